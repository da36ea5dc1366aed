/* Candidates to manifolds: the last step's pair, for its cache, then the pair's manifold in the frame of b. */
#include "view.h"

/* C headers: an enumerator beside an unsigned number is fine there. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wextra"
#include "collision/pair_manifold.h"
#pragma GCC diagnostic pop

/* find_key with seven loads at a time: rounds to memory are what a search takes. */
static __device__ int64_t find_key_in_eighths(const uint64_t *keys, int64_t count, uint64_t key)
{
    int64_t low = 0, length = count; /* the first key >= `key` is in [low, low + length] */
    while (length > 7) {
        const int64_t step = length / 8;
        int smaller = 0;
        for (int k = 1; k < 8; ++k) smaller += keys[low + k * step - 1] < key;
        low += smaller * step;
        length = smaller < 7 ? step - 1 : length - 7 * step;
    }
    int smaller = 0;
    bool there = false;
    for (int k = 0; k < 7; ++k) smaller += k < length && keys[low + k] < key;
    low += smaller;
    if (low < count) there = keys[low] == key;
    return there ? low : -1;
}

/* Do the two shapes of a candidate of the whole step meet in this sub-step? As sadmm_candidate_meets on the host. */
static __device__ bool meet_now(const collision_view &v, const struct collision_step &step, const struct candidate &c)
{
    const struct sadmm_proxy *a = &v.proxies[c.a], *b = &v.proxies[c.b];
    const struct sadmm_box3 box = v.boxes[c.b];
    if (a->geometry.type == SADMM_SHAPE_PLANE)
        return proxy_plane_meets(a, &box, proxy_plane_reach(b, step.margin, fall_of(step.gravity, step.dt)));
    const struct sadmm_box3 own = v.boxes[c.a];
    return boxes_overlap(&own, &box) && boxes_meet(&own, a->velocity, &box, b->velocity, step.dt);
}

/* By which find of a step: in later sub-steps the pair that a candidate goes on from is known. */
enum narrow_for { NARROW_ONE, NARROW_FIRST, NARROW_AGAIN };

template <int FOR>
static __global__ void __launch_bounds__(NARROW_THREADS) narrow_kernel(const __grid_constant__ collision_view v)
{
    const int64_t i = collision_thread(NARROW_THREADS);
    if (i >= (int64_t)v.candidate_capacity + SIZES_BEYOND) return;
    if (i >= usable_candidates(v)) {
        v.sizes[i] = 0;
        return;
    }
    const struct collision_step step = step_of(v);
    const struct candidate own = candidate_of(v, v.candidates[i]);
    const struct sadmm_proxy *pa = &v.proxies[own.a], *pb = &v.proxies[own.b];
    int64_t before = FOR == NARROW_AGAIN && v.sizes[i] > 0 ? v.pair_of[i] : -1;
    if (FOR != NARROW_ONE && !meet_now(v, step, own)) {
        v.sizes[i] = 0;
        return;
    }
    if (FOR != NARROW_AGAIN) {
        const uint64_t shapes = ordered_key(own.a, own.b);
        const int32_t count = v.before.counts->pairs;
        before = find_key_in_eighths(v.before.keys, count, shapes);
        if (before >= 0 && own.child > 0) {
            before = contact_lower_bound(v.before.pairs, before, count, shapes, own.child);
            if (before == count || contact_shapes(&v.before.pairs[before]) != shapes) before = -1;
        }
    }
    const struct sadmm_contact_pair *old = &v.before.pairs[before >= 0 ? before : 0];
    const uint32_t cache = contact_memory(old, pa, pb); /* at once, not after what comes next */
    if (!contact_goes_on(old, own.child, pa, pb)) before = -1;
    struct manifold m;
    find_manifold(pa, pb, own.child, step.margin, step.gravity, step.dt, before >= 0 ? cache : 0, &m);

    v.sizes[i] = (uint8_t)m.count;
    if (m.count == 0) return;
    v.matches[i] = (int32_t)before;
    struct manifold *out = &v.manifolds[i];
    out->normal = m.normal;
    out->count = m.count;
    out->cache = m.cache;
    out->ahead = m.ahead;
    for (int k = 0; k < m.count; ++k) out->points[k] = m.points[k];
}

void COLLISION(narrow_phase_kernels)(struct collision_kernels *kernels)
{
    kernels->narrow = {narrow_kernel<NARROW_ONE>, NARROW_THREADS, 0, "narrow phase"};
    kernels->narrow_first = {narrow_kernel<NARROW_FIRST>, NARROW_THREADS, 0, "narrow phase"};
    kernels->narrow_again = {narrow_kernel<NARROW_AGAIN>, NARROW_THREADS, 0, "narrow phase"};
}
