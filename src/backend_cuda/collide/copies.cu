/* Contacts of many equal worlds: some worlds begin with those of a state that is kept. Pairs are in the order of their
 * shapes, so that a world's lie side by side; the set is put together anew in memory of its own, and comes back. */
#include "backend_cuda/device/kept_state.h"
#include "memory.h"
#include "pipeline.h"

enum { COPIES_THREADS = 64, SUM_THREADS = 256 };

/* Pairs of a world as they are, and as they will be. */
struct world_range {
    int32_t pair, pairs, point, points; /* of the set that is replaced */
    int32_t to_pair, to_point;
};

struct copies_args {
    struct sadmm_resident_copies copies;
    struct collision_set set, made;
    const struct cuda_kept_state *const *states; /* (worlds) NULL: it stays as it is */
    struct world_range *ranges;                  /* (worlds + 1), then a share of a thread each */
    int32_t pairs;                               /* of the set */
};

static __device__ __forceinline__ int32_t first_pair_of(const copies_args &a, int64_t shape)
{
    int32_t low = 0, high = a.pairs;
    while (low < high) {
        const int32_t middle = low + (high - low) / 2;
        if (a.set.pairs[middle].shape_a < shape) low = middle + 1;
        else high = middle;
    }
    return low;
}

static __global__ void __launch_bounds__(COPIES_THREADS) range_kernel(const copies_args a, const int)
{
    const int64_t e = (int64_t)blockIdx.x * COPIES_THREADS + threadIdx.x;
    if (e >= a.copies.count) return;
    const int32_t begin = first_pair_of(a, e * a.copies.shapes), end = first_pair_of(a, (e + 1) * a.copies.shapes);
    struct world_range range = {begin, end - begin, 0, 0, 0, 0};
    if (begin < end) {
        const struct sadmm_contact_pair &last = a.set.pairs[end - 1];
        range.point = a.set.pairs[begin].first;
        range.points = last.first + last.count - range.point;
    }
    a.ranges[e] = range;
}

static __device__ __forceinline__ void add_range(const copies_args &a, int32_t e, int32_t *pair, int32_t *point)
{
    const struct cuda_kept_state *state = a.states[e];
    *pair += state ? state->pair_count : a.ranges[e].pairs;
    *point += state ? state->point_count : a.ranges[e].points;
}

/* One block: where the worlds' pairs go. The last range has the sums of all. */
static __global__ void __launch_bounds__(SUM_THREADS) sum_kernel(const copies_args a, const int)
{
    const int32_t n = a.copies.count, each = (n + SUM_THREADS - 1) / SUM_THREADS, t = (int32_t)threadIdx.x,
                  first = t * each < n ? t * each : n, end = first + each < n ? first + each : n;
    int32_t pair = 0, point = 0;
    for (int32_t e = first; e < end; ++e) {
        a.ranges[e].to_pair = pair, a.ranges[e].to_point = point; /* in the thread's share */
        add_range(a, e, &pair, &point);
    }
    struct world_range *const shares = a.ranges + n + 1;
    shares[t] = {0, pair, 0, point, 0, 0};
    __syncthreads();
    if (t == 0) {
        struct world_range sum = {};
        for (int32_t k = 0; k < SUM_THREADS; ++k) {
            const struct world_range share = shares[k];
            shares[k].to_pair = sum.pairs, shares[k].to_point = sum.points;
            sum.pairs += share.pairs, sum.points += share.points;
        }
        a.ranges[n] = sum;
    }
    __syncthreads();
    const struct world_range before = shares[t];
    for (int32_t e = first; e < end; ++e) {
        a.ranges[e].to_pair += before.to_pair;
        a.ranges[e].to_point += before.to_point;
    }
}

/* As a world has what the first one would have. */
static __device__ __forceinline__ int32_t body_in(const sadmm_resident_copies &copies, int32_t world, int32_t body)
{
    if (body >= 0) return world * copies.bodies + body;
    return body == -1 ? -1 : body - world * copies.kinematic;
}

/* A block a world. */
static __global__ void __launch_bounds__(COPIES_THREADS) make_kernel(const copies_args a, const int)
{
    const int32_t e = (int32_t)blockIdx.x, t = (int32_t)threadIdx.x;
    const struct world_range range = a.ranges[e];
    const struct cuda_kept_state *state = a.states[e];
    const struct sadmm_contact_pair *pairs = state ? state->pairs : a.set.pairs + range.pair;
    const struct sadmm_contact_point *points = state ? state->points : a.set.points + range.point;
    const struct sadmm_contact_migration *migrations = state ? state->migrations : a.set.migrations + range.point;
    const int32_t pair_count = state ? state->pair_count : range.pairs,
                  point_count = state ? state->point_count : range.points, from = state ? 0 : range.point;
    const double dt = a.set.counts->dt;
    /* Impulses of a step of another length are taken over in proportion, as steps do. */
    const double ratio = state && state->dt > 0 && dt > 0 ? dt / state->dt : 1;
    for (int32_t p = t; p < pair_count; p += COPIES_THREADS) {
        struct sadmm_contact_pair pair = pairs[p];
        pair.first += range.to_point - from;
        if (state) {
            pair.shape_a += e * a.copies.shapes, pair.shape_b += e * a.copies.shapes;
            pair.body_a = body_in(a.copies, e, pair.body_a), pair.body_b = body_in(a.copies, e, pair.body_b);
        }
        a.made.pairs[range.to_pair + p] = pair;
        a.made.keys[range.to_pair + p] = contact_shapes(&pair);
    }
    for (int32_t k = t; k < point_count; k += COPIES_THREADS) {
        struct sadmm_contact_point point = points[k];
        for (int i = 0; i < 3 && ratio != 1; ++i) point.impulse[i] *= ratio;
        a.made.points[range.to_point + k] = point;
        if (point.migrates) a.made.migrations[range.to_point + k] = migrations[k];
    }
}

/* All of it comes back. */
static __global__ void __launch_bounds__(COPIES_THREADS) back_kernel(const copies_args a, const int)
{
    const int32_t i = (int32_t)(blockIdx.x * COPIES_THREADS + threadIdx.x), n = a.copies.count,
                  pairs = a.ranges[n].pairs, points = a.ranges[n].points;
    if (i == 0) {
        struct sadmm_cuda_contact_counts *counts = a.set.counts;
        counts->pairs = pairs, counts->points = points;
        for (int32_t e = 0; e < n && counts->dt == 0; ++e)
            if (a.states[e]) counts->dt = a.states[e]->dt;
    }
    if (i < pairs) a.set.pairs[i] = a.made.pairs[i], a.set.keys[i] = a.made.keys[i];
    if (i >= points) return;
    a.set.points[i] = a.made.points[i];
    if (a.made.points[i].migrates) a.set.migrations[i] = a.made.migrations[i];
}

static sadmm_status run(struct sadmm_cuda_collision *c, void (*kernel)(const copies_args, const int), int64_t blocks,
                        int threads, const copies_args &args, struct sadmm_error *error)
{
    if (blocks == 0) return SADMM_OK;
#ifdef SADMM_CUDA_EMULATED
    CUDA_CALL(c, cuda_emulation_launch(kernel, (unsigned)blocks, (unsigned)threads, (size_t)0, args, 0), c->kernel);
#else
    int unused = 0;
    void *parameters[] = {const_cast<copies_args *>(&args), &unused};
    CUDA_CALL(c, cudaLaunchKernel((const void *)kernel, dim3((unsigned)blocks), dim3((unsigned)threads), parameters, 0,
                                  c->stream), c->kernel);
#endif
    return SADMM_OK;
}

static int64_t blocks_of(int64_t threads) { return (threads + COPIES_THREADS - 1) / COPIES_THREADS; }

/* What a set has room for. */
static bool has_room(const struct sadmm_cuda_collision *c, int which, int64_t pairs, int64_t points)
{
    const int shift = which * SET_BUFFERS;
    return c->buffers[PAIRS + shift].capacity >= (size_t)pairs * sizeof(struct sadmm_contact_pair) &&
           c->buffers[PAIR_KEYS + shift].capacity >= (size_t)pairs * sizeof(uint64_t) &&
           c->buffers[POINTS + shift].capacity >= (size_t)points * sizeof(struct sadmm_contact_point) &&
           c->buffers[MIGRATIONS + shift].capacity >= (size_t)points * sizeof(struct sadmm_contact_migration);
}

extern "C" sadmm_status COLLISION(put_contacts)(struct sadmm_cuda_collision *c, void *stream,
                                                const struct sadmm_resident_copies *copies,
                                                const struct cuda_kept_state *const *states,
                                                struct sadmm_cuda_contact_counts *counts, bool *fits,
                                                struct sadmm_error *error)
{
    const int which = c->current;
    const int64_t pairs = (int64_t)c->counts[which].pairs + counts->pairs,
                  points = (int64_t)c->counts[which].points + counts->points, n = copies->count;
    *fits = points <= INT32_MAX && has_room(c, which, pairs, points);
    if (!*fits) return SADMM_OK;
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(reserve(c, COPIES_PAIRS, (size_t)pairs, sizeof(struct sadmm_contact_pair), error));
    TRY(reserve(c, COPIES_KEYS, (size_t)pairs, sizeof(uint64_t), error));
    TRY(reserve(c, COPIES_POINTS, (size_t)points, sizeof(struct sadmm_contact_point), error));
    TRY(reserve(c, COPIES_MIGRATIONS, (size_t)points, sizeof(struct sadmm_contact_migration), error));
    TRY(reserve(c, COPIES_RANGES, (size_t)n + 1 + SUM_THREADS, sizeof(struct world_range), error));
    TRY(reserve(c, PINNED_COPIES, 1, sizeof(struct world_range), error));
    const copies_args args = {*copies,
                              set_of(c, which),
                              {in<struct sadmm_contact_pair>(c, COPIES_PAIRS),
                               in<struct sadmm_contact_point>(c, COPIES_POINTS),
                               in<struct sadmm_contact_migration>(c, COPIES_MIGRATIONS), in<uint64_t>(c, COPIES_KEYS),
                               nullptr},
                              states,
                              in<struct world_range>(c, COPIES_RANGES),
                              c->counts[which].pairs};
    c->kernel = "contacts of environments";
    TRY(run(c, range_kernel, blocks_of(n), COPIES_THREADS, args, error));
    TRY(run(c, sum_kernel, 1, SUM_THREADS, args, error));
    TRY(run(c, make_kernel, n, COPIES_THREADS, args, error));
    TRY(run(c, back_kernel, blocks_of(points > 0 ? points : 1), COPIES_THREADS, args, error));
    struct world_range *sum = in<struct world_range>(c, PINNED_COPIES);
    TRY(copy(c, sum, args.ranges + n, sizeof *sum, false, error));
    TRY(wait(c, error));
    c->counts[which].pairs = sum->pairs;
    c->counts[which].points = sum->points;
    counts->pairs = sum->pairs;
    counts->points = sum->points;
    counts->dt = c->counts[which].dt;
    return SADMM_OK;
}
