/* Constraints given by Jacobian rows, as structure of arrays: what a problem's blocks become (and joints, limits,
 * motors), and what every backend and the certificate read.
 *
 * A constraint is one to six rows on two bodies. Its rows are scalar laws of their own (math/row.h), or three rows
 * (normal, tangent, tangent) are a contact: a cone, Signorini's and Coulomb's law (math/contact.h) with gain 1 and
 * compliance 0 in every row, whose bounds are not read. */
#ifndef SADMM_CORE_MODEL_ROWS_H
#define SADMM_CORE_MODEL_ROWS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/inline.h"
#include "subadmm/problem.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SADMM_MAX_ROWS = 6 };

struct sadmm_row_constraint {
    int32_t body_a, body_b; /* -1: the static world */
    int32_t first, count;   /* rows */
    bool cone;
    double friction;        /* cone: mu */
    bool rigid;             /* each of its rows is a wrench at one point of space on b, and its opposite on a; */
    double offset[3];       /* then from a's centre of mass to b's where the rows are made, m, world frame */
};

struct sadmm_rows {
    struct sadmm_row_constraint *constraints;
    double *jacobian_a, *jacobian_b; /* (rows x 6), on (linear, angular); 0 where the body is static */
    double *gain, *bias, *compliance, *lo, *hi; /* the law of each row */
    double *lambda;                  /* start in, solution out */
    size_t constraint_count, row_count;
};

/* Forget all constraints, keep the memory. */
void sadmm_rows_clear(struct sadmm_rows *rows);
void sadmm_rows_free(struct sadmm_rows *rows);

/* Capacity for so many; false, with nothing changed, when memory runs out. */
bool sadmm_rows_reserve(struct sadmm_rows *rows, size_t constraints, size_t row_count);

/* Add a constraint of `count` rows whose Jacobians and multipliers are 0 and whose laws are hard with bias 0: its first
 * row, -1 when memory runs out. Bodies as in sadmm_problem_block. */
int32_t sadmm_rows_add(struct sadmm_rows *rows, int32_t count, int32_t body_a, int32_t body_b);

/* Of the constraint that was added last: it is rigid, b's centre of mass is at `offset` from a's. */
void sadmm_rows_set_rigid(struct sadmm_rows *rows, const double offset[3]);

/* Add what a block means, and its multipliers (6, or NULL for 0). False when memory runs out. */
bool sadmm_rows_add_block(struct sadmm_rows *rows, const sadmm_problem_block *block, const double *lambda);

/* The block that constraint k is: HARD or ROWS; not of a contact. */
void sadmm_rows_block(const struct sadmm_rows *rows, size_t k, sadmm_problem_block *block);

/* Laws of row r. */
static inline void sadmm_row_set(struct sadmm_rows *rows, int32_t r, double gain, double bias, double compliance,
                                 double lo, double hi)
{
    rows->gain[r] = gain;
    rows->bias[r] = bias;
    rows->compliance[r] = compliance;
    rows->lo[r] = lo;
    rows->hi[r] = hi;
}
/* x + e = 0; e in m/s or rad/s. */
static inline void sadmm_row_hard(struct sadmm_rows *rows, int32_t r, double e)
{
    sadmm_row_set(rows, r, 1, e, 0, -INFINITY, INFINITY);
}
/* lambda + k e + c x = 0. */
static inline void sadmm_row_soft(struct sadmm_rows *rows, int32_t r, double k, double c, double e)
{
    sadmm_row_set(rows, r, c, k * e, 1, -INFINITY, INFINITY);
}
/* 0 <= lambda _|_ x + e >= 0 */
static inline void sadmm_row_limit(struct sadmm_rows *rows, int32_t r, double e)
{
    sadmm_row_set(rows, r, 1, e, 0, 0, INFINITY);
}
/* x = speed with an impulse of at most `most`; dry friction has speed 0. */
static inline void sadmm_row_motor(struct sadmm_rows *rows, int32_t r, double speed, double most)
{
    sadmm_row_set(rows, r, 1, -speed, 0, -most, most);
}

/* May a row share a dense weight with others of its constraint (method `fast`)? A multiplier with bounds, or with
 * compliance, is only exact on its own. */
SADMM_INLINE bool sadmm_law_is_coupled(double compliance, double lo, double hi)
{
    return compliance == 0 && lo == -INFINITY && hi == INFINITY;
}
static inline bool sadmm_row_is_coupled(const struct sadmm_rows *rows, size_t r)
{
    return sadmm_law_is_coupled(rows->compliance[r], rows->lo[r], rows->hi[r]);
}

/* A row that is zero on both bodies is no constraint (Sec. III-C of the paper): it carries nothing where it has no
 * compliance. A soft one carries its own force, which nobody feels. */
bool sadmm_row_acts(const struct sadmm_rows *rows, size_t r);

#ifdef __cplusplus
}
#endif
#endif
