/* Shapes: slots, and what may be set. */
#ifndef SADMM_WORLD_OBJECTS_SHAPE_H
#define SADMM_WORLD_OBJECTS_SHAPE_H

#include "world/state/world_state.h"

/* A shape into a slot that there is room for. body: the slot of a live one. Errors as of
 * sadmm_world_add_shape, with nothing changed. */
sadmm_status sadmm_world_put_shape(sadmm_world *world, size_t slot, int32_t body, const sadmm_shape_def *def,
                                   struct sadmm_error *error);
void sadmm_world_kill_shape(sadmm_world *world, size_t slot);

/* Sizes, 0 where the type has none; may they be set? */
void sadmm_world_read_shape_size(const sadmm_world *world, size_t slot, double size[3]);
sadmm_status sadmm_world_check_shape_size(const sadmm_world *world, size_t slot, const double size[3],
                                          struct sadmm_error *error);
/* May position and orientation in the body's frame be set? */
sadmm_status sadmm_world_check_shape_frame(const double position[3], const double orientation[4],
                                           struct sadmm_error *error);

#endif
