/* subadmm-bench environments: many copies of a scene stepped together (subadmm/environments.h), by their number and the
 * threads, or on a GPU. Each begins with other velocities. What a step of one takes, how far steps are from the laws,
 * and the memory of one. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/settings_fields.h"
#include "scenes/scenes.h"
#include "subadmm/environments.h"

static const char command[] = "environments";

enum { BODY_COLUMNS = 13, REPORT_COLUMNS = 8, ERROR_COLUMN = 0, UNSOLVED_COLUMN = 1, DRIFT_COLUMN = 3 };
/* m/s, rad/s: the most by which velocities differ from the scene's. */
static const double DISTURBANCE = 0.2;

struct options {
    const char *scenes[BENCH_LIST], *csv;
    int scene_count;
    long counts[BENCH_LIST], threads[BENCH_LIST], steps, warm_up;
    int count_count, thread_count, precision, backend;
    bool fixed;
};

struct figures {
    double us, make_ms, error_median, error_most, drift;
    long unsolved, failed; /* environment steps; environments */
    size_t memory;
};

static sadmm_status of_all(const sadmm_environments *environments, sadmm_status status, struct sadmm_error *error)
{
    return status == SADMM_OK ? status : sadmm_fail(error, status, "%s", sadmm_environments_message(environments));
}

static sadmm_status of_world(sadmm_world *world, sadmm_status status, struct sadmm_error *error)
{
    return status == SADMM_OK ? status : sadmm_fail(error, status, "%s", sadmm_world_message(world));
}

static sadmm_status build(const struct options *o, const char *name, int precision, int threads, sadmm_world **world,
                          struct sadmm_error *error)
{
    struct sadmm_scene scene;
    TRY(sadmm_scene_open(name, &scene, error));
    scene.def.backend = (sadmm_backend)o->backend;
    scene.def.precision = (sadmm_precision)precision;
    if (!o->fixed) { /* what a world has that nobody chose for */
        const sadmm_settings own = sadmm_settings_default();
        scene.def.settings.tolerance = own.tolerance;
        scene.def.settings.iterations = own.iterations;
        scene.def.settings.ncp_points = own.ncp_points;
    }
    scene.def.settings.threads = threads;
    const sadmm_status status = sadmm_scene_build(&scene, world, error);
    sadmm_scene_close(&scene);
    return status;
}

/* Between -1 and 1, the same every time. */
static double noise(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*state >> 11) / (double)(UINT64_C(1) << 52) - 1;
}

static sadmm_status disturb(sadmm_world *world, sadmm_environments *environments, struct sadmm_error *error)
{
    const int32_t bodies = sadmm_world_array_rows(world, SADMM_ARRAY_BODY_STATE),
                  count = sadmm_environments_count(environments);
    double *states = (double *)sadmm_alloc((size_t)count * (size_t)bodies, BODY_COLUMNS * sizeof *states);
    uint64_t state = 1;
    if (!states) return sadmm_fail_memory(error, "states");
    sadmm_status status =
        of_all(environments, sadmm_environments_get(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, states), error);
    for (int32_t i = 0; status == SADMM_OK && i < bodies; ++i) {
        sadmm_body_id id;
        sadmm_body_def def;
        status = of_world(world, sadmm_world_body_at(world, i, &id), error);
        if (status == SADMM_OK) status = of_world(world, sadmm_world_body_def(world, id, &def), error);
        for (int32_t e = 0; status == SADMM_OK && def.type == SADMM_BODY_DYNAMIC && e < count; ++e)
            for (int k = 7; k < BODY_COLUMNS; ++k)
                states[BODY_COLUMNS * ((size_t)e * (size_t)bodies + (size_t)i) + (size_t)k] +=
                    DISTURBANCE * noise(&state);
    }
    if (status == SADMM_OK)
        status =
            of_all(environments, sadmm_environments_set(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, states), error);
    sadmm_free(states);
    return status;
}

/* Errors of all environments after every step; times of all steps together. */
static sadmm_status run_steps(const struct options *o, sadmm_environments *environments, struct figures *out,
                              struct sadmm_error *error)
{
    const size_t count = (size_t)sadmm_environments_count(environments);
    sadmm_environments_array report;
    double *errors = (double *)sadmm_alloc(count * (size_t)o->steps, sizeof *errors), begin,
           *rows = (double *)sadmm_alloc(count * REPORT_COLUMNS, sizeof *rows);
    size_t known = 0;
    if (!errors || !rows) {
        sadmm_free(errors);
        sadmm_free(rows);
        return sadmm_fail_memory(error, "errors");
    }
    sadmm_status status = of_all(environments, sadmm_environments_step(environments, (int32_t)o->warm_up), error);
    begin = sadmm_clock_ms();
    if (status == SADMM_OK) /* nothing is read in between */
        status = of_all(environments, sadmm_environments_step(environments, (int32_t)o->steps), error);
    out->us = 1e3 * (sadmm_clock_ms() - begin) / (double)o->steps / (double)count;
    if (status == SADMM_OK)
        status =
            of_all(environments, sadmm_environments_bind(environments, SADMM_ARRAY_REPORT, SADMM_F64, &report), error);
    for (long step = 0; step < o->steps && status == SADMM_OK && !interrupted(); ++step) {
        status = of_all(environments, sadmm_environments_step(environments, 1), error);
        if (status == SADMM_OK)
            status =
                of_all(environments, sadmm_environments_get(environments, SADMM_ARRAY_REPORT, NULL, 0, rows), error);
        for (size_t e = 0; e < count && status == SADMM_OK; ++e) {
            const double *row = rows + REPORT_COLUMNS * e;
            errors[known++] = row[ERROR_COLUMN];
            out->unsolved += row[UNSOLVED_COLUMN] > 0;
            out->drift = fmax(out->drift, row[DRIFT_COLUMN]);
        }
    }
    if (known > 0) {
        qsort(errors, known, sizeof *errors, bench_compare_doubles);
        out->error_median = errors[known / 2];
        out->error_most = errors[known - 1];
    }
    for (size_t e = 0; e < count; ++e) out->failed += sadmm_environments_marked(environments)[e];
    out->memory = sadmm_environments_memory(environments);
    sadmm_free(errors);
    sadmm_free(rows);
    return status;
}

static sadmm_status measure(const struct options *o, const char *scene, int precision, long count, long threads,
                            struct figures *out, struct sadmm_error *error)
{
    sadmm_world *world = NULL;
    sadmm_environments *environments = NULL;
    *out = (struct figures){0};
    sadmm_status status = build(o, scene, precision, (int)threads, &world, error);
    const double begin = sadmm_clock_ms();
    if (status == SADMM_OK)
        status = of_world(world, sadmm_world_replicate(world, (int32_t)count, &environments), error);
    out->make_ms = sadmm_clock_ms() - begin;
    if (status == SADMM_OK) status = disturb(world, environments, error);
    if (status == SADMM_OK) status = run_steps(o, environments, out, error);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(world);
    return status;
}

static void print(const struct options *o, FILE *table, FILE *csv, const char *scene, int precision, long count,
                  long threads, const struct figures *f)
{
    const char *name = bench_precision_name((sadmm_precision)precision);
    const double unsolved = (double)f->unsolved / ((double)o->steps * (double)count);
    fprintf(table, "%-20s %-4s %8ld %7ld %9.2f %9.4g %9.1e %9.1e %9.2g %9.1e %8zu %8.1f\n", scene, name, count, threads,
            f->us, 1 / f->us, f->error_median, f->error_most, unsolved, f->drift, f->memory, f->make_ms);
    fflush(table);
    if (f->failed > 0) fprintf(table, "    %ld environments failed\n", f->failed);
    if (!csv) return;
    bench_write_csv_scene(csv, scene);
    fprintf(csv, ",%s,%ld,%ld,%ld,%.4g,%.4g,%.4g,%.4g,%.4g,%zu,%.4g,%ld\n", name, count, threads, o->steps, f->us,
            f->error_median, f->error_most, unsolved, f->drift, f->memory, f->make_ms, f->failed);
}

static sadmm_status run(const struct options *o, FILE *csv, struct sadmm_error *error)
{
    FILE *const table = outputs_on_stdout() ? stderr : stdout;
    char machine[128];
    bench_runs_on((sadmm_backend)o->backend, machine, sizeof machine);
    fprintf(table, "%s; %ld steps, %s\n", machine, o->steps,
            o->fixed ? "the scenes' fixed work" : "to the default tolerance");
    fprintf(table,
            "us/step: time of a step of one environment; M/s: million such steps a second; median, most: of the true "
            "errors of\nsteps, m/s; unsolved: share of steps that miss the tolerance; drift: of locked joints; "
            "bytes: of one environment;\nmade: time to make all of them\n");
    fprintf(table, "%-20s %-4s %8s %7s %9s %9s %9s %9s %9s %9s %8s %8s\n", "scene", "", "copies", "threads", "us/step",
            "M/s", "median", "most m/s", "unsolved", "drift m", "bytes", "made ms");
    if (csv)
        fprintf(csv, "scene,precision,environments,threads,steps,us,error_median,error_most,unsolved,drift,bytes,"
                     "make_ms,failed\n");
    for (int s = 0; s < o->scene_count; ++s)
        for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision)
            for (int n = 0; n < o->count_count; ++n)
                for (int t = 0; t < o->thread_count && !interrupted(); ++t) {
                    struct figures figures;
                    if (o->precision >= 0 && o->precision != precision) continue;
                    TRY(measure(o, o->scenes[s], precision, o->counts[n], o->threads[t], &figures, error));
                    print(o, table, csv, o->scenes[s], precision, o->counts[n], o->threads[t], &figures);
                }
    return SADMM_OK;
}

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXTS("scene", "SPEC", o->scenes, &o->scene_count, "default ragdolls:1, grippers:1 and chain:10"),
        BENCH_NUMBERS("environments", o->counts, &o->count_count, 1, 1 << 20, "copies, default 1,16,256"),
        BENCH_NUMBERS("threads", o->threads, &o->thread_count, 0, 1024, "0: as many as there are; default 1"),
        BENCH_NUMBER("steps", &o->steps, 1, 100000, "timed ones, and as many whose errors are read; default 50"),
        BENCH_NUMBER("warm-up", &o->warm_up, 1, 100000, "steps before these, default 20"),
        BENCH_WORD("backend", &o->backend, bench_backends, BENCH_ONE_BACKEND, "default cpu"),
        BENCH_WORD("precision", &o->precision, bench_precisions, 3, "default f64"),
        BENCH_FLAG("fixed", &o->fixed, "the scenes' number of iterations in place of the default tolerance"),
        BENCH_TEXT("csv", "FILE", &o->csv, "the same as a CSV file"),
    };
    return bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
}

int bench_environments(int argc, char **argv)
{
    struct options o = {.scenes = {"ragdolls:1", "grippers:1", "chain:10"},
                        .counts = {1, 16, 256},
                        .threads = {1},
                        .steps = 50,
                        .warm_up = 20,
                        .precision = SADMM_F64,
                        .backend = SADMM_BACKEND_CPU};
    struct sadmm_error error = {SADMM_OK, ""};
    struct output *csv = NULL;
    int code = parse(argc, argv, &o);
    if (code) return code < 0 ? 0 : code;
    if (o.scene_count == 0) o.scene_count = 3;
    if (o.count_count == 0) o.count_count = 3;
    if (o.thread_count == 0) o.thread_count = 1;
    if ((code = bench_check_scenes(command, o.scenes, o.scene_count)) != 0) return code;
    if (o.csv && (code = output_open("--csv", o.csv, OUTPUT_STREAM, &csv)) != 0) return code;
    if (run(&o, csv ? output_stream(csv) : NULL, &error) == SADMM_OK) return output_close(csv);
    fprintf(stderr, "subadmm-bench environments: %s\n", error.message);
    output_drop(csv);
    return 1;
}
