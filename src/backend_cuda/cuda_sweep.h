/* What one thread does in Steps 1-4: shared by the stepwise and the resident kernels, so that they agree bit for bit.
 * Pointers to states, records and factors are to global or shared memory. */
#ifndef SADMM_CUDA_SWEEP_H
#define SADMM_CUDA_SWEEP_H

#include "../core/math/contact.h"
#include "cuda_internal.h"

#define CUDA_INLINE static __device__ __forceinline__

enum { ALL_LANES = -1 }; /* of a warp */

/* ---- memory --------------------------------------------------------------------------------------------------- */

CUDA_INLINE vec3 xyz(real4 a) { return v3(a.x, a.y, a.z); }
CUDA_INLINE real4 pack(vec3 a, real w)
{
    real4 out = {a.x, a.y, a.z, w};
    return out;
}

struct body_state {
    vec3 v, w;
    real inv_beta;
};

CUDA_INLINE body_state load_state(const solver_real *state, int32_t body)
{
    const real4 *row = (const real4 *)(state + (size_t)body * ROW);
    real4 lo = row[0], hi = row[1];
    body_state s = {xyz(lo), v3(lo.w, hi.x, hi.y), hi.z};
    return s;
}

/* ---- pairs ---------------------------------------------------------------------------------------------------- */

struct pair_data {
    vec3 normal, difference;
    real friction, inv_s;
    int32_t body_a, body_b; /* rows of the state */
    int32_t count;
};

CUDA_INLINE pair_data load_pair(const cuda_view &v, int32_t p)
{
    real4 n = v.normal[p], d = v.difference[p];
    int2 bodies = v.pair_bodies[p];
    pair_data pair = {xyz(n), xyz(d), n.w, d.w, bodies.x, bodies.y, v.pair_count[p]};
    return pair;
}

/* x = u + w x r_a at a point of the pair. */
struct pair_motion {
    vec3 u, w;
    real inv_beta; /* the larger one */
};

CUDA_INLINE pair_motion relative_motion(const pair_data &pair, const solver_real *state)
{
    body_state a = load_state(state, pair.body_a), b = load_state(state, pair.body_b);
    pair_motion m = {v3_add(v3_sub(b.v, a.v), v3_cross(b.w, pair.difference)), v3_sub(b.w, a.w),
                     real_max(a.inv_beta, b.inv_beta)};
    return m;
}

/* Multipliers of a point: a world vector, or its normal component alone in x when a contact has one row. */
template <int CONTACT_ROWS> CUDA_INLINE vec3 load_lambda(const cuda_view &v, size_t slot)
{
    return CONTACT_ROWS == 3 ? xyz(v.lambda[slot]) : v3(v.lambda_n[slot], 0, 0);
}

template <int CONTACT_ROWS> CUDA_INLINE void store_lambda(const cuda_view &v, size_t slot, vec3 lambda)
{
    if (CONTACT_ROWS == 3) v.lambda[slot] = pack(lambda, 0);
    else v.lambda_n[slot] = lambda.x;
}

/* Steps 2-4 of one point. */
template <int CONTACT_ROWS>
CUDA_INLINE vec3 update_point(const pair_data &pair, const pair_motion &m, vec3 arm, real error, vec3 old)
{
    vec3 x = v3_add(m.u, v3_cross(m.w, arm));
    if (CONTACT_ROWS == 3) {
        vec3 y = v3_sub(old, v3_scale(v3_add(x, v3_scale(pair.normal, error)), pair.inv_s));
        return contact_project(y, pair.normal, pair.friction);
    }
    real y = old.x - (v3_dot(pair.normal, x) + error) * pair.inv_s;
    return v3(y > 0 ? y : (real)0, 0, 0);
}

template <int CONTACT_ROWS> CUDA_INLINE vec3 impulse_of(const pair_data &pair, vec3 lambda)
{
    return CONTACT_ROWS == 3 ? lambda : v3_scale(pair.normal, lambda.x);
}

/* Largest |d lambda| over the rows of the contact. */
template <int CONTACT_ROWS> CUDA_INLINE real largest_row(const pair_data &pair, vec3 delta)
{
    if (CONTACT_ROWS == 1) return real_abs(delta.x);
    vec3 t1, t2;
    v3_tangents(pair.normal, &t1, &t2);
    return real_max(real_abs(v3_dot(delta, pair.normal)),
                    real_max(real_abs(v3_dot(delta, t1)), real_abs(v3_dot(delta, t2))));
}

/* What a pair adds up over its points: force, and torque about a. */
struct pair_sum {
    vec3 force, torque;
};

CUDA_INLINE pair_sum no_sum(void)
{
    pair_sum sum = {v3(0, 0, 0), v3(0, 0, 0)};
    return sum;
}

CUDA_INLINE void add_to(pair_sum *sum, vec3 arm, vec3 impulse)
{
    sum->force = v3_add(sum->force, impulse);
    sum->torque = v3_add(sum->torque, v3_cross(arm, impulse));
}

CUDA_INLINE void store_record(solver_real *record, const pair_sum &sum, vec3 difference)
{
    vec3 f = sum.force, t = sum.torque, tb = v3_add(t, v3_cross(difference, f));
    real4 *out = (real4 *)record;
    out[0] = pack(v3_neg(f), -t.x);
    out[1] = pack(v3(-t.y, -t.z, 0), 0);
    out[2] = pack(f, tb.x);
    out[3] = pack(v3(tb.y, tb.z, 0), 0);
}

/* Sums of one iteration over a pair's points. */
struct pair_sums {
    pair_sum next, change;
    real largest;
};

CUDA_INLINE pair_sums no_sums(void)
{
    pair_sums sums = {no_sum(), no_sum(), 0};
    return sums;
}

template <int CONTACT_ROWS, bool MEASURE>
CUDA_INLINE void add_point(const pair_data &pair, vec3 arm, vec3 lambda, vec3 old, pair_sums *sums)
{
    vec3 delta = v3_sub(lambda, old);
    if (MEASURE) {
        add_to(&sums->next, arm, impulse_of<CONTACT_ROWS>(pair, lambda));
        add_to(&sums->change, arm, impulse_of<CONTACT_ROWS>(pair, delta));
        sums->largest = real_max(sums->largest, largest_row<CONTACT_ROWS>(pair, delta));
    } else {
        add_to(&sums->next, arm, impulse_of<CONTACT_ROWS>(pair, v3_add(lambda, delta)));
    }
}

/* ---- row blocks ----------------------------------------------------------------------------------------------- */

CUDA_INLINE real row_value(const cuda_view &v, int32_t plane, int32_t k)
{
    return v.row_data[(size_t)plane * (size_t)v.row_stride + (size_t)k];
}

/* Records of J^T lambda on both sides. */
CUDA_INLINE void store_row_record(const cuda_view &v, int32_t k, int32_t rows, const real lambda[6],
                                  solver_real *record)
{
    real sum[12] = {0};
    for (int r = 0; r < 6; ++r) {
        if (r >= rows) break;
        for (int j = 0; j < 6; ++j) {
            sum[j] += row_value(v, ROW_J_A + 6 * r + j, k) * lambda[r];
            sum[6 + j] += row_value(v, ROW_J_B + 6 * r + j, k) * lambda[r];
        }
    }
    for (int j = 0; j < ROW; ++j) {
        record[j] = j < 6 ? sum[j] : (real)0;
        record[ROW + j] = j < 6 ? sum[6 + j] : (real)0;
    }
}

/* Steps 2-4 of row block k; body_a, body_b: rows of `state`. */
template <bool MEASURE>
CUDA_INLINE void sweep_row_block(const cuda_view &v, int32_t k, const row_about &about, const solver_real *state,
                                 int32_t body_a, int32_t body_b, solver_real *record, solver_real *change,
                                 double *primal)
{
    const solver_real *va = state + (size_t)body_a * ROW, *vb = state + (size_t)body_b * ROW;
    real s = va[STATE_INV_BETA] + vb[STATE_INV_BETA], old[6], lambda[6], delta[6], largest = 0;
    for (int r = 0; r < 6; ++r) {
        old[r] = lambda[r] = 0;
        if (r >= about.rows) continue;
        real x = 0, error = row_value(v, ROW_ERROR + r, k);
        old[r] = row_value(v, ROW_LAMBDA + r, k);
        for (int j = 0; j < 6; ++j)
            x += row_value(v, ROW_J_A + 6 * r + j, k) * va[j] + row_value(v, ROW_J_B + 6 * r + j, k) * vb[j];
        if (about.kind == SADMM_BLOCK_SOFT)
            lambda[r] = soft_multiplier(row_value(v, ROW_STIFFNESS + r, k), row_value(v, ROW_DAMPING + r, k), error, x,
                                        s, old[r]);
        else if (about.active >> r & 1)
            lambda[r] = old[r] - (x + error) / s;
    }
    if (about.kind == SADMM_BLOCK_CONTACT) {
        real y[3] = {lambda[0], lambda[1], lambda[2]};
        contact_project_rows(y, row_value(v, ROW_FRICTION, k), lambda);
    }
    for (int r = 0; r < 6; ++r) {
        delta[r] = lambda[r] - old[r];
        largest = real_max(largest, real_abs(delta[r]));
        if (r < about.rows) v.row_data[(size_t)(ROW_LAMBDA + r) * (size_t)v.row_stride + (size_t)k] = lambda[r];
    }
    if (MEASURE) {
        store_row_record(v, k, about.rows, lambda, record);
        store_row_record(v, k, about.rows, delta, change);
        *primal = fmax(*primal, (double)(largest * real_max(va[STATE_INV_BETA], vb[STATE_INV_BETA])));
    } else {
        real extrapolated[6];
        for (int r = 0; r < 6; ++r) extrapolated[r] = lambda[r] + delta[r];
        store_row_record(v, k, about.rows, extrapolated, record);
    }
}

/* ---- bodies --------------------------------------------------------------------------------------------------- */

/* Component r of a body's gathered records. */
template <bool JOIN>
CUDA_INLINE real gather(real sum, const solver_real *records, const solver_real *change, real ratio,
                        const int32_t *incident, int32_t begin, int32_t end, int32_t r)
{
#pragma unroll 4
    for (int32_t at = begin; at < end; ++at) {
        size_t from = (size_t)incident[at] * ROW + (size_t)r;
        sum += JOIN ? records[from] + ratio * change[from] : records[from];
    }
    return sum;
}

/* The end of Step 1, v <- v + H g, for lane r's component g of b - A v + J^T E. Every lane of the warp comes here. */
CUDA_INLINE void finish_body(bool mine, int32_t r, real g, const solver_real *H, solver_real *state)
{
    real step = 0;
    for (int k = 0; k < 6; ++k) {
        real other = __shfl_sync((unsigned)ALL_LANES, g, k, LANES);
        if (mine) step += H[6 * k + r] * other;
    }
    __syncwarp((unsigned)ALL_LANES); /* all lanes have read the state */
    if (mine) state[r] += step;
}

/* Step 1 of a body by its eight lanes (kernels I-K). Every lane of the warp comes here. */
template <bool JOIN>
CUDA_INLINE void update_body(bool live, int32_t r, const solver_real *b, const solver_real *A, const solver_real *H,
                             const solver_real *records, const solver_real *change, real ratio, const int32_t *incident,
                             int32_t begin, int32_t end, solver_real *state)
{
    bool mine = live && r < 6;
    real g = 0;
    if (mine) {
        g = gather<JOIN>(b[r], records, change, ratio, incident, begin, end, r);
        for (int k = 0; k < 6; ++k) g -= A[6 * k + r] * state[k];
    }
    finish_body(mine, r, g, H, state);
}

/* ---- reductions ----------------------------------------------------------------------------------------------- */

/* *out = max(*out, values of the warp). Every lane of the warp comes here. Bit patterns of non-negative doubles order
 * like the numbers, and a maximum does not depend on the order it is taken in; a NaN survives as the largest pattern.
 * */
CUDA_INLINE void reduce_max(double value, unsigned long long *out)
{
    /* -0 (what real_abs may give) has the largest pattern but one: it counts as 0. */
    unsigned long long bits = value == 0 ? 0 : (unsigned long long)__double_as_longlong(value);
    for (int o = WARP / 2; o > 0; o /= 2) {
        unsigned long long other = __shfl_xor_sync((unsigned)ALL_LANES, bits, o);
        bits = other > bits ? other : bits;
    }
    if (threadIdx.x % WARP == 0 && bits != 0) atomicMax(out, bits);
}

#endif
