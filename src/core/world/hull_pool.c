#include "hull_pool.h"

#include <string.h>

#include "collision/hull_data.h"
#include "core/base/memory.h"

/* Where a hull is in the list, or belongs. */
static size_t place_of(const struct sadmm_hull_pool *pool, const sadmm_hull *hull)
{
    size_t low = 0, high = pool->hull_count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if ((uintptr_t)pool->hulls[middle].hull < (uintptr_t)hull) low = middle + 1;
        else high = middle;
    }
    return low;
}

static bool has_at(const struct sadmm_hull_pool *pool, size_t place, const sadmm_hull *hull)
{
    return place < pool->hull_count && pool->hulls[place].hull == hull;
}

/* Room for `end` doubles, and the first blocks. */
static sadmm_status reserve(struct sadmm_hull_pool *pool, size_t end, struct sadmm_error *error)
{
    if (!sadmm_grow(&pool->blocks, &pool->block_capacity, pool->doubles, end, sizeof *pool->blocks))
        return sadmm_fail_memory(error, "the hull of a shape");
    if (pool->doubles == 0) sadmm_hull_prelude(pool->blocks);
    return SADMM_OK;
}

sadmm_status sadmm_hull_pool_add(struct sadmm_hull_pool *pool, const sadmm_hull *hull, uint32_t *offset,
                                 struct sadmm_error *error)
{
    const size_t place = place_of(pool, hull);
    if (!has_at(pool, place, hull)) {
        const size_t begin = pool->doubles > 0 ? pool->doubles : HULL_FIRST_OWN, end = begin + hull->doubles;
        if (end > INT32_MAX)
            return sadmm_fail(error, SADMM_ERROR_LIMIT, "hulls of %zu numbers: a world has room for 2^31", end);
        if (!sadmm_grow(&pool->hulls, &pool->hull_capacity, pool->hull_count, pool->hull_count + 1,
                        sizeof *pool->hulls))
            return sadmm_fail_memory(error, "the hull of a shape");
        TRY(reserve(pool, end, error));
        memcpy(pool->blocks + begin, hull->block, hull->doubles * sizeof *hull->block);
        memmove(pool->hulls + place + 1, pool->hulls + place, (pool->hull_count - place) * sizeof *pool->hulls);
        pool->hulls[place] = (struct sadmm_pooled_hull){.hull = hull, .offset = (uint32_t)begin};
        ++pool->hull_count;
        pool->doubles = end;
        ++pool->revision;
        sadmm_hull_retain(hull);
    }
    ++pool->hulls[place].uses;
    *offset = pool->hulls[place].offset;
    return SADMM_OK;
}

/* ---- blocks that move together ---- */

/* While blocks move a header's `reserved` has the offset that its block gets; 0: its hull is gone. */
static struct sadmm_hull_header *header_at(const struct sadmm_hull_pool *pool, size_t offset)
{
    return (struct sadmm_hull_header *)(pool->blocks + offset);
}

/* Where blocks are to go; the size of all of them. */
static size_t assign_offsets(struct sadmm_hull_pool *pool)
{
    size_t end = HULL_FIRST_OWN;
    for (size_t k = 0; k < pool->hull_count; ++k) header_at(pool, pool->hulls[k].offset)->reserved = 1;
    for (size_t at = HULL_FIRST_OWN; at < pool->doubles; at += (size_t)header_at(pool, at)->doubles) {
        if (header_at(pool, at)->reserved == 0) continue;
        header_at(pool, at)->reserved = (int32_t)end;
        end += (size_t)header_at(pool, at)->doubles;
    }
    return end;
}

static void move_blocks(struct sadmm_hull_pool *pool)
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

static void close_gaps(struct sadmm_hull_pool *pool, struct sadmm_geometry *geometries, size_t geometry_count)
{
    const size_t end = pool->hull_count > 0 ? assign_offsets(pool) : pool->holds > 0 ? HULL_FIRST_OWN : 0;
    for (size_t k = 0; k < pool->hull_count; ++k)
        pool->hulls[k].offset = (uint32_t)header_at(pool, pool->hulls[k].offset)->reserved;
    for (size_t k = 0; k < geometry_count && end > 0; ++k)
        if (geometries[k].type == SADMM_SHAPE_HULL && geometries[k].hull >= HULL_FIRST_OWN)
            geometries[k].hull = (uint32_t)header_at(pool, geometries[k].hull)->reserved;
    if (pool->hull_count > 0) move_blocks(pool);
    pool->doubles = end;
    pool->unused = 0;
    ++pool->revision;
}

void sadmm_hull_pool_remove(struct sadmm_hull_pool *pool, const sadmm_hull *hull, struct sadmm_geometry *geometries,
                            size_t geometry_count)
{
    const size_t place = place_of(pool, hull);
    if (!has_at(pool, place, hull) || --pool->hulls[place].uses > 0) return;
    --pool->hull_count;
    memmove(pool->hulls + place, pool->hulls + place + 1, (pool->hull_count - place) * sizeof *pool->hulls);
    pool->unused += hull->doubles;
    sadmm_hull_release(hull);
    if (pool->hull_count == 0 || 2 * pool->unused > pool->doubles) close_gaps(pool, geometries, geometry_count);
}

sadmm_status sadmm_hull_pool_hold(struct sadmm_hull_pool *pool, struct sadmm_error *error)
{
    if (pool->doubles == 0) {
        TRY(reserve(pool, HULL_FIRST_OWN, error));
        pool->doubles = HULL_FIRST_OWN;
        ++pool->revision;
    }
    ++pool->holds;
    return SADMM_OK;
}

void sadmm_hull_pool_let_go(struct sadmm_hull_pool *pool)
{
    if (--pool->holds > 0 || pool->hull_count > 0) return;
    pool->doubles = pool->unused = 0;
    ++pool->revision;
}

void sadmm_hull_pool_free(struct sadmm_hull_pool *pool)
{
    for (size_t k = 0; k < pool->hull_count; ++k) sadmm_hull_release(pool->hulls[k].hull);
    sadmm_free(pool->hulls);
    sadmm_free(pool->blocks);
    memset(pool, 0, sizeof *pool);
}
