/* A run's record as JSON and as a table. What was not measured is null, or left out. */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "core/base/names.h"
#include "interrupt.h"
#include "run_record.h"

static const char *const phase_names[RUN_PHASES] = {
    [RUN_TOTAL] = "total", [RUN_COLLIDE] = "collide", [RUN_ASSEMBLE] = "assemble",
    [RUN_SOLVE] = "solve", [RUN_FINISH] = "finish",
};

static const char *const error_words[SADMM_STEP_ERROR_COUNT] = {
    [SADMM_STEP_ERROR_NONE] = "",
    [SADMM_STEP_ERROR_LAW] = ", of a contact's or joint's law",
    [SADMM_STEP_ERROR_MOMENTUM] = ", of a body's momentum",
    [SADMM_STEP_ERROR_LIMITER] = ", of a body's momentum, for islands were slowed down",
    [SADMM_STEP_ERROR_JOINTS] = ", of a joint that is open",
};

/* What a reader of the table cannot know. */
static const char *const phase_words[RUN_PHASES] = {
    [RUN_TOTAL] = "",
    [RUN_COLLIDE] = "   contacts are found",
    [RUN_ASSEMBLE] = "   their equations are set up",
    [RUN_SOLVE] = "   iterations",
    [RUN_FINISH] = "   bodies are moved",
};

static json_t *times_json(const struct run_record *record)
{
    json_t *o = json_object();
    for (int k = 0; k < RUN_PHASES; ++k) {
        double median, p95;
        json_t *phase = json_null();
        if (record->steps > 0 && run_percentiles(record->ms[k], record->steps, &median, &p95)) {
            phase = json_object();
            json_object_set_new(phase, "median", cli_json_real(median));
            json_object_set_new(phase, "p95", cli_json_real(p95));
        }
        json_object_set_new(o, phase_names[k], phase);
    }
    return o;
}

static json_t *residual_json(const struct sadmm_residual *residual)
{
    json_t *o = json_object();
    bool measured = residual->primal >= 0;
    json_object_set_new(o, "primal", measured ? cli_json_real(residual->primal) : json_null());
    json_object_set_new(o, "dual", measured ? cli_json_real(residual->dual) : json_null());
    return o;
}

static json_t *certificate_json(const struct run_record *record)
{
    const sadmm_certificate *c = &record->last.certificate;
    /* A NaN certificate is a measured one: it becomes null by itself. */
    if (record->steps == 0 || c->ncp_max == -1) return json_null();
    json_t *o = json_object();
    json_object_set_new(o, "ncp_max", cli_json_real(c->ncp_max));
    json_object_set_new(o, "ncp_mean", cli_json_real(c->ncp_mean));
    json_object_set_new(o, "momentum_max", cli_json_real(c->momentum_max));
    json_object_set_new(o, "ncp_max_run", cli_json_real(record->ncp_max));
    json_object_set_new(o, "momentum_max_run", cli_json_real(record->momentum_max));
    return o;
}

/* Who stopped when. */
static json_t *stop_json(const struct run_record *record, const sadmm_settings *settings)
{
    if (record->steps == 0 || !(settings->tolerance > 0)) return json_null();
    json_t *o = json_object();
    json_object_set_new(o, "tolerance", cli_json_real(settings->tolerance));
    json_object_set_new(o, "steps_met", json_integer((json_int_t)record->met));
    json_object_set_new(o, "iterations_mean", cli_json_real(record->iterations_sum / (double)record->steps));
    json_object_set_new(o, "iterations_last", json_integer(record->last.iterations));
    json_object_set_new(o, "steps_unsolved", json_integer((json_int_t)record->unsolved_steps));
    json_object_set_new(o, "unsolved_last", json_integer(record->last.unsolved));
    return o;
}

static json_t *contacts_json(const struct run_record *record)
{
    json_t *o = json_object();
    bool any = record->steps > 0;
    json_object_set_new(o, "mean", any ? cli_json_real(record->contacts_sum / (double)record->steps) : json_null());
    json_object_set_new(o, "max", any ? json_integer(record->contacts_max) : json_null());
    return o;
}

/* What the scene measured of its own success; null: it does not. */
static json_t *result_json(const struct sadmm_scene_result *result)
{
    if (result->task_count == 0) return json_null();
    json_t *o = json_object(), *tasks = json_array();
    for (int k = 0; k < result->task_count; ++k) {
        const struct sadmm_scene_task *task = &result->tasks[k];
        json_t *t = json_object(), *figures = json_array();
        json_object_set_new(t, "name", json_string(task->name));
        json_object_set_new(t, "finished", json_boolean(task->finished));
        json_object_set_new(t, "passed", json_boolean(task->passed));
        for (int f = 0; f < task->figure_count; ++f) {
            json_t *figure = json_object();
            json_object_set_new(figure, "name", json_string(task->figures[f].name));
            json_object_set_new(figure, "value", cli_json_real(task->figures[f].value));
            json_object_set_new(figure, "unit", json_string(task->figures[f].unit));
            json_array_append_new(figures, figure);
        }
        json_object_set_new(t, "figures", figures);
        json_array_append_new(tasks, t);
    }
    json_object_set_new(o, "passed", json_boolean(sadmm_scene_passed(result)));
    json_object_set_new(o, "tasks", tasks);
    return o;
}

static void print_result(const struct sadmm_scene_result *result)
{
    for (int k = 0; k < result->task_count; ++k) {
        const struct sadmm_scene_task *task = &result->tasks[k];
        printf("%-14s %-14s %s", k == 0 ? "result" : "", task->name,
               !task->finished ? "not finished" : task->passed ? "passed" : "FAILED");
        for (int f = 0; f < task->figure_count; ++f)
            printf("%s %s %.4g%s%s", f ? "," : ":", task->figures[f].name, task->figures[f].value,
                   *task->figures[f].unit ? " " : "", task->figures[f].unit);
        printf("\n");
    }
}

/* Set what only a step reports, or null before the first. */
static void set_or_null(json_t *o, const char *name, const struct run_record *record, json_t *value)
{
    if (record->steps > 0) {
        json_object_set_new(o, name, value);
    } else {
        json_decref(value);
        json_object_set_new(o, name, json_null());
    }
}

json_t *run_record_json(const struct run_record *record, const char *spec, const struct sadmm_scene *scene)
{
    const sadmm_step_report *last = &record->last;
    char hash[17];
    json_t *o = json_object();
    snprintf(hash, sizeof hash, "%016" PRIx64, record->hash);
    json_object_set_new(o, "scene", json_string(spec));
    set_or_null(o, "backend", record, json_string(cli_backend_name(last->backend)));
    json_object_set_new(o, "precision", json_string(cli_precision_name(scene->def.precision)));
    json_object_set_new(o, "method", json_string(cli_method_name(scene->def.settings.method)));
    json_object_set_new(o, "bodies", json_integer((json_int_t)record->body_count));
    set_or_null(o, "joints", record, json_integer(last->joints));
    set_or_null(o, "couplings", record, json_integer(last->couplings));
    json_object_set_new(o, "contacts", contacts_json(record));
    json_object_set_new(o, "steps", json_integer((json_int_t)record->steps));
    json_object_set_new(o, "seconds", cli_json_real((double)record->steps * scene->def.settings.dt));
    json_object_set_new(o, "dt", cli_json_real(scene->def.settings.dt));
    json_object_set_new(o, "substeps", json_integer(scene->def.settings.substeps));
    json_object_set_new(o, "iterations", json_integer(scene->def.settings.iterations));
    json_object_set_new(o, "warm_start", json_boolean(scene->def.settings.warm_start));
    set_or_null(o, "threads", record, json_integer(last->threads));
    json_object_set_new(o, "ms_per_step", times_json(record));
    if (record->steps > 0) json_object_set_new(o, "residual", residual_json(&last->residual));
    else json_object_set_new(o, "residual", json_null());
    json_object_set_new(o, "certificate", certificate_json(record));
    json_object_set_new(o, "stop", stop_json(record, &scene->def.settings));
    set_or_null(o, "error_max", record, record->error >= 0 ? cli_json_real(record->error) : json_null());
    set_or_null(o, "error_kind", record,
                record->error >= 0 ? json_string(sadmm_step_error_names[record->error_kind]) : json_null());
    set_or_null(o, "limited_steps", record, json_integer((json_int_t)record->limited_steps));
    set_or_null(o, "repeated", record, json_integer(record->last.repeated));
    set_or_null(o, "penetration_max", record, cli_json_real(record->penetration_max));
    set_or_null(o, "joint_drift", record, cli_json_real(record->joint_drift));
    json_object_set_new(o, "speed_max_final", cli_json_real(record->speed_max));
    json_object_set_new(o, "displacement_max", cli_json_real(record->displacement_max));
    json_object_set_new(o, "scene_result", result_json(&record->result));
    json_object_set_new(o, "state_hash", json_string(hash));
    json_object_set_new(o, "interrupted", json_boolean(interrupted() != 0));
    json_object_set_new(o, "finite", json_boolean(record->finite));
    json_object_set_new(o, "error", *record->failure ? json_string(record->failure) : json_null());
    cli_json_add_build(o);
    json_object_set_new(o, "device", record->steps > 0 ? cli_json_device(last->backend) : json_null());
    json_object_set_new(o, "settings", cli_json_settings(&scene->def.settings));
    return o;
}

void run_record_print(const struct run_record *record, const char *spec, const struct sadmm_scene *scene)
{
    const sadmm_step_report *last = &record->last;
    const sadmm_certificate *c = &last->certificate;
    printf("scene          %s, %zu dynamic bod%s\n", spec, record->body_count, record->body_count == 1 ? "y" : "ies");
    if (scene->loaded) printf("file           a world at its beginning: no script, no measure of success\n");
    printf("steps          %zu of %g s", record->steps, scene->def.settings.dt);
    if (scene->def.settings.substeps > 1) printf(" in %d sub-steps", scene->def.settings.substeps);
    printf(", %g s in all", (double)record->steps * scene->def.settings.dt);
    printf("%s\n", interrupted() ? ", interrupted" : "");
    if (record->steps > 0) {
        printf("backend        %s %s, %d thread%s, %d iterations a step (%s)\n", cli_backend_name(last->backend),
               cli_precision_name(last->precision), last->threads, last->threads == 1 ? "" : "s",
               scene->def.settings.iterations, cli_method_name(scene->def.settings.method));
        printf("contacts       %.1f points a step in the mean, %d at most\n",
               record->contacts_sum / (double)record->steps, record->contacts_max);
        printf("ms per step    %10s %10s\n", "median", "p95");
    }
    for (int k = 0; k < RUN_PHASES; ++k) {
        double median, p95;
        if (record->steps > 0 && run_percentiles(record->ms[k], record->steps, &median, &p95))
            printf("  %-12s %10.4f %10.4f%s\n", phase_names[k], median, p95, phase_words[k]);
    }
    if (record->steps > 0 && last->residual.primal >= 0)
        printf("residual       primal %.3g m/s, dual %.3g N s: of the last step's iterations, not its true error\n",
               last->residual.primal, last->residual.dual);
    if (record->steps > 0 && c->ncp_max != -1)
        printf("certificate    ncp %.3g m/s in the last step, %.3g in the run: of a contact or joint from its law\n"
               "               momentum %.3g, %.3g: of a body, what impulses do not explain, over the largest\n",
               c->ncp_max, record->ncp_max, c->momentum_max, record->momentum_max);
    if (record->steps > 0 && scene->def.settings.tolerance > 0)
        printf("tolerance      %g m/s met in %zu steps of %zu, %.1f iterations in the mean; last step: %d at most, "
               "%" PRId64 " islands unsolved\n",
               scene->def.settings.tolerance, record->met, record->steps,
               record->iterations_sum / (double)record->steps, last->iterations, last->unsolved);
    if (record->steps > 0 && record->error >= 0)
        printf("error          %.3g m/s at most%s\n", record->error, error_words[record->error_kind]);
    if (record->limited_steps > 0)
        printf("limited        %zu steps slowed islands down to the energy contacts can leave: too few iterations\n",
               record->limited_steps);
    if (record->steps > 0 && last->repeated > 0)
        printf("repeated       %" PRId64 " steps, which outgrew the capacities or the plan they were begun with\n",
               last->repeated);
    if (record->steps > 0) printf("penetration    %.3g m at most\n", record->penetration_max);
    if (last->joints > 0) printf("joints         open by %.3g m at most\n", record->joint_drift);
    printf("final state    fastest %.3g m/s, moved %.3g m at most, %s, hash %016" PRIx64 "\n", record->speed_max,
           record->displacement_max, record->finite ? "finite" : "NOT FINITE", record->hash);
    print_result(&record->result);
    if (*record->failure) printf("FAILED         %s\n", record->failure);
}
