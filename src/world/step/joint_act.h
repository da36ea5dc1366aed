/* A joint in a step. */
#ifndef SADMM_WORLD_STEP_JOINT_ACT_H
#define SADMM_WORLD_STEP_JOINT_ACT_H

#include "world/state/world_state.h"

/* The body of a slot, or (-1) the static world, as a joint has it in the (sub-)step at hand. */
struct joint_body sadmm_world_joint_body(const sadmm_world *world, int32_t slot);
/* A (sub-)step's joints are to be found. False: no memory. */
bool sadmm_world_begin_acting(sadmm_world *world, const sadmm_settings *settings);
/* A joint in it, which stays in world->acting_joints until the next one. */
const struct acting_joint *sadmm_world_act_joint(sadmm_world *world, const struct sadmm_world_joint *joint,
                                                 const sadmm_settings *settings);

#endif
