/* test_cuda_push.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_push.c"
