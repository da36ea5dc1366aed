/* The iteration as two kernels: stepwise (kernels I-O), and tier STREAM, a graph of plain steps. */
#include "backend_cuda/graph/layout_kernels.h"
#include "iterate.h"
#include "stop_rule.h"
#include "streamed_sweep.h"

/* Iterations in the graph: enough to hide the launch of one graph behind the run of the one before. */
enum { GRAPH_ITERATIONS = 16 };
enum { BODY_THREADS = 128 };

/* ---- Step 1 --------------------------------------------------------------------------------------------------- */

/* Iterations go over the data forward and backward in turn: what one has touched last is still in the caches when the
 * next one begins. */
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
template <int COUNT>
static __device__ __forceinline__ void load_numbers_once(real (&to)[4 * COUNT], const solver_real *from)
{
    real4 four[COUNT];
#pragma unroll
    for (int i = 0; i < COUNT; ++i) four[i] = load_once((const real4 *)from + i);
    unpack(to, four);
}

/* How far a part of the iteration goes in the island of a body; model.bodies: of none, whose island must not be asked
 * for. (In a step that was aborted islands may have no labels; what a joint has room for, but no rows, has no body.) */
template <bool FAST>
static __device__ __forceinline__ real relaxed(const cuda_view &v, const cuda_args &args, enum cuda_relax what,
                                               int32_t body)
{
    if (!FAST || !(args.relax & what) || body >= v.model.bodies) return 1;
    if (args.relax & RELAX_WARM && !v.islands.info[v.graph.label[body]].warm) return 1;
    return (real)v.model.settings->relaxation;
}
static __device__ __forceinline__ int32_t first_dynamic(const model_view &model, int32_t a, int32_t b)
{
    return a < model.bodies ? a : b;
}

/* Step 1, two threads a body: components 0 to 2 by the one, 3 to 5 by the other. A record has force and torque in
 * halves of sixteen bytes (f32), and each of the two reads its own: a warp's loads are whole sectors, and twice as many
 * records are on their way. A's and H's numbers both read at the same address, rows by halves that they pass on. (Eight
 * lanes a body, as in the persistent tiers, where latency counts, spend the time on instructions that load and pass
 * around single numbers.) What is read once leaves the caches to states and records. The sums are those of
 * free_momentum() and step_of(); FAST: of step_fast() and residual_after(), as far as args.relax says.
 *
 * FAST: a body that nothing touches has the velocity that it falls with after an iteration or two. Once none, relaxed
 * or not, can change a bit of it, RESIDUAL_STAYS says so, and its other numbers are not read any more. */
enum { HALVES = 2, HALF = 3 };

/* The half's own of two numbers; the other half's. */
static __device__ __forceinline__ real own_of(int32_t half, real first, real second) { return half ? second : first; }
static __device__ __forceinline__ real of_other_half(real own) { return __shfl_xor_sync((unsigned)ALL_LANES, own, 1); }

/* All six numbers, of which the halves have three each. Every lane of the warp comes here. */
static __device__ __forceinline__ void join_halves(int32_t half, const real (&own)[HALF], real (&all)[HALVES * HALF])
{
#pragma unroll
    for (int q = 0; q < HALF; ++q) {
        const real other = of_other_half(own[q]);
        all[q] = own_of(half, own[q], other);
        all[q + HALF] = own_of(half, other, own[q]);
    }
}

/* A row of eight by both, half of it each (`there`: else it is 0). Every lane of the warp comes here. */
static __device__ __forceinline__ void fetch_halves(int32_t half, bool there, const solver_real *row, real (&to)[ROW])
{
    const real4 none = {}, own = there ? load_before_wait((const real4 *)row + half) : none,
                other = {of_other_half(own.x), of_other_half(own.y), of_other_half(own.z), of_other_half(own.w)};
    const real four[2][4] = {{own.x, own.y, own.z, own.w}, {other.x, other.y, other.z, other.w}};
#pragma unroll
    for (int k = 0; k < 4; ++k) {
        to[k] = own_of(half, four[0][k], four[1][k]);
        to[k + 4] = own_of(half, four[1][k], four[0][k]);
    }
}

/* Numbers 0 to 5 of a row of eight whose last two are as they were. Every lane of the warp comes here. */
static __device__ __forceinline__ void store_halves(int32_t half, const real (&own)[HALF], const real (&before)[ROW],
                                                    bool live, solver_real *row)
{
    const real fourth = of_other_half(own[0]);
    const real4 piece = {own_of(half, own[0], own[1]), own_of(half, own[1], own[2]),
                         own_of(half, own[2], before[6]), own_of(half, fourth, before[7])};
    if (live) ((real4 *)row)[half] = piece;
}

template <bool JOIN, bool RIGID, bool FAST>
static __global__ void __launch_bounds__(BODY_THREADS)
    bodies_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    enum { LINE = RIGID ? LINE_RIGID : LINE_GENERAL, LINE_A = LINE - LINE_H };
    const unsigned block = args.backward ? gridDim.x - 1 - blockIdx.x : blockIdx.x;
    const int32_t t = (int32_t)(block * (unsigned)BODY_THREADS + threadIdx.x), i = t / HALVES, half = t % HALVES;
    const bool there = i < live_bodies(v.model);
    /* Threads without a body come along, for the other lanes' sake. */
    const size_t at = !there ? 0 : args.in_order ? (size_t)i : (size_t)v.graph.body_of[i];
    const int32_t body = there ? (int32_t)at : v.model.bodies;
    const bool live = there && !(FAST && island_stopped(v.graph, v.islands, args.checks, (int32_t)at));
    const int32_t begin = live ? v.graph.offsets[i] : 0, end = live ? v.graph.offsets[i + 1] : 0;
    const real ratio = JOIN && args.rescaled ? (real)*v.iteration.ratio : (real)1,
               relaxation = FAST ? (real)v.model.settings->relaxation : (real)1,
               multipliers = relaxed<FAST>(v, args, RELAX_MULTIPLIERS, body),
               velocity = relaxed<FAST>(v, args, RELAX_VELOCITY, body);
    const solver_real *line = v.bodies.lines + at * LINE;
    solver_real *const b_row = (FAST ? v.bodies.momentum_residual : v.bodies.b) + at * ROW,
                *const state_row = v.bodies.state + at * ROW;
    real A[LINE_A] = {}, H[LINE_H] = {}, b[ROW], state[ROW], g[HALF], pushed[HALF], all[HALVES * HALF], step[HALF],
         after[HALF];
    fetch_halves(half, true, b_row, b);
    const bool apart = begin == end, moves = live && !(FAST && apart && b[RESIDUAL_STAYS] != 0);
    if (!FAST || moves) {
        load_numbers_once<LINE_A / 4>(A, line);
        load_numbers_once<LINE_H / 4>(H, line + LINE_A);
    }
    fetch_halves(half, !FAST || moves, state_row, state);
    const auto a_of = [&](int q, int k) {
        return own_of(half, line_a((const real *)A, RIGID, q, k), line_a((const real *)A, RIGID, q + HALF, k));
    };
#pragma unroll
    for (int q = 0; q < HALF; ++q) {
        g[q] = FAST ? (real)0 : own_of(half, b[q], b[q + HALF]);
#pragma unroll
        for (int k = 0; k < 6 && !FAST; ++k) g[q] = fused(-a_of(q, k), state[k], g[q]);
    }
    const real4 *records = (const real4 *)v.iteration.records + half,
                *changes = (const real4 *)v.iteration.change + half;
    pdl_wait();
    pdl_trigger();
    if (FAST && all_stopped(v.islands, args.checks)) return;
#pragma unroll 4
    for (int32_t h = begin; h < end; ++h) {
        real4 record = records[HALVES * (size_t)h];
        if (JOIN) {
            const real4 change = changes[HALVES * (size_t)h];
            record.x = record.x + ratio * change.x;
            record.y = record.y + ratio * change.y;
            record.z = record.z + ratio * change.z;
        }
        g[0] += record.x;
        g[1] += record.y;
        g[2] += record.z;
    }
#pragma unroll
    for (int q = 0; q < HALF; ++q) pushed[q] = FAST ? fused((real)2, g[q], own_of(half, b[q], b[q + HALF])) : g[q];
    join_halves(half, pushed, all);
    const auto h_of = [&](int q, int k) { return own_of(half, H[packed_place(q, k)], H[packed_place(q + HALF, k)]); };
    bool stays = apart;
#pragma unroll
    for (int q = 0; q < HALF; ++q) {
        const real before = own_of(half, state[q], state[q + HALF]),
                   whole = product_with_row(h_of(q, 0), h_of(q, 1), h_of(q, 2), h_of(q, 3), h_of(q, 4), h_of(q, 5),
                                            all);
        after[q] = FAST ? fused(velocity, whole, before) : before + whole;
        step[q] = after[q] - before;
        stays = stays && fused(real_max(1, relaxation), whole, before) == before;
    }
    store_halves(half, after, state, moves, state_row);
    if (!FAST) return;
    const bool other_stays = __shfl_xor_sync((unsigned)ALL_LANES, (int)stays, 1) != 0;
    b[RESIDUAL_STAYS] = stays && other_stays ? 1 : 0;
    join_halves(half, step, all);
#pragma unroll
    for (int q = 0; q < HALF; ++q) {
        after[q] = fused(multipliers, g[q], own_of(half, b[q], b[q + HALF]));
#pragma unroll
        for (int k = 0; k < 6; ++k) after[q] = fused(-a_of(q, k), all[k], after[q]);
    }
    store_halves(half, after, b, moves, b_row);
}

/* ---- kernels over constraints: blocks of threads for pairs, then blocks for row blocks --------------------------- */

/* The pair of thread t, in whole warps: lanes beyond the last pair come with that one, not live. */
struct pair_thread {
    int32_t p, lane;
    bool there, live;
};
template <int LANES_A_PAIR>
static __device__ __forceinline__ pair_thread pair_of(const model_view &model, int32_t t)
{
    const int32_t pairs = live_pairs(model), p = t / LANES_A_PAIR;
    const pair_thread out = {p < pairs ? p : pairs - 1, t % LANES_A_PAIR, t / WARP * (WARP / LANES_A_PAIR) < pairs,
                             p < pairs};
    return out;
}

/* FAST: as far as args.relax says. */
template <int LANES_A_PAIR, int COUNT, bool MEASURE, bool FAST>
static __global__ void __launch_bounds__(THREADS)
    constraints_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const pair_thread t = pair_of<LANES_A_PAIR>(v.model, thread_index(args));
    swept_pair<COUNT> pair;
    double primal = 0;
    if (t.there) pair = fetch_pair<LANES_A_PAIR, COUNT, FAST>(v.contacts, t.p, t.lane);
    pdl_wait();
    pdl_trigger();
    if (FAST && all_stopped(v.islands, args.checks)) return;
    if (t.there) {
        const bool on = t.live && !(FAST && pair_stopped(v.model, v.graph, v.islands, args.checks, pair.ends));
        const real factor = relaxed<FAST>(v, args, RELAX_MULTIPLIERS,
                                          first_dynamic(v.model, pair.ends.body_a, pair.ends.body_b));
        primal = sweep_pair<LANES_A_PAIR, COUNT, MEASURE, FAST>(v.model, v.bodies, v.contacts, v.iteration, pair,
                                                                t.lane, on, factor);
    }
    if (MEASURE) reduce_max(primal, v.iteration.residual);
}

/* The same of constraints given by rows: a kernel of its own, whose registers pairs do not pay for. */
template <bool MEASURE, bool FAST>
static __global__ void __launch_bounds__(THREADS)
    rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_only_if(all_pdl(v.model.bodies));
    const int32_t k = thread_index(args);
    double primal = 0;
    if (FAST && all_stopped(v.islands, args.checks)) return;
    if (k < live_rows(v.model, v.rows) &&
        !(FAST && rows_stopped(v.model, v.graph, v.islands, args.checks, v.rows.constraints[k])))
        primal = sweep_rows<MEASURE, FAST>(v.model, v.bodies, v.rows, v.iteration, k,
                                           relaxed<FAST>(v, args, RELAX_MULTIPLIERS,
                                                         first_dynamic(v.model, v.rows.constraints[k].body_a,
                                                                       v.rows.constraints[k].body_b)));
    if (MEASURE) reduce_max(primal, v.iteration.residual);
}

/* J^T lambda^0. */
template <int LANES_A_PAIR>
static __global__ void start_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_only_if(all_pdl(v.model.bodies));
    const pair_thread t = pair_of<LANES_A_PAIR>(v.model, thread_index(args));
    if (t.there) start_pair<LANES_A_PAIR>(v.contacts, v.iteration, t.p, t.lane, t.live);
}

static __global__ void start_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_only_if(all_pdl(v.model.bodies));
    const int32_t k = thread_index(args);
    if (k < live_rows(v.model, v.rows)) start_rows(v.rows, v.iteration, k);
}

/* Where records go. */
static __global__ void place_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_only_if(all_pdl(v.model.bodies));
    const int32_t at = thread_index(args), bodies = live_bodies(v.model);
    if (bodies == 0 || at >= v.graph.offsets[bodies]) return;
    const int32_t side = v.graph.incident[at], on_b = side & 1, k = side / 2 - v.contacts.pair_capacity;
    if (k < 0) *(on_b ? &v.contacts.bodies[side / 2].side_b : &v.contacts.bodies[side / 2].side_a) = at;
    else *(on_b ? &v.rows.constraints[k].side_b : &v.rows.constraints[k].side_a) = at;
}

/* ---- launches ------------------------------------------------------------------------------------------------- */

/* A sweep. It fetches what no sweep writes, or the one before the last, and only then waits for the last one: while
 * that one's last blocks run, the next one's are loading. So the first of a batch, which other kernels precede, is
 * launched without PDL; `follows`: it is not the first. */
static sadmm_status launch_sweep(struct sadmm_context *c, cuda_kernel kernel, const char *name, int64_t blocks,
                                 int threads, bool follows, const cuda_args *args, struct sadmm_error *error)
{
    const bool alternate = c->view.contacts.pair_capacity > 0; /* else Step 1 would follow on itself */
    return follows && alternate ? CUDA(launch_pdl)(c, kernel, name, blocks, threads, args, error)
                                : CUDA(launch_without_pdl)(c, kernel, name, blocks, threads, args, error);
}

/* relax: of enum cuda_relax. */
static sadmm_status launch_bodies(struct sadmm_context *c, bool join, int relax, bool follows,
                                  struct sadmm_error *error)
{
    cuda_args args = {};
    args.rescaled = c->rescaled;
    args.backward = c->backward;
    args.checks = c->checks;
    args.in_order = !slots_by_island(&c->partition);
    args.relax = relax;
    cuda_kernel kernel =
        c->fast ? (c->view.bodies.rigid ? bodies_kernel<false, true, true> : bodies_kernel<false, false, true>)
        : c->view.bodies.rigid ? (join ? bodies_kernel<true, true, false> : bodies_kernel<false, true, false>)
                               : (join ? bodies_kernel<true, false, false> : bodies_kernel<false, false, false>);
    const int64_t blocks = (HALVES * (int64_t)c->view.model.bodies + BODY_THREADS - 1) / BODY_THREADS;
    return launch_sweep(c, kernel, "update_velocity", blocks, BODY_THREADS, follows, &args, error);
}

static int64_t pair_blocks(const cuda_view *v)
{
    return blocks_for((int64_t)v->contacts.lanes * v->contacts.pair_capacity);
}

template <int LANES_A_PAIR, int COUNT> static cuda_kernel sweep_kernel(bool measure, bool fast)
{
    return fast ? (measure ? constraints_kernel<LANES_A_PAIR, COUNT, true, true>
                           : constraints_kernel<LANES_A_PAIR, COUNT, false, true>)
                : (measure ? constraints_kernel<LANES_A_PAIR, COUNT, true, false>
                           : constraints_kernel<LANES_A_PAIR, COUNT, false, false>);
}

static sadmm_status launch_constraints(struct sadmm_context *c, bool measure, int relax, bool follows,
                                       struct sadmm_error *error)
{
    cuda_args args = {};
    args.relax = relax;
    args.checks = c->checks;
    args.backward = c->backward;
    c->backward = !c->backward;
    cuda_kernel kernel = c->view.contacts.lanes == 1      ? sweep_kernel<1, 1>(measure, c->fast)
                         : c->statistics.point_slots <= 4 ? sweep_kernel<4, 1>(measure, c->fast)
                                                          : sweep_kernel<4, 2>(measure, c->fast);
    TRY(launch_sweep(c, kernel, "update_constraints", pair_blocks(&c->view), THREADS, follows, &args, error));
    kernel = measure ? (c->fast ? rows_kernel<true, true> : rows_kernel<true, false>)
                     : (c->fast ? rows_kernel<false, true> : rows_kernel<false, false>);
    return CUDA(launch)(c, kernel, "update_constraints (rows)", blocks_for(c->view.rows.count), &args, error);
}

sadmm_status CUDA(clear_primal)(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    if (!measure) return SADMM_OK;
    if (!c->plan.residuals && c->view.contacts.pair_capacity + c->view.rows.count > 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "measure = true: the plan has residuals = false");
    return CUDA(clear)(c, SCALAR_PRIMAL, error);
}

/* Everything the kernels take for granted: where records go, J^T lambda^0 at the start. */
static sadmm_status prepare_stepwise(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_view *v = &c->view;
    cuda_args args = {};
    if (!c->placed)
        TRY(CUDA(launch)(c, place_kernel, "place_records",
                         blocks_for(2 * ((int64_t)v->contacts.pair_capacity + v->rows.count)), &args, error));
    c->placed = true;
    if (!c->starting) return SADMM_OK;
    c->starting = false;
    TRY(CUDA(launch)(c, v->contacts.lanes == 1 ? start_kernel<1> : start_kernel<4>, "start_records",
                     pair_blocks(v), &args, error));
    return CUDA(launch)(c, start_rows_kernel, "start_records (rows)", blocks_for(v->rows.count), &args, error);
}

static sadmm_status refuse_fast(const struct sadmm_context *c, struct sadmm_error *error)
{
    if (!c->fast) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "method = fast: its iterations are not taken step by step");
}

extern "C" sadmm_status CUDA(update_velocity)(struct sadmm_context *c, struct sadmm_error *error)
{
    TRY(refuse_fast(c, error));
    CUDA_ENTER(c);
    TRY(prepare_stepwise(c, error));
    TRY(launch_bodies(c, c->measured, 0, false, error));
    c->measured = false;
    c->rescaled = false;
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(update_constraints)(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    TRY(refuse_fast(c, error));
    CUDA_ENTER(c);
    TRY(prepare_stepwise(c, error));
    TRY(CUDA(clear_primal)(c, measure, error));
    TRY(launch_constraints(c, measure, 0, false, error));
    c->measured = measure;
    return SADMM_OK;
}

/* ---- fused: STREAM -------------------------------------------------------------------------------------------- */

/* fast: Steps 2-4 first, and relaxed as iteration i of `count` is. */
static sadmm_status fast_iteration(struct sadmm_context *c, int i, int count, bool measure, bool follows,
                                   struct sadmm_error *error)
{
    const int multipliers = relax_constraints(i, count) ? RELAX_MULTIPLIERS : 0;
    TRY(launch_constraints(c, measure, multipliers, follows, error));
    TRY(launch_bodies(c, false, multipliers | (relax_velocity(i, count, c->step1_done) ? RELAX_VELOCITY : 0), true,
                      error));
    c->step1_done = true;
    return SADMM_OK;
}

/* The paper's: Step 1 first. */
static sadmm_status paper_iteration(struct sadmm_context *c, bool join, bool measure, bool follows,
                                    struct sadmm_error *error)
{
    TRY(launch_bodies(c, join, 0, follows, error));
    return launch_constraints(c, measure, 0, true, error);
}

/* Iterations of which nothing is special: fast, relaxed ones. */
static sadmm_status plain_iterations(struct sadmm_context *c, int count, bool follows, struct sadmm_error *error)
{
    for (int i = 0; i < count; ++i, follows = true) {
        if (c->fast) TRY(fast_iteration(c, i, count + 1, false, follows, error));
        else TRY(paper_iteration(c, false, false, follows, error));
    }
    return SADMM_OK;
}

/* Record GRAPH_ITERATIONS plain iterations. A graph of an earlier step has the same nodes: only arguments change. */
static sadmm_status make_graph(struct sadmm_context *c, struct sadmm_error *error)
{
    cudaGraph_t graph = nullptr;
    CUDA_CALL(c, cudaStreamBeginCapture(c->stream, cudaStreamCaptureModeThreadLocal), "cudaStreamBeginCapture");
    sadmm_status status = plain_iterations(c, GRAPH_ITERATIONS, false, error);
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

sadmm_status CUDA(parting_iteration)(struct sadmm_context *c, struct sadmm_error *error)
{
    TRY(prepare_stepwise(c, error));
    TRY(launch_constraints(c, false, RELAX_MULTIPLIERS | RELAX_WARM, false, error));
    TRY(launch_bodies(c, false, RELAX_MULTIPLIERS | (c->step1_done ? RELAX_VELOCITY : 0) | RELAX_WARM, true, error));
    c->step1_done = true;
    return SADMM_OK;
}

sadmm_status CUDA(stream_iterations)(struct sadmm_context *c, int count, bool measure, bool goes_on,
                                     struct sadmm_error *error)
{
    bool follows = false;
    TRY(prepare_stepwise(c, error));
    if (c->measured) {
        TRY(paper_iteration(c, true, measure && count == 1, false, error));
        follows = true;
        --count;
    }
    if (c->fast && !c->step1_done && (count > 1 || goes_on)) {
        TRY(fast_iteration(c, 0, 2, false, false, error));
        follows = true;
        --count;
    }
    int plain = (measure || (c->fast && !goes_on)) && count > 0 ? count - 1 : count;
    if (plain >= GRAPH_ITERATIONS && !c->recording && !c->graph_valid) TRY(make_graph(c, error));
    for (; plain >= GRAPH_ITERATIONS && !c->recording; plain -= GRAPH_ITERATIONS, count -= GRAPH_ITERATIONS)
        CUDA_CALL(c, cudaGraphLaunch(c->graph, c->stream), "cudaGraphLaunch");
    TRY(plain_iterations(c, plain, follows, error));
    follows = follows || plain > 0;
    if (count > plain && c->fast) return fast_iteration(c, 0, 1, measure, follows, error);
    return count > plain ? paper_iteration(c, false, true, follows, error) : SADMM_OK;
}
