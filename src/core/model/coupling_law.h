/* What a virtual coupling keeps from step to step: where its target is, and what it gave (subadmm/coupling.h). In
 * double. */
#ifndef SADMM_CORE_MODEL_COUPLING_LAW_H
#define SADMM_CORE_MODEL_COUPLING_LAW_H

#include "core/math/rigid.h"
#include "system.h"

struct sadmm_coupling_memory {
    struct sadmm_rigid target;   /* its pose and velocity alone */
    double reaction[6], body[6]; /* as in sadmm_coupling_state; in the step at hand: sums over its sub-steps */
};

/* A step begins. */
SADMM_INLINE void coupling_begin(struct sadmm_coupling_memory *memory)
{
    int k;
    for (k = 0; k < 6; ++k) memory->reaction[k] = memory->body[k] = 0;
}

/* The target is still where the (sub-)step began. wrench: on the body, about `point`; arm: from the body's centre of
 * mass to there; both in the middle of the step. */
SADMM_INLINE void coupling_keep(struct sadmm_coupling_memory *memory, const double wrench[6], vec3 point, vec3 arm,
                                double dt)
{
    const vec3 force = v3_load(wrench), torque = v3_load(wrench + 3),
               target = rigid_move(v3_load(memory->target.position), v3_load(memory->target.velocity), dt / 2);
    double own[6], reaction[6];
    int k;
    v3_store(v3_neg(force), reaction);
    v3_store(v3_neg(v3_add(torque, v3_cross(v3_sub(point, target), force))), reaction + 3);
    v3_store(force, own);
    v3_store(v3_add(torque, v3_cross(arm, force)), own + 3);
    for (k = 0; k < 6; ++k) {
        memory->reaction[k] += reaction[k];
        memory->body[k] += own[k];
    }
}

/* A (sub-)step has ended. */
SADMM_INLINE void coupling_move(struct sadmm_rigid *target, double dt)
{
    v3_store(rigid_move(v3_load(target->position), v3_load(target->velocity), dt), target->position);
    q_store(rigid_turn(q_load(target->orientation), v3_load(target->velocity + 3), dt), target->orientation);
}

/* A step has ended: means. */
SADMM_INLINE void coupling_end(struct sadmm_coupling_memory *memory, int substeps)
{
    int k;
    for (k = 0; k < 6; ++k) {
        memory->reaction[k] /= substeps;
        memory->body[k] /= substeps;
    }
}

#endif
