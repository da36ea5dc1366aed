/* The rows of a joint (core/model/joint_law.h): what is locked for all coordinates at once, what is free one by one. */
#include <string.h>

#include "core/math/lanes.h"
#include "joint_kernels.h"

/* joint_moving_of. */
static struct joint_moving moving_of(const struct sadmm_world_joint *joint, const struct acting_joint *acting,
                                     const struct joint_rates *rates, const struct joint_turn_bounds *bounds, int k,
                                     const sadmm_settings *settings)
{
    const bool radial = joint_is_radial(joint->def.kind);
    struct joint_coordinate_rates r = {.before = rates->before[k], .start = rates->start[k],
                                       .middle = rates->middle[k], .prescribed = rates->prescribed[k]};
    const double turning = r.start + r.prescribed - r.before;
    const bool turns = !((k > 0 || !radial) && joint_turns_within(bounds, k, turning, settings->dt)) &&
                       joint_turns(acting, k, radial, turning, settings->dt);
    for (int s = 0; !(joint->def.locks >> k & 1) && s < 2; ++s) {
        if (acting->side[s].system_body < 0) continue;
        r.free += joint_row_product(rates->row[s][k], acting->side[s].free);
        r.response += joint_response(&acting->side[s], rates->row[s][k]);
    }
    return joint_moving_by(&joint->def, &joint->next, acting, k, &r, turns, settings);
}

static void put_row(const struct acting_joint *acting, const struct joint_rates *rates, int k, int sign, size_t r,
                    const struct joint_row_lists *to)
{
    for (int s = 0; s < 2; ++s) {
        double *row = to->jacobian[s] + 6 * r;
        if (acting->side[s].system_body >= 0) memcpy(row, rates->row[s][k], 6 * sizeof *row);
        else memset(row, 0, 6 * sizeof *row);
        for (int j = 0; sign < 0 && j < 6; ++j) row[j] = -row[j];
    }
}

static void put_law(const struct sadmm_world_joint *joint, const struct joint_law *law, size_t r, double dt,
                    const struct joint_row_lists *to)
{
    to->gain[r] = law->gain, to->bias[r] = law->bias, to->compliance[r] = law->compliance;
    to->lo[r] = law->lo, to->hi[r] = law->hi;
    to->lambda[r] = to->multiplier[r] = law->sign * joint->next.force[law->role][law->coordinate] * dt;
    to->source[r] =
        (struct sadmm_joint_source){joint->number,   (int8_t)law->role, (int8_t)law->coordinate, (int8_t)law->sign,
                                    law->separation, law->slack,        law->prescribed};
}

/* All laws of coordinate k, from row r on. Returns how many they are. */
static int put_coordinate(struct sadmm_world_joint *joint, const struct acting_joint *acting,
                          const struct joint_rates *rates, const struct joint_turn_bounds *bounds, int k, size_t r,
                          const sadmm_settings *settings, const struct joint_row_lists *to)
{
    struct joint_laws laws;
    const struct joint_moving m = moving_of(joint, acting, rates, bounds, k, settings);
    if (joint_winds(joint->def.locks, k)) joint->next.angle[k] = m.value;
    const struct joint_table table = {joint->table[k], joint->table[k] ? joint->table[k] + joint->table_count[k] : NULL,
                                      joint->table_count[k]};
    joint_coordinate_laws(&joint->def, k, &m, joint->table[k] ? &table : NULL, &laws);
    joint->next.expected[k] = laws.expected, joint->next.missed[k] = laws.missed, joint->next.ahead[k] = laws.ahead;
    for (int i = 0; i < laws.count; ++i) {
        put_row(acting, rates, k, laws.law[i].sign, r + (size_t)i, to);
        put_law(joint, &laws.law[i], r + (size_t)i, settings->dt, to);
    }
    return laws.count;
}

/* ---- what is locked ---------------------------------------------------------------------------------------------- */

/* What the laws of locked coordinates are made of, in joint_moving's terms. */
struct locks {
    double turning[SIX_RATES], turned[SIX_RATES], feedback[SIX_RATES];
    bool beyond[SIX_RATES]; /* not joint_turns_within */
};

static inline lanes clamped(lanes a, double most)
{
    const lanes hi = lanes_fill(most), lo = lanes_fill(-most);
    const lanes_mask above = a > hi, below = a < lo;
    return lanes_choose(above, hi, lanes_choose(below, lo, a));
}

/* Three translations or rotations. The fourth lane is another coordinate's, or of no account. */
static inline void find_locks(const struct acting_joint *acting, const struct joint_rates *rates,
                              const struct joint_turn_bounds *bounds, bool late, int first,
                              const sadmm_settings *settings, struct locks *out)
{
    const double dt = settings->dt, most = JOINT_MOST_TURN * JOINT_MOST_TURN;
    const lanes before = lanes_at(rates->before + first), prescribed = lanes_at(rates->prescribed + first),
                turning = lanes_at(rates->middle + first) + prescribed - before,
                row_turning = lanes_at(rates->start + first) + prescribed - before,
                half = lanes_fill(dt / 2) * row_turning, bound = lanes_fill(bounds->rotation);
    const lanes_mask within = first ? (row_turning <= bound) & (-row_turning <= bound)
                                : half * half * lanes_fill(bounds->turn2) <= lanes_fill(most * most * bounds->around2);
    lanes_put(turning, out->turning + first);
    lanes_put((late ? lanes_fill(0) : turning) + prescribed, out->turned + first);
    lanes_put(clamped(lanes_fill(JOINT_FEEDBACK) * lanes_at(acting->start.value + first) / lanes_fill(dt),
                      settings->correction_speed),
              out->feedback + first);
    for (int k = 0; k < 3; ++k) out->beyond[first + k] = !within[k];
}

/* Of all of them, where none is a length. */
static int put_locks(struct sadmm_world_joint *joint, const struct acting_joint *acting,
                     const struct joint_rates *rates, const struct joint_turn_bounds *bounds,
                     const sadmm_settings *settings, const struct joint_row_lists *to)
{
    const double *force = joint->next.force[SADMM_ROLE_LOCK];
    const bool off = joint->next.trapezoid_off, follows = joint->next.followed && !joint_is_prescribed(acting);
    const double most[2] = {follows ? joint_most_missed_by(bounds, 0, settings->dt) : 0,
                            follows ? joint_most_missed_by(bounds, 3, settings->dt) : 0};
    struct locks locks;
    size_t r = 0;
    if (joint->def.locks & 7) find_locks(acting, rates, bounds, off, 0, settings, &locks);
    if (joint->def.locks & ~7u) find_locks(acting, rates, bounds, off, 3, settings, &locks);
    for (uint32_t left = joint->def.locks & JOINT_ALL_LOCKED; left; left &= left - 1, ++r) {
        const int k = __builtin_ctz(left);
        const double prescribed = rates->prescribed[k],
                     turning = rates->start[k] + prescribed - rates->before[k];
        const bool turns = locks.beyond[k] && joint_turns(acting, k, false, turning, settings->dt),
                   late = off || turns;
        const double now = acting->start.value[k] / settings->dt + rates->before[k] / 2;
        double missed = 0;
        const double ahead = late ? 0 : joint_foresee(&joint->next, k, now, most[k / 3], &missed);
        joint->next.expected[k] = now + locks.turning[k];
        joint->next.missed[k] = missed, joint->next.ahead[k] = ahead;
        put_row(acting, rates, k, 1, r, to);
        to->gain[r] = 1, to->compliance[r] = 0;
        to->lo[r] = -INFINITY, to->hi[r] = INFINITY;
        to->bias[r] = (turns ? prescribed : locks.turned[k]) + locks.feedback[k] - ahead;
        to->lambda[r] = to->multiplier[r] = force[k] * settings->dt;
        to->source[r] = (struct sadmm_joint_source){
            joint->number, SADMM_ROLE_LOCK, (int8_t)k, 1, 0, turns ? INFINITY : 0, prescribed};
    }
    return (int)r;
}

int SADMM_KERNEL(joint_laws)(struct sadmm_world_joint *joint, const struct acting_joint *acting,
                             const struct joint_rates *rates, const sadmm_settings *settings,
                             const struct joint_row_lists *to)
{
    const struct joint_turn_bounds bounds = joint_turn_bounds_of(acting);
    const bool radial = joint_is_radial(joint->def.kind);
    const uint32_t locks = joint->def.locks & JOINT_ALL_LOCKED, others = JOINT_ALL_LOCKED & ~locks;
    int count = 0;
    if (radial)
        for (uint32_t left = locks; left; left &= left - 1)
            count += put_coordinate(joint, acting, rates, &bounds, __builtin_ctz(left), (size_t)count, settings, to);
    else count = put_locks(joint, acting, rates, &bounds, settings, to);
    for (uint32_t left = radial ? others & 1 : others; left; left &= left - 1)
        count += put_coordinate(joint, acting, rates, &bounds, __builtin_ctz(left), (size_t)count, settings, to);
    return count;
}
