/* Names of kernels that are compiled once per instruction set, with -DSADMM_VARIANT=_avx2 and the like. */
#ifndef SADMM_CORE_BASE_VARIANT_H
#define SADMM_CORE_BASE_VARIANT_H

#define SADMM_VARIANT_JOIN2(a, b) a##b
#define SADMM_VARIANT_JOIN(a, b) SADMM_VARIANT_JOIN2(a, b)
/* The symbol of this variant. */
#define SADMM_KERNEL(name) SADMM_VARIANT_JOIN(sadmm_##name, SADMM_VARIANT)

#endif
