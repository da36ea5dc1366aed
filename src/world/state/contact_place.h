/* Contacts, as callers see them. */
#ifndef SADMM_WORLD_STATE_CONTACT_PLACE_H
#define SADMM_WORLD_STATE_CONTACT_PLACE_H

#include "world_state.h"

/* A point of a (sub-)step, of which `start` is: where sadmm_contact says it is. */
void sadmm_world_contact_position(const sadmm_world *world, const struct sadmm_contact_pair *pair,
                                  const struct sadmm_contact_point *point, double position[3]);
/* How fast the surfaces come closer there before it, m/s. */
double sadmm_world_contact_speed(const sadmm_world *world, const struct sadmm_contact_pair *pair,
                                 const struct sadmm_contact_point *point);
/* Which triangle, as the caller numbers them; -1: of none. shape: b of the pair. */
int32_t sadmm_world_contact_triangle(const sadmm_world *world, int32_t shape, uint32_t subshape);

#endif
