/* What queries search: the world's shapes where they are, in a tree. It is brought up to date by the first query that
 * finds it behind; bodies that move, and shapes that come and go, only leave a mark. */
#include <math.h>
#include <string.h>

#include "collision/hull/hull.h"
#include "collision/hull/hull_data.h"
#include "collision/hull/hull_write.h"
#include "collision/mesh/mesh.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "query_scene.h"
#include "subadmm/query.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"

/* Shapes for which another thread is worth its while. */
enum { SHAPES_PER_THREAD = 16384 };

static const sadmm_query_filter defaults = {.body_types = SADMM_ALL_BODY_TYPES, .environment = -1, .from_inside = true};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_query_filter, &defaults, sensors);

void sadmm_query_filter_init(sadmm_query_filter *filter, size_t size) { sadmm_growing_init(&growing, filter, size, 0); }

sadmm_status sadmm_world_take_filter(sadmm_world *world, const sadmm_query_filter *filter,
                                     struct sadmm_shape_filter *taken, sadmm_query_filter *given)
{
    struct sadmm_error *error = &world->error;
    *given = defaults;
    if (filter) TRY(sadmm_growing_take(&growing, given, filter, "filter", error));
    if (given->body_types > SADMM_ALL_BODY_TYPES)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "filter->body_types = %u: must be in [0, %d]",
                          given->body_types, SADMM_ALL_BODY_TYPES);
    if (given->environment < -1)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "filter->environment = %d: must be >= -1",
                          given->environment);
    *taken = (struct sadmm_shape_filter){.body_types = given->body_types,
                                         .ignored = -1,
                                         .environment = given->environment,
                                         .category = given->category,
                                         .mask = given->mask,
                                         .sensors = given->sensors};
    if (given->ignored.slot == 0 && given->ignored.generation == 0) return SADMM_OK;
    if (!sadmm_world_find_body(world, given->ignored, "filter->ignored", error)) return SADMM_ERROR_STALE_ID;
    taken->ignored = (int32_t)given->ignored.slot - 1;
    return SADMM_OK;
}

int32_t sadmm_world_source_triangle(const sadmm_world *world, uint32_t slot, int32_t triangle)
{
    const int32_t *source = triangle >= 0 ? world->block_shapes[slot].mesh->source : NULL;
    return source ? source[triangle] : triangle;
}

void sadmm_world_place_shape(const sadmm_world *world, uint32_t slot, struct sadmm_placed *placed)
{
    const struct sadmm_shape *shape = &world->shapes[slot];
    const struct sadmm_world_body *body = &world->bodies[shape->body];
    placed_pose(shape->position, shape->orientation, body->rigid.position, body->rigid.orientation, placed);
    placed->geometry = world->geometries[shape->geometry];
    const bool has_block = placed->geometry.type == SADMM_SHAPE_HULL || placed->geometry.type == SADMM_SHAPE_MESH;
    placed->blocks = has_block ? world->shape_data.blocks : world->query.prelude;
    placed->slot = slot;
    placed->body = shape->body;
    placed->environment = body->environment;
    placed->category = shape->category;
    placed->mask = shape->mask;
    placed->sensor = shape->sensor;
    placed->body_type = UINT32_C(1) << body->type;
}

static void place_share(void *argument, int thread, int threads)
{
    const sadmm_world *world = (const sadmm_world *)argument;
    const struct sadmm_query_tree *tree = &world->query.tree;
    size_t begin, end;
    sadmm_share((size_t)world->shape_ids.count, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) sadmm_world_place_shape(world, tree->shapes[i].slot, &tree->shapes[i]);
}

/* All shapes of the list anew. */
static void place_all(sadmm_world *world)
{
    const int threads = sadmm_team_threads(&world->team, world->def.settings.threads,
                                           (size_t)world->shape_ids.count / SHAPES_PER_THREAD + 1);
    sadmm_parallel(&world->team, threads, place_share, world);
}

static sadmm_status list(sadmm_world *world)
{
    struct sadmm_query_tree *tree = &world->query.tree;
    size_t count = 0;
    world->query.listed = false;
    TRY(sadmm_query_tree_reserve(tree, (size_t)world->shape_ids.count, &world->error));
    for (SADMM_OBJECTS(slot, &world->shape_ids)) tree->shapes[count++].slot = (uint32_t)slot;
    place_all(world);
    TRY(sadmm_query_tree_make(tree, count, &world->error));
    world->query.listed = world->query.current = true;
    return SADMM_OK;
}

sadmm_status sadmm_world_begin_query(sadmm_world *world)
{
    TRY(sadmm_world_download_bodies(world));
    if (world->query.prelude) return SADMM_OK;
    world->query.prelude = (double *)sadmm_alloc(HULL_FIRST_OWN, sizeof *world->query.prelude);
    if (!world->query.prelude) return sadmm_fail_memory(&world->error, "a query");
    sadmm_hull_prelude(world->query.prelude);
    return SADMM_OK;
}

sadmm_status sadmm_world_place_shapes(sadmm_world *world)
{
    TRY(sadmm_world_begin_query(world));
    if (world->query.current) return SADMM_OK;
    if (!world->query.listed) return list(world);
    place_all(world);
    if (!sadmm_query_tree_follow(&world->query.tree)) return list(world);
    world->query.current = true;
    return SADMM_OK;
}
