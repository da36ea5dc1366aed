/* Manifold of any ordered pair of shapes, and the bounds both broad phases and the narrow phase share. */
#ifndef SADMM_COLLISION_PAIR_MANIFOLD_H
#define SADMM_COLLISION_PAIR_MANIFOLD_H

#include "manifold.h"
#include "manifold_box.h"
#include "manifold_box_round.h"
#include "manifold_plane.h"
#include "manifold_round.h"
#include "subadmm/world.h"

/* Pose of a in b's frame. The differences are taken in double before anything is rounded to `real`. A plane's origin
 * may be far away: it moves to the foot of the perpendicular from b's centre. R: row-major, shape to world. */
SADMM_INLINE struct pair_pose pair_pose(bool a_is_plane, const double Ra[9], const double xa[3], const double Rb[9],
                                        const double xb[3])
{
    double d[3] = {xa[0] - xb[0], xa[1] - xb[1], xa[2] - xb[2]};
    double R[9], t[3];
    struct pair_pose pose;
    int i, j;
    if (a_is_plane) {
        double height = d[0] * Ra[2] + d[1] * Ra[5] + d[2] * Ra[8];
        for (i = 0; i < 3; ++i) d[i] = height * Ra[3 * i + 2];
    }
    for (i = 0; i < 3; ++i) {
        for (j = 0; j < 3; ++j) R[3 * i + j] = Rb[i] * Ra[j] + Rb[3 + i] * Ra[3 + j] + Rb[6 + i] * Ra[6 + j];
        t[i] = Rb[i] * d[0] + Rb[3 + i] * d[1] + Rb[6 + i] * d[2];
    }
    for (i = 0; i < 3; ++i) pose.R.r[i] = v3((real)R[3 * i], (real)R[3 * i + 1], (real)R[3 * i + 2]);
    pose.t = v3((real)t[0], (real)t[1], (real)t[2]);
    return pose;
}

/* type_a <= type_b; not two planes. size as in sadmm_shape_def. m->count is 0 when the shapes are apart. */
SADMM_INLINE void pair_manifold(int type_a, vec3 size_a, int type_b, vec3 size_b, const struct pair_pose *pose,
                                real limit, uint32_t cache, struct manifold *m)
{
    m->count = 0;
    m->cache = 0;
    if (type_a == SADMM_SHAPE_BOX) {
        manifold_box_box(size_b, size_a, pose, limit, cache, m);
    } else if (type_a == SADMM_SHAPE_PLANE) {
        if (type_b == SADMM_SHAPE_BOX) manifold_plane_box(size_b, pose, limit, m);
        else if (type_b == SADMM_SHAPE_SPHERE) manifold_plane_sphere(size_b.x, pose, limit, m);
        else if (type_b == SADMM_SHAPE_CAPSULE) manifold_plane_capsule(size_b.x, size_b.y, pose, limit, m);
    } else if (type_a == SADMM_SHAPE_SPHERE) {
        if (type_b == SADMM_SHAPE_SPHERE) manifold_sphere_sphere(size_a.x, size_b.x, pose, limit, m);
        else if (type_b == SADMM_SHAPE_CAPSULE)
            manifold_sphere_capsule(size_a.x, size_b.x, size_b.y, pose, limit, m);
        else manifold_sphere_box(size_a.x, size_b, pose, limit, cache, m);
    } else {
        if (type_b == SADMM_SHAPE_CAPSULE)
            manifold_capsule_capsule(size_a.x, size_a.y, size_b.x, size_b.y, pose, limit, cache, m);
        else manifold_capsule_box(size_a.x, size_a.y, size_b, pose, limit, cache, m);
    }
}

#endif
