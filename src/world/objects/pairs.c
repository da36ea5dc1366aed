/* What is set for pairs: of bodies, whether they meet; of shapes, their friction. */
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"

sadmm_status sadmm_world_set_body_pair_contact(sadmm_world *world, sadmm_body_id a, sadmm_body_id b, bool enabled)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    if (!sadmm_world_find_body(world, a, "a", error) || !sadmm_world_find_body(world, b, "b", error))
        return SADMM_ERROR_STALE_ID;
    if (a.slot == b.slot) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "a and b are the same body");
    TRY(sadmm_world_detach(world));
    uint64_t key = sadmm_pair_key(a.slot - 1, b.slot - 1);
    if (!enabled) return sadmm_pair_table_set(&world->disabled_pairs, key, 0, error);
    sadmm_pair_table_remove(&world->disabled_pairs, key);
    return SADMM_OK;
}

int32_t sadmm_world_body_pair_off_count(const sadmm_world *world)
{
    return world ? (int32_t)sadmm_pair_table_count(&world->disabled_pairs) : 0;
}

sadmm_status sadmm_world_body_pair_off_at(sadmm_world *world, int32_t index, sadmm_body_id *a, sadmm_body_id *b)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    TRY(sadmm_check_given(a, "a", error));
    TRY(sadmm_check_given(b, "b", error));
    const size_t count = sadmm_pair_table_count(&world->disabled_pairs);
    double ignored;
    if (index < 0 || (size_t)index >= count)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "index = %d: must be in [0, %zu)", index, count);
    const uint64_t key = sadmm_pair_table_at(&world->disabled_pairs, (size_t)index, &ignored);
    *a = sadmm_world_body_id(world, (uint32_t)(key >> 32));
    *b = sadmm_world_body_id(world, (uint32_t)key);
    return SADMM_OK;
}

sadmm_status sadmm_world_set_pair_friction(sadmm_world *world, sadmm_shape_id a, sadmm_shape_id b, double friction)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    if (!sadmm_world_find_shape(world, a, "a", error) || !sadmm_world_find_shape(world, b, "b", error))
        return SADMM_ERROR_STALE_ID;
    if (a.slot == b.slot) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "a and b are the same shape");
    uint64_t key = sadmm_pair_key(a.slot - 1, b.slot - 1);
    if (friction == -1) {
        TRY(sadmm_world_detach(world));
        sadmm_pair_table_remove(&world->friction_pairs, key);
        return SADMM_OK;
    }
    TRY(sadmm_numbers_check(SADMM_SHAPE_FIELD(friction), &friction, "friction (or -1 for the geometric mean)", error));
    TRY(sadmm_world_detach(world));
    return sadmm_pair_table_set(&world->friction_pairs, key, friction, error);
}

int32_t sadmm_world_pair_friction_count(const sadmm_world *world)
{
    return world ? (int32_t)sadmm_pair_table_count(&world->friction_pairs) : 0;
}

sadmm_status sadmm_world_pair_friction_at(sadmm_world *world, int32_t index, sadmm_shape_id *a, sadmm_shape_id *b,
                                          double *friction)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    TRY(sadmm_check_given(a, "a", error));
    TRY(sadmm_check_given(b, "b", error));
    TRY(sadmm_check_given(friction, "friction", error));
    const size_t count = sadmm_pair_table_count(&world->friction_pairs);
    if (index < 0 || (size_t)index >= count)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "index = %d: must be in [0, %zu)", index, count);
    const uint64_t key = sadmm_pair_table_at(&world->friction_pairs, (size_t)index, friction);
    *a = sadmm_world_shape_id(world, (uint32_t)(key >> 32));
    *b = sadmm_world_shape_id(world, (uint32_t)key);
    return SADMM_OK;
}
