/* The instruction sets that trees and the dense contact solve are compiled for (SADMM_VARIANT). Those with fused
 * multiply-add use it: results differ between instruction sets by rounding. */
#ifndef SADMM_CORE_SOLVE_ARTICULATION_VARIANTS_H
#define SADMM_CORE_SOLVE_ARTICULATION_VARIANTS_H

#include "articulation_tree.h"
#include "ncp_newton.h"

#ifdef __cplusplus
extern "C" {
#endif

struct island;

/* G of islands whose parts are all solved by their trees (ncp_island.h). */
typedef void sadmm_ncp_tree_responses(struct island *s, double *G);

struct sadmm_articulation_kernels {
    const char *variant;
    sadmm_articulation_tree_load *load;
    sadmm_articulation_tree_factorize *factorize;
    sadmm_articulation_tree_solve *solve;
    sadmm_ncp_tree_responses *responses;
    sadmm_ncp_search *newton, *interior; /* ncp_newton.h, ncp_interior.h */
};

#define SADMM_ARTICULATION_JOIN2(a, b) a##b
#define SADMM_ARTICULATION_JOIN(a, b) SADMM_ARTICULATION_JOIN2(a, b)
/* A symbol of this variant. */
#define SADMM_ARTICULATION_KERNEL(name) SADMM_ARTICULATION_JOIN(sadmm_##name, SADMM_VARIANT)

/* The best one that this machine can run. */
const struct sadmm_articulation_kernels *sadmm_articulation_kernels_best(void);

extern sadmm_articulation_tree_load sadmm_articulation_tree_load_baseline, sadmm_articulation_tree_load_avx2;
extern sadmm_articulation_tree_factorize sadmm_articulation_tree_factorize_baseline,
    sadmm_articulation_tree_factorize_avx2;
extern sadmm_articulation_tree_solve sadmm_articulation_tree_solve_baseline, sadmm_articulation_tree_solve_avx2;
extern sadmm_ncp_tree_responses sadmm_ncp_tree_responses_baseline, sadmm_ncp_tree_responses_avx2;
extern sadmm_ncp_search sadmm_ncp_newton_baseline, sadmm_ncp_newton_avx2, sadmm_ncp_interior_baseline,
    sadmm_ncp_interior_avx2;

#ifdef __cplusplus
}
#endif
#endif
