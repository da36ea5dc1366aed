/* The instruction sets that contact finding is compiled for. */
#ifndef SADMM_COLLISION_FIND_VARIANTS_H
#define SADMM_COLLISION_FIND_VARIANTS_H

#include "kernels.h"

/* The variants that this machine can run, the best one first; NULL beyond the last one. */
const struct sadmm_collision_kernels *sadmm_collision_kernels_at(int index);

#endif
