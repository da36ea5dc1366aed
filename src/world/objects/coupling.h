/* Couplings: what may be set. */
#ifndef SADMM_WORLD_OBJECTS_COUPLING_H
#define SADMM_WORLD_OBJECTS_COUPLING_H

#include "world/state/world_state.h"

/* The numbers of a definition; not its body. */
sadmm_status sadmm_world_check_coupling(const sadmm_coupling_def *def, struct sadmm_error *error);
/* A target that may be set, else INVALID_ARGUMENT, into the pose and velocity of `target`. velocity: NULL is 0. */
sadmm_status sadmm_world_check_target(const double position[3], const double orientation[4], const double velocity[6],
                                      struct sadmm_rigid *target, struct sadmm_error *error);

#endif
