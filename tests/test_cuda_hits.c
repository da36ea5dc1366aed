/* Hits of bodies in flight, on the CUDA backend. */
#define HITS_ON_CUDA
#include "test_hits.c"
