/* Momentum and energy of islands with joints (core/model/joint_momentum.h) on the device. A thread block an island,
 * once it is known where its joints let it go: what closing has cost, which it pays; then what each body adds, then
 * sums over the bodies, in the order of the host (world/step/joint_momentum.c). Bodies get what restores it where they
 * are moved (move_articulated.h). Beside them a thread a joint: how far that is off. Where islands are many these
 * are three kernels. */
#include <algorithm>

#include "backend_cuda/device/double.h"

#include "backend_cuda/assemble/stiffened.h"
#include "core/model/articulation.h"
#include "core/model/joint_close.h"
#include "core/model/joint_momentum.h"
#include "anchors.h"
#include "joint_bodies.h"
#include "joint_place.h"
#include "world.h"

/* Threads of an island's block, where islands are few. Where there are so many for each multiprocessor that they fill
 * it, a thread does what is of a body, whichever island it is in, and a warp what is of the islands of 32 bodies. */
enum { ISLAND_THREADS = 128, ISLAND_BLOCKS = 1024, ISLANDS_FILL = 8, ISLAND_WARPS = 16 };
enum { FETCHED = 8 /* at once, of a sum */ };

/* Its bodies, ascending. part: where joints are apart (device/step.h), else NULL. */
struct joint_island {
    int32_t label, count;
    const int32_t *body;
    const struct articulation_structure *part;
    int32_t bits; /* core/model/joint_trapezoid.h */
};

static __device__ __forceinline__ void add_static_rows(const cuda_view &v, int32_t constraint, int side,
                                                       const struct sadmm_rigid *body, const double origin[3],
                                                       double dt, struct joint_momentum *sums)
{
    const struct sadmm_row_constraint *rows = &v.raw.constraints[constraint];
    if (rows->body_a >= 0 && rows->body_b >= 0) return;
    for (int32_t r = 0; r < rows->count; ++r) {
        const size_t slot = (size_t)constraint * SADMM_MAX_ROWS + (size_t)r;
        joint_add_static_row(sums, v.raw.rows[slot].jacobian[side], v.joints.solution[slot], body, origin, dt);
    }
}

/* By the layout of the step: pairs, then rows, both ascending. */
static __device__ __forceinline__ void add_sides(const cuda_view &v, int32_t i, const struct sadmm_rigid *body,
                                                 const double origin[3], double dt, struct joint_momentum *sums)
{
    const int32_t slot = v.graph.slot_of[i];
    for (int32_t at = v.graph.offsets[slot]; at < v.graph.offsets[slot + 1]; ++at) {
        const int32_t code = v.graph.incident[at], side = code & 1, p = code / 2;
        if (p >= v.contacts.pair_capacity) {
            add_static_rows(v, p - v.contacts.pair_capacity, side, body, origin, dt, sums);
            continue;
        }
        const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
        if (!is_static(pair)) continue;
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
            joint_add_static_point(sums, pair->normal, pair->friction, body,
                                   side ? v.raw.points[k].arm_b : v.raw.points[k].arm_a, origin, dt);
    }
}

/* By the part, where there are no contacts: rows, the next one each time. */
static __device__ __forceinline__ void add_part_rows(const cuda_view &v, const struct articulation_structure *part,
                                                     int32_t i, const struct sadmm_rigid *body, const double origin[3],
                                                         double dt,
                                                     struct joint_momentum *sums)
{
    const int32_t e = v.joints.entry[i], first = part->first_around[e], end = part->first_around[e + 1];
    for (int32_t last = -1;;) {
        int32_t next = INT32_MAX, side = 0;
        for (int32_t at = first; at < end; ++at) {
            const int32_t constraint = part->constraint[part->around[at] / 2];
            if (constraint > last && constraint < next) next = constraint, side = part->around[at] % 2;
        }
        if (next == INT32_MAX) return;
        add_static_rows(v, next, side, body, origin, dt, sums);
        last = next;
    }
}

static __device__ __noinline__ void store_body(const cuda_view &v, const struct joint_island &island, int32_t i)
{
    const struct sadmm_rigid *body = &v.step.before[i];
    struct sadmm_rigid stiffened;
    if (rolling_is_stiff(body)) { /* of others it does not count here */
        stiffened = stiffened_rigid(v, i);
        body = &stiffened;
    }
    const double *origin = v.step.before[island.label].position;
    const struct sadmm_settings settings = settings_of(v.model, i);
    struct joint_momentum sums = {};
    double place[PLACE];
    if (island.part) add_part_rows(v, island.part, i, body, origin, settings.dt, &sums);
    else add_sides(v, i, body, origin, settings.dt, &sums);
    if (island.bits & ISLAND_CLOSED)
        for (int k = 0; k < PLACE; ++k) place[k] = v.joints.closed[i].place[k];
    else joint_place(v, i, island.bits, place);
    joint_add_momentum(&sums, body, halfway_of(v, i), place, place + 3, place + 7, origin, island.bits, &settings);
    v.joints.momentum[i] = sums;
}

/* A body of an island that has been closed: its place, if no part of it has been, and what it moves with. */
static __device__ __noinline__ void count_cost(const cuda_view &v, const struct joint_island &island, int32_t i)
{
    struct cuda_closed_body *own = &v.joints.closed[i];
    if (!own->closed) {
        joint_place(v, i, island.bits, own->place);
        own->gained = 0;
    }
    own->moving = joint_motion_energy2(&v.step.before[i], own->place + 3, own->place + 7);
}

/* What closing has lifted, its velocities pay. Every thread of the block comes here. */
static __device__ __forceinline__ void pay_island(const cuda_view &v, const struct joint_island &island)
{
    const int32_t t = (int32_t)threadIdx.x, threads = (int32_t)blockDim.x;
    struct cuda_closed_body *closed = v.joints.closed;
    for (int32_t k = t; k < island.count; k += threads) count_cost(v, island, island.body[k]);
    __syncthreads();
    if (t == 0) { /* in the order of the host */
        double gained = 0, moving = 0;
        for (int32_t k = 0; k < island.count; ++k) {
            const struct cuda_closed_body *one = &closed[island.body[k]];
            gained = k == 0 ? one->gained : gained + one->gained;
            moving = k == 0 ? one->moving : moving + one->moving;
        }
        closed[island.label].keep = joint_closing_keep(gained, moving);
    }
    __syncthreads();
    const double keep = closed[island.label].keep;
    for (int32_t k = t; k < island.count; k += threads)
        for (int j = 7; j < PLACE; ++j) closed[island.body[k]].place[j] *= keep;
    __syncthreads();
}

/* Over its bodies, to the one that the island is named after. */
static __device__ __forceinline__ void add_bodies(const cuda_view &v, const struct joint_island &island)
{
    static_assert(offsetof(struct joint_momentum, factor) == JOINT_MOMENTUM_SUMS * sizeof(double),
                  "numbers are added one by one");
    double *to = (double *)&v.joints.momentum[island.label];
    for (int32_t n = (int32_t)threadIdx.x; n < JOINT_MOMENTUM_SUMS; n += (int32_t)blockDim.x) {
        double sum = to[n];
        for (int32_t first = 1; first < island.count; first += FETCHED) {
            double next[FETCHED];
#pragma unroll
            for (int32_t k = 0; k < FETCHED; ++k)
                if (first + k < island.count)
                    next[k] = ((const double *)&v.joints.momentum[island.body[first + k]])[n];
#pragma unroll
            for (int32_t k = 0; k < FETCHED; ++k)
                if (first + k < island.count) sum += next[k];
        }
        to[n] = sum;
    }
}

static __device__ __noinline__ void find_restoring(const cuda_view &v, int32_t label, int32_t bits)
{
    joint_restoring(&v.joints.momentum[label], bits, v.model.settings->dt);
    v.joints.touch[label] |= ISLAND_RESTORED;
}

/* Every thread of the block comes here. */
static __device__ __forceinline__ void restore_island(const cuda_view &v, const struct joint_island &island)
{
    const int32_t t = (int32_t)threadIdx.x, threads = (int32_t)blockDim.x;
    __syncthreads(); /* all have seen its bits */
    for (int32_t k = t; k < island.count && !island.part; k += threads)
        if (anchors(v, island.body[k])) atomicOr(&v.joints.touch[island.label], ISLAND_ANCHORED);
    __syncthreads();
    if (__ldcg(&v.joints.touch[island.label]) & ISLAND_ANCHORED) return;
    for (int32_t k = t; k < island.count; k += threads) store_body(v, island, island.body[k]);
    __syncthreads();
    add_bodies(v, island);
    __syncthreads();
    if (t == 0) find_restoring(v, island.label, island.bits);
}

/* How far joint j is off, once it has been closed where it had to be. Its island may be paying for that: velocities do
 * not count here. */
static __device__ __noinline__ double drift_of(const cuda_view &v, int32_t j)
{
    const struct sadmm_resident_joint *joint = &v.joints.joints[j];
    struct joint_end end[2];
    for (int s = 0; s < 2; ++s) {
        const int32_t body = joint->body[s];
        double place[PLACE];
        if (body >= 0 && v.joints.closed[body].closed)
            for (int k = 0; k < 7; ++k) place[k] = v.joints.closed[body].place[k];
        else if (body >= 0) joint_place(v, body, v.joints.touch[articulation_label(v, body)], place);
        end[s] = joint_end_after(v, j, s, place);
    }
    return joint_opening(&joint->def, end);
}

static __device__ __forceinline__ void find_drift(const cuda_view &v, int32_t j)
{
    const bool closes = j < v.joints.count && joint_closes(v.joints, j);
    reduce_max(closes ? drift_of(v, j) : 0, &v.step.control->joints.drift);
}

/* Blocks of islands, args.most_bodies of them, then blocks of joints. args.count: parts, where joints are apart. */
static __global__ void __launch_bounds__(ISLAND_THREADS)
    joint_momentum_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    if (v.model.live->abort_code) return;
    const int32_t count = v.joints.apart ? args.count : v.model.bodies, blocks = args.most_bodies;
    if ((int32_t)blockIdx.x >= blocks)
        return find_drift(v, ((int32_t)blockIdx.x - blocks) * (int32_t)blockDim.x + (int32_t)threadIdx.x);
    for (int32_t k = (int32_t)blockIdx.x; k < count; k += blocks) {
        struct joint_island island = {k, 0, nullptr, nullptr, 0};
        struct articulation_structure structure = {};
        if (v.joints.apart) {
            const struct cuda_articulation_part part = v.joints.parts[k];
            structure = articulation_structure_at(v.joints.structures + part.first_number);
            island.label = part.label - 1;
            island.count = part.body_count;
            island.body = v.joints.members + part.first_body;
            island.part = &structure;
        } else if (v.graph.label[k] == k) {
            island.count = v.graph.island_bodies[k];
            island.body = v.graph.body_of + v.graph.slot_of[k];
        }
        island.bits = v.joints.touch[island.label];
        if (island.count > 0 && island.bits & ISLAND_CLOSED) pay_island(v, island);
        if (island.count > 0 && joint_island_is_floating(island.bits)) restore_island(v, island);
    }
}

/* ---- many islands, of joints that are together ------------------------------------------------------------------ */

/* Calls f(island) for those of the block's islands that have such bits; every thread of the block, a warp. */
template <class Is, class F>
static __device__ __forceinline__ void each_island_of_warp(const cuda_view &v, const Is &is, const F &f)
{
    const int32_t first = (int32_t)blockIdx.x * WARP, i = first + (int32_t)threadIdx.x;
    const int32_t bits = i < v.model.bodies && v.graph.label[i] == i ? v.joints.touch[i] : 0;
    for (unsigned left = __ballot_sync((unsigned)ALL_LANES, is(bits)); left != 0; left &= left - 1) {
        const int lane = __ffs((int)left) - 1;
        const int32_t label = first + lane;
        f(joint_island{label, v.graph.island_bodies[label], v.graph.body_of + v.graph.slot_of[label], nullptr,
                       __shfl_sync((unsigned)ALL_LANES, bits, lane, WARP)});
    }
}

/* Blocks of bodies, args.most_bodies of them: what closing has cost, and what holds on to islands; then blocks of
 * joints. */
static __global__ void __launch_bounds__(WARP)
    joint_momentum_pay_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    if (v.model.live->abort_code) return;
    if ((int32_t)blockIdx.x >= args.most_bodies)
        return find_drift(v, ((int32_t)blockIdx.x - args.most_bodies) * WARP + (int32_t)threadIdx.x);
    each_island_of_warp(v, [](int32_t bits) { return (bits & ISLAND_CLOSED) != 0; },
                        [&](const joint_island &island) { pay_island(v, island); });
    const int32_t i = (int32_t)blockIdx.x * WARP + (int32_t)threadIdx.x;
    if (i >= v.model.bodies) return;
    int32_t *const bits = &v.joints.touch[v.graph.label[i]];
    if (joint_island_is_floating(__ldcg(bits)) && anchors(v, i)) atomicOr(bits, ISLAND_ANCHORED);
}

static __global__ void __launch_bounds__(WARP, ISLAND_WARPS)
    joint_momentum_bodies_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t i = (int32_t)blockIdx.x * WARP + (int32_t)threadIdx.x;
    if (i >= v.model.bodies || v.model.live->abort_code) return;
    const int32_t label = v.graph.label[i], bits = v.joints.touch[label];
    if (joint_island_is_floating(bits)) store_body(v, joint_island{label, 0, nullptr, nullptr, bits}, i);
}

static __global__ void __launch_bounds__(WARP, ISLAND_WARPS)
    joint_momentum_islands_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    if (v.model.live->abort_code) return;
    each_island_of_warp(v, [](int32_t bits) { return joint_island_is_floating(bits); },
                        [&](const joint_island &island) { add_bodies(v, island); });
    __syncthreads();
    const int32_t i = (int32_t)blockIdx.x * WARP + (int32_t)threadIdx.x;
    if (i >= v.model.bodies || v.graph.label[i] != i) return;
    const int32_t bits = v.joints.touch[i];
    if (joint_island_is_floating(bits)) find_restoring(v, i, bits);
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

static sadmm_status launch_many(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    const int32_t joints = (c->view.joints.count + WARP - 1) / WARP;
    args.most_bodies = (c->view.model.bodies + WARP - 1) / WARP;
    TRY(CUDA(launch_of)(c, joint_momentum_pay_kernel, "what closing has cost", args.most_bodies + joints, WARP, &args,
                        error));
    TRY(CUDA(launch_of)(c, joint_momentum_bodies_kernel, "momentum of bodies", args.most_bodies, WARP, &args, error));
    return CUDA(launch_of)(c, joint_momentum_islands_kernel, "momentum of joints", args.most_bodies, WARP, &args,
                           error);
}

sadmm_status CUDA(launch_joint_momentum)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    args.count = c->step->articulations;
    if (args.count >= ISLANDS_FILL * c->multiprocessors && !c->view.joints.apart) return launch_many(c, error);
    const int64_t islands = c->view.joints.apart ? args.count : c->view.model.bodies;
    args.most_bodies = (int32_t)std::min<int64_t>(islands, ISLAND_BLOCKS);
    return CUDA(launch_of)(c, joint_momentum_kernel, "momentum of joints",
                           args.most_bodies + (c->view.joints.count + ISLAND_THREADS - 1) / ISLAND_THREADS,
                           ISLAND_THREADS, &args, error);
}
