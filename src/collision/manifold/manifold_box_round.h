/* Sphere and capsule (a) against box (b), in the box's frame.
 *
 * Outside, the closest point of the box gives normal and separation. Once the centre or the segment is inside, the face
 * of least depth does, or for a capsule an edge of the box; the cached one stays unless clearly beaten, so that a body
 * past the midplane of a thin box is pushed back to where it came from.
 */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_ROUND_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_ROUND_H

#include "manifold_round.h"

/* cache of these pairs: 1 + 2 axis + (1 if the outward side is negative); edges of the box against a capsule: 7 + axis
 * and the outward normal (manifold_direction_bits). */
enum { BOX_ROUND_MASK = 31 };

/* Separation of the interval [lo, hi] from the slab |x| <= h on the positive and on the negative side. */
SADMM_INLINE real slab_separation(real lo, real hi, real h, int negative) { return negative ? -hi - h : lo - h; }

SADMM_INLINE vec3 box_clamp(vec3 p, vec3 h)
{
    return v3(real_clamp(p.x, -h.x, h.x), real_clamp(p.y, -h.y, h.y), real_clamp(p.z, -h.z, h.z));
}

/* The outward normal of the last step, 0 without one. */
SADMM_INLINE vec3 box_round_recall(uint32_t cache)
{
    int code = (int)(cache & BOX_ROUND_MASK);
    if (code == 0) return v3(0, 0, 0);
    return code < 7 ? v3_axis((code - 1) / 2, (code - 1) % 2 ? (real)-1 : (real)1) : manifold_cached_direction(cache);
}

/* Face of least depth of the interval box [lo, hi] (the round shape's core) in the box; 1 + 2 axis + negative. */
SADMM_INLINE int box_core_face(const real lo[3], const real hi[3], const real h[3], real thin, uint32_t cache,
                               const real n_cached[3], real *separation)
{
    int k, side, best = 1;
    real s_best = slab_separation(lo[0], hi[0], h[0], 0);
    for (k = 0; k < 3; ++k)
        for (side = 0; side < 2; ++side) {
            real s = slab_separation(lo[k], hi[k], h[k], side);
            if (s > s_best) {
                s_best = s;
                best = 1 + 2 * k + side;
            }
        }
    /* the cached side when the axis is much like the cached one: past the midplane the other is nearer but wrong */
    k = (best - 1) / 2;
    if (real_abs(n_cached[k]) > MANIFOLD_COS_OPPOSITE) {
        side = n_cached[k] < 0;
        best = 1 + 2 * k + side;
        s_best = slab_separation(lo[k], hi[k], h[k], side);
    }
    if (cache >= 1 && cache <= 6) {
        int c = (int)cache - 1;
        real kept = slab_separation(lo[c / 2], hi[c / 2], h[c / 2], c % 2);
        if (kept >= s_best - MANIFOLD_KEEP_DEPTH * real_abs(kept) - MANIFOLD_KEEP_EXTENT * thin) {
            best = (int)cache;
            s_best = kept;
        }
    }
    *separation = s_best;
    return best;
}

SADMM_INLINE void manifold_sphere_box(real radius, vec3 h, const struct pair_pose *pose, real limit, uint32_t cache,
                                      struct manifold *m)
{
    vec3 c = pose_origin(pose), q = box_clamp(c, h), d = v3_sub(q, c);
    real size = radius + v3_max_abs(h), length = v3_norm(d);
    real p[3], hh[3], n_cached[3], s;
    int face;
    v3_to_array(c, p);
    v3_to_array(h, hh);
    v3_to_array(box_round_recall(cache), n_cached);
    face = box_core_face(p, p, hh, 2 * real_min(radius, real_min(h.x, real_min(h.y, h.z))), cache, n_cached, &s);
    m->cache = (uint32_t)face;
    if (length > 16 * SADMM_EPSILON * size) {
        real separation = length - radius;
        int k;
        if (separation > limit) return;
        m->normal = v3_scale(d, 1 / length);
        /* remember the face it came through */
        k = real_abs(d.x) >= real_abs(d.y) ? (real_abs(d.x) >= real_abs(d.z) ? 0 : 2)
                                           : (real_abs(d.y) >= real_abs(d.z) ? 1 : 2);
        m->cache = (uint32_t)(1 + 2 * k + (p[k] < 0));
        manifold_add(m, v3_madd(q, -separation / 2, m->normal), separation, 1);
        return;
    }
    {
        int k = (face - 1) / 2;
        real out = (face - 1) % 2 ? (real)-1 : (real)1;
        vec3 surface = v3_add(c, v3_axis(k, -out * s));
        real separation = s - radius;
        m->normal = v3_axis(k, -out);
        manifold_add(m, v3_madd(surface, -separation / 2, m->normal), separation, 1);
    }
}

/* d/ds of half the squared distance from x = p + s u to the box. */
SADMM_INLINE real segment_box_slope(const real p[3], const real u[3], const real h[3], real s)
{
    real g = 0;
    int k;
    for (k = 0; k < 3; ++k) {
        real x = p[k] + s * u[k];
        g += u[k] * (x - real_clamp(x, -h[k], h[k]));
    }
    return g;
}

/* Parameter of the point of p + s u, |s| <= half, closest to the box. The squared distance is convex and piecewise
 * quadratic in s with breaks where a coordinate enters or leaves its slab: bracket the root of the slope by the breaks,
 * then it is linear. */
SADMM_INLINE real segment_box_closest(const real p[3], const real u[3], const real h[3], real half)
{
    real lo = -half, hi = half, g_lo = segment_box_slope(p, u, h, lo), g_hi;
    int k, side;
    if (g_lo >= 0) return lo;
    g_hi = segment_box_slope(p, u, h, hi);
    if (g_hi <= 0) return hi;
    for (k = 0; k < 3; ++k) {
        if (real_abs(u[k]) < (real)1e-12) continue;
        for (side = -1; side <= 1; side += 2) {
            real s = ((real)side * h[k] - p[k]) / u[k], g;
            if (!(s > lo && s < hi)) continue;
            g = segment_box_slope(p, u, h, s);
            if (g < 0) {
                lo = s;
                g_lo = g;
            } else {
                hi = s;
                g_hi = g;
            }
        }
    }
    return g_hi > g_lo ? lo + (hi - lo) * real_clamp(-g_lo / (g_hi - g_lo), 0, 1) : lo;
}

/* Stretch of |s| <= half where p + s u is within h of 0; false when empty. */
SADMM_INLINE bool segment_slab(real p, real u, real h, real *lo, real *hi)
{
    real tolerance = MANIFOLD_SNAP * h, a, b;
    if (real_abs(u) < (real)1e-12) return real_abs(p) <= h + tolerance;
    a = (-h - p) / u;
    b = (h - p) / u;
    *lo = real_max(*lo, real_min(a, b));
    *hi = real_min(*hi, real_max(a, b));
    return *lo <= *hi;
}

SADMM_INLINE vec3 segment_at(vec3 p, real s, vec3 u) { return v3_madd(p, s, u); }

/* The segment's core crosses the box: face or edge of least depth. */
SADMM_INLINE void manifold_capsule_box_inside(real radius, real half, vec3 h, vec3 p, vec3 u, real limit,
                                              uint32_t cache, struct manifold *m)
{
    real pa[3], ua[3], ha[3], lo[3], hi[3], s_face, s_edge = -SADMM_REAL_MAX, first = -half, last = half;
    real thin = 2 * real_min(radius, real_min(h.x, real_min(h.y, h.z)));
    real n_cached[3];
    vec3 n_edge = v3(0, 0, 1), n;
    int k, face, edge = -1;

    v3_to_array(p, pa);
    v3_to_array(u, ua);
    v3_to_array(h, ha);
    v3_to_array(box_round_recall(cache), n_cached);
    for (k = 0; k < 3; ++k) {
        lo[k] = pa[k] - half * real_abs(ua[k]);
        hi[k] = pa[k] + half * real_abs(ua[k]);
    }
    face = box_core_face(lo, hi, ha, thin, cache, n_cached, &s_face);
    for (k = 0; k < 3; ++k) {
        int i = (k + 1) % 3, j = (k + 2) % 3, negative;
        real ci = ua[j], cj = -ua[i], length2 = ci * ci + cj * cj, d, r, s, inverse, along;
        if (length2 < (real)1e-8) continue;
        inverse = 1 / real_sqrt(length2);
        d = (ci * pa[i] + cj * pa[j]) * inverse;
        r = (real_abs(ci) * ha[i] + real_abs(cj) * ha[j]) * inverse;
        along = (n_cached[i] * ci + n_cached[j] * cj) * inverse;
        /* an axis much like the cached one keeps its side, as faces do */
        negative = real_abs(along) > MANIFOLD_COS_OPPOSITE ? along < 0 : d < 0;
        s = (negative ? -d : d) - r;
        if ((cache & BOX_ROUND_MASK) == (uint32_t)(7 + k) && real_abs(along) >= MANIFOLD_COS_SAME)
            s += MANIFOLD_KEEP_DEPTH * real_abs(s) + MANIFOLD_KEEP_EXTENT * thin;
        if (s > s_edge) {
            vec3 axis;
            real out = negative ? -inverse : inverse;
            s_edge = s;
            edge = k;
            axis = v3_add(v3_axis(i, ci * out), v3_axis(j, cj * out));
            n_edge = axis;
        }
    }
    k = (face - 1) / 2;
    n = v3_axis(k, (face - 1) % 2 ? (real)-1 : (real)1); /* outward */
    if (edge >= 0 && s_edge > s_face + MANIFOLD_KEEP_DEPTH / 2 * real_abs(s_face) &&
        v3_dot(n, n_edge) < MANIFOLD_COS_NEAR) {
        /* the box edge along `edge` on the outward side, and the segment: closest points of the two lines */
        vec3 e = v3(n_edge.x >= 0 ? h.x : -h.x, n_edge.y >= 0 ? h.y : -h.y, n_edge.z >= 0 ? h.z : -h.z), axis, qa, qb;
        real s, t;
        axis = v3_axis(edge, 1);
        e = edge == 0 ? v3(0, e.y, e.z) : (edge == 1 ? v3(e.x, 0, e.z) : v3(e.x, e.y, 0));
        segments_closest(p, u, half, e, axis, ha[edge], &s, &t);
        m->normal = v3_neg(n_edge);
        m->cache = (uint32_t)(7 + edge) | manifold_direction_bits(n_edge);
        qa = v3_madd(segment_at(p, s, u), radius, m->normal);
        qb = v3_madd(e, t, axis);
        manifold_add_between(m, qa, qb, 3);
        return;
    }
    m->normal = v3_neg(n);
    m->cache = (uint32_t)face;
    if (!segment_slab(pa[(k + 1) % 3], ua[(k + 1) % 3], ha[(k + 1) % 3], &first, &last) ||
        !segment_slab(pa[(k + 2) % 3], ua[(k + 2) % 3], ha[(k + 2) % 3], &first, &last))
        first = last = real_clamp(segment_box_closest(pa, ua, ha, half), -half, half);
    {
        vec3 c0 = segment_at(p, first, u), c1 = segment_at(p, last, u);
        real s0 = v3_dot(n, c0) - ha[k] - radius, s1 = v3_dot(n, c1) - ha[k] - radius;
        bool one = last - first <= MANIFOLD_SNAP * real_min(half, v3_max_abs(h)); /* then the deeper end */
        /* halfway between the lowest point of the ball and the face */
        if (one ? s0 <= s1 : s0 <= limit) manifold_add(m, v3_madd(c0, -(radius + s0 / 2), n), s0, 1);
        if (one ? s0 > s1 : s1 <= limit) manifold_add(m, v3_madd(c1, -(radius + s1 / 2), n), s1, 2);
    }
}

/* Segment p + s u, |s| <= half, with a round of `radius` around it, outside the box: x and q the closest points of
 * segment and box, `length` > 0 their distance. Sets the normal (segment to box). A line contact gives the ends of the
 * stretch over the same feature of the box, with features first_feature and + 1; where the closest point is deeper than
 * both by more than `flat`, or there is no line, it comes as first_feature + 2. */
SADMM_INLINE void manifold_segment_outside(real radius, real half, vec3 h, vec3 p, vec3 u, vec3 x, vec3 q, real length,
                                           real flat, real limit, uint32_t first_feature, struct manifold *m)
{
    real pa[3], ua[3], ha[3], na[3], xa[3], closest = length - radius, first = -half, last = half,
                                            best_end = SADMM_REAL_MAX;
    bool stretch = true;
    int k, e, main_axis = 0;

    m->normal = v3_scale(v3_sub(q, x), 1 / length);
    v3_to_array(p, pa);
    v3_to_array(u, ua);
    v3_to_array(h, ha);
    v3_to_array(m->normal, na);
    v3_to_array(x, xa);
    for (k = 1; k < 3; ++k)
        if (real_abs(na[k]) > real_abs(na[main_axis])) main_axis = k;
    m->cache = (uint32_t)(1 + 2 * main_axis + (na[main_axis] > 0));

    /* The slabs in which the closest point lies bound the stretch (one beside the box has an edge of it for company all
     * along); its ends count where the box is found in nearly the same direction. */
    for (k = 0; k < 3; ++k)
        if (na[k] * na[k] < 1 - MANIFOLD_COS_NEAR * MANIFOLD_COS_NEAR && k != main_axis &&
            real_abs(xa[k]) <= ha[k] * (1 + MANIFOLD_SNAP))
            stretch = stretch && segment_slab(pa[k], ua[k], ha[k], &first, &last);
    if (stretch && last - first > MANIFOLD_SNAP * real_min(half, v3_max_abs(h))) {
        for (e = 0; e < 2; ++e) {
            vec3 c = segment_at(p, e ? last : first, u), qe = box_clamp(c, h), d = v3_sub(qe, c);
            real distance = v3_norm(d), separation = distance - radius;
            if (!(v3_dot(m->normal, d) >= MANIFOLD_COS_NEAR * distance)) continue;
            best_end = real_min(best_end, separation);
            if (separation <= limit) /* halfway between the end's surface and the box */
                manifold_add(m, v3_madd(qe, -separation / 2, distance > 0 ? v3_scale(d, 1 / distance) : m->normal),
                             separation, first_feature + (uint32_t)e);
        }
        if (m->count == 2 && best_end - closest < flat) return;
        if (m->count == 1 && best_end - closest < flat) { /* the closest point, in the name of that end */
            first_feature = m->points[0].feature - 2;
            m->count = 0;
        }
    }
    manifold_add(m, v3_madd(q, -closest / 2, m->normal), closest, first_feature + 2);
}

SADMM_INLINE void manifold_capsule_box(real radius, real half, vec3 h, const struct pair_pose *pose, real limit,
                                       uint32_t cache, struct manifold *m)
{
    vec3 p = pose_origin(pose), u = pose_axis(pose), x, q;
    real pa[3], ua[3], ha[3], length;

    v3_to_array(p, pa);
    v3_to_array(u, ua);
    v3_to_array(h, ha);
    x = segment_at(p, segment_box_closest(pa, ua, ha, half), u);
    q = box_clamp(x, h);
    length = v3_norm(v3_sub(q, x));
    if (length <= 64 * SADMM_EPSILON * (radius + half + v3_max_abs(h)))
        manifold_capsule_box_inside(radius, half, h, p, u, limit, cache, m);
    else if (length - radius <= limit)
        manifold_segment_outside(radius, half, h, p, u, x, q, length,
                                 MANIFOLD_FLAT * real_min(radius, real_min(h.x, real_min(h.y, h.z))), limit, 1, m);
}

#endif
