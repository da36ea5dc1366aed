/* A joint in a (sub-)step: its bodies, and what they make of its geometry (core/model/joint_law.h). Joints and gears
 * make their rows of it. */
#include "joint_act.h"

#include <string.h>

#include "core/base/memory.h"
#include "joint_variants.h"

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

static bool has_room(const sadmm_world *world) { return (size_t)world->dynamic_count <= 4 * world->step_joint_count; }

/* Of a dynamic body once a (sub-)step, however many joints it has; there is no room where few bodies have any. */
static void put_side(sadmm_world *world, struct joint_body body, const sadmm_settings *settings, struct joint_side *to)
{
    if (body.system_body < 0 || !has_room(world)) {
        *to = joint_side_of(body, settings);
        return;
    }
    struct sadmm_world_joint_side *kept = &world->joint_sides[body.system_body];
    if (kept->of != world->joint_sides_made) {
        kept->side = joint_side_by(body, &world->spins[body.system_body], settings);
        kept->of = world->joint_sides_made;
    }
    *to = kept->side;
}

bool sadmm_world_begin_acting(sadmm_world *world, const sadmm_settings *settings)
{
    const size_t n = has_room(world) ? (size_t)world->dynamic_count : 0, before = SADMM_ROOM(world->joint_sides);
    if (!SADMM_GROW(world->acting_joints, 0, world->step_joint_count) || !SADMM_GROW(world->joint_sides, 0, n) ||
        !SADMM_GROW(world->spins, 0, n))
        return false;
    if (SADMM_ROOM(world->joint_sides) != before)
        memset(world->joint_sides, 0, SADMM_ROOM(world->joint_sides) * sizeof *world->joint_sides);
    ++world->joint_sides_made;
    sadmm_joint_kernels_best()->spins(world->start.rigid, n, settings->dt, world->spins);
    world->spins_known = n > 0;
    return true;
}

const struct acting_joint *sadmm_world_act_joint(sadmm_world *world, const struct sadmm_world_joint *joint,
                                                 const sadmm_settings *settings)
{
    struct acting_joint *acting = &world->acting_joints[joint->number];
    struct joint_body bodies[2] = {sadmm_world_joint_body(world, joint->body[0]),
                                   sadmm_world_joint_body(world, joint->body[1])};
    if (joint->coupling)
        bodies[0] = (struct joint_body){-1, &world->couplings[joint->coupling - 1].next.target, true, true};
    for (int s = 0; s < 2; ++s) put_side(world, bodies[s], settings, &acting->side[s]);
    sadmm_joint_kernels_best()->act(&joint->def, joint->frame, bodies[0].target, settings, acting);
    return acting;
}
