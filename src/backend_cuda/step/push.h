/* What contacts say of pushes (core/model/push_law.h). Numbers of islands are whole ones, added up by atomics: they
 * depend on no order. How many reasons there are to push an island goes up and down while pairs speak; each change is
 * seen by the one who makes it, and in the end the sum of all is 0 if no island is to be pushed, and only then. */
#ifndef SADMM_CUDA_STEP_PUSH_H
#define SADMM_CUDA_STEP_PUSH_H

#include "backend_cuda/device/double.h"
#include "core/model/push_law.h"

static __device__ __forceinline__ bool island_is_pushed(const push_view &push, int32_t label)
{
    return push_is_due(push.bits[label], (int64_t)push.units[label]);
}

static __device__ __forceinline__ int32_t label_of(const graph_view &graph, const struct sadmm_contact_pair *pair)
{
    return graph.label[pair->body_a >= 0 ? pair->body_a : pair->body_b];
}

/* Reasons that come, less those that go, with what is said of an island. */
static __device__ __forceinline__ int add_bits_of(int32_t *to, int32_t bits)
{
    if (!(bits & ~*to)) return 0; /* bits only come */
    const int32_t before = atomicOr(to, bits), after = before | bits;
    return (push_stays(after) - push_stays(before)) + ((after & PUSH_MORE) != 0) - ((before & PUSH_MORE) != 0);
}
static __device__ __forceinline__ int add_units_of(unsigned long long *to, int64_t units)
{
    if (units == 0) return 0;
    const int64_t before = (int64_t)atomicAdd(to, (unsigned long long)units);
    return (before + units > 0) - (before > 0);
}

/* A pair, whose deepest point has this separation, to its island; -1: none. Lanes that speak of one island do it
 * together. Every lane of the warp comes here; by itself: the others should not pay in registers. */
static __device__ __noinline__ void report_push(const cuda_view &v, int32_t p, double separation)
{
    const unsigned all = (unsigned)ALL_LANES;
    struct push_share share = {};
    int32_t label = -1;
    if (p >= 0) {
        const struct sadmm_settings *s = v.model.settings;
        const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
        const double *gravity = gravity_of(v.model, pair->body_a >= 0 ? pair->body_a : pair->body_b);
        const double speed = push_speed(s, separation),
                     pull = speed > 0 ? push_pull(v.raw.system.rigid, pair, size3(gravity), !v.model.fast) : 0;
        share = push_share_of(pair, speed, s->correction_factor, pull * s->dt);
        if (share.bits) label = label_of(v.graph, pair);
        if (label >= 0 && v.push.bits[label] & PUSH_ROWS) label = -1;
    }
    const unsigned speak = __ballot_sync(all, label >= 0);
    if (speak == 0) return;
    const int first = __ffs((int)speak) - 1, lane = (int)threadIdx.x % WARP;
    const int32_t common = __shfl_sync(all, label, first, WARP);
    if (__ballot_sync(all, label >= 0 && label != common) == 0) {
        if (label < 0) share = {};
        for (int o = WARP / 2; o > 0; o /= 2) {
            share.bits |= __shfl_xor_sync(all, share.bits, o);
            share.units += (int64_t)__shfl_xor_sync(all, (unsigned long long)share.units, o);
        }
        label = lane == first ? common : -1;
    }
    if (label < 0) return;
    const int change = add_bits_of(&v.push.bits[label], share.bits) + add_units_of(&v.push.units[label], share.units);
    if (change != 0) atomicAdd(v.push.due, change);
}

#endif
