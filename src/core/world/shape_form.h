/* What a shape is, apart from what it is like to touch: type, sizes, hull, and where it is. */
#ifndef SADMM_CORE_WORLD_SHAPE_FORM_H
#define SADMM_CORE_WORLD_SHAPE_FORM_H

#include "core/base/error.h"
#include "subadmm/world.h"

/* INVALID_ARGUMENT that names a member of `def`; `orientation`: the definition's, normalised. */
sadmm_status sadmm_shape_form_check(const sadmm_shape_def *def, double orientation[4], struct sadmm_error *error);

#endif
