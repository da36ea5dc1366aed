/* The instruction sets that kernels of joints are compiled for. */
#ifndef SADMM_WORLD_STEP_JOINT_VARIANTS_H
#define SADMM_WORLD_STEP_JOINT_VARIANTS_H

#include "joint_kernels.h"

/* The best one that this machine can run. */
const struct sadmm_joint_kernels *sadmm_joint_kernels_best(void);

#endif
