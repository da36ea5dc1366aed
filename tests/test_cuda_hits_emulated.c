/* test_cuda_hits.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_hits.c"
