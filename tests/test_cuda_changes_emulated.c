/* test_cuda_changes.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_changes.c"
