/* Sums and maxima over islands, in the kernel that makes their terms: slots are by island, and a body's place in its
 * island is what the order of a sum depends on. Of SPREAD neighbours that are SPREAD^k apart the one that comes last
 * adds up all of them, in order, and goes on to the next power; so every sum has one order, whatever surrounds the
 * island and whoever comes last. */
#ifndef SADMM_CUDA_WEIGHT_ISLAND_SUMS_H
#define SADMM_CUDA_WEIGHT_ISLAND_SUMS_H

#include "backend_cuda/device/body.h"

enum { SPREAD_BITS = 4, SPREAD = 1 << SPREAD_BITS, ARRIVAL_BITS = 5 };
static_assert(SPREAD < 1 << ARRIVAL_BITS && 32 / 4 * ARRIVAL_BITS <= 64, "a number holds the arrivals of every power");

struct add_terms {
    static __device__ __forceinline__ double join(double a, double b) { return a + b; }
};
struct largest_term {
    static __device__ __forceinline__ double join(double a, double b) { return keep_max(a, b); }
};

/* Adds `one`; returns what was there. What the warp has written before, whoever counts later sees, and what those have
 * written that have counted, this one does. Fences before and after it would be waited for one after the other. */
static __device__ __forceinline__ unsigned long long count_arrival(unsigned long long *arrivals,
                                                                    unsigned long long one)
{
#ifdef SADMM_CUDA_EMULATED
    return atomicAdd(arrivals, one);
#else
    unsigned long long before;
    asm volatile("atom.acq_rel.gpu.global.add.u64 %0, [%1], %2;"
                 : "=l"(before)
                 : "l"(arrivals), "l"(one)
                 : "memory");
    return before;
#endif
}

/* Of bodies that are `on`, whole islands of them: add_up(slot, apart, members) for each power, by the lanes of the body
 * that came last. True in the lanes of one body of each island; those see what any body of the island has written
 * before it came here. `arrivals`: slots, 0 before and after. Every lane of the warp comes here. */
template <class AddUp>
static __device__ __forceinline__ bool add_up_by_powers(const graph_view &graph, unsigned long long *arrivals,
                                                        const body_thread &t, bool on, AddUp add_up)
{
    const int32_t label = on ? graph.label[t.body] : 0, first = on ? graph.slot_of[label] : 0,
                  bodies = on ? graph.island_bodies[label] : 0;
    int32_t rank = t.slot - first;
    int32_t power = 0;
    for (int64_t apart = 1; __ballot_sync((unsigned)ALL_LANES, on && apart < bodies) != 0; apart *= SPREAD, ++power) {
        const int32_t begin = (int32_t)(rank & -(apart * SPREAD));
        const int64_t places = (bodies - begin + apart - 1) >> SPREAD_BITS * power; /* divided by apart */
        const int32_t members = places < SPREAD ? (int32_t)places : (int32_t)SPREAD;
        const bool alone = !on || members < 2 || apart >= bodies;
        bool last = on;
        __syncwarp((unsigned)ALL_LANES);
        if (!alone && t.lane == 0) {
            const unsigned long long one = 1ull << ARRIVAL_BITS * power,
                                     before = count_arrival(&arrivals[first + begin], one);
            last = (int32_t)(before >> ARRIVAL_BITS * power & ((1u << ARRIVAL_BITS) - 1)) + 1 == members;
            if (last) atomicAdd(&arrivals[first + begin], 0ull - one * (unsigned long long)members);
        }
        on = __shfl_sync((unsigned)ALL_LANES, last, 0, LANES);
        __syncwarp((unsigned)ALL_LANES);
        if (alone || !on) continue;
        rank = begin;
        add_up(first + begin, apart, members);
    }
    return on;
}

/* Terms of a body, term k in lane k, added up (or what Join says) over its island, of bodies that are `on`, whole
 * islands. True in the lanes of one body of each; those have all of the sums in `sum`. Every lane of the warp comes
 * here. */
template <class Join>
static __device__ __forceinline__ bool add_up_island(const graph_view &graph, const island_view &islands,
                                                     const body_thread &t, bool on, double term, double sum[TERMS])
{
    double *own = islands.terms + (size_t)t.slot * TERMS;
    if (on && t.lane < TERMS) own[t.lane] = term;
    const auto add_up = [&](int32_t slot, int64_t apart, int32_t members) {
        double *to = islands.terms + (size_t)slot * TERMS;
        if (t.lane >= TERMS) return;
        double all[SPREAD];
#pragma unroll
        for (int32_t j = 0; j < SPREAD; ++j)
            all[j] = j < members ? __ldcg(to + (size_t)j * (size_t)apart * TERMS + t.lane) : 0;
        term = all[0];
#pragma unroll
        for (int32_t j = 1; j < SPREAD; ++j)
            if (j < members) term = Join::join(term, all[j]);
        to[t.lane] = term;
    };
    const bool last = add_up_by_powers(graph, islands.arrivals, t, on, add_up);
#pragma unroll
    for (int k = 0; k < TERMS; ++k) sum[k] = __shfl_sync((unsigned)ALL_LANES, term, k, LANES);
    return last;
}

/* Where the island of a body begins, and its size, in bodies of a thread block. */
struct island_range {
    int32_t first, bodies;
};

/* The same of all islands of a thread block, whose `bodies` bodies are whole islands: `terms` (shared) holds TERMS of
 * each, and at an island's first body its sums in the end, equal to the last bit. `barrier` is the block's; it comes
 * first and last. */
template <class Join, class Barrier>
static __device__ __forceinline__ void add_up_in_block(int32_t bodies, const island_range *range, double *terms,
                                                       Barrier barrier)
{
    for (int32_t apart = 1; apart < bodies; apart *= SPREAD) {
        barrier();
        for (int32_t i = (int32_t)threadIdx.x; i < bodies * TERMS; i += (int32_t)blockDim.x) {
            const island_range island = range[i / TERMS];
            const int32_t rank = i / TERMS - island.first;
            if (rank % (apart * SPREAD) != 0) continue;
            double all[SPREAD];
#pragma unroll
            for (int32_t j = 0; j < SPREAD; ++j)
                all[j] = rank + j * apart < island.bodies ? terms[i + j * apart * TERMS] : 0;
            double sum = all[0];
#pragma unroll
            for (int32_t j = 1; j < SPREAD; ++j)
                if (rank + j * apart < island.bodies) sum = Join::join(sum, all[j]);
            terms[i] = sum;
        }
    }
    barrier();
}

#endif
