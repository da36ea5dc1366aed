/* Pairs with a mesh: which triangles they may touch.
 *
 * The pairs stage lists such pairs without order. A warp searches the mesh for each (mesh_lanes.h) and appends a
 * candidate a triangle; from there on these are candidates like all others, sorted with them.
 */
#include "batch.h"
#include "mesh_lanes.h"
#define SADMM_WITHOUT_SMOOTH
#include "touch.h"

/* A warp a pair; launched for as many as run at once. */
enum { EXPAND_WARPS = 1024 };
static_assert((int)MESH_THREADS == (int)WARP_LANES, "a block is a warp");

/* The box of the shape that is no mesh, in all of the time that candidates are searched for. */
template <bool SUBSTEPS>
static __device__ struct sadmm_box3 box_of_candidates(const collision_view &v, const struct collision_step &step,
                                                      uint32_t slot, const struct sadmm_proxy &proxy)
{
    struct sadmm_box3 box;
    if (!SUBSTEPS) {
        proxy_box(&proxy, step.dt, step.margin, step.gravity, &box);
        return box;
    }
    const struct collision_reach reach = v.reaches[slot];
    const double whole = time_of_candidates(v, step);
    for (int k = 0; k < 3; ++k) {
        box.lo[k] = reach.box.lo[k] + downward(reach.velocity[k] * whole);
        box.hi[k] = reach.box.hi[k] + upward(reach.velocity[k] * whole);
    }
    return box;
}

template <bool SUBSTEPS>
static __device__ void expand(const collision_view &v, const struct collision_step &step, uint64_t first,
                              struct waiting_nodes *waiting, struct batch *out)
{
    const struct candidate pair = candidate_of(v, first);
    const struct sadmm_proxy &a = *wide_at(v.proxies, pair.a), &b = *wide_at(v.proxies, pair.b);
    const struct sadmm_box3 own = box_of_candidates<SUBSTEPS>(v, step, pair.a, a);
    struct sadmm_box3 box;
    struct mesh mesh;
    mesh_at(v.hulls, b.geometry.hull, &mesh);
    mesh_reach(&a, &b, &own, step.margin, step.gravity, step.dt, time_of_candidates(v, step), &box);
    each_triangle_near(&mesh, &box, (int)threadIdx.x, waiting,
                       [&](int32_t triangle) { add(v, out, first + (uint32_t)triangle, 1); });
}

template <bool SUBSTEPS>
static __global__ void __launch_bounds__(MESH_THREADS) expand_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    COLLISION_SHARED(waiting_nodes, waiting);
    const unsigned long long listed = v.candidate_count[COUNT_MESH_PAIRS];
    const struct collision_step step = step_of(v);
    struct batch out;
    if (aborted(v)) return;
    if (listed > (unsigned)v.candidate_capacity) { /* at least as many candidates do not fit either */
        if (collision_thread(MESH_THREADS) == 0) reserve(v.candidate_count + COUNT_FOUND, (unsigned)listed);
        return;
    }
    out.count = 0;
    for (int64_t i = blockIdx.x; i < (int64_t)listed; i += gridDim.x)
        expand<SUBSTEPS>(v, step_of_shape(v, step, candidate_of(v, v.mesh_pairs[i]).a), v.mesh_pairs[i], &waiting,
                         &out);
    finish_batches(v, out);
}

void COLLISION(mesh_kernels)(struct collision_kernels *kernels)
{
    const size_t shared = sizeof(struct waiting_nodes);
    kernels->expand = {expand_kernel<false>, MESH_THREADS, shared, "triangles of pairs"};
    kernels->expand_first = {expand_kernel<true>, MESH_THREADS, shared, "triangles of pairs"};
    touch_kernels(&kernels->with_meshes);
    kernels->expand_warps = EXPAND_WARPS;
}
