#include "candidates.h"

#include <string.h>

#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "keys.h"
#include "radix_sort.h"

enum {
    SLOT_PRESENT = 1,
    SLOT_LEFT = 2, /* its box left the larger one, or the entry changed */
    SLOT_PLANE = 4,
    SLOT_REFUSED = 8 /* sadmm_collision_check_shape says why */
};

/* The larger box: this share of the shape's radius on every side, and the way it goes in some steps, up to its radius.
 * Larger: fewer updates, more pairs to test. A first sub-step renews it where the shape is about to leave it within the
 * step, so that the broad phase runs once a step unless velocities change much in it. */
#define ENLARGED_BY 0.1
#define STEPS_AHEAD 4
/* How far sub-steps look, as a share of the way that is left: the first one farthest, so that no later one finds, by
 * its rounding, what that one has not. */
#define SUBSTEPS_AHEAD 1.1
/* Ask the broad phase for single shapes up to one in so many: a query costs as much as some ten of a sweep over all. */
enum { ONE_BY_ONE = 8 };

sadmm_status sadmm_candidates_init(struct sadmm_candidates *c, const struct sadmm_broad_phase_kind *kind,
                                   struct sadmm_error *error)
{
    memset(c, 0, sizeof *c);
    c->kind = kind;
    return kind->create(&c->broad_phase, error);
}

void sadmm_candidates_free(struct sadmm_candidates *c)
{
    if (c->broad_phase) c->kind->destroy(c->broad_phase);
    sadmm_free(c->proxies);
    sadmm_free(c->boxes);
    sadmm_free(c->entries);
    sadmm_free(c->seen);
    sadmm_free(c->state);
    sadmm_free(c->changed);
    sadmm_free(c->movers);
    sadmm_free(c->planes);
    sadmm_free(c->list.keys);
    sadmm_free(c->found.keys);
    sadmm_free(c->merged.keys);
    memset(c, 0, sizeof *c);
}

static bool reserve_slots(struct sadmm_candidates *c, size_t slots)
{
    /* entries and seen remember the last step */
    return sadmm_grow(&c->proxies, &c->proxy_capacity, 0, slots, sizeof *c->proxies) &&
           sadmm_grow(&c->boxes, &c->box_capacity, 0, slots, sizeof *c->boxes) &&
           sadmm_grow(&c->entries, &c->entry_capacity, c->slot_count, slots, sizeof *c->entries) &&
           sadmm_grow(&c->seen, &c->seen_capacity, c->slot_count, slots, sizeof *c->seen) &&
           sadmm_grow(&c->state, &c->state_capacity, 0, slots, sizeof *c->state) &&
           sadmm_grow(&c->changed, &c->changed_capacity, 0, slots, sizeof *c->changed) &&
           sadmm_grow(&c->movers, &c->mover_capacity, 0, 2 * slots, sizeof *c->movers) &&
           sadmm_grow(&c->planes, &c->plane_capacity, 0, slots, sizeof *c->planes);
}

static bool contains(const struct sadmm_box3 *outer, const struct sadmm_box3 *inner)
{
    for (int k = 0; k < 3; ++k)
        if (!(outer->lo[k] <= inner->lo[k] && inner->hi[k] <= outer->hi[k])) return false;
    return true;
}

/* What the shape goes until its last sub-step, and a little more. */
static double way_left(const struct sadmm_collision_input *input, double velocity)
{
    return SUBSTEPS_AHEAD * input->substeps_left * (input->dt * velocity);
}

/* Where will the shape be in its last sub-step? */
static void move_on(const struct sadmm_box3 *box, const struct sadmm_proxy *p,
                    const struct sadmm_collision_input *input, struct sadmm_box3 *last)
{
    for (int k = 0; k < 3; ++k) {
        const double way = way_left(input, p->velocity[k]);
        last->lo[k] = box->lo[k] + way;
        last->hi[k] = box->hi[k] + way;
    }
}

/* Is the list of pairs good for the shape, and will it be in the sub-steps to come? */
static bool stays(const struct sadmm_broad_entry *entry, const struct sadmm_box3 *box, const struct sadmm_proxy *p,
                  const struct sadmm_collision_input *input)
{
    struct sadmm_box3 last;
    if (!contains(&entry->box, box)) return false;
    if (input->substeps_left == 0) return true;
    move_on(box, p, input, &last);
    return contains(&entry->box, &last);
}

static void enlarge(const struct sadmm_box3 *box, const struct sadmm_proxy *p,
                    const struct sadmm_collision_input *input, struct sadmm_box3 *larger)
{
    double radius = p->system_body >= 0 ? geometry_radius(&p->geometry) : 0;
    for (int k = 0; k < 3; ++k) {
        const double dt = input->dt * (1 + input->substeps_left),
                     most = fmax(radius, fabs(way_left(input, p->velocity[k])));
        double way = fmin(fmax(STEPS_AHEAD * dt * p->velocity[k], -most), most);
        larger->lo[k] = box->lo[k] - ENLARGED_BY * radius + fmin(way, 0.0);
        larger->hi[k] = box->hi[k] + ENLARGED_BY * radius + fmax(way, 0.0);
    }
}

/* A plane has no box: its entry remembers a point and the normal. */
static bool plane_stays(const struct sadmm_broad_entry *entry, const struct sadmm_proxy *plane)
{
    for (int k = 0; k < 3; ++k)
        if (!(entry->box.lo[k] == plane->x[k] && entry->box.hi[k] == plane->R[3 * k + 2])) return false;
    return true;
}

/* Pose and box of a slot; its entry, enlarged, when the old one does not hold it any more. */
static void update_slot(struct sadmm_candidates *c, const struct sadmm_collision_input *input, size_t slot, bool renew)
{
    const struct sadmm_shape *shape = slot < input->shape_count ? &input->shapes[slot] : NULL;
    struct sadmm_broad_entry *entry = &c->entries[slot];
    struct sadmm_seen *seen = &c->seen[slot], now = {0};
    const struct sadmm_collision_body *body;
    const struct sadmm_geometry *geometry;
    struct sadmm_error refusal;
    unsigned char kind;
    bool plane, same;

    if (!shape || !shape->alive) {
        const bool was_plane = seen->alive && !entry->present;
        c->state[slot] = (unsigned char)((seen->alive ? SLOT_LEFT : 0) | (was_plane ? SLOT_PLANE : 0));
        entry->present = false;
        *seen = now;
        return;
    }
    body = &input->bodies[shape->body];
    now.revision = shape->revision;
    now.body = shape->body;
    now.group = body->environment;
    now.alive = true;
    now.moves = body->system_body >= 0;
    same = seen->alive && seen->revision == now.revision && seen->body == now.body && seen->group == now.group &&
           seen->moves == now.moves && !renew;
    if (!same && sadmm_collision_check_shape(input, slot, &refusal) != SADMM_OK) {
        c->state[slot] = SLOT_REFUSED;
        return;
    }
    geometry = &input->geometries[shape->geometry];
    plane = geometry->type == SADMM_SHAPE_PLANE;
    kind = plane ? SLOT_PRESENT | SLOT_PLANE : SLOT_PRESENT;
    proxy_place(shape, geometry, body, input->dt, input->margin, input->gravity, &c->proxies[slot],
                &c->boxes[slot].box);
    c->boxes[slot].of_plane = plane;
    if (!plane) swept_box_make(c->proxies[slot].velocity, input->dt, &c->boxes[slot]);
    c->state[slot] = kind;
    if (same && (plane ? plane_stays(entry, &c->proxies[slot])
                       : stays(entry, &c->boxes[slot].box, &c->proxies[slot], input)))
        return;
    c->state[slot] = (unsigned char)(kind | SLOT_LEFT);
    *seen = now;
    entry->present = !plane;
    entry->group = now.group;
    entry->moves = now.moves;
    if (plane) {
        for (int k = 0; k < 3; ++k) {
            entry->box.lo[k] = c->proxies[slot].x[k];
            entry->box.hi[k] = c->proxies[slot].R[3 * k + 2];
        }
    } else {
        enlarge(&c->boxes[slot].box, &c->proxies[slot], input, &entry->box);
    }
}

struct slot_update {
    struct sadmm_candidates *candidates;
    const struct sadmm_collision_input *input;
    bool renew;
};

static void update_share(void *argument, int thread, int threads)
{
    const struct slot_update *update = (const struct slot_update *)argument;
    size_t begin, end;
    sadmm_share(update->candidates->slot_count, thread, threads, &begin, &end);
    for (size_t slot = begin; slot < end; ++slot) update_slot(update->candidates, update->input, slot, update->renew);
}

/* Things that do not change while the shapes stay what they are. */
static bool may_meet(const struct sadmm_collision_input *input, uint32_t a, uint32_t b)
{
    const struct sadmm_shape *sa = &input->shapes[a], *sb = &input->shapes[b];
    return sa->body != sb->body && (sa->category & sb->mask) && (sb->category & sa->mask);
}

static uint64_t ordered(const struct sadmm_candidates *c, uint64_t key)
{
    uint32_t low = (uint32_t)(key >> 32), high = (uint32_t)key;
    return c->proxies[high].geometry.type < c->proxies[low].geometry.type ? ordered_key(high, low) : key;
}

/* Keys to order (slot of a, slot of b); slots need few bits, so squeeze them together for the sort. */
static bool sort_pairs(struct sadmm_pair_list *list, struct sadmm_pair_list *scratch, size_t slots)
{
    int bits = bits_of(slots);
    uint64_t mask = (UINT64_C(1) << bits) - 1;
    if (!sadmm_grow(&scratch->keys, &scratch->capacity, 0, list->count, sizeof *scratch->keys)) return false;
    for (size_t i = 0; i < list->count; ++i)
        list->keys[i] = (list->keys[i] >> 32) << bits | (list->keys[i] & UINT32_MAX);
    sadmm_radix_sort(list->keys, scratch->keys, list->count, 2 * bits);
    for (size_t i = 0; i < list->count; ++i)
        list->keys[i] = (list->keys[i] >> bits) << 32 | (list->keys[i] & mask);
    return true;
}

/* What moves, by (group, slot). */
static void list_movers(struct sadmm_candidates *c)
{
    c->mover_count = 0;
    int bits = 0;
    for (size_t slot = 0; slot < c->slot_count; ++slot) {
        const struct sadmm_broad_entry *e = &c->entries[slot];
        if (!e->present || !e->moves || e->group < 0) continue;
        c->movers[c->mover_count++] = ordered_key((uint32_t)e->group, (uint32_t)slot);
        if (bits_of((uint64_t)e->group) > bits) bits = bits_of((uint64_t)e->group);
    }
    /* slots ascend already: the sort is stable, but it looks at whole keys */
    sadmm_radix_sort(c->movers, c->movers + c->mover_count, c->mover_count, 32 + bits);
}

static size_t first_mover(const struct sadmm_candidates *c, uint64_t key)
{
    return (size_t)lower_bound(c->movers, (int64_t)c->mover_count, key);
}

/* Planes against what moves, all of it or, when few moved, that. */
static bool plane_pairs(struct sadmm_candidates *c, const struct sadmm_collision_input *input, bool only_changed)
{
    for (size_t p = 0; p < c->plane_count; ++p) {
        uint32_t plane = c->planes[p];
        int32_t group = c->entries[plane].group;
        size_t i = 0, end = only_changed ? c->changed_count : c->mover_count;
        if (!only_changed && group >= 0) {
            i = first_mover(c, ordered_key((uint32_t)group, 0));
            end = first_mover(c, ordered_key((uint32_t)group + 1, 0));
        }
        for (; i < end; ++i) {
            uint32_t slot = only_changed ? c->changed[i] : (uint32_t)c->movers[i];
            const struct sadmm_broad_entry *e = &c->entries[slot];
            if (!e->present || !e->moves || (group >= 0 && e->group != group)) continue;
            if (proxy_plane_meets(&c->proxies[plane], &e->box,
                                  proxy_plane_reach(&c->proxies[slot], input->margin, c->gravity_fall)) &&
                !sadmm_pair_list_add(&c->found, plane, slot))
                return false;
        }
    }
    return true;
}

/* Drop what may not meet, order, sort and, where pairs may come twice, make unique. */
static bool finish_found(struct sadmm_candidates *c, const struct sadmm_collision_input *input)
{
    size_t n = 0;
    for (size_t i = 0; i < c->found.count; ++i) {
        uint64_t key = c->found.keys[i];
        if (may_meet(input, (uint32_t)(key >> 32), (uint32_t)key)) c->found.keys[n++] = ordered(c, key);
    }
    c->found.count = n;
    if (!sort_pairs(&c->found, &c->merged, c->slot_count)) return false;
    n = 0;
    for (size_t i = 0; i < c->found.count; ++i)
        if (n == 0 || c->found.keys[n - 1] != c->found.keys[i]) c->found.keys[n++] = c->found.keys[i];
    c->found.count = n;
    return true;
}

/* list = (list without the pairs of what left its box) merged with found. */
static bool merge_found(struct sadmm_candidates *c)
{
    size_t i = 0, j = 0, n = 0;
    struct sadmm_pair_list swap;
    if (!sadmm_grow(&c->merged.keys, &c->merged.capacity, 0, c->list.count + c->found.count, sizeof *c->merged.keys))
        return false;
    for (; i < c->list.count; ++i) {
        uint64_t key = c->list.keys[i];
        if ((c->state[key >> 32] | c->state[key & UINT32_MAX]) & SLOT_LEFT) continue;
        while (j < c->found.count && c->found.keys[j] < key) c->merged.keys[n++] = c->found.keys[j++];
        c->merged.keys[n++] = key;
    }
    while (j < c->found.count) c->merged.keys[n++] = c->found.keys[j++];
    c->merged.count = n;
    swap = c->list;
    c->list = c->merged;
    c->merged = swap;
    return true;
}

static sadmm_status refresh_list(struct sadmm_candidates *c, const struct sadmm_collision_input *input, bool one_by_one,
                                 struct sadmm_error *error)
{
    sadmm_status status;
    c->found.count = 0;
    if (one_by_one) {
        status = c->kind->pairs_of(c->broad_phase, c->entries, c->slot_count, c->changed, c->changed_count, &c->found,
                                   error);
    } else {
        c->list.count = 0;
        status = c->kind->pairs(c->broad_phase, c->entries, c->slot_count, &c->found, error);
        if (c->plane_count > 0) list_movers(c);
    }
    if (status != SADMM_OK) return status;
    if (!plane_pairs(c, input, one_by_one) || !finish_found(c, input) || !merge_found(c))
        return sadmm_fail_memory(error, "candidate pairs");
    return SADMM_OK;
}

sadmm_status sadmm_candidates_update(struct sadmm_candidates *c, const struct sadmm_collision_input *input, int threads,
                                     struct sadmm_error *error)
{
    /* Slots never go away; should a caller drop some, they count as dead. */
    size_t slots = input->shape_count > c->slot_count ? input->shape_count : c->slot_count, present = 0;
    const double gravity_fall = fall_of(input->gravity, input->dt);
    /* Planes have no box that could leave a larger one: what they reach must not grow unnoticed. */
    bool renew = !c->broad_phase_valid || !(c->margin == input->margin) || gravity_fall > c->gravity_fall;
    bool one_by_one, plane_changed = false;
    sadmm_status status;

    if (!reserve_slots(c, slots)) return sadmm_fail_memory(error, "collision shapes");
    if (slots > c->slot_count) {
        memset(c->entries + c->slot_count, 0, (slots - c->slot_count) * sizeof *c->entries);
        memset(c->seen + c->slot_count, 0, (slots - c->slot_count) * sizeof *c->seen);
    }
    c->slot_count = slots;

    struct slot_update update = {c, input, renew};
    sadmm_parallel(input->team, threads, update_share, &update);

    c->changed_count = c->plane_count = 0;
    for (size_t slot = 0; slot < slots; ++slot) {
        const bool plane = c->state[slot] & SLOT_PLANE;
        if (c->state[slot] & SLOT_REFUSED) {
            c->broad_phase_valid = c->list_valid = false;
            return sadmm_collision_check_shape(input, slot, error);
        }
        if (c->state[slot] & SLOT_PRESENT) {
            if (plane) c->planes[c->plane_count++] = (uint32_t)slot;
            else ++present;
        }
        if (!(c->state[slot] & SLOT_LEFT)) continue;
        plane_changed = plane_changed || plane;
        c->changed[c->changed_count++] = (uint32_t)slot;
    }
    if (c->changed_count == 0 && c->list_valid && !renew) return SADMM_OK;

    one_by_one =
        c->list_valid && !renew && !plane_changed && c->kind->pairs_of && c->changed_count * ONE_BY_ONE < present;
    c->broad_phase_valid = c->list_valid = false;
    c->margin = input->margin;
    if (renew) c->gravity_fall = gravity_fall;
    status = c->kind->update(c->broad_phase, c->entries, slots, c->changed, c->changed_count, error);
    if (status != SADMM_OK) return status;
    c->broad_phase_valid = true;
    status = refresh_list(c, input, one_by_one, error);
    c->list_valid = status == SADMM_OK;
    return status;
}
