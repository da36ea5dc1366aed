/* How far shapes reach: extents, boxes around them, and the distance within which a pair makes contacts. In double on
 * every backend, so that all of them see the same pairs.
 *
 * A pair makes contacts up to   margin x thinner extent + what the two may close within the step.
 * The box of a shape covers its own part of that: half the margin, its sweep along its velocity, and the reach of its
 * rotation and of the external acceleration in every direction. Shapes are a pair when their boxes overlap, and overlap
 * still when the one is swept along the velocity it has relative to the other.
 */
#ifndef SADMM_COLLISION_BOUNDS_H
#define SADMM_COLLISION_BOUNDS_H

#include "core/math/real.h"
#include "subadmm/world.h"

struct sadmm_box3 { double lo[3], hi[3]; };

/* Smallest extent, m; a plane has none that limits. */
SADMM_INLINE double shape_thickness(int type, const double size[3])
{
    switch (type) {
    case SADMM_SHAPE_SPHERE:
    case SADMM_SHAPE_CAPSULE: return 2 * size[0];
    case SADMM_SHAPE_BOX: return 2 * fmin(size[0], fmin(size[1], size[2]));
    default: return HUGE_VAL;
    }
}

/* Radius of the ball around the shape's centre that holds it, m; 0 for a plane (planes do not move). */
SADMM_INLINE double shape_radius(int type, const double size[3])
{
    switch (type) {
    case SADMM_SHAPE_SPHERE: return size[0];
    case SADMM_SHAPE_CAPSULE: return size[0] + size[1];
    case SADMM_SHAPE_BOX: return sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2]);
    default: return 0;
    }
}

/* Half extents along the world axes, m. R: shape to world. Not for planes. */
SADMM_INLINE void shape_world_extent(int type, const double size[3], const double R[9], double extent[3])
{
    int k;
    for (k = 0; k < 3; ++k) {
        if (type == SADMM_SHAPE_BOX)
            extent[k] = fabs(R[3 * k]) * size[0] + fabs(R[3 * k + 1]) * size[1] + fabs(R[3 * k + 2]) * size[2];
        else if (type == SADMM_SHAPE_CAPSULE) extent[k] = size[0] + fabs(R[3 * k + 2]) * size[1];
        else extent[k] = size[0];
    }
}

/* The part of a motion that goes down, and up. Not by fmin and fmax, which are calls where instructions see NaN in another way. */
SADMM_INLINE double downward(double way) { return way < 0 ? way : 0; }
SADMM_INLINE double upward(double way) { return way > 0 ? way : 0; }

/* Farthest that rotation moves a point within the step, m. reach: of the shape from the body's centre of mass. */
SADMM_INLINE double rotation_sweep(const double angular[3], double reach, double dt)
{
    double turn = sqrt(angular[0] * angular[0] + angular[1] * angular[1] + angular[2] * angular[2]) * dt;
    return (turn < 2 ? turn : 2) * reach;
}

/* Distance up to which a pair makes contacts, m. spin: rotation_sweep; fall: acceleration x dt^2, 0 for static ones. */
SADMM_INLINE double pair_limit(double margin, double thin_a, double thin_b, const double va[3], const double vb[3],
                               double spin_a, double spin_b, double fall, double dt)
{
    double x = vb[0] - va[0], y = vb[1] - va[1], z = vb[2] - va[2];
    return margin * (thin_a < thin_b ? thin_a : thin_b) + sqrt(x * x + y * y + z * z) * dt + spin_a + spin_b + fall;
}

/* Box around a shape for the step: see the top. */
SADMM_INLINE void shape_box(const double centre[3], const double extent[3], double margin_thickness,
                            const double velocity[3], double spin, double fall, double dt, struct sadmm_box3 *box)
{
    int k;
    for (k = 0; k < 3; ++k) {
        double e = extent[k] + 0.5 * margin_thickness + spin + fall, sweep = velocity[k] * dt;
        /* rounding favours contact */
        e += 8 * DBL_EPSILON * (fabs(centre[k]) + e);
        box->lo[k] = centre[k] - e + downward(sweep);
        box->hi[k] = centre[k] + e + upward(sweep);
    }
}

/* Along one axis: do a, at rest, and b, in motion relative to it, come together? Own sweeps are taken off the boxes first. */
SADMM_INLINE int intervals_meet(double lo_a, double hi_a, double lo_b, double hi_b, double sweep_a, double sweep_b)
{
    double relative = sweep_b - sweep_a;
    return lo_a - downward(sweep_a) <= hi_b - upward(sweep_b) + upward(relative) &&
           lo_b - downward(sweep_b) + downward(relative) <= hi_a - upward(sweep_a);
}

/* Do two shapes whose boxes overlap come together within the step? Two that move alike sweep over the same places and
 * never do: without this, the pairs to look at would grow with the speed of a heap that moves as one. */
SADMM_INLINE int boxes_meet(const struct sadmm_box3 *a, const double va[3], const struct sadmm_box3 *b, const double vb[3],
                            double dt)
{
    return intervals_meet(a->lo[0], a->hi[0], b->lo[0], b->hi[0], va[0] * dt, vb[0] * dt) &&
           intervals_meet(a->lo[1], a->hi[1], b->lo[1], b->hi[1], va[1] * dt, vb[1] * dt) &&
           intervals_meet(a->lo[2], a->hi[2], b->lo[2], b->hi[2], va[2] * dt, vb[2] * dt);
}

SADMM_INLINE int boxes_overlap(const struct sadmm_box3 *a, const struct sadmm_box3 *b)
{
    return a->lo[0] <= b->hi[0] && b->lo[0] <= a->hi[0] && a->lo[1] <= b->hi[1] && b->lo[1] <= a->hi[1] &&
           a->lo[2] <= b->hi[2] && b->lo[2] <= a->hi[2];
}

#endif
