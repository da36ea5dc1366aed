/* Bodies that contacts with what does not move hold on to. */
#ifndef SADMM_CUDA_STEP_ANCHORS_H
#define SADMM_CUDA_STEP_ANCHORS_H

#include "backend_cuda/device/double.h"
#include "core/math/momentum.h"

static __device__ __forceinline__ bool is_static(const struct sadmm_contact_pair *pair)
{
    return pair->body_a < 0 || pair->body_b < 0;
}

static __device__ __forceinline__ bool anchors(const cuda_view &v, int32_t body)
{
    const int32_t slot = v.graph.slot_of[body];
    for (int32_t at = v.graph.offsets[slot]; at < v.graph.offsets[slot + 1]; ++at) {
        const int32_t code = v.graph.incident[at];
        if (code / 2 >= v.contacts.pair_capacity) break; /* rows come last */
        const struct sadmm_contact_pair *pair = &v.raw.pairs[code / 2];
        struct arm_sums arms = {};
        if (!is_static(pair)) continue;
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
            add_arm(&arms, code & 1 ? v.raw.points[k].arm_b : v.raw.points[k].arm_a, 1);
        if (momentum_is_anchored(pair->friction, &arms)) return true;
    }
    return false;
}

#endif
