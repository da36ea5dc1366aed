/* Which tier a step runs in, on how many thread blocks of how many threads: from facts of its constraint graph.
 *
 * A part costs its halves + its bodies, and the layout gives every part an even share of all cost, rounded up to whole
 * islands (BLOCK, CLUSTER) or bodies (GRID). That bounds the largest part before it is made. The rooms of a launch
 * (threads, shared memory) are sized above the bound: facts may be those of a step before, and contacts come and go.
 */
#include "cuda_internal.h"

enum {
    QUAD = 4,          /* threads a half */
    SPREAD = 48,       /* halves a block of the grid at least: below that, barriers of more blocks cost more than they gain */
    MOST_BLOCKS = 16   /* thread blocks a multiprocessor */
};

static int64_t smaller(int64_t a, int64_t b) { return a < b ? a : b; }
static int64_t larger(int64_t a, int64_t b) { return a > b ? a : b; }
/* a / b, rounded up. */
static int64_t up(int64_t a, int64_t b) { return (a + b - 1) / b; }

/* What a part may have at most: halves by threads, bodies by shared memory. */
struct bound {
    int64_t halves, bodies;
};

/* Threads for a part within the bound, with an eighth to spare; beyond `most` there is no margin, then no room. */
static int64_t threads_for(struct bound bound, int64_t most)
{
    int64_t wanted = larger(QUAD * (bound.halves + bound.halves / 8), LANES * bound.bodies);
    /* Bodies beyond one for each eight threads take turns. */
    wanted = larger(smaller(wanted, most), QUAD * bound.halves);
    return up(larger(wanted, 1), WARP) * WARP;
}

/* Let the partition's blocks have `bytes` of shared memory each; false: the bound does not fit. */
static bool take_room(const struct sadmm_context *c, struct cuda_partition *partition, struct bound bound, int64_t bytes)
{
    bool rows = c->view.rows > 0;
    int64_t low = bound.bodies, high = larger(c->view.bodies, low);
    partition->most_halves = partition->threads / QUAD;
    if ((int64_t)CUDA(resident_shared)(partition->tier, partition->threads, (int32_t)low, rows) > bytes) return false;
    while (low < high) { /* the most bodies that fit */
        int64_t middle = (low + high + 1) / 2;
        if ((int64_t)CUDA(resident_shared)(partition->tier, partition->threads, (int32_t)middle, rows) <= bytes) low = middle;
        else high = middle - 1;
    }
    partition->most_bodies = (int32_t)low;
    partition->shared = CUDA(resident_shared)(partition->tier, partition->threads, partition->most_bodies, rows);
    return true;
}

/* Parts of whole islands: less than an even share, and then one island more (shares: at most the cost). */
static struct bound island_bound(const struct sadmm_context *c, const struct cuda_facts *facts, int64_t shares)
{
    int64_t share = up((int64_t)facts->halves + c->view.bodies, shares);
    struct bound bound = {smaller(facts->halves, share - 1 + facts->island_halves),
                          smaller(c->view.bodies, share - 1 + facts->island_bodies)};
    return bound;
}

/* Parts of whole bodies. */
static struct bound body_bound(const struct sadmm_context *c, const struct cuda_facts *facts, int64_t shares)
{
    int64_t share = up((int64_t)facts->halves + c->view.bodies, shares);
    struct bound bound = {smaller(facts->halves, share - 1 + facts->degree), smaller(c->view.bodies, share)};
    return bound;
}

/* Islands in thread blocks: NULL, or why not. */
static const char *choose_block(const struct sadmm_context *c, const struct cuda_facts *facts,
                                struct cuda_partition *partition)
{
    static const char too_large[] = "an island does not fit a thread block";
    if (c->refused >> SADMM_CUDA_TIER_BLOCK & 1) return "a thread block would get too much";
    const int64_t most = CUDA(resident_threads)(facts->point_slots), most_halves = most / QUAD;
    if (facts->island_halves > most_halves) return too_large;
    /* As many blocks a multiprocessor as run side by side and find an island each; when that is too few for the room a
     * block has, blocks that run one after another. */
    int64_t parts = c->multiprocessors, side_by_side = 1;
    while (side_by_side < MOST_BLOCKS && 2 * parts <= facts->islands &&
           2 * side_by_side * threads_for(island_bound(c, facts, 2 * parts), most) <= most) {
        parts *= 2;
        side_by_side *= 2;
    }
    while (island_bound(c, facts, parts).halves > most_halves) parts += parts / 4 + 1;
    if (facts->islands <= 1) parts = 1;
    struct bound bound = island_bound(c, facts, parts);
    partition->tier = SADMM_CUDA_TIER_BLOCK;
    partition->parts = (int32_t)parts;
    partition->cluster = 1;
    partition->threads = (int32_t)threads_for(bound, most);
    if (partition->threads > most) return too_large;
    if (take_room(c, partition, bound, c->shared_limit / side_by_side)) return nullptr;
    return take_room(c, partition, bound, c->shared_limit) ? nullptr : too_large;
}

/* Bodies over the whole device: NULL, or why not, or a device error in *code. */
static const char *choose_grid(const struct sadmm_context *c, const struct cuda_facts *facts,
                               struct cuda_partition *partition, cudaError_t *code)
{
    static const char too_many[] = "more constraints than the device can hold at once";
    const char *name = nullptr;
    if (c->refused >> SADMM_CUDA_TIER_GRID & 1) return "a thread block would get too much";
    const int64_t most = CUDA(resident_threads)(facts->point_slots), cost = (int64_t)facts->halves + c->view.bodies;
    if (!c->cooperative) return "the device has no cooperative launch";
    int64_t parts = larger(smaller(c->multiprocessors, up(cost, SPREAD)), 1);
    partition->tier = SADMM_CUDA_TIER_GRID;
    partition->cluster = 1;
    for (int64_t side_by_side = 1; side_by_side <= MOST_BLOCKS; side_by_side *= 2) {
        if (side_by_side > 1) parts = c->multiprocessors * side_by_side;
        struct bound bound = body_bound(c, facts, parts);
        int64_t threads = threads_for(bound, most);
        if (threads > most) continue;
        partition->parts = (int32_t)parts;
        partition->threads = (int32_t)threads;
        if (!take_room(c, partition, bound, c->shared_limit / side_by_side)) continue;
        int resident = 0;
        cuda_kernel kernel =
            CUDA(resident_kernel)(c->plan.contact_rows, facts->point_slots, SADMM_CUDA_TIER_GRID, true, &name);
        *code = cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, (const void *)kernel, partition->threads,
                                                              partition->shared);
        if (*code != cudaSuccess) return nullptr;
        return parts <= (int64_t)resident * c->multiprocessors ? nullptr : too_many;
    }
    return too_many;
}

sadmm_status CUDA(choose_partition)(struct sadmm_context *c, const struct cuda_facts *facts,
                                    struct cuda_partition *partition, struct sadmm_error *error)
{
    const enum sadmm_cuda_tier wanted = c->wanted;
    const bool any = wanted == SADMM_CUDA_TIER_AUTO;
    const char *why = any ? "" : "the device has no clusters";
    if (any || wanted == SADMM_CUDA_TIER_BLOCK) why = choose_block(c, facts, partition);
    if ((any && why) || wanted == SADMM_CUDA_TIER_GRID) {
        cudaError_t code = cudaSuccess;
        why = choose_grid(c, facts, partition, &code);
        if (code != cudaSuccess) return CUDA(fail)(c, code, "cudaOccupancyMaxActiveBlocksPerMultiprocessor", error);
    }
    if ((any && why) || wanted == SADMM_CUDA_TIER_STREAM) {
        struct cuda_partition stream = {SADMM_CUDA_TIER_STREAM, 0, 1, THREADS, INT32_MAX, INT32_MAX, 0};
        *partition = stream;
        why = nullptr;
    }
    return why ? sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "the cuda tier asked for: %s", why) : SADMM_OK;
}
