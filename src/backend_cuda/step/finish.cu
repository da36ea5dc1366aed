/* The end of a step, or of a sub-step (device/step.h): moved bodies, wrenches, impulses into the contacts. */
#include "backend_cuda/device/double.h"

#include "backend_cuda/device/body.h"
#include "backend_cuda/device/plan_check.h"
#include "move.h"
#include "push.h"
#include "touch.h"
#include "world.h"

/* Blocks of bodies that something touches: eight lanes each for what its contacts do, and a warp that moves all of
 * them. Then blocks of bodies that nothing touches, a thread each; then of contacts. */
enum { FINISH_THREADS = 256, FINISH_SIDES = FINISH_THREADS - WARP, FINISH_BODIES = FINISH_SIDES / LANES };

/* Where each kind ends. */
struct finish_blocks {
    int32_t touched, free, pairs;
};
static __host__ __device__ inline finish_blocks finish_blocks_of(const model_view &model, const contact_view &contacts)
{
    const int64_t lanes = (int64_t)contacts.lanes * contacts.pair_capacity;
    finish_blocks end;
    end.touched = (model.bodies + FINISH_BODIES - 1) / FINISH_BODIES;
    end.free = end.touched + (model.bodies + FINISH_THREADS - 1) / FINISH_THREADS;
    end.pairs = end.free + (int32_t)((lanes + FINISH_THREADS - 1) / FINISH_THREADS);
    if (end.pairs == 0) end.pairs = 1; /* one that waits */
    return end;
}

/* Between the threads of a block of bodies: what touches them. */
struct finish_shared {
    int touch[FINISH_BODIES];
};

/* ---- bodies ---------------------------------------------------------------------------------------------------- */

/* What its contacts say of a body; of its island where that may not be as it is as a rule (move.h). */
static __device__ __forceinline__ void report_touch(const island_view &islands, int32_t body, int32_t label,
                                                    bool anchored_outside, int touch)
{
    const int exceptions = touch & TOUCH_PENETRATES; /* a body that rocks too fast (core/model/forces.h) */
    add_touch(islands, body, label, anchored_outside ? (touch & TOUCH_OF_BODY) | exceptions : touch);
    if (!anchored_outside || exceptions) islands.again[AGAIN] = 1;
    if (!(touch & TOUCH_SUPPORTED)) islands.again[AGAIN_UNPRESSED] = 1;
}

/* Does anything touch the bodies of a block? */
static __device__ __forceinline__ bool any_touched(const cuda_view &v)
{
    const int32_t first = (int32_t)blockIdx.x * FINISH_BODIES, end = first + FINISH_BODIES;
    return v.graph.offsets[first] < v.graph.offsets[end < v.model.bodies ? end : v.model.bodies];
}

/* Component `lane` of what contacts that rolled in the last step give it in this one. */
static __device__ __forceinline__ void add_owed(const cuda_view &v, int32_t body, int32_t lane, double wrench[6])
{
    if (!(v.step.before[body].rolls & ROLLING_OWES)) return;
#pragma unroll
    for (int k = 0; k < 6; ++k)
        if (k == lane) wrench[k] += rolling_wrench(&v.step.before[body], v.model.settings->dt, k);
}

/* What the lanes of a body do. */
static __device__ __forceinline__ void finish_sides(const cuda_view &v, struct finish_shared *shared)
{
    const int32_t in_block = (int32_t)threadIdx.x / LANES, slot = (int32_t)blockIdx.x * FINISH_BODIES + in_block;
    const body_thread t = body_of_slot(v.graph, slot, slot < v.model.bodies);
    const int32_t body = (int32_t)t.body;
    const bool touched = t.begin < t.end && v.step.limits;
    const int32_t label = touched ? v.graph.label[body] : 0;
    touching_begun begun = begin_touching(v, t.begin + t.lane, t.end);
    trapezoid_speeds own = {};
    bool anchored_outside = true;
    pdl_wait();
    pdl_trigger();
    if (begun.first.pair >= 0) fetch_impulses(v.contacts, begun.first, 0, &begun.points);
    if (touched) {
        anchored_outside = v.islands.info[label].anchored_outside;
        own = load_trapezoid_speeds<true>(v, body);
    }
    contact_sums sums = sum_touching<true>(v, own, &begun);
    if (t.lane == 0) shared->touch[in_block] = sums.touch;
    if (t.begin < t.end && v.model.wrenches) add_owed(v, body, t.lane, sums.wrench);
    if (t.begin < t.end && v.model.wrenches)
        add_wrench(sums.wrench, t.lane, v.step.substep, v.step.substeps, v.step.wrench + 6 * t.body);
    if (touched && t.lane == 0) report_touch(v.islands, body, label, anchored_outside, sums.touch);
}

/* A body on its way: both places that there are as a rule. */
struct finish_move {
    bool live, finite;
    int32_t body;
    body_before before;
    double stays[PLACE], own[PLACE];
};

/* What the thread does that moves a body, while the others inspect contacts; */
static __device__ __forceinline__ finish_move begin_move(const cuda_view &v, double dt)
{
    const int32_t in_block = (int32_t)threadIdx.x - FINISH_SIDES,
                  slot = (int32_t)blockIdx.x * FINISH_BODIES + in_block;
    finish_move m = {};
    m.live = in_block < FINISH_BODIES && slot < v.model.bodies && v.graph.offsets[slot] < v.graph.offsets[slot + 1];
    m.body = m.live ? v.graph.body_of[slot] : 0;
    if (m.live) m.before = fetch_body(v.step, m.body);
    pdl_wait();
    pdl_trigger();
    if (!m.live) return m;
    double velocity[6];
    load_end_velocity(v, m.body, velocity);
    move_body_both(&m.before.body, halfway_of(v, m.body), velocity, dt, m.stays, m.own);
    m.finite = finite_numbers(m.stays, PLACE) && finite_numbers(m.own, PLACE);
    return m;
}

/* and once they have. */
static __device__ __forceinline__ void end_move(const cuda_view &v, double dt, const finish_move &m,
                                                const struct finish_shared *shared)
{
    const int touch = shared->touch[((int32_t)threadIdx.x - FINISH_SIDES) % FINISH_BODIES];
    const bool keeps = body_trapezoid_kind(&m.before.body, TOUCH_AS_A_RULE, touch) == TRAPEZOID_OFF;
    double place[PLACE];
    if (!m.live) return;
#pragma unroll
    for (int k = 0; k < PLACE; ++k) place[k] = keeps ? m.stays[k] : m.own[k];
    store_moved(v, m.body, m.before, place, !keeps, dt);
    if (!m.finite) atomicMin(&v.step.control->offending_body, m.body);
}

/* A body that nothing touches. By itself: the others should not pay in registers. */
static __device__ __noinline__ void finish_free(const cuda_view &v, double dt, int32_t slot)
{
    const bool live = slot < v.model.bodies && v.graph.offsets[slot] == v.graph.offsets[slot + 1];
    const int32_t body = live ? v.graph.body_of[slot] : 0;
    body_before before = {};
    double velocity[6], place[PLACE];
    if (live) before = fetch_body(v.step, body);
    pdl_wait();
    pdl_trigger();
    if (!live) return;
    load_end_velocity(v, body, velocity);
    move_body(&before.body, halfway_of(v, body), velocity, dt, v.model.settings->gravity, TRAPEZOID_OWN, place);
    if (!moves_apart(v, body)) store_moved(v, body, before, place, true, dt);
    if (!finite_numbers(place, PLACE)) atomicMin(&v.step.control->offending_body, body);
    double owed[6] = {};
    for (int32_t k = 0; v.model.wrenches && k < 6; ++k) add_owed(v, body, k, owed);
    for (int32_t k = 0; v.model.wrenches && k < 6; ++k)
        add_wrench(owed, k, v.step.substep, v.step.substeps, v.step.wrench + 6 * (size_t)body);
}

/* ---- contacts -------------------------------------------------------------------------------------------------- */

struct point_before {
    double impulse[3], separation;
};

static __device__ __forceinline__ point_before fetch_before(const struct sadmm_contact_point *point)
{
    const point_before before = {{point->impulse[0], point->impulse[1], point->impulse[2]}, point->separation};
    return before;
}

struct pair_before {
    int32_t first, count; /* points */
    pair_ends ends;
    point_before point;   /* the lane's first */
};

static __device__ __forceinline__ pair_before fetch_pair(const raw_view &raw, const cuda_step_view &step, int32_t p,
                                                         int32_t lane)
{
    const struct sadmm_contact_pair *pair = wide_at(raw.pairs, (size_t)p);
    pair_before before = {pair->first, pair->count, fetch_ends(pair), {}};
    if (lane < before.count) before.point = fetch_before(wide_at(step.points, (size_t)(before.first + lane)));
    return before;
}

/* Impulses of a pair into its points, every v.contacts.lanes-th of them from `lane` on; *depth: the deepest. */
static __device__ __forceinline__ bool store_impulses(const cuda_view &v, int32_t p, int32_t lane,
                                                      const pair_before &pair, double *depth)
{
    const contact_view &contacts = v.contacts;
    const cuda_step_view &step = v.step;
    const bool solved = v.ncp.points && is_solved(v, pair.ends.body[pair.ends.body[0] < 0]);
    bool finite = true;
    for (int32_t k = lane; k < pair.count; k += contacts.lanes) {
        struct sadmm_contact_point *point = wide_at(step.points, (size_t)(pair.first + k));
        const point_before before = k == lane ? pair.point : fetch_before(point);
        double *start = step.start_impulse + 3 * (size_t)(pair.first + k), impulse[3];
        v3_store(solved ? v3_load(v.ncp.impulse + 3 * (size_t)(pair.first + k)) : point_impulse(contacts, p, k),
                 impulse);
        finite = finite && finite_numbers(impulse, 3);
        /* one record after the other: stores to both in turn would not be joined to wider ones */
        for (int j = 0; j < 3; ++j) start[j] = before.impulse[j];
        for (int j = 0; j < 3; ++j) point->impulse[j] = impulse[j];
        *depth = max_of(*depth, -before.separation);
    }
    return finite;
}

/* A kinematic body that moves would penetrate what it touches. */
static __device__ __noinline__ int add_penetrates(const cuda_view &v, int32_t p)
{
    const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
    if (!sadmm_pair_is_kinematic(&v.raw.system, pair)) return 0;
    add_bits(&v.islands.touch[v.graph.label[pair->body_a >= 0 ? pair->body_a : pair->body_b]], TOUCH_PENETRATES);
    return TOUCH_PENETRATES;
}

/* v.contacts.lanes threads a pair. */
static __device__ __forceinline__ void finish_pair(const cuda_view &v, int32_t i)
{
    const int32_t p = i / v.contacts.lanes, lane = i % v.contacts.lanes;
    const bool live = p < live_pairs(v.model);
    struct cuda_step_control *control = v.step.control;
    double depth = 0;
    pair_before pair = {};
    if (live) pair = fetch_pair(v.raw, v.step, p, lane);
    pdl_wait();
    pdl_trigger();
    const unsigned long long deepest = control->depth; /* of those that have come here */
    /* bodies are named first: all of them are below any contact's */
    const int32_t body = pair.ends.body[1] >= 0 ? pair.ends.body[1] : pair.ends.body[0];
    if (live && !store_impulses(v, p, lane, pair, &depth))
        atomicMin(&control->offending_body, v.model.bodies + body);
    if (live && v.step.limits) {
        int ways = add_ways<true>(v, pair.ends, pair.first, pair.count, lane);
        if (v.kinematic.count > 0 && lane == 0) ways |= add_penetrates(v, p);
        if (ways & TOUCH_PENETRATES) v.islands.again[AGAIN] = 1;
        if (ways & TOUCH_SUPPORTED) v.islands.again[AGAIN_CLOSED] = 1;
        if (ways & TOUCH_ROLLS) v.islands.again[AGAIN_ROLLS] = 1;
    }
    if (v.step.limits && v.push.bits && !v.push.planned) {
        double deepest_of_pair = depth;
        for (int o = 1; o < v.contacts.lanes; o *= 2)
            deepest_of_pair = max_of(deepest_of_pair, __shfl_xor_sync((unsigned)ALL_LANES, deepest_of_pair, o));
        report_push(v, live && lane == 0 ? p : -1, -deepest_of_pair);
    }
    /* -0 is no depth; a larger one may be there already */
    unsigned long long bits = depth > 0 ? (unsigned long long)__double_as_longlong(depth) : 0;
    for (int o = WARP / 2; o > 0; o /= 2) {
        const unsigned long long other = __shfl_xor_sync((unsigned)ALL_LANES, bits, o);
        bits = other > bits ? other : bits;
    }
    if (threadIdx.x % WARP == 0 && bits > deepest) atomicMax(&control->depth, bits);
}

/* ---- all of it ------------------------------------------------------------------------------------------------- */

/* Never reads offending bodies found by this same kernel: which body is named must not depend on timing. */
static __global__ void __launch_bounds__(FINISH_THREADS, 2)
    finish_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    CUDA_DYNAMIC_SHARED(memory);
    struct finish_shared *shared = (struct finish_shared *)memory;
    const finish_blocks end = finish_blocks_of(v.model, v.contacts);
    const double dt = v.model.settings->dt;
    /* Layout and penalties are the last that abort a step, the latter where it is not as planned; iterations come
     * between. Joints that are apart have come to their end: this kernel waits for them before it begins. */
    const bool on = as_planned(v.model, v.step) && !v.model.live->abort_code;
    const int32_t block = (int32_t)blockIdx.x, t = (int32_t)threadIdx.x;
    /* A thread that moves nothing. It waits in any case: kernels after this one wait for this one alone. */
    static_assert(FINISH_THREADS - FINISH_SIDES > FINISH_BODIES, "there is one");
    if (block == 0 && t == FINISH_THREADS - 1) {
        pdl_wait();
        if (args.begin) stamp_solved(v.step);
    }
    if (!on) return;
    if (block >= end.free) finish_pair(v, (block - end.free) * FINISH_THREADS + t);
    else if (block >= end.touched) finish_free(v, dt, (block - end.touched) * FINISH_THREADS + t);
    if (block >= end.touched || !any_touched(v)) return;
    finish_move move;
    if (t < FINISH_SIDES) finish_sides(v, shared);
    else move = begin_move(v, dt);
    __syncthreads();
    if (t >= FINISH_SIDES) end_move(v, dt, move, shared);
}

sadmm_status CUDA(launch_finish)(struct sadmm_context *c, bool first, struct sadmm_error *error)
{
    cuda_args args = {};
    args.begin = first;
    struct cuda_partition blocks = {};
    blocks.parts = finish_blocks_of(c->view.model, c->view.contacts).pairs;
    blocks.cluster = 1;
    blocks.threads = FINISH_THREADS;
    blocks.shared = sizeof(struct finish_shared);
    return CUDA(launch_partition)(c, finish_kernel, "finish", &blocks, &args, error);
}
