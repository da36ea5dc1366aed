/* test_cuda_collision.c on the emulated device: the stage's own sources, thread by thread, in every build. */
#define SADMM_CUDA_EMULATED
#include "test_cuda_collision.c"
