/* The momentum of floating islands (math/momentum.h), and by what their other motions are slowed down: sums
 * over the bodies of an island, and the rigid motion that restores its momentum. In double, from the raw contacts and
 * this precision's b and v; eight lanes a body.
 *
 * Which motions an island may restore does not depend on velocities: where a kernel can run beside the iterations they
 * are found there (energy_limit.cu), and what is left for the end are twelve sums and a few products. */
#ifndef SADMM_CUDA_ITERATE_MOTIONS_H
#define SADMM_CUDA_ITERATE_MOTIONS_H

#include "energies.h"

#include "backend_cuda/weight/island_sums.h"

/* An island's numbers as they lie in memory: at the end the momentum, and the energies of energies.h; before that all
 * sums of math/momentum.h, in whose place the motions come that follow from them. */
enum {
    MOTION_ENERGIES = 6,
    MOTION_END = MOTION_ENERGIES + TERMS, /* numbers of the end */
    MOTION_KNOWN = MOTION_END,
    MOTION_SUMS = MOTION_KNOWN + MOMENTUM_SUMS
};
static_assert(sizeof(struct momentum_sums) == MOMENTUM_SUMS * sizeof(double), "numbers are taken one by one");
static_assert((int)MOTION_SUMS <= (int)MOTION_TERMS, "there is memory for them");
static_assert(1 + 36 + 6 <= (int)MOMENTUM_SUMS, "and for motions in the place of sums");

/* Is the body one of a floating island? */
static __device__ __forceinline__ bool is_floating(const cuda_view &v, const body_thread &t)
{
    return t.live && !v.islands.info[v.graph.label[t.body]].anchored;
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

/* (m I, inertia) of a body. */
static __device__ __forceinline__ void load_inertia(const body_view &bodies, size_t body, double A[PACKED])
{
    const solver_real *line = bodies.lines + body * (size_t)bodies.line;
    for (int k = 0; k < PACKED; ++k) A[k] = 0;
    A[0] = (double)line[0];
    for (int r = 0; r < 3; ++r)
        for (int k = 0; k <= r; ++k) A[packed_place(r + 3, k + 3)] = (double)line[1 + packed_place(r, k)];
}

static __device__ __forceinline__ void load_row(const solver_real *rows, size_t body, double out[6])
{
    for (int k = 0; k < 6; ++k) out[k] = (double)rows[body * ROW + (size_t)k];
}

/* Where the sums of the island begin whose first slot this is. */
static __device__ __forceinline__ double *motion_place(const cuda_view &v, int32_t slot)
{
    return v.islands.motions + (size_t)slot * MOTION_TERMS;
}

/* Functions by themselves: all of them at once would take registers from the kernels that iterate. */

/* What a body adds to the sums for the momentum, to its place; of bodies that are `on`. `iterated`: with its momentum,
 * too. Every lane of the warp comes here. */
static __device__ __noinline__ void store_momentum(const cuda_view &v, const body_thread &t, bool on, bool iterated)
{
    struct momentum_sums own = {};
    double d[3] = {}, A[PACKED], row[6], *to = motion_place(v, t.slot) + MOTION_KNOWN;
    if (on) body_place(v, (int32_t)t.body, v.graph.label[t.body], d);
    for (int32_t at = t.begin + t.lane; on && at < t.end; at += LANES) {
        const int32_t code = v.graph.incident[at], p = code / 2;
        if (p >= v.contacts.pair_capacity) continue;
        const pair_bodies ends = v.contacts.bodies[p];
        if (!is_dynamic(v.model, code & 1 ? ends.body_a : ends.body_b))
            add_static_pair(v.raw, p, code & 1, d, own.gram);
    }
    if (__ballot_sync((unsigned)ALL_LANES, own.gram[MOMENTUM_CONTACTS] > 0) != 0) sum_lanes<PACKED + 1>(own.gram);
    if (!on || t.lane > 0) return;
    load_inertia(v.bodies, t.body, A);
    load_row(v.bodies.b, t.body, row);
    momentum_add_known(&own, d, A, row);
    if (iterated) {
        load_row(v.bodies.state, t.body, row);
        momentum_add_now(own.now, d, A, row);
    }
    const double *numbers = (const double *)&own;
    for (int k = 0; k < MOMENTUM_SUMS; ++k) to[k] = numbers[k];
}

/* What is left of that for the end: the momentum, at the beginning of the place. One lane of the body. */
static __device__ __forceinline__ void store_end_momentum(const cuda_view &v, const body_thread &t, int32_t label)
{
    double d[3], A[PACKED], velocity[6], now[6] = {}, *to = motion_place(v, t.slot);
    body_place(v, (int32_t)t.body, label, d);
    load_inertia(v.bodies, t.body, A);
    load_row(v.bodies.state, t.body, velocity);
    momentum_add_now(now, d, A, velocity);
    for (int k = 0; k < 6; ++k) to[k] = now[k];
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

/* Motions in the place of the sums that they follow from, and back. */
static __device__ __forceinline__ void keep_motions(const struct momentum_motions &motions, double *known)
{
    known[0] = (double)motions.count;
#pragma unroll 1
    for (int k = 0; k < motions.count; ++k) {
        for (int j = 0; j < 6; ++j) known[1 + 6 * k + j] = motions.motion[k][j];
        known[37 + k] = motions.free[k];
    }
}
static __device__ __forceinline__ void take_motions(const double *known, struct momentum_motions *motions)
{
    motions->count = (int)known[0];
    for (int k = 0; k < 6; ++k) { /* all, which are asked for together: what is beyond `count` nobody uses */
        for (int j = 0; j < 6; ++j) motions->motion[k][j] = __ldcg(known + 1 + 6 * k + j);
        motions->free[k] = __ldcg(known + 37 + k);
    }
}

/* The rigid motion that restores the island's momentum, to `place`, and from its energies, where there are any (NULL:
 * none), the island's factor (!slows: 1). motions: with the momentum along them. One thread of it. */
static __device__ __forceinline__ void restore_island(const island_view &islands, cuda_island *island,
                                                      const struct momentum_motions &motions, const double *term,
                                                      bool rebounds, bool slows, double *place)
{
    double factor = 1;
    if (term && !island->rows) {
        const struct momentum_energies rigid = momentum_energies_of(&motions);
        struct island_energies energies = energies_of(term);
        double along = term[4];
        energy_limit_subtract_rigid(&energies, &along, &rigid);
        factor = factor_of(energies, along, rebounds && island->warm);
        if (factor != 1) atomicAdd(islands.limited, 1);
        if (!slows) factor = 1;
    }
    momentum_restoring(&motions, factor, place);
    island->slow_down = factor;
    *islands.moved = 1;
}

/* Adds up `numbers` of every body's place from the `first` one on, by powers, of bodies that are `on`, whole islands.
 * Every lane of the warp comes here. Returns the place of the island in one thread of it, elsewhere NULL. */
static __device__ __forceinline__ double *add_up_motions(const cuda_view &v, const body_thread &t, bool on,
                                                         int32_t first, int32_t numbers)
{
    const bool last =
        add_up_by_powers(v.graph, v.islands.motion_arrivals, t, on, [&](int32_t slot, int64_t apart, int32_t members) {
            add_up_places(motion_place(v, slot) + first, (size_t)apart * MOTION_TERMS, members, numbers, t.lane);
        });
    __syncwarp((unsigned)ALL_LANES);
    return last && t.lane == 0 ? motion_place(v, v.graph.slot_of[v.graph.label[t.body]]) : nullptr;
}

/* The motions of the islands of bodies that are `on`, whole ones. Every lane of the warp comes here. */
static __device__ __forceinline__ void find_motions(const cuda_view &v, const body_thread &t, bool on)
{
    struct momentum_motions motions;
    if (__ballot_sync((unsigned)ALL_LANES, on) == 0) return;
    store_momentum(v, t, on, false);
    double *place = add_up_motions(v, t, on, MOTION_KNOWN, MOMENTUM_SUMS);
    if (!place) return;
    momentum_find_motions((struct momentum_sums *)(place + MOTION_KNOWN), &motions);
    keep_motions(motions, place + MOTION_KNOWN);
}

/* Restores the momentum of the islands of bodies that are `on`, whole ones, along these motions. `energies`: `term` are
 * the lanes' terms of them. Every lane of the warp comes here. */
static __device__ __forceinline__ void restore_islands(const cuda_view &v, const body_thread &t, bool on, bool energies,
                                                       double term, bool rebounds, bool slows)
{
    if (__ballot_sync((unsigned)ALL_LANES, on) == 0) return;
    if (on && energies && t.lane < TERMS) motion_place(v, t.slot)[MOTION_ENERGIES + t.lane] = term;
    const int32_t label = on ? v.graph.label[t.body] : 0;
    if (on && t.lane == 0) store_end_momentum(v, t, label);
    double *place = add_up_motions(v, t, on, 0, energies ? (int32_t)MOTION_END : (int32_t)MOTION_ENERGIES);
    if (!place) return;
    struct momentum_motions motions;
    take_motions(place + MOTION_KNOWN, &motions);
    momentum_measure(&motions, place);
    restore_island(v.islands, &v.islands.info[label], motions, energies ? place + MOTION_ENERGIES : nullptr,
                   rebounds, slows, place);
}

#endif
