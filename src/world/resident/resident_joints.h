/* Joints of a world that a backend keeps. */
#ifndef SADMM_WORLD_RESIDENT_RESIDENT_JOINTS_H
#define SADMM_WORLD_RESIDENT_RESIDENT_JOINTS_H

#include "world/state/world_state.h"

/* Joints of a world that is about to be loaded, into resident.joints and what is beside it. */
sadmm_status sadmm_world_list_joints(sadmm_world *world);
/* A joint's coordinate, whether it is enabled, or its target has been set: the next step takes it along. False: the
 * backend has no room for its rows, the world is to be detached. */
bool sadmm_world_update_joint(sadmm_world *world, struct sadmm_world_joint *joint, enum sadmm_joint_update update);
/* Gears, once joints are listed. */
sadmm_status sadmm_world_list_gears(sadmm_world *world);
void sadmm_world_update_gear(sadmm_world *world, struct sadmm_world_gear *gear);
/* Updates into resident.updates, from *count on. */
sadmm_status sadmm_world_list_joint_updates(sadmm_world *world, size_t *count);
void sadmm_world_forget_joint_updates(sadmm_world *world);
/* As of bodies: what was set for steps that have not been done. */
void sadmm_world_update_joints_again(sadmm_world *world);
/* What joints keep; the last step's rows. Nothing is enqueued. */
sadmm_status sadmm_world_read_joints(sadmm_world *world);
sadmm_status sadmm_world_read_rows(sadmm_world *world);

#endif
