/* Steps 2-4 with everything in memory (streamed.cu): a pair by one lane or four, a row block by a thread. */
#ifndef SADMM_CUDA_ITERATE_STREAMED_SWEEP_H
#define SADMM_CUDA_ITERATE_STREAMED_SWEEP_H

#include "row_law.h"

/* ---- Steps 2-4 of a pair, points in memory ---------------------------------------------------------------------- */

/* What points of a pair add up to: force on b, torque on b and, against it, on a. */
struct pair_sum {
    vec3 force, torque_a, torque_b;
};

/* The j-th point of a lane; absent ones are not added. */
static __device__ __forceinline__ void add_point(pair_sum *sum, int32_t j, vec3 impulse, vec3 arm_a, vec3 arm_b)
{
    vec3 torque_a = fused_cross(arm_a, impulse), torque_b = fused_cross(arm_b, impulse);
    sum->force = j == 0 ? impulse : v3_add(sum->force, impulse);
    sum->torque_a = j == 0 ? torque_a : v3_add(sum->torque_a, torque_a);
    sum->torque_b = j == 0 ? torque_b : v3_add(sum->torque_b, torque_b);
}

static __device__ __forceinline__ vec3 exchange(vec3 value, int lanes)
{
    const unsigned all = (unsigned)ALL_LANES;
    return v3(__shfl_xor_sync(all, value.x, lanes), __shfl_xor_sync(all, value.y, lanes),
              __shfl_xor_sync(all, value.z, lanes));
}

/* The sums of a pair's lanes, added as (q_0 + q_1) + (q_2 + q_3), into the records of its sides. Of four lanes, 0 and 1
 * end up with force and torque on a, 2 and 3 on b. Every lane of the warp comes here. */
template <int LANES_A_PAIR>
static __device__ __forceinline__ void store_records(solver_real *records, const pair_bodies &ends, int32_t lane,
                                                     bool live, const pair_sum &q)
{
    real4 *out = (real4 *)records;
    if (LANES_A_PAIR == 1) {
        if (live && ends.side_a >= 0) {
            out[2 * (size_t)ends.side_a] = pack(v3_neg(q.force), 0);
            out[2 * (size_t)ends.side_a + 1] = pack(v3_neg(q.torque_a), 0);
        }
        if (live && ends.side_b >= 0) {
            out[2 * (size_t)ends.side_b] = pack(q.force, 0);
            out[2 * (size_t)ends.side_b + 1] = pack(q.torque_b, 0);
        }
        return;
    }
    const bool odd = lane & 1, on_b = lane & 2;
    const int32_t side = on_b ? ends.side_b : ends.side_a;
    /* Even lanes keep the force, odd ones the torques. */
    const vec3 kept = v3_add(odd ? q.torque_a : q.force, exchange(odd ? q.force : q.torque_a, 1));
    const vec3 torque_b = v3_add(q.torque_b, exchange(q.torque_b, 1));
    const vec3 sum = v3_add(odd && on_b ? torque_b : kept, exchange(odd && !on_b ? torque_b : kept, 2));
    if (live && side >= 0) out[2 * (size_t)side + (odd ? 1 : 0)] = pack(on_b ? sum : v3_neg(sum), 0);
}

/* A lane's share of a pair, but for its bodies' states: points lane and, where COUNT is 2, lane + 4. The first is
 * loaded whether it is there or not, so that nothing but the states waits for another load. */
template <int COUNT> struct swept_pair {
    real4 about, between;
    pair_bodies ends;
    real weight; /* FAST */
    size_t slot[COUNT];
    real4 point[COUNT];
    vec3 old[COUNT];
};

/* load_lambda, before the wait: load_before_wait. */
static __device__ __forceinline__ vec3 fetch_lambda(const contact_view &contacts, size_t slot)
{
    const solver_real *lambda = contacts.lambda + slot;
    return v3(__ldcg(lambda), __ldcg(lambda + contacts.lambda_stride), __ldcg(lambda + 2 * contacts.lambda_stride));
}

template <int LANES_A_PAIR, int COUNT, bool FAST>
static __device__ __forceinline__ swept_pair<COUNT> fetch_pair(const contact_view &contacts, int32_t p, int32_t lane)
{
    swept_pair<COUNT> pair;
    pair.about = load_once(contacts.normal + p);
    pair.between = load_once(contacts.difference + p);
    pair.ends = load_once(contacts.bodies + p);
    pair.weight = FAST ? contacts.inv_s[p] : (real)0;
    pair.slot[0] = point_slot<LANES_A_PAIR>(contacts, p, lane);
    pair.point[0] = load_once(contacts.arm + pair.slot[0]);
    pair.old[0] = fetch_lambda(contacts, pair.slot[0]);
    const int32_t count = (int32_t)pair.between.w;
#pragma unroll
    for (int32_t j = 1; j < COUNT; ++j) {
        if (lane + LANES_A_PAIR * j >= count) continue;
        pair.slot[j] = point_slot<LANES_A_PAIR>(contacts, p, lane + LANES_A_PAIR * j);
        pair.point[j] = load_once(contacts.arm + pair.slot[j]);
        pair.old[j] = fetch_lambda(contacts, pair.slot[j]);
    }
    return pair;
}

/* `live`: else nothing is stored. Every lane of the warp comes here. FAST: lambda goes `relaxation_factor` times as
 * far; records are those of Step 1 in any case. Returns the lane's share of the primal residual. */
template <int LANES_A_PAIR, int COUNT, bool MEASURE, bool FAST>
static __device__ __forceinline__ double sweep_pair(const model_view &model, const body_view &bodies,
                                                    const contact_view &contacts, const iteration_view &iteration,
                                                    const swept_pair<COUNT> &pair, int32_t lane, bool live,
                                                    real relaxation_factor)
{
    enum { SPLIT = MEASURE && !FAST };
    const real4 &about = pair.about, &between = pair.between;
    const pair_bodies &ends = pair.ends;
    const real4(&point)[COUNT] = pair.point;
    const vec3(&old)[COUNT] = pair.old;
    const int32_t count = (int32_t)between.w;
    const body_row a = load_row(bodies.state, ends.body_a), b = load_row(bodies.state, ends.body_b);

    const vec3 normal = xyz(about), difference = xyz(between);
    const real inv_s = FAST ? pair.weight : penalty_inverse_s(a.inv_beta, b.inv_beta);
    real largest = 0;
    pair_sum next = {}, change = {};
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        if (lane + LANES_A_PAIR * j >= count) continue;
        const vec3 arm_a = xyz(point[j]), arm_b = v3_add(arm_a, difference);
        const vec3 x = relative_velocity(a.motion, arm_a, b.motion, arm_b);
        const point_change to = update<FAST>(normal, about.w, x, point[j].w, inv_s, old[j]);
        const vec3 lambda = to.lambda, delta = to.delta;
        if (live)
            store_lambda(contacts, pair.slot[j],
                         FAST ? relaxed(old[j], to, relaxation_factor == 1, relaxation_factor) : lambda);
        add_point(&next, j,
                  FAST ? delta : SPLIT ? lambda : v3_add(lambda, delta), arm_a, arm_b);
        if (SPLIT) add_point(&change, j, delta, arm_a, arm_b);
        if (!MEASURE) continue;
        largest = real_max(largest, largest_row(normal, delta));
    }
    store_records<LANES_A_PAIR>(iteration.records, ends, lane, live, next);
    if (SPLIT) store_records<LANES_A_PAIR>(iteration.change, ends, lane, live, change);
    if (!MEASURE) return 0;
    return (double)(largest *
                    (FAST ? inverse_of_weight(inv_s, ends.body_a < model.bodies && ends.body_b < model.bodies)
                          : real_max(a.inv_beta, b.inv_beta)));
}

/* The same for J^T lambda^0. */
template <int LANES_A_PAIR>
static __device__ __forceinline__ void start_pair(const contact_view &contacts, const iteration_view &iteration,
                                                  int32_t p, int32_t lane, bool live)
{
    const real4 between = contacts.difference[p];
    pair_sum sum = {};
    for (int32_t k = lane; k < (int32_t)between.w; k += LANES_A_PAIR) {
        size_t slot = point_slot<LANES_A_PAIR>(contacts, p, k);
        vec3 arm = xyz(contacts.arm[slot]), lambda = load_lambda(contacts, slot);
        add_point(&sum, k / LANES_A_PAIR, lambda, arm, v3_add(arm, xyz(between)));
    }
    store_records<LANES_A_PAIR>(iteration.records, contacts.bodies[p], lane, live, sum);
}

/* ---- constraints given by rows --------------------------------------------------------------------------------- */

static __device__ __forceinline__ void store_row_records(const row_view &rows, int32_t k, const row_constraint &about,
                                                         const real impulse[SADMM_MAX_ROWS], solver_real *records)
{
    const row_data *row = rows.data + (size_t)k * SADMM_MAX_ROWS;
    if (about.side_a >= 0) store_row_record(row, 0, impulse, records + (size_t)about.side_a * ROW);
    if (about.side_b >= 0) store_row_record(row, 1, impulse, records + (size_t)about.side_b * ROW);
}

template <bool MEASURE, bool FAST>
static __device__ __forceinline__ double sweep_rows(const model_view &model, const body_view &bodies,
                                                    const row_view &rows, const iteration_view &iteration, int32_t k,
                                                    real relaxation_factor)
{
    enum { SPLIT = MEASURE && !FAST };
    const row_constraint about = rows.constraints[k];
    row_data *row = rows.data + (size_t)k * SADMM_MAX_ROWS;
    const real beta_a = inv_beta_of(bodies, about.body_a), beta_b = inv_beta_of(bodies, about.body_b);
    real lambda[SADMM_MAX_ROWS], delta[SADMM_MAX_ROWS], impulse[SADMM_MAX_ROWS], largest = 0;
    update_rows<FAST>(row, about, about.body_a < model.bodies && about.body_b < model.bodies,
                      penalty_inverse_s(beta_a, beta_b), load_motion(bodies.state + (size_t)about.body_a * ROW),
                      load_motion(bodies.state + (size_t)about.body_b * ROW), lambda, delta);
    for (int r = 0; r < SADMM_MAX_ROWS; ++r) {
        impulse[r] = FAST ? delta[r] : SPLIT ? lambda[r] : lambda[r] + delta[r];
        if (MEASURE)
            largest = real_max(largest, FAST ? row_primal_fast(delta[r], row[r].weight, row[r].along)
                                             : row_primal(delta[r], real_max(beta_a, beta_b)));
        row[r].lambda = FAST && relaxation_factor != 1 ? fused(relaxation_factor, delta[r], row[r].lambda) : lambda[r];
    }
    store_row_records(rows, k, about, impulse, iteration.records);
    if (SPLIT) store_row_records(rows, k, about, delta, iteration.change);
    return (double)largest;
}

/* The same for J^T lambda^0. */
static __device__ __forceinline__ void start_rows(const row_view &rows, const iteration_view &iteration, int32_t k)
{
    real lambda[SADMM_MAX_ROWS];
    for (int r = 0; r < SADMM_MAX_ROWS; ++r) lambda[r] = rows.data[(size_t)k * SADMM_MAX_ROWS + (size_t)r].lambda;
    store_row_records(rows, k, rows.constraints[k], lambda, iteration.records);
}

#endif
