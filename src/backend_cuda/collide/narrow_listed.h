/* The kernel of listed candidates (narrow_hulls.cu). SADMM_WITHOUT_SMOOTH, set by the includer: of worlds without
 * smooth bodies. */
#ifndef SADMM_CUDA_COLLIDE_NARROW_LISTED_H
#define SADMM_CUDA_COLLIDE_NARROW_LISTED_H

#include "narrow.h"

/* A warp a block; on every chip that this is compiled for about so many run at once. Where there are more than these
 * have lanes for, further ones follow. */
enum { LISTED_WARPS = 1024 };

template <int FOR>
static __global__ void __launch_bounds__(NARROW_THREADS)
listed_kernel(const __grid_constant__ collision_view v)
{
    const int64_t width = NARROW_THREADS, most = LISTED_WARPS, all = (v.candidate_capacity + width - 1) / width,
                  warps = all < most ? all : most, count = (int64_t)v.candidate_count[1],
                  wanted = (count + warps - 1) / warps, lanes = wanted < width ? wanted : width,
                  i = blockIdx.x * lanes + threadIdx.x;
    if (threadIdx.x < lanes && i < count) narrow_candidate<FOR, NARROW_LISTED>(v, v.listed[i]);
}

#endif
