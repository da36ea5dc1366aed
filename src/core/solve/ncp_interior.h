/* An interior point of a dense problem (ncp_dense.h): where many impulses do the same, what Newton's steps start from.
 *
 * De Saxce's form of the laws: with s = mu |u_t|, lambda is in Coulomb's cone, (u_n + s, u_t) in its dual, and the two
 * are orthogonal; rows with bounds likewise, bound by bound. Both are kept inside of their cones by Nesterov and Todd's
 * scaling, and the complementarity separation goes to zero (Mehrotra's predictor and corrector; Acary, Armand, Nguyen,
 * Shpakovych, "Second-order cone programming for frictional contact mechanics using interior point algorithm", 2023,
 * from which this differs by s being part of a step's equations). It ends in the middle of the impulses that are
 * solutions: contacts that can stick do so with some to spare, so that the piece of their law is plain to see. */
#ifndef SADMM_CORE_SOLVE_NCP_INTERIOR_H
#define SADMM_CORE_SOLVE_NCP_INTERIOR_H

#include "ncp_dense.h"

#ifdef __cplusplus
extern "C" {
#endif

/* From u alone: what lambda is at the start does not matter. Goes on until the natural map is at most `enough`, it
 * comes no nearer or the budget is spent; lambda and u are those that it ends with. Returns their natural map. */
double ncp_interior(struct ncp_dense *d, double enough);

#ifdef __cplusplus
}
#endif
#endif
