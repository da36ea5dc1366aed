#include "read_shape.h"

#include <string.h>

#include "core/base/memory.h"
#include "core/base/names.h"

/* ---- definitions ------------------------------------------------------------------------------------------------- */

/* The hull or mesh of a shape that is one; others have none. */
static sadmm_status read_form(const struct sadmm_filler *f, const json_t *object, sadmm_shape_def *def)
{
    int64_t number;
    if (def->type == SADMM_SHAPE_HULL) {
        TRY(sadmm_read_number_in(f, object, "hull", f->hull_count, &number));
        def->hull = f->hulls[number];
    } else if (json_object_get(object, "hull")) {
        return sadmm_refuse(&f->reader, "hull", "must be left out, for the shape is a %s",
                            sadmm_shape_type_names[def->type]);
    }
    if (def->type == SADMM_SHAPE_MESH) {
        TRY(sadmm_read_number_in(f, object, "mesh", f->mesh_count, &number));
        def->mesh = f->meshes[number];
    } else if (json_object_get(object, "mesh")) {
        return sadmm_refuse(&f->reader, "mesh", "must be left out, for the shape is a %s",
                            sadmm_shape_type_names[def->type]);
    }
    return SADMM_OK;
}

sadmm_status sadmm_read_shape_def(const struct sadmm_filler *f, const json_t *object, sadmm_shape_def *def)
{
    *def = sadmm_shape_def_default();
    TRY(sadmm_read_fields(&f->reader, object, &sadmm_shape_fields, def));
    if (!json_object_get(object, "type")) return sadmm_refuse(&f->reader, "type", "is missing");
    const size_t sizes = (size_t)sadmm_shape_sizes[def->type];
    const json_t *size = json_object_get(object, "size");
    if (sizes > 0 && !size)
        return sadmm_refuse(&f->reader, "size", "is missing, %zu number%s", sizes, sizes > 1 ? "s" : "");
    if (size) TRY(sadmm_read_reals(&f->reader, "size", size, def->size, sizes));
    return read_form(f, object, def);
}

/* ---- density ----------------------------------------------------------------------------------------------------- */

/* What is solid of the shapes; sensors are not. parts: room for all. */
static sadmm_status read_parts(struct sadmm_filler *f, const json_t *shapes, double density, sadmm_mass *parts,
                               size_t *count)
{
    *count = 0;
    for (size_t k = 0; k < json_array_size(shapes); ++k) {
        sadmm_shape_def def;
        const size_t before = sadmm_enter(&f->reader, "shapes[%zu]", k);
        TRY(sadmm_read_shape_def(f, json_array_get(shapes, k), &def));
        if (def.type == SADMM_SHAPE_PLANE || def.type == SADMM_SHAPE_MESH)
            return sadmm_refuse(&f->reader, "type", "must be a solid, for the body has a density, is %s",
                                sadmm_shape_type_names[def.type]);
        if (!def.sensor) TRY(sadmm_refuse_last(f, sadmm_shape_mass(&def, density, &parts[(*count)++]), ": "));
        sadmm_leave(&f->reader, before);
    }
    return SADMM_OK;
}

static sadmm_status sum_parts(struct sadmm_filler *f, const json_t *shapes, double density, sadmm_mass *whole)
{
    size_t count;
    sadmm_mass *parts = (sadmm_mass *)sadmm_alloc(json_array_size(shapes), sizeof *parts);
    if (!parts) return sadmm_fail_memory(f->reader.error, "the masses of a scene file");
    sadmm_status status = read_parts(f, shapes, density, parts, &count);
    if (status == SADMM_OK && count == 0)
        status = sadmm_refuse(&f->reader, "density", "must be left out, for the body has no shape but sensors");
    /* One alone keeps its axes as they are, where a sum may find others. */
    if (status == SADMM_OK && count == 1) *whole = parts[0];
    if (status == SADMM_OK && count > 1) status = sadmm_refuse_last(f, sadmm_mass_sum(parts, count, whole), ": ");
    sadmm_free(parts);
    return status;
}

sadmm_status sadmm_read_density(struct sadmm_filler *f, const json_t *object, size_t number, sadmm_body_def *def)
{
    static const char *const computed[] = {"mass", "inertia"};
    static const double least = 1e-30, most = 1e30;
    sadmm_mass *const whole = &f->masses[number];
    double density;
    json_t *shapes;
    for (int k = 0; k < 2; ++k)
        if (json_object_get(object, computed[k]))
            return sadmm_refuse(&f->reader, computed[k], "must be left out, for the body has a density");
    TRY(sadmm_read_real(&f->reader, "density", json_object_get(object, "density"), &density));
    if (!(density >= least && density <= most))
        return sadmm_refuse(&f->reader, "density", "must be in [%g, %g] kg/m^3, is %g", least, most, density);
    TRY(sadmm_read_array(&f->reader, object, "shapes", &shapes));
    TRY(sum_parts(f, shapes, density, whole));
    def->mass = whole->mass;
    memcpy(def->inertia, whole->inertia, sizeof def->inertia);
    return sadmm_refuse_last(f, sadmm_mass_pose_of_body(whole, def->position, def->orientation), ".");
}

void sadmm_pose_in_body(const struct sadmm_filler *f, int64_t number, double position[3], double orientation[4])
{
    if (number >= 0 && f->masses[number].mass > 0)
        (void)sadmm_mass_pose_in_body(&f->masses[number], position, orientation);
}
