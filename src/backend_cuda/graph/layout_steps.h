/* What a thread, a warp or a block does in the layout (graph/layout_kernels.h): shared by the kernels of any size and
 * the one for small scenes. The view's arrays may be in global or shared memory. */
#ifndef SADMM_CUDA_GRAPH_LAYOUT_STEPS_H
#define SADMM_CUDA_GRAPH_LAYOUT_STEPS_H

#include <stddef.h>

#include "layout_kernels.h"

#define LAYOUT_INLINE static __device__ __forceinline__

enum { LAYOUT_WARP = 32 };
#define WHOLE_WARP 0xffffffffu

LAYOUT_INLINE int32_t larger(int32_t a, int32_t b) { return a > b ? a : b; }

/* ---- reductions ------------------------------------------------------------------------------------------------ */

LAYOUT_INLINE int32_t warp_sum(int32_t value)
{
    for (int o = LAYOUT_WARP / 2; o > 0; o /= 2) value += __shfl_xor_sync(WHOLE_WARP, value, o);
    return value;
}

LAYOUT_INLINE int32_t warp_max(int32_t value)
{
    for (int o = LAYOUT_WARP / 2; o > 0; o /= 2) value = larger(value, __shfl_xor_sync(WHOLE_WARP, value, o));
    return value;
}

/* Of one thread, block or launch into what is known so far. */
LAYOUT_INLINE void merge_statistics(struct cuda_graph_statistics *to, const cuda_graph_statistics &own)
{
    if (own.islands) atomicAdd(&to->islands, own.islands);
    if (own.sides) atomicAdd(&to->sides, own.sides);
    if (own.rough) atomicAdd(&to->rough, own.rough);
    if (own.warm) atomicAdd(&to->warm, own.warm);
    if (own.island_bodies) atomicMax(&to->island_bodies, own.island_bodies);
    if (own.island_sides) atomicMax(&to->island_sides, own.island_sides);
    if (own.degree) atomicMax(&to->degree, own.degree);
    if (own.point_slots) atomicMax(&to->point_slots, own.point_slots);
}

/* Graph statistics of the block's threads into *block (shared memory, 0 before). Every thread comes here. */
LAYOUT_INLINE void gather_statistics(struct cuda_graph_statistics *block, const cuda_graph_statistics &own)
{
    cuda_graph_statistics warp = {};
    warp.islands = warp_sum(own.islands);
    warp.sides = warp_sum(own.sides);
    warp.rough = warp_sum(own.rough);
    warp.warm = warp_sum(own.warm);
    warp.island_bodies = warp_max(own.island_bodies);
    warp.island_sides = warp_max(own.island_sides);
    warp.degree = warp_max(own.degree);
    warp.point_slots = warp_max(own.point_slots);
    if (threadIdx.x % LAYOUT_WARP == 0) merge_statistics(block, warp);
    __syncthreads();
}

/* ---- islands --------------------------------------------------------------------------------------------------- */

/* Parents only ever get smaller, on the way to the root, so an old one is as good as a new one. Several threads read
 * and write them at once. SHARED: in a block's memory, atomically; else they are read past the caches of
 * multiprocessors: atomics on the root of a large island would queue up. */
template <bool SHARED> LAYOUT_INLINE int32_t parent_of(const int32_t *parents, int32_t i)
{
    return SHARED ? atomicAdd(const_cast<int32_t *>(&parents[i]), 0) : *(const volatile int32_t *)&parents[i];
}

template <bool SHARED> LAYOUT_INLINE int32_t root_of(const int32_t *parents, int32_t i)
{
    for (int32_t up = parent_of<SHARED>(parents, i); up != i; up = parent_of<SHARED>(parents, i)) i = up;
    return i;
}

/* The same, halving the way for those who come later. */
template <bool SHARED> LAYOUT_INLINE int32_t root_of_halving(int32_t *parents, int32_t i)
{
    for (int32_t up = parent_of<SHARED>(parents, i); up != i;) {
        int32_t next = parent_of<SHARED>(parents, up);
        if (next != up) atomicMin(&parents[i], next); /* i is no root: nobody hooks it now */
        i = up;
        up = next;
    }
    return i;
}

/* Hook the larger root under the smaller one. */
template <bool SHARED> LAYOUT_INLINE void join_bodies(int32_t *parents, int32_t a, int32_t b)
{
    a = root_of_halving<SHARED>(parents, a);
    b = root_of_halving<SHARED>(parents, b);
    while (a != b) {
        int32_t high = larger(a, b), low = a + b - high, before = atomicCAS(&parents[high], high, low);
        if (before == high) return;
        a = root_of_halving<SHARED>(parents, before); /* somebody else has hooked it meanwhile */
        b = root_of_halving<SHARED>(parents, low);
    }
}

/* ---- statistics ----------------------------------------------------------------------------------------------------
 */

LAYOUT_INLINE void clear_body(const layout_view &v, int32_t i)
{
    v.label[i] = i;
    v.degree[i] = v.island_bodies[i] = v.island_sides[i] = 0;
}

LAYOUT_INLINE bool starts_warm(const layout_view &v, int32_t first, int32_t count)
{
    for (int32_t k = 0; k < count; ++k) {
        const double *impulse = v.points[first + k].impulse;
        if (impulse[0] != 0 || impulse[1] != 0 || impulse[2] != 0) return true;
    }
    return false;
}

/* What a pair joins, two numbers at a time: threads ask for neighbours, which are far apart, and what counts is how
 * often. */
struct pair_about {
    int2 bodies, points; /* a, b; first, count */
};
LAYOUT_INLINE pair_about load_about(const sadmm_contact_pair *pair)
{
    static_assert(offsetof(sadmm_contact_pair, body_b) == 4 && offsetof(sadmm_contact_pair, first) % 8 == 0 &&
                      offsetof(sadmm_contact_pair, count) == offsetof(sadmm_contact_pair, first) + 4,
                  "neighbours");
    const pair_about about = {*(const int2 *)&pair->body_a, *(const int2 *)&pair->first};
    return about;
}

/* What may differ between steps of the same pairs. */
LAYOUT_INLINE void statistics_of_pair(const layout_view &v, const pair_about &about, double friction,
                                      cuda_graph_statistics *own)
{
    own->point_slots = larger(own->point_slots, about.points.y);
    own->rough += friction > 0;
    if (v.warm_start) own->warm += starts_warm(v, about.points.x, about.points.y);
}

/* A pair (record < pairs), a row block (record >= pair_capacity) or none. */
template <bool SHARED>
LAYOUT_INLINE void statistics_of_record(const layout_view &v, int32_t record, int32_t pairs, bool islands,
                                        cuda_graph_statistics *own)
{
    int32_t body[2] = {-1, -1};
    if (record < pairs) {
        const pair_about about = load_about(&v.pairs[record]);
        body[0] = about.bodies.x;
        body[1] = about.bodies.y;
        statistics_of_pair(v, about, v.pairs[record].friction, own);
    } else if (record >= v.pair_capacity) {
        const sadmm_row_constraint &constraint = v.constraints[record - v.pair_capacity];
        body[0] = constraint.body_a;
        body[1] = constraint.body_b;
    }
    for (int side = 0; side < 2; ++side) {
        bool is_side = body[side] >= 0;
        v.side_body[2 * record + side] = is_side ? body[side] : v.bodies;
        if (!is_side) continue;
        atomicAdd(&v.degree[body[side]], 1);
        ++own->sides;
    }
    if (!islands || body[0] < 0 || body[1] < 0) return;
    /* In global memory threads would contend for roots: they only hook here, and join_record does the rest. */
    if (SHARED) join_bodies<SHARED>(v.label, body[0], body[1]);
    else atomicMin(&v.label[larger(body[0], body[1])], body[0] < body[1] ? body[0] : body[1]);
}

/* Once every body is hooked under the smallest of those that it touches: hook it right under its root. By pointer
 * jumping, since the trees of bodies in a row are as deep as there are bodies. */
LAYOUT_INLINE void flatten_body(const layout_view &v, int32_t i)
{
    volatile int32_t *own = &v.label[i];
    for (int32_t up = *own, next; (next = parent_of<false>(v.label, up)) != up; up = next) *own = next;
}

/* Join what hooking has left apart: a body has one parent, but touches several. */
LAYOUT_INLINE void join_record(const layout_view &v, int32_t record)
{
    const int2 body = ((const int2 *)v.side_body)[record];
    if (body.x < v.bodies && body.y < v.bodies) join_bodies<false>(v.label, body.x, body.y);
}

/* The running total is largest when it is complete: the statistics do not depend on who comes last. */
LAYOUT_INLINE void add_to_island(const layout_view &v, int32_t label, int32_t bodies, int32_t sides,
                                 cuda_graph_statistics *own)
{
    own->island_bodies = larger(own->island_bodies, atomicAdd(&v.island_bodies[label], bodies) + bodies);
    own->island_sides = larger(own->island_sides, atomicAdd(&v.island_sides[label], sides) + sides);
}

/* Label body i; `own` gets what is known of bodies and islands. Every lane of the warp comes here, i ascending. */
template <bool SHARED>
LAYOUT_INLINE void statistics_of_body(const layout_view &v, int32_t i, bool islands, cuda_graph_statistics *own)
{
    const bool live = i < v.bodies;
    const int32_t degree = live ? v.degree[i] : 0;
    own->degree = larger(own->degree, degree);
    if (!islands) return;
    const int32_t label = live ? root_of<SHARED>(v.label, i) : -1;
    if (live) atomicMin(&v.label[i], label); /* its root: no larger than what is there */
    own->islands += live && label == i;
    /* Neighbours are mostly of one island: those of the first lane's go together. */
    const bool together = label == __shfl_sync(WHOLE_WARP, label, 0, LAYOUT_WARP);
    const int32_t bodies = warp_sum(together), sides = warp_sum(together ? degree : 0);
    if (!live) return;
    if (i % LAYOUT_WARP == 0) add_to_island(v, label, bodies, sides, own);
    else if (!together) add_to_island(v, label, 1, degree, own);
}

/* ---- parts ----------------------------------------------------------------------------------------------------- */

/* First slot of share p of P of the slots [first, last). */
LAYOUT_INLINE int32_t share_begin(const int32_t *offsets, int32_t first, int32_t last, int32_t p, int32_t P)
{
    const int64_t before = (int64_t)offsets[first] + first, all = (int64_t)offsets[last] + last - before;
    const int64_t target = before + (p * all + P - 1) / P;
    while (first < last) {
        int32_t middle = first + (last - first) / 2;
        if ((int64_t)offsets[middle] + middle < target) first = middle + 1;
        else last = middle;
    }
    return first;
}

/* The first slot from s on where an island begins. An island's first body, in slots as in raw order, is its label. */
LAYOUT_INLINE int32_t island_from(const layout_view &v, int32_t s)
{
    if (s == v.bodies) return s;
    const int32_t label = v.label[v.body_of[s]], head = v.slot_of[label];
    return head == s ? s : head + v.island_bodies[label];
}

LAYOUT_INLINE int32_t part_begin(const layout_view &v, const cuda_partition &partition, int32_t p)
{
    const int32_t n = v.bodies, each = partition.cluster, clusters = partition.parts / each;
    if (partition.tier == SADMM_CUDA_TIER_GRID) return share_begin(v.offsets, 0, n, p, partition.parts);
    const int32_t first = island_from(v, share_begin(v.offsets, 0, n, p / each, clusters));
    if (p % each == 0) return first;
    const int32_t last = island_from(v, share_begin(v.offsets, 0, n, p / each + 1, clusters));
    return share_begin(v.offsets, first, last, p % each, each);
}

/* Parts, their largest, and whether all fit. Every thread of the one block (of `threads`) comes here; `most` (shared):
 * two numbers. */
LAYOUT_INLINE void make_parts(const layout_view &v, const cuda_partition &partition, int32_t threads, int32_t *most)
{
    const int32_t t = (int32_t)threadIdx.x;
    int32_t sides = 0, bodies = 0;
    if (t < 2) most[t] = 0;
    __syncthreads();
    for (int32_t p = t; p <= partition.parts; p += threads) {
        const int32_t begin = part_begin(v, partition, p);
        v.parts[p] = begin;
        if (p == partition.parts) continue;
        const int32_t end = part_begin(v, partition, p + 1);
        sides = larger(sides, v.offsets[end] - v.offsets[begin]);
        bodies = larger(bodies, end - begin);
    }
    sides = warp_max(sides);
    bodies = warp_max(bodies);
    if (t % LAYOUT_WARP == 0) {
        atomicMax(&most[0], sides);
        atomicMax(&most[1], bodies);
    }
    __syncthreads();
    if (t > 0) return;
    v.statistics->part_sides = most[0];
    v.statistics->part_bodies = most[1];
    if (most[0] > partition.most_sides || most[1] > partition.most_bodies) v.live->abort_code = ABORT_PARTITION;
}

#endif
