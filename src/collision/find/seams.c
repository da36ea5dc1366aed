/* Neighbours are found by a sweep over boxes, body by body; all that does not move is one body. */
#include "seams.h"

#include <stdlib.h>
#include <string.h>

#include "collision/base/keys.h"
#include "collision/mesh/box_tree.h"
#include "collision/shapes/geometry.h"
#include "core/base/memory.h"

/* A shape that may have neighbours, in the frame of its body, of what does not move in the world. */
struct seam_entry {
    uint64_t group;
    double lo[3], hi[3]; /* with what is flush */
    double R[9], x[3];
    uint32_t slot;
    int32_t environment;
    bool apart; /* its body has a pair that does not meet: it hides nothing of other bodies */
};

void sadmm_seams_free(struct sadmm_seams *seams)
{
    sadmm_free(seams->first);
    sadmm_free(seams->neighbours);
    sadmm_free(seams->entries);
    memset(seams, 0, sizeof *seams);
}

static uint64_t hash_of_disabled(const struct sadmm_collision_input *input)
{
    uint64_t hash = input->disabled_body_pair_count;
    for (size_t i = 0; i < input->disabled_body_pair_count; ++i)
        hash = (hash ^ input->disabled_body_pairs[i]) * UINT64_C(0x9E3779B97F4A7C15) + (hash >> 29);
    return hash;
}

static bool is_static(const struct sadmm_collision_input *input, size_t slot)
{
    return input->bodies[input->shapes[slot].body].system_body == -1;
}

/* Bodies that do not move are one group, above all slots of bodies. */
static uint64_t group_of(const struct sadmm_collision_input *input, size_t slot)
{
    return is_static(input, slot) ? UINT64_C(1) << 32 : (uint64_t)input->shapes[slot].body;
}

static bool is_disabled_body(const struct sadmm_collision_input *input, uint32_t body)
{
    for (size_t i = 0; i < input->disabled_body_pair_count; ++i)
        if (input->disabled_body_pairs[i] >> 32 == body || (input->disabled_body_pairs[i] & UINT32_MAX) == body)
            return true;
    return false;
}

static void place_entry(const struct sadmm_collision_input *input, size_t slot, struct seam_entry *e)
{
    static const double still[4] = {1, 0, 0, 0}, origin[3] = {0, 0, 0};
    const struct sadmm_shape *shape = &input->shapes[slot];
    const struct sadmm_geometry *geometry = &input->geometries[shape->geometry];
    const struct sadmm_collision_body *body = &input->bodies[shape->body];
    const bool fixed = is_static(input, slot);
    const quat turn = q_load(fixed ? body->orientation : still);
    const double *at = fixed ? body->position : origin;
    const mat3 R = q_matrix(q_normalize(q_mul(turn, q_load(shape->orientation))));
    double x[3], extent[3], flush = (double)SEAM_FLUSH * geometry_thickness(geometry);
    if (!(flush < HUGE_VAL)) flush = 0;
    v3_store(m3_mul(q_matrix(turn), v3_load(shape->position)), x);
    for (int i = 0; i < 3; ++i) v3_store(R.r[i], e->R + 3 * i);
    geometry_extents(geometry, e->R, extent);
    for (int k = 0; k < 3; ++k) {
        e->x[k] = at[k] + x[k];
        extent[k] += flush + 8 * DBL_EPSILON * (fabs(e->x[k]) + extent[k]);
        e->lo[k] = e->x[k] - extent[k];
        e->hi[k] = e->x[k] + extent[k];
    }
    e->group = group_of(input, slot);
    e->slot = (uint32_t)slot;
    e->environment = body->environment;
    e->apart = fixed && is_disabled_body(input, (uint32_t)shape->body);
}

static int compare_entries(const void *left, const void *right)
{
    const struct seam_entry *a = (const struct seam_entry *)left, *b = (const struct seam_entry *)right;
    if (a->group != b->group) return a->group < b->group ? -1 : 1;
    if (a->lo[0] != b->lo[0]) return a->lo[0] < b->lo[0] ? -1 : 1;
    return (a->slot > b->slot) - (a->slot < b->slot);
}

/* Of the shapes of bodies that have several. seams->first: room for a count by body, and one for what does not move.
 * -1: out of memory. */
static int64_t list_entries(struct sadmm_seams *seams, const struct sadmm_collision_input *input)
{
    size_t count = 0, fixed = 0;
    uint32_t *shapes_of = seams->first;
    memset(shapes_of, 0, input->body_count * sizeof *shapes_of);
    for (size_t slot = 0; slot < input->shape_count; ++slot) {
        if (!sadmm_shape_collides(&input->shapes[slot])) continue;
        if (is_static(input, slot)) ++fixed;
        else ++shapes_of[input->shapes[slot].body];
    }
    for (size_t pass = 0; pass < 2; ++pass) {
        count = 0;
        for (size_t slot = 0; slot < input->shape_count; ++slot) {
            if (!sadmm_shape_collides(&input->shapes[slot])) continue;
            if ((is_static(input, slot) ? fixed : shapes_of[input->shapes[slot].body]) < 2) continue;
            if (pass == 1) place_entry(input, slot, &seams->entries[count]);
            ++count;
        }
        if (count == 0) return 0;
        if (pass == 0 && !SADMM_GROW(seams->entries, 0, count)) return -1;
    }
    qsort(seams->entries, count, sizeof *seams->entries, compare_entries);
    return (int64_t)count;
}

static const struct sadmm_geometry *geometry_of(const struct sadmm_collision_input *input, const struct seam_entry *e)
{
    return &input->geometries[input->shapes[e->slot].geometry];
}

/* May b hide what a has? What a meets must meet b as well. */
static bool may_hide(const struct sadmm_collision_input *input, const struct seam_entry *a, const struct seam_entry *b)
{
    const struct sadmm_shape *sa = &input->shapes[a->slot], *sb = &input->shapes[b->slot];
    if (geometry_of(input, a)->type == SADMM_SHAPE_PLANE) return false; /* all that is inside of it is hidden */
    if (sa->category != sb->category || sa->mask != sb->mask) return false;
    if (b->environment >= 0 && b->environment != a->environment) return false;
    return sa->body == sb->body || !(a->apart || b->apart);
}

static bool boxes_touch(const struct seam_entry *a, const struct seam_entry *b)
{
    for (int k = 0; k < 3; ++k)
        if (!(a->lo[k] <= b->hi[k] && b->lo[k] <= a->hi[k])) return false;
    return true;
}

/* Is any of the box of e in the plane's half-space? */
static bool plane_touches(const struct seam_entry *plane, const struct seam_entry *e)
{
    double height = 0;
    for (int k = 0; k < 3; ++k) {
        const double n = plane->R[3 * k + 2];
        height += n * ((n > 0 ? e->lo[k] : e->hi[k]) - plane->x[k]);
    }
    return height <= 0;
}

/* The box of b in the frame of a. */
static void box_of_neighbour(const struct sadmm_collision_input *input, const struct seam_entry *a,
                             const struct seam_entry *b, struct seam_neighbour *out)
{
    const struct sadmm_geometry *geometry = geometry_of(input, b);
    const double share = geometry->type == SADMM_SHAPE_MESH ? SEAM_FLUSH + SEAM_BESIDE : (double)SEAM_FLUSH,
                 flush = share * geometry_thickness(geometry_of(input, a));
    struct float_box box;
    double R[9], extent[3];
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
            R[3 * i + k] = 0;
            for (int j = 0; j < 3; ++j) R[3 * i + k] += a->R[3 * j + i] * b->R[3 * j + k];
        }
    geometry_extents(geometry, R, extent);
    for (int i = 0; i < 3; ++i) {
        double at = 0, reach;
        for (int j = 0; j < 3; ++j) at += a->R[3 * j + i] * (b->x[j] - a->x[j]);
        reach = fmin(extent[i] * (1 + 1e-9) + flush + 1e-12 * fabs(at), 1e30); /* rounding */
        float_box_set(at - reach, at + reach, i, &box);
    }
    memcpy(out->lo, box.lo, sizeof out->lo);
    memcpy(out->hi, box.hi, sizeof out->hi);
    out->slot = b->slot;
    out->most = 0;
}

/* b as a neighbour of a. false: out of memory. `owner`, by neighbour: the slot of a, in `most` until all are sorted. */
struct seam_found {
    uint32_t owner;
    struct seam_neighbour neighbour;
};
struct seam_list {
    struct seam_found *found;
    size_t count;
};

static bool add_neighbour(const struct sadmm_collision_input *input, const struct seam_entry *a,
                          const struct seam_entry *b, struct seam_list *list)
{
    if (!may_hide(input, a, b)) return true;
    if (!SADMM_GROW(list->found, list->count, list->count + 1)) return false;
    list->found[list->count].owner = a->slot;
    box_of_neighbour(input, a, b, &list->found[list->count++].neighbour);
    return true;
}

static bool find_pairs(const struct sadmm_collision_input *input, const struct seam_entry *entries, size_t count,
                       struct seam_list *list)
{
    for (size_t i = 0; i < count; ++i) {
        const struct seam_entry *a = &entries[i];
        const bool plane = geometry_of(input, a)->type == SADMM_SHAPE_PLANE; /* begins before all others */
        for (size_t k = i + 1; k < count && entries[k].group == a->group && entries[k].lo[0] <= a->hi[0]; ++k) {
            const struct seam_entry *b = &entries[k];
            if (plane ? !plane_touches(a, b) : !boxes_touch(a, b)) continue;
            if (!add_neighbour(input, a, b, list) || !add_neighbour(input, b, a, list)) return false;
        }
    }
    return true;
}

/* Neighbours lie sorted by their shapes' slots; which axis is that of the two's own, is in `reserved`. */
static int compare_found(const void *left, const void *right)
{
    const struct seam_found *a = (const struct seam_found *)left, *b = (const struct seam_found *)right;
    if (a->owner != b->owner) return a->owner < b->owner ? -1 : 1;
    if (a->neighbour.most != b->neighbour.most) return a->neighbour.most < b->neighbour.most ? -1 : 1;
    return (a->neighbour.slot > b->neighbour.slot) - (a->neighbour.slot < b->neighbour.slot);
}

static bool store_found(struct sadmm_seams *seams, const struct sadmm_collision_input *input, struct seam_list *list)
{
    if (!SADMM_GROW(seams->neighbours, 0, list->count)) return false;
    for (size_t i = 0; i < list->count; ++i) { /* until they are sorted: where they begin */
        const struct sadmm_shape *owner = &input->shapes[list->found[i].owner];
        struct seam_neighbour *n = &list->found[i].neighbour;
        n->most = n->lo[seam_axis(&input->geometries[owner->geometry])];
    }
    qsort(list->found, list->count, sizeof *list->found, compare_found);
    memset(seams->first, 0, (input->shape_count + 1) * sizeof *seams->first);
    for (size_t i = 0; i < list->count; ++i) {
        const uint32_t owner = list->found[i].owner;
        const int axis = seam_axis(&input->geometries[input->shapes[owner].geometry]);
        struct seam_neighbour *n = &seams->neighbours[i];
        *n = list->found[i].neighbour;
        n->most = n->hi[axis];
        if (seams->first[owner + 1] > 0 && n[-1].most > n->most) n->most = n[-1].most;
        ++seams->first[owner + 1];
    }
    for (size_t slot = 0; slot < input->shape_count; ++slot) seams->first[slot + 1] += seams->first[slot];
    seams->neighbour_count = list->count;
    return true;
}

bool sadmm_seams_find(struct sadmm_seams *seams, const struct sadmm_collision_input *input, bool changed)
{
    const uint64_t disabled = hash_of_disabled(input);
    const size_t room = (input->shape_count > input->body_count ? input->shape_count : input->body_count) + 1;
    struct seam_list list = {NULL, 0};
    if (!changed && disabled == seams->disabled && seams->slot_count == input->shape_count) return true;
    seams->neighbour_count = seams->slot_count = 0;
    if (!SADMM_GROW(seams->first, 0, room)) return false;
    const int64_t count = list_entries(seams, input);
    bool made = count >= 0 && find_pairs(input, seams->entries, (size_t)count, &list);
    if (made && list.count > 0) made = store_found(seams, input, &list);
    sadmm_free(list.found);
    if (!made) {
        seams->neighbour_count = 0;
        return false;
    }
    seams->slot_count = input->shape_count;
    seams->disabled = disabled;
    return true;
}
