/* The method `fast`: the limit of energies (math/limit.h). In double, from this precision's data; once a step, eight lanes a body.
 *
 *   suspect   is there a body with more energy than its free motion has, or that bounces? Else no island does. Resident
 *             kernels look themselves
 *   limit     nothing, unless there is one: energies and work, sums over islands (cuda_islands.h), the factor of each
 *             island's velocities. Whole steps apply it where they move bodies (cuda_step_kernels.cu)
 */
#include <string.h>

#include "cuda_constraint.h"
#include "cuda_islands.h"
#include "cuda_slow.h"

#include "../core/math/relax.h"

/* g = J^T lambda in the first six numbers of a body's eight lanes; what follows them as the caller likes. */
enum { WORK = 6, PUSH, SUMS };

/* Work of a pair's contacts that push apart. */
static __device__ double work_of(const cuda_view &v, int32_t p)
{
    const pair_data pair = load_pair(v, p);
    double work = 0;
    for (int32_t k = 0; k < pair.count; ++k) {
        const point_data point = load_point(v, p, k, pair);
        work += fmax(0.0, -point.error) * dot3(pair.normal, point.lambda);
    }
    return work;
}

static __global__ void __launch_bounds__(BODY_THREADS)
    suspect_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const body_thread t = body_of_thread(v);
    const body_row row = row_of_body(v, t);
    suspect_body(v, args.few, t.live && t.lane == 0, t.body, row.velocity, row.b, row.a);
}

/* Terms of a body: energy of v, of A^-1 b, of r = b + g - A v; work; v . b / 2. */
static __global__ void __launch_bounds__(BODY_THREADS)
    limit_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    if (!*v.suspects) return;
    const body_thread t = body_of_thread(v);
    double sums[SUMS] = {}, term[TERMS] = {}, total[TERMS];
    for (int32_t at = t.begin + t.lane; at < t.end; at += LANES) {
        const int32_t code = v.incident[at], p = code / 2;
        add_half(v, code, sums, &sums[PUSH]);
        if (p >= v.pair_room || (code & 1 && is_dynamic(v, v.ends[p].body_a))) continue; /* counted there */
        sums[WORK] += work_of(v, p);
    }
    sum_lanes<SUMS>(sums);
    const body_row row = row_of_body(v, t);
    const double momentum = product(row.velocity, row.a), r = row.b + own_number(sums, t.lane) - momentum;
    term[0] = dot_lanes(row.velocity, momentum) / 2;
    term[1] = t.live ? v.free_energy[t.body] : 0;
    term[2] = dot_lanes(r, product(r, row.a_inverse)) / 2;
    term[3] = sums[WORK];
    term[4] = dot_lanes(row.velocity, row.b) / 2;
    if (!add_up_island<add_terms>(v, t, own_number(term, t.lane), total) || t.lane != 0) return;
    const struct limit_energies energies = {total[0], total[1], total[2], total[3]};
    const double allowed = limit_factor(&energies),
                 factor = args.few ? fmin(allowed, limit_bounce_factor(&energies, total[4], SOLVER_EPSILON)) : allowed;
    v.islands[v.label[t.body]].slow_down = factor;
    if (factor != 1) atomicAdd(v.limited, 1);
}

static __global__ void slow_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    const int32_t i = thread_index();
    if (i >= live_bodies(v)) return;
    const solver_real factor = slow_down(v, i);
    solver_real *state = v.state + (size_t)i * ROW;
    for (int k = 0; factor != 1 && k < 6; ++k) state[k] *= factor;
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

static sadmm_status launch(struct sadmm_context *c, cuda_kernel kernel, const char *name, struct sadmm_error *error)
{
    cuda_args args = {};
    args.few = limit_few(c->plan.warm, c->settings.iterations);
    return CUDA(launch_of)(c, kernel, name, body_blocks(c->view.bodies), BODY_THREADS, &args, error);
}

sadmm_status CUDA(enqueue_limit)(struct sadmm_context *c, bool suspected, struct sadmm_error *error)
{
    if (!suspected) CUDA_TRY(launch(c, suspect_kernel, "energies", error));
    return launch(c, limit_kernel, "limit", error);
}

/* ---- entries ----------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(limit_velocity)(struct sadmm_context *c, int32_t *limited, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(enqueue_limit)(c, false, error));
    CUDA_TRY(CUDA(launch)(c, slow_kernel, "limit_velocity", blocks_for(c->view.bodies), &args, error));
    CUDA_TRY(CUDA(download)(c, c->view.limited, sizeof *limited, error));
    memcpy(limited, c->buffers[PINNED_OUT].data, sizeof *limited);
    if (*limited > 0) c->exact_since = RELAX_DEFECT_PERIOD; /* defects are taken anew, should anything follow */
    return SADMM_OK;
}
