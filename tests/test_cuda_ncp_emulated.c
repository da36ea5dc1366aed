/* test_cuda_ncp.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_ncp.c"
