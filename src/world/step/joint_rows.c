/* Joints as constraint rows (docs/internals/algorithm.md, "Joints"): their laws (core/model/joint_law.h) into the
 * step's rows, multipliers from the forces of the last step, and the solution's back into what joints keep. */
#include <string.h>

#include "core/base/memory.h"
#include "gear_rows.h"
#include "joint_act.h"
#include "joint_rows.h"
#include "joint_stiffen.h"
#include "joint_variants.h"

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* Room for the most rows that a joint may have. */
static bool make_room(sadmm_world *world)
{
    struct sadmm_rows *rows = &world->start.rows;
    const size_t most = rows->row_count + JOINT_MOST_ROWS;
    return SADMM_GROW(world->joint_sources, rows->row_count, most) &&
           SADMM_GROW(world->start.multiplier, rows->row_count, most) &&
           sadmm_rows_reserve(rows, rows->constraint_count + JOINT_MOST_ROWS / SADMM_MAX_ROWS, most);
}

static struct joint_row_lists lists_at(const sadmm_world *world, size_t r)
{
    const struct sadmm_rows *rows = &world->start.rows;
    return (struct joint_row_lists){.jacobian = {rows->jacobian_a + 6 * r, rows->jacobian_b + 6 * r},
                                    .gain = rows->gain + r,
                                    .bias = rows->bias + r,
                                    .compliance = rows->compliance + r,
                                    .lo = rows->lo + r,
                                    .hi = rows->hi + r,
                                    .lambda = rows->lambda + r,
                                    .multiplier = world->start.multiplier + r,
                                    .source = world->joint_sources + r};
}

/* Constraints of the rows that the joint has written. */
static void add_constraints(struct sadmm_rows *rows, int count, const struct acting_joint *acting)
{
    for (int done = 0; done < count; done += SADMM_MAX_ROWS) {
        const int left = count - done;
        struct sadmm_row_constraint *constraint = &rows->constraints[rows->constraint_count++];
        *constraint = (struct sadmm_row_constraint){.body_a = acting->side[0].system_body,
                                                    .body_b = acting->side[1].system_body,
                                                    .first = (int32_t)rows->row_count,
                                                    .count = left < SADMM_MAX_ROWS ? left : SADMM_MAX_ROWS,
                                                    .rigid = true};
        v3_store(v3_sub(acting->middle.arm_a, acting->middle.arm_b), constraint->offset);
        rows->row_count += (size_t)constraint->count;
    }
}

int32_t sadmm_joint_constraints(const struct sadmm_world_joint *joint)
{
    int laws = joint_most_laws(&joint->def);
    for (int k = 0; k < JOINT_COORDINATES; ++k) { /* a spring that has nothing but its table */
        const sadmm_joint_coordinate *c = &joint->def.coordinates[k];
        laws += joint->table[k] && !(c->spring_stiffness > 0 || c->spring_damping > 0);
    }
    return joint->coupling ? 1 : (laws + SADMM_MAX_ROWS - 1) / SADMM_MAX_ROWS;
}

/* The constraints that the joint may have: those from `first` on that it has, and others without rows. */
static bool add_slots(sadmm_world *world, const struct sadmm_world_joint *joint, size_t first)
{
    const size_t count = (size_t)sadmm_joint_constraints(joint), begin = world->joint_constraint_count;
    const struct sadmm_rows *rows = &world->start.rows;
    if (!SADMM_GROW(world->joint_constraints, begin, begin + count)) return false;
    for (size_t k = 0; k < count; ++k)
        world->joint_constraints[begin + k] =
            first + k < rows->constraint_count
                ? rows->constraints[first + k]
                : (struct sadmm_row_constraint){.body_a = sadmm_world_joint_body(world, joint->body[0]).system_body,
                                                .body_b = sadmm_world_joint_body(world, joint->body[1]).system_body};
    world->joint_constraint_count += count;
    return true;
}

sadmm_status sadmm_world_make_rows(sadmm_world *world, const sadmm_settings *settings)
{
    const struct sadmm_joint_kernels *kernels = sadmm_joint_kernels_best();
    struct sadmm_rows *rows = &world->start.rows;
    sadmm_rows_clear(rows);
    world->joints_acting = world->couplings_acting = 0;
    world->joint_constraint_count = 0;
    world->spins_known = false;
    if (world->step_joint_count > 0 && !sadmm_world_begin_acting(world, settings))
        return sadmm_fail_memory(&world->error, "the joints' rows");
    for (size_t j = 0; j < world->step_joint_count; ++j) {
        struct sadmm_world_joint *joint = world->step_joints[j];
        struct joint_rates rates;
        const size_t before = rows->constraint_count;
        joint->first_row = joint->end_row = (int32_t)rows->row_count;
        if (!joint->def.enabled) {
            if (!add_slots(world, joint, before)) return sadmm_fail_memory(&world->error, "the joints' rows");
            continue;
        }
        if (!make_room(world)) return sadmm_fail_memory(&world->error, "the joints' rows");
        const struct acting_joint *acting = sadmm_world_act_joint(world, joint, settings);
        const struct joint_row_lists lists = lists_at(world, rows->row_count);
        kernels->rates(acting, &rates);
        const int count = kernels->laws(joint, acting, &rates, settings, &lists);
        if (count > 0) ++*(joint->coupling ? &world->couplings_acting : &world->joints_acting);
        add_constraints(rows, count, acting);
        joint->end_row = (int32_t)rows->row_count;
        if (!add_slots(world, joint, before)) return sadmm_fail_memory(&world->error, "the joints' rows");
        joint_forget_forces(&joint->next); /* the solution says */
    }
    bool any;
    TRY(sadmm_world_make_gear_rows(world, settings));
    return sadmm_world_stiffen(world, settings, &any);
}

/* ---- from step to step ------------------------------------------------------------------------------------------- */

/* Both lists, sorted; a pair that is in both stands there twice. */
static sadmm_status filter_pairs(sadmm_world *world)
{
    struct sadmm_pair_table *own = &world->disabled_pairs, *jointed = &world->jointed_pairs;
    const size_t of_own = sadmm_pair_table_count(own), of_jointed = sadmm_pair_table_count(jointed),
                 count = of_own + of_jointed;
    TRY(sadmm_pair_table_list(own, &world->error));
    TRY(sadmm_pair_table_list(jointed, &world->error));
    TRY(sadmm_pair_table_list(&world->friction_pairs, &world->error));
    if (of_jointed == 0) return SADMM_OK;
    if (!SADMM_GROW(world->filtered_pairs, 0, count))
        return sadmm_fail_memory(&world->error, "pairs of jointed bodies");
    for (size_t k = 0, i = 0, j = 0; k < count; ++k) {
        const bool from_own = j == of_jointed || (i < of_own && own->keys[i] < jointed->keys[j]);
        world->filtered_pairs[k] = from_own ? own->keys[i++] : jointed->keys[j++];
    }
    world->filtered_count = count;
    return SADMM_OK;
}

/* All that a step makes rows of. */
static bool list_step_joints(sadmm_world *world)
{
    const int32_t count = world->joint_ids.count + world->coupling_ids.count;
    int32_t number = 0;
    world->step_joint_count = 0;
    if (!SADMM_GROW(world->step_joints, 0, (size_t)count)) return false;
    for (SADMM_OBJECTS(slot, &world->joint_ids)) world->step_joints[number++] = &world->joints[slot];
    for (SADMM_OBJECTS(slot, &world->coupling_ids)) world->step_joints[number++] = &world->couplings[slot].joint;
    for (int32_t j = 0; j < count; ++j) world->step_joints[j]->number = j;
    world->step_joint_count = (size_t)count;
    return true;
}

sadmm_status sadmm_world_begin_joints(sadmm_world *world)
{
    if (!list_step_joints(world)) return sadmm_fail_memory(&world->error, "joints");
    for (size_t j = 0; j < world->step_joint_count; ++j) {
        struct sadmm_world_joint *joint = world->step_joints[j];
        joint->next = joint->last;
        if (!joint->def.enabled) joint_forget_forces(&joint->next);
    }
    sadmm_world_begin_gears(world);
    return filter_pairs(world);
}

/* All rows of the joint have been kept. */
static void end_joint(sadmm_world *world, struct sadmm_world_joint *joint, const struct acting_joint *acting, double dt)
{
    joint_end_wrench(&joint->next, &joint->def, acting->frame);
    if (joint->coupling)
        coupling_keep(&world->couplings[joint->coupling - 1].next, joint->next.wrench, acting->middle.point,
                      acting->middle.arm_b, dt);
}

/* As the step has solved for it; NULL: the side does not move, or as prescribed. */
static const double *velocity_of(const sadmm_world *world, const struct acting_joint *acting, int s)
{
    const int32_t body = acting->side[s].system_body;
    return body >= 0 ? world->velocity + 6 * (size_t)body : NULL;
}

void sadmm_world_keep_rows(sadmm_world *world, const sadmm_settings *settings)
{
    const struct sadmm_rows *rows = &world->start.rows;
    struct sadmm_world_joint *joint = NULL;
    const struct acting_joint *acting = NULL;
    for (size_t r = 0; r < world->joint_rows; ++r) {
        const struct sadmm_joint_source *source = &world->joint_sources[r];
        if (!joint || joint != world->step_joints[source->joint]) {
            if (joint) end_joint(world, joint, acting, settings->dt);
            joint = world->step_joints[source->joint];
            acting = &world->acting_joints[source->joint];
            v3_store(acting->middle.point, joint->next.point);
        }
        const double force = source->sign * rows->lambda[r] / settings->dt;
        if (joint_role_foresees(source->role))
            joint->next.expected[source->coordinate] +=
                joint_solved_rate(rows->jacobian_a + 6 * r, rows->jacobian_b + 6 * r, velocity_of(world, acting, 0),
                                  velocity_of(world, acting, 1));
        joint_keep_row(&joint->next, acting->middle.axis, source->role, source->coordinate, force);
    }
    if (joint) end_joint(world, joint, acting, settings->dt);
    sadmm_world_keep_gear_rows(world, settings->dt);
}

static void commit_joint(struct sadmm_world_joint *joint)
{
    joint->last = joint->next;
    joint->def.enabled = joint->def.enabled && !joint->last.broken;
}

void sadmm_world_commit_joints(sadmm_world *world)
{
    for (size_t j = 0; j < world->step_joint_count; ++j) commit_joint(world->step_joints[j]);
    sadmm_world_commit_gears(world);
}
