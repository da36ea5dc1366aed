/* The method `fast`: what the momentum of bodies misses, b - A v + J^T lambda: taken anew where it was kept up by changes for
 * long (math/relax.h), and (17). In double, from this precision's data; eight lanes a body. The first of a solve comes with
 * the sums over islands (weight/weights.cu). */
#include "backend_cuda/weight/constraint.h"
#include "stop_rule.h"

/* b - A v + J^T lambda of a body, a component a lane. */
template <bool RIGID> static __device__ __forceinline__ double defect_of(const cuda_view &v, const body_thread &t)
{
    const wide_row<RIGID> row = row_of_body<RIGID>(v, t);
    enum { PUSH = 6, SUMS };
    double sums[SUMS] = {};
    for (int32_t at = t.begin + t.lane; at < t.end; at += LANES) add_half(v, v.incident[at], sums, &sums[PUSH]);
    sum_lanes<SUMS>(sums);
    return row.b + own_number(sums, t.lane) - product(row.velocity, row.a);
}

/* Of all bodies. KEEP: as their defects; else the largest number of all. */
template <bool KEEP>
static __global__ void __launch_bounds__(BODY_THREADS)
    defect_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    if (KEEP && all_stopped(v, args.looks)) return;
    const body_thread t = body_of_thread(v);
    const double r = v.rigid ? defect_of<true>(v, t) : defect_of<false>(v, t);
    if (!KEEP) reduce_max(fabs(r), v.residual + 1);
    else if (t.live) v.defect[t.body * ROW + (size_t)t.lane] = (solver_real)r;
}

static sadmm_status launch(struct sadmm_context *c, cuda_kernel kernel, const char *name, struct sadmm_error *error)
{
    cuda_args args = {};
    args.looks = c->looks;
    return CUDA(launch_of)(c, kernel, name, body_blocks(c->view.bodies), BODY_THREADS, &args, error);
}

sadmm_status CUDA(enqueue_defects)(struct sadmm_context *c, struct sadmm_error *error)
{
    return launch(c, defect_kernel<true>, "defects", error);
}

sadmm_status CUDA(enqueue_momentum_residual)(struct sadmm_context *c, struct sadmm_error *error)
{
    return launch(c, defect_kernel<false>, "momentum residual", error);
}
