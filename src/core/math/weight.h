/* The weight of a constraint in the method `fast` (docs/algorithm.md, section 7): the mass it carries.
 *
 *     B = min(load / V, m) + phi / w          V^2 = sum g . A^-1 g / m,   g = J^T lambda, over the bodies of an island
 *
 * An impulse of size `load` changes velocities of its island by about V, so load / V is the mass behind the constraint.
 * Where impulses cancel in g (bodies clamped between each other) V says nothing: m, the mass of the island, is the cap.
 * phi / w, with w the constraint's own response, is what a constraint without a load gets; it starts high, because loads
 * that have not been found yet are the ones to come, and falls where a step takes its weights anew. Double in every
 * precision: it runs a few times a step. */
#ifndef SADMM_MATH_WEIGHT_H
#define SADMM_MATH_WEIGHT_H

#include "real.h"

/* Iterations after which a step that started cold takes its weights anew, from the loads it has found by then: 5, 10, 20,
 * 40, ... Changes as late as that are small, and a change disturbs. */
enum { WEIGHT_FIRST_REFRESH = 5 };

/* phi. `refresh`: 0 at the start of the step. */
SADMM_INLINE double weight_floor(int refresh)
{
    double phi = 3;
    int k;
    for (k = 0; k < refresh && phi > 1; ++k) phi *= 0.7;
    return phi > 1 ? phi : 1;
}

/* Less is rounding of the impulses, and says nothing about loads; m/s. */
#define WEIGHT_LEAST_SPEED 1e-6

/* V of an island from sum g . A^-1 g over its bodies and its mass, m/s. */
SADMM_INLINE double weight_speed(double energy, double mass)
{
    return sqrt(energy / mass + WEIGHT_LEAST_SPEED * WEIGHT_LEAST_SPEED);
}

/* min(load / V, m), kg; load in N s. */
SADMM_INLINE double weight_mass(double load, double speed, double mass)
{
    return fmin(load / speed, mass);
}

#endif
