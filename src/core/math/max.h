/* fmax and fmin, which host compilers make calls of: double in every precision, a NaN is no number. */
#ifndef SADMM_MATH_MAX_H
#define SADMM_MATH_MAX_H

#include <math.h>

#include "core/base/inline.h"

#ifdef __CUDA_ARCH__
SADMM_INLINE double max_of(double a, double b) { return fmax(a, b); }
SADMM_INLINE double min_of(double a, double b) { return fmin(a, b); }
#else
SADMM_INLINE double max_of(double a, double b)
{
    const double larger = a > b ? a : b; /* one instruction each, and no jump */
    return b != b ? a : larger;
}
SADMM_INLINE double min_of(double a, double b)
{
    const double smaller = a < b ? a : b;
    return b != b ? a : smaller;
}
#endif

#endif
