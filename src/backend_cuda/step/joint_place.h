/* Where joints let a body go before anything closes them. */
#ifndef SADMM_CUDA_STEP_JOINT_PLACE_H
#define SADMM_CUDA_STEP_JOINT_PLACE_H

#include "move.h"

static_assert(sizeof ((struct cuda_closed_body *)nullptr)->place == PLACE * sizeof(double), "a place of a body");

/* bits: of its island. */
static __device__ __noinline__ void joint_place(const cuda_view &v, int32_t i, int32_t bits, double place[PLACE])
{
    double velocity[6];
    if (v.joints.is_articulated[i])
        for (int k = 0; k < 6; ++k) velocity[k] = v.joints.velocity[6 * (size_t)i + (size_t)k];
    else load_end_velocity(v, i, velocity);
    joint_move(&v.step.before[i], halfway_of(v, i), velocity, bits & ISLAND_TRAPEZOID_OFF, v.model.settings->dt, place,
               place + 3, place + 7);
}

#endif
