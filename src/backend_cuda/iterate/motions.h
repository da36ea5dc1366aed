/* The momentum of islands that are not held (math/momentum.h), and by what their other motions are slowed down: sums
 * over the bodies of an island, and the rigid motion that restores its momentum. In double, from the raw contacts and
 * this precision's b and v; eight lanes a body. */
#ifndef SADMM_CUDA_ITERATE_MOTIONS_H
#define SADMM_CUDA_ITERATE_MOTIONS_H

#include "energies.h"

#include "backend_cuda/weight/island_sums.h"

/* Sums over an island, as they lie in memory: those of math/momentum.h, then those of energies.h. */
enum { MOTION_ENERGIES = MOMENTUM_SUMS, MOTION_SUMS = MOTION_ENERGIES + TERMS };
static_assert(sizeof(struct momentum_sums) == MOMENTUM_SUMS * sizeof(double), "numbers are taken one by one");
static_assert((int)MOTION_SUMS <= (int)MOTION_TERMS, "there is memory for them");

/* Is the body one of an island that is not held? */
static __device__ __forceinline__ bool is_loose(const cuda_view &v, const body_thread &t)
{
    return t.live && !v.islands.info[v.graph.label[t.body]].held;
}

/* Adds a static pair on `side`, its body at d. */
static __device__ __forceinline__ void add_static_pair(const raw_view &raw, int32_t p, int side, const double d[3],
                                                       double gram[PACKED + 1])
{
    const struct sadmm_contact_pair *pair = &raw.pairs[p];
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        const double *arm = side ? raw.points[k].arm_b : raw.points[k].arm_a,
                     r[3] = {d[0] + arm[0], d[1] + arm[1], d[2] + arm[2]};
        momentum_add_contact(gram, pair->normal, pair->friction, r);
    }
}

/* Of a body at d, but for the gram. One lane of it. */
static __device__ __forceinline__ void add_own_motion(const body_view &bodies, size_t body, const double d[3],
                                                      struct momentum_sums *sums)
{
    const solver_real *line = bodies.lines + body * (size_t)bodies.line;
    double A[PACKED] = {}, velocity[6], b[6];
    A[0] = (double)line[0];
    for (int r = 0; r < 3; ++r)
        for (int k = 0; k <= r; ++k) A[packed_place(r + 3, k + 3)] = (double)line[1 + packed_place(r, k)];
    for (int k = 0; k < 6; ++k) {
        velocity[k] = (double)bodies.state[body * ROW + (size_t)k];
        b[k] = (double)bodies.b[body * ROW + (size_t)k];
    }
    momentum_add_body(sums, d, A, velocity, b);
}

/* Functions by themselves: all of them at once would take registers from the kernels that iterate. */

/* What a body adds to the sums for the momentum, to its place in `motions`; of bodies that are `on`. Every lane of the
 * warp comes here. */
static __device__ __noinline__ void store_momentum(const cuda_view &v, const body_thread &t, bool on)
{
    struct momentum_sums own = {};
    double d[3] = {}, *to = v.islands.motions + (size_t)t.slot * MOTION_TERMS;
    if (on) body_place(v, (int32_t)t.body, v.graph.label[t.body], d);
    for (int32_t at = t.begin + t.lane; on && at < t.end; at += LANES) {
        const int32_t code = v.graph.incident[at], p = code / 2;
        if (p >= v.contacts.pair_capacity) continue;
        const pair_bodies joined = v.contacts.bodies[p];
        if (!is_dynamic(v.model, code & 1 ? joined.body_a : joined.body_b))
            add_static_pair(v.raw, p, code & 1, d, own.gram);
    }
    if (__ballot_sync((unsigned)ALL_LANES, own.gram[MOMENTUM_CONTACTS] > 0) != 0) sum_lanes<PACKED + 1>(own.gram);
    if (!on || t.lane > 0) return;
    add_own_motion(v.bodies, t.body, d, &own);
    const double *numbers = (const double *)&own;
    for (int k = 0; k < MOMENTUM_SUMS; ++k) to[k] = numbers[k];
}

/* The first `numbers` of `members` places in `motions`, `stride` numbers apart, added up in the first one, in order.
 * By the lanes of a body. Many are fetched at once: who waits for one after the other waits longest of all. */
static __device__ __forceinline__ void add_up_places(double *first, size_t stride, int32_t members, int32_t numbers,
                                                     int32_t lane)
{
    enum { AT_ONCE = 3 };
    double sum[MOTION_NUMBERS];
#pragma unroll
    for (int q = 0; q < MOTION_NUMBERS; ++q) sum[q] = lane + q * LANES < numbers ? __ldcg(first + lane + q * LANES) : 0;
#pragma unroll 1
    for (int32_t j = 1; j < members; j += AT_ONCE) {
        double next[AT_ONCE][MOTION_NUMBERS];
#pragma unroll
        for (int i = 0; i < AT_ONCE; ++i)
#pragma unroll
            for (int q = 0; q < MOTION_NUMBERS; ++q)
                next[i][q] = j + i < members && lane + q * LANES < numbers
                                 ? __ldcg(first + (size_t)(j + i) * stride + lane + q * LANES)
                                 : 0;
#pragma unroll
        for (int i = 0; i < AT_ONCE; ++i)
#pragma unroll
            for (int q = 0; q < MOTION_NUMBERS; ++q)
                if (j + i < members) sum[q] += next[i][q];
    }
#pragma unroll
    for (int q = 0; q < MOTION_NUMBERS; ++q)
        if (lane + q * LANES < numbers) first[lane + q * LANES] = sum[q];
}

/* What follows from an island's sums at `sum`, and from those of its energies, where there are any (NULL: none): the
 * rigid motion, there, and the island's factor (!slows: 1). One thread of it. */
static __device__ __noinline__ void find_motion(const island_view &islands, cuda_island *island, double *sum,
                                                const double *term, bool under_iterated, bool slows)
{
    struct momentum_motions motions;
    double factor = 1;
    momentum_find_motions((struct momentum_sums *)sum, &motions);
    if (term) {
        const struct momentum_energies rigid = momentum_energies_of(&motions);
        struct limit_energies energies = {term[0], term[1], 0, term[3], 1, term[2], term[5], 0};
        double along = term[4];
        limit_take_rigid(&energies, &along, &rigid);
        factor = factor_of(energies, along, under_iterated);
        if (factor != 1) atomicAdd(islands.limited, 1);
        if (!slows) factor = 1;
    }
    momentum_restoring(&motions, factor, sum);
    island->slow_down = factor;
    *islands.moved = 1;
}

/* The islands of bodies that are `on`, whole ones. `energies`: `term` are the lanes' terms of them. Every lane of the
 * warp comes here. */
static __device__ __forceinline__ void restore_islands(const cuda_view &v, const body_thread &t, bool on, bool energies,
                                                       double term, bool under_iterated, bool slows)
{
    if (__ballot_sync((unsigned)ALL_LANES, on) == 0) return;
    if (on && energies && t.lane < TERMS)
        v.islands.motions[(size_t)t.slot * MOTION_TERMS + MOTION_ENERGIES + (size_t)t.lane] = term;
    store_momentum(v, t, on);
    const int32_t numbers = energies ? (int32_t)MOTION_SUMS : (int32_t)MOMENTUM_SUMS;
    const bool last =
        add_up_by_powers(v.graph, v.islands.motion_arrivals, t, on, [&](int32_t slot, int64_t apart, int32_t members) {
            add_up_places(v.islands.motions + (size_t)slot * MOTION_TERMS, (size_t)apart * MOTION_TERMS, members,
                          numbers, t.lane);
        });
    __syncwarp((unsigned)ALL_LANES);
    if (!last || t.lane > 0) return;
    const int32_t label = v.graph.label[t.body];
    double *sum = v.islands.motions + (size_t)v.graph.slot_of[label] * MOTION_TERMS;
    find_motion(v.islands, &v.islands.info[label], sum, energies ? sum + MOTION_ENERGIES : nullptr, under_iterated,
                slows);
}

#endif
