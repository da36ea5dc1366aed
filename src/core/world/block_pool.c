#include "block_pool.h"

#include <string.h>

#include "collision/hull.h"
#include "collision/mesh_data.h"
#include "core/base/memory.h"

/* Of an owner; NULL: it has no block here. */
static struct sadmm_pooled_block *find(const struct sadmm_block_pool *pool, const void *owner)
{
    const double *place = sadmm_key_tree_find(&pool->places, (uintptr_t)owner);
    return place ? &pool->pooled[(size_t)*place] : NULL;
}

/* Room for `end` doubles, and the first blocks. */
static sadmm_status reserve(struct sadmm_block_pool *pool, size_t end, struct sadmm_error *error)
{
    if (!sadmm_grow(&pool->blocks, &pool->block_capacity, pool->doubles, end, sizeof *pool->blocks))
        return sadmm_fail_memory(error, "the hull or mesh of a shape");
    if (pool->doubles == 0) sadmm_hull_prelude(pool->blocks);
    return SADMM_OK;
}

sadmm_status sadmm_block_pool_add(struct sadmm_block_pool *pool, const struct sadmm_block_owner *of, uint32_t *offset,
                                  struct sadmm_error *error)
{
    struct sadmm_pooled_block *pooled = find(pool, of->owner);
    if (!pooled) {
        const size_t begin = pool->doubles > 0 ? pool->doubles : HULL_FIRST_OWN, end = begin + of->doubles;
        if (end > INT32_MAX)
            return sadmm_fail(error, SADMM_ERROR_LIMIT, "hulls and meshes of %zu numbers: a world has room for 2^31",
                              end);
        if (!sadmm_grow(&pool->pooled, &pool->capacity, pool->count, pool->count + 1, sizeof *pool->pooled) ||
            !sadmm_key_tree_reserve(&pool->places))
            return sadmm_fail_memory(error, "the hull or mesh of a shape");
        TRY(reserve(pool, end, error));
        memcpy(pool->blocks + begin, of->block, of->doubles * sizeof *pool->blocks);
        sadmm_key_tree_set(&pool->places, (uintptr_t)of->owner, (double)pool->count);
        pooled = &pool->pooled[pool->count++];
        *pooled = (struct sadmm_pooled_block){.of = *of, .offset = (uint32_t)begin};
        pool->doubles = end;
        ++pool->revision;
        of->retain(of->owner);
    }
    ++pooled->uses;
    *offset = pooled->offset;
    return SADMM_OK;
}

/* ---- blocks that move together ---- */

_Static_assert(offsetof(struct sadmm_mesh_header, doubles) == offsetof(struct sadmm_hull_header, doubles) &&
                   offsetof(struct sadmm_mesh_header, reserved) == offsetof(struct sadmm_hull_header, reserved),
               "blocks of hulls and of meshes are moved alike");

/* While blocks move a header's `reserved` has the offset that its block gets; 0: its owner is gone. Of a mesh the two
 * members that are used are in the same places. */
static struct sadmm_hull_header *header_at(const struct sadmm_block_pool *pool, size_t offset)
{
    return (struct sadmm_hull_header *)(pool->blocks + offset);
}

/* Where blocks are to go; the size of all of them. */
static size_t assign_offsets(struct sadmm_block_pool *pool)
{
    size_t end = HULL_FIRST_OWN;
    for (size_t k = 0; k < pool->count; ++k) header_at(pool, pool->pooled[k].offset)->reserved = 1;
    for (size_t at = HULL_FIRST_OWN; at < pool->doubles; at += (size_t)header_at(pool, at)->doubles) {
        if (header_at(pool, at)->reserved == 0) continue;
        header_at(pool, at)->reserved = (int32_t)end;
        end += (size_t)header_at(pool, at)->doubles;
    }
    return end;
}

static void move_blocks(struct sadmm_block_pool *pool)
{
    size_t size;
    for (size_t at = HULL_FIRST_OWN; at < pool->doubles; at += size) {
        struct sadmm_hull_header *header = header_at(pool, at);
        const size_t to = (size_t)header->reserved;
        size = (size_t)header->doubles;
        header->reserved = 0;
        if (to > 0) memmove(pool->blocks + to, pool->blocks + at, size * sizeof *pool->blocks);
    }
}

static void close_gaps(struct sadmm_block_pool *pool, struct sadmm_geometry *geometries, size_t geometry_count)
{
    const size_t end = pool->count > 0 ? assign_offsets(pool) : pool->holds > 0 ? HULL_FIRST_OWN : 0;
    for (size_t k = 0; k < pool->count; ++k)
        pool->pooled[k].offset = (uint32_t)header_at(pool, pool->pooled[k].offset)->reserved;
    for (size_t k = 0; k < geometry_count && pool->count > 0; ++k)
        if (geometries[k].hull >= HULL_FIRST_OWN)
            geometries[k].hull = (uint32_t)header_at(pool, geometries[k].hull)->reserved;
    if (pool->count > 0) move_blocks(pool);
    pool->doubles = end;
    pool->unused = 0;
    ++pool->revision;
}

void sadmm_block_pool_remove(struct sadmm_block_pool *pool, const void *owner, struct sadmm_geometry *geometries,
                             size_t geometry_count)
{
    struct sadmm_pooled_block *pooled = find(pool, owner);
    if (!pooled || --pooled->uses > 0) return;
    const struct sadmm_block_owner gone = pooled->of;
    sadmm_key_tree_remove(&pool->places, (uintptr_t)owner);
    *pooled = pool->pooled[--pool->count]; /* the last one takes its place */
    double *place = sadmm_key_tree_find(&pool->places, (uintptr_t)pooled->of.owner);
    if (place) *place = (double)(pooled - pool->pooled);
    pool->unused += gone.doubles;
    gone.release(gone.owner);
    if (pool->count == 0 || (2 * pool->unused > pool->doubles && pool->unused >= geometry_count))
        close_gaps(pool, geometries, geometry_count);
}

sadmm_status sadmm_block_pool_hold(struct sadmm_block_pool *pool, struct sadmm_error *error)
{
    if (pool->doubles == 0) {
        TRY(reserve(pool, HULL_FIRST_OWN, error));
        pool->doubles = HULL_FIRST_OWN;
        ++pool->revision;
    }
    ++pool->holds;
    return SADMM_OK;
}

void sadmm_block_pool_let_go(struct sadmm_block_pool *pool)
{
    if (--pool->holds > 0 || pool->count > 0) return;
    pool->doubles = pool->unused = 0;
    ++pool->revision;
}

void sadmm_block_pool_free(struct sadmm_block_pool *pool)
{
    for (size_t k = 0; k < pool->count; ++k) pool->pooled[k].of.release(pool->pooled[k].of.owner);
    sadmm_key_tree_free(&pool->places);
    sadmm_free(pool->pooled);
    sadmm_free(pool->blocks);
    memset(pool, 0, sizeof *pool);
}
