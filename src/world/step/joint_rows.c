/* Joints as constraint rows (docs/internals/algorithm.md, "Joints"): their laws (core/model/joint_law.h) into the
 * step's rows, multipliers from the forces of the last step, and the solution's back into what joints keep. */
#include <string.h>

#include "config.h"
#include "core/base/memory.h"
#include "gear_rows.h"
#include "joint_act.h"
#include "joint_rates.h"
#include "joint_rows.h"
#include "joint_stiffen.h"

/* Six locks, or what acts along six free coordinates. */
struct all_laws {
    struct joint_laws of[JOINT_COORDINATES];
    const struct joint_law *law[JOINT_COORDINATES * JOINT_COORDINATE_LAWS]; /* in the order of rows */
    int count;
};

/* joint_moving_of. */
static struct joint_moving moving_of(const struct sadmm_world_joint *joint, const struct acting_joint *acting,
                                     const struct joint_rates *rates, const struct joint_turn_bounds *bounds, int k,
                                     const sadmm_settings *settings)
{
    const bool radial = joint_is_radial(joint->def.kind);
    struct joint_coordinate_rates r = {.before = rates->before[k], .start = rates->start[k],
                                       .middle = rates->middle[k], .prescribed = rates->prescribed[k]};
    const double turning = r.start + r.prescribed - r.before;
    const bool turns = !((k > 0 || !radial) && joint_turns_within(bounds, k, turning, settings->dt)) &&
                       joint_turns(acting, k, radial, turning, settings->dt);
    for (int s = 0; !(joint->def.locks >> k & 1) && s < 2; ++s) {
        if (acting->side[s].system_body < 0) continue;
        r.free += joint_row_product(rates->row[s][k], acting->side[s].free);
        r.response += joint_response(&acting->side[s], rates->row[s][k]);
    }
    return joint_moving_by(&joint->def, &joint->next, acting, k, &r, turns, settings);
}

/* Locked coordinates first: they are held together. */
static void find_laws(struct sadmm_world_joint *joint, const struct acting_joint *acting,
                      const struct joint_rates *rates, const sadmm_settings *settings, struct all_laws *all)
{
    const struct joint_turn_bounds bounds = joint_turn_bounds_of(acting);
    all->count = 0;
    for (int locked = 1; locked >= 0; --locked)
        for (uint32_t left = JOINT_ALL_LOCKED & (locked ? joint->def.locks : ~joint->def.locks); left;
             left &= left - 1) {
            const int k = __builtin_ctz(left);
            struct joint_laws *laws = &all->of[k];
            if (!joint_has_coordinate(&joint->def, k)) continue;
            const struct joint_moving m = moving_of(joint, acting, rates, &bounds, k, settings);
            if (joint_winds(joint->def.locks, k)) joint->next.angle[k] = m.value;
            const struct joint_table table = {joint->table[k],
                                              joint->table[k] ? joint->table[k] + joint->table_count[k] : NULL,
                                              joint->table_count[k]};
            joint_coordinate_laws(&joint->def, k, &m, joint->table[k] ? &table : NULL, laws);
            for (int i = 0; i < laws->count; ++i) all->law[all->count++] = &laws->law[i];
        }
}

static sadmm_joint_rates *best_rates(void)
{
#ifdef SADMM_HAVE_ISA_AVX2
    if (__builtin_cpu_supports("avx2")) return sadmm_joint_rates_avx2;
#endif
    return sadmm_joint_rates_baseline;
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

static bool add_constraints(sadmm_world *world, const struct sadmm_world_joint *joint,
                            const struct acting_joint *acting, const struct joint_rates *rates,
                            const struct all_laws *laws, double dt)
{
    struct sadmm_rows *rows = &world->start.rows;
    const size_t all = rows->row_count + (size_t)laws->count;
    if (!SADMM_GROW(world->joint_sources, rows->row_count, all) ||
        !SADMM_GROW(world->start.multiplier, rows->row_count, all))
        return false;
    double offset[3];
    v3_store(v3_sub(acting->middle.arm_a, acting->middle.arm_b), offset);
    for (int i = 0; i < laws->count; ++i) {
        const struct joint_law *law = laws->law[i];
        if (i % SADMM_MAX_ROWS == 0) {
            const int left = laws->count - i, count = left < SADMM_MAX_ROWS ? left : SADMM_MAX_ROWS;
            if (sadmm_rows_add(rows, count, acting->side[0].system_body, acting->side[1].system_body) < 0)
                return false;
            sadmm_rows_set_rigid(rows, offset);
        }
        const size_t r = all - (size_t)laws->count + (size_t)i;
        for (int s = 0; s < 2; ++s) {
            double *row = (s ? rows->jacobian_b : rows->jacobian_a) + 6 * r;
            if (acting->side[s].system_body < 0) continue;
            memcpy(row, rates->row[s][law->coordinate], 6 * sizeof *row);
            for (int j = 0; law->sign < 0 && j < 6; ++j) row[j] = -row[j];
        }
        sadmm_row_set(rows, (int32_t)r, law->gain, law->bias, law->compliance, law->lo, law->hi);
        rows->lambda[r] = world->start.multiplier[r] =
            law->sign * joint->next.force[law->role][law->coordinate] * dt;
        world->joint_sources[r] =
            (struct sadmm_joint_source){joint->number,   (int8_t)law->role, (int8_t)law->coordinate, (int8_t)law->sign,
                                        law->separation, law->slack,        law->prescribed};
    }
    return true;
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
    sadmm_joint_rates *const find_rates = best_rates();
    sadmm_rows_clear(&world->start.rows);
    world->joints_acting = world->couplings_acting = 0;
    world->joint_constraint_count = 0;
    world->spins_known = false;
    if (world->step_joint_count > 0 && !sadmm_world_begin_acting(world, settings))
        return sadmm_fail_memory(&world->error, "the joints' rows");
    for (size_t j = 0; j < world->step_joint_count; ++j) {
        struct sadmm_world_joint *joint = world->step_joints[j];
        struct all_laws laws;
        struct joint_rates rates;
        const size_t before = world->start.rows.constraint_count;
        if (!joint->def.enabled) {
            if (!add_slots(world, joint, before)) return sadmm_fail_memory(&world->error, "the joints' rows");
            continue;
        }
        const struct acting_joint *acting = sadmm_world_act_joint(world, joint, settings);
        find_rates(acting, &rates);
        find_laws(joint, acting, &rates, settings, &laws);
        if (laws.count > 0) ++*(joint->coupling ? &world->couplings_acting : &world->joints_acting);
        if (!add_constraints(world, joint, acting, &rates, &laws, settings->dt) ||
            !add_slots(world, joint, before))
            return sadmm_fail_memory(&world->error, "the joints' rows");
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
