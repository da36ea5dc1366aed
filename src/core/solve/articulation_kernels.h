/* What takes the time of trees, compiled once per instruction set. Those with fused multiply-add use it: results differ
 * between instruction sets by rounding. */
#ifndef SADMM_CORE_SOLVE_ARTICULATION_KERNELS_H
#define SADMM_CORE_SOLVE_ARTICULATION_KERNELS_H

#include "articulation_tree.h"
#include "core/base/variant.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_articulation_kernels {
    sadmm_articulation_tree_load *load;
    sadmm_articulation_tree_factorize *factorize;
    sadmm_articulation_tree_solve *solve;
};

extern sadmm_articulation_tree_load sadmm_articulation_tree_load_baseline, sadmm_articulation_tree_load_avx2;
extern sadmm_articulation_tree_factorize sadmm_articulation_tree_factorize_baseline,
    sadmm_articulation_tree_factorize_avx2;
extern sadmm_articulation_tree_solve sadmm_articulation_tree_solve_baseline, sadmm_articulation_tree_solve_avx2;

#ifdef __cplusplus
}
#endif
#endif
