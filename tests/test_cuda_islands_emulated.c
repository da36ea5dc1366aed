/* test_cuda_islands.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_islands.c"
