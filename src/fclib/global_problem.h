/* The global friction contact problem in matrix form, the form of FCLIB and siconos:
 *
 *   M v = H r + G l + f        u = H^T v + w        G^T v + b = 0
 *   r_k in the cone of mu_k, u_k and r_k in Signorini-Coulomb's relation
 *
 * M is symmetric, (6 bodies)^2, block diagonal; H is (6 bodies x 3 contacts), three columns a contact, the normal
 * first; G is (6 bodies x hard rows). In this library's terms: f = b, H = J^T, r = lambda, w = (e, 0, 0), l = lambda
 * of the hard rows and b = e of the hard rows.
 *
 * Nothing here knows about files.
 */
#ifndef SADMM_FCLIB_GLOBAL_PROBLEM_H
#define SADMM_FCLIB_GLOBAL_PROBLEM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"
#include "subadmm/problem.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A sparse matrix as a list of entries; entries at the same place add up. */
struct sadmm_triplets {
    int32_t rows, columns;
    size_t count;
    int32_t *row, *column; /* (count) */
    double *value;         /* (count) */
};

/* Append an entry; false when out of memory. */
bool sadmm_triplets_add(struct sadmm_triplets *matrix, int32_t row, int32_t column, double value);
void sadmm_triplets_free(struct sadmm_triplets *matrix);

struct sadmm_global_problem {
    int32_t bodies, contacts, hard_rows;
    struct sadmm_triplets M, H, G;
    double *f;  /* (bodies x 6) N s, N m s */
    double *w;  /* (contacts x 3) m/s */
    double *mu; /* (contacts) */
    double *b;  /* (hard_rows) m/s, rad/s */
};

void sadmm_global_problem_free(struct sadmm_global_problem *global);

/* Columns in the order of the constraints: contacts given by geometry (in the frame n, t1, t2 of v3_tangents), then
 * CONTACT blocks, each kind in its own order; HARD blocks row by row. Errors: UNSUPPORTED (a SOFT block: the form has
 * no place for it), LIMIT (an index past 2^31 - 1), OUT_OF_MEMORY. `global` is freed after an error. */
sadmm_status sadmm_global_from_problem(sadmm_problem *problem, struct sadmm_global_problem *global,
                                       struct sadmm_error *error);

/* The inverse: every contact becomes a CONTACT block; neighbouring columns of G that act on the same bodies become one
 * HARD block of at most 6 rows. Within a block body_a < body_b; a constraint on one body has body_a = -1.
 * Errors: UNSUPPORTED (M couples bodies; a constraint that touches no body or more than two), INVALID_ARGUMENT (from
 * the problem's own checks, e.g. M is not positive definite), OUT_OF_MEMORY. */
sadmm_status sadmm_global_to_problem(const struct sadmm_global_problem *global, sadmm_problem **out,
                                     struct sadmm_error *error);

/* The current (v, lambda) of a problem in the same form. */
struct sadmm_global_solution {
    int32_t bodies, contacts, hard_rows;
    double *v; /* (bodies x 6) m/s, rad/s */
    double *u; /* (contacts x 3) relative velocity J v + w, normal first, m/s */
    double *r; /* (contacts x 3) impulse, normal first, N s */
    double *l; /* (hard_rows) multipliers */
};

/* Errors: UNSUPPORTED (a SOFT block), OUT_OF_MEMORY. */
sadmm_status sadmm_global_solution_from_problem(sadmm_problem *problem, struct sadmm_global_solution *solution,
                                                struct sadmm_error *error);
void sadmm_global_solution_free(struct sadmm_global_solution *solution);

#ifdef __cplusplus
}
#endif

#endif
