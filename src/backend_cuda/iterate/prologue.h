/* The method `fast` in tier BLOCK, where a thread block has whole islands: what a step does before its first iteration
 * and after its last one, by the kernel that iterates. In the other tiers, and for refreshes, these are kernels of
 * their own (weight/weights.cu, weight/penalty.cu, iterate/limit.cu); the functions are the same, and so are the
 * results, bit for bit. */
#ifndef SADMM_CUDA_ITERATE_PROLOGUE_H
#define SADMM_CUDA_ITERATE_PROLOGUE_H

#include "motions.h"
#include "backend_cuda/weight/factor.h"
#include "backend_cuda/weight/island_sums.h"
#include "backend_cuda/weight/weigh.h"

/* Whole steps of worlds: no row blocks, at least a warp, and blocks whose threads have registers enough. */
struct block_part {
    int32_t first_body, bodies;
    double *terms;       /* shared: bodies x TERMS */
    island_range *range; /* shared: of bodies */
    int32_t *suspected;  /* shared: 0 at first; whether there may be something to do for the limit. The next: scratch */
};

/* use(t, i) for the part's bodies, eight lanes each; `own`: the thread's first. Every thread of the block comes
 * here. */
template <class Use>
static __device__ __forceinline__ void for_each_body(const graph_view &graph, const block_part &part,
                                                     const body_thread &own, Use use)
{
    const int32_t at_once = (int32_t)blockDim.x / LANES, warp_first = (int32_t)threadIdx.x / WARP * (WARP / LANES);
    for (int32_t first = 0; first + warp_first < part.bodies; first += at_once) {
        const int32_t i = first + (int32_t)threadIdx.x / LANES;
        use(first == 0 ? own : body_of_slot(graph, part.first_body + i, i < part.bodies), i);
    }
}

/* terms(t) of the part's bodies, and where their islands are. */
template <class Terms>
static __device__ __forceinline__ void store_terms(const graph_view &graph, const block_part &part,
                                                   const body_thread &own, Terms terms)
{
    for_each_body(graph, part, own, [&](const body_thread &t, int32_t i) {
        const int32_t label = graph.label[t.body]; /* on its way meanwhile */
        const double term = terms(t);
        if (!t.live) return;
        const island_range range = {graph.slot_of[label] - part.first_body, graph.island_bodies[label]};
        if (t.lane < TERMS) part.terms[i * TERMS + t.lane] = term;
        if (t.lane == 0) part.range[i] = range;
    });
}

/* What a solve begins with: terms of its bodies; then the weights, C and factors that follow. */
static __device__ __forceinline__ void store_first_terms(const cuda_view &v, const block_part &part,
                                                         const body_thread &own)
{
    store_terms(v.graph, part, own, [&](const body_thread &t) { return terms_of_body<false, true, false>(v, t); });
}
template <class Barrier>
static __device__ __forceinline__ void weigh_in_block(const cuda_view &v, const cuda_args &args, const block_part &part,
                                                      const body_thread &own, Barrier barrier)
{
    /* On their way while terms are added up. */
    const eight_sides fetched = fetch_sides(v.model, v.graph, v.contacts, v.weights, own, own.begin);
    add_up_in_block<add_terms>(part.bodies, part.range, part.terms, barrier);
    for_each_body(v.graph, part, own, [&](const body_thread &t, int32_t i) {
        const int32_t first = t.live ? part.range[i].first : 0;
        cuda_island island;
        double C[PACKED];
        weigh_island<false>(&island, part.terms + first * TERMS, args);
        const bool own_sides = i < (int32_t)blockDim.x / LANES;
        weighted_matrix<true>(v, t,
                              own_sides ? fetched : fetch_sides(v.model, v.graph, v.contacts, v.weights, t, t.begin),
                              island, true, C);
        if (!t.live) return;
        if (i == first && t.lane == 0) {
            v.islands.info[v.graph.label[t.body]] = island;
            part.suspected[island.held] = 1; /* a choice would take registers */
        }
        factor_rigid(v.bodies, t.body, t.lane, C);
    });
    barrier();
}

/* The limit of energies, where some body of the part was suspected, and the momentum of islands that are not held. */
template <class Barrier>
static __device__ __noinline__ void limit_in_block(const cuda_view &v, bool under_iterated, const block_part &part,
                                                   Barrier barrier)
{
    const body_thread own = body_of_slot(v.graph, part.first_body + (int32_t)threadIdx.x / LANES,
                                         (int32_t)threadIdx.x / LANES < part.bodies);
    store_terms(v.graph, part, own, [&](const body_thread &t) { return energies_of_body<true, false>(v, t); });
    add_up_in_block<add_terms>(part.bodies, part.range, part.terms, barrier);
    for_each_body(v.graph, part, own, [&](const body_thread &t, int32_t i) {
        if (t.live && t.lane == 0 && i == part.range[i].first && v.islands.info[v.graph.label[t.body]].held)
            limit_island(v.islands, &v.islands.info[v.graph.label[t.body]], part.terms + i * TERMS, under_iterated,
                         true);
    });
    for_each_body(v.graph, part, own,
                  [&](const body_thread &t, int32_t) {
                      restore_islands<true>(v, t, is_loose(v, t), under_iterated, true);
                  });
}

#endif
