/* Kinematic bodies in a step that the host makes (core/model/kinematic.h). A backend that keeps the world does
 * the same (backend_cuda/step/kinematic.cu).
 *
 * An island may have one of them as its only support. With c the rigid motion of that body, taken at the island's
 * bodies, v = c + v' is a change of variables: A v' = (b - A c) + J^T lambda, contacts between the bodies see no more
 * of v than of v', and those with the support see it all but at rest. So such an island is solved for v', and all that
 * the method `fast` makes of velocities and energies (initial impulses of first steps, weights, the energy limit) is
 * what it is on the ground: a stack in a lift stands as well as one beside it. Others, a row that a wall pushes over
 * the floor, are solved for v. */
#include <string.h>

#include "core/base/memory.h"
#include "core/model/islands.h"
#include "core/model/kinematic.h"
#include "kinematic.h"
#include "world/state/ids.h"

static sadmm_status list_kinematic(sadmm_world *world)
{
    size_t count = 0;
    if (world->kinematic_listed) return SADMM_OK;
    if (!SADMM_GROW(world->kinematic_slots, 0, (size_t)world->kinematic_count))
        return sadmm_fail_memory(&world->error, "kinematic bodies");
    for (SADMM_OBJECTS(slot, &world->body_ids))
        if (world->bodies[slot].type == SADMM_BODY_KINEMATIC) world->kinematic_slots[count++] = (int32_t)slot;
    world->kinematic_listed = true;
    return SADMM_OK;
}

sadmm_status sadmm_world_slot_not_finite(sadmm_world *world, int32_t slot)
{
    world->not_finite = slot;
    return sadmm_fail(&world->error, SADMM_ERROR_NON_FINITE,
                      "the step made body (slot %d, generation %u, \"%s\") not finite; the world is as before it",
                      slot + 1, world->body_ids.generations[slot],
                      sadmm_tags_name(&world->body_ids.tags, (size_t)slot));
}

sadmm_status sadmm_world_gather_kinematic(sadmm_world *world)
{
    struct sadmm_step_start *start = &world->start;
    const size_t n = (size_t)world->kinematic_count;
    start->kinematic_count = 0;
    if (n == 0) return SADMM_OK;
    TRY(list_kinematic(world));
    if (!SADMM_GROW(start->kinematic, 0, 6 * n) || !SADMM_GROW(world->kinematic, 0, n))
        return sadmm_fail_memory(&world->error, "kinematic bodies");
    for (size_t k = 0; k < n; ++k) {
        const int32_t slot = world->kinematic_slots[k];
        struct sadmm_world_body *body = &world->bodies[slot];
        struct sadmm_world_kinematic *kinematic = &world->kinematic[k];
        double *velocity = start->kinematic + 6 * k;
        body->system_body = world->collision_bodies[slot].system_body = sadmm_kinematic((int32_t)k);
        kinematic->slot = slot;
        kinematic->bearer = (int32_t)k;
        kinematic->rigid = kinematic->next = body->rigid;
        memset(kinematic->wrench, 0, sizeof kinematic->wrench);
        if (body->target.set)
            kinematic_velocity_to(&body->rigid, body->target.position, body->target.orientation, world->def.settings.dt,
                                  kinematic->rigid.velocity);
        memcpy(velocity, kinematic->rigid.velocity, sizeof kinematic->rigid.velocity);
        memcpy(world->collision_bodies[slot].velocity, velocity, sizeof kinematic->rigid.velocity);
    }
    start->kinematic_count = (int32_t)n;
    return SADMM_OK;
}

/* ---- what they support ------------------------------------------------------------------------------------------- */

/* Of an island, in place of a kinematic body: nothing yet; the floor, or several that do not move as one. */
enum { UNSUPPORTED = 0, SEVERAL = 1 };

static void support(const struct sadmm_world *world, const struct sadmm_system *system, int32_t body, int32_t by)
{
    int32_t *supporting = &world->supports[world->support_labels[body]];
    if (*supporting == UNSUPPORTED) *supporting = by;
    else if (!kinematic_same_motion(system, *supporting, by)) *supporting = SEVERAL;
}

/* The support of every island, at its label. False: none is supported by a kinematic body. */
static bool find_supports(sadmm_world *world, const struct sadmm_system *system)
{
    const struct sadmm_rows *rows = system->rows;
    bool any = false;
    sadmm_islands(system, world->support_labels);
    for (int32_t i = 0; i < system->body_count; ++i) world->supports[i] = UNSUPPORTED;
    for (size_t p = 0; p < system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &system->contacts->pairs[p];
        if (pair->body_a < 0) support(world, system, pair->body_b, pair->body_a);
        if (pair->body_b < 0) support(world, system, pair->body_a, pair->body_b);
    }
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k) {
        const struct sadmm_row_constraint *constraint = &rows->constraints[k];
        world->supports[world->support_labels[constraint->body_a >= 0 ? constraint->body_a : constraint->body_b]] =
            SEVERAL;
    }
    for (int32_t i = 0; i < system->body_count; ++i) any = any || sadmm_body_is_kinematic(world->supports[i]);
    return any;
}

static bool any_kinematic(const struct sadmm_system *system)
{
    for (size_t p = 0; system->kinematic_count > 0 && p < system->contacts->pair_count; ++p)
        if (sadmm_pair_is_kinematic(system, &system->contacts->pairs[p])) return true;
    return false;
}

sadmm_status sadmm_world_enter_support_frame(sadmm_world *world, struct sadmm_system *system)
{
    const size_t n = (size_t)system->body_count;
    system->support_motion = NULL;
    if (!any_kinematic(system)) return SADMM_OK;
    if (!SADMM_GROW(world->support_motion, 0, 6 * n) || !SADMM_GROW(world->supports, 0, n) ||
        !SADMM_GROW(world->support_labels, 0, n))
        return sadmm_fail_memory(&world->error, "supports of bodies");
    if (!find_supports(world, system)) return SADMM_OK;
    for (size_t i = 0; i < n; ++i) {
        const int32_t by = world->supports[world->support_labels[i]];
        double *motion = world->support_motion + 6 * i;
        memset(motion, 0, 6 * sizeof *motion);
        if (sadmm_body_is_kinematic(by))
            kinematic_motion_at(&world->kinematic[sadmm_kinematic(by)].rigid, system->rigid[i].position, motion);
        for (int k = 0; k < 6; ++k) system->velocity[6 * i + (size_t)k] -= motion[k];
    }
    system->support_motion = world->support_motion;
    return SADMM_OK;
}

void sadmm_world_leave_support_frame(sadmm_world *world, const struct sadmm_system *system)
{
    for (size_t k = 0; system->support_motion && k < 6 * (size_t)system->body_count; ++k)
        world->velocity[k] += system->support_motion[k];
}

/* ---- from step to step ------------------------------------------------------------------------------------------- */

sadmm_status sadmm_world_move_kinematic(sadmm_world *world, const sadmm_settings *settings)
{
    for (int32_t k = 0; k < world->kinematic_count; ++k) {
        struct sadmm_world_kinematic *kinematic = &world->kinematic[k];
        if (!kinematic_move(&kinematic->rigid, settings->dt, &kinematic->next))
            return sadmm_world_slot_not_finite(world, kinematic->slot);
    }
    return SADMM_OK;
}

void sadmm_world_turn_kinematic(sadmm_world *world)
{
    for (int32_t k = 0; k < world->kinematic_count; ++k) {
        struct sadmm_world_kinematic *kinematic = &world->kinematic[k];
        struct sadmm_collision_body *out = &world->collision_bodies[kinematic->slot];
        kinematic->rigid = kinematic->next;
        memcpy(out->position, kinematic->rigid.position, sizeof out->position);
        memcpy(out->orientation, kinematic->rigid.orientation, sizeof out->orientation);
    }
}

void sadmm_world_add_kinematic_wrenches(sadmm_world *world, const sadmm_settings *settings)
{
    if (world->kinematic_count == 0) return;
    const double share = 1 / (settings->dt * settings->substeps); /* of their mean over the sub-steps */
    for (size_t p = 0; p < world->contacts.pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &world->contacts.pairs[p];
        const bool on_b = sadmm_body_is_kinematic(pair->body_b);
        if (!on_b && !sadmm_body_is_kinematic(pair->body_a)) continue;
        const int32_t bearer = world->kinematic[sadmm_kinematic(on_b ? pair->body_b : pair->body_a)].bearer;
        if (bearer < 0) continue;
        struct sadmm_world_kinematic *kinematic = &world->kinematic[bearer];
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
            const struct sadmm_contact_point *point = &world->contacts.points[k];
            for (int j = 0; j < 6; ++j)
                kinematic->wrench[j] +=
                    kinematic_load(on_b ? point->arm_b : point->arm_a, point->impulse, on_b ? share : -share, j);
        }
    }
}

void sadmm_world_commit_kinematic(sadmm_world *world)
{
    for (int32_t k = 0; k < world->kinematic_count; ++k) {
        const struct sadmm_world_kinematic *kinematic = &world->kinematic[k];
        struct sadmm_world_body *body = &world->bodies[kinematic->slot];
        body->rigid = kinematic->next;
        if (world->plan.wrenches) memcpy(body->contact_wrench, kinematic->wrench, sizeof body->contact_wrench);
        if (!body->target.set) continue;
        kinematic_arrive(body->target.position, body->target.orientation, &body->rigid);
        body->target.set = false;
    }
}
