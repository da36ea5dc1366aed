/* Gears as constraint rows, after those of joints: one hard row each, the sum of two coordinates' rows. */
#include <string.h>

#include "core/base/memory.h"
#include "world_internal.h"

/* Of a step: its row on up to two bodies, and its bias. */
struct acting_gear {
    int32_t body[2]; /* -1: none */
    double row[2][6], bias;
};

static bool acts(const sadmm_world *world, const struct sadmm_world_gear *gear)
{
    return gear->alive && gear->def.enabled && world->joints[gear->joint[0]].def.enabled &&
           world->joints[gear->joint[1]].def.enabled;
}

static void add_row(struct acting_gear *acting, int32_t body, const double row[6], double factor)
{
    const int at = acting->body[1] == body || acting->body[1] < 0 ? 1 : 0; /* b first: one body is b */
    acting->body[at] = body;
    for (int j = 0; j < 6; ++j) acting->row[at][j] += factor * row[j];
}

static struct acting_gear act(const sadmm_world *world, const struct sadmm_world_gear *gear,
                              const sadmm_settings *settings)
{
    struct acting_gear out = {.body = {-1, -1}};
    double error = -gear->def.offset;
    for (int i = 0; i < 2; ++i) {
        const struct sadmm_world_joint *joint = &world->joints[gear->joint[i]];
        const int k = i ? gear->def.coordinate_2 : gear->def.coordinate_1;
        const double factor = i ? gear->def.ratio : 1;
        const struct acting_joint acting = sadmm_world_act_joint(world, joint, settings);
        const struct joint_moving m = joint_moving_of(&joint->def, &joint->next, &acting, k, settings);
        error += factor * m.value;
        out.bias += factor * m.turned;
        for (int s = 0; s < 2; ++s) {
            double row[6];
            if (acting.side[s].system_body < 0) continue;
            joint_step_row(&acting, s, k, row);
            add_row(&out, acting.side[s].system_body, row, factor);
        }
    }
    out.bias += joint_feedback(error, settings->dt, settings->correction_speed);
    return out;
}

/* The constraint that the gear may have, with its row in this step or without. */
static bool add_slot(sadmm_world *world, const struct sadmm_row_constraint *constraint)
{
    const size_t at = world->joint_constraint_count;
    if (!sadmm_grow(&world->joint_constraints, &world->joint_constraint_capacity, at, at + 1,
                    sizeof *world->joint_constraints))
        return false;
    world->joint_constraints[world->joint_constraint_count++] = *constraint;
    return true;
}

sadmm_status sadmm_world_make_gear_rows(sadmm_world *world, const sadmm_settings *settings)
{
    struct sadmm_rows *rows = &world->start.rows;
    world->joint_rows = rows->row_count;
    for (size_t slot = 0; world->gear_count > 0 && slot < world->gear_slots; ++slot) {
        struct sadmm_world_gear *gear = &world->gears[slot];
        const size_t r = rows->row_count;
        if (!gear->alive) continue;
        const struct acting_gear acting = act(world, gear, settings);
        const struct sadmm_row_constraint none = {.body_a = acting.body[0], .body_b = acting.body[1]};
        if (!acts(world, gear)) {
            if (!add_slot(world, &none)) return sadmm_fail_memory(&world->error, "the gears' rows");
            continue;
        }
        if (!sadmm_grow(&world->joint_sources, &world->joint_source_capacity, r, r + 1,
                        sizeof *world->joint_sources) ||
            !sadmm_grow(&world->start.multiplier, &world->start.multiplier_capacity, r, r + 1,
                        sizeof *world->start.multiplier) ||
            sadmm_rows_add(rows, 1, acting.body[0], acting.body[1]) < 0 ||
            !add_slot(world, &rows->constraints[rows->constraint_count - 1]))
            return sadmm_fail_memory(&world->error, "the gears' rows");
        if (acting.body[0] >= 0) memcpy(rows->jacobian_a + 6 * r, acting.row[0], sizeof acting.row[0]);
        memcpy(rows->jacobian_b + 6 * r, acting.row[1], sizeof acting.row[1]);
        sadmm_row_hard(rows, (int32_t)r, acting.bias);
        rows->lambda[r] = world->start.multiplier[r] = gear->next.force * settings->dt;
        /* of its islands it is a row of the first joint's as any other */
        world->joint_sources[r] =
            (struct sadmm_joint_source){.joint = (int32_t)gear->joint[0], .role = SADMM_ROLE_LOCK, .sign = 1};
    }
    return SADMM_OK;
}

void sadmm_world_begin_gears(sadmm_world *world)
{
    for (size_t slot = 0; world->gear_count > 0 && slot < world->gear_slots; ++slot) {
        world->gears[slot].next = world->gears[slot].last;
        if (!acts(world, &world->gears[slot])) world->gears[slot].next.force = 0;
    }
}

void sadmm_world_keep_gear_rows(sadmm_world *world, double dt)
{
    size_t r = world->joint_rows;
    for (size_t slot = 0; world->gear_count > 0 && slot < world->gear_slots; ++slot)
        if (acts(world, &world->gears[slot])) world->gears[slot].next.force = world->start.rows.lambda[r++] / dt;
}

void sadmm_world_commit_gears(sadmm_world *world)
{
    for (size_t slot = 0; world->gear_count > 0 && slot < world->gear_slots; ++slot)
        if (world->gears[slot].alive) world->gears[slot].last = world->gears[slot].next;
}
