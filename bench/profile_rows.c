#include "profile_rows.h"

#include <math.h>

#include "bench.h"

const double profile_bounds[PROFILE_BOUNDS] = {1e-4, 1e-6, 1e-8};
const char *const profile_measures[PROFILE_MEASURES] = {"siconos", "natural map"};

static const char *const ends[] = {"solved", "time limit", "crashed", "not for it", "gave up", "interrupted"};

/* ---- CSV --------------------------------------------------------------------------------------------------------- */

void profile_write_header(FILE *csv)
{
    fputs("problem,bodies,contacts,solver,measure,bound,seconds,iterations,solved,end\n", csv);
}

/* `end` of what is not solved: of the solve to the tightest tolerance that was tried; one that met its own rule has
 * not met this measure's. */
static const char *end_of(const struct profile_times *times, bool solved)
{
    return solved ? ends[PROFILE_SOLVED] : times->end == PROFILE_SOLVED ? "not accurate" : ends[times->end];
}

void profile_write(FILE *csv, const struct profile_problem *problem, const struct profile_solver *solver,
                   const struct profile_times *times)
{
    for (int m = 0; m < PROFILE_MEASURES; ++m)
        for (int b = 0; b < PROFILE_BOUNDS; ++b) {
            const struct profile_time *t = &times->at[m][b];
            const bool solved = isfinite(t->seconds);
            bench_write_csv_text(csv, problem->name);
            fprintf(csv, ",%d,%d,%s,%s,%g,", sadmm_problem_body_count(problem->set.problem), problem->contacts,
                    solver->name, profile_measures[m], profile_bounds[b]);
            if (solved) fprintf(csv, "%.4g", t->seconds);
            putc(',', csv);
            if (solved && t->iterations > 0) fprintf(csv, "%d", t->iterations);
            fprintf(csv, ",%d,%s\n", solved, end_of(times, solved));
        }
    fflush(csv); /* for who watches */
}

/* ---- profiles ---------------------------------------------------------------------------------------------------- */

static double fastest(const struct profile_times *times, int solvers, int m, int b)
{
    double best = INFINITY;
    for (int s = 0; s < solvers; ++s) best = fmin(best, times[s].at[m][b].seconds);
    return best;
}

/* Problems that solver s solves within a factor of the fastest; INFINITY: at all. */
static int within(const struct profile_times *times, int solvers, size_t problems, int s, int m, int b, double factor)
{
    int count = 0;
    for (size_t p = 0; p < problems; ++p) {
        const struct profile_times *of = times + p * (size_t)solvers;
        const double seconds = of[s].at[m][b].seconds;
        count += isfinite(seconds) && (isinf(factor) || seconds <= factor * fastest(of, solvers, m, b));
    }
    return count;
}

void profile_print(FILE *out, const struct profile_solver *solvers, int solver_count, const struct profile_times *times,
                   size_t problems)
{
    static const double factors[] = {INFINITY, 1, 2, 10};
    if (problems == 0) return;
    for (int m = 0; m < PROFILE_MEASURES; ++m) {
        fprintf(out, "%s: %% of %zu problems solved: the fastest, within 2 times, within 10 times its time\n\n",
                profile_measures[m], problems);
        fprintf(out, "| solver");
        for (int b = 0; b < PROFILE_BOUNDS; ++b) fprintf(out, " | %g", profile_bounds[b]);
        fprintf(out, " |\n|---|---|---|---|\n");
        for (int s = 0; s < solver_count; ++s) {
            fprintf(out, "| %s", solvers[s].name);
            for (int b = 0; b < PROFILE_BOUNDS; ++b)
                for (int f = 0; f < 4; ++f)
                    fprintf(out, "%s%.0f",
                            f == 0   ? " | "
                            : f == 1 ? ": "
                                     : ", ",
                            100.0 * within(times, solver_count, problems, s, m, b, factors[f]) / (double)problems);
            fprintf(out, " |\n");
        }
        putc('\n', out);
    }
}
