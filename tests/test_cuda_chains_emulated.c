/* test_cuda_chains.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_chains.c"
