/* Bodies of a world: what they are, and which there are. */
#include <string.h>

#include "body_check.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "coupling.h"
#include "joint_slots.h"
#include "shape.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"
#include "world/step/kinematic.h"

static const sadmm_body_def defaults = {SADMM_BODY_FIELDS(SADMM_FIELD_DEFAULT, )};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_body_def, &defaults, angular_damping);

void sadmm_body_def_init(sadmm_body_def *def, size_t size) { sadmm_growing_init(&growing, def, size, 0); }

sadmm_status sadmm_world_add_body(sadmm_world *world, const sadmm_body_def *given, sadmm_body_id *id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    sadmm_body_def taken;
    const sadmm_body_def *const def = &taken;
    double orientation[4];
    size_t slot;
    TRY(sadmm_growing_take(&growing, &taken, given, "def", error));
    TRY(sadmm_check_given(id, "id", error));
    TRY(sadmm_world_check_body_def(def, world->def.precision, orientation, error));
    TRY(sadmm_world_detach(world));
    TRY(sadmm_ids_next(&world->body_ids, &slot, error));
    if (!SADMM_GROW(world->bodies, world->body_ids.slots, slot + 1)) return sadmm_fail_memory(error, "a body");
    TRY(sadmm_tags_set(&world->body_ids.tags, slot, def->name, def->user_data, error));

    struct sadmm_world_body *body = &world->bodies[slot];
    memset(body, 0, sizeof *body);
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
    sadmm_ids_take(&world->body_ids, slot);
    if (def->type == SADMM_BODY_KINEMATIC) sadmm_world_count_kinematic(world, 1);
    *id = sadmm_world_body_id(world, slot);
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
    sadmm_world_kill_couplings_of(world, (int32_t)id.slot - 1);
    sadmm_pair_table_forget(&world->disabled_pairs, id.slot - 1);
    sadmm_ids_release(&world->body_ids, id.slot - 1);
    if (body->type == SADMM_BODY_DYNAMIC) --world->dynamic_count;
    if (body->type == SADMM_BODY_KINEMATIC) sadmm_world_count_kinematic(world, -1);
    world->contacts_readable = false;
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
                          .name = sadmm_tags_name(&world->body_ids.tags, id.slot - 1),
                          .user_data = sadmm_tags_data(&world->body_ids.tags, id.slot - 1),
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
