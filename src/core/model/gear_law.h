/* A gear in a (sub-)step: one hard row, the sum of two coordinates' rows (docs/internals/algorithm.md, "Gears and
 * couplings"), for a host that makes steps and a device that does. In double.
 *
 * Where a dynamic body carries the axles of both joints, that sum is a row on three bodies, and rows are on two. But
 * the joints' locked rows may be added to it, each as often as one likes: they hold anyway, and so does their sum with
 * it. They are added so that nothing is left on the carrier. What they stand for is the teeth: what presses wheel on
 * wheel, while the bearings hold the carrier. */
#ifndef SADMM_CORE_MODEL_GEAR_LAW_H
#define SADMM_CORE_MODEL_GEAR_LAW_H

#include "core/math/ldl6.h"
#include "joint_law.h"

enum { GEAR_JOINTS = 2, GEAR_BODIES = 3, GEAR_LOCKS = GEAR_JOINTS * JOINT_COORDINATES };

/* How small what is left on the carrier must be, and how large the shares of locked rows may be, both of what was
 * there: rounding of axes that are parallel, which no sum of rows joins, stays outside of both. */
#define GEAR_MOST_LEFT 1e-9
#define GEAR_MOST_SHARE 1e4

/* A gear as a backend that keeps the world has it. */
struct sadmm_resident_gear {
    int32_t joint[GEAR_JOINTS], coordinate[GEAR_JOINTS]; /* joints: as they are loaded */
    double ratio, offset;
    int32_t enabled;
    int32_t body[2]; /* dynamic bodies that its row is on; -1: none */
};

/* What it is between. */
struct gear_joint {
    const sadmm_joint_def *def;
    const struct sadmm_joint_memory *memory; /* of the (sub-)step at hand: angles, and what locks foresee */
    int coordinate;
    double factor;                           /* 1, or the ratio */
};

/* Of a step: its row on the bodies, and its bias. */
struct acting_gear {
    struct acting_joint joint[GEAR_JOINTS];
    int32_t body[GEAR_BODIES]; /* -1: none */
    double row[GEAR_BODIES][6], bias;
    int count;
};

SADMM_INLINE void gear_add_row(struct acting_gear *acting, int32_t body, const double row[6], double factor)
{
    int at = 0, j;
    while (at < acting->count && acting->body[at] != body) ++at;
    acting->count += at == acting->count;
    acting->body[at] = body;
    for (j = 0; j < 6; ++j) acting->row[at][j] += factor * row[j];
}

/* A coordinate's row of a joint, on all of its dynamic bodies. */
SADMM_INLINE void gear_add_coordinate(struct acting_gear *acting, int i, int k, double factor)
{
    int s;
    for (s = 0; s < 2; ++s) {
        double row[6];
        if (acting->joint[i].side[s].system_body < 0) continue;
        joint_step_row(&acting->joint[i], s, k, row);
        gear_add_row(acting, acting->joint[i].side[s].system_body, row, factor);
    }
}

/* Nothing is known yet but the joints. */
SADMM_INLINE void gear_begin(struct acting_gear *acting)
{
    int b, j;
    acting->count = 0;
    acting->bias = 0;
    for (b = 0; b < GEAR_BODIES; ++b) {
        acting->body[b] = -1;
        for (j = 0; j < 6; ++j) acting->row[b][j] = 0;
    }
}

/* By its joints, which act: acting->joint. */
SADMM_INLINE void gear_act(const struct gear_joint joint[GEAR_JOINTS], double offset,
                           const struct sadmm_settings *settings, struct acting_gear *acting)
{
    double error = -offset;
    int i;
    gear_begin(acting);
    for (i = 0; i < GEAR_JOINTS; ++i) {
        const int k = joint[i].coordinate;
        const struct joint_moving m = joint_moving_of(joint[i].def, joint[i].memory, &acting->joint[i], k, settings);
        error += joint[i].factor * m.value;
        acting->bias += joint[i].factor * m.turned;
        gear_add_coordinate(acting, i, k, joint[i].factor);
    }
    acting->bias += joint_feedback(error, settings->dt, settings->correction_speed);
}

/* ---- a carrier that moves ---------------------------------------------------------------------------------------- */

/* The side of either joint that is on the body of both; the two bodies are the same. */
SADMM_INLINE void gear_carrier(const struct acting_gear *acting, int side[GEAR_JOINTS])
{
    int s, t;
    side[0] = side[1] = 0;
    for (s = 0; s < 2; ++s)
        for (t = 0; t < 2; ++t)
            if (acting->joint[0].side[s].system_body == acting->joint[1].side[t].system_body) side[0] = s, side[1] = t;
}

/* The locked rows of both joints on the carrier. */
struct gear_locks {
    double on_carrier[GEAR_LOCKS][6]; /* forces, and torques over `length` */
    double scale[GEAR_LOCKS];         /* of each: the row is that times the one above */
    int joint[GEAR_LOCKS], coordinate[GEAR_LOCKS];
    int count;
};

/* A torque counts as a force on an arm as long as the carrier is wide. */
SADMM_INLINE double gear_length(const struct acting_gear *acting, const int side[GEAR_JOINTS])
{
    const struct joint_geometry *one = &acting->joint[0].middle, *two = &acting->joint[1].middle;
    const struct sadmm_rigid *rigid = acting->joint[0].side[side[0]].rigid;
    const vec3 apart = v3_sub(side[0] ? one->arm_b : one->arm_a, side[1] ? two->arm_b : two->arm_a);
    return v3_norm(apart) + sqrt(v3_max_abs(v3_load(rigid->inertia)) / rigid->mass);
}

SADMM_INLINE void gear_list_locks(const struct gear_joint joint[GEAR_JOINTS], const struct acting_gear *acting,
                                  const int side[GEAR_JOINTS], double length, struct gear_locks *locks)
{
    int i, k, j;
    locks->count = 0;
    for (i = 0; i < GEAR_JOINTS; ++i)
        for (k = 0; k < JOINT_COORDINATES; ++k) {
            double *row = locks->on_carrier[locks->count];
            if (!(joint[i].def->locks >> k & 1)) continue;
            locks->joint[locks->count] = i;
            locks->coordinate[locks->count] = k;
            locks->scale[locks->count] = k < 3 ? 1 : length;
            joint_step_row(&acting->joint[i], side[i], k, row);
            for (j = 0; j < 6; ++j) row[j] *= locks->scale[locks->count] / (j < 3 ? 1 : length);
            ++locks->count;
        }
}

/* The shares of locked rows of which the sum is -wanted, and which are the smallest; false: there are none. */
SADMM_INLINE bool gear_find_shares(const struct gear_locks *locks, const double wanted[6], double share[GEAR_LOCKS])
{
    double S[36], L[36], z[6], left = 0, size = 0, most = 0;
    int n, r, c;
    for (r = 0; r < 36; ++r) S[r] = 0;
    for (n = 0; n < locks->count; ++n)
        for (r = 0; r < 6; ++r)
            for (c = 0; c < 6; ++c) S[6 * r + c] += locks->on_carrier[n][r] * locks->on_carrier[n][c];
    ldl6_factor(S, L);
    ldl6_solve(L, wanted, z);
    for (n = 0; n < locks->count; ++n) {
        share[n] = -six_product(locks->on_carrier[n], z);
        most += share[n] * share[n];
    }
    for (r = 0; r < 6; ++r) {
        double sum = wanted[r];
        for (n = 0; n < locks->count; ++n) sum += share[n] * locks->on_carrier[n][r];
        left += sum * sum;
        size += wanted[r] * wanted[r];
    }
    return left <= GEAR_MOST_LEFT * GEAR_MOST_LEFT * size && most <= GEAR_MOST_SHARE * GEAR_MOST_SHARE * size;
}

/* The carrier is no body of the row. */
SADMM_INLINE void gear_drop_body(struct acting_gear *acting, int at)
{
    int j;
    --acting->count;
    acting->body[at] = acting->body[acting->count];
    for (j = 0; j < 6; ++j) acting->row[at][j] = acting->row[acting->count][j];
}

/* The row of a gear on three bodies without the carrier; false: the axes are such that nothing between the other two
 * can turn both. */
SADMM_INLINE bool gear_leave_carrier(const struct gear_joint joint[GEAR_JOINTS], const struct sadmm_settings *settings,
                                     struct acting_gear *acting)
{
    struct gear_locks locks;
    double share[GEAR_LOCKS], wanted[6], length;
    int side[GEAR_JOINTS], at = 0, j, n;
    bool reaches;
    gear_carrier(acting, side);
    length = gear_length(acting, side);
    while (acting->body[at] != acting->joint[0].side[side[0]].system_body) ++at;
    for (j = 0; j < 6; ++j) wanted[j] = acting->row[at][j] / (j < 3 ? 1 : length);
    gear_list_locks(joint, acting, side, length, &locks);
    reaches = gear_find_shares(&locks, wanted, share);
    for (n = 0; reaches && n < locks.count; ++n) {
        const int i = locks.joint[n], k = locks.coordinate[n];
        const struct joint_moving m = joint_moving_of(joint[i].def, joint[i].memory, &acting->joint[i], k, settings);
        share[n] *= locks.scale[n];
        gear_add_coordinate(acting, i, k, share[n]);
        acting->bias += share[n] * (m.turned + joint_feedback(m.value, settings->dt, settings->correction_speed) -
                                    joint[i].memory->ahead[k]);
    }
    gear_drop_body(acting, at);
    return reaches;
}

/* Which of the bodies of a row on two at most are a and b; one alone is b. */
SADMM_INLINE void gear_sides(const struct acting_gear *acting, int *a, int *b)
{
    *b = acting->count > 0 ? acting->count - 1 : 0;
    *a = *b > 0 ? 0 : 1;
}

/* These bodies, whatever the numbers of the row: side[i][s], of joint i; -1: not dynamic. */
SADMM_INLINE void gear_row_bodies(const int32_t side[GEAR_JOINTS][2], int32_t body[2])
{
    const double none[6] = {0, 0, 0, 0, 0, 0};
    struct acting_gear acting;
    int at[GEAR_JOINTS], i, s, a, b;
    gear_begin(&acting);
    for (i = 0; i < GEAR_JOINTS; ++i)
        for (s = 0; s < 2; ++s) {
            acting.joint[i].side[s].system_body = side[i][s];
            if (side[i][s] >= 0) gear_add_row(&acting, side[i][s], none, 0);
        }
    if (acting.count == GEAR_BODIES) {
        gear_carrier(&acting, at);
        for (i = 0; acting.body[i] != side[0][at[0]];) ++i;
        gear_drop_body(&acting, i);
    }
    gear_sides(&acting, &a, &b);
    body[0] = acting.count > 1 ? acting.body[a] : -1;
    body[1] = acting.count > 0 ? acting.body[b] : -1;
}

#endif
