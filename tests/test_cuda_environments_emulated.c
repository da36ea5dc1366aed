#define CUDA_EMULATED
#include "test_cuda_environments.c"
