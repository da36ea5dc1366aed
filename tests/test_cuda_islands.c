/* Islands on the CUDA backend. */
#define BODIES_ON_CUDA
#include "test_islands.c"
