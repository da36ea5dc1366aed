/* subadmm-bench joints: motions and reactions of one body joined to the ground against reference tables
 * (joint_cases.h). The tables are not part of the project: those of Project Chrono's validation data, a folder a test,
 * FOLDER/<test>/<case>_ADAMS_<quantity>.txt with 501 rows from t = 0 to 5 s. An error is the root mean square over the
 * rows of the worst component; a ratio of 1 is what Chrono's own tests accept. */
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/settings_fields.h"
#include "joint_cases.h"
#include "subadmm/world.h"

static const char command[] = "joints";

enum { ROWS = 501, HEADER = 3, LINE = 256 };
static const double instant = 0.01; /* s, between rows */
static const double gravity = 9.80665;

static const char *const names[JOINT_QUANTITIES] = {"Pos",  "Vel",  "Acc",    "Quat",
                                                    "Avel", "Aacc", "Rforce", "Rtorque"};

struct options {
    const char *reference, *only, *json;
    double dt, tolerance; /* s; 0: each case's own */
    long iterations;
    int backend, precision, method;
};

struct figure {
    double error, tolerance;
};

static int width_of(int quantity) { return quantity == JOINT_ORIENTATION ? 4 : 3; }

static sadmm_status read_table(const char *path, int width, double (*rows)[4], struct sadmm_error *error)
{
    char line[LINE];
    FILE *file = fopen(path, "r");
    if (!file) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s: cannot be read", path);
    int done = -HEADER;
    for (; done < ROWS && fgets(line, sizeof line, file); ++done) {
        double time, *row = done >= 0 ? rows[done] : NULL;
        if (!row) continue;
        const int found = sscanf(line, "%lf %lf %lf %lf %lf", &time, &row[0], &row[1], &row[2], &row[3]);
        if (found != width + 1 || fabs(time - done * instant) > 1e-6) break;
    }
    fclose(file);
    return done == ROWS ? SADMM_OK
                        : sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                                     "%s: must be %d lines of text, then %d rows of a time and %d numbers", path,
                                     HEADER, ROWS, width);
}

static double error_of(const struct joint_sample *samples, double (*rows)[4], int quantity)
{
    double worst = 0;
    for (int k = 0; k < width_of(quantity); ++k) {
        double sum = 0;
        for (int i = 0; i < ROWS; ++i) {
            const double off = samples[i].value[quantity][k] - rows[i][k];
            sum += off * off;
        }
        worst = fmax(worst, sqrt(sum / ROWS));
    }
    return worst;
}

static sadmm_status compare(const struct options *o, const struct joint_case *which, const struct joint_sample *samples,
                            double (*rows)[4], struct figure figures[JOINT_QUANTITIES], struct sadmm_error *error)
{
    for (int q = 0; q < JOINT_QUANTITIES; ++q) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%s/%s_ADAMS_%s%s.txt", o->reference, which->folder, which->name, names[q],
                 q >= JOINT_FORCE ? which->force : "");
        sadmm_status status = read_table(path, width_of(q), rows, error);
        if (status != SADMM_OK) return status;
        figures[q] = (struct figure){error_of(samples, rows, q), which->tolerance[q]};
    }
    return SADMM_OK;
}

static int steps_of(double dt) { return (int)(instant / dt + 0.5); }

static sadmm_status run_case(const struct options *o, const struct joint_case *which, double dt,
                             struct joint_sample *samples, struct sadmm_error *error)
{
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world = NULL;
    def.backend = (sadmm_backend)o->backend;
    def.precision = (sadmm_precision)o->precision;
    sadmm_settings_fix_work(&def.settings);
    def.settings.dt = dt;
    def.settings.gravity[2] = -gravity;
    def.settings.method = (sadmm_method)o->method;
    def.settings.iterations = (int)o->iterations;
    def.settings.tolerance = o->tolerance;
    sadmm_status status = joint_case_build(which, &def, &world);
    if (status == SADMM_OK) status = joint_case_run(which, world, steps_of(dt), ROWS, samples);
    if (status != SADMM_OK)
        sadmm_fail(error, status, "%s: %s", which->name, world ? sadmm_world_message(world) : sadmm_last_message());
    sadmm_world_destroy(world);
    return status;
}

static void add_row(json_t *rows, const char *name, const char *quantity, double dt, double error, double tolerance)
{
    json_array_append_new(rows, json_pack("{ss, ss, sf, sf, sf, sf}", "case", name, "quantity", quantity, "dt", dt,
                                          "error", error, "tolerance", tolerance, "ratio",
                                          tolerance > 0 ? error / tolerance : 0.0));
}

static void report(const struct joint_case *which, double dt, const struct figure figures[JOINT_QUANTITIES],
                   double violation, json_t *rows)
{
    double most = 0;
    int worst = 0;
    for (int q = 0; q < JOINT_QUANTITIES; ++q) {
        if (figures[q].tolerance <= 0) continue;
        add_row(rows, which->name, names[q], dt, figures[q].error, figures[q].tolerance);
        if (figures[q].error / figures[q].tolerance <= most) continue;
        most = figures[q].error / figures[q].tolerance;
        worst = q;
    }
    add_row(rows, which->name, "Constraint", dt, violation, 1e-5);
    if (outputs_on_stdout()) return;
    printf("%-20s %7.0e", which->name, dt);
    for (int q = 0; q < JOINT_QUANTITIES; ++q) printf(" %8.1e", figures[q].error);
    printf(" %8.1e %8.3f %s\n", violation, most, names[worst]);
    fflush(stdout);
}

static sadmm_status run(const struct options *o, struct joint_sample *samples, double (*table)[4], json_t *rows,
                        struct sadmm_error *error)
{
    if (!outputs_on_stdout()) {
        printf("rms differences from the tables, in their units; dt, s; locked: of the coordinates a joint locks, m; "
               "worst: the\nlargest over its tolerance\n");
        printf("%-20s %7s", "case", "dt");
        for (int q = 0; q < JOINT_QUANTITIES; ++q) printf(" %8s", names[q]);
        printf(" %8s %8s\n", "locked", "worst");
    }
    for (size_t k = 0; k < joint_case_count() && !interrupted(); ++k) {
        const struct joint_case *which = joint_case_at(k);
        const double dt = o->dt > 0 ? o->dt : which->step;
        struct figure figures[JOINT_QUANTITIES];
        double violation = 0;
        if (o->only && !strstr(which->name, o->only)) continue;
        sadmm_status status = run_case(o, which, dt, samples, error);
        if (status == SADMM_OK) status = compare(o, which, samples, table, figures, error);
        if (status != SADMM_OK) return status;
        for (int i = 0; i < ROWS; ++i) violation = fmax(violation, samples[i].violation);
        report(which, dt, figures, violation, rows);
    }
    return SADMM_OK;
}

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXT("reference", "FOLDER", &o->reference, "of the tables; needed"),
        BENCH_TEXT("only", "TEXT", &o->only, "cases whose name has this in it"),
        BENCH_REAL("dt", "S", &o->dt, 0.005, "step, a whole share of 0.01 s; default each case's own"),
        BENCH_NUMBER("iterations", &o->iterations, 1, 1000000, "a step at most, default 1000"),
        BENCH_REAL("tolerance", "M/S", &o->tolerance, 1, "of the certificate, where iterations stop, default 1e-10"),
        BENCH_WORD("backend", &o->backend, bench_backends, BENCH_ONE_BACKEND, "default cpu"),
        BENCH_WORD("precision", &o->precision, bench_precisions, BENCH_ONE_PRECISION, "default f64"),
        BENCH_WORD("method", &o->method, bench_methods, BENCH_ONE_METHOD, "default fast"),
        BENCH_TEXT("json", "FILE", &o->json, "write the results there; - is standard output"),
    };
    int code = bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
    if (code) return code;
    if (!o->reference) return bench_bad_option(command, "reference", "''", "the folder of the tables");
    if (o->dt > 0 && fabs(instant / o->dt - steps_of(o->dt)) > 1e-6) {
        char value[32];
        snprintf(value, sizeof value, "%g", o->dt);
        return bench_bad_option(command, "dt", value, "0.01 s over a whole number of at least 2");
    }
    return 0;
}

int bench_joints(int argc, char **argv)
{
    struct options o = {.backend = SADMM_BACKEND_CPU, .precision = SADMM_F64, .method = SADMM_METHOD_FAST,
                        .iterations = 1000, .tolerance = 1e-10};
    struct sadmm_error error = {SADMM_OK, ""};
    struct output *out = NULL;
    int code = parse(argc, argv, &o);
    if (code) return code < 0 ? 0 : code;
    if (o.json && (code = output_open("--json", o.json, OUTPUT_STREAM, &out)) != 0) return code;
    struct joint_sample *samples = sadmm_alloc(ROWS, sizeof *samples);
    double(*table)[4] = sadmm_alloc(ROWS, sizeof *table);
    json_t *rows = json_array(), *whole = json_pack("{sO}", "rows", rows);
    sadmm_status status =
        samples && table ? run(&o, samples, table, rows, &error) : sadmm_fail_memory(&error, "the samples");
    if (out && status == SADMM_OK) {
        json_dumpf(whole, output_stream(out), JSON_INDENT(2) | JSON_REAL_PRECISION(6));
        putc('\n', output_stream(out));
        code = output_close(out);
    }
    json_decref(rows);
    json_decref(whole);
    sadmm_free(samples);
    sadmm_free(table);
    if (status == SADMM_OK) return code;
    fprintf(stderr, "subadmm-bench %s: %s\n", command, error.message);
    return status == SADMM_ERROR_INVALID_ARGUMENT ? 2 : 1;
}
