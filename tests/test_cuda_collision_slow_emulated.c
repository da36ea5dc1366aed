/* test_cuda_collision_slow.c on the emulated device, with few bodies. */
#define SADMM_CUDA_EMULATED
#include "test_cuda_collision_slow.c"
