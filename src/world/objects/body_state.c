/* Where bodies are and what moves them: states, targets, forces, mass. */
#include <math.h>
#include <string.h>

#include "body_check.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/math/rigid.h"
#include "core/model/extrapolation.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"

/* ---- states and targets ------------------------------------------------------------------------------------------ */

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
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "id = (slot %u, generation %u, \"%s\"): must be kinematic", id.slot, id.generation,
                          sadmm_world_body_name(world, id));
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(position), position, "position", error));
    TRY(sadmm_world_check_turn("orientation", orientation, unit, error));
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

/* ---- forces and mass --------------------------------------------------------------------------------------------- */

/* Of a body that there is. */
static sadmm_status check_dynamic(sadmm_world *world, sadmm_body_id id, const char *why)
{
    const sadmm_body_type type = world->bodies[id.slot - 1].type;
    if (type == SADMM_BODY_DYNAMIC) return SADMM_OK;
    return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT,
                      "id = (slot %u, generation %u, \"%s\"): is %s, and must be dynamic: %s", id.slot, id.generation,
                      sadmm_world_body_name(world, id), sadmm_body_type_names[type], why);
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
    TRY(check_dynamic(world, id, "no wrench moves it"));
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
    TRY(check_dynamic(world, id, "gravity does not move it"));
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
    TRY(check_dynamic(world, id, "it has no motion to damp"));
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
    TRY(sadmm_check_vector("force", force, 3, SADMM_WRENCH_LIMIT, error));
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
    TRY(check_dynamic(world, id, "no impulse moves it"));
    TRY(sadmm_check_vector("impulse", impulse, 3, HUGE_VAL, error));
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

sadmm_status sadmm_world_set_body_mass(sadmm_world *world, sadmm_body_id id, double mass, const double inertia[3])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", error);
    if (!body) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(inertia, "inertia", error));
    TRY(check_dynamic(world, id, "it has no mass"));
    TRY(sadmm_world_check_mass(world, mass, inertia, error));
    TRY(sadmm_world_detach(world));
    body->rigid.mass = mass;
    memcpy(body->rigid.inertia, inertia, sizeof body->rigid.inertia);
    return SADMM_OK;
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
