/* Candidate pairs to contacts: manifolds, world frame, impulses of the last step. */
#ifndef SADMM_COLLISION_NARROW_PHASE_H
#define SADMM_COLLISION_NARROW_PHASE_H

#include "candidates.h"

/* Append the contacts of candidates [begin, end) to `out`; `old`: the last step's set. Candidates and old pairs are
 * both sorted by their shapes, so that one pass over each is enough. False when out of memory. */
bool sadmm_narrow_phase(const struct sadmm_candidates *candidates, const struct sadmm_collision_input *input,
                        size_t begin, size_t end, const struct sadmm_contact_set *old, struct sadmm_contact_set *out);

#endif
