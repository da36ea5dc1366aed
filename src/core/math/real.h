/* The scalar of the formulas. A source that includes src/core/math is compiled once per precision with
 * -DSADMM_REAL=float or double; everything here is static inline, so the two never meet at link time.
 * nvcc compiles the same functions for the device. */
#ifndef SADMM_MATH_REAL_H
#define SADMM_MATH_REAL_H

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "core/base/inline.h"
#include "max.h"

#ifndef SADMM_REAL
#define SADMM_REAL double
#define SADMM_REAL_IS_DOUBLE 1
#endif

typedef SADMM_REAL real;

/* Before a loop over an array of known size, which stays in registers then. */
#ifdef __CUDA_ARCH__
#define SADMM_UNROLL _Pragma("unroll")
#define SADMM_ROLLED _Pragma("unroll 1") /* what runs rarely should not take registers */
#else
#define SADMM_UNROLL
#define SADMM_ROLLED
#endif

/* sizeof folds at compile time: one source serves both precisions without the preprocessor knowing the type. */
#define SADMM_EPSILON ((real)(sizeof(real) == 4 ? (double)FLT_EPSILON : DBL_EPSILON))
#define SADMM_REAL_MAX ((real)(sizeof(real) == 4 ? (double)FLT_MAX : DBL_MAX))

SADMM_INLINE real real_sqrt(real x) { return sizeof(real) == 4 ? (real)sqrtf((float)x) : (real)sqrt((double)x); }
SADMM_INLINE real real_abs(real x) { return sizeof(real) == 4 ? (real)fabsf((float)x) : (real)fabs((double)x); }
SADMM_INLINE real real_min(real a, real b) { return a < b ? a : b; }
SADMM_INLINE real real_max(real a, real b) { return a > b ? a : b; }
SADMM_INLINE real real_clamp(real x, real lo, real hi) { return x < lo ? lo : (x > hi ? hi : x); }
/* The larger one, in double in every precision; a NaN stays. */
SADMM_INLINE double keep_max(double a, double b) { return a != a || b <= a ? a : b; }

#endif
