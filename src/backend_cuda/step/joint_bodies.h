/* What a joint of a world is between, in the (sub-)step at hand. */
#ifndef SADMM_CUDA_STEP_JOINT_BODIES_H
#define SADMM_CUDA_STEP_JOINT_BODIES_H

#include "backend_cuda/device/view.h"
#include "core/model/coupling_law.h"
#include "core/model/joint_law.h"

static __device__ __forceinline__ struct joint_body body_of(const cuda_view &v, int32_t body)
{
    struct joint_body out = {body, body >= 0 ? &v.step.before[body] : nullptr, false, false};
    if (!sadmm_body_is_driven(body)) return out;
    out.system_body = -1;
    out.rigid = &v.driven.moving[sadmm_driven(body)];
    out.steered = true;
    return out;
}

/* End a of a joint: a coupling's is its target. */
static __device__ __forceinline__ struct joint_body body_a_of(const cuda_view &v,
                                                              const struct sadmm_resident_joint *joint)
{
    if (joint->coupling < 0) return body_of(v, joint->body[0]);
    const struct joint_body out = {-1, &v.joints.couplings_before[joint->coupling].target, true, true};
    return out;
}

#endif
