/* Kinematic bodies in a step: driven ones (core/base/contact_set.h). Each goes by its velocity, which is the caller's,
 * and feels nothing. Those that are moved to a pose go there by the velocity that brings them there. */
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/joint.h"
#include "core/math/rigid.h"
#include "world_internal.h"

static bool is_driven(const struct sadmm_world_body *body)
{
    return body->alive && body->type == SADMM_BODY_KINEMATIC;
}

/* The velocity that brings the body where it is to be in dt. */
static void velocity_to(const struct sadmm_world_body *body, double dt, double velocity[6])
{
    const struct sadmm_rigid *rigid = &body->rigid;
    const quat turn = q_mul(q_load(body->target.orientation), q_conjugate(q_load(rigid->orientation)));
    for (int k = 0; k < 3; ++k) velocity[k] = (body->target.position[k] - rigid->position[k]) / dt;
    v3_store(v3_scale(q_log(turn), 1 / dt), velocity + 3);
}

sadmm_status sadmm_world_slot_not_finite(sadmm_world *world, int32_t slot)
{
    return sadmm_fail(&world->error, SADMM_ERROR_NON_FINITE,
                      "the step made body (slot %d, generation %u, \"%s\") not finite; the world is as before it",
                      slot + 1, world->bodies[slot].generation, sadmm_world_body_name(&world->bodies[slot]));
}

sadmm_status sadmm_world_gather_driven(sadmm_world *world)
{
    struct sadmm_step_start *start = &world->start;
    const size_t n = (size_t)world->driven_count;
    int32_t next = 0;
    start->driven_count = 0;
    if (n == 0) return SADMM_OK;
    if (!sadmm_grow_empty(&start->driven, &start->driven_capacity, 6 * n, sizeof *start->driven) ||
        !sadmm_grow_empty(&world->driven, &world->driven_capacity, n, sizeof *world->driven))
        return sadmm_fail_memory(&world->error, "kinematic bodies");
    for (size_t slot = 0; slot < world->body_slots; ++slot) {
        struct sadmm_world_body *body = &world->bodies[slot];
        if (!is_driven(body)) continue;
        struct sadmm_world_driven *driven = &world->driven[next];
        double *velocity = start->driven + 6 * (size_t)next;
        body->system_body = world->collision_bodies[slot].system_body = sadmm_driven(next);
        driven->slot = (int32_t)slot;
        driven->rigid = driven->next = body->rigid;
        memset(driven->wrench, 0, sizeof driven->wrench);
        if (body->target.set) velocity_to(body, world->def.settings.dt, driven->rigid.velocity);
        memcpy(velocity, driven->rigid.velocity, sizeof driven->rigid.velocity);
        memcpy(world->collision_bodies[slot].velocity, velocity, sizeof driven->rigid.velocity);
        ++next;
    }
    start->driven_count = next;
    return SADMM_OK;
}

sadmm_status sadmm_world_move_driven(sadmm_world *world, const sadmm_settings *settings)
{
    for (int32_t k = 0; k < world->start.driven_count; ++k) {
        struct sadmm_world_driven *driven = &world->driven[k];
        const struct sadmm_rigid *from = &driven->rigid;
        double sum = 0;
        driven->next = *from;
        v3_store(rigid_move(v3_load(from->position), v3_load(from->velocity), settings->dt), driven->next.position);
        q_store(rigid_turn(q_load(from->orientation), v3_load(from->velocity + 3), settings->dt),
                driven->next.orientation);
        for (int j = 0; j < 3; ++j) sum += driven->next.position[j] - driven->next.position[j];
        for (int j = 0; j < 4; ++j) sum += driven->next.orientation[j] - driven->next.orientation[j];
        if (sum != 0) return sadmm_world_slot_not_finite(world, driven->slot);
    }
    return SADMM_OK;
}

void sadmm_world_turn_driven(sadmm_world *world)
{
    for (int32_t k = 0; k < world->start.driven_count; ++k) {
        struct sadmm_world_driven *driven = &world->driven[k];
        struct sadmm_collision_body *out = &world->collision_bodies[driven->slot];
        driven->rigid = driven->next;
        memcpy(out->position, driven->rigid.position, sizeof out->position);
        memcpy(out->orientation, driven->rigid.orientation, sizeof out->orientation);
    }
}

/* Adds what a point's impulse (on b) gives the body at `arm`; sign +1: it is b. */
static void add_impulse(double wrench[6], const double impulse[3], const double arm[3], double share)
{
    double torque[3];
    v3_store(v3_cross(v3_load(arm), v3_load(impulse)), torque);
    for (int k = 0; k < 3; ++k) {
        wrench[k] += share * impulse[k];
        wrench[k + 3] += share * torque[k];
    }
}

void sadmm_world_add_driven_wrenches(sadmm_world *world, const sadmm_settings *settings)
{
    if (world->start.driven_count == 0) return;
    const double share = 1 / (settings->dt * settings->substeps); /* of their mean over the sub-steps */
    for (size_t p = 0; p < world->contacts.pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &world->contacts.pairs[p];
        const bool on_b = sadmm_body_is_driven(pair->body_b);
        if (!on_b && !sadmm_body_is_driven(pair->body_a)) continue;
        struct sadmm_world_driven *driven = &world->driven[sadmm_driven(on_b ? pair->body_b : pair->body_a)];
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
            const struct sadmm_contact_point *point = &world->contacts.points[k];
            add_impulse(driven->wrench, point->impulse, on_b ? point->arm_b : point->arm_a, on_b ? share : -share);
        }
    }
}

void sadmm_world_commit_driven(sadmm_world *world)
{
    for (int32_t k = 0; k < world->start.driven_count; ++k) {
        const struct sadmm_world_driven *driven = &world->driven[k];
        struct sadmm_world_body *body = &world->bodies[driven->slot];
        body->rigid = driven->next;
        if (world->plan.wrenches) memcpy(body->contact_wrench, driven->wrench, sizeof body->contact_wrench);
        if (!body->target.set) continue;
        memcpy(body->rigid.position, body->target.position, sizeof body->rigid.position);
        memcpy(body->rigid.orientation, body->target.orientation, sizeof body->rigid.orientation);
        memset(body->rigid.velocity, 0, sizeof body->rigid.velocity);
        body->target.set = false;
    }
}
