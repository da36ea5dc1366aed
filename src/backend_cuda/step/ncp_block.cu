/* The dense contact solve, an island by each thread block: of few islands, and of what takes a warp too long. */
#include "backend_cuda/device/double.h"

#include "ncp_kernel.h"

cuda_kernel CUDA(ncp_block_kernel)(void) { return ncp_kernel; }
