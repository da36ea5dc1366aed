/* What a system's raw data means, in double: A_i and b_i of a body, e and Jacobian rows of a contact. Used by the
 * certificate, the literal backend and the tests; the fast backends evaluate the same math/ formulas in theirs. */
#ifndef SADMM_CORE_MODEL_SYSTEM_MATH_H
#define SADMM_CORE_MODEL_SYSTEM_MATH_H

#include <string.h>

#include "core/math/impact.h"
#include "core/math/rigid.h"
#include "forces.h"
#include "rolling.h"
#include "spin.h"
#include "system.h"

#ifndef SADMM_REAL_IS_DOUBLE
#error "system_math.h is double only: do not include it in a source compiled per precision"
#endif

/* What stiffness adds to its inertia (rolling.h, stiffening.h). */
SADMM_INLINE sym3 sadmm_stiffness(const struct sadmm_rigid *body, double dt)
{
    const double *k = body->stiffness, s = dt * dt / 2;
    const sym3 more = {s * k[0], s * k[1], s * k[2], s * k[3], s * k[4], s * k[5]};
    return more;
}

/* Its inertia with that; b, which is made of this angular velocity, along with it: what is added resists changes
 * alone. */
SADMM_INLINE sym3 sadmm_stiffened(const struct sadmm_rigid *body, vec3 angular, double dt, sym3 I, double b[6])
{
    const sym3 more = sadmm_stiffness(body, dt);
    v3_store(v3_add(v3_load(b + 3), s3_mul(more, angular)), b + 3);
    return s3_add(I, more);
}

/* b, but for what needs A besides (below); returns the mass of A. */
SADMM_INLINE double sadmm_rigid_load(const struct sadmm_rigid *body, const struct spin_system *spin,
                                     const struct sadmm_settings *settings, double b[6])
{
    const double dt = settings->dt;
    const struct forces_damping linear = forces_damping_of(body, 0, dt), angular = forces_damping_of(body, 1, dt);
    for (int k = 0; k < 3; ++k) {
        const double gained = dt * forces_gravity(body, settings->gravity, k);
        b[k] = body->mass * (linear.keep * body->velocity[k] + gained) + dt * body->wrench[k];
    }
    v3_store(v3_madd(v3_scale(spin->momentum, angular.keep), dt, v3_load(body->wrench + 3)), b + 3);
    rolling_pay(body, b);
    return linear.mass * body->mass;
}

/* Eq. (1) of a rigid body: A = diag(m I, world inertia) halfway through the step (spin: spin_of_system) and b = A v +
 * dt (m g + f, tau), with damping (forces.h), and what contacts that roll owe it. stiffens: its stiffness counts.
 * Returns the inertia; *mass: of A. */
SADMM_INLINE sym3 sadmm_rigid_body_by(const struct sadmm_rigid *body, const struct spin_system *spin, bool stiffens,
                                      const struct sadmm_settings *settings, double *mass, double b[6])
{
    const double share = forces_damping_of(body, 1, settings->dt).mass;
    *mass = sadmm_rigid_load(body, spin, settings, b);
    const sym3 I = rigid_world_inertia(spin->R, v3_scale(v3_load(body->inertia), share));
    if (rolling_turns_on(body)) v3_store(v3_add(v3_load(b + 3), s3_mul(I, spin->ahead)), b + 3);
    return stiffens ? sadmm_stiffened(body, spin->angular, settings->dt, I, b) : I;
}

SADMM_INLINE sym3 sadmm_rigid_body_at(const struct sadmm_rigid *body, const struct spin_system *spin,
                                      const struct sadmm_settings *settings, double *mass, double b[6])
{
    return sadmm_rigid_body_by(body, spin, rolling_stiffens(body), settings, mass, b);
}

SADMM_INLINE sym3 sadmm_rigid_body(const struct sadmm_rigid *body, const struct sadmm_settings *settings, double *mass,
                                   double b[6])
{
    const struct spin_system spin = spin_of_system(body, settings->dt);
    return sadmm_rigid_body_at(body, &spin, settings, mass, b);
}

/* b of the motion less c, of a rigid body: b - A c. */
SADMM_INLINE void sadmm_subtract_support_motion(double mass, sym3 I, const double c[6], double b[6])
{
    for (int k = 0; k < 3; ++k) b[k] -= mass * c[k];
    v3_store(v3_sub(v3_load(b + 3), s3_mul(I, v3_load(c + 3))), b + 3);
}

/* A (6 x 6 row-major) and b of eq. (1), of body i by its state. */
SADMM_INLINE void sadmm_system_rigid(const struct sadmm_system *system, const struct sadmm_settings *settings,
                                     const struct sadmm_rigid *state, const struct spin_system *spin, int32_t i,
                                     double A[36], double b[6])
{
    double mass;
    const sym3 I = sadmm_rigid_body_at(state, spin, settings, &mass, b);
    memset(A, 0, 36 * sizeof *A);
    A[0] = A[7] = A[14] = mass;
    A[21] = I.xx, A[28] = I.yy, A[35] = I.zz;
    A[22] = A[27] = I.xy, A[23] = A[33] = I.xz, A[29] = A[34] = I.yz;
    if (system->support_motion) sadmm_subtract_support_motion(mass, I, system->support_motion + 6 * (size_t)i, b);
}

/* The same of any body. */
SADMM_INLINE void sadmm_system_body(const struct sadmm_system *system, const struct sadmm_settings *settings, int32_t i,
                                     double A[36], double b[6])
{
    if (system->spins) {
        sadmm_system_rigid(system, settings, &system->rigid[i], &system->spins[i], i, A, b);
        return;
    }
    if (system->rigid) {
        const struct spin_system spin = spin_of_system(&system->rigid[i], settings->dt);
        sadmm_system_rigid(system, settings, &system->rigid[i], &spin, i, A, b);
        return;
    }
    memcpy(A, system->A + 36 * (size_t)i, 36 * sizeof *A);
    memcpy(b, system->b + 6 * (size_t)i, 6 * sizeof *b);
}

SADMM_INLINE vec3 sadmm_velocity_at(const double v[6], const double arm[3])
{
    return v3_add(v3_load(v), v3_cross(v3_load(v + 3), v3_load(arm)));
}

/* What a kinematic body adds to the velocity of b's contact point relative to a's, world frame, less the motion of the
 * other one's support. */
SADMM_INLINE vec3 sadmm_kinematic_part(const struct sadmm_system *system, const struct sadmm_contact_pair *pair,
                                       const struct sadmm_contact_point *point)
{
    const bool on_b = sadmm_body_is_kinematic(pair->body_b);
    if (!on_b && !sadmm_body_is_kinematic(pair->body_a)) return v3(0, 0, 0);
    vec3 x = sadmm_velocity_at(sadmm_kinematic_velocity(system, on_b ? pair->body_b : pair->body_a),
                               on_b ? point->arm_b : point->arm_a);
    if (system->support_motion)
        x = v3_sub(x, sadmm_velocity_at(system->support_motion + 6 * (size_t)(on_b ? pair->body_a : pair->body_b),
                                        on_b ? point->arm_a : point->arm_b));
    return on_b ? x : v3_neg(x);
}

/* The kinematic body of a pair that has one as the motion about the other one's centre of mass that its surface has
 * at the points: with the arms of the other one. `points`: the pair's. */
SADMM_INLINE void sadmm_kinematic_about_other(const struct sadmm_system *system, const struct sadmm_contact_pair *pair,
                                              const struct sadmm_contact_point *points, double motion[6])
{
    const bool on_b = sadmm_body_is_kinematic(pair->body_b);
    const double *v = sadmm_kinematic_velocity(system, on_b ? pair->body_b : pair->body_a),
                 *own = on_b ? points->arm_b : points->arm_a, *other = on_b ? points->arm_a : points->arm_b;
    v3_store(v3_add(v3_load(v), v3_cross(v3_load(v + 3), v3_sub(v3_load(own), v3_load(other)))), motion);
    v3_store(v3_load(v + 3), motion + 3);
    if (!system->support_motion) return;
    const double *c = system->support_motion + 6 * (size_t)(on_b ? pair->body_a : pair->body_b);
    for (int k = 0; k < 6; ++k) motion[k] -= c[k];
}

/* Velocity of b's contact point relative to a's, world frame, by the system's velocities. */
SADMM_INLINE vec3 sadmm_contact_velocity(const struct sadmm_system *system, const struct sadmm_contact_pair *pair,
                                          const struct sadmm_contact_point *point)
{
    vec3 x = v3(0, 0, 0);
    if (pair->body_b >= 0) x = sadmm_velocity_at(system->velocity + 6 * (size_t)pair->body_b, point->arm_b);
    if (pair->body_a >= 0)
        x = v3_sub(x, sadmm_velocity_at(system->velocity + 6 * (size_t)pair->body_a, point->arm_a));
    return system->kinematic_count > 0 ? v3_add(x, sadmm_kinematic_part(system, pair, point)) : x;
}

/* The contact's frame: rows n, t1, t2. */
SADMM_INLINE mat3 sadmm_contact_frame(const double normal[3])
{
    mat3 frame;
    frame.r[0] = v3_load(normal);
    v3_tangents(frame.r[0], &frame.r[1], &frame.r[2]);
    return frame;
}

/* ---- e of a contact ---------------------------------------------------------------------------------------------- */

/* A body that hits: its velocity at the end of the step but for contacts and forces, what forces change it by in half a
 * step, and its response to an impulse. */
struct sadmm_impact_body {
    vec3 linear, angular, push, turn;
    vec3 ahead; /* spin_ahead: a part of what is solved for that is none of an impact's */
    double inverse_mass;
    mat3 inverse_inertia; /* world frame */
};

SADMM_INLINE struct sadmm_impact_body sadmm_impact_body_of(const struct sadmm_system *system,
                                                           const struct sadmm_settings *settings, int32_t i)
{
    const double dt = settings->dt;
    struct sadmm_impact_body out;
    memset(&out, 0, sizeof out);
    if (sadmm_body_is_kinematic(i)) {
        out.linear = v3_load(sadmm_kinematic_velocity(system, i));
        out.angular = v3_load(sadmm_kinematic_velocity(system, i) + 3);
    }
    if (i < 0) return out;
    const struct sadmm_rigid *body = &system->rigid[i];
    const struct spin_system spin = spin_of_system(body, dt);
    const vec3 inertia = v3_load(body->inertia);
    const struct forces_damping linear = forces_damping_of(body, 0, dt), angular = forces_damping_of(body, 1, dt);
    const vec3 heavy = v3_scale(inertia, angular.mass);
    const sym3 inverse = rigid_world_inertia(spin.R, v3(1 / heavy.x, 1 / heavy.y, 1 / heavy.z));
    out.linear = v3_scale(v3_load(body->velocity), linear.keep / linear.mass);
    out.angular = v3_scale(v3_sub(spin.angular, spin.ahead), angular.keep / angular.mass);
    out.ahead = spin.ahead;
    out.push = v3_scale(v3_madd(v3_scale(v3_load(settings->gravity), body->gravity_scale), 1 / body->mass,
                                v3_load(body->wrench)), dt / 2 / linear.mass);
    out.turn = v3_scale(s3_mul(inverse, v3_load(body->wrench + 3)), dt / 2);
    out.inverse_mass = 1 / (linear.mass * body->mass);
    out.inverse_inertia.r[0] = v3(inverse.xx, inverse.xy, inverse.xz);
    out.inverse_inertia.r[1] = v3(inverse.xy, inverse.yy, inverse.yz);
    out.inverse_inertia.r[2] = v3(inverse.xz, inverse.yz, inverse.zz);
    return out;
}

/* Relative velocity at arms of the two bodies. */
SADMM_INLINE vec3 sadmm_impact_velocity(const struct sadmm_impact_body body[2], const vec3 arm[2])
{
    return v3_sub(v3_add(body[1].linear, v3_cross(body[1].angular, arm[1])),
                  v3_add(body[0].linear, v3_cross(body[0].angular, arm[0])));
}

/* What forces change it by in half a step. */
SADMM_INLINE vec3 sadmm_impact_push(const struct sadmm_impact_body body[2], const vec3 arm[2])
{
    return v3_sub(v3_add(body[1].push, v3_cross(body[1].turn, arm[1])),
                  v3_add(body[0].push, v3_cross(body[0].turn, arm[0])));
}

/* Adds to G, the response in the frame, that of a body at an arm. */
SADMM_INLINE void sadmm_add_response(const struct sadmm_impact_body *body, const mat3 *frame, vec3 arm, mat3 *G)
{
    if (body->inverse_mass == 0) return;
    for (int i = 0; i < 3; ++i) {
        const vec3 turned = m3_mul(body->inverse_inertia, v3_cross(arm, frame->r[i]));
        const vec3 moved = v3_madd(v3_cross(turned, arm), body->inverse_mass, frame->r[i]);
        G->r[i] = v3_add(G->r[i], m3_mul(*frame, moved));
    }
}

/* The restitution of a pair whose contacts that hit have their middle at `arm`. */
SADMM_INLINE double sadmm_impact_restitution(const struct sadmm_impact_body body[2],
                                             const struct sadmm_contact_pair *pair, const vec3 arm[2])
{
    const mat3 frame = sadmm_contact_frame(pair->normal);
    mat3 G = {{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
    for (int side = 0; side < 2; ++side) sadmm_add_response(&body[side], &frame, arm[side], &G);
    return impact_restitution(&G, m3_mul(frame, sadmm_impact_velocity(body, arm)),
                              m3_mul(frame, sadmm_impact_push(body, arm)), pair->friction, pair->restitution);
}

/* e of a pair's k-th point with restitution, from e without. */
SADMM_RARE double sadmm_impact_e(const struct sadmm_system *system, const struct sadmm_settings *settings,
                                 const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *points,
                                 int32_t at, double e)
{
    const double dt = settings->dt, threshold = settings->restitution_threshold;
    const struct sadmm_impact_body body[2] = {sadmm_impact_body_of(system, settings, pair->body_a),
                                              sadmm_impact_body_of(system, settings, pair->body_b)};
    const vec3 normal = v3_load(pair->normal);
    vec3 middle[2] = {v3(0, 0, 0), v3(0, 0, 0)};
    double approach = 0, ahead = 0, hits = 0, restitution = pair->restitution;
    for (int32_t k = 0; k < pair->count; ++k) {
        const vec3 arm[2] = {v3_load(points[k].arm_a), v3_load(points[k].arm_b)};
        const double closing = v3_dot(normal, sadmm_impact_velocity(body, arm));
        if (k == at) {
            approach = closing;
            ahead = v3_dot(normal, v3_sub(v3_cross(body[1].ahead, arm[1]), v3_cross(body[0].ahead, arm[0])));
        }
        if (!contact_hits(points[k].separation, closing, dt, threshold)) continue;
        hits += 1;
        for (int side = 0; side < 2; ++side) middle[side] = v3_add(middle[side], arm[side]);
    }
    if (hits == 0) return e; /* no impact: what parted falls back as far as its separation lets it */
    if (pair->friction > 0) {
        for (int side = 0; side < 2; ++side) middle[side] = v3_scale(middle[side], 1 / hits);
        restitution = sadmm_impact_restitution(body, pair, middle);
    }
    if (contact_hits(points[at].separation, approach, dt, threshold)) return min_of(e, restitution * approach - ahead);
    return approach > 0 ? max_of(e, restitution * approach - ahead) : e;
}

/* e of a point along the normal, m/s, of a pair without restitution. */
SADMM_INLINE double sadmm_contact_e_plain(const struct sadmm_system *system, const struct sadmm_settings *settings,
                                           const struct sadmm_contact_point *point)
{
    return system->errors_given ? point->error
                                : contact_error(point->separation, settings->dt, settings->correction_factor,
                                                settings->slop, settings->correction_speed) +
                                      point->error;
}

/* e of a pair's k-th point. `points`: the pair's. */
SADMM_INLINE double sadmm_contact_e(const struct sadmm_system *system, const struct sadmm_settings *settings,
                                     const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *points,
                                     int32_t k)
{
    const double e = sadmm_contact_e_plain(system, settings, &points[k]);
    return sadmm_pair_bounces(system, pair)
               ? sadmm_impact_e(system, settings, pair, points, k, e)
               : e;
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* J = sign [d^T, (arm x d)^T] for the contact direction d: sign +1 on b, -1 on a. */
SADMM_INLINE void sadmm_contact_row(vec3 d, const double arm[3], double sign, double row[6])
{
    vec3 m = v3_cross(v3_load(arm), d);
    row[0] = sign * d.x, row[1] = sign * d.y, row[2] = sign * d.z;
    row[3] = sign * m.x, row[4] = sign * m.y, row[5] = sign * m.z;
}

#endif
