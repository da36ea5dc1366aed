/* What takes the time of the dense contact solve, compiled once per instruction set, as trees are. */
#ifndef SADMM_CORE_SOLVE_NCP_KERNELS_H
#define SADMM_CORE_SOLVE_NCP_KERNELS_H

#include "core/base/variant.h"
#include "ncp_dense.h"

#ifdef __cplusplus
extern "C" {
#endif

struct island;

/* G of an island whose parts are all solved by their trees (ncp_island.h). */
typedef void sadmm_ncp_tree_responses(struct island *s, double *G);
/* The solution of a dense problem (ncp_newton.h, ncp_interior.h). */
typedef double sadmm_ncp_search(struct ncp_dense *d, double enough);

struct sadmm_ncp_kernels {
    sadmm_ncp_tree_responses *responses;
    sadmm_ncp_search *newton, *interior;
};

extern sadmm_ncp_tree_responses sadmm_ncp_tree_responses_baseline, sadmm_ncp_tree_responses_avx2;
extern sadmm_ncp_search sadmm_ncp_newton_baseline, sadmm_ncp_newton_avx2, sadmm_ncp_interior_baseline,
    sadmm_ncp_interior_avx2;

#ifdef __cplusplus
}
#endif
#endif
