/* The step's own kernels (device/step.h): edits, start, admit, turn, commit. */
#include <stddef.h>

#include "backend_cuda/device/double.h"

#include "collision/bounds.h"

#include "backend_cuda/device/plan_check.h"
#include "move.h"
#include "world.h"

enum { STEP_THREADS = 64 }; /* a block: few, for long work and many multiprocessors */
enum { TURN_THREADS = 256 }; /* more: bodies that are moved again have a thread each, side by side */

/* ---- edits ----------------------------------------------------------------------------------------------------- */

/* A thread an edit: no two have the same kind and target. */
static __global__ void edit_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    int32_t i = thread_index();
    if (i >= args.count || v.model.live->abort_code) return;
    const struct sadmm_resident_edit *edit = &args.edits[i];
    const double *values = edit->values;
    if (edit->kind == SADMM_EDIT_SETTINGS) {
        struct cuda_settings *kept = (struct cuda_settings *)v.model.settings; /* its first member */
        struct sadmm_settings *settings = &kept->settings;
        int k = 0;
#define PUT(name) settings->name = values[k++];
        SADMM_EACH_SETTING_NUMBER(PUT)
#undef PUT
        kept->gravity = gravity_size(settings->gravity);
        return;
    }
    struct sadmm_rigid *body = const_cast<struct sadmm_rigid *>(&v.step.before[edit->target]);
    if (edit->kind == SADMM_EDIT_STATE) {
        steady_place(const_cast<struct sadmm_steady *>(&v.step.steady_before[edit->target]), body, values, values + 3);
        for (int k = 0; k < 3; ++k) body->position[k] = values[k];
        for (int k = 0; k < 4; ++k) body->orientation[k] = values[3 + k];
        for (int k = 0; k < 6; ++k) body->velocity[k] = values[7 + k];
    } else {
        for (int k = 0; k < 6; ++k) body->wrench[k] = values[k];
        body->gravity_scale = values[6];
        for (int k = 0; k < 2; ++k) body->damping[k] = values[7 + k];
    }
}
static_assert((int)SADMM_EDIT_VALUES >= (int)SADMM_SETTING_NUMBERS && (int)SADMM_EDIT_VALUES >= 13, "every kind fits");

/* ---- start ----------------------------------------------------------------------------------------------------- */

/* What a body brings along, in the order of both structures: position, orientation, velocity. Then, by a lane each,
 * what its wrench gives it and how often it was placed. */
enum { CARRIED = 13, CARRIED_VELOCITY = 7, LANE_FORCE = CARRIED, LANE_TORQUE, LANE_PLACED, START_LANES };
static_assert(offsetof(struct sadmm_rigid, velocity) == CARRIED_VELOCITY * sizeof(double) &&
                  offsetof(struct sadmm_collision_body, velocity) == CARRIED_VELOCITY * sizeof(double),
              "numbers of a body are copied one by one");

/* Of body i, number `lane` of what it brings along. */
static __device__ __forceinline__ void start_body(const cuda_view &v, int64_t i, int32_t lane,
                                                  const struct sadmm_rigid *body, const struct sadmm_steady *steady)
{
    /* Every lane fetches all that any of them needs, before it is told apart: one wait for memory, not one a kind of
     * lane. */
    const int32_t slot = v.step.slot_of_body[i],
                  k = lane >= CARRIED_VELOCITY && lane < CARRIED ? lane - CARRIED_VELOCITY : 0;
    const double number = ((const double *)body)[lane < CARRIED ? lane : 0], dt = v.model.settings->dt,
                 last_dt = steady->dt, change = steady->change[k];
    const int32_t streak = steady->streak[k / 3];
    const uint32_t placed = steady->placed;
    const vec3 force = v3_load(body->wrench), torque = v3_load(body->wrench + 3);
    const double scale = body->gravity_scale, damping[2] = {body->damping[0], body->damping[1]};
    struct sadmm_collision_body *out = &v.step.bodies[slot];
    if (lane < CARRIED) ((double *)out)[lane] = number;
    if (lane >= CARRIED_VELOCITY && lane < CARRIED)
        v.step.start_velocity[6 * i + k] = steady_velocity(number, streak, change, step_ratio(dt, last_dt));
    if (lane == LANE_FORCE)
        out->acceleration[0] = v3_max_abs(force) == 0 && scale == 1 && damping[0] == 0
                                   ? 0
                                   : forces_acceleration(body, v.model.settings->gravity, dt);
    if (lane == LANE_TORQUE)
        out->acceleration[1] =
            v3_max_abs(torque) == 0 && damping[1] == 0 ? 0 : forces_angular_acceleration(body, dt);
    if (lane == LANE_PLACED) out->placed = placed;
}

/* START_LANES threads a body, a number each: neighbours in memory go to neighbours. */
static __global__ void start_step_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    const int64_t t = (int64_t)blockIdx.x * STEP_THREADS + threadIdx.x, i = t / START_LANES;
    const int32_t lane = (int32_t)(t % START_LANES);
    if (v.model.live->abort_code) return;
    if (t == 0) {
        v.step.control->depth = 0;
        v.step.control->offending_body = INT32_MAX;
        v.step.control->stamps[STAMP_START] = nanoseconds();
    }
    if (i >= v.model.bodies) return;
    start_body(v, i, lane, &v.step.before[i], &v.step.steady_before[i]);
}

/* ---- gates ----------------------------------------------------------------------------------------------------- */

/* One thread. What was found is this step's when it fits. */
static __global__ void admit_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
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
    v.model.live->bodies = v.model.bodies;
    v.model.live->pairs = counts.pairs;
    v.model.live->points = counts.points;
}

/* ---- bodies again ---------------------------------------------------------------------------------------------- */

/* Body i again, now that all is known of its island. */
static __device__ __noinline__ void move_again(const cuda_view &v, int32_t i)
{
    const int32_t label = v.graph.label[i];
    const int island = v.islands.touch[label] | (v.islands.info[label].held ? TOUCH_AS_A_RULE : 0),
              own = v.islands.touch[i];
    const enum lead_kind kind = lead_kind_of(island, own);
    if (kind == LEAD_OWN) return; /* so it went: what more is known now can only make it stay */
    const body_before before = fetch_body(v.step, i);
    const double dt = v.model.settings->dt;
    double velocity[6], place[PLACE];
    load_end_velocity(v, i, velocity);
    move_body(&before.body, velocity, dt, v.model.settings->gravity, kind, place);
    store_moved(v, i, before, velocity, place, dt); /* finite, since both places were that it had to choose from */
}

/* Are there bodies to be moved again (move.h)? */
static __device__ __forceinline__ bool moves_again(const cuda_view &v)
{
    if (!v.step.limits) return false;
    const int32_t *why = v.islands.again;
    const int32_t again = why[AGAIN], closed = why[AGAIN_CLOSED], unpressed = why[AGAIN_UNPRESSED];
    return again || (closed && unpressed);
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
    const struct cuda_step_totals none = {0, -1, 0, 0, 0, 0, {}};
    const struct cuda_step_control *control = v.step.control;
    struct cuda_step_totals totals = v.step.substep > 0 ? control->totals : none;
    const bool constrained = control->counts.points > 0;
    const int32_t limited = v.step.limits ? *v.islands.limited : 0, islands = v.model.statistics->islands;
    double iterations = constrained ? args.count : 1;
    if (args.checks > 0) {
        const struct cuda_stop stop = *v.islands.stop;
        const int32_t unmet = stop.unmet[args.checks % CHECKS_KEPT];
        totals.unmet = unmet > totals.unmet ? unmet : totals.unmet;
        totals.met += unmet == 0;
        totals.most_iterations += stop.last;
        if (islands > 0) iterations = ((double)(int64_t)stop.sum + (double)unmet * args.count) / islands;
    }
    totals.limited = limited > totals.limited ? limited : totals.limited;
    totals.constrained += constrained;
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
    const int64_t t = (int64_t)blockIdx.x * TURN_THREADS + threadIdx.x, i = t / START_LANES,
                  own = (int64_t)blockIdx.x * (TURN_THREADS / START_LANES) + threadIdx.x;
    const int32_t lane = (int32_t)(t % START_LANES);
    struct cuda_step_control *control = v.step.control;
    if (v.model.live->abort_code) return;
    const bool again = moves_again(v);
    if (again && threadIdx.x < TURN_THREADS / START_LANES && own < v.model.bodies) move_again(v, (int32_t)own);
    if (again) __syncthreads(); /* threads of a block start bodies that others of it have moved */
    if (t == 0) {
        control->stamps[STAMP_END] = nanoseconds();
        control->totals = totals_of(v, args);
        control->stamps[STAMP_START] = control->stamps[STAMP_END];
        const int32_t code = abort_of(ABORT_NONE, as_planned(v.model, v.step), control->offending_body);
        if (code) v.model.live->abort_code = code;
    }
    if (i >= v.model.bodies) return;
    start_body(v, i, lane, &v.step.after[i], &v.step.steady_after[i]);
}

/* ---- commit ---------------------------------------------------------------------------------------------------- */

static __device__ double double_of(unsigned long long bits) { return __longlong_as_double((long long)bits); }

/* A thread a body where some may have to be moved again, else one block; the report is one thread's. */
static __global__ void commit_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const bool planned = as_planned(v.model, v.step);
    const int32_t aborted = v.model.live->abort_code;
    struct cuda_step_control *control = v.step.control;
    const int32_t i = (int32_t)(blockIdx.x * (unsigned)STEP_THREADS + threadIdx.x);
    wait_for_stream();
    /* Blocks that begin late may see what the first one says of the step: only where what they move is of no use. */
    const bool again = !aborted && planned && moves_again(v);
    if (again && i < v.model.bodies) move_again(v, i);
    if (blockIdx.x > 0 || threadIdx.x > 0) return;
    struct cuda_step_report *report = &v.step.reports[control->sequence % STEPS_AHEAD];
    const int32_t offending_body = control->offending_body,
                  abort_code = abort_of(aborted, planned, offending_body);
    control->stamps[STAMP_END] = nanoseconds();
    v.model.live->abort_code = abort_code;
    report->sequence = control->sequence++;
    report->abort_code = abort_code;
    report->offending_body = offending_body;
    report->substep = control->substep;
    report->counts = control->counts;
    report->statistics = *v.model.statistics;
    report->depth = double_of(control->depth);
    report->primal = v.step.measured ? double_of(v.iteration.residual[0]) : -1;
    report->dual = v.step.measured ? double_of(v.iteration.residual[1]) : -1;
    report->totals = totals_of(v, args);
}

/* ---- launches -------------------------------------------------------------------------------------------------- */

sadmm_status CUDA(launch_edits)(struct sadmm_context *c, const struct sadmm_resident_edit *edits, size_t count,
                                struct sadmm_error *error)
{
    cuda_args args = {};
    args.count = (int32_t)count;
    args.edits = edits;
    return CUDA(launch)(c, edit_kernel, "edit", blocks_for((int64_t)count), &args, error);
}

sadmm_status CUDA(launch_start)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    const int64_t blocks = (int64_t)c->view.model.bodies * START_LANES / STEP_THREADS + 1;
    return CUDA(launch_of)(c, start_step_kernel, "start", blocks, STEP_THREADS, &args, error);
}

sadmm_status CUDA(launch_turn)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    const int64_t blocks = (int64_t)c->view.model.bodies * START_LANES / TURN_THREADS + 1;
    args.checks = c->checks;
    args.count = c->settings.iterations;
    return CUDA(launch_of)(c, turn_kernel, "turn", blocks, TURN_THREADS, &args, error);
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
    const int64_t blocks = c->view.step.limits ? (int64_t)(c->view.model.bodies - 1) / STEP_THREADS + 1 : 1;
    return CUDA(launch_early)(c, commit_kernel, "commit", blocks, STEP_THREADS, &args, error);
}
