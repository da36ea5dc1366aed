/* Shapes that move through a world. */
#include <math.h>
#include <string.h>

#include "collision/query/cast.h"
#include "core/base/check.h"
#include "query_scene.h"
#include "query_shape.h"
#include "subadmm/query.h"
#include "world/state/ids.h"

/* The box around all of its way. */
static void sweep(const struct sadmm_cast *cast, double limit, struct sadmm_box3 *box)
{
    *box = cast->box;
    for (int k = 0; k < 3; ++k) {
        const double way = cast->direction[k] != 0 ? limit * cast->direction[k] : 0;
        box->lo[k] += fmin(way, 0);
        box->hi[k] += fmax(way, 0);
    }
}

static void give_hit(const sadmm_world *world, const struct sadmm_placed *found, const struct sadmm_cast_find *find,
                     sadmm_ray_hit *hit)
{
    hit->shape = sadmm_world_shape_id(world, found->slot);
    hit->body = sadmm_world_body_id(world, (size_t)found->body);
    hit->distance = find->distance;
    v3_store(find->point, hit->point);
    v3_store(v3_neg(find->normal), hit->normal);
    hit->triangle = sadmm_world_source_triangle(world, found->slot, find->triangle);
    hit->inside = find->inside;
}

static void cast_first(const sadmm_world *world, const struct sadmm_cast *cast, double length,
                       const struct sadmm_shape_filter *filter, sadmm_ray_hit *hit)
{
    const struct sadmm_placed *other, *found = NULL;
    struct sadmm_query_walk walk = {0};
    struct sadmm_cast_find find, best = {.triangle = -1};
    double limit = length;
    struct sadmm_box3 way;
    sweep(cast, limit, &way);
    memset(hit, 0, sizeof *hit);
    hit->triangle = -1;
    while ((other = sadmm_query_tree_next(&world->query.tree, &way, filter, &walk))) {
        if (!sadmm_cast_shape(cast, other, limit, &find)) continue;
        if (found && find.distance == limit && other->slot > found->slot) continue;
        found = other;
        best = find;
        limit = find.distance;
        sweep(cast, limit, &way);
    }
    if (found) give_hit(world, found, &best, hit);
}

sadmm_status sadmm_world_cast_shape(sadmm_world *world, const sadmm_shape_def *def, const double position[3],
                                    const double orientation[4], const double direction[3], double length,
                                    const sadmm_query_filter *filter, sadmm_ray_hit *hit)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_shape_filter taken;
    struct sadmm_placed shape;
    sadmm_query_filter given;
    struct sadmm_cast cast;
    TRY(sadmm_check_given(direction, "direction", error));
    TRY(sadmm_check_given(hit, "hit", error));
    TRY(sadmm_query_check_direction("direction", direction, error));
    if (!(length >= 0))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "length = %g: must be >= 0 m", length);
    TRY(sadmm_world_take_filter(world, filter, &taken, &given));
    TRY(sadmm_world_take_query_shape(world, def, position, orientation, &shape));
    if (shape.geometry.type == SADMM_SHAPE_PLANE)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "def->type = %d: must not be a plane, which has no end", (int)shape.geometry.type);
    TRY(sadmm_world_place_shapes(world));
    cast.shape = &shape;
    cast.from_inside = given.from_inside, cast.from_behind = given.from_behind;
    placed_box(&shape, &cast.box);
    sadmm_query_make_unit(direction, cast.direction);
    cast_first(world, &cast, length, &taken, hit);
    return SADMM_OK;
}
