/* What sensors see. */
#ifndef SADMM_WORLD_OBJECTS_SENSOR_H
#define SADMM_WORLD_OBJECTS_SENSOR_H

#include "world/state/world_state.h"

/* What the sensor in a slot sees: its slots into query.slots, ascending. */
sadmm_status sadmm_world_list_seen(sadmm_world *world, size_t slot, size_t *count);

#endif
