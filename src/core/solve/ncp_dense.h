/* A dense contact problem (NCP): a few constraints that respond to each other by a dense matrix: contacts (three
 * numbers: normal, tangents; Signorini's and Coulomb's law) and rows with bounds (one number).
 *
 *     u(lambda) = u + G (lambda - lambda_0)        lambda = Pi(lambda - u/w)
 *
 * with w each one's own response and Pi the law's projection (core/math/contact.h, row.h). Solved by ncp_newton.h. */
#ifndef SADMM_CORE_SOLVE_NCP_DENSE_H
#define SADMM_CORE_SOLVE_NCP_DENSE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

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
enum { NCP_NEWTON_VECTORS = 21, NCP_INTERIOR_VECTORS = 26 };
enum { NCP_VECTORS = NCP_NEWTON_VECTORS + NCP_INTERIOR_VECTORS };
static inline size_t ncp_work_size(size_t size) { return size * (size + 3 + NCP_VECTORS); }

/* ---- laws -------------------------------------------------------------------------------------------------------- */

/* The projection Pi(y), and its derivative, row by row. */
static inline void ncp_project(const struct ncp_law *law, const double y[3], double to[3], double D[3][3])
{
    memset(D, 0, 9 * sizeof(double));
    if (law->count == 1) {
        to[0] = y[0] < law->lo ? law->lo : y[0] > law->hi ? law->hi : y[0];
        D[0][0] = to[0] == y[0];
        return;
    }
    to[0] = to[1] = to[2] = 0;
    if (!(y[0] > 0)) return;
    const double size = sqrt(y[1] * y[1] + y[2] * y[2]), limit = law->friction * y[0];
    to[0] = y[0], D[0][0] = 1;
    if (size <= limit) {
        to[1] = y[1], to[2] = y[2];
        D[1][1] = D[2][2] = 1;
        return;
    }
    const double way[2] = {y[1] / size, y[2] / size}, left = limit / size;
    for (int k = 0; k < 2; ++k) {
        to[1 + k] = limit * way[k];
        D[1 + k][0] = law->friction * way[k];
        for (int q = 0; q < 2; ++q) D[1 + k][1 + q] = left * ((k == q) - way[k] * way[q]);
    }
}

/* y = lambda - u/w of a law. */
static inline void ncp_arrive(const struct ncp_dense *d, const struct ncp_law *law, double y[3])
{
    const double softness = 1 / law->response;
    y[0] = y[1] = y[2] = 0;
    for (int32_t k = 0; k < law->count; ++k) y[k] = d->lambda[law->first + k] - d->u[law->first + k] * softness;
}

/* Of a law whose projection is `to`, m/s. */
static inline double ncp_law_map(const struct ncp_dense *d, const struct ncp_law *law, const double to[3])
{
    double sum = 0;
    for (int32_t k = 0; k < law->count; ++k) {
        const double residual = d->lambda[law->first + k] - to[k];
        sum += residual * residual;
    }
    return sqrt(sum) * law->response;
}

/* The largest natural map, m/s (rows: w times the residual of lambda). */
static inline double ncp_natural_map(const struct ncp_dense *d)
{
    double most = 0;
    for (int32_t i = 0; i < d->laws; ++i) {
        double y[3], to[3], D[3][3];
        ncp_arrive(d, &d->law[i], y);
        ncp_project(&d->law[i], y, to, D);
        const double map = ncp_law_map(d, &d->law[i], to);
        if (!(map <= most)) most = map; /* what is not a number is the most */
    }
    return most;
}

/* u += G x, of one number x of lambda. */
static inline void ncp_respond(const struct ncp_dense *d, int32_t number, double x, double *u)
{
    for (int32_t r = 0; r < d->size; ++r) u[r] += d->G[(size_t)r * (size_t)d->size + (size_t)number] * x;
}

/* ---- linear equations (ncp_linear.h) ----------------------------------------------------------------------------- */

/* What a factor and a solution take together, in multiplications. */
static inline double ncp_factor_work(double count) { return count * count * (count / 3 + 4); }

#ifdef __cplusplus
}
#endif
#endif
