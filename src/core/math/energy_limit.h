/* The energy limiter: the most kinetic energy that a step may leave an island of rigid bodies with (method `fast`).
 *
 * Contacts take energy out of the free motion v_f = A^-1 b, but for the work W = sum max(0, -e) lambda_n of those that
 * push overlapping bodies apart. An iteration that is cut short need not: then the island is slowed down to what is
 * allowed. Its impulses may be far too large, and W with them, so W counts as far as they can do it: by the share of
 * lambda that solves the dual problem best,
 *
 *     s = min(1, drive / response),    drive = -lambda . (J v_f + e),   response = lambda . J A^-1 J^T lambda
 *
 * the energy of A^-1 (b + s J^T lambda) is at most that of v_f and s W. A solution stays as it is.
 *
 * Within that limit bodies may still rebound: the impulses of a landing, with which the next step starts, take
 * iterations to decay. In a solution they cannot. From A (v - v_f) = J^T lambda and lambda . x <= -e lambda_n (friction
 * takes energy),
 *
 *     v . A (v - v_f) <= W
 *
 * so that v ends on or in the sphere that has 0 and v_f at opposite ends, but for W. Few iterations in an island that
 * starts warm are held to that, too, with all of W: what too large a W allows is limited by the above.
 *
 * What contacts cannot change is left alone. Of a floating island, which may move in ways no static contact feels
 * (math/momentum.h), energies are those of the rest of v and v_f, and the rest alone is slowed down. */
#ifndef SADMM_MATH_ENERGY_LIMIT_H
#define SADMM_MATH_ENERGY_LIMIT_H

#include "momentum.h"
#include "weight.h"

/* Rounding of energies in single precision, some hundred times over. */
#define ENERGY_LIMIT_ROUNDING 1e-5

struct island_energies {
    double now, free, work; /* of v, of v_f, W; J */
    double drive, response;
    double rigid;  /* of the motions that are left alone, which are not in the others */
    int kinematic; /* something that is none of its bodies pushes it, by as much as it takes: it is left alone */
};

SADMM_INLINE int energy_limit_exceeded(double now, double free) { return now > (1 + ENERGY_LIMIT_ROUNDING) * free; }

/* Less is rounding of what was taken out; epsilon: of the solver's precision. */
#define ENERGY_LIMIT_RIGID_ROUNDING 10.0
SADMM_INLINE int energy_limit_is_rounding(const struct island_energies *e, double epsilon)
{
    return e->now <= ENERGY_LIMIT_RIGID_ROUNDING * epsilon * e->rigid;
}

/* Of a floating island: the energies of the rest. `along`: as below. */
SADMM_INLINE void energy_limit_subtract_rigid(struct island_energies *e, double *along,
                                              const struct momentum_energies *rigid)
{
    e->now -= rigid->now;
    e->free = max_of(e->free - rigid->free, 0.0);
    e->rigid = rigid->free;
    *along -= rigid->along;
}

/* What of W counts. */
SADMM_INLINE double energy_limit_work(const struct island_energies *e)
{
    const double share = e->drive >= e->response ? 1 : e->drive > 0 ? e->drive / e->response : 0;
    return share * e->work;
}

/* The factor for the island's velocities, 1: none. */
SADMM_INLINE double energy_limit_factor(const struct island_energies *e, double epsilon)
{
    const double allowed = e->free + energy_limit_work(e);
    if (e->kinematic) return 1;
    return energy_limit_exceeded(e->now, allowed) && !energy_limit_is_rounding(e, epsilon) ? sqrt(allowed / e->now) : 1;
}

/* What goes along the free motion by less than this share is left to come to rest by itself; so is what may be
 * rounding, by epsilon of the solver's precision. */
#define ENERGY_LIMIT_STILL          1e-8 /* measured: bench/constants.py, heaps standing */
#define ENERGY_LIMIT_STILL_ROUNDING 10.0
/* The least factor: islands that would be stopped in every step could not find their way out. */
#define ENERGY_LIMIT_LEAST          0.25 /* measured: bench/constants.py, heaps standing */

/* Is the island tested for a rebound? */
SADMM_INLINE int energy_limit_tests_rebound(int warm, int iterations)
{
    return warm && iterations < WEIGHT_SPRING_ITERATIONS;
}

/* `along`: v . A v_f / 2, J. */
SADMM_INLINE int energy_limit_rebounds(double now, double free, double along, double epsilon)
{
    return now > (1 + ENERGY_LIMIT_ROUNDING) * along +
                     max_of(ENERGY_LIMIT_STILL, ENERGY_LIMIT_STILL_ROUNDING * epsilon) * free;
}

/* The factor that scales v back to the sphere, 1: none. */
SADMM_INLINE double energy_limit_rebound_factor(const struct island_energies *e, double along, double epsilon)
{
    double factor;
    if (e->kinematic || !energy_limit_rebounds(e->now, e->free, along, epsilon) || energy_limit_is_rounding(e, epsilon))
        return 1;
    factor = (along + sqrt(along * along + 2 * e->now * e->work)) / (2 * e->now);
    return factor > 1 - ENERGY_LIMIT_ROUNDING ? 1 : max_of(factor, ENERGY_LIMIT_LEAST);
}

#endif
