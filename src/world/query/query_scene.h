/* What queries search. */
#ifndef SADMM_WORLD_QUERY_QUERY_SCENE_H
#define SADMM_WORLD_QUERY_QUERY_SCENE_H

#include "subadmm/query.h"
#include "world/state/world_state.h"

enum { SADMM_ALL_BODY_TYPES = 1 << SADMM_BODY_DYNAMIC | 1 << SADMM_BODY_STATIC | 1 << SADMM_BODY_KINEMATIC };
/* The bodies of the last step, and what queries need besides: before shapes are placed. */
sadmm_status sadmm_world_begin_query(sadmm_world *world);
/* A shape where it is. */
void sadmm_world_place_shape(const sadmm_world *world, uint32_t slot, struct sadmm_placed *placed);
/* All of it, and the tree up to date. */
sadmm_status sadmm_world_place_shapes(sadmm_world *world);
/* A triangle of a mesh as the caller numbers it. */
int32_t sadmm_world_source_triangle(const sadmm_world *world, uint32_t slot, int32_t triangle);
/* The direction of a ray, of unit length; whatever its length is. */
void sadmm_query_make_unit(const double d[3], double unit[3]);
sadmm_status sadmm_query_check_direction(const char *name, const double d[3], struct sadmm_error *error);
/* `filter`: the caller's, NULL: the defaults. */
sadmm_status sadmm_world_take_filter(sadmm_world *world, const sadmm_query_filter *filter,
                                     struct sadmm_shape_filter *taken, sadmm_query_filter *given);

#endif
