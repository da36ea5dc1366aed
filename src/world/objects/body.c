/* Bodies of a world. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "body.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "core/base/utf8.h"
#include "core/math/rigid.h"
#include "core/model/extrapolation.h"
#include "joint.h"
#include "shape.h"
#include "subadmm/arrays.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"
#include "world/step/kinematic.h"

static const double WRENCH_LIMIT = 1e15;
/* Of a state that is set: whatever a step can make. */
static const double ANY = HUGE_VAL;

static const sadmm_body_def defaults = {SADMM_BODY_FIELDS(SADMM_FIELD_DEFAULT, )};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_body_def, &defaults, angular_damping);

void sadmm_body_def_init(sadmm_body_def *def, size_t size) { sadmm_growing_init(&growing, def, size, 0); }

/* World-frame moments are sums of all three, so that the smallest is known to (unit roundoff x ratio): it and the
 * velocity about its axis are lost to 1 % at these ratios, wholly at some 100 times these. */
static double inertia_ratio_limit(sadmm_precision precision) { return precision == SADMM_F32 ? 1e6 : 1e12; }

static sadmm_status check_inertia_ratio(const char *name, const double inertia[3], sadmm_precision precision,
                                        struct sadmm_error *error)
{
    double least = fmin(inertia[0], fmin(inertia[1], inertia[2])),
           most = fmax(inertia[0], fmax(inertia[1], inertia[2]));
    if (!(most <= inertia_ratio_limit(precision) * least))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "%s = (%g, %g, %g): the largest must be at most %g times the smallest in %s precision, "
                          "which cannot resolve more", name, inertia[0], inertia[1], inertia[2],
                          inertia_ratio_limit(precision), precision == SADMM_F32 ? "single" : "double");
    return SADMM_OK;
}

sadmm_status sadmm_world_check_inertias(sadmm_world *world, sadmm_precision precision)
{
    for (size_t slot = 0; slot < world->body_slots; ++slot) {
        const struct sadmm_world_body *body = &world->bodies[slot];
        char name[96];
        if (!body->alive || body->type != SADMM_BODY_DYNAMIC) continue;
        snprintf(name, sizeof name, "inertia of body (slot %zu, generation %u)", slot + 1, body->generation);
        TRY(check_inertia_ratio(name, body->rigid.inertia, precision, &world->error));
    }
    return SADMM_OK;
}

/* name: of the argument. */
static sadmm_status check_inertia(const char *name, const double inertia[3], sadmm_precision precision,
                                  struct sadmm_error *error)
{
    const struct sadmm_field *const range = SADMM_BODY_FIELD(inertia);
    for (int k = 0; k < 3; ++k)
        if (!(inertia[k] >= range->lo && inertia[k] <= range->hi))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s[%d] = %g: must be in [%g, %g] kg m^2", name, k,
                              inertia[k], range->lo, range->hi);
    for (int k = 0; k < 3; ++k) {
        double others = inertia[(k + 1) % 3] + inertia[(k + 2) % 3];
        if (!(inertia[k] <= others * (1 + 1e-9)))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "%s[%d] = %g: must be at most the sum of the other two, %g (no rigid body has more)",
                              name, k, inertia[k], others);
    }
    return check_inertia_ratio(name, inertia, precision, error);
}

static sadmm_status check_motion(const char *linear_name, const char *angular_name, const double linear[3],
                                 const double angular[3], sadmm_body_type type, struct sadmm_error *error)
{
    for (int k = 0; k < 6 && type == SADMM_BODY_STATIC; ++k) {
        double x = k < 3 ? linear[k] : angular[k - 3];
        if (!(x == 0))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s[%d] = %g: must be 0, for the body is static",
                              k < 3 ? linear_name : angular_name, k % 3, x);
    }
    TRY(sadmm_check_vector(linear_name, linear, 3, ANY, error));
    return sadmm_check_vector(angular_name, angular, 3, ANY, error);
}

static sadmm_status check_def(const sadmm_body_def *def, sadmm_precision precision, double orientation[4],
                              struct sadmm_error *error)
{
    for (int k = 0; k < SADMM_BODY_FIELDS_COUNT; ++k)
        if (def->type == SADMM_BODY_DYNAMIC || sadmm_body_table[k].role != SADMM_IS_DYNAMIC)
            TRY(sadmm_field_check(&sadmm_body_table[k], def, "def->", error));
    if (def->type == SADMM_BODY_DYNAMIC) TRY(check_inertia("def->inertia", def->inertia, precision, error));
    TRY(sadmm_check_orientation("def->orientation", def->orientation, orientation, error));
    TRY(check_motion("def->linear_velocity", "def->angular_velocity", def->linear_velocity, def->angular_velocity,
                     def->type, error));
    if (def->type == SADMM_BODY_DYNAMIC && def->environment < 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->environment = %d: must be >= 0", def->environment);
    return SADMM_OK;
}

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
    TRY(check_def(def, world->def.precision, orientation, error));
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

sadmm_status sadmm_world_body_state(sadmm_world *world, sadmm_body_id id, sadmm_body_state *state)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(state, "state", error));
    TRY(sadmm_world_download_bodies(world));
    memcpy(state->position, body->rigid.position, sizeof state->position);
    memcpy(state->orientation, body->rigid.orientation, sizeof state->orientation);
    memcpy(state->linear_velocity, body->rigid.velocity, sizeof state->linear_velocity);
    memcpy(state->angular_velocity, body->rigid.velocity + 3, sizeof state->angular_velocity);
    return SADMM_OK;
}

/* What a step made is set as it is: an orientation that is unit but for its own rounding would be another one once
 * normalised. */
static void keep_if_unit(const double given[4], double normalised[4])
{
    double most = 0;
    for (int k = 0; k < 4; ++k) most = fmax(most, fabs(normalised[k] - given[k]));
    if (most <= 2 * DBL_EPSILON) memcpy(normalised, given, 4 * sizeof *normalised);
}

sadmm_status sadmm_world_check_body_state(const struct sadmm_world_body *body, const sadmm_body_state *state,
                                          double orientation[4], struct sadmm_error *error)
{
    TRY(sadmm_check_vector("state->position", state->position, 3, ANY, error));
    TRY(sadmm_check_orientation("state->orientation", state->orientation, orientation, error));
    keep_if_unit(state->orientation, orientation);
    return check_motion("state->linear_velocity", "state->angular_velocity", state->linear_velocity,
                        state->angular_velocity, body->type, error);
}

sadmm_status sadmm_world_set_body_state(sadmm_world *world, sadmm_body_id id, const sadmm_body_state *state)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    double orientation[4];
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(state, "state", error));
    TRY(sadmm_world_check_body_state(body, state, orientation, error));
    /* A static body is part of what the backend was given once. */
    if (!sadmm_body_moves(body->system_body)) TRY(sadmm_world_detach(world));
    double velocity[6];
    memcpy(velocity, state->linear_velocity, sizeof state->linear_velocity);
    memcpy(velocity + 3, state->angular_velocity, sizeof state->angular_velocity);
    extrapolation_set(&body->extrapolation, &body->rigid, state->position, orientation, velocity);
    sadmm_world_moved(world);
    sadmm_world_update(world, body, SADMM_UPDATE_STATE);
    if (body->target.set) sadmm_world_update(world, body, SADMM_UPDATE_TARGET);
    body->target.set = false;
    return SADMM_OK;
}

sadmm_status sadmm_world_move_body(sadmm_world *world, sadmm_body_id id, const double position[3],
                                   const double orientation[4])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    double unit[4];
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(position, "position", error));
    TRY(sadmm_check_given(orientation, "orientation", error));
    if (body->type != SADMM_BODY_KINEMATIC)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "id = (slot %u, generation %u): must be kinematic",
                          id.slot, id.generation);
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(position), position, "position", error));
    TRY(sadmm_check_orientation("orientation", orientation, unit, error));
    keep_if_unit(orientation, unit);
    memcpy(body->target.position, position, sizeof body->target.position);
    memcpy(body->target.orientation, unit, sizeof unit);
    body->target.set = true;
    sadmm_world_update(world, body, SADMM_UPDATE_TARGET);
    return SADMM_OK;
}

sadmm_status sadmm_world_body_move(sadmm_world *world, sadmm_body_id id, bool *pending, double position[3],
                                   double orientation[4])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(pending, "pending", error));
    TRY(sadmm_check_given(position, "position", error));
    TRY(sadmm_check_given(orientation, "orientation", error));
    TRY(sadmm_world_download_bodies(world));
    *pending = body->target.set;
    if (!body->target.set) return SADMM_OK;
    memcpy(position, body->target.position, sizeof body->target.position);
    memcpy(orientation, body->target.orientation, sizeof body->target.orientation);
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

static sadmm_status check_dynamic(const struct sadmm_world_body *body, sadmm_body_id id, const char *why,
                                  struct sadmm_error *error)
{
    if (body->type == SADMM_BODY_DYNAMIC) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                      "id = (slot %u, generation %u): is %s, and must be dynamic: %s", id.slot, id.generation,
                      sadmm_body_type_names[body->type], why);
}

sadmm_status sadmm_world_check_wrench(const double force[3], const double torque[3], struct sadmm_error *error)
{
    TRY(sadmm_check_vector("force", force, 3, WRENCH_LIMIT, error));
    return sadmm_check_vector("torque", torque, 3, WRENCH_LIMIT, error);
}

sadmm_status sadmm_world_set_body_wrench(sadmm_world *world, sadmm_body_id id, const double force[3],
                                         const double torque[3])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(force, "force", error));
    TRY(sadmm_check_given(torque, "torque", error));
    TRY(check_dynamic(body, id, "no wrench moves it", error));
    TRY(sadmm_world_check_wrench(force, torque, error));
    if (body->system_body < 0) TRY(sadmm_world_detach(world));
    memcpy(body->rigid.wrench, force, 3 * sizeof *force);
    memcpy(body->rigid.wrench + 3, torque, 3 * sizeof *torque);
    sadmm_world_update(world, body, SADMM_UPDATE_FORCES);
    return SADMM_OK;
}

sadmm_status sadmm_world_body_wrench(sadmm_world *world, sadmm_body_id id, double force[3], double torque[3])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(force, "force", error));
    TRY(sadmm_check_given(torque, "torque", error));
    TRY(sadmm_world_download_bodies(world));
    memcpy(force, body->rigid.wrench, 3 * sizeof *force);
    memcpy(torque, body->rigid.wrench + 3, 3 * sizeof *torque);
    return SADMM_OK;
}

sadmm_status sadmm_world_set_body_gravity_scale(sadmm_world *world, sadmm_body_id id, double scale)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(check_dynamic(body, id, "gravity does not move it", error));
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(gravity_scale), &scale, "scale", error));
    if (body->system_body < 0) TRY(sadmm_world_detach(world));
    body->rigid.gravity_scale = scale;
    sadmm_world_update(world, body, SADMM_UPDATE_FORCES);
    return SADMM_OK;
}

sadmm_status sadmm_world_set_body_damping(sadmm_world *world, sadmm_body_id id, double linear, double angular)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(check_dynamic(body, id, "it has no motion to damp", error));
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(linear_damping), &linear, "linear", error));
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(angular_damping), &angular, "angular", error));
    if (body->system_body < 0) TRY(sadmm_world_detach(world));
    body->rigid.damping[0] = linear;
    body->rigid.damping[1] = angular;
    sadmm_world_update(world, body, SADMM_UPDATE_FORCES);
    return SADMM_OK;
}

/* moment = (point - centre of mass) x v */
static void moment_of(const struct sadmm_rigid *rigid, const double v[3], const double point[3], double moment[3])
{
    const vec3 arm = v3_sub(v3_load(point), v3_load(rigid->position));
    v3_store(v3_cross(arm, v3_load(v)), moment);
}

sadmm_status sadmm_world_add_body_force_at(sadmm_world *world, sadmm_body_id id, const double force[3],
                                           const double point[3])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    double sum[6];
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(force, "force", error));
    TRY(sadmm_check_given(point, "point", error));
    TRY(sadmm_check_vector("force", force, 3, WRENCH_LIMIT, error));
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(position), point, "point", error));
    TRY(sadmm_world_download_bodies(world));
    moment_of(&body->rigid, force, point, sum + 3);
    for (int k = 0; k < 6; ++k) sum[k] = body->rigid.wrench[k] + (k < 3 ? force[k] : sum[k]);
    return sadmm_world_set_body_wrench(world, id, sum, sum + 3);
}

sadmm_status sadmm_world_apply_body_impulse_at(sadmm_world *world, sadmm_body_id id, const double impulse[3],
                                               const double point[3])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    sadmm_body_state state;
    double moment[3];
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(impulse, "impulse", error));
    TRY(sadmm_check_given(point, "point", error));
    TRY(check_dynamic(body, id, "no impulse moves it", error));
    TRY(sadmm_check_vector("impulse", impulse, 3, ANY, error));
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(position), point, "point", error));
    TRY(sadmm_world_body_state(world, id, &state));
    moment_of(&body->rigid, impulse, point, moment);
    const double *I = body->rigid.inertia;
    const sym3 inverse =
        rigid_world_inertia(q_matrix(q_load(state.orientation)), v3(1 / I[0], 1 / I[1], 1 / I[2]));
    v3_store(v3_add(v3_load(state.angular_velocity), s3_mul(inverse, v3_load(moment))), state.angular_velocity);
    for (int k = 0; k < 3; ++k) state.linear_velocity[k] += impulse[k] / body->rigid.mass;
    return sadmm_world_set_body_state(world, id, &state);
}

sadmm_status sadmm_world_check_mass(const sadmm_world *world, double mass, const double inertia[3],
                                    struct sadmm_error *error)
{
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(mass), &mass, "mass", error));
    return check_inertia("inertia", inertia, world->def.precision, error);
}

sadmm_status sadmm_world_set_body_mass(sadmm_world *world, sadmm_body_id id, double mass, const double inertia[3])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(inertia, "inertia", error));
    TRY(check_dynamic(body, id, "it has no mass", error));
    TRY(sadmm_world_check_mass(world, mass, inertia, error));
    TRY(sadmm_world_detach(world));
    body->rigid.mass = mass;
    memcpy(body->rigid.inertia, inertia, sizeof body->rigid.inertia);
    return SADMM_OK;
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

sadmm_status sadmm_world_body_contact_wrench(sadmm_world *world, sadmm_body_id id, double wrench[6])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(wrench, "wrench", error));
    TRY(sadmm_world_download_bodies(world));
    if (!world->stepped || !world->step_settings.recover_wrenches)
        return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE,
                          "contact wrenches: there was no step yet, or settings.recover_wrenches was false");
    if (body->type == SADMM_BODY_STATIC)
        return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE, "contact wrenches are kept for dynamic and kinematic bodies");
    memcpy(wrench, body->contact_wrench, sizeof body->contact_wrench);
    return SADMM_OK;
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

/* ---- inertia of solids ---------------------------------------------------------------------------------------- */

void sadmm_box_inertia(double mass, const double h[3], double inertia[3])
{
    if (!h || !inertia) return;
    inertia[0] = mass / 3 * (h[1] * h[1] + h[2] * h[2]);
    inertia[1] = mass / 3 * (h[0] * h[0] + h[2] * h[2]);
    inertia[2] = mass / 3 * (h[0] * h[0] + h[1] * h[1]);
}

void sadmm_sphere_inertia(double mass, double radius, double inertia[3])
{
    if (!inertia) return;
    inertia[0] = inertia[1] = inertia[2] = 0.4 * mass * radius * radius;
}

/* A cylinder of length 2 h and two half balls, by their shares of the volume. */
void sadmm_capsule_inertia(double mass, double r, double h, double inertia[3])
{
    if (!inertia) return;
    double cylinder = 2 * h, balls = 4.0 / 3.0 * r;
    double mc = mass * cylinder / (cylinder + balls), mb = mass - mc;
    double ball_axis = 0.4 * mb * r * r;
    double ball_side = ball_axis + mb * (h * h + 0.75 * h * r);
    inertia[2] = 0.5 * mc * r * r + ball_axis;
    inertia[0] = inertia[1] = mc * (3 * r * r + cylinder * cylinder) / 12 + ball_side;
}
