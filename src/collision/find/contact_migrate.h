/* Contacts that roll (core/model/rolling.h): where their points and normals get to by the end of the step, and how the
 * two surfaces are curved.
 *
 * A point that was in the last step's manifold was found halfway through that step as it is now through this one. What
 * its arms and normal have changed by in between goes on at the same rate for the half step that is left, for shapes of
 * any kind: what matters is that a feature keeps its name.
 */
#ifndef SADMM_COLLISION_FIND_CONTACT_MIGRATE_H
#define SADMM_COLLISION_FIND_CONTACT_MIGRATE_H

#include "collision/base/manifold.h"
#include "collision/shapes/geometry.h"
#include "contact_match.h"
#include "core/math/rolling.h"

/* ---- curvature --------------------------------------------------------------------------------------------------- */

/* The larger radius of curvature where the surface has the outward normal n, at p (both in the shape's frame);
 * HUGE_VAL: flat, or made of what is flat. */
SADMM_INLINE double geometry_curvature_radius(const struct sadmm_geometry *g, const double n[3], const double p[3])
{
    const double *size = g->size, across = sqrt(n[0] * n[0] + n[1] * n[1]);
    switch ((sadmm_shape_type)g->type) {
    case SADMM_SHAPE_SPHERE:
    case SADMM_SHAPE_CAPSULE: return size[0];
    case SADMM_SHAPE_CYLINDER: /* of revolution: as far along the normal as to the axis. Caps are flat. */
    case SADMM_SHAPE_CONE: return across > 1e-6 ? sqrt(p[0] * p[0] + p[1] * p[1]) / across : HUGE_VAL;
    case SADMM_SHAPE_ELLIPSOID: { /* Hessian of the support function h = |D n|: trace and product of its radii */
        double d2[3], h2 = 0, h, fourth = 0, trace, product, most;
        int k;
        for (k = 0; k < 3; ++k) {
            d2[k] = size[k] * size[k];
            h2 += d2[k] * n[k] * n[k];
            fourth += d2[k] * d2[k] * n[k] * n[k];
        }
        h = sqrt(h2);
        trace = (d2[0] + d2[1] + d2[2] - fourth / h2) / h;
        product = d2[0] * d2[1] * d2[2] / (h2 * h2);
        most = trace * trace / 4 - product;
        return trace / 2 + (most > 0 ? sqrt(most) : 0);
    }
    case SADMM_SHAPE_BOX:
    case SADMM_SHAPE_HULL:
    case SADMM_SHAPE_MESH:
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    return HUGE_VAL;
}

/* Is there anything to roll on a radius of its own? */
SADMM_INLINE bool geometry_is_curved(const struct sadmm_geometry *g)
{
    return g->type == SADMM_SHAPE_SPHERE || g->type == SADMM_SHAPE_CAPSULE || geometry_is_smooth(g);
}

/* Of a shape; normal: outward, arm: of the point from the body's centre of mass, both in the world. */
SADMM_INLINE double proxy_curvature_radius(const struct sadmm_proxy *p, const double normal[3], double sign,
                                           const double arm[3])
{
    double n[3], at[3];
    int k, i;
    for (k = 0; k < 3; ++k) {
        n[k] = at[k] = 0;
        for (i = 0; i < 3; ++i) {
            n[k] += sign * p->R[3 * i + k] * normal[i];
            at[k] += p->R[3 * i + k] * (arm[i] - p->arm[i]);
        }
    }
    return geometry_curvature_radius(&p->geometry, n, at);
}

/* What touches along more than a line does not roll. */
enum { ROLLING_POINTS = 2 };

/* May the contact of these have a radius? */
SADMM_INLINE bool contact_is_curved(const struct sadmm_proxy *a, const struct sadmm_proxy *b, int32_t count)
{
    return count <= ROLLING_POINTS && (geometry_is_curved(&a->geometry) || geometry_is_curved(&b->geometry));
}

/* Of the two surfaces relative to each other; 0: neither is curved, they touch along more than a line, or no body has
 * its centre of mass so low that it rocks (rolling.h). normal: from a to b. */
#define CURVATURE_ROUNDING 1e-6
SADMM_INLINE double contact_radius(const struct sadmm_proxy *a, const struct sadmm_proxy *b, int32_t count,
                                   const double normal[3], const struct sadmm_contact_point *point)
{
    double ra, rb;
    if (!contact_is_curved(a, b, count)) return 0;
    ra = geometry_is_curved(&a->geometry) ? proxy_curvature_radius(a, normal, 1, point->arm_a) : HUGE_VAL;
    rb = geometry_is_curved(&b->geometry) ? proxy_curvature_radius(b, normal, -1, point->arm_b) : HUGE_VAL;
    const double radius = ra < HUGE_VAL && rb < HUGE_VAL ? (ra + rb > 0 ? ra * rb / (ra + rb) : 0) : min_of(ra, rb);
    const double least = radius / (1 + CURVATURE_ROUNDING);
    const bool rocks = (a->system_body >= 0 && least > rolling_height(normal, point->arm_a, point->separation)) ||
                       (b->system_body >= 0 && least > rolling_height(normal, point->arm_b, point->separation));
    return radius < HUGE_VAL && rocks ? radius : 0;
}

/* ---- migration --------------------------------------------------------------------------------------------------- */

/* Shapes that overlap by more than this share of the thinner one touch at no point that goes anywhere. */
#define ROLLING_DEPTH 0.05

/* Did both bodies move by means? */
SADMM_INLINE bool contact_by_means(const struct sadmm_proxy *a, const struct sadmm_proxy *b)
{
    return (a->mean != 0) & (b->mean != 0);
}

/* And is the manifold of the same kind as before? */
SADMM_INLINE bool contact_kind_rolls(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                     const struct sadmm_contact_pair *before, int32_t count)
{
    return contact_by_means(a, b) & (before->count == count) & (count <= ROLLING_POINTS);
}

/* Did the pair press in the last step, by as many points? What hits in this step hits as it is found. points: of the
 * set that `before` is of. */
SADMM_INLINE bool contact_lasts(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                const struct sadmm_contact_pair *before, const struct sadmm_contact_point *points,
                                int32_t count)
{
    const double deep = ROLLING_DEPTH * min_of(a->thin, b->thin);
    bool presses = false;
    int32_t k;
    if (before->count != count || count > ROLLING_POINTS) return false;
    for (k = before->first; k < before->first + count; ++k) {
        if (points[k].separation < -deep) return false;
        presses = presses || sadmm_normal_impulse(before, &points[k]) > 0;
    }
    return presses;
}

/* Do its points go on as they went since the last step? They did then, too. */
SADMM_INLINE bool contact_rolls(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                const struct sadmm_contact_pair *before, const struct sadmm_contact_point *points,
                                int32_t count)
{
    return contact_by_means(a, b) && contact_lasts(a, b, before, points, count);
}

/* The old pair that a round body goes on from where it rolls over a mesh: of the triangle itself, or of another one of
 * the same plane. [first, last): the old pairs of the two shapes. NULL: none. */
SADMM_INLINE const struct sadmm_contact_pair *contact_rolls_from(
    const struct sadmm_proxy *a, const struct sadmm_proxy *b, const struct sadmm_contact_pair *before,
    const struct sadmm_contact_pair *pairs, int64_t first, int64_t last, const struct sadmm_contact_point *points,
    int32_t count, const double normal[3])
{
    const uint32_t revision = word_of_pair(a->revision, b->revision);
    int64_t i;
    if ((before && contact_lasts(a, b, before, points, count)) || !contact_is_curved(a, b, count)) return before;
    for (i = first; i < last; ++i)
        if (contact_is_beside(&pairs[i], revision, normal) && contact_lasts(a, b, &pairs[i], points, count))
            return &pairs[i];
    return before;
}

/* May any point of it have a migration? before: NULL, none. */
SADMM_INLINE bool contact_may_migrate(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                      const struct sadmm_contact_pair *before, const struct sadmm_contact_point *points,
                                      int32_t count)
{
    return contact_is_curved(a, b, count) || (before && contact_rolls(a, b, before, points, count));
}

/* What of the way since the last step's middle is left to this step's end. ratio: step_ratio. */
SADMM_INLINE double migration_share(double ratio) { return ratio / (1 + ratio); }

/* Changes of more than this share of an arm (and of a normal, rad) are those of another place. */
#define MIGRATION_MOST MIDPOINT_TURN

/* By what the normal changes in the half step that is left; normal: halfway. old_points: the first of the old
 * pair's. */
SADMM_INLINE void migrate_normal(const double old_normal[3], const struct sadmm_contact_migration *old, double share,
                                 const double normal[3], double change[3])
{
    double size = 0;
    int k;
    for (k = 0; k < 3; ++k) {
        change[k] = share * (normal[k] - old_normal[k] + (old ? old->normal[k] : 0));
        size += change[k] * change[k];
    }
    for (k = 0; k < 3; ++k) change[k] = size <= MIGRATION_MOST * MIGRATION_MOST ? change[k] : 0;
}

/* A set of contacts, as migrations are looked up in it. */
struct migration_set {
    const struct sadmm_contact_point *points;
    const struct sadmm_contact_migration *migrations;
};

/* What the points of a pair have in common. before: the pair that it goes on from, NULL: none. */
struct migration_pair {
    const struct sadmm_contact_pair *before; /* NULL: nothing rolls */
    bool round;                              /* contact_is_curved */
    bool soon;                               /* it is, and pressed, but nothing rolls */
    bool across;                             /* before: of another triangle */
    double share, normal[3];                 /* of the step's end */
    double change[3];                        /* of the normal */
};

/* A contact whose normal turns by less than this in a step, rad, is closed by trapezoid corrections by less than they
 * may (math/trapezoid.h). */
#define MIGRATION_LEAST 1e-3

/* normal: halfway. ratio: step_ratio. */
SADMM_INLINE void migration_begin(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                  const struct sadmm_contact_pair *before, struct migration_set old, double dt,
                                  double ratio, int32_t count, const double normal[3], struct migration_pair *pair)
{
    int k;
    pair->before = before && contact_rolls(a, b, before, old.points, count) ? before : 0;
    pair->round = contact_is_curved(a, b, count);
    pair->soon = !pair->before && before && pair->round &&
                 dt * (size3(a->angular) + size3(b->angular)) > MIGRATION_LEAST &&
                 contact_lasts(a, b, before, old.points, count);
    pair->share = migration_share(ratio);
    pair->across = false;
    for (k = 0; k < 3; ++k) {
        pair->change[k] = 0;
        pair->normal[k] = normal[k];
    }
    if (!pair->before) return;
    migrate_normal(before->normal, sadmm_migration_of(old.points, old.migrations, before->first), pair->share, normal,
                   pair->change);
    for (k = 0; k < 3; ++k) pair->normal[k] += pair->change[k];
    const double length = length3(pair->normal);
    for (k = 0; k < 3; ++k) {
        pair->normal[k] /= length;
        pair->change[k] = pair->normal[k] - normal[k];
    }
}

/* What two dynamic bodies' arms grow apart by, where edges or corners touch: the same for all points of a pair. */
SADMM_INLINE void migrate_apart(const struct migration_pair *pair, struct migration_set old,
                                const struct sadmm_contact_point *point, double apart[3])
{
    const struct sadmm_contact_point *head = &old.points[pair->before->first];
    const struct sadmm_contact_migration *own = sadmm_migration_of(old.points, old.migrations, pair->before->first);
    int k;
    for (k = 0; k < 3; ++k) {
        const double now = point->arm_b[k] - point->arm_a[k], then = head->arm_b[k] - head->arm_a[k];
        apart[k] = pair->share * (now - then + (own ? own->arm_b[k] - own->arm_a[k] : 0));
    }
}

/* Two dynamic bodies that roll on each other move by means, so that it is halfway through the step that an impulse
 * acts: the arms are those to where they touch there, not those that were moved to one point in space of the start
 * (contact_emit.h). They are referred to the start of the step, and the separation with them; their time offset is dt /
 * 2. */
SADMM_INLINE void migrate_from_halfway(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double dt,
                                       const double normal[3], struct sadmm_contact_point *point)
{
    double across_a[3] = {0, 0, 0}, across_b[3] = {0, 0, 0};
    int k;
    add_cross(normal, a->angular, 1, across_a);
    add_cross(normal, b->angular, 1, across_b);
    for (k = 0; k < 3; ++k) {
        const double way = offset_displacement(a, b, dt / 2, k), shift_a = proxy_share(a, b) * way,
                     shift_b = proxy_share(b, a) * way;
        point->arm_a[k] += shift_a;
        point->arm_b[k] -= shift_b;
        point->separation += dt * (across_a[k] * shift_a + across_b[k] * shift_b);
    }
}

/* What an arm changes by; old: of the same feature, as that step ended, own: its migration on this side. */
SADMM_INLINE bool migrate_arm(double share, const double arm[3], const double old[3], const double *own,
                              double change[3])
{
    int k;
    for (k = 0; k < 3; ++k) change[k] = share * (arm[k] - old[k] + (own ? own[k] : 0));
    return dot3(change, change) <= MIGRATION_MOST * MIGRATION_MOST * dot3(arm, arm);
}

/* The point goes on to the step's end; false: it has no migration worth keeping. hint: its index in the pair; normal:
 * halfway. */
SADMM_INLINE bool migrate_point(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                const struct migration_pair *pair, struct migration_set old, int32_t hint,
                                double radius, double dt, const double normal[3], struct sadmm_contact_point *point,
                                struct sadmm_contact_migration *out)
{
    const bool both = a->system_body >= 0 && b->system_body >= 0;
    int32_t at = -1;
    int k;
    out->radius = radius;
    for (k = 0; k < 3; ++k) {
        out->normal[k] = pair->change[k];
        out->arm_a[k] = out->arm_b[k] = 0;
    }
    if (!pair->before && !pair->soon && !(radius > 0)) return false;
    point->migrates = pair->soon ? MIGRATES_SOON : pair->before && pair->round ? MIGRATES_ON : MIGRATES_NOWHERE;
    if (!pair->before) return true;
    if (both && pair->round) migrate_from_halfway(a, b, dt, normal, point);
    if (!pair->across || contact_is_of_body(point->feature))
        at = contact_find_feature(old.points + pair->before->first, pair->before->count, point->feature, hint);
    if (at >= 0) {
        const struct sadmm_contact_point *from = &old.points[pair->before->first + at];
        const struct sadmm_contact_migration *own =
            sadmm_migration_of(old.points, old.migrations, pair->before->first + at);
        const bool small_a = migrate_arm(pair->share, point->arm_a, from->arm_a, own ? own->arm_a : 0, out->arm_a),
                   small_b = migrate_arm(pair->share, point->arm_b, from->arm_b, own ? own->arm_b : 0, out->arm_b);
        if (!(small_a && small_b))
            for (k = 0; k < 3; ++k) out->arm_a[k] = out->arm_b[k] = 0;
    }
    if (both && !pair->round) {
        double apart[3];
        migrate_apart(pair, old, point, apart);
        for (k = 0; k < 3; ++k) out->arm_a[k] = out->arm_b[k] - apart[k];
    }
    for (k = 0; k < 3; ++k) {
        point->arm_a[k] += out->arm_a[k];
        point->arm_b[k] += out->arm_b[k];
    }
    return true;
}

#endif
