/* The instruction sets that the dense contact solve is compiled for. */
#ifndef SADMM_CORE_SOLVE_NCP_VARIANTS_H
#define SADMM_CORE_SOLVE_NCP_VARIANTS_H

#include "ncp_kernels.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The best one that this machine can run. */
const struct sadmm_ncp_kernels *sadmm_ncp_kernels_best(void);

#ifdef __cplusplus
}
#endif
#endif
