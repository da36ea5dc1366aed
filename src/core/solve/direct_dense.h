/* A few constraints that respond to each other by a dense matrix: contacts (three numbers: normal, tangents; Signorini's
 * and Coulomb's law) and rows with bounds (one number).
 *
 *     u(lambda) = u + G (lambda - lambda_0)        lambda = Pi(lambda - u/w)
 *
 * with w each one's own response and Pi the law's projection (core/math/contact.h, row.h). Solved by direct_newton.h. */
#ifndef SADMM_CORE_SOLVE_DIRECT_DENSE_H
#define SADMM_CORE_SOLVE_DIRECT_DENSE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct direct_law {
    int32_t first, count; /* of its numbers; 3: a contact, 1: a row */
    double response;      /* w > 0 */
    double friction;      /* contact: mu */
    double lo, hi;        /* row: bounds */
};

struct direct_dense {
    int32_t laws, size;
    const struct direct_law *law;
    const double *G;         /* (size x size), row-major */
    double *lambda, *u;      /* (size) start in, the best that was found out */
    double *work;            /* direct_work_size(size) */
    double budget;           /* multiplications that steps may still take: what is left of it out */
};

/* Doubles: a matrix, which both searches use, and vectors of each (direct_newton.c, direct_interior.c). */
enum { DIRECT_NEWTON_VECTORS = 8, DIRECT_INTERIOR_VECTORS = 26 };
enum { DIRECT_VECTORS = DIRECT_NEWTON_VECTORS + DIRECT_INTERIOR_VECTORS };
static inline size_t direct_work_size(size_t size) { return size * (size + DIRECT_VECTORS); }

/* The projection Pi(y), and its derivative, row by row. */
void direct_project(const struct direct_law *law, const double y[3], double to[3], double derivative[3][3]);
/* y = lambda - u/w of a law. */
void direct_arrive(const struct direct_dense *d, const struct direct_law *law, double y[3]);
/* The largest natural map, m/s (rows: w times what lambda misses). */
double direct_natural_map(const struct direct_dense *d);
/* u += G x, of one number x of lambda. */
void direct_respond(const struct direct_dense *d, int32_t number, double x, double *u);

/* M = P L U in place, with the largest of each column as its pivot. False: singular. */
bool direct_factor(double *M, int32_t *pivot, int32_t count);
/* M x = right, in place. */
void direct_substitute(const double *M, const int32_t *pivot, int32_t count, double *right);
/* What both take together, in multiplications. */
static inline double direct_factor_work(double count) { return count * count * (count / 3 + 4); }

#ifdef __cplusplus
}
#endif
#endif
