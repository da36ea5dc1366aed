/* test_cuda_analytic.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_analytic.c"
