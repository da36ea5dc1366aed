/* The manifold of a pair with a smooth body, by types (collision_table.h). */
#ifndef SADMM_COLLISION_MANIFOLD_SMOOTH_MANIFOLD_H
#define SADMM_COLLISION_MANIFOLD_SMOOTH_MANIFOLD_H

#include "collision_table.h"
#include "manifold_convex.h"
#include "manifold_convex_mesh.h"

/* Sets m; its count is 0 before. subshape: of meshes. */
SADMM_INLINE void pair_manifold_of_smooth(const struct sadmm_geometry *shape_a, const struct sadmm_geometry *shape_b,
                                          const double *hulls, uint32_t subshape, const struct pair_pose *pose,
                                          real limit, uint32_t cache, struct manifold *m)
{
    switch (SADMM_TYPE_PAIR(shape_a->type, shape_b->type)) {
#define SADMM_MANIFOLD(A, B, call) \
    case SADMM_TYPE_PAIR((int)SADMM_SHAPE_##A, (int)SADMM_SHAPE_##B): call; break;
        SADMM_CONVEX_TABLE(SADMM_MANIFOLD)
#undef SADMM_MANIFOLD
    default: /* the only one with others */
        if (shape_b->type == SADMM_SHAPE_MESH)
            convex_mesh_manifold(shape_a, shape_b, hulls, subshape, pose, limit, cache, m);
        break;
    }
}

#endif
