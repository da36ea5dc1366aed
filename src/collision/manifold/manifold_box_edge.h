/* Edge axis: closest points of the two supporting edges, or the ends of the stretch they have in common when they are
 * nearly parallel. And boxes that are apart and meet by their corners. */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_EDGE_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_EDGE_H

#include "manifold_box_pair.h"

/* Supporting edge along axis i of a box with half extents h towards direction n (own frame); `lean`: where the other
 * box is, for coordinates along which n does not decide: both edges lie equally far out, but for `even`. Returns the
 * edge's id. */
SADMM_INLINE int box_support_edge(const real h[3], int i, const real n[3], const real lean[3], real even,
                                  real centre[3])
{
    int u = i == 2 ? 0 : i + 1, v = u == 2 ? 0 : u + 1, bu, bv;
    bu = (h[u] * real_abs(n[u]) > even ? n[u] : lean[u]) >= 0;
    bv = (h[v] * real_abs(n[v]) > even ? n[v] : lean[v]) >= 0;
    centre[i] = 0;
    centre[u] = bu ? h[u] : -h[u];
    centre[v] = bv ? h[v] : -h[v];
    return box_edge_id(i, bu, bv);
}

/* Vertex at the upper or lower end of the edge along i through centre. */
SADMM_INLINE int box_edge_end(const real centre[3], int i, int upper)
{
    int u = i == 2 ? 0 : i + 1, v = u == 2 ? 0 : u + 1;
    return (upper ? 1 << i : 0) | (centre[u] > 0 ? 1 << u : 0) | (centre[v] > 0 ? 1 << v : 0);
}

/* The smallest s at which the line x - s out is in the box of half extents h, a large number where it passes the box
 * by. All in the box's frame; `out` points out of the box, across the edge along i, near which x is: that edge goes on
 * at its ends. */
SADMM_INLINE real box_depth_along(const real x[3], const real out[3], const real h[3], int i)
{
    real first = -SADMM_REAL_MAX, last = SADMM_REAL_MAX;
    int k;
    for (k = 0; k < 3; ++k) {
        real near, inverse;
        if (k == i) continue;
        if (real_abs(out[k]) < SADMM_EPSILON) {
            if (real_abs(x[k]) > h[k]) return SADMM_REAL_MAX;
            continue;
        }
        inverse = 1 / out[k];
        near = out[k] > 0 ? h[k] : -h[k];
        first = real_max(first, (x[k] - near) * inverse);
        last = real_min(last, (x[k] + near) * inverse);
    }
    return first <= last ? first : SADMM_REAL_MAX;
}

/* Edge-edge manifold for axis code `axis`; returns false when the edges do not cross (closest points at an end). */
SADMM_HOST_CALL bool box_edge_manifold(const struct box_pair *b, int axis, int negative, struct manifold *m)
{
    int i = (axis - 6) / 3, j = (axis - 6) % 3, e1, e2, k, end;
    vec3 n = box_axis_direction(b, axis, negative), p, q, w, axis1 = v3_axis(i, 1), p1, p2;
    real n1[3], n2[3], lean1[3], lean2[3], c1[3], c2[3], s, t, separation;
    bool crossing;
    vec3 l = box_edge_axis(b, i, j);

    m->count = 0;
    m->normal = n;
    v3_to_array(n, n1);
    for (k = 0; k < 3; ++k) {
        n2[k] = -(n1[0] * b->R[0][k] + n1[1] * b->R[1][k] + n1[2] * b->R[2][k]);
        lean1[k] = b->t[k];
        lean2[k] = -b->t2[k];
    }
    e1 = box_support_edge(b->h1, i, n1, lean1, MANIFOLD_EVEN * b->thin, c1);
    e2 = box_support_edge(b->h2, j, n2, lean2, MANIFOLD_EVEN * b->thin, c2);
    p = v3_from_array(c1);
    {
        real c[3];
        for (k = 0; k < 3; ++k) c[k] = b->t[k] + b->R[k][0] * c2[0] + b->R[k][1] * c2[1] + b->R[k][2] * c2[2];
        q = v3_from_array(c);
    }
    w = v3(b->R[0][j], b->R[1][j], b->R[2][j]);
    segments_closest(p, axis1, b->h1[i], q, w, b->h2[j], &s, &t);
    crossing = real_abs(s) < b->h1[i] && real_abs(t) < b->h2[j];
    p1 = v3_madd(p, s, axis1);
    p2 = v3_madd(q, t, w);
    separation = v3_dot(n, v3_sub(p2, p1));

    if (v3_norm2(l) < 1 - MANIFOLD_COS_NEAR * MANIFOLD_COS_NEAR) {
        /* nearly parallel: ends of the stretch the edges have in common along their mean direction, where the
         * separation has not opened past the limit */
        vec3 mean = b->R[i][j] > 0 ? v3_add(axis1, w) : v3_sub(axis1, w);
        real inverse = 1 / v3_norm(mean), d1, d2, lo1, hi1, lo2, hi2, lo, hi, deepest = SADMM_REAL_MAX;
        mean = v3_scale(mean, inverse);
        d1 = v3_dot(mean, axis1);
        d2 = v3_dot(mean, w);
        lo1 = v3_dot(mean, p) - b->h1[i] * d1;
        hi1 = v3_dot(mean, p) + b->h1[i] * d1;
        lo2 = v3_dot(mean, q) - b->h2[j] * real_abs(d2);
        hi2 = v3_dot(mean, q) + b->h2[j] * real_abs(d2);
        lo = real_max(lo1, lo2);
        hi = real_min(hi1, hi2);
        if (hi - lo > MANIFOLD_SNAP * real_min(b->h1[i], b->h2[j])) {
            for (end = 0; end < 2; ++end) {
                /* the separation along the normal where the one edge ends and where the other does; the smaller one
                 * counts */
                real x = end ? hi : lo, nearest, end1, end2, x1[3], x2[3];
                vec3 a1 = v3_madd(p, (x - v3_dot(mean, p)) / d1, axis1), a2 = v3_madd(q, (x - v3_dot(mean, q)) / d2, w);
                vec3 d = v3_sub(a1, v3_from_array(b->t));
                uint32_t feature;
                for (k = 0; k < 3; ++k) x2[k] = d.x * b->R[0][k] + d.y * b->R[1][k] + d.z * b->R[2][k];
                v3_to_array(a2, x1);
                end1 = box_depth_along(x2, n2, b->h2, j);
                end2 = box_depth_along(x1, n1, b->h1, i);
                nearest = real_min(end1, end2);
                deepest = real_min(deepest, nearest);
                if (nearest > b->limit) continue;
                /* the end belongs to the edge that stops there */
                if (end ? hi1 <= hi2 : lo1 >= lo2) feature = box_feature_vertex(0, box_edge_end(c1, i, end));
                else feature = box_feature_vertex(1, box_edge_end(c2, j, (end != 0) == (d2 > 0)));
                manifold_add(m, end1 <= end2 ? v3_madd(a1, nearest / 2, n) : v3_madd(a2, -nearest / 2, n), nearest,
                             feature);
            }
            if (m->count > 0 && deepest - separation <= MANIFOLD_FLAT * b->thin) return crossing;
        }
    }
    /* beyond the limit too, by which the caller sees what became of the axis */
    manifold_add(m, v3_scale(v3_add(p1, p2), (real)0.5), separation, box_feature_crossing(e1, e2));
    return crossing;
}

/* Boxes apart whose closest features are corners and edges that do not cross: the edges of 2 against the solid 1. */
SADMM_INLINE void box_corner_manifold(const struct box_pair *b, vec3 fallback, struct manifold *m)
{
    vec3 h1 = v3_from_array(b->h1), p = v3(0, 0, 0), u = p, x = p, q = p;
    real best2 = SADMM_REAL_MAX, best_slope = SADMM_REAL_MAX, half = 0, distance, tie = 64 * b->slack * b->limit;
    int direction, side, best = 0;
    uint32_t cache = m->cache;

    m->count = 0;
    for (direction = 0; direction < 3; ++direction) {
        int i = direction == 2 ? 0 : direction + 1, j = i == 2 ? 0 : i + 1, k;
        real w[3];
        for (k = 0; k < 3; ++k) w[k] = b->R[k][direction];
        for (side = 0; side < 4; ++side) {
            real c[3], d2, slope, hi = side & 1 ? b->h2[i] : -b->h2[i], hj = side & 2 ? b->h2[j] : -b->h2[j];
            vec3 x2, q1;
            for (k = 0; k < 3; ++k) c[k] = b->t[k] + b->R[k][i] * hi + b->R[k][j] * hj;
            x2 = v3_madd(v3_from_array(c), segment_box_closest(c, w, b->h1, b->h2[direction]), v3_from_array(w));
            q1 = box_clamp(x2, h1);
            d2 = v3_norm2(v3_sub(x2, q1));
            slope = real_abs(v3_dot(v3_from_array(w), v3_sub(x2, q1)));
            /* three edges meet in a closest vertex: the one that runs along the other box */
            if (d2 < best2 - tie || (d2 <= best2 + tie && slope < best_slope)) {
                best2 = d2;
                best_slope = slope;
                best = box_edge_id(direction, side & 1, side >> 1);
                p = v3_from_array(c);
                u = v3_from_array(w);
                half = b->h2[direction];
                x = x2;
                q = q1;
            }
        }
    }
    distance = real_sqrt(best2);
    /* the square of a distance may be no number; as separations of axes are judged, boxes that touch but for rounding
     * do */
    if (!(best2 < SADMM_REAL_MAX) || distance > b->limit + b->slack) return;
    if (distance > real_max((real)1e-4 * b->thin, 4 * b->slack)) {
        manifold_segment_outside(0, half, h1, p, u, x, q, distance, MANIFOLD_FLAT * b->thin, b->limit,
                                 256u + 3u * (uint32_t)best, m);
        m->normal = v3_neg(m->normal); /* it came from 2 to 1 */
    } else {
        m->normal = fallback;
        manifold_add(m, v3_scale(v3_add(x, q), (real)0.5), distance, 258u + 3u * (uint32_t)best);
    }
    m->cache = cache;
}

#endif
