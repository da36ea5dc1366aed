/* Shapes: slots, and what may be set. */
#ifndef SADMM_WORLD_OBJECTS_SHAPE_H
#define SADMM_WORLD_OBJECTS_SHAPE_H

#include "world/state/world_state.h"

/* A shape into a slot that there is room for. body: the slot of a live one. Errors as of
 * sadmm_world_add_shape, with nothing changed. */
sadmm_status sadmm_world_put_shape(sadmm_world *world, size_t slot, int32_t body, const sadmm_shape_def *def,
                                   struct sadmm_error *error);
void sadmm_world_kill_shape(sadmm_world *world, size_t slot);

#endif
