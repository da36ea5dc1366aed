/* The instruction sets that trees are compiled for. */
#ifndef SADMM_CORE_SOLVE_ARTICULATION_VARIANTS_H
#define SADMM_CORE_SOLVE_ARTICULATION_VARIANTS_H

#include "articulation_kernels.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The best one that this machine can run. */
const struct sadmm_articulation_kernels *sadmm_articulation_kernels_best(void);

#ifdef __cplusplus
}
#endif
#endif
