/* Kinematic bodies on the CUDA backend. */
#define BODIES_ON_CUDA
#include "test_kinematic.c"
