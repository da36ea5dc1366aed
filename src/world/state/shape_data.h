/* Shape data: the blocks of a world's hulls and meshes that collision detection reads (collision/hull/hull_data.h,
 * mesh_data.h), in one array. */
#ifndef SADMM_WORLD_STATE_SHAPE_DATA_H
#define SADMM_WORLD_STATE_SHAPE_DATA_H

#include <stddef.h>
#include <stdint.h>

#include "collision/shapes/shape.h"
#include "core/base/error.h"
#include "core/base/key_tree.h"

/* A hull or a mesh that owns a block, with its reference counting. */
struct sadmm_shape_data_owner {
    const void *owner;
    const double *block;
    size_t doubles;
    void (*retain)(const void *owner), (*release)(const void *owner);
};

struct sadmm_shape_data_entry {
    struct sadmm_shape_data_owner of;
    uint32_t offset; /* of its block */
    uint32_t uses;   /* shapes of it */
};

struct sadmm_shape_data {
    struct sadmm_shape_data_entry *entries; /* in any order */
    size_t count;
    struct sadmm_key_tree places;    /* from the owner's address to the index of its entry */
    double *blocks;                  /* in the order in which they came; none of them without an owner or a hold */
    size_t doubles;
    size_t unused;                   /* doubles of what is gone */
    size_t holds;                    /* shapes that need only the first blocks (geometry.h: smooth ones) */
    uint32_t revision;               /* changes whenever the blocks do */
};

/* One more shape of the owner, whose block is at *offset. Errors: OUT_OF_MEMORY, LIMIT (2^31 doubles); nothing
 * changes. */
sadmm_status sadmm_shape_data_add(struct sadmm_shape_data *data, const struct sadmm_shape_data_owner *of,
                                  uint32_t *offset, struct sadmm_error *error);
/* One shape less. If more than half of the data, and at least as many numbers as there are geometries, is unused then,
 * it is compacted: the offsets in `geometries` change; those without a block become 0. */
void sadmm_shape_data_remove(struct sadmm_shape_data *data, const void *owner, struct sadmm_geometry *geometries,
                             size_t geometry_count);
/* The first blocks, for a shape that needs no more; and one such shape less. Errors: OUT_OF_MEMORY; nothing changes. */
sadmm_status sadmm_shape_data_hold(struct sadmm_shape_data *data, struct sadmm_error *error);
void sadmm_shape_data_release(struct sadmm_shape_data *data);
void sadmm_shape_data_free(struct sadmm_shape_data *data);

#endif
