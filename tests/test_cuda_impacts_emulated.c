/* test_cuda_impacts.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_impacts.c"
