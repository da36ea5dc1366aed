/* Impacts, on the CUDA backend. */
#define IMPACTS_ON_CUDA
#include "test_impacts.c"
