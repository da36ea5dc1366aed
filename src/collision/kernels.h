/* What takes the time in contact finding, compiled once per instruction set (SADMM_VARIANT): one source, and the same
 * bits from every variant, since none fuses a multiplication with an addition. */
#ifndef SADMM_COLLISION_KERNELS_H
#define SADMM_COLLISION_KERNELS_H

#include "candidates.h"

struct sadmm_collision_kernels {
    /* Append the contacts of candidates [begin, end) to `out`; `old`: the last step's set. Candidates and old pairs are
     * both sorted by their shapes, so that one pass over each is enough. False when out of memory. */
    bool (*narrow_phase)(const struct sadmm_candidates *candidates, const struct sadmm_collision_input *input,
                         size_t begin, size_t end, const struct sadmm_contact_set *old, struct sadmm_contact_set *out);
};

extern const struct sadmm_collision_kernels sadmm_collision_kernels_baseline;
extern const struct sadmm_collision_kernels sadmm_collision_kernels_avx2; /* only in builds with it */

/* The best one that this machine can run. */
const struct sadmm_collision_kernels *sadmm_collision_kernels_find(void);

#define SADMM_COLLISION_JOIN2(a, b) a##b
#define SADMM_COLLISION_JOIN(a, b) SADMM_COLLISION_JOIN2(a, b)
/* The table that a source compiled per instruction set gives. */
#define SADMM_COLLISION_KERNELS SADMM_COLLISION_JOIN(sadmm_collision_kernels, SADMM_VARIANT)

#endif
