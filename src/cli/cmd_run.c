/* subadmm run: step a scene and say what it cost, how exact it was and where it ended. */
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "cli.h"
#include "core/base/memory.h"
#include "core/base/utf8.h"
#include "fclib/fclib.h"
#include "interrupt.h"
#include "open_scene.h"
#include "run_csv.h"

enum {
    OPTION_BACKEND, OPTION_DEVICE, OPTION_PRECISION, OPTION_STEPS, OPTION_SECONDS, OPTION_DT, OPTION_SUBSTEPS,
    OPTION_METHOD, OPTION_ITERATIONS, OPTION_TOLERANCE, OPTION_CHECK_PERIOD, OPTION_NCP_POINTS, OPTION_PENALTY_PERIOD,
    OPTION_THREADS, OPTION_SET, OPTION_NO_WARM_START, OPTION_CERTIFY, OPTION_EXPLAIN, OPTION_JSON, OPTION_TRACE,
    OPTION_CONTACTS_CSV, OPTION_ERROR_CSV, OPTION_DUMP, OPTION_QUIET
};

static const struct cli_option options[] = {
    [OPTION_BACKEND] = {"backend", "NAME", "auto, ref, cpu or cuda (default auto)"},
    [OPTION_DEVICE] = {"device", "N", "which accelerator (default 0)"},
    [OPTION_PRECISION] = {"precision", "P", "f32 or f64 (default the scene's)"},
    [OPTION_STEPS] = {"steps", "N", "number of steps (default the scene's duration / dt)"},
    [OPTION_SECONDS] = {"seconds", "S", "simulated time instead of --steps, s: S / dt steps, rounded up"},
    [OPTION_DT] = {"dt", "S", "time step, s (default the scene's)"},
    [OPTION_SUBSTEPS] = {"substeps", "N", "sub-steps of a step, which share its iterations (default the scene's)"},
    [OPTION_METHOD] = {"method", "NAME", "paper or fast (default fast)"},
    [OPTION_ITERATIONS] = {"iterations", "N", "iterations a step (default the scene's for the method)"},
    [OPTION_TOLERANCE] = {"tolerance", "T",
                          "end a step's iterations once its true error is below T, m/s (default never)"},
    [OPTION_NCP_POINTS] = {"ncp-points", "N", "joints: dense contact solve of islands of at most N contact points"},
    [OPTION_CHECK_PERIOD] = {"check-period", "N", "iterations between convergence checks (default 10)"},
    [OPTION_PENALTY_PERIOD] = {"penalty-period", "N", "paper: iterations between penalty updates, 0 = never"},
    [OPTION_THREADS] = {"threads", "N", "CPU threads at most, 0 = as many as pay (default)"},
    [OPTION_SET] = {"set", "NAME=VALUE",
                    "any setting (subadmm settings lists them), after the options above; repeatable"},
    [OPTION_NO_WARM_START] = {"no-warm-start", NULL, "start every step from zero impulses"},
    [OPTION_CERTIFY] = {"certify", NULL, "measure the true error of every step"},
    [OPTION_EXPLAIN] = {"explain", NULL, "say what the last step ran, what it left out and why"},
    [OPTION_JSON] = {"json", "[FILE|-]", "write JSON to FILE, or to standard output (-, the default)"},
    [OPTION_TRACE] = {"trace", "FILE", "write every body's state after every step as CSV (-: to standard output)"},
    [OPTION_CONTACTS_CSV] = {"contacts-csv", "FILE", "write every contact of every step as CSV"},
    [OPTION_ERROR_CSV] = {"error-csv", "FILE", "write every step's true error, iterations and time as CSV; certifies"},
    [OPTION_DUMP] = {"dump-problem", "STEP:FILE",
                     "write the contact problem of a step (1: the first; of its last sub-step) as FCLIB HDF5; "
                     "up to 16"},
    [OPTION_QUIET] = {"quiet", NULL, "no progress, no table"},
};

enum { MOST_DUMPS = 16, MOST_SET = 64 };

struct run_dump {
    long step;
    const char *path;
    struct output *output;
};

struct run_options {
    sadmm_backend backend;
    sadmm_precision precision;
    sadmm_method method;
    long steps, iterations, penalty_period, threads; /* -1: the scene's */
    long check_period, substeps;                     /* 0: the scene's */
    long ncp_points;                                 /* -1: the scene's */
    double dt, tolerance;                            /* 0: the scene's */
    double seconds;                                  /* -1: not given */
    long device;
    bool no_warm_start, certify, explain, quiet, precision_given, method_given;
    const char *json, *csv[RUN_CSV_KINDS];
    struct run_dump dumps[MOST_DUMPS];
    size_t dump_count;
    const char *set[MOST_SET];
    size_t set_count;
};

static bool read_dump(struct run_options *o, const char *value)
{
    char step[24];
    const char *colon = strchr(value, ':');
    size_t length = colon ? (size_t)(colon - value) : 0;
    if (length == 0 || length >= sizeof step || colon[1] == 0) {
        cli_error(CLI_USAGE, "--dump-problem '%s': must be STEP:FILE", value);
        return false;
    }
    if (o->dump_count == MOST_DUMPS) {
        cli_error(CLI_USAGE, "--dump-problem '%s': must be one of %d at most", value, MOST_DUMPS);
        return false;
    }
    struct run_dump *dump = &o->dumps[o->dump_count++];
    memcpy(step, value, length);
    step[length] = 0;
    dump->path = colon + 1;
    return cli_read_int("--dump-problem STEP", step, 1, LONG_MAX, &dump->step);
}

static bool keep_setting(struct run_options *o, const char *value)
{
    sadmm_settings any; /* is it a setting at all? */
    if (o->set_count == MOST_SET) {
        cli_error(CLI_USAGE, "--set '%s': must be one of %d at most", value, MOST_SET);
        return false;
    }
    o->set[o->set_count++] = value;
    return cli_read_setting(value, &any);
}

static int set_option(void *target, size_t index, const char *value)
{
    struct run_options *o = target;
    bool ok = true;
    switch (index) {
    case OPTION_BACKEND: ok = cli_read_backend("--backend", value, &o->backend); break;
    case OPTION_DEVICE: ok = cli_read_int("--device", value, 0, 1023, &o->device); break;
    case OPTION_PRECISION:
        ok = cli_read_precision("--precision", value, &o->precision);
        o->precision_given = true;
        break;
    case OPTION_STEPS: ok = cli_read_int("--steps", value, 0, 1000000000, &o->steps); break;
    case OPTION_SECONDS: ok = cli_read_real("--seconds", value, 0, 1e9, &o->seconds); break;
    case OPTION_DT: ok = cli_read_real("--dt", value, 1e-6, 1, &o->dt); break;
    case OPTION_SUBSTEPS: ok = cli_read_int("--substeps", value, 1, SADMM_MOST_SUBSTEPS, &o->substeps); break;
    case OPTION_METHOD:
        ok = cli_read_method("--method", value, &o->method);
        o->method_given = true;
        break;
    case OPTION_ITERATIONS: ok = cli_read_int("--iterations", value, 1, 1000000, &o->iterations); break;
    case OPTION_TOLERANCE: ok = cli_read_real("--tolerance", value, 0, 1, &o->tolerance); break;
    case OPTION_NCP_POINTS:
        ok = cli_read_int("--ncp-points", value, 0, SADMM_MOST_NCP_POINTS, &o->ncp_points);
        break;
    case OPTION_CHECK_PERIOD: ok = cli_read_int("--check-period", value, 1, 1000000, &o->check_period); break;
    case OPTION_PENALTY_PERIOD: ok = cli_read_int("--penalty-period", value, 0, 1000000, &o->penalty_period); break;
    case OPTION_THREADS: ok = cli_read_int("--threads", value, 0, 1024, &o->threads); break;
    case OPTION_SET: ok = keep_setting(o, value); break;
    case OPTION_NO_WARM_START: o->no_warm_start = true; break;
    case OPTION_CERTIFY: o->certify = true; break;
    case OPTION_EXPLAIN: o->explain = true; break;
    case OPTION_JSON: ok = cli_read_output("--json", value, &o->json); break;
    case OPTION_TRACE: ok = cli_read_output("--trace", value, &o->csv[RUN_CSV_TRACE]); break;
    case OPTION_CONTACTS_CSV:
        ok = cli_read_output("--contacts-csv", value, &o->csv[RUN_CSV_CONTACTS]);
        break;
    case OPTION_ERROR_CSV: ok = cli_read_output("--error-csv", value, &o->csv[RUN_CSV_ERROR]); break;
    case OPTION_DUMP: ok = read_dump(o, value); break;
    case OPTION_QUIET: o->quiet = true; break;
    }
    return ok ? CLI_DONE : CLI_USAGE;
}

static void apply(const struct run_options *o, struct sadmm_scene *scene)
{
    sadmm_settings *s = &scene->def.settings;
    scene->def.backend = o->backend;
    scene->def.device = (int)o->device;
    if (o->precision_given) scene->def.precision = o->precision;
    if (o->dt > 0) s->dt = o->dt;
    if (o->method_given) sadmm_scene_set_method(scene, o->method);
    if (o->substeps > 0) s->substeps = (int)o->substeps;
    if (o->iterations >= 0) s->iterations = (int)o->iterations;
    if (o->tolerance > 0) s->tolerance = o->tolerance;
    if (o->ncp_points >= 0) s->ncp_points = (int)o->ncp_points;
    if (o->check_period > 0) s->check_period = (int)o->check_period;
    if (o->penalty_period >= 0) s->penalty_period = (int)o->penalty_period;
    if (o->threads >= 0) s->threads = (int)o->threads;
    if (o->no_warm_start) s->warm_start = false;
    if (o->certify || o->csv[RUN_CSV_ERROR]) s->certify = true;
    for (size_t k = 0; k < o->set_count; ++k) cli_read_setting(o->set[k], s);
}

/* ---- progress ---------------------------------------------------------------------------------------------------- */

struct progress {
    bool shown;
    double next; /* s */
};

static double clock_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void show_progress(struct progress *p, const struct run_record *record, long steps)
{
    double now = clock_seconds();
    if (now < p->next) return;
    p->next = now + 0.1;
    p->shown = true;
    fprintf(stderr, "\rstep %zu of %ld, %d contacts, %.3g ms \033[K", record->steps, steps, record->last.contacts,
            record->last.ms.total);
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

/* Errors are the run's: record->failure. */
__attribute__((format(printf, 2, 3))) static int fail(struct run_record *record, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(record->failure, sizeof record->failure, format, arguments);
    va_end(arguments);
    sadmm_utf8_mend(record->failure); /* names are cut, and JSON has whole characters only */
    return CLI_FAILED;
}

static int dump_problem(struct run_dump *dump, const char *spec, sadmm_world *world, struct run_record *record)
{
    char title[160];
    struct sadmm_error error = {0};
    sadmm_problem *problem = NULL;
    snprintf(title, sizeof title, "%s, step %ld", spec, dump->step);
    sadmm_status status = sadmm_problem_create(&problem);
    if (status != SADMM_OK) sadmm_fail_memory(&error, "the problem of a step");
    else if ((status = sadmm_world_freeze(world, problem)) != SADMM_OK)
        sadmm_fail(&error, status, "%s", sadmm_world_message(world));
    else status = sadmm_fclib_save(problem, output_path(dump->output), title, &error);
    sadmm_problem_destroy(problem);
    if (status != SADMM_OK) return fail(record, "--dump-problem %.80s: %.200s", dump->path, error.message);
    int code = output_close(dump->output);
    if (code != CLI_DONE) fail(record, "--dump-problem %.200s could not be written", dump->path);
    return code;
}

static int dump_problems(struct run_options *o, long step, const char *spec, sadmm_world *world,
                         struct run_record *record)
{
    int code = CLI_DONE;
    for (size_t k = 0; k < o->dump_count && code == CLI_DONE; ++k)
        if (o->dumps[k].step == step) code = dump_problem(&o->dumps[k], spec, world, record);
    return code;
}

/* The last step measures its residuals, whatever the run measures: they are in every report. */
static bool prepare_last_step(sadmm_world *world)
{
    sadmm_settings s = sadmm_world_settings(world);
    s.measure_residuals = true;
    return sadmm_world_set_settings(world, &s) == SADMM_OK;
}

/* After a step, or before the first. */
static int observe(const struct sadmm_scene *scene, sadmm_world *world, struct run_record *record)
{
    struct sadmm_error error = {0};
    if (sadmm_scene_observe(scene, world, (int64_t)record->steps, &record->result, &error) == SADMM_OK) return CLI_DONE;
    return fail(record, "%s", error.message);
}

static int step_all(struct run_options *o, const char *spec, const struct sadmm_scene *scene, sadmm_world *world,
                    struct run_record *record, struct run_csv *csv)
{
    struct progress progress = {0};
    bool watched = !o->quiet && isatty(STDERR_FILENO);
    int code = run_csv_begin(csv, record, world);
    if (code == CLI_DONE) code = observe(scene, world, record);
    for (long step = 0; code == CLI_DONE && step < o->steps && !interrupted(); ++step) {
        struct sadmm_error error = {0};
        if (sadmm_scene_before_step(scene, world, step, &error) != SADMM_OK) {
            code = fail(record, "%s", error.message);
        } else if ((step + 1 == o->steps && !prepare_last_step(world)) || sadmm_world_step(world) != SADMM_OK) {
            code = fail(record, "step %ld: %.280s", step + 1, sadmm_world_message(world));
        } else if (!run_record_step(record, world)) {
            code = CLI_FAILED;
        } else {
            code = run_csv_step(csv, record, world);
            if (code == CLI_DONE) code = observe(scene, world, record);
            if (code == CLI_DONE) code = dump_problems(o, step + 1, spec, world, record);
        }
        if (watched) show_progress(&progress, record, o->steps);
    }
    if (progress.shown) fputs("\r\033[K", stderr);
    return code;
}

/* After the step; to stderr when standard output carries something else. */
static void explain(sadmm_world *world, FILE *out)
{
    size_t size = sadmm_world_explain(world, NULL, 0) + 1;
    char *text = sadmm_alloc(size, 1);
    if (!text) return;
    sadmm_world_explain(world, text, size);
    fprintf(out, "%s%s", text, size > 1 && text[size - 2] != '\n' ? "\n" : "");
    sadmm_free(text);
}

/* What was not reached is not written. */
static void say_missing_dumps(const struct run_options *o, const struct run_record *record)
{
    for (size_t k = 0; k < o->dump_count; ++k)
        if (o->dumps[k].step > (long)record->steps)
            cli_error(CLI_FAILED, "--dump-problem %ld:%s: not written, the run ended after step %zu", o->dumps[k].step,
                      o->dumps[k].path, record->steps);
}

static int run_world(struct run_options *o, const char *spec, const struct sadmm_scene *scene, sadmm_world *world,
                     struct output *json, struct run_csv *csv)
{
    struct run_record record = {0};
    bool mixed = outputs_on_stdout();
    int code = run_record_start(&record, world) ? CLI_DONE : CLI_FAILED;
    if (code == CLI_DONE) {
        code = step_all(o, spec, scene, world, &record, csv);
        if (*record.failure) cli_error(CLI_FAILED, "%s", record.failure);
        say_missing_dumps(o, &record);
        if (!run_record_finish(&record, world) || !record.finite) code = CLI_FAILED;
        if (o->explain) explain(world, mixed ? stderr : stdout);
        if (!o->quiet && !mixed) run_record_print(&record, spec, scene);
        /* A step that failed ends the run: what was written step by step is whole. */
        int listed = run_csv_close(csv);
        int written = json ? cli_write_json(run_record_json(&record, spec, scene), json) : CLI_DONE;
        if (code == CLI_DONE) code = listed != CLI_DONE ? listed : written;
    }
    run_record_free(&record);
    return code;
}

static int open_outputs(struct run_options *o, struct output **json, struct run_csv **csv)
{
    struct sadmm_error error = {0};
    if (o->dump_count > 0 && !sadmm_fclib_available()) {
        sadmm_fclib_save(NULL, NULL, NULL, &error);
        return cli_error(CLI_FAILED, "--dump-problem: %s", error.message);
    }
    int code = cli_open_json(o->json, json);
    if (code == CLI_DONE) code = run_csv_open(o->csv, csv);
    for (size_t k = 0; k < o->dump_count && code == CLI_DONE; ++k)
        code = output_open("--dump-problem", o->dumps[k].path, OUTPUT_FILE, &o->dumps[k].output);
    return code;
}

/* Steps that cover `seconds`: rounded up, but for the rounding of the two numbers and of their quotient. */
static int count_steps(double seconds, double dt, long *steps)
{
    static const double rounding = 1e-12, most = 1e9;
    if (!(dt > 0)) return CLI_DONE; /* the world refuses it */
    const double exact = seconds / dt, nearest = round(exact);
    const double count = fabs(exact - nearest) <= rounding * exact ? nearest : ceil(exact);
    if (count > most)
        return cli_error(CLI_USAGE, "--seconds %g: are %.0f steps of %g s, must be %.0f at most", seconds, count, dt,
                         most);
    *steps = (long)count;
    return CLI_DONE;
}

static int check_options(struct run_options *o, const struct sadmm_scene *scene)
{
    const double dt = scene->def.settings.dt;
    if (o->steps >= 0 && o->seconds >= 0)
        return cli_error(CLI_USAGE, "--steps %ld and --seconds %g: must be one of them", o->steps, o->seconds);
    if (o->seconds >= 0) {
        const int code = count_steps(o->seconds, dt, &o->steps);
        if (code != CLI_DONE) return code;
    } else if (o->steps < 0) {
        o->steps = lround(fmin(scene->duration / dt, 1e9));
    }
    if (o->penalty_period >= 0 && scene->def.settings.method != SADMM_METHOD_PAPER)
        return cli_error(CLI_USAGE, "--penalty-period %ld: takes --method paper, %s has no penalty updates",
                         o->penalty_period, cli_method_name(scene->def.settings.method));
    for (size_t k = 0; k < o->dump_count; ++k)
        if (o->dumps[k].step > o->steps)
            return cli_error(CLI_USAGE, "--dump-problem STEP %ld: must be in [1, %ld], the steps of this run",
                             o->dumps[k].step, o->steps);
    return CLI_DONE;
}

static int run(int argc, char **argv)
{
    struct run_options o = {
        .steps = -1, .seconds = -1, .iterations = -1, .penalty_period = -1, .threads = -1, .ncp_points = -1};
    struct sadmm_scene scene;
    struct sadmm_error error = {0};
    struct output *json;
    struct run_csv *csv = NULL;
    sadmm_world *world = NULL;
    const char *spec;
    int code = cli_parse(&cli_run, argc, argv, set_option, &o, &spec);
    if (code >= 0) return code;
    if ((code = cli_open_scene(spec, &scene)) != CLI_DONE) return code;
    apply(&o, &scene);
    code = check_options(&o, &scene);
    if (code == CLI_DONE) {
        interrupts_expect();
        cli_protect_scene(spec);
        code = open_outputs(&o, &json, &csv);
    }
    if (code == CLI_DONE && sadmm_scene_build(&scene, &world, &error) != SADMM_OK)
        code = cli_error(CLI_FAILED, "%s", error.message);
    if (code == CLI_DONE) code = run_world(&o, spec, &scene, world, json, csv);
    run_csv_free(csv);
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);
    return code;
}

const struct cli_command cli_run = {
    .name = "run",
    .operands = "SCENE",
    .summary = "simulate a scene (subadmm scenes lists them), or a scene file",
    .text =
        "SCENE: name, name:N or name:N:M. What ends in .json or has a / in it is a scene file, as subadmm scenes NAME\n"
        "--json writes it: a world at its beginning, without the script that a scene may follow, and without its\n"
        "measure of success.\n",
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands_min = 1,
    .operands_max = 1,
    .run = run,
};
