#include "joint_variants.h"

#include "config.h"

#define ALL(variant)                                                                                                   \
    {                                                                                                                  \
        sadmm_joint_spins_##variant, sadmm_joint_moves_##variant, sadmm_joint_act_##variant,                          \
            sadmm_joint_rates_##variant, sadmm_joint_laws_##variant, sadmm_joint_openings_##variant,                   \
            sadmm_joint_close_##variant                                                                                \
    }

const struct sadmm_joint_kernels *sadmm_joint_kernels_best(void)
{
    static const struct sadmm_joint_kernels baseline = ALL(baseline);
#ifdef SADMM_HAVE_ISA_AVX2
    static const struct sadmm_joint_kernels avx2 = ALL(avx2);
    if (__builtin_cpu_supports("avx2")) return &avx2;
#endif
    return &baseline;
}
