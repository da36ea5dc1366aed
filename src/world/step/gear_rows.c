/* Gears as constraint rows (core/model/gear_law.h), after those of joints. */
#include <string.h>

#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "core/model/gear_law.h"
#include "gear_rows.h"
#include "joint_act.h"

static bool acts(const sadmm_world *world, const struct sadmm_world_gear *gear)
{
    return gear->def.enabled && world->joints[gear->joint[0]].def.enabled && world->joints[gear->joint[1]].def.enabled;
}

/* What it is between, in the (sub-)step at hand. */
static struct gear_joint gear_joint_of(const sadmm_world *world, const struct sadmm_world_gear *gear, int i)
{
    const struct sadmm_world_joint *joint = &world->joints[gear->joint[i]];
    return (struct gear_joint){&joint->def, &joint->next, i ? gear->def.coordinate_2 : gear->def.coordinate_1,
                               i ? gear->def.ratio : 1};
}

/* The row of a gear, on two bodies at most; *reaches: it can turn its wheels where they are. */
static struct acting_gear act(sadmm_world *world, const struct sadmm_world_gear *gear,
                              const sadmm_settings *settings, bool *reaches)
{
    const struct gear_joint joints[GEAR_JOINTS] = {gear_joint_of(world, gear, 0), gear_joint_of(world, gear, 1)};
    struct acting_gear out;
    for (int i = 0; i < GEAR_JOINTS; ++i)
        out.joint[i] = *sadmm_world_act_joint(world, &world->joints[gear->joint[i]], settings);
    gear_act(joints, gear->def.offset, settings, &out);
    *reaches = out.count < GEAR_BODIES || gear_leave_carrier(joints, settings, &out);
    return out;
}

bool sadmm_world_gear_reaches(const sadmm_world *world, const struct sadmm_world_gear *gear)
{
    const sadmm_settings settings = sadmm_settings_of_substep(&world->def.settings);
    const struct gear_joint joints[GEAR_JOINTS] = {gear_joint_of(world, gear, 0), gear_joint_of(world, gear, 1)};
    struct acting_gear acting;
    gear_begin(&acting);
    for (int i = 0; i < GEAR_JOINTS; ++i) {
        const struct sadmm_world_joint *joint = &world->joints[gear->joint[i]];
        struct joint_body bodies[2] = {{-1, NULL, false, false}, {-1, NULL, false, false}};
        for (int s = 0; s < 2; ++s) {
            if (joint->body[s] < 0) continue;
            const struct sadmm_world_body *body = &world->bodies[joint->body[s]];
            const bool dynamic = body->type == SADMM_BODY_DYNAMIC;
            bodies[s] = (struct joint_body){dynamic ? joint->body[s] : -1, &body->rigid, false, false};
        }
        acting.joint[i] = joint_act(&joint->def, joint->frame, bodies, &settings);
        gear_add_coordinate(&acting, i, joints[i].coordinate, joints[i].factor);
    }
    return acting.count < GEAR_BODIES || gear_leave_carrier(joints, &settings, &acting);
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* The constraint that the gear may have, with its row in this step or without. */
static bool add_slot(sadmm_world *world, const struct sadmm_row_constraint *constraint)
{
    const size_t at = world->joint_constraint_count;
    if (!SADMM_GROW(world->joint_constraints, at, at + 1)) return false;
    world->joint_constraints[world->joint_constraint_count++] = *constraint;
    return true;
}

sadmm_status sadmm_world_make_gear_rows(sadmm_world *world, const sadmm_settings *settings)
{
    struct sadmm_rows *rows = &world->start.rows;
    world->joint_rows = rows->row_count;
    for (SADMM_OBJECTS(slot, &world->gear_ids)) {
        struct sadmm_world_gear *gear = &world->gears[slot];
        const size_t r = rows->row_count;
        bool reaches;
        int a, b;
        const struct acting_gear acting = act(world, gear, settings, &reaches);
        gear->acts = reaches && acts(world, gear);
        gear_sides(&acting, &a, &b);
        const struct sadmm_row_constraint none = {.body_a = acting.body[a], .body_b = acting.body[b]};
        if (!gear->acts) {
            gear->next.force = 0;
            if (!add_slot(world, &none)) return sadmm_fail_memory(&world->error, "the gears' rows");
            continue;
        }
        if (!SADMM_GROW(world->joint_sources, r, r + 1) || !SADMM_GROW(world->start.multiplier, r, r + 1) ||
            sadmm_rows_add(rows, 1, acting.body[a], acting.body[b]) < 0 ||
            !add_slot(world, &rows->constraints[rows->constraint_count - 1]))
            return sadmm_fail_memory(&world->error, "the gears' rows");
        if (acting.body[a] >= 0) memcpy(rows->jacobian_a + 6 * r, acting.row[a], sizeof acting.row[a]);
        memcpy(rows->jacobian_b + 6 * r, acting.row[b], sizeof acting.row[b]);
        sadmm_row_hard(rows, (int32_t)r, acting.bias);
        rows->lambda[r] = world->start.multiplier[r] = gear->next.force * settings->dt;
        /* of its islands it is a row of the first joint's as any other */
        world->joint_sources[r] = (struct sadmm_joint_source){
            .joint = world->joints[gear->joint[0]].number, .role = SADMM_ROLE_LOCK, .sign = 1};
    }
    return SADMM_OK;
}

void sadmm_world_begin_gears(sadmm_world *world)
{
    for (SADMM_OBJECTS(slot, &world->gear_ids)) {
        world->gears[slot].next = world->gears[slot].last;
        if (!acts(world, &world->gears[slot])) world->gears[slot].next.force = 0;
    }
}

void sadmm_world_keep_gear_rows(sadmm_world *world, double dt)
{
    size_t r = world->joint_rows;
    for (SADMM_OBJECTS(slot, &world->gear_ids))
        if (world->gears[slot].acts) world->gears[slot].next.force = world->start.rows.lambda[r++] / dt;
}

void sadmm_world_commit_gears(sadmm_world *world)
{
    for (SADMM_OBJECTS(slot, &world->gear_ids)) world->gears[slot].last = world->gears[slot].next;
}
