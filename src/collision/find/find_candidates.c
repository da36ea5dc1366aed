#include "find_candidates.h"

#include <string.h>

#include "check_shape.h"
#include "collision/base/keys.h"
#include "collision/base/radix_sort.h"
#include "collision/shapes/geometry.h"
#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "variants.h"

/* Ask the broad phase for single shapes up to one in so many: a query costs as much as some ten of a sweep over all. */
enum { ONE_BY_ONE = 8 };
/* So many shapes are held against each other: all pairs take less than a broad phase does to update them. */
enum { FEW_SHAPES = 32 };

sadmm_status sadmm_candidates_init(struct sadmm_candidates *c, const struct sadmm_broad_phase_kind *kind,
                                   struct sadmm_error *error)
{
    memset(c, 0, sizeof *c);
    c->kind = kind;
    c->kernels = sadmm_collision_kernels_at(0);
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
    sadmm_seams_free(&c->seams);
    memset(c, 0, sizeof *c);
}

static bool reserve_slots(struct sadmm_candidates *c, size_t slots)
{
    /* entries and seen remember the last step */
    return SADMM_GROW(c->proxies, 0, slots) && SADMM_GROW(c->boxes, 0, slots) &&
           SADMM_GROW(c->entries, c->slot_count, slots) && SADMM_GROW(c->seen, c->slot_count, slots) &&
           SADMM_GROW(c->state, 0, slots) && SADMM_GROW(c->changed, 0, slots) && SADMM_GROW(c->movers, 0, 2 * slots) &&
           SADMM_GROW(c->planes, 0, slots);
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
    update->candidates->kernels->place_slots(update->candidates, update->input, begin, end, update->renew);
}

/* Keys to order (slot of a, slot of b); slots need few bits, so squeeze them together for the sort. */
static bool sort_pairs(struct sadmm_pair_list *list, struct sadmm_pair_list *scratch, size_t slots)
{
    int bits = bits_of(slots);
    uint64_t mask = (UINT64_C(1) << bits) - 1;
    if (!SADMM_GROW(scratch->keys, 0, list->count)) return false;
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
    /* slots ascend already: the sort is stable, but it compares whole keys */
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
        if (sadmm_pair_may_meet(input, (uint32_t)(key >> 32), (uint32_t)key))
            c->found.keys[n++] = sadmm_pair_in_order(c, key);
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
    if (!SADMM_GROW(c->merged.keys, 0, c->list.count + c->found.count)) return false;
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

/* What a broad phase reports (broad_phase.h): all pairs, or those of slots that have changed. */
static bool pairs_of_few(struct sadmm_candidates *c, bool only_changed)
{
    uint32_t slots[FEW_SHAPES];
    bool changed[FEW_SHAPES] = {false};
    size_t count = 0;
    for (size_t i = 0; only_changed && i < c->changed_count; ++i) changed[c->changed[i]] = true;
    for (size_t slot = 0; slot < c->slot_count; ++slot)
        if (c->entries[slot].present) slots[count++] = (uint32_t)slot;
    for (size_t i = 0; i < count; ++i) {
        const struct sadmm_broad_entry *a = &c->entries[slots[i]];
        const bool own = !only_changed || changed[slots[i]];
        for (size_t j = own ? 0 : count; j < count; ++j) {
            const struct sadmm_broad_entry *b = &c->entries[slots[j]];
            if (j <= i && (j == i || !only_changed || changed[slots[j]])) continue; /* once */
            if (!boxes_overlap(&a->box, &b->box) || !(a->moves || b->moves)) continue;
            if (a->group != b->group && a->group >= 0 && b->group >= 0) continue;
            if (!sadmm_pair_list_add(&c->found, slots[i], slots[j])) return false;
        }
    }
    return true;
}

static sadmm_status update_list(struct sadmm_candidates *c, const struct sadmm_collision_input *input, bool one_by_one,
                                struct sadmm_error *error)
{
    sadmm_status status;
    c->found.count = 0;
    if (c->few) {
        if (!one_by_one) c->list.count = 0;
        if (!pairs_of_few(c, one_by_one)) return sadmm_fail_memory(error, "candidate pairs");
        if (c->plane_count > 0 && !one_by_one) list_movers(c);
        status = SADMM_OK;
    } else if (one_by_one) {
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
    const bool few = slots <= FEW_SHAPES;
    bool renew = !c->broad_phase_valid || few != c->few || !(c->margin == input->margin) ||
                 gravity_fall > c->gravity_fall;
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
        if (c->state[slot] & SLOT_SEAMS) c->seams_valid = false;
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
    if (!sadmm_seams_find(&c->seams, input, !c->seams_valid)) {
        c->seams_valid = c->broad_phase_valid = c->list_valid = false; /* what has left its box is not listed yet */
        return sadmm_fail_memory(error, "neighbours of shapes");
    }
    c->seams_valid = true;
    if (c->changed_count == 0 && c->list_valid && !renew) return SADMM_OK;

    one_by_one = c->list_valid && !renew && !plane_changed &&
                 (few || (c->kind->pairs_of && c->changed_count * ONE_BY_ONE < present));
    c->broad_phase_valid = c->list_valid = false;
    c->few = few;
    c->margin = input->margin;
    if (renew) c->gravity_fall = gravity_fall;
    if (!few) TRY(c->kind->update(c->broad_phase, c->entries, slots, c->changed, c->changed_count, error));
    c->broad_phase_valid = true;
    status = update_list(c, input, one_by_one, error);
    c->list_valid = status == SADMM_OK;
    return status;
}
