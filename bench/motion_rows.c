#include "motion_rows.h"

#include <math.h>

#include "cli/interrupt.h"

static double seconds_of(const struct motion_plan *plan) { return plan->frames * plan->scene.def.settings.dt; }

static double horizon_of(const struct motion_plan *plan)
{
    return plan->scene.info->chaotic ? plan->start_frames * plan->scene.def.settings.dt : seconds_of(plan);
}

static double reference_dt(const struct motion_plan *plan)
{
    return plan->scene.def.settings.dt / (double)(1 << plan->reference_halvings);
}

/* Pairs a frame. */
static double per_frame(const struct motion_measure *m, int64_t pairs)
{
    return m->frames > 0 ? (double)pairs / (double)m->frames : NAN;
}

static double share_of(int64_t part, int64_t all) { return all > 0 ? (double)part / (double)all : 0; }

/* ---- table ----------------------------------------------------------------------------------------------------- */

/* In mm, or "-" where nothing was measured. */
static const char *mm_text(char text[16], double length)
{
    if (isfinite(length)) snprintf(text, 16, "%.3g", 1e3 * length);
    else snprintf(text, 16, "-");
    return text;
}

static void print_head(const struct motion_study *s, const char *runs_on, FILE *out)
{
    const struct motion_plan *plan = s->plan;
    fprintf(out, "%s, %.4g s in frames of %g ms, %s; %s, commit %s\n", plan->spec, seconds_of(plan),
            1e3 * plan->scene.def.settings.dt, bench_word_of(bench_methods, (int)plan->method), runs_on,
            sadmm_build_commit());
    if (plan->scene.info->chaotic)
        fprintf(out, "errors: after %.4g s from %d states on one run; times and overlaps: whole runs, %d seeds",
                horizon_of(plan), plan->starts, plan->seeds);
    else fprintf(out, "errors: at %d times of the run", motion_study_points(plan));
    fprintf(out, "; the least time of %d\n", plan->repeats);
    char median[16], largest[16];
    fprintf(out, "reference: dt %.4g ms, %d iterations; half as fine is %s mm away (at most %s)\n",
            1e3 * reference_dt(plan), plan->reference_iterations, mm_text(median, s->floor.median),
            mm_text(largest, s->floor.largest));
    fprintf(out, "error: median of the bodies that move by more than %g mm, -: none does; at most: of all\n",
            1e3 * motion_least);
    fprintf(out, "* none is faster and closer, ** least product of both; solver: to many iterations of the same step; "
                 "step: of those to the reference\n\n");
    fprintf(out, "%-4s %8s %4s %5s %9s  | %8s %8s %8s %8s | %8s %8s %8s %8s %8s %8s  %s\n", "", "", "sub-", "",
            "ms per", "error,", "at", "of the", "of the", "overlap,", "", "", "at", "pairs a", "deeper", "");
    fprintf(out, "%-4s %8s %4s %5s %9s  | %8s %8s %8s %8s | %8s %8s %8s %8s %8s %8s  %s\n", "", "dt, ms", "step", "it.",
            "sim. s", "mm", "most", "solver", "step", "mm: 50 %", "99 %", "99.9 %", "most", "frame", "than 1 %", "");
}

void motion_print(const struct motion_study *s, const char *runs_on, FILE *out)
{
    print_head(s, runs_on, out);
    for (int k = 0; k < s->row_count; ++k) {
        const struct motion_row *row = &s->rows[k];
        const struct depth_counts *d = &row->measure.depths;
        char text[16];
        if (row->runs == 0 && !row->failed) continue; /* interrupted */
        fprintf(out, "%-4s %8.4g %4d %5d ", bench_precision_name(row->setting.precision), 1e3 * row->dt,
                row->setting.substeps, row->setting.iterations);
        if (row->runs > 0) {
            fprintf(out, "%9.4g%-2s|", row->ms_median, row->best ? "**" : row->front ? "*" : "");
            const double errors[] = {row->total.median, row->total.largest, row->solver.median, row->step.median};
            for (int i = 0; i < 4; ++i) fprintf(out, " %8s", mm_text(text, errors[i]));
            fprintf(out, " | %8.3g %8.3g %8.3g %8.3g %8.4g %8.3g  ", 1e3 * depth_quantile(d, 0.5),
                    1e3 * depth_quantile(d, 0.99), 1e3 * depth_quantile(d, 0.999), 1e3 * d->deepest,
                    per_frame(&row->measure, d->count), per_frame(&row->measure, d->deep));
        }
        fprintf(out, "%s\n", row->failed ? row->status : "");
    }
}

/* ---- JSON ------------------------------------------------------------------------------------------------------ */

/* A number, or null where nothing was measured. */
static void set_real(json_t *object, const char *name, double value)
{
    json_object_set_new(object, name, isfinite(value) ? json_real(value) : json_null());
}

static json_t *course_json(const struct motion_plan *plan, const struct motion_measure *m)
{
    json_t *course = json_array();
    for (int k = 0; k < COURSE_POINTS; ++k) {
        json_t *point = json_object();
        if (m->runs[k] == 0) {
            json_decref(point);
            continue;
        }
        const int frame = (int)((int64_t)plan->frames * (k + 1) / COURSE_POINTS);
        set_real(point, "time", frame * plan->scene.def.settings.dt);
        set_real(point, "height", m->course[k].height / m->runs[k]);
        set_real(point, "spread", m->course[k].spread / m->runs[k]);
        set_real(point, "kinetic", m->course[k].kinetic / m->runs[k]);
        json_array_append_new(course, point);
    }
    return course;
}

static void set_error(json_t *object, const char *name, const struct motion_error *error)
{
    char largest[32];
    snprintf(largest, sizeof largest, "%s_max", name);
    set_real(object, name, error->median);
    set_real(object, largest, error->largest);
}

static json_t *row_json(const struct motion_plan *plan, const struct motion_row *row)
{
    const struct motion_setting *setting = &row->setting;
    const struct depth_counts *d = &row->measure.depths;
    sadmm_backend_info info;
    sadmm_backend_query(setting->backend, &info);
    json_t *o = json_pack("{s:s, s:s, s:s, s:s, s:i, s:i, s:i, s:i, s:s}", "scene", plan->spec, "backend", info.name,
                          "precision", bench_precision_name(setting->precision), "method",
                          bench_word_of(bench_methods, (int)setting->method), "threads", row->threads, "substeps",
                          setting->substeps, "iterations", setting->iterations, "runs", row->runs, "status",
                          row->status);
    if (!o) return NULL;
    set_real(o, "dt", row->dt);
    set_real(o, "ms_per_simulated_second", row->ms_median);
    set_error(o, "error", &row->total);
    set_error(o, "error_solver", &row->solver);
    set_error(o, "error_step", &row->step);
    const bool measured = row->measure.frames > 0;
    set_real(o, "overlap_median", measured ? depth_quantile(d, 0.5) : NAN);
    set_real(o, "overlap_p99", measured ? depth_quantile(d, 0.99) : NAN);
    set_real(o, "overlap_p999", measured ? depth_quantile(d, 0.999) : NAN);
    set_real(o, "overlap_max", measured ? d->deepest : NAN);
    set_real(o, "overlap_pairs", per_frame(&row->measure, d->count));
    set_real(o, "overlap_deep_pairs", per_frame(&row->measure, d->deep));
    set_real(o, "overlap_deep_share", measured ? share_of(d->deep, d->count) : NAN);
    json_object_set_new(o, "course", course_json(plan, &row->measure));
    json_object_set_new(o, "front", json_boolean(row->front));
    json_object_set_new(o, "best", json_boolean(row->best));
    return o;
}

json_t *motion_json(const struct motion_study *s, const char *runs_on)
{
    const struct motion_plan *plan = s->plan;
    const bool heap = plan->scene.info->chaotic;
    json_t *rows = json_array(), *reference = json_object();
    for (int k = 0; k < s->row_count; ++k)
        if (s->rows[k].runs > 0 || s->rows[k].failed)
            json_array_append_new(rows, row_json(plan, &s->rows[k]));
    set_real(reference, "dt", reference_dt(plan));
    json_object_set_new(reference, "iterations", json_integer(plan->reference_iterations));
    set_error(reference, "floor", &s->floor);
    json_t *o = json_pack("{s:s, s:s, s:s, s:b, s:s, s:s, s:s, s:i, s:o}", "bench", "motion", "scene", plan->spec,
                          "kind", heap ? "heap" : "trajectory", "interrupted", interrupted() != 0, "commit",
                          sadmm_build_commit(), "compiler", sadmm_build_compiler(), "runs_on", runs_on, "threads",
                          plan->threads, "reference", reference);
    if (o) {
        set_real(o, "frame", plan->scene.def.settings.dt);
        set_real(o, "seconds", seconds_of(plan));
        set_real(o, "error_seconds", horizon_of(plan));
        json_object_set_new(o, "match", json_integer(plan->match));
        json_object_set_new(o, "seeds", json_integer(plan->seeds));
        json_object_set_new(o, "repeats", json_integer(plan->repeats));
        json_object_set_new(o, "starts", json_integer(heap ? plan->starts : 1));
        json_object_set_new(o, "points", json_integer(motion_study_points(plan)));
    }
    if (!o || json_object_set_new(o, "rows", rows) != 0) {
        json_decref(o);
        return NULL;
    }
    return o;
}
