/* What the objects of a world in an archive share. */
#ifndef SADMM_WORLD_SAVE_SAVE_PARTS_H
#define SADMM_WORLD_SAVE_SAVE_PARTS_H

#include "core/base/archive.h"
#include "core/base/fields.h"
#include "world/state/world_state.h"

/* A member that is added has to be listed where the type is archived. */
#define LISTED(type, size) \
    _Static_assert(sizeof(type) == (size), #type " has other members than the list of a saved world")

void sadmm_archive_fail_memory(struct sadmm_archive *archive);
/* Members of an object, but those of kind OTHER. */
void sadmm_archive_fields(struct sadmm_archive *archive, const struct sadmm_field *fields, size_t count, void *object);
/* Ids of objects of `size` bytes in *array, for which there is room then; false after a failure. */
bool sadmm_archive_ids(struct sadmm_archive *archive, struct sadmm_id_pool *pool, void *array, size_t size);
/* And what each of these objects has. */
void sadmm_archive_list(struct sadmm_archive *archive, sadmm_world *world, struct sadmm_id_pool *pool, void *array,
                        size_t size,
                        void (*one)(struct sadmm_archive *archive, sadmm_world *world, size_t slot));
/* slots: those that its pairs are of. */
void sadmm_archive_pairs(struct sadmm_archive *archive, struct sadmm_pair_table *table, size_t slots);

#endif
