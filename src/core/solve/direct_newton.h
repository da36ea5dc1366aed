/* A few constraints that respond to each other by a dense matrix, solved by semismooth Newton steps on their natural
 * maps: contacts (three numbers: normal, tangents; Signorini's and Coulomb's law) and rows with bounds (one number).
 *
 *     u(lambda) = u + G (lambda - lambda_0)        lambda = Pi(lambda - u/w)
 *
 * with w each one's own response and Pi the law's projection (core/math/contact.h, row.h). Which piece of each law holds
 * is read from lambda - u/w; a step solves all those pieces at once, so that a right guess is the solution, to rounding,
 * whatever G's condition. */
#ifndef SADMM_CORE_SOLVE_DIRECT_NEWTON_H
#define SADMM_CORE_SOLVE_DIRECT_NEWTON_H

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

/* Doubles. */
static inline size_t direct_work_size(size_t size) { return size * (size + 8); }

/* The largest natural map, m/s (rows: w times what lambda misses). */
double direct_natural_map(const struct direct_dense *d);

/* Goes on until the natural map is at most `enough`, nothing else is left to try or the budget is spent. Returns it. */
double direct_newton(struct direct_dense *d, double enough);

#ifdef __cplusplus
}
#endif
#endif
