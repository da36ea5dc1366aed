/* Contacts solved directly: what the iterations have left is taken away where an island is small.
 *
 * The iteration brings what mechanisms press with along one contact at a time, and may go round and round where rows
 * hold what contacts push against. So after the last iteration, and after the rows' own solve (joined.h), an island
 * with joints and at most settings->direct_points contact points, whose natural map or
 * momentum is off by more than 1e-9 m/s, is solved as a whole:
 *
 *     G = J_c (A - rows)^-1 J_c^T, dense: how its contacts respond to each other, with rows in the states that they are in
 *     contacts by semismooth Newton steps, where need be from an interior point (direct_newton.h)
 *     rows again by those impulses; one that changes its state becomes one more number of G, from then on
 *
 * until no row changes. What it ends with is taken where it is off by less than the iterations are; else all stays as it
 * is. In double. Islands are independent of each other. */
#ifndef SADMM_CORE_SOLVE_DIRECT_H
#define SADMM_CORE_SOLVE_DIRECT_H

#include "core/base/error.h"
#include "core/model/system.h"
#include "joined.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_direct;

/* NULL: no memory. */
struct sadmm_direct *sadmm_direct_create(void);
void sadmm_direct_destroy(struct sadmm_direct *direct);

/* system->velocity, impulses of system->contacts and multipliers of system->rows, in place. Velocities are those of the
 * world, not relative to supports. After sadmm_joined_solve(after) of the same joined bodies and slots. solved: islands
 * that have changed. Errors: OUT_OF_MEMORY, nothing has changed. */
sadmm_status sadmm_direct_solve(struct sadmm_direct *direct, struct sadmm_joined *joined,
                                const struct sadmm_system *system, const struct sadmm_row_constraint *slots,
                                const struct sadmm_settings *settings, int32_t *solved, struct sadmm_error *error);

#ifdef __cplusplus
}
#endif
#endif
