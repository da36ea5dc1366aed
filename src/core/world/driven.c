/* Kinematic bodies in a step that the host makes: driven ones (core/model/driven.h). A backend that keeps the world does
 * the same (backend_cuda/step/driven.cu).
 *
 * An island whose only support is one of them rides on it. With c the rigid motion of that body, taken at the island's
 * bodies, v = c + v' is a change of variables: A v' = (b - A c) + J^T lambda, contacts between the bodies see no more
 * of v than of v', and those with the support see it all but at rest. So such an island is solved for v', and all that
 * the method `fast` makes of velocities and energies (loads of first steps, weights, the limit) is what it is on the
 * ground: a stack in a lift stands as well as one beside it. Others, a row that a wall pushes over the floor, are
 * solved for v. */
#include <string.h>

#include "core/base/memory.h"
#include "core/model/driven.h"
#include "core/model/islands.h"
#include "world_internal.h"

static sadmm_status list_driven(sadmm_world *world)
{
    size_t count = 0;
    if (world->driven_listed) return SADMM_OK;
    if (!sadmm_grow_empty(&world->driven_slots, &world->driven_slot_capacity, (size_t)world->driven_count,
                          sizeof *world->driven_slots))
        return sadmm_fail_memory(&world->error, "kinematic bodies");
    for (size_t slot = 0; slot < world->body_slots; ++slot)
        if (world->bodies[slot].alive && world->bodies[slot].type == SADMM_BODY_KINEMATIC)
            world->driven_slots[count++] = (int32_t)slot;
    world->driven_listed = true;
    return SADMM_OK;
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
    start->driven_count = 0;
    if (n == 0) return SADMM_OK;
    TRY(list_driven(world));
    if (!sadmm_grow_empty(&start->driven, &start->driven_capacity, 6 * n, sizeof *start->driven) ||
        !sadmm_grow_empty(&world->driven, &world->driven_capacity, n, sizeof *world->driven))
        return sadmm_fail_memory(&world->error, "kinematic bodies");
    for (size_t k = 0; k < n; ++k) {
        const int32_t slot = world->driven_slots[k];
        struct sadmm_world_body *body = &world->bodies[slot];
        struct sadmm_world_driven *driven = &world->driven[k];
        double *velocity = start->driven + 6 * k;
        body->system_body = world->collision_bodies[slot].system_body = sadmm_driven((int32_t)k);
        driven->slot = slot;
        driven->rigid = driven->next = body->rigid;
        memset(driven->wrench, 0, sizeof driven->wrench);
        if (body->target.set)
            driven_velocity_to(&body->rigid, body->target.position, body->target.orientation, world->def.settings.dt,
                               driven->rigid.velocity);
        memcpy(velocity, driven->rigid.velocity, sizeof driven->rigid.velocity);
        memcpy(world->collision_bodies[slot].velocity, velocity, sizeof driven->rigid.velocity);
    }
    start->driven_count = (int32_t)n;
    return SADMM_OK;
}

/* ---- what rides on them ------------------------------------------------------------------------------------------ */

/* Of an island, in place of a driven body: nothing yet; the floor, or several that do not move as one. */
enum { UNSUPPORTED = 0, SEVERAL = 1 };

static void support(const struct sadmm_world *world, const struct sadmm_system *system, int32_t body, int32_t by)
{
    int32_t *carrier = &world->carriers[world->carried_labels[body]];
    if (*carrier == UNSUPPORTED) *carrier = by;
    else if (!driven_same_motion(system, *carrier, by)) *carrier = SEVERAL;
}

/* What every island rides on, at its label. False: none rides on anything. */
static bool find_carriers(sadmm_world *world, const struct sadmm_system *system)
{
    const struct sadmm_rows *rows = system->rows;
    bool any = false;
    sadmm_islands(system, world->carried_labels);
    for (int32_t i = 0; i < system->body_count; ++i) world->carriers[i] = UNSUPPORTED;
    for (size_t p = 0; p < system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &system->contacts->pairs[p];
        if (pair->body_a < 0) support(world, system, pair->body_b, pair->body_a);
        if (pair->body_b < 0) support(world, system, pair->body_a, pair->body_b);
    }
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k) {
        const struct sadmm_row_constraint *constraint = &rows->constraints[k];
        world->carriers[world->carried_labels[constraint->body_a >= 0 ? constraint->body_a : constraint->body_b]] =
            SEVERAL;
    }
    for (int32_t i = 0; i < system->body_count; ++i) any = any || sadmm_body_is_driven(world->carriers[i]);
    return any;
}

static bool any_driven(const struct sadmm_system *system)
{
    for (size_t p = 0; system->driven_count > 0 && p < system->contacts->pair_count; ++p)
        if (sadmm_pair_is_driven(system, &system->contacts->pairs[p])) return true;
    return false;
}

sadmm_status sadmm_world_carry(sadmm_world *world, struct sadmm_system *system)
{
    const size_t n = (size_t)system->body_count;
    system->carried = NULL;
    if (!any_driven(system)) return SADMM_OK;
    if (!sadmm_grow_empty(&world->carried, &world->carried_capacity, 6 * n, sizeof *world->carried) ||
        !sadmm_grow_empty(&world->carriers, &world->carrier_capacity, n, sizeof *world->carriers) ||
        !sadmm_grow_empty(&world->carried_labels, &world->carried_label_capacity, n, sizeof *world->carried_labels))
        return sadmm_fail_memory(&world->error, "what rides on kinematic bodies");
    if (!find_carriers(world, system)) return SADMM_OK;
    for (size_t i = 0; i < n; ++i) {
        const int32_t by = world->carriers[world->carried_labels[i]];
        double *motion = world->carried + 6 * i;
        memset(motion, 0, 6 * sizeof *motion);
        if (sadmm_body_is_driven(by))
            driven_motion_at(&world->driven[sadmm_driven(by)].rigid, system->rigid[i].position, motion);
        for (int k = 0; k < 6; ++k) system->velocity[6 * i + (size_t)k] -= motion[k];
    }
    system->carried = world->carried;
    return SADMM_OK;
}

void sadmm_world_put_down(sadmm_world *world, const struct sadmm_system *system)
{
    for (size_t k = 0; system->carried && k < 6 * (size_t)system->body_count; ++k)
        world->velocity[k] += system->carried[k];
}

/* ---- from step to step ------------------------------------------------------------------------------------------- */

sadmm_status sadmm_world_move_driven(sadmm_world *world, const sadmm_settings *settings)
{
    for (int32_t k = 0; k < world->start.driven_count; ++k) {
        struct sadmm_world_driven *driven = &world->driven[k];
        if (!driven_move(&driven->rigid, settings->dt, &driven->next))
            return sadmm_world_slot_not_finite(world, driven->slot);
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
            for (int j = 0; j < 6; ++j)
                driven->wrench[j] +=
                    driven_load(on_b ? point->arm_b : point->arm_a, point->impulse, on_b ? share : -share, j);
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
        driven_arrive(body->target.position, body->target.orientation, &body->rigid);
        body->target.set = false;
    }
}
