/* The dense contact solve on the device (ncp_island.h): small islands before the iterations, and those that are not
 * solved then once more after them. What is found is kept apart, and put where the end of the step reads it. */
#include <algorithm>

#include "backend_cuda/device/double.h"

#include "backend_cuda/device/plan_check.h"
#include "core/model/push_law.h"
#include "anchors.h"
#include "move.h"
#include "ncp_bodies.h"
#include "world.h"

/* Islands that there are, in no order. Bodies that nothing touches are by themselves. */
static __global__ void begin_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t i = thread_index();
    if (i >= v.model.bodies || v.model.live->abort_code) return;
    const int32_t slot = v.graph.slot_of[i];
    const bool touched = v.graph.offsets[slot] < v.graph.offsets[slot + 1];
    v.ncp.solved[i] = !touched && !ncp_is_left(v);
    if (!touched) {
        const struct cuda_articulation_body body = v.joints.bodies[i];
        const vec3 turn = m3_solve(inertia_of(body), v3_load(body.b + 3));
        for (int k = 0; k < 3; ++k) v.joints.velocity[6 * (size_t)i + (size_t)k] = body.b[k] / body.mass;
        v3_store(turn, v.joints.velocity + 6 * (size_t)i + 3);
    } else if (v.graph.label[i] == i) {
        if (v.graph.island_bodies[i] <= NCP_BODIES) v.ncp.islands[atomicAdd(v.ncp.count, 1)] = i;
        else *v.ncp.unsolved = 1;
    }
    if (v.islands.info && v.graph.label[i] == i) v.islands.info[i] = {weight_new_island(), 0, 1, 1, 0, 0, 0, 0};
}

/* ---- where the step reads it ------------------------------------------------------------------------------------- */

/* What the end of the step asks of the island of body i: its energy and its momentum are right; does anything outside
 * hold on to it (weight/weigh.h)? */
static __device__ __forceinline__ void put_island(const cuda_view &v, int32_t i, cuda_island *island)
{
    const int32_t slot = v.graph.slot_of[i], begin = v.graph.offsets[slot], end = v.graph.offsets[slot + 1];
    if (v.graph.label[i] == i) island->slow_down = island->anchored = 1;
    if (begin == end) {
        island->anchored_outside = 1;
    } else if (v.graph.incident[end - 1] / 2 >= v.contacts.pair_capacity) { /* rows come last */
        island->rows = island->anchored_outside = 1;
        if (v.push.bits) v.push.bits[v.graph.label[i]] = PUSH_ROWS;
    } else if (anchors(v, i)) {
        island->anchored_outside = 1;
    }
}

static __device__ __forceinline__ void put_velocity(const cuda_view &v, int32_t i)
{
    for (int k = 0; k < 6; ++k)
        v.bodies.state[(size_t)i * ROW + (size_t)k] = (solver_real)v.joints.velocity[6 * (size_t)i + (size_t)k];
    if (v.islands.info) put_island(v, i, &v.islands.info[v.graph.label[i]]);
}

static __device__ __forceinline__ void put_pair(const cuda_view &v, int32_t p)
{
    const struct sadmm_contact_pair *pair = &v.raw.pairs[p];
    if (!is_solved(v, pair->body_a >= 0 ? pair->body_a : pair->body_b)) return;
    for (int32_t k = 0; k < pair->count && k < v.contacts.point_slots; ++k)
        for (int j = 0; j < 3; ++j)
            v.contacts.lambda[(size_t)j * v.contacts.lambda_stride + point_slot(v.contacts, p, k)] =
                (solver_real)v.ncp.impulse[3 * (size_t)(pair->first + k) + (size_t)j];
}

static __device__ __forceinline__ void put_constraint(const cuda_view &v, int32_t i)
{
    const struct sadmm_row_constraint *constraint = &v.raw.constraints[i];
    const int32_t body = constraint->body_a >= 0 ? constraint->body_a : constraint->body_b;
    if (constraint->count == 0 || body < 0 || !is_solved(v, body)) return;
    for (int32_t r = 0; r < constraint->count; ++r) {
        const size_t at = (size_t)i * SADMM_MAX_ROWS + (size_t)r;
        v.rows.data[at].lambda = (solver_real)v.joints.solution[at];
    }
}

/* A thread a body, then a pair, then a constraint. */
static __global__ void put_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    int32_t i = thread_index();
    if (v.model.live->abort_code) return;
    if (i < v.model.bodies) {
        if (is_solved(v, i)) put_velocity(v, i);
        return;
    }
    i -= v.model.bodies;
    if (i < v.contacts.pair_capacity) {
        if (i < live_pairs(v.model)) put_pair(v, i);
        return;
    }
    i -= v.contacts.pair_capacity;
    if (i < v.rows.count) put_constraint(v, i);
}

/* Is the step what it was planned for, as penalties ask, which may be left out; and are all islands solved, if it was
 * planned so? args.begin: before the iterations; else after them. */
static __global__ void check_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    if (args.begin) check_plan(v.model, v.iteration, v.step);
    if (thread_index() > 0) return;
    if (!args.begin) stamp_solved(v.step);
    else if (!v.model.live->abort_code && *v.ncp.unsolved != 0 && !v.step.speculation.unsolved)
        v.model.live->abort_code = ABORT_PLAN;
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

static cuda_kernel ncp_kernel_of(bool large) { return large ? CUDA(ncp_block_kernel)() : CUDA(ncp_warp_kernel)(); }
static int ncp_shared_of(bool large, int shared_limit)
{
    return std::min(large ? (int)NCP_LARGE_SHARED : (int)NCP_WARPS_SHARED, shared_limit);
}

static sadmm_status launch_pass(struct sadmm_context *c, bool large, enum cuda_ncp_pass pass, bool after,
                                struct sadmm_error *error)
{
    cuda_args args = {};
    struct cuda_partition blocks = {};
    args.count = after;
    args.checks = after ? c->checks : 0;
    args.cluster = ncp_shared_of(large, c->shared_limit);
    args.left = pass;
    args.memory = c->step->ncp_blocks[large].bytes;
    blocks.parts = c->step->ncp_blocks[large].count;
    blocks.cluster = 1;
    blocks.threads = large ? (int)NCP_LARGE_BLOCK : (int)NCP_WARPS * (int)WARP;
    blocks.shared = (size_t)args.cluster;
    return CUDA(launch_partition)(c, ncp_kernel_of(large), "dense contact solve", &blocks, &args, error);
}

sadmm_status CUDA(launch_ncp)(struct sadmm_context *c, bool after, struct sadmm_error *error)
{
    const cuda_args args = {};
    const bool large = has_large_ncp_blocks(c);
    if (after) return launch_pass(c, true, large ? NCP_ALL : NCP_LEFT, true, error);
    CUDA_CALL(c, cudaMemsetAsync(c->view.ncp.count, 0, 4 * sizeof(int32_t), c->stream), "cudaMemsetAsync(islands)");
    TRY(CUDA(launch)(c, begin_kernel, "islands to be solved", blocks_for(c->view.model.bodies), &args, error));
    if (!large) TRY(launch_pass(c, false, NCP_LEAVES, false, error));
    return launch_pass(c, true, large ? NCP_ALL : NCP_LEFT, false, error);
}

sadmm_status CUDA(launch_ncp_check)(struct sadmm_context *c, bool after, struct sadmm_error *error)
{
    cuda_args args = {};
    args.begin = !after;
    return CUDA(launch)(c, check_kernel, "islands that are left", 1, &args, error);
}

sadmm_status CUDA(launch_ncp_put)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    const int64_t threads = (int64_t)c->view.model.bodies + c->view.contacts.pair_capacity + c->view.rows.count;
    return CUDA(launch)(c, put_kernel, "solved islands", blocks_for(threads), &args, error);
}

cudaError_t CUDA(ncp_allow)(int shared_limit)
{
    cudaError_t code = cudaSuccess;
    for (int large = 0; large < 2 && code == cudaSuccess; ++large)
        code = cudaFuncSetAttribute((const void *)ncp_kernel_of(large), cudaFuncAttributeMaxDynamicSharedMemorySize,
                                    ncp_shared_of(large, shared_limit));
    return code;
}
