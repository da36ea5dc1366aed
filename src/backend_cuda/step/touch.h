/* What contacts do to bodies as a step ends. A body's eight lanes take every eighth of its sides each: wrenches, what
 * presses, and where it does not rest. Lanes of pairs: where trapezoid corrections would close a contact
 * (math/trapezoid.h). In double. */
#ifndef SADMM_CUDA_STEP_TOUCH_H
#define SADMM_CUDA_STEP_TOUCH_H

#include "backend_cuda/device/wide.h"
#include "backend_cuda/iterate/slow.h"
#include "backend_cuda/iterate/solution.h"

/* A body: its velocity before the step and at its end, and its trapezoid correction. */
struct trapezoid_body {
    double before[6], velocity[6], correction[6];
};

/* WHOLE: a whole step, where iterations have left `state`; else that is how the step ends. */
template <bool WHOLE>
static __device__ __forceinline__ trapezoid_body load_trapezoid_body(const cuda_view &v, int32_t body)
{
    const struct sadmm_rigid *rigid = wide_at(v.raw.system.rigid, (size_t)body);
    trapezoid_body out;
    solver_real velocity[6];
    const bool supported = WHOLE ? is_supported(v) : v.raw.system.support_motion != nullptr;
    if (WHOLE) end_velocity(v, body, velocity);
    else
        for (int k = 0; k < 6; ++k) velocity[k] = row_at(v.bodies.state, (size_t)body)[k];
    double before[6];
    for (int k = 0; k < 6; ++k) {
        out.before[k] = rigid->velocity[k];
        before[k] = k < 3 ? out.before[k] : halfway_of(v, body)[HALFWAY_ANGULAR + k - 3];
        out.velocity[k] = (double)velocity[k];
        if (supported) out.velocity[k] += v.raw.system.support_motion[6 * (size_t)body + (size_t)k];
    }
    body_trapezoid(rigid, before, out.velocity, out.correction);
    return out;
}

/* What contacts of a body compare with: the linear and angular parts of its speed (trapezoid_size_at), and
 * trapezoid_rest_speed. */
struct trapezoid_speeds {
    double moves[2], rest;
    int touch; /* forces_touch */
};

template <bool WHOLE>
static __device__ __forceinline__ trapezoid_speeds load_trapezoid_speeds(const cuda_view &v, int32_t body)
{
    const struct sadmm_rigid *rigid = wide_at(v.raw.system.rigid, (size_t)body);
    const trapezoid_body own = load_trapezoid_body<WHOLE>(v, body);
    const trapezoid_speeds out = {
        {trapezoid_speed_part(own.before, own.velocity, 0), trapezoid_speed_part(own.before, own.velocity, 1)},
        trapezoid_rest_speed(gravity_of(v.model, body), rigid->gravity_scale, rigid->wrench, rigid->mass,
                             v.model.settings->dt),
        forces_touch(rigid)};
    return out;
}

/* A side of a body, but for its points: what is known before the iterations end. */
struct touching {
    int32_t pair, side; /* pair < 0: none */
    int32_t first, count, other;
    double normal[3], friction;
};

static __device__ __forceinline__ touching fetch_touching(const cuda_view &v, int32_t at, int32_t end)
{
    touching out = {-1, 0, 0, 0, -1, {}, 0};
    if (at >= end) return out;
    const int32_t code = v.graph.incident[at];
    if (code / 2 >= v.contacts.pair_capacity) return out; /* rows: problems alone have them */
    const struct sadmm_contact_pair *pair = wide_at(v.raw.pairs, (size_t)(code / 2));
    out.pair = code / 2, out.side = code & 1;
    out.first = pair->first, out.count = pair->count;
    out.other = out.side ? pair->body_a : pair->body_b;
    out.friction = pair->friction;
    for (int k = 0; k < 3; ++k) out.normal[k] = pair->normal[k];
    return out;
}

/* Sums over sides: J^T lambda / dt, (12) with lambda = -u; bits of the island and of the body. */
struct contact_sums {
    double wrench[6];
    int touch;
};

/* Points of a side that are fetched before the first of them is used. What a lane fetches under a condition is waited
 * for one by one, so the last point stands for those beyond it. */
struct touching_points {
    double arm[POINTS_AT_ONCE][3];
    solver_real impulse[POINTS_AT_ONCE][3];
};

/* Those from k on: arms, known before the iterations end, */
static __device__ __forceinline__ void fetch_arms(const raw_view &raw, const touching &t, int32_t k,
                                                  touching_points *out)
{
#pragma unroll
    for (int32_t j = 0; j < POINTS_AT_ONCE; ++j) {
        const struct sadmm_contact_point *point =
            wide_at(raw.points, (size_t)(t.first + (k + j < t.count ? k + j : t.count - 1)));
        const double *arm = t.side ? point->arm_b : point->arm_a;
#pragma unroll
        for (int i = 0; i < 3; ++i) out->arm[j][i] = arm[i];
    }
}

/* and impulses. */
static __device__ __forceinline__ void fetch_impulses(const contact_view &contacts, const touching &t, int32_t k,
                                                      touching_points *out)
{
#pragma unroll
    for (int32_t j = 0; j < POINTS_AT_ONCE; ++j) {
        const solver_real *lambda =
            contacts.lambda + point_slot(contacts, t.pair, k + j < t.count ? k + j : t.count - 1);
#pragma unroll
        for (int i = 0; i < 3; ++i) out->impulse[j][i] = lambda[(size_t)i * contacts.lambda_stride];
    }
}

/* `points`: those from k on. */
template <bool TRAPEZOID>
static __device__ __forceinline__ void add_points(const trapezoid_speeds &own, const touching &t, int32_t k,
                                                  const touching_points &points, double per_dt, contact_sums *sums)
{
    const double sign = t.side ? per_dt : -per_dt;
#pragma unroll
    for (int32_t j = 0; j < POINTS_AT_ONCE; ++j) {
        if (k + j >= t.count) continue;
        const double *arm = points.arm[j];
        const double impulse[3] = {(double)points.impulse[j][0], (double)points.impulse[j][1],
                                   (double)points.impulse[j][2]};
        double torque[3] = {};
        add_cross(arm, impulse, 1, torque);
#pragma unroll
        for (int i = 0; i < 3; ++i) {
            sums->wrench[i] += sign * impulse[i];
            sums->wrench[i + 3] += sign * torque[i];
        }
        if (TRAPEZOID)
            sums->touch |= trapezoid_push(dot3(t.normal, impulse), trapezoid_size_at(own.moves[0], own.moves[1], arm),
                                          own.rest);
    }
}

/* A body's lane begins: its first side, at place `at` of [at, end), and that one's first arms. */
struct touching_begun {
    int32_t at, end;
    touching first;
    touching_points points;
};
static __device__ __forceinline__ touching_begun begin_touching(const cuda_view &v, int32_t at, int32_t end)
{
    touching_begun out = {at, end, fetch_touching(v, at, end), {}};
    if (out.first.pair >= 0) fetch_arms(v.raw, out.first, 0, &out.points);
    return out;
}

/* Of a body; in all of its lanes. The first impulses are there. Every lane of the warp comes here. */
template <bool TRAPEZOID>
static __device__ __forceinline__ contact_sums sum_touching(const cuda_view &v, const trapezoid_speeds &own,
                                                            touching_begun *begun)
{
    const double per_dt = 1 / v.model.settings->dt;
    contact_sums sums = {{}, own.touch};
    touching &t = begun->first;
    touching_points &points = begun->points;
    for (int32_t at = begun->at; at < begun->end;) {
        for (int32_t k = 0; t.pair >= 0;) {
            add_points<TRAPEZOID>(own, t, k, points, per_dt, &sums);
            k += POINTS_AT_ONCE;
            if (k >= t.count) break;
            fetch_arms(v.raw, t, k, &points);
            fetch_impulses(v.contacts, t, k, &points);
        }
        if (TRAPEZOID && t.pair >= 0)
            sums.touch |= body_contact_touch(t.other >= 0, t.friction);
        at += LANES;
        if (at >= begun->end) break;
        t = fetch_touching(v, at, begun->end);
        if (t.pair < 0) continue;
        fetch_arms(v.raw, t, 0, &points);
        fetch_impulses(v.contacts, t, 0, &points);
    }
    sum_lanes<6>(sums.wrench);
#pragma unroll
    for (int o = 1; o < LANES; o *= 2) sums.touch |= __shfl_xor_sync((unsigned)ALL_LANES, sums.touch, o);
    return sums;
}

enum { TOUCH_OF_BODY = TOUCH_SUPPORTED | TOUCH_MOVED | TOUCH_ROLLS };

/* Bits only come: one that is there already needs no more. */
static __device__ __forceinline__ void add_bits(int32_t *to, int bits)
{
    if (bits & ~*to) atomicOr(to, bits);
}

/* Of a body, and of the island that `label` names. */
static __device__ __forceinline__ void add_touch(const island_view &islands, int32_t body, int32_t label, int touch)
{
    add_bits(&islands.touch[body], touch & TOUCH_OF_BODY);
    add_bits(&islands.touch[label], touch & ~TOUCH_OF_BODY);
}

/* What is known of a pair before the iterations end. */
struct pair_ends {
    int32_t body[2]; /* < 0: not dynamic */
    double normal[3];
};

static __device__ __forceinline__ pair_ends fetch_ends(const struct sadmm_contact_pair *pair)
{
    const pair_ends ends = {{pair->body_a, pair->body_b}, {pair->normal[0], pair->normal[1], pair->normal[2]}};
    return ends;
}

/* What trapezoid corrections of bodies at a contact close: its normal and point, halfway through the step. */
static __device__ __forceinline__ void add_way(const cuda_view &v, const trapezoid_body sides[2],
                                               const double normal[3], const double arm_a[3], const double arm_b[3],
                                               const struct sadmm_contact_point *point, uint32_t migrates,
                                               struct trapezoid_touch *touch)
{
    const double dt = v.model.settings->dt, slop = v.model.settings->slop;
    const double corrections[2] = {-trapezoid_along(normal, sides[0].correction, arm_a),
                                   trapezoid_along(normal, sides[1].correction, arm_b)},
                 size[2] = {trapezoid_size(sides[0].correction, point->arm_a),
                            trapezoid_size(sides[1].correction, point->arm_b)},
                 speed = trapezoid_along(normal, sides[1].velocity, arm_b) -
                         trapezoid_along(normal, sides[0].velocity, arm_a);
    if (trapezoid_is_still(size, dt, slop)) return;
    const struct trapezoid_separation separation = {point->separation, speed,
                                                    {size3(point->arm_a), size3(point->arm_b)}, migrates};
    trapezoid_add_way(touch, separation, corrections, size, dt, slop);
}

/* Of the lane's points that roll. By itself, with all that it needs: few do, and the others should not pay in
 * registers. Bits of the island and of both bodies, a byte each. */
template <bool WHOLE>
static __device__ __noinline__ int add_rolling_ways(const cuda_view &v, pair_ends ends, int32_t first, int32_t count,
                                                    int32_t lane)
{
    struct trapezoid_touch touch = {TOUCH_ROLLS, {TOUCH_ROLLS, TOUCH_ROLLS}};
    trapezoid_body sides[2] = {};
    for (int s = 0; s < 2; ++s)
        if (ends.body[s] >= 0) sides[s] = load_trapezoid_body<WHOLE>(v, ends.body[s]);
    for (int32_t k = first + lane; k < first + count; k += v.contacts.lanes) {
        const struct sadmm_contact_point *point = &v.raw.points[k];
        if (!point->migrates) continue;
        const struct rolling_halfway at = rolling_halfway_of(ends.normal, point, &v.raw.migrations[k]);
        add_way(v, sides, at.normal, at.arm_a, at.arm_b, point, point->migrates, &touch);
    }
    return touch.island | touch.body[0] << 8 | touch.body[1] << 16;
}

/* What trapezoid corrections of a pair's bodies close, by its points, every v.contacts.lanes-th from `lane` on; returns
 * all bits. */
template <bool WHOLE>
static __device__ __forceinline__ int add_ways(const cuda_view &v, const pair_ends &ends, int32_t first, int32_t count,
                                                int32_t lane)
{
    struct trapezoid_touch touch = {0, {0, 0}};
    bool rolls = false;
    trapezoid_body sides[2] = {};
#pragma unroll
    for (int s = 0; s < 2; ++s)
        if (ends.body[s] >= 0) sides[s] = load_trapezoid_body<WHOLE>(v, ends.body[s]);
    for (int32_t k = lane; k < count; k += v.contacts.lanes) {
        const struct sadmm_contact_point *point = wide_at(v.raw.points, (size_t)(first + k));
        if (point->migrates) rolls = true;
        else add_way(v, sides, ends.normal, point->arm_a, point->arm_b, point, MIGRATES_NOT, &touch);
    }
    const int rolling = rolls ? add_rolling_ways<WHOLE>(v, ends, first, count, lane) : 0;
    touch.island |= rolling & 0xff;
    touch.body[0] |= rolling >> 8 & 0xff;
    touch.body[1] |= rolling >> 16 & 0xff;
    const int all = touch.island | touch.body[0] | touch.body[1];
    if (all == 0) return 0;
#pragma unroll
    for (int s = 0; s < 2; ++s)
        if (ends.body[s] >= 0)
            add_touch(v.islands, ends.body[s], v.graph.label[ends.body[s]], touch.island | touch.body[s]);
    return all;
}

#endif
