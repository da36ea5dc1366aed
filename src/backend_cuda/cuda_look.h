/* The method `fast`: what the stop rule of a step has found (cuda_look.cu). */
#ifndef SADMM_CUDA_LOOK_H
#define SADMM_CUDA_LOOK_H

#include "cuda_internal.h"

/* Had every island stopped at the last of `looks` looks? */
static __device__ __forceinline__ bool all_stopped(const cuda_view &v, int32_t looks)
{
    return looks > 0 && v.stop->unmet[looks % LOOKS_KEPT] == 0;
}

/* Had all islands of the slots [first, end)? */
static __device__ __forceinline__ bool part_stopped(const cuda_view &v, int32_t looks, int32_t first, int32_t end)
{
    bool all = looks > 0;
    for (int32_t s = first; all && s < end; ++s) all = v.islands[v.label[v.body_of[s]]].stopped > 0;
    return all;
}

#endif
