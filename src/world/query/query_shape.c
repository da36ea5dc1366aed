/* What overlaps a box or a shape; how far shapes are apart. */
#include <math.h>
#include <string.h>

#include "collision/base/radix_sort.h"
#include "collision/hull/hull.h"
#include "collision/query/closest.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "query_scene.h"
#include "query_shape.h"
#include "subadmm/query.h"
#include "world/state/ids.h"
#include "world/state/shape_form.h"

static const double POSITION_LIMIT = 1e9;

/* Bits of a slot: a world holds 2^28 shapes. */
enum { SLOT_BITS = 28 };

/* ---- a shape that is none of the world's ------------------------------------------------------------------------- */

sadmm_status sadmm_world_take_query_shape(sadmm_world *world, const sadmm_shape_def *given, const double position[3],
                                          const double orientation[4], struct sadmm_placed *placed)
{
    struct sadmm_error *error = &world->error;
    double own[4], turn[4], at[3], axes[4];
    sadmm_shape_def taken;
    const sadmm_shape_def *const def = &taken;
    TRY(sadmm_growing_take(&sadmm_growing_shape, &taken, given, "def", error));
    TRY(sadmm_check_given(position, "position", error));
    TRY(sadmm_check_given(orientation, "orientation", error));
    if (def->type == SADMM_SHAPE_MESH)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "def->type = %d: must not be a mesh, which is a surface without an inside", (int)def->type);
    TRY(sadmm_shape_form_check(def, own, error));
    TRY(sadmm_check_vector("position", position, 3, POSITION_LIMIT, error));
    TRY(sadmm_check_orientation("orientation", orientation, turn, error));
    TRY(sadmm_world_begin_query(world));
    memset(placed, 0, sizeof *placed);
    sadmm_shape_form_place(def, own, at, axes);
    placed_pose(at, axes, position, turn, placed);
    placed->geometry = sadmm_shape_form_geometry(def);
    placed->blocks = def->hull ? def->hull->block : world->query.prelude;
    return SADMM_OK;
}

/* ---- overlaps ---------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_world_check_overlap_room(int32_t capacity, const sadmm_shape_id *shapes, const int32_t *count,
                                            struct sadmm_error *error)
{
    TRY(sadmm_check_given(count, "count", error));
    if (capacity < 0) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "capacity = %d: must be >= 0", capacity);
    return capacity > 0 ? sadmm_check_given(shapes, "shapes", error) : SADMM_OK;
}

/* Half-spaces that face away from each other may be apart. */
static bool planes_overlap(const struct sadmm_placed *a, const struct sadmm_placed *b)
{
    double off2 = 0, height = 0;
    for (int k = 0; k < 3; ++k) {
        const double off = a->R[3 * k + 2] + b->R[3 * k + 2];
        off2 += off * off;
        height += a->R[3 * k + 2] * (b->x[k] - a->x[k]);
    }
    return !(off2 <= 1e-24 && height > 0);
}

static bool overlaps(const struct sadmm_placed *a, const struct sadmm_placed *b)
{
    struct sadmm_separation separation;
    if (!sadmm_closest_is_known(a->geometry.type, b->geometry.type)) return planes_overlap(a, b);
    return sadmm_closest(a, b, 0, &separation) && separation.distance <= 0;
}

sadmm_status sadmm_world_list_overlaps(sadmm_world *world, const struct sadmm_box3 *box,
                                       const struct sadmm_placed *shape, const struct sadmm_shape_filter *filter,
                                       size_t *count)
{
    const size_t most = (size_t)world->shape_ids.count;
    if (!SADMM_GROW(world->query.slots, 0, most) || !SADMM_GROW(world->query.spare, 0, most))
        return sadmm_fail_memory(&world->error, "a query");
    const struct sadmm_placed *other;
    struct sadmm_query_walk walk = {0};
    size_t found = 0;
    TRY(sadmm_world_place_shapes(world));
    while ((other = sadmm_query_tree_next(&world->query.tree, box, filter, &walk)))
        if (!shape || overlaps(shape, other)) world->query.slots[found++] = other->slot;
    sadmm_radix_sort(world->query.slots, world->query.spare, found, SLOT_BITS);
    *count = found;
    return SADMM_OK;
}

void sadmm_world_give_overlaps(const sadmm_world *world, size_t found, int32_t capacity, sadmm_shape_id *shapes,
                               int32_t *count)
{
    for (size_t i = 0; i < found && i < (size_t)capacity; ++i)
        shapes[i] = sadmm_world_shape_id(world, world->query.slots[i]);
    *count = (int32_t)found;
}

sadmm_status sadmm_world_overlap_box(sadmm_world *world, const double lowest[3], const double highest[3],
                                     const sadmm_query_filter *filter, int32_t capacity, sadmm_shape_id *shapes,
                                     int32_t *count)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_shape_filter taken;
    sadmm_query_filter given;
    struct sadmm_box3 box;
    size_t found;
    TRY(sadmm_check_given(lowest, "lowest", error));
    TRY(sadmm_check_given(highest, "highest", error));
    TRY(sadmm_world_check_overlap_room(capacity, shapes, count, error));
    for (int k = 0; k < 3; ++k) {
        if (!(lowest[k] <= highest[k]))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "lowest[%d] = %g: must be <= highest[%d] = %g", k,
                              lowest[k], k, highest[k]);
        box.lo[k] = lowest[k];
        box.hi[k] = highest[k];
    }
    TRY(sadmm_world_take_filter(world, filter, &taken, &given));
    TRY(sadmm_world_list_overlaps(world, &box, NULL, &taken, &found));
    sadmm_world_give_overlaps(world, found, capacity, shapes, count);
    return SADMM_OK;
}

sadmm_status sadmm_world_overlap_shape(sadmm_world *world, const sadmm_shape_def *def, const double position[3],
                                       const double orientation[4], const sadmm_query_filter *filter, int32_t capacity,
                                       sadmm_shape_id *shapes, int32_t *count)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_shape_filter taken;
    sadmm_query_filter given;
    struct sadmm_placed shape;
    struct sadmm_box3 box;
    size_t found;
    TRY(sadmm_world_check_overlap_room(capacity, shapes, count, &world->error));
    TRY(sadmm_world_take_filter(world, filter, &taken, &given));
    TRY(sadmm_world_take_query_shape(world, def, position, orientation, &shape));
    placed_box(&shape, &box);
    TRY(sadmm_world_list_overlaps(world, &box, &shape, &taken, &found));
    sadmm_world_give_overlaps(world, found, capacity, shapes, count);
    return SADMM_OK;
}

/* ---- closest points ---------------------------------------------------------------------------------------------- */

static sadmm_status find_closest(sadmm_world *world, const struct sadmm_placed *a, const struct sadmm_placed *b,
                                 sadmm_closest_points *closest)
{
    const int type_a = a->geometry.type, type_b = b->geometry.type;
    struct sadmm_separation separation;
    if (!sadmm_closest_is_known(type_a, type_b))
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT, "both shapes are %s: one must be another",
                          type_a == SADMM_SHAPE_PLANE ? "planes" : "meshes");
    if (!sadmm_closest(a, b, HUGE_VAL, &separation)) /* numbers so large that nothing is known of them */
        return sadmm_fail(&world->error, SADMM_ERROR_NON_FINITE, "the distance of the two shapes is no number");
    memset(closest, 0, sizeof *closest);
    closest->distance = separation.distance;
    v3_store(separation.normal, closest->normal);
    v3_store(separation.a, closest->a);
    v3_store(separation.b, closest->b);
    closest->triangle = sadmm_world_source_triangle(world, type_a == SADMM_SHAPE_MESH ? a->slot : b->slot,
                                                    separation.triangle);
    return SADMM_OK;
}

sadmm_status sadmm_world_closest_points(sadmm_world *world, sadmm_shape_id a, sadmm_shape_id b,
                                        sadmm_closest_points *closest)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_placed first, second;
    if (!sadmm_world_find_shape(world, a, "a", error) || !sadmm_world_find_shape(world, b, "b", error))
        return SADMM_ERROR_STALE_ID;
    if (a.slot == b.slot) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "a and b are the same shape");
    TRY(sadmm_check_given(closest, "closest", error));
    TRY(sadmm_world_begin_query(world));
    sadmm_world_place_shape(world, a.slot - 1, &first);
    sadmm_world_place_shape(world, b.slot - 1, &second);
    return find_closest(world, &first, &second, closest);
}

sadmm_status sadmm_world_closest_to_shape(sadmm_world *world, const sadmm_shape_def *def, const double position[3],
                                          const double orientation[4], sadmm_shape_id b, sadmm_closest_points *closest)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_placed first, second;
    if (!sadmm_world_find_shape(world, b, "b", error)) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(closest, "closest", error));
    TRY(sadmm_world_take_query_shape(world, def, position, orientation, &first));
    sadmm_world_place_shape(world, b.slot - 1, &second);
    return find_closest(world, &first, &second, closest);
}
