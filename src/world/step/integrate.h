/* States after a step without a solve. */
#ifndef SADMM_WORLD_STEP_INTEGRATE_H
#define SADMM_WORLD_STEP_INTEGRATE_H

#include "world/state/world_state.h"

/* world->next by world->velocity, of bodies that no contact is to be told from. */
void sadmm_world_integrate(sadmm_world *world, const sadmm_settings *settings);

#endif
