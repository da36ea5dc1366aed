/* What a step gives back, in raw order and double: v and lambda, beta, the moved bodies (Q), contact wrenches (R). */
#include "cuda_double.h"

/* Multiplier of a point as a world vector on b. */
static __device__ vec3 point_impulse(const cuda_view &v, int32_t p, int32_t k, vec3 normal)
{
    size_t slot = (size_t)k * (size_t)v.pair_room + (size_t)p;
    if (v.contact_rows == 1) return v3_scale(normal, (double)v.lambda_n[slot]);
    real4 lambda = v.lambda[slot];
    return v3((double)lambda.x, (double)lambda.y, (double)lambda.z);
}

static __device__ double row_multiplier(const cuda_view &v, int32_t k, int r)
{
    return (double)v.row_data[(size_t)(ROW_LAMBDA + r) * (size_t)v.row_stride + (size_t)k];
}

/* ---- v and lambda ---------------------------------------------------------------------------------------------- */

/* out: velocities (bodies x 6), impulses (points x 3), multipliers (blocks x 6). One thread a body, pair or block. */
static __global__ void read_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t i = thread_index();
    double *impulses = v.out + 6 * (size_t)v.bodies, *multipliers = impulses + 3 * (size_t)v.points;
    if (v.live->halt) return;
    if (i < v.bodies) {
        double *out = v.out + 6 * (size_t)v.body_of[i];
        for (int k = 0; k < 6; ++k) out[k] = (double)v.state[(size_t)i * ROW + (size_t)k];
        return;
    }
    i -= v.bodies;
    if (i < live_pairs(v)) {
        const struct sadmm_contact_pair *pair = &v.raw_pairs[i];
        vec3 normal = v3_load(pair->normal);
        for (int32_t k = 0; k < pair->count; ++k)
            v3_store(point_impulse(v, i, k, normal), impulses + 3 * (size_t)(pair->first + k));
        return;
    }
    i -= v.pair_room;
    if (i >= 0 && i < v.rows)
        for (int r = 0; r < 6; ++r) multipliers[6 * (size_t)i + (size_t)r] = row_multiplier(v, i, r);
}

extern "C" sadmm_status CUDA(read_solution)(struct sadmm_context *c, struct sadmm_error *error)
{
    const struct sadmm_system *system = c->system;
    const cuda_view *v = &c->view;
    size_t n = (size_t)v->bodies, points = (size_t)v->points, rows = (size_t)v->rows;
    cuda_args args = {};
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(launch)(c, read_kernel, "read_solution", blocks_for((int64_t)v->bodies + v->pair_room + v->rows), 0,
                          false, &args, error));
    CUDA_TRY(CUDA(download)(c, v->out, (6 * n + 3 * points + 6 * rows) * sizeof(double), error));
    const double *from = (const double *)c->buffers[PINNED_OUT].data;
    if (n > 0) memcpy(system->velocity, from, 6 * n * sizeof *from);
    from += 6 * n;
    for (size_t k = 0; k < points; ++k, from += 3) memcpy(system->contacts->points[k].impulse, from, 3 * sizeof *from);
    if (rows > 0) memcpy(system->block_lambda, from, 6 * rows * sizeof *from);
    return SADMM_OK;
}

/* ---- beta ------------------------------------------------------------------------------------------------------ */

static __global__ void read_penalty_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t i = thread_index();
    if (i < live_bodies(v)) v.out[v.body_of[i]] = v.beta[i];
}

extern "C" sadmm_status CUDA(read_penalty)(struct sadmm_context *c, double *beta, struct sadmm_error *error)
{
    size_t bytes = (size_t)c->view.bodies * sizeof *beta;
    cuda_args args = {};
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(launch)(c, read_penalty_kernel, "read_penalty", blocks_for(c->view.bodies), 0, false, &args, error));
    CUDA_TRY(CUDA(download)(c, c->view.out, bytes, error));
    if (bytes > 0) memcpy(beta, c->buffers[PINNED_OUT].data, bytes);
    return SADMM_OK;
}

/* ---- Q: semi-implicit Euler ------------------------------------------------------------------------------------ */

enum { MOVED = 13 }; /* position, orientation, velocity */

static __global__ void integrate_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t i = thread_index();
    if (i >= live_bodies(v)) return;
    const struct sadmm_rigid *body = &v.raw.rigid[v.body_of[i]];
    const solver_real *state = v.state + (size_t)i * ROW;
    double *out = v.out + MOVED * (size_t)v.body_of[i], dt = v.settings.dt;
    vec3 linear = v3((double)state[0], (double)state[1], (double)state[2]);
    vec3 angular = v3((double)state[3], (double)state[4], (double)state[5]);
    v3_store(rigid_move(v3_load(body->position), linear, dt), out);
    q_store(rigid_turn(q_load(body->orientation), angular, dt), out + 3);
    v3_store(linear, out + 7);
    v3_store(angular, out + 10);
}

extern "C" sadmm_status CUDA(integrate)(struct sadmm_context *c, struct sadmm_rigid *next, struct sadmm_error *error)
{
    size_t n = (size_t)c->view.bodies;
    cuda_args args = {};
    if (!c->plan.rigid)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "integrate: the system gives A and b, not rigid bodies");
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(launch)(c, integrate_kernel, "integrate", blocks_for(c->view.bodies), 0, false, &args, error));
    CUDA_TRY(CUDA(download)(c, c->view.out, MOVED * n * sizeof(double), error));
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

static __device__ void add_pair_wrench(const cuda_view &v, int32_t p, int side, double per_dt, double wrench[6])
{
    const struct sadmm_contact_pair *pair = &v.raw_pairs[p];
    vec3 normal = v3_load(pair->normal);
    for (int32_t k = 0; k < pair->count; ++k) {
        const struct sadmm_contact_point *point = &v.raw_points[pair->first + k];
        vec3 f = point_impulse(v, p, k, normal), m = v3_cross(v3_load(side ? point->arm_b : point->arm_a), f);
        double sign = side ? per_dt : -per_dt;
        wrench[0] += sign * f.x, wrench[1] += sign * f.y, wrench[2] += sign * f.z;
        wrench[3] += sign * m.x, wrench[4] += sign * m.y, wrench[5] += sign * m.z;
    }
}

static __global__ void wrench_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t i = thread_index();
    if (i >= live_bodies(v)) return;
    double wrench[6] = {0}, per_dt = 1 / v.settings.dt;
    for (int32_t at = v.offsets[i]; at < v.offsets[i + 1]; ++at) {
        int32_t record = v.incident[at] / 2, side = v.incident[at] & 1;
        if (record < v.pair_room) add_pair_wrench(v, record, side, per_dt, wrench); /* contacts given by geometry only */
    }
    double *out = v.out + 6 * (size_t)v.body_of[i];
    for (int k = 0; k < 6; ++k) out[k] = wrench[k];
}

extern "C" sadmm_status CUDA(recover_wrenches)(struct sadmm_context *c, double *wrench, struct sadmm_error *error)
{
    size_t bytes = 6 * (size_t)c->view.bodies * sizeof *wrench;
    cuda_args args = {};
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(launch)(c, wrench_kernel, "recover_wrenches", blocks_for(c->view.bodies), 0, false, &args, error));
    CUDA_TRY(CUDA(download)(c, c->view.out, bytes, error));
    if (bytes > 0) memcpy(wrench, c->buffers[PINNED_OUT].data, bytes);
    return SADMM_OK;
}
