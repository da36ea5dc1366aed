/* What is locked, closed at the end of a (sub-)step (core/model/joint_close.h) by the rule of the host
 * (world/step/joint_close.c): a thread block a part, where a loop of it folds or its islands may be opened by more than
 * the order of the step. Bodies get their place where they are moved (move_articulated.h), once their island has paid
 * for it (joint_momentum.cu). */
#include <algorithm>

#include "backend_cuda/device/double.h"

#include "articulation_block.h"
#include "core/model/joint_close.h"
#include "joint_bodies.h"
#include "joint_place.h"
#include "world.h"

/* Blocks of a multiprocessor; parts that one asks at once. */
enum { CLOSE_BLOCKS = 4, CLOSE_AT_ONCE = 32 };

/* What a part's threads share. open: a bit for each of the parts asked. */
struct close_shared {
    unsigned long long most;
    int32_t flag;
    int open;
};

/* Bits of a body's island: a part with joints that are not enabled may be of several. What other parts of the same
 * island add to them here is not asked for. */
static __device__ __forceinline__ int32_t bits_of(const cuda_view &v, int32_t body)
{
    return v.joints.touch[articulation_label(v, body)];
}

/* Joint j as its bodies' places have it; is it to be closed? folds: it is of a part that does. */
static __device__ __noinline__ bool closing_of(const cuda_view &v, int32_t j, bool folds, struct joint_closing *out)
{
    const struct sadmm_resident_joint *joint = &v.joints.joints[j];
    const struct sadmm_settings settings = *v.model.settings;
    struct joint_end start[2], end[2];
    bool moves[2], may_open = folds;
    double scale = 0;
    for (int s = 0; s < 2; ++s) {
        const struct joint_body body = body_of(v, joint->body[s]);
        moves[s] = body.system_body >= 0;
        may_open = may_open || (moves[s] && joint_island_may_open(bits_of(v, body.system_body)));
        start[s] = joint_end_on(&joint->frame[s], body.rigid);
        end[s] = joint_end_after(v, j, s, moves[s] ? v.joints.closed[body.system_body].place : nullptr);
        scale += joint_closing_scale(end[s].arm, moves[s] ? body.rigid : nullptr);
    }
    *out = joint_closing_of(&joint->def, start, end, scale, &settings);
    if (folds) return out->share > JOINT_CLOSE_FOLDING;
    return may_open && !joint_opens_little(&joint->def, end, moves, joint_opening(&joint->def, end)) &&
           out->share > JOINT_CLOSE_FROM;
}

/* Rows of a column: of the joint that has its first constraint there; is that to be closed? */
static __device__ __forceinline__ bool load_constraint(const cuda_view &v, const articulation_view &p, int32_t column,
                                                       bool folds)
{
    const int32_t j = v.joints.closing[p.s.constraint[column]];
    const bool closes = j >= 0 && joint_closes(v.joints, j);
    struct joint_closing c;
    bool open = false;
    c.count = 0;
    if (closes) open = closing_of(v, j, folds, &c);
    for (int i = 0; i < SADMM_MAX_ROWS; ++i) {
        const int32_t r = SADMM_MAX_ROWS * column + i;
        struct articulation_row row = {};
        for (int s = 0; i < c.count && s < 2; ++s)
            if (v.joints.joints[j].body[s] >= 0) joint_closing_row(&c, i, s, row.jacobian[s]);
        if (i < c.count) { /* hard */
            row.gain = 1, row.bias = c.error[i];
            row.lo = -INFINITY, row.hi = INFINITY;
        }
        p.rows[r] = row;
        articulation_put_row(&p, r, i < c.count);
    }
    return open;
}

/* Rows of the part's joints for displacements of its bodies; is any of them to be closed? */
static __device__ __forceinline__ bool load_closing(const cuda_view &v, const articulation_view &p, bool folds,
                                                    int32_t *shared_flag)
{
    if (threadIdx.x == 0) *shared_flag = 0;
    __syncthreads();
    each(p.s.columns, [&](int32_t column) {
        if (load_constraint(v, p, column, folds)) *shared_flag = 1;
    });
    each(6 * p.s.bodies, [&](int32_t k) { p.velocity[k] = p.residual[k] = 0; });
    load_inertia(v, p);
    __syncthreads();
    const bool any = *shared_flag != 0;
    __syncthreads();
    return any;
}

/* Energy that the body of an entry has by its place: as its share of what closing costs begins, and ends. */
static __device__ __noinline__ void add_energy(const cuda_view &v, int32_t i, bool ends)
{
    const struct sadmm_settings settings = settings_of(v.model, i);
    struct cuda_closed_body *own = &v.joints.closed[i];
    const double energy =
        joint_energy2(&v.step.before[i], own->place, own->place + 3, own->place + 7, &settings);
    own->gained = ends ? own->gained + energy : -energy;
    if (ends) own->closed = 1;
}

/* Velocities of what folds, along what its joints leave it at the end, as on the host. */
static __device__ __noinline__ void turn_speeds(const cuda_view &v, const articulation_view &p,
                                                struct close_shared *shared)
{
    load_closing(v, p, true, &shared->flag);
    each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) { p.rows[r].bias = 0; });
    each(6 * p.s.bodies, [&](int32_t k) { p.velocity[k] = v.joints.closed[p.s.body[k / 6]].place[7 + k % 6]; });
    __syncthreads();
    if (!solve_part<true>(p, nullptr, &shared->flag, &shared->most)) return;
    each(6 * p.s.bodies, [&](int32_t k) { v.joints.closed[p.s.body[k / 6]].place[7 + k % 6] += p.dv[k]; });
}

static __device__ __forceinline__ bool close_part(const cuda_view &v, const articulation_view &p, bool folds,
                                                  struct close_shared *shared)
{
    bool any = false;
    each(p.s.bodies, [&](int32_t e) {
        joint_place(v, p.s.body[e], bits_of(v, p.s.body[e]), v.joints.closed[p.s.body[e]].place);
        add_energy(v, p.s.body[e], false);
    });
    __syncthreads();
#pragma unroll 1
    for (int step = 0; step < JOINT_CLOSE_STEPS && load_closing(v, p, folds, &shared->flag); ++step) {
        any = true;
        if (!solve_part<true>(p, nullptr, &shared->flag, &shared->most)) break;
        each(p.s.bodies, [&](int32_t e) {
            double *place = v.joints.closed[p.s.body[e]].place;
            joint_close_move(p.dv + 6 * e, place, place + 3);
        });
        __syncthreads();
    }
    return any;
}

/* Is there anything to be closed in part k, as far as is known before its joints are looked at? A warp asks. */
static __device__ __forceinline__ bool may_open(const cuda_view &v, int32_t k)
{
    const struct cuda_articulation_part part = v.joints.parts[k];
    bool opens = v.joints.folds[k];
    for (int32_t i = (int32_t)threadIdx.x % WARP; i < part.body_count; i += WARP)
        opens = opens || joint_island_may_open(bits_of(v, v.joints.members[part.first_body + i]));
    return __ballot_sync((unsigned)ALL_LANES, opens) != 0;
}

template <bool SMALL>
static __device__ __noinline__ void close_one(const cuda_view &v, int32_t k, struct close_shared *shared)
{
    const bool folds = v.joints.folds[k];
    const articulation_view p = view_of_part<SMALL>(v, k, (double *)(shared + 1));
    if (!close_part(v, p, folds, shared) && !folds) return;
    each(p.s.bodies, [&](int32_t e) { add_energy(v, p.s.body[e], true); });
    __syncthreads();
    if (folds) turn_speeds(v, p, shared);
    each(p.s.bodies, [&](int32_t e) { atomicOr(&v.joints.touch[articulation_label(v, p.s.body[e])], ISLAND_CLOSED); });
}

/* Most parts have nothing to close, and are asked by a warp each; those that may open are closed by the whole block.
 * args.count: parts. */
template <bool SMALL>
static __global__ void __launch_bounds__(ARTICULATION_THREADS)
    joint_close_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    CUDA_DYNAMIC_SHARED(memory);
    struct close_shared *shared = (struct close_shared *)memory;
    pdl_wait();
    pdl_trigger();
    if (v.model.live->abort_code) return;
    const int32_t stride = (int32_t)gridDim.x, warp = (int32_t)threadIdx.x / WARP;
#pragma unroll 1
    for (int32_t first = (int32_t)blockIdx.x; first < args.count; first += CLOSE_AT_ONCE * stride) {
        __syncthreads();
        if (threadIdx.x == 0) shared->open = 0;
        __syncthreads();
        for (int32_t i = warp; i < CLOSE_AT_ONCE; i += ARTICULATION_THREADS / WARP) {
            const int32_t k = first + i * stride;
            if (k < args.count && may_open(v, k) && threadIdx.x % WARP == 0) atomicOr(&shared->open, (int)(1u << i));
        }
        __syncthreads();
        for (unsigned open = (unsigned)shared->open; open != 0; open &= open - 1) {
            close_one<SMALL>(v, first + (__ffs((int)open) - 1) * stride, shared);
            __syncthreads();
        }
    }
}

sadmm_status CUDA(launch_joint_close)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    struct cuda_partition blocks = {};
    if (c->view.joints.count == 0 || c->step->articulations == 0) return SADMM_OK;
    args.count = c->step->articulations;
    blocks.parts = std::min(args.count, (int)CLOSE_BLOCKS * c->multiprocessors);
    blocks.cluster = 1;
    blocks.threads = ARTICULATION_THREADS;
    blocks.shared = sizeof(struct close_shared) + c->step->articulation_bytes; /* less than that of articulations */
    return CUDA(launch_partition)(c, articulations_are_small(c) ? joint_close_kernel<true> : joint_close_kernel<false>,
                                  "joints that close", &blocks, &args, error);
}

cudaError_t CUDA(joint_close_allow)(int shared_limit)
{
    return cudaFuncSetAttribute((const void *)joint_close_kernel<true>, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                shared_limit);
}
