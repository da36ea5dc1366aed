/* Candidates to manifolds, what the kernels of it share: the last step's pair, for its cache, and where manifolds go. */
#ifndef SADMM_CUDA_COLLIDE_NARROW_H
#define SADMM_CUDA_COLLIDE_NARROW_H

#include "view.h"
#include "backend_cuda/device/parallel.h"

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
    for (int k = 0; k < 8; ++k) {
        const uint64_t other = keys[low + k < count ? low + k : 0]; /* always: a branch for each would be waited for */
        smaller += (k < length) & (other < key);
        there = there | ((k <= length) & (low + k < count) & (other == key));
    }
    return there ? low + smaller : -1;
}

/* Keys around where one is likely to be: at rest, where the last find put its pair, or would have put it. */
enum { NEAR = 8 };
struct near_keys {
    uint64_t keys[NEAR];
    int64_t first;
};

/* guess: any number will do. */
static __device__ __forceinline__ near_keys near_keys_of(const uint64_t *keys, int64_t count, int64_t guess)
{
    struct near_keys near;
    near.first = (guess < 0 ? 0 : guess < count ? guess : count) - NEAR / 2;
    for (int k = 0; k < NEAR; ++k) {
        const int64_t at = near.first + k;
        const uint64_t there = keys[at >= 0 && at < count ? at : 0];
        near.keys[k] = at < 0 ? 0 : at < count ? there : ~UINT64_C(0); /* beyond: smaller, or larger, than all */
    }
    return near;
}

/* Do these keys tell where `key` is? Then *at is its index, -1: not there. */
static __device__ __forceinline__ bool find_key_near(const struct near_keys &near, uint64_t key, int64_t *at)
{
    int smaller = 0;
    bool there = false;
    for (int k = 0; k < NEAR; ++k) {
        smaller += near.keys[k] < key;
        there = there | (near.keys[k] == key);
    }
    *at = there ? near.first + smaller : -1;
    return there | ((smaller > 0) & (smaller < NEAR));
}

/* Do the two shapes of a candidate of the whole step meet in this sub-step? As sadmm_candidate_meets on the host. */
static __device__ bool meet_now(const collision_view &v, const struct collision_step &step, const struct candidate &c,
                                const struct sadmm_proxy &a, const struct sadmm_proxy &b)
{
    const struct sadmm_box3 own = v.boxes[c.a], box = v.boxes[c.b]; /* a plane has none */
    if (a.geometry.type == SADMM_SHAPE_PLANE)
        return proxy_plane_meets(&a, &box, proxy_plane_reach(&b, step.margin, fall_of(step.gravity, step.dt)));
    return boxes_overlap(&own, &box) && boxes_meet(&own, a.velocity, &box, b.velocity, step.dt);
}

/* By which find of a step: in later sub-steps the pair that a candidate goes on from is known. */
enum narrow_for { NARROW_ONE, NARROW_FIRST, NARROW_AGAIN };

/* The last step's pair of a candidate, -1: none. */
static __device__ int64_t search_pair(const collision_view &v, const struct candidate &c, int64_t count)
{
    const uint64_t shapes = ordered_key(c.a, c.b);
    int64_t before = find_key_in_eighths(v.before.keys, count, shapes);
    if (before >= 0 && c.child > 0) {
        before = contact_lower_bound(v.before.pairs, before, count, shapes, c.child);
        if (before == count || contact_shapes(&v.before.pairs[before]) != shapes) before = -1;
    }
    return before;
}

static __device__ void store_manifold(const collision_view &v, int64_t i, const struct manifold &m, int64_t before)
{
    v.sizes[i] = (uint8_t)m.count;
    if (m.count == 0) return;
    v.matches[i] = (int32_t)before;
    struct found_manifold *out = &v.manifolds[i];
    out->normal = m.normal;
    out->ahead = m.ahead;
    out->cache = m.cache;
    out->count = m.count;
    for (int k = 0; k < m.count; ++k) {
        const found_point point = {m.points[k].position, m.points[k].separation};
        store_wide(point, &out->points[k]);
        out->features[k] = m.points[k].feature;
    }
}

/* What a kernel does for a candidate. */
enum narrow_how {
    NARROW_PLAIN,   /* there are no hulls */
    NARROW_AT_ONCE, /* of hulls what is little work; the others are listed */
    NARROW_LISTED   /* those, and all pairs with smooth bodies */
};

/* The manifold of a pair with a hull, as find_manifold makes it, where it is little work; false: it is not. */
static __device__ bool hulls_at_once(const collision_view &v, const struct sadmm_proxy *a,
                                     const struct sadmm_proxy *b, const struct pair_start &start, uint32_t cache, struct manifold *m)
{
    if (start.moves_on) return false;
    m->ahead = start.ahead;
    m->count = 0;
    m->cache = 0;
    if (a->geometry.type != SADMM_SHAPE_PLANE)
        return hull_manifold_at_once(&a->geometry, &b->geometry, v.hulls, &start.pose, (real)start.limit, cache, m);
    hull_plane_manifold(&b->geometry, v.hulls, &start.pose, (real)start.limit, m);
    return true;
}

/* What takes the time are rounds to memory: what can be asked for together is, before anything waits for any of it.
 * False: nothing is written, the candidate is to be listed. */
template <int FOR, int HOW>
static __device__ __forceinline__ bool narrow_candidate(const collision_view &v, int64_t i)
{
    const int64_t readable = i < v.candidate_capacity ? i : 0;
    const struct candidate own = candidate_of(v, v.candidates[readable]);
    const int64_t guess = v.pair_of[readable], count = v.before.counts->pairs;
    const struct collision_step step = step_of(v);
    const bool had_points = FOR == NARROW_AGAIN && v.sizes[i] > 0;
    if (i >= usable_candidates(v)) {
        v.sizes[i] = 0;
        return true;
    }
    const int64_t likely = guess >= 0 && guess < count ? guess : 0;
    const struct sadmm_proxy *pa = &v.proxies[own.a], *pb = &v.proxies[own.b];
    const struct near_keys near = near_keys_of(v.before.keys, FOR == NARROW_AGAIN ? 0 : count, guess);
    struct sadmm_contact_pair old = load_wide(&v.before.pairs[likely]);
    const struct sadmm_proxy a = *pa, b = *pb;
    if (FOR != NARROW_ONE && !meet_now(v, step, own, a, b)) {
        v.sizes[i] = 0;
        return true;
    }
    int64_t before = had_points ? guess : -1;
    /* where pairs have several manifolds, keys come more than once */
    const bool known = FOR == NARROW_AGAIN || ((int)find_key_near(near, ordered_key(own.a, own.b), &before) &
                                               (int)(v.child_bits == 0));
    const struct pair_start start = pair_start_of(&a, &b, step.margin, step.gravity, step.dt);
    for (int k = 0; k < 3; k += 2) {
        keep_fetched(a.geometry.size[k]);
        keep_fetched(b.geometry.size[k]);
    }
    if (!known) before = search_pair(v, own, count);
    if (before >= 0 && before != likely) old = load_wide(&v.before.pairs[before]);
    const uint32_t cache = contact_memory(&old, &a, &b);
    if (!contact_goes_on(&old, own.child, &a, &b)) before = -1;
    struct manifold m;
    if (HOW == NARROW_AT_ONCE && b.geometry.type == SADMM_SHAPE_HULL) {
        if (!hulls_at_once(v, pa, pb, start, before >= 0 ? cache : 0, &m)) return false;
    } else if (HOW == NARROW_AT_ONCE && geometry_is_smooth(&b.geometry)) {
        return false;
    } else {
        find_manifold(pa, pb, HOW == NARROW_LISTED ? v.hulls : nullptr, own.child, step.margin, step.gravity, step.dt,
                      &start, before >= 0 ? cache : 0, &m);
    }
    store_manifold(v, i, m, before);
    return true;
}

#endif
