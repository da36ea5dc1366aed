/* States after a step without a solve. */
#ifndef SADMM_WORLD_STEP_INTEGRATE_H
#define SADMM_WORLD_STEP_INTEGRATE_H

#include "world/state/world_state.h"

/* world->next by world->velocity; of islands with joints all but poses and velocities. ncp: has solved the islands.
 * Errors: OUT_OF_MEMORY. */
sadmm_status sadmm_world_integrate(sadmm_world *world, const struct sadmm_system *system,
                                   const sadmm_settings *settings, const struct sadmm_ncp *ncp);

#endif
