/* What `subadmm-bench profile` finds: by which problem, solver, measure and bound how long it took; as CSV and as
 * performance profiles (Dolan and More, Math. Program. 91, 2002): the share of problems that a solver solves within a
 * factor of the time of the fastest of all. */
#ifndef BENCH_PROFILE_ROWS_H
#define BENCH_PROFILE_ROWS_H

#include <stdio.h>

#include "profile_solvers.h"

enum { PROFILE_MEASURES = 2, PROFILE_BOUNDS = 3 };
extern const double profile_bounds[PROFILE_BOUNDS];
extern const char *const profile_measures[PROFILE_MEASURES]; /* siconos' own; the natural map, m/s */

struct profile_time {
    double seconds; /* INFINITY: not solved */
    int iterations;
};

/* Of one solver on one problem. */
struct profile_times {
    struct profile_time at[PROFILE_MEASURES][PROFILE_BOUNDS];
    enum profile_end end; /* of its last solve: why there are no more */
};

void profile_write_header(FILE *csv);
void profile_write(FILE *csv, const struct profile_problem *problem, const struct profile_solver *solver,
                   const struct profile_times *times);

/* times: (problems x solvers). */
void profile_print(FILE *out, const struct profile_solver *solvers, int solver_count, const struct profile_times *times,
                   size_t problems);

#endif
