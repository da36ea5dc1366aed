/* Whole steps on the device: steps are enqueued, their reports seen, and those repeated whose plan did not hold
 * (step/world.h). */
#include <string.h>

#include <algorithm>
#include <atomic>

#include "core/base/memory.h"
#include "world.h"

/* ---- running --------------------------------------------------------------------------------------------------- */

static struct queued_step *slot_of(struct cuda_step *s, int64_t sequence) { return &s->queue[sequence % STEPS_AHEAD]; }

/* Plan and record, if need be, once nothing is running. What a step is like is seen with its updates made. */
static sadmm_status prepare(struct sadmm_context *c, bool with_updates, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    struct step_graphs *graphs = &s->graphs[with_updates];
    if (s->planned && graphs->recorded) return SADMM_OK;
    TRY(CUDA(wait)(c, error)); /* reports are seen before the last blocks of a step have ended */
    if (!s->planned) TRY(CUDA(speculate)(c, error));
    if (graphs->recorded) return SADMM_OK;
    for (int into = 0; into < 2; ++into) TRY(CUDA(record_step)(c, with_updates, into, error));
    graphs->recorded = true;
    return SADMM_OK;
}

/* Updates are launched before the step, by themselves; once they are seen to come again and again they are in graphs of
 * their own, which takes less, but is recorded once more. */
enum { FEW_UPDATED = 16 };

static sadmm_status launch_step(struct sadmm_context *c, int64_t sequence, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const bool updates = slot_of(s, sequence)->update_count > 0;
    s->updated_steps += updates;
    const bool with_updates = updates && s->planned && s->updated_steps > FEW_UPDATED;
    if (updates && !with_updates) {
        CUDA(view_into)(c, s->into, 0);
        TRY(CUDA(launch_updates)(c, error));
    }
    TRY(prepare(c, with_updates, error));
    slot_of(s, sequence)->hits = takes_hits(c);
    c->kernel = "a step's graph";
    ((volatile struct cuda_step_report *)&step_reports(c)[sequence % STEPS_AHEAD])->ready = 0;
    CUDA_CALL(c, cudaGraphLaunch(s->graphs[with_updates].into[s->into], c->stream), "cudaGraphLaunch");
    CUDA_CALL(c, cudaEventRecord(slot_of(s, sequence)->done, c->stream), "cudaEventRecord");
    s->into = 1 - s->into;
    return SADMM_OK;
}

/* ---- seeing and repeating -------------------------------------------------------------------------------------- */

/* Forget the steps from `first` to `end`, which have not been done, and their updates: the caller gives these again. */
static void drop_steps(struct sadmm_context *c, int64_t first, int64_t end)
{
    for (int64_t sequence = first; sequence < end; ++sequence) slot_of(c->step, sequence)->update_count = 0;
    memset(c->numbers, 0, sizeof c->numbers);
}

/* Repeat the steps from `first` to `end`. */
static sadmm_status repeat_steps(struct sadmm_context *c, int64_t first, int64_t end, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    for (int64_t sequence = first; sequence < end; ++sequence) {
        const sadmm_status status = launch_step(c, sequence, error);
        if (status != SADMM_OK) { /* no memory: this step and those behind it are lost */
            drop_steps(c, sequence, end);
            return status;
        }
        s->enqueued = sequence + 1;
    }
    return SADMM_OK;
}

/* Steps that search for candidates in every sub-step, once shapes have left their reach. */
enum { CONSERVATIVE_STEPS = 64 };

/* A later sub-step of the step `first` was not as planned: the next plan is made for it, too. Those behind it are taken
 * to be like it. */
static void learn(struct sadmm_context *c, int64_t first, const struct cuda_step_report *report)
{
    struct cuda_step *s = c->step;
    struct learned *learned = &s->learned;
    const struct cuda_graph_statistics none = {};
    if (learned->step != first) {
        learned->step = first;
        learned->substep = 0;
        learned->pairs = 0;
        learned->statistics = none;
    }
    learned->pairs = std::max(learned->pairs, (int64_t)report->counts.pairs);
    if (report->abort_code == ABORT_CAPACITY) {
        if (report->counts.candidates <= s->candidate_capacity)
            s->point_capacity = std::max(s->point_capacity, generous(report->counts.points));
        return; /* there are no statistics of it */
    }
    CUDA(merge_statistics)(&learned->statistics, &report->statistics);
    s->plans[report->substep] = CUDA(plan_of)(c, report->counts.pairs, report->counts.points, &report->statistics,
                                         &report->joints);
    learned->substep = std::max(learned->substep, report->substep);
}

/* A step was done. Where articulations were left alone for a while it is planned that they are; the longer that takes
 * the more often they were not, since a plan costs what many steps do. The outcome is the same to the last bit: that of
 * the block direct solve, whatever the iterations. */
static void see_articulations(struct sadmm_context *c, const struct cuda_step_report *report)
{
    struct cuda_step *s = c->step;
    if (s->apart) return;
    s->untouched = CUDA(may_be_apart)(c) && !report->joints.together ? s->untouched + 1 : 0;
    if (s->untouched >= s->backoff) s->planned = false;
}

/* A step was done that was planned to have pushes. */
static void see_pushes(struct sadmm_context *c, const struct cuda_step_report *report)
{
    struct cuda_step *s = c->step;
    if (!s->pushes) return;
    s->quiet = report->totals.pushed > 0 ? 0 : s->quiet + 1;
    if (s->quiet < QUIET_STEPS) return;
    s->pushes = s->planned = false;
}

/* A step was done that was planned to have islands that are not solved before the iterations. It is planned that there
 * are none when there has been none for a while, the longer the more often that was wrong. */
static void see_unsolved(struct sadmm_context *c, const struct cuda_step_report *report)
{
    struct cuda_step *s = c->step;
    if (!s->unsolved) return;
    s->solved = report->totals.unsolved > 0 ? 0 : s->solved + 1;
    if (s->solved < s->solved_backoff) return;
    s->unsolved = s->planned = false;
}

/* A step was done that was planned to have islands that start cold. */
static void see_cold(struct sadmm_context *c, const struct cuda_step_report *report)
{
    struct cuda_step *s = c->step;
    if (!s->cold || !c->settings.warm_start) return; /* or they always do */
    s->warm = report->totals.cold > 0 ? 0 : s->warm + 1;
    if (s->warm < WARM_STEPS) return;
    s->cold = s->planned = false;
}

/* A step was done. */
static void see_hits(struct sadmm_context *c, const struct cuda_step_report *report)
{
    struct cuda_step *s = c->step;
    if (!s->hits_planned) return;
    s->calm = report->counts.fast ? 0 : s->calm + 1;
    if (s->calm < CALM_STEPS) return;
    s->hits_planned = s->planned = false;
}

/* The step `first` of the queue has failed, and nothing behind it has been done. */
static sadmm_status recover(struct sadmm_context *c, int64_t first, const struct cuda_step_report *report,
                            struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const int64_t end = s->enqueued;
    TRY(CUDA(wait)(c, error));
    /* The device has numbered the steps that did not run; they are numbered again. */
    s->into = (end - first) % 2 ? 1 - s->into : s->into;
    s->seen = s->enqueued = first;
    CUDA_CALL(c,
              cudaMemcpyAsync(&c->view.step.control->sequence, &s->enqueued, sizeof s->enqueued, cudaMemcpyHostToDevice,
                              c->stream),
              "cudaMemcpyAsync to the device");
    TRY(CUDA(clear_abort)(c, error));
    TRY(CUDA(wait)(c, error));
    if (report->abort_code == ABORT_NON_FINITE) {
        s->offending_body = report->offending_body < 0 ? sadmm_kinematic(report->offending_body - INT32_MIN)
                                                       : report->offending_body % s->bodies; /* by its state, a
                                                                                                contact, or a joint */
        drop_steps(c, first, end);
        return sadmm_fail(error, SADMM_ERROR_NON_FINITE, "the solve gave a velocity or multiplier that is not finite");
    }
    ++s->repeats;
    s->planned = false;
    const bool together = s->apart && report->abort_code == ABORT_PLAN && report->joints.together;
    if (together) {
        s->untouched = 0;
        s->mispredicted = -1; /* another partition */
        s->backoff = std::min(2 * s->backoff, (int32_t)MOST_BACKOFF);
    }
    if (report->abort_code == ABORT_CAPACITY)
        s->candidate_capacity = std::max(s->candidate_capacity, generous(report->counts.candidates));
    if (report->abort_code == ABORT_PARTITION) {
        /* The next partition is made for this very step, and fits; a tier that fails twice is left alone all the
         * same. Sub-steps that no plan was made for yet do not count. */
        const bool known = report->substep == 0 || (s->learned.step == first && report->substep <= s->learned.substep);
        if (s->mispredicted == first && known) c->refused |= 1u << c->partition.tier;
        s->mispredicted = first;
    }
    if (report->abort_code == ABORT_PLAN && report->totals.pushed != 0) {
        s->pushes = true;
        s->push_streams = s->push_streams || report->totals.pushed < 0;
        s->quiet = 0;
    }
    if (report->abort_code == ABORT_PLAN && report->totals.unsolved > 0 && !s->unsolved) {
        s->unsolved = true;
        s->solved = 0;
        s->solved_backoff = std::min(2 * s->solved_backoff, (int32_t)MOST_BACKOFF);
    }
    if (report->totals.cold > 0 && updates_weights(c)) {
        s->cold = true;
        s->warm = 0;
    }
    if (report->abort_code == ABORT_HITS) CUDA(plan_hits)(c);
    else if (report->abort_code == ABORT_REACH) s->conservative = CONSERVATIVE_STEPS;
    else if (together) s->learned.step = -1; /* nothing is known of it with its rows */
    else if (report->substep > 0) learn(c, first, report);
    return repeat_steps(c, first, end, error);
}

/* Until a step's report is there: a few us before the driver knows of the step's end. That is asked for first, and now
 * and then: a step that has failed makes no report. */
static cudaError_t wait_for_report(const struct sadmm_context *c, int64_t sequence)
{
    enum { POLLS = 1 << 14 }; /* some 10 us between queries, each of which takes longer than many polls */
    const volatile int64_t *ready = &step_reports(c)[sequence % STEPS_AHEAD].ready;
    for (int poll = 0; poll % POLLS == 0 || *ready != sequence + 1; ++poll) {
        if (poll % POLLS > 0) continue;
        const cudaError_t code = cudaEventQuery(slot_of(c->step, sequence)->done);
        if (code != cudaErrorNotReady) return code;
    }
    std::atomic_thread_fence(std::memory_order_acquire);
    return cudaSuccess;
}

/* Wait for the oldest step of the queue and read its report. */
static sadmm_status see_step(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const cudaError_t code = wait_for_report(c, s->seen);
    if (code != cudaSuccess) TRY(CUDA(wait)(c, error)); /* says what failed */
    /* A copy: recover() reuses the place. */
    const struct cuda_step_report report = step_reports(c)[s->seen % STEPS_AHEAD];
    if (report.abort_code != ABORT_NONE) return recover(c, s->seen, &report, error);
    s->last = report;
    s->now = report.counts;
    struct queued_step *q = slot_of(s, s->seen);
    q->update_count = 0;
    s->last_settings = q->settings;
    s->last_hits = q->hits;
    s->time += q->settings.dt;
    ++s->seen;
    ++s->done;
    if (s->conservative > 0 && --s->conservative == 0) s->planned = false;
    see_articulations(c, &report);
    see_pushes(c, &report);
    see_unsolved(c, &report);
    see_cold(c, &report);
    see_hits(c, &report);
    /* A plan with far too large capacities wastes launches. */
    if (report.counts.pairs < c->view.contacts.pair_capacity / 4 - 256) s->planned = false;
    return SADMM_OK;
}

static sadmm_status see_all(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    while (s->seen < s->enqueued) TRY(see_step(c, error));
    return SADMM_OK;
}

/* ---- entries --------------------------------------------------------------------------------------------------- */

/* Make the queue's next place free. */
static sadmm_status next_place(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    while (s->enqueued - s->seen >= STEPS_AHEAD) TRY(see_step(c, error));
    return SADMM_OK;
}

/* Room for so many updates a step. Nothing is enqueued. */
static sadmm_status reserve_updates(struct sadmm_context *c, size_t count, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const size_t capacity = sadmm_grown_capacity((size_t)s->update_capacity, count, 64);
    if (capacity > INT32_MAX)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%zu changes in a step: too many, at most %d", count, INT32_MAX);
    s->update_capacity = 0; /* if there is no memory */
    TRY(CUDA(reserve)(c, PINNED_UPDATES,
                      STEPS_AHEAD * (sizeof(struct cuda_updates) + capacity * sizeof(struct sadmm_resident_update)),
                      error));
    s->update_capacity = (int32_t)capacity;
    s->graphs[true].recorded = false; /* they know where updates are */
    return SADMM_OK;
}

/* The updates of a step, and the settings' numbers where the device has others, into its place in the queue, which has
 * room for them. */
static void take_updates(struct sadmm_context *c, int64_t sequence, const struct sadmm_settings *settings,
                         const struct sadmm_resident_update *updates, size_t count)
{
    struct queued_step *q = slot_of(c->step, sequence);
    struct sadmm_resident_update numbers = {SADMM_UPDATE_SETTINGS, 0, {}};
    const struct sadmm_settings share = sadmm_settings_of_substep(settings);
    sadmm_settings_numbers(&share, numbers.values);
    const bool other = memcmp(numbers.values, c->numbers, sizeof c->numbers) != 0;
    struct cuda_updates *to = const_cast<struct cuda_updates *>(
        updates_of_step(buffer<struct cuda_updates>(c, PINNED_UPDATES), c->step->update_capacity, sequence));
    struct sadmm_resident_update *at = const_cast<struct sadmm_resident_update *>(first_update(to));
    if (count > 0) memcpy(at, updates, count * sizeof *updates);
    if (other) at[count] = numbers;
    q->update_count = count + other;
    to->count = (int64_t)q->update_count;
    memcpy(c->numbers, numbers.values, sizeof c->numbers);
    q->settings = *settings;
}

extern "C" sadmm_status CUDA(step_world)(struct sadmm_context *c, const struct sadmm_settings *settings,
                                         const struct sadmm_resident_update *updates, size_t count,
                                         struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const struct sadmm_settings share = sadmm_settings_of_substep(settings);
    CUDA_ENTER(c);
    TRY(next_place(c, error));
    if (count >= (size_t)s->update_capacity) { /* settings may be one more */
        TRY(see_all(c, error));
        TRY(reserve_updates(c, count + 1, error));
    }
    if (!sadmm_settings_same_but_numbers(&c->settings, &share)) {
        TRY(see_all(c, error));
        s->planned = false;
    }
    if (!s->planned) TRY(see_all(c, error));
    CUDA(plan_settings)(c, &share); /* kernels know sub-steps alone */
    take_updates(c, s->enqueued, settings, updates, count);
    const sadmm_status status = launch_step(c, s->enqueued, error);
    if (status != SADMM_OK) {
        drop_steps(c, s->enqueued, s->enqueued + 1);
        return status;
    }
    ++s->enqueued;
    return SADMM_OK;
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
    COLLISION(set_current)(s->collision, 1 - s->into, s->now);
    CUDA(report_step)(c, out);
    return status;
}
