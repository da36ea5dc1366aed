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
    bool live = i < live_bodies(v), mine = live && r < 6;
    size_t at = live ? (size_t)v.body_of[i] : 0;
    body_lane body = load_body(live, r, v.lines + at * (size_t)v.line, v.rigid, v.b + at * ROW, v.state + at * ROW);
    real g = free_momentum(body);
    const real ratio = JOIN && args.rescaled ? (real)*v.ratio : (real)1;
    if (mine) {
        const int32_t slot = record_slot(r), end = v.offsets[i + 1];
#pragma unroll 4
        for (int32_t h = v.offsets[i]; h < end; ++h) {
            size_t from = (size_t)v.incident[h] * ROW + (size_t)slot;
            g += JOIN ? v.records[from] + ratio * v.change[from] : v.records[from];
        }
    }
    move_body(&body, g);
    if (mine) v.state[at * ROW + (size_t)r] = body.v;
}

/* What points of a pair add up to: force on b, torque on b and, against it, on a. */
struct pair_sum {
    vec3 force, torque_a, torque_b;
};

static __device__ __forceinline__ pair_sum sum_of(vec3 impulse, vec3 arm_a, vec3 arm_b)
{
    pair_sum sum = {impulse, fused_cross(arm_a, impulse), fused_cross(arm_b, impulse)};
    return sum;
}

static __device__ __forceinline__ void add_to(pair_sum *sum, const pair_sum &more)
{
    sum->force = v3_add(sum->force, more.force);
    sum->torque_a = v3_add(sum->torque_a, more.torque_a);
    sum->torque_b = v3_add(sum->torque_b, more.torque_b);
}

/* Of one iteration. */
struct pair_sums {
    pair_sum next, change;
    real largest;
};

static __device__ __forceinline__ void add_to(pair_sums *sums, const pair_sums &more)
{
    add_to(&sums->next, more.next);
    add_to(&sums->change, more.change);
    sums->largest = real_max(sums->largest, more.largest);
}

/* part(k) for each point k of a pair, added up in the order that cuda_internal.h sets. */
template <class Sum, class Part> static __device__ __forceinline__ Sum sum_points(int32_t count, Part part)
{
    Sum q[4] = {};
#pragma unroll
    for (int32_t j = 0; j < 4; ++j) {
        if (j < count) q[j] = part(j);
        if (j + 4 < count) add_to(&q[j], part(j + 4));
    }
    add_to(&q[0], q[1]);
    add_to(&q[2], q[3]);
    add_to(&q[0], q[2]);
    return q[0];
}

static __device__ __forceinline__ void store_record(solver_real *record, const pair_sum &sum)
{
    real4 *out = (real4 *)record;
    out[0] = pack(v3_neg(sum.force), 0);
    out[1] = pack(v3_neg(sum.torque_a), 0);
    out[2] = pack(sum.force, 0);
    out[3] = pack(sum.torque_b, 0);
}

/* Steps 2-4 of a pair, points in memory. */
template <int CONTACT_ROWS, bool MEASURE>
static __device__ __forceinline__ void sweep_pair(const cuda_view &v, int32_t p, double *primal)
{
    const real4 about = v.normal[p], between = v.difference[p];
    const vec3 normal = xyz(about), difference = xyz(between);
    const int2 bodies = v.pair_bodies[p];
    const body_motion a = load_motion(v.state + (size_t)bodies.x * ROW), b = load_motion(v.state + (size_t)bodies.y * ROW);
    const pair_sums sums = sum_points<pair_sums>(v.pair_count[p], [&](int32_t k) {
        size_t slot = (size_t)k * (size_t)v.pair_room + (size_t)p;
        real4 arm = v.arm[slot];
        vec3 arm_a = xyz(arm), arm_b = v3_add(arm_a, difference), old = load_lambda<CONTACT_ROWS>(v, slot);
        vec3 x = relative_velocity(a, arm_a, b, arm_b);
        vec3 lambda = update_point<CONTACT_ROWS>(normal, about.w, x, arm.w, between.w, old), delta = v3_sub(lambda, old);
        store_lambda<CONTACT_ROWS>(v, slot, lambda);
        pair_sums one = {};
        one.next = sum_of(impulse_of<CONTACT_ROWS>(normal, MEASURE ? lambda : v3_add(lambda, delta)), arm_a, arm_b);
        if (MEASURE) {
            one.change = sum_of(impulse_of<CONTACT_ROWS>(normal, delta), arm_a, arm_b);
            one.largest = largest_row<CONTACT_ROWS>(normal, delta);
        }
        return one;
    });
    store_record(v.records + (size_t)p * RECORD, sums.next);
    if (MEASURE) {
        store_record(v.change + (size_t)p * RECORD, sums.change);
        *primal = (double)(sums.largest * real_max(inv_beta_of(v, bodies.x), inv_beta_of(v, bodies.y)));
    }
}

static __device__ __forceinline__ void store_row_records(const cuda_view &v, int32_t k, int32_t rows,
                                                         const real lambda[6], solver_real *records)
{
    solver_real *record = records + ((size_t)v.pair_room + (size_t)k) * RECORD;
    for (int side = 0; side < 2; ++side) store_row_record(v, k, rows, side, lambda, record + side * ROW);
}

template <bool MEASURE>
static __device__ __forceinline__ void sweep_row_block(const cuda_view &v, int32_t k, double *primal)
{
    const row_about about = v.row_info[k];
    real lambda[6], delta[6];
    load_row_lambda(v, k, lambda);
    update_row_block(v, k, about, v.state + (size_t)about.body_a * ROW, v.state + (size_t)about.body_b * ROW, lambda,
                     delta);
    store_row_lambda(v, k, lambda);
    if (MEASURE) {
        store_row_records(v, k, about.rows, lambda, v.records);
        store_row_records(v, k, about.rows, delta, v.change);
        *primal = row_block_primal(v, about, delta);
    } else {
        for (int r = 0; r < 6; ++r) lambda[r] += delta[r];
        store_row_records(v, k, about.rows, lambda, v.records);
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
        sweep_row_block<MEASURE>(v, k, &primal);
    }
    if (MEASURE) reduce_max(primal, v.residual);
}

/* J^T lambda^0. */
template <int CONTACT_ROWS>
static __global__ void start_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t p = thread_index(), k = p - v.pair_room;
    if (p < live_pairs(v)) {
        vec3 normal = xyz(v.normal[p]), difference = xyz(v.difference[p]);
        store_record(v.records + (size_t)p * RECORD, sum_points<pair_sum>(v.pair_count[p], [&](int32_t j) {
            size_t slot = (size_t)j * (size_t)v.pair_room + (size_t)p;
            vec3 arm = xyz(v.arm[slot]), lambda = load_lambda<CONTACT_ROWS>(v, slot);
            return sum_of(impulse_of<CONTACT_ROWS>(normal, lambda), arm, v3_add(arm, difference));
        }));
    } else if (k >= 0 && k < live_rows(v)) {
        real lambda[6];
        load_row_lambda(v, k, lambda);
        store_row_records(v, k, v.row_info[k].rows, lambda, v.records);
    }
}

static __global__ void weigh_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t p = thread_index();
    if (p >= live_pairs(v)) return;
    int2 bodies = v.pair_bodies[p];
    v.difference[p].w = inverse_weight(v, bodies.x, bodies.y);
}

/* (17) as the momentum residual A v - b - J^T lambda. */
static __global__ void dual_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t i = thread_index() / LANES, r = (int32_t)threadIdx.x % LANES;
    double dual = 0;
    if (i < live_bodies(v) && r < 6) {
        size_t body = (size_t)v.body_of[i];
        const solver_real *line = v.lines + body * (size_t)v.line, *state = v.state + body * ROW;
        real g = -v.b[body * ROW + (size_t)r];
        for (int k = 0; k < 6; ++k) g += line_a(line, v.rigid, r, k) * state[k];
        for (int32_t at = v.offsets[i]; at < v.offsets[i + 1]; ++at)
            g -= v.records[(size_t)v.incident[at] * ROW + (size_t)record_slot(r)];
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
    args.rescaled = c->rescaled;
    return CUDA(launch)(c, join ? bodies_kernel<true> : bodies_kernel<false>, "update_velocity",
                        blocks_for((int64_t)c->view.bodies * LANES), &args, error);
}

static sadmm_status launch_constraints(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    cuda_args args = {};
    cuda_kernel kernel = c->view.contact_rows == 1
                             ? (measure ? constraints_kernel<1, true> : constraints_kernel<1, false>)
                             : (measure ? constraints_kernel<3, true> : constraints_kernel<3, false>);
    return CUDA(launch)(c, kernel, "update_constraints", constraint_blocks(c), &args, error);
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

sadmm_status CUDA(prepare_stepwise)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    if (c->starting) {
        CUDA_TRY(CUDA(launch)(c, c->view.contact_rows == 1 ? start_kernel<1> : start_kernel<3>, "start_records",
                              blocks_for((int64_t)c->view.pair_room + c->view.rows), &args, error));
        c->starting = false;
    }
    if (c->weighed) return SADMM_OK;
    c->weighed = true;
    return CUDA(launch)(c, weigh_kernel, "weigh_pairs", blocks_for(c->view.pair_room), &args, error);
}

extern "C" sadmm_status CUDA(update_velocity)(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(prepare_stepwise)(c, error));
    CUDA_TRY(launch_bodies(c, c->measured, error));
    c->measured = false;
    c->rescaled = false;
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(update_constraints)(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(prepare_stepwise)(c, error));
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
    CUDA_TRY(CUDA(prepare_stepwise)(c, error));
    if (c->measured) {
        CUDA_TRY(launch_bodies(c, true, error));
        CUDA_TRY(launch_constraints(c, measure && count == 1, error));
        --count;
    }
    int plain = measure && count > 0 ? count - 1 : count;
    if (plain >= GRAPH_ITERATIONS && !c->recording && !c->graph_valid) CUDA_TRY(make_graph(c, error));
    for (; plain >= GRAPH_ITERATIONS && !c->recording; plain -= GRAPH_ITERATIONS, count -= GRAPH_ITERATIONS)
        CUDA_CALL(c, cudaGraphLaunch(c->graph, c->stream), "cudaGraphLaunch");
    CUDA_TRY(plain_iterations(c, plain, error));
    if (count > plain) {
        CUDA_TRY(launch_bodies(c, false, error));
        CUDA_TRY(launch_constraints(c, true, error));
    }
    return SADMM_OK;
}

/* ---- fused: BLOCK, CLUSTER and GRID ---------------------------------------------------------------------------- */

static sadmm_status resident_iterations(struct sadmm_context *c, int count, bool measure, struct sadmm_error *error)
{
    const struct cuda_partition *partition = &c->partition;
    const char *name = nullptr;
    cuda_args args = {};
    args.count = count;
    args.measure = measure;
    args.join = c->measured;
    args.rescaled = c->rescaled;
    args.start = c->starting;
    args.most_bodies = partition->most_bodies;
    args.cluster = partition->cluster;
    cuda_kernel kernel = CUDA(resident_kernel)(c->view.contact_rows, c->facts.point_slots, partition->tier,
                                               partition->threads, measure || c->view.rows > 0, &name);
    if (partition->tier == SADMM_CUDA_TIER_GRID)
        CUDA_CALL(c, cudaMemsetAsync(c->view.barrier, 0, sizeof *c->view.barrier, c->stream),
                  "cudaMemsetAsync(barrier)");
    CUDA_TRY(CUDA(launch_partition)(c, kernel, name, partition, &args, error));
    c->starting = false;
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(iterate)(struct sadmm_context *c, int count, bool measure, struct sadmm_error *error)
{
    if (count <= 0) return SADMM_OK;
    CUDA_ENTER(c);
    CUDA_TRY(clear_primal(c, measure, error));
    CUDA_TRY(c->partition.tier == SADMM_CUDA_TIER_STREAM ? stream_iterations(c, count, measure, error)
                                               : resident_iterations(c, count, measure, error));
    c->measured = measure;
    c->rescaled = false;
    return SADMM_OK;
}

/* ---- residuals ------------------------------------------------------------------------------------------------ */

sadmm_status CUDA(enqueue_residuals)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_CALL(c, cudaMemsetAsync(c->view.residual + 1, 0, sizeof *c->view.residual, c->stream),
              "cudaMemsetAsync(residual)");
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
