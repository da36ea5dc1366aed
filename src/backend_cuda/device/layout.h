/* The constraint graph of a step on the device: what is known where, and how it is split among thread blocks.
 *
 * Graph statistics are on the device, speculated ones on the host: launches are sized by the capacities, kernels learn
 * the true counts from `cuda_live` and do nothing once a step of the queue has failed.
 *
 * Bodies have slots, so that an island's bodies are neighbours; where islands do not matter (GRID and STREAM in the
 * method `paper`, but for steps of worlds) a body's slot is its raw index. Pairs and row blocks keep their raw order:
 * the record of pair p is p, that of row block k is pair_capacity + k. A side is a constraint as seen by one of its
 * dynamic bodies: 2 record + side (0 on a, 1 on b).
 *
 * Parts, the shares of thread blocks, are ranges of body slots. With C(i) the sides and bodies before slot i, share p
 * of P of the slots [first, last) begins at the first slot i with C(i) - C(first) >= ceil(p (C(last) - C(first)) / P).
 *   GRID     shares of all slots
 *   BLOCK    the same, moved to the next slot where an island begins
 *   CLUSTER  so for clusters of blocks, whose slots are shared out among their blocks as in GRID
 * A part may be empty.
 */
#ifndef SADMM_CUDA_DEVICE_LAYOUT_H
#define SADMM_CUDA_DEVICE_LAYOUT_H

#include <stdalign.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "tier.h"

struct sadmm_contact_pair;
struct sadmm_contact_point;
struct sadmm_row_constraint;

/* REACH: a shape is not where the step's first sub-step thought it might be (collide/view.h). */
enum cuda_abort {
    ABORT_NONE = 0, ABORT_CAPACITY, ABORT_PARTITION, ABORT_PLAN, ABORT_NON_FINITE, ABORT_REACH, ABORT_HITS
};

/* In device memory; written by begin() (problem level: copied from the host) or by the step's gate (world level). */
struct cuda_live {
    alignas(16) int32_t abort_code;      /* not 0: nothing after this does anything (its reason, enum cuda_abort) */
    int32_t bodies, pairs, points; /* this step's */
};

/* Of the constraint graph; in device memory, copied to the host on demand. */
struct cuda_graph_statistics {
    int32_t islands;         /* bodies connected by constraints; a lone body is one; 0: not counted */
    int32_t island_bodies, island_sides; /* of the largest (each maximum separately) */
    int32_t sides;          /* all */
    int32_t degree;          /* most sides of one body */
    int32_t point_slots;     /* most points of a pair */
    int32_t rough;           /* pairs with friction > 0 */
    int32_t warm;            /* pairs with any impulse != 0 at the start; 0 where the start is cold anyway */
    int32_t cold;            /* fast: not 0: some island starts cold; known once it is weighed */
    int32_t part_sides, part_bodies; /* largest part of the partition made last */
};

/* Both, side by side in device memory and in the staging buffer. */
struct cuda_known {
    struct cuda_live live;
    struct cuda_graph_statistics statistics;
};

/* The host's choice, before the layout is made. */
struct cuda_partition {
    enum sadmm_cuda_tier tier; /* BLOCK, CLUSTER, GRID, STREAM (no parts) */
    int32_t parts;           /* thread blocks */
    int32_t cluster;         /* blocks a cluster, 1: none; parts is a multiple of it */
    int32_t threads;         /* a block */
    int32_t most_sides, most_bodies; /* a part may have; a part with more sets live->abort_code = ABORT_PARTITION */
    size_t shared;           /* bytes a block, for most_sides and most_bodies */
    bool islands;            /* slots by island in GRID and STREAM too */
};

/* What the arrays hold, so that a scene whose pairs are still the same keeps them (one_block). */
struct layout_kept {
    int32_t valid, pairs;
    struct cuda_partition partition;
};

/* Device memory. A side that is none (no pair, a static side) has body and slot `bodies`. */
struct layout_view {
    struct cuda_live *live;
    struct cuda_graph_statistics *statistics;
    const struct sadmm_contact_pair *pairs;
    const struct sadmm_contact_point *points;
    const struct sadmm_row_constraint *constraints; /* given by rows */
    int32_t bodies, pair_capacity, rows; /* as in cuda_view */
    int32_t warm_start;
    int32_t most_blocks; /* that run at once */

    int32_t *label, *degree;                 /* by raw body; label: its island's smallest body */
    int32_t *island_bodies, *island_sides;  /* by label */
    int32_t *side_body, *side_slot, *sorted; /* 2 (pair_capacity + rows): raw body, slot, slots sorted */
    int32_t *sorted_label;                   /* bodies */
    const int32_t *numbers;                  /* 0, 1, ...: at least as many as sides or bodies */
    void *temp;                              /* of the sorts */
    size_t temp_bytes;

    int32_t *body_of, *slot_of, *offsets, *incident, *parts;
    struct layout_kept *kept;
};

/* A layout brought to the host, for tests; arrays of the caller, of bodies, bodies, bodies + 1, two a
 * constraint and parts + 1 elements. */
struct cuda_layout_copy {
    struct cuda_live live;
    struct cuda_graph_statistics statistics;
    int32_t *body_of, *slot_of, *offsets, *incident, *parts;
    bool one_block; /* made by the kernel for small scenes */
};

enum cuda_layout_way {
    CUDA_LAYOUT_GENERAL = 1, /* by the kernels for any size */
    CUDA_LAYOUT_GRAPH = 2    /* both stages enqueued together, captured into a graph */
};

#endif
