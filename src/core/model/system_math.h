/* What a system's raw data means, in double: A_i and b_i of a body, e and Jacobian rows of a contact. Used by the
 * certificate, the literal backend and the tests; the fast backends evaluate the same math/ formulas in theirs. */
#ifndef SADMM_CORE_MODEL_SYSTEM_MATH_H
#define SADMM_CORE_MODEL_SYSTEM_MATH_H

#include <string.h>

#include "core/math/contact.h"
#include "core/math/rigid.h"
#include "system.h"

#ifndef SADMM_REAL_IS_DOUBLE
#error "system_math.h is double only: do not include it in a source compiled per precision"
#endif

/* A (6 x 6 row-major) and b of eq. (1). Rigid bodies: A = diag(m I, world inertia) and
 * b = A v + dt (m g + f, tau) with the gyroscopic term inside the angular momentum (math/rigid.h). */
SADMM_INLINE void sadmm_system_body(const struct sadmm_system *system, const struct sadmm_settings *settings, int32_t i,
                                     double A[36], double b[6])
{
    if (!system->rigid) {
        memcpy(A, system->A + 36 * (size_t)i, 36 * sizeof *A);
        memcpy(b, system->b + 6 * (size_t)i, 6 * sizeof *b);
        return;
    }
    const struct sadmm_rigid *body = &system->rigid[i];
    double dt = settings->dt;
    quat q = q_load(body->orientation);
    vec3 inertia = v3_load(body->inertia);
    sym3 I = rigid_world_inertia(q_matrix(q), inertia);
    vec3 momentum = rigid_angular_momentum(q, inertia, v3_load(body->velocity + 3), dt);
    vec3 angular = v3_madd(momentum, dt, v3_load(body->wrench + 3));

    memset(A, 0, 36 * sizeof *A);
    A[0] = A[7] = A[14] = body->mass;
    A[21] = I.xx, A[28] = I.yy, A[35] = I.zz;
    A[22] = A[27] = I.xy, A[23] = A[33] = I.xz, A[29] = A[34] = I.yz;
    for (int k = 0; k < 3; ++k)
        b[k] = body->mass * (body->velocity[k] + dt * settings->gravity[k]) + dt * body->wrench[k];
    v3_store(angular, b + 3);
}

/* Velocity of b's contact point relative to a's, world frame; `velocity` (bodies x 6). */
SADMM_INLINE vec3 sadmm_contact_velocity(const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *point,
                                          const double *velocity)
{
    vec3 x = v3(0, 0, 0);
    if (pair->body_b >= 0) {
        const double *v = velocity + 6 * (size_t)pair->body_b;
        x = v3_add(v3_load(v), v3_cross(v3_load(v + 3), v3_load(point->arm_b)));
    }
    if (pair->body_a >= 0) {
        const double *v = velocity + 6 * (size_t)pair->body_a;
        x = v3_sub(x, v3_add(v3_load(v), v3_cross(v3_load(v + 3), v3_load(point->arm_a))));
    }
    return x;
}

/* e along the normal, m/s. */
SADMM_INLINE double sadmm_contact_e(const struct sadmm_system *system, const struct sadmm_settings *settings,
                                     const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *point)
{
    double approach = 0;
    if (system->errors_given) return point->error;
    if (system->rigid && pair->restitution > 0) {
        vec3 va = v3(0, 0, 0), vb = va;
        if (pair->body_a >= 0) {
            const double *v = system->rigid[pair->body_a].velocity;
            va = v3_add(v3_load(v), v3_cross(v3_load(v + 3), v3_load(point->arm_a)));
        }
        if (pair->body_b >= 0) {
            const double *v = system->rigid[pair->body_b].velocity;
            vb = v3_add(v3_load(v), v3_cross(v3_load(v + 3), v3_load(point->arm_b)));
        }
        approach = v3_dot(v3_load(pair->normal), v3_sub(vb, va));
    }
    return contact_error(point->gap, approach, pair->restitution, settings->dt, settings->baumgarte, settings->slop,
                         settings->correction_speed, settings->restitution_threshold);
}

/* The contact's frame: rows n, t1, t2. */
SADMM_INLINE mat3 sadmm_contact_frame(const double normal[3])
{
    mat3 frame;
    frame.r[0] = v3_load(normal);
    v3_tangents(frame.r[0], &frame.r[1], &frame.r[2]);
    return frame;
}

/* J = sign [d^T, (arm x d)^T] for the contact direction d: sign +1 on b, -1 on a. */
SADMM_INLINE void sadmm_contact_row(vec3 d, const double arm[3], double sign, double row[6])
{
    vec3 m = v3_cross(v3_load(arm), d);
    row[0] = sign * d.x, row[1] = sign * d.y, row[2] = sign * d.z;
    row[3] = sign * m.x, row[4] = sign * m.y, row[5] = sign * m.z;
}

#endif
