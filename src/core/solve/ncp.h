/* The dense contact solve (NCP) of small islands with joints, which takes away what the iterations have left.
 *
 * An iteration brings the loads of mechanisms along one contact at a time, and may cycle where rows resist what
 * contacts push. So after the last iteration, and after the block direct solve of the rows (articulation.h), an island
 * with joints and at most settings->ncp_points contact points, whose natural map or momentum is off by more than
 * 1e-9 m/s, is solved as a whole:
 *
 *     G = J_c (A - rows)^-1 J_c^T, dense: the response of its contacts to each other, with rows in their present states
 *     contacts by semismooth Newton steps, where need be from an interior point (ncp_newton.h)
 *     rows again by those impulses; one that changes its state is active from then on: one more number of G
 *
 * until no row changes. What it ends with is taken where it is off by less than the iterations are; else all stays as it
 * is. In double. Islands are independent of each other. */
#ifndef SADMM_CORE_SOLVE_NCP_H
#define SADMM_CORE_SOLVE_NCP_H

#include "articulation.h"
#include "core/base/error.h"
#include "core/model/system.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_ncp;

/* NULL: no memory. */
struct sadmm_ncp *sadmm_ncp_create(void);
void sadmm_ncp_destroy(struct sadmm_ncp *ncp);

/* system->velocity, impulses of system->contacts and multipliers of system->rows, in place. Velocities are those of the
 * world, not relative to supports. After sadmm_articulations_solve(after) of the same articulations and slots. solved:
 * islands that have changed. Errors: OUT_OF_MEMORY, nothing has changed. */
sadmm_status sadmm_ncp_solve(struct sadmm_ncp *ncp, struct sadmm_articulations *articulations,
                             const struct sadmm_system *system, const struct sadmm_row_constraint *slots,
                             const struct sadmm_settings *settings, int32_t *solved, struct sadmm_error *error);

#ifdef __cplusplus
}
#endif
#endif
