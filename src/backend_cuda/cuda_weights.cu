/* The method `fast`, what runs a few times a step: weights of the constraints (kernels E-G; math/weight.h), levels of
 * the islands, the momentum residual (17) and the limit of energies (math/limit.h). In double, from this precision's
 * data.
 *
 *   terms    a body by eight lanes: what it adds to the sums over its island. A pair counts at its first dynamic body
 *   stages   the sums, in place: slots are by island, and a body's place in its island is what the order of the sum
 *            depends on. Stage k adds SPREAD neighbours that are SPREAD^k apart, so that an island of any size takes
 *            few steps and has one order whatever surrounds it, in every tier. Then what follows for the island
 *   weights  a thread a pair or row block: B. Then C and H (cuda_penalty.cu)
 */
#include "cuda_body.h"

#include "../core/math/limit.h"
#include "../core/math/violation.h"
#include "../core/math/weight.h"

enum { SPREAD = 16 };
/* Sums of as many bodies as one block has places for take one launch; more take a launch a stage. */
enum { ONE_BLOCK = 1024, EACH = 4 };

enum what { OF_WEIGHTS, OF_LEVELS, OF_ENERGY, OF_LIMIT, OF_RESIDUAL };

/* ---- pairs and row blocks in double ------------------------------------------------------------------------------ */

struct pair_data {
    double normal[3], difference[3], friction;
    int32_t count;
};

static __device__ __forceinline__ pair_data load_pair(const cuda_view &v, int32_t p)
{
    const real4 about = v.normal[p], between = v.difference[p];
    const pair_data pair = {{(double)about.x, (double)about.y, (double)about.z},
                            {(double)between.x, (double)between.y, (double)between.z},
                            (double)about.w,
                            (int32_t)between.w};
    return pair;
}

/* Arms are of use on dynamic sides only. */
struct point_data {
    double arm[2][3], lambda[3], error;
};

static __device__ __forceinline__ point_data load_point(const cuda_view &v, int32_t p, int32_t k, const pair_data &pair)
{
    const size_t slot = point_slot(v, p, k);
    const real4 arm = v.arm[slot];
    const double r[3] = {(double)arm.x, (double)arm.y, (double)arm.z};
    point_data point;
    point.error = (double)arm.w;
#pragma unroll
    for (int j = 0; j < 3; ++j) {
        point.arm[0][j] = r[j];
        point.arm[1][j] = r[j] + pair.difference[j];
        point.lambda[j] = v.contact_rows == 1 ? (double)v.lambda[slot] * pair.normal[j]
                                              : (double)v.lambda[(size_t)j * v.lambda_stride + slot];
    }
    return point;
}

static __device__ __forceinline__ double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static __device__ __forceinline__ bool is_dynamic(const cuda_view &v, int32_t body) { return body < v.bodies; }

/* The island of a constraint. */
static __device__ __forceinline__ cuda_island *island_of(const cuda_view &v, int32_t body_a, int32_t body_b)
{
    return &v.islands[v.label[is_dynamic(v, body_a) ? body_a : body_b]];
}

/* (A_0 + A_1 + A_2) / 3 */
static __device__ __forceinline__ double mass_of(const cuda_view &v, size_t body)
{
    const solver_real *line = v.lines + body * (size_t)v.line;
    return ((double)line_a(line, v.rigid, 0, 0) + (double)line_a(line, v.rigid, 1, 1) +
            (double)line_a(line, v.rigid, 2, 2)) /
           3;
}

/* ---- terms ------------------------------------------------------------------------------------------------------- */

/* g += J^T lambda of a half; *push += the size of its force. */
static __device__ void add_half(const cuda_view &v, int32_t code, double g[6], double *push)
{
    const int32_t side = code & 1, p = code / 2;
    if (p >= v.pair_room) {
        const int32_t k = p - v.pair_room, jacobian = side ? ROW_J_B : ROW_J_A;
        double wrench[6] = {};
        for (int r = 0; r < v.row_info[k].rows; ++r)
            for (int j = 0; j < 6; ++j)
                wrench[j] += row_number(v, jacobian + 6 * r + j, k) * row_number(v, ROW_LAMBDA + r, k);
        for (int j = 0; j < 6; ++j) g[j] += wrench[j];
        *push += sqrt(dot3(wrench, wrench));
        return;
    }
    const pair_data pair = load_pair(v, p);
    const double sign = side ? 1 : -1;
    double force[3] = {};
    for (int32_t k = 0; k < pair.count; ++k) {
        const point_data point = load_point(v, p, k, pair);
        for (int j = 0; j < 3; ++j) force[j] += point.lambda[j];
        add_cross(side ? point.arm[1] : point.arm[0], point.lambda, sign, g + 3);
    }
    for (int j = 0; j < 3; ++j) g[j] += sign * force[j];
    *push += sqrt(dot3(force, force));
}

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

/* A component of x in each lane: component `lane` of M x, in lanes that have one. Every lane of the warp comes here. */
template <class Entry> static __device__ __forceinline__ double product(int32_t lane, double x, Entry entry)
{
    double sum = 0;
#pragma unroll
    for (int k = 0; k < 6; ++k) {
        const double other = __shfl_sync((unsigned)ALL_LANES, x, k, LANES);
        if (lane < 6) sum += entry(k) * other;
    }
    return sum;
}

/* x . y, a component a lane, in all of them. Every lane of the warp comes here. */
static __device__ __forceinline__ double dot_lanes(double x, double y)
{
    double sum = x * y;
    sum_lanes<1>(&sum);
    return sum;
}

/* What a body adds to its island's sums:
 *   OF_WEIGHTS  g . A^-1 g, mass, v . A v, push            with g = J^T lambda, push the sum of the forces' sizes
 *   OF_LEVELS   also r . A^-1 r, what its pairs miss       with r = b + g - A v
 *   OF_ENERGY   energy of v, of A^-1 b
 *   OF_LIMIT    also energy of r; work                     (nothing where no island is suspected)
 *   OF_RESIDUAL nothing: (17), the largest entry of r */
template <int WHAT>
static __global__ void __launch_bounds__(BODY_THREADS)
    terms_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    if (WHAT == OF_LIMIT && !*v.suspects) return;
    if (WHAT == OF_ENERGY && blockIdx.x == 0 && threadIdx.x == 0) *v.limited = *v.suspects = 0;
    const body_thread t = body_of_thread(v);
    enum { PAIRS = 6, PUSH, SUMS };
    double sums[SUMS] = {}, term[TERMS] = {};
    for (int32_t at = t.begin + t.lane; WHAT != OF_ENERGY && at < t.end; at += LANES) {
        const int32_t code = v.incident[at], p = code / 2;
        add_half(v, code, sums, &sums[PUSH]);
        if ((WHAT != OF_LEVELS && WHAT != OF_LIMIT) || p >= v.pair_room) continue;
        if (code & 1 && is_dynamic(v, v.ends[p].body_a)) continue; /* counted there */
        sums[PAIRS] += WHAT == OF_LEVELS ? violation_of(v, p) : work_of(v, p);
    }
    sum_lanes<SUMS>(sums);
    double g = 0;
#pragma unroll
    for (int k = 0; k < 6; ++k)
        if (k == t.lane) g = sums[k];

    const solver_real *line = v.lines + t.body * (size_t)v.line;
    const double *inverse = v.A_inverse + t.body * PACKED;
    auto a = [&](int k) { return t.live ? (double)line_a(line, v.rigid, t.lane, k) : 0; };
    auto a_inverse = [&](int k) { return t.live ? inverse[packed_place(t.lane, k)] : 0; };
    const bool has = t.live && t.lane < 6;
    const double velocity = has ? (double)v.state[t.body * ROW + (size_t)t.lane] : 0;
    const double b = has ? (double)v.b[t.body * ROW + (size_t)t.lane] : 0;
    const double momentum = product(t.lane, velocity, a), r = b + g - momentum;
    if (WHAT == OF_RESIDUAL) reduce_max(has ? fabs(r) : 0, v.residual + 1);
    if (WHAT == OF_WEIGHTS || WHAT == OF_LEVELS) {
        term[0] = dot_lanes(g, product(t.lane, g, a_inverse));
        term[1] = t.live ? mass_of(v, t.body) : 0;
        term[2] = dot_lanes(velocity, momentum);
        term[3] = sums[PUSH];
    }
    if (WHAT == OF_LEVELS) {
        term[4] = dot_lanes(r, product(t.lane, r, a_inverse));
        term[5] = sums[PAIRS];
    }
    if (WHAT == OF_ENERGY || WHAT == OF_LIMIT) {
        term[0] = dot_lanes(velocity, momentum) / 2;
        term[1] = dot_lanes(b, product(t.lane, b, a_inverse)) / 2;
    }
    if (WHAT == OF_LIMIT) {
        term[2] = dot_lanes(r, product(t.lane, r, a_inverse)) / 2;
        term[3] = sums[PAIRS];
    }
    if (!t.live) return;
#pragma unroll
    for (int k = 0; WHAT != OF_RESIDUAL && k < TERMS; ++k)
        if (k == t.lane) v.terms[(size_t)t.slot * TERMS + (size_t)k] = term[k];
    if (args.start && t.lane == TERMS) {
        const cuda_island fresh = {0, 0, 1, 0, 1, 1, 0};
        v.islands[t.body] = fresh;
    }
}

/* ---- sums over islands ------------------------------------------------------------------------------------------- */

/* Where slot s is in its island. */
struct place_in_island {
    int32_t label, rank, bodies;
};

static __device__ __forceinline__ place_in_island place_of(const cuda_view &v, int32_t s)
{
    const int32_t label = v.label[v.body_of[s]];
    const place_in_island place = {label, s - v.slot_of[label], v.island_bodies[label]};
    return place;
}

static __device__ void add_neighbours(const cuda_view &v, int32_t s, const place_in_island &place, int32_t apart)
{
    const int64_t left = ((int64_t)place.bodies - place.rank + apart - 1) / apart; /* places from here on */
    if (place.rank % ((int64_t)apart * SPREAD) != 0 || left < 2) return;
    double *to = v.terms + (size_t)s * TERMS, sum[TERMS];
#pragma unroll
    for (int k = 0; k < TERMS; ++k) sum[k] = to[k];
    const int32_t count = left < SPREAD ? (int32_t)left : (int32_t)SPREAD;
#pragma unroll 5
    for (int32_t j = 1; j < count; ++j) {
        const double *from = to + (size_t)j * (size_t)apart * TERMS;
#pragma unroll
        for (int k = 0; k < TERMS; ++k) sum[k] += from[k];
    }
#pragma unroll
    for (int k = 0; k < TERMS; ++k) to[k] = sum[k];
}

template <int WHAT>
static __device__ void finish_island(const cuda_view &v, int32_t s, const place_in_island &place, bool warm)
{
    if (place.rank != 0) return;
    const double *sum = v.terms + (size_t)s * TERMS;
    cuda_island *island = &v.islands[place.label];
    if (WHAT == OF_ENERGY) {
        if (limit_suspects(sum[0], sum[1])) *v.suspects = 1;
        return;
    }
    if (WHAT == OF_LIMIT) {
        const struct limit_energies energies = {sum[0], sum[1], sum[2], sum[3]};
        island->slow_down = limit_factor(&energies);
        if (island->slow_down != 1) atomicAdd(v.limited, 1);
        return;
    }
    island->speed = weight_speed(sum[0], sum[1]);
    if (warm) {
        island->tallness = weight_tallness(island->speed, sum[3], sum[1]);
        island->speed = weight_speed_warm(island->speed, island->tallness, sum[2], sum[1]);
    }
    island->mass = sum[1];
    if (WHAT != OF_LEVELS || island->blocks) return;
    const double balance = weight_balance(sum[5], sum[4], sum[1]), level = weight_next_level(island->level, balance);
    island->scale = weight_stalls(balance) ? level / island->level : 0;
    island->level = level;
}

/* Slow a body down as its island is. */
static __device__ void slow_body(const cuda_view &v, int32_t s, double factor)
{
    solver_real *state = v.state + (size_t)v.body_of[s] * ROW;
    if (factor == 1) return;
    for (int k = 0; k < 6; ++k) state[k] *= (solver_real)factor;
}

/* Stages [first_stage, last_stage], and after the very last one (`count`) what follows for the islands, COUNT bodies a
 * thread. Several stages: one block; then bodies are slowed down here too. */
template <int WHAT, int COUNT>
static __global__ void __launch_bounds__(ONE_BLOCK)
    islands_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const int32_t first = (int32_t)(blockIdx.x * blockDim.x + threadIdx.x), all = (int32_t)(gridDim.x * blockDim.x);
    const int32_t bodies = live_bodies(v);
    const bool one_block = COUNT > 1;
    if (WHAT == OF_LIMIT && !*v.suspects) return;
    place_in_island place[COUNT];
    int32_t apart = 1;
#pragma unroll
    for (int j = 0; j < COUNT; ++j) {
        const place_in_island none = {0, 1, 0};
        place[j] = first + j * all < bodies ? place_of(v, first + j * all) : none;
    }
    for (int32_t stage = 0; stage <= args.last_stage; ++stage, apart *= SPREAD) {
        if (stage < args.first_stage) continue;
#pragma unroll
        for (int j = 0; j < COUNT; ++j) add_neighbours(v, first + j * all, place[j], apart);
        if (one_block) __syncthreads();
    }
    if (args.last_stage + 1 < args.count) return;
#pragma unroll
    for (int j = 0; j < COUNT; ++j) finish_island<WHAT>(v, first + j * all, place[j], args.warm);
    if (WHAT != OF_LIMIT || !one_block) return;
    __syncthreads();
#pragma unroll
    for (int j = 0; j < COUNT; ++j)
        if (first + j * all < bodies) slow_body(v, first + j * all, v.islands[place[j].label].slow_down);
}

/* ---- weights ----------------------------------------------------------------------------------------------------- */

/* Mean of J A^-1 J^T over a pair's points and rows, 1/kg. */
static __device__ double response_of(const cuda_view &v, int32_t p, const pair_data &pair, const int32_t bodies[2])
{
    double w = 0;
    for (int side = 0; side < 2; ++side) {
        if (!is_dynamic(v, bodies[side])) continue;
        struct arm_sums sums = {};
        double S[PACKED] = {};
        for (int32_t k = 0; k < pair.count; ++k) {
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
        const double *inverse = v.A_inverse + (size_t)bodies[side] * PACKED;
        if (v.contact_rows == 3 && v.rigid) {
            w += packed_dot_arms(inverse, &sums);
            continue;
        }
        if (v.contact_rows == 3) add_arm_sums(S, &sums);
        w += packed_dot(inverse, S);
    }
    return w / (v.contact_rows * pair.count);
}

/* The contacts of tall islands close small gaps slowly. */
static __device__ void ease_gaps(const cuda_view &v, int32_t p, int32_t count, double tallness)
{
    const double slop = v.settings.slop / v.settings.dt, share = weight_gap_share(tallness);
    for (int32_t k = 0; k < count && share < 1; ++k) {
        solver_real *error = &v.arm[point_slot(v, p, k)].w;
        *error = (solver_real)weight_gap_error((double)*error, share, slop);
    }
}

template <bool FIRST> static __device__ void weigh_pair(const cuda_view &v, int32_t p)
{
    const pair_data pair = load_pair(v, p);
    const pair_ends ends = v.ends[p];
    const int32_t bodies[2] = {ends.body_a, ends.body_b};
    const cuda_island *island = island_of(v, ends.body_a, ends.body_b);
    double load = 0;
    for (int32_t k = 0; k < pair.count; ++k) {
        const point_data point = load_point(v, p, k, pair);
        load += sqrt(dot3(point.lambda, point.lambda));
    }
    const double response = FIRST ? response_of(v, p, pair, bodies) : v.response[p];
    const double carried = weight_mass(load / pair.count, island->speed, island->mass);
    const double B = island->scale > 0 ? v.weight[p] * island->scale : weight_of_pair(island->level, carried, response);
    if (FIRST) v.response[p] = response;
    if (FIRST && v.rigid) ease_gaps(v, p, pair.count, island->tallness); /* world level: gaps, a slop and a step */
    v.weight[p] = B;
    v.inv_s[p] = (solver_real)(is_dynamic(v, ends.body_a) && is_dynamic(v, ends.body_b) ? B / 2 : B);
}

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
template <bool FIRST> static __device__ void weigh_row_block(const cuda_view &v, int32_t k)
{
    const row_about about = v.row_info[k];
    cuda_island *island = island_of(v, about.body_a, about.body_b);
    double load2 = 0, lambda2 = 0, mean = 0;
    if (FIRST) {
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

template <bool FIRST>
static __global__ void weigh_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    const int32_t i = thread_index(), k = i - v.pair_room;
    if (i < live_pairs(v)) weigh_pair<FIRST>(v, i);
    else if (k >= 0 && k < live_rows(v)) weigh_row_block<FIRST>(v, k);
}

/* ---- limit ------------------------------------------------------------------------------------------------------- */

static __global__ void slow_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    const int32_t s = thread_index();
    if (!*v.suspects) return;
    if (s < live_bodies(v)) slow_body(v, s, v.islands[v.label[v.body_of[s]]].slow_down);
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

template <int WHAT>
static sadmm_status launch_terms(struct sadmm_context *c, bool start, const char *name, struct sadmm_error *error)
{
    cuda_args args = {};
    args.start = start;
    return CUDA(launch_of)(c, terms_kernel<WHAT>, name, body_blocks(c->view.bodies), BODY_THREADS, &args, error);
}

static bool one_block(const cuda_view *v) { return v->bodies <= EACH * ONE_BLOCK; }

template <int WHAT> static sadmm_status launch_islands(struct sadmm_context *c, struct sadmm_error *error)
{
    static const char name[] = "sums over islands";
    const int32_t n = c->view.bodies;
    cuda_args args = {};
    args.warm = c->plan.warm;
    for (int64_t reach = 1; reach < n || args.count == 0; reach *= SPREAD) ++args.count;
    if (n == 0) return SADMM_OK;
    if (one_block(&c->view)) {
        args.last_stage = args.count - 1;
        return CUDA(launch_of)(c, islands_kernel<WHAT, EACH>, name, 1, ONE_BLOCK, &args, error);
    }
    for (; args.last_stage < args.count; args.first_stage = ++args.last_stage)
        CUDA_TRY(CUDA(launch)(c, islands_kernel<WHAT, 1>, name, blocks_for(n), &args, error));
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_weights)(struct sadmm_context *c, bool first, bool factor, bool planned,
                                   struct sadmm_error *error)
{
    cuda_args args = {};
    if (first) {
        c->refreshes = 0;
        c->starting = c->settled = false;
    } else {
        ++c->refreshes;
    }
    const bool levels = c->refreshes >= WEIGHT_FIRST_LEVEL;
    CUDA_TRY(levels ? launch_terms<OF_LEVELS>(c, false, "terms of levels", error)
                    : launch_terms<OF_WEIGHTS>(c, first, "terms of weights", error));
    CUDA_TRY(levels ? launch_islands<OF_LEVELS>(c, error) : launch_islands<OF_WEIGHTS>(c, error));
    CUDA_TRY(CUDA(launch)(c, first ? weigh_kernel<true> : weigh_kernel<false>, "weights",
                          blocks_for((int64_t)c->view.pair_room + c->view.rows), &args, error));
    return CUDA(enqueue_weighted_penalties)(c, factor, planned, error);
}

sadmm_status CUDA(enqueue_momentum_residual)(struct sadmm_context *c, struct sadmm_error *error)
{
    return launch_terms<OF_RESIDUAL>(c, false, "momentum residual", error);
}

sadmm_status CUDA(enqueue_limit)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_TRY(launch_terms<OF_ENERGY>(c, false, "energies", error));
    CUDA_TRY(launch_islands<OF_ENERGY>(c, error));
    CUDA_TRY(launch_terms<OF_LIMIT>(c, false, "terms of the limit", error));
    CUDA_TRY(launch_islands<OF_LIMIT>(c, error));
    if (one_block(&c->view)) return SADMM_OK;
    return CUDA(launch)(c, slow_kernel, "limit_velocity", blocks_for(c->view.bodies), &args, error);
}

/* ---- entries ----------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(update_weights)(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    return CUDA(enqueue_weights)(c, false, false, false, error);
}

extern "C" sadmm_status CUDA(limit_velocity)(struct sadmm_context *c, int32_t *limited, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(enqueue_limit)(c, error));
    CUDA_TRY(CUDA(download)(c, c->view.limited, sizeof *limited, error));
    memcpy(limited, c->buffers[PINNED_OUT].data, sizeof *limited);
    return SADMM_OK;
}
