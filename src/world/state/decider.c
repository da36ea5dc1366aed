#include "decider.h"

#include "core/base/memory.h"

void sadmm_decider_forget(struct sadmm_decider *decider, uint32_t shape)
{
    struct sadmm_decided_pairs *pairs = &decider->last;
    size_t kept = 0;
    for (size_t k = 0; k < pairs->count; ++k)
        if ((uint32_t)(pairs->keys[k] >> 32) != shape && (uint32_t)pairs->keys[k] != shape)
            pairs->keys[kept++] = pairs->keys[k];
    pairs->count = kept;
}

void sadmm_decider_turn(struct sadmm_decider *decider)
{
    const struct sadmm_decided_pairs last = decider->last;
    decider->last = decider->now;
    decider->now = last;
    decider->now.count = 0;
}

void sadmm_decider_hand_on(struct sadmm_decider *from, struct sadmm_decider *to)
{
    *to = *from;
    *from = (struct sadmm_decider){.call = NULL};
    to->last.count = to->now.count = 0;
}

void sadmm_decider_free(struct sadmm_decider *decider)
{
    sadmm_free(decider->last.keys);
    sadmm_free(decider->now.keys);
}
