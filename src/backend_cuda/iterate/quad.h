/* Four lanes that share a side of a constraint. */
#ifndef SADMM_CUDA_ITERATE_QUAD_H
#define SADMM_CUDA_ITERATE_QUAD_H

#include "sweep.h"

enum { QUAD = 4 }; /* lanes a side */

struct real2_pair {
    solver_real x, y;
};

/* Force and torque added over a quad as (q_0 + q_1) + (q_2 + q_3); lane 0 gets the force's x and y, lane 2 its z and 0,
 * lanes 1 and 3 the torque's. Every lane of the warp comes here. */
CUDA_INLINE real2_pair sum_quad(int32_t lane, vec3 force, vec3 torque)
{
    const unsigned all = (unsigned)ALL_LANES;
    const bool odd = lane & 1, high = lane & 2;
    vec3 mine = odd ? torque : force, given = odd ? force : torque;
    mine.x += __shfl_xor_sync(all, given.x, 1);
    mine.y += __shfl_xor_sync(all, given.y, 1);
    mine.z += __shfl_xor_sync(all, given.z, 1);
    real first = high ? mine.z : mine.x, other = high ? mine.x : mine.z;
    first += __shfl_xor_sync(all, other, 2);
    mine.y += __shfl_xor_sync(all, mine.y, 2);
    real2_pair sum = {first, high ? (real)0 : mine.y};
    return sum;
}

/* Where a lane's share of that sum is in the record. */
CUDA_INLINE int32_t quad_slot(int32_t lane) { return (lane & 1) * QUAD + (lane & 2); }

#endif
