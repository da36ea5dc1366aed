/* What a step gives back, in raw order and double: v and lambda, beta, the moved bodies (Q), contact wrenches (R). */
#include "backend_cuda/device/double.h"
#include "backend_cuda/device/body.h"
#include "touch.h"

/* ---- v and lambda ---------------------------------------------------------------------------------------------- */

/* out: velocities (bodies x 6), impulses (points x 3), multipliers (blocks x 6). One thread a body, pair or block. */
static __global__ void read_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    int32_t i = thread_index();
    double *impulses = v.raw.out + 6 * (size_t)v.model.bodies, *multipliers = impulses + 3 * (size_t)v.model.points;
    if (i < v.model.bodies) {
        if (i >= live_bodies(v.model)) return;
        double *out = v.raw.out + 6 * (size_t)i;
        for (int k = 0; k < 6; ++k) out[k] = (double)v.bodies.state[(size_t)i * ROW + (size_t)k];
        return;
    }
    i -= v.model.bodies;
    if (i < v.contacts.pair_capacity) {
        if (i >= live_pairs(v.model)) return;
        const struct sadmm_contact_pair *pair = &v.raw.pairs[i];
        for (int32_t k = 0; k < pair->count; ++k)
            v3_store(point_impulse(v.contacts, i, k), impulses + 3 * (size_t)(pair->first + k));
        return;
    }
    i -= v.contacts.pair_capacity;
    if (i < live_rows(v.model, v.rows))
        for (int r = 0; r < 6; ++r)
            multipliers[6 * (size_t)i + (size_t)r] = (double)v.rows.data[6 * (size_t)i + (size_t)r].lambda;
}

extern "C" sadmm_status CUDA(read_solution)(struct sadmm_context *c, struct sadmm_error *error)
{
    const struct sadmm_system *system = c->system;
    const cuda_view *v = &c->view;
    size_t n = (size_t)v->model.bodies, points = (size_t)c->plan.points, rows = (size_t)v->rows.count;
    cuda_args args = {};
    CUDA_ENTER(c);
    TRY(CUDA(launch)(c, read_kernel, "read_solution",
                     blocks_for((int64_t)v->model.bodies + v->contacts.pair_capacity + v->rows.count), &args,
                     error));
    TRY(CUDA(download)(c, v->raw.out, (6 * n + 3 * points + 6 * rows) * sizeof(double), error));
    const double *from = (const double *)c->buffers[PINNED_OUT].data;
    if (n > 0) memcpy(system->velocity, from, 6 * n * sizeof *from);
    from += 6 * n;
    for (size_t k = 0; k < points; ++k, from += 3) memcpy(system->contacts->points[k].impulse, from, 3 * sizeof *from);
    for (size_t k = 0; k < rows; ++k, from += 6) {
        const struct sadmm_row_constraint *constraint = &system->rows->constraints[k];
        memcpy(system->rows->lambda + constraint->first, from, (size_t)constraint->count * sizeof *from);
    }
    return SADMM_OK;
}

/* ---- beta ------------------------------------------------------------------------------------------------------ */

static __global__ void read_penalty_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    int32_t i = thread_index();
    if (i < live_bodies(v.model)) v.raw.out[i] = v.bodies.beta[i];
}

extern "C" sadmm_status CUDA(read_penalty)(struct sadmm_context *c, double *beta, struct sadmm_error *error)
{
    size_t bytes = (size_t)c->view.model.bodies * sizeof *beta;
    cuda_args args = {};
    CUDA_ENTER(c);
    TRY(CUDA(launch)(c, read_penalty_kernel, "read_penalty", blocks_for(c->view.model.bodies), &args, error));
    TRY(CUDA(download)(c, c->view.raw.out, bytes, error));
    if (bytes > 0) memcpy(beta, c->buffers[PINNED_OUT].data, bytes);
    return SADMM_OK;
}

/* ---- Q: which trapezoid corrections (math/trapezoid.h) bodies take, and moved bodies ----------------------------- */

/* Eight lanes a body, then v.contacts.lanes a pair; bits are 0 before. */
static __global__ void touch_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t slot = thread_index() / LANES, lane = (int32_t)threadIdx.x % LANES,
                  sides = (v.model.bodies * LANES + THREADS - 1) / THREADS * THREADS;
    if (thread_index() >= sides) {
        const int32_t i = thread_index() - sides, p = i / v.contacts.lanes;
        if (p >= live_pairs(v.model)) return;
        const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
        add_ways<false>(v, fetch_ends(pair), pair->first, pair->count, i % v.contacts.lanes);
        if (v.raw.system.kinematic_count > 0 && i % v.contacts.lanes == 0 &&
            sadmm_pair_is_kinematic(&v.raw.system, pair))
            add_bits(&v.islands.touch[v.graph.label[pair->body_a >= 0 ? pair->body_a : pair->body_b]],
                     TOUCH_PENETRATES);
        return;
    }
    const body_thread t = body_of_slot(v.graph, slot, slot < live_bodies(v.model));
    const int32_t body = (int32_t)t.body;
    const trapezoid_speeds own = load_trapezoid_speeds<false>(v, body);
    touching_begun begun = begin_touching(v, t.begin + lane, t.end);
    if (begun.first.pair >= 0) fetch_impulses(v.contacts, begun.first, 0, &begun.points);
    const contact_sums sums = sum_touching<true>(v, own, &begun);
    if (t.live && lane == 0) add_touch(v.islands, body, v.graph.label[body], sums.touch);
}

enum { MOVED = PLACE + 1 }; /* and sadmm_rigid.mean */

static __global__ void integrate_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    int32_t i = thread_index();
    if (i >= live_bodies(v.model)) return;
    double *out = v.raw.out + MOVED * (size_t)i, velocity[6];
    const int island = args.count ? v.islands.touch[v.graph.label[i]] : 0, own = args.count ? v.islands.touch[i] : 0;
    for (int k = 0; k < 6; ++k) {
        velocity[k] = (double)v.bodies.state[(size_t)i * ROW + (size_t)k];
        if (v.raw.system.support_motion) velocity[k] += v.raw.system.support_motion[6 * (size_t)i + (size_t)k];
    }
    const enum trapezoid_kind kind = body_trapezoid_kind(&v.raw.system.rigid[i], island, own);
    move_body(&v.raw.system.rigid[i], halfway_of(v, i), velocity, v.model.settings->dt, v.model.settings->gravity, kind,
              out);
    out[PLACE] = body_moves_by_mean(&v.raw.system.rigid[i], kind);
}

extern "C" sadmm_status CUDA(integrate)(struct sadmm_context *c, struct sadmm_rigid *next, struct sadmm_error *error)
{
    size_t n = (size_t)c->view.model.bodies;
    cuda_args args = {};
    if (!c->plan.rigid)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "integrate: the system gives A and b, not rigid bodies");
    CUDA_ENTER(c);
    args.count = c->plan.momentum; /* there are contacts */
    if (c->plan.momentum) {
        CUDA_CALL(c, cudaMemsetAsync(c->view.islands.touch, 0, n * sizeof(int32_t), c->stream),
                  "cudaMemsetAsync(touch)");
        TRY(CUDA(launch)(c, touch_kernel, "touch",
                         blocks_for((int64_t)c->view.model.bodies * LANES) +
                             blocks_for((int64_t)c->view.contacts.lanes * c->view.contacts.pair_capacity),
                         &args, error));
    }
    TRY(CUDA(launch)(c, integrate_kernel, "integrate", blocks_for(c->view.model.bodies), &args, error));
    TRY(CUDA(download)(c, c->view.raw.out, MOVED * n * sizeof(double), error));
    const double *from = (const double *)c->buffers[PINNED_OUT].data;
    for (size_t i = 0; i < n; ++i, from += MOVED) {
        next[i] = c->system->rigid[i];
        memcpy(next[i].position, from, sizeof next[i].position);
        memcpy(next[i].orientation, from + 3, sizeof next[i].orientation);
        memcpy(next[i].velocity, from + 7, sizeof next[i].velocity);
        rolling_forget(&next[i]);
        next[i].was_hit = 0;
        next[i].mean = from[PLACE] != 0;
    }
    return SADMM_OK;
}

/* ---- R: (12) with lambda = -u, J^T lambda / dt summed over a body's contacts in their order --------------------- */

static __global__ void wrench_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t slot = thread_index() / LANES, lane = (int32_t)threadIdx.x % LANES;
    const body_thread t = body_of_slot(v.graph, slot, slot < live_bodies(v.model));
    const trapezoid_speeds none = {};
    touching_begun begun = begin_touching(v, t.begin + lane, t.end);
    if (begun.first.pair >= 0) fetch_impulses(v.contacts, begun.first, 0, &begun.points);
    const contact_sums sums = sum_touching<false>(v, none, &begun);
    if (t.live) store_wrench(sums.wrench, lane, v.raw.out + 6 * t.body);
}

extern "C" sadmm_status CUDA(recover_wrenches)(struct sadmm_context *c, double *wrench, struct sadmm_error *error)
{
    size_t bytes = 6 * (size_t)c->view.model.bodies * sizeof *wrench;
    cuda_args args = {};
    CUDA_ENTER(c);
    TRY(CUDA(launch)(c, wrench_kernel, "recover_wrenches", blocks_for((int64_t)c->view.model.bodies * LANES),
                     &args, error));
    TRY(CUDA(download)(c, c->view.raw.out, bytes, error));
    if (bytes > 0) memcpy(wrench, c->buffers[PINNED_OUT].data, bytes);
    return SADMM_OK;
}
