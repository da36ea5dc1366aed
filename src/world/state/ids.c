/* From ids to objects and back, and what all kinds of objects have alike. */
#include "ids.h"

#include "core/base/check.h"
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

const char *sadmm_world_body_name(const struct sadmm_world_body *body) { return body->name ? body->name : ""; }
