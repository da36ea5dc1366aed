/* The method `fast`: what an island's weights are made of (math/weight.h). In double, from this precision's data; eight
 * lanes a body. */
#ifndef SADMM_CUDA_WEIGHT_WEIGH_H
#define SADMM_CUDA_WEIGHT_WEIGH_H

#include "constraint.h"
#include "backend_cuda/assemble/side_sums.h"

#include "core/math/weight.h"

/* The residual of a pair's contacts, as an energy. */
static inline __device__ double violation_of(const body_view &bodies, const contact_view &contacts,
                                             const weight_view &weights, int32_t p)
{
    const pair_data pair = load_pair(contacts, p);
    const pair_bodies of_pair = contacts.bodies[p];
    const int32_t ends[2] = {of_pair.body_a, of_pair.body_b};
    double velocity[2][6], sum = 0;
    for (int side = 0; side < 2; ++side)
        for (int j = 0; j < 6; ++j) velocity[side][j] = (double)bodies.state[(size_t)ends[side] * ROW + (size_t)j];
    for (int32_t k = 0; k < pair.count; ++k) {
        const point_data point = load_point(contacts, p, k, pair);
        double u[3];
        for (int j = 0; j < 3; ++j) u[j] = velocity[1][j] - velocity[0][j] + point.error * pair.normal[j];
        add_cross(velocity[1] + 3, point.arm[1], 1, u);
        add_cross(velocity[0] + 3, point.arm[0], -1, u);
        sum += contact_violation(point.lambda, u, pair.normal, pair.friction, weights.response[p]);
    }
    return sum;
}

/* Of the terms of a body before there are weight scales: what anchors its island; the balance of weight_starts_warm. */
enum { TERM_ANCHORED = 4, TERM_BALANCE };

/* Are there new weights for constraints of an island: the first ones, or updates? */
static __device__ __forceinline__ bool is_weighed(const cuda_island *island, const cuda_args &args)
{
    return args.start || !island->warm;
}

/* As a solve begins, before there are scales. */
static __device__ __forceinline__ cuda_island new_island(const double sum[TERMS], const cuda_args &args)
{
    return {weight_new_island(), 0, 1, sum[TERM_ANCHORED] > 0, 0, 0,
            args.may_be_warm && weight_starts_warm(sum[TERM_BALANCE]), sum[TERM_ANCHORED] >= 1};
}

/* What follows from the sums over an island. Returns whether it starts cold. */
template <bool SCALES>
static __device__ __forceinline__ bool weigh_island(cuda_island *island, const double sum[TERMS], const cuda_args &args)
{
    static_assert(sizeof(struct weight_sums) == TERMS * sizeof(double), "a term for each");
    const struct weight_sums sums = {sum[0], sum[1], sum[2], sum[3], sum[4], sum[5]};
    if (!is_weighed(island, args)) return false;
    weight_update_speed(&island->weights, &sums, island->warm ? args.spring_iterations : 0);
    if (!SCALES || island->rows) return !island->warm;
    /* those that stagnate keep their weights, times what the weight scale has risen by since they were taken */
    const double rise = weight_update_scale(&island->weights, &sums);
    island->scale_weights = (island->scale_weights > 0 ? island->scale_weights : 1) * rise;
    return true;
}

/* Component `lane`, below 6, of J^T lambda on side `code` of a row block; of its place for rows that it does not have,
 * too, which are 0: all of them are fetched at once. */
static inline __device__ double row_side_number(const contact_view &contacts, const row_view &rows, int32_t code,
                                                int32_t lane)
{
    const row_data *row = rows_of(rows, code / 2 - contacts.pair_capacity);
    double sum = 0;
    if (lane >= 6) return 0;
#pragma unroll
    for (int r = 0; r < SADMM_MAX_ROWS; ++r)
        sum += (double)row[r].jacobian[code & 1][lane] * (double)row[r].lambda;
    return sum;
}

/* Of two halves of a constraint those that its side has. */
static __device__ __forceinline__ int32_t share_of_side(const model_view &model, const contact_view &contacts,
                                                        const row_view &rows, int32_t code)
{
    const int32_t p = code / 2, k = p - contacts.pair_capacity;
    const int32_t other = k < 0 ? (code & 1 ? contacts.bodies[p].body_a : contacts.bodies[p].body_b)
                                : (code & 1 ? rows.constraints[k].body_a : rows.constraints[k].body_b);
    return is_dynamic(model, other) ? 1 : 2;
}

/* J^T lambda of a body, a component a lane; in lane SIDE_PUSH the sum of the forces' sizes, and *balance, twice
 * that of weight_starts_warm; in lane SIDE_ANCHORS how many sides anchor it. ROWS: there may be row
 * blocks; then every lane of the warp comes here. */
template <bool ROWS>
static __device__ __forceinline__ double sum_sides(const model_view &model, const graph_view &graph,
                                                   const contact_view &contacts, const row_view &rows,
                                                   const weight_view &weights, const body_thread &t, int32_t *balance)
{
    enum { AT_ONCE = 4 };
    double sum = 0;
    *balance = 0;
    for (int32_t first = t.begin; ROWS ? __ballot_sync((unsigned)ALL_LANES, first < t.end) != 0 : first < t.end;
         first += AT_ONCE) {
        double number[AT_ONCE];
        int32_t code[AT_ONCE];
#pragma unroll
        for (int32_t j = 0; j < AT_ONCE; ++j) code[j] = first + j < t.end ? graph.incident[first + j] : -1;
#pragma unroll
        for (int32_t j = 0; j < AT_ONCE; ++j)
            number[j] = code[j] < 0 ? 0
                        : ROWS && code[j] / 2 >= contacts.pair_capacity
                            ? row_side_number(contacts, rows, code[j], t.lane)
                            : weights.side_wrench[(size_t)code[j] * ROW + (size_t)t.lane];
#pragma unroll
        for (int32_t j = 0; ROWS && j < AT_ONCE; ++j) {
            const double x = __shfl_sync((unsigned)ALL_LANES, number[j], 0, LANES),
                         y = __shfl_sync((unsigned)ALL_LANES, number[j], 1, LANES),
                         z = __shfl_sync((unsigned)ALL_LANES, number[j], 2, LANES);
            const bool turns = any_of_lanes(t.lane >= 3 && t.lane < 6 && number[j] != 0);
            if (t.lane != SIDE_PUSH || code[j] / 2 < contacts.pair_capacity) continue;
            number[j] = sqrt(x * x + y * y + z * z);
            if (turns && !(number[j] > 0)) /* a couple pushes nothing */
                *balance += 2 * share_of_side(model, contacts, rows, code[j]);
        }
#pragma unroll
        for (int32_t j = 0; j < AT_ONCE; ++j) {
            sum += number[j];
            if (t.lane != SIDE_PUSH || code[j] < 0) continue;
            const int32_t share = share_of_side(model, contacts, rows, code[j]);
            *balance += number[j] > 0 ? share : -share;
        }
    }
    return sum;
}

/* Terms of a body (struct weight_sums; the last two: SCALES), one a lane, and, where its weights are new, its momentum
 * residual r = b + g - A v, g = J^T lambda. A pair counts at its first dynamic body. Every lane of the warp comes
 * here. */
template <bool SCALES, bool RIGID, bool ROWS>
static __device__ __forceinline__ double terms_of_body(const cuda_view &v, const cuda_args &args, const body_thread &t)
{
    double violation = 0, term[TERMS] = {};
    int32_t balance;
    for (int32_t at = t.begin + t.lane; SCALES && at < t.end; at += LANES) {
        const int32_t code = v.graph.incident[at], p = code / 2;
        if (p >= v.contacts.pair_capacity || (code & 1 && is_dynamic(v.model, v.contacts.bodies[p].body_a)))
            continue; /* counted there */
        violation += violation_of(v.bodies, v.contacts, v.weights, p);
    }
    const wide_row<RIGID> row = row_of_body<RIGID>(v.bodies, t);
    const double sum = sum_sides<ROWS>(v.model, v.graph, v.contacts, v.rows, v.weights, t, &balance),
                 g = t.lane < 6 ? sum : 0, momentum = product(row.velocity, row.a);
    term[0] = dot_lanes(g, product(g, row.a_inverse));
    term[1] = t.live ? mass_of(v.bodies, t.body) : 0;
    term[2] = dot_lanes(row.velocity, momentum);
    term[3] = __shfl_sync((unsigned)ALL_LANES, sum, SIDE_PUSH, LANES);
    const double r = row.b + g - momentum;
    if (t.live && (args.start || !v.islands.info[v.graph.label[t.body]].warm))
        v.bodies.momentum_residual[t.body * ROW + (size_t)t.lane] = (solver_real)(t.lane < 6 ? r : 0);
    if (!SCALES) {
        /* a body that nothing touches moves as it should */
        const double anchors = __shfl_sync((unsigned)ALL_LANES, sum, SIDE_ANCHORS, LANES);
        term[TERM_ANCHORED] = t.live && t.begin == t.end ? 1 : anchors;
        term[TERM_BALANCE] = __shfl_sync((unsigned)ALL_LANES, balance, SIDE_PUSH, LANES);
    } else {
        sum_lanes<1>(&violation);
        term[4] = dot_lanes(r, product(r, row.a_inverse));
        term[5] = violation;
    }
    return own_number(term, t.lane);
}

#endif
