/* The persistent kernel (persistent.h): sides of constraints given by rows. A quad takes a side, as it takes that of a
 * pair; lane q has the rows q and q + 4. Only warps that have such sides come here. */
#ifndef SADMM_CUDA_ITERATE_PERSISTENT_ROWS_H
#define SADMM_CUDA_ITERATE_PERSISTENT_ROWS_H

#include "quad.h"
#include "row_law.h"

/* Numbers of a row in shared memory, a warp apart: it takes no registers of those who have no rows, and local memory
 * would be asked for from afar in every iteration of the grid, whose barriers empty the cache. */
enum row_number {
    ROW_OWN,        /* six each: Jacobians of the side's own body and of the other */
    ROW_OTHER = 6,
    ROW_LAW = 12,   /* as in struct row_law */
    ROW_LAMBDA = 19
};

struct row_lane {
    enum { COUNT = ROWS_OF_LANE };
    solver_real *numbers;  /* the lane's first */
    real share, friction;
    row_data *rows;        /* of the constraint; NULL: the quad's side is none of rows */
    bool cone, stores;     /* stores: of its constraint's two sides this one writes multipliers */
    bool cones;            /* some lane of the warp has a cone */

    __device__ __forceinline__ solver_real &number(int32_t j, int32_t k) const
    {
        return numbers[(j * ROW_NUMBERS + k) * WARP];
    }
    template <bool FAST>
    __device__ __forceinline__ void load(const cuda_view &v, int32_t lane, bool live, int32_t code,
                                         solver_real *memory);
    __device__ __forceinline__ row_law law(int32_t j) const;
    __device__ __forceinline__ void jacobian(int32_t j, row_number first, real row[6]) const;
    template <bool FAST>
    __device__ __forceinline__ void update(const body_motion &mine, const body_motion &others, real next[COUNT],
                                           real delta[COUNT]) const;
    __device__ __forceinline__ void wrench(const real impulse[COUNT], vec3 *force, vec3 *torque) const;
    __device__ __forceinline__ void store(int32_t lane) const;
};

__device__ __forceinline__ row_law row_lane::law(int32_t j) const
{
    const row_law out = {number(j, ROW_LAW),     number(j, ROW_LAW + 1), number(j, ROW_LAW + 2), number(j, ROW_LAW + 3),
                         number(j, ROW_LAW + 4), number(j, ROW_LAW + 5), number(j, ROW_LAW + 6)};
    return out;
}

__device__ __forceinline__ void row_lane::jacobian(int32_t j, row_number first, real row[6]) const
{
#pragma unroll
    for (int32_t i = 0; i < 6; ++i) row[i] = number(j, first + i);
}

/* live: is there a side, and is it one of rows? memory: the warp's, of ROWS_OF_LANE x ROW_NUMBERS a lane. Every lane of
 * the warp comes here. */
template <bool FAST>
__device__ __forceinline__ void row_lane::load(const cuda_view &v, int32_t lane, bool live, int32_t code,
                                               solver_real *memory)
{
    numbers = memory + threadIdx.x % WARP;
    const int32_t k = live ? code / 2 - v.contacts.pair_capacity : 0, on_b = code & 1;
    row_constraint about = {};
    if (live) about = v.rows.constraints[k];
    const bool both = about.body_a < v.model.bodies && about.body_b < v.model.bodies;
    const real beta_a = live ? inv_beta_of(v.bodies, about.body_a) : (real)0,
               beta_b = live ? inv_beta_of(v.bodies, about.body_b) : (real)0;
    rows = live ? v.rows.data + (size_t)k * SADMM_MAX_ROWS : nullptr;
    stores = live && (!on_b || about.body_a == v.model.bodies);
    cone = live && about.cone;
    cones = __ballot_sync((unsigned)ALL_LANES, cone) != 0;
    share = share_of_body(both);
    friction = about.friction;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const int32_t r = lane + QUAD * j;
        row_data row = {};
        if (live && r < SADMM_MAX_ROWS) row = rows[r];
#pragma unroll
        for (int32_t i = 0; i < 6; ++i) {
            number(j, ROW_OWN + i) = on_b ? row.jacobian[1][i] : row.jacobian[0][i];
            number(j, ROW_OTHER + i) = on_b ? row.jacobian[0][i] : row.jacobian[1][i];
        }
        const row_law law = law_of_row(row, FAST ? share * row.weight : penalty_inverse_s(beta_a, beta_b));
        const real numbers_of_law[] = {law.gain, law.bias, law.compliance, law.lo, law.hi, law.step, law.along};
#pragma unroll
        for (int32_t i = 0; i < 7; ++i) number(j, ROW_LAW + i) = numbers_of_law[i];
        number(j, ROW_LAMBDA) = row.lambda;
    }
}

/* lambda^, and lambda^ - lambda. Every lane of the warp comes here. */
template <bool FAST>
__device__ __forceinline__ void row_lane::update(const body_motion &mine, const body_motion &others, real next[COUNT],
                                                 real delta[COUNT]) const
{
    const unsigned all = (unsigned)ALL_LANES;
    real residual[COUNT], push = 0;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        real own[6], other[6];
        jacobian(j, ROW_OWN, own);
        jacobian(j, ROW_OTHER, other);
        residual[j] = law_residual(law(j), row_velocity(own, mine) + row_velocity(other, others),
                                   number(j, ROW_LAMBDA));
        push = j == 0 ? law(j).along * residual[j] : fused(law(j).along, residual[j], push);
    }
    if (FAST) {
        push += __shfl_xor_sync(all, push, 1);
        push += __shfl_xor_sync(all, push, 2);
        push *= share;
    }
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const row_change change = change_row(law(j), residual[j], FAST ? push : (real)0, number(j, ROW_LAMBDA));
        next[j] = change.lambda;
        delta[j] = change.delta;
    }
    if (!cones) return;
    real old[3], step[3], projected[3], change[3];
    for (int32_t r = 0; r < 3; ++r) {
        old[r] = __shfl_sync(all, number(0, ROW_LAMBDA), r, QUAD);
        step[r] = __shfl_sync(all, law(0).step * residual[0], r, QUAD);
    }
    change_cone<FAST>(old, step, friction, projected, change);
    const int32_t lane = (int32_t)threadIdx.x % QUAD;
    if (!cone || lane >= 3) return;
    next[0] = lane == 0 ? projected[0] : lane == 1 ? projected[1] : projected[2];
    delta[0] = lane == 0 ? change[0] : lane == 1 ? change[1] : change[2];
}

/* J^T impulse of the lane's rows on the side's own body. */
__device__ __forceinline__ void row_lane::wrench(const real impulse[COUNT], vec3 *force, vec3 *torque) const
{
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        real own[6];
        jacobian(j, ROW_OWN, own);
        add_row(own, impulse[j], j == 0, force, torque);
    }
}

__device__ __forceinline__ void row_lane::store(int32_t lane) const
{
    if (!stores) return;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j)
        if (lane + QUAD * j < SADMM_MAX_ROWS) rows[lane + QUAD * j].lambda = number(j, ROW_LAMBDA);
}

#endif
