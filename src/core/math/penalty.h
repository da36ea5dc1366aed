/* Penalty weights of the method `paper`. */
#ifndef SADMM_MATH_PENALTY_H
#define SADMM_MATH_PENALTY_H

#include "real.h"

/* Eq. (13), kg, from Tr(A_i) and Tr(C_i). `offset` is the paper's c, in its time-scaled units: hence dt^2. A body
 * without (non-zero) rows has no use for a penalty: 1. */
SADMM_INLINE double penalty_of_body(double trace_A, double trace_C, double mass_factor, double offset, double dt)
{
    return trace_C > 0 ? mass_factor * trace_A / trace_C + offset * dt * dt : 1;
}

/* Eq. (15): beta is multiplied by this. A residual of zero on both sides says nothing about the balance: leave the
 * penalty alone. */
SADMM_INLINE double penalty_ratio(double primal, double dual, double limit)
{
    if (primal <= 0 && dual <= 0) return 1;
    return min_of(max_of(primal / max_of(dual, 1e-300), 1 / limit), limit);
}

/* 1/s of a constraint, s = 1/beta_a + 1/beta_b; 1/beta of the static world is 0. */
SADMM_INLINE real penalty_inverse_s(real inv_beta_a, real inv_beta_b)
{
    const real s = inv_beta_a + inv_beta_b;
    return s > 0 ? 1 / s : (real)0;
}

#endif
