/* Solve a problem until siconos' measure is small enough.
 *
 * Batches of iterations, each a warm continuation of the one before, with the certificate between them. The penalty is
 * beta = M Tr(A)/Tr(C) + c (eq. 13) with M = 0 unless asked for: near-uniform weights converge where mass-proportional
 * ones stagnate, but the best offset c differs by decades from problem to problem, and updates by eq. (15) help most
 * problems and ruin some. So the loop starts from the mean mass of the bodies with updates. When the measure stagnates,
 * other offsets without updates start from nothing beside it, and from then on the one runs that will be the first to
 * arrive if it goes on at its present rate. The method fast has no offset to choose: it recomputes its weights in every
 * batch.
 */
#ifndef SADMM_CLI_SOLVE_LOOP_H
#define SADMM_CLI_SOLVE_LOOP_H

#include "cli.h"

struct solve_plan {
    sadmm_backend backend;
    sadmm_precision precision;
    sadmm_settings settings;  /* iterations and warm_start are the loop's */
    double tolerance;         /* of siconos' measure */
    long max_iterations;
    int batch;              /* iterations between convergence checks */
    double offset;             /* kg, kept; 0: chosen and changed automatically */
};

struct solve_outcome {
    bool converged;           /* to the tolerance, and the other errors of the certificate are finite */
    long iterations;
    double ms;                /* solving, without the certificates */
    double offset;             /* kg, the last one used */
    int offsets_tried;
    sadmm_solve_report report;/* of the last batch */
    sadmm_certificate certificate; /* of the solution left in the problem: the best one seen */
};

/* An interrupt ends it after the batch under way. Errors: those of sadmm_problem_solve; `error` holds the message. */
sadmm_status solve_loop(sadmm_problem *problem, const struct solve_plan *plan, struct solve_outcome *outcome,
                        struct sadmm_error *error);

#endif
