/* Kinematic bodies of a world that a backend keeps. */
#ifndef SADMM_WORLD_RESIDENT_RESIDENT_KINEMATIC_H
#define SADMM_WORLD_RESIDENT_RESIDENT_KINEMATIC_H

#include "world/state/world_state.h"

/* Kinematic bodies of a world that is about to be loaded, into resident.kinematic. */
sadmm_status sadmm_world_list_kinematic(sadmm_world *world);
/* After the last step done; the velocities that they had in it, into `start`. Nothing is enqueued. */
sadmm_status sadmm_world_read_kinematic(sadmm_world *world);
sadmm_status sadmm_world_read_kinematic_start(sadmm_world *world);

#endif
