/* Contacts at the bodies of a part (step/articulation_block.h). Where parts are small their blocks find them among all
 * pairs, so that they need not wait for the layout of the step; else that has lists of them. */
#ifndef SADMM_CUDA_STEP_ARTICULATION_CONTACTS_H
#define SADMM_CUDA_STEP_ARTICULATION_CONTACTS_H

#include "articulation_block.h"
#include "move.h"

/* A side of a pair. Its impulses are those that the step starts with, which its points have; or those that the
 * iterations have found, which its points do not have yet. */
struct articulation_side {
    int32_t p, first, count, side;
    bool after;
};
static __device__ __forceinline__ const double *arm_of(const cuda_view &v, const articulation_side &s, int32_t k)
{
    const struct sadmm_contact_point *point = &v.raw.points[s.first + k];
    return s.side ? point->arm_b : point->arm_a;
}
static __device__ __forceinline__ vec3 impulse_of(const cuda_view &v, const articulation_side &s, int32_t k)
{
    return s.after ? point_impulse(v.contacts, s.p, k) : v3_load(v.raw.points[s.first + k].impulse);
}

/* Sides of pairs at bodies of a part, ascending: where they begin in v.joints.sides, and how many they are. The first
 * ones are near. */
enum { NEAR_SIDES = 256, ARTICULATION_WARPS = ARTICULATION_THREADS / WARP };
struct articulation_sides {
    int32_t first, count;
    int32_t of_warp[ARTICULATION_WARPS];
    double weight[NEAR_SIDES]; /* B of those that are near (weigh_sides) */
    struct cuda_articulation_side near[NEAR_SIDES];
};

/* Finds them among the pairs of the step: those whose body's part has this label. */
static __device__ __forceinline__ void find_sides(const cuda_view &v, int32_t label, int32_t pairs,
                                                  struct articulation_sides *sides)
{
    const int32_t t = (int32_t)threadIdx.x, warp = t / WARP, lane = t % WARP;
    const int32_t *parts = v.joints.pair_parts;
    int32_t own = 0, found = 0;
#pragma unroll 4
    for (int32_t at = t; at < 2 * pairs; at += ARTICULATION_THREADS) own += parts[at] == label;
    if (own > 0) atomicAdd(&sides->count, own);
    __syncthreads();
    if (sides->count == 0) return;
    if (t == 0) sides->first = atomicAdd(&v.step.control->joints.sides, sides->count);
#pragma unroll 1
    for (int32_t begin = 0; begin < 2 * pairs; begin += ARTICULATION_THREADS) { /* in order */
        const int32_t code = begin + t;
        const bool is = code < 2 * pairs && parts[code] == label;
        const unsigned lanes = __ballot_sync((unsigned)ALL_LANES, is);
        if (lane == 0) sides->of_warp[warp] = __popc(lanes);
        __syncthreads();
        int32_t place = found + __popc(lanes & ((1u << lane) - 1));
        for (int32_t w = 0; w < ARTICULATION_WARPS; ++w) {
            if (w < warp) place += sides->of_warp[w];
            found += sides->of_warp[w];
        }
        if (is) {
            const struct sadmm_contact_pair *pair = &v.raw.pairs[code / 2];
            const struct cuda_articulation_side side = {code, v.joints.entry[code & 1 ? pair->body_b : pair->body_a],
                                                        pair->first, pair->count};
            v.joints.sides[sides->first + place] = side;
            if (place < NEAR_SIDES) sides->near[place] = side;
        }
        __syncthreads();
    }
}

/* Again, as they were found before the iterations. */
static __device__ __forceinline__ void load_sides(const cuda_view &v, const struct cuda_articulation_range &range,
                                                  struct articulation_sides *sides)
{
    const int32_t near = range.count < NEAR_SIDES ? range.count : (int32_t)NEAR_SIDES;
    if (threadIdx.x == 0) sides->first = range.first, sides->count = range.count;
    each(near, [&](int32_t k) { sides->near[k] = v.joints.sides[range.first + k]; });
    __syncthreads();
}

/* B of a side (core/model/articulation.h); speed: that its part's impulses change that by. */
static __device__ __forceinline__ double weight_of_side(const cuda_view &v, const articulation_side &side, double speed)
{
    double load = 0;
#pragma unroll 4
    for (int32_t k = 0; k < side.count; ++k) load += v3_norm(impulse_of(v, side, k));
    return articulation_contact_weight(load, side.count, speed);
}

/* Of those that are near, by a thread each. */
static __device__ __forceinline__ void weigh_sides(const cuda_view &v, bool after, double speed,
                                                   struct articulation_sides *sides)
{
    const int32_t near = sides->count < NEAR_SIDES ? sides->count : (int32_t)NEAR_SIDES;
    each(near, [&](int32_t k) {
        const struct cuda_articulation_side at = sides->near[k];
        const articulation_side side = {at.code / 2, at.first, at.count, at.code & 1, after};
        sides->weight[k] = weight_of_side(v, side, speed);
    });
    __syncthreads();
}

/* Calls f(side, k) for contacts of body e of the part, pairs ascending. SMALL: by the sides of the part; k: the side is
 * near, and that of them; else -1. */
template <bool SMALL, class F>
static __device__ __forceinline__ void each_contact(const cuda_view &v, const articulation_view &p, int32_t e,
                                                    bool after, const struct articulation_sides *sides, const F &f)
{
    if (SMALL) {
#pragma unroll 1
        for (int32_t k = 0; k < sides->count; ++k) {
            const struct cuda_articulation_side at = k < NEAR_SIDES ? sides->near[k] : v.joints.sides[sides->first + k];
            const articulation_side side = {at.code / 2, at.first, at.count, at.code & 1, after};
            if (at.entry == e) f(side, k < NEAR_SIDES ? k : -1);
        }
        return;
    }
    if (v.joints.apart) return; /* there are none */
    const int32_t slot = v.graph.slot_of[p.s.body[e]], end = v.graph.offsets[slot + 1];
#pragma unroll 1
    for (int32_t at = v.graph.offsets[slot]; at < end; ++at) {
        const int32_t code = v.graph.incident[at];
        if (code / 2 >= v.contacts.pair_capacity) break; /* rows come last */
        const struct sadmm_contact_pair *pair = &v.raw.pairs[code / 2];
        const articulation_side side = {code / 2, pair->first, pair->count, code & 1, after};
        f(side, -1);
    }
}

/* Does a contact touch the part? touched: 0 before. */
template <bool SMALL>
static __device__ __forceinline__ bool is_touched(const cuda_view &v, const articulation_view &p,
                                                  const struct articulation_sides *sides, int32_t *touched)
{
    if (SMALL) return sides->count > 0;
    each(p.s.bodies, [&](int32_t e) {
        const int32_t slot = v.graph.slot_of[p.s.body[e]], first = v.graph.offsets[slot];
        if (first < v.graph.offsets[slot + 1] && v.graph.incident[first] / 2 < v.contacts.pair_capacity)
            *touched = 1; /* pairs come first */
    });
    __syncthreads();
    return *touched != 0;
}

#endif
