/* Where pairs with a mesh that are fast first touch one of its triangles: what all triangles of a pair have in
 * common is computed by candidate and looked up by the others; after the sort those of a pair are neighbours. */
#ifndef SADMM_CUDA_COLLIDE_TOUCH_H
#define SADMM_CUDA_COLLIDE_TOUCH_H

#include "narrow.h"

template <int FOR>
static __global__ void __launch_bounds__(MESH_THREADS) touch_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    const int64_t i = collision_thread(MESH_THREADS);
    if (i >= usable_candidates(v)) return;
    const struct candidate own = candidate_of(v, v.candidates[i]);
    const struct collision_step step = step_of_shape(v, step_of(v), own.a);
    const struct sadmm_proxy &a = *wide_at(v.proxies, own.a), &b = *wide_at(v.proxies, own.b);
    if (b.geometry.type != SADMM_SHAPE_MESH) return;
    const struct pair_start start = pair_start_of(&a, &b, step.margin, step.gravity, step.dt);
    if (!start.moves_on) return;
    v.touches[i] = narrow_find<FOR>(v) != NARROW_ONE && !triangle_now(v, step, own, a, b)
                       ? HUGE_VAL
                       : mesh_first_touch(&a, &b, v.hulls, own.subshape, step.gravity, step.dt);
}

static void touch_kernels(struct narrow_kernels *k)
{
    k->touch = k->touch_first = k->touch_again = {touch_kernel<NARROW_ANY>, MESH_THREADS, 0, "first touches of meshes"};
}

#endif
