/* The iteration, stepwise (kernels I-O) and as a graph of plain steps, and the residuals (16), (17). */
#include <string.h>

#include "cuda_sweep.h"

/* Iterations in the graph: enough to hide the launch of one graph behind the run of the one before. */
enum { GRAPH_ITERATIONS = 16 };

/* ---- kernels -------------------------------------------------------------------------------------------------- */

static __device__ __forceinline__ int32_t thread_index(void)
{
    return (int32_t)(blockIdx.x * (unsigned)THREADS + threadIdx.x);
}

/* Step 1: eight lanes a body. */
template <bool JOIN> static __global__ void bodies_kernel(const __grid_constant__ cuda_view v,
                                                          const __grid_constant__ cuda_args args)
{
    int32_t i = thread_index() / LANES, r = (int32_t)threadIdx.x % LANES;
    bool live = i < live_bodies(v);
    size_t body = live ? (size_t)i : 0;
    update_body<JOIN>(live, r, v.b + body * ROW, v.A + body * MATRIX, v.H + body * MATRIX, v.records, v.change,
                      args.ratio, v.incident, live ? v.offsets[body] : 0, live ? v.offsets[body + 1] : 0,
                      v.state + body * ROW);
}

/* Steps 2-4 of a pair, points in memory. */
template <int CONTACT_ROWS, bool MEASURE>
static __device__ __forceinline__ void sweep_pair(const cuda_view &v, int32_t p, double *primal)
{
    pair_data pair = load_pair(v, p);
    pair_motion motion = relative_motion(pair, v.state);
    pair_sums sums = no_sums();
    for (int32_t k = 0; k < pair.count; ++k) {
        size_t slot = (size_t)k * (size_t)v.pair_room + (size_t)p;
        real4 arm = v.arm[slot];
        vec3 old = load_lambda<CONTACT_ROWS>(v, slot);
        vec3 lambda = update_point<CONTACT_ROWS>(pair, motion, xyz(arm), arm.w, old);
        store_lambda<CONTACT_ROWS>(v, slot, lambda);
        add_point<CONTACT_ROWS, MEASURE>(pair, xyz(arm), lambda, old, &sums);
    }
    store_record(v.records + (size_t)p * RECORD, sums.next, pair.difference);
    if (MEASURE) {
        store_record(v.change + (size_t)p * RECORD, sums.change, pair.difference);
        *primal = (double)(sums.largest * motion.inv_beta);
    }
}

/* Blocks of threads for pairs, then blocks for row blocks. */
template <int CONTACT_ROWS, bool MEASURE>
static __global__ void constraints_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t pair_threads = (v.pair_room + THREADS - 1) / THREADS * THREADS, p = thread_index(), k = p - pair_threads;
    double primal = 0;
    if (k < 0) {
        if (p < live_pairs(v)) sweep_pair<CONTACT_ROWS, MEASURE>(v, p, &primal);
    } else if (k < live_rows(v)) {
        row_about about = v.row_info[k];
        size_t record = ((size_t)v.pair_room + (size_t)k) * RECORD;
        sweep_row_block<MEASURE>(v, k, about, v.state, about.body_a, about.body_b, v.records + record,
                                 MEASURE ? v.change + record : nullptr, &primal);
    }
    if (MEASURE) reduce_max(primal, v.residual);
}

/* J^T lambda^0. */
template <int CONTACT_ROWS>
static __global__ void start_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t p = thread_index();
    if (p < live_pairs(v)) {
        pair_data pair = load_pair(v, p);
        pair_sum sum = no_sum();
        for (int32_t k = 0; k < pair.count; ++k) {
            size_t slot = (size_t)k * (size_t)v.pair_room + (size_t)p;
            vec3 lambda = load_lambda<CONTACT_ROWS>(v, slot);
            add_to(&sum, xyz(v.arm[slot]), impulse_of<CONTACT_ROWS>(pair, lambda));
        }
        store_record(v.records + (size_t)p * RECORD, sum, pair.difference);
    } else if (p >= v.pair_room && p - v.pair_room < live_rows(v)) {
        int32_t k = p - v.pair_room;
        real lambda[6];
        for (int r = 0; r < 6; ++r) lambda[r] = row_value(v, ROW_LAMBDA + r, k);
        store_row_record(v, k, v.row_info[k].rows, lambda, v.records + (size_t)p * RECORD);
    }
}

static __global__ void weigh_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t p = thread_index();
    if (p >= live_pairs(v)) return;
    int2 bodies = v.pair_bodies[p];
    real s = v.state[(size_t)bodies.x * ROW + STATE_INV_BETA] + v.state[(size_t)bodies.y * ROW + STATE_INV_BETA];
    v.difference[p].w = s > 0 ? 1 / s : (real)0;
}

/* (17) as the momentum residual A v - b - J^T lambda. */
static __global__ void dual_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t i = thread_index() / LANES, r = (int32_t)threadIdx.x % LANES;
    double dual = 0;
    if (i < live_bodies(v) && r < 6) {
        size_t body = (size_t)i;
        const solver_real *A = v.A + body * MATRIX, *state = v.state + body * ROW;
        real g = -v.b[body * ROW + (size_t)r];
        for (int k = 0; k < 6; ++k) g += A[6 * k + r] * state[k];
        for (int32_t at = v.offsets[i]; at < v.offsets[i + 1]; ++at)
            g -= v.records[(size_t)v.incident[at] * ROW + (size_t)r];
        dual = fabs((double)g);
    }
    reduce_max(dual, v.residual + 1);
}

/* ---- launches ------------------------------------------------------------------------------------------------- */

static int64_t constraint_blocks(const struct sadmm_context *c)
{
    return blocks_for(c->view.pair_room) + blocks_for(c->view.rows);
}

static sadmm_status launch_bodies(struct sadmm_context *c, bool join, struct sadmm_error *error)
{
    cuda_args args = {};
    args.ratio = (solver_real)c->ratio;
    return CUDA(launch)(c, join ? bodies_kernel<true> : bodies_kernel<false>, "update_velocity",
                        blocks_for((int64_t)c->view.bodies * LANES), 0, false, &args, error);
}

static sadmm_status launch_constraints(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    cuda_args args = {};
    cuda_kernel kernel = c->view.contact_rows == 1
                             ? (measure ? constraints_kernel<1, true> : constraints_kernel<1, false>)
                             : (measure ? constraints_kernel<3, true> : constraints_kernel<3, false>);
    return CUDA(launch)(c, kernel, "update_constraints", constraint_blocks(c), 0, false, &args, error);
}

static sadmm_status clear_primal(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    if (!measure) return SADMM_OK;
    if (!c->view.change && c->view.pair_room + c->view.rows > 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "measure = true: the plan has residuals = false");
    CUDA_CALL(c, cudaMemsetAsync(c->view.residual, 0, sizeof *c->view.residual, c->stream),
              "cudaMemsetAsync(residual)");
    return SADMM_OK;
}

sadmm_status CUDA(start_records)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    c->measured = false;
    c->ratio = 1;
    return CUDA(launch)(c, c->view.contact_rows == 1 ? start_kernel<1> : start_kernel<3>, "start_records",
                        blocks_for((int64_t)c->view.pair_room + c->view.rows), 0, false, &args, error);
}

sadmm_status CUDA(weigh_pairs)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    return CUDA(launch)(c, weigh_kernel, "weigh_pairs", blocks_for(c->view.pair_room), 0, false, &args, error);
}

extern "C" sadmm_status CUDA(update_velocity)(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    CUDA_TRY(launch_bodies(c, c->measured, error));
    c->measured = false;
    c->ratio = 1;
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(update_constraints)(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    CUDA_TRY(clear_primal(c, measure, error));
    CUDA_TRY(launch_constraints(c, measure, error));
    c->measured = measure;
    return SADMM_OK;
}

/* ---- fused: STREAM -------------------------------------------------------------------------------------------- */

static sadmm_status plain_iterations(struct sadmm_context *c, int count, struct sadmm_error *error)
{
    for (int i = 0; i < count; ++i) {
        CUDA_TRY(launch_bodies(c, false, error));
        CUDA_TRY(launch_constraints(c, false, error));
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

static sadmm_status stream_iterations(struct sadmm_context *c, int count, bool measure, struct sadmm_error *error)
{
    if (c->measured) {
        CUDA_TRY(launch_bodies(c, true, error));
        CUDA_TRY(launch_constraints(c, measure && count == 1, error));
        --count;
    }
    int plain = measure && count > 0 ? count - 1 : count;
    if (plain >= GRAPH_ITERATIONS && !c->graph_valid) CUDA_TRY(make_graph(c, error));
    for (; plain >= GRAPH_ITERATIONS; plain -= GRAPH_ITERATIONS, count -= GRAPH_ITERATIONS)
        CUDA_CALL(c, cudaGraphLaunch(c->graph, c->stream), "cudaGraphLaunch");
    CUDA_TRY(plain_iterations(c, plain, error));
    if (count > plain) {
        CUDA_TRY(launch_bodies(c, false, error));
        CUDA_TRY(launch_constraints(c, true, error));
    }
    return SADMM_OK;
}

/* ---- fused: BLOCK and GRID ------------------------------------------------------------------------------------ */

static sadmm_status resident_iterations(struct sadmm_context *c, int count, bool measure, struct sadmm_error *error)
{
    cuda_args args = {};
    args.count = count;
    args.measure = measure;
    args.join = c->measured;
    args.ratio = (solver_real)c->ratio;
    bool grid = c->partition.tier == SADMM_CUDA_TIER_GRID;
    if (grid)
        CUDA_CALL(c, cudaMemsetAsync(c->view.barrier, 0, sizeof *c->view.barrier, c->stream),
                  "cudaMemsetAsync(barrier)");
    return CUDA(launch)(c, c->resident, c->resident_name, c->partition.parts, c->partition.shared, grid, &args, error);
}

extern "C" sadmm_status CUDA(iterate)(struct sadmm_context *c, int count, bool measure, struct sadmm_error *error)
{
    if (count <= 0) return SADMM_OK;
    CUDA_ENTER(c);
    CUDA_TRY(clear_primal(c, measure, error));
    CUDA_TRY(c->partition.tier == SADMM_CUDA_TIER_STREAM ? stream_iterations(c, count, measure, error)
                                               : resident_iterations(c, count, measure, error));
    c->measured = measure;
    c->ratio = 1;
    return SADMM_OK;
}

/* ---- residuals ------------------------------------------------------------------------------------------------ */

extern "C" sadmm_status CUDA(measure_residuals)(struct sadmm_context *c, struct sadmm_residual *residual,
                                                struct sadmm_error *error)
{
    cuda_args args = {};
    double both[2];
    CUDA_ENTER(c);
    CUDA_CALL(c, cudaMemsetAsync(c->view.residual + 1, 0, sizeof *c->view.residual, c->stream),
              "cudaMemsetAsync(residual)");
    CUDA_TRY(CUDA(launch)(c, dual_kernel, "measure_residuals", blocks_for((int64_t)c->view.bodies * LANES), 0, false,
                          &args, error));
    CUDA_TRY(CUDA(download)(c, c->view.residual, sizeof both, error));
    memcpy(both, c->buffers[PINNED_OUT].data, sizeof both);
    residual->primal = both[0];
    residual->dual = both[1];
    return SADMM_OK;
}
