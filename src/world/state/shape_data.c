#include "shape_data.h"

#include <string.h>

#include "collision/hull/hull.h"
#include "collision/hull/hull_write.h"
#include "collision/mesh/mesh_data.h"
#include "core/base/memory.h"

/* Of an owner; NULL: it has no block here. */
static struct sadmm_shape_data_entry *find(const struct sadmm_shape_data *data, const void *owner)
{
    const double *place = sadmm_key_tree_find(&data->places, (uintptr_t)owner);
    return place ? &data->entries[(size_t)*place] : NULL;
}

/* Room for `end` doubles, and the first blocks. */
static sadmm_status reserve(struct sadmm_shape_data *data, size_t end, struct sadmm_error *error)
{
    if (!SADMM_GROW(data->blocks, data->doubles, end)) return sadmm_fail_memory(error, "the hull or mesh of a shape");
    if (data->doubles == 0) sadmm_hull_prelude(data->blocks);
    return SADMM_OK;
}

sadmm_status sadmm_shape_data_add(struct sadmm_shape_data *data, const struct sadmm_shape_data_owner *of,
                                  uint32_t *offset, struct sadmm_error *error)
{
    struct sadmm_shape_data_entry *entry = find(data, of->owner);
    if (!entry) {
        const size_t begin = data->doubles > 0 ? data->doubles : HULL_FIRST_OWN, end = begin + of->doubles;
        if (end > INT32_MAX)
            return sadmm_fail(error, SADMM_ERROR_LIMIT, "hulls and meshes of %zu numbers: a world has room for 2^31",
                              end);
        if (!SADMM_GROW(data->entries, data->count, data->count + 1) || !sadmm_key_tree_reserve(&data->places))
            return sadmm_fail_memory(error, "the hull or mesh of a shape");
        TRY(reserve(data, end, error));
        memcpy(data->blocks + begin, of->block, of->doubles * sizeof *data->blocks);
        sadmm_key_tree_set(&data->places, (uintptr_t)of->owner, (double)data->count);
        entry = &data->entries[data->count++];
        *entry = (struct sadmm_shape_data_entry){.of = *of, .offset = (uint32_t)begin};
        data->doubles = end;
        ++data->revision;
        of->retain(of->owner);
    }
    ++entry->uses;
    *offset = entry->offset;
    return SADMM_OK;
}

/* ---- blocks that move together ---- */

_Static_assert(offsetof(struct sadmm_mesh_header, doubles) == offsetof(struct sadmm_hull_header, doubles) &&
                   offsetof(struct sadmm_mesh_header, reserved) == offsetof(struct sadmm_hull_header, reserved),
               "blocks of hulls and of meshes are moved alike");

/* While blocks move a header's `reserved` has the offset that its block gets; 0: its owner is gone. Of a mesh the two
 * members that are used are in the same places. */
static struct sadmm_hull_header *header_at(const struct sadmm_shape_data *data, size_t offset)
{
    return (struct sadmm_hull_header *)(data->blocks + offset);
}

/* Where blocks are to go; the size of all of them. */
static size_t assign_offsets(struct sadmm_shape_data *data)
{
    size_t end = HULL_FIRST_OWN;
    for (size_t k = 0; k < data->count; ++k) header_at(data, data->entries[k].offset)->reserved = 1;
    for (size_t at = HULL_FIRST_OWN; at < data->doubles; at += (size_t)header_at(data, at)->doubles) {
        if (header_at(data, at)->reserved == 0) continue;
        header_at(data, at)->reserved = (int32_t)end;
        end += (size_t)header_at(data, at)->doubles;
    }
    return end;
}

static void move_blocks(struct sadmm_shape_data *data)
{
    size_t size;
    for (size_t at = HULL_FIRST_OWN; at < data->doubles; at += size) {
        struct sadmm_hull_header *header = header_at(data, at);
        const size_t to = (size_t)header->reserved;
        size = (size_t)header->doubles;
        header->reserved = 0;
        if (to > 0) memmove(data->blocks + to, data->blocks + at, size * sizeof *data->blocks);
    }
}

static void compact(struct sadmm_shape_data *data, struct sadmm_geometry *geometries, size_t geometry_count)
{
    const size_t end = data->count > 0 ? assign_offsets(data) : data->holds > 0 ? HULL_FIRST_OWN : 0;
    for (size_t k = 0; k < data->count; ++k)
        data->entries[k].offset = (uint32_t)header_at(data, data->entries[k].offset)->reserved;
    for (size_t k = 0; k < geometry_count && data->count > 0; ++k)
        if (geometries[k].hull >= HULL_FIRST_OWN)
            geometries[k].hull = (uint32_t)header_at(data, geometries[k].hull)->reserved;
    if (data->count > 0) move_blocks(data);
    data->doubles = end;
    data->unused = 0;
    ++data->revision;
}

void sadmm_shape_data_remove(struct sadmm_shape_data *data, const void *owner, struct sadmm_geometry *geometries,
                             size_t geometry_count)
{
    struct sadmm_shape_data_entry *entry = find(data, owner);
    if (!entry || --entry->uses > 0) return;
    const struct sadmm_shape_data_owner gone = entry->of;
    sadmm_key_tree_remove(&data->places, (uintptr_t)owner);
    *entry = data->entries[--data->count]; /* the last one takes its place */
    double *place = sadmm_key_tree_find(&data->places, (uintptr_t)entry->of.owner);
    if (place) *place = (double)(entry - data->entries);
    data->unused += gone.doubles;
    gone.release(gone.owner);
    if (data->count == 0 || (2 * data->unused > data->doubles && data->unused >= geometry_count))
        compact(data, geometries, geometry_count);
}

sadmm_status sadmm_shape_data_hold(struct sadmm_shape_data *data, struct sadmm_error *error)
{
    if (data->doubles == 0) {
        TRY(reserve(data, HULL_FIRST_OWN, error));
        data->doubles = HULL_FIRST_OWN;
        ++data->revision;
    }
    ++data->holds;
    return SADMM_OK;
}

void sadmm_shape_data_release(struct sadmm_shape_data *data)
{
    if (--data->holds > 0 || data->count > 0) return;
    data->doubles = data->unused = 0;
    ++data->revision;
}

void sadmm_shape_data_free(struct sadmm_shape_data *data)
{
    for (size_t k = 0; k < data->count; ++k) data->entries[k].of.release(data->entries[k].of.owner);
    sadmm_key_tree_free(&data->places);
    sadmm_free(data->entries);
    sadmm_free(data->blocks);
    memset(data, 0, sizeof *data);
}
