#include "motion_run.h"

#include <string.h>

#include "cli/interrupt.h"

enum { LEAD_STEPS = 16, LEAD_ITERATIONS = 200, WARM_UP = 10 /* frames */ };

static sadmm_settings settings_of(const struct sadmm_scene *scene, const struct motion_setting *setting)
{
    sadmm_settings settings = scene->def.settings;
    settings.method = setting->method;
    settings.substeps = setting->substeps;
    settings.iterations = setting->iterations;
    settings.threads = setting->threads;
    settings.dt = scene->def.settings.dt / (double)(1 << setting->halvings);
    return settings;
}

static sadmm_status lead_in(struct motion_world *w, const struct motion_run *run)
{
    struct motion_setting lead = run->setting;
    lead.method = SADMM_METHOD_FAST;
    lead.iterations = LEAD_ITERATIONS;
    lead.substeps = 1;
    lead.halvings = run->lead_halvings;
    const sadmm_settings settings = settings_of(run->scene, &lead);
    TRY(motion_world_check(w, sadmm_world_set_settings(w->world, &settings)));
    TRY(motion_world_set_states(w, run->start));
    for (int k = 0; k < LEAD_STEPS; ++k) TRY(motion_world_step(w, k, NULL));
    return motion_world_read(w);
}

static sadmm_status step_frames(struct motion_world *w, struct motion_run *run)
{
    const int steps = 1 << run->setting.halvings, points = run->track ? run->track->points : 0;
    const int warm_up = run->frames >= 4 * WARM_UP ? WARM_UP : run->frames / 4;
    int point = 0;
    for (int frame = 1; frame <= run->frames; ++frame) {
        if (interrupted()) return SADMM_OK;
        for (int k = 0; k < steps; ++k)
            TRY(motion_world_step(w, (int64_t)(frame - 1) * steps + k, frame > warm_up ? &run->ms : NULL));
        const bool at_point = point < points && frame == (int)((int64_t)run->frames * (point + 1) / points);
        if (!at_point && !run->measure) continue;
        TRY(motion_world_read(w));
        if (run->measure) TRY(motion_measure_frame(run->measure, w, frame, run->frames));
        if (!at_point) continue;
        memcpy(track_states(run->track, run->number, point++), w->states, (size_t)w->body_count * sizeof *w->states);
    }
    run->timed = (run->frames - warm_up) * run->scene->def.settings.dt;
    run->complete = true;
    return SADMM_OK;
}

static sadmm_status run_world(struct motion_world *w, struct motion_run *run)
{
    const struct motion_setting *setting = &run->setting;
    sadmm_step_report report;
    if (run->start) TRY(lead_in(w, run));
    const sadmm_settings settings = settings_of(run->scene, setting);
    TRY(motion_world_check(
        w, sadmm_world_set_backend(w->world, setting->backend, setting->precision, setting->device)));
    TRY(motion_world_check(w, sadmm_world_set_settings(w->world, &settings)));
    if (run->track) {
        if (!run->track->bodies) TRY(track_create(run->track, w));
        memcpy(run->track->start + (size_t)run->number * (size_t)w->body_count, w->states,
               (size_t)w->body_count * sizeof *w->states);
    }
    TRY(step_frames(w, run));
    TRY(motion_world_check(w, sadmm_world_report(w->world, &report)));
    run->threads = report.threads;
    return SADMM_OK;
}

sadmm_status motion_run(struct motion_run *run, struct sadmm_error *error)
{
    struct sadmm_scene built = *run->scene, stepped = *run->scene;
    struct motion_world w;
    built.def.backend = SADMM_BACKEND_CPU;
    built.def.precision = SADMM_F64;
    stepped.def.settings = settings_of(run->scene, &run->setting);
    run->ms = 0;
    run->complete = false;
    sadmm_status status = motion_world_open(&w, &built, run->seed, error);
    w.scene = &stepped; /* scripted inputs go by its step; where bodies start is the same for all */
    if (status == SADMM_OK) status = run_world(&w, run);
    motion_world_close(&w);
    return status;
}
