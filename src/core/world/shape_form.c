#include "shape_form.h"

#include "collision/geometry.h"
#include "core/base/check.h"

sadmm_status sadmm_shape_form_check(const sadmm_shape_def *def, double orientation[4], struct sadmm_error *error)
{
    if ((int)def->type < 0 || def->type >= SADMM_SHAPE_TYPE_COUNT)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->type = %d: must be in [0, %d)", (int)def->type,
                          SADMM_SHAPE_TYPE_COUNT);
    if (def->type == SADMM_SHAPE_HULL && !def->hull)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->hull = NULL: must be given where def->type is %d",
                          SADMM_SHAPE_HULL);
    if (def->type != SADMM_SHAPE_HULL && def->hull)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->hull: must be NULL where def->type is %d, not %d",
                          (int)def->type, SADMM_SHAPE_HULL);
    for (int k = 0; k < geometry_sizes(def->type); ++k)
        if (!(def->size[k] >= 1e-6 && def->size[k] <= 1e6))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->size[%d] = %g: must be in [1e-6, 1e6] m", k,
                              def->size[k]);
    TRY(sadmm_check_vector("def->position", def->position, 3, 1e6, error));
    return sadmm_check_orientation("def->orientation", def->orientation, orientation, error);
}
