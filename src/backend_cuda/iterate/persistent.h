/* The fused iteration as one kernel whose state stays on the chip: tiers BLOCK, CLUSTER and GRID (device/view.h).
 *
 * A thread block owns a part: a range of bodies and the sides of their constraints. Four lanes (a quad) take a side,
 * one contact point each (points k and k + 4 where pairs have up to 8), and keep it in registers through all
 * iterations. The multipliers of a pair between two dynamic bodies are thereby computed twice, from the same inputs by
 * the same expressions, so that both copies stay equal bit for bit and no wrench ever leaves its block: an iteration
 * exchanges velocities, and nothing else.
 *   BLOCK    parts are whole islands: nothing to exchange
 *   CLUSTER  the blocks of a cluster read each other's velocities from shared memory, written alternately to two
 *            buffers, and meet in one cluster barrier an iteration
 *   GRID     velocities go through global memory, two buffers again, with one grid barrier an iteration. The launch is
 *            cooperative, so that every block runs and the spinning ends.
 * A quad takes a side of a constraint given by rows, too, up to two rows a lane (persistent_rows.h); a warp has sides
 * of pairs or of such constraints, never both.
 *
 * On entry and exit everything is in global memory as the stepwise kernels leave it. Before the first iteration and
 * after the last one of a step, BLOCK may also do what else an island needs (prologue.h).
 */
#ifndef SADMM_CUDA_ITERATE_PERSISTENT_H
#define SADMM_CUDA_ITERATE_PERSISTENT_H

#include "persistent_load.h"
#include "persistent_steps.h"

#include "backend_cuda/device/plan_check.h"

/* ---- the kernel ------------------------------------------------------------------------------------------------ */

/* The step is aborted; or a block without bodies, or a cluster: there are more than islands, mostly. In the grid
 * everybody comes to the barrier. Or the stop rule is met. */
template <int MODE, bool FAST>
static __device__ __forceinline__ bool nothing_to_do(const model_view &model, const graph_view &graph,
                                                     const island_view &islands, const cuda_args &args)
{
    const int32_t cluster = MODE == BLOCK ? 1 : args.cluster, part = (int32_t)blockIdx.x / cluster * cluster,
                  first = graph.parts[part], end = graph.parts[part + cluster];
    /* Asked for beside them: neither load waits for the other. */
    if (model.live->abort_code || (FAST && MODE != BLOCK && all_stopped(islands, args.checks))) return true;
    if (MODE == GRID) return false;
    return first == end || (FAST && MODE == BLOCK && part_stopped(graph, islands, args.checks, first, end));
}

/* All iterations of a batch by the method `fast` (math/relax.h): Steps 2-4, then Step 1. An iteration has the barriers
 * of the other method's. */
template <int MODE, int SIZE, class Part>
static __device__ __forceinline__ void iterate_fast(Part &part, const cuda_view &v, const cuda_args &args,
                                                    real relaxation, row_lane *rows, unsigned *target)
{
    int32_t count = args.count, batch = args.goes_on ? count + 1 : count, step1_done = args.step1_done;
    /* Were it the launch's constant, and not a choice, it would be fetched in every iteration. */
    real all = part.bodies > 0 ? relaxation : (real)1;
    keep<SIZE>(&count), keep<SIZE>(&batch), keep<SIZE>(&step1_done), keep<SIZE>(&all);
    for (int32_t i = 0; i < count; ++i) {
        const int32_t odd = i & 1;
        const bool plain = !relax_constraints(i, batch) || all == 1;
        real relaxation_factor = plain ? (real)1 : all,
             velocity_factor = relax_velocity(i, batch, step1_done) ? all : (real)1;
        keep<SIZE>(&relaxation_factor), keep<SIZE>(&velocity_factor);
        if (HAS_ROWS<SIZE> && part.row_sides) part.update_rows(*rows, odd, relaxation_factor);
        else part.update_sides(odd, relaxation_factor, plain);
        block_barrier<SIZE>();
        part.move_bodies_fast(!odd, velocity_factor, relaxation_factor);
        step1_done = 1;
        arrive<MODE, SIZE>(v.iteration.barrier);
        if (part.has_moves()) part.own_body.b = residual_after(part.own_body, part.sum, part.step, relaxation_factor);
        wait<MODE, SIZE>(v.iteration.barrier, *target += gridDim.x);
    }
}

/* The same by the method `paper`: Step 1, then Steps 2-4. */
template <int MODE, int SIZE, class Part>
static __device__ __forceinline__ void iterate_paper(Part &part, const cuda_view &v, const cuda_args &args,
                                                     row_lane *rows, unsigned *target)
{
    for (int32_t iteration = 1; iteration <= args.count; ++iteration) {
        const int32_t odd = iteration & 1;
        part.move_bodies(odd);
        arrive<MODE, SIZE>(v.iteration.barrier);
        if (part.has_moves()) part.momentum = free_momentum(part.own_body);
        wait<MODE, SIZE>(v.iteration.barrier, *target += gridDim.x);
        if (HAS_ROWS<SIZE> && part.row_sides) part.update_rows(*rows, odd, 1);
        else part.update_sides(odd, 1, true);
        block_barrier<SIZE>();
    }
}

/* A batch's iterations; then what they leave is stored. */
template <int MODE, int SIZE, bool FAST, class Part>
static __device__ __forceinline__ void iterate(Part &part, const cuda_view &v, const cuda_args &args, real relaxation)
{
    unsigned target = 0;
    row_lane rows = {};
    if (HAS_ROWS<SIZE> && part.row_sides)
        rows.load<FAST>(v, part.lane, part.is_row_side(), part.side_code, part.row_memory);
    if (FAST && MODE != BLOCK) { /* others read the velocities that were loaded */
        arrive<MODE, SIZE>(v.iteration.barrier);
        wait<MODE, SIZE>(v.iteration.barrier, target += gridDim.x);
    }
    if (FAST) iterate_fast<MODE, SIZE>(part, v, args, relaxation, &rows, &target);
    else iterate_paper<MODE, SIZE>(part, v, args, &rows, &target);
    /* No block may read this one's memory once it is gone. */
    if (!FAST && MODE == CLUSTER) {
        arrive<MODE, SIZE>(v.iteration.barrier);
        wait<MODE, SIZE>(v.iteration.barrier, 0);
    }
    /* After the iterations: what has come takes a place beside them. A cooperative launch ends 10 us later for it, and
     * after clusters it gains nothing. */
    if (MODE == BLOCK) pdl_trigger();
    part.store_bodies(args.count & 1);
    if (!part.has_side() || part.side_stopped()) return;
    if (HAS_ROWS<SIZE> && part.row_sides) rows.store(part.lane);
    else part.store_pair();
}

/* A batch's iterations, and the energy limit after them. */
template <int MODE, int SIZE, bool FAST, bool PROLOGUE, class Part>
static __device__ __forceinline__ void run_batch(Part &part, const cuda_view &v, const cuda_args &args, real relaxation,
                                                 const block_part &block)
{
    iterate<MODE, SIZE, FAST>(part, v, args, relaxation);
    if (!FAST || args.energy_limit == LIMIT_NONE) return;
    const bool candidates = part.has_candidate(args.count & 1);
    if (!PROLOGUE || args.energy_limit == LIMIT_CANDIDATES) {
        if (candidates) *v.islands.candidates = 1;
        return;
    }
    if constexpr (PROLOGUE) {
        if (candidates) block.flags[FLAG_CANDIDATES] = 1;
        block_barrier<SIZE>();
        if (block.flags[FLAG_CANDIDATES] || block.flags[FLAG_FLOATING])
            limit_in_block(v, args.rebounds, block, [] { block_barrier<SIZE>(); });
    }
}

/* A multiprocessor holds one block at least: unless told so the compiler gives a block of one warp fewer registers than
 * it needs. */
template <int POINTS, int MODE, int SIZE, bool FAST>
static __global__ void __launch_bounds__(most_threads(POINTS, SIZE), 1)
    persistent_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    CUDA_DYNAMIC_SHARED(memory);
    pdl_wait();
    /* They take registers. */
    constexpr bool PROLOGUE = FAST && MODE == BLOCK && !HAS_ROWS<SIZE> && SIZE != ANY_SIZE;
    if (nothing_to_do<MODE, FAST>(v.model, v.graph, v.islands, args)) {
        if (PROLOGUE && args.begin) stamp_assembled(v.step);
        return;
    }
    part_run<POINTS, MODE, SIZE, FAST> part(v, args, memory);
    const auto barrier = [] { block_barrier<SIZE>(); };
    const block_part block = part.for_prologue();
    const bool begins = PROLOGUE && args.begin;
    /* floating islands: this kernel finds them out as it begins, or an earlier one has */
    if (PROLOGUE && threadIdx.x == 0) {
        block.flags[FLAG_CANDIDATES] = 0;
        block.flags[FLAG_FLOATING] = begins || args.energy_limit != LIMIT_WHOLE ? 0 : *v.islands.floating;
    }
    if constexpr (PROLOGUE)
        if (begins) store_first_terms(v, args, block, part.found);
    part.fetch_side(); /* on its way while islands are weighed */
    if constexpr (PROLOGUE)
        if (begins) {
            weigh_in_block(v, args, block, part.found, barrier);
            /* for kernels after this one */
            if (threadIdx.x == 0 && block.flags[FLAG_FLOATING]) *v.islands.floating = 1;
            stamp_assembled(v.step);
        }
    const real relaxation = FAST ? (real)v.model.settings->relaxation : (real)1; /* on its way with what is loaded */
    part.load();
    run_batch<MODE, SIZE, FAST, PROLOGUE>(part, v, args, relaxation, block);
}

/* ---- instances ------------------------------------------------------------------------------------------------- */

/* Is there such an instance? Each takes long to compile, and is there for what steps take longer without it.
 * Boxes on boxes touch in up to 8 points, mostly 4: with 4 a lane needs fewer registers. */
template <int POINTS, int MODE, int SIZE, bool FAST> constexpr bool exists(void)
{
    const bool in_double = sizeof(solver_real) == sizeof(double);
    if (SIZE == ONE_WARP) return MODE == BLOCK;
    return !(SIZE == SMALL && MODE == GRID && in_double && !FAST);
}

struct persistent_instance {
    int points, threads; /* at most */
    bool rows, fast;
    cuda_kernel kernel; /* NULL: does not exist */
    const char *name;
};

template <int POINTS, int MODE, int SIZE, bool FAST> constexpr persistent_instance instance(const char *name)
{
    persistent_instance one = {POINTS, most_threads(POINTS, SIZE), HAS_ROWS<SIZE>, FAST, nullptr, name};
    if constexpr (exists<POINTS, MODE, SIZE, FAST>()) one.kernel = persistent_kernel<POINTS, MODE, SIZE, FAST>;
    return one;
}

/* All of a mode, which has a source of its own; from those of few threads to those of many. */
struct persistent_instances {
    const persistent_instance *first;
    size_t count;
};
persistent_instances CUDA(block_instances)(void);
persistent_instances CUDA(cluster_instances)(void);
persistent_instances CUDA(grid_instances)(void);

#define OF_POINTS(points, mode, fast, name)                                                      \
    instance<points, mode, ONE_WARP, fast>("iterate (" name ", " #points " points, warp)"),      \
        instance<points, mode, SMALL, fast>("iterate (" name ", " #points " points, small)"),    \
        instance<points, mode, ANY_SIZE, fast>("iterate (" name ", " #points " points)"),        \
        instance<points, mode, WITH_ROWS, fast>("iterate (" name ", " #points " points, rows)")
#define OF_MODE(mode, name)                                                                      \
    OF_POINTS(4, mode, false, name), OF_POINTS(8, mode, false, name),                            \
        OF_POINTS(4, mode, true, "fast, " name), OF_POINTS(8, mode, true, "fast, " name)

#endif
