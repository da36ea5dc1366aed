/* The most kinetic energy a step may leave an island of rigid bodies with (method `fast`).
 *
 * Contacts take energy out of the free motion v_f = A^-1 b, but for the work W = sum max(0, -e) lambda_n of those that
 * push overlapping bodies apart. An iteration that is cut short need not: then the island is slowed down to what is
 * allowed. W is believed only where the momentum A v - b - J^T lambda is balanced to 3 % (R: its energy, by A^-1). A
 * solution stays as it is.
 *
 * That much energy lets bodies bounce: impulses of a landing, taken over into the next step, need iterations to go down
 * again. In a solution they cannot. From A (v - v_f) = J^T lambda and lambda . x <= -e lambda_n (friction takes
 * energy),
 *
 *     v . A (v - v_f) <= W
 *
 * so that v ends on or in the sphere that has 0 and v_f at opposite ends, but for W. Few iterations in a step that
 * starts warm are held to that, too. Here W need not be believed: what too large a W allows is limited by the above. */
#ifndef SADMM_MATH_LIMIT_H
#define SADMM_MATH_LIMIT_H

#include "real.h"
#include "weight.h"

/* Rounding of energies in single precision, some hundred times over. */
#define LIMIT_ROUNDING 1e-5
#define LIMIT_BALANCED 1e-3

struct limit_energies {
    double now, free, momentum_residual, work; /* of v, of v_f, R, W; J */
};

SADMM_INLINE int limit_suspects(double now, double free) { return now > (1 + LIMIT_ROUNDING) * free; }

/* The factor for the island's velocities, 1: none. */
SADMM_INLINE double limit_factor(const struct limit_energies *e)
{
    int balanced = e->momentum_residual <= LIMIT_BALANCED * (e->now + e->free);
    double allowed = e->free + (balanced ? e->work : 0);
    return limit_suspects(e->now, allowed) ? sqrt(allowed / e->now) : 1;
}

/* What goes along the free motion by less than this share is left to come to rest by itself; so is what may be
 * rounding, by epsilon of the solver's precision. */
#define LIMIT_STILL 1e-8
#define LIMIT_STILL_ROUNDING 10.0
/* The least factor: islands that would be stopped in every step could not find their way out. */
#define LIMIT_LEAST 0.25

/* Is the island checked for bounces? */
SADMM_INLINE int limit_under_iterated(int warm, int iterations) { return warm && iterations < WEIGHT_UNDER_ITERATED; }

/* `along`: v . A v_f / 2, J. */
SADMM_INLINE int limit_bounces(double now, double free, double along, double epsilon)
{
    return now > (1 + LIMIT_ROUNDING) * along + fmax(LIMIT_STILL, LIMIT_STILL_ROUNDING * epsilon) * free;
}

/* The factor that takes v back to the sphere, 1: none. */
SADMM_INLINE double limit_bounce_factor(const struct limit_energies *e, double along, double epsilon)
{
    double factor;
    if (!limit_bounces(e->now, e->free, along, epsilon)) return 1;
    factor = (along + sqrt(along * along + 2 * e->now * e->work)) / (2 * e->now);
    return factor > 1 - LIMIT_ROUNDING ? 1 : fmax(factor, LIMIT_LEAST);
}

#endif
