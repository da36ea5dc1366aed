#include "ncp_variants.h"

#include "config.h"
#include "ncp_interior.h"
#include "ncp_newton.h"

const struct sadmm_ncp_kernels *sadmm_ncp_kernels_best(void)
{
    static const struct sadmm_ncp_kernels baseline = {sadmm_ncp_tree_responses_baseline, sadmm_ncp_newton_baseline,
                                                      sadmm_ncp_interior_baseline};
#ifdef SADMM_HAVE_ISA_AVX2
    static const struct sadmm_ncp_kernels avx2 = {sadmm_ncp_tree_responses_avx2, sadmm_ncp_newton_avx2,
                                                  sadmm_ncp_interior_avx2};
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return &avx2;
#endif
    return &baseline;
}

double ncp_newton(struct ncp_dense *d, double enough) { return sadmm_ncp_kernels_best()->newton(d, enough); }
double ncp_interior(struct ncp_dense *d, double enough) { return sadmm_ncp_kernels_best()->interior(d, enough); }
