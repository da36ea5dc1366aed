/* Joints set to positions and speeds: what they hold on one side moves along. */
#ifndef SADMM_WORLD_OBJECTS_JOINT_PLACE_H
#define SADMM_WORLD_OBJECTS_JOINT_PLACE_H

#include "world/state/world_state.h"

/* Of a joint as its bodies are now. */
struct joint_geometry sadmm_world_joint_geometry(const sadmm_world *world, const struct sadmm_world_joint *joint);
/* Positions and speeds of a joint, as in sadmm_joint_state. */
void sadmm_world_read_joint_motion(const sadmm_world *world, const struct sadmm_world_joint *joint, double position[6],
                                   double speed[6]);
/* May the joint in a slot be set to these positions? Else INVALID_ARGUMENT; OUT_OF_MEMORY. Notes whether it changes. */
sadmm_status sadmm_world_check_joint_positions(sadmm_world *world, size_t slot, const double position[6]);
sadmm_status sadmm_world_check_joint_speeds(sadmm_world *world, size_t slot, const double speed[6]);
/* After the checks of all that are set: it is, where it changes. The others keep their positions and speeds. */
sadmm_status sadmm_world_set_joint_positions(sadmm_world *world, size_t slot, const double position[6]);
sadmm_status sadmm_world_set_joint_speeds(sadmm_world *world, size_t slot, const double speed[6]);

#endif
