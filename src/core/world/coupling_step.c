/* What couplings keep from step to step: where their targets are, and what they gave. */
#include <string.h>

#include "core/math/rigid.h"
#include "world_internal.h"

void sadmm_world_begin_couplings(sadmm_world *world)
{
    for (size_t slot = 0; world->coupling_count > 0 && slot < world->coupling_slots; ++slot) {
        struct sadmm_coupling_memory *next = &world->couplings[slot].next;
        *next = world->couplings[slot].last;
        memset(next->felt, 0, sizeof next->felt);
        memset(next->body, 0, sizeof next->body);
    }
}

void sadmm_coupling_keep(struct sadmm_coupling_memory *memory, const double wrench[6],
                         const struct joint_geometry *middle)
{
    const vec3 force = v3_load(wrench), torque = v3_load(wrench + 3);
    double own[6], felt[6];
    v3_store(v3_neg(force), felt);
    v3_store(v3_neg(v3_add(torque, v3_cross(middle->arm_a, force))), felt + 3); /* arm_a: from the target's origin */
    v3_store(force, own);
    v3_store(v3_add(torque, v3_cross(middle->arm_b, force)), own + 3);
    for (int k = 0; k < 6; ++k) {
        memory->felt[k] += felt[k];
        memory->body[k] += own[k];
    }
}

void sadmm_world_move_targets(sadmm_world *world, double dt)
{
    for (size_t slot = 0; world->coupling_count > 0 && slot < world->coupling_slots; ++slot) {
        struct sadmm_rigid *target = &world->couplings[slot].next.target;
        v3_store(rigid_move(v3_load(target->position), v3_load(target->velocity), dt), target->position);
        q_store(rigid_turn(q_load(target->orientation), v3_load(target->velocity + 3), dt), target->orientation);
    }
}

void sadmm_world_commit_couplings(sadmm_world *world, int substeps)
{
    for (size_t slot = 0; world->coupling_count > 0 && slot < world->coupling_slots; ++slot) {
        struct sadmm_world_coupling *coupling = &world->couplings[slot];
        if (!coupling->alive) continue;
        coupling->last = coupling->next;
        for (int k = 0; k < 6; ++k) {
            coupling->last.felt[k] /= substeps;
            coupling->last.body[k] /= substeps;
        }
    }
}
