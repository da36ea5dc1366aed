/* From ids to objects and back, and what all kinds of objects have alike. */
#include "ids.h"

#include <string.h>

#include "core/base/check.h"
#include "core/base/utf8.h"
#include "subadmm/arrays.h"
#include "subadmm/coupling.h"
#include "subadmm/gear.h"
#include "subadmm/joint.h"

/* sadmm_world_<object>_id, _find_<object>; of the array `objects`, <object>_count and <object>_at. */
#define OBJECT(object, objects, type)                                                                                \
    sadmm_##object##_id sadmm_world_##object##_id(const sadmm_world *world, size_t slot)                             \
    {                                                                                                                \
        return (sadmm_##object##_id){(uint32_t)slot + 1, world->object##_ids.generations[slot]};                     \
    }                                                                                                                \
    type *sadmm_world_find_##object(const sadmm_world *world, sadmm_##object##_id id, const char *argument,          \
                                    struct sadmm_error *error)                                                       \
    {                                                                                                                \
        return sadmm_ids_check(&world->object##_ids, id.slot, id.generation, argument, error) == SADMM_OK            \
                   ? &world->objects[id.slot - 1]                                                                    \
                   : NULL;                                                                                           \
    }                                                                                                                \
    int32_t sadmm_world_##object##_count(const sadmm_world *world) { return world ? world->object##_ids.count : 0; } \
    sadmm_status sadmm_world_##object##_at(sadmm_world *world, int32_t index, sadmm_##object##_id *id)               \
    {                                                                                                                \
        TRY(sadmm_check_given(world, "world", NULL));                                                                \
        TRY(sadmm_check_given(id, "id", &world->error));                                                             \
        TRY(check_index(&world->object##_ids, index, &world->error));                                                \
        *id = sadmm_world_##object##_id(world, sadmm_ids_at(&world->object##_ids, index));                           \
        return SADMM_OK;                                                                                             \
    }

#define INDEX_OF(object)                                                                                  \
    sadmm_status sadmm_world_##object##_index(sadmm_world *world, sadmm_##object##_id id, int32_t *index) \
    {                                                                                                     \
        TRY(sadmm_check_given(world, "world", NULL));                                                     \
        TRY(sadmm_ids_check(&world->object##_ids, id.slot, id.generation, "id", &world->error));          \
        TRY(sadmm_check_given(index, "index", &world->error));                                            \
        *index = sadmm_ids_index(&world->object##_ids, id.slot - 1);                                      \
        return SADMM_OK;                                                                                  \
    }

static sadmm_status check_index(const struct sadmm_id_pool *pool, int32_t index, struct sadmm_error *error)
{
    if (index >= 0 && index < pool->count) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "index = %d: must be in [0, %d)", index, pool->count);
}

OBJECT(body, bodies, struct sadmm_world_body)
OBJECT(shape, shapes, struct sadmm_shape)
OBJECT(joint, joints, struct sadmm_world_joint)
OBJECT(gear, gears, struct sadmm_world_gear)
OBJECT(coupling, couplings, struct sadmm_world_coupling)

INDEX_OF(body)
INDEX_OF(shape)
INDEX_OF(joint)
INDEX_OF(coupling)

sadmm_body_id sadmm_world_body_of(const sadmm_world *world, int32_t shape)
{
    return sadmm_world_body_id(world, (size_t)world->shapes[shape].body);
}

/* ---- names and user data ----------------------------------------------------------------------------------------- */

static bool is_there(const struct sadmm_id_pool *pool, uint32_t number, uint32_t generation)
{
    return sadmm_ids_has(pool, (size_t)number - 1) && pool->generations[number - 1] == generation;
}

/* The slot of the one object with a name. */
static sadmm_status find_named(const struct sadmm_id_pool *pool, const char *name, size_t *slot,
                               struct sadmm_error *error)
{
    const size_t length = sadmm_utf8_fit(name, SADMM_NAME_SIZE - 1); /* as far as names are kept */
    int32_t count = 0;
    if (length == 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "name = \"%s\": must be the name of a %s", name,
                          pool->object);
    for (size_t at = 0; at < pool->tags.slots; ++at) {
        const char *own = sadmm_tags_name(&pool->tags, at);
        if (!sadmm_ids_has(pool, at) || strncmp(own, name, length) != 0 || own[length]) continue;
        *slot = at;
        ++count;
    }
    if (count == 1) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                      "name = \"%s\": must be the name of one %s, %d of %d have it", name, pool->object, count,
                      pool->count);
}

/* sadmm_world_<object>_name, _<object>_named, _<object>_user_data, _set_<object>_user_data. */
#define TAGGED(object)                                                                                               \
    const char *sadmm_world_##object##_name(const sadmm_world *world, sadmm_##object##_id id)                        \
    {                                                                                                                \
        if (!world || !is_there(&world->object##_ids, id.slot, id.generation)) return "";                            \
        return sadmm_tags_name(&world->object##_ids.tags, id.slot - 1);                                              \
    }                                                                                                                \
    sadmm_status sadmm_world_##object##_named(sadmm_world *world, const char *name, sadmm_##object##_id *id)         \
    {                                                                                                                \
        size_t slot = 0;                                                                                             \
        TRY(sadmm_check_given(world, "world", NULL));                                                                \
        TRY(sadmm_check_given(name, "name", &world->error));                                                         \
        TRY(sadmm_check_given(id, "id", &world->error));                                                             \
        TRY(find_named(&world->object##_ids, name, &slot, &world->error));                                           \
        *id = sadmm_world_##object##_id(world, slot);                                                                \
        return SADMM_OK;                                                                                             \
    }                                                                                                                \
    void *sadmm_world_##object##_user_data(const sadmm_world *world, sadmm_##object##_id id)                         \
    {                                                                                                                \
        if (!world || !is_there(&world->object##_ids, id.slot, id.generation)) return NULL;                          \
        return sadmm_tags_data(&world->object##_ids.tags, id.slot - 1);                                              \
    }                                                                                                                \
    sadmm_status sadmm_world_set_##object##_user_data(sadmm_world *world, sadmm_##object##_id id, void *data)        \
    {                                                                                                                \
        TRY(sadmm_check_given(world, "world", NULL));                                                                \
        TRY(sadmm_ids_check(&world->object##_ids, id.slot, id.generation, "id", &world->error));                     \
        return sadmm_tags_set_data(&world->object##_ids.tags, id.slot - 1, data, &world->error);                     \
    }

TAGGED(body)
TAGGED(shape)
TAGGED(joint)
TAGGED(gear)
TAGGED(coupling)
