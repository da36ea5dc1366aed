/* The method `fast` in tier BLOCK, where a thread block has whole islands: what a step does before its first iteration
 * and after its last one, by the kernel that iterates. In the other tiers, and for later weight updates, these are
 * kernels of their own (weight/weights.cu, weight/penalty.cu, iterate/energy_limit.cu); the functions are the same, and
 * so are the results, bit for bit. */
#ifndef SADMM_CUDA_ITERATE_PROLOGUE_H
#define SADMM_CUDA_ITERATE_PROLOGUE_H

#include "motions.h"
#include "backend_cuda/weight/factor.h"
#include "backend_cuda/weight/island_sums.h"
#include "backend_cuda/weight/weigh.h"

/* Of a part, in any of its islands: one is floating; one is anchored; a body has too much energy. */
enum part_flags { FLAG_FLOATING, FLAG_ANCHORED, FLAG_CANDIDATES, PART_FLAGS };

/* Whole steps of worlds: no row blocks, at least a warp, and blocks whose threads have registers enough. */
struct block_part {
    int32_t first_body, bodies;
    double *terms;       /* shared: bodies x TERMS */
    island_range *range; /* shared: of bodies */
    int32_t *flags;      /* shared: PART_FLAGS; those that are asked for are 0 at first */
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
static __device__ __forceinline__ void store_first_terms(const cuda_view &v, const cuda_args &args,
                                                         const block_part &part, const body_thread &own)
{
    store_terms(v.graph, part, own,
                [&](const body_thread &t) { return terms_of_body<false, true, false>(v, args, t); });
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
        double C[PACKED];
        cuda_island island = new_island(part.terms + first * TERMS, args);
        const bool cold = weigh_island<false>(&island, part.terms + first * TERMS, args);
        const bool own_sides = i < (int32_t)blockDim.x / LANES;
        weighted_matrix<true>(v, t,
                              own_sides ? fetched : fetch_sides(v.model, v.graph, v.contacts, v.weights, t, t.begin),
                              island, true, C);
        if (!t.live) return;
        if (i == first && t.lane == 0) {
            v.islands.info[v.graph.label[t.body]] = island;
            if (cold) v.model.statistics->cold = 1;
            part.flags[island.anchored] = 1; /* FLAG_FLOATING or FLAG_ANCHORED: a choice would take registers */
        }
        factor_rigid(v.bodies, t.body, t.lane, C);
    });
    barrier();
}

/* What bodies add to their islands' momentum, of floating ones, added up at an island's first body; as by
 * powers (weight/island_sums.h). */
template <class Barrier>
static __device__ __forceinline__ void add_up_momentum(const cuda_view &v, const block_part &part,
                                                       const body_thread &own, Barrier barrier)
{
    for_each_body(v.graph, part, own,
                  [&](const body_thread &t, int32_t) { store_momentum(v, t, is_floating(v, t), true); });
    for (int32_t apart = 1; apart < part.bodies; apart *= SPREAD) {
        barrier();
        for_each_body(v.graph, part, own, [&](const body_thread &t, int32_t i) {
            if (!is_floating(v, t)) return;
            const island_range island = part.range[i];
            const int32_t rank = i - island.first, places = (island.bodies - rank + apart - 1) / apart;
            if (rank % (apart * SPREAD) == 0 && places > 1)
                add_up_places(motion_place(v, t.slot) + MOTION_KNOWN, (size_t)apart * MOTION_TERMS,
                              places < SPREAD ? places : (int32_t)SPREAD, MOMENTUM_SUMS, t.lane);
        });
    }
    __syncwarp((unsigned)ALL_LANES);
}

/* The motions of an island and what they restore, from its sums, momentum included. One thread of it. */
static __device__ __noinline__ void find_motion(const island_view &islands, cuda_island *island, double *place,
                                                const double *term, bool rebounds, bool slows)
{
    struct momentum_motions motions;
    momentum_find_motions((struct momentum_sums *)(place + MOTION_KNOWN), &motions);
    restore_island(islands, island, motions, term, rebounds, slows, place);
}

/* The energy limit, where some body of the part is a candidate, and the momentum of floating islands. */
template <class Barrier>
static __device__ __noinline__ void limit_in_block(const cuda_view &v, bool rebounds, const block_part &part,
                                                   Barrier barrier)
{
    const body_thread own = body_of_slot(v.graph, part.first_body + (int32_t)threadIdx.x / LANES,
                                         (int32_t)threadIdx.x / LANES < part.bodies);
    const bool candidates = part.flags[FLAG_CANDIDATES] != 0;
    store_terms(v.graph, part, own, [&](const body_thread &t) {
        const bool floating = is_floating(v, t), on = candidates || floating;
        return __ballot_sync((unsigned)ALL_LANES, on) != 0 ? energies_of_body<true>(v, t, on) : 0;
    });
    if (part.flags[FLAG_FLOATING]) add_up_momentum(v, part, own, barrier);
    add_up_in_block<add_terms>(part.bodies, part.range, part.terms, barrier);
    for_each_body(v.graph, part, own, [&](const body_thread &t, int32_t i) {
        if (!t.live || t.lane > 0 || i != part.range[i].first) return;
        cuda_island *island = &v.islands.info[v.graph.label[t.body]];
        const double *energies = part.terms + i * TERMS;
        if (!island->anchored) find_motion(v.islands, island, motion_place(v, t.slot), energies, rebounds, true);
        else if (candidates) limit_island(v.islands, island, energies, rebounds, true);
    });
}

#endif
