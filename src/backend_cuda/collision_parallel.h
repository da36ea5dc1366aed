/* What contact finding and the layout take from CUB, and integer atomics. On the emulated device: plain C++. */
#ifndef SADMM_CUDA_COLLISION_PARALLEL_H
#define SADMM_CUDA_COLLISION_PARALLEL_H

#include <stddef.h>
#include <stdint.h>

#include <cuda_runtime.h>

#include "collision_device.h"

/* Sort keys[0] by their low `bits` bits, stably, with values[0] (values NULL: keys alone); the result is in
 * keys[*result], values[*result]. temp NULL: only *bytes is set, to what temp must hold. */
cudaError_t COLLISION(sort)(void *temp, size_t *bytes, uint64_t *const keys[2], uint32_t *const *values, int count,
                            int bits, int *result, cudaStream_t stream);
/* Sort keys >= 0 below 2^bits stably, with values; the input stays. temp as above. */
cudaError_t COLLISION(sort_numbers)(void *temp, size_t *bytes, const int32_t *keys, int32_t *sorted_keys,
                                    const int32_t *values, int32_t *sorted_values, int count, int bits,
                                    cudaStream_t stream);
/* out[i] = sum of in[0 .. i-1]. temp as above. */
cudaError_t COLLISION(sum)(void *temp, size_t *bytes, const uint64_t *in, uint64_t *out, int count,
                           cudaStream_t stream);

#ifdef SADMM_CUDA_EMULATED

static inline unsigned long long reserve(unsigned long long *counter, unsigned count)
{
    unsigned long long before = *counter;
    *counter += count;
    return before;
}
inline int64_t node_visits;
static inline void count_visit(void) { ++node_visits; }
static inline int arrive(int *arrivals) { return (*arrivals)++; }
static inline int leading_zeros(uint64_t x) { return x ? __builtin_clzll(x) : 64; }
#else

/* Take `count` consecutive places; returns the first. */
static __device__ __forceinline__ unsigned long long reserve(unsigned long long *counter, unsigned count)
{
    return atomicAdd(counter, (unsigned long long)count);
}
/* How many came before. What they wrote is visible, and what this thread wrote is to those after it. */
static __device__ __forceinline__ int arrive(int *arrivals)
{
    __threadfence();
    int before = atomicAdd(arrivals, 1);
    __threadfence();
    return before;
}
static __device__ __forceinline__ void count_visit(void) {}
static __device__ __forceinline__ int leading_zeros(uint64_t x) { return __clzll((long long)x); }
#endif

#endif
