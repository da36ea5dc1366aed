#include "id_pool.h"

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

bool sadmm_ids_reserve(struct sadmm_id_pool *pool, size_t slots)
{
    size_t words = pool->words ? pool->words : 1;
    while (words * BITS < slots) words *= 2;
    if (!SADMM_GROW(pool->generations, pool->slots, slots)) return false;
    if (words == pool->words) return true;
    if (!SADMM_GROW(pool->bits, pool->words, words) ||
        !SADMM_GROW(pool->sums, pool->words ? pool->words + 1 : 0, words + 1))
        return false;
    /* what is new is empty, but for the sums from the first word on */
    for (size_t i = 2 * pool->words; pool->words && i <= words; i *= 2) pool->sums[i] = pool->sums[pool->words];
    pool->words = words;
    return true;
}

static size_t lowest_free(const struct sadmm_id_pool *pool)
{
    size_t word = 0;
    for (size_t step = pool->words; step > 0; step /= 2)
        if (word + step <= pool->words && pool->sums[word + step] == step * BITS) word += step;
    return word * BITS + (word < pool->words ? place_of(~pool->bits[word], 0) : 0);
}

sadmm_status sadmm_ids_next(struct sadmm_id_pool *pool, size_t *slot, struct sadmm_error *error)
{
    *slot = lowest_free(pool);
    if (*slot >> pool->most)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%d %s: a world holds at most 2^%d", pool->count, pool->objects,
                          pool->most);
    if (sadmm_ids_reserve(pool, *slot + 1)) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_OUT_OF_MEMORY, "out of memory for a %s", pool->object);
}

static void add(struct sadmm_id_pool *pool, size_t slot, uint32_t change)
{
    pool->bits[slot / BITS] ^= UINT64_C(1) << slot % BITS;
    for (size_t i = slot / BITS + 1; i <= pool->words; i += i & (~i + 1)) pool->sums[i] += change;
}

void sadmm_ids_take(struct sadmm_id_pool *pool, size_t slot)
{
    add(pool, slot, 1);
    ++pool->count;
    for (; pool->slots <= slot; ++pool->slots) pool->generations[pool->slots] = 1;
}

void sadmm_ids_release(struct sadmm_id_pool *pool, size_t slot)
{
    add(pool, slot, UINT32_MAX);
    --pool->count;
    uint32_t *generation = &pool->generations[slot];
    *generation = *generation < UINT32_MAX ? *generation + 1 : 1;
    sadmm_tags_clear(&pool->tags, slot);
}

sadmm_status sadmm_ids_check(const struct sadmm_id_pool *pool, uint32_t number, uint32_t generation,
                             const char *argument, struct sadmm_error *error)
{
    const size_t slot = (size_t)number - 1; /* SIZE_MAX: of no object */
    if (sadmm_ids_has(pool, slot) && pool->generations[slot] == generation) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_STALE_ID, "%s = (slot %u, generation %u): no such %s (any more)", argument,
                      number, generation, pool->object);
}

size_t sadmm_ids_from(const struct sadmm_id_pool *pool, size_t slot)
{
    if (slot >= pool->slots) return pool->slots;
    size_t word = slot / BITS;
    uint64_t left = pool->bits[word] >> slot % BITS << slot % BITS;
    while (left == 0 && ++word * BITS < pool->slots) left = pool->bits[word];
    return left ? word * BITS + place_of(left, 0) : pool->slots;
}

size_t sadmm_ids_at(const struct sadmm_id_pool *pool, int32_t index)
{
    size_t word = 0;
    uint32_t left = (uint32_t)index;
    for (size_t step = pool->words; step > 0; step /= 2)
        if (word + step <= pool->words && pool->sums[word + step] <= left) left -= pool->sums[word += step];
    return word * BITS + place_of(pool->bits[word], left);
}

int32_t sadmm_ids_index(const struct sadmm_id_pool *pool, size_t slot)
{
    uint32_t count = ones(pool->bits[slot / BITS] & ((UINT64_C(1) << slot % BITS) - 1));
    for (size_t i = slot / BITS; i > 0; i &= i - 1) count += pool->sums[i];
    return (int32_t)count;
}

void sadmm_ids_free(struct sadmm_id_pool *pool)
{
    sadmm_tags_free(&pool->tags);
    sadmm_free(pool->generations);
    sadmm_free(pool->bits);
    sadmm_free(pool->sums);
    pool->generations = NULL;
    pool->bits = NULL;
    pool->sums = NULL;
    pool->slots = pool->words = 0;
    pool->count = 0;
}
