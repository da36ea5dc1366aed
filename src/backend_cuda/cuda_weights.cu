/* The method `fast`: weights of the constraints (kernels E-G; math/weight.h) and levels of the islands. In double, from this
 * precision's data; a few times a step.
 *
 *   pairs    four threads a pair, or one: its load and, the first time, its response. Beside the layout in a whole step
 *   terms    eight lanes a body: its defect, what it adds to the sums over its island, the sums (cuda_islands.h), and what
 *            follows for the island. A pair counts at its first dynamic body
 *   rows     a thread a row block: B
 *   then C and H (cuda_penalty.cu), where each half of a pair works out B for itself
 */
#include "cuda_constraint.h"
#include "cuda_islands.h"

#include "../core/math/weight.h"

/* ---- pairs ------------------------------------------------------------------------------------------------------- */

/* x[k] of a pair's lanes added up, in all of them. Every lane of the warp comes here. */
template <int COUNT> static __device__ __forceinline__ void sum_pair(const cuda_view &v, double x[COUNT])
{
    for (int o = 1; o < v.lanes; o *= 2)
#pragma unroll
        for (int k = 0; k < COUNT; ++k) x[k] += __shfl_xor_sync((unsigned)ALL_LANES, x[k], o);
}

/* What one side of a pair's points, every v.lanes-th from `lane` on, adds to the sum of J A^-1 J^T over points and rows. */
static __device__ double side_response(const cuda_view &v, int32_t p, int32_t lane, const pair_data &pair, int32_t side,
                                       int32_t body)
{
    const double *inverse = v.A_inverse + (size_t)body * PACKED;
    struct arm_sums sums = {};
    double S[PACKED] = {};
    for (int32_t k = lane; k < pair.count; k += v.lanes) {
        const point_data point = load_point(v, p, k, pair);
        const double *r = side ? point.arm[1] : point.arm[0];
        if (v.contact_rows == 3) {
            add_arm(&sums, r, 1);
        } else {
            double row[6];
            normal_row(pair.normal, r, row);
            packed_add_row(S, row, 1);
        }
    }
    if (v.contact_rows == 3 && v.rigid) return packed_dot_arms(inverse, &sums);
    if (v.contact_rows == 3) add_arm_sums(S, &sums);
    return packed_dot(inverse, S);
}

/* FIRST: with the mean of J A^-1 J^T over a pair's points and rows, 1/kg. */
template <bool FIRST>
static __global__ void __launch_bounds__(BODY_THREADS)
    pairs_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    const int32_t t = (int32_t)(blockIdx.x * (unsigned)BODY_THREADS + threadIdx.x), p = t / v.lanes, lane = t % v.lanes;
    const bool live = p < live_pairs(v);
    double sum[2] = {}; /* |lambda|, response */
    pair_data pair = {};
    if (live) {
        pair = load_pair(v, p);
        for (int32_t k = lane; k < pair.count; k += v.lanes) {
            const point_data point = load_point(v, p, k, pair);
            sum[0] += sqrt(dot3(point.lambda, point.lambda));
        }
    }
    if (live && FIRST) {
        const pair_ends ends = v.ends[p];
        if (is_dynamic(v, ends.body_a)) sum[1] += side_response(v, p, lane, pair, 0, ends.body_a);
        if (is_dynamic(v, ends.body_b)) sum[1] += side_response(v, p, lane, pair, 1, ends.body_b);
    }
    sum_pair<FIRST ? 2 : 1>(v, sum);
    if (!live || lane != 0) return;
    v.load[p] = sum[0] / pair.count;
    if (FIRST) v.response[p] = sum[1] / (v.contact_rows * pair.count);
}

/* ---- terms and islands --------------------------------------------------------------------------------------------- */

/* What the contacts of a pair miss. */
static __device__ double violation_of(const cuda_view &v, int32_t p)
{
    const pair_data pair = load_pair(v, p);
    const pair_ends ends = v.ends[p];
    const int32_t bodies[2] = {ends.body_a, ends.body_b};
    double velocity[2][6], sum = 0;
    for (int side = 0; side < 2; ++side)
        for (int j = 0; j < 6; ++j) velocity[side][j] = (double)v.state[(size_t)bodies[side] * ROW + (size_t)j];
    for (int32_t k = 0; k < pair.count; ++k) {
        const point_data point = load_point(v, p, k, pair);
        double u[3];
        for (int j = 0; j < 3; ++j) u[j] = velocity[1][j] - velocity[0][j] + point.error * pair.normal[j];
        add_cross(velocity[1] + 3, point.arm[1], 1, u);
        add_cross(velocity[0] + 3, point.arm[0], -1, u);
        sum += contact_violation(point.lambda, u, pair.normal, v.contact_rows == 1 ? 0 : pair.friction, v.response[p]);
    }
    return sum;
}

/* What follows from the sums over an island. */
template <bool LEVELS> static __device__ void weigh_island(cuda_island *island, const double sum[TERMS], const cuda_args &args)
{
    const cuda_island fresh = {0, 0, 1, 0, 1, 1, 0, 0};
    if (args.start) *island = fresh;
    island->speed = weight_speed(sum[0], sum[1]);
    if (args.warm) {
        const double speed = island->speed;
        island->tallness = weight_tallness(speed, sum[3], sum[1]);
        island->speed = weight_speed_warm(speed, island->tallness, sum[2], sum[1]);
        island->speed = weight_speed_few(speed, island->speed, args.factor, sum[2], sum[1]);
    }
    island->mass = sum[1];
    if (!LEVELS || island->blocks) return;
    const double balance = weight_balance(sum[5], sum[4], sum[1]), level = weight_next_level(island->level, balance);
    /* those that stall keep the weights they have, times what the level has risen by since those were taken */
    island->scale = weight_stalls(balance) ? (island->scale > 0 ? island->scale : 1) * (level / island->level) : 0;
    island->level = level;
}

/* Terms of a body:   g . A^-1 g, mass, v . A v, push        with g = J^T lambda, push the sum of the forces' sizes
 *         LEVELS     also r . A^-1 r, what its pairs miss   with r = b + g - A v */
template <bool LEVELS>
static __global__ void __launch_bounds__(BODY_THREADS)
    terms_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    if (args.start && blockIdx.x == 0 && threadIdx.x == 0) {
        const cuda_stop none = {};
        *v.limited = *v.suspects = 0;
        *v.stop = none;
    }
    const body_thread t = body_of_thread(v);
    enum { PAIRS = 6, PUSH, SUMS };
    double sums[SUMS] = {}, term[TERMS] = {}, total[TERMS];
    for (int32_t at = t.begin + t.lane; at < t.end; at += LANES) {
        const int32_t code = v.incident[at], p = code / 2;
        add_half(v, code, sums, &sums[PUSH]);
        if (!LEVELS || p >= v.pair_room) continue;
        if (code & 1 && is_dynamic(v, v.ends[p].body_a)) continue; /* counted there */
        sums[PAIRS] += violation_of(v, p);
    }
    sum_lanes<SUMS>(sums);
    const body_row row = row_of_body(v, t);
    const double g = own_number(sums, t.lane), momentum = product(row.velocity, row.a);
    term[0] = dot_lanes(g, product(g, row.a_inverse));
    term[1] = t.live ? mass_of(v, t.body) : 0;
    term[2] = dot_lanes(row.velocity, momentum);
    term[3] = sums[PUSH];
    const double r = row.b + g - momentum;
    if (t.live) v.defect[t.body * ROW + (size_t)t.lane] = (solver_real)r;
    if (LEVELS) {
        term[4] = dot_lanes(r, product(r, row.a_inverse));
        term[5] = sums[PAIRS];
    }
    if (add_up_island<add_terms>(v, t, own_number(term, t.lane), total) && t.lane == 0)
        weigh_island<LEVELS>(&v.islands[v.label[t.body]], total, args);
}

/* ---- row blocks -------------------------------------------------------------------------------------------------- */

static __device__ void store_row(const cuda_view &v, int32_t plane, int32_t k, double value)
{
    v.row_data[(size_t)plane * (size_t)v.row_stride + (size_t)k] = (solver_real)value;
}

/* Of every row of a block, and what its multiplier counts for in the load: a row that pushes by how much, a row that
 * only turns by the push that would take as much energy. */
static __device__ void respond_row_block(const cuda_view &v, int32_t k, const row_about &about)
{
    const int32_t bodies[2] = {about.body_a, about.body_b};
    double inverse_mass = 0;
    for (int side = 0; side < 2; ++side)
        if (is_dynamic(v, bodies[side])) inverse_mass += 1 / mass_of(v, (size_t)bodies[side]);
    for (int r = 0; r < about.rows; ++r) {
        double w = 0, push = 0, row[6];
        for (int side = 0; side < 2; ++side) {
            if (!is_dynamic(v, bodies[side])) continue;
            for (int j = 0; j < 6; ++j) row[j] = row_number(v, (side ? ROW_J_B : ROW_J_A) + 6 * r + j, k);
            w += packed_form(v.A_inverse + (size_t)bodies[side] * PACKED, row);
            push = fmax(push, sqrt(dot3(row, row)));
        }
        store_row(v, ROW_RESPONSE + r, k, w);
        store_row(v, ROW_SCALE + r, k, push > 0 ? push : sqrt(w / inverse_mass));
    }
}

/* B = diag(weight) + along along^T */
static __device__ void weigh_row_block(const cuda_view &v, int32_t k, bool first)
{
    const row_about about = v.row_info[k];
    cuda_island *island = &v.islands[v.label[is_dynamic(v, about.body_a) ? about.body_a : about.body_b]];
    double load2 = 0, lambda2 = 0, mean = 0;
    if (first) {
        respond_row_block(v, k, about);
        island->blocks = 1;
    }
    for (int r = 0; r < about.rows; ++r) {
        const double lambda = row_number(v, ROW_LAMBDA + r, k), load = row_number(v, ROW_SCALE + r, k) * lambda;
        load2 += load * load;
        lambda2 += lambda * lambda;
        mean += row_number(v, ROW_RESPONSE + r, k) / about.rows;
    }
    const double share = weight_share(load2, island->speed, island->mass);
    for (int r = 0; r < about.rows; ++r) {
        const double lambda = row_number(v, ROW_LAMBDA + r, k), response = row_number(v, ROW_RESPONSE + r, k);
        const bool hard = about.kind == SADMM_BLOCK_HARD;
        store_row(v, ROW_WEIGHT + r, k,
                  hard                                ? weight_of_hard_row(response)
                  : about.kind == SADMM_BLOCK_CONTACT ? weight_of_contact_block(share, lambda2, mean)
                                                      : weight_of_soft_row(share, lambda, response));
        store_row(v, ROW_ALONG + r, k, hard ? sqrt(share) * lambda : 0);
    }
}

static __global__ void weigh_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const int32_t k = thread_index();
    if (k < live_rows(v)) weigh_row_block(v, k, args.start);
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

sadmm_status CUDA(enqueue_pairs)(struct sadmm_context *c, bool first, struct sadmm_error *error)
{
    cuda_args args = {};
    const int64_t blocks = ((int64_t)c->view.pair_room * c->view.lanes + BODY_THREADS - 1) / BODY_THREADS;
    return CUDA(launch_of)(c, first ? pairs_kernel<true> : pairs_kernel<false>, "loads of pairs", blocks, BODY_THREADS,
                           &args, error);
}

sadmm_status CUDA(enqueue_islands)(struct sadmm_context *c, bool first, struct sadmm_error *error)
{
    cuda_args args = {};
    if (first) {
        c->refreshes = 0;
        c->starting = c->settled = false;
    } else {
        ++c->refreshes;
    }
    c->exact_since = 0;
    args.start = first;
    args.warm = c->plan.warm;
    args.factor = weight_few(c->plan.rigid, c->settings.iterations);
    const cuda_kernel kernel = c->refreshes >= WEIGHT_FIRST_LEVEL ? terms_kernel<true> : terms_kernel<false>;
    CUDA_TRY(CUDA(launch_of)(c, kernel, "sums over islands", body_blocks(c->view.bodies), BODY_THREADS, &args, error));
    return CUDA(launch)(c, weigh_rows_kernel, "weights of row blocks", blocks_for(c->view.rows), &args, error);
}

sadmm_status CUDA(enqueue_weights)(struct sadmm_context *c, bool first, bool factor, struct sadmm_error *error)
{
    CUDA_TRY(CUDA(enqueue_pairs)(c, first, error));
    CUDA_TRY(CUDA(enqueue_islands)(c, first, error));
    return CUDA(enqueue_weighted_penalties)(c, first, factor, false, error);
}

/* ---- entries ----------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(update_weights)(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    return CUDA(enqueue_weights)(c, false, false, error);
}
