/* Couplings: slots, and what may be set. */
#ifndef SADMM_WORLD_OBJECTS_COUPLING_H
#define SADMM_WORLD_OBJECTS_COUPLING_H

#include "world/state/world_state.h"

/* What a step makes a coupling's rows of, by its definition as it is kept. May there be such a coupling? Else
 * INVALID_ARGUMENT, STALE_ID. */
sadmm_status sadmm_world_read_coupling(const sadmm_world *world, struct sadmm_world_coupling *coupling,
                                       struct sadmm_error *error);
/* A target that may be set, else INVALID_ARGUMENT, into the pose and velocity of `target`. velocity: NULL is 0. */
sadmm_status sadmm_world_check_target(const double position[3], const double orientation[4], const double velocity[6],
                                      struct sadmm_rigid *target, struct sadmm_error *error);
/* A coupling in a slot is on its body's list from here on. */
void sadmm_world_link_coupling(sadmm_world *world, size_t slot);
/* The couplings of a body that is removed. */
void sadmm_world_kill_couplings_of(sadmm_world *world, int32_t body);

#endif
