/* Islands that are pushed apart without a velocity (core/solve/push.h): the second problem of a step, in a context of
 * its own. Its partition is made for as many contacts as the step may have. It has all bodies, under their own numbers,
 * and the pairs of the islands that are pushed, one after the other; where there are none its kernels are not launched,
 * or leave at once. */
#include "backend_cuda/device/double.h"

#include "backend_cuda/device/parallel.h"
#include "backend_cuda/device/plan_check.h"
#include "backend_cuda/graph/graph.h"
#include "backend_cuda/iterate/iterate.h"
#include "move.h"
#include "push.h"
#include "world.h"

/* ---- which ------------------------------------------------------------------------------------------------------- */

/* Islands with constraints given by rows, before contacts speak. A thread a constraint. */
static __global__ void push_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t k = thread_index();
    if (k >= live_rows(v.model, v.rows)) return;
    const struct sadmm_row_constraint *rows = &v.raw.constraints[k];
    if (rows->count > 0) v.push.bits[v.graph.label[rows->body_a >= 0 ? rows->body_a : rows->body_b]] = PUSH_ROWS;
}

/* A thread a pair. */
static __global__ void push_report_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t p = thread_index();
    const bool live = p < live_pairs(v.model);
    double separation = 0;
    for (int32_t k = 0; live && k < v.raw.pairs[p].count; ++k)
        separation = min_of(separation, v.raw.points[v.raw.pairs[p].first + k].separation);
    report_push(v, live ? p : -1, separation);
}

/* e of the step's problem: what overlaps is not to come nearer, and no more. A thread a pair, capacity included. */
static __global__ void push_hold_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t p = thread_index();
    if (p >= v.contacts.pair_capacity) return;
    const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
    const bool pushed = p < live_pairs(v.model) && island_is_pushed(v.push, label_of(v.graph, pair));
    v.push.points[p] = (uint8_t)(pushed ? pair->count : 0);
    for (int32_t k = 0; pushed && k < pair->count; ++k) {
        struct sadmm_contact_point *point = &v.step.points[pair->first + k];
        point->error = push_speed(v.model.settings, point->separation);
    }
}

/* ---- the second problem ------------------------------------------------------------------------------------------ */

static __device__ __forceinline__ bool carries(const struct sadmm_contact_point *point)
{
    return point->impulse[0] != 0 || point->impulse[1] != 0 || point->impulse[2] != 0;
}

static __device__ __forceinline__ void gather_pair(const cuda_view &v, int32_t p)
{
    const uint64_t place = v.push.places[p];
    struct sadmm_contact_pair pair = v.raw.pairs[p];
    const int32_t from = pair.first;
    bool warm = false;
    pair.first = (int32_t)(uint32_t)place;
    v.push.pairs[place >> 32] = pair;
    for (int32_t k = 0; k < pair.count; ++k) {
        struct sadmm_contact_point point = v.step.points[from + k];
        point.error = 0;
        point.migrates = 0;
        warm = warm || carries(&point);
        v.push.contacts[pair.first + k] = point;
    }
    if (warm) atomicAdd(&v.push.due[PUSH_WARM_PAIRS], 1);
}

/* A thread a body or pair, once the step's impulses are in its points. */
static __global__ void push_gather_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t i = thread_index();
    if (v.model.live->abort_code || !as_planned(v.model, v.step)) return;
    if (i < v.contacts.pair_capacity && v.push.points[i] > 0) gather_pair(v, i);
    if (i >= v.model.bodies) return;
    solver_real velocity[6];
    end_velocity(v, i, velocity);
    for (int k = 0; k < 6; ++k) v.push.start[6 * (size_t)i + (size_t)k] = (double)velocity[k];
}

static __device__ __forceinline__ int32_t kind_of(const cuda_view &v, int32_t pairs)
{
    if (pairs == 0 || v.model.live->abort_code || !as_planned(v.model, v.step)) return 0;
    return v.model.warm_start && plan_mostly_warm(pairs, v.push.due[PUSH_WARM_PAIRS]) ? PUSH_WARM : PUSH_COLD;
}

/* One thread. args.begin: it has been gathered; args.count: kinds that go on. */
static __global__ void push_kind_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    if (threadIdx.x > 0) return;
    const int32_t last = v.contacts.pair_capacity - 1;
    const uint64_t all = v.push.places[last] + size_of(v.push.points[last]);
    int32_t *kind = &v.push.due[PUSH_KIND];
    if (args.begin) {
        *kind = kind_of(v, (int32_t)(all >> 32));
    } else if (*kind && v.push.live->abort_code == ABORT_PARTITION) { /* of the layout */
        v.push.due[PUSH_MISPREDICTED] = 1;
        *kind = 0;
    }
    const struct cuda_live live = {*kind & args.count ? ABORT_NONE : ABORT_PLAN, v.model.bodies, (int32_t)(all >> 32),
                                   (int32_t)(uint32_t)all};
    *v.push.live = live;
}

/* ---- the way ----------------------------------------------------------------------------------------------------- */

/* Of the second problem, solved. A thread a body. */
static __global__ void push_way_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t i = thread_index();
    if (i >= v.model.bodies || !v.push.due[PUSH_KIND]) return;
    solver_real velocity[6];
    end_velocity(v, i, velocity);
    for (size_t k = 6 * (size_t)i; k < 6 * (size_t)i + 6; ++k)
        v.push.way[k] = (double)velocity[k - 6 * (size_t)i] - v.push.start[k];
}

/* What follows from where a body has got to. */
static __device__ __forceinline__ void keep_pushed(const cuda_view &v, int32_t i, double dt)
{
    const body_before before = fetch_body(v.step, i);
    struct sadmm_extrapolation extrapolation = before.extrapolation;
    const struct sadmm_rigid *next = &v.step.after[i];
    extrapolation_keep(&extrapolation, &before.body, next, dt);
    v.step.extrapolation_after[i] = extrapolation;
    if (!finite_numbers(next->position, 3) || !finite_numbers(next->orientation, 4) ||
        !finite_numbers(next->velocity, 6))
        atomicMin(&v.step.control->offending_body, i);
}

/* All bodies of an island in the air, in their order, as the host does. */
static __device__ __noinline__ void move_island(const cuda_view &v, int32_t label, double dt)
{
    const int32_t first = v.graph.slot_of[label], end = first + v.graph.island_bodies[label];
    const vec3 place = v3_load(v.step.before[label].position);
    struct push_island island = {};
    for (int32_t slot = first; slot < end; ++slot) {
        const int32_t i = v.graph.body_of[slot];
        push_move_body(&v.step.after[i], v.push.way + 6 * (size_t)i, dt, place, &island);
    }
    push_find_turn(&island);
    for (int32_t slot = first; slot < end; ++slot) {
        const int32_t i = v.graph.body_of[slot];
        push_turn_body(&island, place, &v.step.after[i]);
        keep_pushed(v, i, dt);
    }
}

/* A thread a body; of islands in the air that of the body which names it. */
static __global__ void push_move_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t i = thread_index();
    if (i >= v.model.bodies || !v.push.due[PUSH_KIND]) return;
    const int32_t label = v.graph.label[i];
    const double dt = v.model.settings->dt;
    if (!island_is_pushed(v.push, label)) return;
    if (!(v.push.bits[label] & PUSH_STANDS)) {
        if (i == label) move_island(v, label, dt);
        return;
    }
    push_move_body(&v.step.after[i], v.push.way + 6 * (size_t)i, dt, v3(0, 0, 0), nullptr);
    keep_pushed(v, i, dt);
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

static sadmm_status launch(struct sadmm_context *c, cuda_kernel kernel, const char *name, int64_t threads,
                           struct sadmm_error *error)
{
    const cuda_args args = {};
    return CUDA(launch)(c, kernel, name, blocks_for(threads), &args, error);
}

sadmm_status CUDA(launch_push_choice)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_view *v = &c->view;
    TRY(launch(c, push_rows_kernel, "islands with rows", v->rows.count, error));
    TRY(launch(c, push_report_kernel, "pushes of islands", v->contacts.pair_capacity, error));
    return launch(c, push_hold_kernel, "pushed contacts", v->contacts.pair_capacity, error);
}

sadmm_status CUDA(launch_push_gather)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_view *v = &c->view;
    const int32_t bodies = v->model.bodies, pairs = v->contacts.pair_capacity;
    cuda_buffer *sort = &c->buffers[BUFFER_PUSH_SORT];
    size_t bytes = sort->capacity;
    CUDA_CALL(c, COLLISION(sum)(sort->data, &bytes, v->push.points, v->push.places, pairs, c->stream),
              "places of pushed pairs");
    return launch(c, push_gather_kernel, "the second problem", bodies > pairs ? bodies : pairs, error);
}

sadmm_status CUDA(launch_push_kind)(struct sadmm_context *c, bool first, int kinds, struct sadmm_error *error)
{
    cuda_args args = {};
    args.begin = first;
    args.count = kinds;
    return CUDA(launch_of)(c, push_kind_kernel, "kind of the second problem", 1, WARP, &args, error);
}

sadmm_status CUDA(launch_push_move)(struct sadmm_context *c, struct sadmm_error *error)
{
    TRY(launch(c->step->push, push_way_kernel, "ways of pushed bodies", c->view.model.bodies, error));
    return launch(c, push_move_kernel, "pushed bodies", c->view.model.bodies, error);
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

/* The second problem's context, with room for all contacts. */
static sadmm_status reserve_second(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    if (!s->push) TRY(CUDA(create)(c->device, &s->push, error));
    struct sadmm_context *p = s->push;
    cuda_view *v = &p->view;
    const size_t pairs = (size_t)c->view.contacts.pair_capacity;
    TRY(CUDA(wait)(p, error));
    CUDA(plan_second)(c, false);
    p->bounces = c->bounces;
    p->statistics = c->statistics;
    p->wanted = s->push_streams ? SADMM_CUDA_TIER_STREAM : SADMM_CUDA_TIER_AUTO;
    v->model.bodies = s->bodies;
    v->model.settings = c->view.model.settings; /* the same numbers, whatever updates make of them */
    v->model.points = 0;
    v->contacts.pair_capacity = c->view.contacts.pair_capacity;
    v->raw.system = c->view.raw.system;
    TRY(CUDA(choose_partition)(p, &c->statistics, &p->partition, error));
    TRY(CUDA(reserve_layout)(p, error));
    TRY(CUDA(reserve_solver)(p, error));
    TRY(CUDA(reserve)(p, BUFFER_RAW_PAIRS, pairs * sizeof(struct sadmm_contact_pair), error));
    TRY(CUDA(reserve)(p, BUFFER_RAW_POINTS, (size_t)s->point_capacity * sizeof(struct sadmm_contact_point), error));
    return CUDA(wait)(p, error);
}

sadmm_status CUDA(reserve_push)(struct sadmm_context *c, struct sadmm_error *error)
{
    const size_t n = (size_t)c->step->bodies, pairs = (size_t)c->view.contacts.pair_capacity;
    size_t temp = 0;
    TRY(CUDA(reserve)(c, BUFFER_PUSH, n * (sizeof(int64_t) + sizeof(int32_t)) + PUSH_NUMBERS * sizeof(int32_t), error));
    CUDA_CALL(c, cudaMemsetAsync(buffer<void>(c, BUFFER_PUSH), 0, PUSH_NUMBERS * sizeof(int32_t), c->stream),
              "cudaMemsetAsync(pushes)");
    if (!c->step->pushes) return SADMM_OK;
    CUDA_CALL(c, COLLISION(sum)(nullptr, &temp, nullptr, nullptr, (int)pairs, c->stream), "sizing of a sum");
    TRY(CUDA(reserve)(c, BUFFER_PUSHED, 12 * n * sizeof(double) + pairs * (sizeof(uint64_t) + 1), error));
    TRY(CUDA(reserve)(c, BUFFER_PUSH_SORT, temp, error));
    return reserve_second(c, error);
}

void CUDA(plan_second)(struct sadmm_context *c, bool warm)
{
    struct sadmm_context *p = c->step->push;
    const struct sadmm_settings settings = sadmm_push_settings(&c->settings);
    p->plan = c->plan;
    if (p->plan.points == 0) p->plan.points = 1; /* they come in a later sub-step */
    p->plan.row_constraints = 0;
    sadmm_plan_complete(&p->plan, &settings, warm, plan_updates_weights(&settings, true, false, c->step->uneven));
    CUDA(plan_settings)(p, &settings);
    p->view.model.warm_start = p->plan.warm_start;
    p->view.model.contact_rows = c->view.model.contact_rows;
}

void CUDA(view_push)(struct sadmm_context *c)
{
    const struct cuda_step *s = c->step;
    const size_t n = (size_t)s->bodies, pairs = (size_t)c->view.contacts.pair_capacity;
    struct push_view *push = &c->view.push;
    const struct push_view none = {};
    int32_t *due = buffer<int32_t>(c, BUFFER_PUSH);
    *push = none;
    if (!due) return; /* nothing is planned yet */
    if (!push_is_apart(true, s->copies > 0 ? s->bodies / s->copies : s->bodies, s->kinematic)) return;
    push->due = due;
    push->units = (unsigned long long *)(due + PUSH_NUMBERS);
    push->bits = (int32_t *)(push->units + n);
    push->planned = s->pushes && c->plan.momentum && s->planned;
    if (!push->planned) return;
    struct sadmm_context *p = s->push;
    push->start = buffer<double>(c, BUFFER_PUSHED);
    push->way = push->start + 6 * n;
    push->places = (uint64_t *)(push->way + 6 * n);
    push->points = (uint8_t *)(push->places + pairs);
    push->live = p->view.model.live;
    push->pairs = buffer<struct sadmm_contact_pair>(p, BUFFER_RAW_PAIRS);
    push->contacts = buffer<struct sadmm_contact_point>(p, BUFFER_RAW_POINTS);
    p->view.raw.system = c->view.raw.system;
    p->view.raw.system.velocity = push->start;
    p->view.raw.pairs = push->pairs;
    p->view.raw.points = push->contacts;
    p->view.push.start = push->start;
    p->view.push.way = push->way;
    p->view.push.due = push->due;
}
