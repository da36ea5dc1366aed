/* L D L^T of symmetric 6 x 6 matrices, in double, row-major, for hot paths of host and device (dense6.h: for what need
 * not be fast). In registers and without roots: what waits for memory and for quotients waits longest. */
#ifndef SADMM_CORE_MATH_LDL6_H
#define SADMM_CORE_MATH_LDL6_H

#include "real.h"

/* Of six numbers each, x_stride and y_stride apart; in pairs, which makes the chain of sums shorter. */
SADMM_INLINE double six_strided_product(const double *x, int x_stride, const double *y, int y_stride)
{
    return (x[0] * y[0] + x[x_stride] * y[y_stride]) +
           (x[2 * x_stride] * y[2 * y_stride] + x[3 * x_stride] * y[3 * y_stride]) +
           (x[4 * x_stride] * y[4 * y_stride] + x[5 * x_stride] * y[5 * y_stride]);
}
SADMM_INLINE double six_product(const double *x, const double *y) { return six_strided_product(x, 1, y, 1); }

/* L D L^T of a symmetric matrix S, of which the lower half is read: below the diagonal the unit L, on it D^-1. A pivot
 * that is lost to rounding: the row says what others say, and its solution is 0. */
SADMM_INLINE void ldl6_factor(const double S[36], double to[36])
{
    double L[6][6];
    int r, c, k;
    SADMM_UNROLL
    for (r = 0; r < 6; ++r) {
        SADMM_UNROLL
        for (k = 0; k <= r; ++k) L[r][k] = S[6 * r + k];
    }
    SADMM_UNROLL
    for (k = 0; k < 6; ++k) {
        const double inverse = L[k][k] > 0 ? 1 / L[k][k] : 0;
        to[7 * k] = inverse;
        SADMM_UNROLL
        for (r = k + 1; r < 6; ++r) {
            const double share = L[r][k] * inverse;
            to[6 * r + k] = share;
            SADMM_UNROLL
            for (c = k + 1; c <= r; ++c) L[r][c] -= share * L[c][k];
        }
    }
}

/* L^-1 x, D^-1 x, L^-T x in place; x = A^-1 b by all of them. */
SADMM_INLINE void ldl6_forward(const double L[36], double x[6])
{
    int r, i;
    SADMM_UNROLL
    for (r = 0; r < 6; ++r) {
        SADMM_UNROLL
        for (i = 0; i < r; ++i) x[r] -= L[6 * r + i] * x[i];
    }
}
SADMM_INLINE void ldl6_scale(const double L[36], double x[6])
{
    int k;
    SADMM_UNROLL
    for (k = 0; k < 6; ++k) x[k] *= L[7 * k];
}
SADMM_INLINE void ldl6_backward(const double L[36], double x[6])
{
    int r, i;
    SADMM_UNROLL
    for (r = 5; r >= 0; --r) {
        SADMM_UNROLL
        for (i = 5; i > r; --i) x[r] -= L[6 * i + r] * x[i];
    }
}
SADMM_INLINE void ldl6_solve(const double L[36], const double b[6], double x[6])
{
    double y[6];
    int k;
    SADMM_UNROLL
    for (k = 0; k < 6; ++k) y[k] = b[k];
    ldl6_forward(L, y);
    ldl6_scale(L, y);
    ldl6_backward(L, y);
    SADMM_UNROLL
    for (k = 0; k < 6; ++k) x[k] = y[k];
}

/* x^T A^-1 x */
SADMM_INLINE double ldl6_inverse_product(const double L[36], const double x[6])
{
    double y[6], sum = 0;
    int k;
    SADMM_UNROLL
    for (k = 0; k < 6; ++k) y[k] = x[k];
    ldl6_forward(L, y);
    SADMM_UNROLL
    for (k = 0; k < 6; ++k) sum += y[k] * y[k] * L[7 * k];
    return sum;
}

#endif
