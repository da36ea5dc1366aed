/* Shapes that are none of the world's, and what overlaps them. */
#ifndef SADMM_WORLD_QUERY_QUERY_SHAPE_H
#define SADMM_WORLD_QUERY_QUERY_SHAPE_H

#include "world/state/world_state.h"

/* The caller's shape at a pose. The world is ready for a query. */
sadmm_status sadmm_world_take_query_shape(sadmm_world *world, const sadmm_shape_def *given, const double position[3],
                                          const double orientation[4], struct sadmm_placed *placed);

/* What meets a box (shape: NULL), or overlaps a shape in that box: its slots into query.slots, ascending. The tree is
 * brought up to date. */
sadmm_status sadmm_world_list_overlaps(sadmm_world *world, const struct sadmm_box3 *box,
                                       const struct sadmm_placed *shape, const struct sadmm_shape_filter *filter,
                                       size_t *count);
/* To the caller, who has room for `capacity` of them. */
sadmm_status sadmm_world_check_overlap_room(int32_t capacity, const sadmm_shape_id *shapes, const int32_t *count,
                                            struct sadmm_error *error);
void sadmm_world_give_overlaps(const sadmm_world *world, size_t found, int32_t capacity, sadmm_shape_id *shapes,
                               int32_t *count);

#endif
