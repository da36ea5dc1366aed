/* A world as JSON: the whole file, bodies and shapes. */
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "format.h"
#include "scene_file.h"
#include "write_forms.h"
#include "write_parts.h"
#include "write_text.h"

static bool allocate(struct sadmm_writer *w)
{
    w->body_slots.count = (size_t)sadmm_world_body_count(w->world);
    w->shape_slots.count = (size_t)sadmm_world_shape_count(w->world);
    w->joint_slots.count = (size_t)sadmm_world_joint_count(w->world);
    w->body_slots.slots = (uint32_t *)sadmm_alloc(w->body_slots.count, sizeof(uint32_t));
    w->shape_slots.slots = (uint32_t *)sadmm_alloc(w->shape_slots.count, sizeof(uint32_t));
    w->joint_slots.slots = (uint32_t *)sadmm_alloc(w->joint_slots.count, sizeof(uint32_t));
    w->shape_place = (size_t *)sadmm_alloc(w->shape_slots.count, sizeof *w->shape_place);
    w->shape_body = (int32_t *)sadmm_alloc(w->shape_slots.count, sizeof *w->shape_body);
    return w->body_slots.slots && w->shape_slots.slots && w->joint_slots.slots && w->shape_place && w->shape_body;
}

static sadmm_status list_slots(struct sadmm_writer *w)
{
    if (!allocate(w)) return sadmm_fail_memory(w->error, "the numbers of bodies, shapes and joints");
    for (size_t k = 0; k < w->body_slots.count; ++k) {
        sadmm_body_id id;
        TRY(sadmm_pass_on(w, sadmm_world_body_at(w->world, (int32_t)k, &id)));
        w->body_slots.slots[k] = id.slot;
    }
    for (size_t k = 0; k < w->shape_slots.count; ++k) {
        sadmm_shape_id id;
        TRY(sadmm_pass_on(w, sadmm_world_shape_at(w->world, (int32_t)k, &id)));
        w->shape_slots.slots[k] = id.slot;
    }
    for (size_t k = 0; k < w->joint_slots.count; ++k) {
        sadmm_joint_id id;
        TRY(sadmm_pass_on(w, sadmm_world_joint_at(w->world, (int32_t)k, &id)));
        w->joint_slots.slots[k] = id.slot;
    }
    return SADMM_OK;
}

static void free_writer(struct sadmm_writer *w)
{
    json_decref(w->root);
    sadmm_free(w->body_slots.slots);
    sadmm_free(w->shape_slots.slots);
    sadmm_free(w->joint_slots.slots);
    sadmm_free(w->shape_place);
    sadmm_free(w->shape_body);
    sadmm_key_tree_free(&w->hull_numbers);
    sadmm_key_tree_free(&w->mesh_numbers);
}

/* ---- bodies and shapes ------------------------------------------------------------------------------------------- */

/* What only dynamic bodies have stays null on others. */
static sadmm_status write_dynamic(struct sadmm_writer *w, json_t *body, sadmm_body_id id, const sadmm_body_def *def)
{
    struct sadmm_body_load load;
    if (def->type != SADMM_BODY_DYNAMIC) return SADMM_OK;
    TRY(sadmm_pass_on(w, sadmm_world_body_wrench(w->world, id, load.force, load.torque)));
    if (!sadmm_write_fields(body, &sadmm_dynamic_fields, def) || !sadmm_write_fields(body, &sadmm_load_fields, &load))
        w->complete = false;
    return SADMM_OK;
}

static sadmm_status write_move(struct sadmm_writer *w, json_t *body, sadmm_body_id id)
{
    sadmm_body_state target;
    bool pending;
    TRY(sadmm_pass_on(w, sadmm_world_body_move(w->world, id, &pending, target.position, target.orientation)));
    if (!pending) return SADMM_OK;
    json_t *move = sadmm_put(w, body, "move", json_object());
    if (!sadmm_write_fields(move, &sadmm_move_fields, &target)) w->complete = false;
    return SADMM_OK;
}

static sadmm_status write_bodies(struct sadmm_writer *w)
{
    for (int32_t k = 0; k < sadmm_world_body_count(w->world); ++k) {
        sadmm_body_id id;
        sadmm_body_def def;
        TRY(sadmm_pass_on(w, sadmm_world_body_at(w->world, k, &id)));
        TRY(sadmm_pass_on(w, sadmm_world_body_def(w->world, id, &def)));
        json_t *body = sadmm_append_object(w, w->bodies, &sadmm_body_fields, &def);
        sadmm_put(w, body, "index", json_integer(k));
        sadmm_put(w, body, "name", json_string(def.name));
        sadmm_put(w, body, "shapes", json_array());
        json_object_del(body, "density"); /* mass and inertia say it */
        TRY(write_dynamic(w, body, id, &def));
        TRY(write_move(w, body, id));
    }
    return SADMM_OK;
}

/* What a shape refers to. */
static sadmm_status write_form(struct sadmm_writer *w, json_t *shape, const sadmm_shape_def *def)
{
    json_int_t number;
    json_object_del(shape, "hull");
    json_object_del(shape, "mesh");
    if (def->hull) {
        TRY(sadmm_write_hull(w, def->hull, &number));
        sadmm_put(w, shape, "hull", json_integer(number));
    }
    if (def->mesh) {
        TRY(sadmm_write_mesh(w, def->mesh, &number));
        sadmm_put(w, shape, "mesh", json_integer(number));
    }
    return SADMM_OK;
}

static sadmm_status write_shape(struct sadmm_writer *w, int32_t number, json_t *all)
{
    sadmm_shape_id id;
    sadmm_shape_def def;
    sadmm_body_id body;
    TRY(sadmm_pass_on(w, sadmm_world_shape_at(w->world, number, &id)));
    TRY(sadmm_pass_on(w, sadmm_world_shape_def(w->world, id, &def, &body)));
    const int32_t on = sadmm_slot_number(&w->body_slots, body.slot);
    json_t *shapes = json_object_get(json_array_get(w->bodies, (size_t)on), "shapes");
    w->shape_body[number] = on;
    w->shape_place[number] = json_array_size(shapes);
    json_t *shape = sadmm_append_object(w, shapes, &sadmm_shape_fields, &def);
    sadmm_put(w, shape, "index", json_integer(number));
    sadmm_put_name(w, shape, def.name);
    sadmm_put(w, shape, "size", sadmm_json_reals(def.size, (size_t)sadmm_shape_sizes[def.type]));
    sadmm_append(w, all, json_incref(shape));
    return write_form(w, shape, &def);
}

/* Shapes have their numbers where they were not made body by body; elsewhere the order in the file says as much. */
static sadmm_status write_shapes(struct sadmm_writer *w)
{
    json_t *all = json_array(), *shape;
    sadmm_status status = SADMM_OK;
    bool in_order = true;
    size_t k;
    for (int32_t number = 0; status == SADMM_OK && number < sadmm_world_shape_count(w->world); ++number) {
        status = write_shape(w, number, all);
        in_order = in_order && (number == 0 || w->shape_body[number] >= w->shape_body[number - 1]);
    }
    if (in_order) json_array_foreach(all, k, shape) json_object_del(shape, "index");
    json_decref(all);
    return status;
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

/* By method; of the settings' own, what these say. */
static void put_by_method(struct sadmm_writer *w, const char *name, const int numbers[SADMM_METHOD_COUNT],
                          sadmm_method own, int number)
{
    int all[SADMM_METHOD_COUNT];
    for (int m = 0; m < SADMM_METHOD_COUNT; ++m) all[m] = m == (int)own ? number : numbers[m];
    json_t *object = sadmm_put(w, w->root, name, json_object());
    if (!sadmm_write_fields(object, &sadmm_method_fields, all)) w->complete = false;
}

static void write_head(struct sadmm_writer *w, const struct sadmm_scene_about *about, const sadmm_settings *settings)
{
    static const char *const units =
        "SI; world frame; quaternions w x y z, body to world; inertia: principal moments in the body's frame; box: "
        "half extents; capsule: radius, half length along z; plane: half-space z <= 0 of its frame; hull: around the "
        "points of an entry of hulls, in their frame, and what is within convex_radius of that; mesh: an entry of "
        "meshes, in its frame: triangles of vertices, counter-clockwise seen from outside, or heights over a grid of "
        "the x-y plane with its middle at the origin, rows along x one after the other along y, every cell two "
        "triangles parted by the diagonal from its lowest x and y to its highest; cylinder, cone: radius, half height "
        "along z, a cone's apex at +z; ellipsoid: semi-axes";
    json_object_del(w->root, "$schema");
    sadmm_put(w, w->root, "format", json_string(SADMM_SCENE_FORMAT));
    sadmm_put(w, w->root, "format_version", json_integer(SADMM_SCENE_FORMAT_VERSION));
    sadmm_put(w, w->root, "scene", json_string(about->spec));
    sadmm_put(w, w->root, "name", json_string(about->name));
    if (about->n >= 0) sadmm_put(w, w->root, "n", json_integer(about->n));
    if (about->m >= 0) sadmm_put(w, w->root, "m", json_integer(about->m));
    sadmm_put(w, w->root, "description", json_string(about->description));
    sadmm_put(w, w->root, "units", json_string(units));
    sadmm_put(w, w->root, "duration", sadmm_json_real(about->duration));
    put_by_method(w, "iterations", about->iterations, settings->method, settings->iterations);
    put_by_method(w, "substeps", about->substeps, settings->method, settings->substeps);
    sadmm_put(w, w->root, "friction_of_a_pair", json_string(SADMM_SCENE_PAIR_FRICTION));
    json_t *object = sadmm_put(w, w->root, "settings", json_object());
    if (!sadmm_write_fields(object, &sadmm_settings_fields, settings)) w->complete = false;
}

static sadmm_status write_all(struct sadmm_writer *w, const struct sadmm_scene_about *about, const sadmm_world_def *def)
{
    const sadmm_settings settings = sadmm_world_settings(w->world);
    if (!sadmm_write_fields(w->root, &sadmm_file_fields, def)) w->complete = false;
    write_head(w, about, &settings);
    w->bodies = sadmm_put(w, w->root, "bodies", json_array());
    w->hulls = sadmm_put(w, w->root, "hulls", json_array());
    w->meshes = sadmm_put(w, w->root, "meshes", json_array());
    TRY(list_slots(w));
    TRY(write_bodies(w));
    TRY(write_shapes(w));
    TRY(sadmm_write_parts(w));
    if (!sadmm_json_add_build(w->root)) w->complete = false;
    return w->complete ? SADMM_OK : sadmm_fail_memory(w->error, "the JSON of a scene");
}

sadmm_status sadmm_scene_file_write(const struct sadmm_scene_about *about, const sadmm_world_def *def,
                                    sadmm_world *world, FILE *stream, struct sadmm_error *error)
{
    struct sadmm_writer w = {.world = world, .root = json_object(), .complete = true, .error = error};
    sadmm_status status = write_all(&w, about, def);
    if (status == SADMM_OK && !sadmm_write_text(w.root, stream))
        status = sadmm_fail(error, SADMM_ERROR_IO, "the scene could not be written");
    free_writer(&w);
    return status;
}
