/* The larger and the smaller of two: double in every precision, a NaN is no number. Not fmax and fmin, which host
 * compilers make calls of, and which take another zero on a device. */
#ifndef SADMM_MATH_MAX_H
#define SADMM_MATH_MAX_H

#include <math.h>

#include "core/base/inline.h"

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
