/* The step's own kernels (device/step.h): updates, start, admit, turn, commit. */
#include <stddef.h>

#include <algorithm>

#include "backend_cuda/device/double.h"

#include "collision/base/bounds.h"
#include "core/model/coupling_law.h"
#include "core/model/gear_law.h"
#include "core/model/joint_trapezoid.h"
#include "core/model/kinematic.h"

#include "backend_cuda/device/plan_check.h"
#include "move_articulated.h"
#include "world.h"

enum { STEP_THREADS = 64 }; /* a block: few, for long work and many multiprocessors */
enum { UPDATE_THREADS = 64, MOST_UPDATE_BLOCKS = 64 }; /* enough on their way to keep the bus to the host busy */
enum { TURN_THREADS = 256 }; /* more: bodies that are moved again have a thread each, side by side */

/* ---- updates --------------------------------------------------------------------------------------------------- */

/* SADMM_UPDATE_JOINT. A joint that is enabled again is whole again. */
static __device__ __forceinline__ void update_joint(const joint_view &joints, int32_t target, const double *values)
{
    const int32_t j = target / SADMM_JOINT_TARGETS, k = target % SADMM_JOINT_TARGETS;
    sadmm_joint_def *def = &joints.joints[j].def;
    if (k < JOINT_COORDINATES) {
        joint_coordinate_take(values, &def->coordinates[k]);
        return;
    }
    if (k > JOINT_COORDINATES) {
        struct sadmm_rigid *target = &const_cast<struct sadmm_coupling_memory *>(
            joints.couplings_before)[joints.joints[j].coupling].target;
        for (int i = 0; i < 3; ++i) target->position[i] = values[i];
        for (int i = 0; i < 4; ++i) target->orientation[i] = values[3 + i];
        for (int i = 0; i < 6; ++i) target->velocity[i] = values[7 + i];
        return;
    }
    def->enabled = values[0] != 0;
    const_cast<struct sadmm_joint_memory *>(joints.begin)[j].broken &= !def->enabled;
}

static __device__ __forceinline__ void update_state(struct sadmm_rigid *body, struct sadmm_extrapolation *extrapolation,
                                                    const double *values)
{
    extrapolation_set(extrapolation, body, values, values + 3, values + 7);
}

static __device__ __forceinline__ void update_kinematic(const kinematic_view &kinematic,
                                                        const struct sadmm_resident_update &update)
{
    struct sadmm_kinematic_body *body =
        &const_cast<struct sadmm_kinematic_body *>(kinematic.before)[sadmm_kinematic(update.target)];
    const double *values = update.values;
    if (update.kind == SADMM_UPDATE_STATE) return update_state(&body->rigid, &body->extrapolation, values);
    body->target = values[0] != 0;
    for (int k = 0; k < 3; ++k) body->position[k] = values[1 + k];
    for (int k = 0; k < 4; ++k) body->orientation[k] = values[4 + k];
    body->dt = values[8];
}

static __device__ __forceinline__ void apply_update(const cuda_view &v, const struct sadmm_resident_update &update)
{
    const double *values = update.values;
    if (update.kind == SADMM_UPDATE_SETTINGS) {
        struct cuda_settings *kept = (struct cuda_settings *)v.model.settings; /* its first member */
        struct sadmm_settings *settings = &kept->settings;
        int k = 0;
#define PUT(name) settings->name = values[k++];
        SADMM_EACH_SETTING_NUMBER(PUT)
#undef PUT
        kept->gravity = gravity_size(settings->gravity);
        return;
    }
    if (update.kind == SADMM_UPDATE_JOINT) return update_joint(v.joints, update.target, values);
    if (update.kind == SADMM_UPDATE_GEAR) {
        v.joints.gear[update.target].enabled = values[0] != 0;
        return;
    }
    if (sadmm_body_is_kinematic(update.target)) return update_kinematic(v.kinematic, update);
    struct sadmm_rigid *body = const_cast<struct sadmm_rigid *>(&v.step.before[update.target]);
    if (update.kind == SADMM_UPDATE_STATE) {
        update_state(body, const_cast<struct sadmm_extrapolation *>(&v.step.extrapolation_before[update.target]),
                     values);
    } else {
        for (int k = 0; k < 6; ++k) body->wrench[k] = values[k];
        body->gravity_scale = values[6];
        for (int k = 0; k < 2; ++k) body->damping[k] = values[7 + k];
    }
}
static_assert((int)SADMM_UPDATE_VALUES >= (int)SADMM_SETTING_NUMBERS && (int)SADMM_UPDATE_VALUES >= 13 &&
                  (int)SADMM_UPDATE_VALUES >= (int)JOINT_COORDINATE_NUMBERS,
              "every kind fits");

/* No two updates have the same kind and target. An update is fetched, all of it, from the host's memory before it is
 * known to be one: the number of updates is as far away. */
static __global__ void __launch_bounds__(UPDATE_THREADS)
    update_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const struct cuda_updates *updates = updates_of_step(v.step.updates, v.step.update_capacity,
                                                         v.step.control->sequence);
    const int32_t stride = (int32_t)gridDim.x * UPDATE_THREADS, abort_code = v.model.live->abort_code;
    for (int32_t i = (int32_t)(blockIdx.x * (unsigned)UPDATE_THREADS + threadIdx.x); i < v.step.update_capacity;
         i += stride) {
        const struct sadmm_resident_update update = first_update(updates)[i];
        if (i >= updates->count || abort_code) return;
        apply_update(v, update);
    }
}

/* ---- start ----------------------------------------------------------------------------------------------------- */

/* What a body brings along, in the order of both structures: position, orientation, velocity. Then, by a lane each,
 * what its wrench gives it and how often it was placed. */
enum { COPIED = 13, COPIED_VELOCITY = 7, LANE_FORCE = COPIED, LANE_TORQUE, LANE_PLACED, START_LANES };
static_assert(offsetof(struct sadmm_rigid, velocity) == COPIED_VELOCITY * sizeof(double) &&
                  offsetof(struct sadmm_collision_body, velocity) == COPIED_VELOCITY * sizeof(double),
              "numbers of a body are copied one by one");

/* Of body i, number `lane` of what it brings along. */
static __device__ __forceinline__ void start_body(const cuda_view &v, int64_t i, int32_t lane,
                                                  const struct sadmm_rigid *body,
                                                  const struct sadmm_extrapolation *extrapolation)
{
    /* Every lane fetches all that any of them needs, before it is known which: one wait for memory, not one a kind of
     * lane. */
    const int32_t slot = v.step.slot_of_body[i],
                  k = lane >= COPIED_VELOCITY && lane < COPIED ? lane - COPIED_VELOCITY : 0;
    const double number = ((const double *)body)[lane < COPIED ? lane : 0], dt = v.model.settings->dt,
                 last_dt = extrapolation->dt, change = extrapolation->change[k];
    const int32_t streak = extrapolation->streak[k / 3];
    const uint32_t placed = extrapolation->placed;
    const int32_t mean = body->mean;
    const vec3 force = v3_load(body->wrench), torque = v3_load(body->wrench + 3);
    const double scale = body->gravity_scale, damping[2] = {body->damping[0], body->damping[1]};
    struct sadmm_collision_body *out = &v.step.bodies[slot];
    if (lane < COPIED) ((double *)out)[lane] = number;
    if (lane >= COPIED_VELOCITY && lane < COPIED)
        v.step.start_velocity[6 * i + k] = extrapolate_velocity(number, streak, change, step_ratio(dt, last_dt));
    if (lane == LANE_FORCE)
        out->acceleration[0] = v3_max_abs(force) == 0 && scale == 1 && damping[0] == 0
                                   ? 0
                                   : forces_acceleration(body, gravity_of(v.model, (int32_t)i), dt);
    if (lane == LANE_TORQUE)
        out->acceleration[1] =
            v3_max_abs(torque) == 0 && damping[1] == 0 ? 0 : forces_angular_acceleration(body, dt);
    if (lane == LANE_PLACED) {
        out->placed = placed;
        out->mean = mean;
    }
}

/* START_LANES threads a body, a number each: neighbours in memory go to neighbours. */
static __global__ void start_step_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int64_t t = (int64_t)blockIdx.x * STEP_THREADS + threadIdx.x, i = t / START_LANES;
    const int32_t lane = (int32_t)(t % START_LANES);
    if (v.model.live->abort_code) return;
    if (t == 0) {
        v.step.control->depth = 0;
        v.step.control->offending_body = INT32_MAX;
        v.step.control->stamps[STAMP_START] = nanoseconds();
        v.step.control->joints = {};
    }
    if (i >= v.model.bodies) return;
    start_body(v, i, lane, &v.step.before[i], &v.step.extrapolation_before[i]);
}

/* ---- gates ----------------------------------------------------------------------------------------------------- */

/* One thread. What was found is this step's when it fits. */
static __global__ void admit_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    if (threadIdx.x > 0 || v.model.live->abort_code) return;
    const struct sadmm_cuda_contact_counts counts = *v.step.counts;
    v.step.control->stamps[STAMP_FOUND] = nanoseconds();
    v.step.control->counts = counts;
    v.step.control->substep = v.step.substep;
    if (counts.candidates > v.step.candidate_capacity || counts.points > v.step.point_capacity ||
        counts.pairs > v.contacts.pair_capacity) {
        v.model.live->abort_code = ABORT_CAPACITY;
        return;
    }
    if (counts.fast && v.step.leaves_hits) v.model.live->abort_code = ABORT_HITS;
    v.model.live->bodies = v.model.bodies;
    v.model.live->pairs = counts.pairs;
    v.model.live->points = counts.points;
}

/* ---- bodies again ---------------------------------------------------------------------------------------------- */

/* Body i again, now that all is known of its island. */
static __device__ __noinline__ void move_again(const cuda_view &v, int32_t i)
{
    const int32_t label = v.graph.label[i];
    const int island = v.islands.touch[label] | (v.islands.info[label].anchored_outside ? TOUCH_AS_A_RULE : 0),
              own = v.islands.touch[i];
    if (trapezoid_kind_of(island, own) == TRAPEZOID_OWN) return; /* it was moved so: what more is known now can only
                                                                    turn the correction off */
    const body_before before = fetch_body(v.step, i);
    const enum trapezoid_kind kind = body_trapezoid_kind(&before.body, island, own);
    if (kind == TRAPEZOID_OWN) return;
    const double dt = v.model.settings->dt;
    double velocity[6], place[PLACE];
    load_end_velocity(v, i, velocity);
    move_body(&before.body, halfway_of(v, i), velocity, dt, gravity_of(v.model, i), kind, place);
    store_moved(v, i, before, place, false, dt); /* finite, since both places were that it had to choose from */
}

/* Does any contact roll? */
static __device__ __forceinline__ bool rolls_again(const cuda_view &v)
{
    return v.step.limits && v.islands.again[AGAIN_ROLLS];
}

/* Have joints to do with body i's island: ISLAND_ARTICULATED; has its momentum been restored: ISLAND_RESTORED? */
static __device__ __forceinline__ bool island_is(const cuda_view &v, int32_t i, int what)
{
    return v.joints.count > 0 && !v.joints.apart && v.joints.touch[articulation_label(v, i)] & what;
}

/* What contacts that roll give body i to take along, which has been moved; -1: none. LANES threads a body, each with
 * every eighth of its sides. Every lane of the warp comes here. */
static __device__ __noinline__ void keep_rolling(const cuda_view &v, int32_t i, int32_t lane)
{
    const double dt = v.model.settings->dt;
    const int32_t slot = i >= 0 ? v.graph.slot_of[i] : 0, end = i >= 0 ? v.graph.offsets[slot + 1] : 0;
    const bool restored = i >= 0 && island_is(v, i, ISLAND_RESTORED);
    double sums[13] = {}, *owed = sums, *stiffness = sums + 6, *round = sums + 12; /* on round surfaces: how many */
    for (int32_t at = i >= 0 ? v.graph.offsets[slot] + lane : 0; at < end; at += LANES) {
        const int32_t code = v.graph.incident[at], side = code & 1;
        if (code / 2 >= v.contacts.pair_capacity) continue; /* rows */
        const struct sadmm_contact_pair *pair = &v.raw.pairs[code / 2];
        if (restored && pair->body_a >= 0 && pair->body_b >= 0) continue; /* the island has what it owes, in sum */
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
            const struct sadmm_contact_point *point = &v.raw.points[k];
            if (!point->migrates) continue;
            *round += point->migrates >= MIGRATES_SOON;
            const struct rolling_halfway halfway = rolling_halfway_of(pair->normal, point, &v.raw.migrations[k]);
            const double *arm = side ? point->arm_b : point->arm_a;
            rolling_owe(pair->normal, arm, halfway.normal, side ? halfway.arm_b : halfway.arm_a, point->impulse,
                        side ? 1 : -1, owed);
            rolling_stiffen(pair->normal, rolling_height(pair->normal, arm, point->separation),
                            v.raw.migrations[k].radius, sadmm_normal_impulse(pair, point), dt, stiffness);
        }
    }
    sum_lanes<13>(sums);
    if (i >= 0 && lane == 0)
        rolling_keep(&v.step.after[i], v.step.before[i].position, dt,
                     island_is(v, i, ISLAND_ARTICULATED) || *round == 0, owed, stiffness);
}

/* Body i, where its island has joints as they let it go; else again, if need be. */
static __device__ __forceinline__ void move_once_more(const cuda_view &v, int32_t i, bool again, bool articulated)
{
    const int32_t bits = articulated ? v.joints.touch[articulation_label(v, i)] : 0;
    if (articulated && !v.joints.is_articulated[i] && !(v.ncp.points && is_solved(v, i)))
        load_end_velocity(v, i, v.joints.velocity + 6 * (size_t)i);
    if (bits & ISLAND_ARTICULATED) move_articulated(v, i);
    else if (again) move_again(v, i);
}

/* Does a contact of body i roll? */
static __device__ __forceinline__ bool body_rolls(const cuda_view &v, int32_t i)
{
    return i < v.model.bodies && v.islands.touch[i] & TOUCH_ROLLS;
}

/* The bodies of a warp, of which each lane has moved one, i. Every lane of it comes here. */
static __device__ __forceinline__ void keep_rolling_of_warp(const cuda_view &v, int32_t i)
{
    const int32_t lane = (int32_t)(threadIdx.x % WARP), group = lane / LANES;
    __syncwarp(0xffffffffu); /* lanes see what others have moved */
    for (unsigned left = __ballot_sync(0xffffffffu, body_rolls(v, i)); left != 0;) {
        unsigned own = left;
        for (int k = 0; k < WARP / LANES; ++k) {
            if (k < group) own &= own - 1;
            left &= left - 1;
        }
        keep_rolling(v, own ? i - lane + __ffs((int)own) - 1 : -1, lane % LANES);
    }
}

/* Are there bodies to be moved again (move.h)? */
static __device__ __forceinline__ bool moves_again(const cuda_view &v)
{
    if (!v.step.limits) return false;
    const int32_t *why = v.islands.again;
    const int32_t again = why[AGAIN], closed = why[AGAIN_CLOSED], unpressed = why[AGAIN_UNPRESSED];
    return again || (closed && unpressed);
}

/* Are there pushes? Then what has to be moved again is, before it is pushed. */
static __device__ __forceinline__ bool some_pushed(const push_view &push)
{
    return push.planned && push.due[PUSH_DUE] != 0;
}

/* A thread a body. */
static __global__ void __launch_bounds__(TURN_THREADS)
    move_again_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t i = (int32_t)(blockIdx.x * (unsigned)TURN_THREADS + threadIdx.x);
    if (i >= v.model.bodies || v.model.live->abort_code || !as_planned(v.model, v.step) || !some_pushed(v.push)) return;
    const bool again = moves_again(v), articulated = v.joints.count > 0 && !v.joints.apart;
    if (again || articulated) move_once_more(v, i, again, articulated);
}

/* Has the step no need of a second problem, or one that fits (step/push.h)? Once all contacts have spoken. */
static __device__ __forceinline__ bool pushes_as_planned(const push_view &push)
{
    return !push.bits || push.due[push.planned ? PUSH_MISPREDICTED : PUSH_DUE] == 0;
}

/* Sub-steps with pushes, this one included. */
static __device__ __forceinline__ int32_t count_pushed(const push_view &push, int32_t before)
{
    if (!push.bits || before < 0) return before;
    return push.due[PUSH_MISPREDICTED] ? -1 : before + (push.due[PUSH_DUE] != 0);
}

/* ---- turn ------------------------------------------------------------------------------------------------------ */

/* What has become of the sub-step. One thread, once it has ended. */
static __device__ int32_t abort_of(int32_t aborted, bool planned, int32_t offending_body)
{
    return aborted ? aborted : !planned ? ABORT_PLAN : offending_body != INT32_MAX ? ABORT_NON_FINITE : ABORT_NONE;
}

/* The sub-step is added to those before it. args.count: its iterations. */
static __device__ struct cuda_step_totals totals_of(const cuda_view &v, const cuda_args &args)
{
    const struct cuda_step_totals zero = {0, -1, 0, 0, 0, 0, 0, 0, 0, 0, {}};
    const struct cuda_step_control *control = v.step.control;
    struct cuda_step_totals totals = v.step.substep > 0 ? control->totals : zero;
    totals.pushed = count_pushed(v.push, totals.pushed);
    const bool constrained = control->counts.points > 0 || control->joints.constraints > 0,
               spared = v.ncp.points && *v.ncp.unsolved == 0;
    const int32_t limited = v.step.limits ? *v.islands.limited : 0, islands = v.model.statistics->islands;
    double iterations = spared ? 0 : constrained ? args.count : 1;
    if (args.checks > 0) {
        const struct cuda_stop stop = *v.islands.stop;
        const int32_t unmet = spared ? *v.ncp.missed : stop.unmet[args.checks % CHECKS_KEPT];
        totals.unmet = unmet > totals.unmet ? unmet : totals.unmet;
        totals.met += unmet == 0;
        totals.most_iterations += spared ? 0 : stop.last;
        if (islands > 0 && !spared)
            iterations = ((double)(int64_t)stop.sum + (double)unmet * args.count) / islands;
    }
    totals.limited = limited > totals.limited ? limited : totals.limited;
    totals.cold += v.model.statistics->cold;
    totals.unsolved += v.ncp.points && *v.ncp.unsolved != 0;
    totals.constrained += constrained;
    totals.spared += constrained && spared;
    totals.iterations_mean += iterations;
    /* each phase goes on from where it was */
    for (int k = 1; k < STAMPS; ++k) totals.stamps[k] += control->stamps[k] - control->stamps[0];
    return totals;
}

/* The end of a sub-step that others follow, as seen by it: the account, and what the next one starts from. Threads as
 * in start_step_kernel. */
static __global__ void __launch_bounds__(TURN_THREADS, 4)
    turn_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int64_t t = (int64_t)blockIdx.x * TURN_THREADS + threadIdx.x, i = t / START_LANES,
                  own = (int64_t)blockIdx.x * (TURN_THREADS / START_LANES) + threadIdx.x;
    const int32_t lane = (int32_t)(t % START_LANES);
    struct cuda_step_control *control = v.step.control;
    if (v.model.live->abort_code) return;
    const bool articulated = v.joints.count > 0 && !v.joints.apart, again = moves_again(v),
               moves = (again || articulated) && !some_pushed(v.push), any = moves || rolls_again(v);
    if (moves && threadIdx.x < TURN_THREADS / START_LANES && own < v.model.bodies)
        move_once_more(v, (int32_t)own, again, articulated);
    if (articulated) end_joints(v, (int32_t)t);
    if (any) __syncthreads(); /* threads of a block start bodies that others of it have moved */
    if (rolls_again(v)) {
        keep_rolling(v, lane < LANES && body_rolls(v, (int32_t)i) ? (int32_t)i : -1, lane % LANES);
        __syncthreads();
    }
    if (t == 0) {
        control->stamps[STAMP_END] = nanoseconds();
        control->totals = totals_of(v, args);
        control->stamps[STAMP_START] = control->stamps[STAMP_END];
        const int32_t code = abort_of(ABORT_NONE, as_planned(v.model, v.step) && pushes_as_planned(v.push),
                                      control->offending_body);
        if (code) v.model.live->abort_code = code;
        else control->joints = {};
    }
    if (i >= v.model.bodies) return;
    start_body(v, i, lane, &v.step.after[i], &v.step.extrapolation_after[i]);
}

/* ---- commit ---------------------------------------------------------------------------------------------------- */

static __device__ double double_of(unsigned long long bits) { return __longlong_as_double((long long)bits); }

/* Threads a body: in small worlds as many as keep what it rolls by; in others, where that would be a burden when
 * nothing rolls, one. */
static __host__ __device__ inline int32_t commit_lanes(int32_t bodies) { return all_pdl(bodies) ? LANES : 1; }

static __device__ __forceinline__ void commit_bodies(const cuda_view &v, int32_t thread, bool articulated)
{
    const int32_t lanes = commit_lanes(v.model.bodies), i = thread / lanes, lane = thread % lanes;
    const bool again = moves_again(v), rolls = rolls_again(v);
    if (lane == 0 && (again || articulated) && !some_pushed(v.push) && i < v.model.bodies)
        move_once_more(v, i, again, articulated);
    if (!rolls) return;
    if (lanes == 1) return keep_rolling_of_warp(v, i);
    __syncwarp(0xffffffffu);
    keep_rolling(v, body_rolls(v, i) ? i : -1, lane);
}

/* Blocks of bodies (args.most_bodies of them) where some may have to be moved again; blocks of joints that bodies are
 * moved by; the last one's first thread reports, beside them. */
static __global__ void commit_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const bool planned = as_planned(v.model, v.step), reports = blockIdx.x == gridDim.x - 1;
    const int32_t aborted = v.model.live->abort_code;
    struct cuda_step_control *control = v.step.control;
    const int32_t i = (int32_t)(blockIdx.x * (unsigned)STEP_THREADS + threadIdx.x), body_blocks = args.most_bodies;
    pdl_wait();
    if (!reports) {
        /* Blocks that begin late may see what the report says of the step: only where what they move is of no use. */
        const bool on = !aborted && planned, articulated = on && v.joints.count > 0 && !v.joints.apart;
        if ((int32_t)blockIdx.x >= body_blocks) {
            if (articulated) end_joints(v, i - body_blocks * STEP_THREADS);
            return;
        }
        if (on) commit_bodies(v, i, articulated);
        return;
    }
    if (threadIdx.x > 0) return;
    struct cuda_step_report *report = &v.step.reports[control->sequence % STEPS_AHEAD];
    const int32_t offending_body = control->offending_body,
                  abort_code = abort_of(aborted, planned && pushes_as_planned(v.push), offending_body);
    control->stamps[STAMP_END] = nanoseconds();
    v.model.live->abort_code = abort_code;
    report->sequence = control->sequence++;
    report->abort_code = abort_code;
    report->offending_body = offending_body;
    report->substep = control->substep;
    report->counts = control->counts;
    report->statistics = *v.model.statistics;
    report->joints = control->joints;
    report->apart = v.joints.apart;
    report->depth = double_of(control->depth);
    report->primal = v.step.measured ? double_of(v.iteration.residual[0]) : -1;
    report->dual = v.step.measured ? double_of(v.iteration.residual[1]) : -1;
    report->totals = totals_of(v, args);
    __threadfence_system();
    *(volatile int64_t *)&report->ready = report->sequence + 1;
}

/* ---- launches -------------------------------------------------------------------------------------------------- */

/* Of the step whose turn it is on the device. */
sadmm_status CUDA(launch_updates)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    const int64_t blocks = ((int64_t)c->step->update_capacity + UPDATE_THREADS - 1) / UPDATE_THREADS;
    return CUDA(launch_of)(c, update_kernel, "update", std::min<int64_t>(blocks, MOST_UPDATE_BLOCKS), UPDATE_THREADS,
                           &args, error);
}

sadmm_status CUDA(launch_start)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    const int64_t blocks = (int64_t)c->view.model.bodies * START_LANES / STEP_THREADS + 1;
    TRY(CUDA(launch_of)(c, start_step_kernel, "start", blocks, STEP_THREADS, &args, error));
    return CUDA(launch_kinematic_start)(c, error);
}

/* Joints whose bodies move at the very end, once it is known where they may go. */
static int64_t moved_last(const struct sadmm_context *c)
{
    return c->view.joints.apart ? 0 : c->view.joints.count + c->view.joints.gears;
}

sadmm_status CUDA(launch_turn)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    const int64_t bodies = (int64_t)c->view.model.bodies * START_LANES, joints = moved_last(c),
                  blocks = (bodies > joints ? bodies : joints) / TURN_THREADS + 1;
    args.checks = c->checks;
    args.count = c->settings.iterations;
    return CUDA(launch_of)(c, turn_kernel, "turn", blocks, TURN_THREADS, &args, error);
}

sadmm_status CUDA(launch_move_again)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    const int64_t blocks = ((int64_t)c->view.model.bodies + TURN_THREADS - 1) / TURN_THREADS;
    return CUDA(launch_of)(c, move_again_kernel, "move again", blocks, TURN_THREADS, &args, error);
}

sadmm_status CUDA(launch_admit)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    return CUDA(launch)(c, admit_kernel, "admit", 1, &args, error);
}

sadmm_status CUDA(launch_commit)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    args.checks = c->checks;
    args.count = c->settings.iterations;
    const int64_t joints = moved_last(c), bodies = c->view.step.limits || joints ? c->view.model.bodies : 0;
    args.most_bodies = (int32_t)((bodies * commit_lanes((int32_t)bodies) + STEP_THREADS - 1) / STEP_THREADS);
    const int64_t blocks = args.most_bodies + (joints + STEP_THREADS - 1) / STEP_THREADS + 1;
    return CUDA(launch_pdl)(c, commit_kernel, "commit", blocks, STEP_THREADS, &args, error);
}
