/* How far shapes reach: boxes around them, and the distance within which a pair makes contacts. In double on
 * every backend, so that all of them see the same pairs.
 *
 * A pair makes contacts up to   max(margin x thinner extent, fall) + what the velocities may close within the step. The
 * fall is what external accelerations add to that: velocities come first (semi-implicit Euler), so that a body moves by
 * the whole of a dt^2 in the step in which it lets go. Gravity counts once, as one body of a pair may be held while the
 * other falls; the forces and torques on the two bodies count both. Joints will add theirs. The box of a shape covers
 * its own part: half the margin, or half the fall by gravity and its own part of the rest, whichever is more; its sweep
 * along its velocity; and the reach of its rotation. Two such parts are never less than what the pair asks for. Shapes
 * are a pair when their boxes overlap, and overlap still when the one is swept along the velocity it has relative to
 * the other.
 */
#ifndef SADMM_COLLISION_BASE_BOUNDS_H
#define SADMM_COLLISION_BASE_BOUNDS_H

#include "core/math/real.h"

struct sadmm_box3 { double lo[3], hi[3]; };

/* The part of a motion that goes down, and up. Not by fmin and fmax, which are calls where instructions see NaN in
 * another way. */
SADMM_INLINE double downward(double way) { return way < 0 ? way : 0; }
SADMM_INLINE double upward(double way) { return way > 0 ? way : 0; }

/* rad/s. */
SADMM_INLINE double turning_rate(const double angular[3])
{
    return sqrt(angular[0] * angular[0] + angular[1] * angular[1] + angular[2] * angular[2]);
}

/* Farthest that rotation moves a point within the step, m. rate: turning_rate; reach: of the shape from the body's
 * centre of mass. */
SADMM_INLINE double rotation_sweep(double rate, double reach, double dt)
{
    double turn = rate * dt;
    return (turn < 2 ? turn : 2) * reach;
}

/* Size of gravity, m/s^2. */
SADMM_INLINE double gravity_size(const double gravity[3])
{
    return sqrt(gravity[0] * gravity[0] + gravity[1] * gravity[1] + gravity[2] * gravity[2]);
}

/* Farthest that an acceleration moves what was at rest, or held, within the step, m. */
SADMM_INLINE double fall_of(double acceleration, double dt) { return acceleration * dt * dt; }

/* Farthest that the force and the torque on its body move a point of a shape, beyond its velocity, m. acceleration:
 * m/s^2, rad/s^2; reach as above. */
SADMM_INLINE double own_fall(const double acceleration[2], double reach, double dt)
{
    double turn = fall_of(acceleration[1], dt);
    return fall_of(acceleration[0], dt) + (turn < 2 ? turn : 2) * reach;
}

/* Of two velocities, m/s. */
SADMM_INLINE double relative_speed(const double va[3], const double vb[3])
{
    double x = vb[0] - va[0], y = vb[1] - va[1], z = vb[2] - va[2];
    return sqrt(x * x + y * y + z * z);
}

/* Distance up to which a pair makes contacts, m. speed: relative_speed; spin: rotation_sweep; fall: own_fall; gravity:
 * fall_of it. */
SADMM_INLINE double pair_limit(double margin, double thin_a, double thin_b, double speed, double spin_a, double spin_b,
                               double fall_a, double fall_b, double gravity, double dt)
{
    double least = margin * (thin_a < thin_b ? thin_a : thin_b), fall = gravity + fall_a + fall_b;
    return (least > fall ? least : fall) + speed * dt + spin_a + spin_b;
}

/* A shape's part of max(margin x thinner extent, fall), m. */
SADMM_INLINE double shape_reach(double margin, double thin, double fall, double gravity)
{
    double least = 0.5 * (margin * thin), most = 0.5 * gravity + fall;
    return least > most ? least : most;
}

/* Box around a shape for the step: see the top. */
SADMM_INLINE void shape_box(const double centre[3], const double extent[3], double reach, const double velocity[3],
                            double spin, double dt, struct sadmm_box3 *box)
{
    int k;
    for (k = 0; k < 3; ++k) {
        double e = extent[k] + reach + spin, sweep = velocity[k] * dt;
        /* rounding favours contact */
        e += 8 * DBL_EPSILON * (fabs(centre[k]) + e);
        box->lo[k] = centre[k] - e + downward(sweep);
        box->hi[k] = centre[k] + e + upward(sweep);
    }
}

/* Along one axis: do a, at rest, and b, in motion relative to it, come together? Own sweeps are taken off the boxes
 * first. */
SADMM_INLINE int intervals_meet(double lo_a, double hi_a, double lo_b, double hi_b, double sweep_a, double sweep_b)
{
    double relative = sweep_b - sweep_a;
    return lo_a - downward(sweep_a) <= hi_b - upward(sweep_b) + upward(relative) &&
           lo_b - downward(sweep_b) + downward(relative) <= hi_a - upward(sweep_a);
}

/* Do two shapes whose boxes overlap come together within the step? Two that move alike sweep over the same places and
 * never do: without this, the pairs to test would grow with the speed of a heap that moves as one. */
SADMM_INLINE int boxes_meet(const struct sadmm_box3 *a, const double va[3], const struct sadmm_box3 *b,
                            const double vb[3], double dt)
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
