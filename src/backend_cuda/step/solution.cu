/* What a step gives back, in raw order and double: v and lambda, beta, the moved bodies (Q), contact wrenches (R). */
#include "backend_cuda/device/double.h"
#include "backend_cuda/device/plan_check.h"
#include "backend_cuda/iterate/slow.h"
#include "backend_cuda/iterate/solution.h"
#include "world.h"

/* ---- v and lambda ---------------------------------------------------------------------------------------------- */

/* out: velocities (bodies x 6), impulses (points x 3), multipliers (blocks x 6). One thread a body, pair or block. */
static __global__ void read_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
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

/* ---- Q: what contacts say of leads (math/lead.h), and moved bodies ----------------------------------------------- */

/* A body of a pair: its velocity before the step and at its end, its lead, and lead_rest_speed. */
struct lead_side {
    double before[6], velocity[6], lead[6], rest;
};

static __device__ __forceinline__ void load_side(const cuda_view &v, int32_t body, bool whole_step, lead_side *side)
{
    const struct sadmm_rigid *rigid = &v.raw.system.rigid[body];
    solver_real velocity[6];
    if (whole_step) end_velocity(v, body, velocity);
    else
        for (int k = 0; k < 6; ++k) velocity[k] = v.bodies.state[(size_t)body * ROW + (size_t)k];
    for (int k = 0; k < 6; ++k) {
        side->before[k] = rigid->velocity[k];
        side->velocity[k] = (double)velocity[k];
    }
    side->rest = lead_rest_speed(v.model.settings->gravity, rigid->wrench, rigid->mass, v.model.settings->dt);
    lead_own(rigid->velocity, side->velocity, rigid_is_isotropic(v3_load(rigid->inertia)), side->lead);
}

/* Bits only come: one that is there already needs no more. */
static __device__ __forceinline__ void add_bits(int32_t *to, int bits)
{
    if (bits & ~*to) atomicOr(to, bits);
}

/* contacts.lanes threads a pair, every so manieth point each. `planned`: of a whole step. */
static __global__ void touch_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const int32_t lanes = v.contacts.lanes, p = thread_index() / lanes, lane = thread_index() % lanes;
    const double dt = v.model.settings->dt, slop = v.model.settings->slop;
    const bool on = p < live_pairs(v.model) && !(args.planned && !as_planned(v.model, v.step));
    const struct sadmm_contact_pair *pair = &v.raw.pairs[on ? p : 0];
    int32_t body[2] = {-1, -1}, first = 0, count = 0;
    double n[3] = {}, friction = 0;
    if (on) {
        body[0] = pair->body_a, body[1] = pair->body_b;
        first = pair->first, count = pair->count;
        friction = pair->friction;
        for (int k = 0; k < 3; ++k) n[k] = pair->normal[k];
    }
    wait_for_stream();
    let_next_begin();
    if (!on) return;
    lead_side sides[2] = {};
    struct lead_touch touch = {
        body[0] >= 0 && body[1] >= 0 ? TOUCH_INNER : friction > 0 ? TOUCH_FRICTION : TOUCH_SMOOTH, {0, 0}};
#pragma unroll
    for (int s = 0; s < 2; ++s)
        if (body[s] >= 0) load_side(v, body[s], args.planned, &sides[s]);
    const double rest[2] = {sides[0].rest, sides[1].rest};
    for (int32_t k = lane; k < count; k += lanes) {
        const struct sadmm_contact_point *point = &v.raw.points[first + k];
        double impulse[3];
        v3_store(point_impulse(v.contacts, p, k), impulse);
        const double leads[2] = {-lead_along(n, sides[0].lead, point->arm_a),
                                 lead_along(n, sides[1].lead, point->arm_b)},
                     speed = lead_along(n, sides[1].velocity, point->arm_b) -
                             lead_along(n, sides[0].velocity, point->arm_a);
        const double size[2] = {lead_size(sides[0].lead, point->arm_a), lead_size(sides[1].lead, point->arm_b)},
                     moves[2] = {lead_speed(sides[0].before, sides[0].velocity, point->arm_a),
                                 lead_speed(sides[1].before, sides[1].velocity, point->arm_b)};
        lead_add_point(&touch, point->gap, dot3(n, impulse), speed, leads, size, moves, rest, dt, slop);
    }
#pragma unroll
    for (int s = 0; s < 2; ++s)
        if (body[s] >= 0) {
            add_bits(&v.islands.touch[v.graph.label[body[s]]], touch.island);
            if (touch.body[s]) add_bits(&v.islands.touch[body[s]], touch.body[s]);
        }
}

sadmm_status CUDA(launch_touch)(struct sadmm_context *c, bool whole_step, struct sadmm_error *error)
{
    cuda_args args = {};
    args.planned = whole_step;
    const int64_t threads = (int64_t)c->view.contacts.lanes * c->view.contacts.pair_capacity;
    return CUDA(launch_early)(c, touch_kernel, "touch", blocks_for(threads), THREADS, &args, error);
}

enum { MOVED = 13 }; /* position, orientation, velocity */

static __global__ void integrate_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    int32_t i = thread_index();
    if (i >= live_bodies(v.model)) return;
    double *out = v.raw.out + MOVED * (size_t)i;
    const int island = args.count ? v.islands.touch[v.graph.label[i]] : 0, own = args.count ? v.islands.touch[i] : 0;
    move_body(&v.raw.system.rigid[i], v.bodies.state + (size_t)i * ROW, v.model.settings->dt,
              v.model.settings->gravity, island, own, out, out + 3, out + 7);
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
        TRY(CUDA(launch_touch)(c, false, error));
    }
    TRY(CUDA(launch)(c, integrate_kernel, "integrate", blocks_for(c->view.model.bodies), &args, error));
    TRY(CUDA(download)(c, c->view.raw.out, MOVED * n * sizeof(double), error));
    const double *from = (const double *)c->buffers[PINNED_OUT].data;
    for (size_t i = 0; i < n; ++i, from += MOVED) {
        next[i] = c->system->rigid[i];
        memcpy(next[i].position, from, sizeof next[i].position);
        memcpy(next[i].orientation, from + 3, sizeof next[i].orientation);
        memcpy(next[i].velocity, from + 7, sizeof next[i].velocity);
    }
    return SADMM_OK;
}

/* ---- R: (12) with lambda = -u, J^T lambda / dt summed over a body's contacts in their order --------------------- */

static __global__ void wrench_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t slot = thread_index() / LANES, lane = (int32_t)threadIdx.x % LANES;
    bool live = slot < live_bodies(v.model);
    double wrench[6];
    contact_wrench(v.graph, v.contacts, v.raw, live ? v.graph.offsets[slot] : 0, live ? v.graph.offsets[slot + 1] : 0,
                   lane, 1 / v.model.settings->dt, wrench);
    if (live) store_wrench(wrench, lane, v.raw.out + 6 * (size_t)v.graph.body_of[slot]);
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
