/* The persistent kernel (persistent.h): Step 1 and Steps 2-4 of a part, and which of its bodies have too much energy.
 */
#ifndef SADMM_CUDA_ITERATE_PERSISTENT_STEPS_H
#define SADMM_CUDA_ITERATE_PERSISTENT_STEPS_H

#include "persistent_part.h"

/* ---- Step 1 ---------------------------------------------------------------------------------------------------- */

/* g and `count` numbers, each a record after the last, one after the other. The first few are fetched whether they are
 * there or not; where a lane of the warp has more, the next ones too before the first is added. */
PART __device__ __forceinline__ real PART_RUN::gather(real g, const solver_real *from, int32_t count, bool more) const
{
    real first[FETCHED_FIRST], value[MORE] = {};
#pragma unroll
    for (int32_t j = 0; j < FETCHED_FIRST; ++j) first[j] = from[j * ROW];
    if (more) {
#pragma unroll
        for (int32_t j = 0; j < MORE; ++j)
            value[j] = FETCHED_FIRST + j < count ? from[(FETCHED_FIRST + j) * ROW] : (real)0;
    }
#pragma unroll
    for (int32_t j = 0; j < FETCHED_FIRST; ++j)
        if (j < count) g += first[j];
    if (!more) return g;
    for (int32_t h = FETCHED_FIRST;;) {
#pragma unroll
        for (int32_t j = 0; j < MORE; ++j)
            if (h + j < count) g += value[j];
        h += MORE;
        if (h >= count) return g;
#pragma unroll
        for (int32_t j = 0; j < MORE; ++j) value[j] = h + j < count ? from[(h + j) * ROW] : (real)0;
    }
}

/* `to`: component r of body i in even iterations. */
PART __device__ __forceinline__ void PART_RUN::publish(solver_real *to, int32_t i, real value, int32_t odd)
{
    if (i >= bodies || r >= 6) return;
    to[MODE == CLUSTER && odd ? args.most_bodies * ROW : 0] = value;
    if (MODE == GRID)
        v.iteration.exchange[((size_t)(odd ? v.model.bodies : 0) + (size_t)(first_body + i)) * ROW + (size_t)r] = value;
}

PART __device__ __forceinline__ void PART_RUN::move_bodies(int32_t odd)
{
    if (has_moves()) {
        own_body.v += step_of(own_body, gather(momentum, gathered, gathered_count, many));
        publish(own_state, body, own_body.v, odd);
    }
    if (SIZE == ONE_WARP) return; /* at most one body for each eight threads (iterate/partition.cu) */
    const int32_t in_registers = (int32_t)blockDim.x / LANES;
    for (int32_t first = in_registers; warp_has_body(first); first += in_registers) {
        const int32_t i = first + body, at = i - in_registers;
        const bool live = i < bodies;
        body_lane one =
            load_body(live, r, m.lines + at * LINE_GENERAL, v.bodies.rigid, m.b + at * ROW, state(!odd) + i * ROW);
        real g = free_momentum(one);
        if (live && r < 6) {
            const int32_t from = v.graph.offsets[first_body + i], count = v.graph.offsets[first_body + i + 1] - from;
            g = gather(g, m.records + (from - first_side) * ROW + record_slot(r), count, count > FETCHED_FIRST);
        }
        publish(m.state + i * ROW + r, i, one.v + step_of(one, g), odd);
    }
}

/* `relaxation` times as far; multipliers have gone `multipliers` times. The momentum residuals of bodies in registers
 * follow later: nobody waits for them. */
PART __device__ __forceinline__ void PART_RUN::move_bodies_fast(int32_t odd, real relaxation, real multipliers)
{
    if (has_moves()) {
        sum = gather(0, gathered, gathered_count, many);
        step = step_fast(&own_body, sum, relaxation);
        publish(own_state, body, own_body.v, odd);
    }
    if (SIZE == ONE_WARP) return; /* at most one body for each eight threads (iterate/partition.cu) */
    const int32_t in_registers = (int32_t)blockDim.x / LANES;
    for (int32_t first = in_registers; warp_has_body(first); first += in_registers) {
        const int32_t i = first + body, at = i - in_registers;
        const bool live = i < bodies && r < 6;
        body_lane one = load_body(i < bodies, r, m.lines + at * LINE_GENERAL, v.bodies.rigid, m.b + at * ROW,
                                  state(!odd) + i * ROW);
        real pushed = 0;
        if (live) {
            const int32_t from = v.graph.offsets[first_body + i], count = v.graph.offsets[first_body + i + 1] - from;
            pushed = gather(0, m.records + (from - first_side) * ROW + record_slot(r), count, count > FETCHED_FIRST);
        }
        const real gone = step_fast(&one, pushed, relaxation);
        publish(m.state + i * ROW + r, i, one.v, odd);
        const real momentum_residual = residual_after(one, pushed, gone, multipliers);
        if (live) m.b[at * ROW + r] = momentum_residual;
    }
}

/* ---- Steps 2-4 ------------------------------------------------------------------------------------------------- */

/* FAST: lambda goes `relaxation_factor` times as far, plain: once; records are those of Step 1 in any case. */
PART __device__ __forceinline__ void PART_RUN::update_sides(int32_t odd, real relaxation_factor, bool plain)
{
    if (!has_updates()) return;
    const solver_real *mine = own_row + (MODE == CLUSTER && odd ? args.most_bodies * ROW : 0),
                      *others = own.other + (odd ? own.other_odd : 0);
    const body_motion own_motion = load_motion(mine), other = load_motion(others);
    vec3 force = v3(0, 0, 0), torque = force;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const vec3 old = own.lambda[j], x = relative_velocity(other, own.other_arm[j], own_motion, own.own_arm[j]);
        const point_change to = update<FAST>(own.normal, own.friction, x, own.error[j], own.inv_s[j], old);
        own.lambda[j] = FAST ? relaxed(old, to, plain, relaxation_factor) : to.lambda;
        const vec3 impulse = FAST ? to.delta : v3_add(to.lambda, to.delta),
                   moment = fused_cross(own.own_arm[j], impulse);
        force = j == 0 ? impulse : v3_add(force, impulse);
        torque = j == 0 ? moment : v3_add(torque, moment);
    }
    store_record(own_record, sum_quad(lane, force, torque));
}

/* The same of the warp's sides of constraints given by rows. */
PART __device__ __forceinline__ void PART_RUN::update_rows(const row_lane &rows, int32_t odd,
                                                          real relaxation_factor) const
{
    real next[row_lane::COUNT], delta[row_lane::COUNT], impulse[row_lane::COUNT];
    vec3 force, torque;
    rows.update<FAST>(load_motion(own_row + (MODE == CLUSTER && odd ? args.most_bodies * ROW : 0)),
                      load_motion(own.other + (odd ? own.other_odd : 0)), next, delta);
#pragma unroll
    for (int32_t j = 0; j < row_lane::COUNT; ++j) {
        impulse[j] = FAST ? delta[j] : next[j] + delta[j];
        if (FAST && relaxation_factor != 1) next[j] = fused(relaxation_factor, delta[j], rows.number(j, ROW_LAMBDA));
        rows.number(j, ROW_LAMBDA) = next[j];
    }
    rows.wrench(impulse, &force, &torque);
    const real2_pair sum = sum_quad(lane, force, torque);
    if (rows.rows) *own_record = sum;
}

/* ---- the energy limit, of the method `fast` ---------------------------------------------------------------------- */

/* Is there a body, one of those that this thread speaks for, that has more energy than it may? Of a world: rigid
 * ones. */
PART __device__ __forceinline__ bool PART_RUN::has_candidate(int32_t odd) const
{
    bool any = false;
    const int32_t in_registers = (int32_t)blockDim.x / LANES;
    for (int32_t first = 0; warp_has_body(first); first += in_registers) {
        const int32_t i = first + body, at = i - in_registers;
        const bool live = i < bodies;
        const size_t raw = live ? (size_t)v.graph.body_of[first_body + i] : 0;
        const bool speaks = live && r == 0;
        const double b = live && r < 6 ? (double)v.bodies.b[raw * ROW + (size_t)r] : 0,
                     free = speaks ? v.bodies.free_energy[raw] : 0;
        double a[3] = {}; /* of rigid bodies */
#pragma unroll
        for (int k = 0; k < 3; ++k) {
            if (first == 0) a[k] = (double)(r < 3 ? own_body.A[k] : own_body.A[k + 3]);
            else if (live && r < 6) a[k] = (double)line_a(m.lines + at * LINE_GENERAL, true, r, r / 3 * 3 + k);
        }
        const double velocity = live && r < 6 ? (double)state(odd)[i * ROW + r] : 0;
        const bool warm = args.rebounds && speaks && v.islands.info[v.graph.label[raw]].warm;
        any = is_candidate(args.rebounds, warm, speaks, free, velocity, b, a) || any;
    }
    return any;
}

#endif
