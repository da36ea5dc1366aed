/* The dense contact solve, an island by each warp: of thousands of islands. */
#define NCP_BY_WARP
#include "backend_cuda/device/double.h"

#include "ncp_kernel.h"

cuda_kernel CUDA(ncp_warp_kernel)(void) { return ncp_kernel; }
