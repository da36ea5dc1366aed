/* subadmm-bench motion: total error against run time of scenes in motion. Trajectories with the scene's time step, half
 * of it, a quarter, ... by numbers of iterations are compared with one at a 64th of the step and with many iterations,
 * at the same simulated times; heaps, whose trajectories part whatever one does, after a short time from states on one
 * run. Overlaps are measured apart from the library (overlap.h). Or motions whose answers are known (known_motions.h).
 * docs/internals/accuracy.md. */
#include <math.h>
#include <string.h>

#include "bench.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/base/memory.h"
#include "core/base/settings_fields.h"
#include "known_rows.h"
#include "motion_rows.h"

static const char command[] = "motion", default_scene[] = "pile:300";

struct options {
    const char *scene, *json;
    int backend, precision, method;
    long device, threads, halvings, substeps[BENCH_LIST], iterations[BENCH_LIST], match, seeds, repeats, starts,
        reference, reference_iterations, known;
    int substep_count, iteration_count;
    double dt, seconds, horizon;
};

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXT("scene", "SPEC", &o->scene, "default pile:300"),
        BENCH_NUMBER("known", &o->known, 1, 1000,
                     "in place of a scene: N motions of every kind with a known answer, against that; goes with "
                     "halvings, iterations (the last), method, backend, precision, threads and device"),
        BENCH_REAL("dt", "S", &o->dt, 1, "time step of a frame, default the scene's"),
        BENCH_NUMBER("halvings", &o->halvings, 0, MOST_HALVINGS, "of it: dt, dt/2, ...; default 2"),
        BENCH_NUMBERS("substeps", o->substeps, &o->substep_count, 1, SADMM_MOST_SUBSTEPS,
                      "of a step, which share its iterations; default 1"),
        BENCH_NUMBERS("iterations", o->iterations, &o->iteration_count, 1, 1000000, "a step, default 20,60"),
        BENCH_NUMBER("match", &o->match, 0, 1000000,
                     "and N at dt, N/2 at dt/2, ...: steps x iterations kept; default the scene's, 0: not"),
        BENCH_WORD("method", &o->method, bench_methods, BENCH_ONE_METHOD, "default fast"),
        BENCH_WORD("backend", &o->backend, bench_backends, BENCH_ONE_BACKEND, "default cpu"),
        BENCH_WORD("precision", &o->precision, bench_precisions, 3, "default f32"),
        BENCH_NUMBER("threads", &o->threads, 0, 1024, "at most, 0: as many as there are; default 1"),
        BENCH_NUMBER("device", &o->device, 0, 1023, "accelerator, default 0"),
        BENCH_REAL("seconds", "S", &o->seconds, 3600, "simulated, default the scene's"),
        BENCH_NUMBER("seeds", &o->seeds, 1, 1000, "heaps: of boxes in other orientations, default 3"),
        BENCH_NUMBER("repeats", &o->repeats, 1, 1000, "of every run, for its time; default 5, of heaps 1"),
        BENCH_NUMBER("starts", &o->starts, 1, 1000, "heaps: states whose errors are measured, default 9"),
        BENCH_REAL("horizon", "S", &o->horizon, 3600, "heaps: how long from there, default 0.05"),
        BENCH_NUMBER("reference", &o->reference, 1, MOST_HALVINGS, "halvings of the reference's step, default 6"),
        BENCH_NUMBER("reference-iterations", &o->reference_iterations, 1, 1000000, "default 300"),
        BENCH_TEXT("json", "FILE|-", &o->json,
                   "rows[] of {dt, substeps, iterations, ms_per_simulated_second, error, overlap_max, ...}"),
    };
    return bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
}

static int wrong(const char *message)
{
    fprintf(stderr, "subadmm-bench %s: %s\n", command, message);
    return 2;
}

static int bad_number(const char *option, long value, const char *allowed)
{
    char text[32];
    snprintf(text, sizeof text, "%ld", value);
    return bench_bad_option(command, option, text, allowed);
}

static int frames_in(double seconds, double dt) { return (int)fmax(1, fmin(1e8, round(seconds / dt))); }

static int make_plan(const struct options *o, struct motion_plan *plan)
{
    struct sadmm_scene *scene = &plan->scene;
    const int code = bench_open_scene(command, o->scene, scene);
    if (code) return code;
    const bool heap = scene->info->chaotic;
    double *dt = &scene->def.settings.dt;
    if (o->dt > 0) *dt = o->dt;
    if (*dt / (double)(1L << o->reference) < 1e-6) return bad_number("reference", o->reference, "fewer: dt >= 1e-6 s");
    if (o->halvings >= o->reference) return bad_number("halvings", o->halvings, "fewer than --reference");
    for (int k = 0; k < o->substep_count; ++k)
        if (*dt / (double)(1L << o->halvings) < 1e-6 * (double)o->substeps[k])
            return bad_number("substeps", o->substeps[k], "fewer: dt of a sub-step >= 1e-6 s");
    plan->spec = o->scene;
    plan->backend = (sadmm_backend)o->backend;
    plan->method = (sadmm_method)o->method;
    plan->precision = o->precision;
    plan->device = (int)o->device;
    plan->threads = (int)o->threads;
    plan->halvings = (int)o->halvings;
    for (int k = 0; k < o->substep_count; ++k) plan->substeps[k] = (int)o->substeps[k];
    plan->substep_count = o->substep_count;
    for (int k = 0; k < o->iteration_count; ++k) plan->iterations[k] = (int)o->iterations[k];
    plan->iteration_count = o->iteration_count;
    plan->match = o->match >= 0 ? (int)o->match : scene->info->iterations[plan->method];
    plan->frames = frames_in(o->seconds > 0 ? o->seconds : scene->duration, *dt);
    plan->seeds = heap ? (int)o->seeds : 1;
    plan->repeats = o->repeats > 0 ? (int)o->repeats : heap ? 1 : 5;
    plan->starts = (int)(o->starts < plan->frames ? o->starts : plan->frames);
    plan->start_frames = frames_in(o->horizon, *dt);
    plan->reference_halvings = (int)o->reference;
    plan->reference_iterations = (int)o->reference_iterations;
    return 0;
}

static bool available(const struct motion_plan *plan)
{
    for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision)
        if ((plan->precision < 0 || plan->precision == precision) &&
            !bench_is_available(plan->backend, (sadmm_precision)precision, stderr))
            return false;
    return true;
}

static int write_json(const struct motion_study *study, const char *runs_on, struct output *json)
{
    FILE *stream = output_stream(json);
    json_t *document = motion_json(study, runs_on);
    const bool complete = document && json_dumpf(document, stream, JSON_INDENT(2)) == 0;
    putc('\n', stream);
    json_decref(document);
    if (complete || ferror(stream)) return output_close(json);
    fprintf(stderr, "subadmm-bench %s: out of memory for the JSON\n", command);
    return 1;
}

static int run(const struct motion_plan *plan, struct motion_study *study, struct output *json)
{
    char runs_on[128];
    struct sadmm_error error = {SADMM_OK, ""};
    bench_runs_on(plan->backend, runs_on, sizeof runs_on);
    if (motion_study_run(study, plan, &error) != SADMM_OK) {
        fprintf(stderr, "subadmm-bench %s: %s\n", command, error.message);
        return 1;
    }
    if (!outputs_on_stdout()) motion_print(study, runs_on, stdout);
    return json ? write_json(study, runs_on, json) : 0;
}

static int study_plan(const struct options *o, const struct motion_plan *plan)
{
    struct output *json = NULL;
    int code = 0;
    if (!available(plan)) return 1;
    if (o->json && (code = output_open("--json", o->json, OUTPUT_STREAM, &json)) != 0) return code;
    struct motion_study *study = sadmm_alloc(1, sizeof *study);
    code = study ? run(plan, study, json) : wrong("out of memory");
    if (study) motion_study_free(study);
    sadmm_free(study);
    return code;
}

static int run_known(const struct options *o)
{
    struct sadmm_error error = {SADMM_OK, ""};
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_settings_fix_work(&def.settings);
    if (o->json || o->scene != default_scene) return wrong("--known takes neither --scene nor --json");
    if (o->halvings < 1 || o->halvings >= KNOWN_LEVELS)
        return bad_number("halvings", o->halvings, "1 to 4 with --known");
    def.backend = (sadmm_backend)o->backend;
    def.precision = (sadmm_precision)(o->precision < 0 ? SADMM_F64 : o->precision);
    def.device = (int)o->device;
    def.settings.method = (sadmm_method)o->method;
    def.settings.threads = (int)o->threads;
    def.settings.iterations = (int)o->iterations[o->iteration_count - 1];
    if (known_print(&def, (int)o->known, (int)o->halvings + 1, stdout, &error) == SADMM_OK) return 0;
    fprintf(stderr, "subadmm-bench %s: %s\n", command, error.message);
    return 1;
}

int bench_motion(int argc, char **argv)
{
    struct options o = {
        .scene = default_scene, .backend = SADMM_BACKEND_CPU, .precision = SADMM_F32, .method = SADMM_METHOD_FAST,
        .threads = 1, .halvings = 2, .substeps = {1}, .substep_count = 1, .iterations = {20, 60},
        .iteration_count = 2, .match = -1, .seeds = 3,
        .starts = 9, .horizon = 0.05, .reference = 6, .reference_iterations = 300,
    };
    struct motion_plan plan = {0};
    int code = parse(argc, argv, &o);
    if (code) return code < 0 ? 0 : code;
    if (o.known > 0) return run_known(&o);
    code = make_plan(&o, &plan);
    if (code == 0) code = study_plan(&o, &plan);
    sadmm_scene_close(&plan.scene);
    return code;
}
