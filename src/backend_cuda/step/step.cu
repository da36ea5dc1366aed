/* Whole steps on the device, the host's side (step/step.h): load, plan, record, launch, see, read. */
#include <string.h>

#include <algorithm>

#include "collision/collision.h"
#include "core/base/memory.h"
#include "core/model/settings.h"
#include "core/solve/stages.h"
#include "backend_cuda/collide/pipeline.h"
#include "backend_cuda/device/context.h"

/* Of a step that was enqueued, until its report has been seen. */
struct queued_step {
    cudaEvent_t done;
    struct sadmm_settings settings;
    struct sadmm_resident_edit *edits; /* pinned */
    size_t edit_count, edit_capacity;
};

struct cuda_step {
    struct sadmm_cuda_collision *collision;
    int32_t bodies, slots;

    bool planned;               /* rooms, partition and guess are for the world as it is */
    bool recorded;              /* and so are the graphs */
    cudaGraphExec_t graphs[2];  /* by the set that is written */
    struct cuda_step_guess guess;
    int64_t candidate_capacity, point_capacity;

    /* The queue: steps [seen, enqueued), at most STEPS_AHEAD. */
    struct queued_step queue[STEPS_AHEAD];
    int64_t enqueued, seen;
    int into;                   /* set and state the next step writes */

    struct cuda_step_report last; /* of the last step that was done, */
    struct sadmm_settings last_settings;
    double time;                  /* simulated until after it, s */
    int64_t done, repeats;
    int64_t misfit;             /* the last step that its partition did not fit; -1: none */
    int32_t offending_body;
};

template <class T> static T *buffer(const struct sadmm_context *c, enum cuda_buffer_name name)
{
    return (T *)c->buffers[name].data;
}

static struct cuda_step_report *reports(const struct sadmm_context *c)
{
    return buffer<struct cuda_step_report>(c, PINNED_REPORTS);
}

/* Capacities: more than there was, so that not every new contact repeats a step: half as much again in small scenes,
 * where a heap that spreads gains a third, an eighth in large ones, where it costs memory. */
static int64_t generous(int64_t count) { return count + std::min(count / 2, count / 8 + 8192) + 256; }

/* ---- the view of a step ---------------------------------------------------------------------------------------- */

/* Is there a stop rule to check? Then residuals say nothing: islands end at different times. */
static bool stops(const struct sadmm_context *c) { return c->fast && c->settings.certificate_tolerance > 0; }

/* Everything of the view that depends on which state and set is written. */
static void view_into(struct sadmm_context *c, int into)
{
    const struct cuda_step *s = c->step;
    const struct sadmm_cuda_contacts set = COLLISION(set)(s->collision, into);
    const size_t n = (size_t)s->bodies;
    struct cuda_step_view *step = &c->view.step;
    struct sadmm_rigid *rigid = buffer<struct sadmm_rigid>(c, BUFFER_WORLD_BODIES);
    struct sadmm_steady *steady = buffer<struct sadmm_steady>(c, BUFFER_WORLD_STEADY);
    step->before = rigid + (size_t)(1 - into) * n;
    step->after = rigid + (size_t)into * n;
    step->steady_before = steady + (size_t)(1 - into) * n;
    step->steady_after = steady + (size_t)into * n;
    step->wrench = buffer<double>(c, BUFFER_WORLD_WRENCH) + (size_t)into * 6 * n;
    step->start_velocity = buffer<double>(c, BUFFER_WORLD_VELOCITY);
    step->start_impulse = buffer<double>(c, BUFFER_WORLD_IMPULSE);
    step->points = set.points;
    step->slot_of_body = buffer<int32_t>(c, BUFFER_WORLD_SLOTS);
    step->bodies = buffer<struct sadmm_collision_body>(c, BUFFER_WORLD_PLACES);
    step->counts = set.device_counts;
    step->candidate_capacity = s->candidate_capacity;
    step->point_capacity = s->point_capacity;
    step->guess = s->guess;
    step->control = buffer<struct cuda_step_control>(c, BUFFER_WORLD_CONTROL);
    step->reports = reports(c);
    step->measured = c->plan.residuals && !stops(c);
    step->limits = c->plan.limit;
    c->view.raw.system.rigid = step->before;
    c->view.raw.system.velocity = step->start_velocity;
    c->view.raw.pairs = set.pairs;
    c->view.raw.points = set.points;
}

/* Counts and settings of the view; pairs: room for so many. */
static void view_counts(struct sadmm_context *c, int64_t pairs)
{
    struct cuda_step *s = c->step;
    cuda_view *v = &c->view;
    struct sadmm_system none = {};
    c->system = nullptr;
    v->raw.system = none;
    v->raw.system.body_count = s->bodies;
    v->model.bodies = s->bodies;
    v->contacts.pair_capacity = (int32_t)((pairs + WARP - 1) / WARP * WARP);
    v->rows.count = 0;
    v->rows.stride = 0;
    v->model.contact_rows = s->guess.contact_rows == 1 ? 1 : 3;
    v->model.warm_start = c->settings.warm_start;
}

/* ---- a step, launch by launch ---------------------------------------------------------------------------------- */

/* Contacts, up to the gate. */
static sadmm_status enqueue_find(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_TRY(COLLISION(enqueue)(c->step->collision, c->stream, c->step->into, error));
    return CUDA(launch_admit)(c, error);
}

/* Launches go to the side stream while this lives; it begins behind what is on the main one. */
namespace {
struct side_branch {
    struct sadmm_context *c;
    cudaStream_t main;
    cudaError_t code;
    explicit side_branch(struct sadmm_context *context) : c(context), main(context->stream)
    {
        code = cudaEventRecord(c->fork, main);
        if (code == cudaSuccess) code = cudaStreamWaitEvent(c->side, c->fork, 0);
        c->stream = c->side;
    }
    ~side_branch() { c->stream = main; }
    side_branch(const side_branch &) = delete;
    side_branch &operator=(const side_branch &) = delete;
};
} // namespace

/* What the iterating kernels do about energies. With convergence checks an island may have more iterations after them.
 */
static enum cuda_limit limit_by_iterations(const struct sadmm_context *c)
{
    if (!c->plan.limit || c->partition.tier == SADMM_CUDA_TIER_STREAM) return LIMIT_NONE;
    return c->prologue && !stops(c) ? LIMIT_WHOLE : LIMIT_SUSPECTS;
}

/* A and b of the bodies: beside contact finding, of which they need nothing. */
static sadmm_status record_gather(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_TRY(CUDA(launch_start)(c, error));
    side_branch side(c);
    CUDA_CALL(c, side.code, "a branch of the step");
    return CUDA(enqueue_bodies)(c, error);
}

/* Graph statistics and layout; beside them contacts in the solver's form, and what weights take from pairs. */
static sadmm_status record_plan(struct sadmm_context *c, struct sadmm_error *error)
{
    {
        side_branch side(c);
        CUDA_CALL(c, side.code, "a branch of the step");
        CUDA_TRY(CUDA(assemble_contacts)(c, error));
        CUDA_CALL(c, cudaEventRecord(c->join, c->stream), "cudaEventRecord");
    }
    CUDA_TRY(CUDA(enqueue_statistics_and_layout)(c, slots_by_island(&c->partition), &c->partition, error));
    CUDA_CALL(c, cudaStreamWaitEvent(c->stream, c->join, 0), "cudaStreamWaitEvent");
    return SADMM_OK;
}

/* The end of the step, wrenches included; beside it the residuals of the last iteration, where they are wanted. */
static sadmm_status record_finish(struct sadmm_context *c, bool residuals, struct sadmm_error *error)
{
    if (residuals) {
        side_branch side(c);
        CUDA_CALL(c, side.code, "a branch of the step");
        CUDA_TRY(CUDA(enqueue_residuals)(c, error));
        CUDA_CALL(c, cudaEventRecord(c->join, c->stream), "cudaEventRecord");
    }
    CUDA_TRY(CUDA(launch_finish)(c, error));
    if (residuals) CUDA_CALL(c, cudaStreamWaitEvent(c->stream, c->join, 0), "cudaStreamWaitEvent");
    return SADMM_OK;
}

/* *residuals: those of the last iteration are wanted. */
static sadmm_status record_stage(struct sadmm_context *c, const struct sadmm_stage *stage, bool *residuals,
                                 struct sadmm_error *error)
{
    const enum cuda_limit limit = limit_by_iterations(c);
    switch (stage->kind) {
    case SADMM_STAGE_GATHER: return record_gather(c, error);
    case SADMM_STAGE_FIND: return enqueue_find(c, error);
    case SADMM_STAGE_PLAN: return record_plan(c, error);
    case SADMM_STAGE_PENALTY: return CUDA(enqueue_penalties)(c, error);
    case SADMM_STAGE_ITERATE:
        return CUDA(enqueue_iterations)(c, stage->count, stage->measure && (stage->last || !stops(c)),
                                        stage->last || stage->checked ? limit : LIMIT_NONE, error);
    case SADMM_STAGE_RESIDUALS: /* not reported where islands stop by themselves */
        *residuals = stage->last;
        return stage->last || stops(c) ? SADMM_OK : CUDA(enqueue_residuals)(c, error);
    case SADMM_STAGE_CHECK: return CUDA(enqueue_convergence_check)(c, stage->done, error);
    case SADMM_STAGE_REWEIGH: return CUDA(enqueue_weights)(c, true, error);
    case SADMM_STAGE_BALANCE: /* the ratio of (15) is found on the device */
        CUDA_TRY(CUDA(enqueue_balance)(c, error));
        return CUDA(factorize)(c, error);
    case SADMM_STAGE_LIMIT:
        return limit == LIMIT_WHOLE ? SADMM_OK : CUDA(enqueue_limit)(c, limit == LIMIT_SUSPECTS, error);
    case SADMM_STAGE_INTEGRATE: return record_finish(c, *residuals, error);
    case SADMM_STAGE_COMMIT: return CUDA(launch_commit)(c, error);
    case SADMM_STAGE_BODIES:   /* beside FIND */
    case SADMM_STAGE_CONTACTS: /* beside PLAN */
    case SADMM_STAGE_SOLUTION: /* INTEGRATE reads it where it is, */
    case SADMM_STAGE_WRENCHES: /* and adds up wrenches */
    case SADMM_STAGE_CERTIFY:  /* by the host, afterwards */
    case SADMM_STAGE_PREDICT:  /* worlds are not loaded before their first step, */
    case SADMM_STAGE_ROWS:     /* and have none */
    default: return SADMM_OK;
    }
}

static sadmm_status enqueue_step(struct sadmm_context *c, struct sadmm_error *error)
{
    struct sadmm_stages stages = sadmm_stages_of(&c->plan, &c->settings, true);
    struct sadmm_stage stage;
    bool residuals = false;
    c->prologue = c->fast && !c->plan.residuals && c->view.rows.count == 0 && c->view.model.contact_rows == 3 &&
                  CUDA(persistent_does_prologue)(&c->partition);
    while (sadmm_stages_next(&stages, &stage)) CUDA_TRY(record_stage(c, &stage, &residuals, error));
    return SADMM_OK;
}

/* ---- plan ------------------------------------------------------------------------------------------------------ */

static sadmm_status copy_out(struct sadmm_context *c, void *to, const void *from, size_t bytes,
                             struct sadmm_error *error)
{
    if (bytes > 0)
        CUDA_CALL(c, cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, c->stream),
                  "cudaMemcpyAsync from the device");
    return SADMM_OK;
}

static sadmm_status clear_abort(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_CALL(c, cudaMemsetAsync(c->view.model.live, 0, sizeof *c->view.model.live, c->stream),
              "cudaMemsetAsync(live)");
    return SADMM_OK;
}

/* Contacts of the next step and what they are like, seen by the host. */
struct preview {
    struct cuda_live live;
    struct cuda_graph_statistics statistics;
    struct sadmm_cuda_contact_counts counts;
};

static sadmm_status preview_step(struct sadmm_context *c, struct preview *out, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    CUDA_TRY(CUDA(reserve)(c, PINNED_OUT, sizeof *out, error));
    struct preview *staged = buffer<struct preview>(c, PINNED_OUT);
    for (;;) {
        CUDA_TRY(COLLISION(reserve)(s->collision, &s->candidate_capacity, &s->point_capacity, error));
        view_counts(c, s->candidate_capacity);
        CUDA_TRY(CUDA(reserve_layout)(c, error));
        view_into(c, s->into);
        CUDA_TRY(clear_abort(c, error));
        CUDA_TRY(CUDA(launch_start)(c, error));
        CUDA_TRY(enqueue_find(c, error));
        CUDA_TRY(CUDA(enqueue_statistics)(c, true, error));
        CUDA_TRY(copy_out(c, &staged->live, c->view.model.live, sizeof staged->live, error));
        CUDA_TRY(copy_out(c, &staged->statistics, c->view.model.statistics, sizeof staged->statistics, error));
        CUDA_TRY(copy_out(c, &staged->counts, c->view.step.counts, sizeof staged->counts, error));
        CUDA_TRY(CUDA(wait)(c, error));
        *out = *staged;
        if (out->live.abort_code != ABORT_CAPACITY) return SADMM_OK;
        s->candidate_capacity = std::max(s->candidate_capacity, generous(out->counts.candidates));
        /* points are counted only where all candidates had room */
        if (out->counts.candidates <= c->view.step.candidate_capacity)
            s->point_capacity = std::max(s->point_capacity, generous(out->counts.points));
    }
}

static struct sadmm_plan plan_of(const struct sadmm_context *c, const struct preview *seen)
{
    const struct cuda_step *s = c->step;
    struct sadmm_plan plan = {};
    plan.bodies = s->bodies;
    plan.pairs = seen->live.pairs;
    plan.points = seen->live.points;
    plan.contact_rows = plan.points == 0 ? 0 : seen->statistics.rough > 0 ? 3 : 1;
    plan.rigid = true;
    plan.gyroscopic = c->plan.gyroscopic; /* since load */
    plan.threads = 1;
    sadmm_plan_settle(&plan, &c->settings, plan.pairs > 0 && 2 * (int64_t)seen->statistics.warm >= plan.pairs);
    return plan;
}

/* The layout once, for what its parts are really like. */
static sadmm_status tighten(struct sadmm_context *c, const struct preview *seen, struct sadmm_error *error)
{
    if (c->partition.tier == SADMM_CUDA_TIER_STREAM) return SADMM_OK;
    struct preview *staged = buffer<struct preview>(c, PINNED_OUT);
    staged->live = seen->live;
    CUDA_CALL(
        c, cudaMemcpyAsync(c->view.model.live, &staged->live, sizeof staged->live, cudaMemcpyHostToDevice, c->stream),
        "cudaMemcpyAsync to the device");
    CUDA_TRY(CUDA(enqueue_statistics_and_layout)(c, true, &c->partition, error));
    CUDA_TRY(copy_out(c, &staged->live, c->view.model.live, sizeof staged->live, error));
    CUDA_TRY(copy_out(c, &staged->statistics, c->view.model.statistics, sizeof staged->statistics, error));
    CUDA_TRY(CUDA(wait)(c, error));
    struct cuda_graph_statistics statistics = staged->statistics;
    statistics.point_slots = c->statistics.point_slots;
    if (staged->live.abort_code == ABORT_NONE) CUDA(tighten_partition)(c, &statistics, &c->partition);
    return clear_abort(c, error);
}

static sadmm_status make_plan(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    struct preview seen;
    CUDA_TRY(preview_step(c, &seen, error));
    c->plan = plan_of(c, &seen);
    s->guess.contact_rows = c->plan.contact_rows;
    s->guess.point_slots = seen.statistics.point_slots <= 1   ? 1
                           : seen.statistics.point_slots <= 4 ? 4
                                                              : SADMM_MAX_POINTS;
    s->guess.warm = sadmm_plan_depends_on_warmth(&c->settings) ? c->plan.warm : -1;
    view_counts(c, generous(seen.counts.pairs));
    c->view.model.points = 0; /* results are read elsewhere */
    seen.statistics.point_slots = s->guess.point_slots;
    c->statistics = seen.statistics;
    CUDA_TRY(CUDA(choose_partition)(c, &seen.statistics, &c->partition, error));
    CUDA_TRY(CUDA(reserve_layout)(c, error));
    CUDA_TRY(tighten(c, &seen, error));
    CUDA_TRY(CUDA(reserve_solver)(c, error));
    CUDA_TRY(CUDA(reserve)(c, BUFFER_WORLD_IMPULSE, 3 * (size_t)s->point_capacity * sizeof(double), error));
    s->planned = true;
    s->recorded = false;
    return SADMM_OK;
}

/* ---- graphs ---------------------------------------------------------------------------------------------------- */

static sadmm_status record_graph(struct sadmm_context *c, int into, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    cudaGraph_t graph = nullptr;
    const int next = s->into;
    CUDA_CALL(c, cudaStreamBeginCapture(c->stream, cudaStreamCaptureModeThreadLocal), "cudaStreamBeginCapture");
    s->into = into;
    view_into(c, into);
    c->recording = true;
    sadmm_status status = enqueue_step(c, error);
    c->recording = false;
    s->into = next;
    cudaError_t code = cudaStreamEndCapture(c->stream, &graph);
    if (status == SADMM_OK && code != cudaSuccess) status = CUDA(fail)(c, code, "cudaStreamEndCapture", error);
    /* Instantiated again: plans change rarely, and then the graph's shape changes with them. */
    if (s->graphs[into]) (void)cudaGraphExecDestroy(s->graphs[into]);
    s->graphs[into] = nullptr;
    if (status == SADMM_OK) {
        code = cudaGraphInstantiate(&s->graphs[into], graph, 0);
        if (code != cudaSuccess) {
            s->graphs[into] = nullptr;
            status = CUDA(fail)(c, code, "cudaGraphInstantiate", error);
        }
    }
    if (graph) (void)cudaGraphDestroy(graph);
    return status;
}

/* Clear the abort code, plan if need be, record if need be. Nothing is running. */
static sadmm_status prepare(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    if (!s->planned) CUDA_TRY(make_plan(c, error));
    if (s->recorded) return SADMM_OK;
    for (int into = 0; into < 2; ++into) CUDA_TRY(record_graph(c, into, error));
    s->recorded = true;
    return SADMM_OK;
}

/* ---- the queue ------------------------------------------------------------------------------------------------- */

static struct queued_step *slot_of(struct cuda_step *s, int64_t sequence) { return &s->queue[sequence % STEPS_AHEAD]; }

static sadmm_status launch_edits_of(struct sadmm_context *c, int64_t sequence, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const struct queued_step *q = slot_of(s, sequence);
    view_into(c, s->into);
    return CUDA(launch_edits)(c, q->edits, q->edit_count, error);
}

static sadmm_status launch_step(struct sadmm_context *c, int64_t sequence, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    c->kernel = "a step's graph";
    CUDA_CALL(c, cudaGraphLaunch(s->graphs[s->into], c->stream), "cudaGraphLaunch");
    CUDA_CALL(c, cudaEventRecord(slot_of(s, sequence)->done, c->stream), "cudaEventRecord");
    s->into = 1 - s->into;
    return SADMM_OK;
}

/* Forget the steps from `first` to `end`, which have not been done, and their edits: the caller gives these again. */
static void drop_steps(struct sadmm_context *c, int64_t first, int64_t end)
{
    for (int64_t sequence = first; sequence < end; ++sequence) slot_of(c->step, sequence)->edit_count = 0;
    memset(c->numbers, 0, sizeof c->numbers);
}

/* Repeat the steps from `first` to `end`. */
static sadmm_status repeat_steps(struct sadmm_context *c, int64_t first, int64_t end, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    for (int64_t sequence = first; sequence < end; ++sequence) {
        sadmm_status status = launch_edits_of(c, sequence, error);
        if (status == SADMM_OK) status = prepare(c, error);
        if (status == SADMM_OK) status = launch_step(c, sequence, error);
        if (status != SADMM_OK) { /* no memory: this step and those behind it are lost */
            drop_steps(c, sequence, end);
            return status;
        }
        s->enqueued = sequence + 1;
    }
    return SADMM_OK;
}

/* The step `first` of the queue has failed, and nothing behind it has been done. */
static sadmm_status recover(struct sadmm_context *c, int64_t first, const struct cuda_step_report *report,
                            struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const int64_t end = s->enqueued;
    CUDA_TRY(CUDA(wait)(c, error));
    /* The device has numbered the steps that did not run; they are numbered again. */
    s->into = (end - first) % 2 ? 1 - s->into : s->into;
    s->seen = s->enqueued = first;
    CUDA_CALL(c, cudaMemcpyAsync(&c->view.step.control->sequence, &s->enqueued, sizeof s->enqueued,
                                 cudaMemcpyHostToDevice, c->stream),
              "cudaMemcpyAsync to the device");
    CUDA_TRY(clear_abort(c, error));
    CUDA_TRY(CUDA(wait)(c, error));
    if (report->abort_code == ABORT_NON_FINITE) {
        s->offending_body =
            report->offending_body >= s->bodies ? report->offending_body - s->bodies : report->offending_body;
        drop_steps(c, first, end);
        return sadmm_fail(error, SADMM_ERROR_NON_FINITE, "the solve gave a velocity or multiplier that is not finite");
    }
    ++s->repeats;
    s->planned = false;
    if (report->abort_code == ABORT_CAPACITY)
        s->candidate_capacity = std::max(s->candidate_capacity, generous(report->counts.candidates));
    if (report->abort_code == ABORT_PARTITION) {
        /* The next partition is made for this very step, and fits; a tier that fails twice is left alone all the same. */
        if (s->misfit == first) c->refused |= 1u << c->partition.tier;
        s->misfit = first;
    }
    return repeat_steps(c, first, end, error);
}

/* Wait for the oldest step of the queue and read its report. */
static sadmm_status see_step(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    cudaError_t code = cudaEventSynchronize(slot_of(s, s->seen)->done);
    if (code != cudaSuccess) CUDA_TRY(CUDA(wait)(c, error)); /* says what failed */
    const struct cuda_step_report report = reports(c)[s->seen % STEPS_AHEAD]; /* a copy: recover() reuses the place */
    if (report.abort_code != ABORT_NONE) return recover(c, s->seen, &report, error);
    s->last = report;
    struct queued_step *q = slot_of(s, s->seen);
    q->edit_count = 0;
    s->last_settings = q->settings;
    s->time += q->settings.dt;
    ++s->seen;
    ++s->done;
    /* A plan with far too much room wastes launches. */
    if (report.counts.pairs < c->view.contacts.pair_capacity / 4 - 256) s->planned = false;
    return SADMM_OK;
}

static sadmm_status see_all(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    while (s->seen < s->enqueued) CUDA_TRY(see_step(c, error));
    return SADMM_OK;
}

/* ---- entries: load and unload ---------------------------------------------------------------------------------- */

void CUDA(step_destroy)(struct sadmm_context *c)
{
    struct cuda_step *s = c->step;
    if (!s) return;
    for (struct queued_step &q : s->queue) {
        if (q.done) (void)cudaEventDestroy(q.done);
        if (q.edits) (void)cudaFreeHost(q.edits);
    }
    for (cudaGraphExec_t graph : s->graphs)
        if (graph) (void)cudaGraphExecDestroy(graph);
    COLLISION(destroy)(s->collision);
    sadmm_free(s);
    c->step = nullptr;
}

static sadmm_status step_create(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = (struct cuda_step *)sadmm_alloc(1, sizeof *s);
    if (!s) return sadmm_fail_memory(error, "the cuda backend's world");
    c->step = s;
    CUDA_TRY(COLLISION(create)(c->device, &s->collision, error));
    for (struct queued_step &q : s->queue)
        CUDA_CALL(c, cudaEventCreateWithFlags(&q.done, cudaEventDisableTiming), "cudaEventCreate");
    return SADMM_OK;
}

/* Through pinned memory that is free again when this returns. */
static sadmm_status put(struct sadmm_context *c, enum cuda_buffer_name name, const void *from, size_t bytes,
                        struct sadmm_error *error)
{
    CUDA_TRY(CUDA(reserve)(c, PINNED_BODIES, bytes, error));
    CUDA_TRY(CUDA(upload)(c, c->buffers[name].data, PINNED_BODIES, 0, from, bytes, error));
    return CUDA(wait)(c, error);
}

extern "C" sadmm_status CUDA(load_world)(struct sadmm_context *c, const struct sadmm_resident_world *world,
                                         const struct sadmm_settings *settings, struct sadmm_error *error)
{
    const size_t n = (size_t)world->body_count, slots = world->input->body_count;
    if (n > (size_t)INT32_MAX / 64)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%d bodies: at most %d", world->body_count, INT32_MAX / 64);
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(wait)(c, error));
    if (!c->step) {
        sadmm_status status = step_create(c, error);
        if (status != SADMM_OK) {
            CUDA(step_destroy)(c);
            return status;
        }
    }
    struct cuda_step *s = c->step;
    s->bodies = (int32_t)n;
    s->slots = (int32_t)slots;
    s->last_settings = *settings;
    s->time = world->time;
    s->planned = s->recorded = false;
    s->enqueued = s->seen = s->done = s->repeats = 0;
    s->offending_body = -1;
    for (struct queued_step &q : s->queue) q.edit_count = 0;
    memset(&s->last, 0, sizeof s->last);
    CUDA_TRY(CUDA(use_settings)(c, settings, error));
    CUDA_TRY(CUDA(reserve)(c, BUFFER_WORLD_BODIES, 2 * n * sizeof *world->rigid, error));
    CUDA_TRY(CUDA(reserve)(c, BUFFER_WORLD_STEADY, 2 * n * sizeof *world->steady, error));
    CUDA_TRY(CUDA(reserve)(c, BUFFER_WORLD_WRENCH, 12 * n * sizeof(double), error));
    CUDA_TRY(CUDA(reserve)(c, BUFFER_WORLD_VELOCITY, 6 * n * sizeof(double), error));
    CUDA_TRY(CUDA(reserve)(c, BUFFER_WORLD_SLOTS, n * sizeof *world->slot_of, error));
    CUDA_TRY(CUDA(reserve)(c, BUFFER_WORLD_PLACES, slots * sizeof(struct sadmm_collision_body), error));
    CUDA_TRY(CUDA(reserve)(c, BUFFER_WORLD_CONTROL, sizeof(struct cuda_step_control), error));
    CUDA_TRY(CUDA(reserve)(c, PINNED_REPORTS, STEPS_AHEAD * sizeof(struct cuda_step_report), error));
    CUDA_CALL(c, cudaMemsetAsync(buffer<void>(c, BUFFER_WORLD_CONTROL), 0, sizeof(struct cuda_step_control), c->stream),
              "cudaMemsetAsync(control)");

    c->plan.gyroscopic = sadmm_plan_is_gyroscopic(world->rigid, world->body_count);
    /* The state before the first step is the one that is not written by it. */
    CUDA_TRY(COLLISION(upload)(s->collision, c->stream, world->contacts, error));
    s->into = 1 - COLLISION(current)(s->collision);
    const size_t before = (size_t)(1 - s->into);
    CUDA_TRY(put(c, BUFFER_WORLD_SLOTS, world->slot_of, n * sizeof *world->slot_of, error));
    CUDA_TRY(put(c, BUFFER_WORLD_PLACES, world->input->bodies, slots * sizeof *world->input->bodies, error));
    CUDA_TRY(CUDA(reserve)(c, PINNED_BODIES, n * sizeof *world->rigid, error));
    CUDA_TRY(CUDA(upload)(c, buffer<struct sadmm_rigid>(c, BUFFER_WORLD_BODIES) + before * n, PINNED_BODIES, 0,
                          world->rigid, n * sizeof *world->rigid, error));
    CUDA_TRY(CUDA(wait)(c, error));
    CUDA_TRY(CUDA(upload)(c, buffer<struct sadmm_steady>(c, BUFFER_WORLD_STEADY) + before * n, PINNED_BODIES, 0,
                          world->steady, n * sizeof *world->steady, error));
    CUDA_TRY(CUDA(wait)(c, error));
    view_counts(c, 0);
    CUDA_TRY(CUDA(reserve_layout)(c, error)); /* live is needed from here on */
    CUDA_TRY(clear_abort(c, error));
    s->candidate_capacity = s->point_capacity = c->first_capacity;
    c->refused = 0;
    s->misfit = -1;
    const struct cuda_settings *kept = buffer<struct cuda_settings>(c, BUFFER_SETTINGS);
    CUDA_TRY(COLLISION(attach)(s->collision, c->stream, world->input,
                               buffer<struct sadmm_collision_body>(c, BUFFER_WORLD_PLACES),
                               &c->view.model.live->abort_code, &kept->settings.dt, &kept->gravity, error));
    view_into(c, s->into);
    return CUDA(wait)(c, error);
}

/* ---- entries: steps -------------------------------------------------------------------------------------------- */

/* Make the queue's next place free. */
static sadmm_status next_place(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    while (s->enqueued - s->seen >= STEPS_AHEAD) CUDA_TRY(see_step(c, error));
    return SADMM_OK;
}

/* The edits of a step, and the settings' numbers where the device has others, into its place in the queue. */
static sadmm_status take_edits(struct sadmm_context *c, struct queued_step *q, const struct sadmm_settings *settings,
                               const struct sadmm_resident_edit *edits, size_t count, struct sadmm_error *error)
{
    struct sadmm_resident_edit numbers = {SADMM_EDIT_SETTINGS, 0, {}};
    sadmm_settings_numbers(settings, numbers.values);
    const bool other = memcmp(numbers.values, c->numbers, sizeof c->numbers) != 0;
    const size_t total = count + other;
    if (total > q->edit_capacity) {
        const size_t capacity = std::max(2 * q->edit_capacity, total);
        if (sadmm_test_allocation_fails())
            return CUDA(fail)(c, cudaErrorMemoryAllocation, "allocation of changes of bodies", error);
        if (q->edits) (void)cudaFreeHost(q->edits);
        q->edits = nullptr;
        q->edit_capacity = 0;
        CUDA_CALL(c, cudaMallocHost((void **)&q->edits, capacity * sizeof *q->edits), "allocation of changes of bodies");
        q->edit_capacity = capacity;
    }
    if (count > 0) memcpy(q->edits, edits, count * sizeof *edits);
    if (other) q->edits[count] = numbers;
    memcpy(c->numbers, numbers.values, sizeof c->numbers);
    q->settings = *settings;
    q->edit_count = total;
    return SADMM_OK;
}

static sadmm_status enqueue_next(struct sadmm_context *c, struct queued_step *q, const struct sadmm_settings *settings,
                                 const struct sadmm_resident_edit *edits, size_t count, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    CUDA_TRY(take_edits(c, q, settings, edits, count, error));
    CUDA_TRY(launch_edits_of(c, s->enqueued, error));
    CUDA_TRY(prepare(c, error));
    return launch_step(c, s->enqueued, error);
}

extern "C" sadmm_status CUDA(step_world)(struct sadmm_context *c, const struct sadmm_settings *settings,
                                         const struct sadmm_resident_edit *edits, size_t count,
                                         struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    CUDA_ENTER(c);
    CUDA_TRY(next_place(c, error));
    if (!sadmm_settings_same_but_numbers(&c->settings, settings)) {
        CUDA_TRY(see_all(c, error));
        s->planned = false;
    }
    if (!s->planned) CUDA_TRY(see_all(c, error));
    CUDA(plan_settings)(c, settings);
    struct queued_step *q = slot_of(s, s->enqueued);
    sadmm_status status = enqueue_next(c, q, settings, edits, count, error);
    if (status != SADMM_OK) {
        drop_steps(c, s->enqueued, s->enqueued + 1);
        return status;
    }
    ++s->enqueued;
    return SADMM_OK;
}

static double milliseconds(const struct cuda_step_report *report, enum step_stamp from, enum step_stamp to)
{
    return 1e-6 * (double)(report->stamps[to] - report->stamps[from]);
}

extern "C" sadmm_status CUDA(wait_world)(struct sadmm_context *c, struct sadmm_resident_report *out,
                                         struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    CUDA_ENTER(c);
    sadmm_status status = see_all(c, error);
    /* Where some steps could not be repeated the ones before them still run. */
    while (status != SADMM_OK && status != SADMM_ERROR_DEVICE && s->seen < s->enqueued) {
        struct sadmm_error later;
        if (see_step(c, &later) != SADMM_ERROR_DEVICE) continue;
        *error = later;
        status = SADMM_ERROR_DEVICE;
    }
    const struct cuda_step_report *last = &s->last;
    const struct sadmm_settings *settings = &s->last_settings;
    COLLISION(settle)(s->collision, 1 - s->into, last->counts);
    out->done = s->done;
    out->time = s->time;
    out->settings = *settings;
    out->repeats = s->repeats;
    out->offending_body = s->offending_body;
    out->plan = c->plan;
    out->plan.pairs = last->counts.pairs;
    out->plan.points = last->counts.points;
    out->iterations = last->counts.points > 0 ? settings->iterations : 1;
    out->iterations_mean = out->iterations;
    out->islands_above = last->unmet;
    out->converged = last->unmet == 0;
    if (out->converged) out->iterations = last->most_iterations;
    if (last->unmet >= 0 && last->statistics.islands > 0)
        out->iterations_mean = ((double)last->sum_of_iterations + (double)last->unmet * settings->iterations) /
                               last->statistics.islands;
    out->limited = last->limited;
    out->penetration_max = last->depth;
    out->residual.primal = last->primal;
    out->residual.dual = last->dual;
    out->ms.collide = milliseconds(last, STAMP_START, STAMP_FOUND);
    out->ms.assemble = milliseconds(last, STAMP_FOUND, STAMP_ASSEMBLED);
    out->ms.solve = milliseconds(last, STAMP_ASSEMBLED, STAMP_SOLVED);
    out->ms.finish = milliseconds(last, STAMP_SOLVED, STAMP_END);
    out->ms.total = milliseconds(last, STAMP_START, STAMP_END);
    return status;
}

/* ---- entries: reads -------------------------------------------------------------------------------------------- */

/* In pieces, through pinned memory of that size. */
static sadmm_status get(struct sadmm_context *c, void *to, const void *from, size_t bytes, struct sadmm_error *error)
{
    enum { PIECE = 16 << 20 };
    if (!to) return SADMM_OK;
    CUDA_TRY(CUDA(reserve)(c, PINNED_OUT, std::min(bytes, (size_t)PIECE), error));
    for (size_t at = 0; at < bytes; at += PIECE) {
        const size_t piece = std::min(bytes - at, (size_t)PIECE);
        CUDA_TRY(CUDA(download)(c, (const char *)from + at, piece, error));
        memcpy((char *)to + at, c->buffers[PINNED_OUT].data, piece);
    }
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(read_bodies)(struct sadmm_context *c, struct sadmm_rigid *rigid,
                                          struct sadmm_steady *steady, double *wrench, struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    const size_t n = (size_t)s->bodies;
    CUDA_ENTER(c);
    view_into(c, s->into);
    CUDA_TRY(get(c, rigid, c->view.step.before, n * sizeof *rigid, error));
    CUDA_TRY(get(c, steady, c->view.step.steady_before, n * sizeof *steady, error));
    return get(c, wrench, buffer<double>(c, BUFFER_WORLD_WRENCH) + (size_t)(1 - s->into) * 6 * n, 6 * n * sizeof *wrench,
               error);
}

extern "C" sadmm_status CUDA(read_contacts)(struct sadmm_context *c, struct sadmm_contact_set *contacts,
                                            struct sadmm_error *error)
{
    return COLLISION(download)(c->step->collision, c->stream, contacts, error);
}

extern "C" sadmm_status CUDA(read_start)(struct sadmm_context *c, struct sadmm_rigid *rigid, double *velocity,
                                         double *impulse, struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    const size_t n = (size_t)s->bodies, points = (size_t)s->last.counts.points;
    CUDA_ENTER(c);
    view_into(c, 1 - s->into); /* of the last step */
    CUDA_TRY(get(c, rigid, c->view.step.before, n * sizeof *rigid, error));
    CUDA_TRY(get(c, velocity, c->view.step.start_velocity, 6 * n * sizeof *velocity, error));
    return get(c, impulse, c->view.step.start_impulse, 3 * points * sizeof *impulse, error);
}
