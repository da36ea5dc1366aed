/* The dense contact solve (NCP) of small islands: contacts and joints at once, to rounding.
 *
 * An iteration brings the loads of mechanisms along one contact at a time, and may cycle where rows resist what
 * contacts push. So an island of at most settings->ncp_points contact points is solved as a whole: with joints before
 * the first iteration where its natural map or momentum is off by more than 1e-9 m/s, and what is not solved by then
 * after the last one; without joints, for which some iterations cost less, where these miss settings->tolerance:
 *
 *     G = J_c (A - rows)^-1 J_c^T, dense: the response of its contacts to each other, with rows in their present states
 *     contacts by semismooth Newton steps, where need be from an interior point, or by proximal points (ncp_newton.h)
 *     rows again by those impulses; one that changes its state is active from then on: one more number of G
 *
 * until no row changes. Where that ends without a solution, or with one that throws bodies about, contacts give by a
 * share of their response, from impulses of 0. What is neither is taken where it is nearer to the laws; else all stays
 * as it is. Islands that are solved before the first iteration need none, and keep their solution through those of
 * others. Where they are all there is but few contacts without joints, these are solved then, too, and no iteration is
 * made. In double. Islands are independent of each other. */
#ifndef SADMM_CORE_SOLVE_NCP_H
#define SADMM_CORE_SOLVE_NCP_H

#include "articulation.h"
#include "core/base/error.h"
#include "core/model/system.h"
#include "solve_error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_ncp;

/* An iteration of a contact point takes as long as so many multiplications here, 10 ns. */
enum { NCP_POINT_WORK = 100 };

/* NULL: no memory. */
struct sadmm_ncp *sadmm_ncp_create(void);
void sadmm_ncp_destroy(struct sadmm_ncp *ncp);

/* A system of one (sub-)step: after the block solve of the same articulations and slots, before and after the
 * iterations. Velocities are those of the world, not relative to supports. errors: of the iterations' result; NULL: not
 * known, islands without joints are left as they are. */
struct sadmm_ncp_input {
    int iterations; /* that were made */
    struct sadmm_articulations *articulations;
    const struct sadmm_system *system; /* velocity, impulses of contacts and multipliers of rows in place */
    const struct sadmm_row_constraint *slots;
    const struct sadmm_settings *settings;
    const struct sadmm_solve_errors *errors;
};

/* A (sub-)step begins. */
void sadmm_ncp_begin(struct sadmm_ncp *ncp);

/* Before the iterations. tries: else all is left for later. all: every island is solved, those without constraints,
 * too. solved: islands that have changed. Errors: OUT_OF_MEMORY, nothing has changed. */
sadmm_status sadmm_ncp_solve(struct sadmm_ncp *ncp, const struct sadmm_ncp_input *input, bool tries, bool *all,
                             int32_t *solved, struct sadmm_error *error);

/* The islands of that call, by their first body (core/model/islands.h); (body_count). */
const int32_t *sadmm_ncp_islands(const struct sadmm_ncp *ncp);

/* Has the island of a body rows? */
bool sadmm_ncp_has_rows(const struct sadmm_ncp *ncp, int32_t body);

/* Between: is the island of this label solved, or will it be tried after the iterations? *work: what that takes, in
 * multiplications, about. */
bool sadmm_ncp_has(const struct sadmm_ncp *ncp, int32_t label, const struct sadmm_settings *settings, double *work);

/* After them: islands that were solved before are as they were then, others are solved from where they are. moved:
 * bodies without joints have changed, whom the iterations do not move then. */
sadmm_status sadmm_ncp_solve_again(struct sadmm_ncp *ncp, const struct sadmm_ncp_input *input, int32_t *solved,
                                   bool *moved, struct sadmm_error *error);

/* What the last call has left of an island's error, joints that contradict each other included, m/s; -1: not known. */
double sadmm_ncp_error(const struct sadmm_ncp *ncp, int32_t label);

#ifdef __cplusplus
}
#endif
#endif
