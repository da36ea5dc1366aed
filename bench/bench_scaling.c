/* subadmm-bench scaling: whole steps of a scene that grows, on the CPU by threads and on the GPU. Times come from steps
 * without a certificate; the errors beside them from further steps of the same run with it. A size that would take too
 * long is left out, and the row says so. bench/plot_scaling.py draws the CSV. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "scene_timing.h"

static const char command[] = "scaling";

struct options {
    const char *scene;
    int backend;     /* SADMM_BACKEND_AUTO: cpu and cuda */
    int precision;   /* -1: both */
    int method;
    long iterations; /* 0: the scene's */
    long sizes[BENCH_LIST], threads[BENCH_LIST], steps, warm_up, certified, device;
    int size_count, thread_count; /* a scene file: one size, 0 */
    double max_seconds;
    const char *csv;
};

/* What is measured at all sizes: a backend in a precision on a number of threads. */
struct series {
    sadmm_backend backend;
    sadmm_precision precision;
    int threads;
    char runs_on[128];
    double size, least_s; /* of the last row: its N, and what warm-up, one timed step and the certificates took */
};

struct row {
    const struct series *series;
    const char *scene;
    struct scene_timing timing;
    char status[SADMM_MESSAGE_SIZE]; /* "ok", "skipped: why" or "failed: why" */
};

/* ---- the rows ---------------------------------------------------------------------------------------------------- */

struct sinks {
    FILE *table; /* NULL: not wanted */
    FILE *csv;
};

static void write_header(const struct sinks *out, const struct options *o)
{
    if (out->csv)
        fputs(
            "scene,backend,threads,precision,runs_on,bodies,contacts,pairs,iterations,steps,"
            "collide_ms,assemble_ms,solve_ms,finish_ms,solver_ms,step_ms,ncp_max,momentum_max,"
            "hash_step,state_hash,commit,status\n",
            out->csv);
    if (!out->table) return;
    fprintf(out->table,
            "medians of up to %ld steps after %ld, ms; solver: all but collide; ncp_max (m/s), momentum: worst of %ld "
            "certified steps\n",
            o->steps, o->warm_up, o->certified);
    fprintf(out->table,
            "thr: CPU threads; iter: iterations a step; steps: timed ones; state: hash of it after the last\n");
    fprintf(out->table, "%-24s %-5s %4s %-4s %9s %5s %9s %9s %9s %9s %9s %9s %5s %8s %8s %16s\n", "scene", "by", "thr",
            "in", "contacts", "iter", "collide", "assemble", "solve", "finish", "solver", "step", "steps", "ncp_max",
            "momentum", "state");
}

static void write_csv(FILE *out, const struct row *row)
{
    const struct scene_timing *t = &row->timing;
    const struct series *s = row->series;
    bench_write_csv_scene(out, row->scene);
    fprintf(out, ",%s,%d,%s,", bench_word_of(bench_backends, (int)s->backend), s->threads,
            bench_precision_name(s->precision));
    bench_write_csv_text(out, s->runs_on);
    if (t->steps > 0)
        fprintf(out, ",%d,%d,%d,%d,%d,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g", t->last.bodies, t->last.contacts, t->last.pairs,
                t->last.iterations, t->steps, t->ms.collide, t->ms.assemble, t->ms.solve, t->ms.finish, t->solver_ms,
                t->ms.total);
    else fputs(",,,,,,,,,,,", out);
    if (t->certified > 0) fprintf(out, ",%.3e,%.3e", t->ncp_max, t->momentum_max);
    else fputs(",,", out);
    if (t->steps > 0) fprintf(out, ",%" PRId64 ",%016" PRIx64, t->last.step, t->state_hash);
    else fputs(",,", out);
    fprintf(out, ",%s,", sadmm_build_commit());
    bench_write_csv_text(out, row->status);
    putc('\n', out);
}

static void write_row(const struct sinks *out, const struct row *row)
{
    const struct scene_timing *t = &row->timing;
    const struct series *s = row->series;
    if (out->csv) {
        write_csv(out->csv, row);
        fflush(out->csv); /* for who watches */
    }
    if (!out->table) return;
    fprintf(out->table, "%-24s %-5s %4d %-4s ", row->scene, bench_word_of(bench_backends, (int)s->backend), s->threads,
            bench_precision_name(s->precision));
    if (t->steps > 0) {
        fprintf(out->table, "%9d %5d %9.3f %9.3f %9.3f %9.3f %9.3f %9.3f %5d ", t->last.contacts, t->last.iterations,
                t->ms.collide, t->ms.assemble, t->ms.solve, t->ms.finish, t->solver_ms, t->ms.total, t->steps);
        if (t->certified > 0) fprintf(out->table, "%8.1e %8.1e ", t->ncp_max, t->momentum_max);
        else fprintf(out->table, "%8s %8s ", "-", "-");
        fprintf(out->table, "%016" PRIx64, t->state_hash);
    }
    if (strcmp(row->status, "ok")) fputs(row->status, out->table);
    putc('\n', out->table);
    fflush(out->table);
}

/* ---- rows ------------------------------------------------------------------------------------------------------ */

/* False: something failed (what is skipped has not failed). */
static bool run_row(const struct options *o, struct series *s, long size, const struct sinks *out)
{
    const struct scene_timing_plan plan = {.warm_up = (int)o->warm_up, .steps = (int)o->steps,
                                           .certified = (int)o->certified, .seconds = o->max_seconds};
    struct sadmm_scene scene;
    struct sadmm_error error = {SADMM_OK, ""};
    char sized[96];
    snprintf(sized, sizeof sized, "%.60s:%ld", o->scene, size);
    const char *const spec = size > 0 ? sized : o->scene;
    struct row row = {.series = s, .scene = spec, .status = "ok"};
    double expected_s = s->size > 0 && size > 0 ? s->least_s * (double)size / s->size : 0;
    sadmm_status status = SADMM_OK;
    if (expected_s > o->max_seconds) {
        snprintf(row.status, sizeof row.status, "skipped: would take %.3g s at least, --max-seconds is %g", expected_s,
                 o->max_seconds);
    } else {
        status = sadmm_scene_open(spec, &scene, &error);
        if (status == SADMM_OK) {
            scene.def.backend = s->backend;
            scene.def.precision = s->precision;
            scene.def.device = (int)o->device;
            scene.def.settings.threads = s->threads;
            sadmm_scene_set_method(&scene, (sadmm_method)o->method);
            if (o->iterations > 0) scene.def.settings.iterations = (int)o->iterations;
            status = scene_timing_run(&scene, &plan, &row.timing, &error);
            sadmm_scene_close(&scene);
        }
        if (status != SADMM_OK) snprintf(row.status, sizeof row.status, "failed: %.300s", error.message);
        else if (row.timing.steps == 0)
            snprintf(row.status, sizeof row.status,
                     "skipped: no step timed within --max-seconds %g (building %.3g s, slowest step %.3g s)",
                     o->max_seconds, row.timing.build_s, row.timing.slowest_step_s);
        if (status == SADMM_OK) {
            double step_s = row.timing.steps > 0 ? 1e-3 * row.timing.ms.total : row.timing.slowest_step_s;
            s->size = (double)size;
            s->least_s = row.timing.build_s + step_s * (double)(o->warm_up + 1 + o->certified);
        }
    }
    if (!interrupted()) write_row(out, &row);
    return status == SADMM_OK && !(out->csv && ferror(out->csv));
}

static bool run_series(const struct options *o, struct series *s, const struct sinks *out)
{
    bool good = true;
    for (int k = 0; k < o->size_count && !interrupted(); ++k)
        if (!run_row(o, s, o->sizes[k], out)) good = false;
    return good;
}

static bool run_cpu(const struct options *o, sadmm_precision precision, const struct sinks *out, FILE *notes)
{
    struct series s = {.backend = SADMM_BACKEND_CPU, .precision = precision};
    int most = bench_machine_threads();
    bool good = true;
    bench_runs_on(SADMM_BACKEND_CPU, s.runs_on, sizeof s.runs_on);
    for (int t = 0; t < o->thread_count; ++t) {
        if (o->threads[t] > most) {
            fprintf(notes, "cpu, %ld threads: left out, this machine has %d\n", o->threads[t], most);
            continue;
        }
        s.threads = (int)o->threads[t];
        s.size = 0;
        if (!run_series(o, &s, out)) good = false;
    }
    return good;
}

/* False: not available although asked for by name, or something failed. */
static bool run_backend(const struct options *o, sadmm_backend backend, sadmm_precision precision,
                        const struct sinks *out, FILE *notes)
{
    if (!bench_is_available(backend, precision, notes)) return o->backend != (int)backend;
    if (backend == SADMM_BACKEND_CPU) return run_cpu(o, precision, out, notes);
    struct series s = {.backend = backend, .precision = precision, .threads = 1};
    bench_runs_on(backend, s.runs_on, sizeof s.runs_on);
    return run_series(o, &s, out);
}

/* ---- command line ---------------------------------------------------------------------------------------------- */

/* A file is what it is: one row a series. */
static int take_file(struct options *o)
{
    if (o->size_count > 0) {
        char size[32];
        snprintf(size, sizeof size, "%ld", o->sizes[0]);
        return bench_bad_option(command, "sizes", size, "left out, for a scene file has a size of its own");
    }
    o->sizes[o->size_count++] = 0;
    return bench_check_scenes(command, &o->scene, 1);
}

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXT("scene", "NAME", &o->scene, "a scene that takes a size, default sliding_cubes; or a scene file"),
        BENCH_NUMBERS("sizes", o->sizes, &o->size_count, 1, 1000000,
                      "ascending; default 100,500,1000,2000,5000,10000,100000,1000000; a file has its own"),
        BENCH_WORD("backend", &o->backend, bench_backends, 4, "all: cpu and cuda (default)"),
        BENCH_NUMBERS("threads", o->threads, &o->thread_count, 1, 1024,
                      "CPU threads at most, default 1,2,4,8,16; more than the machine has are left out"),
        BENCH_WORD("precision", &o->precision, bench_precisions, 3, "default f32"),
        BENCH_WORD("method", &o->method, bench_methods, BENCH_ONE_METHOD, "default fast"),
        BENCH_NUMBER("iterations", &o->iterations, 1, 1000000, "a step; default the scene's for the method"),
        BENCH_NUMBER("device", &o->device, 0, 1023, "accelerator, default 0"),
        BENCH_NUMBER("steps", &o->steps, 1, 100000, "timed steps a row, default 20"),
        BENCH_NUMBER("warm-up", &o->warm_up, 0, 100000, "steps before them, default 5"),
        BENCH_NUMBER("certified", &o->certified, 0, 1000, "steps with the certificate after them, default 1"),
        BENCH_REAL("max-seconds", "S", &o->max_seconds, 86400,
                   "a row; larger sizes that would take longer are skipped; default 60"),
        BENCH_TEXT("csv", "FILE|-", &o->csv, "the rows as CSV"),
    };
    const int code = bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
    if (code) return code;
    if (sadmm_scene_is_file(o->scene) || sadmm_scene_is_model(o->scene)) return take_file(o);
    static const long usual[] = {100, 500, 1000, 2000, 5000, 10000, 100000, 1000000};
    for (size_t k = 0, given = (size_t)o->size_count; given == 0 && k < sizeof usual / sizeof *usual; ++k)
        o->sizes[o->size_count++] = usual[k];
    for (int k = 1; k < o->size_count; ++k)
        if (o->sizes[k] <= o->sizes[k - 1]) {
            char sizes[64];
            snprintf(sizes, sizeof sizes, "%ld,%ld", o->sizes[k - 1], o->sizes[k]);
            return bench_bad_option(command, "sizes", sizes, "ascending");
        }
    /* Before anything is measured: does the scene take the smallest and the largest size? */
    for (int k = 0; k < 2; ++k) {
        struct sadmm_scene scene;
        struct sadmm_error error;
        char spec[96];
        snprintf(spec, sizeof spec, "%.60s:%ld", o->scene, o->sizes[k ? o->size_count - 1 : 0]);
        if (sadmm_scene_open(spec, &scene, &error) != SADMM_OK) {
            fprintf(stderr, "subadmm-bench %s: %s\n", command, error.message);
            return 2;
        }
        sadmm_scene_close(&scene);
    }
    return 0;
}

int bench_scaling(int argc, char **argv)
{
    struct options o = {
        .scene = "sliding_cubes",
        .backend = SADMM_BACKEND_AUTO,
        .precision = SADMM_F32,
        .method = SADMM_METHOD_FAST,
        .threads = {1, 2, 4, 8, 16},
        .thread_count = 5,
        .steps = 20,
        .warm_up = 5,
        .certified = 1,
        .max_seconds = 60,
    };
    static const sadmm_backend order[] = {SADMM_BACKEND_REF, SADMM_BACKEND_CPU, SADMM_BACKEND_CUDA};
    int status = parse(argc, argv, &o);
    if (status) return status < 0 ? 0 : status;
    struct output *csv = NULL;
    if (o.csv && (status = output_open("--csv", o.csv, OUTPUT_STREAM, &csv)) != 0) return status;
    struct sinks out = {.table = outputs_on_stdout() ? NULL : stdout, .csv = csv ? output_stream(csv) : NULL};
    write_header(&out, &o);
    for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision) {
        if (o.precision >= 0 && o.precision != precision) continue;
        for (size_t k = 0; k < sizeof order / sizeof *order; ++k) {
            bool wanted = o.backend == SADMM_BACKEND_AUTO ? order[k] != SADMM_BACKEND_REF : (int)order[k] == o.backend;
            if (wanted && !run_backend(&o, order[k], (sadmm_precision)precision, &out, out.table ? out.table : stderr))
                status = 1;
        }
    }
    int written = output_close(csv);
    return status ? status : written;
}
