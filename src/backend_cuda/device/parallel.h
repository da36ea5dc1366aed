/* What contact finding and the layout take from CUB, and integer atomics. On the emulated device: plain C++. */
#ifndef SADMM_CUDA_DEVICE_PARALLEL_H
#define SADMM_CUDA_DEVICE_PARALLEL_H

#include <stddef.h>
#include <stdint.h>

#include <cuda_runtime.h>

#include "found.h"

/* Sort keys[0] by their low `bits` bits, stably, with values[0] (values NULL: keys alone); the result is in
 * keys[*result], values[*result]. temp NULL: only *bytes is set, to what temp must hold. */
cudaError_t COLLISION(sort)(void *temp, size_t *bytes, uint64_t *const keys[2], uint32_t *const *values, int count,
                            int bits, int *result, cudaStream_t stream);
/* Sort keys >= 0 below 2^bits stably, with values; the input stays. temp as above. */
cudaError_t COLLISION(sort_numbers)(void *temp, size_t *bytes, const int32_t *keys, int32_t *sorted_keys,
                                    const int32_t *values, int32_t *sorted_values, int count, int bits,
                                    cudaStream_t stream);
/* out[i] = sum over j < i of size_of(in[j]). temp as above. */
cudaError_t COLLISION(sum)(void *temp, size_t *bytes, const uint8_t *in, uint64_t *out, int count, cudaStream_t stream);

/* Of a candidate with so many points: pairs << 32 | points. */
static __host__ __device__ __forceinline__ uint64_t size_of(uint8_t points)
{
    return points > 0 ? UINT64_C(1) << 32 | points : 0;
}

#ifdef SADMM_CUDA_EMULATED

static inline unsigned long long reserve(unsigned long long *counter, unsigned count)
{
    unsigned long long before = *counter;
    *counter += count;
    return before;
}
inline int64_t node_visits;
static inline void count_visit(void) { ++node_visits; }
static inline void keep_fetched(double x) { (void)x; }
static inline int arrive(int *arrivals) { return (*arrivals)++; }
static inline int leading_zeros(uint64_t x) { return x ? __builtin_clzll(x) : 64; }
static inline int trailing_zeros(uint64_t x) { return __builtin_ctzll(x); }
static inline int bits_set(uint64_t x) { return __builtin_popcountll(x); }
static inline float round_down(double x) { return (float)x > x ? nextafterf((float)x, -HUGE_VALF) : (float)x; }
static inline float round_up(double x) { return (float)x < x ? nextafterf((float)x, HUGE_VALF) : (float)x; }
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
/* The number has been loaded by here, whatever becomes of it: what lies beside it is near then. */
static __device__ __forceinline__ void keep_fetched(double x) { asm volatile("" ::"d"(x)); }
static __device__ __forceinline__ int leading_zeros(uint64_t x) { return __clzll((long long)x); }
static __device__ __forceinline__ int trailing_zeros(uint64_t x) { return __ffsll((long long)x) - 1; } /* x not 0 */
static __device__ __forceinline__ int bits_set(uint64_t x) { return __popcll(x); }
static __device__ __forceinline__ float round_down(double x) { return __double2float_rd(x); }
static __device__ __forceinline__ float round_up(double x) { return __double2float_ru(x); }
#endif

enum { WARP_LANES = 32 };

/* The same for a whole warp, in one go: lane after lane. */
static __device__ __forceinline__ unsigned long long reserve_by_warp(unsigned long long *counter, unsigned count)
{
    const int lane = (int)threadIdx.x % WARP_LANES;
    unsigned sum = count;
    for (int by = 1; by < WARP_LANES; by *= 2) {
        const unsigned below = __shfl_up_sync(0xffffffffu, sum, by);
        if (lane >= by) sum += below;
    }
    const unsigned total = __shfl_sync(0xffffffffu, sum, WARP_LANES - 1, WARP_LANES);
    unsigned long long first = 0;
    if (total == 0) return 0;
    if (lane == 0) first = reserve(counter, total);
    return __shfl_sync(0xffffffffu, first, 0, WARP_LANES) + (sum - count);
}

#endif
