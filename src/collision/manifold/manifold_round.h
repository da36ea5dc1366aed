/* Spheres and capsules against each other. A sphere is a capsule with a segment of length 0. Capsules lie along z of
 * their own frame. */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_ROUND_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_ROUND_H

#include <stdbool.h>

#include "collision/base/manifold.h"

/* Unit vector of d, or `fallback` (unit) when d is too short to have a direction; returns the length. */
SADMM_INLINE real direction_or(vec3 d, real size, vec3 fallback, vec3 *n)
{
    real length = v3_norm(d);
    if (length > 16 * SADMM_EPSILON * size && length > (real)1e-18) {
        *n = v3_scale(d, 1 / length);
        return length;
    }
    *n = fallback;
    return 0;
}

/* Point of ball a (centre ca) against ball b (centre cb) along m->normal. */
SADMM_INLINE void manifold_add_balls(struct manifold *m, vec3 ca, real ra, vec3 cb, real rb, real limit,
                                     uint32_t feature)
{
    real s = v3_dot(m->normal, v3_sub(cb, ca)) - ra - rb;
    if (s <= limit)
        manifold_add_between(m, v3_madd(ca, ra, m->normal), v3_madd(cb, -rb, m->normal), feature);
}

SADMM_INLINE void manifold_sphere_sphere(real ra, real rb, const struct pair_pose *pose, real limit,
                                         struct manifold *m)
{
    /* concentric: every normal is right, take b's z */
    const vec3 t = pose_origin(pose);
    direction_or(v3_neg(t), ra + rb, v3(0, 0, 1), &m->normal);
    manifold_add_balls(m, t, ra, v3(0, 0, 0), rb, limit, 1);
}

SADMM_INLINE void manifold_sphere_capsule(real ra, real rb, real half, const struct pair_pose *pose, real limit,
                                          struct manifold *m)
{
    vec3 t = pose_origin(pose), c = v3(0, 0, real_clamp(t.z, -half, half));
    /* centre on the segment: any direction across it */
    direction_or(v3_sub(c, t), ra + rb, v3(1, 0, 0), &m->normal);
    manifold_add_balls(m, t, ra, c, rb, limit, 1);
}

/* Closest points of the segments p + s u, |s| <= hp and q + t w, |t| <= hq (u, w unit). */
SADMM_INLINE void segments_closest(vec3 p, vec3 u, real hp, vec3 q, vec3 w, real hq, real *s, real *t)
{
    vec3 d = v3_sub(q, p);
    vec3 cross = v3_cross(u, w);
    real c = v3_dot(u, w), du = v3_dot(d, u), dw = v3_dot(d, w), sin2 = v3_norm2(cross);
    real a = du, b;
    /* nearly parallel: the difference would be of numbers that are equal but for sin2 */
    if (sin2 > (real)1e-6) a = (du - c * dw) / sin2;
    else if (sin2 > 16 * SADMM_EPSILON * SADMM_EPSILON) a = v3_dot(d, v3_cross(w, cross)) / sin2;
    a = real_clamp(a, -hp, hp);
    b = a * c - dw;
    if (b > hq) {
        b = hq;
        a = real_clamp(du + c * hq, -hp, hp);
    } else if (b < -hq) {
        b = -hq;
        a = real_clamp(du - c * hq, -hp, hp);
    }
    *s = a;
    *t = b;
}

/* Balls around ca and cb whose centres are apart sideways as well: adds the point halfway between their surfaces on the
 * line along the normal on which they are nearest. Returns the separation there, a large number where they pass each
 * other by. */
SADMM_INLINE real manifold_add_section(struct manifold *m, vec3 ca, real ra, vec3 cb, real rb, real limit,
                                       uint32_t feature)
{
    vec3 d = v3_sub(cb, ca), side;
    real along = v3_dot(m->normal, d), share = ra / (ra + rb), height2, height, s;
    side = v3_madd(d, -along, m->normal);
    height2 = (ra + rb) * (ra + rb) - v3_norm2(side);
    if (height2 <= 0) return SADMM_REAL_MAX;
    height = real_sqrt(height2);
    s = along - height;
    if (s <= limit)
        manifold_add(m, v3_madd(v3_madd(ca, share, side), share * height + s / 2, m->normal), s, feature);
    return s;
}

/* Two capsules side by side touch along a line: both ends of the common stretch. Otherwise the closest points.
 * cache: 1 and the normal (manifold_direction_bits), whose side stays when the axes cross. */
SADMM_INLINE void manifold_capsule_capsule(real ra, real ha, real rb, real hb, const struct pair_pose *pose,
                                           real limit, uint32_t cache, struct manifold *m)
{
    vec3 u = pose_axis(pose), w = v3(0, 0, 1), p = pose_origin(pose), cross = v3_cross(u, w), fallback = v3(1, 0, 0), d;
    vec3 ca, cb;
    real s, t, closest, sin2 = v3_norm2(cross), radii = ra + rb, size = radii + ha + hb;

    segments_closest(p, u, ha, v3(0, 0, 0), w, hb, &s, &t);
    ca = v3_madd(p, s, u);
    cb = v3_scale(w, t);
    d = v3_sub(cb, ca);
    if (sin2 > (real)1e-6) size /= real_sqrt(sin2); /* the rounding of where they meet (segments_closest) */
    if (sin2 > 16 * SADMM_EPSILON * SADMM_EPSILON) {
        vec3 n_cached = cache ? manifold_cached_direction(cache) : cross;
        bool crossing =
            sin2 > (real)1e-6 && real_abs(s) < ha && real_abs(t) < hb && v3_norm2(d) < (real)0.25 * radii * radii;
        /* however small their angle: along capsules that are long enough it is more than their radii */
        fallback = v3_scale(cross, (v3_dot(cross, n_cached) < 0 ? -1 : 1) / real_sqrt(sin2));
        if (crossing && cache && v3_dot(d, n_cached) < 0) d = v3_neg(d);
    }
    direction_or(d, size, fallback, &m->normal);
    m->cache = 1 | manifold_direction_bits(m->normal);

    closest = v3_dot(m->normal, v3_sub(cb, ca)) - radii;
    if (closest > limit) return;
    if (sin2 < 1 - MANIFOLD_COS_NEAR * MANIFOLD_COS_NEAR) {
        /* nearly parallel: the stretch of b beside a */
        real reach = ha * real_abs(u.z), lo = real_max(p.z - reach, -hb), hi = real_min(p.z + reach, hb);
        if (hi - lo > MANIFOLD_SNAP * (ha + hb)) {
            vec3 a_lo = v3_madd(p, (lo - p.z) / u.z, u), a_hi = v3_madd(p, (hi - p.z) / u.z, u);
            vec3 b_lo = v3(0, 0, lo), b_hi = v3(0, 0, hi);
            real s_lo = manifold_add_section(m, a_lo, ra, b_lo, rb, limit, 1);
            real s_hi = manifold_add_section(m, a_hi, ra, b_hi, rb, limit, 2);
            if (m->count > 0 && real_min(s_lo, s_hi) - closest <= MANIFOLD_FLAT * 2 * real_min(ra, rb)) return;
        }
    }
    manifold_add_balls(m, ca, ra, cb, rb, limit, 3);
}

#endif
