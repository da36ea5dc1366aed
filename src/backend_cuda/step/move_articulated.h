/* Where joints let bodies go, and what joints remember of it (docs/internals/algorithm.md, "Time stepping of rows"). */
#ifndef SADMM_CUDA_STEP_MOVE_ARTICULATED_H
#define SADMM_CUDA_STEP_MOVE_ARTICULATED_H

#include "core/model/gear_law.h"
#include "core/model/joint_momentum.h"
#include "move.h"

/* Body i of an island with joints goes where these let it. */
static __device__ __noinline__ void move_articulated(const cuda_view &v, int32_t i)
{
    const int32_t label = articulation_label(v, i), bits = v.joints.touch[label];
    const body_before before = fetch_body(v.step, i);
    const double dt = v.model.settings->dt;
    const bool trapezoid_off = bits & ISLAND_TRAPEZOID_OFF;
    double place[PLACE];
    joint_move(&before.body, halfway_of(v, i), v.joints.velocity + 6 * (size_t)i, trapezoid_off, dt, place, place + 3,
               place + 7);
    for (int k = 0; k < PLACE && bits & ISLAND_CLOSED; ++k) place[k] = v.joints.closed[i].place[k];
    if (bits & ISLAND_RESTORED)
        joint_restore(&v.joints.momentum[label], place, v.step.before[label].position, place + 7);
    store_moved(v, i, before, place, !trapezoid_off, dt);
}

/* Joint j remembers how its bodies have been moved, once that is known; behind the joints, of a gear the first one. */
static __device__ __forceinline__ void end_joints(const cuda_view &v, int32_t j)
{
    const joint_view &joints = v.joints;
    int32_t constraint;
    if (j >= joints.count + joints.gears) return;
    if (j >= joints.count) {
        constraint = joints.first_gear + j - joints.count;
        j = joints.gear[j - joints.count].joint[0];
    } else {
        if (joints.joints[j].constraints == 0) return;
        constraint = joints.first[j];
    }
    const struct sadmm_row_constraint *first = &v.raw.constraints[constraint];
    if (first->count == 0) return;
    const int32_t bits = joints.touch[articulation_label(v, first->body_a >= 0 ? first->body_a : first->body_b)];
    joints.after[j].trapezoid_off = bits & ISLAND_TRAPEZOID_OFF;
    joints.after[j].followed = joint_island_is_followed(bits);
}

#endif
