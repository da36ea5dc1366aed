/* What each backend offers the registry: its table for a precision, or NULL with a reason (static storage). When a
 * table is returned, *reason says what it runs on. */
#ifndef SADMM_CORE_SOLVE_BACKENDS_H
#define SADMM_CORE_SOLVE_BACKENDS_H

#include "kernels.h"

/* The one list: F(value, function) of every backend. */
#define SADMM_BACKEND_FINDERS(F)           \
    F(SADMM_BACKEND_REF, sadmm_ref_find)   \
    F(SADMM_BACKEND_CPU, sadmm_cpu_find)   \
    F(SADMM_BACKEND_CUDA, sadmm_cuda_find)

#define SADMM_DECLARE_FINDER(value, find) \
    const struct sadmm_kernels *find(sadmm_precision precision, const char **reason);
SADMM_BACKEND_FINDERS(SADMM_DECLARE_FINDER)

#endif
