/* A step by the host: the stages of core/solve/stages.h, one after the other. Nothing before COMMIT changes a body. A
 * backend that keeps the world goes through the same list on its own (resident.c).
 */
#include <math.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/clock.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "core/model/extrapolation.h"
#include "core/model/joint_momentum.h"
#include "core/model/push_law.h"
#include "core/solve/registry.h"
#include "step.h"
#include "world/objects/events.h"
#include "world/resident/resident.h"
#include "world/state/report.h"
#include "world/step/coupling_step.h"
#include "world/step/decide.h"
#include "world/step/gather.h"
#include "world/step/hits.h"
#include "world/step/integrate.h"
#include "world/step/joint_move.h"
#include "world/step/joint_rows.h"
#include "world/step/joint_stiffen.h"
#include "world/step/kinematic.h"
#include "world/step/rolling.h"
#include "world/step/wrenches.h"

/* Settled boxes have about ten contacts each; AUTO needs an order of magnitude before the first contact is known. */
enum { EXPECTED_CONTACTS_PER_BODY = 8 };

sadmm_status sadmm_world_choose_backend(sadmm_world *world)
{
    const bool chosen = world->kernels != NULL; /* and its context was given up, after an error of its device */
    if (world->context) return SADMM_OK;
    int64_t expected = (int64_t)world->dynamic_count * EXPECTED_CONTACTS_PER_BODY;
    if (!chosen)
        TRY(sadmm_backend_choose(world->def.backend, world->def.precision, expected, &world->kernels, world->why,
                                 sizeof world->why, &world->error));
    sadmm_status status = world->kernels->create(world->def.device, &world->context, &world->error);
    if (status != SADMM_OK && !chosen) world->kernels = NULL;
    return status;
}

static sadmm_status find_contacts(sadmm_world *world, int substep)
{
    struct sadmm_collision_input input = sadmm_world_collision_input(world, substep);
    input.team = &world->team;
    world->hit_since = NULL;
    return (substep > 0 ? sadmm_collision_find_again : sadmm_collision_find)(world->collision, &input,
                                                                             &world->contacts, &world->error);
}

struct start_keeping {
    sadmm_world *world;
    double deepest[SADMM_MOST_THREADS]; /* of each member's points */
};

static void keep_share(void *argument, int thread, int threads)
{
    struct start_keeping *keeping = (struct start_keeping *)argument;
    sadmm_world *world = keeping->world;
    const struct sadmm_contact_point *points = world->contacts.points;
    size_t begin, end;
    double deepest = 0;
    sadmm_share(world->contacts.point_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) {
        memcpy(world->start.impulse + 3 * k, points[k].impulse, 3 * sizeof *world->start.impulse);
        const double own = points[k].separation < 0 ? -points[k].separation : 0; /* a separation of 0 is 0 deep, not
                                                                                    -0 */
        deepest = own > deepest ? own : deepest;
    }
    keeping->deepest[thread] = deepest;
}

/* The starting impulses, which the solve replaces, and the deepest penetration: one pass over the points. */
static sadmm_status keep_start(sadmm_world *world, double *depth)
{
    const size_t count = world->contacts.point_count;
    struct start_keeping keeping;
    if (!SADMM_GROW(world->start.impulse, 0, 3 * count))
        return sadmm_fail_memory(&world->error, "the step's starting impulses");
    keeping.world = world;
    const int ran = sadmm_parallel(&world->team, sadmm_pass_threads(world->plan.threads, count), keep_share, &keeping);
    *depth = 0;
    for (int t = 0; t < ran; ++t) *depth = keeping.deepest[t] > *depth ? keeping.deepest[t] : *depth;
    return SADMM_OK;
}

static bool finite_state(const struct sadmm_rigid *body)
{
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += body->position[k] - body->position[k];
    for (int k = 0; k < 4; ++k) sum += body->orientation[k] - body->orientation[k];
    for (int k = 0; k < 6; ++k) sum += body->velocity[k] - body->velocity[k];
    return sum == 0;
}

static sadmm_status check_next(sadmm_world *world)
{
    for (int32_t i = 0; i < world->dynamic_count; ++i)
        if (!finite_state(&world->next[i])) return sadmm_world_not_finite(world, i);
    return SADMM_OK;
}

/* The solve found something that is not finite: name a body of it. */
static sadmm_status name_offending_body(sadmm_world *world)
{
    for (size_t k = 0; k < 6 * (size_t)world->dynamic_count; ++k)
        if (!isfinite(world->velocity[k])) return sadmm_world_not_finite(world, (int32_t)(k / 6));
    for (size_t p = 0; p < world->contacts.pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &world->contacts.pairs[p];
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
            for (int j = 0; j < 3; ++j)
                if (!isfinite(world->contacts.points[k].impulse[j]))
                    return sadmm_world_not_finite(world, pair->body_b >= 0 ? pair->body_b : pair->body_a);
    }
    for (size_t k = 0; k < world->start.rows.constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &world->start.rows.constraints[k];
        for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r)
            if (!isfinite(world->start.rows.lambda[r]))
                return sadmm_world_not_finite(world, constraint->body_b >= 0 ? constraint->body_b : constraint->body_a);
    }
    return SADMM_ERROR_NON_FINITE;
}

static void commit_share(void *argument, int thread, int threads)
{
    sadmm_world *world = (sadmm_world *)argument;
    const sadmm_settings settings = sadmm_settings_of_substep(&world->def.settings);
    size_t begin, end;
    sadmm_share((size_t)world->dynamic_count, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) {
        struct sadmm_world_body *body = &world->bodies[world->slot_of[i]];
        if (settings.substeps > 1) body->extrapolation = world->extrapolation[i];
        extrapolation_keep(&body->extrapolation, &world->start.rigid[i], &world->next[i], settings.dt);
        body->rigid = world->next[i];
        if (!world->plan.wrenches) continue;
        const double *last = world->wrench + 6 * i;
        if (settings.substeps == 1) memcpy(body->contact_wrench, last, sizeof body->contact_wrench);
        else
            for (int k = 0; k < 6; ++k)
                body->contact_wrench[k] = (world->wrench_sum[6 * i + (size_t)k] + last[k]) / settings.substeps;
    }
}

static void commit(sadmm_world *world)
{
    const int threads = sadmm_pass_threads(world->plan.threads, (size_t)world->dynamic_count);
    sadmm_parallel(&world->team, threads, commit_share, world);
    sadmm_world_commit_kinematic(world);
    sadmm_world_moved(world);
    sadmm_world_commit_joints(world);
    sadmm_world_commit_couplings(world, world->def.settings.substeps);
    sadmm_decider_turn(&world->decider);
    world->stepped = true;
    world->contacts_readable = true;
}

/* A step made by the host, while it is made. */
struct host_step {
    sadmm_world *world;
    sadmm_settings settings; /* of a sub-step */
    struct sadmm_system system;
    struct sadmm_solve solve;
    sadmm_solve_report report;
    struct sadmm_stages stages;
    bool found;   /* the contacts have been replaced */
    /* Of the sub-steps made so far. */
    double depth;          /* deepest penetration, m; */
    double depth_now;      /* that of this sub-step */
    double joint_drift;    /* of the last one */
    int iterations;        /* of all of them */
    bool unconverged;      /* one of them has not met a stop rule */
    int32_t limited;       /* islands, most of any */
    int32_t ncp;           /* islands that the dense contact solve has changed in this sub-step */
    int32_t pushed;        /* bodies moved out of overlaps in this sub-step */
    double error;          /* m/s, -1: not known; */
    sadmm_step_error error_kind; /* what it is; */
    int64_t unsolved;            /* islands, most of any; -1: no tolerance */
    double ms[SADMM_PHASE_COUNT];
};

/* The block direct solve of articulations. */
static sadmm_status solve_articulations(struct host_step *step, const uint8_t *stiffened, bool after)
{
    sadmm_world *world = step->world;
    if (!world->articulations) world->articulations = sadmm_articulations_create();
    if (!world->articulations) return sadmm_fail_memory(&world->error, "articulations");
    return sadmm_articulations_solve(world->articulations, &step->system, world->joint_constraints,
                                     world->joint_constraint_count, &step->settings, stiffened, after, &world->error);
}

/* Before the iterations; again with the stiffness of the forces that this finds. */
static sadmm_status begin_articulations(struct host_step *step)
{
    sadmm_world *world = step->world;
    bool stiffened;
    TRY(solve_articulations(step, NULL, false));
    TRY(sadmm_world_stiffen(world, &step->settings, &stiffened));
    return stiffened ? solve_articulations(step, world->stiffened, false) : SADMM_OK;
}

/* Nothing is left to iterate: any stop rule is met, and x and z are one (eqs. 16 and 17). */
static void report_solved(struct host_step *step)
{
    const sadmm_settings *settings = &step->settings;
    const sadmm_residual none = {0};
    step->report.converged = settings->tolerance > 0 || settings->residual_tolerance > 0;
    if (step->world->plan.residuals) step->report.residual = none;
}

/* m/s: a world whose last step missed no more was at rest, say, and may be still. */
static const double AT_REST = 1e-9, LIKELY_AT_REST = 1e-8;

/* Without joints: is the start the solution, as it is of what rests? */
static sadmm_status find_rest(struct host_step *step, bool *rests)
{
    sadmm_world *world = step->world;
    *rests = false;
    if (step->settings.tolerance <= 0 || !world->stepped || !(world->report.error <= LIKELY_AT_REST) ||
        world->report.error < 0)
        return SADMM_OK;
    TRY(sadmm_solve_errors_find(&world->errors, &step->system, &step->settings, world->kernels->precision,
                                &world->error));
    const struct sadmm_solve_error sum = sadmm_solve_errors_sum(&world->errors, step->settings.tolerance);
    *rests = sum.law <= AT_REST && sum.momentum <= AT_REST;
    step->solve.errors_known = *rests;
    return SADMM_OK;
}

/* The system, with a list of rows though it may be empty. */
static struct sadmm_system with_rows(const struct host_step *step)
{
    struct sadmm_system system = step->system;
    system.rows = &step->world->start.rows;
    return system;
}

static sadmm_status make_ncp(struct host_step *step)
{
    sadmm_world *world = step->world;
    if (!world->ncp) world->ncp = sadmm_ncp_create();
    if (!world->articulations) world->articulations = sadmm_articulations_create();
    if (!world->ncp || !world->articulations)
        return sadmm_fail_memory(&world->error, "islands of the dense contact solve");
    return world->plan.row_constraints > 0
               ? SADMM_OK
               : sadmm_articulations_find_none(world->articulations, &step->system, &world->error);
}

/* The dense contact solve (NCP) before the iterations (core/solve/ncp.h): where bodies are seen from their supports, or
 * pushed apart, islands are left for later. */
static sadmm_status solve_ncp(struct host_step *step)
{
    sadmm_world *world = step->world;
    const bool rows = world->plan.row_constraints > 0, apart = step->system.support_motion || step->pushed > 0;
    TRY(make_ncp(step));
    const struct sadmm_system system = with_rows(step);
    const struct sadmm_ncp_input input = {0,   world->articulations, &system, world->joint_constraints, &step->settings,
                                          NULL};
    TRY(sadmm_ncp_solve(world->ncp, &input, rows && !apart, &step->stages.solved, &step->ncp, &world->error));
    if (!rows && !apart) TRY(find_rest(step, &step->stages.solved));
    if (step->stages.solved) report_solved(step);
    step->solve.ncp = world->ncp;
    return SADMM_OK;
}

/* After them. Bodies without joints that it has changed are moved anew: the iterations' result has moved all. */
static sadmm_status solve_ncp_again(struct host_step *step)
{
    sadmm_world *world = step->world;
    int32_t solved;
    bool moved;
    step->system.support_motion = NULL;
    TRY(make_ncp(step));
    const struct sadmm_system system = with_rows(step);
    const struct sadmm_ncp_input input = {
        step->report.iterations,  world->articulations, &system,
        world->joint_constraints, &step->settings,      step->solve.errors_known ? &world->errors : NULL};
    if (step->solve.errors_known && !step->solve.ncp_missed && world->plan.row_constraints == 0) return SADMM_OK;
    TRY(sadmm_ncp_solve_again(world->ncp, &input, &solved, &moved, &world->error));
    step->ncp += solved;
    return moved ? sadmm_world_integrate(world, &step->system, &step->settings, world->ncp) : SADMM_OK;
}

/* Which islands are pushed apart without a velocity (core/solve/push.h). */
static sadmm_status choose_pushes(struct host_step *step)
{
    sadmm_world *world = step->world;
    const bool cuda = world->kernels->backend == SADMM_BACKEND_CUDA;
    const struct sadmm_resident_copies *copies = world->resident.copies;
    const int32_t bodies = copies ? copies->bodies : step->system.body_count;
    if (step->depth_now <= step->settings.slop || !push_is_apart(cuda, bodies, step->system.kinematic_count))
        return SADMM_OK;
    if (!world->push) world->push = sadmm_push_create();
    if (!world->push) return sadmm_fail_memory(&world->error, "bodies that overlap");
    TRY(sadmm_push_choose(world->push, &step->system, &step->settings, world->plan.threads, &world->error));
    step->pushed = sadmm_push_count(world->push);
    return SADMM_OK;
}

static sadmm_status solve_pushes(struct host_step *step)
{
    sadmm_world *world = step->world;
    if (step->pushed == 0) return SADMM_OK;
    return sadmm_push_solve(world->push, world->kernels, world->def.device, &step->system,
                            world->plan.contact_rows, &step->settings, &world->error);
}

static sadmm_status find(struct host_step *step)
{
    sadmm_world *world = step->world;
    TRY(find_contacts(world, step->stages.substep));
    sadmm_world_open_separations(world);
    step->found = true;
    return sadmm_world_decide(world);
}

static sadmm_status make_plan(struct host_step *step)
{
    sadmm_world *world = step->world;
    step->system = sadmm_world_system(world);
    step->system.first = step->system.first && step->stages.substep == 0;
    if (world->spins_known) step->system.spins = world->spins;
    TRY(sadmm_world_enter_support_frame(world, &step->system));
    world->plan = sadmm_plan_make(&step->system, &step->settings);
    if (world->resident.copies && world->plan.points > 0) world->plan.contact_rows = PLAN_CONTACT_ROWS_OF_COPIES;
    step->report = sadmm_solve_report_empty(world->kernels);
    step->solve.ncp = NULL;
    step->solve.errors_known = step->solve.ncp_missed = false;
    step->ncp = step->pushed = 0;
    if (world->articulations) sadmm_articulations_begin(world->articulations);
    if (world->ncp) sadmm_ncp_begin(world->ncp);
    TRY(keep_start(world, &step->depth_now));
    step->depth = step->depth_now > step->depth ? step->depth_now : step->depth;
    return SADMM_OK;
}

/* ---- the error of a step ----------------------------------------------------------------------------------------- */

static void add_error(struct host_step *step, double error, sadmm_step_error kind)
{
    if (error <= step->error) return;
    step->error = error;
    step->error_kind = kind;
}

/* Joints that are open by more than a step's correction closes: what is beyond it, m/s. */
static double joint_error(const struct host_step *step)
{
    const sadmm_settings *s = &step->settings;
    const double beyond = step->joint_drift / s->dt - s->correction_speed;
    return s->correction_speed > 0 && s->correction_factor > 0 && beyond > 0 ? beyond : 0;
}

/* Are all islands the dense contact solve's, as far as it has come with them? */
static bool ncp_has_all(const struct host_step *step)
{
    const sadmm_world *world = step->world;
    if (!step->stages.solved || step->solve.errors_known) return false;
    const int32_t *label = sadmm_ncp_islands(world->ncp);
    for (int32_t i = 0; i < world->dynamic_count; ++i)
        if (label[i] == i && sadmm_ncp_error(world->ncp, i) < 0) return false;
    return true;
}

/* What the dense contact solve has left of islands, in the place of what the iterations had. */
static void take_ncp_errors(struct host_step *step)
{
    sadmm_world *world = step->world;
    struct sadmm_solve_errors *errors = &world->errors;
    for (int32_t i = 0; i < errors->body_count; ++i) {
        const double left = errors->label[i] == i ? sadmm_ncp_error(world->ncp, i) : -1;
        if (left < 0) continue;
        errors->law[i] = left;
        errors->momentum[i] = 0;
    }
}

/* No island is looked at again whose error is known: of a dense contact solve, or a check after which nothing has
 * changed. */
static sadmm_status find_error(struct host_step *step)
{
    sadmm_world *world = step->world;
    const sadmm_settings *settings = &step->settings;
    struct sadmm_solve_error sum = {0, 0, 0};
    if (settings->tolerance <= 0 && !settings->certify) return SADMM_OK;
    add_error(step, 0, SADMM_STEP_ERROR_NONE);
    if (ncp_has_all(step)) {
        const int32_t *label = sadmm_ncp_islands(world->ncp);
        for (int32_t i = 0; i < world->dynamic_count; ++i) {
            const double left = label[i] == i ? sadmm_ncp_error(world->ncp, i) : 0;
            sum.law = left > sum.law ? left : sum.law;
            sum.unsolved += !(left <= settings->tolerance);
        }
    } else {
        const bool changed = step->report.limited > 0 || world->plan.row_constraints > 0;
        step->system.support_motion = NULL;
        if (!step->solve.errors_known || (changed && !step->stages.solved))
            TRY(sadmm_solve_errors_find(&world->errors, &step->system, settings, world->kernels->precision,
                                        &world->error));
        else if (step->ncp > 0) take_ncp_errors(step);
        sum = sadmm_solve_errors_sum(&world->errors, settings->tolerance);
    }
    add_error(step, sum.law, SADMM_STEP_ERROR_LAW);
    add_error(step, sum.momentum, step->report.limited > 0 ? SADMM_STEP_ERROR_LIMITER : SADMM_STEP_ERROR_MOMENTUM);
    add_error(step, joint_error(step), SADMM_STEP_ERROR_JOINTS);
    if (settings->tolerance <= 0) return SADMM_OK;
    step->unsolved = sum.unsolved > step->unsolved ? sum.unsolved : step->unsolved;
    step->report.converged = sum.unsolved == 0 && (settings->residual_tolerance <= 0 || step->report.converged);
    return SADMM_OK;
}

/* A sub-step has been made. */
static void add_substep(struct host_step *step)
{
    const sadmm_solve_report *solved = &step->report;
    step->iterations += solved->iterations;
    step->unconverged = step->unconverged || !solved->converged;
    step->limited = solved->limited > step->limited ? solved->limited : step->limited;
}

static sadmm_status solve_stage(struct host_step *step, const struct sadmm_stage *stage)
{
    sadmm_status status = sadmm_solve_stage(&step->solve, &step->stages, stage);
    return status == SADMM_ERROR_NON_FINITE ? name_offending_body(step->world) : status;
}

static sadmm_status integrate(struct host_step *step)
{
    sadmm_world *world = step->world;
    sadmm_world_leave_support_frame(world, &step->system);
    if (step->stages.solved)
        return sadmm_world_integrate(world, &step->system, &step->settings, world->ncp);
    return world->kernels->integrate(world->context, world->next, &world->error);
}

static sadmm_status move_kinematic(struct host_step *step)
{
    TRY(sadmm_world_move_kinematic(step->world, &step->settings));
    sadmm_world_move_targets(step->world, step->settings.dt);
    return SADMM_OK;
}

static sadmm_status move_articulated(struct host_step *step)
{
    sadmm_world *world = step->world;
    return sadmm_world_move_articulated(world, &step->settings,
                                        step->stages.solved ? sadmm_ncp_islands(world->ncp) : NULL, &step->joint_drift);
}

static void move_pushed(struct host_step *step)
{
    if (step->pushed > 0) sadmm_push_move(step->world->push, step->settings.dt, step->world->next);
}

static sadmm_status keep(struct host_step *step)
{
    sadmm_world_keep_rolling(step->world, step->settings.dt);
    TRY(find_error(step));
    add_substep(step);
    return check_next(step->world);
}

static sadmm_status find_wrenches(const struct host_step *step)
{
    sadmm_world *world = step->world;
    sadmm_world_add_kinematic_wrenches(world, &step->settings);
    if (step->ncp > 0 || step->stages.solved) /* by impulses that the backend has not */
        sadmm_world_find_wrenches(world, &step->settings);
    else
        TRY(world->kernels->recover_wrenches(world->context, world->wrench, &world->error));
    for (size_t i = 0; i < (size_t)world->dynamic_count; ++i)
        for (int k = 0; k < 6; ++k)
            world->wrench[6 * i + (size_t)k] += rolling_wrench(&world->start.rigid[i], step->settings.dt, k);
    sadmm_world_add_hit_wrenches(world, &step->settings);
    return SADMM_OK;
}

static sadmm_status certify(struct host_step *step)
{
    sadmm_world *world = step->world;
    step->system.support_motion = NULL;
    world->certified_step = world->report.step + 1; /* what this step will be */
    return sadmm_certify_with(&world->certificate_workspace, &step->system, &step->settings, &step->report.certificate,
                              &world->error);
}

static sadmm_status run_stage(struct host_step *step, const struct sadmm_stage *stage)
{
    sadmm_world *world = step->world;
    const sadmm_settings *settings = &step->settings;
    switch (stage->kind) {
    case SADMM_STAGE_GATHER: return sadmm_world_gather(world);
    case SADMM_STAGE_HITS: return sadmm_world_take_hits(world, step->stages.substep);
    case SADMM_STAGE_FIND: return find(step);
    case SADMM_STAGE_JOINT_ROWS: return sadmm_world_make_rows(world, settings);
    case SADMM_STAGE_PLAN: return make_plan(step);
    case SADMM_STAGE_PUSH_CHOICE: return choose_pushes(step);
    case SADMM_STAGE_BLOCK_SOLVE: return begin_articulations(step);
    case SADMM_STAGE_PUSH_SOLVE: return solve_pushes(step);
    case SADMM_STAGE_INTEGRATE: return integrate(step);
    case SADMM_STAGE_BLOCK_SOLVE_AGAIN: return solve_articulations(step, NULL, true);
    case SADMM_STAGE_NCP_SOLVE: return solve_ncp(step);
    case SADMM_STAGE_NCP_SOLVE_AGAIN: return solve_ncp_again(step);
    case SADMM_STAGE_REACTIONS: sadmm_world_keep_rows(world, settings); return SADMM_OK;
    case SADMM_STAGE_KINEMATIC: return move_kinematic(step);
    case SADMM_STAGE_JOINT_MOTION: return move_articulated(step);
    case SADMM_STAGE_PUSH_MOTION: move_pushed(step); return SADMM_OK;
    case SADMM_STAGE_KEEP: return keep(step);
    case SADMM_STAGE_WRENCHES: return find_wrenches(step);
    case SADMM_STAGE_TURN: sadmm_world_turn(world, step->stages.substep - 1); return SADMM_OK;
    case SADMM_STAGE_CERTIFY: return certify(step);
    case SADMM_STAGE_COMMIT: commit(world); return SADMM_OK;
    default: return solve_stage(step, stage);
    }
}

static sadmm_status run_stages(struct host_step *step)
{
    struct sadmm_stage stage;
    enum sadmm_phase phase = SADMM_PHASE_COLLIDE;
    double begin = sadmm_clock_ms(); /* of the phase: the clock takes as long as a stage of a small world */
    while (sadmm_stages_next(&step->stages, &stage)) {
        const enum sadmm_phase next = sadmm_stage_phase(stage.kind);
        if (next != phase) {
            const double now = sadmm_clock_ms();
            step->ms[phase] += now - begin;
            begin = now, phase = next;
        }
        TRY(run_stage(step, &stage));
    }
    step->ms[phase] += sadmm_clock_ms() - begin;
    return SADMM_OK;
}

static void report_step(const struct host_step *step)
{
    const sadmm_solve_report *solved = &step->report;
    const double *ms = step->ms;
    struct sadmm_resident_report done = {
        .plan = step->world->plan,
        .time = step->world->report.time + step->world->def.settings.dt,
        .iterations = step->iterations,
        .iterations_mean = step->iterations,
        .converged = !step->unconverged,
        .error = step->error,
        .error_kind = step->error_kind,
        .unsolved = step->unsolved,
        .limited = step->limited,
        .joints = step->world->joints_acting,
        .couplings = step->world->couplings_acting,
        .penetration_max = step->depth,
        .joint_drift = step->joint_drift,
        .residual = solved->residual,
        .ms = {.collide = ms[SADMM_PHASE_COLLIDE],
               .assemble = ms[SADMM_PHASE_ASSEMBLE],
               .solve = ms[SADMM_PHASE_SOLVE],
               .finish = ms[SADMM_PHASE_FINISH]},
    };
    done.plan.threads = step->world->team.ran;
    for (int phase = 0; phase < SADMM_PHASE_COUNT; ++phase)
        done.ms.total += phase == SADMM_PHASE_CERTIFY ? 0 : ms[phase];
    sadmm_world_report_steps(step->world, 1, &done);
    step->world->report.certificate = solved->certificate;
    step->world->report.certify_ms = ms[SADMM_PHASE_CERTIFY];
}

/* A step made by the host, stage by stage. */
static sadmm_status host_step(sadmm_world *world)
{
    struct host_step step = {
        .world = world, .settings = sadmm_settings_of_substep(&world->def.settings), .error = -1, .unsolved = -1};
    step.stages = sadmm_stages_of(&world->plan, &step.settings, true);
    TRY(sadmm_world_detach(world));
    world->certified_step = -1;
    world->team.ran = 1;
    const struct sadmm_plan last_plan = world->plan;
    step.solve = (struct sadmm_solve){.kernels = world->kernels,
                                      .context = world->context,
                                      .system = &step.system,
                                      .settings = &step.settings,
                                      .plan = &world->plan,
                                      .report = &step.report,
                                      .error = &world->error,
                                      .errors = &world->errors};
    sadmm_world_swap_starts(world);
    sadmm_status status = run_stages(&step);
    if (status != SADMM_OK) { /* what can be read of the last step is as before */
        sadmm_world_swap_starts(world);
        world->plan = last_plan;
        if (step.found) sadmm_collision_undo(world->collision, &world->contacts);
        return sadmm_world_contain(world, status);
    }
    world->step_settings = world->def.settings;
    report_step(&step);
    return SADMM_OK;
}

sadmm_status sadmm_world_step(sadmm_world *world)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_world_choose_backend(world));
    TRY(sadmm_world_may_reside(world) ? sadmm_world_resident_step(world, true) : host_step(world));
    return sadmm_world_note_events(world);
}

sadmm_status sadmm_world_step_async(sadmm_world *world)
{
    TRY(sadmm_check_given(world, "world", NULL));
    if (world->events.capacity > 0) return sadmm_world_step(world);
    TRY(sadmm_world_choose_backend(world));
    return sadmm_world_may_reside(world) ? sadmm_world_resident_step(world, false) : host_step(world);
}

sadmm_status sadmm_world_wait(sadmm_world *world)
{
    TRY(sadmm_check_given(world, "world", NULL));
    return sadmm_world_synchronise(world);
}

/* Of the report's first version. */
enum { LEAST_REPORT = SADMM_SIZE_TO(sadmm_step_report, certificate) };

sadmm_status sadmm_world_report_sized(sadmm_world *world, sadmm_step_report *report, size_t size)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_check_given(report, "report", &world->error));
    TRY(sadmm_world_synchronise(world));
    return sadmm_give_bytes(report, size, &world->report, sizeof world->report, LEAST_REPORT, "report", &world->error);
}
