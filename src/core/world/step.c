/* A step by the host: the stages of core/solve/stages.h, one after the other. Nothing before COMMIT changes a body. A
 * backend that keeps the world goes through the same list on its own (resident.c).
 */
#include <math.h>
#include <string.h>

#include "core/base/clock.h"
#include "core/base/memory.h"
#include "core/solve/registry.h"
#include "core/model/joint_momentum.h"
#include "core/model/steady.h"
#include "core/model/push_law.h"
#include "world_internal.h"

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
        const double own = points[k].gap < 0 ? -points[k].gap : 0; /* a gap of 0 is 0 deep, not -0 */
        deepest = own > deepest ? own : deepest;
    }
    keeping->deepest[thread] = deepest;
}

/* The starting impulses, which the solve replaces, and the deepest penetration: one pass over the points. */
static sadmm_status keep_start(sadmm_world *world, double *depth)
{
    const size_t count = world->contacts.point_count;
    struct start_keeping keeping;
    if (!sadmm_grow(&world->start.impulse, &world->start.impulse_capacity, 0, 3 * count,
                    sizeof *world->start.impulse))
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
        if (settings.substeps > 1) body->steady = world->steady[i];
        steady_keep(&body->steady, &world->start.rigid[i], &world->next[i], settings.dt);
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
    sadmm_world_commit_driven(world);
    sadmm_world_moved(world);
    sadmm_world_commit_joints(world);
    sadmm_world_commit_couplings(world, world->def.settings.substeps);
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
    double depth;          /* deepest penetration, m */
    double joint_drift;    /* of the last one */
    int iterations;        /* of all of them */
    bool unconverged;      /* one of them has not met a stop rule */
    int32_t limited;       /* islands, most of any */
    int32_t direct;        /* islands solved directly in this sub-step */
    int32_t pushed;        /* bodies moved out of overlaps in this sub-step */
    int64_t islands_above; /* likewise, but of the last sub-step; -1: no stop rule */
    double ms[SADMM_PHASE_COUNT];
};

/* Bodies with joints, directly. */
static sadmm_status solve_joined(struct host_step *step, const uint8_t *stiffened, bool after)
{
    sadmm_world *world = step->world;
    if (!step->system.rows) return SADMM_OK;
    if (!world->joined) world->joined = sadmm_joined_create();
    if (!world->joined) return sadmm_fail_memory(&world->error, "joined bodies");
    return sadmm_joined_solve(world->joined, &step->system, world->joint_constraints, world->joint_constraint_count,
                              &step->settings, stiffened, after, &world->error);
}

/* Before the iterations; again with the stiffness of the forces that this finds. */
static sadmm_status begin_joined(struct host_step *step)
{
    sadmm_world *world = step->world;
    bool stiffened;
    TRY(solve_joined(step, NULL, false));
    TRY(sadmm_world_stiffen(world, &step->settings, &stiffened));
    return stiffened ? solve_joined(step, world->stiffened, false) : SADMM_OK;
}

/* What the iterations have left of islands with joints (core/solve/direct.h). */
static sadmm_status solve_direct(struct host_step *step)
{
    sadmm_world *world = step->world;
    step->direct = 0;
    if (step->settings.direct_points == 0 || !step->system.rows) return SADMM_OK;
    if (!world->direct) world->direct = sadmm_direct_create();
    if (!world->direct) return sadmm_fail_memory(&world->error, "islands that are solved directly");
    return sadmm_direct_solve(world->direct, world->joined, &step->system, world->joint_constraints, &step->settings,
                              &step->direct, &world->error);
}

/* Which islands are pushed apart without a velocity (core/solve/push.h). */
static sadmm_status choose_pushes(struct host_step *step, double depth)
{
    sadmm_world *world = step->world;
    step->pushed = 0;
    if (depth <= step->settings.slop || !push_is_apart(world->kernels->backend == SADMM_BACKEND_CUDA,
                                                       step->system.body_count, step->system.driven_count))
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

static sadmm_status make_plan(struct host_step *step)
{
    sadmm_world *world = step->world;
    double depth = 0;
    step->found = true;
    TRY(sadmm_world_make_rows(world, &step->settings));
    step->system = sadmm_world_system(world);
    step->system.first = step->system.first && step->stages.substep == 0;
    TRY(sadmm_world_carry(world, &step->system));
    world->plan = sadmm_plan_make(&step->system, &step->settings);
    step->report = sadmm_solve_report_empty(world->kernels);
    TRY(keep_start(world, &depth));
    TRY(choose_pushes(step, depth));
    if (world->joined) sadmm_joined_begin(world->joined);
    if (world->plan.warm_start) TRY(begin_joined(step));
    step->depth = depth > step->depth ? depth : step->depth;
    return SADMM_OK;
}

/* A sub-step has been made. */
static void add_substep(struct host_step *step)
{
    const sadmm_solve_report *solved = &step->report;
    const int64_t above = solved->certificate.islands_above;
    step->iterations += solved->iterations;
    step->unconverged = step->unconverged || !solved->converged;
    step->limited = solved->limited > step->limited ? solved->limited : step->limited;
    if (!sadmm_stages_in_last_substep(&step->stages) && above > step->islands_above) step->islands_above = above;
}

/* A contact that rolls, to what a body takes along into the next step. */
static void keep_rolling(sadmm_world *world, const struct sadmm_contact_pair *pair, int32_t k, double dt)
{
    const struct sadmm_contact_point *point = &world->contacts.points[k];
    const struct sadmm_contact_migration *migration = &world->contacts.migrations[k];
    const struct rolling_halfway at = rolling_halfway_of(pair->normal, point, migration);
    const double push = sadmm_normal_impulse(pair, point);
    const int32_t body[2] = {pair->body_a, pair->body_b};
    for (int s = 0; s < 2; ++s) {
        if (body[s] < 0) continue;
        struct sadmm_rigid *next = &world->next[body[s]];
        const double *arm = s ? point->arm_b : point->arm_a;
        rolling_begin(next);
        if (point->migrates >= MIGRATES_SOON) next->rolls |= ROLLING_TURNS_ON; /* on a round surface */
        rolling_owe(pair->normal, arm, at.normal, s ? at.arm_b : at.arm_a, point->impulse, s ? 1 : -1, next->owed);
        rolling_stiffen(pair->normal, rolling_height(pair->normal, arm, point->gap), migration->radius, push, dt,
                        next->stiffness);
    }
}

/* Between bodies of an island whose momentum has been restored: it has what such a contact owes already, in sum. */
static bool is_restored(const sadmm_world *world, const struct sadmm_contact_pair *pair)
{
    return world->start.rows.constraint_count > 0 && pair->body_a >= 0 && pair->body_b >= 0 &&
           joint_island_is_loose(world->joint_touch[world->joint_labels[pair->body_a]]);
}

static bool is_joined(const sadmm_world *world, int32_t body)
{
    return world->start.rows.constraint_count > 0 &&
           world->joint_touch[world->joint_labels[body]] & ISLAND_JOINED;
}

static void keep_rolling_contacts(sadmm_world *world, double dt)
{
    const struct sadmm_contact_set *contacts = &world->contacts;
    if (contacts->migrating == 0) return;
    for (size_t p = 0; p < contacts->pair_count; ++p)
        for (int32_t k = contacts->pairs[p].first; k < contacts->pairs[p].first + contacts->pairs[p].count; ++k)
            if (contacts->points[k].migrates && !is_restored(world, &contacts->pairs[p]))
                keep_rolling(world, &contacts->pairs[p], k, dt);
    for (int32_t i = 0; i < world->dynamic_count; ++i) {
        struct sadmm_rigid *next = &world->next[i];
        if (next->rolls)
            rolling_keep(next, world->start.rigid[i].position, dt, is_joined(world, i) || !rolling_turns_on(next),
                         next->owed, next->stiffness);
    }
}

static sadmm_status solve_stage(struct host_step *step, const struct sadmm_stage *stage)
{
    sadmm_status status = sadmm_solve_stage(&step->solve, &step->stages, stage);
    return status == SADMM_ERROR_NON_FINITE ? name_offending_body(step->world) : status;
}

static sadmm_status integrate(struct host_step *step)
{
    sadmm_world *world = step->world;
    sadmm_world_put_down(world, &step->system);
    TRY(world->kernels->integrate(world->context, world->next, &world->error));
    if (step->system.rows) {
        TRY(solve_joined(step, NULL, true));
        TRY(solve_direct(step));
        sadmm_world_keep_rows(world, &step->settings);
    }
    TRY(sadmm_world_move_driven(world, &step->settings));
    sadmm_world_move_targets(world, step->settings.dt);
    if (step->system.rows) TRY(sadmm_world_move_joined(world, &step->settings, &step->joint_drift));
    if (step->pushed > 0) sadmm_push_move(world->push, step->settings.dt, world->next);
    keep_rolling_contacts(world, step->settings.dt);
    add_substep(step);
    return check_next(world);
}

static sadmm_status find_wrenches(const struct host_step *step)
{
    sadmm_world *world = step->world;
    sadmm_world_add_driven_wrenches(world, &step->settings);
    if (step->direct == 0) TRY(world->kernels->recover_wrenches(world->context, world->wrench, &world->error));
    else sadmm_world_find_wrenches(world, &step->settings); /* by impulses that the backend has not */
    for (size_t i = 0; i < (size_t)world->dynamic_count; ++i)
        for (int k = 0; k < 6; ++k)
            world->wrench[6 * i + (size_t)k] += rolling_wrench(&world->start.rigid[i], step->settings.dt, k);
    sadmm_world_add_hit_wrenches(world, &step->settings);
    return SADMM_OK;
}

static sadmm_status run_stage(struct host_step *step, const struct sadmm_stage *stage)
{
    sadmm_world *world = step->world;
    switch (stage->kind) {
    case SADMM_STAGE_GATHER: return sadmm_world_gather(world);
    case SADMM_STAGE_FIND:
        TRY(sadmm_world_take_hits(world, step->stages.substep));
        TRY(find_contacts(world, step->stages.substep));
        sadmm_world_open_gaps(world);
        return SADMM_OK;
    case SADMM_STAGE_PLAN: return make_plan(step);
    case SADMM_STAGE_SOLUTION: TRY(solve_stage(step, stage)); return solve_pushes(step);
    case SADMM_STAGE_INTEGRATE: return integrate(step);
    case SADMM_STAGE_WRENCHES: return find_wrenches(step);
    case SADMM_STAGE_TURN: sadmm_world_turn(world, step->stages.substep - 1); return SADMM_OK;
    case SADMM_STAGE_CERTIFY:
        step->system.carried = NULL;
        world->certified_step = world->report.step + 1; /* what this step will be */
        return sadmm_certify_with(&world->certificate_workspace, &step->system, &step->settings,
                                  &step->report.certificate, &world->error);
    case SADMM_STAGE_COMMIT: commit(world); return SADMM_OK;
    default: return solve_stage(step, stage);
    }
}

static sadmm_status run_stages(struct host_step *step)
{
    struct sadmm_stage stage;
    double before = sadmm_clock_ms();
    while (sadmm_stages_next(&step->stages, &stage)) {
        TRY(run_stage(step, &stage));
        const double now = sadmm_clock_ms();
        step->ms[sadmm_stage_phase(stage.kind)] += now - before;
        before = now;
    }
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
        .limited = step->limited,
        .joints = step->world->joints_acting,
        .couplings = step->world->couplings_acting,
        .penetration_max = step->depth,
        .joint_drift = step->joint_drift,
        .residual = solved->residual,
        .ms = {.collide = ms[SADMM_PHASE_COLLIDE], .assemble = ms[SADMM_PHASE_ASSEMBLE],
               .solve = ms[SADMM_PHASE_SOLVE], .finish = ms[SADMM_PHASE_FINISH]},
    };
    done.plan.threads = step->world->team.ran;
    for (int phase = 0; phase < SADMM_PHASE_COUNT; ++phase)
        done.ms.total += phase == SADMM_PHASE_CERTIFY ? 0 : ms[phase];
    sadmm_world_report_steps(step->world, 1, &done);
    step->world->report.certificate = solved->certificate;
    if (step->islands_above > solved->certificate.islands_above)
        step->world->report.certificate.islands_above = step->islands_above;
    step->world->report.certify_ms = ms[SADMM_PHASE_CERTIFY];
}

/* A step made by the host, stage by stage. */
static sadmm_status host_step(sadmm_world *world)
{
    struct host_step step = {
        .world = world, .settings = sadmm_settings_of_substep(&world->def.settings), .islands_above = -1};
    step.stages = sadmm_stages_of(&world->plan, &step.settings, true);
    TRY(sadmm_world_take_back(world));
    world->certified_step = -1;
    world->team.ran = 1;
    const struct sadmm_plan last_plan = world->plan;
    step.solve = (struct sadmm_solve){world->kernels, world->context, &step.system, &step.settings,
                                      &world->plan, &step.report, &world->error};
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
    return sadmm_world_settle(world);
}

sadmm_status sadmm_world_report(sadmm_world *world, sadmm_step_report *report)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_check_given(report, "report", &world->error));
    TRY(sadmm_world_settle(world));
    *report = world->report;
    return SADMM_OK;
}

/* FNV-1a over the bit patterns. */
static uint64_t hash_doubles(uint64_t hash, const double *x, int count)
{
    for (int k = 0; k < count; ++k) {
        uint64_t bits;
        memcpy(&bits, &x[k], sizeof bits);
        for (int byte = 0; byte < 8; ++byte) {
            hash ^= bits >> (8 * byte) & 0xff;
            hash *= UINT64_C(0x100000001b3);
        }
    }
    return hash;
}

sadmm_status sadmm_world_state_hash(sadmm_world *world, uint64_t *out)
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_check_given(out, "hash", &world->error));
    TRY(sadmm_world_pull_bodies(world));
    for (size_t slot = 0; slot < world->body_slots; ++slot) {
        const struct sadmm_world_body *body = &world->bodies[slot];
        if (!body->alive) continue;
        hash = hash_doubles(hash, body->rigid.position, 3);
        hash = hash_doubles(hash, body->rigid.orientation, 4);
        hash = hash_doubles(hash, body->rigid.velocity, 6);
    }
    *out = hash;
    return SADMM_OK;
}
