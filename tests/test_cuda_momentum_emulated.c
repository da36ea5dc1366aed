/* test_cuda_momentum.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_momentum.c"
