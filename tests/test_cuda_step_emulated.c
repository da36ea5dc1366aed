/* test_cuda_step.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_step.c"
