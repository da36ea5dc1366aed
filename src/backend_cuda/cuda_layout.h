/* What a step's layout is about: the live counts, facts of the constraint graph, and the partition made from them. */
#ifndef SADMM_CUDA_LAYOUT_H
#define SADMM_CUDA_LAYOUT_H

#include <stddef.h>
#include <stdint.h>

#include "cuda_tier.h"

/* In device memory; written by begin() (problem level: copied from the host) or by the step's gate (world level). */
struct alignas(16) cuda_live {
    int32_t halt;                  /* not 0: nothing after this does anything (its reason, enum cuda_halt) */
    int32_t bodies, pairs, points; /* this step's */
};

enum cuda_halt { HALT_NONE = 0, HALT_ROOM, HALT_PARTITION, HALT_PLAN, HALT_NON_FINITE };

/* Of the constraint graph; in device memory, copied to the host on demand. A half is one constraint as seen by one of
 * its dynamic bodies. */
struct cuda_facts {
    int32_t islands;                     /* bodies joined by constraints; a lone body is one */
    int32_t island_bodies, island_halves; /* of the largest (each maximum separately) */
    int32_t halves;                      /* all */
    int32_t degree;                      /* most halves of one body */
    int32_t point_slots;                 /* most points of a pair */
    int32_t rough;                       /* pairs with friction > 0 */
    int32_t warm;                        /* pairs with any impulse != 0 at the start */
    int32_t part_halves, part_bodies;    /* largest part of the partition made last */
};

/* The host's choice, before the layout is made: the resident kernel's thread blocks ("parts"), each a range of body
 * slots with the halves of those bodies. */
struct cuda_partition {
    enum sadmm_cuda_tier tier;        /* BLOCK, CLUSTER, GRID, STREAM (no parts) */
    int32_t parts;                    /* thread blocks */
    int32_t cluster;                  /* blocks a cluster, 1: none; parts is a multiple of it */
    int32_t threads;                  /* a block */
    int32_t most_halves, most_bodies; /* a part may have; a part with more sets live->halt = HALT_PARTITION */
    size_t shared;                    /* bytes a block, for most_halves and most_bodies */
};

#endif
