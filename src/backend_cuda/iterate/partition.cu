/* Which tier a step runs in, on how many thread blocks of how many threads: from statistics of its constraint graph.
 *
 * A part costs its sides + its bodies, and the layout gives every part an even share of all cost, rounded up to whole
 * islands (BLOCK, CLUSTER) or bodies (GRID). That bounds the largest part before it is made. The threads and the shared
 * memory of a launch are sized above the bound: statistics may be those of a step before, and contacts come and go.
 *
 * Which tier. An iteration takes what its barrier and its longest chain of dependent instructions take, and then the
 * time a multiprocessor needs for the sides it holds: its warps take turns. A thread block to an island has the
 * cheapest barrier; a cluster shares an island among 2 to 16 multiprocessors, and pays for it with a dearer barrier and
 * velocities from other multiprocessors; the grid shares among all of them, through memory. Whatever fits and is
 * estimated to be the fastest is taken, which comes to this:
 *   BLOCK    islands of up to about a hundred sides, and larger ones where there are so many islands that every
 *            multiprocessor has enough to do anyway
 *   CLUSTER  else, whenever a cluster can hold an island: its size such that a block holds some tens of sides, or as
 *            large as leaves one for every island
 *   GRID     an island that no cluster can hold, or a few that do not fit side by side
 *   STREAM   what the device cannot hold at once, and (fast) worlds of tens of thousands of bodies that touch nothing
 */
#include "iterate.h"

enum {
    QUAD = 4,    /* threads a side */
    SPREAD = 48, /* sides a block of the grid at least: below that, barriers of more blocks cost more than they gain */
    MOST_BLOCKS = 16, /* thread blocks a multiprocessor */
    MOST_CLUSTER = 16 /* thread blocks a cluster */
};

/* Times are those of the device (timings.cu); these are ratios. fast: what a body that touches nothing takes on its
 * multiprocessor, in sides; and of STREAM, which leaves out such bodies (iterate/streamed.cu), the kernels of an
 * iteration, and how many bodies it leaves out in the time of one. On an H200, of pile in flight an iteration took 1.4
 * us in BLOCK and 2.75 in STREAM with 20,000 boxes, 8.7 and 4.4 with 100,000; both take the same with 60,000. */
#define FREE_SIDES (8.0 / 3)
enum { STREAM_KERNELS = 2, STREAM_LEAVES_OUT = 68750 };

/* A partition, why there is none (else NULL), and its nanoseconds an iteration. */
struct choice {
    struct cuda_partition partition;
    const char *why;
    double time;
};

static int64_t smaller(int64_t a, int64_t b) { return a < b ? a : b; }
static int64_t larger(int64_t a, int64_t b) { return a > b ? a : b; }
/* a / b, rounded up. */
static int64_t up(int64_t a, int64_t b) { return (a + b - 1) / b; }

/* What a part may have at most: sides by threads, bodies by shared memory. */
struct bound {
    int64_t sides, bodies;
};

/* Places for sides that may stay empty: constraints given by rows begin with a warp (part_rows_from_pairs in
 * persistent_load.h). */
static int64_t spare_sides(const struct sadmm_context *c) { return c->view.rows.count > 0 ? WARP / QUAD - 1 : 0; }

/* The most sides that a block of so many threads takes. */
static int64_t most_sides_of(const struct sadmm_context *c, int64_t threads) { return threads / QUAD - spare_sides(c); }

/* Threads for a part within the bound, with an eighth to spare; beyond `most` there is no margin, then no capacity. */
static int64_t threads_for(const struct sadmm_context *c, struct bound bound, int64_t most)
{
    /* Bodies beyond one for each eight threads take turns: for them alone no block is so large that its threads have
     * fewer registers. */
    const int64_t needed = QUAD * (bound.sides + spare_sides(c)),
                  bodies = smaller(LANES * bound.bodies, CUDA(persistent_small_threads)());
    const int64_t wanted = larger(smaller(larger(needed + QUAD * (bound.sides / 8), bodies), most), needed);
    return up(larger(wanted, 1), WARP) * WARP;
}

/* Let the partition's blocks have `bytes` of shared memory each; false: the bound does not fit. */
static bool take_capacity(const struct sadmm_context *c, struct cuda_partition *partition, struct bound bound,
                          int64_t bytes)
{
    const int rows = c->view.rows.count;
    int64_t low = bound.bodies, high = larger(c->view.model.bodies, low);
    partition->most_sides = (int32_t)most_sides_of(c, partition->threads);
    if (partition->threads == WARP && bound.bodies > WARP / LANES) return false;
    if ((int64_t)CUDA(persistent_shared)(partition->tier, rows, partition->threads, (int32_t)low) > bytes) return false;
    while (low < high) { /* the most bodies that fit */
        int64_t middle = (low + high + 1) / 2;
        if ((int64_t)CUDA(persistent_shared)(partition->tier, rows, partition->threads, (int32_t)middle) <= bytes)
            low = middle;
        else high = middle - 1;
    }
    /* A block of one warp keeps all its bodies in registers (iterate/persistent.h). */
    if (partition->threads == WARP) low = smaller(low, WARP / LANES);
    partition->most_bodies = (int32_t)low;
    partition->shared = CUDA(persistent_shared)(partition->tier, rows, partition->threads, partition->most_bodies);
    return true;
}

/* Parts of whole islands: less than an even share, and then one island more (shares: at most the cost). */
static struct bound island_bound(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics,
                                 int64_t shares)
{
    int64_t share = up((int64_t)statistics->sides + c->view.model.bodies, shares);
    struct bound bound = {smaller(statistics->sides, larger(share - 1, 0) + statistics->island_sides),
                          smaller(c->view.model.bodies, larger(share - 1, 0) + statistics->island_bodies)};
    return bound;
}

/* Parts of whole bodies. */
static struct bound body_bound(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics,
                               int64_t shares)
{
    int64_t share = up((int64_t)statistics->sides + c->view.model.bodies, shares);
    struct bound bound = {smaller(statistics->sides, larger(share - 1, 0) + statistics->degree),
                          smaller(c->view.model.bodies, share)};
    return bound;
}

static struct choice no_choice(const char *why)
{
    struct choice none = {{}, why, INFINITY};
    return none;
}

static const char refused[] = "a thread block would get too much";
static const char too_many[] = "more thread blocks than the layout has capacity for";

/* No more than the layout has capacity for. */
static int64_t most_parts(const struct sadmm_context *c)
{
    return c->view.model.bodies + (int64_t)c->multiprocessors * MOST_BLOCKS;
}

/* Do blocks of so many parts take what is in them, `blocks` of them on a multiprocessor? */
static bool parts_fit(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics, int64_t parts,
                      int64_t blocks, int64_t most)
{
    const struct bound bound = island_bound(c, statistics, parts);
    return bound.sides <= most_sides_of(c, most) && blocks * threads_for(c, bound, most) <= most;
}

/* Parts in rounds of blocks that run one after another: as few rounds as there can be, and of those the smallest
 * blocks, which have more registers and do more of a step (persistent_does_prologue). */
static int64_t parts_in_rounds(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics,
                               int64_t most, int64_t *side_by_side)
{
    for (int64_t rounds = 1; rounds * c->multiprocessors <= most_parts(c); ++rounds)
        for (int64_t blocks = MOST_BLOCKS; blocks > 0; blocks /= 2) {
            const int64_t parts = rounds * blocks * c->multiprocessors;
            if (parts > most_parts(c) || !parts_fit(c, statistics, parts, blocks, most)) continue;
            *side_by_side = blocks;
            return parts;
        }
    return INT64_MAX;
}

/* Islands in thread blocks. */
static struct choice choose_block(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics)
{
    static const char too_large[] = "an island does not fit a thread block";
    if (c->refused >> SADMM_CUDA_TIER_BLOCK & 1) return no_choice(refused);
    const int64_t most = CUDA(persistent_threads)(statistics->point_slots, c->view.rows.count > 0),
                  most_sides = most_sides_of(c, most);
    if (statistics->island_sides > most_sides) return no_choice(too_large);
    /* As many blocks a multiprocessor as run side by side and find an island each; when that is too few for the memory
     * a block has, rounds of blocks that run one after another. */
    int64_t parts = c->multiprocessors, side_by_side = 1;
    while (side_by_side < MOST_BLOCKS && 2 * parts <= statistics->islands &&
           2 * side_by_side * threads_for(c, island_bound(c, statistics, 2 * parts), most) <= most) {
        parts *= 2;
        side_by_side *= 2;
    }
    if (island_bound(c, statistics, parts).sides > most_sides)
        parts = parts_in_rounds(c, statistics, most, &side_by_side);
    if (parts > most_parts(c)) return no_choice(too_many);
    if (statistics->islands <= 1) parts = 1;
    struct bound bound = island_bound(c, statistics, parts);
    struct choice choice = {};
    choice.partition.tier = SADMM_CUDA_TIER_BLOCK;
    choice.partition.parts = (int32_t)parts;
    choice.partition.cluster = 1;
    choice.partition.threads = (int32_t)threads_for(c, bound, most);
    if (choice.partition.threads > most) return no_choice(too_large);
    if (!take_capacity(c, &choice.partition, bound, c->shared_limit / side_by_side) &&
        !take_capacity(c, &choice.partition, bound, c->shared_limit))
        return no_choice(too_large);
    side_by_side = smaller(side_by_side, larger((int64_t)(c->shared_limit / choice.partition.shared), 1));
    const int64_t rounds = up(smaller(parts, larger(statistics->islands, 1)), c->multiprocessors * side_by_side);
    const int64_t sides = side_by_side * larger(statistics->island_sides, up(statistics->sides, parts));
    choice.time = (double)rounds * (c->timings.block + c->timings.side * (double)sides);
    return choice;
}

/* Islands in clusters of `size` thread blocks. */
static struct choice choose_cluster_of(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics,
                                       int32_t size, cudaError_t *code)
{
    static const char too_large[] = "an island does not fit a cluster of thread blocks";
    const char *name = nullptr;
    const int64_t most = CUDA(persistent_threads)(statistics->point_slots, c->view.rows.count > 0),
                  most_sides = most_sides_of(c, most);
    const int64_t cost = (int64_t)statistics->sides + c->view.model.bodies;
    /* As many clusters as find a multiprocessor for each of their blocks; when that is too few for the memory a block
     * has, clusters that run one after another. */
    int64_t clusters = statistics->islands <= 1 ? 1 : larger(c->multiprocessors / size, 1);
    struct bound bound;
    for (;; clusters += clusters / 4 + 1) {
        const struct bound whole = island_bound(c, statistics, clusters);
        const int64_t share = up(smaller(cost, whole.sides + whole.bodies), size);
        bound.sides = smaller(whole.sides, larger(share - 1, 0) + statistics->degree);
        bound.bodies = smaller(whole.bodies, share);
        if (bound.sides <= most_sides) break;
        if (clusters >= cost) return no_choice(too_large);
    }
    if (clusters * size > most_parts(c)) return no_choice(too_many);
    struct choice choice = {};
    choice.partition.tier = SADMM_CUDA_TIER_CLUSTER;
    choice.partition.parts = (int32_t)clusters * size;
    choice.partition.cluster = size;
    choice.partition.threads = (int32_t)threads_for(c, bound, most);
    if (choice.partition.threads > most || !take_capacity(c, &choice.partition, bound, c->shared_limit))
        return no_choice(too_large);
    int active = 0;
    cuda_kernel kernel = CUDA(persistent_kernel)(statistics->point_slots, SADMM_CUDA_TIER_CLUSTER, (int)most,
                                                 c->view.rows.count > 0, c->fast, &name);
    *code = CUDA(active_clusters)(c, kernel, &choice.partition, &active);
    if (*code != cudaSuccess || active < 1) return no_choice("the device has no clusters that large");
    const int64_t rounds = up(smaller(clusters, larger(statistics->islands, 1)), active);
    const int64_t sides = up(larger(statistics->island_sides, up(statistics->sides, clusters)), size);
    const cuda_timings &times = c->timings;
    choice.time = (double)rounds * (times.cluster + times.member * size + times.side * (double)sides);
    return choice;
}

/* Islands in clusters of the size that is likely the fastest. */
static struct choice choose_cluster(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics,
                                    cudaError_t *code)
{
    if (c->refused >> SADMM_CUDA_TIER_CLUSTER & 1) return no_choice(refused);
    if (!c->clusters) return no_choice("the device has no clusters of thread blocks");
    struct choice best = no_choice("there are no clusters of that size");
    for (int32_t size = 2; size <= MOST_CLUSTER; size *= 2) {
        if (c->wanted_cluster > 0 && c->wanted_cluster != size) continue;
        const struct choice one = choose_cluster_of(c, statistics, size, code);
        if (*code != cudaSuccess) return one;
        if (best.why || one.time < best.time) best = one;
    }
    return best;
}

/* Bodies over the whole device. */
static struct choice choose_grid(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics,
                                 cudaError_t *code)
{
    static const char too_large[] = "more constraints than the device can hold at once";
    const char *name = nullptr;
    if (c->refused >> SADMM_CUDA_TIER_GRID & 1) return no_choice(refused);
    const int64_t most = CUDA(persistent_threads)(statistics->point_slots, c->view.rows.count > 0),
                  cost = (int64_t)statistics->sides + c->view.model.bodies;
    if (!c->cooperative) return no_choice("the device has no cooperative launch");
    int64_t parts = larger(smaller(c->multiprocessors, up(cost, SPREAD)), 1);
    struct choice choice = {};
    choice.partition.tier = SADMM_CUDA_TIER_GRID;
    choice.partition.cluster = 1;
    for (int64_t side_by_side = 1; side_by_side <= MOST_BLOCKS; side_by_side *= 2) {
        if (side_by_side > 1) parts = c->multiprocessors * side_by_side;
        struct bound bound = body_bound(c, statistics, parts);
        int64_t threads = threads_for(c, bound, most);
        if (threads > most) continue;
        choice.partition.parts = (int32_t)parts;
        choice.partition.threads = (int32_t)threads;
        if (!take_capacity(c, &choice.partition, bound, c->shared_limit / side_by_side)) continue;
        int resident = 0;
        cuda_kernel kernel = CUDA(persistent_kernel)(statistics->point_slots, SADMM_CUDA_TIER_GRID, (int)most,
                                                     c->view.rows.count > 0, c->fast, &name);
        *code = cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, (const void *)kernel,
                                                              choice.partition.threads, choice.partition.shared);
        if (*code != cudaSuccess || parts > (int64_t)resident * c->multiprocessors) return no_choice(too_large);
        choice.time = c->timings.grid + c->timings.side * (double)(side_by_side * up(statistics->sides, parts));
        return choice;
    }
    return no_choice(too_large);
}

static struct choice choose_stream(void)
{
    struct choice choice = {{SADMM_CUDA_TIER_STREAM, 0, 1, THREADS, INT32_MAX, INT32_MAX, 0, false}, nullptr, 0};
    return choice;
}

/* Would STREAM gain more by leaving out what nothing touches than its kernels take? */
static bool most_are_free(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics)
{
    const int64_t free = larger((int64_t)c->view.model.bodies - statistics->sides, 0);
    const double moved = FREE_SIDES * c->timings.side * (double)up(free, c->multiprocessors);
    return c->fast && moved > c->timings.kernel * (STREAM_KERNELS + (double)free / STREAM_LEAVES_OUT);
}

/* What is likely the fastest; a tier whose floor is above what another takes is left out. */
static struct choice choose_any(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics,
                                cudaError_t *code)
{
    struct choice best = choose_block(c, statistics);
    if (best.time > c->timings.cluster) {
        const struct choice cluster = choose_cluster(c, statistics, code);
        if (*code != cudaSuccess) return cluster;
        if (cluster.time < best.time) best = cluster;
    }
    if (best.time > c->timings.grid) {
        const struct choice grid = choose_grid(c, statistics, code);
        if (*code != cudaSuccess) return grid;
        if (grid.time < best.time) best = grid;
    }
    return best.why || most_are_free(c, statistics) ? choose_stream() : best;
}

sadmm_status CUDA(choose_partition)(struct sadmm_context *c, const struct cuda_graph_statistics *statistics,
                                    struct cuda_partition *partition, struct sadmm_error *error)
{
    cudaError_t code = cudaSuccess;
    struct choice choice;
    /* Motions of kinematic bodies are in memory, a row a pair: the other tiers have no place for them on the chip. */
    switch (c->view.raw.system.kinematic_count > 0 ? SADMM_CUDA_TIER_STREAM : c->wanted) {
    case SADMM_CUDA_TIER_BLOCK: choice = choose_block(c, statistics); break;
    case SADMM_CUDA_TIER_CLUSTER: choice = choose_cluster(c, statistics, &code); break;
    case SADMM_CUDA_TIER_GRID: choice = choose_grid(c, statistics, &code); break;
    case SADMM_CUDA_TIER_STREAM: choice = choose_stream(); break;
    default: choice = choose_any(c, statistics, &code); break;
    }
    if (code != cudaSuccess) return CUDA(fail)(c, code, "searching for blocks that run side by side", error);
    if (choice.why) return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "the cuda tier asked for: %s", choice.why);
    *partition = choice.partition;
    partition->islands = c->fast || c->plan.momentum || c->view.joints.count > 0 || c->view.kinematic.count > 0;
    return SADMM_OK;
}

void CUDA(tighten_partition)(const struct sadmm_context *c, const struct cuda_graph_statistics *statistics,
                             struct cuda_partition *partition)
{
    if (partition->tier == SADMM_CUDA_TIER_STREAM) return;
    const struct bound bound = {statistics->part_sides, statistics->part_bodies};
    struct cuda_partition tight = *partition;
    tight.threads =
        (int32_t)threads_for(c, bound, CUDA(persistent_threads)(statistics->point_slots, c->view.rows.count > 0));
    if (tight.threads < partition->threads && take_capacity(c, &tight, bound, (int64_t)partition->shared))
        *partition = tight;
}
