/* The emulated device as a program's backend cuda, in place of the library's own: the project's commands with it. */
#include "core/solve/backends.h"
#include "emulation_control.h"

const struct sadmm_kernels *sadmm_cuda_find(sadmm_precision precision, const char **reason)
{
    *reason = "emulated device";
    return &cuda_emulation_tables[precision];
}
