/* After the last iteration: momentum that no contact may change is restored (iterate/motions.h), and in the method
 * `fast` energies are limited (math/limit.h). In double, from this precision's data; once a step, eight lanes a body.
 *
 *   suspect   is there a body with more energy than its free motion has, or that bounces? Else no island does, unless
 *             it is not held. Persistent kernels test that themselves, those of tier BLOCK see to the rest too
 *   limit     nothing, unless there is one: energies and work, sums over islands (weight/island_sums.h), the factor of
 *             each island's velocities, and the rigid motion of those that are not held. Whole steps apply both where
 *             they move bodies (step/kernels.cu)
 *
 * paper: islands with too much energy are counted, and left as they are; those that are not held get that motion alone.
 */
#include <string.h>

#include "backend_cuda/device/double.h"
#include "iterate.h"
#include "motions.h"

#include "core/math/relax.h"

template <bool RIGID>
static __device__ __forceinline__ bool suspect(const body_view &bodies, const body_thread &t, bool under_iterated)
{
    const wide_row<RIGID> row = row_of_body<RIGID>(bodies, t);
    const bool speaks = t.live && t.lane == 0;
    return suspect_body(under_iterated, speaks, speaks ? bodies.free_energy[t.body] : 0, row.velocity, row.b, row.a);
}

static __global__ void __launch_bounds__(BODY_THREADS)
    suspect_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    wait_for_stream();
    const body_thread t = body_of_thread(v.model, v.graph);
    if (v.bodies.rigid ? suspect<true>(v.bodies, t, args.under_iterated)
                       : suspect<false>(v.bodies, t, args.under_iterated))
        *v.islands.suspects = 1;
}

static __global__ void __launch_bounds__(BODY_THREADS)
    limit_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    wait_for_stream();
    const body_thread t = body_of_thread(v.model, v.graph);
    if (!*v.islands.suspects) {
        if (args.paper) restore_islands<false>(v, t, is_loose(v, t), false, false);
        return;
    }
    double total[TERMS];
    const double term = v.bodies.rigid ? energies_of_body<true, false>(v, t) : energies_of_body<false, false>(v, t);
    const bool loose = v.islands.motions && is_loose(v, t);
    if (add_up_island<add_terms>(v.graph, v.islands, t, term, total) && t.lane == 0 && !loose)
        limit_island(v.islands, &v.islands.info[v.graph.label[t.body]], total, args.under_iterated, !args.paper);
    if (v.islands.motions) restore_islands<true>(v, t, loose, args.under_iterated, !args.paper);
}

static __global__ void slow_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    const int32_t i = thread_index();
    if (i >= live_bodies(v.model)) return;
    solver_real *state = v.bodies.state + (size_t)i * ROW, velocity[6];
    end_velocity(v, i, velocity);
    for (int k = 0; k < 6; ++k) state[k] = velocity[k];
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

static sadmm_status launch(struct sadmm_context *c, cuda_kernel kernel, const char *name, struct sadmm_error *error)
{
    cuda_args args = {};
    args.paper = !c->fast;
    args.under_iterated = c->fast && limit_under_iterated(c->plan.warm, c->settings.iterations);
    return CUDA(launch_early)(c, kernel, name, body_blocks(c->view.model.bodies), BODY_THREADS, &args, error);
}

sadmm_status CUDA(enqueue_limit)(struct sadmm_context *c, bool suspected, struct sadmm_error *error)
{
    if (!suspected) TRY(launch(c, suspect_kernel, "energies", error));
    return launch(c, limit_kernel, "limit", error);
}

/* ---- entries ----------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(limit_velocity)(struct sadmm_context *c, int32_t *limited, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    TRY(CUDA(enqueue_limit)(c, false, error));
    TRY(CUDA(launch)(c, slow_kernel, "limit_velocity", blocks_for(c->view.model.bodies), &args, error));
    TRY(CUDA(download)(c, c->view.islands.limited, sizeof *limited, error));
    memcpy(limited, c->buffers[PINNED_OUT].data, sizeof *limited);
    if (c->fast) c->exact_since = RELAX_RESIDUAL_PERIOD; /* residuals are recomputed, should anything follow */
    return SADMM_OK;
}
