#include "scene_timing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "cli/interrupt.h"
#include "core/base/clock.h"
#include "core/solve/schedule.h"

enum { TOTAL, COLLIDE, ASSEMBLE, SOLVE, FINISH, SOLVER, COLUMNS };

struct stopwatch {
    sadmm_world *world;
    const struct sadmm_scene *scene;
    double begin; /* ms, before the world was made */
    struct scene_timing *timing;
};

static sadmm_status fail(const sadmm_world *world, sadmm_status status, struct sadmm_error *error)
{
    return status == SADMM_OK ? status : sadmm_fail(error, status, "%s", sadmm_world_message(world));
}

static sadmm_status step(struct stopwatch *w, sadmm_step_report *report, struct sadmm_error *error)
{
    double begin = sadmm_clock_ms();
    sadmm_status status = sadmm_world_report(w->world, report);
    if (status == SADMM_OK) status = sadmm_scene_before_step(w->scene, w->world, report->step, error);
    if (status == SADMM_OK) status = fail(w->world, sadmm_world_step(w->world), error);
    if (status == SADMM_OK) status = sadmm_world_report(w->world, report);
    w->timing->slowest_step_s = fmax(w->timing->slowest_step_s, 1e-3 * (sadmm_clock_ms() - begin));
    return status;
}

static bool time_is_over(const struct stopwatch *w, double seconds)
{
    return interrupted() || sadmm_clock_ms() - w->begin > 1e3 * seconds;
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, bench_compare_doubles);
    return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

/* `times`: COLUMNS rows of plan->steps numbers. */
static sadmm_status time_steps(struct stopwatch *w, const struct scene_timing_plan *plan, double *times,
                               struct sadmm_error *error)
{
    struct scene_timing *t = w->timing;
    while (t->steps < plan->steps && !time_is_over(w, plan->seconds)) {
        sadmm_status status = step(w, &t->last, error);
        if (status != SADMM_OK) return status;
        const sadmm_phase_times *ms = &t->last.ms;
        const double columns[COLUMNS] = {ms->total, ms->collide, ms->assemble,
                                         ms->solve, ms->finish,  ms->total - ms->collide};
        for (int k = 0; k < COLUMNS; ++k) times[k * plan->steps + t->steps] = columns[k];
        ++t->steps;
    }
    if (t->steps == 0) return SADMM_OK;
    double *medians[COLUMNS] = {&t->ms.total, &t->ms.collide, &t->ms.assemble,
                                &t->ms.solve, &t->ms.finish,  &t->solver_ms};
    for (int k = 0; k < COLUMNS; ++k) *medians[k] = median(times + k * plan->steps, t->steps);
    return fail(w->world, sadmm_world_state_hash(w->world, &t->state_hash), error);
}

static sadmm_status certify_steps(struct stopwatch *w, int count, struct sadmm_error *error)
{
    sadmm_settings settings = sadmm_world_settings(w->world);
    sadmm_step_report report;
    settings.certify = true;
    sadmm_status status = fail(w->world, sadmm_world_set_settings(w->world, &settings), error);
    for (; w->timing->certified < count && status == SADMM_OK && !interrupted(); ++w->timing->certified) {
        status = step(w, &report, error);
        if (status != SADMM_OK) break;
        w->timing->ncp_max = fmax(w->timing->ncp_max, report.certificate.ncp_max);
        w->timing->momentum_max = fmax(w->timing->momentum_max, report.certificate.momentum_max);
    }
    return status;
}

static sadmm_status run(struct stopwatch *w, const struct scene_timing_plan *plan, double *times,
                        struct sadmm_error *error)
{
    sadmm_status status = SADMM_OK;
    sadmm_step_report report;
    for (int i = 0; i < plan->warm_up && status == SADMM_OK; ++i) {
        if (time_is_over(w, plan->seconds)) return SADMM_OK;
        status = step(w, &report, error);
    }
    if (status == SADMM_OK) status = time_steps(w, plan, times, error);
    if (status == SADMM_OK && w->timing->steps > 0) status = certify_steps(w, plan->certified, error);
    return status;
}

sadmm_status scene_timing_run(const struct sadmm_scene *scene, const struct scene_timing_plan *plan,
                              struct scene_timing *timing, struct sadmm_error *error)
{
    struct stopwatch w = {.scene = scene, .begin = sadmm_clock_ms(), .timing = timing};
    memset(timing, 0, sizeof *timing);
    double *times = malloc(COLUMNS * (size_t)plan->steps * sizeof *times);
    if (!times) return sadmm_fail_memory(error, "the times");
    sadmm_status status = sadmm_scene_build(scene, &w.world, error);
    timing->build_s = 1e-3 * (sadmm_clock_ms() - w.begin);
    if (status == SADMM_OK && plan->change) status = fail(w.world, plan->change(w.world), error);
    if (status == SADMM_OK) status = run(&w, plan, times, error);
    sadmm_world_destroy(w.world);
    free(times);
    return status;
}
