#include "kernels.h"

#include "core/base/memory.h"
#include "collision/mesh/mesh_walk.h"
#include "contact_emit.h"
#include "later.h"
#define SADMM_SMOOTH_ELSEWHERE SADMM_COLLISION_KERNEL(smooth_manifold)
#include "collision/manifold/pair_manifold.h"
#include "seam.h"

/* The old pairs of the same two shapes that a triangle's points may go on from: [first, last); of other pairs none. */
struct old_pairs {
    int64_t first, last;
};
static const struct old_pairs no_pairs = {0, 0};

/* Bodies that were hit within the step: the later of both moments (later.h). */
static double since_of(const struct sadmm_collision_input *input, const struct sadmm_proxy *a,
                       const struct sadmm_proxy *b)
{
    return input->since ? max_of(input->since[a->body], input->since[b->body]) : 0;
}

static void begin_later(const struct sadmm_collision_input *input, const struct sadmm_proxy *p, double since,
                        struct sadmm_proxy *out)
{
    proxy_begin_later(p, input->since[p->body], since, input->dt, out);
}

/* A shape of a pair that was found `time_offset` seconds into the step. */
SADMM_ALWAYS_INLINE const struct sadmm_proxy *proxy_found_at(const struct sadmm_collision_input *input,
                                                             const struct sadmm_proxy *p, double since,
                                                             double time_offset, struct sadmm_proxy *turned)
{
    return since > 0 ? proxy_at_later(p, input->since[p->body], since, time_offset, input->dt, turned)
                     : proxy_at(p, time_offset, input->dt, turned);
}

/* Write the manifold as a pair with its points; there is capacity. `before`: the pair that it goes on from, or NULL.
 * ratio: step_ratio of both sets. */
SADMM_ALWAYS_INLINE void emit(const struct sadmm_candidates *c, const struct sadmm_collision_input *input, uint32_t a,
                              uint32_t b, uint32_t subshape, const struct manifold *m,
                              const struct sadmm_contact_set *old, double ratio,
                              const struct sadmm_contact_pair *before, struct old_pairs beside,
                              struct sadmm_contact_set *out)
{
    const double since = since_of(input, &c->proxies[a], &c->proxies[b]);
    struct sadmm_proxy turned[2];
    const struct sadmm_proxy *pa = proxy_found_at(input, &c->proxies[a], since, m->time_offset, &turned[0]),
                             *pb = proxy_found_at(input, &c->proxies[b], since, m->time_offset, &turned[1]);
    struct sadmm_contact_pair *pair = &out->pairs[out->pair_count++];
    const double friction = contact_friction(input->friction_pairs, input->friction_values,
                                             (int64_t)input->friction_pair_count, a, b, pa, pb);
    struct pair_motion motion;
    const struct migration_set last = {old->points, old->migrations};
    struct migration_pair rolling;
    double normal[3];

    rotate_to_world(pb->R, m->normal, normal);
    pair_motion_of(pa, pb, normal, m->time_offset, input->dt, &motion);
    const bool midpoint =
        since == 0 && is_midpoint(m->time_offset, input->dt); /* what is found elsewhere has no half step left */
    const struct sadmm_contact_pair *from = before;
    if (beside.first < beside.last)
        from = contact_rolls_from(pa, pb, before, old->pairs, beside.first, beside.last, old->points, m->count, normal);
    migration_begin(pa, pb, midpoint ? from : NULL, last, input->dt, ratio, m->count, normal, &rolling);
    rolling.across = from != before;
    contact_emit_pair(a, b, subshape, pa, pb, m, rolling.normal, friction, (int32_t)out->point_count, pair);
    for (int i = 0; i < m->count; ++i) {
        struct sadmm_contact_point *point = &out->points[out->point_count];
        contact_emit_point(pa, pb, &motion, &m->points[i], point);
        if (since > 0) open_separation(pa, pb, normal, point);
        const bool carried = before && contact_carry(before, old->points, i, rolling.normal, friction, ratio, point);
        if (!carried && beside.first < beside.last)
            contact_carry_across(old->pairs, beside.first, beside.last, old->points, pair->revision, i, rolling.normal,
                                 friction, ratio, point);
        const double radius = midpoint ? contact_radius(pa, pb, m->count, normal, point) : 0;
        if ((rolling.before || rolling.soon || radius > 0) &&
            migrate_point(pa, pb, &rolling, last, i, radius, input->dt, normal, point,
                          &out->migrations[out->point_count]))
            ++out->migrating;
        ++out->point_count;
    }
}

/* For one more manifold. */
static bool has_capacity(const struct sadmm_contact_set *set)
{
    return set->pair_count < SADMM_ROOM(set->pairs) &&
           set->point_count + SADMM_MANIFOLD_POINTS <= SADMM_ROOM(set->points);
}

/* The same of migrations, where there may be some. */
static bool has_migrations(struct sadmm_contact_set *set)
{
    return set->point_count + SADMM_MANIFOLD_POINTS <= SADMM_ROOM(set->migrations) ||
           sadmm_contact_set_reserve_migrations(set, set->point_count + SADMM_MANIFOLD_POINTS);
}

static bool add_capacity(struct sadmm_contact_set *set)
{
    return SADMM_GROW(set->pairs, set->pair_count, set->pair_count + 1) &&
           SADMM_GROW(set->points, set->point_count, set->point_count + SADMM_MANIFOLD_POINTS);
}

/* What a range of candidates is worked on with. */
struct narrow_phase {
    const struct sadmm_candidates *candidates;
    const struct sadmm_collision_input *input;
    const struct sadmm_contact_set *old;
    size_t next; /* pairs of `old` before it come before everything that is left */
    double ratio; /* of the steps' lengths */
    struct seam_view seams;
    struct sadmm_contact_set *out;
};

/* The pair that a manifold goes on from, NULL: none. They are asked for in the order of sets. */
SADMM_ALWAYS_INLINE const struct sadmm_contact_pair *find_before(struct narrow_phase *n, uint64_t shapes,
                                                                 uint32_t subshape, const struct sadmm_proxy *a,
                                                                 const struct sadmm_proxy *b)
{
    const struct sadmm_contact_pair *pairs = n->old->pairs;
    const size_t count = n->old->pair_count;
    size_t at = n->next;
    while (at < count && contact_is_before(&pairs[at], shapes, subshape)) ++at;
    n->next = at;
    if (at == count || contact_shapes(&pairs[at]) != shapes) return NULL;
    return contact_goes_on(&pairs[at], subshape, a, b) ? &pairs[at] : NULL;
}

/* Write the manifold of a pair, if it has points; false when out of memory. */
SADMM_ALWAYS_INLINE bool keep(struct narrow_phase *n, uint32_t a, uint32_t b, uint32_t subshape,
                              const struct manifold *m, const struct sadmm_contact_pair *before,
                              struct old_pairs beside)
{
    if (m->count == 0) return true;
    if (n->seams.first && seam_hides(&n->seams, n->candidates->proxies, n->input->hulls, a, b, subshape, m))
        return true;
    if (!has_capacity(n->out) && !add_capacity(n->out)) return false;
    if (contact_may_migrate(&n->candidates->proxies[a], &n->candidates->proxies[b], before,
                            n->old->points, m->count) &&
        !has_migrations(n->out))
        return false;
    emit(n->candidates, n->input, a, b, subshape, m, n->old, n->ratio, before, beside, n->out);
    return true;
}

/* Of a triangle, or a pair that was hit: the other one is part of find_subshapes alone. */
__attribute__((noinline)) static bool keep_triangle(struct narrow_phase *n, uint32_t a, uint32_t b, uint32_t triangle,
                                                    const struct manifold *m, const struct sadmm_contact_pair *before,
                                                    struct old_pairs beside)
{
    return keep(n, a, b, triangle, m, before, beside);
}

/* The old pairs of two shapes. They are asked for in the order of sets. */
static struct old_pairs find_beside(struct narrow_phase *n, uint64_t shapes)
{
    const struct sadmm_contact_pair *pairs = n->old->pairs;
    const int64_t count = (int64_t)n->old->pair_count;
    struct old_pairs beside;
    while ((int64_t)n->next < count && contact_is_before(&pairs[n->next], shapes, 0)) ++n->next;
    beside.first = beside.last = (int64_t)n->next;
    while (beside.last < count && contact_shapes(&pairs[beside.last]) == shapes) ++beside.last;
    return beside;
}

/* When a pair with a mesh that moves on first touches any triangle. */
static double touch_any(const struct narrow_phase *n, const struct mesh *mesh, const struct sadmm_box3 *box,
                        const struct sadmm_proxy *a, const struct sadmm_proxy *b, double gravity, double dt)
{
    double first = HUGE_VAL;
    struct mesh_walk walk;
    mesh_walk_begin(mesh, box, &walk);
    for (int32_t triangle = mesh_walk_next(mesh, &walk); triangle >= 0; triangle = mesh_walk_next(mesh, &walk))
        first = min_of(mesh_first_touch(a, b, n->input->hulls, (uint32_t)triangle, gravity, dt), first);
    return first;
}

/* b: a mesh. pa, pb: the two in a step of dt that begins at `since`. By itself: find_subshapes is as quick as it is
 * because all of find_manifold is inlined into it, and what keeps that. */
__attribute__((noinline)) static bool find_triangles(struct narrow_phase *n, uint32_t a, uint32_t b,
                                                     const struct sadmm_proxy *pa, const struct sadmm_proxy *pb,
                                                     double since, double gravity, double dt)
{
    const struct sadmm_collision_input *input = n->input;
    const struct sadmm_proxy *whole_a = &n->candidates->proxies[a], *whole_b = &n->candidates->proxies[b];
    struct pair_start start = pair_start_of(pa, pb, input->margin, gravity, dt);
    struct sadmm_box3 box;
    struct mesh_walk walk;
    struct mesh mesh;
    struct manifold m;
    mesh_at(input->hulls, pb->geometry.hull, &mesh);
    mesh_reach(whole_a, whole_b, &n->candidates->boxes[a].box, input->margin, input->gravity, input->dt, input->dt,
               &box);
    if (start.moves_on) {
        const double first = touch_any(n, &mesh, &box, pa, pb, gravity, dt);
        mesh_start_at(pa, pb, first, input->margin, gravity, dt, &start);
    }
    const struct old_pairs beside = find_beside(n, ordered_key(a, b));
    mesh_walk_begin(&mesh, &box, &walk);
    for (int32_t triangle = mesh_walk_next(&mesh, &walk); triangle >= 0; triangle = mesh_walk_next(&mesh, &walk)) {
        const struct sadmm_contact_pair *before = find_before(n, ordered_key(a, b), (uint32_t)triangle, pa, pb);
        const uint32_t cache = before ? contact_memory(before, pa, pb) : 0;
        m.count = 0;
        m.cache = 0;
        triangle_manifold(&pa->geometry, &pb->geometry, input->hulls, (uint32_t)triangle, &start.pose,
                          (real)start.limit, cache, &m);
        m.time_offset = start.time_offset;
        if (pair_asks_balls(pa, pb, input->hulls, (uint32_t)triangle, &start, gravity, dt, &m))
            inner_balls_add(pa, pb, input->hulls, (uint32_t)triangle, cache != 0, start.touch, gravity, dt, &m);
        m.time_offset += since;
        if (!keep_triangle(n, a, b, (uint32_t)triangle, &m, before, beside)) return false;
    }
    return true;
}

/* find_subshapes of a pair that was hit within the step. */
__attribute__((noinline)) static bool find_later(struct narrow_phase *n, uint32_t a, uint32_t b, double since)
{
    const struct sadmm_collision_input *input = n->input;
    const double left = input->dt - since, gravity = gravity_later(input->gravity, input->dt, left);
    struct sadmm_proxy pa, pb;
    struct manifold m;

    begin_later(input, &n->candidates->proxies[a], since, &pa);
    begin_later(input, &n->candidates->proxies[b], since, &pb);
    const uint32_t subshapes = pair_subshapes(&pa.geometry, &pb.geometry);
    if (subshapes == 0) return find_triangles(n, a, b, &pa, &pb, since, gravity, left);
    for (uint32_t subshape = 0; subshape < subshapes; ++subshape) {
        const struct sadmm_contact_pair *before = find_before(n, ordered_key(a, b), subshape, &pa, &pb);
        const struct pair_start start = pair_start_of(&pa, &pb, input->margin, gravity, left);
        find_manifold(&pa, &pb, input->hulls, subshape, input->margin, gravity, left, &start,
                      before ? contact_memory(before, &pa, &pb) : 0, &m);
        m.time_offset += since;
        if (!keep_triangle(n, a, b, subshape, &m, before, no_pairs)) return false;
    }
    return true;
}

/* The manifolds of two shapes; false when out of memory. */
static bool find_subshapes(struct narrow_phase *n, uint32_t a, uint32_t b)
{
    const struct sadmm_collision_input *input = n->input;
    const struct sadmm_proxy *pa = &n->candidates->proxies[a], *pb = &n->candidates->proxies[b];
    const uint32_t subshapes = pair_subshapes(&pa->geometry, &pb->geometry);
    const double since = since_of(input, pa, pb);
    struct manifold m;

    if (since > 0) return find_later(n, a, b, since);
    if (subshapes == 0) return find_triangles(n, a, b, pa, pb, 0, input->gravity, input->dt);
    for (uint32_t subshape = 0; subshape < subshapes; ++subshape) {
        const struct sadmm_contact_pair *before = find_before(n, ordered_key(a, b), subshape, pa, pb);
        const struct pair_start start = pair_start_of(pa, pb, input->margin, input->gravity, input->dt);
        find_manifold(pa, pb, input->hulls, subshape, input->margin, input->gravity, input->dt, &start,
                      before ? contact_memory(before, pa, pb) : 0, &m);
        if (!keep(n, a, b, subshape, &m, before, no_pairs)) return false;
    }
    return true;
}

/* Those of the candidates [begin, end) that meet, at most MOST_LISTED. In a pass of its own, which waits for nothing:
 * about half of them do, in no order that a processor could foresee. */
enum { MOST_LISTED = 256 };
static size_t list_meeting(const struct sadmm_candidates *c, const struct sadmm_collision_input *input, size_t begin,
                           size_t end, uint64_t keys[MOST_LISTED])
{
    size_t count = 0;
    for (size_t i = begin; i < end; ++i) {
        const uint64_t key = c->list.keys[i];
        const uint32_t a = (uint32_t)(key >> 32), b = (uint32_t)key;
        keys[count] = key;
        count += sadmm_candidate_meets(c, input, a, b);
    }
    return count;
}

bool SADMM_COLLISION_KERNEL(narrow_phase)(const struct sadmm_candidates *c, const struct sadmm_collision_input *input,
                                          size_t begin, size_t end, const struct sadmm_contact_set *old,
                                          struct sadmm_contact_set *out)
{
    struct narrow_phase n = {.candidates = c, .input = input, .old = old, .out = out,
                             .ratio = step_ratio(input->dt, old->dt), .seams = sadmm_seams_view(&c->seams)};
    if (begin < end)
        n.next = (size_t)contact_lower_bound(old->pairs, 0, (int64_t)old->pair_count, c->list.keys[begin], 0);

    while (begin < end) {
        uint64_t keys[MOST_LISTED];
        const size_t last = end - begin < MOST_LISTED ? end : begin + MOST_LISTED,
                     count = list_meeting(c, input, begin, last, keys);
        for (size_t i = 0; i < count; ++i)
            if (!sadmm_pair_is_disabled(input, keys[i]) &&
                !find_subshapes(&n, (uint32_t)(keys[i] >> 32), (uint32_t)keys[i]))
                return false;
        begin = last;
    }
    return true;
}
