/* What the caller decides of contacts before they are solved (subadmm/manifold.h). */
#ifndef SADMM_WORLD_STATE_DECIDER_H
#define SADMM_WORLD_STATE_DECIDER_H

#include <stddef.h>
#include <stdint.h>

#include "subadmm/manifold.h"

/* Pairs of shapes, (a << 32) | b by slots, ascending. */
struct sadmm_decided_pairs {
    uint64_t *keys;
    size_t count;
};

struct sadmm_decider {
    sadmm_manifold_callback call; /* NULL: nothing is decided */
    void *context;
    struct sadmm_decided_pairs last, now; /* that had a manifold in the last step; that have one in the step at hand */
};

/* A shape has gone. */
void sadmm_decider_forget(struct sadmm_decider *decider, uint32_t shape);
/* The step is done: what it had is what the last one had. */
void sadmm_decider_turn(struct sadmm_decider *decider);
/* To a world that takes the place of this one. */
void sadmm_decider_hand_on(struct sadmm_decider *from, struct sadmm_decider *to);
void sadmm_decider_free(struct sadmm_decider *decider);

#endif
