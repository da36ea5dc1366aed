/* test_cuda_substeps.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_substeps.c"
