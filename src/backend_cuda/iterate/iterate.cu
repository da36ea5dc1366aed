/* The fused iteration in any tier, and the residuals (16), (17). */
#include <string.h>

#include "backend_cuda/weight/weight.h"
#include "iterate.h"
#include "sweep.h"

#include "core/math/energy_limit.h"

/* ---- fused: BLOCK, CLUSTER and GRID ---------------------------------------------------------------------------- */

static sadmm_status persistent_iterations(struct sadmm_context *c, int count, enum cuda_energy_limit limit,
                                          bool goes_on, struct sadmm_error *error)
{
    const struct cuda_partition *partition = &c->partition;
    const char *name = nullptr;
    cuda_args args = CUDA(weight_args)(c); /* of a solve that begins with them */
    args.begin = c->prologue && !c->step1_done;
    args.count = count;
    args.join = c->measured;
    args.rescaled = c->rescaled;
    args.start = c->starting || args.begin;
    args.step1_done = c->step1_done;
    args.goes_on = goes_on;
    args.energy_limit = limit;
    args.rebounds = energy_limit_tests_rebound(true, c->settings.iterations);
    args.checks = c->checks;
    args.most_bodies = partition->most_bodies;
    args.cluster = partition->cluster;
    cuda_kernel kernel = CUDA(persistent_kernel)(c->statistics.point_slots, partition->tier, partition->threads,
                                                 c->view.rows.count > 0, c->fast, &name);
    if (partition->tier == SADMM_CUDA_TIER_GRID) TRY(CUDA(clear)(c, SCALAR_BARRIER, error));
    TRY(CUDA(launch_partition)(c, kernel, name, partition, &args, error));
    c->starting = false;
    c->step1_done = true;
    return SADMM_OK;
}

/* The measured iteration, a batch's last one, is made by the stepwise kernels, to the same bits: to measure takes
 * registers that the persistent kernel needs for iterations. */
static sadmm_status measured_batch(struct sadmm_context *c, int count, struct sadmm_error *error)
{
    if (count > 1) {
        TRY(persistent_iterations(c, count - 1, LIMIT_NONE, true, error));
        c->measured = c->rescaled = false; /* joined */
    }
    return CUDA(stream_iterations)(c, 1, true, false, error);
}

/* Up to `count` iterations, the last ones of the batch unless it goes on. */
static sadmm_status iterations_of_tier(struct sadmm_context *c, int count, bool measure, enum cuda_energy_limit limit,
                                       bool goes_on, struct sadmm_error *error)
{
    if (c->partition.tier == SADMM_CUDA_TIER_STREAM) return CUDA(stream_iterations)(c, count, measure, goes_on, error);
    return measure ? measured_batch(c, count, error) : persistent_iterations(c, count, limit, goes_on, error);
}

sadmm_status CUDA(enqueue_iterations)(struct sadmm_context *c, int count, bool goes_on, bool measure,
                                      enum cuda_energy_limit limit, struct sadmm_error *error)
{
    TRY(CUDA(clear_primal)(c, measure, error));
    const bool parts = c->fast && goes_on;
    while (count > 0) {
        if (c->fast && c->exact_since == RELAX_RESIDUAL_PERIOD) {
            TRY(CUDA(enqueue_momentum_residuals)(c, error));
            c->exact_since = 0;
        }
        const int left = c->fast ? RELAX_RESIDUAL_PERIOD - c->exact_since : count, now = count < left ? count : left;
        const bool last = now == count;
        const int whole = parts && last ? now - 1 : now;
        if (whole > 0)
            TRY(iterations_of_tier(c, whole, measure && last, last ? limit : LIMIT_NONE, parts || !last, error));
        if (parts && last) TRY(CUDA(parting_iteration)(c, error));
        if (c->fast) c->exact_since += now;
        count -= now;
    }
    c->measured = measure && !c->fast;
    c->rescaled = false;
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(iterate)(struct sadmm_context *c, int count, bool goes_on, bool measure,
                                      struct sadmm_error *error)
{
    if (count <= 0) return SADMM_OK;
    CUDA_ENTER(c);
    return CUDA(enqueue_iterations)(c, count, goes_on, measure, LIMIT_NONE, error);
}

/* ---- residuals ------------------------------------------------------------------------------------------------ */

/* (17) as the momentum residual A v - b - J^T lambda. */
static __global__ void dual_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    int32_t i = (int32_t)(blockIdx.x * (unsigned)THREADS + threadIdx.x) / LANES, r = (int32_t)threadIdx.x % LANES;
    double dual = 0;
    if (i < live_bodies(v.model) && r < 6) {
        size_t body = (size_t)v.graph.body_of[i];
        const solver_real *line = v.bodies.lines + body * (size_t)v.bodies.line, *state = v.bodies.state + body * ROW;
        real g = -v.bodies.b[body * ROW + (size_t)r];
        for (int k = 0; k < 6; ++k) g += line_a(line, v.bodies.rigid, r, k) * state[k];
        for (int32_t at = v.graph.offsets[i]; at < v.graph.offsets[i + 1]; ++at)
            g -= v.iteration.records[(size_t)at * ROW + (size_t)record_slot(r)];
        dual = fabs((double)g);
    }
    reduce_max(dual, v.iteration.residual + 1);
}

sadmm_status CUDA(enqueue_residuals)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    TRY(CUDA(clear)(c, SCALAR_DUAL, error));
    if (c->fast) return CUDA(enqueue_momentum_residual)(c, error);
    return CUDA(launch)(c, dual_kernel, "measure_residuals", blocks_for((int64_t)c->view.model.bodies * LANES), &args,
                        error);
}

extern "C" sadmm_status CUDA(measure_residuals)(struct sadmm_context *c, struct sadmm_residual *residual,
                                                struct sadmm_error *error)
{
    double both[2];
    CUDA_ENTER(c);
    TRY(CUDA(enqueue_residuals)(c, error));
    TRY(CUDA(download)(c, c->view.iteration.residual, sizeof both, error));
    memcpy(both, c->buffers[PINNED_OUT].data, sizeof both);
    residual->primal = both[0];
    residual->dual = both[1];
    return SADMM_OK;
}
