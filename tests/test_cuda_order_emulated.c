/* test_cuda_order.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_order.c"
