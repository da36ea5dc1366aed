/* Hits of bodies in flight, each at its moment. */
#ifndef SADMM_WORLD_STEP_HITS_H
#define SADMM_WORLD_STEP_HITS_H

#include "world/state/world_state.h"

/* Hits of bodies in flight in the sub-step at hand, each at its moment: `start` and the bodies as collision sees them
 * become what they are after them. */
sadmm_status sadmm_world_take_hits(sadmm_world *world, int substep);
/* Dynamic bodies, by slot, that joints hold. */
void sadmm_world_mark_held(const sadmm_world *world, unsigned char *bodies, unsigned char mark);
/* Pairs that were followed to the end of the sub-step touch no more in it: planes laid through their contacts may say
 * that they do, where surfaces are round or turn. Their separations are what the bodies close by themselves, at least,
 * so that such contacts act only on what others push together. After contacts are found. */
void sadmm_world_open_separations(sadmm_world *world);
/* What the (sub-)step's hits give bodies, beside its contacts. */
void sadmm_world_add_hit_wrenches(sadmm_world *world, const sadmm_settings *settings);
void sadmm_world_free_hits(sadmm_world *world);

#endif
