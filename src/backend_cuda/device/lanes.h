/* Sums over the eight lanes of a body, in double. */
#ifndef SADMM_CUDA_DEVICE_LANES_H
#define SADMM_CUDA_DEVICE_LANES_H

#include "context.h"

/* x[k] of the eight lanes added up, in all of them. Every lane of the warp comes here. */
template <int COUNT> static __device__ __forceinline__ void sum_lanes(double x[COUNT])
{
#pragma unroll
    for (int o = 1; o < LANES; o *= 2)
#pragma unroll
        for (int k = 0; k < COUNT; ++k) x[k] += __shfl_xor_sync((unsigned)ALL_LANES, x[k], o);
}

/* Does any of the eight lanes say yes? Every lane of the warp comes here. */
static __device__ __forceinline__ bool any_of_lanes(bool yes)
{
    const unsigned warp = __ballot_sync((unsigned)ALL_LANES, yes), first = threadIdx.x % WARP / LANES * LANES;
    return (warp >> first & ((1U << LANES) - 1)) != 0;
}

/* A component of x in each lane: that of M x, by the lane's row of M; of three numbers where M is two blocks of 3 x 3.
 * Every lane of the warp comes here. */
template <int SIZE> static __device__ __forceinline__ double product(double x, const double (&row)[SIZE])
{
    const int32_t first = SIZE == 6 || (int32_t)threadIdx.x % LANES < SIZE ? 0 : SIZE;
    double sum = 0;
#pragma unroll
    for (int k = 0; k < SIZE; ++k) sum += row[k] * __shfl_sync((unsigned)ALL_LANES, x, first + k, LANES);
    return sum;
}

/* x . y, a component a lane, in all of them. Every lane of the warp comes here. */
static __device__ __forceinline__ double dot_lanes(double x, double y)
{
    double sum = x * y;
    sum_lanes<1>(&sum);
    return sum;
}

/* The largest x of the eight lanes, in all of them; a NaN stays. Every lane of the warp comes here. */
static __device__ __forceinline__ double largest_of_lanes(double x)
{
#pragma unroll
    for (int o = 1; o < LANES; o *= 2) {
        const double other = __shfl_xor_sync((unsigned)ALL_LANES, x, o);
        x = x != x || other <= x ? x : other;
    }
    return x;
}

#endif
