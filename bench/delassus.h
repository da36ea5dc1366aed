/* The Delassus form of a global friction contact problem (fclib/global_problem.h), the bodies taken out:
 *
 *     u = W r + q,    W = H^T M^-1 H in blocks of 3 x 3,    q = H^T M^-1 f + w
 *
 * Two contacts have a block where they have a body in common. Of contacts alone: problems without bilateral rows. */
#ifndef BENCH_DELASSUS_H
#define BENCH_DELASSUS_H

#include "fclib/global_problem.h"

struct delassus {
    int32_t bodies, contacts;
    int32_t *body;            /* (contacts x 2); -1: none */
    double *J, *response;     /* (contacts x 2 x 18): rows of H^T; J M^-1 */
    double *factor;           /* (bodies x 36): Cholesky's, of M */
    double *offset;           /* (contacts x 3): q, m/s */
    int32_t *first, *touches; /* contacts of a body: touches[first[i]] up to touches[first[i + 1]], ascending */
};

/* Errors: UNSUPPORTED (bilateral rows; a contact of more than two bodies), INVALID_ARGUMENT (M is not positive
 * definite), OUT_OF_MEMORY. Freed after an error. */
sadmm_status delassus_make(const struct sadmm_global_problem *global, struct delassus *out, struct sadmm_error *error);
void delassus_free(struct delassus *d);

/* Contacts that share a body with k, k among them, ascending and once each, into a list of at least
 * delassus_most_in_row. Returns how many. */
int32_t delassus_row(const struct delassus *d, int32_t k, int32_t *list);
int32_t delassus_most_in_row(const struct delassus *d);

/* The block of contacts k and l, row-major. */
void delassus_block(const struct delassus *d, int32_t k, int32_t l, double block[9]);

/* v = M^-1 (f + H r), (bodies x 6). */
void delassus_velocities(const struct delassus *d, const double *f, const double *r, double *v);

#endif
