/* Masses and principal moments that a body may have: what the host and devices check of numbers that are set. */
#ifndef SADMM_CORE_MODEL_MOMENTS_H
#define SADMM_CORE_MODEL_MOMENTS_H

#include <stdbool.h>

#include "core/base/inline.h"

#define MOMENTS_LEAST_MASS 1e-9 /* kg */

/* World-frame moments are sums of all three, so that the smallest is known to (unit roundoff x ratio): it and the
 * velocity about its axis are lost to 1 % at these ratios, wholly at some 100 times these. single: of the solver. */
SADMM_INLINE double moments_most_ratio(bool single) { return single ? 1e6 : 1e12; }

SADMM_INLINE bool moments_ratio_fits(const double inertia[3], bool single)
{
    double least = inertia[0], most = inertia[0];
    int k;
    for (k = 1; k < 3; ++k) {
        least = inertia[k] < least ? inertia[k] : least;
        most = inertia[k] > most ? inertia[k] : most;
    }
    return most <= moments_most_ratio(single) * least;
}

/* No rigid body has a moment of more than the sum of the others. */
SADMM_INLINE bool moments_sum_fits(const double inertia[3], int k)
{
    return inertia[k] <= (inertia[(k + 1) % 3] + inertia[(k + 2) % 3]) * (1 + 1e-9);
}

/* Of a mass and moments: rounding to single precision may take numbers out of their range, the least mass, a moment
 * that is the sum of the others. They become what they were meant to be. */
#define MOMENTS_ROUNDING (1 + 1e-6)
SADMM_INLINE void moments_mend(double row[4])
{
    int k;
    if (row[0] < MOMENTS_LEAST_MASS && row[0] * MOMENTS_ROUNDING >= MOMENTS_LEAST_MASS) row[0] = MOMENTS_LEAST_MASS;
    for (k = 1; k < 4; ++k) {
        const double most = row[1 + k % 3] + row[1 + (k + 1) % 3];
        if (row[k] > most && row[k] <= MOMENTS_ROUNDING * most) row[k] = most;
    }
}

#endif
