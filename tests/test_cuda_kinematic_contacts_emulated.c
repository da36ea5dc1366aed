/* test_cuda_kinematic_contacts.c on the emulated device. */
#define CUDA_EMULATED
#include "test_cuda_kinematic_contacts.c"
