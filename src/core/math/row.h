/* The law of a scalar constraint row. With x = J_a v_a + J_b v_b its velocity and lambda its multiplier,
 *
 *     gain x + bias + compliance lambda   = 0    where lo < lambda < hi
 *                                        >= 0    where lambda = lo
 *                                        <= 0    where lambda = hi
 *
 *     hard (4)         1    e     0    -inf .. inf       x + e = 0
 *     soft (3)         c    k e   1    -inf .. inf       lambda = -(k e + c x)
 *     one-sided limit  1    e     0       0 .. inf       0 <= lambda  _|_  x + e >= 0
 *     motor            1   -w     0    -F dt .. F dt     speed w with a force of at most F
 *     dry friction     1    0     0    -F dt .. F dt     holds up to F, then slips against F
 *
 * The equation may be multiplied by any positive number; rows without compliance have gain 1. The gain stands at x, not
 * its inverse at lambda, so that soft rows may have no damping (gain 0: a plain force) or no stiffness (bias 0).
 *
 * Step 3 of the paper, (8), solves the law on its own with x = x_0 + s (lambda - lambda_0), s = 1/beta_a + 1/beta_b.
 * Inside the bounds
 *
 *     lambda - lambda_0 = -(gain x_0 + bias + compliance lambda_0) / (compliance + gain s)
 *
 * which is the paper's update for hard rows (gain 1, compliance 0) and for soft ones (gain c, compliance 1). The law is
 * monotone in lambda, so that the exact solution within bounds is this one, clamped: row by row, and only where no
 * other row's multiplier moves x in the same step. */
#ifndef SADMM_MATH_ROW_H
#define SADMM_MATH_ROW_H

#include "real.h"

/* The residual of the equation. */
SADMM_INLINE real row_residual(real gain, real bias, real compliance, real x, real lambda)
{
    return gain * x + bias + compliance * lambda;
}

/* What the residual is multiplied with for the change of lambda (less its sign); weight = 1/s, >= 0. A row of weight 0
 * does not move. */
SADMM_INLINE real row_step(real gain, real compliance, real weight) { return weight / (gain + compliance * weight); }

/* lambda + change within the bounds, and the change with that: without the rounding of the sum where no bound is
 * met. */
SADMM_INLINE real row_bounded(real lambda, real lo, real hi, real *change)
{
    real next = lambda + *change, bounded = real_clamp(next, lo, hi);
    if (bounded != next) *change = bounded - lambda;
    return bounded;
}

/* The natural map of a row whose own response J A^-1 J^T is w > 0: how far lambda is from the law's solution by this
 * row alone, times w, m/s. */
SADMM_INLINE real row_natural_map(real gain, real bias, real compliance, real lo, real hi, real x, real lambda, real w)
{
    const real residual = row_residual(gain, bias, compliance, x, lambda), under = compliance + gain * w;
    real change = -residual / under;
    const real unbounded = change;
    row_bounded(lambda, lo, hi, &change);
    /* w / (gain w) is exactly 1 */
    return change == unbounded ? real_abs(residual) * (w / under) : real_abs(change) * w;
}

#endif
