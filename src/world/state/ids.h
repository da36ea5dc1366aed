/* Objects by their ids. */
#ifndef SADMM_WORLD_STATE_IDS_H
#define SADMM_WORLD_STATE_IDS_H

#include "world_state.h"

/* The id of the object in a slot. */
sadmm_body_id sadmm_world_body_id(const sadmm_world *world, size_t slot);
sadmm_shape_id sadmm_world_shape_id(const sadmm_world *world, size_t slot);
sadmm_joint_id sadmm_world_joint_id(const sadmm_world *world, size_t slot);
sadmm_gear_id sadmm_world_gear_id(const sadmm_world *world, size_t slot);
sadmm_coupling_id sadmm_world_coupling_id(const sadmm_world *world, size_t slot);
/* Of the body of the shape in a slot. */
sadmm_body_id sadmm_world_body_of(const sadmm_world *world, int32_t shape);

/* The object of an id, in its slot, id.slot - 1; NULL, with SADMM_ERROR_STALE_ID set on `error`: there is none. */
struct sadmm_world_body *sadmm_world_find_body(const sadmm_world *world, sadmm_body_id id, const char *argument,
                                               struct sadmm_error *error);
struct sadmm_shape *sadmm_world_find_shape(const sadmm_world *world, sadmm_shape_id id, const char *argument,
                                           struct sadmm_error *error);
struct sadmm_world_joint *sadmm_world_find_joint(const sadmm_world *world, sadmm_joint_id id, const char *argument,
                                                 struct sadmm_error *error);
struct sadmm_world_gear *sadmm_world_find_gear(const sadmm_world *world, sadmm_gear_id id, const char *argument,
                                               struct sadmm_error *error);
struct sadmm_world_coupling *sadmm_world_find_coupling(const sadmm_world *world, sadmm_coupling_id id,
                                                       const char *argument, struct sadmm_error *error);

#endif
