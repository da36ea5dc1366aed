/* Contacts after hits (hits_view.h): shapes of what was hit, where they are now; their manifolds and points; and what
 * hits gave bodies. */
#include "hits_view.h"
#include "narrow.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wextra"
#include "collision/find/later.h"
#include "collision/flight/swept_bodies.h"
#pragma GCC diagnostic pop

/* ---- replace ----------------------------------------------------------------------------------------------------- */

/* As place_kernel, of a body whose orientation is the one at its last hit. */
static __device__ __forceinline__ void replace_leaf(const hits_view &v, const struct collision_step &step, int32_t i)
{
    const uint32_t slot = v.c.present[i];
    const double gravity = step_of_shape(v.c, step, slot).gravity;
    const struct sadmm_shape &shape = v.c.shapes[slot];
    if (v.swept_bodies[shape.body].hits == 0) return;
    const struct sadmm_collision_body body = load_wide(&v.c.bodies[shape.body]);
    const struct proxy_turn turn = proxy_turn_since(&shape, &body, v.since[shape.body], step.dt);
    struct collision_leaf leaf = v.c.placed[i];
    struct sadmm_proxy proxy;
    proxy_place(&shape, &v.c.geometries[shape.geometry], &body, &turn, step.dt, step.margin, gravity, &proxy,
                &leaf.box);
    for (int k = 0; k < 3; ++k) leaf.velocity[k] = proxy.velocity[k];
    v.c.proxies[slot] = proxy;
    v.c.placed[i] = leaf;
}

struct packing {
    int32_t counts[HIT_THREADS];
    int32_t end; /* of what is packed */
};

/* The hits of all groups become the step's, one group after the other. One block. */
static __device__ void pack_records(const hits_view &v, struct packing *shared)
{
    struct hits_state *state = v.state;
    const int32_t t = (int32_t)threadIdx.x, into = v.step.into;
    const bool quiet = state->quiet;
    if (t == 0) {
        state->listed = 0;
        ++state->epoch;
        state->first[into] = v.step.substep > 0 ? state->records[into] : 0;
        shared->end = state->first[into];
    }
    __syncthreads();
    for (int32_t first = 0; !quiet && first < v.group_count; first += HIT_THREADS) {
        const int32_t g = first + t, count = g < v.group_count ? v.progress[g].records : 0;
        shared->counts[t] = count;
        __syncthreads();
        int32_t at = shared->end;
        for (int32_t k = 0; k < t; ++k) at += shared->counts[k];
        struct sadmm_world_hit *to = v.records + (size_t)into * (size_t)v.record_capacity + at;
        for (int32_t k = 0; k < count; ++k) to[k] = v.taken[v.groups[g].record_first + k];
        __syncthreads();
        if (t == HIT_THREADS - 1) shared->end = at + count;
        __syncthreads();
    }
    if (t == 0) state->records[into] = shared->end;
}

/* And the candidates are none: they are searched for again. */
static __global__ void __launch_bounds__(HIT_THREADS) replace_kernel(const __grid_constant__ hits_view v)
{
    pdl_wait_if(v.c.pdl);
    COLLISION_SHARED(packing, shared);
    if (blockIdx.x == 0 && !aborted(v.c)) pack_records(v, &shared);
    const int64_t thread = collision_thread(HIT_THREADS), stride = (int64_t)gridDim.x * HIT_THREADS;
    if (v.state->quiet) return;
    const struct collision_step step = step_of(v.c);
    if (thread == 0) v.c.candidate_count[COUNT_FOUND] = v.c.candidate_count[COUNT_MESH_PAIRS] = 0;
    for (int64_t i = thread; i < v.c.leaf_count; i += stride) replace_leaf(v, step, (int32_t)i);
    for (int64_t i = thread; !v.few && i < v.c.candidate_capacity; i += stride) v.c.found[i] = ~UINT64_C(0);
}

/* ---- later ------------------------------------------------------------------------------------------------------- */

/* From when on the pair's motion is what it is taken for, s; 0: all of the step. */
static __device__ __forceinline__ double since_of(const hits_view &v, const struct sadmm_proxy *a,
                                                  const struct sadmm_proxy *b)
{
    return max_of(v.since[a->body], v.since[b->body]);
}

/* From where a pair with a mesh that moves on is found, as find_triangles has it on the host: where it first touches
 * any of its triangles. They are neighbours in the list. */
static __device__ __noinline__ void start_on_mesh(const hits_view &v, const struct collision_step &step,
                                                  const struct candidate &own, const struct sadmm_proxy *a,
                                                  const struct sadmm_proxy *b, double gravity, double left,
                                                  struct pair_start *start)
{
    const uint64_t key = first_candidate(v.c, own.a, own.b);
    const int64_t count = usable_candidates(v.c);
    double least = HUGE_VAL;
    for (int64_t i = lower_bound(v.c.candidates, count, key);
         i < count && v.c.candidates[i] >> v.c.subshape_bits == key >> v.c.subshape_bits; ++i)
        least = min_of(
            mesh_first_touch(a, b, v.c.hulls, candidate_of(v.c, v.c.candidates[i]).subshape, gravity, left), least);
    mesh_start_at(a, b, least, step.margin, gravity, left, start);
}

static __device__ __noinline__ void find_on_mesh(const hits_view &v, const struct collision_step &step,
                                                 const struct candidate &own, const struct sadmm_proxy *a,
                                                 const struct sadmm_proxy *b, double gravity, double left,
                                                 struct pair_start *start, uint32_t cache, struct manifold *m)
{
    if (start->moves_on) start_on_mesh(v, step, own, a, b, gravity, left, start);
    m->count = 0;
    m->cache = 0;
    triangle_manifold(&a->geometry, &b->geometry, v.c.hulls, own.subshape, &start->pose, (real)start->limit, cache, m);
    m->time_offset = start->time_offset;
    if (pair_asks_balls(a, b, v.c.hulls, own.subshape, start, gravity, left, m))
        inner_balls_add(a, b, v.c.hulls, own.subshape, cache != 0, start->touch, gravity, left, m);
}

/* As find_later on the host. */
static __global__ void __launch_bounds__(NARROW_THREADS) later_kernel(const __grid_constant__ hits_view v)
{
    pdl_wait_only_if(v.c.pdl);
    const int64_t thread = collision_thread(NARROW_THREADS), stride = (int64_t)gridDim.x * NARROW_THREADS;
    if (v.state->quiet) return;
    const struct collision_step step = step_of(v.c);
    const int64_t count = v.c.before.counts->pairs, found = usable_candidates(v.c);
    for (int64_t i = thread; i < found; i += stride) {
        const struct candidate own = candidate_of(v.c, v.c.candidates[i]);
        const struct sadmm_proxy *a = &v.c.proxies[own.a], *b = &v.c.proxies[own.b];
        const double since = since_of(v, a, b), left = step.dt - since,
                     gravity = gravity_later(step_of_shape(v.c, step, own.a).gravity, step.dt, left);
        struct sadmm_proxy later_a, later_b;
        struct manifold m;
        if (!(since > 0)) continue;
        proxy_begin_later(a, v.since[a->body], since, step.dt, &later_a);
        proxy_begin_later(b, v.since[b->body], since, step.dt, &later_b);
        struct pair_start start = pair_start_of(&later_a, &later_b, step.margin, gravity, left);
        int64_t before = search_pair(v.c, own, count);
        uint32_t cache = 0;
        if (before >= 0 && contact_goes_on(&v.c.before.pairs[before], own.subshape, &later_a, &later_b))
            cache = contact_memory(&v.c.before.pairs[before], &later_a, &later_b);
        else before = -1;
        if (b->geometry.type == SADMM_SHAPE_MESH)
            find_on_mesh(v, step, own, &later_a, &later_b, gravity, left, &start, cache, &m);
        else
            find_manifold(&later_a, &later_b, v.c.hulls, own.subshape, step.margin, gravity, left, &start, cache, &m);
        m.time_offset += since;
        store_manifold(v.c, i, m, before);
    }
}

/* ---- reopen ------------------------------------------------------------------------------------------------------ */

/* The contacts of candidate i, as `emit` makes them of a pair that was hit within the step on the host. */
static __device__ __noinline__ void emit_later(const hits_view &v, int64_t i, const struct candidate &own, double since,
                                               double dt, struct sadmm_contact_pair *pair)
{
    const struct found_manifold &found = v.c.manifolds[i];
    const struct sadmm_proxy *a = &v.c.proxies[own.a], *b = &v.c.proxies[own.b], *pa, *pb;
    const struct sadmm_contact_pair *before = v.c.matches[i] >= 0 ? &v.c.before.pairs[v.c.matches[i]] : nullptr;
    const double ratio = step_ratio(dt, v.c.before.counts->dt);
    struct sadmm_proxy turned[2];
    struct pair_motion motion;
    struct manifold m;
    double normal[3];
    m.normal = found.head.normal;
    m.time_offset = found.head.time_offset;
    m.cache = found.head.cache;
    m.count = found.head.count;
    pa = proxy_at_later(a, v.since[a->body], since, m.time_offset, dt, &turned[0]);
    pb = proxy_at_later(b, v.since[b->body], since, m.time_offset, dt, &turned[1]);
    rotate_to_world(pb->R, m.normal, normal);
    pair_motion_of(pa, pb, normal, m.time_offset, dt, &motion);
    const double friction = contact_friction(v.c.friction_pairs, v.c.friction_values, v.c.friction_count, own.a, own.b,
                                             pa, pb);
    const int32_t first = pair->first;
    contact_emit_pair(own.a, own.b, own.subshape, pa, pb, &m, normal, friction, first, pair);
    for (int k = 0; k < m.count; ++k) {
        const struct manifold_point point = {found.points[k].position, found.points[k].separation,
                                             found.features[k / FOUND_FEATURES].of[k % FOUND_FEATURES]};
        struct sadmm_contact_point *out = &v.c.after.points[first + k];
        contact_emit_point(pa, pb, &motion, &point, out);
        open_separation(pa, pb, normal, out);
        if (before) contact_carry(before, v.c.before.points, k, normal, friction, ratio, out);
    }
}

/* To the end? */
static __device__ __forceinline__ bool is_followed(const hits_view &v, int32_t body)
{
    const int32_t group = v.group_of[body];
    const uint64_t mark = v.marks[body].followed;
    if (group < 0) return mark >= followed_mark(v.state->epoch, 0); /* by any of them */
    return mark != 0 && mark == v.progress[group].followed && v.kinds[body] != SADMM_SWEPT_NONE &&
           !(gives_up(v, body, mark) && v.marks[body].passes == mark);
}

/* As sadmm_world_open_separations on the host. */
static __device__ __forceinline__ void open_separations(const hits_view &v, const struct candidate &own,
                                                        const struct sadmm_contact_pair *pair)
{
    const struct sadmm_proxy *a = &v.c.proxies[own.a], *b = &v.c.proxies[own.b];
    if (b->geometry.type == SADMM_SHAPE_MESH || !is_followed(v, a->body) || !is_followed(v, b->body)) return;
    const struct swept_body *of_a = &v.swept_bodies[a->body], *of_b = &v.swept_bodies[b->body];
    if (!(pair->restitution > 0 || of_a->hits > 0 || of_b->hits > 0)) return;
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
        swept_bodies_open_separation(pair, &of_a->flight, &of_b->flight, min_of(a->thin, b->thin), v.step.settings,
                                     &v.c.after.points[k]);
}

static __global__ void __launch_bounds__(HIT_THREADS) reopen_kernel(const __grid_constant__ hits_view v)
{
    pdl_wait_if(v.c.pdl);
    const int64_t thread = collision_thread(HIT_THREADS), stride = (int64_t)gridDim.x * HIT_THREADS;
    const bool quiet = v.state->quiet;
    if (aborted(v.c) || !v.state->followed) return;
    const int64_t found = usable_candidates(v.c);
    if (v.c.after.counts->points > v.c.point_capacity) return;
    const double dt = step_of(v.c).dt;
    for (int64_t i = thread; i < found; i += stride) {
        if (v.c.sizes[i] == 0) continue;
        const struct candidate own = candidate_of(v.c, v.c.candidates[i]);
        struct sadmm_contact_pair *pair = &v.c.after.pairs[v.c.pair_of[i]];
        const double since = quiet ? 0 : since_of(v, &v.c.proxies[own.a], &v.c.proxies[own.b]);
        if (since > 0) emit_later(v, i, own, since, dt, pair);
        open_separations(v, own, pair);
    }
}

/* ---- give -------------------------------------------------------------------------------------------------------- */

/* What hits give bodies, beside contacts, once these have been added up (sadmm_world_add_hit_wrenches). */
static __global__ void __launch_bounds__(HIT_THREADS) give_kernel(const __grid_constant__ hits_view v)
{
    pdl_wait_if(v.c.pdl);
    const int64_t thread = collision_thread(HIT_THREADS), stride = (int64_t)gridDim.x * HIT_THREADS;
    if (aborted(v.c) || v.state->quiet) return;
    const double dt = step_of(v.c).dt, all = 1 / (dt * v.step.substeps), /* the last sub-step makes sums means */
        own = v.step.substep + 1 == v.step.substeps ? all : 1 / dt;
    for (int64_t slot = thread; slot < v.c.body_count; slot += stride) {
        const int32_t system = v.c.bodies[slot].system_body;
        if (system == -1) continue;
        const bool kinematic = sadmm_body_is_kinematic(system);
        double *wrench = kinematic ? v.step.kinematic_wrench + 6 * (size_t)sadmm_kinematic(system)
                                   : v.step.wrench + 6 * (size_t)system;
        for (int k = 0; k < 6; ++k) {
            const double impulse = v.impulse[6 * (size_t)slot + k];
            if (impulse != 0) wrench[k] += (kinematic ? all : own) * impulse;
        }
    }
}

void COLLISION(hits_contacts_kernels)(struct hits_kernels *kernels)
{
    kernels->replace = {replace_kernel, HIT_THREADS, sizeof(struct packing), "shapes that were hit"};
    kernels->later = {later_kernel, NARROW_THREADS, 0, "narrow phase of what was hit"};
    kernels->reopen = {reopen_kernel, HIT_THREADS, 0, "contacts of what was hit"};
    kernels->give = {give_kernel, HIT_THREADS, 0, "impulses of hits"};
}
