/* How fast a cold solve of one problem converges. Errors are those of whole solves with that many iterations (nothing
 * reads a running one), measured in double whatever ran; times are those of the same solves without the
 * measurement.
 *
 * The error is the certificate's natural map at v = A^-1 (b + J^T lambda), where momentum balances ("balanced"): one
 * number that is zero at a solution only. The natural map at the solve's own velocities and the momentum error are kept
 * beside it. */
#ifndef BENCH_COLD_CONVERGENCE_H
#define BENCH_COLD_CONVERGENCE_H

#include "convergence_rows.h"
#include "problem_set.h"
#include "reference_solution.h"

struct cold_plan {
    int limit;      /* most iterations of a solve */
    double time_ms; /* repeat a timed solve until this much time has passed (3 to 16 times); the best time counts */
    int density;    /* solves with so many counts between k and e k; 0: as many as the problem's size allows */
    double enough;  /* m/s: where errors of solves in a row are below it, more iterations are not tried; 0: never */
    const struct reference_solution *reference; /* what distances are measured from; NULL: they are not */
};

/* Adds a ROW_CURVE for 1, 2, 3, 5, 7, 10, ... iterations, and a ROW_COUNT for 1e-3, 1e-4 and 1e-6 m/s: the fewest
 * iterations after which the error stays below, as far as solves with 7 (large problems) to 70 counts between k and 2 k
 * (plan->density) can tell. A solve that fails (not finite) counts as an error above every tolerance. Errors:
 * OUT_OF_MEMORY, UNAVAILABLE, ... */
sadmm_status cold_convergence(const struct set_problem *problem, sadmm_method method, const struct series *series,
                              const struct cold_plan *plan, struct rows *rows, struct sadmm_error *error);

#endif
