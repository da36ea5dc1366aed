#include "pull.h"

#include <math.h>
#include <string.h>

#include "core/math/quat.h"

double sadmm_smooth(double x)
{
    const double t = fmin(fmax(x, 0), 1);
    return t * t * t * (10 + t * (6 * t - 15));
}

sadmm_status sadmm_add_pull(sadmm_world *world, sadmm_body_id body, struct sadmm_frame target,
                            const sadmm_coupling_def *gains, struct sadmm_error *error)
{
    sadmm_coupling_def def = *gains;
    def.body = body;
    memcpy(def.target_position, target.origin, sizeof def.target_position);
    memcpy(def.target_orientation, target.orientation, sizeof def.target_orientation);
    return sadmm_scene_world_error(world, sadmm_world_add_coupling(world, &def, NULL), error);
}

/* The angular velocity that turns one orientation into the other in dt (s), world frame, rad/s. */
static void turn_rate(const double from[4], const double to[4], double dt, double rate[3])
{
    const double back[4] = {from[0], -from[1], -from[2], -from[3]};
    double turn[4];
    q_store(q_mul(q_load(to), q_load(back)), turn);
    const double sign = turn[0] < 0 ? -1 : 1, s = sqrt(turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3]);
    for (int k = 0; k < 3; ++k)
        rate[k] = s > 0 ? sign * turn[k + 1] / s * 2 * atan2(s, sign * turn[0]) / dt : 0;
}

sadmm_status sadmm_move_pull(sadmm_world *world, int32_t index, struct sadmm_frame now, struct sadmm_frame next,
                             double dt, struct sadmm_error *error)
{
    double velocity[6];
    sadmm_coupling_id id;
    for (int k = 0; k < 3; ++k) velocity[k] = (next.origin[k] - now.origin[k]) / dt;
    turn_rate(now.orientation, next.orientation, dt, velocity + 3);
    sadmm_status status = sadmm_world_coupling_at(world, index, &id);
    if (status == SADMM_OK)
        status = sadmm_world_set_coupling_target(world, id, now.origin, now.orientation, velocity);
    return sadmm_scene_world_error(world, status, error);
}
