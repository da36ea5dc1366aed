/* test_cuda_events.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_events.c"
