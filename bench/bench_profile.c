/* subadmm-bench profile: performance profiles over FCLIB problem files, this library's methods beside the solvers of
 * siconos. A solver has its own measure and its own way to stop, so each is run to one tolerance after the other, 1e-3,
 * 1e-4, ..., and what it has found is measured; to a bound counts the fastest of its solves that is below. */
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/base/memory.h"
#include "fclib/fclib.h"
#include "profile_rows.h"
#include "profile_set.h"

static const char command[] = "profile";

/* Tolerances, a decade each: three more than the tightest bound, for measures that are that far apart. */
static const double first_tolerance = 1e-3, last_tolerance = 1e-11;

/* Tighter tolerances are not tried after so many solves in a row that end before their stop rule is met, and after
 * solves that took so many times the longest one together. */
enum { MOST_GIVEN_UP = 2 };
static const double PATIENCE = 3;

struct options {
    const char *folder, *dump, *problem, *csv;
    const char *only[BENCH_LIST];
    int only_count;
    double seconds;
    bool quick, list;
};

struct bench {
    const struct options *o;
    struct profile_solver solvers[PROFILE_MOST];
    int solver_count;
    struct profile_times *times; /* (problems x solvers) */
    size_t problems;
    FILE *out, *csv;
    bool failed;
};

static bool report(struct bench *b, const char *what, sadmm_status status, const struct sadmm_error *error)
{
    if (status == SADMM_OK) return true;
    fprintf(stderr, "subadmm-bench %s: %s: %s\n", command, what, error->message);
    b->failed = true;
    return false;
}

/* ---- measuring --------------------------------------------------------------------------------------------------- */

/* Returns false when every bound is reached. */
static bool add_run(struct profile_times *times, const struct profile_run *run)
{
    bool left = false;
    for (int m = 0; m < PROFILE_MEASURES; ++m)
        for (int b = 0; b < PROFILE_BOUNDS; ++b) {
            struct profile_time *t = &times->at[m][b];
            if ((m ? run->ncp : run->siconos) <= profile_bounds[b] && run->seconds < t->seconds)
                *t = (struct profile_time){run->seconds, run->iterations};
            left = left || isinf(t->seconds);
        }
    return left;
}

static sadmm_status measure_solver(struct bench *b, struct profile_problem *problem,
                                   const struct profile_solver *solver, struct profile_times *times,
                                   struct sadmm_error *error)
{
    for (int m = 0; m < PROFILE_MEASURES; ++m)
        for (int k = 0; k < PROFILE_BOUNDS; ++k) times->at[m][k] = (struct profile_time){INFINITY, 0};
    int gave_up = 0;
    double spent = 0;
    for (double tolerance = first_tolerance; tolerance > 0.5 * last_tolerance; tolerance /= 10) {
        struct profile_run run;
        TRY(profile_run(problem, solver, tolerance, b->o->seconds, &run, error));
        times->end = run.end;
        gave_up = run.end == PROFILE_GAVE_UP ? gave_up + 1 : 0;
        if (run.end != PROFILE_SOLVED && !gave_up) break;
        if (!add_run(times, &run) || gave_up == MOST_GIVEN_UP) break;
        spent += run.seconds;
        if (spent <= PATIENCE * b->o->seconds) continue;
        times->end = PROFILE_LATE;
        break;
    }
    return SADMM_OK;
}

static void print_times(const struct bench *b, const struct profile_solver *solver, const struct profile_times *times)
{
    fprintf(b->out, "  %-24s", solver->name);
    for (int m = 0; m < PROFILE_MEASURES; ++m)
        for (int k = 0; k < PROFILE_BOUNDS; ++k) {
            const struct profile_time *t = &times->at[m][k];
            if (isfinite(t->seconds)) fprintf(b->out, "  %9.3g (%6d)", 1e3 * t->seconds, t->iterations);
            else fprintf(b->out, "  %9s %8s", "-", "");
        }
    putc('\n', b->out);
    fflush(b->out);
}

static void measure(struct bench *b, struct profile_problem *problem)
{
    struct sadmm_error error = {SADMM_OK, ""};
    const size_t row = b->problems * (size_t)b->solver_count;
    if (!SADMM_GROW(b->times, row, row + (size_t)b->solver_count)) {
        report(b, problem->name, sadmm_fail_memory(&error, "the times"), &error);
        return;
    }
    fprintf(b->out,
            "%s: %d bodies, %d contacts; ms (iterations) to 1e-4, 1e-6, 1e-8 of siconos' measure, of the "
            "natural map in m/s\n",
            problem->name, sadmm_problem_body_count(problem->set.problem), problem->contacts);
    for (int s = 0; s < b->solver_count; ++s) {
        struct profile_times *times = &b->times[row + (size_t)s];
        if (!report(b, problem->name, measure_solver(b, problem, &b->solvers[s], times, &error), &error)) return;
        if (interrupted()) return; /* a problem counts for all solvers, or for none */
        print_times(b, &b->solvers[s], times);
    }
    for (int s = 0; b->csv && s < b->solver_count; ++s)
        profile_write(b->csv, problem, &b->solvers[s], &b->times[row + (size_t)s]);
    ++b->problems;
}

/* ---- problems ---------------------------------------------------------------------------------------------------- */

/* All of a problem's constraints are blocks: it is of a file. */
static void count_constraints(struct profile_problem *problem)
{
    sadmm_problem_block block;
    for (int32_t k = 0; k < sadmm_problem_block_count(problem->set.problem); ++k)
        if (sadmm_problem_get_block(problem->set.problem, k, &block) == SADMM_OK) {
            if (block.kind == SADMM_BLOCK_CONTACT) ++problem->contacts;
            else problem->hard_rows += block.rows;
        }
}

static void measure_file(struct bench *b, const char *folder, const char *name)
{
    struct profile_problem problem = {0};
    struct sadmm_error error = {SADMM_OK, ""};
    if (snprintf(problem.file, sizeof problem.file, "%s/%s", folder, name) >= (int)sizeof problem.file) {
        report(b, name, sadmm_fail(&error, SADMM_ERROR_IO, "the path is too long"), &error);
        return;
    }
    if (!report(b, problem.file, problem_set_load(problem.file, &problem.set, &error), &error)) return;
    memcpy(problem.name, problem.set.name, sizeof problem.name);
    count_constraints(&problem);
    measure(b, &problem);
    problem_set_free(&problem.set);
}

static int is_problem(const struct dirent *entry)
{
    const char *dot = strrchr(entry->d_name, '.');
    return dot && (!strcmp(dot, ".hdf5") || !strcmp(dot, ".h5"));
}

static bool wanted(const struct options *o, const char *name) { return !o->problem || strstr(name, o->problem); }

/* In the order of their names. */
static void measure_folder(struct bench *b, const char *folder)
{
    struct dirent **entries;
    struct sadmm_error error = {SADMM_OK, ""};
    const int count = scandir(folder, &entries, is_problem, alphasort);
    if (count <= 0) {
        report(b, folder, sadmm_fail(&error, SADMM_ERROR_IO, "%s", count < 0 ? strerror(errno) : "no .hdf5 file"),
               &error);
        return;
    }
    for (int k = 0; k < count; ++k) {
        if (wanted(b->o, entries[k]->d_name) && !interrupted()) measure_file(b, folder, entries[k]->d_name);
        free(entries[k]);
    }
    free(entries);
}

/* The set's files into a folder. */
static void write_set(struct bench *b, const char *folder, FILE *list)
{
    for (size_t k = 0; k < profile_set_count() && !interrupted(); ++k) {
        struct set_problem problem;
        struct sadmm_error error = {SADMM_OK, ""};
        char file[64], path[4096];
        if (b->o->quick && !profile_set_quick(k)) continue;
        if (!report(b, profile_set_name(k), profile_set_make(k, &problem, file, &error), &error)) continue;
        snprintf(path, sizeof path, "%s/%s.hdf5", folder, file);
        const sadmm_status status =
            wanted(b->o, file) ? sadmm_fclib_save(problem.problem, path, file, &error) : SADMM_OK;
        if (report(b, path, status, &error) && list && wanted(b->o, file))
            fprintf(list, "%-32s %5d bodies %6d contacts\n", file, sadmm_problem_body_count(problem.problem),
                    sadmm_problem_contact_count(problem.problem));
        problem_set_free(&problem);
    }
}

static void remove_folder(const char *folder)
{
    struct dirent **entries;
    const int count = scandir(folder, &entries, is_problem, NULL);
    for (int k = 0; k < count; ++k) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%s", folder, entries[k]->d_name);
        unlink(path);
        free(entries[k]);
    }
    if (count >= 0) free(entries);
    rmdir(folder);
}

static void measure_set(struct bench *b)
{
    const char *where = getenv("TMPDIR");
    char folder[2048];
    struct sadmm_error error = {SADMM_OK, ""};
    snprintf(folder, sizeof folder, "%.2000s/subadmm-profile-XXXXXX", where && *where ? where : "/tmp");
    if (!mkdtemp(folder)) {
        report(b, folder, sadmm_fail(&error, SADMM_ERROR_IO, "%s", strerror(errno)), &error);
        return;
    }
    write_set(b, folder, NULL);
    if (!interrupted()) measure_folder(b, folder);
    remove_folder(folder);
}

/* ---- command line ------------------------------------------------------------------------------------------------ */

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXT("folder", "DIR", &o->folder,
                   "FCLIB files (.hdf5), global problems; default: a set of fifty of its own"),
        BENCH_TEXT("dump", "DIR", &o->dump, "write that set to this folder and list it; nothing is measured"),
        BENCH_TEXT("problem", "TEXT", &o->problem, "only files with TEXT in their name"),
        BENCH_TEXTS("solver", "TEXT", o->only, &o->only_count, "only solvers with TEXT in their name; up to 16 times"),
        BENCH_FLAG("list", &o->list, "list the solvers that there are"),
        BENCH_REAL("seconds", "S", &o->seconds, 3600,
                   "longest solve; one that takes longer has not solved; default 10"),
        BENCH_FLAG("quick", &o->quick, "a few small problems of the set"),
        BENCH_TEXT("csv", "FILE|-", &o->csv, "a row a problem, solver, measure and bound"),
    };
    return bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
}

static void choose_solvers(struct bench *b)
{
    int kept = 0;
    b->solver_count = profile_solvers(b->solvers);
    for (int s = 0; s < b->solver_count; ++s) {
        bool keep = b->o->only_count == 0;
        for (int k = 0; k < b->o->only_count; ++k) keep = keep || strstr(b->solvers[s].name, b->o->only[k]);
        if (keep) b->solvers[kept++] = b->solvers[s];
    }
    b->solver_count = kept;
}

int bench_profile(int argc, char **argv)
{
    struct options o = {.seconds = 10};
    struct bench b = {.o = &o};
    struct output *csv = NULL;
    int status = parse(argc, argv, &o);
    if (status) return status < 0 ? 0 : status;
    if (!sadmm_fclib_available()) {
        fprintf(stderr, "subadmm-bench %s: this build reads no FCLIB files (-Dhdf5=enabled)\n", command);
        return 1;
    }
    if (o.dump) {
        write_set(&b, o.dump, stdout);
        return b.failed;
    }
    choose_solvers(&b);
    if (o.list) {
        for (int s = 0; s < b.solver_count; ++s) puts(b.solvers[s].name);
        return 0;
    }
    if (o.csv && (status = output_open("--csv", o.csv, OUTPUT_STREAM, &csv)) != 0) return status;
    if (csv) profile_write_header(b.csv = output_stream(csv));
    b.out = outputs_on_stdout() ? stderr : stdout;
    if (o.folder) measure_folder(&b, o.folder);
    else measure_set(&b);
    profile_print(b.out, b.solvers, b.solver_count, b.times, b.problems);
    status = output_close(csv);
    sadmm_free(b.times);
    return b.failed ? 1 : status;
}
