/* Joints that have come apart are closed. */
#ifndef SADMM_WORLD_STEP_JOINT_CLOSE_H
#define SADMM_WORLD_STEP_JOINT_CLOSE_H

#include "world/state/world_state.h"

/* Closes what is locked in world->next, where it is off by much; off: the largest error that is left, m. */
sadmm_status sadmm_world_close_joints(sadmm_world *world, const sadmm_settings *settings, double *off);

#endif
