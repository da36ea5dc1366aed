/* H = (A + beta C)^-1 of a body, and B and C of the method `fast`. In double; eight lanes a body. H only preconditions:
 * the fixed point of Step 1 does not depend on it. */
#ifndef SADMM_CUDA_WEIGHT_FACTOR_H
#define SADMM_CUDA_WEIGHT_FACTOR_H

#include "constraint.h"
#include "backend_cuda/assemble/side_sums.h"

#include "core/math/weight.h"

/* ---- weights of the method `fast` -------------------------------------------------------------------------------- */

/* The contacts of deep stacks close small separations slowly. */
static __device__ __forceinline__ void ease_separations(const model_view &model, const contact_view &contacts,
                                                        int32_t p, double share)
{
    const double slop = model.settings->slop / model.settings->dt;
    const int32_t count = share < 1 ? (int32_t)contacts.difference[p].w : 0;
    for (int32_t k = 0; k < count; ++k) {
        solver_real *error = &contacts.arm[point_slot(contacts, p, k)].w;
        *error = (solver_real)weight_separation_error((double)*error, share, slop);
    }
}

/* Of eight sides of a body, one a lane: which, what its weight is made of, and from all of their records the lane's
 * numbers. */
struct eight_sides {
    int32_t code;                  /* of the lane's own, or -1 */
    pair_bodies bodies;
    solver_real load, response;    /* of a pair */
    int alone;                     /* bits of a, b of a pair: nothing else touches it */
    solver_real number[2][LANES];  /* numbers lane and lane + LANES of arm_sums */
};

/* weight_most of pair p. By itself: few bodies are alone, and the others should not pay in registers. */
static __device__ __noinline__ double most_of(const body_view &bodies, const contact_view &contacts, int alone,
                                              int32_t p)
{
    const pair_bodies pair = contacts.bodies[p];
    const double mass[2] = {alone & 1 ? mass_of(bodies, (size_t)pair.body_a) : 0,
                            alone & 2 ? mass_of(bodies, (size_t)pair.body_b) : 0};
    const int constraints[2] = {alone & 1, alone >> 1};
    return weight_most(constraints, mass, (int)contacts.difference[p].w);
}

/* B of the pair of the lane's side. Both of its sides work it out; the one at its first dynamic body keeps it, but in
 * islands that keep their weights. */
static __device__ __forceinline__ double weigh_side(const model_view &model, const body_view &bodies,
                                                    const contact_view &contacts, const weight_view &weights,
                                                    const eight_sides &sides, const cuda_island &island, bool first)
{
    const int32_t p = sides.code / 2;
    const double load = (double)sides.load, response = (double)sides.response;
    const bool a = is_dynamic(model, sides.bodies.body_a), both = a && is_dynamic(model, sides.bodies.body_b);
    const double most = sides.alone ? most_of(bodies, contacts, sides.alone, p) : HUGE_VAL,
                 scale = island.scale_weights,
                 taken = scale > 0 ? weights.weight[p]
                                   : weight_of_pair(&island.weights, load, most, response),
                 B = scale > 0 ? taken * scale : taken;
    if ((sides.code & 1 && a) || (!first && island.warm)) return B;
    contacts.inv_s[p] = (solver_real)(both ? B / 2 : B);
    if (!(scale > 0)) weights.weight[p] = taken;
    if (first && bodies.rigid)
        ease_separations(model, contacts, p, island.weights.separation_share); /* world level: separations, a slop and
                                                                                  a step */
    return B;
}

/* Are bodies rigid, and have contacts of three rows alone? Then A + C is inverted in closed form (factor_rigid). */
static __host__ __device__ __forceinline__ bool has_closed_form(const model_view &model, const body_view &bodies,
                                                               const row_view &rows)
{
    return bodies.rigid && model.contact_rows == 3 && rows.count == 0;
}

/* The same of a body among others: no row joins it. So it has one form, whatever the others have. */
static __device__ __forceinline__ bool body_has_closed_form(const cuda_view &v, const body_thread &t)
{
    return v.bodies.rigid && v.model.contact_rows == 3 &&
           (t.begin == t.end || v.graph.incident[t.end - 1] / 2 < v.contacts.pair_capacity); /* rows come last */
}

/* ---- C ----------------------------------------------------------------------------------------------------------- */

/* B of a side's points into C, where contacts have one row. */
static __device__ __forceinline__ void add_normals(const contact_view &contacts, int32_t code, double B,
                                                   double C[PACKED])
{
    const int32_t side = code & 1, p = code / 2;
    const pair_data pair = load_pair(contacts, p);
    for_each_point(contacts, p, pair, [&](const point_data &point) {
        double row[6];
        normal_row(pair.normal, side ? point.arm[1] : point.arm[0], row);
        packed_add_row(C, row, B);
    });
}

/* Has a body one constraint? */
static __device__ __forceinline__ bool is_alone(const model_view &model, const graph_view &graph, int32_t body)
{
    if (!is_dynamic(model, body)) return false;
    const int32_t slot = graph.slot_of[body];
    return graph.offsets[slot + 1] - graph.offsets[slot] == 1;
}

/* Those from place `begin` on. Every lane of the warp comes here. */
static __device__ __forceinline__ eight_sides fetch_sides(const model_view &model, const graph_view &graph,
                                                          const contact_view &contacts, const weight_view &weights,
                                                          const body_thread &t, int32_t begin)
{
    const bool more = t.lane + LANES < SIDE_ARMS;
    const pair_bodies nobody = {};
    eight_sides out;
    out.code = begin + t.lane < t.end ? graph.incident[begin + t.lane] : -1;
    const bool own = out.code >= 0 && out.code < 2 * contacts.pair_capacity;
    const solver_real *about = weights.side_arms + (size_t)(own ? out.code : 0) * SIDE_NUMBERS;
    out.bodies = own ? contacts.bodies[out.code / 2] : nobody;
    out.load = own ? about[SIDE_LOAD] : (solver_real)0;
    out.response = own ? about[SIDE_RESPONSE] : (solver_real)0;
#pragma unroll
    for (int j = 0; j < LANES; ++j) {
        const int32_t code = __shfl_sync((unsigned)ALL_LANES, out.code, j, LANES);
        const bool pair = code >= 0 && code < 2 * contacts.pair_capacity && model.contact_rows == 3;
        const solver_real *arms = weights.side_arms + (size_t)(pair ? code : 0) * SIDE_NUMBERS + t.lane;
        out.number[0][j] = pair ? arms[0] : (solver_real)0;
        out.number[1][j] = pair && more ? arms[LANES] : (solver_real)0;
    }
    /* Asked for after all that does not wait for the bodies. */
    out.alone = !own ? 0 : is_alone(model, graph, out.bodies.body_a) | is_alone(model, graph, out.bodies.body_b) << 1;
    return out;
}

/* C of a body by the weights, and beta = 1, in all lanes: each weighs every eighth side, and adds up a sum or two over
 * all. `sides`: the first of them. `first`: of a solve. CLOSED: as in has_closed_form. Every lane of the warp comes
 * here. */
template <bool CLOSED>
static __device__ __forceinline__ void weighted_matrix(const cuda_view &v, const body_thread &t, eight_sides sides,
                                                       const cuda_island &island, bool first, double C[PACKED])
{
    const bool three = CLOSED || v.model.contact_rows == 3;
    double sum[2] = {};
#pragma unroll
    for (int k = 0; k < PACKED; ++k) C[k] = 0;
    for (int32_t begin = t.begin;;) {
        const bool rows = !CLOSED && sides.code >= 0 && sides.code >= 2 * v.contacts.pair_capacity;
        const double B = sides.code < 0 || rows
                             ? 0
                             : weigh_side(v.model, v.bodies, v.contacts, v.weights, sides, island, first);
        if (rows) add_weighted_rows(v.rows, sides.code / 2 - v.contacts.pair_capacity, sides.code & 1, C);
        else if (!three && sides.code >= 0) add_normals(v.contacts, sides.code, B, C);
#pragma unroll
        for (int j = 0; j < LANES; ++j) {
            const double weight = __shfl_sync((unsigned)ALL_LANES, B, j, LANES);
            sum[0] = fma(weight, (double)sides.number[0][j], sum[0]);
            sum[1] = fma(weight, (double)sides.number[1][j], sum[1]);
        }
        begin += LANES;
        if (__ballot_sync((unsigned)ALL_LANES, begin < t.end) == 0) break;
        sides = fetch_sides(v.model, v.graph, v.contacts, v.weights, t, begin);
    }
    if (!three || (!CLOSED && v.rows.count > 0)) sum_lanes<PACKED>(C);
    if (!three) return;
    struct arm_sums sums;
    double *in_order = &sums.count;
#pragma unroll
    for (int k = 0; k < SIDE_ARMS; ++k)
        in_order[k] = __shfl_sync((unsigned)ALL_LANES, sum[k / LANES], k % LANES, LANES);
    add_arm_sums(C, &sums);
    packed_round_up(C, SOLVER_EPSILON); /* sums are in this precision, too */
}

/* ---- H ----------------------------------------------------------------------------------------------------------- */

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

/* A column of H into the lower triangle, 1/beta, and what H has unused. */
static __device__ __forceinline__ void store_column(const body_view &bodies, size_t body, int32_t lane, double beta,
                                                    solver_real *H, const double x[6])
{
#pragma unroll
    for (int i = 0; i < 6; ++i)
        if (lane <= i) H[i * (i + 1) / 2 + lane] = (solver_real)x[i];
    if (lane == 6)
        for (int k = PACKED; k < LINE_H; ++k) H[k] = 0;
    if (lane == 7) bodies.state[body * ROW + STATE_INV_BETA] = (solver_real)(1 / beta);
}

/* H where it has a closed form. A + C = [p I, -[q]x; [q]x, R] with [q]x u = q x u; by eliminating the linear part, a
 * column a lane: in
 *
 *     p t - q x w = f,   q x t + R w = g
 *     S w = g - q x f / p,   S = R - (|q|^2 I - q q^T) / p,   t = (f + q x w) / p
 *
 * S = L D L^T. */
static __device__ __forceinline__ void factor_rigid(const body_view &bodies, size_t body, int32_t lane,
                                                    const double C[PACKED])
{
    solver_real *line = bodies.lines + body * (size_t)bodies.line;
    const double p = (double)line[0] + C[0], x = C[16], y = C[8], z = C[10], by_p = 1 / p;
    const double rxx = (double)line[1] + C[9], rxy = (double)line[2] + C[13], ryy = (double)line[3] + C[14],
                 rxz = (double)line[4] + C[18], ryz = (double)line[5] + C[19], rzz = (double)line[6] + C[20];
    const double qx = x * by_p, qy = y * by_p, qz = z * by_p;
    const double sxx = fma(-qz, z, fma(-qy, y, rxx)), syy = fma(-qz, z, fma(-qx, x, ryy)),
                 szz = fma(-qy, y, fma(-qx, x, rzz)), sxy = fma(qx, y, rxy), sxz = fma(qx, z, rxz),
                 syz = fma(qy, z, ryz);
    const double d0 = 1 / sxx, l1 = sxy * d0, l2 = sxz * d0, left = fma(-l1, sxy, syy), d1 = 1 / left,
                 cross = fma(-l1, sxz, syz), l3 = cross * d1, last = fma(-l3, cross, fma(-l2, sxz, szz)), d2 = 1 / last;
    const bool ok = p > 0 && sxx > 4 * DBL_EPSILON * rxx && left > 4 * DBL_EPSILON * ryy &&
                    last > 4 * DBL_EPSILON * rzz && p <= DBL_MAX && sxx <= DBL_MAX && left <= DBL_MAX &&
                    last <= DBL_MAX;
    /* g - q x f / p with f or g the unit vector of the lane */
    const double g0 = lane == 1 ? qz : lane == 2 ? -qy : lane == 3 ? 1 : 0,
                 g1 = lane == 0 ? -qz : lane == 2 ? qx : lane == 4 ? 1 : 0,
                 g2 = lane == 0 ? qy : lane == 1 ? -qx : lane == 5 ? 1 : 0;
    const double y1 = fma(-l1, g0, g1), y2 = fma(-l3, y1, fma(-l2, g0, g2));
    const double w2 = y2 * d2, w1 = fma(-l3, w2, y1 * d1), w0 = fma(-l2, w2, fma(-l1, w1, g0 * d0));
    double column[6] = {fma(qy, w2, fma(-qz, w1, lane == 0 ? by_p : 0)),
                        fma(qz, w0, fma(-qx, w2, lane == 1 ? by_p : 0)),
                        fma(qx, w1, fma(-qy, w0, lane == 2 ? by_p : 0)), w0, w1, w2};
    if (!ok) { /* as in factor_body */
        const double diagonal = lane < 3 ? p : lane == 3 ? rxx : lane == 4 ? ryy : rzz;
#pragma unroll
        for (int i = 0; i < 6; ++i) column[i] = i == lane ? 1 / diagonal : 0;
    }
    store_column(bodies, body, lane, 1, line_h(line, true), column);
}

/* H = (A + beta C)^-1, a column a lane, and 1/beta. */
static __device__ __forceinline__ void factor_body(const body_view &bodies, size_t body, int32_t lane, double beta,
                                                   const double C[PACKED])
{
    solver_real *line = bodies.lines + body * (size_t)bodies.line, *H = line_h(line, bodies.rigid);
    double M[PACKED], diagonal[6], inverse[6], x[6];
#pragma unroll
    for (int r = 0; r < 6; ++r) {
#pragma unroll
        for (int k = 0; k <= r; ++k)
            M[r * (r + 1) / 2 + k] = (double)line_a(line, bodies.rigid, r, k) + beta * C[r * (r + 1) / 2 + k];
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
    for (int i = 0; i < 6;
         ++i) /* A rounded to f32 stays positive definite unless the problem is beyond f32: then keep the diagonal. */
        if (!ok) x[i] = i == lane ? 1 / diagonal[i] : 0;
    store_column(bodies, body, lane, beta, H, x);
}

#endif
