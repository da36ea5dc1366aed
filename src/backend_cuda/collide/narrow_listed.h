/* The narrow phase: two kernels each of plain worlds, of those with convex hulls, with meshes, with smooth bodies, which
 * would be slower with all that the others need of registers and stack.
 *
 * Most pairs take little: they are slow, and those with a hull go on as they were, or are too far apart. The few others (a
 * twentieth in a heap of hulls) take ten times as long, and a warp with one of them would wait for it: so they are listed,
 * and done together, in as many warps as run at once: no two of them go the same way for long. Those with a hull go on
 * from where the walk of the distance, which said that they are near, has ended. The list has no order; what is found
 * does not depend on it. The kernel after them is not triggered (device/pdl.h): terrain took 1 % longer where it was.
 */
#ifndef SADMM_CUDA_COLLIDE_NARROW_LISTED_H
#define SADMM_CUDA_COLLIDE_NARROW_LISTED_H

#include "narrow.h"

template <int FOR, int HOW>
static __global__ void __launch_bounds__(NARROW_THREADS, NARROW_BLOCKS)
at_once_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_only_if(v.pdl);
    const int64_t i = collision_thread(NARROW_THREADS);
    struct gjk_walk walk;
    walk.end = GJK_FAR;
    if (i < (int64_t)v.candidate_capacity + SIZES_BEYOND && !narrow_candidate<FOR, HOW>(v, i, &walk)) {
        const unsigned long long at = atomicAdd(v.candidate_count + COUNT_LISTED, 1ull);
        v.listed[at] = (int32_t)i;
        if (with_hulls(HOW)) v.walks[at] = walk;
    }
}

/* A warp a block; on every chip that this is compiled for about so many run at once. Where there are more than these have
 * lanes for, further ones follow. */
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
    if (threadIdx.x < lanes && i < count) narrow_candidate<FOR, HOW>(v, v.listed[i], with_hulls(HOW) ? &v.walks[i] : nullptr);
}

#endif
