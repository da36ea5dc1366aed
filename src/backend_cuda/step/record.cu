/* Whole steps on the device: a step, launch by launch, and the graph that is made of it (step/world.h). */
#include "backend_cuda/assemble/assemble.h"
#include "backend_cuda/graph/graph.h"
#include "backend_cuda/iterate/iterate.h"
#include "backend_cuda/weight/weight.h"
#include "collision/collision.h"
#include "core/solve/stages.h"
#include "world.h"

/* ---- stages ---------------------------------------------------------------------------------------------------- */

static struct sadmm_cuda_find find_of(const struct sadmm_context *c, int substep)
{
    const struct cuda_step *s = c->step;
    const int substeps = c->settings.substeps;
    const bool hits = takes_hits(c), alone = s->conservative > 0 || hits; /* each with candidates of its own */
    const struct sadmm_cuda_find find = {step_state(s->into, substep - 1, substeps),
                                         step_state(s->into, substep, substeps),
                                         alone ? 0 : substep,
                                         alone ? 1 : substeps,
                                         all_use_pdl(c),
                                         hits ? &s->hits : nullptr,
                                         c->view.step.leaves_hits ? &c->view.model.settings->restitution_threshold
                                                                  : nullptr};
    return find;
}

sadmm_status CUDA(enqueue_hits)(struct sadmm_context *c, int substep, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const struct sadmm_cuda_find find = find_of(c, substep);
    if (!find.hits) return SADMM_OK;
    struct sadmm_rigid *start = buffer<struct sadmm_rigid>(c, BUFFER_WORLD_HIT) + (size_t)s->into * (size_t)s->bodies;
    s->hits = {c->view.step.before,
               start,
               c->view.step.bodies,
               c->view.step.start_velocity,
               c->view.model.settings,
               s->bodies,
               c->settings.hits,
               s->into,
               substep,
               c->settings.substeps,
               c->view.step.wrench,
               c->view.kinematic.count > 0 ? c->view.kinematic.wrench : nullptr};
    TRY(COLLISION(enqueue_hits)(s->collision, c->stream, &find, error));
    c->view.step.before = c->view.raw.system.rigid = start;
    if (c->view.push.planned) s->push->view.raw.system.rigid = start;
    return SADMM_OK;
}

/* Contacts, up to the gate. */
sadmm_status CUDA(enqueue_find)(struct sadmm_context *c, int substep, struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    const struct sadmm_cuda_find find = find_of(c, substep);
    TRY(COLLISION(enqueue)(s->collision, c->stream, &find, error));
    return CUDA(launch_admit)(c, error);
}

/* Launches go to a side stream while this lives; it begins behind what is on the main one. */
namespace {
struct side_branch {
    struct sadmm_context *c;
    cudaStream_t main;
    cudaError_t code;
    side_branch(struct sadmm_context *context, cudaStream_t side)
        : c(context), main(context->stream), code(cudaSuccess)
    {
        code = cudaEventRecord(c->fork, main);
        if (code == cudaSuccess) code = cudaStreamWaitEvent(side, c->fork, 0);
        c->stream = side;
    }
    ~side_branch() { c->stream = main; }
    side_branch(const side_branch &) = delete;
    side_branch &operator=(const side_branch &) = delete;
};
} // namespace

/* What the iterating kernels do about energies. With convergence checks an island may have more iterations after them.
 */
static enum cuda_energy_limit energy_limit_by_iterations(const struct sadmm_context *c)
{
    if (!c->plan.energy_limit || c->partition.tier == SADMM_CUDA_TIER_STREAM || c->plan.residuals) return LIMIT_NONE;
    return c->prologue && !stop_rule_checked(c) ? LIMIT_WHOLE : LIMIT_CANDIDATES;
}

/* What is planned and seen from here on is sub-step `substep`. */
static void view_substep(struct sadmm_context *c, int substep)
{
    struct cuda_step *s = c->step;
    const struct substep_plan *plan = &s->plans[substep];
    c->plan = plan->plan;
    s->speculation.contact_rows = plan->contact_rows;
    s->speculation.warm = plan->warm;
    s->speculation.cold = s->cold || !updates_weights(c);
    s->speculation.unsolved = s->unsolved;
    s->speculation.rows = plan->rows;
    c->view.model.contact_rows = plan->contact_rows == 1 ? 1 : 3;
    CUDA(view_into)(c, s->into, substep);
    c->prologue = c->fast && !c->plan.residuals && c->view.rows.count == 0 && c->view.model.contact_rows == 3 &&
                  CUDA(persistent_does_prologue)(&c->partition);
}

static sadmm_status wait_for_joints(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_CALL(c, cudaStreamWaitEvent(c->stream, c->joint_join, 0), "cudaStreamWaitEvent");
    return SADMM_OK;
}

/* Rows of joints. */
static sadmm_status record_joint_rows(struct sadmm_context *c, struct sadmm_error *error)
{
    side_branch side(c, c->joint_side);
    CUDA_CALL(c, side.code, "a branch of the step");
    TRY(CUDA(launch_joint_rows)(c, error));
    CUDA_CALL(c, cudaEventRecord(c->joint_join, c->stream), "cudaEventRecord");
    return SADMM_OK;
}

/* Those in the solver's form, if every step needs them. Where articulations are apart, all that is to be done about
 * them. */
static sadmm_status record_joints(struct sadmm_context *c, struct sadmm_error *error)
{
    side_branch side(c, c->joint_side);
    CUDA_CALL(c, side.code, "a branch of the step");
    CUDA_CALL(c, cudaStreamWaitEvent(c->stream, c->join, 0), "cudaStreamWaitEvent"); /* A and b */
    if (c->view.joints.apart) {
        TRY(CUDA(launch_articulations)(c, false, error));
        TRY(CUDA(launch_joint_solution)(c, error));
        TRY(CUDA(launch_joint_move)(c, error));
    } else if (!solves_ncp(c)) {
        TRY(CUDA(assemble_rows)(c, error));
    }
    CUDA_CALL(c, cudaEventRecord(c->joint_join, c->stream), "cudaEventRecord");
    return SADMM_OK;
}

/* Articulations before the iterations, beside what the main stream does then; what they leave of their inertia
 * (core/model/stiffening.h) is that which rows respond by. */
static sadmm_status record_articulations(struct sadmm_context *c, struct sadmm_error *error)
{
    side_branch side(c, c->joint_side);
    CUDA_CALL(c, side.code, "a branch of the step");
    if (articulations_are_small(c)) TRY(CUDA(launch_pair_parts)(c, error));
    if (c->settings.warm_start) TRY(CUDA(launch_articulations)(c, false, error));
    if (c->fast) TRY(CUDA(enqueue_row_responses)(c, error));
    CUDA_CALL(c, cudaEventRecord(c->joint_join, c->stream), "cudaEventRecord");
    return SADMM_OK;
}

/* A and b of the bodies, and joints, whose forces stiffen them: beside contact finding, of which they need nothing.
 * Where there are kinematic bodies, bodies wait for the motion of their supports. */
static sadmm_status record_bodies(struct sadmm_context *c, struct sadmm_error *error)
{
    const bool joints = c->view.joints.count > 0;
    if (c->view.kinematic.count > 0) return CUDA(launch_joint_rows)(c, error);
    if (joints) TRY(record_joint_rows(c, error));
    {
        side_branch side(c, c->side);
        CUDA_CALL(c, side.code, "a branch of the step");
        if (joints) TRY(wait_for_joints(c, error));
        TRY(CUDA(enqueue_bodies)(c, error));
        CUDA_CALL(c, cudaEventRecord(c->join, c->stream), "cudaEventRecord");
    }
    return joints ? record_joints(c, error) : SADMM_OK;
}

/* What is enqueued from here to end_unsolved is left out where every island is planned to be solved before the
 * iterations. */
static sadmm_status begin_unsolved(struct sadmm_context *c, bool after, struct sadmm_error *error)
{
    const bool measured = c->plan.residuals && !stop_rule_checked(c); /* of iterations, which then are to be made */
    if (!solves_ncp(c) || measured) return SADMM_OK;
    TRY(CUDA(launch_ncp_check)(c, after, error));
    c->skips = !c->step->unsolved;
    return SADMM_OK;
}

static void end_unsolved(struct sadmm_context *c) { c->skips = false; }

/* Islands that are solved before the iterations; what the others need, up to SOLUTION, and of their articulations.
 * Contacts are read by the end of every step. */
static sadmm_status record_solved(struct sadmm_context *c, struct sadmm_error *error)
{
    if (solves_ncp(c)) {
        TRY(CUDA(launch_ncp)(c, false, error));
        TRY(CUDA(assemble_contacts)(c, error));
        TRY(begin_unsolved(c, false, error));
        TRY(CUDA(assemble_rows)(c, error));
    }
    return record_articulations(c, error);
}

/* Contacts in the solver's form, and where iterations begin in islands that are solved. */
static sadmm_status record_starts(struct sadmm_context *c, struct sadmm_error *error)
{
    TRY(CUDA(assemble_contacts)(c, error));
    return solves_ncp(c) ? CUDA(launch_ncp_put)(c, error) : SADMM_OK;
}

/* record_plan where there are kinematic bodies: one after the other. */
static sadmm_status record_kinematic_plan(struct sadmm_context *c, struct sadmm_error *error)
{
    TRY(CUDA(enqueue_statistics_and_layout)(c, slots_by_island(&c->partition), &c->partition, error));
    TRY(CUDA(launch_support)(c, error));
    TRY(CUDA(enqueue_bodies)(c, error));
    if (c->view.push.planned) TRY(CUDA(launch_push_choice)(c, error));
    if (c->view.joints.count > 0) {
        if (!solves_ncp(c)) TRY(CUDA(assemble_rows)(c, error));
        TRY(record_solved(c, error));
        TRY(wait_for_joints(c, error));
    }
    return record_starts(c, error);
}

/* Contacts in the solver's form, beside what the main stream does; after articulations, where these say what they
 * respond by. */
static sadmm_status record_contacts(struct sadmm_context *c, bool late, struct sadmm_error *error)
{
    side_branch side(c, c->side);
    CUDA_CALL(c, side.code, "a branch of the step");
    if (late) TRY(wait_for_joints(c, error));
    TRY(CUDA(assemble_contacts)(c, error));
    CUDA_CALL(c, cudaEventRecord(c->join, c->stream), "cudaEventRecord");
    return SADMM_OK;
}

/* Graph statistics and layout; beside them contacts in the solver's form, what weights take from pairs, and
 * articulations that do not wait for the layout. */
static sadmm_status record_plan(struct sadmm_context *c, struct sadmm_error *error)
{
    if (c->view.kinematic.count > 0) return record_kinematic_plan(c, error);
    const bool together = c->view.joints.count > 0 && !c->view.joints.apart,
               solved = together && solves_ncp(c),
               beside = together && articulations_are_small(c) && !solved,
               late = together && c->fast && c->settings.warm_start, /* inertia of articulations is not known before */
               side = !c->view.push.planned && (!late || beside) && !solved;
    if (together) TRY(wait_for_joints(c, error)); /* the graph is of their rows, too */
    if (beside) TRY(record_articulations(c, error));
    if (side) TRY(record_contacts(c, late, error));
    TRY(CUDA(enqueue_statistics_and_layout)(c, slots_by_island(&c->partition), &c->partition, error));
    CUDA_CALL(c, cudaStreamWaitEvent(c->stream, c->join, 0), "cudaStreamWaitEvent");
    if (c->view.push.planned) TRY(CUDA(launch_push_choice)(c, error)); /* it says what contacts are */
    if (together && !beside) TRY(record_solved(c, error));
    if (together) TRY(wait_for_joints(c, error));
    return side ? SADMM_OK : record_starts(c, error);
}

/* Which motions of floating islands may be restored, beside the iterations; where those find out themselves what is
 * anchored, after them. */
static bool motions_beside(const struct sadmm_context *c)
{
    return c->plan.momentum && !c->prologue && !solves_ncp(c);
}

static sadmm_status record_motions(struct sadmm_context *c, struct sadmm_error *error)
{
    side_branch side(c, c->side);
    CUDA_CALL(c, side.code, "a branch of the step");
    TRY(CUDA(enqueue_motions)(c, error));
    CUDA_CALL(c, cudaEventRecord(c->join, c->stream), "cudaEventRecord");
    return SADMM_OK;
}

static sadmm_status record_energy_limit(struct sadmm_context *c, bool candidates, struct sadmm_error *error)
{
    TRY(CUDA(enqueue_pushed)(c, error));
    if (motions_beside(c)) CUDA_CALL(c, cudaStreamWaitEvent(c->stream, c->join, 0), "cudaStreamWaitEvent");
    else TRY(CUDA(enqueue_motions)(c, error));
    return CUDA(enqueue_energy_limit)(c, candidates, error);
}

/* What joints keep, once their bodies have been solved after the iterations; beside that the end of the step, which
 * takes less. */
static sadmm_status record_articulation_finish(struct sadmm_context *c, struct sadmm_error *error)
{
    {
        side_branch side(c, c->joint_side);
        CUDA_CALL(c, side.code, "a branch of the step");
        TRY(CUDA(launch_finish)(c, c->step->articulations == 0, error));
        CUDA_CALL(c, cudaEventRecord(c->joint_join, c->stream), "cudaEventRecord");
    }
    TRY(begin_unsolved(c, true, error));
    TRY(CUDA(launch_articulations)(c, true, error));
    end_unsolved(c);
    TRY(wait_for_joints(c, error));
    return CUDA(launch_joint_solution)(c, error);
}

/* Islands that were not solved before the iterations, once more. */
static sadmm_status end_iterations(struct sadmm_context *c, struct sadmm_error *error)
{
    if (!solves_ncp(c) || c->view.joints.count == 0) return SADMM_OK;
    TRY(CUDA(launch_ncp)(c, true, error));
    end_unsolved(c);
    return CUDA(launch_ncp_put)(c, error);
}

/* The end of the step, wrenches included; beside it the residuals of the last iteration where they are wanted. */
static sadmm_status record_finish(struct sadmm_context *c, bool residuals, struct sadmm_error *error)
{
    const bool joints = c->view.joints.count > 0, apart = c->view.joints.apart;
    if (residuals) {
        side_branch side(c, c->side);
        CUDA_CALL(c, side.code, "a branch of the step");
        TRY(CUDA(enqueue_residuals)(c, error));
        CUDA_CALL(c, cudaEventRecord(c->join, c->stream), "cudaEventRecord");
    }
    if (joints && apart) TRY(wait_for_joints(c, error));
    TRY(joints && !apart ? record_articulation_finish(c, error) : CUDA(launch_finish)(c, true, error));
    TRY(CUDA(launch_kinematic_finish)(c, error));
    if (takes_hits(c) && c->view.model.wrenches)
        TRY(COLLISION(give_hits)(c->step->collision, c->stream, &c->step->hits, error));
    if (residuals) CUDA_CALL(c, cudaStreamWaitEvent(c->stream, c->join, 0), "cudaStreamWaitEvent");
    return SADMM_OK;
}

/* ---- the second problem (push.cu) -------------------------------------------------------------------------------- */

/* Stages that both problems have alike. */
static sadmm_status record_solving(struct sadmm_context *c, const struct sadmm_stage *stage, bool *residuals,
                                   enum cuda_energy_limit limit, struct sadmm_error *error)
{
    switch (stage->kind) {
    case SADMM_STAGE_ITERATE:
        return CUDA(enqueue_iterations)(c, stage->count, stage->goes_on,
                                        stage->measure && (stage->last || !stop_rule_checked(c)),
                                        stage->last || stage->checked ? limit : LIMIT_NONE, error);
    case SADMM_STAGE_RESIDUALS: /* not reported where islands stop by themselves */
        *residuals = stage->last && !stop_rule_checked(c);
        return stage->last || stop_rule_checked(c) ? SADMM_OK : CUDA(enqueue_residuals)(c, error);
    case SADMM_STAGE_CHECK: return CUDA(enqueue_convergence_check)(c, stage->done, error);
    case SADMM_STAGE_WEIGHTS: return CUDA(enqueue_weights)(c, true, error);
    case SADMM_STAGE_BALANCE: /* the ratio of (15) is found on the device */
        TRY(CUDA(enqueue_balance)(c, error));
        return CUDA(factorize)(c, error);
    default: return SADMM_OK;
    }
}

static sadmm_status record_second_stage(struct sadmm_context *p, const struct sadmm_stage *stage,
                                        struct sadmm_error *error)
{
    bool residuals = false;
    switch (stage->kind) {
    case SADMM_STAGE_BODIES: return CUDA(enqueue_bodies)(p, error);
    case SADMM_STAGE_CONTACTS: return CUDA(assemble_contacts)(p, error);
    case SADMM_STAGE_PENALTY: /* nothing is compared with a plan */
        TRY(CUDA(init_penalty)(p, error));
        return CUDA(factorize)(p, error);
    case SADMM_STAGE_ENERGY_LIMIT:
        TRY(CUDA(enqueue_pushed)(p, error));
        TRY(CUDA(enqueue_motions)(p, error));
        return CUDA(enqueue_energy_limit)(p, false, error);
    default: return record_solving(p, stage, &residuals, LIMIT_NONE, error);
    }
}

/* Of one kind. */
static sadmm_status record_second(struct sadmm_context *p, struct sadmm_error *error)
{
    struct sadmm_stages stages = sadmm_stages_of(&p->plan, &p->settings, false);
    struct sadmm_stage stage;
    while (sadmm_stages_next(&stages, &stage)) TRY(record_second_stage(p, &stage, error));
    return SADMM_OK;
}

/* As a cold one and as a warm one, of which one does nothing. */
static sadmm_status record_kinds(struct sadmm_context *c, struct sadmm_error *error)
{
    struct sadmm_context *p = c->step->push;
    const bool differ = sadmm_plan_depends_on_warmth(&p->settings);
    TRY(CUDA(enqueue_statistics_and_layout)(p, true, &p->partition, error));
    for (int warm = 0; warm <= differ; ++warm) {
        TRY(CUDA(launch_push_kind)(c, false, !differ ? PUSH_ANY : warm ? PUSH_WARM : PUSH_COLD, error));
        CUDA(plan_second)(c, warm);
        TRY(record_second(p, error));
    }
    return CUDA(launch_push_move)(c, error);
}

/* What bodies that are pushed do, from where the step moves them to. */
static sadmm_status record_pushed(struct sadmm_context *c, struct sadmm_error *error)
{
    TRY(CUDA(launch_move_again)(c, error));
    TRY(CUDA(launch_push_gather)(c, error));
    TRY(CUDA(launch_push_kind)(c, true, PUSH_ANY, error));
    return record_kinds(c, error);
}

/* Behind the end of the step; most steps that are planned to have pushes have none. */
static sadmm_status record_push(struct sadmm_context *c, struct sadmm_error *error)
{
    struct sadmm_context *p = c->step->push;
    const cudaStream_t own = p->stream;
    p->stream = c->stream;
    p->recording = true;
    const sadmm_status status = record_pushed(c, error);
    p->recording = false;
    p->stream = own;
    return status;
}

/* *residuals: those of the last iteration are wanted. */
static sadmm_status record_stage(struct sadmm_context *c, const struct sadmm_stage *stage, bool *residuals,
                                 struct sadmm_error *error)
{
    const enum cuda_energy_limit limit = energy_limit_by_iterations(c);
    switch (stage->kind) {
    case SADMM_STAGE_GATHER: return CUDA(launch_start)(c, error);
    case SADMM_STAGE_HITS: return CUDA(enqueue_hits)(c, c->view.step.substep, error);
    case SADMM_STAGE_FIND:
        TRY(record_bodies(c, error)); /* beside it */
        return CUDA(enqueue_find)(c, c->view.step.substep, error);
    case SADMM_STAGE_PLAN: return record_plan(c, error);
    case SADMM_STAGE_PENALTY:
        TRY(CUDA(enqueue_penalties)(c, error));
        return motions_beside(c) ? record_motions(c, error) : SADMM_OK;
    case SADMM_STAGE_ITERATE:
    case SADMM_STAGE_RESIDUALS:
    case SADMM_STAGE_CHECK:
    case SADMM_STAGE_WEIGHTS:
    case SADMM_STAGE_BALANCE: return record_solving(c, stage, residuals, limit, error);
    case SADMM_STAGE_SOLUTION: return end_iterations(c, error); /* record_finish reads it where it is */
    case SADMM_STAGE_ENERGY_LIMIT:
        return limit == LIMIT_WHOLE ? SADMM_OK : record_energy_limit(c, limit == LIMIT_CANDIDATES, error);
    case SADMM_STAGE_INTEGRATE:
        TRY(record_finish(c, *residuals, error));
        return c->view.push.planned ? record_push(c, error) : SADMM_OK;
    case SADMM_STAGE_TURN:
        TRY(CUDA(launch_turn)(c, error));
        view_substep(c, c->view.step.substep + 1);
        *residuals = false;
        return SADMM_OK;
    case SADMM_STAGE_COMMIT: return CUDA(launch_commit)(c, error);
    /* record_bodies, beside FIND */
    case SADMM_STAGE_JOINT_ROWS:
    case SADMM_STAGE_BODIES:
    /* record_plan */
    case SADMM_STAGE_PUSH_CHOICE:
    case SADMM_STAGE_BLOCK_SOLVE:
    case SADMM_STAGE_NCP_SOLVE:
    case SADMM_STAGE_CONTACTS:
    case SADMM_STAGE_ROWS:
    /* end_iterations */
    case SADMM_STAGE_NCP_SOLVE_AGAIN:
    /* record_finish */
    case SADMM_STAGE_BLOCK_SOLVE_AGAIN:
    case SADMM_STAGE_REACTIONS:
    case SADMM_STAGE_KINEMATIC:
    case SADMM_STAGE_JOINT_MOTION:
    case SADMM_STAGE_WRENCHES:
    /* record_push */
    case SADMM_STAGE_PUSH_SOLVE:
    case SADMM_STAGE_PUSH_MOTION:
    /* launch_turn and launch_commit */
    case SADMM_STAGE_KEEP: return SADMM_OK;
    /* by the host: loads before a world is loaded, certificates of what it reads */
    case SADMM_STAGE_INITIALISE:
    case SADMM_STAGE_CERTIFY:
    case SADMM_STAGE_COUNT: return SADMM_OK;
    }
    return SADMM_OK;
}

static sadmm_status enqueue_step(struct sadmm_context *c, bool with_updates, struct sadmm_error *error)
{
    struct sadmm_stages stages = sadmm_stages_of(&c->plan, &c->settings, true);
    struct sadmm_stage stage;
    bool residuals = false;
    view_substep(c, 0);
    if (with_updates) TRY(CUDA(launch_updates)(c, error));
    while (sadmm_stages_next(&stages, &stage)) TRY(record_stage(c, &stage, &residuals, error));
    return SADMM_OK;
}

/* ---- graphs ---------------------------------------------------------------------------------------------------- */

sadmm_status CUDA(record_step)(struct sadmm_context *c, bool with_updates, int into, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    cudaGraphExec_t *ready = &s->graphs[with_updates].into[into];
    cudaGraph_t graph = nullptr;
    const int next = s->into;
    CUDA_CALL(c, cudaStreamBeginCapture(c->stream, cudaStreamCaptureModeThreadLocal), "cudaStreamBeginCapture");
    s->into = into;
    c->recording = true;
    sadmm_status status = enqueue_step(c, with_updates, error);
    c->recording = c->skips = false;
    s->into = next;
    cudaError_t code = cudaStreamEndCapture(c->stream, &graph);
    if (status == SADMM_OK && code != cudaSuccess) status = CUDA(fail)(c, code, "cudaStreamEndCapture", error);
    /* Instantiated again: plans change rarely, and then the graph's shape changes with them. */
    if (*ready) (void)cudaGraphExecDestroy(*ready);
    *ready = nullptr;
    if (status == SADMM_OK) {
        code = cudaGraphInstantiate(ready, graph, 0);
        if (code != cudaSuccess) {
            *ready = nullptr;
            status = CUDA(fail)(c, code, "cudaGraphInstantiate", error);
        }
    }
    if (graph) (void)cudaGraphDestroy(graph);
    return status;
}
