/* The most kinetic energy a step may leave an island of rigid bodies with (method `fast`).
 *
 * Contacts take energy out of the free motion v_f = A^-1 b, but for the work W = sum max(0, -e) lambda_n of those that push
 * overlapping bodies apart. An iteration that is cut short need not: then the island is slowed down to what is allowed.
 * W is believed only where the momentum A v - b - J^T lambda is balanced to a tenth (R: its energy, by A^-1). A solution
 * stays as it is. */
#ifndef SADMM_MATH_LIMIT_H
#define SADMM_MATH_LIMIT_H

#include "real.h"

/* Rounding of energies in single precision, some hundred times over. */
#define LIMIT_ROUNDING 1e-5
#define LIMIT_BALANCED 0.01

struct limit_energies {
    double now, free, defect, work; /* of v, of v_f, R, W; J */
};

SADMM_INLINE int limit_suspects(double now, double free) { return now > (1 + LIMIT_ROUNDING) * free; }

/* The factor for the island's velocities, 1: none. */
SADMM_INLINE double limit_factor(const struct limit_energies *e)
{
    int balanced = e->defect <= LIMIT_BALANCED * (e->now + e->free);
    double allowed = e->free + (balanced ? e->work : 0);
    return limit_suspects(e->now, allowed) ? sqrt(allowed / e->now) : 1;
}

#endif
