#include "shape_form.h"

#include <string.h>

#include "collision/hull/hull.h"
#include "collision/mesh/mesh.h"
#include "collision/shapes/geometry.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/math/quat.h"

static const sadmm_shape_def defaults = {SADMM_SHAPE_FIELDS(SADMM_FIELD_DEFAULT, )};
const struct sadmm_growing sadmm_growing_shape = SADMM_GROWING(sadmm_shape_def, &defaults, mesh);

void sadmm_shape_def_init(sadmm_shape_def *def, size_t size) { sadmm_growing_init(&sadmm_growing_shape, def, size, 0); }

/* A hull is given with shapes of that type, and with no others; so is a mesh. */
static sadmm_status check_part(const char *name, const void *part, int of_type, int type, struct sadmm_error *error)
{
    if (type == of_type && !part)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->%s = NULL: must be given where def->type is %d",
                          name, of_type);
    if (type != of_type && part)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->%s: must be NULL where def->type is %d, not %d",
                          name, type, of_type);
    return SADMM_OK;
}

sadmm_status sadmm_shape_form_check(const sadmm_shape_def *def, double orientation[4], struct sadmm_error *error)
{
    TRY(sadmm_field_check(SADMM_SHAPE_FIELD(type), def, "def->", error));
    const struct sadmm_field *const size = SADMM_SHAPE_FIELD(size);
    TRY(check_part("hull", def->hull, SADMM_SHAPE_HULL, (int)def->type, error));
    TRY(check_part("mesh", def->mesh, SADMM_SHAPE_MESH, (int)def->type, error));
    for (int k = 0; k < sadmm_shape_sizes[def->type]; ++k)
        if (!(def->size[k] >= size->lo && def->size[k] <= size->hi))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->size[%d] = %g: must be in [%g, %g] m", k,
                              def->size[k], size->lo, size->hi);
    TRY(sadmm_field_check(SADMM_SHAPE_FIELD(position), def, "def->", error));
    return sadmm_check_orientation("def->orientation", def->orientation, orientation, error);
}

struct sadmm_geometry sadmm_shape_form_geometry(const sadmm_shape_def *def)
{
    struct sadmm_geometry geometry = {.type = (int32_t)def->type, .subshapes = def->type == SADMM_SHAPE_MESH ? 0 : 1};
    const double *size = def->hull ? def->hull->half : def->mesh ? def->mesh->half : def->size;
    memcpy(geometry.size, size, sizeof geometry.size);
    return geometry;
}

void sadmm_shape_form_place(const sadmm_shape_def *def, const double orientation[4], double position_of_geometry[3],
                            double orientation_of_geometry[4])
{
    static const double as_it_is[4] = {1, 0, 0, 0};
    const quat turn = q_load(orientation);
    memcpy(position_of_geometry, def->position, 3 * sizeof *def->position);
    memcpy(orientation_of_geometry, orientation, 4 * sizeof *orientation);
    if (!def->hull && !def->mesh) return;
    const double *middle = def->hull ? def->hull->position : def->mesh->middle,
                 *axes = def->hull ? def->hull->orientation : as_it_is;
    v3_store(v3_add(v3_load(def->position), m3_mul(q_matrix(turn), v3_load(middle))), position_of_geometry);
    q_store(q_normalize(q_mul(turn, q_load(axes))), orientation_of_geometry);
}

void sadmm_world_read_shape_frame(const sadmm_world *world, size_t slot, double frame[7])
{
    const struct sadmm_shape *shape = &world->shapes[slot];
    const int32_t type = world->geometries[shape->geometry].type;
    const bool block = type == SADMM_SHAPE_HULL || type == SADMM_SHAPE_MESH;
    memcpy(frame, block ? world->block_shapes[slot].position : shape->position, 3 * sizeof *frame);
    memcpy(frame + 3, block ? world->block_shapes[slot].orientation : shape->orientation, 4 * sizeof *frame);
}
