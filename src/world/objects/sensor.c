/* Sensors: shapes that touch nothing and see what overlaps them. */
#include "collision/shapes/placed.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "sensor.h"
#include "world/query/query_scene.h"
#include "world/query/query_shape.h"
#include "world/state/ids.h"

enum { MOVING_TYPES = 1 << SADMM_BODY_DYNAMIC | 1 << SADMM_BODY_KINEMATIC };

/* Has contact of the two bodies been turned off, or do joints keep them from meeting? */
static bool apart(const sadmm_world *world, int32_t a, int32_t b)
{
    const uint64_t key = sadmm_pair_key((size_t)a, (size_t)b);
    return sadmm_pair_table_find(&world->disabled_pairs, key) || sadmm_pair_table_find(&world->jointed_pairs, key);
}

sadmm_status sadmm_world_list_seen(sadmm_world *world, size_t slot, size_t *count)
{
    const struct sadmm_shape *sensor = &world->shapes[slot];
    const struct sadmm_world_body *body = &world->bodies[sensor->body];
    const bool moves = body->type != SADMM_BODY_STATIC;
    const struct sadmm_shape_filter filter = {.body_types = moves ? SADMM_ALL_BODY_TYPES : MOVING_TYPES,
                                              .ignored = sensor->body,
                                              .environment = body->environment,
                                              .category = sensor->category,
                                              .mask = sensor->mask};
    struct sadmm_placed placed;
    struct sadmm_box3 box;
    size_t found = 0;
    *count = 0;
    if (sensor->category == 0 || sensor->mask == 0) return SADMM_OK; /* it would meet nothing */
    TRY(sadmm_world_begin_query(world));
    sadmm_world_place_shape(world, (uint32_t)slot, &placed);
    placed_box(&placed, &box);
    TRY(sadmm_world_list_overlaps(world, &box, &placed, &filter, &found));
    for (size_t k = 0; k < found; ++k) {
        const uint64_t other = world->query.slots[k];
        if (!apart(world, sensor->body, world->shapes[other].body)) world->query.slots[(*count)++] = other;
    }
    return SADMM_OK;
}

sadmm_status sadmm_world_sensor_overlaps(sadmm_world *world, sadmm_shape_id sensor, int32_t capacity,
                                         sadmm_shape_id *shapes, int32_t *count)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    const struct sadmm_shape *shape = sadmm_world_find_shape(world, sensor, "sensor", error);
    size_t found;
    if (!shape) return SADMM_ERROR_STALE_ID;
    if (!shape->sensor)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "sensor = (slot %u, generation %u, \"%s\"): must be a shape defined as a sensor",
                          sensor.slot, sensor.generation, sadmm_world_shape_name(world, sensor));
    TRY(sadmm_world_check_overlap_room(capacity, shapes, count, error));
    TRY(sadmm_world_list_seen(world, sensor.slot - 1, &found));
    sadmm_world_give_overlaps(world, found, capacity, shapes, count);
    return SADMM_OK;
}
