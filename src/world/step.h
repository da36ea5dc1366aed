/* Steps. */
#ifndef SADMM_WORLD_STEP_H
#define SADMM_WORLD_STEP_H

#include "world/state/world_state.h"

/* The choice of the kernels, at the first step. */
sadmm_status sadmm_world_choose_backend(sadmm_world *world);

#endif
