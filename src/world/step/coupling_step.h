/* What couplings keep from step to step. */
#ifndef SADMM_WORLD_STEP_COUPLING_STEP_H
#define SADMM_WORLD_STEP_COUPLING_STEP_H

#include "world/state/world_state.h"

/* What couplings kept of the last step into what they keep of this one. */
void sadmm_world_begin_couplings(sadmm_world *world);
/* A (sub-)step of dt is over: targets move on. */
void sadmm_world_move_targets(sadmm_world *world, double dt);
/* The step of so many sub-steps is done. */
void sadmm_world_commit_couplings(sadmm_world *world, int substeps);

#endif
