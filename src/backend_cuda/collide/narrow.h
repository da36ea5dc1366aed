/* Candidates to manifolds, what the kernels of it share: the last step's pair, for its cache, and where
 * manifolds go. */
#ifndef SADMM_CUDA_COLLIDE_NARROW_H
#define SADMM_CUDA_COLLIDE_NARROW_H

#include "view.h"
#include "backend_cuda/device/parallel.h"

/* C headers: an enumerator beside an unsigned number is fine there. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wextra"
#include "collision/flight/fast_pair.h"
#include "collision/manifold/pair_manifold.h"
#include "collision/mesh/mesh_walk.h"
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

/* hint: any number will do. */
static __device__ __forceinline__ near_keys near_keys_of(const uint64_t *keys, int64_t count, int64_t hint)
{
    struct near_keys near;
    near.first = (hint < 0 ? 0 : hint < count ? hint : count) - NEAR / 2;
    for (int k = 0; k < NEAR; ++k) {
        const int64_t at = near.first + k;
        const uint64_t there = keys[at >= 0 && at < count ? at : 0];
        near.keys[k] = at < 0 ? 0 : at < count ? there : ~UINT64_C(0); /* beyond: smaller, or larger, than all */
    }
    return near;
}

/* Do these keys say where `key` is? Then *at is its index, -1: not there. */
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

/* Is the triangle near the shape in this sub-step? As mesh_walk_next finds it on the host. */
static __device__ bool triangle_now(const collision_view &v, const struct collision_step &step,
                                    const struct candidate &c, const struct sadmm_proxy &a, const struct sadmm_proxy &b)
{
    const struct sadmm_box3 own = v.boxes[c.a];
    struct sadmm_box3 box;
    struct mesh mesh;
    mesh_at(v.hulls, b.geometry.hull, &mesh);
    mesh_reach(&a, &b, &own, step.margin, step.gravity, step.dt, step.dt, &box);
    return mesh_triangle_near(&mesh, (int32_t)c.subshape, &box);
}

/* When the pair of a candidate first touches any triangle: of its candidates the least. */
static __device__ double first_touch(const collision_view &v, const struct candidate &c)
{
    const uint64_t first = first_candidate(v, c.a, c.b);
    const int64_t count = usable_candidates(v);
    double least = HUGE_VAL;
    for (int64_t i = lower_bound(v.candidates, count, first);
         i < count && v.candidates[i] >> v.subshape_bits == first >> v.subshape_bits; ++i)
        least = min_of(v.touches[i], least);
    return least;
}

/* By which find of a step: in later sub-steps the pair that a candidate goes on from is known. ANY: a kernel for all
 * three, which the view distinguishes, where compiling it takes minutes. */
enum narrow_for { NARROW_ONE, NARROW_FIRST, NARROW_AGAIN, NARROW_ANY };
template <int FOR> static __device__ __forceinline__ int narrow_find(const collision_view &v)
{
    if (FOR != NARROW_ANY) return FOR;
    return v.substeps == 1 ? NARROW_ONE : v.substep == 0 ? NARROW_FIRST : NARROW_AGAIN;
}

/* The last step's pair of a candidate, -1: none. */
static __device__ int64_t search_pair(const collision_view &v, const struct candidate &c, int64_t count)
{
    const uint64_t shapes = ordered_key(c.a, c.b);
    int64_t before = find_key_in_eighths(v.before.keys, count, shapes);
    if (before >= 0 && c.subshape > 0) {
        before = contact_lower_bound(v.before.pairs, before, count, shapes, c.subshape);
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
    const found_head head = {m.normal, m.time_offset, m.cache, m.count};
    store_wide(head, &out->head);
    for (int first = 0; first < m.count; first += FOUND_FEATURES) {
        found_features features = {};
        for (int k = 0; k < FOUND_FEATURES && first + k < m.count; ++k) {
            const struct manifold_point &from = m.points[first + k];
            const found_point point = {from.position, from.separation};
            store_wide(point, &out->points[first + k]);
            features.of[k] = from.feature;
        }
        store_wide(features, &out->features[first / FOUND_FEATURES]);
    }
}

/* pair_is_fast, by what is at hand first. */
static __device__ __forceinline__ void note_fast(const collision_view &v, const struct collision_step &step, double way,
                                                 const struct sadmm_proxy *a, const struct sadmm_proxy *b)
{
    if (!(way > *v.threshold * step.dt)) return;
    if (a->restitution > 0 || b->restitution > 0 || pair_passes(a, b, way)) v.candidate_count[COUNT_FAST] = 1;
}

/* What a kernel does for a candidate. */
enum narrow_how {
    NARROW_PLAIN_AT_ONCE, /* of worlds without hulls and meshes what is little work; the others are listed */
    NARROW_PLAIN_LISTED,  /* those */
    NARROW_HULLS_AT_ONCE,       /* the same of worlds with hulls */
    NARROW_HULLS_LISTED,
    NARROW_MESHES_AT_ONCE, /* the same of worlds with meshes: further code, which would slow down the others */
    NARROW_MESHES_LISTED,
    NARROW_ALL_AT_ONCE,   /* the same again, of worlds with smooth bodies */
    NARROW_ALL_LISTED
};
static __device__ constexpr bool with_meshes(int how) { return how >= NARROW_MESHES_AT_ONCE; }
static __device__ constexpr bool with_hulls(int how) { return how >= NARROW_HULLS_AT_ONCE; }
static __device__ constexpr bool is_at_once(int how) { return how % 2 == NARROW_PLAIN_AT_ONCE; }
static __device__ constexpr bool is_listed(int how) { return !is_at_once(how); }
static __device__ constexpr bool with_smooth(int how) { return how >= NARROW_ALL_AT_ONCE; }

/* The manifold of a pair with a hull, as find_manifold makes it, where it is little work; false: it is not. walk: what
 * has been done of it; GJK_FAR: nothing. */
static __device__ bool hulls_at_once(const collision_view &v, const struct collision_step &step,
                                     const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                     const struct pair_start &start, uint32_t cache, struct gjk_walk *walk,
                                     struct manifold *m)
{
    walk->end = GJK_FAR;
    if (start.moves_on) return false;
    m->time_offset = start.time_offset;
    m->count = 0;
    m->cache = 0;
    if (a->geometry.type == SADMM_SHAPE_PLANE)
        hull_plane_manifold(&b->geometry, v.hulls, &start.pose, (real)start.limit, m);
    else if (!hull_manifold_at_once(&a->geometry, &b->geometry, v.hulls, &start.pose, (real)start.limit, cache, walk,
                                    m))
        return false;
    walk->end = GJK_FAR;
    return !pair_asks_balls(a, b, v.hulls, 0, &start, step.gravity, step.dt, m);
}

/* From there. */
static __device__ void hulls_from(const collision_view &v, const struct collision_step &step,
                                  const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                  const struct pair_start &start, uint32_t cache, const struct gjk_walk *walk,
                                  struct manifold *m)
{
    m->time_offset = start.time_offset;
    hull_manifold_from(&a->geometry, &b->geometry, v.hulls, &start.pose, (real)start.limit, cache, walk, m);
    if (pair_asks_balls(a, b, v.hulls, 0, &start, step.gravity, step.dt, m))
        inner_balls_add(a, b, v.hulls, 0, cache != 0, start.touch, step.gravity, step.dt, m);
}

/* As hulls_at_once, of a pair without hulls, meshes and smooth bodies. */
static __device__ __forceinline__ bool plain_at_once(const struct collision_step &step, const struct sadmm_proxy *a,
                                                     const struct sadmm_proxy *b, const struct pair_start &start,
                                                     uint32_t cache, struct manifold *m)
{
    if (start.moves_on) return false;
    const struct pair_pose pose = start.pose; /* as in find_manifold */
    pair_manifold(&a->geometry, &b->geometry, nullptr, 0, &pose, (real)start.limit, cache, m);
    m->time_offset = start.time_offset;
    return !pair_asks_balls(a, b, nullptr, 0, &start, step.gravity, step.dt, m);
}

/* As hulls_at_once, of a pair with a smooth body: on planes, by formula. */
#ifdef SADMM_WITHOUT_SMOOTH
static __device__ bool smooth_at_once(const collision_view &, const struct collision_step &, const struct sadmm_proxy *,
                                      const struct sadmm_proxy *, const struct pair_start &, struct manifold *)
{
    return false;
}
#else
static __device__ bool smooth_at_once(const collision_view &v, const struct collision_step &step,
                                      const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                      const struct pair_start &start, struct manifold *m)
{
    if (start.moves_on || a->geometry.type != SADMM_SHAPE_PLANE) return false;
    m->time_offset = start.time_offset;
    m->count = 0;
    m->cache = 0;
    convex_plane_manifold(&b->geometry, v.hulls, &start.pose, (real)start.limit, m);
    return !pair_asks_balls(a, b, v.hulls, 0, &start, step.gravity, step.dt, m);
}
#endif

/* The manifold with a triangle, as find_triangles makes it on the host; false: it is to be listed. missed: the pair
 * moves on, but not as far as this triangle, so that no ball in its body does. */
template <int HOW>
static __device__ bool narrow_triangle(const collision_view &v, const struct collision_step &step,
                                       const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                       const struct pair_start &start, bool missed, uint32_t subshape, uint32_t cache,
                                       struct gjk_walk *walk, struct manifold *m)
{
    m->time_offset = start.time_offset;
    m->count = 0;
    m->cache = 0;
    if (is_at_once(HOW)) {
        walk->end = GJK_FAR;
        if ((start.moves_on && !missed) || (with_smooth(HOW) && geometry_is_smooth(&a->geometry))) return false;
        if (!mesh_manifold_at_once(&a->geometry, &b->geometry, v.hulls, subshape, &start.pose, (real)start.limit, cache,
                                   walk, m))
            return false;
        walk->end = GJK_FAR;
        if (pair_sinks(a, b, v.hulls, subshape, &start, step.gravity, step.dt, m)) return false;
        if (start.moves_on) inner_on_surface(a, b, m);
        return true;
    }
    if (walk->end != GJK_FAR)
        mesh_manifold_from(&a->geometry, &b->geometry, v.hulls, subshape, &start.pose, (real)start.limit, cache, walk,
                           m);
    else
        triangle_manifold(&a->geometry, &b->geometry, v.hulls, subshape, &start.pose, (real)start.limit, cache, m);
    if (pair_asks_balls(a, b, v.hulls, subshape, &start, step.gravity, step.dt, m))
        inner_balls_add(a, b, v.hulls, subshape, cache != 0, start.touch, step.gravity, step.dt, m);
    return true;
}

/* What takes the time are rounds to memory: what can be asked for together is, before anything waits for any of it.
 * False: nothing is written, the candidate is to be listed. walk: of pairs with a hull, what has been done at once. */
template <int FOR, int HOW>
static __device__ __forceinline__ bool narrow_candidate(const collision_view &v, int64_t i, struct gjk_walk *walk)
{
    const int64_t readable = i < v.candidate_capacity ? i : 0;
    const struct candidate own = candidate_of(v, v.candidates[readable]);
    const int64_t hint = v.pair_of[readable], count = v.before.counts->pairs;
    const struct collision_step all = step_of(v);
    const int find = narrow_find<FOR>(v);
    const bool had_points = find == NARROW_AGAIN && v.sizes[i] > 0;
    if (i >= usable_candidates(v)) {
        v.sizes[i] = 0;
        return true;
    }
    const struct collision_step step = step_of_shape(v, all, own.a);
    const int64_t likely = hint >= 0 && hint < count ? hint : 0;
    const struct sadmm_proxy *pa = wide_at(v.proxies, own.a), *pb = wide_at(v.proxies, own.b);
    const struct near_keys near = near_keys_of(v.before.keys, find == NARROW_AGAIN ? 0 : count, hint);
    struct sadmm_contact_pair old = load_wide(&v.before.pairs[likely]);
    const struct sadmm_proxy a = *pa, b = *pb;
    if (find != NARROW_ONE && !meet_now(v, step, own, a, b)) {
        v.sizes[i] = 0;
        return true;
    }
    int64_t before = had_points ? hint : -1;
    /* where pairs have several manifolds, keys come more than once */
    const bool known = find == NARROW_AGAIN || ((int)find_key_near(near, ordered_key(own.a, own.b), &before) &
                                               (int)(v.subshape_bits == 0));
    struct pair_start start = pair_start_of(&a, &b, step.margin, step.gravity, step.dt);
    const bool on_mesh = with_meshes(HOW) && b.geometry.type == SADMM_SHAPE_MESH; /* whose hits are the solve's */
    if (is_at_once(HOW) && v.threshold && !on_mesh)
        note_fast(v, step, pair_way(&a, &b, step.gravity, step.dt), pa, pb);
    if (on_mesh) {
        if (find != NARROW_ONE && !triangle_now(v, step, own, a, b)) {
            v.sizes[i] = 0;
            return true;
        }
        if (start.moves_on) mesh_start_at(&a, &b, first_touch(v, own), step.margin, step.gravity, step.dt, &start);
    }
    for (int k = 0; k < 3; k += 2) {
        keep_fetched(a.geometry.size[k]);
        keep_fetched(b.geometry.size[k]);
    }
    if (!known) before = search_pair(v, own, count);
    if (before >= 0 && before != likely) old = load_wide(&v.before.pairs[before]);
    const uint32_t cache = contact_memory(&old, &a, &b);
    if (!contact_goes_on(&old, own.subshape, &a, &b)) before = -1;
    struct manifold m;
    if (on_mesh) {
        const bool missed = start.moves_on && !(v.touches[i] < HUGE_VAL);
        if (!narrow_triangle<HOW>(v, step, pa, pb, start, missed, own.subshape, before >= 0 ? cache : 0, walk, &m))
            return false;
    } else if (with_hulls(HOW) && is_at_once(HOW) && b.geometry.type == SADMM_SHAPE_HULL) {
        if (!hulls_at_once(v, step, pa, pb, start, before >= 0 ? cache : 0, walk, &m)) return false;
    } else if (with_hulls(HOW) && b.geometry.type == SADMM_SHAPE_HULL && walk->end != GJK_FAR) {
        hulls_from(v, step, pa, pb, start, before >= 0 ? cache : 0, walk, &m);
    } else if (with_smooth(HOW) && is_at_once(HOW) && geometry_is_smooth(&b.geometry)) {
        if (!smooth_at_once(v, step, pa, pb, start, &m)) return false;
    } else if (is_at_once(HOW)) {
        if (!plain_at_once(step, pa, pb, start, before >= 0 ? cache : 0, &m)) return false;
    } else {
        find_manifold(pa, pb, with_hulls(HOW) ? v.hulls : nullptr, own.subshape, step.margin, step.gravity, step.dt,
                      &start, before >= 0 ? cache : 0, &m);
    }
    store_manifold(v, i, m, before);
    return true;
}

#endif
