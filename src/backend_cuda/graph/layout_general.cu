/* The layout of a scene of any size: a kernel a stage, sorts by CUB (graph/layout_kernels.h). */
#include "backend_cuda/device/parallel.h"
#include "layout_steps.h"

static __device__ __forceinline__ int32_t thread_index(void)
{
    return (int32_t)(blockIdx.x * (unsigned)LAYOUT_THREADS + threadIdx.x);
}

static int64_t blocks_for(int64_t threads) { return (threads + LAYOUT_THREADS - 1) / LAYOUT_THREADS; }

/* No more than run at once, each going on through the records or bodies: statistics take few atomics on one place. */
static int64_t few_blocks_for(const struct layout_view *v, int64_t threads)
{
    return blocks_for(threads) < v->most_blocks ? blocks_for(threads) : v->most_blocks;
}

/* ---- statistics ----------------------------------------------------------------------------------------------------
 */

static __global__ void clear_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
    pdl_wait();
    if (v.live->abort_code) return;
    const int32_t i = thread_index();
    if (i == 0) {
        cuda_graph_statistics none = {};
        *v.statistics = none;
    }
    if (i < v.bodies) clear_body(v, i);
}

/* A stage whose threads find statistics: for_each(base, statistics) is called for the thread's items base +
 * threadIdx.x. */
template <class F>
static __device__ __forceinline__ void find_statistics(const layout_view &v, int32_t count, F for_each)
{
    LAYOUT_SHARED(memory);
    cuda_graph_statistics *block = (cuda_graph_statistics *)memory, own = {};
    if (threadIdx.x == 0) *block = own;
    __syncthreads();
    for (int32_t base = (int32_t)blockIdx.x * LAYOUT_THREADS; base < count; base += (int32_t)gridDim.x * LAYOUT_THREADS)
        for_each(base + (int32_t)threadIdx.x, &own);
    gather_statistics(block, own);
    if (threadIdx.x == 0) merge_statistics(v.statistics, *block);
}

static __global__ void __launch_bounds__(LAYOUT_THREADS)
    records_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args args)
{
    pdl_wait();
    if (v.live->abort_code) return;
    const int32_t pairs = v.live->pairs, records = v.pair_capacity + v.rows;
    find_statistics(v, records, [&](int32_t record, cuda_graph_statistics *own) {
        if (record < records) statistics_of_record<false>(v, record, pairs, args.islands, own);
    });
}

static __global__ void flatten_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
    pdl_wait();
    const int32_t i = thread_index();
    if (i < v.bodies && !v.live->abort_code) flatten_body(v, i);
}

static __global__ void join_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
    pdl_wait();
    const int32_t record = thread_index();
    if (record < v.pair_capacity + v.rows && !v.live->abort_code) join_record(v, record);
}

static __global__ void __launch_bounds__(LAYOUT_THREADS)
    bodies_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args args)
{
    pdl_wait();
    if (v.live->abort_code) return;
    find_statistics(v, v.bodies,
                    [&](int32_t i, cuda_graph_statistics *own) { statistics_of_body<false>(v, i, args.islands, own); });
}

/* ---- layout ---------------------------------------------------------------------------------------------------- */

static __global__ void slots_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
    pdl_wait();
    const int32_t s = thread_index();
    if (s < v.bodies && !v.live->abort_code) v.slot_of[v.body_of[s]] = s;
}

static __global__ void side_slots_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
    pdl_wait();
    const int32_t h = thread_index();
    if (h >= 2 * (v.pair_capacity + v.rows) || v.live->abort_code) return;
    const int32_t body = v.side_body[h];
    v.side_slot[h] = body < v.bodies ? v.slot_of[body] : v.bodies;
}

/* Where each body's sides begin among the sorted ones; slots that are raw indices. */
static __global__ void offsets_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args args)
{
    pdl_wait();
    const int32_t s = thread_index();
    if (s > v.bodies || v.live->abort_code) return;
    int32_t first = 0, last = v.statistics->sides;
    while (first < last) {
        int32_t middle = first + (last - first) / 2;
        if (v.sorted[middle] < s) first = middle + 1;
        else last = middle;
    }
    v.offsets[s] = first;
    if (s < v.bodies && !args.islands) v.body_of[s] = v.slot_of[s] = s;
    if (s == 0) v.statistics->part_sides = v.statistics->part_bodies = 0;
}

static __global__ void __launch_bounds__(ONE_BLOCK_THREADS)
    parts_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args args)
{
    pdl_wait();
    LAYOUT_SHARED(memory);
    if (!v.live->abort_code) make_parts(v, args.partition, ONE_BLOCK_THREADS, (int32_t *)memory);
}

static __global__ void number_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
    pdl_wait();
    const int32_t i = thread_index();
    if (i < v.bodies) v.label[i] = i;
}

/* ---- launches -------------------------------------------------------------------------------------------------- */

#define LAUNCH(function, name, blocks, threads, shared)                                                       \
    do {                                                                                                      \
        *kernel = (name);                                                                                     \
        cudaError_t launch_code = layout_launch((function), (blocks), (threads), (shared), v, &args, stream); \
        if (launch_code != cudaSuccess) return launch_code;                                                   \
    } while (0)

cudaError_t LAYOUT(statistics)(const struct layout_view *v, bool islands, const struct layout_stream &stream,
                               const char **kernel)
{
    layout_args args = {};
    args.islands = islands;
    LAUNCH(clear_kernel, "statistics (clear)", blocks_for((int64_t)v->bodies + 1), LAYOUT_THREADS, 0);
    LAUNCH(records_kernel, "statistics (records)", few_blocks_for(v, (int64_t)v->pair_capacity + v->rows),
           LAYOUT_THREADS, sizeof(cuda_graph_statistics));
    if (islands) {
        LAUNCH(flatten_kernel, "statistics (roots)", blocks_for(v->bodies), LAYOUT_THREADS, 0);
        LAUNCH(join_kernel, "statistics (islands)", blocks_for((int64_t)v->pair_capacity + v->rows), LAYOUT_THREADS, 0);
    }
    LAUNCH(bodies_kernel, "statistics (bodies)", few_blocks_for(v, v->bodies), LAYOUT_THREADS,
           sizeof(cuda_graph_statistics));
    return cudaSuccess;
}

/* Bits of the numbers 0 .. most. */
static int bits_of(int32_t most)
{
    int bits = 1;
    while (bits < 31 && most >> bits) ++bits;
    return bits;
}

static cudaError_t sort(const struct layout_view *v, const int32_t *keys, int32_t *sorted_keys, int32_t *sorted_values,
                        int32_t count, const struct layout_stream &stream)
{
    size_t bytes = v->temp_bytes;
    if (count == 0) return cudaSuccess;
    return COLLISION(sort_numbers)(v->temp, &bytes, keys, sorted_keys, v->numbers, sorted_values, count,
                                   bits_of(v->bodies), stream.stream);
}

cudaError_t LAYOUT(make)(const struct layout_view *v, const struct cuda_partition *partition,
                         const struct layout_stream &stream, const char **kernel)
{
    const int32_t sides = 2 * (v->pair_capacity + v->rows);
    layout_args args = {};
    cudaError_t code;
    args.islands = slots_by_island(partition);
    args.partition = *partition;
    if (args.islands) {
        *kernel = "layout (sort of bodies)";
        code = sort(v, v->label, v->sorted_label, v->body_of, v->bodies, stream);
        if (code != cudaSuccess) return code;
        LAUNCH(slots_kernel, "layout (slots)", blocks_for(v->bodies), LAYOUT_THREADS, 0);
        LAUNCH(side_slots_kernel, "layout (slots of sides)", blocks_for(sides), LAYOUT_THREADS, 0);
    }
    *kernel = "layout (sort of sides)";
    code = sort(v, args.islands ? v->side_slot : v->side_body, v->sorted, v->incident, sides, stream);
    if (code != cudaSuccess) return code;
    LAUNCH(offsets_kernel, "layout (offsets)", blocks_for((int64_t)v->bodies + 1), LAYOUT_THREADS, 0);
    if (partition->tier != SADMM_CUDA_TIER_STREAM)
        LAUNCH(parts_kernel, "layout (parts)", 1, ONE_BLOCK_THREADS, 2 * sizeof(int32_t));
    return cudaSuccess;
}

cudaError_t LAYOUT(temp_bytes)(int32_t bodies, int32_t sides, size_t *bytes)
{
    size_t of_bodies = 0, of_sides = 0;
    cudaError_t code = cudaSuccess;
    if (bodies > 0)
        code = COLLISION(sort_numbers)(nullptr, &of_bodies, nullptr, nullptr, nullptr, nullptr, bodies, bits_of(bodies),
                                       nullptr);
    if (code == cudaSuccess && sides > 0)
        code = COLLISION(sort_numbers)(nullptr, &of_sides, nullptr, nullptr, nullptr, nullptr, sides, bits_of(bodies),
                                       nullptr);
    *bytes = of_bodies > of_sides ? of_bodies : of_sides;
    return code;
}

cudaError_t LAYOUT(number)(int32_t *numbers, int32_t count, const struct layout_stream &stream, const char **kernel)
{
    layout_view to = {}, *v = &to;
    layout_args args = {};
    to.label = numbers;
    to.bodies = count;
    LAUNCH(number_kernel, "layout (numbers)", blocks_for(count), LAYOUT_THREADS, 0);
    return cudaSuccess;
}
