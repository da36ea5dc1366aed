/* Joints: what may be set of them. */
#ifndef SADMM_WORLD_OBJECTS_JOINT_H
#define SADMM_WORLD_OBJECTS_JOINT_H

#include "world/state/world_state.h"

/* A joint's bodies and frames, by its definition as it is kept. May there be such a joint? Else INVALID_ARGUMENT,
 * STALE_ID. */
sadmm_status sadmm_world_read_joint(const sadmm_world *world, struct sadmm_world_joint *joint,
                                    struct sadmm_error *error);
sadmm_status sadmm_world_check_table(const double *positions, const double *forces, int32_t count,
                                     struct sadmm_error *error);
/* May that be set of a joint's coordinate? Else INVALID_ARGUMENT. */
sadmm_status sadmm_world_check_coordinate(const struct sadmm_world_joint *joint, int32_t index,
                                          const sadmm_joint_coordinate *coordinate, struct sadmm_error *error);
/* Its frames in its bodies, of a and of b: position and orientation each, one behind the other. May they be set? Else
 * INVALID_ARGUMENT. */
enum { SADMM_JOINT_FRAME_NUMBERS = 14 };
void sadmm_world_read_joint_frames(const struct sadmm_world_joint *joint, double *row);
sadmm_status sadmm_world_check_joint_frames(const double *row, struct sadmm_error *error);
sadmm_status sadmm_world_set_joint_frames(sadmm_world *world, struct sadmm_world_joint *joint, const double *row);
/* Something of a joint has been set: the next step of the backend that keeps the world takes it along. */
sadmm_status sadmm_world_take_update(sadmm_world *world, struct sadmm_world_joint *joint,
                                     enum sadmm_joint_update update);

#endif
