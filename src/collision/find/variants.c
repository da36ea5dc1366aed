#include "variants.h"

#include "config.h"

const struct sadmm_collision_kernels *sadmm_collision_kernels_at(int index)
{
    static const struct sadmm_collision_kernels variants[] = {
#ifdef SADMM_HAVE_ISA_AVX2
        {"avx2", sadmm_place_slots_avx2, sadmm_narrow_phase_avx2},
#endif
        {"baseline", sadmm_place_slots_baseline, sadmm_narrow_phase_baseline},
    };
    const int count = (int)(sizeof variants / sizeof *variants);
#ifdef SADMM_HAVE_ISA_AVX2
    if (!__builtin_cpu_supports("avx2")) ++index;
#endif
    return index < count ? &variants[index] : NULL;
}
