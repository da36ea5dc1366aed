/* How a step turns a body (docs/internals/algorithm.md, "Turning"): half a step of motion without torque, then
 * everything that acts on it, then half a step without torque again. A and b of eq. (1), rows of joints and the
 * solution are those of the orientation halfway: torques change the angular momentum in space by dt times themselves,
 * what is between keeps it, and no gyroscopic term is left. Where all principal moments are equal, spin and A do not
 * depend on the orientation, and it is turned at the end, by one velocity. In double. */
#ifndef SADMM_CORE_MODEL_SPIN_H
#define SADMM_CORE_MODEL_SPIN_H

#include "core/math/rigid.h"
#include "rolling.h"

#ifndef SADMM_REAL_IS_DOUBLE
#error "spin.h is double only: do not include it in a source compiled per precision"
#endif

SADMM_INLINE struct rigid_spin spin_start(const struct sadmm_rigid *body)
{
    const struct rigid_spin start = {q_load(body->orientation), v3_load(body->velocity + 3)};
    return start;
}

/* Halfway, before anything acts on it. */
SADMM_INLINE struct rigid_spin spin_halfway(const struct sadmm_rigid *body, double dt)
{
    return rigid_drift(spin_start(body), v3_load(body->inertia), dt / 2);
}

/* What the spin of a body that rolls (rolling.h) changes by from there to the step's end without a torque, to first
 * order; momentum: angular, in the world. Of others 0. */
SADMM_INLINE vec3 spin_ahead(const struct sadmm_rigid *body, quat halfway, vec3 momentum, double dt)
{
    const vec3 inertia = v3_load(body->inertia);
    if (!rolling_turns_on(body) || rigid_is_isotropic(inertia)) return v3(0, 0, 0);
    const vec3 angular = rigid_angular_velocity(halfway, inertia, momentum);
    return v3_scale(rigid_angular_velocity(halfway, inertia, v3_cross(momentum, angular)), dt / 2);
}

/* The same for what A and b are of: where moments are equal, the start. With its matrix, and the angular momentum. */
struct spin_system {
    quat orientation;
    mat3 R;
    vec3 angular, momentum; /* world */
    vec3 ahead;             /* spin_ahead, which is part of `angular` */
};

SADMM_INLINE struct spin_system spin_of_system(const struct sadmm_rigid *body, double dt)
{
    const vec3 inertia = v3_load(body->inertia);
    struct spin_system out;
    struct rigid_tumbling t;
    out.orientation = t.orientation = q_load(body->orientation);
    out.angular = v3_load(body->velocity + 3);
    out.R = t.R = q_matrix(t.orientation);
    t.own = m3_tmul(t.R, out.angular);
    out.momentum = m3_mul(t.R, v3(inertia.x * t.own.x, inertia.y * t.own.y, inertia.z * t.own.z));
    out.ahead = v3(0, 0, 0);
    if (rigid_is_isotropic(inertia) || v3_max_abs(t.own) == 0) return out;
    t = rigid_tumble_on(t, inertia, dt / 2);
    out.orientation = t.orientation;
    out.R = t.R;
    out.ahead = spin_ahead(body, out.orientation, out.momentum, dt);
    out.angular = v3_add(m3_mul(t.R, t.own), out.ahead);
    return out;
}

/* The same by the orientation halfway. */
SADMM_INLINE struct spin_system spin_system_at(const struct sadmm_rigid *body, const double halfway[4], double dt)
{
    const vec3 inertia = v3_load(body->inertia);
    struct spin_system out;
    out.momentum = rigid_angular_momentum(q_load(body->orientation), inertia, v3_load(body->velocity + 3));
    out.orientation = rigid_is_isotropic(inertia) ? q_load(body->orientation) : q_load(halfway);
    out.R = q_matrix(out.orientation);
    out.ahead = spin_ahead(body, out.orientation, out.momentum, dt);
    out.angular = v3_add(rigid_angular_velocity(out.orientation, inertia, out.momentum), out.ahead);
    return out;
}

/* That orientation alone. */
SADMM_INLINE quat spin_turned_halfway(const struct sadmm_rigid *body, double dt)
{
    const vec3 inertia = v3_load(body->inertia);
    const struct rigid_spin start = spin_start(body);
    return rigid_is_isotropic(inertia) ? start.orientation : rigid_tumble(start, inertia, dt / 2).orientation;
}

/* Velocities of the start with the spin that a solution is of, to first order, which is enough to compare it with (the
 * trapezoid correction). */
SADMM_INLINE void spin_before(const struct sadmm_rigid *body, double dt, double before[6])
{
    const vec3 inertia = v3_load(body->inertia), spin = v3_load(body->velocity + 3);
    int k;
    for (k = 0; k < 6; ++k) before[k] = body->velocity[k];
    if (rigid_is_isotropic(inertia) || v3_max_abs(spin) == 0) return;
    const quat q = q_load(body->orientation);
    const vec3 torque = v3_cross(rigid_angular_momentum(q, inertia, spin), spin);
    v3_store(v3_madd(spin, rolling_turns_on(body) ? dt : dt / 2, rigid_angular_velocity(q, inertia, torque)),
             before + 3);
}

/* Where a body whose moments differ gets to: on from halfway by the spin that the step has left it with. */
SADMM_INLINE struct rigid_spin spin_end(const struct sadmm_rigid *body, quat halfway, const double spin[3], double dt)
{
    struct rigid_spin from = {halfway, v3_load(spin)};
    if (rolling_turns_on(body)) {
        const vec3 momentum =
            rigid_angular_momentum(q_load(body->orientation), v3_load(body->inertia), v3_load(body->velocity + 3));
        from.angular = v3_sub(from.angular, spin_ahead(body, halfway, momentum, dt));
    }
    return rigid_tumble(from, v3_load(body->inertia), dt / 2);
}

/* The same where the trapezoid correction is off (math/trapezoid.h): it has turned by that spin since the step began,
 * as its contacts assume. Its motion in its own frame is the one that ends at `end`, and so is its energy; but as it
 * did not turn like that before, its angular momentum turns with it, by dt times the correction. turned: by that
 * spin. */
SADMM_INLINE struct rigid_spin spin_turned_whole(struct rigid_spin end, quat turned)
{
    const vec3 own = m3_tmul(q_matrix(end.orientation), end.angular);
    end.orientation = turned;
    end.angular = m3_mul(q_matrix(end.orientation), own);
    return end;
}
SADMM_INLINE struct rigid_spin spin_end_whole(const struct sadmm_rigid *body, const double spin[3],
                                              struct rigid_spin end, double dt)
{
    return spin_turned_whole(end, rigid_turn(q_load(body->orientation), v3_load(spin), dt));
}

/* The pose and the velocity that the solution v leaves it with. mean: what it is moved by, and turned, where moments
 * are equal; halfway: its orientation then, read where they differ; whole: the correction is off. */
SADMM_INLINE void spin_move_from(const struct sadmm_rigid *body, const double halfway[4], const double v[6],
                                 const double mean[6], bool whole, double dt, double position[3],
                                 double orientation[4], double velocity[6])
{
    int k;
    v3_store(rigid_move(v3_load(body->position), v3_load(mean), dt), position);
    for (k = 0; k < 6; ++k) velocity[k] = v[k];
    if (rigid_is_isotropic(v3_load(body->inertia))) {
        q_store(rigid_turn(q_load(body->orientation), v3_load(mean + 3), dt), orientation);
    } else {
        struct rigid_spin end = spin_end(body, q_load(halfway), v + 3, dt);
        if (whole) end = spin_end_whole(body, v + 3, end, dt);
        q_store(end.orientation, orientation);
        v3_store(end.angular, velocity + 3);
    }
}

SADMM_INLINE void spin_move(const struct sadmm_rigid *body, const double v[6], const double mean[6], bool whole,
                            double dt, double position[3], double orientation[4], double velocity[6])
{
    double halfway[4];
    q_store(spin_turned_halfway(body, dt), halfway);
    spin_move_from(body, halfway, v, mean, whole, dt, position, orientation, velocity);
}

#endif
