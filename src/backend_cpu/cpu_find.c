/* The best variant of the CPU backend this machine can run. */
#include "core/solve/backends.h"
#include "config.h"

#define DECLARE(isa)                                               \
    extern const struct sadmm_kernels sadmm_cpu_kernels_f32_##isa; \
    extern const struct sadmm_kernels sadmm_cpu_kernels_f64_##isa
#define RETURN_TABLE(isa) \
    return precision == SADMM_F32 ? &sadmm_cpu_kernels_f32_##isa : &sadmm_cpu_kernels_f64_##isa

#ifdef SADMM_HAVE_ISA_AVX512
DECLARE(avx512);
#endif
#ifdef SADMM_HAVE_ISA_AVX2
DECLARE(avx2);
#endif
#ifdef SADMM_HAVE_ISA_SSE2
DECLARE(sse2);
#endif
#ifdef SADMM_HAVE_ISA_GENERIC
DECLARE(generic);
#endif

#ifdef SADMM_HAVE_OPENMP
#define THREADS "OpenMP"
#else
#define THREADS "plain threads (built without OpenMP)"
#endif

const struct sadmm_kernels *sadmm_cpu_find(sadmm_precision precision, const char **reason)
{
#ifdef SADMM_HAVE_ISA_AVX512
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512bw")) {
        *reason = THREADS ", AVX-512";
        RETURN_TABLE(avx512);
    }
#endif
#ifdef SADMM_HAVE_ISA_AVX2
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        *reason = THREADS ", AVX2";
        RETURN_TABLE(avx2);
    }
#endif
#ifdef SADMM_HAVE_ISA_SSE2
    *reason = THREADS ", SSE2";
    RETURN_TABLE(sse2);
#else
    *reason = THREADS ", generic vectors";
    RETURN_TABLE(generic);
#endif
}
