/* Momentum of islands with joints. */
#ifndef SADMM_WORLD_STEP_JOINT_MOMENTUM_H
#define SADMM_WORLD_STEP_JOINT_MOMENTUM_H

#include "world/state/world_state.h"

/* In `next`: islands with joints that contacts touch, once they have been moved. */
sadmm_status sadmm_world_restore_articulated(sadmm_world *world, const sadmm_settings *settings);

#endif
