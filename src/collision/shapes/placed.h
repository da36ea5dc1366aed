/* A shape where it is, as queries read it: what sadmm_proxy is in a step, without motion, margins and materials. In
 * double everywhere. */
#ifndef SADMM_COLLISION_SHAPES_PLACED_H
#define SADMM_COLLISION_SHAPES_PLACED_H

#include <stdbool.h>

#include "collision/base/bounds.h"
#include "core/math/quat.h"
#include "geometry.h"

struct sadmm_placed {
    double R[9], x[3]; /* shape to world, row-major; its origin, m */
    struct sadmm_geometry geometry;
    const double *blocks; /* that geometry.hull is an offset in (hull_data.h). Of others than hulls and meshes: what
                             all shape data begins with */
    uint32_t slot;
    int32_t body, environment;
    uint32_t category, mask;
    uint32_t body_type; /* a bit */
    bool sensor;
};

/* position, orientation: of the shape's frame in the body's, and of the body's in the world. */
SADMM_INLINE void placed_pose(const double position[3], const double orientation[4], const double body_position[3],
                              const double body_orientation[4], struct sadmm_placed *p)
{
    const quat turn = q_load(body_orientation);
    const mat3 R = q_matrix(q_normalize(q_mul(turn, q_load(orientation))));
    const vec3 arm = m3_mul(q_matrix(turn), v3_load(position));
    int i;
    for (i = 0; i < 3; ++i) v3_store(R.r[i], p->R + 3 * i);
    p->x[0] = body_position[0] + (double)arm.x;
    p->x[1] = body_position[1] + (double)arm.y;
    p->x[2] = body_position[2] + (double)arm.z;
}

/* A vector of the world in the shape's frame, and back. */
SADMM_INLINE vec3 placed_own(const struct sadmm_placed *p, vec3 v)
{
    return v3(p->R[0] * v.x + p->R[3] * v.y + p->R[6] * v.z, p->R[1] * v.x + p->R[4] * v.y + p->R[7] * v.z,
              p->R[2] * v.x + p->R[5] * v.y + p->R[8] * v.z);
}
SADMM_INLINE vec3 placed_world(const struct sadmm_placed *p, vec3 v)
{
    return v3(p->R[0] * v.x + p->R[1] * v.y + p->R[2] * v.z, p->R[3] * v.x + p->R[4] * v.y + p->R[5] * v.z,
              p->R[6] * v.x + p->R[7] * v.y + p->R[8] * v.z);
}

/* The box around it in the world. Not of a plane. */
SADMM_INLINE void placed_box(const struct sadmm_placed *p, struct sadmm_box3 *box)
{
    double extent[3];
    int k;
    geometry_extents(&p->geometry, p->R, extent);
    for (k = 0; k < 3; ++k) {
        const double e = extent[k] + 8 * DBL_EPSILON * (fabs(p->x[k]) + extent[k]); /* rounding favours meeting */
        box->lo[k] = p->x[k] - e;
        box->hi[k] = p->x[k] + e;
    }
}

#endif
