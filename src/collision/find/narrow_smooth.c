/* Manifolds of smooth bodies on the host: an object of their own (pair_manifold.h). */
#include "collision/manifold/smooth_manifold.h"
#include "kernels.h"

void SADMM_COLLISION_KERNEL(smooth_manifold)(const struct sadmm_geometry *shape_a, const struct sadmm_geometry *shape_b,
                                             const double *hulls, uint32_t subshape, const struct pair_pose *pose,
                                             real limit, uint32_t cache, struct manifold *m);

void SADMM_COLLISION_KERNEL(smooth_manifold)(const struct sadmm_geometry *shape_a, const struct sadmm_geometry *shape_b,
                                             const double *hulls, uint32_t subshape, const struct pair_pose *pose,
                                             real limit, uint32_t cache, struct manifold *m)
{
    pair_manifold_of_smooth(shape_a, shape_b, hulls, subshape, pose, limit, cache, m);
}
