/* Bodies that a scene's script leads by the hand: virtual couplings (coupling.h) whose targets follow the script. */
#ifndef SADMM_SCENES_PULL_H
#define SADMM_SCENES_PULL_H

#include "place.h"
#include "subadmm/coupling.h"

/* Smoothly from 0 at x = 0 to 1 at x = 1, with speed and acceleration 0 at both ends; constant beyond. */
double sadmm_smooth(double x);

/* Add a coupling as `gains` says (all but its body, target and frames, which are the body's own) that draws `body` to
 * `target`. */
sadmm_status sadmm_add_pull(sadmm_world *world, sadmm_body_id body, struct sadmm_frame target,
                            const sadmm_coupling_def *gains, struct sadmm_error *error);

/* Lead the world's coupling of this index: its target is at `now`, and at `next` after `dt` (s). */
sadmm_status sadmm_move_pull(sadmm_world *world, int32_t index, struct sadmm_frame now, struct sadmm_frame next,
                             double dt, struct sadmm_error *error);

#endif
