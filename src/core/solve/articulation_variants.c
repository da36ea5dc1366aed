#include "articulation_variants.h"

#include "config.h"

const struct sadmm_articulation_kernels *sadmm_articulation_kernels_best(void)
{
    static const struct sadmm_articulation_kernels baseline = {sadmm_articulation_tree_load_baseline,
                                                               sadmm_articulation_tree_factorize_baseline,
                                                               sadmm_articulation_tree_solve_baseline};
#ifdef SADMM_HAVE_ISA_AVX2
    static const struct sadmm_articulation_kernels avx2 = {sadmm_articulation_tree_load_avx2,
                                                           sadmm_articulation_tree_factorize_avx2,
                                                           sadmm_articulation_tree_solve_avx2};
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return &avx2;
#endif
    return &baseline;
}
