/* Two convex bodies, without a memory and without what contacts prefer: their distance, or least depth. */
#ifndef SADMM_COLLISION_QUERY_CLOSEST_PAIR_H
#define SADMM_COLLISION_QUERY_CLOSEST_PAIR_H

#include "collision/manifold/manifold_convex.h"
#include "collision/manifold/manifold_hull.h"
#include "separation.h"

/* Points that are off the axis by no more than this share of the size are its nearest ones. */
#define CLOSEST_ON_AXIS 1e-10

/* pa and pb, or b's point moved to where it is due where rounding has left the two off the axis by a little. */
static inline void closest_put(vec3 n, double distance, vec3 pa, vec3 pb, struct sadmm_separation *separation)
{
    const vec3 middle = v3_scale(v3_add(pa, pb), 0.5);
    separation->distance = distance;
    separation->normal = n;
    separation->a = v3_madd(middle, -distance / 2, n);
    separation->b = v3_madd(middle, distance / 2, n);
    separation->triangle = -1;
}

/* Are they off the axis, by more than rounding? */
static inline bool closest_is_off(vec3 n, double distance, vec3 pa, vec3 pb, double size)
{
    return !(v3_norm(v3_madd(v3_sub(pb, pa), -distance, n)) <= CLOSEST_ON_AXIS * size);
}

/* The points of two polytopes that overlap, by the direction along which they are least deep: held apart along it they
 * have them as their nearest ones. False: rounding has let none be found. */
static inline bool closest_held_apart(const struct polytope_pair *pair, vec3 n, double distance, vec3 *pa, vec3 *pb)
{
    struct polytope_pair held = *pair;
    const double way = pair->size - (distance + pair_radii(pair));
    struct gjk_simplex s;
    vec3 v;
    held.t = v3_madd(pair->t, -way, n);
    if (gjk_distance(&held, n, HUGE_VAL, &s, &v) != GJK_APART) return false;
    gjk_points(&held, &s, pa, pb);
    *pa = v3_madd(*pa, way + pair->a.radius, n);
    *pb = v3_madd(*pb, -pair->b.radius, n);
    return !closest_is_off(n, distance, *pa, *pb, pair->size);
}

/* Of two polytopes, of which b has faces. start: a direction from a to b. */
static inline bool closest_of_polytopes(const struct polytope_pair *pair, vec3 start, double limit,
                                        struct sadmm_separation *separation)
{
    struct polytope_axis axis;
    uint32_t feature;
    vec3 pa, pb, a, b;
    if (!hull_nearest(pair, start, limit, &axis, &pa, &pb, &feature)) return false;
    /* cores that are in each other: the face of the expanding polytope may be beside the nearest points */
    if (axis.separation + pair_radii(pair) < HULL_TOUCH * pair->size &&
        closest_held_apart(pair, axis.n, axis.separation, &a, &b)) {
        pa = a;
        pb = b;
    }
    closest_put(axis.n, axis.separation, pa, pb, separation);
    return true;
}

/* The middle of what faces along the axis and is nearest there: the manifold's points are at its rim, and beside it by
 * what contacts tolerate. */
static inline void closest_middle(const struct convex_pair *pair, struct convex_axis *axis)
{
    struct manifold m;
    vec3 sum = v3(0, 0, 0);
    double least = HUGE_VAL;
    int nearest = 0;
    bool witness;
    convex_clip_manifold(pair, axis->n, axis->separation, SADMM_REAL_MAX, &m, &witness);
    for (int k = 0; k < m.count; ++k) least = min_of(m.points[k].separation, least);
    for (int k = 0; k < m.count; ++k) {
        if (m.points[k].separation > least + 1e-9 * pair->size) continue;
        sum = v3_add(sum, m.points[k].position);
        ++nearest;
    }
    if (nearest == 0) return;
    sum = v3_scale(sum, 1 / (double)nearest);
    axis->pa = v3_madd(sum, -least / 2, axis->n);
    axis->pb = v3_madd(sum, least / 2, axis->n);
}

/* Of two bodies of which one at least is smooth. */
static inline bool closest_of_convex(struct convex_pair *pair, vec3 start, double limit,
                                     struct sadmm_separation *separation)
{
    struct convex_axis axis;
    uint32_t cache;
    if (!(v3_norm2(start) > 0)) start = v3(0, 0, 1);
    if (!convex_search(pair, start, false, limit, &axis, &cache)) return false;
    const uint32_t kind = cache & CONVEX_MEMORY_MASK;
    if (kind == CONVEX_MEMORY_DIRECTION
            ? closest_is_off(axis.n, axis.separation, axis.pa, axis.pb, pair->size)
            : !convex_is_on_flat(pair, &axis, kind == CONVEX_MEMORY_FLAT_A, (int)(cache >> MANIFOLD_DIRECTION_SHIFT),
                                 CLOSEST_ON_AXIS * pair->size))
        closest_middle(pair, &axis);
    closest_put(axis.n, axis.separation, axis.pa, axis.pb, separation);
    return true;
}

#endif
