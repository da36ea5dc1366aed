#include "motion_study.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench.h"
#include "cli/interrupt.h"
#include "core/base/memory.h"

enum { START_HALVINGS = 3, MOST_POINTS = 20 };

static bool is_heap(const struct motion_plan *plan) { return plan->scene.info->chaotic; }

int motion_study_points(const struct motion_plan *plan)
{
    return is_heap(plan) ? 1 : plan->frames < MOST_POINTS ? plan->frames : MOST_POINTS;
}

/* ---- rows ------------------------------------------------------------------------------------------------------ */

/* place: of the sub-steps in the plan's list. */
static void add_row(struct motion_study *s, sadmm_precision precision, int halvings, int place, int iterations)
{
    const struct motion_plan *plan = s->plan;
    const int substeps = plan->substeps[place];
    for (int k = 0; k < s->row_count; ++k) {
        const struct motion_setting *other = &s->rows[k].setting;
        if (other->precision == precision && other->halvings == halvings && other->substeps == substeps &&
            other->iterations == iterations)
            return;
    }
    s->rows[s->row_count++] = (struct motion_row){
        .setting = {plan->backend, precision, plan->method, plan->device, plan->threads, halvings, substeps,
                    iterations},
        .dt = plan->scene.def.settings.dt / (double)(1 << halvings), .substep_place = place,
        .total = motion_error_none(), .solver = motion_error_none(), .step = motion_error_none(),
        .ms_median = NAN, .status = "ok",
    };
}

static int compare_rows(const void *a, const void *b)
{
    const struct motion_setting *x = &((const struct motion_row *)a)->setting;
    const struct motion_setting *y = &((const struct motion_row *)b)->setting;
    if (x->precision != y->precision) return (int)x->precision - (int)y->precision;
    if (x->halvings != y->halvings) return x->halvings - y->halvings;
    return x->substeps != y->substeps ? x->substeps - y->substeps : x->iterations - y->iterations;
}

static sadmm_status make_rows(struct motion_study *s, struct sadmm_error *error)
{
    const struct motion_plan *plan = s->plan;
    for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision)
        for (int h = 0; h <= plan->halvings && (plan->precision < 0 || plan->precision == precision); ++h)
            for (int place = 0; place < plan->substep_count; ++place) {
                for (int k = 0; k < plan->iteration_count; ++k)
                    add_row(s, (sadmm_precision)precision, h, place, plan->iterations[k]);
                const int matched = (int)lround((double)plan->match / (double)(1 << h));
                if (plan->match > 0) add_row(s, (sadmm_precision)precision, h, place, matched > 0 ? matched : 1);
            }
    qsort(s->rows, (size_t)s->row_count, sizeof *s->rows, compare_rows);
    for (int k = 0; k < s->row_count; ++k) {
        struct motion_row *row = &s->rows[k];
        row->ms = sadmm_alloc((size_t)plan->seeds, sizeof *row->ms);
        row->track = (struct track){.runs = is_heap(plan) ? plan->starts : 1, .points = motion_study_points(plan)};
        if (!row->ms) return sadmm_fail_memory(error, "the rows");
    }
    return SADMM_OK;
}

/* ---- trajectories ---------------------------------------------------------------------------------------------- */

/* From the scene's start, or of a heap from every state on the way. */
static sadmm_status follow(const struct motion_study *s, const struct motion_setting *setting, struct track *track,
                           struct sadmm_error *error)
{
    const struct motion_plan *plan = s->plan;
    const bool heap = is_heap(plan);
    *track = (struct track){.runs = heap ? plan->starts : 1, .points = motion_study_points(plan)};
    for (int k = 0; k < track->runs && !interrupted(); ++k) {
        struct motion_run run = {
            .scene = &plan->scene, .setting = *setting, .track = track, .number = k, .lead_halvings = START_HALVINGS,
            .frames = heap ? plan->start_frames : plan->frames,
            .start = heap ? track_states(&s->starts, 0, k) : NULL,
        };
        TRY(motion_run(&run, error));
    }
    return SADMM_OK;
}

/* What is as good as solved: in double, on the CPU, with many iterations in every sub-step. */
static struct motion_setting solved_setting(const struct motion_plan *plan, int halvings, int substeps, int iterations)
{
    return (struct motion_setting){SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_FAST, 0, plan->threads, halvings,
                                   substeps, substeps * iterations};
}

/* States on one run of a heap at an eighth of the step, evenly from its start to one part before its end. */
static sadmm_status find_starts(struct motion_study *s, struct sadmm_error *error)
{
    const struct motion_plan *plan = s->plan;
    const int iterations = plan->scene.info->iterations[SADMM_METHOD_FAST];
    s->starts = (struct track){.runs = 1, .points = plan->starts};
    struct motion_run run = {
        .scene = &plan->scene, .setting = solved_setting(plan, START_HALVINGS, 1, iterations), .track = &s->starts,
        .frames = (int)((int64_t)plan->frames * plan->starts / (plan->starts + 1)),
    };
    return motion_run(&run, error);
}

static sadmm_status find_references(struct motion_study *s, struct sadmm_error *error)
{
    const struct motion_plan *plan = s->plan;
    if (is_heap(plan)) TRY(find_starts(s, error));
    for (int h = 0; h <= plan->halvings; ++h)
        for (int place = 0; place < plan->substep_count; ++place) {
            const struct motion_setting setting =
                solved_setting(plan, h, plan->substeps[place], plan->reference_iterations);
            TRY(follow(s, &setting, &s->solved[h][place], error));
        }
    const struct motion_setting fine = solved_setting(plan, plan->reference_halvings, 1, plan->reference_iterations);
    struct motion_setting coarse = fine;
    --coarse.halvings;
    TRY(follow(s, &coarse, &s->coarser, error));
    TRY(follow(s, &fine, &s->reference, error));
    s->has_errors = !interrupted();
    return s->has_errors ? track_compare(&s->coarser, &s->reference, &s->floor, error) : SADMM_OK;
}

/* ---- measurements ---------------------------------------------------------------------------------------------- */

static bool row_failed(struct motion_row *row, sadmm_status status, const struct sadmm_error *error)
{
    row->failed = status != SADMM_OK;
    if (row->failed) snprintf(row->status, sizeof row->status, "failed: %.300s", error->message);
    return row->failed;
}

static sadmm_status compare_row(struct motion_study *s, struct motion_row *row, struct sadmm_error *error)
{
    const struct track *solved = &s->solved[row->setting.halvings][row->substep_place];
    if (!s->has_errors || row->failed || interrupted()) return SADMM_OK;
    TRY(track_compare(&row->track, &s->reference, &row->total, error));
    TRY(track_compare(&row->track, solved, &row->solver, error));
    return track_compare(solved, &s->reference, &row->step, error);
}

/* A heap's errors come from runs of their own, before those that are timed. */
static sadmm_status follow_heaps(struct motion_study *s, struct sadmm_error *error)
{
    for (int k = 0; k < s->row_count && is_heap(s->plan); ++k) {
        struct motion_row *row = &s->rows[k];
        row_failed(row, follow(s, &row->setting, &row->track, error), error);
        TRY(compare_row(s, row, error));
    }
    return SADMM_OK;
}

/* Rows in turn, so that what slows the machine down for a while meets all of them. */
static sadmm_status time_rows(struct motion_study *s, struct sadmm_error *error)
{
    const struct motion_plan *plan = s->plan;
    for (int n = 0; n < plan->seeds * plan->repeats; ++n)
        for (int k = 0; k < s->row_count && !interrupted(); ++k) {
            struct motion_row *row = &s->rows[k];
            const int seed = n % plan->seeds;
            const bool first = n < plan->seeds; /* later ones repeat what these were */
            struct motion_run run = {
                .scene = &plan->scene, .setting = row->setting, .frames = plan->frames, .seed = seed,
                .measure = first ? &row->measure : NULL, .track = first && !is_heap(plan) ? &row->track : NULL,
            };
            if (row->failed || row_failed(row, motion_run(&run, error), error) || !run.complete) continue;
            ++row->runs;
            row->ms[seed] = first ? run.ms / run.timed : fmin(row->ms[seed], run.ms / run.timed);
            row->threads = run.threads;
            if (run.track) TRY(compare_row(s, row, error));
        }
    return SADMM_OK;
}

static void find_best(struct motion_study *s)
{
    struct motion_row *best = NULL;
    for (int k = 0; k < s->row_count; ++k) {
        struct motion_row *row = &s->rows[k];
        const int count = row->runs < s->plan->seeds ? row->runs : s->plan->seeds;
        if (count == 0) continue;
        qsort(row->ms, (size_t)count, sizeof *row->ms, bench_compare_doubles);
        row->ms_median = 0.5 * (row->ms[(count - 1) / 2] + row->ms[count / 2]);
    }
    for (int k = 0; k < s->row_count; ++k) {
        struct motion_row *row = &s->rows[k];
        row->front = isfinite(row->ms_median) && isfinite(row->total.median);
        for (int j = 0; j < s->row_count && row->front; ++j)
            row->front = !(s->rows[j].ms_median < row->ms_median && s->rows[j].total.median < row->total.median);
        if (row->front && (!best || row->ms_median * row->total.median < best->ms_median * best->total.median))
            best = row;
    }
    if (best) best->best = true;
}

sadmm_status motion_study_run(struct motion_study *s, const struct motion_plan *plan, struct sadmm_error *error)
{
    s->plan = plan;
    s->floor = motion_error_none();
    TRY(make_rows(s, error));
    TRY(find_references(s, error));
    TRY(follow_heaps(s, error));
    TRY(time_rows(s, error));
    find_best(s);
    return SADMM_OK;
}

void motion_study_free(struct motion_study *s)
{
    for (int k = 0; k < s->row_count; ++k) {
        track_free(&s->rows[k].track);
        motion_measure_free(&s->rows[k].measure);
        sadmm_free(s->rows[k].ms);
    }
    for (int h = 0; h <= MOST_HALVINGS; ++h)
        for (int place = 0; place < BENCH_LIST; ++place) track_free(&s->solved[h][place]);
    track_free(&s->starts);
    track_free(&s->reference);
    track_free(&s->coarser);
}
