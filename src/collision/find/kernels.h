/* What takes the time in contact finding, compiled once per instruction set (SADMM_VARIANT): one source, and the same
 * bits from every variant, since none fuses a multiplication with an addition. */
#ifndef SADMM_COLLISION_FIND_KERNELS_H
#define SADMM_COLLISION_FIND_KERNELS_H

#include "candidates.h"

/* Pose and box of the slots [begin, end); the entry, enlarged, where the old one does not hold the box any more. */
typedef void sadmm_place_slots(struct sadmm_candidates *candidates, const struct sadmm_collision_input *input,
                               size_t begin, size_t end, bool renew);
/* Append the contacts of candidates [begin, end) to `out`; `old`: the last step's set. Candidates and old pairs are
 * both sorted by their shapes, so that one pass over each is enough. False when out of memory. */
typedef bool sadmm_narrow_phase(const struct sadmm_candidates *candidates, const struct sadmm_collision_input *input,
                                size_t begin, size_t end, const struct sadmm_contact_set *old,
                                struct sadmm_contact_set *out);

struct sadmm_collision_kernels {
    const char *variant;
    sadmm_place_slots *place_slots;
    sadmm_narrow_phase *narrow_phase;
};

#define SADMM_COLLISION_JOIN2(a, b) a##b
#define SADMM_COLLISION_JOIN(a, b) SADMM_COLLISION_JOIN2(a, b)
/* A symbol of this variant. */
#define SADMM_COLLISION_KERNEL(name) SADMM_COLLISION_JOIN(sadmm_##name, SADMM_VARIANT)

extern sadmm_place_slots sadmm_place_slots_baseline, sadmm_place_slots_avx2;
extern sadmm_narrow_phase sadmm_narrow_phase_baseline, sadmm_narrow_phase_avx2;

#endif
