/* A swept body, whose path within a (sub-)step is followed: that path, what a hit makes of it, and the start from which
 * it would be where it is (hits.c says why). For the host and devices; in double. */
#ifndef SADMM_COLLISION_FLIGHT_SWEPT_BODY_H
#define SADMM_COLLISION_FLIGHT_SWEPT_BODY_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "collision/base/bounds.h"
#include "collision/base/manifold.h"
#include "collision/shapes/geometry.h"
#include "collision/shapes/proxy.h"
#include "core/base/contact_set.h"
#include "core/math/hit.h"
#include "core/math/rigid.h"
#include "core/model/forces.h"
#include "core/model/spin.h"
#include "flight.h"

/* A body that takes part. */
struct swept_body {
    int32_t slot, dynamic; /* dynamic: -1 if it is not */
    int32_t kinematic;     /* -1 if it is not */
    struct sadmm_rigid start;
    struct sadmm_flight flight;
    uint32_t hits; /* that it has had: what was foreseen before the last one does not hold */
    bool too_many; /* there would be more than it may have */
    bool passes;   /* it may go through what is thin: the hits it has had are kept then, */
    bool ended;    /* and what comes after them is left to the solve */
};

/* ---- what is supported ------------------------------------------------------------------------------------------- */

/* Does a point of the last step's contacts press on its bodies? By more than what rounding of single precision leaves
 * of their speeds there, some hundred times over. mass: 0 of what is not dynamic. */
#define SWEPT_BODY_ROUNDING 1e-5
SADMM_INLINE bool swept_body_presses(const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *point,
                                     const struct sadmm_proxy *a, double mass_a, const struct sadmm_proxy *b,
                                     double mass_b)
{
    const double push = sadmm_normal_impulse(pair, point),
                 gives = push * ((mass_a > 0 ? 1 / mass_a : 0) + (mass_b > 0 ? 1 / mass_b : 0)),
                 speed = size3(a->velocity) + size3(a->angular) * size3(point->arm_a) + size3(b->velocity) +
                         size3(b->angular) * size3(point->arm_b);
    return push > 0 && gives > SWEPT_BODY_ROUNDING * speed;
}

/* ---- ways -------------------------------------------------------------------------------------------------------- */

/* v after the step over v at its start but for what forces add, along the body's centre of mass. */
SADMM_INLINE double swept_body_kept(const struct sadmm_rigid *body, double dt)
{
    const struct forces_damping linear = forces_damping_of(body, 0, dt);
    return linear.keep / linear.mass;
}

/* The acceleration that the step gives its velocity. */
SADMM_INLINE void swept_body_accelerate(const struct sadmm_rigid *body, const struct sadmm_settings *settings,
                                        double acceleration[3])
{
    double free[6];
    int k;
    forces_free(body, body->velocity, settings->gravity, settings->dt, free);
    for (k = 0; k < 3; ++k) acceleration[k] = (free[k] - body->velocity[k]) / settings->dt;
}

/* dt I^-1 torque, as damping lets it be. */
SADMM_INLINE vec3 swept_body_torque_gain(const struct sadmm_rigid *body, quat q, double dt)
{
    const double share = dt / forces_damping_of(body, 1, dt).mass;
    return v3_scale(rigid_angular_velocity(q, v3_load(body->inertia), v3_load(body->wrench + 3)), share);
}

/* What torques and damping make of an angular velocity in a step (core/model/system_math.h: b over A); and back. */
SADMM_INLINE vec3 swept_body_spin_after(const struct sadmm_rigid *body, quat q, vec3 before, double dt)
{
    const struct forces_damping angular = forces_damping_of(body, 1, dt);
    return v3_add(v3_scale(before, angular.keep / angular.mass), swept_body_torque_gain(body, q, dt));
}
SADMM_INLINE vec3 swept_body_spin_without(const struct sadmm_rigid *body, quat q, vec3 after, double dt)
{
    const struct forces_damping angular = forces_damping_of(body, 1, dt);
    return v3_scale(v3_sub(after, swept_body_torque_gain(body, q, dt)), angular.mass / angular.keep);
}

/* Of equal moments: as the step turns it, with its trapezoid correction (math/trapezoid.h). */
SADMM_INLINE void swept_body_turn_evenly(struct sadmm_flight *flight, quat q, vec3 before, vec3 after, double at)
{
    q_store(q, flight->orientation);
    v3_store(after, flight->spin);
    v3_store(v3_sub(after, v3_scale(v3_sub(after, before), 0.5)), flight->turn);
    flight->rate = length3(flight->turn);
    flight->at = at;
}

/* How fast it turns at most, and how fast that changes: by ((I_y - I_z) / I_x w_y w_z, ...) in the body's frame, w no
 * larger than rigid_rate2 says. */
SADMM_INLINE void swept_body_bound_turn(struct sadmm_flight *flight, vec3 inertia, struct rigid_spin halfway, double dt)
{
    const vec3 w = m3_tmul(q_matrix(halfway.orientation), halfway.angular),
               share = v3((inertia.y - inertia.z) / inertia.x, (inertia.z - inertia.x) / inertia.y,
                          (inertia.x - inertia.y) / inertia.z);
    flight->rate = sqrt(rigid_rate2(inertia, w));
    flight->bend = v3_max_abs(share) * flight->rate * flight->rate;
    flight->sway = min_of(dt / 2 * flight->bend, 2 * flight->rate);
}

/* Of others: as the step turns it about the middle (core/model/spin.h). */
SADMM_INLINE void swept_body_turn_freely(struct sadmm_flight *flight, vec3 inertia, struct rigid_spin halfway,
                                         double dt)
{
    q_store(halfway.orientation, flight->orientation);
    v3_store(halfway.angular, flight->spin);
    v3_store(halfway.angular, flight->turn);
    v3_store(inertia, flight->inertia);
    swept_body_bound_turn(flight, inertia, halfway, dt);
    flight->at = dt / 2;
}

SADMM_INLINE void swept_body_turn_from_start(struct swept_body *f, double dt)
{
    const struct sadmm_rigid *start = &f->start;
    const vec3 inertia = v3_load(start->inertia);
    if (rigid_is_isotropic(inertia)) {
        const struct rigid_spin spin = spin_start(start);
        const vec3 after = swept_body_spin_after(start, spin.orientation, spin.angular, dt);
        swept_body_turn_evenly(&f->flight, spin.orientation, spin.angular, after, 0);
    } else {
        struct rigid_spin halfway = spin_halfway(start, dt);
        halfway.angular = swept_body_spin_after(start, halfway.orientation, halfway.angular, dt);
        swept_body_turn_freely(&f->flight, inertia, halfway, dt);
    }
}

/* By its spin at t, which it has after what acts on it in the step, the one at its start. */
SADMM_INLINE void swept_body_turn_from_hit(struct swept_body *f, double dt, double t, struct rigid_spin hit)
{
    const vec3 inertia = v3_load(f->start.inertia);
    struct rigid_spin start = hit;
    if (rigid_is_isotropic(inertia)) {
        start.angular = swept_body_spin_without(&f->start, hit.orientation, hit.angular, dt);
        swept_body_turn_evenly(&f->flight, hit.orientation, start.angular, hit.angular, t);
        start.orientation = rigid_turn(hit.orientation, v3_load(f->flight.turn), -t);
    } else {
        start = rigid_tumble(hit, inertia, dt / 2 - t);
        swept_body_turn_freely(&f->flight, inertia, start, dt);
        start.angular = swept_body_spin_without(&f->start, start.orientation, start.angular, dt);
        start = rigid_tumble(start, inertia, -dt / 2);
    }
    q_store(start.orientation, f->start.orientation);
    v3_store(start.angular, f->start.velocity + 3);
}

/* From its start, by what it is. */
SADMM_CALLED void swept_body_begin(struct swept_body *f, const struct sadmm_settings *settings)
{
    struct sadmm_flight *flight = &f->flight;
    memset(flight, 0, sizeof *flight);
    memcpy(flight->position, f->start.position, sizeof flight->position);
    memcpy(flight->orientation, f->start.orientation, sizeof flight->orientation);
    if (f->dynamic < 0 && f->kinematic < 0) return;
    memcpy(flight->velocity, f->start.velocity, sizeof flight->velocity);
    memcpy(flight->turn, f->start.velocity + 3, sizeof flight->turn);
    memcpy(flight->spin, f->start.velocity + 3, sizeof flight->spin);
    flight->rate = length3(flight->turn);
    if (f->dynamic < 0) return;
    swept_body_accelerate(&f->start, settings, flight->acceleration);
    swept_body_turn_from_start(f, settings->dt);
}

/* The start from which a body would come to the pose at t with these velocities. */
SADMM_CALLED void swept_body_leave(struct swept_body *f, const struct sadmm_settings *settings, double t,
                                   const struct sadmm_flight_pose *pose, vec3 linear, vec3 spin)
{
    const double dt = settings->dt, s = t / dt, k = swept_body_kept(&f->start, dt), share = 1 + s * (k - 1);
    const struct rigid_spin hit = {q_load(pose->orientation), spin};
    struct sadmm_rigid *start = &f->start;
    double gained[3];
    int j;
    swept_body_accelerate(start, settings, gained); /* dt a = (k - 1) v + what forces add */
    for (j = 0; j < 3; ++j) gained[j] = dt * gained[j] - (k - 1) * start->velocity[j];
    v3_store(v3_scale(v3_madd(linear, -s, v3_load(gained)), 1 / share), start->velocity);
    swept_body_accelerate(start, settings, f->flight.acceleration);
    for (j = 0; j < 3; ++j) {
        f->flight.position[j] = pose->position[j] - t * (start->velocity[j] + t / 2 * f->flight.acceleration[j]);
        start->position[j] = f->flight.position[j] - dt * dt / 2 * f->flight.acceleration[j];
    }
    start->was_hit = 1;
    swept_body_turn_from_hit(f, dt, t, hit);
    memcpy(f->flight.velocity, start->velocity, sizeof f->flight.velocity);
    f->flight.since = t;
}

/* What the step gives it by the time it ends: it stays airborne, and what contacts do not change is right from the
 * start. */
SADMM_INLINE void swept_body_end_velocity(const struct swept_body *f, const struct sadmm_settings *settings,
                                          double velocity[6])
{
    double gained[3];
    int k;
    swept_body_accelerate(&f->start, settings, gained);
    for (k = 0; k < 3; ++k) {
        velocity[k] = f->start.velocity[k] + settings->dt * gained[k];
        velocity[3 + k] = f->flight.spin[k];
    }
}

/* What loses most of its velocity within the step has no start from which it would come. */
SADMM_INLINE bool swept_body_is_damped(const struct sadmm_rigid *body, double dt)
{
    return body->damping[0] * dt > 1 || body->damping[1] * dt > 1;
}

/* The box that a shape sweeps from a hit on; from, to: its body's pose at that and at the step's end. */
SADMM_INLINE void swept_body_box(const struct sadmm_shape *shape, const struct sadmm_geometry *geometry,
                                 const struct sadmm_flight *flight, double dt, const struct sadmm_flight_pose *from,
                                 const struct sadmm_flight_pose *to, struct sadmm_box3 *box)
{
    const double left = dt - flight->since, arm = v3_norm(v3_load(shape->position)),
                 sags = left * left / 8 * v3_norm(v3_load(flight->acceleration)),
                 reach = arm + geometry_radius(geometry) + sags;
    int k;
    for (k = 0; k < 3; ++k) {
        const double rounding = 8 * DBL_EPSILON * (fabs(from->position[k]) + fabs(to->position[k]) + reach);
        box->lo[k] = min_of(from->position[k], to->position[k]) - reach - rounding;
        box->hi[k] = max_of(from->position[k], to->position[k]) + reach + rounding;
    }
}

/* ---- a hit ------------------------------------------------------------------------------------------------------- */

SADMM_INLINE void swept_body_hit_body(const struct swept_body *f, const struct sadmm_flight_pose *pose,
                                      struct hit_body *out)
{
    memset(out, 0, sizeof *out);
    out->linear = v3_load(pose->velocity);
    out->angular = v3_load(pose->spin);
    if (f->dynamic < 0) return;
    const mat3 R = q_matrix(q_load(pose->orientation));
    const double *I = f->start.inertia;
    const sym3 inverse = rigid_world_inertia(R, v3(1 / I[0], 1 / I[1], 1 / I[2]));
    out->inverse_mass = 1 / f->start.mass;
    out->inverse_inertia.r[0] = v3(inverse.xx, inverse.xy, inverse.xz);
    out->inverse_inertia.r[1] = v3(inverse.xy, inverse.yy, inverse.yz);
    out->inverse_inertia.r[2] = v3(inverse.xz, inverse.yz, inverse.zz);
}

/* hit->friction and restitution are set. */
SADMM_INLINE void swept_bodies_hit(const struct swept_body *const f[2], const struct sadmm_flight_touch *touch,
                                   double threshold, const struct sadmm_flight_pose pose[2], struct hit *hit)
{
    int side, k;
    hit->threshold = threshold;
    hit->frame.r[0] = v3_load(touch->normal);
    v3_tangents(hit->frame.r[0], &hit->frame.r[1], &hit->frame.r[2]);
    hit->count = touch->count;
    for (side = 0; side < 2; ++side) {
        swept_body_hit_body(f[side], &pose[side], &hit->body[side]);
        for (k = 0; k < touch->count; ++k)
            hit->arm[side][k] = v3_sub(v3_load(touch->point[k]), v3_load(pose[side].position));
    }
}

/* In place of where they touch, the body that is easier to turn through its centre of mass: however they turn on, that
 * comes no nearer. hit: swept_bodies_hit's. */
SADMM_INLINE void swept_bodies_hit_centre(const struct swept_body *const f[2], const struct sadmm_flight_pose pose[2],
                                          struct sadmm_flight_touch *touch, struct hit *hit)
{
    const bool of_b = f[0]->dynamic < 0 || (f[1]->dynamic >= 0 && v3_max_abs(v3_load(f[1]->start.inertia)) <
                                                                      v3_max_abs(v3_load(f[0]->start.inertia)));
    int side;
    touch->count = hit->count = 1;
    touch->feature[0] = INNER_BALL_FEATURE + of_b;
    memcpy(touch->point[0], pose[of_b].position, sizeof touch->point[0]);
    hit->friction = hit->restitution = 0;
    for (side = 0; side < 2; ++side)
        hit->arm[side][0] = v3_sub(v3_load(pose[of_b].position), v3_load(pose[side].position));
}

/* What the hit leaves together and forces press on each other: how fast the points part that part least, m/s, and how
 * much faster each second they come together again, within the step. */
#define SWEPT_HELD_TURNS 0.25 /* rad: what turns on by more touches elsewhere */
struct swept_bodies_held {
    double parts, falls; /* falls: 0: they are not held */
};

SADMM_INLINE struct swept_bodies_held swept_bodies_held_by(const struct sadmm_flight *a, const struct sadmm_flight *b,
                                                           double time, double dt, const struct hit *hit,
                                                           const vec3 linear[2], const vec3 spin[2])
{
    const double left = dt - time,
                 falls = -v3_dot(hit->frame.r[0], v3_sub(v3_load(b->acceleration), v3_load(a->acceleration)));
    struct swept_bodies_held held = {HUGE_VAL, 0};
    int k;
    for (k = 0; k < hit->count; ++k) {
        const vec3 at_a = v3_add(linear[0], v3_cross(spin[0], hit->arm[0][k])),
                   at_b = v3_add(linear[1], v3_cross(spin[1], hit->arm[1][k]));
        held.parts = min_of(held.parts, v3_dot(hit->frame.r[0], v3_sub(at_b, at_a)));
    }
    held.parts = max_of(held.parts, 0.0);
    if (falls > 0 && 2 * held.parts < falls * left &&
        (v3_norm(spin[0]) + v3_norm(spin[1])) * left < SWEPT_HELD_TURNS)
        held.falls = falls;
    return held;
}

/* They stay together: they begin the step at a separation of 0, and move on without what presses them. `along`: the
 * normal, times the body's share. */
SADMM_INLINE void swept_body_hold(struct swept_body *f, struct swept_bodies_held held, double t, double dt, vec3 along)
{
    const double apart = held.falls * (dt * dt - t * t) / 2 - t * held.parts;
    double way[3];
    int k;
    v3_store(along, way);
    for (k = 0; k < 3; ++k) {
        const double kept = held.falls * way[k];
        f->start.position[k] -= apart * way[k];
        f->flight.acceleration[k] += kept;
        f->flight.velocity[k] -= t * kept;
        f->flight.position[k] += t * t / 2 * kept;
    }
}

/* Both go on from the hit, which is solved. */
SADMM_INLINE void swept_bodies_part(struct swept_body *const f[2], const struct sadmm_settings *settings, double time,
                                    const struct sadmm_flight_pose pose[2], const struct hit *hit)
{
    vec3 linear[2], spin[2];
    int side;
    for (side = 0; side < 2; ++side) hit_apply(hit, side, &linear[side], &spin[side]);
    const struct swept_bodies_held held =
        swept_bodies_held_by(&f[0]->flight, &f[1]->flight, time, settings->dt, hit, linear, spin);
    const double mass = hit->body[0].inverse_mass + hit->body[1].inverse_mass;
    for (side = 0; side < 2; ++side) {
        if (f[side]->dynamic < 0) continue;
        ++f[side]->hits;
        swept_body_leave(f[side], settings, time, &pose[side], linear[side], spin[side]);
        if (held.falls > 0)
            swept_body_hold(f[side], held, time, settings->dt,
                            v3_scale(hit->frame.r[0], (side ? 1 : -1) * hit->body[side].inverse_mass / mass));
    }
}

/* ---- contacts after hits ----------------------------------------------------------------------------------------- */

/* How fast the two come closer at a point by their own motions, at the end of the sub-step, m/s. */
SADMM_INLINE double swept_bodies_approach(const struct sadmm_contact_pair *pair,
                                          const struct sadmm_contact_point *point, const struct sadmm_flight *a,
                                          const struct sadmm_flight *b, double dt)
{
    double across_a[3] = {0, 0, 0}, across_b[3] = {0, 0, 0}, speed = 0;
    int k;
    add_cross(pair->normal, a->spin, 1, across_a);
    add_cross(pair->normal, b->spin, 1, across_b);
    for (k = 0; k < 3; ++k)
        speed -= pair->normal[k] * (b->velocity[k] - a->velocity[k] + dt * (b->acceleration[k] - a->acceleration[k])) -
                 across_a[k] * point->arm_a[k] + across_b[k] * point->arm_b[k];
    return speed;
}

/* Separations are opened by so much more, and by no more than this share of the thinner shape: nothing goes through
 * where the touch of thin shapes is lost in rounding. */
#define SWEPT_OPEN        1e-6
#define SWEPT_OPENED_MOST 0.25
SADMM_INLINE void swept_bodies_open_separation(const struct sadmm_contact_pair *pair, const struct sadmm_flight *a,
                                               const struct sadmm_flight *b, double thinner,
                                               const struct sadmm_settings *settings, struct sadmm_contact_point *point)
{
    const double speed = swept_bodies_approach(pair, point, a, b, settings->dt),
                 way = (1 + SWEPT_OPEN) * speed * settings->dt;
    if (speed > settings->restitution_threshold && way > point->separation &&
        way - point->separation <= SWEPT_OPENED_MOST * thinner)
        point->separation = way;
}

#endif
