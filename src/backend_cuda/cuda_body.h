/* A body by its eight lanes, in double: what runs a few times a step and sums over a body's halves. */
#ifndef SADMM_CUDA_BODY_H
#define SADMM_CUDA_BODY_H

#include "cuda_double.h"

#include "../core/math/packed6.h"

/* Blocks of few threads: the work of a lane is long, and there are many multiprocessors. */
enum { BODY_THREADS = 64 };

static inline int64_t body_blocks(int32_t bodies)
{
    return ((int64_t)bodies * LANES + BODY_THREADS - 1) / BODY_THREADS;
}

/* Which body a thread is about. */
struct body_thread {
    int32_t slot, lane;
    bool live;
    size_t body; /* raw */
    int32_t begin, end; /* places of its halves */
};

static __device__ __forceinline__ body_thread body_of_thread(const cuda_view &v)
{
    const int32_t t = (int32_t)(blockIdx.x * (unsigned)BODY_THREADS + threadIdx.x), slot = t / LANES;
    const bool live = slot < live_bodies(v);
    body_thread out = {slot, t % LANES, live, live ? (size_t)v.body_of[slot] : 0, live ? v.offsets[slot] : 0,
                       live ? v.offsets[slot + 1] : 0};
    return out;
}

/* x[k] of the eight lanes added up, in all of them. Every lane of the warp comes here. */
template <int COUNT> static __device__ __forceinline__ void sum_lanes(double x[COUNT])
{
#pragma unroll
    for (int o = 1; o < LANES; o *= 2)
#pragma unroll
        for (int k = 0; k < COUNT; ++k) x[k] += __shfl_xor_sync(0xffffffffu, x[k], o);
}

static __device__ __forceinline__ double row_number(const cuda_view &v, int32_t plane, int32_t k)
{
    return (double)v.row_data[(size_t)plane * (size_t)v.row_stride + (size_t)k];
}

#endif
