#include "pull.h"

#include <math.h>
#include <string.h>

#include "core/math/quat.h"
#include "subadmm/joint.h"

double sadmm_smooth(double x)
{
    const double t = fmin(fmax(x, 0), 1);
    return t * t * t * (10 + t * (6 * t - 15));
}

/* The rotation vector of a turn. */
static void turn_vector(const double orientation[4], double out[3])
{
    const double w = orientation[0], sign = w < 0 ? -1 : 1;
    const double s = sqrt(fmax(0, 1 - w * w)), angle = 2 * atan2(s, fabs(w));
    for (int k = 0; k < 3; ++k) out[k] = orientation[k + 1] * sign * (s > 1e-9 ? angle / s : 2);
}

sadmm_status sadmm_add_pull(sadmm_world *world, sadmm_body_id body, const double offset[3], struct sadmm_frame target,
                            const struct sadmm_pull *pull, struct sadmm_error *error)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = SADMM_JOINT_CUSTOM;
    def.body_b = body;
    memcpy(def.position_b, offset, sizeof def.position_b);
    double turn[3];
    turn_vector(target.orientation, turn);
    for (int k = 0; k < 6; ++k) {
        def.coordinates[k].drive = SADMM_DRIVE_POSITION;
        def.coordinates[k].target_position = k < 3 ? target.origin[k] : turn[k - 3];
        def.coordinates[k].drive_stiffness = k < 3 ? pull->stiffness : pull->turn_stiffness;
        def.coordinates[k].drive_damping = k < 3 ? pull->damping : pull->turn_damping;
        def.coordinates[k].drive_force = k < 3 ? pull->force : pull->torque;
    }
    return sadmm_scene_world_error(world, sadmm_world_add_joint(world, &def, NULL), error);
}

sadmm_status sadmm_move_pull(sadmm_world *world, int32_t joints, int32_t pull, struct sadmm_frame now,
                             struct sadmm_frame next, double dt, struct sadmm_error *error)
{
    double from[3], to[3];
    sadmm_joint_id id;
    sadmm_joint_def def;
    turn_vector(now.orientation, from);
    turn_vector(next.orientation, to);
    sadmm_status status = sadmm_world_joint_at(world, joints + pull, &id);
    if (status == SADMM_OK) status = sadmm_world_joint_def(world, id, &def);
    for (int k = 0; k < 6 && status == SADMM_OK; ++k) {
        sadmm_joint_coordinate *c = &def.coordinates[k];
        c->target_position = k < 3 ? now.origin[k] : from[k - 3];
        c->target_speed = (k < 3 ? next.origin[k] - now.origin[k] : to[k - 3] - from[k - 3]) / dt;
        status = sadmm_world_set_joint_coordinate(world, id, k, c);
    }
    return sadmm_scene_world_error(world, status, error);
}
