/* test_cuda_fast.c on the emulated device: the backend's own sources, thread by thread, in every build. */
#define CUDA_EMULATED
#include "test_cuda_fast.c"
