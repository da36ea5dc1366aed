/* The narrow phase: two kernels each of worlds with convex hulls, with meshes, with smooth bodies, which would be
 * slower with all that the others need of registers and stack; one of plain worlds.
 *
 * Most pairs take little: they are slow, and those with a hull go on as they were, or are too far apart. The few others
 * (a twentieth in a heap of hulls) take ten times as long, and a warp with one of them would wait for it: so they are
 * listed, and done together, in as many warps as run at once: no two of them go the same way for long. Those with a
 * hull go on from where the walk of the distance, which said that they are near, has ended. The list has no order; what
 * is found does not depend on it. The kernel after them is not triggered (device/pdl.h): terrain took 1 % longer
 * where it was. In plain worlds, where others are fewer still, they are done on the spot: a kernel more takes
 * longer. */
#ifndef SADMM_CUDA_COLLIDE_NARROW_LISTED_H
#define SADMM_CUDA_COLLIDE_NARROW_LISTED_H

#include "narrow_seams.h"

/* A candidate of a plain world that is not done at once. By itself: others should not pay in registers. */
template <int HOW> static __device__ __noinline__ void narrow_on_the_spot(const collision_view &v, int64_t i)
{
    narrow_candidate<NARROW_ANY, HOW>(v, i, nullptr);
}

template <int FOR, int HOW>
static __global__ void __launch_bounds__(NARROW_THREADS, NARROW_BLOCKS)
at_once_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_only_if(v.pdl);
    const int64_t i = collision_thread(NARROW_THREADS);
    struct gjk_walk walk;
    walk.end = GJK_FAR;
    if (i >= (int64_t)v.candidate_capacity + SIZES_BEYOND) return;
    const bool done = narrow_candidate<FOR, HOW>(v, i, &walk);
    if (with_hulls(HOW) && v.is_listed && i < v.candidate_capacity) v.is_listed[i] = !done;
    if (!done) {
        if constexpr (with_hulls(HOW)) {
            const unsigned long long at = atomicAdd(v.candidate_count + COUNT_LISTED, 1ull);
            v.listed[at] = (int32_t)i;
            v.walks[at] = walk;
        } else {
            narrow_on_the_spot<NARROW_PLAIN_LISTED>(v, i);
        }
    }
    if (!with_hulls(HOW) && v.hides && i < usable_candidates(v)) hide_seams(v, i);
}

/* A warp a block; on every chip that this is compiled for about so many run at once. Where there are more than these
 * have lanes for, further ones follow. */
enum { LISTED_WARPS = 1024 };

template <int FOR, int HOW>
static __global__ void __launch_bounds__(NARROW_THREADS)
listed_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_only_if(v.pdl);
    const int64_t width = NARROW_THREADS, most = LISTED_WARPS, all = (v.candidate_capacity + width - 1) / width,
                  warps = all < most ? all : most, count = (int64_t)v.candidate_count[COUNT_LISTED],
                  wanted = (count + warps - 1) / warps, lanes = wanted < width ? wanted : width,
                  i = blockIdx.x * lanes + threadIdx.x;
    if (threadIdx.x < lanes && i < count) narrow_candidate<FOR, HOW>(v, v.listed[i], &v.walks[i]);
}

#endif
