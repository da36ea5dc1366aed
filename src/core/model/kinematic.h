/* Kinematic bodies (core/base/contact_set.h) in a step: the formulas, for a host that makes steps and a device that
 * does. A kinematic body goes by its velocity, which is the caller's, and feels nothing. One that is to be at a pose
 * after the step goes there by the velocity that brings it there. */
#ifndef SADMM_CORE_MODEL_KINEMATIC_H
#define SADMM_CORE_MODEL_KINEMATIC_H

#include "core/math/joint.h" /* q_log */
#include "core/math/rigid.h"
#include "system.h"

/* As a backend that keeps the world has it. */
struct sadmm_kinematic_body {
    struct sadmm_rigid rigid;
    struct sadmm_extrapolation extrapolation; /* how often it was placed alone */
    double position[3], orientation[4]; /* it is to be there after the next step, */
    double dt;                  /* so long a step, s; */
    int32_t target;             /* where not 0 */
    int32_t slot;               /* of the world's bodies */
};

/* The velocity that brings the body to a pose in dt. */
SADMM_INLINE void kinematic_velocity_to(const struct sadmm_rigid *rigid, const double position[3],
                                        const double orientation[4], double dt, double velocity[6])
{
    const quat turn = q_mul(q_load(orientation), q_conjugate(q_load(rigid->orientation)));
    for (int k = 0; k < 3; ++k) velocity[k] = (position[k] - rigid->position[k]) / dt;
    v3_store(v3_scale(q_log(turn), 1 / dt), velocity + 3);
}

/* A (sub-)step of dt is over; false: the pose is not finite. */
SADMM_INLINE bool kinematic_move(const struct sadmm_rigid *from, double dt, struct sadmm_rigid *next)
{
    double sum = 0;
    *next = *from;
    v3_store(rigid_move(v3_load(from->position), v3_load(from->velocity), dt), next->position);
    q_store(rigid_turn(q_load(from->orientation), v3_load(from->velocity + 3), dt), next->orientation);
    for (int k = 0; k < 3; ++k) sum += next->position[k] - next->position[k];
    for (int k = 0; k < 4; ++k) sum += next->orientation[k] - next->orientation[k];
    return sum == 0;
}

/* The whole step is over, and it was to be there. */
SADMM_INLINE void kinematic_arrive(const double position[3], const double orientation[4], struct sadmm_rigid *rigid)
{
    for (int k = 0; k < 3; ++k) rigid->position[k] = position[k];
    for (int k = 0; k < 4; ++k) rigid->orientation[k] = orientation[k];
    for (int k = 0; k < 6; ++k) rigid->velocity[k] = 0;
}

/* Its motion at a place (m, world). */
SADMM_INLINE void kinematic_motion_at(const struct sadmm_rigid *rigid, const double place[3], double motion[6])
{
    const vec3 arm = v3_sub(v3_load(place), v3_load(rigid->position)), spin = v3_load(rigid->velocity + 3);
    v3_store(v3_add(v3_load(rigid->velocity), v3_cross(spin, arm)), motion);
    v3_store(spin, motion + 3);
}

/* Do two supports (kinematic ones, or -1: the static world) move as one? */
SADMM_INLINE bool kinematic_same_motion(const struct sadmm_system *system, int32_t a, int32_t b)
{
    if (a == b) return true;
    if (a >= 0 || b >= 0 || a == -1 || b == -1) return false;
    const double *va = sadmm_kinematic_velocity(system, a), *vb = sadmm_kinematic_velocity(system, b);
    for (int k = 0; k < 3; ++k)
        if (va[k] != vb[k] || va[k + 3] != 0 || vb[k + 3] != 0) return false;
    return true;
}

/* Component k of (force, torque) that a point's impulse (on b) gives the body at `arm`; share: of it, negative on a. */
SADMM_INLINE double kinematic_load(const double arm[3], const double impulse[3], double share, int k)
{
    return share * (k < 3 ? v3_part(v3_load(impulse), k) : v3_part(v3_cross(v3_load(arm), v3_load(impulse)), k - 3));
}

#endif
