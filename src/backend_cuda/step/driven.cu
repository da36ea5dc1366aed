/* Driven bodies of a world on the device (core/model/driven.h), in double: where they are, what rides on them
 * (core/world/driven.c says what that is for), and what contacts give them. A step without any has none of it.
 *
 *   start    velocities of the step, and poses as collision sees them
 *   carry    once the layout has islands: the first pair that supports each, by its number; is there anything else that
 *            holds it? Then the motion of what it rides on, and where the solve starts from
 *   finish   the (sub-)step is over: they move; a block a body, whose points' impulses are added up in their order
 */
#include "backend_cuda/device/double.h"

#include "backend_cuda/device/plan_check.h"
#include "core/model/driven.h"
#include "core/model/steady.h"
#include "world.h"

/* ---- start ------------------------------------------------------------------------------------------------------- */

static __device__ __forceinline__ void place(const cuda_view &v, int32_t slot, const struct sadmm_rigid *rigid)
{
    struct sadmm_collision_body *out = &v.step.bodies[slot];
    for (int k = 0; k < 3; ++k) out->position[k] = rigid->position[k];
    for (int k = 0; k < 4; ++k) out->orientation[k] = rigid->orientation[k];
    for (int k = 0; k < 6; ++k) out->velocity[k] = rigid->velocity[k];
}

static __global__ void driven_start_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    follow_if(all_early(v.model.bodies));
    const int32_t k = thread_index();
    if (k >= v.driven.count || v.model.live->abort_code) return;
    const struct sadmm_driven_body body = v.driven.before[k];
    struct sadmm_rigid moving = body.rigid;
    if (body.target) driven_velocity_to(&body.rigid, body.position, body.orientation, body.dt, moving.velocity);
    v.driven.moving[k] = moving;
    double *velocity = const_cast<double *>(v.raw.system.driven) + 6 * (size_t)k;
    for (int j = 0; j < 6; ++j) velocity[j] = moving.velocity[j];
    place(v, body.slot, &moving);
    v.step.bodies[body.slot].placed = body.steady.placed;
}

/* ---- what rides on them ------------------------------------------------------------------------------------------ */

static __global__ void carry_clear_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    follow_if(all_early(v.model.bodies));
    const int32_t i = thread_index();
    if (i == 0) *v.driven.moves = *v.driven.carries = 0;
    if (i >= v.model.bodies) return;
    v.driven.support[i] = INT32_MAX;
    v.driven.several[i] = 0;
}

/* What of a pair does not feel it; 0: both of its bodies do. */
static __device__ __forceinline__ int32_t support_of(const struct sadmm_contact_pair *pair)
{
    return pair->body_a < 0 ? pair->body_a : pair->body_b < 0 ? pair->body_b : 0;
}

static __device__ __forceinline__ int32_t label_of(const graph_view &graph, int32_t a, int32_t b)
{
    return graph.label[a >= 0 ? a : b];
}

/* A thread a pair; then one a constraint of joints. */
static __global__ void carry_find_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    follow_if(all_early(v.model.bodies));
    const int32_t p = thread_index(), r = p - v.contacts.pair_capacity;
    if (r >= 0) {
        if (r >= live_rows(v.model, v.rows) || v.raw.constraints[r].count == 0) return;
        v.driven.several[label_of(v.graph, v.raw.constraints[r].body_a, v.raw.constraints[r].body_b)] = 1;
        return;
    }
    if (p >= live_pairs(v.model)) return;
    const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
    if (support_of(pair) == 0) return;
    atomicMin(&v.driven.support[label_of(v.graph, pair->body_a, pair->body_b)], p);
    if (sadmm_pair_is_driven(&v.raw.system, pair)) *v.driven.moves = 1;
}

static __global__ void carry_compare_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    follow_if(all_early(v.model.bodies));
    const int32_t p = thread_index();
    if (p >= live_pairs(v.model)) return;
    const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
    const int32_t by = support_of(pair);
    if (by == 0) return;
    const int32_t label = label_of(v.graph, pair->body_a, pair->body_b);
    if (!driven_same_motion(&v.raw.system, support_of(&v.raw.pairs[v.driven.support[label]]), by))
        v.driven.several[label] = 1;
}

static __global__ void carry_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    follow_if(all_early(v.model.bodies));
    const int32_t i = thread_index();
    if (i >= live_bodies(v.model)) return;
    const int32_t label = v.graph.label[i], pair = v.driven.support[label];
    const int32_t by = pair < INT32_MAX && !v.driven.several[label] ? support_of(&v.raw.pairs[pair]) : -1;
    double motion[6] = {};
    if (sadmm_body_is_driven(by) && *v.driven.moves) {
        driven_motion_at(&v.driven.moving[sadmm_driven(by)], v.step.before[i].position, motion);
        *v.driven.carries = 1;
    }
    for (int k = 0; k < 6; ++k) {
        const size_t at = 6 * (size_t)i + (size_t)k;
        const_cast<double *>(v.raw.system.carried)[at] = motion[k];
        v.driven.velocity[at] = v.step.start_velocity[at] - motion[k];
    }
}

/* ---- finish ------------------------------------------------------------------------------------------------------ */

/* Pairs that a block looks at in one go, and of which it adds up the points' impulses. */
enum { DRIVEN_THREADS = 256, DRIVEN_PAIRS = 64, DRIVEN_LANES = DRIVEN_THREADS / DRIVEN_PAIRS,
       DRIVEN_WARPS = DRIVEN_THREADS / WARP };

struct driven_shared {
    int32_t of_warp[DRIVEN_WARPS];
    int32_t list[DRIVEN_PAIRS + DRIVEN_THREADS]; /* pairs of the body, ascending */
    int32_t points[DRIVEN_PAIRS];
    double load[DRIVEN_PAIRS][SADMM_MAX_POINTS][6];
};

/* The (sub-)step is over for a body. */
static __device__ __forceinline__ void move_driven(const cuda_view &v, int32_t k)
{
    const struct sadmm_driven_body *before = &v.driven.before[k];
    const struct sadmm_rigid from = v.driven.moving[k];
    struct sadmm_driven_body after = *before;
    if (!driven_move(&from, v.model.settings->dt, &after.rigid))
        atomicMin(&v.step.control->offending_body, INT32_MIN + k);
    if (v.step.substep + 1 < v.step.substeps) {
        v.driven.moving[k] = after.rigid;
        place(v, before->slot, &after.rigid);
        return;
    }
    if (before->target) driven_arrive(before->position, before->orientation, &after.rigid);
    after.target = 0;
    v.driven.after[k] = after;
}

/* Adds the block's next pairs of body k to the list, of which there are `count`; returns how many there are then. Every
 * thread comes here. */
static __device__ __forceinline__ int32_t list_pairs(const cuda_view &v, int32_t k, int32_t p, int32_t count,
                                                     struct driven_shared *shared)
{
    const int32_t warp = (int32_t)threadIdx.x / WARP, lane = (int32_t)threadIdx.x % WARP;
    const bool is = p < live_pairs(v.model) && sadmm_driven(support_of(&v.raw.pairs[p])) == k;
    const unsigned lanes = __ballot_sync((unsigned)ALL_LANES, is);
    if (lane == 0) shared->of_warp[warp] = __popc(lanes);
    __syncthreads();
    int32_t at = count + __popc(lanes & ((1u << lane) - 1));
    for (int32_t w = 0; w < DRIVEN_WARPS; ++w) {
        if (w < warp) at += shared->of_warp[w];
        count += shared->of_warp[w];
    }
    if (is) shared->list[at] = p;
    __syncthreads();
    return count;
}

/* What points of listed pairs from `first` on give the body. */
static __device__ __forceinline__ void load_pairs(const cuda_view &v, int32_t first, int32_t count, double share,
                                                  struct driven_shared *shared)
{
    const int32_t at = (int32_t)threadIdx.x / DRIVEN_LANES, lane = (int32_t)threadIdx.x % DRIVEN_LANES;
    if (first + at >= count) return;
    const struct sadmm_contact_pair *pair = &v.raw.pairs[shared->list[first + at]];
    const bool on_b = pair->body_b < 0;
    shared->points[at] = pair->count;
    for (int32_t i = lane; i < pair->count; i += DRIVEN_LANES) {
        const struct sadmm_contact_point *point = &v.step.points[pair->first + i];
        for (int j = 0; j < 6; ++j)
            shared->load[at][i][j] =
                driven_load(on_b ? point->arm_b : point->arm_a, point->impulse, on_b ? share : -share, j);
    }
}

/* Component j of what the listed pairs give, added one after the other: in six threads. */
static __device__ __forceinline__ double add_pairs(const struct driven_shared *shared, int32_t pairs, int j, double sum)
{
    for (int32_t at = 0; at < pairs; ++at)
        for (int32_t i = 0; i < shared->points[at]; ++i) sum += shared->load[at][i][j];
    return sum;
}

static __global__ void __launch_bounds__(DRIVEN_THREADS)
    driven_finish_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    wait_for_stream();
    let_next_begin();
    CUDA_DYNAMIC_SHARED(memory);
    struct driven_shared *shared = (struct driven_shared *)memory;
    const int32_t k = (int32_t)blockIdx.x, t = (int32_t)threadIdx.x, pairs = live_pairs(v.model);
    if (v.model.live->abort_code || !as_planned(v.model, v.step)) return;
    if (t == 0) move_driven(v, k);
    if (!v.model.wrenches) return;
    const double share = 1 / (v.model.settings->dt * v.step.substeps); /* of their mean over the sub-steps */
    double *wrench = v.driven.wrench + 6 * (size_t)k, sum = t < 6 && v.step.substep > 0 ? wrench[t] : 0;
    int32_t count = 0;
    for (int32_t begin = 0; begin < pairs; begin += DRIVEN_THREADS) {
        count = list_pairs(v, k, begin + t, count, shared);
        if (count < DRIVEN_PAIRS && begin + DRIVEN_THREADS < pairs) continue;
        for (int32_t first = 0; first < count; first += DRIVEN_PAIRS) {
            load_pairs(v, first, count, share, shared);
            __syncthreads();
            if (t < 6) sum = add_pairs(shared, count - first < DRIVEN_PAIRS ? count - first : DRIVEN_PAIRS, t, sum);
            __syncthreads();
        }
        count = 0;
    }
    if (t < 6) wrench[t] = sum;
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

sadmm_status CUDA(launch_driven_start)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    return CUDA(launch)(c, driven_start_kernel, "driven bodies", blocks_for(c->view.driven.count), &args, error);
}

sadmm_status CUDA(launch_carry)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    const int64_t bodies = blocks_for((int64_t)c->view.model.bodies + 1), pairs = c->view.contacts.pair_capacity;
    TRY(CUDA(launch)(c, carry_clear_kernel, "carriers", bodies, &args, error));
    TRY(CUDA(launch)(c, carry_find_kernel, "carriers", blocks_for(pairs + c->view.rows.count), &args, error));
    TRY(CUDA(launch)(c, carry_compare_kernel, "carriers", blocks_for(pairs), &args, error));
    return CUDA(launch)(c, carry_kernel, "carried bodies", bodies, &args, error);
}

sadmm_status CUDA(launch_driven_finish)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    struct cuda_partition blocks = {};
    if (c->view.driven.count == 0) return SADMM_OK;
    blocks.parts = c->view.driven.count;
    blocks.cluster = 1;
    blocks.threads = DRIVEN_THREADS;
    blocks.shared = sizeof(struct driven_shared);
    return CUDA(launch_partition)(c, driven_finish_kernel, "driven bodies", &blocks, &args, error);
}

/* ---- where they are ---------------------------------------------------------------------------------------------- */

void CUDA(view_driven)(struct sadmm_context *c, int into)
{
    const size_t n = (size_t)c->step->driven, bodies = (size_t)c->step->bodies;
    struct driven_view *driven = &c->view.driven;
    driven->count = (int32_t)n;
    if (n == 0) return;
    struct sadmm_driven_body *body = buffer<struct sadmm_driven_body>(c, BUFFER_WORLD_DRIVEN);
    driven->before = body + (size_t)(1 - into) * n;
    driven->after = body + (size_t)into * n;
    driven->moving = (struct sadmm_rigid *)(body + 2 * n);
    double *velocity = (double *)(driven->moving + n), *carried = buffer<double>(c, BUFFER_WORLD_CARRIED);
    driven->wrench = velocity + 6 * n + (size_t)into * 6 * n;
    driven->velocity = carried + 6 * bodies;
    driven->support = (int32_t *)(driven->velocity + 6 * bodies);
    driven->several = driven->support + bodies;
    driven->moves = driven->several + bodies;
    driven->carries = driven->moves + 1;
    c->view.raw.system.driven = velocity;
    c->view.raw.system.carried = carried;
    c->view.raw.system.velocity = driven->velocity;
}

/* ---- to the device ----------------------------------------------------------------------------------------------- */

sadmm_status CUDA(load_driven)(struct sadmm_context *c, const struct sadmm_resident_world *world,
                               struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const size_t n = (size_t)world->driven_count, bodies = (size_t)s->bodies;
    const cuda_capacity wanted[] = {
        {BUFFER_WORLD_DRIVEN,
         n * (2 * sizeof(struct sadmm_driven_body) + sizeof(struct sadmm_rigid) + 18 * sizeof(double))},
        {BUFFER_WORLD_CARRIED, 12 * bodies * sizeof(double) + (2 * bodies + 2) * sizeof(int32_t)},
    };
    s->driven = c->view.driven.count = (int32_t)n;
    if (n == 0) return SADMM_OK;
    TRY(reserve_all(c, wanted, error));
    return CUDA(put)(c, buffer<struct sadmm_driven_body>(c, BUFFER_WORLD_DRIVEN) + (size_t)(1 - s->into) * n,
                     world->driven, n * sizeof *world->driven, error);
}
