/* Builds without CUDA: the backend is listed, with the reason why it cannot run. */
#include "core/solve/backends.h"
#include "config.h"

const struct sadmm_kernels *sadmm_cuda_find(sadmm_precision precision, const char **reason)
{
    (void)precision;
    *reason = SADMM_CUDA_MISSING_REASON;
    return 0;
}
