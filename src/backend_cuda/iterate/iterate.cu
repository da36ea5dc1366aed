/* The iteration, stepwise (kernels I-O) and as a graph of plain steps, and the residuals (16), (17). */
#include <string.h>

#include "stop_rule.h"
#include "sweep.h"

#include "core/math/limit.h"

/* Iterations in the graph: enough to hide the launch of one graph behind the run of the one before. */
enum { GRAPH_ITERATIONS = 16 };
enum { BODY_THREADS = 128 };

/* ---- kernels -------------------------------------------------------------------------------------------------- */

/* Iterations go over the data forward and backward in turn: what one has touched last is still in the caches when the next
 * one begins. */
static __device__ __forceinline__ int32_t thread_index(const cuda_args &args)
{
    const unsigned block = args.backward ? gridDim.x - 1 - blockIdx.x : blockIdx.x;
    return (int32_t)(block * (unsigned)THREADS + threadIdx.x);
}

template <int COUNT> static __device__ __forceinline__ void unpack(real (&to)[4 * COUNT], const real4 (&four)[COUNT])
{
#pragma unroll
    for (int i = 0; i < COUNT; ++i)
        to[4 * i] = four[i].x, to[4 * i + 1] = four[i].y, to[4 * i + 2] = four[i].z, to[4 * i + 3] = four[i].w;
}
template <int COUNT> static __device__ __forceinline__ void load_numbers(real (&to)[4 * COUNT], const solver_real *from)
{
    real4 four[COUNT];
#pragma unroll
    for (int i = 0; i < COUNT; ++i) four[i] = ((const real4 *)from)[i];
    unpack(to, four);
}
template <int COUNT>
static __device__ __forceinline__ void load_numbers_once(real (&to)[4 * COUNT], const solver_real *from)
{
    real4 four[COUNT];
#pragma unroll
    for (int i = 0; i < COUNT; ++i) four[i] = load_once((const real4 *)from + i);
    unpack(to, four);
}

static __device__ __forceinline__ void store_numbers(solver_real *to, const real (&from)[ROW])
{
    const real4 lo = {from[0], from[1], from[2], from[3]}, hi = {from[4], from[5], from[6], from[7]};
    ((real4 *)to)[0] = lo;
    ((real4 *)to)[1] = hi;
}

/* Step 1, a thread a body: all of a body's numbers lie side by side and are asked for at once, sixteen bytes at a time. (Eight
 * lanes a body, as in the resident tiers, where latency counts, spend the time on instructions that load and pass around
 * single numbers.) What is read once makes room in the caches for states and records. The sums are those of
 * free_momentum() and step_of(); FAST: of step_fast() and defect_after(), args.factor times as far. */
template <bool JOIN, bool RIGID, bool FAST>
static __global__ void __launch_bounds__(BODY_THREADS)
    bodies_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    enum { LINE = RIGID ? LINE_RIGID : LINE_GENERAL };
    const unsigned block = args.backward ? gridDim.x - 1 - blockIdx.x : blockIdx.x;
    const int32_t i = (int32_t)(block * (unsigned)BODY_THREADS + threadIdx.x);
    if (i >= live_bodies(v) || (FAST && all_stopped(v, args.looks))) return;
    const size_t at = args.in_order ? (size_t)i : (size_t)v.body_of[i];
    if (FAST && island_stopped(v, args.looks, (int32_t)at)) return;
    const real ratio = JOIN && args.rescaled ? (real)*v.ratio : (real)1;
    real line[LINE], b[ROW], state[ROW], g[6], step[6];
    load_numbers_once<LINE / 4>(line, v.lines + at * LINE);
    load_numbers_once<ROW / 4>(b, (FAST ? v.defect : v.b) + at * ROW);
    load_numbers<ROW / 4>(state, v.state + at * ROW);
#pragma unroll
    for (int r = 0; r < 6; ++r) {
        g[r] = FAST ? (real)0 : b[r];
#pragma unroll
        for (int k = 0; k < 6 && !FAST; ++k) g[r] = fused(-line_a((const real *)line, RIGID, r, k), state[k], g[r]);
    }
    const int32_t end = v.offsets[i + 1];
#pragma unroll 4
    for (int32_t h = v.offsets[i]; h < end; ++h) {
        real record[ROW], change[ROW];
        load_numbers<ROW / 4>(record, v.records + (size_t)h * ROW);
        if (JOIN) load_numbers<ROW / 4>(change, v.change + (size_t)h * ROW);
#pragma unroll
        for (int r = 0; r < 6; ++r) {
            const int slot = record_slot(r);
            g[r] += JOIN ? record[slot] + ratio * change[slot] : record[slot];
        }
    }
    const real *H = line_h((const real *)line, RIGID);
    real pushed[6];
#pragma unroll
    for (int r = 0; r < 6; ++r) pushed[r] = FAST ? fused((real)2, g[r], b[r]) : g[r];
#pragma unroll
    for (int r = 0; r < 6; ++r) {
        step[r] = product_with_row(H[packed_place(r, 0)], H[packed_place(r, 1)], H[packed_place(r, 2)],
                                   H[packed_place(r, 3)], H[packed_place(r, 4)], H[packed_place(r, 5)], pushed);
        const real before = state[r];
        state[r] = FAST ? fused((real)args.factor, step[r], before) : before + step[r];
        step[r] = state[r] - before;
    }
    store_numbers(v.state + at * ROW, state);
    if (FAST) {
#pragma unroll
        for (int r = 0; r < 6; ++r) {
            b[r] = fused((real)args.multipliers, g[r], b[r]);
#pragma unroll
            for (int k = 0; k < 6; ++k) b[r] = fused(-line_a((const real *)line, RIGID, r, k), step[k], b[r]);
        }
        store_numbers(v.defect + at * ROW, b);
    }
}

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

/* The sums of a pair's lanes, added as (q_0 + q_1) + (q_2 + q_3), into the records of its halves. Of four lanes, 0 and 1
 * end up with force and torque on a, 2 and 3 on b. Every lane of the warp comes here. */
template <int LANES_A_PAIR>
static __device__ __forceinline__ void store_records(solver_real *records, const pair_ends &ends, int32_t lane,
                                                     bool live, const pair_sum &q)
{
    real4 *out = (real4 *)records;
    if (LANES_A_PAIR == 1) {
        if (live && ends.half_a >= 0) {
            out[2 * (size_t)ends.half_a] = pack(v3_neg(q.force), 0);
            out[2 * (size_t)ends.half_a + 1] = pack(v3_neg(q.torque_a), 0);
        }
        if (live && ends.half_b >= 0) {
            out[2 * (size_t)ends.half_b] = pack(q.force, 0);
            out[2 * (size_t)ends.half_b + 1] = pack(q.torque_b, 0);
        }
        return;
    }
    const bool odd = lane & 1, on_b = lane & 2;
    const int32_t half = on_b ? ends.half_b : ends.half_a;
    /* Even lanes keep the force, odd ones the torques. */
    const vec3 kept = v3_add(odd ? q.torque_a : q.force, exchange(odd ? q.force : q.torque_a, 1));
    const vec3 torque_b = v3_add(q.torque_b, exchange(q.torque_b, 1));
    const vec3 sum = v3_add(odd && on_b ? torque_b : kept, exchange(odd && !on_b ? torque_b : kept, 2));
    if (live && half >= 0) out[2 * (size_t)half + (odd ? 1 : 0)] = pack(on_b ? sum : v3_neg(sum), 0);
}

/* A lane's share of a pair: points lane and, where COUNT is 2, lane + 4. The first is loaded whether it is
 * there or not, so that nothing but the states waits for another load. `live`: else nothing is stored. Every lane of the warp comes
 * here. FAST: lambda goes `farther` times as far; records are those of Step 1 in any case. Returns the lane's share of the primal
 * residual. */
template <int LANES_A_PAIR, int COUNT, bool MEASURE, bool FAST>
static __device__ __forceinline__ double sweep_pair(const cuda_view &v, int32_t p, int32_t lane, bool live, real farther)
{
    enum { SPLIT = MEASURE && !FAST };
    const real4 about = load_once(v.normal + p), between = load_once(v.difference + p);
    const pair_ends ends = load_once(v.ends + p);
    const real weight = FAST ? v.inv_s[p] : (real)0;
    size_t slot[COUNT];
    real4 point[COUNT];
    vec3 old[COUNT];
    slot[0] = point_slot<LANES_A_PAIR>(v, p, lane);
    point[0] = load_once(v.arm + slot[0]);
    old[0] = load_lambda(v, slot[0]);
    const int32_t count = (int32_t)between.w;
#pragma unroll
    for (int32_t j = 1; j < COUNT; ++j) {
        if (lane + LANES_A_PAIR * j >= count) continue;
        slot[j] = point_slot<LANES_A_PAIR>(v, p, lane + LANES_A_PAIR * j);
        point[j] = load_once(v.arm + slot[j]);
        old[j] = load_lambda(v, slot[j]);
    }
    const body_row a = load_row(v.state, ends.body_a), b = load_row(v.state, ends.body_b);

    const vec3 normal = xyz(about), difference = xyz(between);
    const real inv_s = FAST ? weight : inverse_weight(a.inv_beta, b.inv_beta);
    real largest = 0;
    pair_sum next = {}, change = {};
#pragma unroll
    for (int32_t j = 0; j < COUNT; ++j) {
        if (lane + LANES_A_PAIR * j >= count) continue;
        const vec3 arm_a = xyz(point[j]), arm_b = v3_add(arm_a, difference);
        const vec3 x = relative_velocity(a.motion, arm_a, b.motion, arm_b);
        const point_change to = update<FAST>(normal, about.w, x, point[j].w, inv_s, old[j]);
        const vec3 lambda = to.lambda, delta = to.delta;
        if (live) store_lambda(v, slot[j], FAST ? relaxed(old[j], to, farther == 1, farther) : lambda);
        add_point(&next, j,
                  FAST ? delta : SPLIT ? lambda : v3_add(lambda, delta), arm_a, arm_b);
        if (SPLIT) add_point(&change, j, delta, arm_a, arm_b);
        if (!MEASURE) continue;
        largest = real_max(largest, largest_row(normal, delta));
    }
    store_records<LANES_A_PAIR>(v.records, ends, lane, live, next);
    if (SPLIT) store_records<LANES_A_PAIR>(v.change, ends, lane, live, change);
    if (!MEASURE) return 0;
    return (double)(largest * (FAST ? inverse_of_weight(inv_s, ends.body_a < v.bodies && ends.body_b < v.bodies)
                                    : real_max(a.inv_beta, b.inv_beta)));
}

/* The same for J^T lambda^0. */
template <int LANES_A_PAIR>
static __device__ __forceinline__ void start_pair(const cuda_view &v, int32_t p, int32_t lane, bool live)
{
    const real4 between = v.difference[p];
    pair_sum sum = {};
    for (int32_t k = lane; k < (int32_t)between.w; k += LANES_A_PAIR) {
        size_t slot = point_slot<LANES_A_PAIR>(v, p, k);
        vec3 arm = xyz(v.arm[slot]), lambda = load_lambda(v, slot);
        add_point(&sum, k / LANES_A_PAIR, lambda, arm, v3_add(arm, xyz(between)));
    }
    store_records<LANES_A_PAIR>(v.records, v.ends[p], lane, live, sum);
}

/* ---- row blocks ------------------------------------------------------------------------------------------------- */

static __device__ __forceinline__ void store_row_records(const cuda_view &v, int32_t k, const row_about &about,
                                                         const real lambda[6], solver_real *records)
{
    if (about.half_a >= 0) store_row_record(v, k, about.rows, 0, lambda, records + (size_t)about.half_a * ROW);
    if (about.half_b >= 0) store_row_record(v, k, about.rows, 1, lambda, records + (size_t)about.half_b * ROW);
}

template <bool MEASURE>
static __device__ __forceinline__ double sweep_row_block_fast(const cuda_view &v, int32_t k, real farther)
{
    const row_about about = v.row_info[k];
    real lambda[6], delta[6], kept[6];
    load_row_lambda(v, k, lambda);
    for (int r = 0; r < 6; ++r) kept[r] = lambda[r];
    update_row_block_fast(v, k, about, v.state + (size_t)about.body_a * ROW, v.state + (size_t)about.body_b * ROW,
                          lambda, delta);
    for (int r = 0; r < 6; ++r) kept[r] = relaxed(kept[r], lambda[r], delta[r], farther);
    store_row_lambda(v, k, kept);
    store_row_records(v, k, about, delta, v.records);
    return MEASURE ? row_block_primal_fast(v, k, about, delta) : 0;
}

template <bool MEASURE> static __device__ __forceinline__ double sweep_row_block(const cuda_view &v, int32_t k)
{
    const row_about about = v.row_info[k];
    real lambda[6], delta[6];
    load_row_lambda(v, k, lambda);
    update_row_block(v, k, about, v.state + (size_t)about.body_a * ROW, v.state + (size_t)about.body_b * ROW, lambda,
                     delta);
    store_row_lambda(v, k, lambda);
    if (MEASURE) {
        store_row_records(v, k, about, lambda, v.records);
        store_row_records(v, k, about, delta, v.change);
    } else {
        for (int r = 0; r < 6; ++r) lambda[r] += delta[r];
        store_row_records(v, k, about, lambda, v.records);
    }
    return MEASURE ? row_block_primal(v, about, delta) : 0;
}

/* ---- kernels over constraints: blocks of threads for pairs, then blocks for row blocks ----------------------------- */

template <int LANES_A_PAIR> static __device__ __forceinline__ int32_t pair_threads(const cuda_view &v)
{
    return (LANES_A_PAIR * v.pair_room + THREADS - 1) / THREADS * THREADS;
}

/* The pair of thread t: work(pair, lane, live), in whole warps; lanes beyond the last pair come with that one, not live. */
template <int LANES_A_PAIR, class Work>
static __device__ __forceinline__ void with_pair(const cuda_view &v, int32_t t, Work work)
{
    const int32_t pairs = live_pairs(v), p = t / LANES_A_PAIR;
    if (t / WARP * (WARP / LANES_A_PAIR) < pairs) work(p < pairs ? p : pairs - 1, t % LANES_A_PAIR, p < pairs);
}

/* FAST: args.factor times as far. */
template <int LANES_A_PAIR, int COUNT, bool MEASURE, bool FAST>
static __global__ void __launch_bounds__(THREADS)
    constraints_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const int32_t t = thread_index(args), k = t - pair_threads<LANES_A_PAIR>(v);
    double primal = 0;
    if (FAST && all_stopped(v, args.looks)) return;
    if (k < 0)
        with_pair<LANES_A_PAIR>(v, t, [&](int32_t p, int32_t lane, bool live) {
            const bool on = live && !(FAST && pair_stopped(v, args.looks, v.ends[p]));
            primal = sweep_pair<LANES_A_PAIR, COUNT, MEASURE, FAST>(v, p, lane, on, (real)args.factor);
        });
    else if (k < live_rows(v))
        primal = FAST ? sweep_row_block_fast<MEASURE>(v, k, (real)args.factor) : sweep_row_block<MEASURE>(v, k);
    if (MEASURE) reduce_max(primal, v.residual);
}

/* J^T lambda^0. */
template <int LANES_A_PAIR>
static __global__ void start_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const int32_t t = thread_index(args), k = t - pair_threads<LANES_A_PAIR>(v);
    if (k < 0) {
        with_pair<LANES_A_PAIR>(v, t, [&](int32_t p, int32_t lane, bool live) {
            start_pair<LANES_A_PAIR>(v, p, lane, live);
        });
    } else if (k < live_rows(v)) {
        real lambda[6];
        load_row_lambda(v, k, lambda);
        store_row_records(v, k, v.row_info[k], lambda, v.records);
    }
}

/* Where records go. */
static __global__ void place_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const int32_t at = thread_index(args), bodies = live_bodies(v);
    if (bodies == 0 || at >= v.offsets[bodies]) return;
    const int32_t half = v.incident[at], side = half & 1, k = half / 2 - v.pair_room;
    if (k < 0) *(side ? &v.ends[half / 2].half_b : &v.ends[half / 2].half_a) = at;
    else *(side ? &v.row_info[k].half_b : &v.row_info[k].half_a) = at;
}

/* (17) as the momentum residual A v - b - J^T lambda. */
static __global__ void dual_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    int32_t i = thread_index(args) / LANES, r = (int32_t)threadIdx.x % LANES;
    double dual = 0;
    if (i < live_bodies(v) && r < 6) {
        size_t body = (size_t)v.body_of[i];
        const solver_real *line = v.lines + body * (size_t)v.line, *state = v.state + body * ROW;
        real g = -v.b[body * ROW + (size_t)r];
        for (int k = 0; k < 6; ++k) g += line_a(line, v.rigid, r, k) * state[k];
        for (int32_t at = v.offsets[i]; at < v.offsets[i + 1]; ++at)
            g -= v.records[(size_t)at * ROW + (size_t)record_slot(r)];
        dual = fabs((double)g);
    }
    reduce_max(dual, v.residual + 1);
}

/* ---- launches ------------------------------------------------------------------------------------------------- */

/* fast: v goes `relaxation` times as far, multipliers have gone `multipliers` times. */
static sadmm_status launch_bodies(struct sadmm_context *c, bool join, double relaxation, double multipliers,
                                  struct sadmm_error *error)
{
    cuda_args args = {};
    args.rescaled = c->rescaled;
    args.backward = c->backward;
    args.looks = c->looks;
    args.in_order = !slots_by_island(&c->partition);
    args.factor = relaxation;
    args.multipliers = multipliers;
    cuda_kernel kernel =
        c->fast         ? (c->view.rigid ? bodies_kernel<false, true, true> : bodies_kernel<false, false, true>)
        : c->view.rigid ? (join ? bodies_kernel<true, true, false> : bodies_kernel<false, true, false>)
                        : (join ? bodies_kernel<true, false, false> : bodies_kernel<false, false, false>);
    const int64_t blocks = ((int64_t)c->view.bodies + BODY_THREADS - 1) / BODY_THREADS;
    return CUDA(launch_of)(c, kernel, "update_velocity", blocks, BODY_THREADS, &args, error);
}

static int64_t constraint_blocks(const cuda_view *v)
{
    return blocks_for((int64_t)v->lanes * v->pair_room) + blocks_for(v->rows);
}

template <int LANES_A_PAIR, int COUNT> static cuda_kernel sweep_kernel(bool measure, bool fast)
{
    return fast ? (measure ? constraints_kernel<LANES_A_PAIR, COUNT, true, true>
                           : constraints_kernel<LANES_A_PAIR, COUNT, false, true>)
                : (measure ? constraints_kernel<LANES_A_PAIR, COUNT, true, false>
                           : constraints_kernel<LANES_A_PAIR, COUNT, false, false>);
}

/* fast: lambda goes `farther` times as far. */
static sadmm_status launch_constraints(struct sadmm_context *c, bool measure, double farther, struct sadmm_error *error)
{
    cuda_args args = {};
    args.factor = farther;
    args.looks = c->looks;
    args.backward = c->backward;
    c->backward = !c->backward;
    cuda_kernel kernel = c->view.lanes == 1            ? sweep_kernel<1, 1>(measure, c->fast)
                         : c->facts.point_slots <= 4 ? sweep_kernel<4, 1>(measure, c->fast)
                                                     : sweep_kernel<4, 2>(measure, c->fast);
    return CUDA(launch)(c, kernel, "update_constraints", constraint_blocks(&c->view), &args, error);
}

static sadmm_status clear_primal(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    if (!measure) return SADMM_OK;
    if (!c->plan.residuals && c->view.pair_room + c->view.rows > 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "measure = true: the plan has residuals = false");
    return CUDA(clear)(c, SCALAR_PRIMAL, error);
}

sadmm_status CUDA(prepare_stepwise)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_view *v = &c->view;
    cuda_args args = {};
    if (!c->placed)
        CUDA_TRY(CUDA(launch)(c, place_kernel, "place_records", blocks_for(2 * ((int64_t)v->pair_room + v->rows)), &args,
                              error));
    c->placed = true;
    if (!c->starting) return SADMM_OK;
    c->starting = false;
    return CUDA(launch)(c, v->lanes == 1 ? start_kernel<1> : start_kernel<4>, "start_records", constraint_blocks(v), &args, error);
}

static sadmm_status refuse_fast(const struct sadmm_context *c, struct sadmm_error *error)
{
    if (!c->fast) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "method = fast: its iterations are not taken step by step");
}

extern "C" sadmm_status CUDA(update_velocity)(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_TRY(refuse_fast(c, error));
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(prepare_stepwise)(c, error));
    CUDA_TRY(launch_bodies(c, c->measured, 1, 1, error));
    c->measured = false;
    c->rescaled = false;
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(update_constraints)(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    CUDA_TRY(refuse_fast(c, error));
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(prepare_stepwise)(c, error));
    CUDA_TRY(clear_primal(c, measure, error));
    CUDA_TRY(launch_constraints(c, measure, 1, error));
    c->measured = measure;
    return SADMM_OK;
}

/* ---- fused: STREAM -------------------------------------------------------------------------------------------- */

/* fast: Steps 2-4 first, and relaxed as iteration i of `count` is. */
static sadmm_status fast_iteration(struct sadmm_context *c, int i, int count, bool measure, struct sadmm_error *error)
{
    const double relaxation = c->settings.relaxation;
    const double farther = relax_constraints(i, count) ? relaxation : 1;
    CUDA_TRY(launch_constraints(c, measure, farther, error));
    CUDA_TRY(launch_bodies(c, false, relax_velocity(i, count, c->settled) ? relaxation : 1, farther, error));
    c->settled = true;
    return SADMM_OK;
}

/* Iterations of which nothing is special: fast, relaxed ones. */
static sadmm_status plain_iterations(struct sadmm_context *c, int count, struct sadmm_error *error)
{
    for (int i = 0; i < count; ++i) {
        if (c->fast) {
            CUDA_TRY(fast_iteration(c, i, count + 1, false, error));
            continue;
        }
        CUDA_TRY(launch_bodies(c, false, 1, 1, error));
        CUDA_TRY(launch_constraints(c, false, 1, error));
    }
    return SADMM_OK;
}

/* Record GRAPH_ITERATIONS plain iterations. A graph of an earlier step has the same nodes: only arguments change. */
static sadmm_status make_graph(struct sadmm_context *c, struct sadmm_error *error)
{
    cudaGraph_t graph = nullptr;
    CUDA_CALL(c, cudaStreamBeginCapture(c->stream, cudaStreamCaptureModeThreadLocal), "cudaStreamBeginCapture");
    sadmm_status status = plain_iterations(c, GRAPH_ITERATIONS, error);
    cudaError_t code = cudaStreamEndCapture(c->stream, &graph);
    if (status != SADMM_OK || code != cudaSuccess) {
        if (graph) cudaGraphDestroy(graph);
        return status != SADMM_OK ? status : CUDA(fail)(c, code, "cudaStreamEndCapture", error);
    }
    if (c->graph) {
        cudaGraphExecUpdateResultInfo info;
        if (cudaGraphExecUpdate(c->graph, graph, &info) != cudaSuccess) {
            (void)cudaGetLastError(); /* another topology: not an error, but remembered as one */
            cudaGraphExecDestroy(c->graph);
            c->graph = nullptr;
        }
    }
    if (!c->graph) code = cudaGraphInstantiate(&c->graph, graph, 0);
    cudaGraphDestroy(graph);
    if (code != cudaSuccess) {
        c->graph = nullptr;
        return CUDA(fail)(c, code, "cudaGraphInstantiate", error);
    }
    c->graph_valid = true;
    return SADMM_OK;
}

/* fast, goes_on: none of them is the stretch's last. */
static sadmm_status stream_iterations(struct sadmm_context *c, int count, bool measure, bool goes_on,
                                      struct sadmm_error *error)
{
    CUDA_TRY(CUDA(prepare_stepwise)(c, error));
    if (c->measured) {
        CUDA_TRY(launch_bodies(c, true, 1, 1, error));
        CUDA_TRY(launch_constraints(c, measure && count == 1, 1, error));
        --count;
    }
    if (c->fast && !c->settled && (count > 1 || goes_on)) {
        CUDA_TRY(fast_iteration(c, 0, 2, false, error));
        --count;
    }
    int plain = (measure || (c->fast && !goes_on)) && count > 0 ? count - 1 : count;
    if (plain >= GRAPH_ITERATIONS && !c->recording && !c->graph_valid) CUDA_TRY(make_graph(c, error));
    for (; plain >= GRAPH_ITERATIONS && !c->recording; plain -= GRAPH_ITERATIONS, count -= GRAPH_ITERATIONS)
        CUDA_CALL(c, cudaGraphLaunch(c->graph, c->stream), "cudaGraphLaunch");
    CUDA_TRY(plain_iterations(c, plain, error));
    if (count > plain && c->fast) return fast_iteration(c, 0, 1, measure, error);
    if (count > plain) {
        CUDA_TRY(launch_bodies(c, false, 1, 1, error));
        CUDA_TRY(launch_constraints(c, true, 1, error));
    }
    return SADMM_OK;
}

/* ---- fused: BLOCK, CLUSTER and GRID ---------------------------------------------------------------------------- */

static sadmm_status resident_iterations(struct sadmm_context *c, int count, bool measure, enum cuda_limit limit,
                                        bool goes_on, struct sadmm_error *error)
{
    const struct cuda_partition *partition = &c->partition;
    const char *name = nullptr;
    cuda_args args = CUDA(weight_args)(c); /* of a solve that begins with them */
    args.begin = c->ends && !c->settled;
    args.count = count;
    args.measure = measure;
    args.join = c->measured;
    args.rescaled = c->rescaled;
    args.start = c->starting || args.begin;
    args.settled = c->settled;
    args.goes_on = goes_on;
    args.limit = limit;
    args.few = limit_few(c->plan.warm, c->settings.iterations);
    args.looks = c->looks;
    args.relaxation = (solver_real)c->settings.relaxation;
    args.most_bodies = partition->most_bodies;
    args.cluster = partition->cluster;
    cuda_kernel kernel = CUDA(resident_kernel)(c->facts.point_slots, partition->tier, partition->threads,
                                               measure || c->view.rows > 0, c->fast, &name);
    if (partition->tier == SADMM_CUDA_TIER_GRID) CUDA_TRY(CUDA(clear)(c, SCALAR_BARRIER, error));
    CUDA_TRY(CUDA(launch_partition)(c, kernel, name, partition, true, &args, error));
    c->starting = false;
    c->settled = true;
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_iterations)(struct sadmm_context *c, int count, bool measure, enum cuda_limit limit,
                                      struct sadmm_error *error)
{
    const bool stream = c->partition.tier == SADMM_CUDA_TIER_STREAM;
    CUDA_TRY(clear_primal(c, measure, error));
    while (count > 0) {
        if (c->fast && c->exact_since == RELAX_DEFECT_PERIOD) {
            CUDA_TRY(CUDA(enqueue_defects)(c, error));
            c->exact_since = 0;
        }
        const int left = c->fast ? RELAX_DEFECT_PERIOD - c->exact_since : count, now = count < left ? count : left;
        const bool goes_on = now < count;
        CUDA_TRY(stream ? stream_iterations(c, now, measure && !goes_on, goes_on, error)
                        : resident_iterations(c, now, measure && !goes_on, goes_on ? LIMIT_NONE : limit, goes_on, error));
        if (c->fast) c->exact_since += now;
        count -= now;
    }
    c->measured = measure && !c->fast;
    c->rescaled = false;
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(iterate)(struct sadmm_context *c, int count, bool measure, struct sadmm_error *error)
{
    if (count <= 0) return SADMM_OK;
    CUDA_ENTER(c);
    return CUDA(enqueue_iterations)(c, count, measure, LIMIT_NONE, error);
}

/* ---- residuals ------------------------------------------------------------------------------------------------ */

sadmm_status CUDA(enqueue_residuals)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_TRY(CUDA(clear)(c, SCALAR_DUAL, error));
    if (c->fast) return CUDA(enqueue_momentum_residual)(c, error);
    return CUDA(launch)(c, dual_kernel, "measure_residuals", blocks_for((int64_t)c->view.bodies * LANES), &args, error);
}

extern "C" sadmm_status CUDA(measure_residuals)(struct sadmm_context *c, struct sadmm_residual *residual,
                                                struct sadmm_error *error)
{
    double both[2];
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(enqueue_residuals)(c, error));
    CUDA_TRY(CUDA(download)(c, c->view.residual, sizeof both, error));
    memcpy(both, c->buffers[PINNED_OUT].data, sizeof both);
    residual->primal = both[0];
    residual->dual = both[1];
    return SADMM_OK;
}
