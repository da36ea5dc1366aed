/* The whole layout of a small scene by one block, in shared memory (graph/layout_kernels.h). */
#include "layout_steps.h"

/* A body or side to be sorted is one number, key << ITEM_BITS | index: indices ascend within a key. */
enum { ITEM_BITS = 20, KEY_BITS = 32 - ITEM_BITS, DIGIT_BITS = 6, DIGITS = 1 << DIGIT_BITS };
enum { WARPS = ONE_BLOCK_THREADS / LAYOUT_WARP, COUNTERS = DIGITS * WARPS };

struct one_block_memory {
    cuda_graph_statistics *statistics;
    int32_t *most;                                           /* 2 */
    int32_t *label, *degree, *island_bodies, *island_sides; /* bodies */
    int32_t *body_of, *slot_of, *offsets;                    /* bodies, bodies, bodies + 1 */
    int32_t *counters, *totals;                              /* COUNTERS, WARPS */
    uint32_t *items, *sorted;                                /* sides or bodies, what there are more of */
};

/* One description for its size and its addresses (base NULL: only that). */
static __host__ __device__ inline size_t place(one_block_memory *m, unsigned char *base, int32_t bodies, int32_t sides)
{
    const size_t n = (size_t)bodies, items = (size_t)(sides > bodies ? sides : bodies);
    size_t used = 0;
    auto take = [&](size_t bytes) {
        size_t at = used;
        used += (bytes + 15) / 16 * 16;
        return base ? base + at : nullptr;
    };
    m->statistics = (cuda_graph_statistics *)take(sizeof(cuda_graph_statistics));
    m->most = (int32_t *)take(2 * sizeof(int32_t));
    m->label = (int32_t *)take(n * sizeof(int32_t));
    m->degree = (int32_t *)take(n * sizeof(int32_t));
    m->island_bodies = (int32_t *)take(n * sizeof(int32_t));
    m->island_sides = (int32_t *)take(n * sizeof(int32_t));
    m->body_of = (int32_t *)take(n * sizeof(int32_t));
    m->slot_of = (int32_t *)take(n * sizeof(int32_t));
    m->offsets = (int32_t *)take((n + 1) * sizeof(int32_t));
    m->counters = (int32_t *)take(COUNTERS * sizeof(int32_t));
    m->totals = (int32_t *)take(WARPS * sizeof(int32_t));
    m->items = (uint32_t *)take(items * sizeof(uint32_t));
    m->sorted = (uint32_t *)take(items * sizeof(uint32_t));
    return used;
}

/* ---- sums and sorts of a block ----------------------------------------------------------------------------------- */

/* Exclusive sums in place. */
static __device__ void scan(int32_t *data, int32_t count, int32_t *totals)
{
    const int32_t t = (int32_t)threadIdx.x, lane = t % LAYOUT_WARP, warp = t / LAYOUT_WARP;
    const int32_t each = (count + ONE_BLOCK_THREADS - 1) / ONE_BLOCK_THREADS;
    const int32_t begin = t * each < count ? t * each : count, end = begin + each < count ? begin + each : count;
    int32_t own = 0;
    for (int32_t i = begin; i < end; ++i) own += data[i];
    int32_t before = own; /* the warp's lanes up to this one */
    for (int o = 1; o < LAYOUT_WARP; o *= 2) {
        int32_t lower = __shfl_up_sync(WHOLE_WARP, before, o);
        if (lane >= o) before += lower;
    }
    if (lane == LAYOUT_WARP - 1) totals[warp] = before;
    __syncthreads();
    /* There are as many warps as lanes: every warp adds up the ones before it. */
    int32_t next = before - own + warp_sum(lane < warp ? totals[lane] : 0);
    for (int32_t i = begin; i < end; ++i) {
        int32_t value = data[i];
        data[i] = next;
        next += value;
    }
    __syncthreads();
}

/* Lanes of the warp with the same digit (live ones only). */
static __device__ unsigned same_digit(uint32_t digit, bool live)
{
    unsigned same = __ballot_sync(WHOLE_WARP, live);
    for (int bit = 0; bit < DIGIT_BITS; ++bit) {
        const bool set = digit >> bit & 1;
        const unsigned with = __ballot_sync(WHOLE_WARP, set);
        same &= set ? with : ~with;
    }
    return same;
}

/* Radix sort by the keys of `bits` bits, least significant digit first; stable, since every warp goes through its own
 * range in order, and counters are summed up digit by digit, warps ascending. Returns where the result is. */
static __device__ uint32_t *sort(uint32_t *from, uint32_t *to, int32_t count, int bits, int32_t *counters,
                                 int32_t *totals)
{
    const int32_t t = (int32_t)threadIdx.x, lane = t % LAYOUT_WARP, warp = t / LAYOUT_WARP;
    const int32_t rounds = (count + ONE_BLOCK_THREADS - 1) / ONE_BLOCK_THREADS;
    const int32_t first = warp * rounds * LAYOUT_WARP + lane;
    const unsigned below = (1u << lane) - 1;
    for (int shift = ITEM_BITS; shift < ITEM_BITS + bits; shift += DIGIT_BITS) {
        for (int32_t i = t; i < COUNTERS; i += ONE_BLOCK_THREADS) counters[i] = 0;
        __syncthreads();
        for (int pass = 0; pass < 2; ++pass) { /* count, then move */
            for (int32_t round = 0; round < rounds; ++round) {
                const int32_t i = first + round * LAYOUT_WARP;
                const bool live = i < count;
                const uint32_t item = live ? from[i] : 0, digit = item >> shift & (DIGITS - 1);
                const unsigned same = same_digit(digit, live), rank = (unsigned)__popc(same & below);
                int32_t at = 0;
                if (live && rank == 0) at = atomicAdd(&counters[digit * WARPS + (uint32_t)warp], __popc(same));
                if (pass == 0) continue;
                at = __shfl_sync(WHOLE_WARP, at, live ? __ffs((int)same) - 1 : lane, LAYOUT_WARP);
                if (live) to[at + (int32_t)rank] = item;
            }
            __syncthreads();
            if (pass == 0) scan(counters, COUNTERS, totals);
        }
        uint32_t *other = from;
        from = to;
        to = other;
    }
    return from;
}

/* ---- stages ---------------------------------------------------------------------------------------------------- */

static __device__ void statistics(const layout_view &v, const layout_view &global, bool islands)
{
    const int32_t t = (int32_t)threadIdx.x, pairs = v.live->pairs;
    cuda_graph_statistics own = {};
    if (t == 0) *v.statistics = own;
    for (int32_t i = t; i < v.bodies; i += ONE_BLOCK_THREADS) clear_body(v, i);
    __syncthreads();
    for (int32_t k = t; k < pairs + v.rows; k += ONE_BLOCK_THREADS)
        statistics_of_record<true>(v, k < pairs ? k : v.pair_capacity + k - pairs, pairs, islands, &own);
    __syncthreads();
    for (int32_t base = 0; base < v.bodies; base += ONE_BLOCK_THREADS)
        statistics_of_body<true>(v, base + t, islands, &own);
    gather_statistics(v.statistics, own);
    /* for a layout that is made by a launch of its own */
    for (int32_t i = t; i < v.bodies; i += ONE_BLOCK_THREADS) {
        global.label[i] = v.label[i];
        global.degree[i] = v.degree[i];
        global.island_bodies[i] = v.island_bodies[i];
    }
    if (t == 0) *global.statistics = *v.statistics;
}

/* Are the pairs, body by body, those that the arrays were made for? Then only what may differ is counted, into
 * *statistics (shared memory). Every thread comes here; `same` is shared. */
static __device__ bool same_pairs(const layout_view &v, const layout_args &args, int32_t *same,
                                  cuda_graph_statistics *statistics)
{
    const int32_t t = (int32_t)threadIdx.x, pairs = v.live->pairs;
    const struct cuda_partition *now = &args.partition, *kept = &v.kept->partition;
    cuda_graph_statistics own = {};
    if (t == 0) {
        *statistics = own;
        *same = v.kept->valid && v.kept->pairs == pairs && v.rows == 0 && kept->tier == now->tier &&
                kept->parts == now->parts && kept->cluster == now->cluster && kept->most_sides == now->most_sides &&
                kept->most_bodies == now->most_bodies && kept->islands == now->islands;
    }
    __syncthreads();
    if (!*same) return false;
    __syncthreads();
    bool differ = false;
    for (int32_t p = t; p < pairs; p += ONE_BLOCK_THREADS) {
        const pair_about about = load_about(&v.pairs[p]);
        const int2 side = *(const int2 *)&v.side_body[2 * p];
        differ = differ || side.x != (about.bodies.x >= 0 ? about.bodies.x : v.bodies) ||
                 side.y != (about.bodies.y >= 0 ? about.bodies.y : v.bodies);
        statistics_of_pair(v, about, v.pairs[p].friction, &own);
    }
    if (differ) atomicMin(same, 0);
    __syncthreads();
    if (!*same) return false;
    gather_statistics(statistics, own);
    if (t == 0) {
        v.statistics->rough = statistics->rough;
        v.statistics->warm = statistics->warm;
        v.statistics->cold = 0;
        v.statistics->point_slots = statistics->point_slots;
    }
    return true;
}

static __device__ void load_statistics(const layout_view &v, const layout_view &global)
{
    for (int32_t i = (int32_t)threadIdx.x; i < v.bodies; i += ONE_BLOCK_THREADS) {
        v.label[i] = global.label[i];
        v.degree[i] = global.degree[i];
        v.island_bodies[i] = global.island_bodies[i];
    }
    __syncthreads();
}

static __device__ void make_slots(const layout_view &v, const layout_view &global, bool islands, int bits,
                                  const one_block_memory &m)
{
    const int32_t t = (int32_t)threadIdx.x;
    const uint32_t *order = m.items;
    for (int32_t i = t; i < v.bodies; i += ONE_BLOCK_THREADS)
        m.items[i] = (uint32_t)(islands ? v.label[i] : 0) << ITEM_BITS | (uint32_t)i;
    __syncthreads();
    if (islands) order = sort(m.items, m.sorted, v.bodies, bits, m.counters, m.totals);
    for (int32_t s = t; s < v.bodies; s += ONE_BLOCK_THREADS) {
        const int32_t body = (int32_t)(order[s] & ((1u << ITEM_BITS) - 1));
        v.body_of[s] = global.body_of[s] = body;
        v.slot_of[body] = global.slot_of[body] = s;
        v.offsets[s] = v.degree[body];
    }
    if (t == 0) v.offsets[v.bodies] = 0;
    __syncthreads();
    scan(v.offsets, v.bodies + 1, m.totals);
}

static __device__ void list_sides(const layout_view &v, const layout_view &global, int bits, const one_block_memory &m)
{
    const int32_t t = (int32_t)threadIdx.x, of_pairs = 2 * v.live->pairs, count = of_pairs + 2 * v.rows;
    for (int32_t k = t; k < count; k += ONE_BLOCK_THREADS) {
        const int32_t side = k < of_pairs ? k : 2 * v.pair_capacity + k - of_pairs, body = v.side_body[side];
        const int32_t slot = body < v.bodies ? v.slot_of[body] : v.bodies;
        m.items[k] = (uint32_t)slot << ITEM_BITS | (uint32_t)side;
    }
    __syncthreads();
    const uint32_t *order = sort(m.items, m.sorted, count, bits, m.counters, m.totals);
    for (int32_t k = t; k < v.offsets[v.bodies]; k += ONE_BLOCK_THREADS)
        v.incident[k] = (int32_t)(order[k] & ((1u << ITEM_BITS) - 1));
    for (int32_t s = t; s <= v.bodies; s += ONE_BLOCK_THREADS) global.offsets[s] = v.offsets[s];
}

static __global__ void __launch_bounds__(ONE_BLOCK_THREADS)
    one_block_kernel(const __grid_constant__ layout_view global, const __grid_constant__ layout_args args)
{
    pdl_wait();
    pdl_trigger();
    LAYOUT_SHARED(memory);
    one_block_memory m;
    layout_view v = global; /* with the arrays in shared memory where there is one */
    if (global.live->abort_code) return;
    place(&m, memory, v.bodies, 2 * (v.pair_capacity + v.rows));
    v.label = m.label;
    v.degree = m.degree;
    v.island_bodies = m.island_bodies;
    v.island_sides = m.island_sides;
    v.body_of = m.body_of;
    v.slot_of = m.slot_of;
    v.offsets = m.offsets;
    if (args.statistics && args.layout && same_pairs(global, args, m.most, m.statistics)) return;
    __syncthreads();
    if (args.statistics) {
        v.statistics = m.statistics;
        statistics(v, global, args.islands);
        v.statistics = global.statistics;
        __syncthreads();
    } else {
        load_statistics(v, global);
    }
    if (!args.layout) {
        if (threadIdx.x == 0) global.kept->valid = 0; /* side_body is another step's now */
        return;
    }
    int bits = 1;
    while (v.bodies >> bits) ++bits;
    make_slots(v, global, slots_by_island(&args.partition), bits, m);
    list_sides(v, global, bits, m);
    if (args.partition.tier != SADMM_CUDA_TIER_STREAM) make_parts(v, args.partition, ONE_BLOCK_THREADS, m.most);
    else if (threadIdx.x == 0) v.statistics->part_sides = v.statistics->part_bodies = 0;
    __syncthreads();
    if (threadIdx.x == 0) {
        global.kept->valid = global.live->abort_code == ABORT_NONE;
        global.kept->pairs = global.live->pairs;
        global.kept->partition = args.partition;
    }
}

/* ---- launch ---------------------------------------------------------------------------------------------------- */

size_t LAYOUT(one_block_shared)(int32_t bodies, int32_t sides)
{
    one_block_memory unused;
    if (bodies >> KEY_BITS || sides >> ITEM_BITS) return SIZE_MAX;
    return place(&unused, nullptr, bodies, sides);
}

cudaError_t LAYOUT(one_block_allow)(int bytes)
{
    return cudaFuncSetAttribute((const void *)one_block_kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes);
}

cudaError_t LAYOUT(one_block)(const struct layout_view *v, bool with_statistics, bool islands,
                              const struct cuda_partition *partition, const struct layout_stream &stream,
                              const char **kernel)
{
    layout_args args = {};
    args.statistics = with_statistics;
    args.islands = islands;
    args.layout = partition != nullptr;
    if (partition) args.partition = *partition;
    *kernel = "layout (one block)";
    return layout_launch(one_block_kernel, 1, ONE_BLOCK_THREADS,
                         LAYOUT(one_block_shared)(v->bodies, 2 * (v->pair_capacity + v->rows)), v, &args, stream);
}
