/* What begins and ends. */
#ifndef SADMM_WORLD_OBJECTS_EVENTS_H
#define SADMM_WORLD_OBJECTS_EVENTS_H

#include "world/state/world_state.h"

/* A step has been made: what has begun and ended in it. */
sadmm_status sadmm_world_note_events(sadmm_world *world);
/* Recording goes on in a world that has been restored, which has none of its own. */
void sadmm_world_hand_events_on(sadmm_world *from, sadmm_world *to);
void sadmm_world_free_events(sadmm_world *world);

#endif
