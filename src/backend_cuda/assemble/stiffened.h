/* Bodies with what joints stiffen them by, which is beside them on the device: a step's start is not written to. */
#ifndef SADMM_CUDA_ASSEMBLE_STIFFENED_H
#define SADMM_CUDA_ASSEMBLE_STIFFENED_H

#include "backend_cuda/device/view.h"
#include "core/model/stiffening.h"

/* Body i in the step, with what joints stiffen it by. */
static __device__ __forceinline__ struct sadmm_rigid stiffened_rigid(const cuda_view &v, int32_t i)
{
    const struct sadmm_rigid *before = &v.step.before[i];
    struct sadmm_rigid body = *before;
    if (v.joints.stiffening[i].any)
        stiffening_set(&body, before->stiffness, v.model.settings->dt, v.joints.stiffening[i].more);
    return body;
}

#endif
