/* Cylinders, cones and ellipsoids (b) against every shape (a), in the frame of b. a may be any convex body.
 *
 *   1. The flat of the last step: where the points of what faces along its normal prove that nothing is nearer, that is
 *      all. What stands on a cap, or lies on a face, asks for nothing else.
 *   2. The direction along which the two are farthest apart, or least deep in each other (convex_axis.h).
 *   3. A flat whose normal is that direction, to within rounding, gives its own: what rolls has its true
 *      normal, and what stands has one that does not shiver.
 *   4. The points of what faces along it (convex_clip.h); the nearest points as well where these do not have them.
 */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_CONVEX_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_CONVEX_H

#include "collision/convex/convex_axis.h"
#include "collision/convex/convex_clip.h"
#include "manifold_hull.h"

/* Along a flat's normal: the points of what faces along it, or the one of what has one alone there. False: it is not
 * a witness that no direction beside it is better, or the two are so deep in each other that another side may be. */
SADMM_INLINE bool convex_on_flat(const struct convex_pair *pair, const struct convex_axis *axis, bool of_a, int flat,
                                 real limit, struct manifold *m)
{
    bool witness;
    if (axis->separation + convex_radii(pair) < -CONVEX_SHALLOW * pair->thin) return false;
    convex_clip_manifold(pair, axis->n, axis->separation, limit, m, &witness);
    if (witness || !convex_is_on_flat(pair, axis, of_a, flat, 0)) return witness;
    hull_add_nearest(pair->thin, axis->pa, axis->pb, polytope_feature(FEATURE_NEAREST, 0, 0), m);
    return true;
}

/* What a pair remembers. */
struct convex_memory {
    bool known;      /* anything */
    bool is_flat;    /* a flat: `axis` */
    bool of_a;
    int flat;
    vec3 side;       /* the direction; else one to begin with */
    struct convex_axis axis;
};

SADMM_INLINE void convex_recall(const struct convex_pair *pair, uint32_t cache, struct convex_memory *memory)
{
    const uint32_t kind = cache & CONVEX_MEMORY_MASK, flat = cache >> MANIFOLD_DIRECTION_SHIFT;
    memory->known = memory->is_flat = false;
    memory->of_a = kind == CONVEX_MEMORY_FLAT_A;
    memory->flat = 0;
    memory->side = v3_neg(pair->t);
    if (!(v3_norm2(memory->side) > 0)) memory->side = v3(0, 0, 1);
    if (kind == CONVEX_MEMORY_DIRECTION) {
        const vec3 n = manifold_cached_direction(cache);
        if (!(v3_norm2(n) > (real)0.5)) return;
        memory->side = n;
        memory->known = true;
        return;
    }
    if (kind != CONVEX_MEMORY_FLAT_A && kind != CONVEX_MEMORY_FLAT_B) return;
    if (!convex_has_flat(memory->of_a ? &pair->a : &pair->b, flat)) return;
    memory->known = memory->is_flat = true;
    memory->flat = (int)flat;
    convex_flat_axis(pair, memory->of_a, memory->flat, &memory->axis);
    memory->side = memory->axis.n;
}

/* 1. False: the whole of it has to be done. */
SADMM_INLINE bool convex_by_memory(const struct convex_pair *pair, real limit, uint32_t cache,
                                   struct convex_memory *memory, struct manifold *m)
{
    const struct convex_axis *axis = &memory->axis;
    convex_recall(pair, cache, memory);
    if (!memory->is_flat) return false;
    if (axis->separation > limit + pair->slack) return true;
    if (convex_on_flat(pair, axis, memory->of_a, memory->flat, limit, m)) {
        m->cache = cache;
        return true;
    }
    m->count = 0;
    return false;
}

/* 2 and 3. side, known: convex_recall. False: farther apart than the limit. *cache: what is to be remembered of it. */
SADMM_INLINE bool convex_search(struct convex_pair *pair, vec3 side, bool known, real limit, struct convex_axis *axis,
                                uint32_t *cache)
{
    struct convex_axis flat;
    struct convex_active active;
    if (!convex_find(pair, side, known, limit, axis, &active)) return false;
    *cache = convex_flat_beside(pair, axis->n, &flat);
    if (*cache && flat.separation >= axis->separation - 2 * pair->slack) {
        *axis = flat;
    } else {
        convex_nearest(pair, &active, axis);
        *cache = CONVEX_MEMORY_DIRECTION | manifold_direction_bits(axis->n);
    }
    return axis->separation <= limit + pair->slack;
}

/* 4. What faces along the axis, with the nearest points. */
SADMM_INLINE void convex_points(const struct convex_pair *pair, const struct convex_axis *axis, real limit,
                                struct manifold *m)
{
    bool witness;
    convex_clip_manifold(pair, axis->n, axis->separation, limit, m, &witness);
    hull_add_nearest(pair->thin, axis->pa, axis->pb, polytope_feature(FEATURE_NEAREST, 0, 0), m);
}

SADMM_RARE void convex_manifold(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *hulls,
                                const struct pair_pose *pose, real limit, uint32_t cache, struct manifold *m)
{
    struct convex_pair pair;
    struct convex_memory memory;
    struct convex_axis axis;
    uint32_t found;
    convex_pair_make(a, b, hulls, pose, &pair);
    if (convex_by_memory(&pair, limit, cache, &memory, m)) return;
    if (!convex_search(&pair, memory.side, memory.known, limit, &axis, &found)) {
        m->count = 0;
        return;
    }
    convex_points(&pair, &axis, limit, m);
    m->cache = found;
}

/* ---- planes ------------------------------------------------------------------------------------------------------ */

/* x: a point of b's surface. */
SADMM_INLINE void convex_plane_point(struct manifold *m, vec3 x, real offset, real limit, uint32_t feature)
{
    const real s = v3_dot(m->normal, x) + offset;
    if (s <= limit) manifold_add(m, v3_madd(x, -s / 2, m->normal), s, feature);
}

/* a: the plane (manifold_plane.h). The lowest point of every piece; of a cap within 8 degrees of the plane the points
 * of its rim, which go by the plane's x axis, and the lowest one where it is between them. */
SADMM_RARE void convex_plane_manifold(const struct sadmm_geometry *b, const double *hulls, const struct pair_pose *pose,
                                      real limit, struct manifold *m)
{
    enum { RIM_FEATURE = 8 };
    struct convex c;
    vec3 down;
    const real offset = plane_offset(pose, &m->normal);
    int flat, k;
    convex_of(b, hulls, &c);
    down = v3_neg(m->normal);
    if (c.form == CONVEX_ELLIPSOID) {
        convex_plane_point(m, convex_point(&c, 0, down), offset, limit, 1);
        return;
    }
    flat = convex_flat(&c, down, MANIFOLD_COS_NEAR);
    if (flat < 0) {
        for (k = 0; k < 2; ++k) convex_plane_point(m, convex_point(&c, k, down), offset, limit, (uint32_t)k + 1);
    } else {
        struct convex_feature disc;
        const vec3 x = convex_point(&c, flat, down);
        const real s = v3_dot(m->normal, x) + offset;
        const vec3 centre[2] = {v3(0, 0, 0), pose->tips[1] ? r3_vec3(pose->centre[1]) : v3(0, 0, 0)};
        vec3 e1, e2, way = v3(0, 0, 0);
        disc.normal = convex_flat_normal(&c, flat);
        disc.centre = v3_scale(disc.normal, c.size.y);
        disc.radius = c.size.x;
        if (pose->tips[1]) way = convex_tipping(&disc, centre, pose->tips);
        if (!(v3_norm2(way) > 0)) way = v3(r3_vec3(pose->R[0]).x, r3_vec3(pose->R[1]).x, r3_vec3(pose->R[2]).x);
        convex_rim_axes(&disc, way, &e1, &e2);
        for (k = 0; k < CONVEX_RIM; ++k)
            convex_plane_point(m, convex_rim(&disc, e1, e2, k), offset, limit, RIM_FEATURE + (uint32_t)k);
        if (s <= limit)
            hull_add_nearest((real)geometry_thickness(b), v3_madd(x, -s, m->normal), x, (uint32_t)flat + 1, m);
    }
}

#endif
