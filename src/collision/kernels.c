#include "kernels.h"

#include "config.h"

const struct sadmm_collision_kernels *sadmm_collision_kernels_find(void)
{
#ifdef SADMM_HAVE_ISA_AVX2
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return &sadmm_collision_kernels_avx2;
#endif
    return &sadmm_collision_kernels_baseline;
}
