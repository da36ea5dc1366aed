/* subadmm-bench convergence: how many iterations, and how much time, each method takes to a tolerance on a set of cold
 * problems, and how far from the solution a scene's steps are when they do few. docs/internals/accuracy.md says how to
 * read it; bench/plot_convergence.py draws the CSV. */
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cold_convergence.h"
#include "scenes/scenes.h"
#include "warm_convergence.h"

static const char command[] = "convergence";

enum part { PART_COLD, PART_WARM };

struct options {
    int backend;                 /* SADMM_BACKEND_AUTO: cpu and cuda */
    int precision, method, only; /* -1: both; only: of enum part */
    long threads[BENCH_LIST], budgets[BENCH_LIST], limit, device;
    int thread_count, budget_count;
    double seconds; /* 0: each scene's own */
    double max_seconds;
    bool quick;
    const char *problem; /* NULL: all; else those with it in their name */
    const char *files[BENCH_LIST], *scenes[BENCH_LIST];
    int file_count, scene_count;
    const char *csv;
};

/* What is measured, in what, and where it goes. */
struct bench {
    const struct options *o;
    struct series series;
    struct rows *rows;
    bool failed;
};

/* Simulated seconds and, where it is not the scene's, dt. */
static const struct {
    const char *spec;
    double seconds, dt;
    bool quick;
} scenes[] = {
    {"vertical_stacks", 2, 0, false},
    {"oblique_stacks", 2, 0, false},
    {"card_houses:1", 1, 0, false},
    {"sliding_cubes:500", 1, 0, false},
    {"pyramid:30", 2, 0, false},
    {"pyramid:100", 2, 1.0 / 60, false},
    {"settled_pile:1000", 1, 0, false},
    {"pile:300", 2, 0, false},
    {"mixed_pile:200", 2, 0, false},
    {"sliding_pile:200", 2, 0, false},
    {"kicked_cubes", 2, 0, false},
    {"burst:3", 1, 0, false},
    {"incline", 1, 0, true},
};

/* ---- measuring ------------------------------------------------------------------------------------------------- */

static void report(struct bench *b, const char *what, sadmm_status status, const struct sadmm_error *error)
{
    if (status == SADMM_OK) return;
    fprintf(stderr, "subadmm-bench %s: %s: %s\n", command, what, error->message);
    b->failed = true;
}

static bool wanted_method(const struct options *o, int method) { return o->method < 0 || o->method == method; }

static void progress(const struct bench *b, const char *what, int method)
{
    if (!b->o->quick) fprintf(stderr, "%s, %s\n", what, method == SADMM_METHOD_FAST ? "fast" : "paper");
}

static void measure_problem(struct bench *b, struct set_problem *problem)
{
    struct sadmm_error error = {SADMM_OK, ""};
    const struct cold_plan plan = {.limit = (int)b->o->limit, .time_ms = b->o->quick ? 1 : 20};
    for (int method = 0; method < SADMM_METHOD_COUNT; ++method) {
        if (!wanted_method(b->o, method) || interrupted()) continue;
        progress(b, problem->name, method);
        report(b, problem->name, cold_convergence(problem, (sadmm_method)method, &b->series, &plan, b->rows, &error),
               &error);
    }
    problem_set_free(problem);
}

static void measure_cold(struct bench *b)
{
    struct sadmm_error error = {SADMM_OK, ""};
    struct set_problem problem;
    for (size_t k = 0; k < problem_set_count() && !interrupted(); ++k) {
        if (b->o->problem ? !strstr(problem_set_name(k), b->o->problem) : b->o->quick && !problem_set_quick(k))
            continue;
        sadmm_status status = problem_set_make(k, &problem, &error);
        report(b, problem_set_name(k), status, &error);
        if (status == SADMM_OK) measure_problem(b, &problem);
    }
    for (int k = 0; k < b->o->file_count && !interrupted(); ++k) {
        sadmm_status status = problem_set_load(b->o->files[k], &problem, &error);
        report(b, b->o->files[k], status, &error);
        if (status == SADMM_OK) measure_problem(b, &problem);
    }
}

static void measure_scene(struct bench *b, const char *spec, double seconds, double dt)
{
    struct sadmm_error error = {SADMM_OK, ""};
    struct warm_plan plan = {.scene = spec,
                             .dt = dt,
                             .max_seconds = b->o->max_seconds,
                             .seconds = b->o->seconds > 0 ? b->o->seconds : seconds};
    for (int k = 0; k < b->o->budget_count; ++k)
        for (int method = 0; method < SADMM_METHOD_COUNT; ++method) {
            if (!wanted_method(b->o, method) || interrupted()) continue;
            plan.iterations = (int)b->o->budgets[k];
            progress(b, spec, method);
            report(b, spec,
                   warm_convergence(&plan, (sadmm_method)method, &b->series, (int)b->o->device, b->rows, &error),
                   &error);
        }
}

static void measure_warm(struct bench *b)
{
    for (int k = 0; k < b->o->scene_count; ++k) measure_scene(b, b->o->scenes[k], 2, 0);
    if (b->o->scene_count > 0) return;
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; ++k)
        if (!b->o->quick || scenes[k].quick) measure_scene(b, scenes[k].spec, scenes[k].seconds, scenes[k].dt);
}

static void measure_series(struct bench *b)
{
    if (b->o->only != PART_WARM) measure_cold(b);
    if (b->o->only != PART_COLD) measure_warm(b);
    FILE *out = outputs_on_stdout() ? stderr : stdout;
    rows_print_cold(b->rows, &b->series, out);
    rows_print_warm(b->rows, &b->series, out);
    fflush(out);
}

/* Not available although asked for by name: a failure. */
static void measure_backend(struct bench *b, sadmm_backend backend, sadmm_precision precision)
{
    if (!bench_is_available(backend, precision, stderr)) {
        if (b->o->backend == (int)backend) b->failed = true;
        return;
    }
    b->series = (struct series){.backend = backend, .precision = precision, .threads = 1};
    bench_runs_on(backend, b->series.runs_on, sizeof b->series.runs_on);
    for (int t = 0; t < (backend == SADMM_BACKEND_CPU ? b->o->thread_count : 1) && !interrupted(); ++t) {
        if (backend == SADMM_BACKEND_CPU) b->series.threads = (int)b->o->threads[t];
        measure_series(b);
    }
}

/* ---- command line ---------------------------------------------------------------------------------------------- */

static int parse(int argc, char **argv, struct options *o)
{
    static const struct bench_word parts[] = {{"cold", PART_COLD}, {"warm", PART_WARM}};
    const struct bench_option options[] = {
        BENCH_WORD("method", &o->method, bench_methods, 3, "default both"),
        BENCH_WORD("backend", &o->backend, bench_backends, 4, "all: cpu and cuda; default cpu"),
        BENCH_WORD("precision", &o->precision, bench_precisions, 3,
                   "default f64; errors are measured in double in both"),
        BENCH_NUMBERS("threads", o->threads, &o->thread_count, 1, 1024, "CPU threads at most, default 1"),
        BENCH_NUMBER("device", &o->device, 0, 1023, "accelerator, default 0"),
        BENCH_WORD("only", &o->only, parts, 2, "one of the two parts of the measurements"),
        BENCH_TEXT("problem", "TEXT", &o->problem, "only the cold problems with TEXT in their name"),
        BENCH_TEXTS("fclib", "FILE.hdf5", o->files, &o->file_count, "one more cold problem; up to 16 times"),
        BENCH_NUMBER("limit", &o->limit, 1, 1000000, "most iterations of a cold solve, default 2000"),
        BENCH_TEXTS("scene", "SPEC", o->scenes, &o->scene_count,
                    "these scenes instead of the default ones; up to 16 times"),
        BENCH_NUMBERS("budgets", o->budgets, &o->budget_count, 1, 1000000, "iterations a step, default 5,10,20,30"),
        BENCH_REAL("seconds", "S", &o->seconds, 3600, "simulated time of a scene, default 1 or 2 by scene"),
        BENCH_REAL("max-seconds", "S", &o->max_seconds, 86400, "wall time of a scene's run, default 60"),
        BENCH_FLAG("quick", &o->quick, "a few small problems and one scene"),
        BENCH_TEXT("csv", "FILE|-", &o->csv, "the rows as CSV"),
    };
    const int code = bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
    return code ? code : bench_check_scenes(command, o->scenes, o->scene_count);
}

int bench_convergence(int argc, char **argv)
{
    struct options o = {
        .backend = SADMM_BACKEND_CPU,
        .precision = SADMM_F64,
        .method = -1,
        .threads = {1},
        .thread_count = 1,
        .budgets = {5, 10, 20, 30},
        .budget_count = 4,
        .limit = 2000,
        .max_seconds = 60,
        .only = -1,
    };
    static const sadmm_backend order[] = {SADMM_BACKEND_REF, SADMM_BACKEND_CPU, SADMM_BACKEND_CUDA};
    int status = parse(argc, argv, &o);
    if (status) return status < 0 ? 0 : status;
    struct rows rows = {0};
    struct bench b = {.o = &o, .rows = &rows};
    struct output *csv = NULL;
    if (o.csv && (status = output_open("--csv", o.csv, OUTPUT_STREAM, &csv)) != 0) return status;
    if (csv) rows_write_header(rows.csv = output_stream(csv));
    for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision) {
        if (o.precision >= 0 && o.precision != precision) continue;
        for (size_t k = 0; k < sizeof order / sizeof *order; ++k)
            if (o.backend == SADMM_BACKEND_AUTO ? order[k] != SADMM_BACKEND_REF : (int)order[k] == o.backend)
                measure_backend(&b, order[k], (sadmm_precision)precision);
    }
    status = output_close(csv);
    rows_free(&rows);
    return b.failed ? 1 : status;
}
