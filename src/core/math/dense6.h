/* Dense 6x6 algebra in double, row-major: for the literal backend, the certificate and input checks, where
 * readability matters and speed does not. */
#ifndef SADMM_CORE_MATH_DENSE6_H
#define SADMM_CORE_MATH_DENSE6_H

#include <math.h>
#include <stdbool.h>

#include "real.h" /* SADMM_INLINE: the CUDA backend compiles these for the device too */

/* Lower Cholesky factor, A = L L^T (only A's lower half is read). False when a pivot is lost to rounding: A is not
 * positive definite, or so nearly singular that solving with it means nothing. */
SADMM_INLINE bool dense6_cholesky(const double A[36], double L[36])
{
    for (int j = 0; j < 6; ++j) {
        double d = A[6 * j + j];
        for (int k = 0; k < j; ++k) d -= L[6 * j + k] * L[6 * j + k];
        if (!(d > 4 * 2.220446049250313e-16 * A[6 * j + j]) || isinf(d)) return false;
        d = sqrt(d);
        for (int i = 0; i < 6; ++i) {
            if (i < j) {
                L[6 * i + j] = 0;
            } else if (i == j) {
                L[6 * i + j] = d;
            } else {
                double s = A[6 * i + j];
                for (int k = 0; k < j; ++k) s -= L[6 * i + k] * L[6 * j + k];
                L[6 * i + j] = s / d;
            }
        }
    }
    return true;
}

/* y = L^-1 r, x = L^-T y. */
SADMM_INLINE void dense6_forward(const double L[36], const double r[6], double y[6])
{
    for (int i = 0; i < 6; ++i) {
        double s = r[i];
        for (int k = 0; k < i; ++k) s -= L[6 * i + k] * y[k];
        y[i] = s / L[6 * i + i];
    }
}

SADMM_INLINE void dense6_backward(const double L[36], const double y[6], double x[6])
{
    for (int i = 5; i >= 0; --i) {
        double s = y[i];
        for (int k = i + 1; k < 6; ++k) s -= L[6 * k + i] * x[k];
        x[i] = s / L[6 * i + i];
    }
}

SADMM_INLINE void dense6_solve(const double L[36], const double r[6], double x[6])
{
    double y[6];
    dense6_forward(L, r, y);
    dense6_backward(L, y, x);
}

SADMM_INLINE void dense6_mul(const double A[36], const double x[6], double y[6])
{
    for (int i = 0; i < 6; ++i) {
        double s = 0;
        for (int j = 0; j < 6; ++j) s += A[6 * i + j] * x[j];
        y[i] = s;
    }
}

SADMM_INLINE double dense6_dot(const double x[6], const double y[6])
{
    double s = 0;
    for (int i = 0; i < 6; ++i) s += x[i] * y[i];
    return s;
}

#endif
