/* Shapes of a world. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "collision/hull/hull.h"
#include "collision/mesh/mesh.h"
#include "collision/shapes/geometry.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "shape.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"
#include "world/state/shape_form.h"

static bool is_zero(const double v[3]) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }

static sadmm_status check_surface(const char *name, const struct sadmm_world_body *body, const double velocity[3],
                                  struct sadmm_error *error)
{
    TRY(sadmm_check_vector(name, velocity, 3, SADMM_SHAPE_FIELD(surface_velocity)->hi, error));
    if (body->type == SADMM_BODY_DYNAMIC && !is_zero(velocity))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "%s = (%g, %g, %g): must be 0 on a dynamic body", name, velocity[0], velocity[1],
                          velocity[2]);
    return SADMM_OK;
}

static sadmm_status check_def(const struct sadmm_world_body *body, const sadmm_shape_def *def, double orientation[4],
                              struct sadmm_error *error)
{
    TRY(sadmm_shape_form_check(def, orientation, error));
    const struct sadmm_geometry geometry = sadmm_shape_form_geometry(def);
    static const enum sadmm_motion motion[] = {[SADMM_BODY_DYNAMIC] = SADMM_MOTION_DYNAMIC,
                                               [SADMM_BODY_STATIC] = SADMM_MOTION_NONE,
                                               [SADMM_BODY_KINEMATIC] = SADMM_MOTION_KINEMATIC};
    TRY(sadmm_geometry_check(&geometry, motion[body->type], "def->", error));
    if (def->sensor && def->type == SADMM_SHAPE_MESH)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "def->sensor = true: must be false where def->type is %d, a mesh, which has no inside",
                          (int)def->type);
    TRY(sadmm_field_check(SADMM_SHAPE_FIELD(friction), def, "def->", error));
    TRY(sadmm_field_check(SADMM_SHAPE_FIELD(restitution), def, "def->", error));
    return check_surface("def->surface_velocity", body, def->surface_velocity, error);
}

static bool has_block(int type)
{
    return type == SADMM_SHAPE_HULL || type == SADMM_SHAPE_MESH;
}

static void retain_hull(const void *hull) { sadmm_hull_retain((const sadmm_hull *)hull); }
static void release_hull(const void *hull) { sadmm_hull_release((const sadmm_hull *)hull); }
static void retain_mesh(const void *mesh) { sadmm_mesh_retain((const sadmm_mesh *)mesh); }
static void release_mesh(const void *mesh) { sadmm_mesh_release((const sadmm_mesh *)mesh); }

static struct sadmm_shape_data_owner block_owner(const sadmm_shape_def *def)
{
    if (def->type == SADMM_SHAPE_HULL)
        return (struct sadmm_shape_data_owner){def->hull, def->hull->block, def->hull->doubles, retain_hull,
                                               release_hull};
    return (struct sadmm_shape_data_owner){def->mesh, def->mesh->block, def->mesh->doubles, retain_mesh, release_mesh};
}

/* Room for what a shape with a block in `slot` has beside it, and its block in the shape data. Errors leave the world
 * as it is. */
static sadmm_status add_block(sadmm_world *world, size_t slot, const sadmm_shape_def *def, uint32_t *offset,
                              struct sadmm_error *error)
{
    const struct sadmm_shape_data_owner owner = block_owner(def);
    if (!SADMM_GROW(world->block_shapes, world->block_shape_slots, slot + 1))
        return sadmm_fail_memory(error, "a shape");
    TRY(sadmm_shape_data_add(&world->shape_data, &owner, offset, error));
    if (slot >= world->block_shape_slots) world->block_shape_slots = slot + 1;
    return SADMM_OK;
}

/* What was given, to be read back. */
static void keep_given(sadmm_world *world, size_t slot, const sadmm_shape_def *def, const double orientation[4])
{
    struct sadmm_world_block_shape *kept = &world->block_shapes[slot];
    kept->hull = def->hull;
    kept->mesh = def->mesh;
    memcpy(kept->position, def->position, sizeof kept->position);
    memcpy(kept->orientation, orientation, sizeof kept->orientation);
}

static struct sadmm_link *link_at(sadmm_world *world, uint32_t name) { return &world->shape_links[name - 1]; }

static bool reserve(sadmm_world *world, size_t slots)
{
    const size_t used = world->shape_ids.slots;
    return SADMM_GROW(world->shapes, used, slots) && SADMM_GROW(world->geometries, used, slots) &&
           SADMM_GROW(world->shape_links, used, slots) && SADMM_GROW(world->surfaces, 3 * used, 3 * slots);
}

sadmm_status sadmm_world_put_shape(sadmm_world *world, size_t slot, int32_t body_slot, const sadmm_shape_def *def,
                                   struct sadmm_error *error)
{
    struct sadmm_world_body *body = &world->bodies[body_slot];
    double orientation[4];
    uint32_t offset = 0;
    TRY(check_def(body, def, orientation, error));
    const struct sadmm_geometry geometry = sadmm_shape_form_geometry(def);
    if (has_block(def->type)) TRY(add_block(world, slot, def, &offset, error));
    else if (geometry_is_smooth(&geometry)) TRY(sadmm_shape_data_hold(&world->shape_data, error));

    struct sadmm_shape *shape = &world->shapes[slot];
    memset(shape, 0, sizeof *shape);
    shape->geometry = (uint32_t)slot;
    world->geometries[shape->geometry] = geometry;
    world->geometries[shape->geometry].hull = offset;
    sadmm_shape_form_place(def, orientation, shape->position, shape->orientation);
    if (has_block(def->type)) keep_given(world, slot, def, orientation);
    shape->friction = def->friction;
    shape->restitution = def->restitution;
    shape->category = def->category;
    shape->mask = def->mask;
    shape->sensor = def->sensor;
    shape->body = body_slot;
    shape->alive = true;
    shape->revision = ++world->shape_revisions;
    shape->formed = ++world->shape_changes;
    world->sensor_count += def->sensor;
    world->bouncing_count += def->restitution > 0;
    memcpy(world->surfaces + 3 * slot, def->surface_velocity, sizeof def->surface_velocity);
    world->moving_surfaces += !is_zero(def->surface_velocity);
    sadmm_world_reshaped(world);
    sadmm_link_add(world, link_at, &body->first_shape, (uint32_t)slot + 1);
    return SADMM_OK;
}

sadmm_status sadmm_world_add_shape(sadmm_world *world, sadmm_body_id body_id, const sadmm_shape_def *given,
                                   sadmm_shape_id *id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_world_body *body = sadmm_world_find_body(world, body_id, "body", error);
    sadmm_shape_def def;
    double ignored[4];
    size_t slot;
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_growing_take(&sadmm_growing_shape, &def, given, "def", error));
    TRY(check_def(body, &def, ignored, error)); /* before the world is detached */
    TRY(sadmm_world_detach(world));

    TRY(sadmm_ids_next(&world->shape_ids, &slot, error));
    if (!reserve(world, slot + 1)) return sadmm_fail_memory(error, "a shape");
    TRY(sadmm_tags_set(&world->shape_ids.tags, slot, def.name, def.user_data, error));
    TRY(sadmm_world_put_shape(world, slot, (int32_t)body_id.slot - 1, &def, error));
    sadmm_ids_take(&world->shape_ids, slot);
    if (id) *id = sadmm_world_shape_id(world, slot);
    return SADMM_OK;
}

static void remove_block(sadmm_world *world, size_t slot)
{
    const struct sadmm_world_block_shape *kept = &world->block_shapes[slot];
    const void *owner = kept->hull ? (const void *)kept->hull : kept->mesh;
    world->geometries[world->shapes[slot].geometry].hull = 0;
    sadmm_shape_data_remove(&world->shape_data, owner, world->geometries, world->shape_ids.slots);
}

void sadmm_world_kill_shape(sadmm_world *world, size_t slot)
{
    const struct sadmm_geometry *geometry = &world->geometries[world->shapes[slot].geometry];
    if (has_block(geometry->type)) remove_block(world, slot);
    else if (geometry_is_smooth(geometry)) sadmm_shape_data_release(&world->shape_data);
    world->shapes[slot].alive = false;
    sadmm_world_reshaped(world);
    world->sensor_count -= world->shapes[slot].sensor;
    world->bouncing_count -= world->shapes[slot].restitution > 0;
    world->moving_surfaces -= !is_zero(world->surfaces + 3 * slot);
    sadmm_decider_forget(&world->decider, (uint32_t)slot);
    sadmm_link_remove(world, link_at, &world->bodies[world->shapes[slot].body].first_shape, (uint32_t)slot + 1);
    sadmm_ids_release(&world->shape_ids, slot);
    sadmm_pair_table_forget(&world->friction_pairs, (uint32_t)slot);
    world->contacts_readable = false;
}

sadmm_status sadmm_world_remove_shape(sadmm_world *world, sadmm_shape_id id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    if (!sadmm_world_find_shape(world, id, "id", &world->error)) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_world_detach(world));
    sadmm_world_kill_shape(world, id.slot - 1);
    return SADMM_OK;
}

sadmm_status sadmm_world_shape_def_sized(sadmm_world *world, sadmm_shape_id id, sadmm_shape_def *out, size_t size,
                                         sadmm_body_id *body)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_shape *shape = sadmm_world_find_shape(world, id, "id", error);
    if (!shape) return SADMM_ERROR_STALE_ID;
    const struct sadmm_geometry *geometry = &world->geometries[shape->geometry];
    sadmm_shape_def def = {.type = (sadmm_shape_type)geometry->type,
                           .friction = shape->friction,
                           .restitution = shape->restitution,
                           .category = shape->category,
                           .mask = shape->mask,
                           .sensor = shape->sensor,
                           .name = sadmm_tags_name(&world->shape_ids.tags, id.slot - 1),
                           .user_data = sadmm_tags_data(&world->shape_ids.tags, id.slot - 1)};
    memcpy(def.surface_velocity, world->surfaces + 3 * (id.slot - 1), sizeof def.surface_velocity);
    memcpy(def.size, geometry->size, sizeof def.size);
    memcpy(def.position, shape->position, sizeof def.position);
    memcpy(def.orientation, shape->orientation, sizeof def.orientation);
    if (has_block(geometry->type)) {
        const struct sadmm_world_block_shape *kept = &world->block_shapes[id.slot - 1];
        def.hull = kept->hull;
        def.mesh = kept->mesh;
        memcpy(def.position, kept->position, sizeof def.position);
        memcpy(def.orientation, kept->orientation, sizeof def.orientation);
    }
    TRY(sadmm_growing_give(&sadmm_growing_shape, out, size, 0, &def, "def", error));
    if (body) *body = sadmm_world_body_id(world, (size_t)shape->body);
    return SADMM_OK;
}

sadmm_status sadmm_world_set_shape_material(sadmm_world *world, sadmm_shape_id id, double friction, double restitution)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_shape *shape = sadmm_world_find_shape(world, id, "id", error);
    if (!shape) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_numbers_check(SADMM_SHAPE_FIELD(friction), &friction, "friction", error));
    TRY(sadmm_numbers_check(SADMM_SHAPE_FIELD(restitution), &restitution, "restitution", error));
    TRY(sadmm_world_detach(world));
    world->bouncing_count += (restitution > 0) - (shape->restitution > 0);
    shape->friction = friction;
    shape->restitution = restitution;
    ++world->shape_changes;
    return SADMM_OK;
}

sadmm_status sadmm_world_set_shape_surface_velocity(sadmm_world *world, sadmm_shape_id id, const double velocity[3])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_shape *shape = sadmm_world_find_shape(world, id, "id", error);
    if (!shape) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(velocity, "velocity", error));
    TRY(check_surface("velocity", &world->bodies[shape->body], velocity, error));
    double *own = world->surfaces + 3 * (size_t)(id.slot - 1);
    if (memcmp(own, velocity, 3 * sizeof *own) == 0) return SADMM_OK;
    TRY(sadmm_world_detach(world));
    world->moving_surfaces += !is_zero(velocity) - !is_zero(own);
    memcpy(own, velocity, 3 * sizeof *own);
    return SADMM_OK;
}

/* ---- size and place ---------------------------------------------------------------------------------------------- */

/* Contacts of a shape with other sizes, or in another place, begin anew: its revision is another one. It depends on
 * what the shape is and not on how it came to be that: environments take turns in one world, and each must find its own
 * contacts again (environments.h). So the revision moves by the difference of two words. */
static uint32_t form_word(const sadmm_world *world, size_t slot)
{
    double numbers[10];
    uint64_t word = UINT64_C(0x9E3779B97F4A7C15);
    memcpy(numbers, world->geometries[world->shapes[slot].geometry].size, 3 * sizeof *numbers);
    sadmm_world_read_shape_frame(world, slot, numbers + 3);
    for (int k = 0; k < 10; ++k) {
        uint64_t bits;
        memcpy(&bits, &numbers[k], sizeof bits);
        word = (word ^ bits) * UINT64_C(0xBF58476D1CE4E5B9);
        word ^= word >> 29;
    }
    return (uint32_t)(word >> 32) ^ (uint32_t)word;
}

static void reform(sadmm_world *world, size_t slot, uint32_t before)
{
    world->shapes[slot].revision += form_word(world, slot) - before;
    world->shapes[slot].formed = ++world->shape_changes;
    sadmm_world_moved(world);
}

static int sizes_of(const sadmm_world *world, size_t slot)
{
    return sadmm_shape_sizes[world->geometries[world->shapes[slot].geometry].type];
}

void sadmm_world_read_shape_size(const sadmm_world *world, size_t slot, double size[3])
{
    const double *own = world->geometries[world->shapes[slot].geometry].size;
    for (int k = 0; k < 3; ++k) size[k] = k < sizes_of(world, slot) ? own[k] : 0;
}

sadmm_status sadmm_world_check_shape_size(const sadmm_world *world, size_t slot, const double size[3],
                                          struct sadmm_error *error)
{
    const struct sadmm_field *const range = SADMM_SHAPE_FIELD(size);
    const int sizes = sizes_of(world, slot);
    for (int k = 0; k < 3; ++k) {
        if (k < sizes && !(size[k] >= range->lo && size[k] <= range->hi))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "size[%d] = %g: must be in [%g, %g] m", k, size[k],
                              range->lo, range->hi);
        if (k >= sizes && !(size[k] == 0))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "size[%d] = %g: must be 0, for a shape of type %d has %d sizes", k, size[k],
                              (int)world->geometries[world->shapes[slot].geometry].type, sizes);
    }
    return SADMM_OK;
}

sadmm_status sadmm_world_set_shape_size(sadmm_world *world, sadmm_shape_id id, const double size[3])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_shape *shape = sadmm_world_find_shape(world, id, "id", error);
    if (!shape) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(size, "size", error));
    const size_t slot = id.slot - 1, bytes = (size_t)sizes_of(world, slot) * sizeof *size;
    TRY(sadmm_world_check_shape_size(world, slot, size, error));
    double *own = world->geometries[shape->geometry].size;
    if (memcmp(own, size, bytes) == 0) return SADMM_OK;
    TRY(sadmm_world_detach(world));
    const uint32_t before = form_word(world, slot);
    memcpy(own, size, bytes);
    reform(world, slot, before);
    return SADMM_OK;
}

/* One that is of unit length to rounding stays as it is, so that what was read can be set again. */
static sadmm_status take_orientation(const double given[4], double out[4], struct sadmm_error *error)
{
    double length2 = 0;
    TRY(sadmm_check_orientation("orientation", given, out, error));
    for (int k = 0; k < 4; ++k) length2 += given[k] * given[k];
    if (fabs(length2 - 1) <= 8 * DBL_EPSILON) memcpy(out, given, 4 * sizeof *out);
    return SADMM_OK;
}

sadmm_status sadmm_world_check_shape_frame(const double position[3], const double orientation[4],
                                           struct sadmm_error *error)
{
    double ignored[4];
    TRY(sadmm_check_vector("position", position, 3, SADMM_SHAPE_FIELD(position)->hi, error));
    return take_orientation(orientation, ignored, error);
}

sadmm_status sadmm_world_set_shape_frame(sadmm_world *world, sadmm_shape_id id, const double position[3],
                                         const double orientation[4])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_shape *shape = sadmm_world_find_shape(world, id, "id", error);
    if (!shape) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(position, "position", error));
    TRY(sadmm_check_given(orientation, "orientation", error));
    TRY(sadmm_world_check_shape_frame(position, orientation, error));
    const size_t slot = id.slot - 1;
    double now[7], frame[7];
    sadmm_world_read_shape_frame(world, slot, now);
    memcpy(frame, position, 3 * sizeof *frame);
    TRY(take_orientation(orientation, frame + 3, error));
    if (memcmp(now, frame, sizeof now) == 0) return SADMM_OK;
    TRY(sadmm_world_detach(world));
    const uint32_t before = form_word(world, slot);
    sadmm_shape_def def = {.type = (sadmm_shape_type)world->geometries[shape->geometry].type};
    if (has_block(def.type)) {
        struct sadmm_world_block_shape *kept = &world->block_shapes[slot];
        def.hull = kept->hull;
        def.mesh = kept->mesh;
        memcpy(kept->position, frame, sizeof kept->position);
        memcpy(kept->orientation, frame + 3, sizeof kept->orientation);
    }
    memcpy(def.position, frame, sizeof def.position);
    sadmm_shape_form_place(&def, frame + 3, shape->position, shape->orientation);
    reform(world, slot, before);
    return SADMM_OK;
}
