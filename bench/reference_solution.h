/* The solution of a contact problem by another way than the library's: Newton's method on the dense system of impulses.
 *
 * Unknown are all impulses z, with x = W z + q, W = J A^-1 J^T. Their laws are functions that are zero at a solution,
 * those of Alart and Curnier (Comput. Methods Appl. Mech. Eng. 92, 1991) for contacts:
 *     normal    z_n - max(0, y_n)                           y = z - r x
 *     tangents  z_t - P(y_t), P: onto the disc of radius mu max(0, y_n)
 *     rows      z - clamp(z - r (gain x + error + compliance z), lower, upper)
 * Impulses of redundant contacts are not unique and W is singular: proximal steps, W + a D and q - a D z_before with D
 * the diagonal of W, make each system regular, and no term is left of them where they end. Gauss-Seidel sweeps come
 * first. */
#ifndef BENCH_REFERENCE_SOLUTION_H
#define BENCH_REFERENCE_SOLUTION_H

#include <stdbool.h>

#include "core/base/error.h"
#include "subadmm/problem.h"

enum { REFERENCE_MOST = 1200 }; /* unknowns: the work is their third power */

/* A problem's solution and what distances from it need. */
struct reference_solution {
    int bodies;
    double *velocities; /* bodies x 6; NULL: there is none */
    double *A;          /* bodies x 36 */
    double mass;        /* kg, of all bodies */
    double error;       /* its natural map, by the library's certificate, m/s */
};

/* Is the problem small enough? */
bool reference_fits(const sadmm_problem *problem);
/* The solution, which becomes the problem's. It counts as found where its natural map is at most 1e-12 m/s; else
 * out->velocities is NULL. Errors: OUT_OF_MEMORY; those of the problem. */
sadmm_status reference_solve(sadmm_problem *problem, struct reference_solution *out, struct sadmm_error *error);
/* How far velocities (bodies x 6) are from it, in the metric of kinetic energy: sqrt(dv^T A dv / mass), m/s. */
double reference_distance(const struct reference_solution *reference, const double *velocities);
void reference_free(struct reference_solution *reference);

#endif
