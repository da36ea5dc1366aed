/* begin: islands of the step, and which of them are floating: those that no static pair is known to anchor
 * (momentum_is_anchored), and in which no bodies roll on each other. Most are anchored, which one of their pairs
 * decides; lists are made for floating ones alone. */
#include "core/base/memory.h"
#include "core/math/momentum.h"
#include "core/model/islands.h"
#include "cpu.h"

/* Of an island, in place of an index. */
enum { UNTOUCHED = -3, ANCHORED = -2, TOUCHED = -1 };

static bool is_static(const struct sadmm_contact_pair *pair) { return pair->body_a < 0 || pair->body_b < 0; }

static bool anchors(const struct sadmm_context *c, const struct sadmm_contact_pair *pair)
{
    const struct sadmm_contact_point *points = &c->system->contacts->points[pair->first];
    struct arm_sums arms = {0};
    if (!is_static(pair)) return sadmm_pair_rolls(pair, points);
    if (pair->count < 3 || !(pair->friction > 0)) return false;
    for (int32_t k = 0; k < pair->count; ++k) add_arm(&arms, pair->body_a >= 0 ? points[k].arm_a : points[k].arm_b, 1);
    return momentum_is_anchored(pair->friction, &arms);
}

static int32_t *island_of(const struct sadmm_context *c, int32_t body_a, int32_t body_b)
{
    return &c->floating_of[c->label[body_a >= 0 ? body_a : body_b]];
}

/* Returns how many static pairs floating islands may have. */
static size_t mark_anchored(struct sadmm_context *c)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    size_t pairs = 0;
    for (int32_t i = 0; i < c->bodies; ++i) c->floating_of[i] = UNTOUCHED;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        int32_t *island = island_of(c, pair->body_a, pair->body_b);
        if (*island == ANCHORED) continue;
        *island = anchors(c, pair) ? ANCHORED : TOUCHED;
        pairs += is_static(pair);
    }
    for (size_t k = 0; k < sadmm_row_constraint_count(c->system); ++k) /* left alone */
        *island_of(c, c->system->rows->constraints[k].body_a, c->system->rows->constraints[k].body_b) = ANCHORED;
    return pairs;
}

/* Counting sorts by island: what there is of each, where it begins, its members. */
static void list_members(struct sadmm_context *c)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    int32_t bodies = 0, pairs = 0;
    for (int32_t i = 0; i < c->bodies; ++i)
        if (c->floating_of[c->label[i]] >= 0) ++c->floating[c->floating_of[c->label[i]]].end_body;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const int32_t island = *island_of(c, contacts->pairs[p].body_a, contacts->pairs[p].body_b);
        if (island >= 0 && is_static(&contacts->pairs[p])) ++c->floating[island].end_pair;
    }
    for (int32_t k = 0; k < c->floating_count; ++k) {
        struct cpu_floating *floating = &c->floating[k];
        const int32_t of_bodies = floating->end_body, of_pairs = floating->end_pair;
        floating->first_body = floating->end_body = bodies;
        floating->first_pair = floating->end_pair = pairs;
        bodies += of_bodies, pairs += of_pairs;
    }
    for (int32_t i = 0; i < c->bodies; ++i)
        if (c->floating_of[c->label[i]] >= 0)
            c->floating_bodies[c->floating[c->floating_of[c->label[i]]].end_body++] = i;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const int32_t island = *island_of(c, contacts->pairs[p].body_a, contacts->pairs[p].body_b);
        if (island >= 0 && is_static(&contacts->pairs[p]))
            c->floating_pairs[c->floating[island].end_pair++] = (int32_t)p;
    }
}

bool CPU(find_islands)(struct sadmm_context *c)
{
    const size_t n = (size_t)c->bodies;
    c->floating_count = 0;
    if (!c->fast && !c->plan.momentum) return true;
    if (!SADMM_GROW(c->label, 0, n)) return false;
    sadmm_islands(c->system, c->label);
    if (!c->plan.momentum) return true;
    if (!SADMM_GROW(c->touch, 0, n) || !SADMM_GROW(c->floating_of, 0, n)) return false;
    const size_t pairs = mark_anchored(c);
    for (size_t i = 0; i < n; ++i)
        if (c->label[i] == (int32_t)i && c->floating_of[i] == TOUCHED) c->floating_of[i] = c->floating_count++;
    if (c->floating_count == 0) return true;
    if (!SADMM_GROW(c->floating, 0, (size_t)c->floating_count) || !SADMM_GROW(c->floating_bodies, 0, n) ||
        !SADMM_GROW(c->floating_pairs, 0, pairs))
        return false;
    for (int32_t k = 0; k < c->floating_count; ++k) c->floating[k].end_body = c->floating[k].end_pair = 0;
    list_members(c);
    return true;
}
