/* Scale of gravity and damping of bodies, on the CUDA backend. */
#define BODIES_ON_CUDA
#include "test_body_forces.c"
