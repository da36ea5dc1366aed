/* subadmm-bench kernels: the cost of one iteration (Step 1 included) per contact, and how much of memory's bandwidth it
 * uses. The problem is the lattice of lattice.h; the solve is checked by its certificate, printed beside the time. */
#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/base/clock.h"
#include "core/base/parallel.h"
#include "core/base/settings_fields.h"
#include "core/solve/certificate.h"
#include "core/solve/schedule.h"
#include "lattice.h"

struct options {
    int backend;   /* SADMM_BACKEND_AUTO: all */
    int method;
    int precision; /* -1: both */
    long threads[BENCH_LIST], contacts[BENCH_LIST];
    int thread_count, contact_count;
    double seconds;
    const char *json;
};

struct row {
    sadmm_backend backend;
    const char *name, *variant;
    sadmm_precision precision;
    int threads;
    long contacts, pairs, bodies;
    int iterations;
    double ns, gb_per_s, share, spread;
    sadmm_certificate certificate;
};

/* The bytes an iteration of the reduced form has to move at least: contact (arm, error, lambda read and written), pair
 * (normal, offset, friction, weight, two indices, both wrenches written and read), body (A, H, b, v read and written;
 * fast: the momentum residual, read and written, in place of b). */
static double bytes_per_iteration(const struct lattice *lattice, size_t real, sadmm_method method)
{
    double contact = 10.0 * (double)real, pair = (8 + 2 * 12) * (double)real + 16;
    double body = (7 + 21 + (method == SADMM_METHOD_FAST ? 12 : 6) + 12) * (double)real;
    return contact * (double)lattice->contacts.point_count + pair * (double)lattice->contacts.pair_count +
           body * (double)lattice->system.body_count;
}

static sadmm_status prepare(const struct sadmm_kernels *k, struct sadmm_context *c, struct lattice *lattice,
                            const struct sadmm_settings *settings, const struct sadmm_plan *plan,
                            struct sadmm_error *error)
{
    sadmm_status status = k->begin(c, &lattice->system, plan, settings, error);
    if (status == SADMM_OK) status = k->assemble_bodies(c, error);
    if (status == SADMM_OK) status = k->assemble_contacts(c, error);
    if (status == SADMM_OK) status = k->init_penalty(c, error);
    if (status == SADMM_OK) status = k->factorize(c, error);
    return status;
}

/* `beta` (a number a body) receives what nobody needs. */
static sadmm_status iterate(const struct sadmm_kernels *k, struct sadmm_context *c, int count, double *beta,
                            struct sadmm_error *error)
{
    sadmm_status status = SADMM_OK;
    if (k->iterate) {
        status = k->iterate(c, count, false, false, error);
    } else {
        for (int i = 0; i < count && status == SADMM_OK; ++i) {
            status = k->update_velocity(c, error);
            if (status == SADMM_OK) status = k->update_constraints(c, false, error);
        }
    }
    /* A device returns before it is done: reading something small waits for it. */
    return status == SADMM_OK && k->backend == SADMM_BACKEND_CUDA ? k->read_penalty(c, beta, error) : status;
}

/* Median over batches of `batch` iterations; the first batch warms up. */
static sadmm_status measure(const struct sadmm_kernels *k, struct sadmm_context *c, double seconds, double *beta,
                            struct row *row, struct sadmm_error *error)
{
    enum { MAX_BATCHES = 200 };
    sadmm_status status = iterate(k, c, 2, beta, error);
    double times[MAX_BATCHES], begin = sadmm_clock_ms();
    if (status == SADMM_OK) status = iterate(k, c, 2, beta, error);
    double once = (sadmm_clock_ms() - begin) / 2;
    int batch = once > 0 ? (int)(seconds * 1e3 / 20 / once) : 1000, batches = 0;
    if (batch < 10) batch = 10;
    if (batch > 100000) batch = 100000;
    begin = sadmm_clock_ms();
    while (status == SADMM_OK && !interrupted() && batches < MAX_BATCHES &&
           (batches < 3 || sadmm_clock_ms() - begin < seconds * 1e3)) {
        double start = sadmm_clock_ms();
        status = iterate(k, c, batch, beta, error);
        times[batches++] = (sadmm_clock_ms() - start) / batch;
        row->iterations += batch;
    }
    if (status != SADMM_OK || batches == 0) return status;
    row->iterations += 4;
    qsort(times, (size_t)batches, sizeof *times, bench_compare_doubles);
    double median = times[batches / 2];
    row->ns = 1e6 * median / (double)row->contacts;
    row->spread = (times[batches - 1 - batches / 10] - times[batches / 10]) / median;
    return SADMM_OK;
}

/* On as many threads as asked for, whether or not they pay. */
static sadmm_status run_row(const struct sadmm_kernels *k, struct lattice *lattice, sadmm_method method, double seconds,
                            struct row *row, struct sadmm_error *error)
{
    struct sadmm_settings settings = sadmm_settings_default();
    sadmm_settings_fix_work(&settings);
    settings.method = method;
    settings.threads = row->threads;
    settings.penalty_period = 0;
    lattice_reset(lattice);
    sadmm_test_force_threads(true);
    struct sadmm_plan plan = sadmm_plan_make(&lattice->system, &settings);
    struct sadmm_context *context = NULL;
    sadmm_status status = k->create(0, &context, error);
    if (status != SADMM_OK) return status;
    status = prepare(k, context, lattice, &settings, &plan, error);
    row->bodies = lattice->system.body_count;
    row->pairs = (long)lattice->contacts.pair_count;
    row->contacts = (long)lattice->contacts.point_count;
    double *beta = calloc((size_t)row->bodies, sizeof *beta);
    if (status == SADMM_OK && !beta) status = sadmm_fail_memory(error, "the penalties");
    if (status == SADMM_OK) status = measure(k, context, seconds, beta, row, error);
    free(beta);
    if (status == SADMM_OK) status = k->read_solution(context, error);
    if (status == SADMM_OK) status = sadmm_certify(&lattice->system, &settings, &row->certificate, error);
    k->destroy(context);
    row->gb_per_s = bytes_per_iteration(lattice, k->precision == SADMM_F32 ? 4 : 8, settings.method) /
                    (row->ns * (double)row->contacts);
    return status;
}

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_WORD("backend", &o->backend, bench_backends, 4, "default all (ref up to 10,000 contacts)"),
        BENCH_WORD("precision", &o->precision, bench_precisions, 3, "default both"),
        BENCH_WORD("method", &o->method, bench_methods, BENCH_ONE_METHOD,
                   "default fast; tables that do not have the method are left out"),
        BENCH_NUMBERS("threads", o->threads, &o->thread_count, 1, 1024, "CPU threads, default 1,2"),
        BENCH_NUMBERS("contacts", o->contacts, &o->contact_count, 1, 20000000, "default 1000,10000,100000,1000000"),
        BENCH_REAL("seconds", "S", &o->seconds, 600, "time spent on each row, default 1"),
        BENCH_TEXT("json", "FILE|-", &o->json,
                   "rows[] of {backend, precision, threads, contacts, ns_per_contact_iteration, gb_per_s, ...}"),
    };
    return bench_parse("kernels", options, sizeof options / sizeof *options, NULL, argc, argv);
}

static json_t *row_json(const struct row *row)
{
    return json_pack("{s:s, s:s, s:s, s:i, s:I, s:I, s:I, s:i, s:f, s:f, s:f, s:f, s:{s:f, s:f}}", "backend", row->name,
                     "variant", row->variant, "precision", bench_precision_name(row->precision), "threads",
                     row->threads, "contacts", (json_int_t)row->contacts, "pairs", (json_int_t)row->pairs, "bodies",
                     (json_int_t)row->bodies, "iterations", row->iterations, "ns_per_contact_iteration", row->ns,
                     "gb_per_s", row->gb_per_s, "bandwidth_share", row->share, "spread", row->spread, "certificate",
                     "ncp_max", row->certificate.ncp_max, "momentum_max", row->certificate.momentum_max);
}

int bench_kernels(int argc, char **argv)
{
    struct options o = {
        .backend = SADMM_BACKEND_AUTO, .precision = -1, .method = SADMM_METHOD_FAST,
        .threads = {1, 2}, .thread_count = 2,
        .contacts = {1000, 10000, 100000, 1000000}, .contact_count = 4, .seconds = 1,
    };
    int status = parse(argc, argv, &o);
    if (status) return status < 0 ? 0 : status;
    struct output *json = NULL;
    if (o.json && (status = output_open("--json", o.json, OUTPUT_STREAM, &json)) != 0) return status;
    bool quiet = outputs_on_stdout();
    json_t *rows = json_array(), *bandwidths = json_array();
    double bandwidth[BENCH_LIST];
    for (int t = 0; t < o.thread_count && !interrupted(); ++t) {
        bandwidth[t] = bench_memory_bandwidth((int)o.threads[t]);
        json_array_append_new(bandwidths,
                              json_pack("{s:i, s:f}", "threads", (int)o.threads[t], "gb_per_s", bandwidth[t]));
        if (!quiet)
            printf("memory, %ld thread%s: %.1f GB/s (copy)\n", o.threads[t], o.threads[t] == 1 ? "" : "s",
                   bandwidth[t]);
    }
    if (!quiet)
        printf("ns/cont/it: time of an iteration over contacts; GB/s: what it must move; of mem: that over the copy's; "
               "ncp_max, m/s\n"
               "%-5s %-8s %-4s %7s %9s %11s %8s %7s %10s\n",
               "by", "variant", "in", "threads", "contacts", "ns/cont/it", "GB/s", "of mem", "ncp_max");
    for (int size = 0; size < o.contact_count && status == 0 && !interrupted(); ++size) {
        struct lattice lattice;
        if (!lattice_create(&lattice, o.contacts[size])) {
            fprintf(stderr, "subadmm-bench kernels: out of memory at %ld contacts\n", o.contacts[size]);
            status = 1;
            break;
        }
        const struct sadmm_kernels *k;
        for (size_t index = 0; (k = sadmm_kernels_at(index)) != NULL && status == 0 && !interrupted(); ++index) {
            if (o.backend != SADMM_BACKEND_AUTO && (int)k->backend != o.backend) continue;
            if (o.precision >= 0 && (int)k->precision != o.precision) continue;
            if (o.method == SADMM_METHOD_FAST && !k->update_weights) continue;
            if (k->backend == SADMM_BACKEND_REF && o.contacts[size] > 10000 && o.backend != SADMM_BACKEND_REF) continue;
            for (int t = 0; t < (k->backend == SADMM_BACKEND_CPU ? o.thread_count : 1) && status == 0; ++t) {
                sadmm_backend_info info;
                struct sadmm_error error = {SADMM_OK, ""};
                sadmm_backend_query(k->backend, &info);
                struct row row = {.backend = k->backend, .name = info.name, .variant = k->variant,
                                  .precision = k->precision,
                                  .threads = k->backend == SADMM_BACKEND_CPU ? (int)o.threads[t] : 1};
                if (run_row(k, &lattice, (sadmm_method)o.method, o.seconds, &row, &error) != SADMM_OK) {
                    fprintf(stderr, "subadmm-bench kernels: %s\n", error.message);
                    status = 1;
                    break;
                }
                if (interrupted()) break;
                row.share = k->backend == SADMM_BACKEND_CUDA ? 0 : row.gb_per_s / bandwidth[t];
                if (!quiet) {
                    printf("%-5s %-8s %-4s %7d %9ld %11.2f %8.2f %6.0f%% %10.1e\n", row.name, row.variant,
                           bench_precision_name(row.precision), row.threads, row.contacts, row.ns, row.gb_per_s,
                           100 * row.share, row.certificate.ncp_max);
                    fflush(stdout);
                }
                json_array_append_new(rows, row_json(&row));
            }
        }
        lattice_destroy(&lattice);
    }
    json_t *document =
        json_pack("{s:s, s:s, s:b, s:s, s:s, s:o, s:o}", "bench", "kernels", "method",
                  bench_word_of(bench_methods, o.method), "interrupted", interrupted() != 0, "commit",
                  sadmm_build_commit(), "compiler", sadmm_build_compiler(), "memory", bandwidths, "rows", rows);
    if (status == 0 && json) {
        FILE *stream = output_stream(json);
        bool complete = json_dumpf(document, stream, JSON_INDENT(2)) == 0;
        putc('\n', stream);
        if (complete || ferror(stream)) {
            status = output_close(json);
        } else {
            fprintf(stderr, "subadmm-bench kernels: out of memory for the JSON\n");
            status = 1;
        }
    }
    json_decref(document);
    return status;
}
