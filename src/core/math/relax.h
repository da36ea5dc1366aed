/* What the method `fast` relaxes in a stretch of `count` iterations, i = 0 .. count - 1.
 *
 * Step 1 gives v^ from (v, 2 lambda^ - lambda), Steps 2-4 lambda^ from (lambda, v); relaxed, v and lambda go rho times as far.
 * Result and measure are about (v^, lambda^) themselves: the last Step 1 is plain, and so are the last two Steps 2-4, since
 * the last of them starts from the lambda that the last Step 1 has seen. The first Step 1 of a solve is plain too: bodies
 * without constraints are at A^-1 b then and stay there. */
#ifndef SADMM_MATH_RELAX_H
#define SADMM_MATH_RELAX_H

#include "real.h"

/* `settled`: Step 1 ran before in this solve. */
SADMM_INLINE int relax_velocity(int i, int count, int settled) { return settled && i + 1 < count; }
SADMM_INLINE int relax_constraints(int i, int count) { return i + 2 < count; }

#endif
