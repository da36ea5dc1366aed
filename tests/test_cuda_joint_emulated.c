/* test_cuda_joint.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_joint.c"
