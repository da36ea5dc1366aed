/* What a world's hulls and meshes are to contact finding: their blocks (collision/hull_data.h, mesh_data.h), one beside
 * the other in memory. */
#ifndef SADMM_CORE_WORLD_BLOCK_POOL_H
#define SADMM_CORE_WORLD_BLOCK_POOL_H

#include <stddef.h>
#include <stdint.h>

#include "collision/collision.h"
#include "core/base/error.h"
#include "core/base/key_tree.h"

/* A hull or a mesh: whose block it is, and how the pool holds on to it. */
struct sadmm_block_owner {
    const void *owner;
    const double *block;
    size_t doubles;
    void (*retain)(const void *owner), (*release)(const void *owner);
};

struct sadmm_pooled_block {
    struct sadmm_block_owner of;
    uint32_t offset; /* of its block */
    uint32_t uses;   /* shapes of it */
};

struct sadmm_block_pool {
    struct sadmm_pooled_block *pooled; /* in any order */
    size_t count, capacity;
    struct sadmm_key_tree places;    /* by the owner's address: where it is among them */
    double *blocks;                  /* in the order in which they came; none of them without an owner or a hold */
    size_t doubles, block_capacity;
    size_t unused;                   /* doubles of what is gone */
    size_t holds;                    /* shapes that need the pool's first blocks alone (geometry.h: smooth ones) */
    uint32_t revision;               /* changes whenever the blocks do */
};

/* One more shape of the owner, whose block is at *offset. Errors: OUT_OF_MEMORY, LIMIT (2^31 doubles); nothing
 * changes. */
sadmm_status sadmm_block_pool_add(struct sadmm_block_pool *pool, const struct sadmm_block_owner *of, uint32_t *offset,
                                  struct sadmm_error *error);
/* One less. Where more than half of the pool is unused then, and as many numbers as there are geometries, blocks move, and the offsets of those of `geometries` that
 * have one with them; one that is no more has offset 0. */
void sadmm_block_pool_remove(struct sadmm_block_pool *pool, const void *owner, struct sadmm_geometry *geometries,
                             size_t geometry_count);
/* The first blocks, for a shape that needs no more; and one such shape less. Errors: OUT_OF_MEMORY; nothing changes. */
sadmm_status sadmm_block_pool_hold(struct sadmm_block_pool *pool, struct sadmm_error *error);
void sadmm_block_pool_let_go(struct sadmm_block_pool *pool);
void sadmm_block_pool_free(struct sadmm_block_pool *pool);

#endif
