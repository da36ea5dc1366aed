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

/* How far a part of the iteration goes. */
template <bool FAST>
static __device__ __forceinline__ real relaxed(const model_view &model, const cuda_args &args, enum cuda_relax what)
{
    return FAST && args.relax & what ? (real)model.settings->relaxation : (real)1;
}

/* Step 1, a thread a body: all of a body's numbers lie side by side and are asked for at once, sixteen bytes at a time.
 * (Eight lanes a body, as in the persistent tiers, where latency counts, spend the time on instructions that load and
 * pass around single numbers.) What is read once leaves the caches to states and records. The sums are those of
 * free_momentum() and step_of(); FAST: of step_fast() and residual_after(), as far as args.relax says. */
template <bool JOIN, bool RIGID, bool FAST>
static __global__ void __launch_bounds__(BODY_THREADS)
    bodies_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    wait_if(all_early(v.model.bodies));
    enum { LINE = RIGID ? LINE_RIGID : LINE_GENERAL };
    const unsigned block = args.backward ? gridDim.x - 1 - blockIdx.x : blockIdx.x;
    const int32_t i = (int32_t)(block * (unsigned)BODY_THREADS + threadIdx.x);
    if (i >= live_bodies(v.model) || (FAST && all_stopped(v.islands, args.checks))) return;
    const size_t at = args.in_order ? (size_t)i : (size_t)v.graph.body_of[i];
    if (FAST && island_stopped(v.graph, v.islands, args.checks, (int32_t)at)) return;
    const real ratio = JOIN && args.rescaled ? (real)*v.iteration.ratio : (real)1,
               relaxation_factor = relaxed<FAST>(v.model, args, RELAX_VELOCITY),
               multipliers = relaxed<FAST>(v.model, args, RELAX_MULTIPLIERS);
    real line[LINE], b[ROW], state[ROW], g[6], step[6];
    load_numbers_once<LINE / 4>(line, v.bodies.lines + at * LINE);
    load_numbers_once<ROW / 4>(b, (FAST ? v.bodies.momentum_residual : v.bodies.b) + at * ROW);
    load_numbers<ROW / 4>(state, v.bodies.state + at * ROW);
#pragma unroll
    for (int r = 0; r < 6; ++r) {
        g[r] = FAST ? (real)0 : b[r];
#pragma unroll
        for (int k = 0; k < 6 && !FAST; ++k) g[r] = fused(-line_a((const real *)line, RIGID, r, k), state[k], g[r]);
    }
    const int32_t end = v.graph.offsets[i + 1];
#pragma unroll 4
    for (int32_t h = v.graph.offsets[i]; h < end; ++h) {
        real record[ROW], change[ROW];
        load_numbers<ROW / 4>(record, v.iteration.records + (size_t)h * ROW);
        if (JOIN) load_numbers<ROW / 4>(change, v.iteration.change + (size_t)h * ROW);
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
        state[r] = FAST ? fused(relaxation_factor, step[r], before) : before + step[r];
        step[r] = state[r] - before;
    }
    store_numbers(v.bodies.state + at * ROW, state);
    if (FAST) {
#pragma unroll
        for (int r = 0; r < 6; ++r) {
            b[r] = fused(multipliers, g[r], b[r]);
#pragma unroll
            for (int k = 0; k < 6; ++k) b[r] = fused(-line_a((const real *)line, RIGID, r, k), step[k], b[r]);
        }
        store_numbers(v.bodies.momentum_residual + at * ROW, b);
    }
}

/* ---- kernels over constraints: blocks of threads for pairs, then blocks for row blocks --------------------------- */

/* The pair of thread t: work(pair, lane, live), in whole warps; lanes beyond the last pair come with that one, not
 * live. */
template <int LANES_A_PAIR, class Work>
static __device__ __forceinline__ void with_pair(const model_view &model, int32_t t, Work work)
{
    const int32_t pairs = live_pairs(model), p = t / LANES_A_PAIR;
    if (t / WARP * (WARP / LANES_A_PAIR) < pairs) work(p < pairs ? p : pairs - 1, t % LANES_A_PAIR, p < pairs);
}

/* FAST: as far as args.relax says. */
template <int LANES_A_PAIR, int COUNT, bool MEASURE, bool FAST>
static __global__ void __launch_bounds__(THREADS)
    constraints_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    wait_if(all_early(v.model.bodies));
    const int32_t t = thread_index(args);
    double primal = 0;
    if (FAST && all_stopped(v.islands, args.checks)) return;
    const real relaxation_factor = relaxed<FAST>(v.model, args, RELAX_MULTIPLIERS);
    with_pair<LANES_A_PAIR>(v.model, t, [&](int32_t p, int32_t lane, bool live) {
        const bool on = live && !(FAST && pair_stopped(v.model, v.graph, v.islands, args.checks, v.contacts.bodies[p]));
        primal = sweep_pair<LANES_A_PAIR, COUNT, MEASURE, FAST>(v.model, v.bodies, v.contacts, v.iteration, p, lane, on,
                                                                relaxation_factor);
    });
    if (MEASURE) reduce_max(primal, v.iteration.residual);
}

/* The same of constraints given by rows: a kernel of its own, whose registers pairs do not pay for. */
template <bool MEASURE, bool FAST>
static __global__ void __launch_bounds__(THREADS)
    rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    wait_if(all_early(v.model.bodies));
    const int32_t k = thread_index(args);
    double primal = 0;
    if (FAST && all_stopped(v.islands, args.checks)) return;
    if (k < live_rows(v.model, v.rows) &&
        !(FAST && rows_stopped(v.model, v.graph, v.islands, args.checks, v.rows.constraints[k])))
        primal = sweep_rows<MEASURE, FAST>(v.model, v.bodies, v.rows, v.iteration, k,
                                           relaxed<FAST>(v.model, args, RELAX_MULTIPLIERS));
    if (MEASURE) reduce_max(primal, v.iteration.residual);
}

/* J^T lambda^0. */
template <int LANES_A_PAIR>
static __global__ void start_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    wait_if(all_early(v.model.bodies));
    with_pair<LANES_A_PAIR>(v.model, thread_index(args), [&](int32_t p, int32_t lane, bool live) {
        start_pair<LANES_A_PAIR>(v.contacts, v.iteration, p, lane, live);
    });
}

static __global__ void start_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    wait_if(all_early(v.model.bodies));
    const int32_t k = thread_index(args);
    if (k < live_rows(v.model, v.rows)) start_rows(v.rows, v.iteration, k);
}

/* Where records go. */
static __global__ void place_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    wait_if(all_early(v.model.bodies));
    const int32_t at = thread_index(args), bodies = live_bodies(v.model);
    if (bodies == 0 || at >= v.graph.offsets[bodies]) return;
    const int32_t side = v.graph.incident[at], on_b = side & 1, k = side / 2 - v.contacts.pair_capacity;
    if (k < 0) *(on_b ? &v.contacts.bodies[side / 2].side_b : &v.contacts.bodies[side / 2].side_a) = at;
    else *(on_b ? &v.rows.constraints[k].side_b : &v.rows.constraints[k].side_a) = at;
}

/* ---- launches ------------------------------------------------------------------------------------------------- */

/* relax: of enum cuda_relax. */
static sadmm_status launch_bodies(struct sadmm_context *c, bool join, int relax, struct sadmm_error *error)
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
    const int64_t blocks = ((int64_t)c->view.model.bodies + BODY_THREADS - 1) / BODY_THREADS;
    return CUDA(launch_of)(c, kernel, "update_velocity", blocks, BODY_THREADS, &args, error);
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

static sadmm_status launch_constraints(struct sadmm_context *c, bool measure, int relax, struct sadmm_error *error)
{
    cuda_args args = {};
    args.relax = relax;
    args.checks = c->checks;
    args.backward = c->backward;
    c->backward = !c->backward;
    cuda_kernel kernel = c->view.contacts.lanes == 1      ? sweep_kernel<1, 1>(measure, c->fast)
                         : c->statistics.point_slots <= 4 ? sweep_kernel<4, 1>(measure, c->fast)
                                                          : sweep_kernel<4, 2>(measure, c->fast);
    TRY(CUDA(launch)(c, kernel, "update_constraints", pair_blocks(&c->view), &args, error));
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
    TRY(launch_bodies(c, c->measured, 0, error));
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
    TRY(launch_constraints(c, measure, 0, error));
    c->measured = measure;
    return SADMM_OK;
}

/* ---- fused: STREAM -------------------------------------------------------------------------------------------- */

/* fast: Steps 2-4 first, and relaxed as iteration i of `count` is. */
static sadmm_status fast_iteration(struct sadmm_context *c, int i, int count, bool measure, struct sadmm_error *error)
{
    const int multipliers = relax_constraints(i, count) ? RELAX_MULTIPLIERS : 0;
    TRY(launch_constraints(c, measure, multipliers, error));
    TRY(launch_bodies(c, false, multipliers | (relax_velocity(i, count, c->settled) ? RELAX_VELOCITY : 0), error));
    c->settled = true;
    return SADMM_OK;
}

/* Iterations of which nothing is special: fast, relaxed ones. */
static sadmm_status plain_iterations(struct sadmm_context *c, int count, struct sadmm_error *error)
{
    for (int i = 0; i < count; ++i) {
        if (c->fast) {
            TRY(fast_iteration(c, i, count + 1, false, error));
            continue;
        }
        TRY(launch_bodies(c, false, 0, error));
        TRY(launch_constraints(c, false, 0, error));
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

sadmm_status CUDA(stream_iterations)(struct sadmm_context *c, int count, bool measure, bool goes_on,
                                     struct sadmm_error *error)
{
    TRY(prepare_stepwise(c, error));
    if (c->measured) {
        TRY(launch_bodies(c, true, 0, error));
        TRY(launch_constraints(c, measure && count == 1, 0, error));
        --count;
    }
    if (c->fast && !c->settled && (count > 1 || goes_on)) {
        TRY(fast_iteration(c, 0, 2, false, error));
        --count;
    }
    int plain = (measure || (c->fast && !goes_on)) && count > 0 ? count - 1 : count;
    if (plain >= GRAPH_ITERATIONS && !c->recording && !c->graph_valid) TRY(make_graph(c, error));
    for (; plain >= GRAPH_ITERATIONS && !c->recording; plain -= GRAPH_ITERATIONS, count -= GRAPH_ITERATIONS)
        CUDA_CALL(c, cudaGraphLaunch(c->graph, c->stream), "cudaGraphLaunch");
    TRY(plain_iterations(c, plain, error));
    if (count > plain && c->fast) return fast_iteration(c, 0, 1, measure, error);
    if (count > plain) {
        TRY(launch_bodies(c, false, 0, error));
        TRY(launch_constraints(c, true, 0, error));
    }
    return SADMM_OK;
}
