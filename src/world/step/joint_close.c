/* What is locked, closed at the end of a (sub-)step (core/model/joint_close.h): rows of the poses that it has moved
 * bodies to, solved for displacements by the order of the step's own. */
#include <string.h>

#include "core/base/memory.h"
#include "core/model/forces.h"
#include "core/model/joint_close.h"
#include "core/model/joint_trapezoid.h"
#include "core/solve/articulation.h"
#include "gather.h"
#include "joint_act.h"
#include "joint_close.h"
#include "joint_rows.h"
#include "joint_variants.h"

static struct joint_pose pose_of(const struct sadmm_rigid *rigid)
{
    return rigid ? (struct joint_pose){rigid->position, rigid->orientation} : (struct joint_pose){NULL, NULL};
}

/* Targets of couplings have no start of their own left: they are where the step has left them. */
static const struct sadmm_rigid *target_of(const sadmm_world *world, const struct sadmm_world_joint *joint, int s)
{
    return s == 0 && joint->coupling ? &world->couplings[joint->coupling - 1].next.target : NULL;
}

/* Where the step has left a body of the joint. */
static const struct sadmm_rigid *moved_to(const sadmm_world *world, const struct sadmm_world_joint *joint, int s)
{
    const struct sadmm_rigid *target = target_of(world, joint, s);
    if (target) return target;
    const struct joint_body body = sadmm_world_joint_body(world, joint->body[s]);
    if (body.system_body >= 0) return &world->next[body.system_body];
    if (body.prescribed)
        return &world->kinematic[sadmm_kinematic(world->bodies[joint->body[s]].system_body)].next;
    return body.rigid;
}

static bool closes(const struct sadmm_world_joint *joint) { return joint->def.enabled && joint->def.locks; }

static struct joint_opened opened_of(const sadmm_world *world, const struct sadmm_world_joint *joint)
{
    struct joint_opened out = {.joint = joint};
    for (int s = 0; s < 2; ++s) {
        const struct joint_body body = sadmm_world_joint_body(world, joint->body[s]);
        out.pose[s] = pose_of(moved_to(world, joint, s));
        out.moves[s] = body.system_body >= 0 ? body.rigid : NULL;
    }
    return out;
}

/* The joints that are to stay closed. */
static bool list_joints(sadmm_world *world)
{
    world->opening_count = 0;
    if (!SADMM_GROW(world->openings, 0, world->step_joint_count)) return false;
    for (size_t j = 0; j < world->step_joint_count; ++j)
        if (closes(world->step_joints[j]))
            world->openings[world->opening_count++] = opened_of(world, world->step_joints[j]);
    return true;
}

static void find_closing(const sadmm_world *world, const struct joint_opened *opened, const sadmm_settings *settings,
                         struct joint_closing *out)
{
    struct joint_pose start[2];
    for (int s = 0; s < 2; ++s) {
        const struct sadmm_rigid *target = target_of(world, opened->joint, s);
        start[s] = pose_of(target ? target : sadmm_world_joint_body(world, opened->joint->body[s]).rigid);
    }
    sadmm_joint_kernels_best()->close(opened, start, settings, out);
}

/* Is it of a part that folds? */
static bool folds(const sadmm_world *world, const struct sadmm_world_joint *joint)
{
    for (int s = 0; s < 2; ++s) {
        const int32_t body = sadmm_world_joint_body(world, joint->body[s]).system_body;
        if (body >= 0 && world->folding[body]) return true;
    }
    return false;
}

static void mark_bodies(const sadmm_world *world, const struct sadmm_world_joint *joint, uint8_t *bodies)
{
    for (int s = 0; s < 2; ++s) {
        const int32_t body = sadmm_world_joint_body(world, joint->body[s]).system_body;
        if (body >= 0) bodies[body] = true;
    }
}

static bool may_open(const sadmm_world *world, const struct sadmm_world_joint *joint)
{
    for (int s = 0; s < 2; ++s) {
        const int32_t body = sadmm_world_joint_body(world, joint->body[s]).system_body;
        if (body >= 0 && joint_island_may_open(world->joint_touch[world->joint_labels[body]])) return true;
    }
    return false;
}

/* Which bodies have joints that are to be closed; the largest error, m. Are there any? */
static bool find_open(sadmm_world *world, const sadmm_settings *settings, double *off)
{
    bool any = false;
    *off = 0;
    sadmm_joint_kernels_best()->openings(world->openings, world->opening_count);
    for (size_t j = 0; j < world->opening_count; ++j) {
        const struct joint_opened *opened = &world->openings[j];
        const struct sadmm_world_joint *joint = opened->joint;
        const bool folding = folds(world, joint);
        struct joint_closing closing;
        *off = opened->off > *off ? opened->off : *off;
        if (!folding && (opened->little || !may_open(world, joint))) continue;
        find_closing(world, opened, settings, &closing);
        if (!(closing.share > (folding ? JOINT_CLOSE_FOLDING : JOINT_CLOSE_FROM))) continue;
        if (!any) memset(world->opened, 0, (size_t)world->dynamic_count);
        mark_bodies(world, joint, world->opened);
        any = true;
    }
    return any;
}

static void mark_islands(const sadmm_world *world, const uint8_t *bodies)
{
    for (int32_t i = 0; i < world->dynamic_count; ++i)
        if (bodies[i]) world->joint_touch[world->joint_labels[i]] |= ISLAND_CLOSED;
}

/* ---- what folds -------------------------------------------------------------------------------------------------- */

/* Which bodies are of parts that fold; what is left of rows is kept for the next step. Are there any? */
static sadmm_status find_folding(sadmm_world *world, bool *any)
{
    const size_t n = (size_t)world->dynamic_count, rows = world->start.rows.row_count;
    *any = false;
    if (!SADMM_GROW(world->folding, 0, n)) return sadmm_fail_memory(&world->error, "joints that fold");
    memset(world->folding, 0, n);
    if (!sadmm_articulations_has_loops(world->articulations)) return SADMM_OK;
    if (!SADMM_GROW(world->row_left, 0, rows)) return sadmm_fail_memory(&world->error, "joints that fold");
    memset(world->row_left, 0, rows * sizeof *world->row_left);
    sadmm_articulations_find_left(world->articulations, world->joint_constraints, world->row_left);
    for (size_t r = 0; r < world->joint_rows; ++r) {
        const struct sadmm_joint_source *source = &world->joint_sources[r];
        struct sadmm_world_joint *joint = world->step_joints[source->joint];
        double *was = &joint->next.left[source->coordinate];
        if (source->role != SADMM_ROLE_LOCK) continue;
        if (joint_row_folds(*was, world->row_left[r])) {
            *any = true;
            mark_bodies(world, joint, world->folding);
        }
        *was = world->row_left[r];
    }
    if (*any) sadmm_articulations_mark_parts(world->articulations, world->folding);
    return SADMM_OK;
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* Rows of locks, a constraint each, in the places of the step's own. */
static bool add_rows(sadmm_world *world, const struct sadmm_row_constraint *place,
                     const struct joint_opened *opened, const sadmm_settings *settings)
{
    struct sadmm_rows *rows = &world->closing;
    struct joint_closing c;
    find_closing(world, opened, settings, &c);
    const int32_t first = sadmm_rows_add(rows, c.count, place->body_a, place->body_b);
    if (first < 0) return false;
    double offset[3];
    v3_store(v3_sub(c.geometry.arm_a, c.geometry.arm_b), offset);
    sadmm_rows_set_rigid(rows, offset);
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
    const struct joint_opened *opened = world->openings;
    size_t at = 0;
    sadmm_rows_clear(&world->closing);
    if (!SADMM_GROW(world->closing_slots, 0, world->joint_constraint_count)) return false;
    for (size_t k = 0; k < world->joint_constraint_count; ++k) {
        world->closing_slots[k] = world->joint_constraints[k];
        world->closing_slots[k].first = world->closing_slots[k].count = 0;
    }
    for (size_t j = 0; j < world->step_joint_count; ++j) {
        const struct sadmm_world_joint *joint = world->step_joints[j];
        const size_t before = world->closing.constraint_count, places = (size_t)sadmm_joint_constraints(joint);
        if (closes(joint) && !add_rows(world, &world->closing_slots[at], opened++, settings)) return false;
        if (world->closing.constraint_count > before) world->closing_slots[at] = world->closing.constraints[before];
        at += places;
    }
    return true;
}

/* ---- what it costs ----------------------------------------------------------------------------------------------- */

static double energy2(const struct sadmm_rigid *body, const sadmm_settings *settings)
{
    return joint_energy2(body, body->position, body->orientation, body->velocity, settings);
}

/* Of a body; then by island, at its first body. */
struct joint_closing_cost {
    double gained, moving; /* twice the energy that closing has given it, and that of its motion, J */
};

static void begin_costs(sadmm_world *world, const sadmm_settings *settings)
{
    for (int32_t i = 0; i < world->dynamic_count; ++i)
        world->closing_costs[i].gained = -energy2(&world->next[i], settings);
}

static void end_costs(sadmm_world *world, const sadmm_settings *settings)
{
    for (int32_t i = 0; i < world->dynamic_count; ++i)
        world->closing_costs[i].gained += energy2(&world->next[i], settings);
}

static void pay_costs(sadmm_world *world)
{
    struct joint_closing_cost *costs = world->closing_costs;
    for (int32_t i = 0; i < world->dynamic_count; ++i) { /* an island's first body comes first */
        struct joint_closing_cost *sum = &costs[world->joint_labels[i]];
        costs[i].moving = joint_motion_energy2(&world->next[i], world->next[i].orientation, world->next[i].velocity);
        if (sum == &costs[i]) continue;
        sum->gained += costs[i].gained;
        sum->moving += costs[i].moving;
    }
    for (int32_t i = 0; i < world->dynamic_count; ++i) {
        const struct joint_closing_cost *sum = &costs[world->joint_labels[i]];
        if (!(world->joint_touch[world->joint_labels[i]] & ISLAND_CLOSED)) continue;
        const double keep = joint_closing_keep(sum->gained, sum->moving);
        for (int k = 0; k < 6; ++k) world->next[i].velocity[k] *= keep;
    }
}

/* Velocities of what folds, along what its joints leave it at the end. What they are off by in a direction that is
 * about to vanish would be taken for errors as large as that is short, once the next step is past the pose. */
static sadmm_status turn_speeds(sadmm_world *world, const struct sadmm_system *system, const sadmm_settings *settings)
{
    if (!make_rows(world, settings)) return sadmm_fail_memory(&world->error, "joints that close");
    memset(world->closing.bias, 0, world->closing.row_count * sizeof *world->closing.bias);
    mark_islands(world, world->folding);
    return sadmm_articulations_close(world->articulations, system, world->closing_slots, world->joint_constraint_count,
                                     settings, world->folding, true, world->next, &world->error);
}

sadmm_status sadmm_world_close_joints(sadmm_world *world, const sadmm_settings *settings, double *off)
{
    struct sadmm_system system = sadmm_world_system(world);
    if (world->spins_known) system.spins = world->spins;
    const size_t n = (size_t)world->dynamic_count;
    if (!SADMM_GROW(world->opened, 0, n) || !SADMM_GROW(world->closing_costs, 0, n) || !list_joints(world))
        return sadmm_fail_memory(&world->error, "joints that close");
    bool any = false, folding = false;
    TRY(find_folding(world, &folding));
    system.rows = &world->closing;
    if (folding) begin_costs(world, settings);
    for (int step = 0; find_open(world, settings, off) && step < JOINT_CLOSE_STEPS; ++step) {
        if (!any && !folding) begin_costs(world, settings);
        any = true;
        if (!make_rows(world, settings)) return sadmm_fail_memory(&world->error, "joints that close");
        sadmm_articulations_mark_parts(world->articulations, world->opened);
        mark_islands(world, world->opened);
        TRY(sadmm_articulations_close(world->articulations, &system, world->closing_slots,
                                      world->joint_constraint_count, settings, world->opened, false, world->next,
                                          &world->error));
    }
    if (!any && !folding) return SADMM_OK;
    end_costs(world, settings);
    if (folding) TRY(turn_speeds(world, &system, settings));
    pay_costs(world);
    return SADMM_OK;
}
