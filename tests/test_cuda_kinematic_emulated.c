/* test_cuda_kinematic.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_kinematic.c"
