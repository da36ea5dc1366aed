#include "swept_bodies.h"

#include <float.h>

#include "collision/find/contact_emit.h"
#include "collision/find/pipeline.h"
#include "fast_pair.h"
#include "swept_body.h"

static double mass_of(const struct sadmm_rigid *bodies, const struct sadmm_proxy *shape)
{
    return shape->system_body >= 0 ? bodies[shape->system_body].mass : 0;
}

/* Its first point mostly decides. */
static bool presses(const struct sadmm_contact_set *contacts, const struct sadmm_contact_pair *pair,
                    const struct sadmm_proxy *a, const struct sadmm_proxy *b, const struct sadmm_rigid *bodies)
{
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
        if (swept_body_presses(pair, &contacts->points[k], a, mass_of(bodies, a), b, mass_of(bodies, b))) return true;
    return false;
}

void sadmm_collision_mark_pressed(const struct sadmm_collision *collision, const struct sadmm_contact_set *contacts,
                                  const struct sadmm_rigid *bodies, unsigned char *kinds)
{
    const struct sadmm_candidates *c = &collision->candidates;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        if ((size_t)pair->shape_a >= c->slot_count || (size_t)pair->shape_b >= c->slot_count ||
            !(c->state[pair->shape_a] & c->state[pair->shape_b] & SLOT_PRESENT))
            continue;
        const struct sadmm_proxy *a = &c->proxies[pair->shape_a], *b = &c->proxies[pair->shape_b];
        unsigned char *of_a = &kinds[a->body], *of_b = &kinds[b->body];
        if ((*of_a != SADMM_SWEPT_DYNAMIC && *of_b != SADMM_SWEPT_DYNAMIC) ||
            pair->revision != word_of_pair(a->revision, b->revision) || !presses(contacts, pair, a, b, bodies))
            continue;
        if (*of_a == SADMM_SWEPT_DYNAMIC) *of_a = SADMM_SWEPT_NONE;
        if (*of_b == SADMM_SWEPT_DYNAMIC) *of_b = SADMM_SWEPT_NONE;
    }
}

bool sadmm_collision_may_hit(const struct sadmm_collision *collision, const unsigned char *kinds, uint64_t key)
{
    const struct sadmm_candidates *c = &collision->candidates;
    const unsigned char of_a = kinds[c->proxies[key >> 32].body], of_b = kinds[c->proxies[key & UINT32_MAX].body];
    return of_a != SADMM_SWEPT_NONE && of_b != SADMM_SWEPT_NONE &&
           (of_a == SADMM_SWEPT_DYNAMIC || of_b == SADMM_SWEPT_DYNAMIC);
}

bool sadmm_collision_passes(const struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                            uint64_t key)
{
    const struct sadmm_proxy *a = &collision->candidates.proxies[key >> 32],
                             *b = &collision->candidates.proxies[key & UINT32_MAX];
    return pair_passes(a, b, pair_way(a, b, input->gravity, input->dt));
}

/* The longest way that any pair may go, and the least thickness of what moves: most worlds have no pair that is
 * fast. */
struct fastest {
    double way, thin;
};
static struct fastest fastest_of(const struct sadmm_candidates *c, const struct sadmm_collision_input *input)
{
    struct fastest of = {0, HUGE_VAL};
    for (size_t slot = 0; slot < c->slot_count; ++slot) {
        const struct sadmm_proxy *p = &c->proxies[slot];
        if (!(c->state[slot] & SLOT_PRESENT) || !sadmm_body_moves(p->system_body)) continue;
        of.way = max_of(of.way, length3(p->velocity) * input->dt + p->spin + p->fall);
        of.thin = min_of(of.thin, p->thin);
    }
    of.way = (1 + 16 * DBL_EPSILON) * (2 * of.way + fall_of(input->gravity, input->dt));
    return of;
}

bool sadmm_collision_list_fast(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                               double threshold, bool bounces, struct sadmm_pair_list *list)
{
    const struct sadmm_candidates *c = &collision->candidates;
    const struct fastest fastest = fastest_of(c, input);
    const double least = threshold * input->dt;
    const bool any = fastest.way > least && (bounces || fastest.way > fastest.thin);
    list->count = 0;
    for (size_t i = 0; any && i < c->list.count; ++i) {
        const uint64_t key = c->list.keys[i];
        const uint32_t a = (uint32_t)(key >> 32), b = (uint32_t)key;
        if (!pair_is_fast(&c->proxies[a], &c->proxies[b], threshold, input->gravity, input->dt) ||
            !sadmm_candidate_meets(c, input, a, b) || sadmm_pair_is_disabled(input, key))
            continue;
        if (!sadmm_pair_list_add(list, a, b)) return false;
        list->keys[list->count - 1] = key; /* in its order */
    }
    return true;
}

void sadmm_collision_pair_law(const struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                              uint64_t key, double *friction, double *restitution)
{
    const uint32_t slot_a = (uint32_t)(key >> 32), slot_b = (uint32_t)key;
    const struct sadmm_proxy *a = &collision->candidates.proxies[slot_a], *b = &collision->candidates.proxies[slot_b];
    *friction = contact_friction(input->friction_pairs, input->friction_values, (int64_t)input->friction_pair_count,
                                 slot_a, slot_b, a, b);
    *restitution = max_of(a->restitution, b->restitution);
}

bool sadmm_collision_set_box(struct sadmm_collision *collision, uint32_t slot, const struct sadmm_box3 *swept)
{
    if (!collision->row.made && !sadmm_box_row_make(&collision->row, &collision->candidates)) return false;
    collision->candidates.boxes[slot].box = *swept;
    sadmm_box_row_move(&collision->row, slot);
    return true;
}

/* Does its box meet that of another one? */
static bool swept_meet(const struct sadmm_candidates *c, uint32_t slot, uint32_t other)
{
    const struct sadmm_box3 *box = &c->boxes[slot].box;
    return c->boxes[other].of_plane ? proxy_plane_meets(&c->proxies[other], box, 0)
                                    : boxes_overlap(&c->boxes[other].box, box);
}

/* Add the pair, if it is one. */
static bool add_near(const struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                     const unsigned char *kinds, uint32_t slot, uint32_t other, struct sadmm_pair_list *list)
{
    const struct sadmm_candidates *c = &collision->candidates;
    const int32_t group = c->seen[slot].group, of_other = c->seen[other].group;
    if (other == slot || !swept_meet(c, slot, other) || !sadmm_pair_may_meet(input, slot, other) ||
        (group >= 0 && of_other >= 0 && of_other != group))
        return true;
    const uint64_t key = sadmm_pair_in_order(c, unordered_key(slot, other));
    if (!sadmm_collision_may_hit(collision, kinds, key) || sadmm_pair_is_disabled(input, key)) return true;
    if (!sadmm_pair_list_add(list, slot, other)) return false;
    list->keys[list->count - 1] = key;
    return true;
}

bool sadmm_collision_list_near(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                               const unsigned char *kinds, uint32_t slot, struct sadmm_pair_list *list)
{
    const struct sadmm_box_row *row = &collision->row;
    size_t first, last;
    sadmm_box_row_find(row, &collision->candidates.boxes[slot].box, &first, &last);
    for (size_t i = first; i < last; ++i) {
        const uint32_t other = (uint32_t)row->keys[i];
        if (!row->out[other] && !add_near(collision, input, kinds, slot, other, list)) return false;
    }
    for (size_t i = 0; i < row->beside_count; ++i)
        if (!add_near(collision, input, kinds, slot, row->beside[i], list)) return false;
    return true;
}
