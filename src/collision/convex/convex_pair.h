/* Two convex bodies while their manifold is computed, in the frame of b: the points of their Minkowski difference a -
 * b, distance by the walk of gjk.h and a first idea of the depth by the growth of epa.h, over points that are no longer
 * finitely many: both end near what they search for, and convex_axis.h goes on from there. */
#ifndef SADMM_COLLISION_CONVEX_CONVEX_PAIR_H
#define SADMM_COLLISION_CONVEX_CONVEX_PAIR_H

#include "collision/shapes/geometry.h"
#include "convex.h"
#include "epa.h"

struct convex_pair {
    struct convex a, b;
    mat3 R; /* p_b = R p_a + t */
    vec3 t;
    vec3 shift;  /* of b, while it is held away from a */
    vec3 centre[2]; /* of mass, as of pair_pose */
    bool tips[2];
    vec3 spread; /* what points of rims are spread from (convex_clip.h); 0: a side of the other one's flat or line */
    uint32_t left_out; /* of b: bit k: corner k, 16 + k: side k: points there are not wanted (convex_clip.h) */
    real thin;   /* the thinner one's smallest extent */
    real size;   /* of both, and of what is between them: what rounding is measured by */
    real slack;  /* rounding of a separation */
    real enough; /* share of the square of a distance that the walk may miss */
    real equal;  /* separations that differ by less are the same */
};

/* Centres of mass, in a frame whose origin is at `origin` of b's. */
SADMM_INLINE void convex_pair_tips(const struct pair_pose *pose, vec3 origin, struct convex_pair *pair)
{
    int s;
    for (s = 0; s < 2; ++s) {
        pair->tips[s] = pose->tips[s];
        if (pose->tips[s]) pair->centre[s] = v3_sub(r3_vec3(pose->centre[s]), origin);
    }
}

/* What follows from the size. */
SADMM_INLINE void convex_pair_finish(struct convex_pair *pair)
{
    pair->shift = pair->spread = v3(0, 0, 0);
    pair->left_out = 0;
    pair->tips[0] = pair->tips[1] = false;
    pair->slack = 8 * SADMM_EPSILON * pair->size;
    pair->equal = real_max(8 * pair->slack, (real)1e-11 * pair->size);
    pair->enough = sizeof(real) == 4 ? (real)1e-5 : (real)1e-8;
}

SADMM_INLINE void convex_pair_make(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *hulls,
                                   const struct pair_pose *pose, struct convex_pair *pair)
{
    int i;
    convex_of(a, hulls, &pair->a);
    convex_of(b, hulls, &pair->b);
    for (i = 0; i < 3; ++i) pair->R.r[i] = r3_vec3(pose->R[i]);
    pair->t = r3_vec3(pose->t);
    pair->thin = (real)min_of(geometry_thickness(a), geometry_thickness(b));
    pair->size = (real)(geometry_radius(a) + geometry_radius(b)) + v3_norm(pair->t);
    convex_pair_finish(pair);
    convex_pair_tips(pose, v3(0, 0, 0), pair);
}

SADMM_INLINE real convex_radii(const struct convex_pair *pair) { return pair->a.p.radius + pair->b.p.radius; }

/* Points of the two where a's surface points along n, and b's against it. */
SADMM_INLINE vec3 convex_point_a(const struct convex_pair *pair, int piece, vec3 n)
{
    return v3_add(m3_mul(pair->R, convex_point(&pair->a, piece, m3_tmul(pair->R, n))), pair->t);
}
SADMM_INLINE vec3 convex_point_b(const struct convex_pair *pair, int piece, vec3 n)
{
    return convex_point(&pair->b, piece, v3_neg(n));
}

/* Of a - b, farthest along d; a and b of it are pieces. */
SADMM_CALLED struct difference_point convex_support(const struct convex_pair *pair, vec3 d,
                                                    const struct difference_point *at)
{
    struct difference_point point;
    point.a = convex_piece(&pair->a, m3_tmul(pair->R, d), at->a);
    point.b = convex_piece(&pair->b, v3_neg(d), at->b);
    point.w = v3_sub(v3_sub(convex_point_a(pair, point.a, d), convex_point_b(pair, point.b, d)), pair->shift);
    return point;
}

/* How far the two are apart along n (unit). */
SADMM_INLINE real convex_separation(const struct convex_pair *pair, vec3 n)
{
    const struct difference_point zero = {{0, 0, 0}, 0, 0};
    return -v3_dot(n, convex_support(pair, n, &zero).w) - convex_radii(pair);
}

SADMM_INLINE bool convex_same_point(const struct difference_point *p, const struct difference_point *q)
{
    return p->w.x == q->w.x && p->w.y == q->w.y && p->w.z == q->w.z;
}

#define GJK_DISTANCE SADMM_CALLED enum gjk_end convex_distance
#define GJK_PAIR struct convex_pair
#define GJK_SUPPORT convex_support
#define GJK_SAME convex_same_point
#define GJK_ENOUGH(pair, v2, length) real_max((pair)->slack * (length) / 4, (pair)->enough * (v2))
#include "gjk_walk.h"

#define EPA_NAME(name) convex_epa_##name
#define EPA_PAIR struct convex_pair
#define EPA_SUPPORT convex_support
#include "epa_grow.h"

#endif
