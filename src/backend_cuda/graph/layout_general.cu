/* The layout of a scene of any size: a kernel a stage, sorts by CUB (graph/layout_view.h). */
#include "backend_cuda/device/parallel.h"
#include "layout_steps.h"

static __device__ __forceinline__ int32_t thread_index(void)
{
    return (int32_t)(blockIdx.x * (unsigned)LAYOUT_THREADS + threadIdx.x);
}

static int64_t blocks_for(int64_t threads) { return (threads + LAYOUT_THREADS - 1) / LAYOUT_THREADS; }

/* No more than run at once, each going on through the records or bodies: facts take few atomics on one place. */
static int64_t few_blocks_for(const struct layout_view *v, int64_t threads)
{
    return blocks_for(threads) < v->most_blocks ? blocks_for(threads) : v->most_blocks;
}

/* ---- survey ---------------------------------------------------------------------------------------------------- */

static __global__ void clear_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
    if (v.live->halt) return;
    const int32_t i = thread_index();
    if (i == 0) {
        cuda_facts none = {};
        *v.facts = none;
    }
    if (i < v.bodies) clear_body(v, i);
}

/* A stage whose threads find facts: for_each(base, facts) is called for the thread's items base + threadIdx.x. */
template <class F> static __device__ __forceinline__ void find_facts(const layout_view &v, int32_t count, F for_each)
{
    LAYOUT_SHARED(memory);
    cuda_facts *block = (cuda_facts *)memory, own = {};
    if (threadIdx.x == 0) *block = own;
    __syncthreads();
    for (int32_t base = (int32_t)blockIdx.x * LAYOUT_THREADS; base < count; base += (int32_t)gridDim.x * LAYOUT_THREADS)
        for_each(base + (int32_t)threadIdx.x, &own);
    gather_facts(block, own);
    if (threadIdx.x == 0) merge_facts(v.facts, *block);
}

static __global__ void __launch_bounds__(LAYOUT_THREADS)
    records_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args args)
{
    if (v.live->halt) return;
    const int32_t pairs = v.live->pairs, records = v.pair_room + v.rows;
    find_facts(v, records, [&](int32_t record, cuda_facts *own) {
        if (record < records) survey_record<false>(v, record, pairs, args.islands, own);
    });
}

static __global__ void __launch_bounds__(LAYOUT_THREADS)
    bodies_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args args)
{
    if (v.live->halt) return;
    find_facts(v, v.bodies, [&](int32_t i, cuda_facts *own) { survey_body<false>(v, i, args.islands, own); });
}

/* ---- layout ---------------------------------------------------------------------------------------------------- */

static __global__ void slots_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
    const int32_t s = thread_index();
    if (s < v.bodies && !v.live->halt) v.slot_of[v.body_of[s]] = s;
}

static __global__ void half_slots_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
    const int32_t h = thread_index();
    if (h >= 2 * (v.pair_room + v.rows) || v.live->halt) return;
    const int32_t body = v.half_body[h];
    v.half_slot[h] = body < v.bodies ? v.slot_of[body] : v.bodies;
}

/* Where each body's halves begin among the sorted ones; slots that are raw indices. */
static __global__ void offsets_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args args)
{
    const int32_t s = thread_index();
    if (s > v.bodies || v.live->halt) return;
    int32_t first = 0, last = v.facts->halves;
    while (first < last) {
        int32_t middle = first + (last - first) / 2;
        if (v.sorted[middle] < s) first = middle + 1;
        else last = middle;
    }
    v.offsets[s] = first;
    if (s < v.bodies && !args.islands) v.body_of[s] = v.slot_of[s] = s;
    if (s == 0) v.facts->part_halves = v.facts->part_bodies = 0;
}

static __global__ void __launch_bounds__(ONE_BLOCK_THREADS)
    parts_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args args)
{
    LAYOUT_SHARED(memory);
    if (!v.live->halt) make_parts(v, args.partition, ONE_BLOCK_THREADS, (int32_t *)memory);
}

static __global__ void number_kernel(const __grid_constant__ layout_view v, const __grid_constant__ layout_args)
{
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

cudaError_t LAYOUT(survey)(const struct layout_view *v, bool islands, cudaStream_t stream, const char **kernel)
{
    layout_args args = {};
    args.islands = islands;
    LAUNCH(clear_kernel, "survey (clear)", blocks_for((int64_t)v->bodies + 1), LAYOUT_THREADS, 0);
    LAUNCH(records_kernel, "survey (records)", few_blocks_for(v, (int64_t)v->pair_room + v->rows), LAYOUT_THREADS,
           sizeof(cuda_facts));
    LAUNCH(bodies_kernel, "survey (bodies)", few_blocks_for(v, v->bodies), LAYOUT_THREADS, sizeof(cuda_facts));
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
                        int32_t count, cudaStream_t stream)
{
    size_t bytes = v->temp_bytes;
    if (count == 0) return cudaSuccess;
    return COLLISION(sort_numbers)(v->temp, &bytes, keys, sorted_keys, v->numbers, sorted_values, count,
                                   bits_of(v->bodies), stream);
}

cudaError_t LAYOUT(make)(const struct layout_view *v, const struct cuda_partition *partition, cudaStream_t stream,
                         const char **kernel)
{
    const int32_t halves = 2 * (v->pair_room + v->rows);
    layout_args args = {};
    cudaError_t code;
    args.islands = slots_by_island(partition);
    args.partition = *partition;
    if (args.islands) {
        *kernel = "layout (sort of bodies)";
        code = sort(v, v->label, v->sorted_label, v->body_of, v->bodies, stream);
        if (code != cudaSuccess) return code;
        LAUNCH(slots_kernel, "layout (slots)", blocks_for(v->bodies), LAYOUT_THREADS, 0);
        LAUNCH(half_slots_kernel, "layout (slots of halves)", blocks_for(halves), LAYOUT_THREADS, 0);
    }
    *kernel = "layout (sort of halves)";
    code = sort(v, args.islands ? v->half_slot : v->half_body, v->sorted, v->incident, halves, stream);
    if (code != cudaSuccess) return code;
    LAUNCH(offsets_kernel, "layout (offsets)", blocks_for((int64_t)v->bodies + 1), LAYOUT_THREADS, 0);
    if (partition->tier != SADMM_CUDA_TIER_STREAM)
        LAUNCH(parts_kernel, "layout (parts)", 1, ONE_BLOCK_THREADS, 2 * sizeof(int32_t));
    return cudaSuccess;
}

cudaError_t LAYOUT(temp_bytes)(int32_t bodies, int32_t halves, size_t *bytes)
{
    size_t of_bodies = 0, of_halves = 0;
    cudaError_t code = cudaSuccess;
    if (bodies > 0)
        code = COLLISION(sort_numbers)(nullptr, &of_bodies, nullptr, nullptr, nullptr, nullptr, bodies, bits_of(bodies),
                                       nullptr);
    if (code == cudaSuccess && halves > 0)
        code = COLLISION(sort_numbers)(nullptr, &of_halves, nullptr, nullptr, nullptr, nullptr, halves, bits_of(bodies),
                                       nullptr);
    *bytes = of_bodies > of_halves ? of_bodies : of_halves;
    return code;
}

cudaError_t LAYOUT(number)(int32_t *numbers, int32_t count, cudaStream_t stream, const char **kernel)
{
    layout_view to = {}, *v = &to;
    layout_args args = {};
    to.label = numbers;
    to.bodies = count;
    LAUNCH(number_kernel, "layout (numbers)", blocks_for(count), LAYOUT_THREADS, 0);
    return cudaSuccess;
}
