/* After the last iteration: momentum that no contact may change is restored (iterate/motions.h), and in the method
 * `fast` energies are limited (math/energy_limit.h). In double, from this precision's data; once a step, eight lanes a
 * body.
 *
 *   motions   of floating islands: which may be restored (beside the iterations, where these do not find out
 *             themselves what is anchored)
 *   candidate is there a body with more energy than its free motion has, or that rebounds? Else no anchored island
 *             does. Persistent kernels test that themselves, those of tier BLOCK see to the rest too
 *   limit     energies and work, sums over islands (weight/island_sums.h), the factor of each island's velocities: of
 *             anchored islands, if there is such a body; of floating ones in any case, and the rigid motion that
 *             restores their momentum. Whole steps apply both where they move bodies (step/move.h)
 *
 * paper: if there is such a body, islands with too much energy are counted, and left as they are; floating ones get
 * that motion in any case.
 */
#include <string.h>

#include "backend_cuda/device/double.h"
#include "iterate.h"
#include "motions.h"

#include "core/math/relax.h"

template <bool RIGID>
static __device__ __forceinline__ bool has_candidate(const cuda_view &v, const body_thread &t, bool rebounds)
{
    const body_view &bodies = v.bodies;
    const wide_row<RIGID> row = row_of_body<RIGID>(bodies, t);
    const bool speaks = t.live && t.lane == 0,
               warm = rebounds && speaks && v.islands.info[v.graph.label[t.body]].warm;
    const double free = speaks ? bodies.free_energy[t.body] : 0;
    pdl_wait(); /* of all that, iterations change velocities alone */
    const double velocity = t.live && t.lane < 6 ? (double)bodies.state[t.body * ROW + (size_t)t.lane] : 0;
    return is_candidate(rebounds, warm, speaks, free, velocity, row.b, row.a);
}

static __global__ void __launch_bounds__(BODY_THREADS)
    candidate_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const body_thread t = body_of_thread(v.model, v.graph);
    if (v.bodies.rigid ? has_candidate<true>(v, t, args.rebounds) : has_candidate<false>(v, t, args.rebounds))
        *v.islands.candidates = 1;
}

/* Worlds have rigid bodies; the others are of problems. By itself: the kernel comes by the other one, too. */
static __device__ __noinline__ double general_energies(const cuda_view &v, const body_thread &t, bool on)
{
    return energies_of_body<false>(v, t, on);
}
static __device__ __forceinline__ double energies_in_lanes(const cuda_view &v, const body_thread &t, bool on)
{
    return v.bodies.rigid ? energies_of_body<true>(v, t, on) : general_energies(v, t, on);
}

/* Anchored islands of bodies that are `on`. Every lane of the warp comes here. */
static __device__ __forceinline__ void limit_anchored(const cuda_view &v, const cuda_args &args, const body_thread &t,
                                                      bool on, double term)
{
    double total[TERMS];
    if (add_up_island<add_terms>(v.graph, v.islands, t, on, term, total) && t.lane == 0)
        limit_island(v.islands, &v.islands.info[v.graph.label[t.body]], total, args.rebounds, !args.paper);
}

static __global__ void __launch_bounds__(BODY_THREADS)
    motions_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait();
    pdl_trigger(v.model.bodies);
    if (!args.paper && !*v.islands.floating) return; /* paper does not ask */
    const body_thread t = body_of_thread(v.model, v.graph);
    find_motions(v, t, is_floating(v, t));
}

/* So many blocks have registers on a multiprocessor at once: large scenes run in waves of them. */
enum { ENERGY_LIMIT_BLOCKS = 10 };

static __global__ void __launch_bounds__(BODY_THREADS, ENERGY_LIMIT_BLOCKS)
    energy_limit_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const body_thread t = body_of_thread(v.model, v.graph); /* iterations do not change the layout */
    const int32_t label = t.live ? v.graph.label[t.body] : 0;
    pdl_wait();
    pdl_trigger(v.model.bodies);
    /* neither waits for the other */
    const bool floating = v.islands.motions && t.live && !v.islands.info[label].anchored;
    const bool candidates = *v.islands.candidates != 0, anchored = t.live && candidates && !floating;
    if (__ballot_sync((unsigned)ALL_LANES, floating || anchored) == 0) return;
    const bool energies = candidates || !args.paper;
    const double term = energies ? energies_in_lanes(v, t, floating || anchored) : 0;
    if (candidates) limit_anchored(v, args, t, anchored, term);
    if (v.islands.motions) restore_islands(v, t, floating, energies, term, args.rebounds, !args.paper);
}

static __global__ void slow_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait();
    pdl_trigger(v.model.bodies);
    const int32_t i = thread_index();
    if (i >= live_bodies(v.model)) return;
    solver_real *state = v.bodies.state + (size_t)i * ROW, velocity[6];
    end_velocity(v, i, velocity);
    for (int k = 0; k < 6; ++k) state[k] = velocity[k];
}

/* Islands that kinematic bodies push are left alone, as those with rows are. A thread a pair. */
static __global__ void kinematic_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait();
    pdl_trigger(v.model.bodies);
    const int32_t p = thread_index();
    if (p >= live_pairs(v.model)) return;
    const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
    if (sadmm_pair_gives_energy(&v.raw.system, pair))
        v.islands.info[v.graph.label[pair->body_a >= 0 ? pair->body_a : pair->body_b]].rows = 1;
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

static sadmm_status launch(struct sadmm_context *c, cuda_kernel kernel, const char *name, struct sadmm_error *error)
{
    cuda_args args = {};
    args.paper = !c->fast;
    args.rebounds = c->fast && energy_limit_tests_rebound(true, c->settings.iterations);
    return CUDA(launch_pdl)(c, kernel, name, body_blocks(c->view.model.bodies), BODY_THREADS, &args, error);
}

sadmm_status CUDA(enqueue_motions)(struct sadmm_context *c, struct sadmm_error *error)
{
    if (!c->view.islands.motions) return SADMM_OK;
    return launch(c, motions_kernel, "motions", error);
}

sadmm_status CUDA(enqueue_energy_limit)(struct sadmm_context *c, bool candidates, struct sadmm_error *error)
{
    if (!candidates) TRY(launch(c, candidate_kernel, "energies", error));
    return launch(c, energy_limit_kernel, "energy limit", error);
}

sadmm_status CUDA(enqueue_pushed)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    if (c->view.raw.system.kinematic_count == 0) return SADMM_OK;
    return CUDA(launch)(c, kinematic_kernel, "kinematic islands", blocks_for(c->view.contacts.pair_capacity), &args,
                        error);
}

/* ---- entries ----------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(limit_energy)(struct sadmm_context *c, int32_t *limited, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    TRY(CUDA(enqueue_pushed)(c, error));
    TRY(CUDA(enqueue_motions)(c, error));
    TRY(CUDA(enqueue_energy_limit)(c, false, error));
    TRY(CUDA(launch)(c, slow_kernel, "limit_energy", blocks_for(c->view.model.bodies), &args, error));
    TRY(CUDA(download)(c, c->view.islands.limited, sizeof *limited, error));
    memcpy(limited, c->buffers[PINNED_OUT].data, sizeof *limited);
    if (c->fast) c->exact_since = RELAX_RESIDUAL_PERIOD; /* residuals are recomputed, should anything follow */
    return SADMM_OK;
}
