/* test_cuda_body_forces.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_body_forces.c"
