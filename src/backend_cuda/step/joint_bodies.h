/* What a joint of a world is between, in the (sub-)step at hand. */
#ifndef SADMM_CUDA_STEP_JOINT_BODIES_H
#define SADMM_CUDA_STEP_JOINT_BODIES_H

#include "backend_cuda/device/view.h"
#include "core/model/coupling_law.h"
#include "core/model/joint_law.h"
#include "core/model/kinematic.h"

static __device__ __forceinline__ struct joint_body body_of(const cuda_view &v, int32_t body)
{
    struct joint_body out = {body, body >= 0 ? &v.step.before[body] : nullptr, false, false};
    if (!sadmm_body_is_kinematic(body)) return out;
    out.system_body = -1;
    out.rigid = &v.kinematic.moving[sadmm_kinematic(body)];
    out.prescribed = true;
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

/* Is joint j to be held together at the end of the step? */
static __device__ __forceinline__ bool joint_closes(const joint_view &joints, int32_t j)
{
    const sadmm_joint_def *def = &joints.joints[j].def;
    return def->locks && def->enabled && !joints.begin[j].broken;
}

/* The frame of joint j on its body at side s at the end of the step. place: of a dynamic body. Couplings have no
 * locks. */
static __device__ __forceinline__ struct joint_end joint_end_after(const cuda_view &v, int32_t j, int s,
                                                                   const double *place)
{
    const struct sadmm_resident_joint *joint = &v.joints.joints[j];
    const int32_t body = joint->body[s];
    if (body >= 0) return joint_end_of(&joint->frame[s], v3_load(place), q_load(place + 3));
    if (!sadmm_body_is_kinematic(body)) return joint_end_on(&joint->frame[s], nullptr);
    struct sadmm_rigid next;
    kinematic_move(&v.kinematic.moving[sadmm_kinematic(body)], v.model.settings->dt, &next);
    return joint_end_on(&joint->frame[s], &next);
}

#endif
