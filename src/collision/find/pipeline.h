/* The insides of struct sadmm_collision, for collision.c and the tests. */
#ifndef SADMM_COLLISION_FIND_PIPELINE_H
#define SADMM_COLLISION_FIND_PIPELINE_H

#include "box_row.h"
#include "candidates.h"

struct sadmm_collision {
    struct sadmm_candidates candidates;
    /* The set before the last find, to undo it; the next find writes here. Finds again write to `between`, from the
     * set that they replace. */
    struct sadmm_contact_set spare, between;
    bool can_undo;
    bool has_candidates; /* the candidates are those of the next find */
    struct sadmm_box_row row; /* of their boxes, made when it is asked for (swept_bodies.h) */
    /* One a thread beyond the first; its first thread writes to the new set itself. */
    struct sadmm_contact_set *parts;
    size_t part_count;
};

#endif
