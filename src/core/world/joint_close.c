/* What is locked, closed at the end of a (sub-)step (core/model/joint_close.h): rows of the poses that it has moved bodies
 * to, solved for displacements by the order of the step's own. */
#include <string.h>

#include "core/base/memory.h"
#include "core/model/joint_close.h"
#include "core/solve/joined.h"
#include "world_internal.h"

/* A joint's end where the step has left its bodies. */
static struct joint_end end_of(const sadmm_world *world, const struct sadmm_world_joint *joint, int s)
{
    if (s == 0 && joint->coupling)
        return joint_end_on(&joint->frame[s], &world->couplings[joint->coupling - 1].next.target);
    const struct joint_body body = sadmm_world_joint_body(world, joint->body[s]);
    if (body.system_body >= 0) return joint_end_on(&joint->frame[s], &world->next[body.system_body]);
    if (body.steered)
        return joint_end_on(&joint->frame[s],
                            &world->driven[sadmm_driven(world->bodies[joint->body[s]].system_body)].next);
    return joint_end_on(&joint->frame[s], body.rigid);
}

static bool closes(const struct sadmm_world_joint *joint) { return joint->alive && joint->def.enabled; }

static struct joint_closing closing_of(const sadmm_world *world, size_t slot, const sadmm_settings *settings)
{
    const struct sadmm_world_joint *joint = &world->joints[slot];
    const struct joint_end a = end_of(world, joint, 0), b = end_of(world, joint, 1);
    return joint_closing_of(&joint->def, &a, &b, &world->joint_levers[slot], settings);
}

/* Which bodies have joints that are to be closed; the largest error, m. Are there any? */
static bool find_open(sadmm_world *world, const sadmm_settings *settings, double *off)
{
    bool any = false;
    memset(world->opened, 0, (size_t)world->dynamic_count);
    *off = 0;
    for (size_t slot = 0; slot < world->joint_slots; ++slot) {
        const struct sadmm_world_joint *joint = &world->joints[slot];
        if (!closes(joint)) continue;
        const struct joint_closing c = closing_of(world, slot, settings);
        if (c.off > *off) *off = c.off;
        if (!(c.share > JOINT_CLOSE_FROM) || world->kernels->resident) continue; /* a device would not do it */
        for (int s = 0; s < 2; ++s) {
            const int32_t body = sadmm_world_joint_body(world, joint->body[s]).system_body;
            if (body < 0) continue;
            world->opened[body] = true;
            any = true;
        }
    }
    return any;
}

/* Rows of locks, a constraint each, in the places of the step's own. */
static bool add_rows(sadmm_world *world, const struct sadmm_row_constraint *place, size_t slot,
                     const sadmm_settings *settings)
{
    struct sadmm_rows *rows = &world->closing;
    const struct joint_closing c = closing_of(world, slot, settings);
    if (c.count == 0) return true;
    const int32_t first = sadmm_rows_add(rows, c.count, place->body_a, place->body_b);
    if (first < 0) return false;
    for (int i = 0; i < c.count; ++i) {
        const size_t r = (size_t)(first + i);
        if (place->body_a >= 0) joint_closing_row(&c, i, 0, rows->jacobian_a + 6 * r);
        if (place->body_b >= 0) joint_closing_row(&c, i, 1, rows->jacobian_b + 6 * r);
        sadmm_row_hard(rows, (int32_t)r, c.error[i]);
    }
    return true;
}

static bool make_rows(sadmm_world *world, const sadmm_settings *settings)
{
    size_t at = 0;
    sadmm_rows_clear(&world->closing);
    if (!sadmm_grow_empty(&world->closing_slots, &world->closing_slot_capacity, world->joint_constraint_count,
                          sizeof *world->closing_slots))
        return false;
    for (size_t k = 0; k < world->joint_constraint_count; ++k) {
        world->closing_slots[k] = world->joint_constraints[k];
        world->closing_slots[k].first = world->closing_slots[k].count = 0;
    }
    for (size_t slot = 0; slot < world->joint_slots; ++slot) {
        const struct sadmm_world_joint *joint = &world->joints[slot];
        if (!joint->alive) continue;
        const size_t before = world->closing.constraint_count;
        if (sadmm_joint_constraints(joint) > 0 && closes(joint) &&
            !add_rows(world, &world->closing_slots[at], slot, settings))
            return false;
        if (world->closing.constraint_count > before) world->closing_slots[at] = world->closing.constraints[before];
        at += (size_t)sadmm_joint_constraints(joint);
    }
    return true;
}

sadmm_status sadmm_world_close_joints(sadmm_world *world, const sadmm_settings *settings, double *off)
{
    if (!sadmm_grow_empty(&world->opened, &world->opened_capacity, (size_t)world->dynamic_count, sizeof *world->opened))
        return sadmm_fail_memory(&world->error, "joints that close");
    /* Where they are stiff bodies give way to loads and not to light ones: with that stiffness. */
    const struct sadmm_system system = {.body_count = world->dynamic_count,
                                        .rigid = world->next,
                                        .velocity = world->velocity,
                                        .stiffening = world->start.stiffened ? world->start.stiffening : NULL,
                                        .rows = &world->closing};
    for (int step = 0; find_open(world, settings, off) && step < JOINT_CLOSE_STEPS; ++step) {
        if (!make_rows(world, settings)) return sadmm_fail_memory(&world->error, "joints that close");
        TRY(sadmm_joined_close(world->joined, &system, world->closing_slots, world->joint_constraint_count,
                               world->opened, world->next, &world->error));
    }
    return SADMM_OK;
}
