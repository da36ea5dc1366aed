/* Hits: from candidates to what is left when all have been taken (hits_view.h). */
#include "hits_view.h"

/* C headers: an enumerator beside an unsigned number is fine there. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wextra"
#include "collision/flight/flight_touch_math.h"
#include "collision/flight/fast_pair.h"
#include "collision/flight/swept_bodies.h"
#pragma GCC diagnostic pop

/* ---- list -------------------------------------------------------------------------------------------------------- */

static __device__ __forceinline__ bool shape_is_there(const hits_view &v, int32_t slot)
{
    return slot >= 0 && slot < v.shape_count && v.c.shapes[slot].alive && !v.c.shapes[slot].sensor;
}

/* Does the last step's pair press? */
static __device__ __forceinline__ bool pair_presses(const hits_view &v, const struct sadmm_contact_pair &pair)
{
    if (!shape_is_there(v, pair.shape_a) || !shape_is_there(v, pair.shape_b)) return false;
    const struct sadmm_proxy &a = v.c.proxies[pair.shape_a], &b = v.c.proxies[pair.shape_b];
    if (pair.revision != word_of_pair(a.revision, b.revision)) return false;
    const double mass_a = a.system_body >= 0 ? v.step.before[a.system_body].mass : 0,
                 mass_b = b.system_body >= 0 ? v.step.before[b.system_body].mass : 0;
    for (int32_t k = pair.first; k < pair.first + pair.count; ++k)
        if (swept_body_presses(&pair, &v.c.before.points[k], &a, mass_a, &b, mass_b)) return true;
    return false;
}

static __global__ void __launch_bounds__(HIT_THREADS) list_kernel(const __grid_constant__ hits_view v)
{
    pdl_wait_if(v.c.pdl);
    const int64_t thread = collision_thread(HIT_THREADS), stride = (int64_t)gridDim.x * HIT_THREADS;
    if (thread == 0) v.state->quiet = 1;
    if (aborted(v.c)) return;
    if (thread == 0) v.state->followed = 0;
    for (int64_t g = thread; g < v.group_count; g += stride) {
        struct hit_progress *progress = &v.progress[g];
        progress->earlier = v.step.substep > 0 ? progress->earlier + progress->records : 0;
        progress->foreseen = progress->followed = 0;
        progress->records = 0;
    }
    const struct collision_step all = step_of(v.c);
    const double threshold = v.step.settings->restitution_threshold;
    const uint64_t epoch = v.state->epoch + 1;
    const int64_t candidates = usable_candidates(v.c), pairs = v.c.before.counts->pairs;
    static_assert(sizeof(struct sadmm_rigid) % sizeof(wide_piece) == 0, "a copy is of whole pieces");
    const int64_t pieces = (int64_t)v.step.body_count * (int64_t)(sizeof(struct sadmm_rigid) / sizeof(wide_piece));
    const wide_piece *from = (const wide_piece *)v.step.before;
    for (int64_t i = thread; i < pieces; i += stride) ((wide_piece *)v.step.start)[i] = from[i];
    for (int64_t i = thread; i < candidates; i += stride) {
        const struct candidate own = candidate_of(v.c, v.c.candidates[i]);
        const struct collision_step step = step_of_shape(v.c, all, own.a);
        const struct sadmm_proxy &a = v.c.proxies[own.a], &b = v.c.proxies[own.b];
        if (own.subshape > 0 || b.geometry.type == SADMM_SHAPE_MESH ||
            !pair_is_fast(&a, &b, threshold, step.gravity, step.dt))
            continue;
        v.c.candidate_count[COUNT_FAST] = 1;
        v.listed[atomicAdd(&v.state->listed, 1ull)] = (int32_t)i;
    }
    for (int64_t p = thread; p < pairs; p += stride) {
        const struct sadmm_contact_pair &pair = v.c.before.pairs[p];
        if (!pair_presses(v, pair)) continue;
        v.marks[v.c.proxies[pair.shape_a].body].pressed = epoch;
        v.marks[v.c.proxies[pair.shape_b].body].pressed = epoch;
    }
}

/* ---- swept bodies ------------------------------------------------------------------------------------------------ */

static __device__ __forceinline__ unsigned char kind_of(const hits_view &v, int32_t slot, uint64_t epoch)
{
    const int32_t system = v.c.bodies[slot].system_body;
    if (system < 0) return SADMM_SWEPT_FIXED;
    return v.held[slot] || v.marks[slot].pressed == epoch ||
                   swept_body_is_damped(&v.step.before[system], v.step.settings->dt)
               ? SADMM_SWEPT_NONE
               : SADMM_SWEPT_DYNAMIC;
}

static __device__ __forceinline__ bool kinds_hit(unsigned char a, unsigned char b)
{
    return a != SADMM_SWEPT_NONE && b != SADMM_SWEPT_NONE && (a == SADMM_SWEPT_DYNAMIC || b == SADMM_SWEPT_DYNAMIC);
}

/* The settings of a body that is swept: gravity may be its world's own; `own` has room for these. */
static __device__ __forceinline__ const struct sadmm_settings *settings_for(const hits_view &v, int32_t dynamic,
                                                                            struct sadmm_settings *own)
{
    if (!v.c.gravities.of || dynamic < 0) return v.step.settings;
    *own = *v.step.settings;
    for (int k = 0; k < 3; ++k) own->gravity[k] = own_gravity(v.c.gravities, dynamic)[k];
    return own;
}

static __device__ __noinline__ void load_swept_body(const hits_view &v, int32_t slot, struct swept_body *f)
{
    const struct sadmm_collision_body &body = v.c.bodies[slot];
    memset(f, 0, sizeof *f);
    f->slot = slot;
    f->dynamic = body.system_body >= 0 ? body.system_body : -1;
    f->kinematic = sadmm_body_is_kinematic(body.system_body) ? sadmm_kinematic(body.system_body) : -1;
    if (f->dynamic >= 0) {
        f->start = v.step.before[f->dynamic];
    } else {
        memcpy(f->start.position, body.position, sizeof body.position);
        memcpy(f->start.orientation, body.orientation, sizeof body.orientation);
        memcpy(f->start.velocity, body.velocity, sizeof body.velocity);
    }
    struct sadmm_settings own;
    swept_body_begin(f, settings_for(v, f->dynamic, &own));
}

static __device__ __forceinline__ struct sadmm_swept_shape swept_shape(const hits_view &v, uint32_t slot,
                                                                       const struct sadmm_flight *flight)
{
    const struct sadmm_shape *shape = &v.c.shapes[slot];
    return {shape, &v.c.geometries[shape->geometry], flight};
}

/* When do two shapes of the group hit each other, from `from` on? Into its list; what does not fit is counted. False:
 * it took too many tests to decide. */
static __device__ __noinline__ bool foresee(const hits_view &v, int32_t group, uint64_t key, const struct swept_body *a,
                                            const struct swept_body *b, double from, uint64_t mark)
{
    struct foreseen_hit hit;
    struct sadmm_swept_pair pair = {swept_shape(v, (uint32_t)(key >> 32), &a->flight),
                                    swept_shape(v, (uint32_t)key, &b->flight),
                                    v.c.hulls,
                                    0,
                                    v.step.settings->restitution_threshold,
                                    false};
    v.marks[a->slot].followed = v.marks[b->slot].followed = mark;
    if (pair.b.geometry->type == SADMM_SHAPE_MESH) return true; /* the solve's: what its triangles push along depends on
                                                                   others */
    const bool found = swept_touch(&pair, from, v.step.settings->dt, &hit.touch);
    if (pair.lost) v.marks[a->slot].lost = v.marks[b->slot].lost = mark;
    if (!found) return !pair.lost;
    hit.key = key;
    hit.body[0] = a->slot;
    hit.body[1] = b->slot;
    hit.hits[0] = a->hits;
    hit.hits[1] = b->hits;
    const struct hit_group &of = v.groups[group];
    const unsigned long long at = atomicAdd(&v.progress[group].foreseen, 1ull);
    if (at < (unsigned long long)of.room) v.foreseen[of.room_first + at] = hit;
    return !pair.lost;
}

static __device__ __forceinline__ int32_t group_of(const hits_view &v, int32_t a, int32_t b)
{
    return v.group_of[a] >= 0 ? v.group_of[a] : v.group_of[b];
}

/* A body as the (sub-)step begins. */
static __device__ __forceinline__ void begin_body(const hits_view &v, int32_t slot)
{
    load_swept_body(v, slot, &v.swept_bodies[slot]);
    for (int k = 0; k < 6; ++k) v.impulse[6 * (size_t)slot + k] = 0;
    v.since[slot] = 0;
}

/* Both of a fast pair of swept bodies are followed, and may go through each other. */
static __device__ __forceinline__ void follow(const hits_view &v, const struct collision_step &step,
                                              const struct sadmm_proxy &a, const struct sadmm_proxy &b, uint64_t mark)
{
    v.marks[a.body].followed = v.marks[b.body].followed = mark;
    if (pair_passes(&a, &b, pair_way(&a, &b, step.gravity, step.dt)))
        v.marks[a.body].passes = v.marks[b.body].passes = mark;
}

/* Pairs with a mesh are the solve's, but swept bodies that are fast enough are followed. kind: of a body. */
template <class Kind>
static __device__ __forceinline__ void follow_on_meshes(const hits_view &v, int64_t thread, int64_t stride,
                                                        uint64_t mark, const Kind &kind)
{
    if (v.c.mesh_count == 0) return;
    const struct collision_step all = step_of(v.c);
    const int64_t count = usable_candidates(v.c) > 0 ? (int64_t)v.c.candidate_count[COUNT_MESH_PAIRS] : 0;
    for (int64_t j = thread; j < count; j += stride) {
        const struct candidate own = candidate_of(v.c, v.c.mesh_pairs[j]);
        const struct collision_step step = step_of_shape(v.c, all, own.a);
        const struct sadmm_proxy &a = v.c.proxies[own.a], &b = v.c.proxies[own.b];
        if (kinds_hit(kind(a.body), kind(b.body)) &&
            pair_is_fast(&a, &b, v.step.settings->restitution_threshold, step.gravity, step.dt))
            follow(v, step, a, b, mark);
    }
}

/* A listed pair; those that took too many tests to decide are marked by their sign. */
static __device__ __forceinline__ struct candidate listed_pair(const hits_view &v, int64_t j)
{
    const int32_t at = v.listed[j];
    return candidate_of(v.c, v.c.candidates[at < 0 ? ~at : at]);
}

/* Beside it all swept bodies and boxes for `take`. */
static __device__ __forceinline__ void foresee_all(const hits_view &v)
{
    const int64_t thread = collision_thread(FORESEE_THREADS), stride = (int64_t)gridDim.x * FORESEE_THREADS;
    if (aborted(v.c)) return;
    const int64_t count = (int64_t)v.state->listed;
    const uint64_t epoch = v.state->epoch + 1, mark = followed_mark(epoch, 0);
    const struct collision_step step = step_of(v.c);
    for (int64_t j = thread; j < count; j += stride) {
        const struct candidate own = listed_pair(v, j);
        const int32_t a = v.c.proxies[own.a].body, b = v.c.proxies[own.b].body;
        struct swept_body swept_bodies[2];
        if (!kinds_hit(kind_of(v, a, epoch), kind_of(v, b, epoch))) continue;
        load_swept_body(v, a, &swept_bodies[0]);
        load_swept_body(v, b, &swept_bodies[1]);
        v.state->followed = 1;
        v.progress[group_of(v, a, b)].followed = mark;
        follow(v, step_of_shape(v.c, step, own.a), v.c.proxies[own.a], v.c.proxies[own.b], mark);
        if (!foresee(v, group_of(v, a, b), ordered_key(own.a, own.b), &swept_bodies[0], &swept_bodies[1], 0, mark))
            v.listed[j] = ~v.listed[j];
    }
    if (count > 0)
        follow_on_meshes(v, thread, stride, mark, [&v, epoch](int32_t body) { return kind_of(v, body, epoch); });
    for (int64_t slot = thread; count > 0 && slot < v.c.body_count; slot += stride) {
        begin_body(v, (int32_t)slot);
        v.kinds[slot] = kind_of(v, (int32_t)slot, epoch);
    }
    for (int64_t i = thread; count > 0 && i < v.c.leaf_count; i += stride) v.boxes[i] = v.c.placed[i].box;
}

/* ---- take -------------------------------------------------------------------------------------------------------- */

struct take_shared {
    double time[TAKE_THREADS];
    uint64_t key[TAKE_THREADS];
    int64_t item[TAKE_THREADS];
    struct foreseen_hit next;
    struct hit_group own;
    unsigned long long shapes, near, tests; /* of a body that was hit; near one of these; in all */
    int64_t count;               /* of the list */
    int32_t listed[TAKE_SHAPES], leaves[TAKE_SHAPES]; /* of a body that was hit: as they come, and in order */
    int32_t group, record_count, hit_count, found, taken;
    bool fails;
};

static __device__ __forceinline__ bool holds(const hits_view &v, const struct foreseen_hit &hit)
{
    const int32_t a = hit.body[0], b = hit.body[1];
    return v.swept_bodies[a].hits == hit.hits[0] && v.swept_bodies[b].hits == hit.hits[1] &&
           kinds_hit(v.kinds[a], v.kinds[b]);
}

/* The group's swept bodies, boxes and sums as the (sub-)step begins, once more. Every thread. */
static __device__ void begin_again(const hits_view &v, const struct hit_group &own)
{
    for (int32_t j = (int32_t)threadIdx.x; j < own.body_count; j += TAKE_THREADS)
        begin_body(v, v.group_bodies[own.body_first + j]);
    for (int32_t j = (int32_t)threadIdx.x; j < own.leaf_count; j += TAKE_THREADS) {
        const int32_t i = v.group_leaves[own.leaf_first + j];
        v.boxes[i] = v.c.placed[i].box;
    }
    __syncthreads();
}

/* Swept bodies of the group's fast pairs, once some bodies take part no more. Every thread. */
static __device__ void follow_listed(const hits_view &v, int32_t group, uint64_t mark)
{
    const struct collision_step step = step_of(v.c);
    for (int64_t j = (int64_t)threadIdx.x; j < (int64_t)v.state->listed; j += TAKE_THREADS) {
        const struct candidate own = listed_pair(v, j);
        const struct sadmm_proxy &a = v.c.proxies[own.a], &b = v.c.proxies[own.b];
        if (group_of(v, a.body, b.body) != group || !kinds_hit(v.kinds[a.body], v.kinds[b.body])) continue;
        follow(v, step_of_shape(v.c, step, own.a), a, b, mark);
        if (v.listed[j] < 0) v.marks[a.body].lost = v.marks[b.body].lost = mark;
    }
    follow_on_meshes(v, (int64_t)threadIdx.x, TAKE_THREADS, mark, [&v, group](int32_t body) {
        return v.group_of[body] < 0 || v.group_of[body] == group ? v.kinds[body] : (unsigned char)SADMM_SWEPT_NONE;
    });
    if (threadIdx.x == 0) v.progress[group].followed = mark;
    __syncthreads();
}

static __device__ __forceinline__ bool is_before(double time, uint64_t key, double other_time, uint64_t other_key)
{
    return time < other_time || (time == other_time && key < other_key);
}

/* The next hit of the list into shared->item[0], -1: there is none. Every thread. */
static __device__ void find_next(const hits_view &v, struct take_shared *shared)
{
    const int t = (int)threadIdx.x;
    double time = HUGE_VAL;
    uint64_t key = ~UINT64_C(0);
    int64_t best = -1;
    for (int64_t i = t; i < shared->count; i += TAKE_THREADS) {
        const struct foreseen_hit &hit = v.foreseen[shared->own.room_first + i];
        if ((best >= 0 && !is_before(hit.touch.time, hit.key, time, key)) || !holds(v, hit)) continue;
        time = hit.touch.time;
        key = hit.key;
        best = i;
    }
    shared->time[t] = time;
    shared->key[t] = key;
    shared->item[t] = best;
    __syncthreads();
    for (int half = TAKE_THREADS / 2; half > 0; half /= 2) {
        if (t < half && shared->item[t + half] >= 0 &&
            (shared->item[t] < 0 ||
             is_before(shared->time[t + half], shared->key[t + half], shared->time[t], shared->key[t]))) {
            shared->time[t] = shared->time[t + half];
            shared->key[t] = shared->key[t + half];
            shared->item[t] = shared->item[t + half];
        }
        __syncthreads();
    }
}

/* As `record` on the host; and what it gives bodies. False: there is no room. */
static __device__ bool record(const hits_view &v, const struct foreseen_hit &item, const struct hit *hit,
                              struct take_shared *shared)
{
    for (int k = 0; k < hit->count; ++k) {
        if (!(hit->impulse[k].x > 0)) continue;
        if (v.progress[shared->group].earlier + shared->record_count == shared->own.record_room) return false;
        struct sadmm_world_hit *out = &v.taken[shared->own.record_first + shared->record_count++];
        memset(out, 0, sizeof *out);
        out->shape_a = (int32_t)(item.key >> 32);
        out->shape_b = (int32_t)(uint32_t)item.key;
        out->feature = item.touch.feature[k];
        memcpy(out->position, item.touch.point[k], sizeof out->position);
        memcpy(out->normal, item.touch.normal, sizeof out->normal);
        v3_store(hit_impulse(hit, k, 1), out->impulse);
        for (int side = 0; side < 2; ++side) {
            const struct swept_body &f = v.swept_bodies[item.body[side]];
            double *sum = v.impulse + 6 * (size_t)item.body[side];
            v3_store(hit->arm[side][k], out->arm[side]);
            out->dynamic[side] = f.dynamic;
            out->kinematic[side] = f.kinematic;
            if (v.group_of[item.body[side]] < 0) continue; /* it does not move, and other groups meet it */
            for (int j = 0; j < 3; ++j) sum[j] += (side ? 1 : -1) * out->impulse[j];
            add_cross(out->arm[side], out->impulse, side ? 1 : -1, sum + 3);
        }
        out->speed = -(double)hit_velocity(hit, k).x;
        out->friction = hit->friction;
    }
    return true;
}

/* One thread: the hit happens, or would be one too many; of what passes, one more through a centre of mass does. */
static __device__ __noinline__ void take_hit(const hits_view &v, uint64_t mark, struct take_shared *shared)
{
    struct foreseen_hit &item = shared->next;
    struct swept_body *const f[2] = {&v.swept_bodies[item.body[0]], &v.swept_bodies[item.body[1]]};
    const struct swept_body *const of[2] = {f[0], f[1]};
    struct sadmm_flight_pose pose[2];
    struct hit hit;
    bool may = true, last = false;
    shared->taken = 0;
    for (int side = 0; side < 2; ++side) {
        if (f[side]->hits < (uint32_t)v.step.most) continue;
        may = may && v.marks[item.body[side]].passes == mark && f[side]->hits == (uint32_t)v.step.most;
        f[side]->too_many = last = true;
    }
    if (!may) {
        /* it does not hold; nor the next time, without one of them */
        v.foreseen[shared->own.room_first + shared->item[0]].hits[0] = UINT32_MAX;
        return;
    }
    const struct sadmm_proxy &a = v.c.proxies[item.key >> 32], &b = v.c.proxies[item.key & UINT32_MAX];
    for (int side = 0; side < 2; ++side) flight_at(&f[side]->flight, item.touch.time, &pose[side]);
    memset(&hit, 0, sizeof hit);
    hit.friction = contact_friction(v.c.friction_pairs, v.c.friction_values, v.c.friction_count,
                                    (uint32_t)(item.key >> 32), (uint32_t)item.key, &a, &b);
    hit.restitution = max_of(a.restitution, b.restitution);
    swept_bodies_hit(of, &item.touch, v.step.settings->restitution_threshold, pose, &hit);
    if (last) swept_bodies_hit_centre(of, pose, &item.touch, &hit);
    hit_solve(&hit);
    if (!record(v, item, &hit, shared)) {
        shared->fails = true;
        return;
    }
    struct sadmm_settings own;
    const int32_t dynamic = f[0]->dynamic >= 0 ? f[0]->dynamic : f[1]->dynamic;
    swept_bodies_part(f, settings_for(v, dynamic, &own), item.touch.time, pose, &hit);
    shared->taken = 1;
    ++shared->hit_count;
}

/* The shapes of a body that was hit, and their boxes from then on. In order: whether there is room for what one of them
 * comes near depends on those before it. Every thread. */
static __device__ void list_shapes(const hits_view &v, int32_t body, struct take_shared *shared)
{
    const struct swept_body &f = v.swept_bodies[body];
    if (threadIdx.x == 0) shared->shapes = shared->near = 0;
    __syncthreads();
    for (int32_t j = (int32_t)threadIdx.x; j < shared->own.leaf_count; j += TAKE_THREADS) {
        const int32_t i = v.group_leaves[shared->own.leaf_first + j];
        if (v.c.placed[i].filter.body != body) continue;
        const unsigned long long at = atomicAdd(&shared->shapes, 1ull);
        if (at >= TAKE_SHAPES) continue;
        const struct sadmm_shape *shape = &v.c.shapes[v.c.placed[i].slot];
        struct sadmm_flight_pose from, to;
        flight_at(&f.flight, f.flight.since, &from);
        flight_at(&f.flight, v.step.settings->dt, &to);
        swept_body_box(shape, &v.c.geometries[shape->geometry], &f.flight, v.step.settings->dt, &from, &to,
                       &v.boxes[i]);
        shared->listed[at] = i;
    }
    __syncthreads();
    for (int32_t k = (int32_t)threadIdx.x; shared->shapes <= TAKE_SHAPES && k < (int32_t)shared->shapes;
         k += TAKE_THREADS) {
        int32_t rank = 0;
        for (int32_t other = 0; other < (int32_t)shared->shapes; ++other)
            rank += shared->listed[other] < shared->listed[k];
        shared->leaves[rank] = shared->listed[k];
    }
    if (threadIdx.x == 0) {
        shared->tests += (shared->shapes + 1) *
                         (unsigned long long)(shared->own.leaf_count + v.shared_leaf_count + v.c.plane_count);
        if (shared->shapes > TAKE_SHAPES || shared->tests > TAKE_TESTS) shared->fails = true;
    }
    __syncthreads();
}

static __device__ __forceinline__ bool filters_hit(const hits_view &v, const struct collision_filter &a,
                                                   const struct collision_filter &b)
{
    return a.body != b.body && (a.category & b.mask) != 0 && (b.category & a.mask) != 0 &&
           kinds_hit(v.kinds[a.body], v.kinds[b.body]) &&
           (v.c.disabled_count == 0 ||
            find_key(v.c.disabled_pairs, v.c.disabled_count, unordered_key((uint32_t)a.body, (uint32_t)b.body)) < 0);
}

static __device__ __forceinline__ void add_near(const hits_view &v, uint64_t key, struct take_shared *shared)
{
    v.near[shared->own.near_first + atomicAdd(&shared->near, 1ull)] = key;
}

/* If the leaf, of a body that was hit, comes near the other one: sadmm_collision_list_near. */
static __device__ __forceinline__ void test_near(const hits_view &v, int32_t number, const struct sadmm_box3 &box,
                                                 int32_t i, int32_t except, struct take_shared *shared)
{
    const struct collision_leaf &own = v.c.placed[number], &other = v.c.placed[i];
    if (i == number || other.filter.body == except || !boxes_overlap(&v.boxes[i], &box) ||
        !(own.group_low <= other.group_high && other.group_low <= own.group_high) ||
        !filters_hit(v, own.filter, other.filter))
        return;
    const int rank = own.filter.kind & FILTER_RANK, of_other = other.filter.kind & FILTER_RANK;
    const bool first = rank < of_other || (rank == of_other && own.slot < other.slot);
    add_near(v,
             first ? ordered_key((uint32_t)own.slot, (uint32_t)other.slot)
                   : ordered_key((uint32_t)other.slot, (uint32_t)own.slot),
             shared);
}

/* All that it comes near. Every thread. */
static __device__ void list_near(const hits_view &v, int32_t number, int32_t except, struct take_shared *shared)
{
    const struct collision_leaf &own = v.c.placed[number];
    const struct sadmm_box3 box = v.boxes[number];
    for (int32_t j = (int32_t)threadIdx.x; j < shared->own.leaf_count; j += TAKE_THREADS)
        test_near(v, number, box, v.group_leaves[shared->own.leaf_first + j], except, shared);
    for (int32_t j = (int32_t)threadIdx.x; j < v.shared_leaf_count; j += TAKE_THREADS)
        test_near(v, number, box, v.shared_leaves[j], except, shared);
    for (int32_t p = (int32_t)threadIdx.x; p < v.c.plane_count; p += TAKE_THREADS) {
        const uint64_t entry = v.c.planes[p], group = entry >> 32;
        const uint32_t plane = (uint32_t)entry;
        if (v.c.filters[plane].body == except ||
            (group > 0 && own.group_low == own.group_high && own.group_low != (int32_t)group - 1) ||
            !proxy_plane_meets(&v.c.proxies[plane], &box, 0) || !filters_hit(v, v.c.filters[plane], own.filter))
            continue;
        add_near(v, ordered_key(plane, (uint32_t)own.slot), shared);
    }
    __syncthreads();
}

/* Room for so many more in the list: what does not hold any more goes. Every thread. */
static __device__ void make_room(const hits_view &v, int64_t initial, int64_t more, struct take_shared *shared)
{
    if (threadIdx.x == 0 && shared->count + more > shared->own.room) {
        struct foreseen_hit *list = v.foreseen + shared->own.room_first;
        int64_t kept = initial;
        for (int64_t i = initial; i < shared->count; ++i)
            if (holds(v, list[i])) list[kept++] = list[i];
        shared->count = kept;
        if (kept + more > shared->own.room) shared->fails = true;
        v.progress[shared->group].foreseen = (unsigned long long)kept;
    }
    __syncthreads();
}

/* With which marks hits are taken. */
struct taking_marks {
    uint64_t followed;
    int64_t initial; /* foreseen by its candidates */
};

/* What a body that was hit comes near from there on; `except`: a body whose pairs with it are known. Every thread. */
static __device__ void foresee_body(const hits_view &v, int32_t body, int32_t except, const struct taking_marks &marks,
                                    struct take_shared *shared)
{
    list_shapes(v, body, shared);
    for (int32_t k = 0; !shared->fails && k < (int32_t)shared->shapes; ++k) {
        list_near(v, shared->leaves[k], except, shared);
        const int64_t near = (int64_t)shared->near;
        make_room(v, marks.initial, near, shared);
        if (shared->fails) break;
        for (int64_t j = (int64_t)threadIdx.x; j < near; j += TAKE_THREADS) {
            const uint64_t key = v.near[shared->own.near_first + j];
            foresee(v, shared->group, key, &v.swept_bodies[v.c.proxies[key >> 32].body],
                    &v.swept_bodies[v.c.proxies[key & UINT32_MAX].body], v.swept_bodies[body].flight.since,
                    marks.followed);
        }
        __syncthreads();
        if (threadIdx.x == 0) {
            shared->count = (int64_t)v.progress[shared->group].foreseen;
            shared->near = 0;
        }
        __syncthreads();
    }
    __syncthreads();
}

/* All hits, in the order of time. Every thread. */
static __device__ void take_all(const hits_view &v, const struct taking_marks &marks, struct take_shared *shared)
{
    while (!shared->fails) {
        find_next(v, shared);
        if (shared->item[0] < 0) return;
        if (threadIdx.x == 0) {
            shared->next = v.foreseen[shared->own.room_first + shared->item[0]];
            take_hit(v, marks.followed, shared);
        }
        __syncthreads();
        if (!shared->taken || shared->fails) continue;
        const int32_t a = shared->next.body[0], b = shared->next.body[1];
        const bool moves_a = v.swept_bodies[a].dynamic >= 0, moves_b = v.swept_bodies[b].dynamic >= 0;
        if (moves_a) foresee_body(v, a, -1, marks, shared);
        if (moves_b && !shared->fails) foresee_body(v, b, moves_a ? a : -1, marks, shared);
    }
}

/* Bodies that would be hit too often, and do not pass, take part no more; are there any? Every thread. */
static __device__ bool leave_out(const hits_view &v, uint64_t mark, struct take_shared *shared)
{
    if (threadIdx.x == 0) shared->found = 0;
    __syncthreads();
    for (int32_t j = (int32_t)threadIdx.x; j < shared->own.body_count; j += TAKE_THREADS) {
        const int32_t slot = v.group_bodies[shared->own.body_first + j];
        if (v.kinds[slot] == SADMM_SWEPT_NONE || !gives_up(v, slot, mark) || v.marks[slot].passes == mark) continue;
        v.kinds[slot] = SADMM_SWEPT_NONE;
        shared->found = 1;
    }
    __syncthreads();
    return shared->found != 0;
}

/* What was hit begins the (sub-)step where it would have. */
static __device__ __forceinline__ void write_back(const hits_view &v, int32_t slot)
{
    const struct swept_body &f = v.swept_bodies[slot];
    if (f.hits == 0) return;
    struct sadmm_collision_body *out = &v.step.bodies[slot];
    double *velocity = v.step.velocity + 6 * (size_t)f.dynamic;
    struct sadmm_flight_pose pose;
    v.step.start[f.dynamic] = f.start;
    struct sadmm_settings own;
    swept_body_end_velocity(&f, settings_for(v, f.dynamic, &own), velocity);
    flight_at(&f.flight, f.flight.since, &pose);
    memcpy(out->position, f.start.position, sizeof out->position);
    memcpy(out->velocity, f.start.velocity, sizeof out->velocity);
    memcpy(out->orientation, pose.orientation, sizeof out->orientation);
    if (f.flight.inertia[0] > 0) memcpy(out->velocity + 3, pose.spin, sizeof pose.spin);
    v.since[slot] = f.flight.since;
}

/* Every thread of the block. */
static __device__ void take_group(const hits_view &v, int32_t group, uint64_t epoch, struct take_shared *shared)
{
    const bool is_first = threadIdx.x == 0;
    const struct hit_group &own = shared->own;
    __syncthreads();
    if (is_first) {
        shared->group = group;
        shared->own = v.groups[group];
        shared->taken = 0;
        shared->tests = 0;
    }
    __syncthreads();
    struct taking_marks marks = {0, (int64_t)v.progress[group].foreseen};
    __syncthreads();
    if (is_first) /* what is sure to be more than it may take is not begun */
        shared->fails = marks.initial > own.room ||
                        marks.initial * (own.leaf_count + v.shared_leaf_count + v.c.plane_count) > TAKE_TESTS;
    __syncthreads();
    bool done = false;
    for (int times = 0; times < TAKE_TIMES && !done && !shared->fails; ++times) {
        marks.followed = followed_mark(epoch, times);
        __syncthreads();
        if (is_first) {
            shared->count = marks.initial;
            shared->record_count = shared->hit_count = 0;
            v.progress[group].foreseen = (unsigned long long)marks.initial;
        }
        __syncthreads();
        if (times > 0) {
            begin_again(v, own);
            follow_listed(v, group, marks.followed);
        }
        take_all(v, marks, shared);
        __syncthreads();
        if (!shared->fails) done = !leave_out(v, marks.followed, shared);
        __syncthreads();
    }
    const bool any = done && shared->hit_count > 0;
    for (int32_t j = (int32_t)threadIdx.x; j < own.body_count; j += TAKE_THREADS) {
        const int32_t slot = v.group_bodies[own.body_first + j];
        if (any) write_back(v, slot);
        if (done) continue;
        begin_body(v, slot); /* none is taken, and none was foreseen */
        v.kinds[slot] = SADMM_SWEPT_NONE;
    }
    if (!is_first || !any) return;
    v.progress[group].records = shared->record_count;
    v.state->quiet = 0;
}

static __device__ __forceinline__ void take_all_groups(const hits_view &v)
{
    COLLISION_SHARED(take_shared, shared);
    if (aborted(v.c) || v.state->listed == 0) return;
    const uint64_t epoch = v.state->epoch + 1;
    for (int32_t group = (int32_t)blockIdx.x; group < v.group_count; group += (int32_t)gridDim.x)
        if (v.progress[group].followed != 0) take_group(v, group, epoch, &shared);
}

/* One kernel for both: most of either is when two shapes touch, which takes its compiler a minute. */
static __global__ void __launch_bounds__(TAKE_THREADS) touch_kernel(const __grid_constant__ hits_view v)
{
    pdl_wait_if(v.c.pdl);
    if (v.takes) take_all_groups(v);
    else foresee_all(v);
}

void COLLISION(hits_take_kernels)(struct hits_kernels *kernels)
{
    kernels->list = {list_kernel, HIT_THREADS, 0, "fast pairs"};
    kernels->foresee = {touch_kernel, FORESEE_THREADS, sizeof(struct take_shared), "first touches"};
    kernels->take = {touch_kernel, TAKE_THREADS, sizeof(struct take_shared), "hits"};
}
