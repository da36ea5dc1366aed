/* Boxes in a row along an axis, by where they begin: those that another box meets are near each other there. */
#ifndef SADMM_COLLISION_FIND_BOX_ROW_H
#define SADMM_COLLISION_FIND_BOX_ROW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "collision/base/bounds.h"

struct sadmm_candidates;

struct sadmm_box_row {
    bool made;
    int axis;
    double widest;      /* of those in the row, along the axis, m */
    uint64_t *keys;     /* (where it begins, rounded down << 32) | slot, sorted; then room to sort them */
    uint32_t *beside;   /* slots that are tested one by one: planes, what is much wider than most, what was moved */
    unsigned char *out; /* by slot: it is beside */
    size_t count, beside_count;
};

void sadmm_box_row_free(struct sadmm_box_row *row);

/* Of the shapes that are present. False: out of memory. */
bool sadmm_box_row_make(struct sadmm_box_row *row, const struct sadmm_candidates *c);

/* A shape in it has another box from now on. */
void sadmm_box_row_move(struct sadmm_box_row *row, uint32_t slot);

/* The part [first, last) of the row in which boxes may meet this one, beside what is beside. */
void sadmm_box_row_find(const struct sadmm_box_row *row, const struct sadmm_box3 *box, size_t *first, size_t *last);

#endif
