/* Which slots of an array are taken: ids stay valid while slots are reused. A bit a slot, and a tree of sums over words
 * of them (Fenwick's), so that the lowest free slot, the slot of an index and the index of a slot are O(log n),
 * wherever slots come and go. */
#ifndef SADMM_WORLD_STATE_SLOTS_H
#define SADMM_WORLD_STATE_SLOTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* All 0: none is taken. */
struct sadmm_slot_set {
    uint64_t *bits;
    uint32_t *sums;     /* sums[i], i >= 1: taken slots in the words [i - (lowest bit of i), i) */
    size_t words;       /* a power of two, or 0 */
};

/* Room for `slots` slots; false, with nothing changed, when memory runs out. */
bool sadmm_slots_reserve(struct sadmm_slot_set *set, size_t slots);
/* There is room for it; it was free; it was taken. */
void sadmm_slots_take(struct sadmm_slot_set *set, size_t slot);
void sadmm_slots_release(struct sadmm_slot_set *set, size_t slot);
/* The lowest one that is free: there may be no room for it yet. */
size_t sadmm_slots_free(const struct sadmm_slot_set *set);
/* The index-th one that is taken, where there is one. */
size_t sadmm_slots_at(const struct sadmm_slot_set *set, int32_t index);
/* How many are taken below a slot that there is room for. */
int32_t sadmm_slots_index(const struct sadmm_slot_set *set, size_t slot);
void sadmm_slots_destroy(struct sadmm_slot_set *set);

#endif
