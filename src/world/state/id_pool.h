/* Ids of the objects of one kind. An object has a slot for life, and a new one gets the lowest slot that is free. The
 * objects of a slot have generations, 1 and up, so that the ids of those that are gone are stale. After 2^32 - 1
 * objects in the same slot its generations begin again.
 *
 * A bit a slot, and a tree of sums over words of them (Fenwick's), so that the lowest free slot, the slot of an index
 * and the index of a slot are O(log n), wherever objects come and go. */
#ifndef SADMM_WORLD_STATE_ID_POOL_H
#define SADMM_WORLD_STATE_ID_POOL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"
#include "tags.h"

/* All but the first members 0: no objects. */
struct sadmm_id_pool {
    const char *object, *objects; /* as messages call one of them, and several */
    int most;                     /* 2^most slots */
    int32_t count;                /* objects */
    size_t slots;                 /* those that have had an object are below */
    uint32_t *generations;        /* by slot: of its object, or of the next one */
    uint64_t *bits;               /* slots with an object */
    uint32_t *sums;               /* sums[i], i >= 1: objects in the words [i - (lowest bit of i), i) of these */
    size_t words;                 /* a power of two, or 0 */
    struct sadmm_tags tags;       /* names and user data; gone with the object */
};

/* Room for `slots` slots; false, with nothing changed, when memory runs out. */
bool sadmm_ids_reserve(struct sadmm_id_pool *pool, size_t slots);
/* The lowest slot that is free, with room for it in the pool. Errors: LIMIT, OUT_OF_MEMORY; nothing changes. */
sadmm_status sadmm_ids_next(struct sadmm_id_pool *pool, size_t *slot, struct sadmm_error *error);
/* An object comes into a slot that is free and has room; it goes. */
void sadmm_ids_take(struct sadmm_id_pool *pool, size_t slot);
void sadmm_ids_release(struct sadmm_id_pool *pool, size_t slot);

static inline bool sadmm_ids_has(const struct sadmm_id_pool *pool, size_t slot)
{
    return slot < pool->slots && pool->bits[slot / 64] >> slot % 64 & 1;
}

/* Is there an object of this id? `argument` has it, of a caller. Errors: STALE_ID. */
sadmm_status sadmm_ids_check(const struct sadmm_id_pool *pool, uint32_t number, uint32_t generation,
                             const char *argument, struct sadmm_error *error);
/* The first slot with an object, from `slot` on; pool->slots: none. */
size_t sadmm_ids_from(const struct sadmm_id_pool *pool, size_t slot);
/* for (SADMM_OBJECTS(slot, pool)): all slots with an object, in order. */
#define SADMM_OBJECTS(slot, pool)          \
    size_t slot = sadmm_ids_from(pool, 0); \
    slot < (pool)->slots;                  \
    slot = sadmm_ids_from(pool, slot + 1)

/* The slot of the index-th object, index in [0, count); how many objects have lower slots than this one. */
size_t sadmm_ids_at(const struct sadmm_id_pool *pool, int32_t index);
int32_t sadmm_ids_index(const struct sadmm_id_pool *pool, size_t slot);
void sadmm_ids_free(struct sadmm_id_pool *pool);

#endif
