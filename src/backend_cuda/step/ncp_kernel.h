/* The dense contact solve's kernel (ncp_island.h): an island by each thread block (ncp_block.cu), or by each warp of
 * one (ncp_warp.cu). */
#ifndef SADMM_CUDA_STEP_NCP_KERNEL_H
#define SADMM_CUDA_STEP_NCP_KERNEL_H

#include "assemble_again.h"
#include "ncp_search.h"
#include "world.h"

static __device__ __noinline__ void store_island(const cuda_view &v, const ncp_island &s)
{
    each(s.bodies * LANES, [&](int32_t t) {
        if (t % LANES < 6)
            v.joints.velocity[6 * (size_t)s.node[t / LANES].body + (size_t)(t % LANES)] =
                s.node[t / LANES].velocity[t % LANES];
    });
    each(s.contacts, [&](int32_t i) {
        const ncp_contact *c = &s.contact[i];
        for (int k = 0; k < 3; ++k)
            v.ncp.impulse[3 * (size_t)c->point + (size_t)k] = c->frame[k] * s.impulse[3 * i] +
                                                              c->frame[3 + k] * s.impulse[3 * i + 1] +
                                                              c->frame[6 + k] * s.impulse[3 * i + 2];
    });
    store_rows(v, s);
    ncp_barrier();
}

/* Does any body have another inertia by the forces that have been found? */
static __device__ __noinline__ bool stiffen_island(const cuda_view &v, const ncp_island &s, ncp_shared *shared)
{
    bool any = false;
    each(s.bodies, [&](int32_t n) {
        const int32_t body = s.node[n].body;
        if (v.ncp.part_of[body] < 0 || !stiffen_body(v, body, true)) return;
        assemble_again(v, body);
        s.node[n].own = v.joints.bodies[body];
        any = true;
    });
    return any_of(any, shared);
}

/* live: there is an island. All threads of the block come here. */
static __device__ bool solve_island(const cuda_view &v, ncp_memory memory, bool live, bool after, ncp_shared *shared)
{
    ncp_island *const s = &shared->island;
    double budget = NCP_BUDGET;
    bool right = live && make_nodes(v, s, &memory, shared);
    ncp_together();
    right = right && make_rows(v, s, &memory, after, shared);
    ncp_together();
    right = right && make_contacts(v, s, &memory, after, shared);
    ncp_together();
#pragma unroll 1
    for (int turn = 0; turn < 2; ++turn) { /* the second one, of few islands, as they come */
        if (right) {
            put(s->laws, s->contacts);
            put(s->numbers, 3 * s->contacts);
            each(s->rows, [&](int32_t r) { s->row[r].number = -1; });
            factor_trees(*s);
        }
        if (turn == 0) ncp_together();
        right = right && search_all(v, s, memory, &budget, shared);
        if (turn == 0) ncp_together();
        if (right) store_island(v, *s);
        if (turn == 0) ncp_together();
        if (!right || after || turn > 0 || !stiffen_island(v, *s, shared)) break;
    }
    return right;
}

static __device__ __forceinline__ void keep_outcome(const cuda_view &v, const cuda_args &args, int32_t label,
                                                    bool solved, bool missed)
{
    v.ncp.solved[label] = solved;
    if (!solved && args.left == NCP_LEAVES) v.ncp.left[atomicAdd(v.ncp.left_count, 1)] = label;
    else if (!solved) *v.ncp.unsolved = 1;
    if (solved && missed) atomicAdd(v.ncp.missed, 1);
    if (solved && !missed && args.checks > 0 && v.islands.info[label].stopped == 0) /* a check has counted it */
        atomicAdd(&v.islands.stop->unmet[args.checks % CHECKS_KEPT], -1);
}

/* In the block's memory: functions that are not inlined read it there sooner than from the parameters. */
static __device__ __forceinline__ const cuda_view &load_view(const cuda_view &given, void *own)
{
    static_assert(sizeof(cuda_view) % sizeof(double) == 0, "it is copied by doubles");
    for (int k = (int)threadIdx.x; k < (int)(sizeof(cuda_view) / sizeof(double)); k += (int)blockDim.x)
        ((double *)own)[k] = ((const double *)&given)[k];
    __syncthreads();
    return *(const cuda_view *)own;
}

/* Islands are taken in turn. args.count: after the iterations; args.left: enum cuda_ncp_pass. What an island takes at
 * most is by its threads: a block solves it, or not, whether a warp has tried or not. */
static __global__ void __launch_bounds__((int)NCP_ISLANDS * (int)NCP_THREADS)
    ncp_kernel(const __grid_constant__ cuda_view given, const __grid_constant__ cuda_args args)
{
    CUDA_DYNAMIC_SHARED(dynamic);
    enum { VIEW_BYTES = (sizeof(cuda_view) + 15) / 16 * 16 };
    const cuda_view &v = load_view(given, dynamic);
    const int32_t which = (int32_t)threadIdx.x / (int32_t)NCP_THREADS, blocks = (int32_t)gridDim.x;
    const size_t bytes = ((size_t)args.cluster - VIEW_BYTES) / NCP_ISLANDS / 16 * 16;
    char *const own = (char *)dynamic + VIEW_BYTES + (size_t)which * bytes,
         *const far = v.ncp.memory + ((size_t)blockIdx.x * NCP_ISLANDS + (size_t)which) * args.memory;
    ncp_shared *const shared = (ncp_shared *)own;
    const ncp_memory memory = {(char *)(shared + 1), own + bytes, far, far + args.memory, false};
    pdl_wait();
    if (ncp_is_left(v)) {
        if (blockIdx.x == 0 && threadIdx.x == 0) *v.ncp.unsolved = 1;
        return;
    }
    const bool of_left = args.left == NCP_LEFT;
    const int32_t islands = of_left ? *v.ncp.left_count : *v.ncp.count,
                  *const list = of_left ? v.ncp.left : v.ncp.islands;
#pragma unroll 1
    for (int32_t first = (int32_t)blockIdx.x; first < islands; first += (int32_t)NCP_ISLANDS * blocks) {
        const int32_t k = first + which * blocks, label = k < islands ? list[k] : 0;
        const bool live = k < islands && !(args.count && v.ncp.solved[label]);
        put(shared->island.label, label);
        put(shared->island.first_slot, v.graph.slot_of[label]);
        put(shared->island.bodies, v.graph.island_bodies[label]);
        put(shared->island.missed, false);
        ncp_barrier();
        const bool solved = solve_island(v, memory, live, args.count != 0, shared);
        ncp_barrier();
        if (live && ncp_thread() == 0) keep_outcome(v, args, label, solved, shared->island.missed);
    }
}

#endif
