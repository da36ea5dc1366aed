/* subadmm-bench rows: what a constraint given by rows costs a scene. The frozen problem of a step with two further
 * bodies (or more pairs of them), without and with a weld between them, solved in turn; an iteration's time is the
 * difference of solves that differ by so many. What is printed are medians: of both times, and of the ratios of
 * neighbours. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/settings_fields.h"
#include "scenes/scenes.h"
#include "subadmm/subadmm.h"

static const char command[] = "rows";

/* Iterations of the shorter solve; by how many two solves differ, on a processor and on an accelerator: some
 * milliseconds, beside which the start of a solve is even. */
enum { BASE_ITERATIONS = 20, HOST_ITERATIONS = 200, DEVICE_ITERATIONS = 4000, MOST_PAIRS = 1000 };

struct options {
    const char *scene;
    int backend, precision, method; /* precision, method -1: both */
    long steps, threads, pairs, welds, iterations; /* iterations 0: by the backend */
};

struct figures {
    double without, with, ratio; /* us an iteration */
};

static sadmm_status of_problem(const sadmm_problem *problem, sadmm_status status, struct sadmm_error *error)
{
    return status == SADMM_OK ? status : sadmm_fail(error, status, "%s", sadmm_problem_message(problem));
}

/* The scene's problem after some steps. */
static sadmm_status freeze(const struct options *o, sadmm_problem *problem, struct sadmm_error *error)
{
    struct sadmm_scene scene;
    sadmm_world *world = NULL;
    sadmm_status status = sadmm_scene_open(o->scene, &scene, error);
    if (status != SADMM_OK) return status;
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = SADMM_F64;
    status = sadmm_scene_build(&scene, &world, error);
    for (long k = 0; k < o->steps && status == SADMM_OK; ++k) {
        status = sadmm_scene_before_step(&scene, world, k, error);
        if (status == SADMM_OK && (status = sadmm_world_step(world)) != SADMM_OK)
            sadmm_fail(error, status, "%s", sadmm_world_message(world));
    }
    if (status == SADMM_OK && (status = sadmm_world_freeze(world, problem)) != SADMM_OK)
        sadmm_fail(error, status, "%s", sadmm_world_message(world));
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);
    return status;
}

/* `to` is `from` with `more` pairs of bodies of 1 kg more, each joined by a hard block of six rows if `welded`. */
static sadmm_status extend(sadmm_problem *from, sadmm_problem *to, long more, bool welded, struct sadmm_error *error)
{
    const int32_t n = sadmm_problem_body_count(from), count = sadmm_problem_contact_count(from);
    const size_t bodies = (size_t)n + 2 * (size_t)more;
    double *A = sadmm_alloc(48 * bodies, sizeof *A), *b = A + 36 * bodies, *v = b + 6 * bodies;
    sadmm_problem_block *welds = sadmm_alloc((size_t)more, sizeof *welds);
    double *impulses = sadmm_alloc(3 * (size_t)count, sizeof *impulses);
    sadmm_problem_contact *contacts = sadmm_alloc((size_t)count, sizeof *contacts);
    sadmm_status status = A && welds && impulses && contacts ? SADMM_OK : sadmm_fail_memory(error, "the problem");
    if (status == SADMM_OK) status = of_problem(from, sadmm_problem_get_bodies(from, A, b, v), error);
    for (int32_t k = 0; k < count && status == SADMM_OK; ++k)
        status = of_problem(from, sadmm_problem_get_contact(from, k, &contacts[k]), error);
    if (status == SADMM_OK)
        status = of_problem(from, sadmm_problem_get_solution(from, NULL, impulses, NULL), error);
    for (size_t i = (size_t)n; status == SADMM_OK && i < bodies; ++i) {
        for (int j = 0; j < 6; ++j) A[36 * i + 7 * (size_t)j] = j < 3 ? 1 : 0.1;
        for (int j = 0; j < 6; ++j)
            b[6 * i + (size_t)j] = i % 2 ? 1 : 2; /* they keep moving: nothing is a denormal number */
    }
    for (int32_t k = 0; status == SADMM_OK && k < (int32_t)more; ++k) {
        welds[k] =
            (sadmm_problem_block){.kind = SADMM_BLOCK_HARD, .rows = 6, .body_a = n + 2 * k, .body_b = n + 2 * k + 1};
        for (int j = 0; j < 6; ++j) welds[k].jacobian_a[7 * j] = -1, welds[k].jacobian_b[7 * j] = 1;
    }
    if (status == SADMM_OK) status = of_problem(to, sadmm_problem_set_bodies(to, (int32_t)bodies, A, b, v), error);
    if (status == SADMM_OK) status = of_problem(to, sadmm_problem_set_contacts(to, count, contacts, impulses), error);
    if (status == SADMM_OK && welded)
        status = of_problem(to, sadmm_problem_set_blocks(to, (int32_t)more, welds, NULL), error);
    sadmm_free(A);
    sadmm_free(welds);
    sadmm_free(impulses);
    sadmm_free(contacts);
    return status;
}

static sadmm_status solve(sadmm_problem *problem, const struct options *o, sadmm_settings settings, int precision,
                          int iterations, double *ms, struct sadmm_error *error)
{
    sadmm_solve_report report;
    settings.iterations = iterations;
    sadmm_status status =
        sadmm_problem_solve(problem, (sadmm_backend)o->backend, (sadmm_precision)precision, &settings, &report);
    *ms = report.solve_ms;
    return of_problem(problem, status, error);
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, bench_compare_doubles);
    return values[count / 2];
}

static sadmm_status measure(sadmm_problem *const problems[2], const struct options *o, sadmm_method method,
                            int precision, struct figures *out, struct sadmm_error *error)
{
    double us[2][MOST_PAIRS], ratio[MOST_PAIRS];
    sadmm_settings settings = sadmm_settings_default();
    sadmm_settings_fix_work(&settings);
    settings.method = method;
    settings.threads = (int)o->threads;
    settings.penalty_period = 0;
    const int iterations = o->iterations > 0                        ? (int)o->iterations
                           : o->backend == SADMM_BACKEND_CUDA ? DEVICE_ITERATIONS
                                                              : HOST_ITERATIONS;
    int done = 0;
    for (long pair = -1; pair < o->pairs && !(interrupted() && done > 0); ++pair) { /* the first one warms up */
        double now[2];
        for (int k = 0; k < 2; ++k) {
            const int which = pair % 2 ? 1 - k : k;
            double base, longer;
            sadmm_status status = solve(problems[which], o, settings, precision, BASE_ITERATIONS, &base, error);
            if (status == SADMM_OK)
                status = solve(problems[which], o, settings, precision, BASE_ITERATIONS + iterations, &longer, error);
            if (status != SADMM_OK) return status;
            now[which] = 1e3 * (longer - base) / iterations;
        }
        if (pair < 0) continue;
        us[0][done] = now[0], us[1][done] = now[1];
        ratio[done++] = now[1] / now[0];
    }
    *out = (struct figures){median(us[0], done), median(us[1], done), median(ratio, done)};
    return SADMM_OK;
}

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXT("scene", "SPEC", &o->scene, "default sliding_cubes:2000"),
        BENCH_NUMBER("steps", &o->steps, 1, 100000, "before the problem is frozen, default 20"),
        BENCH_WORD("backend", &o->backend, bench_backends, BENCH_ONE_BACKEND, "default cpu"),
        BENCH_WORD("method", &o->method, bench_methods, 3, "default both"),
        BENCH_WORD("precision", &o->precision, bench_precisions, 3, "default both"),
        BENCH_NUMBER("threads", &o->threads, 0, 1024, "at most, 0: as many as there are; default 1"),
        BENCH_NUMBER("welds", &o->welds, 1, 1000000, "between two more bodies each, default 1"),
        BENCH_NUMBER("iterations", &o->iterations, 1, 100000, "by which two solves differ, default 200, cuda 4000"),
        BENCH_NUMBER("pairs", &o->pairs, 1, MOST_PAIRS, "solves without and with the block in turn, default 21"),
    };
    return bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
}

static sadmm_status run(const struct options *o, sadmm_problem *const problems[3], struct sadmm_error *error)
{
    sadmm_backend_info info;
    sadmm_status status = freeze(o, problems[2], error);
    for (int k = 0; k < 2 && status == SADMM_OK; ++k)
        status = extend(problems[2], problems[k], o->welds, k == 1, error);
    if (status != SADMM_OK) return status;
    sadmm_backend_query((sadmm_backend)o->backend, &info);
    printf("%s after %ld steps: %d bodies, %d contacts; %ld weld%s between %ld more bodies\n", o->scene, o->steps,
           sadmm_problem_body_count(problems[2]), sadmm_problem_contact_count(problems[2]), o->welds,
           o->welds == 1 ? "" : "s", 2 * o->welds);
    printf("us an iteration, without the welds and with them, each as rows; ratio: median over %ld pairs of solves\n",
           o->pairs);
    printf("%-6s %-5s %-4s %12s %12s %8s\n", "by", "", "in", "without", "with", "ratio");
    for (int method = 0; method < SADMM_METHOD_COUNT; ++method)
        for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision) {
            struct figures figures;
            if (o->method >= 0 && o->method != method) continue;
            if (o->precision >= 0 && o->precision != precision) continue;
            if (o->precision < 0 && !info.available[precision]) continue;
            status = measure(problems, o, (sadmm_method)method, precision, &figures, error);
            if (status != SADMM_OK) return status;
            printf("%-6s %-5s %-4s %12.2f %12.2f %8.3f\n", info.name, bench_word_of(bench_methods, method),
                   bench_precision_name((sadmm_precision)precision), figures.without, figures.with, figures.ratio);
            fflush(stdout);
        }
    return SADMM_OK;
}

int bench_rows(int argc, char **argv)
{
    struct options o = {.scene = "sliding_cubes:2000", .backend = SADMM_BACKEND_CPU, .precision = -1, .method = -1,
                        .steps = 20, .threads = 1, .pairs = 21, .welds = 1};
    struct sadmm_error error = {SADMM_OK, ""};
    sadmm_problem *problems[3] = {NULL, NULL, NULL};
    int code = parse(argc, argv, &o);
    if (code) return code < 0 ? 0 : code;
    sadmm_status status = SADMM_OK;
    for (int k = 0; k < 3 && status == SADMM_OK; ++k) status = sadmm_problem_create(&problems[k]);
    if (status == SADMM_OK) status = run(&o, problems, &error);
    for (int k = 0; k < 3; ++k) sadmm_problem_destroy(problems[k]);
    if (status == SADMM_OK) return 0;
    fprintf(stderr, "subadmm-bench %s: %s\n", command, error.message);
    return status == SADMM_ERROR_INVALID_ARGUMENT ? bench_scene_status(o.scene) : 1;
}
