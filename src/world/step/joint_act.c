/* A joint in a (sub-)step: its bodies, and what they make of its geometry (core/model/joint_law.h). Joints and gears
 * make their rows of it. */
#include "joint_act.h"

struct joint_body sadmm_world_joint_body(const sadmm_world *world, int32_t slot)
{
    struct joint_body out = {-1, NULL, false, false};
    if (slot < 0) return out;
    const struct sadmm_world_body *body = &world->bodies[slot];
    out.rigid = &body->rigid;
    if (body->type == SADMM_BODY_STATIC) return out;
    if (body->type == SADMM_BODY_KINEMATIC)
        return (struct joint_body){-1, &world->kinematic[sadmm_kinematic(body->system_body)].rigid, true, false};
    out.system_body = body->system_body;
    out.rigid = &world->start.rigid[out.system_body];
    return out;
}

struct acting_joint sadmm_world_act_joint(const sadmm_world *world, const struct sadmm_world_joint *joint,
                                          const sadmm_settings *settings)
{
    struct joint_body bodies[2] = {sadmm_world_joint_body(world, joint->body[0]),
                                   sadmm_world_joint_body(world, joint->body[1])};
    if (joint->coupling)
        bodies[0] = (struct joint_body){-1, &world->couplings[joint->coupling - 1].next.target, true, true};
    return joint_act(&joint->def, joint->frame, bodies, settings);
}
