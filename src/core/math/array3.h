/* 3-vectors as arrays. Double in every precision: sums of wrenches and their sizes, a few times a step. */
#ifndef SADMM_MATH_ARRAY3_H
#define SADMM_MATH_ARRAY3_H

#include "real.h"

SADMM_INLINE double dot3(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
/* 1-norm: no less than the length, and no root. */
SADMM_INLINE double size3(const double a[3]) { return fabs(a[0]) + fabs(a[1]) + fabs(a[2]); }
SADMM_INLINE double length3(const double a[3]) { return sqrt(dot3(a, a)); }

/* x += sign w x r */
SADMM_INLINE void add_cross(const double w[3], const double r[3], double sign, double x[3])
{
    x[0] += sign * (w[1] * r[2] - w[2] * r[1]);
    x[1] += sign * (w[2] * r[0] - w[0] * r[2]);
    x[2] += sign * (w[0] * r[1] - w[1] * r[0]);
}

#endif
