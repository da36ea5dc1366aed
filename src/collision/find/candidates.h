/* From shapes and bodies to the list of pairs worth a narrow phase.
 *
 * Every step each shape gets its pose, its box for this step (bounds.h) and the numbers the narrow phase needs. The
 * broad phase works on larger boxes that are kept until a shape's own box leaves them: as long as nothing leaves, the
 * list of the last step is still complete and the broad phase does not run at all; when little moved, only that is
 * asked for. The list may therefore hold more pairs than overlap at present. The narrow phase asks
 * sadmm_candidate_meets, which uses this step's boxes alone: results depend on the present state and never on the
 * history of the larger boxes.
 */
#ifndef SADMM_COLLISION_FIND_CANDIDATES_H
#define SADMM_COLLISION_FIND_CANDIDATES_H

#include "collision/base/keys.h"
#include "collision/broad/broad_phase.h"
#include "collision/broad/swept_box.h"
#include "collision/shapes/input.h"
#include "collision/shapes/proxy.h"
#include "seams.h"

/* What decides whether a shape's entry in the broad phase is still the same. Planes have no entry. */
struct sadmm_seen {
    uint32_t revision, formed;
    int32_t body, group;
    bool alive, moves;
    bool still;      /* on a body that does not move; */
    uint32_t placed; /* where that is */
};

/* What became of a slot. */
enum {
    SLOT_PRESENT = 1,
    SLOT_LEFT = 2, /* its box left the larger one, or the entry changed */
    SLOT_PLANE = 4,
    SLOT_REFUSED = 8, /* sadmm_collision_check_shape says why */
    SLOT_SEAMS = 16   /* its neighbours may be others (seams.h) */
};

struct sadmm_collision_kernels;

struct sadmm_candidates {
    const struct sadmm_collision_kernels *kernels; /* of the machine's instruction set */
    const struct sadmm_broad_phase_kind *kind;
    struct sadmm_broad_phase *broad_phase;
    bool broad_phase_valid; /* it holds every present entry */
    bool few;               /* shapes: entries are held against each other, and the broad phase holds none */
    bool list_valid;
    double margin; /* of the last update */
    double gravity_fall; /* the list holds every pair with a plane up to this fall by gravity, m */

    /* by shape slot */
    struct sadmm_proxy *proxies;
    struct sadmm_swept_box *boxes;
    struct sadmm_broad_entry *entries;
    struct sadmm_seen *seen;
    unsigned char *state; /* SLOT_ flags of the step */
    size_t slot_count;

    uint32_t *changed;
    size_t changed_count;
    uint64_t *movers; /* (group << 32) | slot of what moves, sorted: planes look up their group here */
    size_t mover_count;
    uint32_t *planes;
    size_t plane_count;

    /* (slot of a << 32) | slot of b, sorted; a: lower (type, slot) */
    struct sadmm_pair_list list;
    struct sadmm_pair_list found, merged;

    struct sadmm_seams seams;
    bool seams_valid;
};

/* Things that do not change while the shapes stay what they are. */
static inline bool sadmm_pair_may_meet(const struct sadmm_collision_input *input, uint32_t a, uint32_t b)
{
    const struct sadmm_shape *sa = &input->shapes[a], *sb = &input->shapes[b];
    return sa->body != sb->body && (sa->category & sb->mask) && (sb->category & sa->mask);
}

/* Of two bodies that do not meet by the caller's will. */
static inline bool sadmm_pair_is_disabled(const struct sadmm_collision_input *input, uint64_t shapes)
{
    const struct sadmm_shape *a = &input->shapes[shapes >> 32], *b = &input->shapes[shapes & UINT32_MAX];
    return input->disabled_body_pair_count &&
           find_key(input->disabled_body_pairs, (int64_t)input->disabled_body_pair_count,
                    unordered_key((uint32_t)a->body, (uint32_t)b->body)) >= 0;
}

/* Two slots as a pair: the lower (type, slot) first. */
static inline uint64_t sadmm_pair_in_order(const struct sadmm_candidates *c, uint64_t key)
{
    const uint32_t low = (uint32_t)(key >> 32), high = (uint32_t)key;
    const int rank_low = geometry_rank(c->proxies[low].geometry.type),
              rank_high = geometry_rank(c->proxies[high].geometry.type);
    return rank_high < rank_low ? ordered_key(high, low) : key;
}

/* Do the two shapes of a pair in the list come together within this step, as far as their boxes show (bounds.h)? */
SADMM_INLINE bool sadmm_candidate_meets(const struct sadmm_candidates *c, const struct sadmm_collision_input *input,
                                        uint32_t a, uint32_t b)
{
    if (c->boxes[a].of_plane)
        return proxy_plane_meets(&c->proxies[a], &c->boxes[b].box,
                                 proxy_plane_reach(&c->proxies[b], input->margin, fall_of(input->gravity, input->dt)));
    return swept_boxes_meet(&c->boxes[a], &c->boxes[b]);
}

#endif
