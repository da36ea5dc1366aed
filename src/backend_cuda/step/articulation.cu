/* Articulations on the device: the block direct solve of core/solve/articulation.h, in double. A thread block a part:
 * constraints that are connected. Once before the iterations, from what they start with, and once after them, from what
 * they end with. */
#include "backend_cuda/device/double.h"
#include "backend_cuda/device/plan_check.h"

#include "articulation_contacts.h"
#include "assemble_again.h"
#include "core/model/joint_close.h"
#include "world.h"

/* What a part's threads share. */
struct articulation_shared {
    unsigned long long most; /* largest_residual */
    double speed;
    int32_t touched, flag;
    int32_t aborted, pairs; /* as one thread has seen them: a branch beside this one may abort the step at any time */
    struct articulation_sides sides;
};

size_t CUDA(articulation_shared_size)(void) { return sizeof(struct articulation_shared); }

/* ---- what there is ----------------------------------------------------------------------------------------------- */

/* Rows as their constraints have them. */
static __device__ __forceinline__ void load_rows(const cuda_view &v, const articulation_view &p)
{
    static_assert(sizeof(struct raw_row) == sizeof(struct articulation_row), "rows are copied");
    enum { NUMBERS = sizeof(struct articulation_row) / sizeof(double), OF_COLUMN = SADMM_MAX_ROWS * NUMBERS };
    const double *rows = (const double *)v.raw.rows;
    copy(p.s.columns * OF_COLUMN, (double *)p.rows, [&](int32_t at) {
        const int32_t constraint = p.s.constraint[at / OF_COLUMN], k = at % OF_COLUMN;
        const bool there = k / NUMBERS < v.raw.constraints[constraint].count; /* fetched beside the number */
        const double number = rows[(size_t)constraint * OF_COLUMN + (size_t)k];
        return there ? number : 0;
    });
    each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) {
        articulation_put_row(&p, r, r % SADMM_MAX_ROWS < v.raw.constraints[p.s.constraint[r / SADMM_MAX_ROWS]].count);
    });
}

/* Multipliers as the iterations leave them. */
static __device__ __forceinline__ void load_multipliers(const cuda_view &v, const articulation_view &p)
{
    each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) {
        const double lambda = (double)v.rows.data[row_in_world(p, r)].lambda;
        if (p.state[r] != ROW_ABSENT) p.rows[r].lambda = lambda;
    });
}

/* again: as they have been found just now. */
static __device__ __forceinline__ double velocity_of(const cuda_view &v, int32_t body, int k, bool after, bool again)
{
    double all[6], out = 0;
    if (again) return v.joints.velocity[6 * (size_t)body + (size_t)k];
    if (!after) return v.step.start_velocity[6 * (size_t)body + (size_t)k];
    load_end_velocity(v, body, all);
#pragma unroll
    for (int i = 0; i < 6; ++i) out = i == k ? all[i] : out; /* not by an index: they stay in registers */
    return out;
}

/* Velocities, and the contacts' impulses on bodies, into `dv`, which is not in use yet. */
template <bool SMALL>
static __device__ __forceinline__ void load_bodies(const cuda_view &v, const articulation_view &p, bool after,
                                                   bool again, struct articulation_shared *shared)
{
    each_component(p, [&](int32_t e, int k) {
        const int32_t body = p.s.body[e];
        double sum = 0;
        if (k >= 6) return;
        p.velocity[6 * e + k] = velocity_of(v, body, k, after, again);
        each_contact<SMALL>(v, p, e, after, &shared->sides, [&](const articulation_side &s, int32_t) {
            shared->touched = 1;
#pragma unroll 4
            for (int32_t i = 0; i < s.count; ++i) {
                double impulse[3];
                v3_store(impulse_of(v, s, i), impulse);
                sum += articulation_point_load(arm_of(v, s, i), impulse, s.side, k);
            }
        });
        p.dv[6 * e + k] = sum;
    });
}

/* Rows' impulses, too; b - A v + J^T lambda, or 0 where that is left to contacts (core/solve/articulation.c says
 * why). */
static __device__ __forceinline__ void find_residuals(const cuda_view &v, const articulation_view &p, bool left)
{
    each_component(p, [&](int32_t e, int k) {
        if (k >= 6) return;
        double sum = p.dv[6 * e + k];
#pragma unroll 2
        for (int32_t at = p.s.first_around[e]; at < p.s.first_around[e + 1]; ++at)
            sum += articulation_row_load(&p, p.s.around[at], k);
        p.dv[6 * e + k] = sum;
        p.residual[6 * e + k] = left ? 0 : articulation_body_residual(&p, e, k, v.joints.bodies[p.s.body[e]].b[k], sum);
    });
}

/* The speed that its impulses change the part by. */
static __device__ __forceinline__ void find_speed(const articulation_view &p, struct articulation_shared *shared)
{
    each(p.s.bodies, [&](int32_t e) { p.energy[e] = articulation_energy(p.factor + 36 * e, p.dv + 6 * e); });
    __syncthreads();
    if (threadIdx.x == 0) {
        double energy = 0, mass = 0;
#pragma unroll 4
        for (int32_t e = 0; e < p.s.bodies; ++e) {
            energy += p.energy[e];
            mass += p.factor[36 * e];
        }
        shared->speed = articulation_speed(energy, mass);
    }
    __syncthreads();
}

/* C, to A. */
template <bool SMALL>
static __device__ __forceinline__ void add_weights(const cuda_view &v, const articulation_view &p, bool after,
                                                   const struct articulation_shared *shared)
{
    each_component(p, [&](int32_t e, int k) {
        double *row = p.factor + 36 * e + 6 * k, sum[6];
        if (k >= 6) return;
#pragma unroll
        for (int q = 0; q < 6; ++q) sum[q] = row[q];
        each_contact<SMALL>(v, p, e, after, &shared->sides, [&](const articulation_side &s, int32_t near) {
            const double B = near >= 0 ? shared->sides.weight[near] : weight_of_side(v, s, shared->speed);
#pragma unroll 2
            for (int32_t i = 0; B > 0 && i < s.count; ++i) {
                const double *arm = arm_of(v, s, i);
#pragma unroll
                for (int q = 0; q < 6; ++q)
                    if (q <= k) sum[q] += B * articulation_point_entry(arm, k, q);
            }
        });
#pragma unroll
        for (int q = 0; q < 6; ++q) row[q] = sum[q];
    });
    __syncthreads();
}

template <bool SMALL>
static __device__ __forceinline__ void load_part(const cuda_view &v, const articulation_view &p, bool after, bool again,
                                                 struct articulation_shared *shared)
{
    if (after) load_multipliers(v, p);
    load_bodies<SMALL>(v, p, after, again, shared);
    __syncthreads();
    const bool touched = shared->touched != 0;
    find_residuals(v, p, touched && v.model.settings->method == SADMM_METHOD_PAPER);
    __syncthreads();
    if (!touched) return;
    find_speed(p, shared);
    if (SMALL) weigh_sides(v, after, shared->speed, &shared->sides);
    add_weights<SMALL>(v, p, after, shared);
}

/* ---- what is found ----------------------------------------------------------------------------------------------- */

/* Is any row of its joints about to say what others say? What is left of each is kept for the next step. */
static __device__ __noinline__ void find_folding(const cuda_view &v, const articulation_view &p)
{
    int32_t *folds = &v.joints.folds[blockIdx.x];
    if (threadIdx.x == 0) *folds = 0;
    __syncthreads();
    each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) {
        const int32_t at = row_in_world(p, r);
        if (p.state[r] == ROW_ABSENT || p.s.constraint[r / SADMM_MAX_ROWS] >= v.joints.first_gear) return;
        const struct sadmm_joint_source source = v.joints.sources[at];
        if (source.role != SADMM_ROLE_LOCK) return;
        const double left = articulation_left(&p, r);
        v.joints.after[source.joint].left[source.coordinate] = left;
        if (joint_row_folds(v.joints.before[source.joint].left[source.coordinate], left)) *folds = 1;
    });
}

/* Before the iterations: what these start from. After them, or where there are none: what the end of the step reads. */
static __device__ __forceinline__ void store_part(const cuda_view &v, const articulation_view &p, bool after,
                                                  bool solved)
{
    each_component(p, [&](int32_t e, int k) {
        const size_t body = (size_t)p.s.body[e];
        if (k >= 6) return;
        const double velocity = p.velocity[6 * e + k] + (solved ? p.dv[6 * e + k] : 0);
        v.joints.velocity[6 * body + (size_t)k] = velocity;
        if (!after && !v.joints.apart) v.bodies.state[body * ROW + (size_t)k] = (solver_real)velocity;
    });
    each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) {
        const int32_t at = row_in_world(p, r);
        if (!after) v.joints.kept_state[at] = p.state[r];
        if (p.state[r] == ROW_ABSENT) return;
        const double lambda = solved ? articulation_bounded(&p, r) : p.rows[r].lambda;
        v.joints.solution[at] = lambda;
        if (!after && !v.joints.apart) v.rows.data[at].lambda = (solver_real)lambda;
    });
    if (v.joints.parts[blockIdx.x].loop) find_folding(v, p);
    if (threadIdx.x > 0) return;
    if (!after) v.joints.kept[blockIdx.x] = solved;
    if (!solved) v.step.control->joints.together = 1;
}

/* ---- geometric stiffness ----------------------------------------------------------------------------------------- */

/* Does any body of the part have another inertia by the forces that have been found? */
static __device__ __forceinline__ bool stiffen_part(const cuda_view &v, const articulation_view &p,
                                                    int32_t *shared_flag)
{
    if (threadIdx.x == 0) *shared_flag = 0;
    __syncthreads(); /* multipliers, too */
    each(p.s.bodies, [&](int32_t e) {
        if (!stiffen_body(v, p.s.body[e], true)) return;
        assemble_again(v, p.s.body[e]);
        *shared_flag = 1;
    });
    __syncthreads();
    const bool any = *shared_flag != 0;
    __syncthreads();
    return any;
}

/* The part as it has been found. */
static __device__ __forceinline__ void load_again(const cuda_view &v, const articulation_view &p)
{
    each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) {
        if (p.state[r] == ROW_ABSENT) return;
        p.rows[r].lambda = v.joints.solution[row_in_world(p, r)];
        articulation_put_row(&p, r, true);
    });
    load_inertia(v, p);
    __syncthreads();
}

/* ---- all of it --------------------------------------------------------------------------------------------------- */

/* Of a small part. again: it has searched before the iterations. */
static __device__ __forceinline__ void find_sides(const cuda_view &v, bool again,
                                                  struct articulation_shared *shared)
{
    const int32_t part = (int32_t)blockIdx.x;
    if (again) load_sides(v, v.joints.ranges[part], &shared->sides);
    else if (!v.joints.apart) find_sides(v, v.joints.parts[part].label, shared->pairs, &shared->sides);
    if (!again && threadIdx.x == 0) {
        const struct cuda_articulation_range range = {shared->sides.first, shared->sides.count};
        v.joints.ranges[part] = range;
    }
}

/* args.count: after the iterations; args.start: it ran before them, too. What the iterations and contacts do not change
 * is fetched while the kernel before this one ends; where joints are apart that is the one that makes rows. */
template <bool SMALL>
static __global__ void __launch_bounds__(ARTICULATION_THREADS)
    articulation_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    CUDA_DYNAMIC_SHARED(memory);
    struct articulation_shared *shared = (struct articulation_shared *)memory;
    const bool after = args.count != 0, again = after && args.start;
    if (threadIdx.x == 0) {
        shared->aborted = v.model.live->abort_code;
        shared->pairs = v.model.live->pairs;
        shared->touched = shared->sides.count = shared->sides.first = 0;
    }
    __syncthreads();
    if (shared->aborted) {
        pdl_wait();
        return;
    }
    if (v.ncp.points) { /* it may be solved already */
        pdl_wait();
        if (v.ncp.solved[v.graph.label[v.joints.parts[blockIdx.x].label - 1]]) {
            if (after && blockIdx.x == 0 && threadIdx.x == 0) stamp_solved(v.step);
            return;
        }
    }
    const articulation_view p = view_of_part<SMALL>(v, (int32_t)blockIdx.x, (double *)(shared + 1));
    if (v.joints.apart) pdl_wait();
    load_rows(v, p);
    load_inertia(v, p);
    pdl_wait();
    pdl_trigger();
    if (after && blockIdx.x == 0 && threadIdx.x == 0) stamp_solved(v.step);
    __syncthreads();
    if (SMALL) find_sides(v, again, shared);
    const bool kept = again && v.joints.kept[blockIdx.x]; /* it was solved before the iterations; it is so still: */
    if (kept && !is_touched<SMALL>(v, p, &shared->sides, &shared->touched)) return;
#pragma unroll 1
    for (int turn = 0;; ++turn) { /* before the iterations once more, with the stiffness of the forces found */
        load_part<SMALL>(v, p, after, turn > 0, shared);
        const bool solved =
            solve_part<false>(p, kept ? v.joints.kept_state : nullptr, &shared->flag, &shared->most);
        store_part(v, p, after, solved);
        if (after || turn > 0 || !v.model.warm_start || !stiffen_part(v, p, &shared->flag)) return;
        load_again(v, p);
    }
}

/* Which part the bodies of a pair are of: a thread a side. Small parts find their contacts by it. */
static __global__ void pair_parts_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t code = thread_index();
    if (code >= 2 * live_pairs(v.model)) return;
    const struct sadmm_contact_pair *pair = &v.raw.pairs[code / 2];
    const int32_t body = code & 1 ? pair->body_b : pair->body_a;
    v.joints.pair_parts[code] = body >= 0 ? v.joints.is_articulated[body] : 0;
}

sadmm_status CUDA(launch_articulations)(struct sadmm_context *c, bool after, struct sadmm_error *error)
{
    cuda_args args = {};
    struct cuda_partition blocks = {};
    if (c->view.joints.count == 0 || c->step->articulations == 0) return SADMM_OK;
    blocks.parts = c->step->articulations;
    blocks.cluster = 1;
    blocks.threads = ARTICULATION_THREADS;
    blocks.shared = sizeof(struct articulation_shared) + c->step->articulation_bytes;
    args.count = after;
    args.start = c->settings.warm_start;
    return CUDA(launch_partition)(c,
                                  articulations_are_small(c) ? articulation_kernel<true> : articulation_kernel<false>,
                                      "articulations", &blocks, &args, error);
}

sadmm_status CUDA(launch_pair_parts)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    return CUDA(launch)(c, pair_parts_kernel, "parts of pairs", blocks_for(2 * (int64_t)c->view.contacts.pair_capacity),
                        &args, error);
}

cudaError_t CUDA(articulation_allow)(int shared_limit)
{
    return cudaFuncSetAttribute((const void *)articulation_kernel<true>, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                shared_limit);
}
