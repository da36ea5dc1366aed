/* The persistent kernel (persistent.h): a thread block's part, how it is loaded and stored. */
#ifndef SADMM_CUDA_ITERATE_PERSISTENT_PART_H
#define SADMM_CUDA_ITERATE_PERSISTENT_PART_H

#include "persistent_memory.h"
#include "persistent_rows.h"
#include "stop_rule.h"

/* ---- sides in registers --------------------------------------------------------------------------------------- */

/* A lane's share of its quad's side: points lane, lane + 4, ... The side on side b sees the relative velocity x; the
 * side on side a sees -x, so its errors and weights have the other sign too. A point that is not there has all 0. */
template <int POINTS> struct side_lane {
    enum { COUNT = POINTS / QUAD };
    vec3 normal;
    real friction, sign;
    vec3 own_arm[COUNT], other_arm[COUNT], lambda[COUNT];
    real error[COUNT], inv_s[COUNT];
    int32_t own;              /* body, in the part */
    const solver_real *other; /* row of the other body's state in even iterations */
    int32_t other_odd;        /* from there to its row in odd iterations */
    bool pair;                /* a side of a pair */
};

struct real2_pair {
    solver_real x, y;
};

/* Force and torque added over a quad as (q_0 + q_1) + (q_2 + q_3); lane 0 gets the force's x and y, lane 2 its z and 0, lanes
 * 1 and 3 the torque's. Every lane of the warp comes here. */
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

/* ---- a part ---------------------------------------------------------------------------------------------------- */

template <int POINTS, int MODE, bool FULL, int SIZE, bool FAST> struct part_run {
    enum { COUNT = POINTS / QUAD, MORE = MODE == BLOCK ? 8 : 4 }; /* more take registers, fewer another round */
    const cuda_view &v;
    const cuda_args &args;
    part_memory m;
    int32_t t, r, lane, side; /* thread; component of a body; lane of a quad; the quad's side */
    int32_t first_body, bodies, first_side, sides;
    body_thread found; /* the thread's first body */

    /* One body for each eight threads is in registers, with where its records are; more are in shared memory. What the loop
     * needs is worked out before it: addresses, and what holds for a whole warp. */
    int32_t body;
    const solver_real *gathered; /* component r of the first record */
    int32_t gathered_count;      /* 0 in lanes that have no component */
    bool many;                   /* some lane of the warp has more than FEW */
    bool moves, updates;         /* the warp has bodies, sides */
    const solver_real *own_row;  /* of the side's own body in even iterations */
    solver_real *own_state;      /* the body's component r, in even iterations */
    real2_pair *own_record;
    body_lane own_body;
    real momentum;               /* b - A v */
    real sum, step;              /* FAST: J^T d lambda, what v has gone by in this iteration */
    side_lane<POINTS> own;
    /* Until iterations begin (registers): what the side is, and its pair as it is in memory. */
    int32_t side_code;
    pair_ends on;
    real4 about, between, point[COUNT];

    __device__ __forceinline__ part_run(const cuda_view &view, const cuda_args &arguments, unsigned char *memory)
        : v(view), args(arguments), t((int32_t)threadIdx.x), r(t % LANES), lane(t % QUAD), side(t / QUAD),
          first_body(v.graph.parts[blockIdx.x]), bodies(v.graph.parts[blockIdx.x + 1] - first_body),
          first_side(v.graph.offsets[first_body]), sides(v.graph.offsets[first_body + bodies] - first_side),
          found(body_of_slot(v.graph, first_body + t / LANES, t / LANES < bodies)), body(t / LANES), gathered(nullptr),
          gathered_count(0), many(false), moves(warp_has_body(0)), updates(warp_has_side()), own_row(nullptr),
          own_state(nullptr), own_record(nullptr), own_body(), momentum(0), sum(0), step(0), own(),
          side_code(side < sides ? v.graph.incident[first_side + side] : 0), on(), about(), between(), point()
    {
        lay_out(&m, memory, MODE == CLUSTER, (int)blockDim.x, args.most_bodies, has_rows());
    }

    /* A block of one warp has work, or would not be here. */
    __device__ __forceinline__ bool has_moves(void) const { return SIZE == ONE_WARP || moves; }
    __device__ __forceinline__ bool has_updates(void) const { return SIZE == ONE_WARP || updates; }

    __device__ __forceinline__ solver_real *state(int32_t odd) const
    {
        return m.state + (MODE == CLUSTER && odd ? args.most_bodies * ROW : 0);
    }
    /* Number i of the part's rows of ROW, in the bodies' raw order. */
    __device__ __forceinline__ size_t raw_row(int32_t i) const
    {
        return (size_t)v.graph.body_of[first_body + i / ROW] * ROW + (size_t)(i % ROW);
    }
    __device__ __forceinline__ bool has_rows(void) const { return FULL && v.rows.count > 0; }
    /* Warps without work are left out of everything but barriers. */
    __device__ __forceinline__ bool warp_has_body(int32_t first) const
    {
        return first + t / WARP * (WARP / LANES) < bodies;
    }
    __device__ __forceinline__ bool warp_has_side(void) const { return t / WARP * (WARP / QUAD) < sides; }

    __device__ __forceinline__ void load(void);
    /* Where point k of the side's pair is, if there is memory for so many: their number is not waited for. */
    __device__ __forceinline__ size_t slot_or_first(int32_t k) const
    {
        return k < v.contacts.lanes * ((v.contacts.point_slots + v.contacts.lanes - 1) / v.contacts.lanes)
                   ? point_slot(v.contacts, side_code / 2, k)
                   : 0;
    }
    __device__ __forceinline__ void fetch_side(void);
    __device__ __forceinline__ void load_side(void);
    __device__ __forceinline__ void find_other(int32_t other);
    __device__ __forceinline__ void start_records(void);
    __device__ __forceinline__ void load_records(void);
    __device__ __forceinline__ void store_record(real2_pair *record, real2_pair sum) const;
    __device__ __forceinline__ real gather(real g, const solver_real *from, int32_t count, bool more) const;
    __device__ __forceinline__ void publish(solver_real *to, int32_t i, real value, int32_t odd);
    __device__ __forceinline__ void move_bodies(int32_t odd);
    __device__ __forceinline__ void move_bodies_fast(int32_t odd, real relaxation, real multipliers);
    template <bool MEASURE>
    __device__ __forceinline__ double update_sides(int32_t odd, real relaxation_factor, bool plain);
    __device__ __forceinline__ bool suspect(int32_t odd) const;
    __device__ __forceinline__ void store(int32_t odd);
};

#define PART template <int POINTS, int MODE, bool FULL, int SIZE, bool FAST>
#define PART_RUN part_run<POINTS, MODE, FULL, SIZE, FAST>

/* ---- loading --------------------------------------------------------------------------------------------------- */

/* Where the other body's state will be. */
PART __device__ __forceinline__ void PART_RUN::find_other(int32_t other)
{
    /* slots are by island in BLOCK and CLUSTER, raw order in GRID; by island everywhere in the method `fast` */
    const int32_t slot = (MODE == GRID && !FAST) || other == v.model.bodies ? other : v.graph.slot_of[other],
                  local = slot - first_body;
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
    if (side >= sides || (FULL && p >= v.contacts.pair_capacity)) return;
    about = v.contacts.normal[p];
    between = v.contacts.difference[p];
    on = v.contacts.ends[p];
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const size_t slot = slot_or_first(lane + QUAD * j);
        point[j] = v.contacts.arm[slot];
        own.lambda[j] = load_lambda(v.contacts, slot);
    }
}

PART __device__ __forceinline__ void PART_RUN::load_side(void)
{
    const int32_t side = side_code & 1, p = side_code / 2;
    if (FULL && p >= v.contacts.pair_capacity) {
        const row_about rows = v.rows.info[p - v.contacts.pair_capacity];
        own.own = v.graph.slot_of[side ? rows.body_b : rows.body_a] - first_body;
        find_other(side ? rows.body_a : rows.body_b);
        return;
    }
    own.pair = true;
    own.sign = side ? (real)1 : (real)-1;
    own.own = v.graph.slot_of[side ? on.body_b : on.body_a] - first_body;
    find_other(side ? on.body_a : on.body_b);
    const real inv_s =
        own.sign * (FAST ? v.contacts.inv_s[p]
                         : inverse_weight(inv_beta_of(v.bodies, on.body_a), inv_beta_of(v.bodies, on.body_b)));
    own.normal = xyz(about);
    own.friction = about.w;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const int32_t k = lane + QUAD * j;
        const real error = FAST ? v.contacts.arm[slot_or_first(k)].w : point[j].w;
        const bool there = k < (int32_t)between.w;
        const vec3 arm_a = xyz(point[j]), arm_b = v3_add(arm_a, xyz(between)), none = v3(0, 0, 0);
        own.own_arm[j] = there ? (side ? arm_b : arm_a) : none;
        own.other_arm[j] = there ? (side ? arm_a : arm_b) : none;
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
    many = __ballot_sync((unsigned)ALL_LANES, gathered_count > FEW) != 0;
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
    if (has_rows() && side < sides && !own.pair && lane == 0)
        start_row_side(v, side_code, m.row_lambda + side * ROW, m.records + side * ROW,
                       !FAST && args.start);
    if (FAST && MODE == GRID) /* for the first Steps 2-4 of the others */
        for (int32_t i = t; i < bodies * ROW; i += threads)
            v.iteration.exchange[(size_t)first_body * ROW + (size_t)i] = v.bodies.state[raw_row(i)];
    block_barrier<SIZE>();
}

/* ---- storing --------------------------------------------------------------------------------------------------- */

/* Velocities, records (FAST: momentum residuals) and, from side a (b where a is static), multipliers; nothing of
 * islands that have stopped. */
PART __device__ __forceinline__ void PART_RUN::store(int32_t odd)
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
    if (side >= sides) return;
    if (FAST && island_stopped(v.graph, v.islands, args.checks, v.graph.body_of[first_body + own.own])) return;
    const int32_t code = v.graph.incident[first_side + side], p = code / 2;
    if (own.pair) {
        if (code & 1 && v.contacts.ends[p].body_a != v.model.bodies) return;
        const int32_t count = (int32_t)v.contacts.difference[p].w;
#pragma unroll
        for (int32_t j = 0; j < COUNT; ++j) {
            const int32_t k = lane + QUAD * j;
            if (k < count) store_lambda(v.contacts, point_slot(v.contacts, p, k), own.lambda[j]);
        }
    } else if (FULL && lane == 0) {
        const int32_t k = p - v.contacts.pair_capacity;
        if (code & 1 && v.rows.info[k].body_a != v.model.bodies) return;
        store_row_lambda(v.rows, k, m.row_lambda + side * ROW);
    }
}

#endif
