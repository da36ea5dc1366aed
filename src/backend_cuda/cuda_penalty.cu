/* Kernels E-H and P: C_i (14), beta_i (13), (15), and H = (A_i + beta_i C_i)^-1. In double: they run a few times
 * a step, and H only preconditions (the fixed point of Step 1 does not depend on it). */
#include "cuda_body.h"
#include "cuda_step_check.h"

#include "../core/math/weight.h"

/* ---- weights of the method `fast` -------------------------------------------------------------------------------- */

/* The contacts of tall islands close small gaps slowly. */
static __device__ void ease_gaps(const cuda_view &v, int32_t p, int32_t count, double tallness)
{
    const double slop = v.settings.slop / v.settings.dt, share = weight_gap_share(tallness);
    for (int32_t k = 0; k < count && share < 1; ++k) {
        solver_real *error = &v.arm[point_slot(v, p, k)].w;
        *error = (solver_real)weight_gap_error((double)*error, share, slop);
    }
}

/* B of a pair. Both of its halves work it out; the one at its first dynamic body keeps it. */
static __device__ __forceinline__ double weigh_pair(const cuda_view &v, int32_t p, int side,
                                                    const struct sadmm_contact_pair *pair, const cuda_island *island,
                                                    bool first)
{
    const double scale = island->scale,
                 taken = scale > 0 ? v.weight[p]
                                   : weight_of_pair(island->level, weight_mass(v.load[p], island->speed, island->mass),
                                                    v.response[p]),
                 B = scale > 0 ? taken * scale : taken;
    if (side && pair->body_a >= 0) return B;
    v.inv_s[p] = (solver_real)(pair->body_a >= 0 && pair->body_b >= 0 ? B / 2 : B);
    if (!(scale > 0)) v.weight[p] = taken;
    /* World level: gaps, a slop and a step. More points than the step was planned for halt it, but not before this. */
    if (first && v.rigid)
        ease_gaps(v, p, pair->count <= v.point_slots ? pair->count : v.point_slots, island->tallness);
    return B;
}

/* ---- C ------------------------------------------------------------------------------------------------------------- */

static __device__ void add_pair(const cuda_view &v, const struct sadmm_contact_pair *pair, int side, double weight,
                                arm_sums *sums, double C[PACKED])
{
    const int32_t count = pair->count;
    const struct sadmm_contact_point *points = v.raw_points + pair->first;
    for (int32_t first = 0; first < count; first += POINTS_AT_ONCE) {
        double arms[POINTS_AT_ONCE][3] = {};
#pragma unroll
        for (int32_t j = 0; j < POINTS_AT_ONCE; ++j) {
            const double *r = side ? points[first + j].arm_b : points[first + j].arm_a;
            for (int i = 0; i < 3 && first + j < count; ++i) arms[j][i] = r[i];
        }
#pragma unroll
        for (int32_t j = 0; j < POINTS_AT_ONCE; ++j) {
            if (first + j >= count) continue;
            if (v.contact_rows == 3) {
                add_arm(sums, arms[j], weight);
            } else {
                double row[6];
                sadmm_contact_row(v3_load(pair->normal), arms[j], 1, row);
                packed_add_row(C, row, weight);
            }
        }
    }
}

template <bool WEIGHTED> static __device__ void add_block(const cuda_view &v, int32_t k, int side, double C[PACKED])
{
    const struct sadmm_problem_block *block = &v.raw.blocks[k];
    const double *J = side ? block->jacobian_b : block->jacobian_a;
    double along[6] = {};
    for (int32_t r = 0; r < block->rows; ++r) {
        double row[6];
        for (int j = 0; j < 6; ++j) row[j] = J[6 * r + j];
        packed_add_row(C, row, WEIGHTED ? row_number(v, ROW_WEIGHT + r, k) : 1);
        for (int j = 0; WEIGHTED && j < 6; ++j) along[j] += row_number(v, ROW_ALONG + r, k) * row[j];
    }
    if (WEIGHTED) packed_add_row(C, along, 1);
}

/* C_i, in all lanes: each adds up every eighth half. WEIGHTED: as the weights of the method `fast` have it, else with
 * B = 1; `first`: of a solve. Every lane of the warp comes here. */
template <bool WEIGHTED>
static __device__ __forceinline__ void penalty_matrix(const cuda_view &v, const body_thread &t, bool first,
                                                      double C[PACKED])
{
    arm_sums sums = {};
    const cuda_island *island = WEIGHTED && t.live ? &v.islands[v.label[t.body]] : nullptr;
    for (int k = 0; k < PACKED; ++k) C[k] = 0;
    for (int32_t at = t.begin + t.lane; at < t.end; at += LANES) {
        const int32_t record = v.incident[at] / 2, side = v.incident[at] & 1;
        if (record < v.pair_room) {
            const struct sadmm_contact_pair *pair = &v.raw_pairs[record];
            const double weight = WEIGHTED ? weigh_pair(v, record, side, pair, island, first) : 1;
            add_pair(v, pair, side, weight, &sums, C);
        } else {
            add_block<WEIGHTED>(v, record - v.pair_room, side, C);
        }
    }
    if (v.contact_rows == 1 || v.rows > 0) sum_lanes<PACKED>(C);
    sum_lanes<sizeof sums / sizeof(double)>(&sums.count);
    add_arm_sums(C, &sums);
}

/* (13). dt^2: c is given in the paper's time-scaled units. Without constraints beta does not matter. */
static __device__ __forceinline__ double penalty_of(const cuda_view &v, const solver_real *line, const double C[PACKED])
{
    const struct sadmm_settings *s = &v.settings;
    double trace_A = 0, trace_C = C[0] + C[2] + C[5] + C[9] + C[14] + C[20];
#pragma unroll
    for (int k = 0; k < 6; ++k) trace_A += (double)line_a(line, v.rigid, k, k);
    return trace_C > 0 ? s->penalty_mass_factor * trace_A / trace_C + s->penalty_offset * s->dt * s->dt : 1;
}

/* L of M = L L^T in place, packed, and 1 / L's diagonal; false: a pivot is lost to rounding. */
static __device__ __forceinline__ bool packed_cholesky(double M[PACKED], double inverse[6])
{
    bool ok = true;
#pragma unroll
    for (int j = 0; j < 6; ++j) {
        const int at = j * (j + 1) / 2;
        double d = M[at + j], whole = d;
#pragma unroll
        for (int k = 0; k < j; ++k) d -= M[at + k] * M[at + k];
        ok = ok && d > 4 * DBL_EPSILON * whole && d <= DBL_MAX;
        inverse[j] = 1 / sqrt(d);
        M[at + j] = d * inverse[j];
#pragma unroll
        for (int i = j + 1; i < 6; ++i) {
            const int row = i * (i + 1) / 2;
            double s = M[row + j];
#pragma unroll
            for (int k = 0; k < j; ++k) s -= M[row + k] * M[at + k];
            M[row + j] = s * inverse[j];
        }
    }
    return ok;
}

/* H = (A + beta C)^-1, a column a lane, and 1/beta. */
static __device__ __forceinline__ void factor_body(const cuda_view &v, size_t body, int32_t lane, double beta,
                                                   const double C[PACKED])
{
    solver_real *line = v.lines + body * (size_t)v.line, *H = line_h(line, v.rigid);
    double M[PACKED], diagonal[6], inverse[6], x[6];
#pragma unroll
    for (int r = 0; r < 6; ++r) {
#pragma unroll
        for (int k = 0; k <= r; ++k)
            M[r * (r + 1) / 2 + k] = (double)line_a(line, v.rigid, r, k) + beta * C[r * (r + 1) / 2 + k];
        diagonal[r] = M[r * (r + 1) / 2 + r];
    }
    const bool ok = packed_cholesky(M, inverse);
#pragma unroll
    for (int i = 0; i < 6; ++i) { /* L y = e_lane */
        double s = i == lane ? 1 : 0;
#pragma unroll
        for (int k = 0; k < i; ++k) s -= M[i * (i + 1) / 2 + k] * x[k];
        x[i] = s * inverse[i];
    }
#pragma unroll
    for (int i = 5; i >= 0; --i) { /* L^T x = y */
        double s = x[i];
#pragma unroll
        for (int k = i + 1; k < 6; ++k) s -= M[k * (k + 1) / 2 + i] * x[k];
        x[i] = s * inverse[i];
    }
#pragma unroll
    for (int i = 0; i < 6; ++i) {
        /* A rounded to f32 stays positive definite unless the problem is beyond f32: then keep the diagonal. */
        if (!ok) x[i] = i == lane ? 1 / diagonal[i] : 0;
        if (lane <= i) H[i * (i + 1) / 2 + lane] = (solver_real)x[i];
    }
    if (lane == 6)
        for (int k = PACKED; k < LINE_H; ++k) H[k] = 0;
    if (lane == 7) v.state[body * ROW + STATE_INV_BETA] = (solver_real)(1 / beta);
}

/* ---- kernels ----------------------------------------------------------------------------------------------------- */

/* PENALTY: C and beta; FACTOR: H from them. */
template <bool PENALTY, bool FACTOR, bool WEIGHTED>
static __global__ void __launch_bounds__(BODY_THREADS)
    penalty_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const body_thread t = body_of_thread(v);
    double C[PACKED], beta = 1;
    if (PENALTY) {
        penalty_matrix<WEIGHTED>(v, t, args.start, C);
        if (t.live) {
            if (!WEIGHTED) beta = penalty_of(v, v.lines + t.body * (size_t)v.line, C);
            if (t.lane == 0) v.beta[t.body] = beta;
#pragma unroll
            for (int k = 0; k < PACKED; ++k)
                if (k % LANES == t.lane) v.C[t.body * PACKED + (size_t)k] = C[k];
        }
    } else if (t.live) {
        beta = v.beta[t.body];
        for (int k = 0; k < PACKED; ++k) C[k] = v.C[t.body * PACKED + (size_t)k];
    }
    if (FACTOR && t.live) factor_body(v, t.body, t.lane, beta, C);
    if (args.planned) check_plan(v);
}

static __global__ void scale_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    int32_t i = thread_index();
    if (i >= live_bodies(v)) return;
    double ratio = args.factor;
    if (args.measure) /* by the residuals */
        ratio = sadmm_penalty_ratio(__longlong_as_double((long long)v.residual[0]),
                                    __longlong_as_double((long long)v.residual[1]), v.settings.penalty_ratio_limit);
    v.beta[i] *= ratio;
    if (i == 0) *v.ratio = ratio;
}

/* ---- entries --------------------------------------------------------------------------------------------------- */

static sadmm_status launch_bodies(struct sadmm_context *c, cuda_kernel kernel, const char *name, const cuda_args *args,
                                  struct sadmm_error *error)
{
    const int64_t blocks = body_blocks(c->view.bodies);
    return CUDA(launch_of)(c, kernel, name, args->planned && blocks == 0 ? 1 : blocks, BODY_THREADS, args, error);
}

extern "C" sadmm_status CUDA(init_penalty)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    c->starting = true;
    c->looks = 0;
    c->cleared = 0;
    c->placed = false;
    c->measured = false;
    c->rescaled = false;
    if (c->fast) return CUDA(enqueue_weights)(c, true, false, error);
    return launch_bodies(c, penalty_kernel<true, false, false>, "init_penalty", &args, error);
}

extern "C" sadmm_status CUDA(factorize)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    return launch_bodies(c, penalty_kernel<false, true, false>, "factorize", &args, error);
}

extern "C" sadmm_status CUDA(update_penalty)(struct sadmm_context *c, double ratio, struct sadmm_error *error)
{
    cuda_args args = {};
    args.factor = ratio;
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(launch)(c, scale_kernel, "update_penalty", blocks_for(c->view.bodies), &args, error));
    c->rescaled = true;
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_penalties)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    args.planned = true;
    c->starting = !c->fast;
    c->looks = 0;
    c->cleared = SCALAR_PRIMAL | SCALAR_DUAL | SCALAR_BARRIER; /* cuda_step_check.h */
    c->placed = c->measured = c->rescaled = false;
    if (c->fast) return CUDA(enqueue_weighted_penalties)(c, true, true, true, error);
    return launch_bodies(c, penalty_kernel<true, true, false>, "penalties", &args, error);
}

sadmm_status CUDA(enqueue_balance)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    args.measure = 1;
    CUDA_TRY(CUDA(launch)(c, scale_kernel, "update_penalty", blocks_for(c->view.bodies), &args, error));
    c->rescaled = true;
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_weighted_penalties)(struct sadmm_context *c, bool first, bool factor, bool planned,
                                              struct sadmm_error *error)
{
    cuda_args args = {};
    args.start = first;
    args.planned = planned;
    return launch_bodies(c, factor ? penalty_kernel<true, true, true> : penalty_kernel<true, false, true>, "penalties",
                         &args, error);
}
