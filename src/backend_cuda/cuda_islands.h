/* Sums and maxima over islands, in the kernel that makes their terms: slots are by island, and a body's place in its island
 * is what the order of a sum depends on. Of SPREAD neighbours that are SPREAD^k apart the one that comes last adds up all of
 * them, in order, and goes on to the next power; so every sum has one order, whatever surrounds the island and whoever comes
 * last. */
#ifndef SADMM_CUDA_ISLANDS_H
#define SADMM_CUDA_ISLANDS_H

#include "cuda_body.h"

enum { SPREAD = 16, ARRIVAL_BITS = 5 };
static_assert(SPREAD < 1 << ARRIVAL_BITS && 32 / 4 * ARRIVAL_BITS <= 64, "a number holds the arrivals of every power");

struct add_terms {
    static __device__ __forceinline__ double join(double a, double b) { return a + b; }
};
struct largest_term { /* a NaN stays */
    static __device__ __forceinline__ double join(double a, double b) { return a != a || b <= a ? a : b; }
};

/* Terms of a body, term k in lane k, added up (or what Join says) over its island. True in the lanes of one body of each
 * island; those have all of the sums in `sum`, and see what any body of the island has written before it came here. Every
 * lane of the warp comes here. */
template <class Join>
static __device__ __forceinline__ bool add_up_island(const cuda_view &v, const body_thread &t, double term,
                                                     double sum[TERMS])
{
    const int32_t label = t.live ? v.label[t.body] : 0, first = t.live ? v.slot_of[label] : 0,
                  bodies = t.live ? v.island_bodies[label] : 0;
    int32_t rank = t.slot - first;
    bool on = t.live;
    double *own = v.terms + (size_t)t.slot * TERMS;
    if (on && t.lane < TERMS) own[t.lane] = term;
    int32_t power = 0;
    for (int64_t apart = 1; __ballot_sync((unsigned)ALL_LANES, on && apart < bodies) != 0; apart *= SPREAD, ++power) {
        const int32_t begin = (int32_t)(rank / (apart * SPREAD) * (apart * SPREAD));
        const int64_t places = (bodies - begin + apart - 1) / apart;
        const int32_t members = places < SPREAD ? (int32_t)places : (int32_t)SPREAD;
        const bool alone = !on || members < 2 || apart >= bodies;
        bool last = on;
        __syncwarp((unsigned)ALL_LANES);
        if (!alone && t.lane == 0) {
            const unsigned long long one = 1ull << ARRIVAL_BITS * power;
            __threadfence(); /* what the lanes have written, before their body is counted */
            const unsigned long long before = atomicAdd(&v.arrivals[first + begin], one);
            last = (int32_t)(before >> ARRIVAL_BITS * power & ((1u << ARRIVAL_BITS) - 1)) + 1 == members;
            if (last) atomicAdd(&v.arrivals[first + begin], 0ull - one * (unsigned long long)members);
            __threadfence(); /* and what the others have */
        }
        on = __shfl_sync((unsigned)ALL_LANES, last, 0, LANES);
        __syncwarp((unsigned)ALL_LANES);
        if (alone || !on) continue;
        rank = begin;
        double *to = v.terms + (size_t)(first + begin) * TERMS;
        if (t.lane >= TERMS) continue;
        double all[SPREAD];
#pragma unroll
        for (int32_t j = 0; j < SPREAD; ++j)
            all[j] = j < members ? __ldcg(to + (size_t)j * (size_t)apart * TERMS + t.lane) : 0;
        term = all[0];
#pragma unroll
        for (int32_t j = 1; j < SPREAD; ++j)
            if (j < members) term = Join::join(term, all[j]);
        to[t.lane] = term;
    }
#pragma unroll
    for (int k = 0; k < TERMS; ++k) sum[k] = __shfl_sync((unsigned)ALL_LANES, term, k, LANES);
    return on;
}

#endif
