/* The method `fast`: what a pair adds to its bodies, a record for each side, so that what sums over a body's sides need
 * not read points: J^T lambda for the momentum, sums over arms for C, load and response for the weight
 * (math/weight.h). Made by contacts.lanes threads a pair where contacts are assembled, and again where loads are
 * recomputed. In double, from this precision's data. */
#ifndef SADMM_CUDA_ASSEMBLE_SIDE_SUMS_H
#define SADMM_CUDA_ASSEMBLE_SIDE_SUMS_H

#include "backend_cuda/device/body.h"
#include "backend_cuda/device/wide.h"

#include "core/math/momentum.h"

/* Numbers of side_wrench: force and torque, then the force's size, and 1 where the pair anchors its island
 * (math/momentum.h), as a solve begins; ROW in all. */
enum { SIDE_PUSH = 6, SIDE_ANCHORS };
/* In place of that 1 where the pair rolls (sadmm_pair_rolls): the sums of fewer than 2^20 of them are less. */
#define ANCHORS_BY_ROLLING (1.0 / (1 << 20))
/* Those of side_arms (device/view.h) are in this precision, and sums only where contacts have three rows: else C
 * depends on normals. */
static_assert(sizeof(struct arm_sums) == SIDE_ARMS * sizeof(double), "numbers are taken one by one");

/* Sums over a pair's points, with arms of side a (of side b where a is static). */
struct pair_sums {
    double pushed, force[3], torque[3]; /* |lambda|, lambda and its moment */
    double r[3], rr[6];                 /* as in arm_sums, where contacts have three rows */
    double row_response[2];             /* of sides, where they have one: J A^-1 J^T, 1/kg */
};
enum { LOAD_SUMS = 7, ARM_END = 16, PAIR_SUMS = sizeof(struct pair_sums) / sizeof(double) };
static_assert(PAIR_SUMS == ARM_END + 2, "numbers are taken one by one");

/* sums[begin, end) added up over a pair's lanes, in all of them. Every lane of the warp comes here. */
template <int BEGIN, int END>
static __device__ __forceinline__ void sum_pair(const contact_view &contacts, struct pair_sums *sums)
{
    double *numbers = &sums->pushed;
    for (int o = 1; o < contacts.lanes; o *= 2)
#pragma unroll
        for (int k = BEGIN; k < END; ++k) numbers[k] += __shfl_xor_sync((unsigned)ALL_LANES, numbers[k], o);
}

/* A^-1 of a rigid body: 1/m, and the inverse inertia as in arm_sums. */
struct rigid_inverse {
    double linear, xx, yy, zz, xy, xz, yz;
};
static __device__ __forceinline__ rigid_inverse inverse_of_body(const body_view &bodies, int32_t body)
{
    const double *M = bodies.A_inverse + (size_t)body * PACKED;
    const rigid_inverse inverse = {M[0], M[9], M[14], M[20], M[13], M[18], M[19]};
    return inverse;
}

static __device__ __forceinline__ void add_point(const model_view &model, const body_view &bodies,
                                                 const pair_bodies &ends, const real4 &normal,
                                                 const real4 &difference, const real4 &arm, const solver_real lambda[3],
                                                 bool first, struct pair_sums *sums)
{
    const double n[3] = {(double)normal.x, (double)normal.y, (double)normal.z},
                 r[3] = {(double)arm.x, (double)arm.y, (double)arm.z},
                 r_b[3] = {r[0] + (double)difference.x, r[1] + (double)difference.y, r[2] + (double)difference.z};
    double impulse[3], square = 0;
#pragma unroll
    for (int j = 0; j < 3; ++j) {
        impulse[j] = (double)lambda[j];
        square += impulse[j] * impulse[j];
        sums->force[j] += impulse[j];
    }
    sums->pushed += sqrt(square);
    add_cross(r, impulse, 1, sums->torque);
    if (!first) return;
    if (model.contact_rows == 3) {
#pragma unroll
        for (int j = 0; j < 3; ++j) {
            sums->r[j] += r[j];
            sums->rr[j] += r[j] * r[j];
        }
        sums->rr[3] += r[0] * r[1];
        sums->rr[4] += r[0] * r[2];
        sums->rr[5] += r[1] * r[2];
        return;
    }
    double row[6];
    normal_row(n, r, row);
    if (ends.body_a < model.bodies)
        sums->row_response[0] += packed_form(bodies.A_inverse + (size_t)ends.body_a * PACKED, row);
    normal_row(n, r_b, row);
    if (ends.body_b < model.bodies)
        sums->row_response[1] += packed_form(bodies.A_inverse + (size_t)ends.body_b * PACKED, row);
}

/* Sums with arms r + d, of a pair of `count` points. */
static __device__ __forceinline__ void shift_sums(struct pair_sums *sums, int32_t count, const double d[3])
{
    add_cross(d, sums->force, 1, sums->torque);
    sums->rr[3] += d[0] * sums->r[1] + d[1] * sums->r[0] + count * (d[0] * d[1]);
    sums->rr[4] += d[0] * sums->r[2] + d[2] * sums->r[0] + count * (d[0] * d[2]);
    sums->rr[5] += d[1] * sums->r[2] + d[2] * sums->r[1] + count * (d[1] * d[2]);
#pragma unroll
    for (int j = 0; j < 3; ++j) {
        sums->rr[j] += 2 * (d[j] * sums->r[j]) + count * (d[j] * d[j]);
        sums->r[j] += count * d[j];
    }
}

/* Of a side's body: <A^-1, sum J^T J> over points and rows. */
static __device__ __forceinline__ double side_response(const model_view &model, const body_view &bodies, int32_t side,
                                                       int32_t body, int32_t count, const rigid_inverse &rigid,
                                                       const struct pair_sums *sums)
{
    const double *rr = sums->rr;
    if (model.contact_rows == 1) return sums->row_response[side];
    if (bodies.rigid)
        return 3 * rigid.linear * count + rigid.xx * (rr[1] + rr[2]) + rigid.yy * (rr[0] + rr[2]) +
               rigid.zz * (rr[0] + rr[1]) - 2 * (rigid.xy * rr[3] + rigid.xz * rr[4] + rigid.yz * rr[5]);
    struct arm_sums arms = {(double)count, {sums->r[0], sums->r[1], sums->r[2]}, {}};
    double S[PACKED] = {};
    for (int j = 0; j < 6; ++j) arms.rr[j] = rr[j];
    add_arm_sums(S, &arms);
    return packed_dot(bodies.A_inverse + (size_t)body * PACKED, S);
}

struct side_numbers {
    solver_real of[SIDE_NUMBERS];
};

/* share: 1 / count. The response, which needs both sides, is stored by store_sides. */
static __device__ __forceinline__ void store_side(const weight_view &weights, int32_t p, int32_t side, int32_t count,
                                                  double share, bool first, double anchors,
                                                  const struct pair_sums *sums)
{
    const double sign = side ? 1 : -1, *f = sums->force;
    const size_t at = (size_t)(2 * p + side);
    const solver_real load = (solver_real)(sums->pushed * share);
    eight_numbers<double> wrench;
#pragma unroll
    for (int j = 0; j < 3; ++j) {
        wrench.of[j] = sign * f[j];
        wrench.of[j + 3] = sign * sums->torque[j];
    }
    wrench.of[SIDE_PUSH] = length3(f);
    wrench.of[SIDE_ANCHORS] = anchors;
    store_row(wrench, weights.side_wrench, at);
    if (!first) {
        weights.side_arms[at * SIDE_NUMBERS + SIDE_LOAD] = load;
        return;
    }
    side_numbers arms = {};
    arms.of[0] = (solver_real)count;
#pragma unroll
    for (int j = 0; j < 3; ++j) arms.of[1 + j] = (solver_real)sums->r[j];
#pragma unroll
    for (int j = 0; j < 6; ++j) arms.of[4 + j] = (solver_real)sums->rr[j];
    arms.of[SIDE_LOAD] = load;
    store_wide(arms, (side_numbers *)weights.side_arms + at);
}

/* Which side's record a lane makes: the first lane side a, the second side b; a single lane both, -1 here. */
static __device__ __forceinline__ int32_t side_of_lane(const contact_view &contacts, int32_t lane)
{
    return contacts.lanes == 1 ? -1 : lane;
}

/* Does the pair anchor its island, one of its bodies being static? */
static __device__ __forceinline__ bool pair_anchors(const model_view &model, int32_t count, const pair_bodies &ends,
                                                    double friction, const struct pair_sums *sums)
{
    if (count < 3 || model.contact_rows == 1) return false;
    if (ends.body_a < model.bodies && ends.body_b < model.bodies) return false;
    struct arm_sums arms = {(double)count, {sums->r[0], sums->r[1], sums->r[2]}, {}};
#pragma unroll
    for (int j = 0; j < 6; ++j) arms.rr[j] = sums->rr[j];
    return momentum_is_anchored(friction, &arms);
}

/* The records of a pair from its lanes' sums. `first`: also what depends on arms alone; rolls: sadmm_pair_rolls.
 * `inverse`: of the body at the lane's side. Every lane of the warp comes here. */
static __device__ __forceinline__ void store_sides(const model_view &model, const body_view &bodies,
                                                   const contact_view &contacts, const weight_view &weights, bool live,
                                                   int32_t p, int32_t lane, int32_t count, const pair_bodies &ends,
                                                   double friction, const real4 &difference, bool first, bool rolls,
                                                   const rigid_inverse &inverse,
                                                   struct pair_sums *sums)
{
    const double d[3] = {(double)difference.x, (double)difference.y, (double)difference.z}, share = 1 / (double)count;
    const int32_t own = side_of_lane(contacts, lane);
    double response = 0;
    sum_pair<0, LOAD_SUMS>(contacts, sums);
    if (first && model.contact_rows == 3) sum_pair<LOAD_SUMS, ARM_END>(contacts, sums);
    if (first && model.contact_rows == 1) sum_pair<ARM_END, PAIR_SUMS>(contacts, sums);
    double anchors = first && live && rolls ? ANCHORS_BY_ROLLING : 0;
    if (first && live && !rolls) anchors = pair_anchors(model, count, ends, friction, sums);
#pragma unroll
    for (int32_t side = 0; side < 2; ++side) {
        const int32_t body = side ? ends.body_b : ends.body_a;
        if (side) shift_sums(sums, count, d);
        if (!live || body >= model.bodies || (own >= 0 && own != side)) continue;
        store_side(weights, p, side, count, share, first, anchors, sums);
        if (!first) continue;
        response += side_response(model, bodies, side, body, count,
                                  own < 0 && bodies.rigid ? inverse_of_body(bodies, body) : inverse, sums);
    }
    if (!first) return;
    if (contacts.lanes > 1) response += __shfl_xor_sync((unsigned)ALL_LANES, response, 1);
    if (!live || lane > 1) return;
    response *= model.contact_rows == 3 ? share * (1.0 / 3) : share;
    for (int32_t side = 0; side < 2; ++side)
        if (own < 0 || own == side)
            weights.side_arms[(size_t)(2 * p + side) * SIDE_NUMBERS + SIDE_RESPONSE] = (solver_real)response;
    if (lane == 0) weights.response[p] = response;
}

#endif
