/* Gears: what may be set. */
#ifndef SADMM_WORLD_OBJECTS_GEAR_H
#define SADMM_WORLD_OBJECTS_GEAR_H

#include "world/state/world_state.h"

/* May there be such a gear? Else INVALID_ARGUMENT, STALE_ID. */
sadmm_status sadmm_world_check_gear(const sadmm_world *world, const sadmm_gear_def *def, struct sadmm_error *error);

#endif
