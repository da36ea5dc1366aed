/* Gears: what may be set. */
#ifndef SADMM_WORLD_OBJECTS_GEAR_H
#define SADMM_WORLD_OBJECTS_GEAR_H

#include "world/state/world_state.h"

/* What a gear is between, by its definition. May there be such a gear? Else INVALID_ARGUMENT, STALE_ID. */
sadmm_status sadmm_world_read_gear(const sadmm_world *world, struct sadmm_world_gear *gear, struct sadmm_error *error);

#endif
