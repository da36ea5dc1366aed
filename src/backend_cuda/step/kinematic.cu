/* Kinematic bodies of a world on the device (core/model/kinematic.h), in double: where they are, what they support
 * (world/step/kinematic.c says what that is for), and what contacts give them. A step without any has none of it.
 *
 *   start    velocities of the step, and poses as collision sees them
 *   support  once the layout has islands: the first pair that supports each, by its number; is there anything else that
 *            holds it? Then the motion of its support, and where the solve starts from
 *   finish   the (sub-)step is over: they move; a block a body, whose points' impulses are added up in their order
 */
#include "backend_cuda/device/double.h"

#include "backend_cuda/device/plan_check.h"
#include "core/model/extrapolation.h"
#include "core/model/kinematic.h"
#include "world.h"

/* ---- start ------------------------------------------------------------------------------------------------------- */

static __device__ __forceinline__ void place(const cuda_view &v, int32_t slot, const struct sadmm_rigid *rigid)
{
    struct sadmm_collision_body *out = &v.step.bodies[slot];
    for (int k = 0; k < 3; ++k) out->position[k] = rigid->position[k];
    for (int k = 0; k < 4; ++k) out->orientation[k] = rigid->orientation[k];
    for (int k = 0; k < 6; ++k) out->velocity[k] = rigid->velocity[k];
}

static __global__ void kinematic_start_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t k = thread_index();
    if (k >= v.kinematic.count || v.model.live->abort_code) return;
    const struct sadmm_kinematic_body body = v.kinematic.before[k];
    struct sadmm_rigid moving = body.rigid;
    if (body.target) kinematic_velocity_to(&body.rigid, body.position, body.orientation, body.dt, moving.velocity);
    v.kinematic.moving[k] = moving;
    double *velocity = const_cast<double *>(v.raw.system.kinematic) + 6 * (size_t)k;
    for (int j = 0; j < 6; ++j) velocity[j] = moving.velocity[j];
    place(v, body.slot, &moving);
    v.step.bodies[body.slot].placed = body.extrapolation.placed;
}

/* ---- what they support ------------------------------------------------------------------------------------------- */

static __global__ void support_clear_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t i = thread_index();
    if (i == 0) *v.kinematic.moves = *v.kinematic.supports = 0;
    if (i >= v.model.bodies) return;
    v.kinematic.support[i] = INT32_MAX;
    v.kinematic.several[i] = 0;
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
static __global__ void support_find_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t p = thread_index(), r = p - v.contacts.pair_capacity;
    if (r >= 0) {
        if (r >= live_rows(v.model, v.rows) || v.raw.constraints[r].count == 0) return;
        v.kinematic.several[label_of(v.graph, v.raw.constraints[r].body_a, v.raw.constraints[r].body_b)] = 1;
        return;
    }
    if (p >= live_pairs(v.model)) return;
    const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
    if (support_of(pair) == 0) return;
    atomicMin(&v.kinematic.support[label_of(v.graph, pair->body_a, pair->body_b)], p);
    if (sadmm_pair_is_kinematic(&v.raw.system, pair)) *v.kinematic.moves = 1;
}

static __global__ void support_compare_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t p = thread_index();
    if (p >= live_pairs(v.model)) return;
    const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
    const int32_t by = support_of(pair);
    if (by == 0) return;
    const int32_t label = label_of(v.graph, pair->body_a, pair->body_b);
    if (!kinematic_same_motion(&v.raw.system, support_of(&v.raw.pairs[v.kinematic.support[label]]), by))
        v.kinematic.several[label] = 1;
}

static __global__ void support_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t i = thread_index();
    if (i >= live_bodies(v.model)) return;
    const int32_t label = v.graph.label[i], pair = v.kinematic.support[label];
    const int32_t by = pair < INT32_MAX && !v.kinematic.several[label] ? support_of(&v.raw.pairs[pair]) : -1;
    double motion[6] = {};
    if (sadmm_body_is_kinematic(by) && *v.kinematic.moves) {
        kinematic_motion_at(&v.kinematic.moving[sadmm_kinematic(by)], v.step.before[i].position, motion);
        *v.kinematic.supports = 1;
    }
    for (int k = 0; k < 6; ++k) {
        const size_t at = 6 * (size_t)i + (size_t)k;
        const_cast<double *>(v.raw.system.support_motion)[at] = motion[k];
        v.kinematic.velocity[at] = v.step.start_velocity[at] - motion[k];
    }
}

/* ---- finish ------------------------------------------------------------------------------------------------------ */

/* Pairs that a block inspects in one go, and of which it adds up the points' impulses. */
enum { KINEMATIC_THREADS = 256, KINEMATIC_PAIRS = 64, KINEMATIC_LANES = KINEMATIC_THREADS / KINEMATIC_PAIRS,
       KINEMATIC_WARPS = KINEMATIC_THREADS / WARP };

struct kinematic_shared {
    int32_t of_warp[KINEMATIC_WARPS];
    int32_t list[KINEMATIC_PAIRS + KINEMATIC_THREADS]; /* pairs of the body, ascending */
    int32_t points[KINEMATIC_PAIRS];
    double load[KINEMATIC_PAIRS][SADMM_MAX_POINTS][6];
};

/* The (sub-)step is over for a body. */
static __device__ __forceinline__ void move_kinematic(const cuda_view &v, int32_t k)
{
    const struct sadmm_kinematic_body *before = &v.kinematic.before[k];
    const struct sadmm_rigid from = v.kinematic.moving[k];
    struct sadmm_kinematic_body after = *before;
    if (!kinematic_move(&from, v.model.settings->dt, &after.rigid))
        atomicMin(&v.step.control->offending_body, INT32_MIN + k);
    if (v.step.substep + 1 < v.step.substeps) {
        v.kinematic.moving[k] = after.rigid;
        place(v, before->slot, &after.rigid);
        return;
    }
    if (before->target) kinematic_arrive(before->position, before->orientation, &after.rigid);
    after.target = 0;
    v.kinematic.after[k] = after;
}

/* Adds the block's next pairs of body k to the list, of which there are `count`; returns how many there are then. Every
 * thread comes here. */
static __device__ __forceinline__ int32_t list_pairs(const cuda_view &v, int32_t k, int32_t p, int32_t count,
                                                     struct kinematic_shared *shared)
{
    const int32_t warp = (int32_t)threadIdx.x / WARP, lane = (int32_t)threadIdx.x % WARP;
    const bool is = p < live_pairs(v.model) && sadmm_kinematic(support_of(&v.raw.pairs[p])) == k;
    const unsigned lanes = __ballot_sync((unsigned)ALL_LANES, is);
    if (lane == 0) shared->of_warp[warp] = __popc(lanes);
    __syncthreads();
    int32_t at = count + __popc(lanes & ((1u << lane) - 1));
    for (int32_t w = 0; w < KINEMATIC_WARPS; ++w) {
        if (w < warp) at += shared->of_warp[w];
        count += shared->of_warp[w];
    }
    if (is) shared->list[at] = p;
    __syncthreads();
    return count;
}

/* What points of listed pairs from `first` on give the body. */
static __device__ __forceinline__ void load_pairs(const cuda_view &v, int32_t first, int32_t count, double share,
                                                  struct kinematic_shared *shared)
{
    const int32_t at = (int32_t)threadIdx.x / KINEMATIC_LANES, lane = (int32_t)threadIdx.x % KINEMATIC_LANES;
    if (first + at >= count) return;
    const struct sadmm_contact_pair *pair = &v.raw.pairs[shared->list[first + at]];
    const bool on_b = pair->body_b < 0;
    shared->points[at] = pair->count;
    for (int32_t i = lane; i < pair->count; i += KINEMATIC_LANES) {
        const struct sadmm_contact_point *point = &v.step.points[pair->first + i];
        for (int j = 0; j < 6; ++j)
            shared->load[at][i][j] =
                kinematic_load(on_b ? point->arm_b : point->arm_a, point->impulse, on_b ? share : -share, j);
    }
}

/* Component j of what the listed pairs give, added one after the other: in six threads. */
static __device__ __forceinline__ double add_pairs(const struct kinematic_shared *shared, int32_t pairs, int j,
                                                   double sum)
{
    for (int32_t at = 0; at < pairs; ++at)
        for (int32_t i = 0; i < shared->points[at]; ++i) sum += shared->load[at][i][j];
    return sum;
}

static __global__ void __launch_bounds__(KINEMATIC_THREADS)
    kinematic_finish_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait();
    pdl_trigger();
    CUDA_DYNAMIC_SHARED(memory);
    struct kinematic_shared *shared = (struct kinematic_shared *)memory;
    const int32_t k = (int32_t)blockIdx.x, t = (int32_t)threadIdx.x, pairs = live_pairs(v.model);
    if (v.model.live->abort_code || !as_planned(v.model, v.step)) return;
    if (t == 0) move_kinematic(v, k);
    if (!v.model.wrenches) return;
    const double share = 1 / (v.model.settings->dt * v.step.substeps); /* of their mean over the sub-steps */
    double *wrench = v.kinematic.wrench + 6 * (size_t)k, sum = t < 6 && v.step.substep > 0 ? wrench[t] : 0;
    int32_t count = 0;
    for (int32_t begin = 0; begin < pairs; begin += KINEMATIC_THREADS) {
        count = list_pairs(v, k, begin + t, count, shared);
        if (count < KINEMATIC_PAIRS && begin + KINEMATIC_THREADS < pairs) continue;
        for (int32_t first = 0; first < count; first += KINEMATIC_PAIRS) {
            load_pairs(v, first, count, share, shared);
            __syncthreads();
            if (t < 6)
                sum = add_pairs(shared, count - first < KINEMATIC_PAIRS ? count - first : KINEMATIC_PAIRS, t, sum);
            __syncthreads();
        }
        count = 0;
    }
    if (t < 6) wrench[t] = sum;
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

sadmm_status CUDA(launch_kinematic_start)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    return CUDA(launch)(c, kinematic_start_kernel, "kinematic bodies", blocks_for(c->view.kinematic.count), &args,
                        error);
}

sadmm_status CUDA(launch_support)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    const int64_t bodies = blocks_for((int64_t)c->view.model.bodies + 1), pairs = c->view.contacts.pair_capacity;
    TRY(CUDA(launch)(c, support_clear_kernel, "supports", bodies, &args, error));
    TRY(CUDA(launch)(c, support_find_kernel, "supports", blocks_for(pairs + c->view.rows.count), &args, error));
    TRY(CUDA(launch)(c, support_compare_kernel, "supports", blocks_for(pairs), &args, error));
    return CUDA(launch)(c, support_kernel, "supported bodies", bodies, &args, error);
}

sadmm_status CUDA(launch_kinematic_finish)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    struct cuda_partition blocks = {};
    if (c->view.kinematic.count == 0) return SADMM_OK;
    blocks.parts = c->view.kinematic.count;
    blocks.cluster = 1;
    blocks.threads = KINEMATIC_THREADS;
    blocks.shared = sizeof(struct kinematic_shared);
    return CUDA(launch_partition)(c, kinematic_finish_kernel, "kinematic bodies", &blocks, &args, error);
}

/* ---- where they are ---------------------------------------------------------------------------------------------- */

void CUDA(view_kinematic)(struct sadmm_context *c, int into)
{
    const size_t n = (size_t)c->step->kinematic, bodies = (size_t)c->step->bodies;
    struct kinematic_view *kinematic = &c->view.kinematic;
    kinematic->count = (int32_t)n;
    if (n == 0) return;
    struct sadmm_kinematic_body *body = buffer<struct sadmm_kinematic_body>(c, BUFFER_WORLD_KINEMATIC);
    kinematic->before = body + (size_t)(1 - into) * n;
    kinematic->after = body + (size_t)into * n;
    kinematic->moving = (struct sadmm_rigid *)(body + 2 * n);
    double *velocity = (double *)(kinematic->moving + n), *support_motion = buffer<double>(c, BUFFER_WORLD_SUPPORT);
    kinematic->wrench = velocity + 6 * n + (size_t)into * 6 * n;
    kinematic->velocity = support_motion + 6 * bodies;
    kinematic->support = (int32_t *)(kinematic->velocity + 6 * bodies);
    kinematic->several = kinematic->support + bodies;
    kinematic->moves = kinematic->several + bodies;
    kinematic->supports = kinematic->moves + 1;
    c->view.raw.system.kinematic = velocity;
    c->view.raw.system.support_motion = support_motion;
    c->view.raw.system.velocity = kinematic->velocity;
}

/* ---- to the device ----------------------------------------------------------------------------------------------- */

sadmm_status CUDA(load_kinematic)(struct sadmm_context *c, const struct sadmm_resident_world *world,
                                  struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const size_t n = (size_t)world->kinematic_count, bodies = (size_t)s->bodies;
    const cuda_capacity wanted[] = {
        {BUFFER_WORLD_KINEMATIC,
         n * (2 * sizeof(struct sadmm_kinematic_body) + sizeof(struct sadmm_rigid) + 18 * sizeof(double))},
        {BUFFER_WORLD_SUPPORT, 12 * bodies * sizeof(double) + (2 * bodies + 2) * sizeof(int32_t)},
    };
    s->kinematic = c->view.kinematic.count = (int32_t)n;
    if (n == 0) return SADMM_OK;
    TRY(reserve_all(c, wanted, error));
    return CUDA(put)(c, buffer<struct sadmm_kinematic_body>(c, BUFFER_WORLD_KINEMATIC) + (size_t)(1 - s->into) * n,
                     world->kinematic, n * sizeof *world->kinematic, error);
}
