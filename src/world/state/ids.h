/* Objects by their ids. */
#ifndef SADMM_WORLD_STATE_IDS_H
#define SADMM_WORLD_STATE_IDS_H

#include "world_state.h"

sadmm_shape_id sadmm_world_shape_id(const sadmm_world *world, int32_t slot);
sadmm_body_id sadmm_world_body_id(const sadmm_world *world, int32_t slot);

/* "" where it has none. */
const char *sadmm_world_body_name(const struct sadmm_world_body *body);
/* The slot of a live object, or NULL with SADMM_ERROR_STALE_ID set on `error`. */
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

/* The slot of the index-th of `count` live objects; `id`, where its id is to go, is not NULL. INVALID_ARGUMENT. */
sadmm_status sadmm_world_slot_at(const struct sadmm_slot_set *taken, int32_t count, int32_t index, const void *id,
                                 size_t *slot, struct sadmm_error *error);

#endif
