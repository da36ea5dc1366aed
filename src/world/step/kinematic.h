/* Kinematic bodies in a step. */
#ifndef SADMM_WORLD_STEP_KINEMATIC_H
#define SADMM_WORLD_STEP_KINEMATIC_H

#include "world/state/world_state.h"

/* Kinematic bodies in slot order into `kinematic` and `start`, and numbers of theirs for collision, which has their
 * poses. */
sadmm_status sadmm_world_gather_kinematic(sadmm_world *world);
/* A kinematic body has come (change 1) or gone (-1). */
static inline void sadmm_world_count_kinematic(sadmm_world *world, int32_t change)
{
    world->kinematic_count += change;
    world->kinematic_listed = false;
}
/* Islands that a kinematic body supports are solved relative to its motion: system->support_motion, and
 * system->velocity less that; and back. */
sadmm_status sadmm_world_enter_support_frame(sadmm_world *world, struct sadmm_system *system);
void sadmm_world_leave_support_frame(sadmm_world *world, const struct sadmm_system *system);
/* Where they are after the (sub-)step. NON_FINITE. */
sadmm_status sadmm_world_move_kinematic(sadmm_world *world, const sadmm_settings *settings);
/* The next sub-step begins there. */
void sadmm_world_turn_kinematic(sadmm_world *world);
/* What the (sub-)step's contacts give kinematic bodies. */
void sadmm_world_add_kinematic_wrenches(sadmm_world *world, const sadmm_settings *settings);
/* The step is done. */
void sadmm_world_commit_kinematic(sadmm_world *world);
/* SADMM_ERROR_NON_FINITE that names the body of a slot. */
sadmm_status sadmm_world_slot_not_finite(sadmm_world *world, int32_t slot);

#endif
