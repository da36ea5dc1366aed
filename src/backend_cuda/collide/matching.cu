/* Manifolds to contacts: world terms, and the last step's impulses by feature. Eight threads take a candidate, one a
 * point; the first one writes the pair as well. Few candidates are done with at once: a kernel more takes longer than
 * what waits for the points that roll. Of many all are made as if they were found halfway and stayed as they are; those
 * that roll, or were found elsewhere, are then made by a kernel of their own, and so is what slides over meshes. */
#include "view.h"

/* Time steps of this set and of the one before; fetched first, so that nothing waits for them later. */
struct step_lengths {
    double now, before;
};
static __device__ step_lengths lengths_of(const collision_view &v)
{
    const step_lengths lengths = {step_of(v).dt, v.before.counts->dt};
    return lengths;
}

/* total: of all candidates. */
static __device__ void emit_counts(const collision_view &v, uint64_t total, double dt)
{
    v.after.counts->candidates = (int64_t)*v.candidate_count;
    v.after.counts->pairs = (int32_t)(total >> 32);
    v.after.counts->points = (int32_t)(uint32_t)total;
    v.after.counts->dt = dt;
    v.after.counts->fast = v.candidate_count[COUNT_FAST] != 0;
}

/* What is known of a candidate before it is known how many there are. Beyond them, and without points, it may be
 * anything. */
struct emit_start {
    struct candidate own;
    int32_t count, match;
};
static __device__ __forceinline__ emit_start emit_start_of(const collision_view &v, int64_t i)
{
    const int64_t readable = i < v.candidate_capacity ? i : 0;
    const emit_start start = {candidate_of(v, v.candidates[readable]), v.sizes[readable], v.matches[readable]};
    return start;
}

/* What a point is made of. Copied: all of it is asked for before anything waits for any of it, or is written, which
 * takes registers; in place: for many threads. */
struct emit_copy {
    struct sadmm_proxy a, b;
    struct manifold_point point;
    struct sadmm_contact_pair old; /* for what matches */
    struct manifold head;          /* but for the points */
};
struct emit_in_place {
    const struct sadmm_proxy &a, &b;
    struct manifold_point point;
    const struct sadmm_contact_pair &old;
    struct manifold head;
};
static __device__ __forceinline__ emit_in_place emit_source_of(const collision_view &v, const emit_start &start,
                                                               int64_t i, int32_t lane)
{
    const struct found_manifold &m = v.manifolds[i];
    const found_point point = load_wide(&m.points[lane]);
    const found_head found = load_wide(&m.head);
    struct manifold head;
    head.normal = found.normal;
    head.time_offset = found.time_offset;
    head.cache = found.cache;
    head.count = found.count;
    const uint32_t feature = m.features[lane / FOUND_FEATURES].of[lane % FOUND_FEATURES];
    const struct sadmm_proxy *a = wide_at(v.proxies, start.own.a), *b = wide_at(v.proxies, start.own.b);
    const struct sadmm_contact_pair *old = wide_at(v.before.pairs, start.match >= 0 ? (size_t)start.match : 0);
    return {*a, *b, {point.position, point.separation, feature}, *old, head};
}

/* The point goes on to the step's end, and its normal (core/model/rolling.h). */
static __device__ __forceinline__ void migrate(const collision_view &v, const struct sadmm_proxy *a,
                                               const struct sadmm_proxy *b, const struct sadmm_contact_pair *before,
                                               const step_lengths &dt, uint64_t shapes, int32_t count, int32_t lane,
                                               int32_t at, double normal[3], struct sadmm_contact_point *point)
{
    const struct migration_set last = {v.before.points, v.before.migrations};
    const double radius = contact_radius(a, b, count, normal, point);
    struct sadmm_contact_migration migration;
    struct migration_pair pair;
    const struct sadmm_contact_pair *from = before;
    if (b->geometry.type == SADMM_SHAPE_MESH) {
        const int64_t pairs = v.before.counts->pairs, first = contact_lower_bound(v.before.pairs, 0, pairs, shapes, 0);
        int64_t end = first;
        while (end < pairs && contact_shapes(&v.before.pairs[end]) == shapes) ++end;
        from = contact_rolls_from(a, b, before, v.before.pairs, first, end, v.before.points, count, normal);
    }
    migration_begin(a, b, from, last, dt.now, step_ratio(dt.now, dt.before), count, normal, &pair);
    pair.across = from != before;
    if (migrate_point(a, b, &pair, last, lane, radius, dt.now, normal, point, &migration))
        v.after.migrations[at] = migration;
    for (int k = 0; k < 3; ++k) normal[k] = pair.normal[k];
}

/* Is a candidate one for emit_general? By what is at hand: of those that are, some do not roll. */
template <class Source>
static __device__ __forceinline__ bool is_general(const emit_start &start, const Source &source, double dt)
{
    const struct sadmm_proxy *a = &source.a, *b = &source.b;
    if (!is_midpoint(source.head.time_offset, dt)) return true;
    if (start.count > ROLLING_POINTS) return false;
    return contact_is_curved(a, b, start.count) ||
           (start.match >= 0 && contact_kind_rolls(a, b, &source.old, start.count));
}

/* A pair, but for its normal and its points. */
template <class Source>
static __device__ __forceinline__ void emit_pair(const collision_view &v, const emit_start &start,
                                                 const Source &source, const double normal[3], double friction,
                                                 int32_t at, int32_t first)
{
    const struct candidate own = start.own;
    struct sadmm_contact_pair pair;
    contact_emit_pair(own.a, own.b, own.subshape, &source.a, &source.b, &source.head, normal, friction, first, &pair);
    store_wide(pair, &v.after.pairs[at]);
    v.after.keys[at] = ordered_key(own.a, own.b);
}

template <class Source>
static __device__ __forceinline__ double friction_of(const collision_view &v, const candidate &own,
                                                     const Source &source)
{
    return contact_friction(v.friction_pairs, v.friction_values, v.friction_count, own.a, own.b, &source.a, &source.b);
}

/* A point that was found halfway, and its normal. */
template <class Source>
static __device__ __forceinline__ void place_point(const Source &source, double dt, double normal[3],
                                                   struct sadmm_contact_point *point)
{
    struct pair_motion motion;
    rotate_to_world(source.b.R, source.head.normal, normal);
    pair_motion_halfway(&source.a, &source.b, normal, source.head.time_offset, dt, &motion);
    contact_emit_point(&source.a, &source.b, &motion, &source.point, point);
}

/* Point `lane` of candidate i as it is found halfway, and its pair into the new set by the first lane; at, first: the
 * pair, and its first point. Points go out by the warp or by the lane, which the kernel knows. LISTS: candidates for
 * emit_general are. */
struct emitted {
    struct sadmm_contact_point point;
    double normal[3], friction; /* of the pair */
};
template <bool LISTS, class Source>
static __device__ __forceinline__ emitted emit_halfway(const collision_view &v, const step_lengths &dt, int64_t i,
                                                       int32_t lane, const emit_start &start, const Source &source,
                                                       int32_t at, int32_t first)
{
    emitted out;
    out.friction = friction_of(v, start.own, source);
    place_point(source, dt.now, out.normal, &out.point);
    if (start.match >= 0)
        contact_carry(&source.old, wide_at(v.before.points, 0), lane, out.normal, out.friction,
                      step_ratio(dt.now, dt.before), &out.point);
    if (lane > 0) return out;
    if (LISTS && is_general(start, source, dt.now))
        v.general[atomicAdd(v.candidate_count + COUNT_GENERAL, 1ull)] = (int32_t)i;
    emit_pair(v, start, source, out.normal, out.friction, at, first);
    return out;
}

/* ---- points that slide over a mesh ------------------------------------------------------------------------------ */

/* Goes the point on from the old pair of its own triangle? */
static __device__ __forceinline__ bool goes_on(const collision_view &v, int32_t match, int32_t lane, uint32_t feature)
{
    if (match < 0) return false;
    const struct sadmm_contact_pair &old = v.before.pairs[match];
    return contact_find_feature(v.before.points + old.first, old.count, feature, lane) >= 0;
}

/* A point in the new set goes on from other triangles' old pairs, where it is of a mesh and its own has none. By
 * itself: others should not pay in registers. */
static __device__ __noinline__ void carry_across(const collision_view &v, int64_t i, int32_t lane, vec3 normal,
                                                 double friction, struct sadmm_contact_point *point)
{
    const struct candidate own = candidate_of(v, v.candidates[i]);
    const struct sadmm_proxy &a = v.proxies[own.a], &b = v.proxies[own.b];
    if (b.geometry.type != SADMM_SHAPE_MESH || goes_on(v, v.matches[i], lane, point->feature)) return;
    const double along[3] = {normal.x, normal.y, normal.z};
    const uint64_t shapes = ordered_key(own.a, own.b);
    const int64_t count = v.before.counts->pairs, first = contact_lower_bound(v.before.pairs, 0, count, shapes, 0);
    int64_t last = first;
    while (last < count && contact_shapes(&v.before.pairs[last]) == shapes) ++last;
    contact_carry_across(v.before.pairs, first, last, v.before.points, word_of_pair(a.revision, b.revision), lane,
                         along, friction, step_ratio(step_of(v).dt, v.before.counts->dt), point);
}

/* ---- pairs that roll, or were found elsewhere than halfway ------------------------------------------------------- */

/* Point `lane` of candidate i. By itself: others should not pay in registers. */
static __device__ __noinline__ void emit_general(const collision_view &v, int64_t i, int32_t lane, int32_t at,
                                                 int32_t first)
{
    const step_lengths dt = lengths_of(v);
    const emit_start start = emit_start_of(v, i);
    const emit_in_place source = emit_source_of(v, start, i, lane);
    const struct sadmm_proxy *pa = &source.a, *pb = &source.b;
    const struct sadmm_contact_pair *before = start.match >= 0 ? &source.old : nullptr;
    const double friction = friction_of(v, start.own, source), ratio = step_ratio(dt.now, dt.before);
    double normal[3];
    struct sadmm_contact_point point;
    if (is_midpoint(source.head.time_offset, dt.now)) {
        place_point(source, dt.now, normal, &point);
        if (contact_may_migrate(pa, pb, before, v.before.points, start.count))
            migrate(v, pa, pb, before, dt, ordered_key(start.own.a, start.own.b), start.count, lane, first + lane,
                    normal, &point);
    } else {
        contact_emit_turned(pa, pb, source.head.normal, source.head.time_offset, dt.now, &source.point, normal, &point);
    }
    if (before) contact_carry(before, wide_at(v.before.points, 0), lane, normal, friction, ratio, &point);
    if (lane == 0) emit_pair(v, start, source, normal, friction, at, first);
    store_wide(point, &v.after.points[first + lane]);
    if (v.carries) carry_across(v, i, lane, v3_load(normal), friction, &v.after.points[first + lane]);
}

static __device__ __forceinline__ struct sadmm_contact_point *point_place(const collision_view &v, int32_t lane,
                                                                          uint64_t place)
{
    return &v.after.points[(int32_t)(uint32_t)place + lane];
}

/* So many blocks have registers on a multiprocessor at once. */
enum { EMIT_BLOCKS = 4 };

/* Points of a warp lie side by side. */
struct emit_pieces {
    warp_pieces<sizeof(struct sadmm_contact_point) / sizeof(wide_piece)> of[COLLISION_THREADS / 32];
};

static __global__ void __launch_bounds__(COLLISION_THREADS, EMIT_BLOCKS)
emit_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    COLLISION_SHARED(emit_pieces, shared);
    const int64_t thread = collision_thread(COLLISION_THREADS), i = thread / POINT_LANES;
    const int32_t lane = (int32_t)(thread % POINT_LANES), found = usable_candidates(v);
    const step_lengths dt = lengths_of(v);
    const uint64_t total = v.places[v.candidate_capacity];
    if (aborted(v)) return;
    if (thread == 0) emit_counts(v, total, dt.now);
    /* Whole warps leave, since points go out by the warp; many do, so that nothing is asked for before. */
    const int64_t first = i - i % (32 / POINT_LANES);
    if (first >= found || (int32_t)(uint32_t)total > v.point_capacity) return;
    const bool there = i < found;
    const uint64_t place = there ? v.places[i] : 0;
    const emit_start start = emit_start_of(v, i);
    if (there && lane == 0) v.pair_of[i] = (int32_t)(place >> 32);
    struct sadmm_contact_point point, *to = nullptr;
    if (there && lane < start.count) {
        const int32_t at = (int32_t)(place >> 32), before = (int32_t)(uint32_t)place;
        point = emit_halfway<true>(v, dt, i, lane, start, emit_source_of(v, start, i, lane), at, before).point;
        to = point_place(v, lane, place);
    }
    store_of_warp(point, to, &shared.of[threadIdx.x / 32]);
}

/* ---- few candidates: every block adds up all sizes ------------------------------------------------------------- */

enum { SIZES_A_WORD = 4, EMIT_WARPS = EMIT_CANDIDATES * POINT_LANES / 32 };

/* Of four sizes of at most 8: pairs << 32 | points. */
static __device__ __forceinline__ uint64_t sum_sizes(uint32_t sizes)
{
    const uint32_t any = (sizes | sizes >> 1 | sizes >> 2 | sizes >> 3) & 0x01010101u;
    return (uint64_t)(any * 0x01010101u >> 24) << 32 | sizes * 0x01010101u >> 24;
}

/* Point `lane` of candidate i, whatever it takes. */
static __device__ __forceinline__ void emit_now(const collision_view &v, const step_lengths &dt, int64_t i,
                                                int32_t lane, const emit_start &start, const emit_copy &source,
                                                uint64_t place)
{
    const int32_t at = (int32_t)(place >> 32), first = (int32_t)(uint32_t)place;
    if (is_general(start, source, dt.now)) return emit_general(v, i, lane, at, first);
    const emitted out = emit_halfway<false>(v, dt, i, lane, start, source, at, first);
    struct sadmm_contact_point *to = point_place(v, lane, place);
    store_wide(out.point, to);
    if (v.carries) carry_across(v, i, lane, v3_load(out.normal), out.friction, to);
}

struct emit_sums {
    uint64_t before[EMIT_WARPS], all[EMIT_WARPS];
};

static __global__ void __launch_bounds__(EMIT_CANDIDATES *POINT_LANES)
emit_few_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    COLLISION_SHARED(emit_sums, shared);
    const int32_t t = (int32_t)threadIdx.x, first = (int32_t)blockIdx.x * EMIT_CANDIDATES;
    const int32_t i = first + t / POINT_LANES, lane = t % POINT_LANES, found = usable_candidates(v);
    const uint32_t *const sizes = (const uint32_t *)v.sizes;
    uint64_t before = 0, all = 0;
    const step_lengths dt = lengths_of(v);
    const emit_start start = emit_start_of(v, i);
    emit_copy source;
    if (aborted(v) || (first >= found && first > 0)) return;
    const bool has_point = i < found && lane < start.count;
    if (has_point) {
        const emit_in_place from = emit_source_of(v, start, i, lane);
        source = {from.a, from.b, from.point, from.old, from.head};
    }
    for (int32_t k = t; k < (found + SIZES_A_WORD - 1) / SIZES_A_WORD; k += EMIT_CANDIDATES * POINT_LANES) {
        const uint64_t sum = sum_sizes(sizes[k]);
        all += sum;
        if (k < first / SIZES_A_WORD) before += sum;
    }
    for (int bits = 1; bits < 32; bits *= 2) {
        before += __shfl_xor_sync(0xffffffffu, before, bits);
        all += __shfl_xor_sync(0xffffffffu, all, bits);
    }
    if (t % 32 == 0) {
        shared.before[t / 32] = before;
        shared.all[t / 32] = all;
    }
    __syncthreads();
    before = all = 0;
    for (int k = 0; k < EMIT_WARPS; ++k) {
        before += shared.before[k];
        all += shared.all[k];
    }
    if (t == 0 && first == 0) emit_counts(v, all, dt.now);
    if (i >= found || (int32_t)(uint32_t)all > v.point_capacity) return;
    for (int32_t k = first; k < i; k += SIZES_A_WORD) {
        const uint32_t word = sizes[k / SIZES_A_WORD];
        before += sum_sizes(i - k < SIZES_A_WORD ? word & ((UINT32_C(1) << 8 * (i - k)) - 1) : word);
    }
    if (lane == 0) v.pair_of[i] = (int32_t)(before >> 32);
    if (has_point) emit_now(v, dt, i, lane, start, source, before);
}

/* ---- the rest of many candidates: kernels of their own ----------------------------------------------------------- */

static __global__ void __launch_bounds__(GENERAL_THREADS)
emit_general_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    const int64_t thread = collision_thread(GENERAL_THREADS), stride = (int64_t)gridDim.x * GENERAL_THREADS;
    const int64_t count = (int64_t)v.candidate_count[COUNT_GENERAL];
    if (usable_candidates(v) == 0 || v.after.counts->points > v.point_capacity) return;
    for (int64_t j = thread; j < count * GENERAL_LANES; j += stride) {
        const int64_t i = v.general[j / GENERAL_LANES];
        const int32_t at = v.pair_of[i], first = v.after.pairs[at].first, points = v.sizes[i];
        for (int32_t k = (int32_t)(j % GENERAL_LANES); k < points; k += GENERAL_LANES) emit_general(v, i, k, at, first);
    }
}

/* Where there are meshes. */
static __global__ void __launch_bounds__(COLLISION_THREADS) carry_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    const int64_t thread = collision_thread(COLLISION_THREADS), i = thread / POINT_LANES;
    const int32_t lane = (int32_t)(thread % POINT_LANES);
    if (i >= usable_candidates(v) || lane >= v.sizes[i] || v.after.counts->points > v.point_capacity) return;
    const struct sadmm_contact_pair &pair = v.after.pairs[v.pair_of[i]];
    carry_across(v, i, lane, v3_load(pair.normal), pair.friction, &v.after.points[pair.first + lane]);
}

void COLLISION(matching_kernels)(struct collision_kernels *kernels)
{
    kernels->emit = {emit_kernel, COLLISION_THREADS, sizeof(struct emit_pieces), "contacts"};
    kernels->emit_general = {emit_general_kernel, GENERAL_THREADS, 0, "contacts that roll"};
    kernels->carry = {carry_kernel, COLLISION_THREADS, 0, "impulses from triangle to triangle"};
    kernels->emit_few = {emit_few_kernel, EMIT_CANDIDATES * POINT_LANES, sizeof(struct emit_sums), "contacts"};
}
