/* The method `fast` in tier BLOCK, where a thread block has whole islands: what a step does before its first iteration and after
 * its last one, by the kernel that iterates. In the other tiers, and for refreshes, these are kernels of their own
 * (cuda_weights.cu, cuda_penalty.cu, cuda_limit.cu); the functions are the same, and so are the results, bit for bit. */
#ifndef SADMM_CUDA_RESIDENT_ENDS_H
#define SADMM_CUDA_RESIDENT_ENDS_H

#include "cuda_energies.h"
#include "cuda_factor.h"
#include "cuda_islands.h"
#include "cuda_weigh.h"

/* Whole steps of worlds: no row blocks, at least a warp, and blocks whose threads have registers enough. */
struct block_part {
    int32_t first_body, bodies;
    double *terms;       /* shared: bodies x TERMS */
    island_range *range; /* shared: of bodies */
    int32_t *suspected;  /* shared: 0 at first */
};

/* use(t, i) for the part's bodies, eight lanes each. Every thread of the block comes here. */
template <class Use>
static __device__ __forceinline__ void for_each_body(const cuda_view &v, const block_part &part, Use use)
{
    const int32_t at_once = (int32_t)blockDim.x / LANES, warp_first = (int32_t)threadIdx.x / WARP * (WARP / LANES);
    for (int32_t first = 0; first + warp_first < part.bodies; first += at_once) {
        const int32_t i = first + (int32_t)threadIdx.x / LANES, slot = part.first_body + i;
        const bool live = i < part.bodies;
        const body_thread t = {slot, (int32_t)threadIdx.x % LANES, live, live ? (size_t)v.body_of[slot] : 0,
                               live ? v.offsets[slot] : 0, live ? v.offsets[slot + 1] : 0};
        use(t, i);
    }
}

static __device__ __forceinline__ void store_term(const cuda_view &v, const block_part &part, const body_thread &t, int32_t i,
                                                 double term)
{
    if (!t.live) return;
    if (t.lane < TERMS) part.terms[i * TERMS + t.lane] = term;
    if (t.lane > 0) return;
    const int32_t label = v.label[t.body];
    const island_range range = {v.slot_of[label] - part.first_body, v.island_bodies[label]};
    part.range[i] = range;
}

/* Weights, C and factors of a solve that begins. */
template <class Barrier>
static __device__ __forceinline__ void begin_in_block(const cuda_view &v, const cuda_args &args, const block_part &part,
                                                      Barrier barrier)
{
    for_each_body(v, part, [&](const body_thread &t, int32_t i) { store_term(v, part, t, i, terms_of_body<false, true, false>(v, t)); });
    add_up_in_block<add_terms>(part.bodies, part.range, part.terms, barrier);
    for_each_body(v, part, [&](const body_thread &t, int32_t i) {
        const int32_t first = t.live ? part.range[i].first : 0;
        const eight_halves halves = fetch_halves(v, t, t.begin); /* on their way while the island is weighed */
        cuda_island island;
        double C[PACKED];
        weigh_island<false>(&island, part.terms + first * TERMS, args);
        weighted_matrix<true>(v, t, halves, island, true, C);
        if (!t.live) return;
        if (i == first && t.lane == 0) v.islands[v.label[t.body]] = island;
        factor_rigid(v, t.body, t.lane, C);
    });
    barrier();
}

/* The limit of energies, where some body of the part was suspected. */
template <class Barrier>
static __device__ __noinline__ void limit_in_block(const cuda_view &v, bool few, const block_part &part, Barrier barrier)
{
    for_each_body(v, part, [&](const body_thread &t, int32_t i) { store_term(v, part, t, i, energies_of_body<true>(v, t)); });
    add_up_in_block<add_terms>(part.bodies, part.range, part.terms, barrier);
    for_each_body(v, part, [&](const body_thread &t, int32_t i) {
        if (t.live && t.lane == 0 && i == part.range[i].first)
            limit_island(v, &v.islands[v.label[t.body]], part.terms + i * TERMS, few);
    });
}

#endif
