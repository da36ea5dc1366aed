/* subadmm-bench precision: error against run time of a frozen problem, for every backend, precision and method, and
 * which of them comes to 1e-3, 1e-5 and 1e-8 m/s first. bench/plot_convergence.py draws the CSV. */
#include <math.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cold_convergence.h"
#include "scenes/scenes.h"

static const char command[] = "precision";

static const double levels[] = {1e-3, 1e-5, 1e-8}; /* m/s */
enum { LEVELS = sizeof levels / sizeof *levels };

struct options {
    int backend;           /* SADMM_BACKEND_AUTO: cpu and cuda */
    int precision, method; /* -1: both */
    long threads[BENCH_LIST], limit, device, steps;
    int thread_count;
    bool quick;
    const char *problem;
    const char *files[BENCH_LIST], *scenes[BENCH_LIST];
    int file_count, scene_count;
    const char *csv;
};

struct bench {
    const struct options *o;
    struct rows rows;
    size_t first; /* row of the problem at hand */
    FILE *out;
    bool failed;
};

static void report(struct bench *b, const char *what, sadmm_status status, const struct sadmm_error *error)
{
    if (status == SADMM_OK) return;
    fprintf(stderr, "subadmm-bench %s: %s: %s\n", command, what, error->message);
    b->failed = true;
}

/* ---- tables ---------------------------------------------------------------------------------------------------- */

static bool same_run(const struct row *a, const struct row *b)
{
    return a->method == b->method && a->series.backend == b->series.backend &&
           a->series.precision == b->series.precision && a->series.threads == b->series.threads;
}

/* The first point of a run's curve from which errors stay below; NULL: there is none. `run`: its first row. */
static const struct row *reaches(const struct bench *b, const struct row *run, double level)
{
    const struct row *found = NULL;
    for (size_t k = b->first; k < b->rows.count; ++k) {
        const struct row *r = &b->rows.rows[k];
        if (r->kind != ROW_CURVE || !same_run(r, run)) continue;
        if (!(r->ncp_balanced <= level)) found = NULL;
        else if (!found) found = r;
    }
    return found;
}

static double least_error(const struct bench *b, const struct row *run)
{
    double least = INFINITY;
    for (size_t k = b->first; k < b->rows.count; ++k)
        if (b->rows.rows[k].kind == ROW_CURVE && same_run(&b->rows.rows[k], run))
            least = fmin(least, b->rows.rows[k].ncp_balanced);
    return least;
}

static void print_name(FILE *out, const struct row *r)
{
    fprintf(out, "%s %s", bench_word_of(bench_backends, (int)r->series.backend),
            bench_precision_name(r->series.precision));
    if (r->series.backend == SADMM_BACKEND_CPU && r->series.threads > 1) fprintf(out, " x %d", r->series.threads);
    fprintf(out, " %s", bench_word_of(bench_methods, (int)r->method));
}

static bool begins_run(const struct bench *b, size_t at)
{
    if (b->rows.rows[at].kind != ROW_CURVE) return false;
    for (size_t k = b->first; k < at; ++k)
        if (b->rows.rows[k].kind == ROW_CURVE && same_run(&b->rows.rows[k], &b->rows.rows[at])) return false;
    return true;
}

static void print_runs(const struct bench *b)
{
    fprintf(b->out, "| backend, precision, method | ms (iterations) to 1e-3 m/s | 1e-5 | 1e-8 | least error |\n"
                    "|---|---|---|---|---|\n");
    for (size_t k = b->first; k < b->rows.count; ++k) {
        const struct row *run = &b->rows.rows[k];
        if (!begins_run(b, k)) continue;
        fputs("| ", b->out);
        print_name(b->out, run);
        for (int level = 0; level < LEVELS; ++level) {
            const struct row *r = reaches(b, run, levels[level]);
            if (r) fprintf(b->out, " | %.3g (%d)", r->ms, r->iterations);
            else fputs(" | -", b->out);
        }
        fprintf(b->out, " | %.1e |\n", least_error(b, run));
    }
}

/* Of all runs, or of one backend alone. */
static const struct row *soonest(const struct bench *b, double level, int backend)
{
    const struct row *best = NULL;
    for (size_t k = b->first; k < b->rows.count; ++k) {
        if (!begins_run(b, k) || (backend >= 0 && (int)b->rows.rows[k].series.backend != backend)) continue;
        const struct row *r = reaches(b, &b->rows.rows[k], level);
        if (r && (!best || r->ms < best->ms)) best = r;
    }
    return best;
}

static void print_soonest(const struct bench *b)
{
    for (int level = 0; level < LEVELS; ++level) {
        const struct row *best = soonest(b, levels[level], -1);
        fprintf(b->out, "%.0e m/s first: ", levels[level]);
        if (!best) {
            fputs("none comes there\n", b->out);
            continue;
        }
        print_name(b->out, best);
        fprintf(b->out, ", %d iterations, %.3g ms", best->iterations, best->ms);
        const struct row *cpu = soonest(b, levels[level], SADMM_BACKEND_CPU),
                         *gpu = soonest(b, levels[level], SADMM_BACKEND_CUDA);
        if (cpu && gpu) fprintf(b->out, "; cuda %.3g times as fast as cpu", cpu->ms / gpu->ms);
        putc('\n', b->out);
    }
}

/* ---- measuring ------------------------------------------------------------------------------------------------- */

static void measure_backend(struct bench *b, struct set_problem *problem, const struct reference_solution *reference,
                            sadmm_backend backend, sadmm_precision precision)
{
    struct sadmm_error error = {SADMM_OK, ""};
    const struct cold_plan plan = {.limit = (int)b->o->limit,
                                   .time_ms = b->o->quick ? 1 : 20,
                                   .density = 2,
                                   .enough = precision == SADMM_F32 ? 0 : 1e-10,
                                   .reference = reference};
    struct series series = {.backend = backend, .precision = precision, .threads = 1};
    if (!bench_is_available(backend, precision, stderr)) {
        if (b->o->backend == (int)backend) b->failed = true;
        return;
    }
    bench_runs_on(backend, series.runs_on, sizeof series.runs_on);
    report(b, problem->name, sadmm_problem_set_device(problem->problem, (int)b->o->device), &error);
    for (int t = 0; t < (backend == SADMM_BACKEND_CPU ? b->o->thread_count : 1); ++t) {
        if (backend == SADMM_BACKEND_CPU) series.threads = (int)b->o->threads[t];
        for (int method = 0; method < SADMM_METHOD_COUNT; ++method) {
            if ((b->o->method >= 0 && b->o->method != method) || interrupted()) continue;
            report(b, problem->name,
                   cold_convergence(problem, (sadmm_method)method, &series, &plan, &b->rows, &error), &error);
        }
    }
}

static void measure(struct bench *b, struct set_problem *problem)
{
    static const sadmm_backend order[] = {SADMM_BACKEND_REF, SADMM_BACKEND_CPU, SADMM_BACKEND_CUDA};
    struct reference_solution reference = {0};
    struct sadmm_error error = {SADMM_OK, ""};
    const bool fits = reference_fits(problem->problem);
    fprintf(b->out, "%s: %d bodies, %d contacts, %d constraints given by rows; ", problem->name,
            sadmm_problem_body_count(problem->problem), sadmm_problem_contact_count(problem->problem),
            sadmm_problem_block_count(problem->problem));
    if (fits) report(b, problem->name, reference_solve(problem->problem, &reference, &error), &error);
    if (reference.velocities) fprintf(b->out, "reference by Newton's method, natural map %.1e m/s\n", reference.error);
    else if (fits) fprintf(b->out, "no reference: Newton's method ends at %.1e m/s\n", reference.error);
    else fprintf(b->out, "no reference: more than %d impulses\n", REFERENCE_MOST);
    b->first = b->rows.count;
    for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision) {
        if (b->o->precision >= 0 && b->o->precision != precision) continue;
        for (size_t k = 0; k < sizeof order / sizeof *order; ++k)
            if (b->o->backend == SADMM_BACKEND_AUTO ? order[k] != SADMM_BACKEND_REF : (int)order[k] == b->o->backend)
                measure_backend(b, problem, reference.velocities ? &reference : NULL, order[k],
                                (sadmm_precision)precision);
    }
    print_runs(b);
    print_soonest(b);
    putc('\n', b->out);
    fflush(b->out);
    reference_free(&reference);
    problem_set_free(problem);
}

static void measure_all(struct bench *b)
{
    struct sadmm_error error = {SADMM_OK, ""};
    struct set_problem problem;
    for (int k = 0; k < b->o->scene_count && !interrupted(); ++k) {
        const sadmm_status status = problem_set_freeze(b->o->scenes[k], (int)b->o->steps, &problem, &error);
        report(b, b->o->scenes[k], status, &error);
        if (status == SADMM_OK) measure(b, &problem);
    }
    for (int k = 0; k < b->o->file_count && !interrupted(); ++k) {
        const sadmm_status status = problem_set_load(b->o->files[k], &problem, &error);
        report(b, b->o->files[k], status, &error);
        if (status == SADMM_OK) measure(b, &problem);
    }
    if (b->o->scene_count + b->o->file_count > 0 && !b->o->problem) return;
    for (size_t k = 0; k < problem_set_count() && !interrupted(); ++k) {
        if (b->o->problem ? !strstr(problem_set_name(k), b->o->problem) : b->o->quick && !problem_set_quick(k))
            continue;
        const sadmm_status status = problem_set_make(k, &problem, &error);
        report(b, problem_set_name(k), status, &error);
        if (status == SADMM_OK) measure(b, &problem);
    }
}

/* ---- command line ---------------------------------------------------------------------------------------------- */

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXTS("scene", "SPEC", o->scenes, &o->scene_count, "its problem after some steps; up to 16 times"),
        BENCH_NUMBER("steps", &o->steps, 0, 1000000, "of a scene, default 100"),
        BENCH_TEXTS("fclib", "FILE.hdf5", o->files, &o->file_count, "a problem in a file; up to 16 times"),
        BENCH_TEXT("problem", "TEXT", &o->problem,
                   "built-in problems with TEXT in their name; without any of these three, all of them"),
        BENCH_WORD("backend", &o->backend, bench_backends, 4, "default all: cpu and cuda"),
        BENCH_WORD("precision", &o->precision, bench_precisions, 3,
                   "default both; errors are measured in double in both"),
        BENCH_WORD("method", &o->method, bench_methods, 3, "default both"),
        BENCH_NUMBERS("threads", o->threads, &o->thread_count, 1, 1024, "CPU threads at most, default 1"),
        BENCH_NUMBER("device", &o->device, 0, 1023, "accelerator, default 0"),
        BENCH_NUMBER("limit", &o->limit, 1, 1000000, "most iterations, default 20000"),
        BENCH_FLAG("quick", &o->quick, "a few small problems, each solve timed once or twice"),
        BENCH_TEXT("csv", "FILE|-", &o->csv, "the curves as CSV, as of convergence; distance: from the reference, m/s"),
    };
    const int code = bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
    return code ? code : bench_check_scenes(command, o->scenes, o->scene_count);
}

int bench_precision(int argc, char **argv)
{
    struct options o = {.backend = SADMM_BACKEND_AUTO,
                        .precision = -1,
                        .method = -1,
                        .threads = {1},
                        .thread_count = 1,
                        .limit = 20000,
                        .steps = 100};
    struct bench b = {.o = &o};
    struct output *csv = NULL;
    int status = parse(argc, argv, &o);
    if (status) return status < 0 ? 0 : status;
    if (o.csv && (status = output_open("--csv", o.csv, OUTPUT_STREAM, &csv)) != 0) return status;
    if (csv) rows_write_header(b.rows.csv = output_stream(csv));
    b.out = outputs_on_stdout() ? stderr : stdout;
    measure_all(&b);
    status = output_close(csv);
    rows_free(&b.rows);
    return b.failed ? 1 : status;
}
