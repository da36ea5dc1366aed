/* Two polytopes while their manifold is computed, in the frame of b, and the points of their Minkowski difference
 * a - b: the two meet where it contains the origin. */
#ifndef SADMM_COLLISION_CONVEX_POLYTOPE_PAIR_H
#define SADMM_COLLISION_CONVEX_POLYTOPE_PAIR_H

#include "collision/base/manifold.h"
#include "polytope.h"

struct polytope_pair {
    struct polytope a, b;
    mat3 R; /* p_b = R p_a + t */
    vec3 t;
    real thin;  /* the thinner one's smallest extent */
    real size;  /* of both, and of what is between them: what rounding is measured by */
    real slack; /* rounding of a separation */
};

/* Points of a - b, by the vertices that make them. */
struct difference_point {
    vec3 w;
    int a, b;
};

SADMM_INLINE vec3 pair_point_a(const struct polytope_pair *pair, int v)
{
    return v3_add(m3_mul(pair->R, polytope_vertex(&pair->a, v)), pair->t);
}

/* Farthest along d; `at`: its vertices are where a search begins. */
SADMM_INLINE struct difference_point pair_support(const struct polytope_pair *pair, vec3 d,
                                                  const struct difference_point *at)
{
    struct difference_point point;
    point.a = polytope_support(&pair->a, m3_tmul(pair->R, d), at->a);
    point.b = polytope_support(&pair->b, v3_neg(d), at->b);
    point.w = v3_sub(pair_point_a(pair, point.a), polytope_vertex(&pair->b, point.b));
    return point;
}

SADMM_INLINE bool same_point(const struct difference_point *p, const struct difference_point *q)
{
    return p->a == q->a && p->b == q->b;
}

SADMM_INLINE real pair_radii(const struct polytope_pair *pair) { return pair->a.radius + pair->b.radius; }

#endif
