/* What contacts that roll keep. */
#ifndef SADMM_WORLD_STEP_ROLLING_H
#define SADMM_WORLD_STEP_ROLLING_H

#include "world/state/world_state.h"

/* What contacts that roll leave their bodies for the next (sub-)step. */
void sadmm_world_keep_rolling(sadmm_world *world, double dt);

#endif
