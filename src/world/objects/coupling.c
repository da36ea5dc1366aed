/* Couplings of a world: what callers see of them, and change. In a step a coupling acts as a joint from its target to
 * the frame on the body would whose six coordinates have position drives: its gains and limits. */
#include "subadmm/coupling.h"

#include <math.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "core/math/rigid.h"
#include "coupling.h"
#include "joint.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"

static const sadmm_coupling_def defaults = {SADMM_COUPLING_FIELDS(SADMM_FIELD_DEFAULT, )};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_coupling_def, &defaults, enabled);

void sadmm_coupling_def_init(sadmm_coupling_def *def, size_t size) { sadmm_growing_init(&growing, def, size, 0); }

/* ---- checks ------------------------------------------------------------------------------------------------------ */

/* Gains and limits, under their own names. */
static sadmm_status check_numbers(const sadmm_coupling_def *def, struct sadmm_error *error)
{
    const size_t count = SADMM_COUPLING_PLACE_max_torque - SADMM_COUPLING_PLACE_linear_stiffness + 1;
    return sadmm_fields_check(SADMM_COUPLING_FIELD(linear_stiffness), count, def, "", error);
}

sadmm_status sadmm_world_check_target(const double position[3], const double orientation[4], const double velocity[6],
                                      struct sadmm_rigid *target, struct sadmm_error *error)
{
    TRY(sadmm_numbers_check(SADMM_COUPLING_FIELD(target_position), position, "position", error));
    if (velocity) TRY(sadmm_numbers_check(SADMM_COUPLING_FIELD(target_velocity), velocity, "velocity", error));
    TRY(sadmm_check_orientation("orientation", orientation, target->orientation, error));
    memcpy(target->position, position, sizeof target->position);
    if (velocity) memcpy(target->velocity, velocity, sizeof target->velocity);
    else memset(target->velocity, 0, sizeof target->velocity);
    return SADMM_OK;
}

static sadmm_status check_def(const sadmm_world *world, const sadmm_coupling_def *def, struct sadmm_error *error)
{
    const struct sadmm_world_body *body = sadmm_world_find_body(world, def->body, "def->body", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    if (body->type != SADMM_BODY_DYNAMIC)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "def->body = (slot %u, generation %u, \"%s\"): must be dynamic, it is %s", def->body.slot,
                          def->body.generation, sadmm_world_body_name(world, def->body),
                          sadmm_body_type_names[body->type]);
    return sadmm_fields_check(sadmm_coupling_table, SADMM_COUPLING_FIELDS_COUNT, def, "def->", error);
}

/* ---- life -------------------------------------------------------------------------------------------------------- */

/* What its joint is to do. */
static void set_drives(sadmm_joint_def *joint, const sadmm_coupling_def *def)
{
    joint->enabled = def->enabled;
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        sadmm_joint_coordinate *c = &joint->coordinates[k];
        c->drive_stiffness = k < 3 ? def->linear_stiffness : def->angular_stiffness;
        c->drive_damping = k < 3 ? def->linear_damping : def->angular_damping;
        c->drive_force = k < 3 ? def->max_force : def->max_torque;
        c->drive = c->drive_stiffness > 0 || c->drive_damping > 0 ? SADMM_DRIVE_POSITION : SADMM_DRIVE_OFF;
    }
}

static void set_joint(struct sadmm_world_coupling *coupling)
{
    const sadmm_coupling_def *def = &coupling->def;
    struct sadmm_world_joint *joint = &coupling->joint;
    joint->def = sadmm_joint_def_default();
    joint->def.kind = SADMM_JOINT_CUSTOM;
    joint->def.body_b = def->body;
    joint->body[0] = -1;
    joint->body[1] = (int32_t)def->body.slot - 1;
    joint->frame[0] = (struct joint_frame){.orientation = {1, 0, 0, 0}};
    joint->frame[1] = (struct joint_frame){v3_load(def->position), q_load(def->orientation)};
    set_drives(&joint->def, def);
}

sadmm_status sadmm_world_read_coupling(const sadmm_world *world, struct sadmm_world_coupling *coupling,
                                       struct sadmm_error *error)
{
    TRY(check_def(world, &coupling->def, error));
    set_joint(coupling);
    return SADMM_OK;
}

static struct sadmm_link *link_at(sadmm_world *world, uint32_t name)
{
    return &world->couplings[name - 1].joint.on_body[1];
}

void sadmm_world_link_coupling(sadmm_world *world, size_t slot)
{
    struct sadmm_world_joint *joint = &world->couplings[slot].joint;
    joint->coupling = (int32_t)slot + 1;
    sadmm_link_add(world, link_at, &world->bodies[joint->body[1]].first_coupling, (uint32_t)slot + 1);
}

static void kill(sadmm_world *world, size_t slot)
{
    const int32_t body = world->couplings[slot].joint.body[1];
    sadmm_link_remove(world, link_at, &world->bodies[body].first_coupling, (uint32_t)slot + 1);
    sadmm_ids_release(&world->coupling_ids, slot);
}

void sadmm_world_kill_couplings_of(sadmm_world *world, int32_t body)
{
    const uint32_t *first = &world->bodies[body].first_coupling;
    while (*first) kill(world, *first - 1);
}

sadmm_status sadmm_world_add_coupling(sadmm_world *world, const sadmm_coupling_def *given, sadmm_coupling_id *id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_coupling made = {.joint = {.coupling = 0}};
    sadmm_coupling_def *const def = &made.def;
    size_t slot;
    TRY(sadmm_growing_take(&growing, def, given, "def", error));
    TRY(check_def(world, def, error));
    TRY(sadmm_check_orientation("def->orientation", def->orientation, def->orientation, error));
    TRY(sadmm_world_check_target(def->target_position, def->target_orientation, def->target_velocity, &made.last.target,
                                 error));
    set_joint(&made);
    TRY(sadmm_world_detach(world));
    TRY(sadmm_ids_next(&world->coupling_ids, &slot, error));
    if (!SADMM_GROW(world->couplings, world->coupling_ids.slots, slot + 1))
        return sadmm_fail_memory(error, "a coupling");
    TRY(sadmm_tags_set(&world->coupling_ids.tags, slot, def->name, def->user_data, error));
    def->name = NULL; /* both are in the tags */
    def->user_data = NULL;
    sadmm_ids_take(&world->coupling_ids, slot);
    world->couplings[slot] = made;
    sadmm_world_link_coupling(world, slot);
    if (id) *id = sadmm_world_coupling_id(world, slot);
    return SADMM_OK;
}

sadmm_status sadmm_world_remove_coupling(sadmm_world *world, sadmm_coupling_id id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    if (!sadmm_world_find_coupling(world, id, "id", &world->error)) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_world_detach(world));
    kill(world, id.slot - 1);
    return SADMM_OK;
}

/* ---- what it is, and what is set --------------------------------------------------------------------------------- */

sadmm_status sadmm_world_coupling_def_sized(sadmm_world *world, sadmm_coupling_id id, sadmm_coupling_def *out,
                                            size_t size)
{
    TRY(sadmm_check_given(world, "world", NULL));
    const struct sadmm_world_coupling *coupling = sadmm_world_find_coupling(world, id, "id", &world->error);
    if (!coupling) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(out, "def", &world->error));
    TRY(sadmm_world_download_joints(world));
    const struct sadmm_rigid *target = &coupling->last.target;
    sadmm_coupling_def def = coupling->def;
    memcpy(def.target_position, target->position, sizeof def.target_position);
    memcpy(def.target_orientation, target->orientation, sizeof def.target_orientation);
    memcpy(def.target_velocity, target->velocity, sizeof def.target_velocity);
    def.name = sadmm_tags_name(&world->coupling_ids.tags, id.slot - 1);
    def.user_data = sadmm_tags_data(&world->coupling_ids.tags, id.slot - 1);
    return sadmm_growing_give(&growing, out, size, 0, &def, "def", &world->error);
}

sadmm_status sadmm_world_set_coupling_target(sadmm_world *world, sadmm_coupling_id id, const double position[3],
                                             const double orientation[4], const double velocity[6])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_coupling *coupling = sadmm_world_find_coupling(world, id, "id", error);
    struct sadmm_rigid target = {.position = {0}};
    if (!coupling) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(position, "position", error));
    TRY(sadmm_check_given(orientation, "orientation", error));
    TRY(sadmm_world_check_target(position, orientation, velocity, &target, error));
    coupling->last.target = target;
    return sadmm_world_take_update(world, &coupling->joint, SADMM_JOINT_TARGET);
}

/* Gains, limits and whether it acts: those of `def` from here on. */
static sadmm_status change(sadmm_world *world, struct sadmm_world_coupling *coupling, const sadmm_coupling_def *def)
{
    TRY(check_numbers(def, &world->error));
    coupling->def = *def;
    set_drives(&coupling->joint.def, def);
    for (int k = 0; k <= SADMM_JOINT_ENABLED; ++k)
        TRY(sadmm_world_take_update(world, &coupling->joint, (enum sadmm_joint_update)k));
    return SADMM_OK;
}

sadmm_status sadmm_world_set_coupling_gains(sadmm_world *world, sadmm_coupling_id id, double linear_stiffness,
                                            double linear_damping, double angular_stiffness, double angular_damping)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_world_coupling *coupling = sadmm_world_find_coupling(world, id, "id", &world->error);
    if (!coupling) return SADMM_ERROR_STALE_ID;
    sadmm_coupling_def def = coupling->def;
    def.linear_stiffness = linear_stiffness;
    def.linear_damping = linear_damping;
    def.angular_stiffness = angular_stiffness;
    def.angular_damping = angular_damping;
    return change(world, coupling, &def);
}

sadmm_status sadmm_world_set_coupling_limits(sadmm_world *world, sadmm_coupling_id id, double max_force,
                                             double max_torque)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_world_coupling *coupling = sadmm_world_find_coupling(world, id, "id", &world->error);
    if (!coupling) return SADMM_ERROR_STALE_ID;
    sadmm_coupling_def def = coupling->def;
    def.max_force = max_force;
    def.max_torque = max_torque;
    return change(world, coupling, &def);
}

sadmm_status sadmm_world_set_coupling_enabled(sadmm_world *world, sadmm_coupling_id id, bool enabled)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_world_coupling *coupling = sadmm_world_find_coupling(world, id, "id", &world->error);
    if (!coupling) return SADMM_ERROR_STALE_ID;
    sadmm_coupling_def def = coupling->def;
    def.enabled = enabled;
    return change(world, coupling, &def);
}

/* ---- state ------------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_world_coupling_state(sadmm_world *world, sadmm_coupling_id id, sadmm_coupling_state *state)
{
    TRY(sadmm_check_given(world, "world", NULL));
    const struct sadmm_world_coupling *coupling = sadmm_world_find_coupling(world, id, "id", &world->error);
    if (!coupling) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(state, "state", &world->error));
    TRY(sadmm_world_download_bodies(world));
    TRY(sadmm_world_download_joints(world));
    const struct sadmm_coupling_memory *last = &coupling->last;
    const struct sadmm_world_joint *joint = &coupling->joint;
    const struct joint_end end = joint_end_on(&joint->frame[1], &world->bodies[joint->body[1]].rigid);
    memcpy(state->reaction_force, last->reaction, sizeof state->reaction_force);
    memcpy(state->reaction_torque, last->reaction + 3, sizeof state->reaction_torque);
    memcpy(state->body_force, last->body, sizeof state->body_force);
    memcpy(state->body_torque, last->body + 3, sizeof state->body_torque);
    v3_store(v3_sub(v3_load(last->target.position), end.point), state->position_error);
    v3_store(q_log(q_mul(q_load(last->target.orientation), q_conjugate(end.orientation))), state->rotation_error);
    return SADMM_OK;
}
