/* Half-space against sphere, capsule and box. a is the plane: its solid is z <= 0 of its own frame. Every vertex (or
 * centre of a round end) within the limit gives a point. */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_PLANE_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_PLANE_H

#include "collision/base/manifold.h"

/* Height over the plane of the origin of b's frame; n: the plane's normal in that frame. */
SADMM_INLINE real plane_offset(const struct pair_pose *pose, vec3 *n)
{
    *n = pose_axis(pose);
    return -v3_dot(*n, pose_origin(pose));
}

SADMM_INLINE void manifold_plane_round_end(struct manifold *m, vec3 centre, real radius, real offset, real limit,
                                           uint32_t feature)
{
    real height = v3_dot(m->normal, centre) + offset, s = height - radius;
    /* halfway between the lowest point of the ball and the plane */
    if (s <= limit) manifold_add(m, v3_madd(centre, -(radius + s / 2), m->normal), s, feature);
}

SADMM_INLINE void manifold_plane_sphere(real radius, const struct pair_pose *pose, real limit, struct manifold *m)
{
    real offset = plane_offset(pose, &m->normal);
    manifold_plane_round_end(m, v3(0, 0, 0), radius, offset, limit, 1);
}

SADMM_INLINE void manifold_plane_capsule(real radius, real half, const struct pair_pose *pose, real limit,
                                         struct manifold *m)
{
    real offset = plane_offset(pose, &m->normal);
    manifold_plane_round_end(m, v3(0, 0, -half), radius, offset, limit, 1);
    manifold_plane_round_end(m, v3(0, 0, half), radius, offset, limit, 2);
}

SADMM_INLINE void manifold_plane_box(vec3 h, const struct pair_pose *pose, real limit, struct manifold *m)
{
    vec3 n;
    real offset = plane_offset(pose, &n);
    int v;
    m->normal = n;
    for (v = 0; v < 8; ++v) {
        vec3 p = v3(v & 1 ? h.x : -h.x, v & 2 ? h.y : -h.y, v & 4 ? h.z : -h.z);
        real s = v3_dot(n, p) + offset;
        if (s <= limit) manifold_add(m, v3_madd(p, -s / 2, n), s, (uint32_t)v + 1);
    }
}

#endif
