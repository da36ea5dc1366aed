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
/* `filter`: the caller's, NULL: the defaults. */
sadmm_status sadmm_world_take_filter(sadmm_world *world, const sadmm_query_filter *filter,
                                     struct sadmm_shape_filter *taken, sadmm_query_filter *given);

#endif
