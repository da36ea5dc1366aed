/* Joints: slots, and what may be set. */
#ifndef SADMM_WORLD_OBJECTS_JOINT_H
#define SADMM_WORLD_OBJECTS_JOINT_H

#include "world/state/world_state.h"

/* Definitions as they are kept: may they be? Else INVALID_ARGUMENT. */
sadmm_status sadmm_world_check_joint_def(const sadmm_joint_def *def, struct sadmm_error *error);
sadmm_status sadmm_world_check_table(const double *positions, const double *forces, int32_t count,
                                     struct sadmm_error *error);
/* May that be set of a joint's coordinate? Else INVALID_ARGUMENT. */
sadmm_status sadmm_world_check_coordinate(const struct sadmm_world_joint *joint, int32_t index,
                                          const sadmm_joint_coordinate *coordinate, struct sadmm_error *error);
/* What joints have beside their slots. */
void sadmm_world_free_tables(sadmm_world *world);
/* Something of a joint has been set: the next step of the backend that keeps the world takes it along. */
sadmm_status sadmm_world_take_update(sadmm_world *world, struct sadmm_world_joint *joint,
                                     enum sadmm_joint_update update);
/* Room for so many slots of joints; false when memory runs out. */
bool sadmm_world_reserve_joints(sadmm_world *world, size_t slots);
/* A joint in a slot is on its bodies' lists, a gear on its joints', from here on. */
void sadmm_world_link_joint(sadmm_world *world, size_t slot);
void sadmm_world_link_gear(sadmm_world *world, size_t slot);
/* Put a joint that has been checked into a slot. */
sadmm_status sadmm_world_insert_joint(sadmm_world *world, const struct sadmm_world_joint *joint, size_t *slot);
/* With its coupling, if it is of one, and the gears on it. */
void sadmm_world_kill_joint(sadmm_world *world, size_t slot);
void sadmm_world_kill_gear(sadmm_world *world, size_t slot);
/* The joints and couplings of a body that is removed. */
void sadmm_world_kill_joints_of(sadmm_world *world, int32_t body);

#endif
