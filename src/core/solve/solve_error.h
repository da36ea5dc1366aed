/* How far a solution is from the laws, as velocities, island by island: what stop rules read and steps report.
 *
 *     law        the natural map of its constraints, as the certificate has it (certificate.h), m/s
 *     momentum   the velocity A^-1 (A v - b - J^T lambda) that its bodies owe, as the speed at which a body has its
 *                kinetic energy, m/s. What the energy limiter has taken is part of it
 *
 * An island is solved where both are at most the tolerance. In single precision rounding alone is a share of its
 * speeds: nothing below that share counts. In double, from the raw data that every backend reads. */
#ifndef SADMM_CORE_SOLVE_SOLVE_ERROR_H
#define SADMM_CORE_SOLVE_SOLVE_ERROR_H

#include "core/base/error.h"
#include "core/model/system.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_solve_errors {
    int32_t *label;         /* (bodies) islands, by their first body; there: */
    double *law, *momentum; /* m/s */
    double *enough;         /* what rounding excuses, m/s */
    double *bodies;         /* of each body: work */
    int32_t body_count;
};

/* Of all islands. */
struct sadmm_solve_error {
    double law, momentum; /* the largest, m/s */
    int64_t unsolved;     /* islands that miss the tolerance */
};

/* Errors of the system's velocities, impulses and multipliers. Errors: OUT_OF_MEMORY. */
sadmm_status sadmm_solve_errors_find(struct sadmm_solve_errors *errors, const struct sadmm_system *system,
                                     const struct sadmm_settings *settings, sadmm_precision precision,
                                     struct sadmm_error *error);
void sadmm_solve_errors_free(struct sadmm_solve_errors *errors);

/* Does the island of this label miss the tolerance? A number that is not finite does. */
bool sadmm_solve_errors_above(const struct sadmm_solve_errors *errors, int32_t label, double tolerance);
struct sadmm_solve_error sadmm_solve_errors_sum(const struct sadmm_solve_errors *errors, double tolerance);

#ifdef __cplusplus
}
#endif
#endif
