/* The fused iteration as one kernel whose state stays on the chip: tiers BLOCK, CLUSTER and GRID (device/context.h).
 *
 * A thread block owns a part: a range of bodies and the halves of their constraints. Four lanes (a quad) take a half, one
 * contact point each (points k and k + 4 where pairs have up to 8), and keep it in registers through all iterations. The
 * multipliers of a pair between two dynamic bodies are thereby computed twice, from the same inputs by the same
 * expressions, so that both copies stay equal bit for bit and no wrench ever leaves its block: an iteration exchanges
 * velocities, and nothing else.
 *   BLOCK    parts are whole islands: nothing to exchange
 *   CLUSTER  the blocks of a cluster read each other's velocities from shared memory, written alternately to two
 *            buffers, and meet in one cluster barrier an iteration
 *   GRID     velocities go through global memory, two buffers again, with one grid barrier an iteration. The launch is
 *            cooperative, so that every block runs and the spinning ends.
 * A half of a row block is the work of its quad's first lane; it reads its Jacobians from memory (six rows on two bodies
 * are more than registers hold).
 *
 * On entry and exit everything is in global memory as the stepwise kernels leave it. Before the first iteration and after
 * the last one of a step, BLOCK may also do what else an island needs (iterate/resident_ends.h).
 */
#ifndef SADMM_CUDA_ITERATE_RESIDENT_H
#define SADMM_CUDA_ITERATE_RESIDENT_H

#include "stop_rule.h"
#include "resident_ends.h"
#include "backend_cuda/step/plan_check.h"
#include "sweep.h"

enum resident_mode { BLOCK, CLUSTER, GRID };

enum { QUAD = 4 }; /* lanes a half */

/* Sizes of blocks an instance is made for: few threads may have all the registers they want, and a single warp needs no
 * barrier (BLOCK alone). */
enum block_size { ANY_SIZE, SMALL, ONE_WARP };
enum { SMALL_THREADS = sizeof(solver_real) == sizeof(float) ? 512 : 256 };

static constexpr int most_threads(int points, int size)
{
    if (size == ONE_WARP) return WARP;
    if (size == SMALL) return SMALL_THREADS;
    return sizeof(solver_real) == sizeof(float) ? (points == 4 ? 1024 : 768) : (points == 4 ? 512 : 384);
}

/* Records of a body that are fetched at once, whether it has them or not. */
enum { FEW = 4 };

/* ---- shared memory --------------------------------------------------------------------------------------------- */

/* The same in every block of a launch: blocks of a cluster look into each other's memory. */
struct part_memory {
    solver_real *state;      /* CLUSTER: of even, then of odd iterations; bodies x ROW each, then a row of 0 */
    solver_real *records;    /* halves x ROW, and FEW rows that are read and not used */
    solver_real *row_lambda; /* halves x ROW, when there are row blocks */
    solver_real *lines, *b;  /* of bodies beyond one for each eight threads: (bodies - threads / LANES) x line, ROW; FAST:
                                the defect in place of b */
    int32_t *suspected;      /* a body of the part has too much energy */
    /* Before the first iteration and after the last one, over what is above (iterate/resident_ends.h): */
    double *terms;           /* bodies x TERMS */
    island_range *range;     /* bodies */
};

enum { SLACK = 16 }; /* the end, with what is to come there aligned */

/* One description of the layout for its size and its addresses. */
static __host__ __device__ inline size_t lay_out(part_memory *m, unsigned char *base, bool cluster, int threads,
                                                 int32_t bodies, bool row_blocks)
{
    size_t n = (size_t)bodies, halves = (size_t)(threads / QUAD), first = (size_t)(threads / LANES);
    size_t more = n > first ? n - first : 0;
    m->state = (solver_real *)base;
    m->records = m->state + ((cluster ? 2 * n : n) + 1) * ROW;
    m->row_lambda = m->records + (halves + FEW) * ROW;
    m->lines = m->row_lambda + (row_blocks ? halves * ROW : 0);
    m->b = m->lines + more * LINE_GENERAL;
    m->terms = (double *)base;
    m->range = (island_range *)(m->terms + n * TERMS);
    size_t iterating = (size_t)(m->b + more * ROW - m->state) * sizeof(solver_real),
           ends = n * (TERMS * sizeof(double) + sizeof(island_range)), used = iterating > ends ? iterating : ends;
    m->suspected = (int32_t *)(base + used);
    return used + SLACK;
}

/* ---- barriers -------------------------------------------------------------------------------------------------- */

/* Between the two halves of a barrier a thread may do what concerns nobody else. */
template <int MODE, int SIZE> static __device__ __forceinline__ void arrive(unsigned *arrivals)
{
#ifdef SADMM_CUDA_EMULATED
    (void)arrivals;
#else
    if (MODE == GRID) {
        /* One thread of a block speaks for it: its release and acquire, with the block's own barriers around them, order
         * every thread's writes before every thread's reads. */
        __syncthreads();
        if (threadIdx.x == 0) asm volatile("red.release.gpu.global.add.u32 [%0], 1;" ::"l"(arrivals) : "memory");
    }
#if __CUDA_ARCH__ >= CLUSTER_ARCH
    if (MODE == CLUSTER) asm volatile("barrier.cluster.arrive.release.aligned;" ::: "memory");
#endif
#endif
}

/* Of the block's own. */
template <int SIZE> static __device__ __forceinline__ void block_barrier(void)
{
    if (SIZE == ONE_WARP) __syncwarp((unsigned)ALL_LANES);
    else __syncthreads();
}

/* `target`: arrivals in all when every block has come. */
template <int MODE, int SIZE> static __device__ __forceinline__ void wait(const unsigned *arrivals, unsigned target)
{
#ifdef SADMM_CUDA_EMULATED
    (void)arrivals;
    (void)target;
    if (MODE == BLOCK) block_barrier<SIZE>();
    else cuda_emulation_barrier_together();
#else
    if (MODE == GRID && threadIdx.x == 0) {
        unsigned now;
        do asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(now) : "l"(arrivals) : "memory");
        while ((int)(now - target) < 0);
    }
    if (MODE != CLUSTER) block_barrier<SIZE>();
#if __CUDA_ARCH__ >= CLUSTER_ARCH
    if (MODE == CLUSTER) asm volatile("barrier.cluster.wait.acquire.aligned;" ::: "memory");
#endif
#endif
}

/* The same address in the shared memory of another block of the cluster. */
static __device__ __forceinline__ const solver_real *in_block(const solver_real *own, unsigned rank)
{
#ifdef SADMM_CUDA_EMULATED
    return (const solver_real *)cuda_emulation_in_block(own, rank);
#elif __CUDA_ARCH__ >= CLUSTER_ARCH
    const solver_real *other;
    asm("mapa.u64 %0, %1, %2;" : "=l"(other) : "l"(own), "r"(rank));
    return other;
#else
    (void)rank;
    return own;
#endif
}

/* An address in this block's own memory, in a register: to save one the compiler makes it anew from its parts in every iteration,
 * and what is loaded from there waits. Blocks of ANY_SIZE have none to spare. */
template <int SIZE> static __device__ __forceinline__ solver_real *kept_address(solver_real *own)
{
#ifndef SADMM_CUDA_EMULATED
    if (SIZE != ANY_SIZE) {
        uint32_t at = (uint32_t)__cvta_generic_to_shared(own);
        asm volatile("" : "+r"(at));
        return (solver_real *)__cvta_shared_to_generic(at);
    }
#endif
    return own;
}

/* A number worked out here, not where it is used: the compiler may not move it past this place. */
#ifdef SADMM_CUDA_EMULATED
template <int SIZE, typename T> static void keep(T *)
{
}
#else
template <int SIZE> static __device__ __forceinline__ void keep(int32_t *number)
{
    if (SIZE != ANY_SIZE) asm volatile("" : "+r"(*number));
}
template <int SIZE> static __device__ __forceinline__ void keep(float *number)
{
    if (SIZE != ANY_SIZE) asm volatile("" : "+f"(*number));
}
template <int SIZE> static __device__ __forceinline__ void keep(double *number)
{
    if (SIZE != ANY_SIZE) asm volatile("" : "+d"(*number));
}
#endif

/* ---- halves in registers --------------------------------------------------------------------------------------- */

/* A lane's share of its quad's half: points lane, lane + 4, ... The half on side b sees the relative velocity x; the half
 * on side a sees -x, so its errors and weights have the other sign too. A point that is not there has all 0. */
template <int POINTS> struct half_lane {
    enum { COUNT = POINTS / QUAD };
    vec3 normal;
    real friction, sign;
    vec3 own_arm[COUNT], other_arm[COUNT], lambda[COUNT];
    real error[COUNT], inv_s[COUNT];
    int32_t own;              /* body, in the part */
    const solver_real *other; /* row of the other body's state in even iterations */
    int32_t other_odd;        /* from there to its row in odd iterations */
    bool pair;                /* a half of a pair */
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
    int32_t t, r, lane, half; /* thread; component of a body; lane of a quad; the quad's half */
    int32_t first_body, bodies, first_half, halves;
    body_thread found; /* the thread's first body */

    /* One body for each eight threads is in registers, with where its records are; more are in shared memory. What the loop
     * needs is worked out before it: addresses, and what holds for a whole warp. */
    int32_t body;
    const solver_real *gathered; /* component r of the first record */
    int32_t gathered_count;      /* 0 in lanes that have no component */
    bool many;                   /* some lane of the warp has more than FEW */
    bool moves, updates;         /* the warp has bodies, halves */
    const solver_real *own_row;  /* of the half's own body in even iterations */
    solver_real *own_state;      /* the body's component r, in even iterations */
    real2_pair *own_record;
    body_lane own_body;
    real momentum;               /* b - A v */
    real sum, step;              /* FAST: J^T d lambda, what v has gone by in this iteration */
    half_lane<POINTS> own;
    /* Until iterations begin (registers): what the half is, and its pair as it is in memory. */
    int32_t half_code;
    pair_ends on;
    real4 about, between, point[COUNT];

    __device__ __forceinline__ part_run(const cuda_view &view, const cuda_args &arguments, unsigned char *memory)
        : v(view), args(arguments), t((int32_t)threadIdx.x), r(t % LANES), lane(t % QUAD), half(t / QUAD),
          first_body(v.parts[blockIdx.x]), bodies(v.parts[blockIdx.x + 1] - first_body),
          first_half(v.offsets[first_body]), halves(v.offsets[first_body + bodies] - first_half),
          found(body_of_slot(v, first_body + t / LANES, t / LANES < bodies)), body(t / LANES),
          gathered(nullptr), gathered_count(0), many(false), moves(warp_has_body(0)), updates(warp_has_half()),
          own_row(nullptr), own_state(nullptr), own_record(nullptr), own_body(), momentum(0), sum(0), step(0), own(),
          half_code(half < halves ? v.incident[first_half + half] : 0), on(), about(), between(), point()
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
        return (size_t)v.body_of[first_body + i / ROW] * ROW + (size_t)(i % ROW);
    }
    __device__ __forceinline__ bool has_rows(void) const { return FULL && v.rows > 0; }
    /* Warps without work are left out of everything but barriers. */
    __device__ __forceinline__ bool warp_has_body(int32_t first) const
    {
        return first + t / WARP * (WARP / LANES) < bodies;
    }
    __device__ __forceinline__ bool warp_has_half(void) const { return t / WARP * (WARP / QUAD) < halves; }

    __device__ __forceinline__ void load(void);
    /* Where point k of the half's pair is, if there is memory for so many: their number is not waited for. */
    __device__ __forceinline__ size_t slot_or_first(int32_t k) const
    {
        return k < v.lanes * ((v.point_slots + v.lanes - 1) / v.lanes) ? point_slot(v, half_code / 2, k) : 0;
    }
    __device__ __forceinline__ void fetch_half(void);
    __device__ __forceinline__ void load_half(void);
    __device__ __forceinline__ void find_other(int32_t other);
    __device__ __forceinline__ void start_records(void);
    __device__ __forceinline__ void load_records(void);
    __device__ __forceinline__ void store_record(real2_pair *record, real2_pair sum) const;
    __device__ __forceinline__ real gather(real g, const solver_real *from, int32_t count, bool more) const;
    __device__ __forceinline__ void publish(solver_real *to, int32_t i, real value, int32_t odd);
    __device__ __forceinline__ void move_bodies(int32_t odd);
    __device__ __forceinline__ void move_bodies_fast(int32_t odd, real relaxation, real multipliers);
    template <bool MEASURE> __device__ __forceinline__ double update_halves(int32_t odd, real farther, bool plain);
    __device__ __forceinline__ bool suspect(int32_t odd) const;
    __device__ __forceinline__ void store(int32_t odd);
};

#define PART template <int POINTS, int MODE, bool FULL, int SIZE, bool FAST>
#define PART_RUN part_run<POINTS, MODE, FULL, SIZE, FAST>

/* ---- row blocks, out of line: few systems have them ------------------------------------------------------------ */

/* Steps 2-4 of half `code` of a row block, of the method `fast`, into this side's record. */
static __device__ __noinline__ double update_row_half_fast(const cuda_view &v, int32_t code, const solver_real *own,
                                                           const solver_real *other, solver_real *kept,
                                                           solver_real *record, real farther)
{
    const int32_t k = code / 2 - v.pair_room, side = code & 1;
    const row_about about = v.row_info[k];
    real lambda[6], delta[6];
    for (int j = 0; j < 6; ++j) lambda[j] = kept[j];
    update_row_block_fast(v, k, about, side ? other : own, side ? own : other, lambda, delta);
    for (int j = 0; j < 6; ++j) kept[j] = relaxed(kept[j], lambda[j], delta[j], farther);
    store_row_record(v, k, about.rows, side, delta, record);
    return row_block_primal_fast(v, k, about, delta);
}

/* Steps 2-4 of half `code` of a row block, into this side's record; `change`: as after a measured iteration. */
static __device__ __noinline__ double update_row_half(const cuda_view &v, int32_t code, const solver_real *own,
                                                      const solver_real *other, solver_real *kept, solver_real *record,
                                                      solver_real *change)
{
    const int32_t k = code / 2 - v.pair_room, side = code & 1;
    const row_about about = v.row_info[k];
    real lambda[6], delta[6];
    for (int j = 0; j < 6; ++j) lambda[j] = kept[j];
    update_row_block(v, k, about, side ? other : own, side ? own : other, lambda, delta);
    for (int j = 0; j < 6; ++j) kept[j] = lambda[j];
    if (!change)
        for (int j = 0; j < 6; ++j) lambda[j] += delta[j];
    store_row_record(v, k, about.rows, side, lambda, record);
    if (!change) return 0;
    store_row_record(v, k, about.rows, side, delta, change);
    return row_block_primal(v, about, delta);
}

static __device__ __noinline__ void start_row_half(const cuda_view &v, int32_t code, solver_real *kept,
                                                   solver_real *record, bool start)
{
    const int32_t k = code / 2 - v.pair_room;
    real lambda[6];
    load_row_lambda(v, k, lambda);
    for (int j = 0; j < 6; ++j) kept[j] = lambda[j];
    if (start) store_row_record(v, k, v.row_info[k].rows, code & 1, lambda, record);
}

/* ---- loading --------------------------------------------------------------------------------------------------- */

/* Where the other body's state will be. */
PART __device__ __forceinline__ void PART_RUN::find_other(int32_t other)
{
    /* slots are by island in BLOCK and CLUSTER, raw order in GRID; by island everywhere in the method `fast` */
    const int32_t slot = (MODE == GRID && !FAST) || other == v.bodies ? other : v.slot_of[other],
                  local = slot - first_body;
    own.other_odd = 0;
    if (other == v.bodies) { /* the static world */
        own.other = m.state + (MODE == CLUSTER ? 2 : 1) * args.most_bodies * ROW;
    } else if (MODE == BLOCK) {
        own.other = m.state + local * ROW;
    } else if (MODE == GRID) {
        bool inside = local >= 0 && local < bodies;
        own.other = inside ? m.state + local * ROW : v.exchange + (size_t)slot * ROW;
        own.other_odd = inside ? 0 : v.bodies * ROW;
    } else {
        const int32_t first_part = (int32_t)blockIdx.x / args.cluster * args.cluster;
        int32_t rank = 0;
        while (rank + 1 < args.cluster && slot >= v.parts[first_part + rank + 1]) ++rank;
        own.other = in_block(m.state, (unsigned)rank) + (slot - v.parts[first_part + rank]) * ROW;
        own.other_odd = args.most_bodies * ROW;
    }
}

/* The half's pair as it is in memory; its points' errors and weights may still change. */
PART __device__ __forceinline__ void PART_RUN::fetch_half(void)
{
    const int32_t p = half_code / 2;
    if (half >= halves || (FULL && p >= v.pair_room)) return;
    about = v.normal[p];
    between = v.difference[p];
    on = v.ends[p];
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const size_t slot = slot_or_first(lane + QUAD * j);
        point[j] = v.arm[slot];
        own.lambda[j] = load_lambda(v, slot);
    }
}

PART __device__ __forceinline__ void PART_RUN::load_half(void)
{
    const int32_t side = half_code & 1, p = half_code / 2;
    if (FULL && p >= v.pair_room) {
        const row_about rows = v.row_info[p - v.pair_room];
        own.own = v.slot_of[side ? rows.body_b : rows.body_a] - first_body;
        find_other(side ? rows.body_a : rows.body_b);
        return;
    }
    own.pair = true;
    own.sign = side ? (real)1 : (real)-1;
    own.own = v.slot_of[side ? on.body_b : on.body_a] - first_body;
    find_other(side ? on.body_a : on.body_b);
    const real inv_s =
        own.sign * (FAST ? v.inv_s[p] : inverse_weight(inv_beta_of(v, on.body_a), inv_beta_of(v, on.body_b)));
    own.normal = xyz(about);
    own.friction = about.w;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const int32_t k = lane + QUAD * j;
        const real error = FAST ? v.arm[slot_or_first(k)].w : point[j].w;
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

/* What the last stretch or the stepwise kernels left, joined after a measured iteration. */
PART __device__ __forceinline__ void PART_RUN::load_records(void)
{
    const real ratio = args.rescaled ? (real)*v.ratio : (real)1;
    for (int32_t i = t; i < halves * ROW; i += (int32_t)blockDim.x) {
        const size_t from = (size_t)first_half * ROW + (size_t)i;
        m.records[i] = args.join ? v.records[from] + ratio * v.change[from] : v.records[from];
    }
}

PART __device__ __forceinline__ void PART_RUN::load(void)
{
    const int32_t threads = (int32_t)blockDim.x, in_registers = threads / LANES;
    own_body = load_body(found.live, r, v.lines + found.body * (size_t)v.line, v.rigid,
                         (FAST ? v.defect : v.b) + found.body * ROW, v.state + found.body * ROW);
    gathered = m.records;
    if (found.live && r < 6) {
        gathered = m.records + (found.begin - first_half) * ROW + record_slot(r);
        gathered_count = found.end - found.begin;
    }
    many = __ballot_sync((unsigned)ALL_LANES, gathered_count > FEW) != 0;
    own_record = (real2_pair *)kept_address<SIZE>(m.records + half * ROW + quad_slot(lane));
    if (!FAST && moves) momentum = free_momentum(own_body);
    if (found.live) m.state[body * ROW + r] = own_body.v;
    for (int32_t i = in_registers * ROW + t; i < bodies * ROW; i += threads) m.state[i] = v.state[raw_row(i)];
    if (t < ROW) m.state[(MODE == CLUSTER ? 2 : 1) * args.most_bodies * ROW + t] = 0;
    if (bodies > in_registers) {
        const int32_t more = bodies - in_registers;
        for (int32_t i = t; i < more * v.line; i += threads)
            m.lines[i / v.line * LINE_GENERAL + i % v.line] =
                v.lines[(size_t)v.body_of[first_body + in_registers + i / v.line] * (size_t)v.line +
                        (size_t)(i % v.line)];
        for (int32_t i = t; i < more * ROW; i += threads)
            m.b[i] = (FAST ? v.defect : v.b)[raw_row(in_registers * ROW + i)];
    }
    own.own = 0;
    own.other = m.state;
    if (half < halves) load_half();
    own_row = kept_address<SIZE>(m.state + own.own * ROW);
    own_state = kept_address<SIZE>(m.state + body * ROW + r);
    if (!FAST && !args.start) load_records();
    else if (!FAST && updates) start_records();
    if (has_rows() && half < halves && !own.pair && lane == 0)
        start_row_half(v, half_code, m.row_lambda + half * ROW, m.records + half * ROW,
                       !FAST && args.start);
    if (FAST && MODE == GRID) /* for the first Steps 2-4 of the others */
        for (int32_t i = t; i < bodies * ROW; i += threads)
            v.exchange[(size_t)first_body * ROW + (size_t)i] = v.state[raw_row(i)];
    block_barrier<SIZE>();
}

/* ---- Step 1 ---------------------------------------------------------------------------------------------------- */

/* g and `count` numbers, each a record after the last, one after the other. The first few are fetched whether they are
 * there or not; where a lane of the warp has more, the next ones too before the first is added. */
PART __device__ __forceinline__ real PART_RUN::gather(real g, const solver_real *from, int32_t count, bool more) const
{
    real few[FEW], value[MORE] = {};
#pragma unroll
    for (int32_t j = 0; j < FEW; ++j) few[j] = from[j * ROW];
    if (more) {
#pragma unroll
        for (int32_t j = 0; j < MORE; ++j) value[j] = FEW + j < count ? from[(FEW + j) * ROW] : (real)0;
    }
#pragma unroll
    for (int32_t j = 0; j < FEW; ++j)
        if (j < count) g += few[j];
    if (!more) return g;
    for (int32_t h = FEW;;) {
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
    if (MODE == GRID) v.exchange[((size_t)(odd ? v.bodies : 0) + (size_t)(first_body + i)) * ROW + (size_t)r] = value;
}

PART __device__ __forceinline__ void PART_RUN::move_bodies(int32_t odd)
{
    if (has_moves()) {
        own_body.v += step_of(own_body, gather(momentum, gathered, gathered_count, many));
        publish(own_state, body, own_body.v, odd);
    }
    if (SIZE == ONE_WARP) return; /* at most one body for each eight threads (graph/partition.cu) */
    const int32_t in_registers = (int32_t)blockDim.x / LANES;
    for (int32_t first = in_registers; warp_has_body(first); first += in_registers) {
        const int32_t i = first + body, at = i - in_registers;
        const bool live = i < bodies;
        body_lane one =
            load_body(live, r, m.lines + at * LINE_GENERAL, v.rigid, m.b + at * ROW, state(!odd) + i * ROW);
        real g = free_momentum(one);
        if (live && r < 6) {
            const int32_t from = v.offsets[first_body + i], count = v.offsets[first_body + i + 1] - from;
            g = gather(g, m.records + (from - first_half) * ROW + record_slot(r), count, count > FEW);
        }
        publish(m.state + i * ROW + r, i, one.v + step_of(one, g), odd);
    }
}

/* `relaxation` times as far; multipliers have gone `multipliers` times. The defects of bodies in registers follow
 * later: nobody waits for them. */
PART __device__ __forceinline__ void PART_RUN::move_bodies_fast(int32_t odd, real relaxation, real multipliers)
{
    if (has_moves()) {
        sum = gather(0, gathered, gathered_count, many);
        step = step_fast(&own_body, sum, relaxation);
        publish(own_state, body, own_body.v, odd);
    }
    if (SIZE == ONE_WARP) return; /* at most one body for each eight threads (graph/partition.cu) */
    const int32_t in_registers = (int32_t)blockDim.x / LANES;
    for (int32_t first = in_registers; warp_has_body(first); first += in_registers) {
        const int32_t i = first + body, at = i - in_registers;
        const bool live = i < bodies && r < 6;
        body_lane one =
            load_body(i < bodies, r, m.lines + at * LINE_GENERAL, v.rigid, m.b + at * ROW, state(!odd) + i * ROW);
        real pushed = 0;
        if (live) {
            const int32_t from = v.offsets[first_body + i], count = v.offsets[first_body + i + 1] - from;
            pushed = gather(0, m.records + (from - first_half) * ROW + record_slot(r), count, count > FEW);
        }
        const real gone = step_fast(&one, pushed, relaxation);
        publish(m.state + i * ROW + r, i, one.v, odd);
        const real defect = defect_after(one, pushed, gone, multipliers);
        if (live) m.b[at * ROW + r] = defect;
    }
}

/* ---- Steps 2-4 ------------------------------------------------------------------------------------------------- */

PART __device__ __forceinline__ void PART_RUN::store_record(real2_pair *record, real2_pair sum) const
{
    sum.x *= own.sign;
    sum.y *= own.sign;
    if (own.pair) *record = sum;
}

/* The lane's share of the primal residual. FAST: lambda goes `farther` times as far, plain: once; records are those of Step 1 in any
 * case. */
PART template <bool MEASURE>
__device__ __forceinline__ double PART_RUN::update_halves(int32_t odd, real farther, bool plain)
{
    enum { SPLIT = MEASURE && !FAST };
    double primal = 0;
    if (!has_updates()) return primal;
    const solver_real *mine = own_row + (MODE == CLUSTER && odd ? args.most_bodies * ROW : 0),
                      *others = own.other + (odd ? own.other_odd : 0);
    const body_motion own_motion = load_motion(mine), other = load_motion(others);
    vec3 force = v3(0, 0, 0), torque = force, change_force = force, change_torque = force;
    real largest = 0;
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        const vec3 old = own.lambda[j], x = relative_velocity(other, own.other_arm[j], own_motion, own.own_arm[j]);
        const point_change to = update<FAST>(own.normal, own.friction, x, own.error[j], own.inv_s[j], old);
        const vec3 lambda = to.lambda, delta = to.delta;
        own.lambda[j] = FAST ? relaxed(old, to, plain, farther) : lambda;
        vec3 impulse =
            FAST ? delta : SPLIT ? lambda : v3_add(lambda, delta);
        vec3 moment = fused_cross(own.own_arm[j], impulse);
        force = j == 0 ? impulse : v3_add(force, impulse);
        torque = j == 0 ? moment : v3_add(torque, moment);
        if (SPLIT) {
            impulse = delta;
            moment = fused_cross(own.own_arm[j], impulse);
            change_force = j == 0 ? impulse : v3_add(change_force, impulse);
            change_torque = j == 0 ? moment : v3_add(change_torque, moment);
        }
        if (!MEASURE) continue;
        largest = real_max(largest, largest_row(own.normal, delta));
    }
    store_record(own_record, sum_quad(lane, force, torque));
    if (!MEASURE && !has_rows()) return primal;

    const int32_t code = half < halves ? v.incident[first_half + half] : 0;
    solver_real *change = SPLIT ? v.change + (size_t)(first_half + half) * ROW : nullptr;
    if (FAST && MEASURE && own.pair) {
        const pair_ends on = v.ends[code / 2];
        primal =
            (double)(largest * inverse_of_weight(real_abs(own.inv_s[0]), on.body_a < v.bodies && on.body_b < v.bodies));
    }
    if (SPLIT) {
        store_record((real2_pair *)(change + quad_slot(lane)), sum_quad(lane, change_force, change_torque));
        if (own.pair) {
            const pair_ends on = v.ends[code / 2];
            primal = (double)(largest * real_max(inv_beta_of(v, on.body_a), inv_beta_of(v, on.body_b)));
        }
    }
    if (has_rows() && half < halves && !own.pair && lane == 0)
        primal = FAST ? update_row_half_fast(v, code, mine, others, m.row_lambda + half * ROW,
                                             m.records + half * ROW, farther)
                      : update_row_half(v, code, mine, others, m.row_lambda + half * ROW, m.records + half * ROW,
                                        change);
    return primal;
}

/* ---- the limit of energies, of the method `fast` ------------------------------------------------------------------ */

/* Is there a body, one of those that this thread speaks for, that has more energy than it may? Of a world: rigid ones. */
PART __device__ __forceinline__ bool PART_RUN::suspect(int32_t odd) const
{
    bool any = false;
    const int32_t in_registers = (int32_t)blockDim.x / LANES;
    for (int32_t first = 0; warp_has_body(first); first += in_registers) {
        const int32_t i = first + body, at = i - in_registers;
        const bool live = i < bodies;
        const size_t raw = live ? (size_t)v.body_of[first_body + i] : 0;
        const bool speaks = live && r == 0;
        const double b = live && r < 6 ? (double)v.b[raw * ROW + (size_t)r] : 0, free = speaks ? v.free_energy[raw] : 0;
        double a[3] = {}; /* of rigid bodies */
#pragma unroll
        for (int k = 0; k < 3; ++k) {
            if (first == 0) a[k] = (double)(r < 3 ? own_body.A[k] : own_body.A[k + 3]);
            else if (live && r < 6) a[k] = (double)line_a(m.lines + at * LINE_GENERAL, true, r, r / 3 * 3 + k);
        }
        const double velocity = live && r < 6 ? (double)state(odd)[i * ROW + r] : 0;
        any = suspect_body(args.few, speaks, free, velocity, b, a) || any;
    }
    return any;
}

/* ---- storing --------------------------------------------------------------------------------------------------- */

/* Velocities, records (FAST: defects) and, from side a (b where a is static), multipliers; nothing of islands that have
 * stopped. */
PART __device__ __forceinline__ void PART_RUN::store(int32_t odd)
{
    const int32_t in_registers = (int32_t)blockDim.x / LANES;
    for (int32_t i = t; i < bodies * ROW; i += (int32_t)blockDim.x) {
        if (i % ROW >= 6 || (FAST && island_stopped(v, args.looks, v.body_of[first_body + i / ROW]))) continue;
        v.state[raw_row(i)] = state(odd)[i];
        if (FAST) v.defect[raw_row(i)] = i < in_registers * ROW ? own_body.b : m.b[i - in_registers * ROW];
    }
    for (int32_t i = t; !FAST && i < halves * ROW; i += (int32_t)blockDim.x)
        v.records[(size_t)first_half * ROW + (size_t)i] = m.records[i];
    if (half >= halves) return;
    if (FAST && island_stopped(v, args.looks, v.body_of[first_body + own.own])) return;
    const int32_t code = v.incident[first_half + half], p = code / 2;
    if (own.pair) {
        if (code & 1 && v.ends[p].body_a != v.bodies) return;
        const int32_t count = (int32_t)v.difference[p].w;
#pragma unroll
        for (int32_t j = 0; j < COUNT; ++j) {
            const int32_t k = lane + QUAD * j;
            if (k < count) store_lambda(v, point_slot(v, p, k), own.lambda[j]);
        }
    } else if (FULL && lane == 0) {
        const int32_t k = p - v.pair_room;
        if (code & 1 && v.row_info[k].body_a != v.bodies) return;
        store_row_lambda(v, k, m.row_lambda + half * ROW);
    }
}

/* ---- the kernel ------------------------------------------------------------------------------------------------ */

/* The step is halted; or a block without bodies, or a cluster: there are more than islands, mostly. In the grid everybody comes to
 * the barrier. Or the stop rule is met. */
template <int MODE, bool FAST>
static __device__ __forceinline__ bool nothing_to_do(const cuda_view &v, const cuda_args &args)
{
    const int32_t cluster = MODE == BLOCK ? 1 : args.cluster, part = (int32_t)blockIdx.x / cluster * cluster,
                  first = v.parts[part], end = v.parts[part + cluster]; /* beside halt: neither load waits for the other */
    if (v.live->halt || (FAST && MODE != BLOCK && all_stopped(v, args.looks))) return true;
    if (MODE == GRID) return false;
    return first == end || (FAST && MODE == BLOCK && part_stopped(v, args.looks, first, end));
}

/* The method `fast` (math/relax.h): Steps 2-4, then Step 1. An iteration has the barriers of the other method's. */
template <int MODE, bool FULL, int SIZE, class Part>
static __device__ __forceinline__ void iterate_fast(Part &part, const cuda_view &v, const cuda_args &args,
                                                    unsigned *target)
{
    if (MODE != BLOCK) { /* others look at the velocities that were loaded */
        arrive<MODE, SIZE>(v.barrier);
        wait<MODE, SIZE>(v.barrier, *target += gridDim.x);
    }
    int32_t count = args.count, stretch = args.goes_on ? count + 1 : count, settled = args.settled;
    /* Were it the launch's constant, and not a choice, it would be fetched in every iteration. */
    real all = part.bodies > 0 ? args.relaxation : (real)1;
    keep<SIZE>(&count), keep<SIZE>(&stretch), keep<SIZE>(&settled), keep<SIZE>(&all);
    for (int32_t i = 0; i < count; ++i) {
        const int32_t odd = i & 1;
        const bool plain = !relax_constraints(i, stretch) || all == 1;
        real farther = plain ? (real)1 : all, bodies_farther = relax_velocity(i, stretch, settled) ? all : (real)1;
        keep<SIZE>(&farther), keep<SIZE>(&bodies_farther);
        if (FULL && plain && args.measure) reduce_max(part.template update_halves<true>(odd, farther, true), v.residual);
        else part.template update_halves<false>(odd, farther, plain);
        block_barrier<SIZE>();
        part.move_bodies_fast(!odd, bodies_farther, farther);
        settled = 1;
        arrive<MODE, SIZE>(v.barrier);
        if (part.has_moves()) part.own_body.b = defect_after(part.own_body, part.sum, part.step, farther);
        wait<MODE, SIZE>(v.barrier, *target += gridDim.x);
    }
}

/* The method `paper`: Step 1, then Steps 2-4. */
template <int MODE, bool FULL, int SIZE, class Part>
static __device__ __forceinline__ void iterate_paper(Part &part, const cuda_view &v, const cuda_args &args, unsigned *target)
{
    for (int32_t iteration = 1; iteration <= args.count; ++iteration) {
        const int32_t odd = iteration & 1;
        part.move_bodies(odd);
        arrive<MODE, SIZE>(v.barrier);
        if (part.has_moves()) part.momentum = free_momentum(part.own_body);
        wait<MODE, SIZE>(v.barrier, *target += gridDim.x);
        if (FULL && args.measure && iteration == args.count)
            reduce_max(part.template update_halves<true>(odd, 1, true), v.residual);
        else part.template update_halves<false>(odd, 1, true);
        block_barrier<SIZE>();
    }
    /* Nobody looks into this block's memory once it is gone. */
    if (MODE == CLUSTER) {
        arrive<MODE, SIZE>(v.barrier);
        wait<MODE, SIZE>(v.barrier, 0);
    }
}

/* FULL: with row blocks, or to be measured; both cost registers, and most stretches have neither. A multiprocessor holds one block
 * at least: unless told so the compiler gives a block of one warp fewer registers than it needs. */
template <int POINTS, int MODE, bool FULL, int SIZE, bool FAST>
static __global__ void __launch_bounds__(most_threads(POINTS, SIZE), 1)
    resident_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    CUDA_DYNAMIC_SHARED(memory);
    wait_for_stream();
    /* They take registers. */
    constexpr bool ENDS = FAST && MODE == BLOCK && !FULL && SIZE != ANY_SIZE;
    if (nothing_to_do<MODE, FAST>(v, args)) {
        if (ENDS && args.begin) stamp_assembled(v);
        return;
    }
    part_run<POINTS, MODE, FULL, SIZE, FAST> part(v, args, memory);
    const auto barrier = [] { block_barrier<SIZE>(); };
    const block_part ends = {part.first_body, part.bodies, part.m.terms, part.m.range, part.m.suspected};
    if (ENDS && threadIdx.x == 0) *ends.suspected = 0;
    const bool begins = ENDS && args.begin;
    if constexpr (ENDS)
        if (begins) store_first_terms(v, ends, part.found);
    part.fetch_half(); /* on its way while islands are weighed */
    if constexpr (ENDS)
        if (begins) {
            weigh_in_block(v, args, ends, part.found, barrier);
            stamp_assembled(v);
        }
    part.load();
    unsigned target = 0;
    if (FAST) iterate_fast<MODE, FULL, SIZE>(part, v, args, &target);
    else iterate_paper<MODE, FULL, SIZE>(part, v, args, &target);
    /* After the iterations: what has come takes a place beside them. A cooperative launch ends 10 us later for it, and after
     * clusters it gains nothing. */
    if (MODE == BLOCK) let_next_begin();
    part.store(args.count & 1);
    if (!FAST || args.limit == LIMIT_NONE) return;
    const bool suspected = part.suspect(args.count & 1);
    if (!ENDS || args.limit == LIMIT_SUSPECTS) {
        if (suspected) *v.suspects = 1;
        return;
    }
    if constexpr (ENDS) {
        if (suspected) *ends.suspected = 1;
        block_barrier<SIZE>();
        if (*ends.suspected) limit_in_block(v, args.few, ends, barrier);
    }
}

/* ---- instances ------------------------------------------------------------------------------------------------- */

struct resident_instance {
    int points;
    bool full;
    int size;
    bool fast;
    cuda_kernel kernel;
    const char *name;
};

/* All of a mode, which has a source of its own: they take long to compile. */
struct resident_instances {
    const resident_instance *first;
    size_t count;
};
resident_instances CUDA(block_instances)(void);
resident_instances CUDA(cluster_instances)(void);
resident_instances CUDA(grid_instances)(void);

#define INSTANCE(points, mode, full, size, fast, name) \
    {points, full, size, fast, resident_kernel<points, mode, full, size, fast>, "iterate (" name ")"}
/* Boxes on boxes touch in up to 8 points, mostly 4: with 4 a lane needs fewer registers. */
#define OF_SIZES(points, mode, fast, name)                        \
    INSTANCE(points, mode, false, ANY_SIZE, fast, name),          \
        INSTANCE(points, mode, false, SMALL, fast, name ", small"), \
        INSTANCE(points, mode, true, ANY_SIZE, fast, name ", full")
#define OF_MODE(mode, name)                                      \
    OF_SIZES(4, mode, false, name ", 4 points"),                 \
        OF_SIZES(8, mode, false, name ", 8 points"),             \
        OF_SIZES(4, mode, true, "fast, " name ", 4 points"),     \
        OF_SIZES(8, mode, true, "fast, " name ", 8 points")

#endif
