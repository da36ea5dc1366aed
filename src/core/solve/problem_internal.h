/* A problem's insides: what its files share (problem.c: life and solving; problem_input.c: what is set;
 * problem_solution.c: what is read back), and what tests read. */
#ifndef SADMM_CORE_SOLVE_PROBLEM_INTERNAL_H
#define SADMM_CORE_SOLVE_PROBLEM_INTERNAL_H

#include "certificate.h"
#include "core/base/check.h"
#include "core/base/parallel.h"
#include "core/model/system.h"
#include "kernels.h"
#include "solve_error.h"
#include "subadmm/problem.h"

struct sadmm_problem {
    struct sadmm_team team;
    struct sadmm_error error;
    struct sadmm_certificate_workspace certificate;
    struct sadmm_solve_errors errors;
    int32_t body_count;
    double *A, *b;               /* (bodies x 36), (bodies x 6) */
    double *velocity;            /* (bodies x 6) */
    struct sadmm_contact_set contacts;
    double *kinematic;           /* (kinematic_count x 6) of pairs whose static side moves */
    int32_t kinematic_count;
    int32_t block_count;
    sadmm_problem_block *blocks; /* as given, to be read back */
    struct sadmm_rows rows;      /* what they mean: a constraint a block, in their order */

    double *saved; /* velocity, impulses (points x 3), multipliers (rows) before a solve */
    int device;
    struct sadmm_context *contexts[SADMM_BACKEND_COUNT][2];
    const struct sadmm_kernels *tables[SADMM_BACKEND_COUNT][2];

    struct sadmm_system system;  /* of the last solve: a context keeps pointers to these three */
    struct sadmm_plan plan;
    struct sadmm_settings settings;
};

#define REFUSE(...) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, __VA_ARGS__)

static inline sadmm_status sadmm_check_problem(const sadmm_problem *problem)
{
    return sadmm_check_given(problem, "problem", NULL);
}

/* `values` (count x width), a start or a solution, which may be anything finite; NULL is fine. */
sadmm_status sadmm_check_values(const char *name, const double *values, int32_t count, int width,
                                struct sadmm_error *error);
/* The same for multipliers (blocks x 6), of which only the rows that there are count. */
sadmm_status sadmm_check_lambda(const char *name, const sadmm_problem_block *blocks, int32_t count,
                                const double *lambda, struct sadmm_error *error);

/* Bodies and constraints are gone; what they were kept in is free. */
void sadmm_problem_drop_parts(sadmm_problem *problem);

/* The contacts as a solve sees them: in the order they were set, grouped into pairs. */
const struct sadmm_contact_set *sadmm_problem_contact_set(const sadmm_problem *problem);

#endif
