/* Where joints let bodies go. */
#ifndef SADMM_WORLD_STEP_JOINT_MOVE_H
#define SADMM_WORLD_STEP_JOINT_MOVE_H

#include "world/state/world_state.h"

/* Bodies of islands with joints as they are after the step, in the place of what the backend made of them, once the
 * others have moved. islands: of bodies, NULL: not known. off: the largest error of a locked translation that is
 * left, m. */
sadmm_status sadmm_world_move_articulated(sadmm_world *world, const sadmm_settings *settings, const int32_t *islands,
                                          double *off);

#endif
