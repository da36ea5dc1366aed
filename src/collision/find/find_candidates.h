/* Finds the candidates of a step. */
#ifndef SADMM_COLLISION_FIND_FIND_CANDIDATES_H
#define SADMM_COLLISION_FIND_FIND_CANDIDATES_H

#include "candidates.h"

sadmm_status sadmm_candidates_init(struct sadmm_candidates *c, const struct sadmm_broad_phase_kind *kind,
                                   struct sadmm_error *error);
void sadmm_candidates_free(struct sadmm_candidates *c);

/* Bring proxies, boxes and the list up to date. After a failure the next call starts from scratch. */
sadmm_status sadmm_candidates_update(struct sadmm_candidates *c, const struct sadmm_collision_input *input, int threads,
                                     struct sadmm_error *error);

#endif
