/* The dense contact solve (core/solve/ncp_newton.h) of a frozen problem, island by island, from impulses of 0: what
 * worlds do with small islands, with the Delassus form as G. */
#ifndef BENCH_DENSE_SOLVE_H
#define BENCH_DENSE_SOLVE_H

#include <stdbool.h>

#include "fclib/global_problem.h"

/* Has no island more contacts than the library's dense solve ever takes (SADMM_MOST_NCP_POINTS), and is there none of
 * anything but contacts? False where memory runs out, too. */
bool dense_solve_takes(sadmm_problem *problem);

/* Until each island's natural map is at most `enough`, m/s, or nothing else is left to try: r (contacts x 3), v
 * (bodies x 6), and the largest natural map. Errors: those of delassus_make. */
sadmm_status dense_solve(const struct sadmm_global_problem *global, double enough, double *r, double *v, double *map,
                         struct sadmm_error *error);

#endif
