#include "slots.h"

#include <string.h>

#include "core/base/memory.h"

enum { BITS = 64 };

static uint32_t ones(uint64_t word)
{
    word -= word >> 1 & UINT64_C(0x5555555555555555);
    word = (word & UINT64_C(0x3333333333333333)) + (word >> 2 & UINT64_C(0x3333333333333333));
    return (uint32_t)(((word + (word >> 4)) & UINT64_C(0x0f0f0f0f0f0f0f0f)) * UINT64_C(0x0101010101010101) >> 56);
}

/* Of the index-th one of a word. */
static uint32_t place_of(uint64_t word, uint32_t index)
{
    for (; index > 0; --index) word &= word - 1;
    return ones((word & (~word + 1)) - 1);
}

bool sadmm_slots_reserve(struct sadmm_slot_set *set, size_t slots)
{
    size_t words = set->words ? set->words : 1;
    while (words * BITS < slots) words *= 2;
    if (words == set->words) return true;
    if (!SADMM_GROW(set->bits, set->words, words) || !SADMM_GROW(set->sums, set->words ? set->words + 1 : 0, words + 1))
        return false;
    /* what is new is empty, but for the sums from the first word on */
    for (size_t i = 2 * set->words; set->words && i <= words; i *= 2) set->sums[i] = set->sums[set->words];
    set->words = words;
    return true;
}

static void add(struct sadmm_slot_set *set, size_t slot, uint32_t change)
{
    for (size_t i = slot / BITS + 1; i <= set->words; i += i & (~i + 1)) set->sums[i] += change;
}

void sadmm_slots_take(struct sadmm_slot_set *set, size_t slot)
{
    set->bits[slot / BITS] |= UINT64_C(1) << slot % BITS;
    add(set, slot, 1);
}

void sadmm_slots_release(struct sadmm_slot_set *set, size_t slot)
{
    set->bits[slot / BITS] &= ~(UINT64_C(1) << slot % BITS);
    add(set, slot, UINT32_MAX);
}

size_t sadmm_slots_free(const struct sadmm_slot_set *set)
{
    size_t word = 0;
    for (size_t step = set->words; step > 0; step /= 2)
        if (word + step <= set->words && set->sums[word + step] == step * BITS) word += step;
    return word * BITS + (word < set->words ? place_of(~set->bits[word], 0) : 0);
}

size_t sadmm_slots_at(const struct sadmm_slot_set *set, int32_t index)
{
    size_t word = 0;
    uint32_t left = (uint32_t)index;
    for (size_t step = set->words; step > 0; step /= 2)
        if (word + step <= set->words && set->sums[word + step] <= left) left -= set->sums[word += step];
    return word * BITS + place_of(set->bits[word], left);
}

int32_t sadmm_slots_index(const struct sadmm_slot_set *set, size_t slot)
{
    uint32_t count = ones(set->bits[slot / BITS] & ((UINT64_C(1) << slot % BITS) - 1));
    for (size_t i = slot / BITS; i > 0; i &= i - 1) count += set->sums[i];
    return (int32_t)count;
}

void sadmm_slots_destroy(struct sadmm_slot_set *set)
{
    sadmm_free(set->bits);
    sadmm_free(set->sums);
    memset(set, 0, sizeof *set);
}
