/* Bodies that a scene's script leads by the hand: a frame on a body is drawn to a pose that the script moves, by springs
 * and dampers of limited force. */
#ifndef SADMM_SCENES_PULL_H
#define SADMM_SCENES_PULL_H

#include "place.h"

struct sadmm_pull {
    double stiffness, damping;           /* N/m, N s/m */
    double turn_stiffness, turn_damping; /* N m/rad, N m s/rad */
    double force, torque;                /* at most, N, N m */
};

/* Smoothly from 0 at x = 0 to 1 at x = 1, with speed and acceleration 0 at both ends; constant beyond. */
double sadmm_smooth(double x);

/* Draw the frame at `offset` (m, body frame, not turned against the body) on `body` to `target`. Pulls are counted from
 * 0 in the order in which they are added; a scene adds its joints before its first pull. */
sadmm_status sadmm_add_pull(sadmm_world *world, sadmm_body_id body, const double offset[3], struct sadmm_frame target,
                            const struct sadmm_pull *pull, struct sadmm_error *error);

/* Lead a pull: it is at `now` and will be at `next` after `dt` (s). `joints`: the scene's own. */
sadmm_status sadmm_move_pull(sadmm_world *world, int32_t joints, int32_t pull, struct sadmm_frame now,
                             struct sadmm_frame next, double dt, struct sadmm_error *error);

#endif
