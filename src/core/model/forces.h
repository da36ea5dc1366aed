/* What acts on a body without contacts: gravity by the body's scale, its external wrench, damping. In double.
 *
 * Damping is the force -c m v (angular: the torque -c I w). For a constant force f the exact solution after dt is
 *
 *     v+ = e^-z v + (1 - e^-z) / z  dt f / m,     z = c dt
 *
 * and with that of A v+ = b, which contacts and joints then act on,
 *
 *     A = m z / (1 - e^-z),     b = m z / (e^z - 1) v + dt f
 *
 * Free motion decays as it should at any dt, what falls ends at f / (c m), and nothing of it is ever unstable, since A
 * only grows: for large z it is m z = m c dt, the implicit Euler rule. */
#ifndef SADMM_CORE_MODEL_FORCES_H
#define SADMM_CORE_MODEL_FORCES_H

#include <math.h>

#include "core/math/rigid.h"
#include "core/math/trapezoid.h"
#include "rolling.h"

#ifndef SADMM_REAL_IS_DOUBLE
#error "forces.h is double only: do not include it in a source compiled per precision"
#endif

/* A over m, and b over m v but for dt f. Both are 1 without damping. */
struct forces_damping {
    double mass, keep;
};

SADMM_RARE struct forces_damping forces_damped(double z)
{
    const struct forces_damping out = {z / -expm1(-z), z / expm1(z)};
    return out;
}

/* part 0: linear, 1: angular */
SADMM_INLINE struct forces_damping forces_damping_of(const struct sadmm_rigid *body, int part, double dt)
{
    const struct forces_damping none = {1, 1};
    const double z = body->damping[part] * dt;
    return z > 0 ? forces_damped(z) : none;
}

/* m/s^2 */
SADMM_INLINE double forces_gravity(const struct sadmm_rigid *body, const double gravity[3], int k)
{
    return body->gravity_scale * gravity[k];
}

/* Gravity of its own, or damping: it has no motion in common with others that fall. */
SADMM_INLINE bool forces_differ(const struct sadmm_rigid *body)
{
    return body->gravity_scale != 1 || body->damping[0] > 0 || body->damping[1] > 0;
}

/* What a body brings to its island's bits (math/trapezoid.h): the correction of a stiff one is off. */
SADMM_INLINE int forces_touch(const struct sadmm_rigid *body)
{
    return (forces_differ(body) ? TOUCH_DIFFERS : 0) | (rolling_is_stiff(body) ? TOUCH_PENETRATES : 0);
}

/* What damping takes of the speed of a part in a step, as an acceleration. */
SADMM_RARE double forces_braking(const double velocity[3], double z, double dt)
{
    return -expm1(-z) * v3_norm(v3_load(velocity)) / dt;
}

/* Sizes of accelerations that come on top of gravity's, which counts once for a pair of bodies: no two gain more
 * towards each other by it than the sum of what is beyond scales of 0 to 1. Linear (m/s^2); angular (rad/s^2). */
SADMM_INLINE double forces_acceleration(const struct sadmm_rigid *body, const double gravity[3], double dt)
{
    const double scale = body->gravity_scale,
                 more = scale > 1   ? scale - 1
                        : scale < 0 ? -scale
                                    : 0,
                 z = body->damping[0] * dt;
    double size = rigid_acceleration(body->mass, v3_load(body->wrench));
    if (more > 0) size += more * v3_norm(v3_load(gravity));
    return z > 0 ? size + forces_braking(body->velocity, z, dt) : size;
}
SADMM_INLINE double forces_angular_acceleration(const struct sadmm_rigid *body, double dt)
{
    const double z = body->damping[1] * dt,
                 size = rigid_angular_acceleration(q_load(body->orientation), v3_load(body->inertia),
                                                   v3_load(body->wrench + 3));
    return z > 0 ? size + forces_braking(body->velocity + 3, z, dt) : size;
}

/* What a step without contacts and torques makes of a velocity of its middle. */
SADMM_INLINE void forces_free(const struct sadmm_rigid *body, const double velocity[6], const double gravity[3],
                              double dt, double free[6])
{
    const struct forces_damping linear = forces_damping_of(body, 0, dt), angular = forces_damping_of(body, 1, dt);
    for (int k = 0; k < 3; ++k) {
        const double gained = dt * (forces_gravity(body, gravity, k) + body->wrench[k] / body->mass);
        free[k] = (linear.keep * velocity[k] + gained) / linear.mass;
        free[k + 3] = angular.keep * velocity[k + 3] / angular.mass;
    }
}

/* What is set of a body for the steps to come, from one to the other: the rest is what steps make. */
SADMM_INLINE void forces_copy(struct sadmm_rigid *to, const struct sadmm_rigid *from)
{
    for (int k = 0; k < 6; ++k) to->wrench[k] = from->wrench[k];
    to->gravity_scale = from->gravity_scale;
    to->damping[0] = from->damping[0];
    to->damping[1] = from->damping[1];
}

#endif
