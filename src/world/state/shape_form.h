/* What a shape is, apart from what it is like to touch: type, sizes, hull, and where it is. */
#ifndef SADMM_WORLD_STATE_SHAPE_FORM_H
#define SADMM_WORLD_STATE_SHAPE_FORM_H

#include "collision/shapes/shape.h"
#include "core/base/error.h"
#include "core/base/growing.h"
#include "subadmm/types.h"
#include "world_state.h"

extern const struct sadmm_growing sadmm_growing_shape;

/* INVALID_ARGUMENT that names a member of `def`; `orientation`: the definition's, normalised. */
sadmm_status sadmm_shape_form_check(const sadmm_shape_def *def, double orientation[4], struct sadmm_error *error);
/* What a checked definition is to contact finding: its geometry, without the place of a block; and where that is in the
 * frame that the definition is given in: hulls and meshes are in the frame of the box around them. */
struct sadmm_geometry sadmm_shape_form_geometry(const sadmm_shape_def *def);
void sadmm_shape_form_place(const sadmm_shape_def *def, const double orientation[4], double position_of_geometry[3],
                            double orientation_of_geometry[4]);

/* Of a shape of a world: position and orientation in the body's frame, as in the definition. */
void sadmm_world_read_shape_frame(const sadmm_world *world, size_t slot, double frame[7]);

#endif
