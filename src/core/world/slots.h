/* Slots of bodies and shapes: ids stay valid while slots are reused, and no search walks over all of them. */
#ifndef SADMM_CORE_WORLD_SLOTS_H
#define SADMM_CORE_WORLD_SLOTS_H

#include <stdbool.h>
#include <stddef.h>

#include "subadmm/world.h"

/* Where to begin looking among the slots of an array, so that no call walks over all of them. */
struct sadmm_slot_marks {
    size_t free;   /* no slot below is free */
    size_t at;     /* any slot, */
    int32_t below; /* and how many live ones are below it */
};

/* The lowest free slot, where there is one; sadmm_slot_taken says that it is free no more. `alive` tells of one
 * slot. */
size_t sadmm_slot_free(struct sadmm_slot_marks *marks, const sadmm_world *world,
                       bool (*alive)(const sadmm_world *world, size_t slot));
/* The slot of the index-th live one, where there is one. */
size_t sadmm_slot_at(struct sadmm_slot_marks *marks, int32_t index, const sadmm_world *world,
                     bool (*alive)(const sadmm_world *world, size_t slot));
/* How many live ones are below a slot. */
int32_t sadmm_slot_index(struct sadmm_slot_marks *marks, size_t slot, const sadmm_world *world,
                         bool (*alive)(const sadmm_world *world, size_t slot));
void sadmm_slot_taken(struct sadmm_slot_marks *marks, size_t slot);
void sadmm_slot_freed(struct sadmm_slot_marks *marks, size_t slot);

#endif
