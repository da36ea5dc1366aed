/* Semismooth Newton steps on the natural maps of a dense problem (ncp_dense.h). Which piece of each law holds is read
 * from lambda - u/w; a step solves all those pieces at once, so that with the right ones it ends at the solution, to
 * rounding, whatever G's condition. Where they do not come to an end, from an interior point (ncp_interior.h) once
 * more; then for laws that give, less and less (proximal points). */
#ifndef SADMM_CORE_SOLVE_NCP_NEWTON_H
#define SADMM_CORE_SOLVE_NCP_NEWTON_H

#include "ncp_dense.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Goes on until the natural map is at most `enough`, nothing else is left to try or the budget is spent. Returns it. */
double ncp_newton(struct ncp_dense *d, double enough);

#ifdef __cplusplus
}
#endif
#endif
