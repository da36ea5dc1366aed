#include "collision.h"

#include <stdio.h>

#include "collision_table.h"
#include "geometry.h"
#include "hull_data.h"

sadmm_status sadmm_geometry_check(const struct sadmm_geometry *geometry, bool moves, const char *name,
                                  struct sadmm_error *error)
{
    if ((uint32_t)geometry->type >= SADMM_SHAPE_TYPE_COUNT)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%stype = %d: must be in [0, %d)", name,
                          (int)geometry->type, SADMM_SHAPE_TYPE_COUNT);
    if (geometry->children < 1 || geometry->children > SADMM_MOST_CHILDREN)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%schildren = %d: must be in [1, %d]", name,
                          (int)geometry->children, SADMM_MOST_CHILDREN);
    for (int other = 0; moves && other < SADMM_SHAPE_TYPE_COUNT; ++other)
        if (!pair_is_listed(geometry->type, other))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "%stype = %d: has no contacts with type %d, so that only static bodies may have it", name,
                              (int)geometry->type, other);
    return SADMM_OK;
}

sadmm_status sadmm_collision_check_shape(const struct sadmm_collision_input *input, size_t slot,
                                         struct sadmm_error *error)
{
    const struct sadmm_shape *shape = &input->shapes[slot];
    char name[40];
    if (shape->geometry >= input->geometry_count)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "shapes[%zu].geometry = %u: must be in [0, %zu)", slot,
                          shape->geometry, input->geometry_count);
    snprintf(name, sizeof name, "shapes[%zu]: ", slot);
    const struct sadmm_geometry *geometry = &input->geometries[shape->geometry];
    TRY(sadmm_geometry_check(geometry, sadmm_body_moves(input->bodies[shape->body].system_body), name, error));
    const size_t hull_doubles = input->hulls ? input->hull_doubles : 0;
    if (geometry->type == SADMM_SHAPE_HULL && (geometry->hull < HULL_FIRST_OWN || geometry->hull >= hull_doubles))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%shull = %u: must be in [%d, %zu), the pool of hulls",
                          name, geometry->hull, HULL_FIRST_OWN, hull_doubles);
    if (geometry_is_smooth(geometry) && hull_doubles < HULL_FIRST_OWN)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "%stype = %d: needs a pool of hulls, of %d doubles or more", name, (int)geometry->type,
                          HULL_FIRST_OWN);
    return SADMM_OK;
}
