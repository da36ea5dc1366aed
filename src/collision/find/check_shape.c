#include "check_shape.h"

#include <stdio.h>

#include "collision/hull/hull_data.h"
#include "collision/manifold/collision_table.h"
#include "collision/shapes/geometry.h"

/* Bodies that the caller moves meet dynamic ones alone; but a plane has no box that could be moved. */
static bool needs_every_pair(const struct sadmm_geometry *geometry, enum sadmm_motion motion)
{
    return motion == SADMM_MOTION_DYNAMIC || (motion == SADMM_MOTION_KINEMATIC && geometry->type == SADMM_SHAPE_PLANE);
}

sadmm_status sadmm_geometry_check(const struct sadmm_geometry *geometry, enum sadmm_motion motion, const char *name,
                                  struct sadmm_error *error)
{
    if ((uint32_t)geometry->type >= SADMM_SHAPE_TYPE_COUNT)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%stype = %d: must be in [0, %d)", name,
                          (int)geometry->type, SADMM_SHAPE_TYPE_COUNT);
    if (geometry->type == SADMM_SHAPE_MESH && geometry->subshapes != 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%ssubshapes = %d: must be 0 of a mesh", name,
                          (int)geometry->subshapes);
    if (geometry->type != SADMM_SHAPE_MESH && (geometry->subshapes < 1 || geometry->subshapes > SADMM_MOST_SUBSHAPES))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%ssubshapes = %d: must be in [1, %d]", name,
                          (int)geometry->subshapes, SADMM_MOST_SUBSHAPES);
    for (int other = 0; needs_every_pair(geometry, motion) && other < SADMM_SHAPE_TYPE_COUNT; ++other)
        if (!pair_is_listed(geometry->type, other))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "%stype = %d: has no contacts with type %d, so that only %s bodies may have it", name,
                              (int)geometry->type, other,
                              geometry->type == SADMM_SHAPE_MESH ? "static and kinematic" : "static");
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
    const int32_t body = input->bodies[shape->body].system_body;
    TRY(sadmm_geometry_check(geometry,
                             body >= 0                       ? SADMM_MOTION_DYNAMIC
                             : sadmm_body_is_kinematic(body) ? SADMM_MOTION_KINEMATIC
                                                             : SADMM_MOTION_NONE,
                             name, error));
    const size_t hull_doubles = input->hulls ? input->hull_doubles : 0;
    const bool of_block = geometry->type == SADMM_SHAPE_HULL || geometry->type == SADMM_SHAPE_MESH;
    if (of_block && (geometry->hull < HULL_FIRST_OWN || geometry->hull >= hull_doubles))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%shull = %u: must be in [%d, %zu), the shape data",
                          name, geometry->hull, HULL_FIRST_OWN, hull_doubles);
    if (geometry_is_smooth(geometry) && hull_doubles < HULL_FIRST_OWN)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "%stype = %d: needs shape data of %d doubles or more", name, (int)geometry->type,
                          HULL_FIRST_OWN);
    return SADMM_OK;
}
