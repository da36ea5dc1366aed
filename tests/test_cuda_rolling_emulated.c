/* test_cuda_rolling.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_rolling.c"
