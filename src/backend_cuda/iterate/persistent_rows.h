/* The persistent kernel (persistent.h): sides of constraints given by rows. A quad takes a side, as it takes that of a
 * pair; lane q has the rows q and q + 4. Only warps that have such sides come here. */
#ifndef SADMM_CUDA_ITERATE_PERSISTENT_ROWS_H
#define SADMM_CUDA_ITERATE_PERSISTENT_ROWS_H

#include "quad.h"
#include "row_law.h"

struct row_lane {
    enum { COUNT = ROWS_OF_LANE };
    /* Numbers 0 to 5 of a row are its Jacobian of the side's own body, 6 to 11 of the other. In double there are more of them
     * than registers: they are in shared memory. (Local memory would be asked for from afar in every iteration of the grid,
     * whose barriers empty the cache.) */
    real held[JACOBIANS_SHARED ? 1 : COUNT * JACOBIAN];
    solver_real *shared; /* the lane's first; the others follow a warp apart */
    row_law law[COUNT];
    real lambda[COUNT], next[COUNT], delta[COUNT]; /* next: lambda^, delta: lambda^ - lambda */
    real share, friction;
    row_data *rows;                      /* of the constraint; NULL: the quad's side is none of rows */
    bool cone, stores;                   /* stores: of its constraint's two sides this one writes multipliers */
    bool cones;                          /* some lane of the warp has a cone */

    template <bool FAST>
    __device__ __forceinline__ void load(const cuda_view &v, int32_t lane, bool live, int32_t code,
                                         solver_real *jacobians);
    __device__ __forceinline__ void keep_number(int32_t j, int32_t i, real value);
    __device__ __forceinline__ void jacobian(int32_t j, bool other, real row[6]) const;
    template <bool FAST> __device__ __forceinline__ void update(const body_motion &mine, const body_motion &others);
    __device__ __forceinline__ void wrench(const real impulse[COUNT], vec3 *force, vec3 *torque) const;
    __device__ __forceinline__ void store(int32_t lane) const;
};

__device__ __forceinline__ void row_lane::keep_number(int32_t j, int32_t i, real value)
{
    if (JACOBIANS_SHARED) shared[(j * JACOBIAN + i) * WARP] = value;
    else held[JACOBIANS_SHARED ? 0 : j * JACOBIAN + i] = value;
}

/* Of row j, of the other body or of the side's own. */
__device__ __forceinline__ void row_lane::jacobian(int32_t j, bool other, real row[6]) const
{
#pragma unroll
    for (int32_t i = 0; i < 6; ++i) {
        const int32_t number = j * JACOBIAN + (other ? 6 : 0) + i;
        row[i] = JACOBIANS_SHARED ? shared[number * WARP] : held[JACOBIANS_SHARED ? 0 : number];
    }
}

/* live: is there a side, and is it one of rows? jacobians: the block's shared memory for them. Every lane of the warp comes
 * here. */
template <bool FAST>
__device__ __forceinline__ void row_lane::load(const cuda_view &v, int32_t lane, bool live, int32_t code,
                                               solver_real *jacobians)
{
    const int32_t t = (int32_t)threadIdx.x;
    shared = jacobians + t / WARP * (COUNT * JACOBIAN * WARP) + t % WARP;
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
            keep_number(j, i, on_b ? row.jacobian[1][i] : row.jacobian[0][i]);
            keep_number(j, 6 + i, on_b ? row.jacobian[0][i] : row.jacobian[1][i]);
        }
        law[j] = law_of_row(row, FAST ? share * row.weight : inverse_weight(beta_a, beta_b));
        lambda[j] = row.lambda;
        delta[j] = 0;
    }
}

/* next and delta. Every lane of the warp comes here. */
template <bool FAST>
__device__ __forceinline__ void row_lane::update(const body_motion &mine, const body_motion &others)
{
    const unsigned all = (unsigned)ALL_LANES;
    real missing[COUNT], push = 0;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        real own[6], other[6];
        jacobian(j, false, own);
        jacobian(j, true, other);
        missing[j] = row_missing(law[j], row_velocity(own, mine) + row_velocity(other, others), lambda[j]);
        push = j == 0 ? law[j].along * missing[j] : fused(law[j].along, missing[j], push);
    }
    if (FAST) {
        push += __shfl_xor_sync(all, push, 1);
        push += __shfl_xor_sync(all, push, 2);
        push *= share;
    }
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const row_change change = change_row(law[j], missing[j], FAST ? push : (real)0, lambda[j]);
        next[j] = change.lambda;
        delta[j] = change.delta;
    }
    if (!cones) return;
    real old[3], step[3], projected[3], change[3];
    for (int32_t r = 0; r < 3; ++r) {
        old[r] = __shfl_sync(all, lambda[0], r, QUAD);
        step[r] = __shfl_sync(all, law[0].step * missing[0], r, QUAD);
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
        jacobian(j, false, own);
        add_row(own, impulse[j], j == 0, force, torque);
    }
}

__device__ __forceinline__ void row_lane::store(int32_t lane) const
{
    if (!stores) return;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j)
        if (lane + QUAD * j < SADMM_MAX_ROWS) rows[lane + QUAD * j].lambda = lambda[j];
}

#endif
