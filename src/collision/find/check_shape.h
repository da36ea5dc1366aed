/* Shapes that contact finding takes. */
#ifndef SADMM_COLLISION_FIND_CHECK_SHAPE_H
#define SADMM_COLLISION_FIND_CHECK_SHAPE_H

#include "collision/shapes/input.h"
#include "core/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* May a shape be of this geometry, on such a body? Else INVALID_ARGUMENT; `name`: what the message calls the geometry,
 * as "def->". Sizes are not checked. */
sadmm_status sadmm_geometry_check(const struct sadmm_geometry *geometry, enum sadmm_motion motion, const char *name,
                                  struct sadmm_error *error);

/* Is the shape in this slot one that collision can work on? Else INVALID_ARGUMENT that names it. Asked for every shape
 * that is new or changed, by whoever takes the input over. */
sadmm_status sadmm_collision_check_shape(const struct sadmm_collision_input *input, size_t slot,
                                         struct sadmm_error *error);

#ifdef __cplusplus
}
#endif
#endif
