/* Solvers of a frozen problem for `subadmm-bench profile`: this library's and, where subadmm-siconos is beside the
 * program, those of siconos. Each solve is a process of its own, on one thread, from nothing. */
#ifndef BENCH_PROFILE_SOLVERS_H
#define BENCH_PROFILE_SOLVERS_H

#include "problem_set.h"

enum { PROFILE_MOST = 32 }; /* solvers */

struct profile_solver {
    char name[40];
    enum { PROFILE_ITERATES, PROFILE_DENSE, PROFILE_SICONOS } kind;
    sadmm_method method; /* ITERATES */
    sadmm_precision precision;
};

/* Into `out` (PROFILE_MOST); returns how many. Says on standard error where siconos is not. */
int profile_solvers(struct profile_solver *out);

/* A problem and its file, for what has to read it. */
struct profile_problem {
    char name[64], file[4096];
    struct set_problem set;
    int32_t contacts, hard_rows;
};

enum profile_end { PROFILE_SOLVED, PROFILE_LATE, PROFILE_LOST, PROFILE_UNSUITED, PROFILE_GAVE_UP, PROFILE_INTERRUPTED };

/* What one solve gave, by the certificate of its velocities and impulses, whoever found them. */
struct profile_run {
    enum profile_end
        end;        /* GAVE_UP: it has ended before its stop rule was met; what it has found counts all the same */
    double seconds; /* of the solve: the best of those that fit into a twentieth of a second */
    int iterations; /* 0: it does not count them */
    double siconos; /* siconos' measure */
    double ncp;     /* natural map at v = A^-1 (b + J^T lambda), m/s */
};

/* Solves to a tolerance of the solver's own measure, in at most so many seconds. Errors: OUT_OF_MEMORY. */
sadmm_status profile_run(struct profile_problem *problem, const struct profile_solver *solver, double tolerance,
                         double seconds, struct profile_run *run, struct sadmm_error *error);

#endif
