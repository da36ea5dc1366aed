/* What contacts give bodies, where no backend says. */
#ifndef SADMM_WORLD_STEP_WRENCHES_H
#define SADMM_WORLD_STEP_WRENCHES_H

#include "world/state/world_state.h"

/* Contact wrenches of dynamic bodies, eq. (12), of the (sub-)step by its points' impulses. */
void sadmm_world_find_wrenches(sadmm_world *world, const sadmm_settings *settings);

#endif
