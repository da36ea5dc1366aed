/* A dense contact problem (NCP): a few constraints that respond to each other by a dense matrix: contacts (three
 * numbers: normal, tangents; Signorini's and Coulomb's law) and rows with bounds (one number).
 *
 *     u(lambda) = u + G (lambda - lambda_0)        lambda = Pi(lambda - u/w)
 *
 * with w each one's own response and Pi the law's projection (core/math/contact.h, row.h). Solved by ncp_newton.h. */
#ifndef SADMM_CORE_SOLVE_NCP_DENSE_H
#define SADMM_CORE_SOLVE_NCP_DENSE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct ncp_law {
    int32_t first, count; /* of its numbers; 3: a contact, 1: a row */
    double response;      /* w > 0 */
    double friction;      /* contact: mu */
    double lo, hi;        /* row: bounds */
};

struct ncp_dense {
    int32_t laws, size;
    const struct ncp_law *law;
    const double *G;         /* (size x size), row-major */
    double *lambda, *u;      /* (size) start in, the best that was found out */
    double *work;            /* ncp_work_size(size) */
    double budget;           /* multiplications that steps may still take: what is left of it out */
};

/* Doubles: a matrix, which both searches use, and vectors of each (ncp_newton.c, ncp_interior.c). */
enum { NCP_NEWTON_VECTORS = 8, NCP_INTERIOR_VECTORS = 26 };
enum { NCP_VECTORS = NCP_NEWTON_VECTORS + NCP_INTERIOR_VECTORS };
static inline size_t ncp_work_size(size_t size) { return size * (size + NCP_VECTORS); }

/* The projection Pi(y), and its derivative, row by row. */
void ncp_project(const struct ncp_law *law, const double y[3], double to[3], double derivative[3][3]);
/* y = lambda - u/w of a law. */
void ncp_arrive(const struct ncp_dense *d, const struct ncp_law *law, double y[3]);
/* The largest natural map, m/s (rows: w times the residual of lambda). */
double ncp_natural_map(const struct ncp_dense *d);
/* u += G x, of one number x of lambda. */
void ncp_respond(const struct ncp_dense *d, int32_t number, double x, double *u);

/* M = P L U in place, with the largest of each column as its pivot. False: singular. */
bool ncp_factor(double *M, int32_t *pivot, int32_t count);
/* M x = right, in place. */
void ncp_substitute(const double *M, const int32_t *pivot, int32_t count, double *right);
/* What both take together, in multiplications. */
static inline double ncp_factor_work(double count) { return count * count * (count / 3 + 4); }

#ifdef __cplusplus
}
#endif
#endif
