/* The contact problems that convergence is measured on: small ones that are hard for known reasons, pyramids, random
 * piles, the settled states of the scene library, and files. All of them are the same on every machine (the scenes'
 * states up to the rounding of the build). */
#ifndef BENCH_PROBLEM_SET_H
#define BENCH_PROBLEM_SET_H

#include "core/base/error.h"
#include "subadmm/problem.h"

struct set_problem {
    char name[64];
    sadmm_problem *problem;
    double dt;          /* s: the unit of the penalty offset */
    int penalty_period; /* m of eq. (15) */
    bool quick;         /* one of the few of a quick run */
};

/* Built-in problems and scenes, index in [0, count). */
size_t problem_set_count(void);
const char *problem_set_name(size_t index);
bool problem_set_quick(size_t index);

/* Build one; the caller frees it. A scene's problem is that of the step after it has settled by the paper's method with
 * the scene's own settings, in double on the CPU. Errors: those of problems, scenes and worlds. */
sadmm_status problem_set_make(size_t index, struct set_problem *out, struct sadmm_error *error);
/* A scene's problem after so many steps. Errors as above. */
sadmm_status problem_set_freeze(const char *scene, int steps, struct set_problem *out, struct sadmm_error *error);
/* From an FCLIB file. It has no time step: 5 ms. */
sadmm_status problem_set_load(const char *path, struct set_problem *out, struct sadmm_error *error);
void problem_set_free(struct set_problem *problem);

/* Exact (v, lambda) have v = A^-1 (b + J^T lambda): set the problem's velocities to that, from its current lambda, so
 * that the certificate's natural map is the whole error and momentum's is rounding. Errors: OUT_OF_MEMORY. */
sadmm_status problem_set_balance(sadmm_problem *problem, struct sadmm_error *error);

#endif
