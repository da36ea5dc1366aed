/* The hulls of a world's shapes, one beside the other in memory, for contact finding (collision/hull_data.h). */
#ifndef SADMM_CORE_WORLD_HULL_POOL_H
#define SADMM_CORE_WORLD_HULL_POOL_H

#include <stddef.h>
#include <stdint.h>

#include "collision/collision.h"
#include "collision/hull.h"
#include "core/base/error.h"

struct sadmm_pooled_hull {
    const sadmm_hull *hull;
    uint32_t offset; /* of its block */
    uint32_t uses;   /* shapes of it */
};

struct sadmm_hull_pool {
    struct sadmm_pooled_hull *hulls; /* by address, so that they are found */
    size_t hull_count, hull_capacity;
    double *blocks;                  /* in the order in which they came; none of them without a hull */
    size_t doubles, block_capacity;
    size_t unused;                   /* doubles of hulls that are gone */
    size_t holds;                    /* shapes that need the pool's first blocks alone (geometry.h: smooth ones) */
    uint32_t revision;               /* changes whenever the blocks do */
};

/* One more shape of the hull, whose block is at *offset. Errors: OUT_OF_MEMORY, LIMIT (2^31 doubles); nothing
 * changes. */
sadmm_status sadmm_hull_pool_add(struct sadmm_hull_pool *pool, const sadmm_hull *hull, uint32_t *offset,
                                 struct sadmm_error *error);
/* One less. Where more than half of the pool is unused then, blocks move, and the offsets of those of `geometries` that
 * are hulls with them; one that is no more has offset 0. */
void sadmm_hull_pool_remove(struct sadmm_hull_pool *pool, const sadmm_hull *hull, struct sadmm_geometry *geometries,
                            size_t geometry_count);
/* The first blocks, for a shape that needs no more; and one such shape less. */
sadmm_status sadmm_hull_pool_hold(struct sadmm_hull_pool *pool, struct sadmm_error *error);
void sadmm_hull_pool_let_go(struct sadmm_hull_pool *pool);
void sadmm_hull_pool_free(struct sadmm_hull_pool *pool);

#endif
