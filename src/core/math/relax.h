/* What the method `fast` relaxes in a batch of `count` iterations, i = 0 .. count - 1.
 *
 * Steps 2-4 give lambda^ from (lambda, v), then Step 1 gives v^ from (v, 2 lambda^ - lambda); relaxed, lambda and v go
 * rho times as far. The last iteration is plain: the result is (lambda^, v^). So is the one before a weight update, in
 * islands that have one. The first Step 1 of a solve is plain too:
 * bodies without constraints are at A^-1 b then and stay there. */
#ifndef SADMM_MATH_RELAX_H
#define SADMM_MATH_RELAX_H

#include "real.h"

/* Bodies keep their momentum residual b - A v + J^T lambda by adding changes, while lambda and v are rounded: after so
 * many iterations it is recomputed from both. In single precision the momentum error would else grow (vertical_stacks
 * with 2,000 iterations a step: 9e-6 in place of 5e-7). */
enum { RELAX_RESIDUAL_PERIOD = 128 };

SADMM_INLINE int relax_constraints(int i, int count) { return i + 1 < count; }
/* `step1_done`: Step 1 ran before in this solve. */
SADMM_INLINE int relax_velocity(int i, int count, int step1_done) { return step1_done && i + 1 < count; }

#endif
