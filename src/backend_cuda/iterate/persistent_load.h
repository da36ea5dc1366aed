/* The persistent kernel (persistent.h): a part is loaded before the first iteration and stored after the last one. */
#ifndef SADMM_CUDA_ITERATE_PERSISTENT_LOAD_H
#define SADMM_CUDA_ITERATE_PERSISTENT_LOAD_H

#include "persistent_part.h"

/* ---- loading --------------------------------------------------------------------------------------------------- */

/* Which side each quad takes: those of pairs first, then, from the next whole warp on, those of constraints given by
 * rows. A warp that had both would do one after the other, and all wait for it. Thread t first classifies side t: a
 * block has more threads than sides. */
PART __device__ __forceinline__ void PART_RUN::part_rows_from_pairs(void)
{
    enum { QUADS = WARP / QUAD };
    const int32_t quads = (int32_t)blockDim.x / QUAD, warps = (int32_t)blockDim.x / WARP, warp = t / WARP;
    int32_t *taken = (int32_t *)m.records, *counts = taken + quads, before = 0, all = 0; /* before there are records */
    const bool rows = t < sides && v.graph.incident[first_side + t] / 2 >= v.contacts.pair_capacity;
    const unsigned votes = __ballot_sync((unsigned)ALL_LANES, rows);
    if (t % WARP == 0) counts[warp] = __popc(votes);
    if (t < quads) taken[t] = sides;
    block_barrier<SIZE>();
    for (int32_t k = 0; k < warps; ++k) {
        before += k < warp ? counts[k] : 0;
        all += counts[k];
    }
    before += __popc(votes & ((1u << t % WARP) - 1));
    if (t < sides) taken[rows ? (sides - all + QUADS - 1) / QUADS * QUADS + before : t - before] = t;
    block_barrier<SIZE>();
    side = taken[t / QUAD];
    side_code = side < sides ? v.graph.incident[first_side + side] : 0;
    row_memory = m.rows + (warp - (sides - all + QUADS - 1) / QUADS) * (ROWS_OF_LANE * ROW_NUMBERS * WARP);
    block_barrier<SIZE>();
}

/* Where the other body's state will be. */
PART __device__ __forceinline__ void PART_RUN::find_other(int32_t other)
{
    const int32_t slot = other == v.model.bodies ? other : v.graph.slot_of[other], local = slot - first_body;
    own.other_odd = 0;
    if (other == v.model.bodies) { /* the static world */
        own.other = m.state + (MODE == CLUSTER ? 2 : 1) * args.most_bodies * ROW;
    } else if (MODE == BLOCK) {
        own.other = m.state + local * ROW;
    } else if (MODE == GRID) {
        bool inside = local >= 0 && local < bodies;
        own.other = inside ? m.state + local * ROW : v.iteration.exchange + (size_t)slot * ROW;
        own.other_odd = inside ? 0 : v.model.bodies * ROW;
    } else {
        const int32_t first_part = (int32_t)blockIdx.x / args.cluster * args.cluster;
        int32_t rank = 0;
        while (rank + 1 < args.cluster && slot >= v.graph.parts[first_part + rank + 1]) ++rank;
        own.other = in_block(m.state, (unsigned)rank) + (slot - v.graph.parts[first_part + rank]) * ROW;
        own.other_odd = args.most_bodies * ROW;
    }
}

/* The side's pair as it is in memory; its points' errors and weights may still change. */
PART __device__ __forceinline__ void PART_RUN::fetch_side(void)
{
    const int32_t p = side_code / 2;
    if (side >= sides || is_row_side()) return;
    about = v.contacts.normal[p];
    between = v.contacts.difference[p];
    on = v.contacts.bodies[p];
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const size_t slot = slot_or_first(lane + QUAD * j);
        point[j] = v.contacts.arm[slot];
        own.lambda[j] = load_lambda(v.contacts, slot);
    }
}

PART __device__ __forceinline__ void PART_RUN::load_side(void)
{
    const int32_t on_b = side_code & 1, p = side_code / 2;
    if (is_row_side()) {
        const row_constraint rows = v.rows.constraints[p - v.contacts.pair_capacity];
        own.own = v.graph.slot_of[on_b ? rows.body_b : rows.body_a] - first_body;
        find_other(on_b ? rows.body_a : rows.body_b);
        return;
    }
    own.pair = true;
    own.sign = on_b ? (real)1 : (real)-1;
    own.own = v.graph.slot_of[on_b ? on.body_b : on.body_a] - first_body;
    find_other(on_b ? on.body_a : on.body_b);
    const real inv_s =
        own.sign * (FAST ? v.contacts.inv_s[p]
                         : penalty_inverse_s(inv_beta_of(v.bodies, on.body_a), inv_beta_of(v.bodies, on.body_b)));
    own.normal = xyz(about);
    own.friction = about.w;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const int32_t k = lane + QUAD * j;
        const real error = FAST ? v.contacts.arm[slot_or_first(k)].w : point[j].w;
        const bool there = k < (int32_t)between.w;
        const vec3 arm_a = xyz(point[j]), arm_b = v3_add(arm_a, xyz(between)), none = v3(0, 0, 0);
        own.own_arm[j] = there ? (on_b ? arm_b : arm_a) : none;
        own.other_arm[j] = there ? (on_b ? arm_a : arm_b) : none;
        own.error[j] = there ? own.sign * error : 0;
        own.inv_s[j] = there ? inv_s : 0;
        own.lambda[j] = there ? own.lambda[j] : none;
    }
}

/* J^T lambda. */
PART __device__ __forceinline__ void PART_RUN::start_records(void)
{
    vec3 force = v3(0, 0, 0), torque = force;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        vec3 impulse = own.lambda[j],
             moment = fused_cross(own.own_arm[j], impulse);
        force = j == 0 ? impulse : v3_add(force, impulse);
        torque = j == 0 ? moment : v3_add(torque, moment);
    }
    store_record(own_record, sum_quad(lane, force, torque));
}

PART __device__ __forceinline__ void PART_RUN::start_row_records(void)
{
    row_lane rows = {};
    vec3 force, torque;
    rows.load<FAST>(v, lane, is_row_side(), side_code, row_memory);
    const real impulse[] = {rows.number(0, ROW_LAMBDA), rows.number(1, ROW_LAMBDA)};
    rows.wrench(impulse, &force, &torque);
    const real2_pair sum = sum_quad(lane, force, torque);
    if (rows.rows) *own_record = sum;
}

/* What the last batch or the stepwise kernels left, joined after a measured iteration. */
PART __device__ __forceinline__ void PART_RUN::load_records(void)
{
    const real ratio = args.rescaled ? (real)*v.iteration.ratio : (real)1;
    for (int32_t i = t; i < sides * ROW; i += (int32_t)blockDim.x) {
        const size_t from = (size_t)first_side * ROW + (size_t)i;
        m.records[i] =
            args.join ? v.iteration.records[from] + ratio * v.iteration.change[from] : v.iteration.records[from];
    }
}

PART __device__ __forceinline__ void PART_RUN::load(void)
{
    const int32_t threads = (int32_t)blockDim.x, in_registers = threads / LANES;
    own_body = load_body(found.live, r, v.bodies.lines + found.body * (size_t)v.bodies.line, v.bodies.rigid,
                         (FAST ? v.bodies.momentum_residual : v.bodies.b) + found.body * ROW,
                         v.bodies.state + found.body * ROW);
    gathered = m.records;
    if (found.live && r < 6) {
        gathered = m.records + (found.begin - first_side) * ROW + record_slot(r);
        gathered_count = found.end - found.begin;
    }
    many = __ballot_sync((unsigned)ALL_LANES, gathered_count > FETCHED_FIRST) != 0;
    own_record = (real2_pair *)kept_address<SIZE>(m.records + side * ROW + quad_slot(lane));
    if (!FAST && moves) momentum = free_momentum(own_body);
    if (found.live) m.state[body * ROW + r] = own_body.v;
    for (int32_t i = in_registers * ROW + t; i < bodies * ROW; i += threads) m.state[i] = v.bodies.state[raw_row(i)];
    if (t < ROW) m.state[(MODE == CLUSTER ? 2 : 1) * args.most_bodies * ROW + t] = 0;
    if (bodies > in_registers) {
        const int32_t more = bodies - in_registers;
        for (int32_t i = t; i < more * v.bodies.line; i += threads)
            m.lines[i / v.bodies.line * LINE_GENERAL + i % v.bodies.line] =
                v.bodies.lines[(size_t)v.graph.body_of[first_body + in_registers + i / v.bodies.line] *
                                   (size_t)v.bodies.line +
                               (size_t)(i % v.bodies.line)];
        for (int32_t i = t; i < more * ROW; i += threads)
            m.b[i] = (FAST ? v.bodies.momentum_residual : v.bodies.b)[raw_row(in_registers * ROW + i)];
    }
    own.own = 0;
    own.other = m.state;
    if (side < sides) load_side();
    own_row = kept_address<SIZE>(m.state + own.own * ROW);
    own_state = kept_address<SIZE>(m.state + body * ROW + r);
    if (!FAST && !args.start) load_records();
    else if (!FAST && updates) start_records();
    if (HAS_ROWS<SIZE> && !FAST && args.start && row_sides) start_row_records();
    if (FAST && MODE == GRID) /* for the first Steps 2-4 of the others */
        for (int32_t i = t; i < bodies * ROW; i += threads)
            v.iteration.exchange[(size_t)first_body * ROW + (size_t)i] = v.bodies.state[raw_row(i)];
    block_barrier<SIZE>();
}

/* ---- storing --------------------------------------------------------------------------------------------------- */

/* Velocities, and records (FAST: momentum residuals); nothing of islands that have stopped. */
PART __device__ __forceinline__ void PART_RUN::store_bodies(int32_t odd)
{
    const int32_t in_registers = (int32_t)blockDim.x / LANES;
    for (int32_t i = t; i < bodies * ROW; i += (int32_t)blockDim.x) {
        if (i % ROW >= 6 ||
            (FAST && island_stopped(v.graph, v.islands, args.checks, v.graph.body_of[first_body + i / ROW])))
            continue;
        v.bodies.state[raw_row(i)] = state(odd)[i];
        if (FAST)
            v.bodies.momentum_residual[raw_row(i)] = i < in_registers * ROW ? own_body.b : m.b[i - in_registers * ROW];
    }
    for (int32_t i = t; !FAST && i < sides * ROW; i += (int32_t)blockDim.x)
        v.iteration.records[(size_t)first_side * ROW + (size_t)i] = m.records[i];
}

/* The multipliers of the side's pair, from side a (b where a is static). */
PART __device__ __forceinline__ void PART_RUN::store_pair(void)
{
    const int32_t code = v.graph.incident[first_side + side], p = code / 2;
    if (code & 1 && v.contacts.bodies[p].body_a != v.model.bodies) return;
    const int32_t count = (int32_t)v.contacts.difference[p].w;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const int32_t k = lane + QUAD * j;
        if (k < count) store_lambda(v.contacts, point_slot(v.contacts, p, k), own.lambda[j]);
    }
}

#endif
