/* What joints stiffen bodies by. */
#ifndef SADMM_WORLD_STEP_JOINT_STIFFEN_H
#define SADMM_WORLD_STEP_JOINT_STIFFEN_H

#include "world/state/world_state.h"

/* Stiffness of joints into the bodies of `start`, by the multipliers that rows have. any: bodies whose inertia this
 * changes, by body world->stiffened. */
sadmm_status sadmm_world_stiffen(sadmm_world *world, const sadmm_settings *settings, bool *any);

#endif
