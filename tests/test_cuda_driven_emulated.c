/* test_cuda_driven.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_driven.c"
