/* What each backend offers the registry: its table for a precision, or NULL with a reason (static storage). When a
 * table is returned, *reason says what it runs on. */
#ifndef SADMM_CORE_SOLVE_BACKENDS_H
#define SADMM_CORE_SOLVE_BACKENDS_H

#include "kernels.h"

const struct sadmm_kernels *sadmm_ref_find(sadmm_precision precision, const char **reason);
const struct sadmm_kernels *sadmm_cpu_find(sadmm_precision precision, const char **reason);
const struct sadmm_kernels *sadmm_cuda_find(sadmm_precision precision, const char **reason);

#endif
