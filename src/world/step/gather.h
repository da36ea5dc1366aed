/* What a step reads. */
#ifndef SADMM_WORLD_STEP_GATHER_H
#define SADMM_WORLD_STEP_GATHER_H

#include "world/state/world_state.h"

/* Dynamic bodies in slot order into `start` and what else a step works on, and all bodies as collision sees them. */
sadmm_status sadmm_world_gather(sadmm_world *world);
/* The same from one sub-step to the next: from `next`, and without the bodies' slots. substep: the one that
 * has ended. */
void sadmm_world_turn(sadmm_world *world, int substep);
/* Exchange `start` and `last_start`. */
void sadmm_world_swap_starts(sadmm_world *world);
/* substep: the one that contacts are to be found for. */
struct sadmm_collision_input sadmm_world_collision_input(const sadmm_world *world, int substep);
struct sadmm_system sadmm_world_system(sadmm_world *world);
/* SADMM_ERROR_NON_FINITE that names a dynamic body. */
sadmm_status sadmm_world_not_finite(sadmm_world *world, int32_t body);

#endif
