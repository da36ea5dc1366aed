/* The method `fast`: the momentum residual of bodies, b - A v + J^T lambda: recomputed where it was updated by
 * changes for long (math/relax.h), and (17). In double, from this precision's data; eight lanes a body. The first of a
 * solve comes with the sums over islands (weight/weights.cu). */
#include "backend_cuda/weight/constraint.h"
#include "iterate.h"
#include "stop_rule.h"

/* b - A v + J^T lambda of a body, a component a lane. */
template <bool RIGID>
static __device__ __forceinline__ double momentum_residual_of(const body_view &bodies, const graph_view &graph,
                                                              const contact_view &contacts, const row_view &rows,
                                                              const body_thread &t)
{
    const wide_row<RIGID> row = row_of_body<RIGID>(bodies, t);
    enum { PUSH = 6, SUMS };
    double sums[SUMS] = {};
    for (int32_t at = t.begin + t.lane; at < t.end; at += LANES)
        add_side(contacts, rows, graph.incident[at], sums, &sums[PUSH]);
    sum_lanes<SUMS>(sums);
    return row.b + own_number(sums, t.lane) - product(row.velocity, row.a);
}

/* Of all bodies. KEEP: as their momentum residuals; else the largest number of all. */
template <bool KEEP>
static __global__ void __launch_bounds__(BODY_THREADS)
    momentum_residual_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    if (KEEP && all_stopped(v.islands, args.checks)) return;
    const body_thread t = body_of_thread(v.model, v.graph);
    const double r = v.bodies.rigid ? momentum_residual_of<true>(v.bodies, v.graph, v.contacts, v.rows, t)
                                    : momentum_residual_of<false>(v.bodies, v.graph, v.contacts, v.rows, t);
    if (!KEEP) reduce_max(fabs(r), v.iteration.residual + 1);
    else if (t.live) v.bodies.momentum_residual[t.body * ROW + (size_t)t.lane] = (solver_real)(t.lane < 6 ? r : 0);
}

static sadmm_status launch(struct sadmm_context *c, cuda_kernel kernel, const char *name, struct sadmm_error *error)
{
    cuda_args args = {};
    args.checks = c->checks;
    return CUDA(launch_of)(c, kernel, name, body_blocks(c->view.model.bodies), BODY_THREADS, &args, error);
}

sadmm_status CUDA(enqueue_momentum_residuals)(struct sadmm_context *c, struct sadmm_error *error)
{
    return launch(c, momentum_residual_kernel<true>, "momentum_residuals", error);
}

sadmm_status CUDA(enqueue_momentum_residual)(struct sadmm_context *c, struct sadmm_error *error)
{
    return launch(c, momentum_residual_kernel<false>, "momentum residual", error);
}
