/* The state of one of many equal worlds, in device memory (core/solve/resident.h, sadmm_resident_state). */
#ifndef SADMM_CUDA_DEVICE_KEPT_STATE_H
#define SADMM_CUDA_DEVICE_KEPT_STATE_H

#include "core/solve/resident.h"

/* All of it is one block, which begins with this; pointers are into the block. */
struct cuda_kept_state {
    struct sadmm_rigid *rigid;
    struct sadmm_extrapolation *extrapolation;
    double *wrench;
    struct sadmm_kinematic_body *kinematic;
    double *kinematic_wrench;
    struct sadmm_joint_memory *joints;
    uint8_t *enabled;
    struct sadmm_coupling_memory *couplings;
    double *gear_force;
    struct sadmm_contact_pair *pairs; /* shapes and bodies as in the first world; points counted from 0 */
    struct sadmm_contact_point *points;
    struct sadmm_contact_migration *migrations;
    int32_t pair_count, point_count;
    double dt; /* of the step that impulses are for; 0: of none */
};

#endif
