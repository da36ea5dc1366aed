/* Distance of two polytopes: Gilbert, Johnson, Keerthi, "A fast procedure for computing the distance between complex
 * objects in three-dimensional space" (IEEE J. Robotics and Automation, 1988). A simplex of points of a - b walks
 * towards the origin; as there are finitely many points, it ends with the nearest feature itself, not near it. The walk
 * is in gjk_walk.h, as it is the same for pairs that have other points.
 */
#ifndef SADMM_COLLISION_CONVEX_GJK_H
#define SADMM_COLLISION_CONVEX_GJK_H

#include "polytope_pair.h"

enum { GJK_MOVES = 96 };

struct gjk_simplex {
    int count;
    struct difference_point p[4];
    real weight[4]; /* of the point nearest to the origin */
};

enum gjk_end {
    GJK_FAR,   /* farther apart than asked for */
    GJK_APART, /* v is the shortest vector of a - b */
    GJK_MEET   /* or too near to decide: the simplex is a start for what is inside */
};

/* The walk of the distance, and how it has ended. */
struct gjk_walk {
    enum gjk_end end;
    struct gjk_simplex simplex;
    vec3 v;
};

SADMM_INLINE void simplex_keep(struct gjk_simplex *s, int i)
{
    s->p[0] = s->p[i];
    s->weight[0] = 1;
    s->count = 1;
}

/* Points i and j, of which j has this weight. */
SADMM_INLINE void simplex_keep_two(struct gjk_simplex *s, int i, int j, real weight)
{
    const struct difference_point p = s->p[i], q = s->p[j];
    s->p[0] = p;
    s->p[1] = q;
    s->weight[0] = 1 - weight;
    s->weight[1] = weight;
    s->count = 2;
}

SADMM_INLINE vec3 closest_on_segment(struct gjk_simplex *s)
{
    const vec3 a = s->p[0].w, d = v3_sub(s->p[1].w, a);
    const real length2 = v3_norm2(d), along = -v3_dot(a, d);
    if (!(along > 0)) {
        simplex_keep(s, 0);
        return a;
    }
    if (along >= length2) {
        simplex_keep(s, 1);
        return s->p[0].w;
    }
    simplex_keep_two(s, 0, 1, along / length2);
    return v3_madd(a, along / length2, d);
}

/* By the regions of its corners and sides (Ericson, Real-Time Collision Detection, 5.1.5). */
SADMM_INLINE vec3 closest_on_triangle(struct gjk_simplex *s)
{
    const vec3 a = s->p[0].w, b = s->p[1].w, c = s->p[2].w, ab = v3_sub(b, a), ac = v3_sub(c, a);
    const real d1 = -v3_dot(ab, a), d2 = -v3_dot(ac, a), d3 = -v3_dot(ab, b), d4 = -v3_dot(ac, b),
               d5 = -v3_dot(ab, c), d6 = -v3_dot(ac, c), va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6,
               vc = d1 * d4 - d3 * d2;
    vec3 n;
    real n2, t;
    if (d1 <= 0 && d2 <= 0) {
        simplex_keep(s, 0);
        return a;
    }
    if (d3 >= 0 && d4 <= d3) {
        simplex_keep(s, 1);
        return b;
    }
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        t = d1 / (d1 - d3);
        simplex_keep_two(s, 0, 1, t);
        return v3_madd(a, t, ab);
    }
    if (d6 >= 0 && d5 <= d6) {
        simplex_keep(s, 2);
        return c;
    }
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        t = d2 / (d2 - d6);
        simplex_keep_two(s, 0, 2, t);
        return v3_madd(a, t, ac);
    }
    if (va <= 0 && d4 >= d3 && d5 >= d6) {
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        simplex_keep_two(s, 1, 2, t);
        return v3_madd(b, t, v3_sub(c, b));
    }
    n = v3_cross(ab, ac);
    n2 = v3_norm2(n);
    s->count = 3;
    s->weight[1] = vb / (va + vb + vc);
    s->weight[2] = vc / (va + vb + vc);
    s->weight[0] = 1 - s->weight[1] - s->weight[2];
    /* by the normal: what the triangle's size loses of a short distance is not lost of its direction */
    return v3_scale(n, v3_dot(n, v3_add(a, v3_add(b, c))) / (3 * n2));
}

/* A triangle's weights of `foot`, in its plane, whose unit normal is `normal`: by areas, which lose less than products
 * of lengths do. Beside the triangle they go on, unless it is a sliver. */
SADMM_INLINE void simplex_weigh(struct gjk_simplex *s, vec3 foot, vec3 normal)
{
    vec3 x[3];
    real weight[3], area;
    int k;
    for (k = 0; k < 3; ++k) x[k] = v3_sub(s->p[k].w, foot);
    area = v3_dot(normal, v3_cross(v3_sub(x[1], x[0]), v3_sub(x[2], x[0])));
    for (k = 0; k < 3; ++k) {
        weight[k] = v3_dot(normal, v3_cross(x[k < 2 ? k + 1 : 0], x[k > 0 ? k - 1 : 2])) / area;
        if (!(real_abs(weight[k]) <= 16)) {
            weight[0] = weight[1] = weight[2] = (real)1 / 3;
            break;
        }
    }
    for (k = 0; k < 3; ++k) s->weight[k] = weight[k];
}

/* The sides behind which the origin is are asked; false: there are none, it is inside. */
SADMM_INLINE bool closest_on_tetrahedron(struct gjk_simplex *s, vec3 *v)
{
    struct gjk_simplex best;
    real best2 = SADMM_REAL_MAX;
    bool outside = false;
    int k;
    best.count = 0;
    for (k = 0; k < 4; ++k) {
        struct gjk_simplex side;
        vec3 a, n, x;
        real own, other;
        int i, count = 0;
        for (i = 0; i < 4; ++i)
            if (i != k) side.p[count++] = s->p[i];
        side.count = 3;
        a = side.p[0].w;
        n = v3_cross(v3_sub(side.p[1].w, a), v3_sub(side.p[2].w, a));
        own = -v3_dot(n, a);
        other = v3_dot(n, v3_sub(s->p[k].w, a));
        if (own * other > 0) continue;
        outside = true;
        x = closest_on_triangle(&side);
        if (v3_norm2(x) < best2) {
            best2 = v3_norm2(x);
            best = side;
            *v = x;
        }
    }
    if (best.count > 0) *s = best;
    else
        for (k = 0; k < 4; ++k) s->weight[k] = (real)0.25;
    return outside && best.count > 0;
}

#define GJK_DISTANCE SADMM_INLINE enum gjk_end gjk_distance
#define GJK_PAIR struct polytope_pair
#define GJK_SUPPORT pair_support
#define GJK_SAME same_point
#define GJK_ENOUGH(pair, v2, length) ((pair)->slack * (length) / 4)
#include "gjk_walk.h"

/* The nearest points themselves, on the cores. */
SADMM_INLINE void gjk_points(const struct polytope_pair *pair, const struct gjk_simplex *s, vec3 *pa, vec3 *pb)
{
    int k;
    *pa = v3(0, 0, 0);
    *pb = v3(0, 0, 0);
    for (k = 0; k < s->count; ++k) {
        *pa = v3_madd(*pa, s->weight[k], pair_point_a(pair, s->p[k].a));
        *pb = v3_madd(*pb, s->weight[k], polytope_vertex(&pair->b, s->p[k].b));
    }
}

#endif
