/* A scene file into a world: bodies and shapes. */
#include <string.h>

#include "core/base/memory.h"
#include "file.h"
#include "filler.h"
#include "orientation.h"
#include "read_forms.h"
#include "read_parts.h"
#include "read_shape.h"
#include "scene_file.h"

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static bool is_given(const json_t *object, const char *member)
{
    const json_t *value = json_object_get(object, member);
    return value && !json_is_null(value);
}

/* Members that only dynamic bodies have: of them, read; null or not there on others. */
static sadmm_status read_dynamic(const struct sadmm_filler *f, const json_t *object, const struct sadmm_fields *fields,
                                 sadmm_body_type type, void *into)
{
    if (type == SADMM_BODY_DYNAMIC) return sadmm_read_some(&f->reader, object, fields, into);
    for (size_t k = 0; k < fields->count; ++k)
        if (is_given(object, fields->list[k].name))
            return sadmm_refuse(&f->reader, fields->list[k].name, "must be null or left out, for the body is %s",
                                sadmm_body_type_names[type]);
    return SADMM_OK;
}

static sadmm_status read_body_def(struct sadmm_filler *f, const json_t *object, size_t number, sadmm_body_def *def)
{
    static const char *const needed[] = {"mass", "inertia"};
    *def = sadmm_body_def_default();
    TRY(sadmm_read_fields(&f->reader, object, &sadmm_body_fields, def));
    TRY(sadmm_read_object_name(f, object, &def->name));
    const json_t *given = json_object_get(object, "index");
    if (given) {
        int64_t index;
        TRY(sadmm_read_whole(&f->reader, "index", given, 0, INT32_MAX, &index));
        if (index != (int64_t)number)
            return sadmm_refuse(&f->reader, "index", "must be %zu, the body's place in the list, or left out, is %lld",
                                number, (long long)index);
    }
    TRY(read_dynamic(f, object, &sadmm_dynamic_fields, def->type, def));
    if (is_given(object, "density")) {
        if (def->type == SADMM_BODY_DYNAMIC) return sadmm_read_density(f, object, number, def);
        return sadmm_refuse(&f->reader, "density", "must be null or left out, for the body is %s",
                            sadmm_body_type_names[def->type]);
    }
    for (int k = 0; k < 2 && def->type == SADMM_BODY_DYNAMIC; ++k)
        if (!json_object_get(object, needed[k]))
            return sadmm_refuse(&f->reader, needed[k], "is missing: a dynamic body has mass and inertia, or density");
    return SADMM_OK;
}

/* The orientation as it is in the file, if it is unit but for its own rounding. */
static sadmm_status keep_orientation(const struct sadmm_filler *f, sadmm_body_id id, const double orientation[4])
{
    sadmm_body_state state;
    TRY(sadmm_refuse_world(f, sadmm_world_body_state(f->world, id, &state), ": "));
    if (memcmp(state.orientation, orientation, sizeof state.orientation) == 0) return SADMM_OK;
    memcpy(state.orientation, orientation, sizeof state.orientation);
    return sadmm_refuse_world(f, sadmm_world_set_body_state(f->world, id, &state), ": ");
}

/* A pose that a kinematic body is to go to within the first step. */
static sadmm_status read_move(struct sadmm_filler *f, const json_t *object, sadmm_body_id id, sadmm_body_type type)
{
    sadmm_body_state target = {.orientation = {1, 0, 0, 0}};
    if (!is_given(object, "move")) return SADMM_OK;
    if (type != SADMM_BODY_KINEMATIC)
        return sadmm_refuse(&f->reader, "move", "must be null or left out, for the body is %s",
                            sadmm_body_type_names[type]);
    const size_t before = sadmm_enter(&f->reader, "move");
    TRY(sadmm_read_fields(&f->reader, json_object_get(object, "move"), &sadmm_move_fields, &target));
    TRY(sadmm_refuse_world(f, sadmm_world_move_body(f->world, id, target.position, target.orientation), "."));
    sadmm_leave(&f->reader, before);
    return SADMM_OK;
}

static sadmm_status read_body(struct sadmm_filler *f, const json_t *object, size_t number)
{
    sadmm_body_def def;
    struct sadmm_body_load load = {{0}, {0}};
    TRY(read_body_def(f, object, number, &def));
    TRY(read_dynamic(f, object, &sadmm_load_fields, def.type, &load));
    f->body_types[number] = def.type;
    TRY(sadmm_refuse_world(f, sadmm_world_add_body(f->world, &def, &f->bodies[number]), ": "));
    TRY(keep_orientation(f, f->bodies[number], def.orientation));
    if (is_given(object, "force") || is_given(object, "torque"))
        TRY(sadmm_refuse_world(f, sadmm_world_set_body_wrench(f->world, f->bodies[number], load.force, load.torque),
                               "."));
    return read_move(f, object, f->bodies[number], def.type);
}

static sadmm_status read_bodies(struct sadmm_filler *f)
{
    json_t *list;
    TRY(sadmm_read_array(&f->reader, f->root, "bodies", &list));
    const size_t count = json_array_size(list);
    f->bodies = (sadmm_body_id *)sadmm_alloc(count, sizeof *f->bodies);
    f->body_types = (sadmm_body_type *)sadmm_alloc(count, sizeof *f->body_types);
    f->first_shape = (size_t *)sadmm_alloc(count + 1, sizeof *f->first_shape);
    f->masses = (sadmm_mass *)sadmm_alloc(count, sizeof *f->masses);
    if (!f->bodies || !f->body_types || !f->masses || !f->first_shape)
        return sadmm_fail_memory(f->reader.error, "the bodies of a scene file");
    for (size_t k = 0; k < count; ++k) {
        json_t *shapes;
        const size_t before = sadmm_enter(&f->reader, "bodies[%zu]", k);
        TRY(read_body(f, json_array_get(list, k), k));
        TRY(sadmm_read_array(&f->reader, json_array_get(list, k), "shapes", &shapes));
        f->first_shape[k + 1] = f->first_shape[k] + json_array_size(shapes);
        sadmm_leave(&f->reader, before);
    }
    f->body_count = count;
    return SADMM_OK;
}

/* ---- shapes ------------------------------------------------------------------------------------------------------ */

/* A shape of the file, and where it is there. */
struct place {
    const json_t *object;
    size_t body, nth;
};

static size_t enter_shape(struct sadmm_filler *f, const struct place *place)
{
    return sadmm_enter(&f->reader, "bodies[%zu].shapes[%zu]", place->body, place->nth);
}

/* Shapes body by body. */
static void list_places(const struct sadmm_filler *f, struct place *places)
{
    const json_t *bodies = json_object_get(f->root, "bodies");
    for (size_t k = 0; k < f->body_count; ++k) {
        const json_t *shapes = json_object_get(json_array_get(bodies, k), "shapes");
        for (size_t nth = 0; nth < json_array_size(shapes); ++nth)
            places[f->first_shape[k] + nth] = (struct place){json_array_get(shapes, nth), k, nth};
    }
}

/* order[i]: the place of the i-th shape to be made. By their "index", which all have or none; without it as they are in
 * the file. */
static sadmm_status order_shapes(struct sadmm_filler *f, const struct place *places, size_t count, size_t *order)
{
    size_t with = 0;
    for (size_t k = 0; k < count; ++k) with += json_object_get(places[k].object, "index") != NULL;
    for (size_t k = 0; k < count; ++k) order[k] = with ? count : k;
    for (size_t k = 0; with && k < count; ++k) {
        const json_t *value = json_object_get(places[k].object, "index");
        const size_t before = enter_shape(f, &places[k]);
        int64_t index;
        if (!value) return sadmm_refuse(&f->reader, "index", "is missing: all shapes must have one, or none");
        TRY(sadmm_read_whole(&f->reader, "index", value, 0, (double)(count - 1), &index));
        if (order[index] != count)
            return sadmm_refuse(&f->reader, "index", "must be another one than bodies[%zu].shapes[%zu] has, is %lld",
                                places[order[index]].body, places[order[index]].nth, (long long)index);
        order[index] = k;
        sadmm_leave(&f->reader, before);
    }
    return SADMM_OK;
}

static sadmm_status read_shape(struct sadmm_filler *f, const json_t *object, size_t body, sadmm_shape_id *id)
{
    sadmm_shape_def def;
    TRY(sadmm_read_shape_def(f, object, &def));
    TRY(sadmm_read_object_name(f, object, &def.name));
    sadmm_pose_in_body(f, (int64_t)body, def.position, def.orientation);
    sadmm_before_unit(def.orientation);
    return sadmm_refuse_world(f, sadmm_world_add_shape(f->world, f->bodies[body], &def, id), ": ");
}

static sadmm_status read_shapes(struct sadmm_filler *f)
{
    const size_t count = f->first_shape[f->body_count];
    struct place *places = (struct place *)sadmm_alloc(count, sizeof *places);
    size_t *order = (size_t *)sadmm_alloc(count, sizeof *order);
    f->shapes = (sadmm_shape_id *)sadmm_alloc(count, sizeof *f->shapes);
    sadmm_status status = SADMM_OK;
    if (places && order && f->shapes) {
        list_places(f, places);
        status = order_shapes(f, places, count, order);
        for (size_t k = 0; status == SADMM_OK && k < count; ++k) {
            const struct place *place = &places[order[k]];
            const size_t before = enter_shape(f, place);
            status = read_shape(f, place->object, place->body, &f->shapes[order[k]]);
            sadmm_leave(&f->reader, before);
        }
    } else {
        status = sadmm_fail_memory(f->reader.error, "the shapes of a scene file");
    }
    sadmm_free(places);
    sadmm_free(order);
    return status;
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

static void free_filler(struct sadmm_filler *f)
{
    json_decref(f->names);
    for (size_t k = 0; k < f->hull_count; ++k) sadmm_hull_destroy(f->hulls[k]);
    for (size_t k = 0; k < f->mesh_count; ++k) sadmm_mesh_destroy(f->meshes[k]);
    sadmm_free(f->hulls);
    sadmm_free(f->meshes);
    sadmm_free(f->bodies);
    sadmm_free(f->body_types);
    sadmm_free(f->masses);
    sadmm_free(f->shapes);
    sadmm_free(f->first_shape);
    sadmm_free(f->joints);
}

static sadmm_status fill(struct sadmm_filler *f)
{
    TRY(sadmm_read_hulls(f));
    TRY(sadmm_read_meshes(f));
    TRY(read_bodies(f));
    TRY(read_shapes(f));
    return sadmm_read_parts(f);
}

sadmm_status sadmm_scene_file_fill(const struct sadmm_scene_file *file, sadmm_world *world, struct sadmm_error *error)
{
    struct sadmm_filler f = {.reader = {.name = file->name, .error = error}, .root = file->root, .world = world};
    const sadmm_status status = fill(&f);
    free_filler(&f);
    return status;
}
