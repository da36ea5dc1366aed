/* Bodies of a world: what they are, and which there are. */
#include <string.h>

#include "body_check.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "core/base/utf8.h"
#include "joint_slots.h"
#include "shape.h"
#include "subadmm/arrays.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"
#include "world/step/kinematic.h"

static const sadmm_body_def defaults = {SADMM_BODY_FIELDS(SADMM_FIELD_DEFAULT, )};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_body_def, &defaults, angular_damping);

void sadmm_body_def_init(sadmm_body_def *def, size_t size) { sadmm_growing_init(&growing, def, size, 0); }

/* A copy of `given`, cut to the characters that fit. */
static sadmm_status copy_name(const char *given, char **name, struct sadmm_error *error)
{
    const size_t length = given ? sadmm_utf8_fit(given, SADMM_NAME_SIZE - 1) : 0;
    *name = NULL;
    if (given && given[length] && sadmm_utf8_character(given + length) == 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->name: must be UTF-8, its byte %zu (0x%02x) is not",
                          length, (unsigned char)given[length]);
    if (length == 0) return SADMM_OK;
    *name = (char *)sadmm_alloc(length + 1, 1);
    if (!*name) return sadmm_fail_memory(error, "a body's name");
    memcpy(*name, given, length);
    return SADMM_OK;
}

sadmm_status sadmm_world_add_body(sadmm_world *world, const sadmm_body_def *given, sadmm_body_id *id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    sadmm_body_def taken;
    const sadmm_body_def *const def = &taken;
    double orientation[4];
    char *name;
    TRY(sadmm_growing_take(&growing, &taken, given, "def", error));
    TRY(sadmm_check_given(id, "id", error));
    TRY(sadmm_world_check_body_def(def, world->def.precision, orientation, error));
    TRY(sadmm_world_detach(world));
    const size_t slot = sadmm_slots_free(&world->bodies_taken);
    if (slot >= (size_t)1 << 27)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%d bodies: a world holds at most 2^27", world->body_count);
    if (!SADMM_GROW(world->bodies, world->body_slots, slot + 1) || !sadmm_slots_reserve(&world->bodies_taken, slot + 1))
        return sadmm_fail_memory(error, "a body");
    TRY(copy_name(def->name, &name, error));

    struct sadmm_world_body *body = &world->bodies[slot];
    uint32_t generation = slot < world->body_slots ? body->generation : 1;
    memset(body, 0, sizeof *body);
    body->alive = true;
    body->generation = generation;
    body->type = def->type;
    body->environment = def->environment;
    body->system_body = -1;
    struct sadmm_rigid *rigid = &body->rigid;
    memcpy(rigid->position, def->position, sizeof rigid->position);
    memcpy(rigid->orientation, orientation, sizeof rigid->orientation);
    if (def->type == SADMM_BODY_DYNAMIC) {
        rigid->mass = def->mass;
        memcpy(rigid->inertia, def->inertia, sizeof rigid->inertia);
        rigid->gravity_scale = def->gravity_scale;
        rigid->damping[0] = def->linear_damping;
        rigid->damping[1] = def->angular_damping;
        ++world->dynamic_count;
    }
    memcpy(rigid->velocity, def->linear_velocity, sizeof def->linear_velocity);
    memcpy(rigid->velocity + 3, def->angular_velocity, sizeof def->angular_velocity);
    body->name = name;
    if (slot == world->body_slots) ++world->body_slots;
    sadmm_slots_take(&world->bodies_taken, slot);
    ++world->body_count;
    if (def->type == SADMM_BODY_KINEMATIC) sadmm_world_count_kinematic(world, 1);
    id->slot = (uint32_t)slot + 1;
    id->generation = generation;
    return SADMM_OK;
}

sadmm_status sadmm_world_remove_body(sadmm_world *world, sadmm_body_id id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", &world->error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_world_detach(world));
    while (body->first_shape) sadmm_world_kill_shape(world, body->first_shape - 1);
    sadmm_world_kill_joints_of(world, (int32_t)id.slot - 1);
    sadmm_pair_table_forget(&world->disabled_pairs, id.slot - 1);
    sadmm_free(body->name);
    body->name = NULL;
    body->alive = false;
    ++body->generation;
    --world->body_count;
    sadmm_slots_release(&world->bodies_taken, id.slot - 1);
    if (body->type == SADMM_BODY_DYNAMIC) --world->dynamic_count;
    if (body->type == SADMM_BODY_KINEMATIC) sadmm_world_count_kinematic(world, -1);
    world->contacts_readable = false;
    return SADMM_OK;
}

int32_t sadmm_world_body_count(const sadmm_world *world)
{
    return world ? world->body_count : 0;
}

sadmm_status sadmm_world_body_at(sadmm_world *world, int32_t index, sadmm_body_id *id)
{
    size_t slot;
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_world_slot_at(&world->bodies_taken, world->body_count, index, id, &slot, &world->error));
    *id = sadmm_world_body_id(world, (int32_t)slot);
    return SADMM_OK;
}

sadmm_status sadmm_world_body_index(sadmm_world *world, sadmm_body_id id, int32_t *index)
{
    TRY(sadmm_check_given(world, "world", NULL));
    if (!sadmm_world_find_body(world, id, "id", &world->error)) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(index, "index", &world->error));
    *index = sadmm_slots_index(&world->bodies_taken, id.slot - 1);
    return SADMM_OK;
}

sadmm_status sadmm_world_body_def_sized(sadmm_world *world, sadmm_body_id id, sadmm_body_def *out, size_t size)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(out, "def", error));
    TRY(sadmm_world_download_bodies(world));
    sadmm_body_def def = {.type = body->type,
                          .mass = body->rigid.mass,
                          .environment = body->environment,
                          .name = sadmm_world_body_name(body),
                          .gravity_scale = body->rigid.gravity_scale,
                          .linear_damping = body->rigid.damping[0],
                          .angular_damping = body->rigid.damping[1]};
    memcpy(def.inertia, body->rigid.inertia, sizeof def.inertia);
    memcpy(def.position, body->rigid.position, sizeof def.position);
    memcpy(def.orientation, body->rigid.orientation, sizeof def.orientation);
    memcpy(def.linear_velocity, body->rigid.velocity, sizeof def.linear_velocity);
    memcpy(def.angular_velocity, body->rigid.velocity + 3, sizeof def.angular_velocity);
    return sadmm_growing_give(&growing, out, size, 0, &def, "def", error);
}

sadmm_status sadmm_world_set_body_user_data(sadmm_world *world, sadmm_body_id id, void *data)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", &world->error);
    if (!body) return SADMM_ERROR_STALE_ID;
    body->user_data = data;
    return SADMM_OK;
}

void *sadmm_world_body_user_data(const sadmm_world *world, sadmm_body_id id)
{
    struct sadmm_error ignored;
    const struct sadmm_world_body *body = world ? sadmm_world_find_body(world, id, "id", &ignored) : NULL;
    return body ? body->user_data : NULL;
}

sadmm_status sadmm_world_set_body_pair_contact(sadmm_world *world, sadmm_body_id a, sadmm_body_id b, bool enabled)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    if (!sadmm_world_find_body(world, a, "a", error) || !sadmm_world_find_body(world, b, "b", error))
        return SADMM_ERROR_STALE_ID;
    if (a.slot == b.slot) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "a and b are the same body");
    TRY(sadmm_world_detach(world));
    uint64_t key = sadmm_pair_key(a.slot - 1, b.slot - 1);
    if (!enabled) return sadmm_pair_table_set(&world->disabled_pairs, key, 0, error);
    sadmm_pair_table_remove(&world->disabled_pairs, key);
    return SADMM_OK;
}

int32_t sadmm_world_body_pair_off_count(const sadmm_world *world)
{
    return world ? (int32_t)sadmm_pair_table_count(&world->disabled_pairs) : 0;
}

sadmm_status sadmm_world_body_pair_off_at(sadmm_world *world, int32_t index, sadmm_body_id *a, sadmm_body_id *b)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    TRY(sadmm_check_given(a, "a", error));
    TRY(sadmm_check_given(b, "b", error));
    const size_t count = sadmm_pair_table_count(&world->disabled_pairs);
    double ignored;
    if (index < 0 || (size_t)index >= count)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "index = %d: must be in [0, %zu)", index, count);
    const uint64_t key = sadmm_pair_table_at(&world->disabled_pairs, (size_t)index, &ignored);
    const uint32_t low = (uint32_t)(key >> 32), high = (uint32_t)key;
    *a = (sadmm_body_id){low + 1, world->bodies[low].generation};
    *b = (sadmm_body_id){high + 1, world->bodies[high].generation};
    return SADMM_OK;
}
