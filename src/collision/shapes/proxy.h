/* A shape in the world, this step: what every backend computes from a shape and its body before it tests pairs. */
#ifndef SADMM_COLLISION_SHAPES_PROXY_H
#define SADMM_COLLISION_SHAPES_PROXY_H

#include "collision/base/bounds.h"
#include "collision/base/midpoint.h"
#include "core/math/quat.h"
#include "geometry.h"
#include "shape.h"

struct sadmm_proxy {
    double R[9], x[3];  /* shape to world, row-major; centre, m: at the time offset's rotation (midpoint.h), not yet
                           moved */
    struct sadmm_geometry geometry; /* a copy: a pair needs no third place in memory */
    double arm[3];      /* centre relative to the body's centre of mass, m, world: likewise rotated */
    double com[3];      /* of the body, at the step's start */
    double velocity[3]; /* of the body, m/s */
    double angular[3];  /* of the body, rad/s */
    double time_offset; /* of its rotation, s: [0, dt / 2] */
    double spin, fall;  /* reach of rotation, and of the force and torque on the body, within the step, m */
    double thin;        /* smallest extent, m */
    double inertia;     /* of the body: its largest principal moment, kg m^2 */
    double friction, restitution;
    int32_t body, system_body;
    uint32_t revision, placed;
    int32_t mean, reserved[3]; /* of the body; whole pieces of 16 bytes */
};

/* The centre of mass of p's body in p's frame. */
SADMM_INLINE vec3 proxy_centre(const struct sadmm_proxy *p)
{
    double x[3];
    int i;
    for (i = 0; i < 3; ++i) x[i] = -(p->R[i] * p->arm[0] + p->R[3 + i] * p->arm[1] + p->R[6 + i] * p->arm[2]);
    return v3_load(x);
}

/* Rotation of a shape to its time offset. */
struct proxy_turn {
    double rate, time_offset; /* rad/s, s */
    quat body, shape;         /* to the world */
};

/* since: the body's orientation is the one that it has then, s after the step's start. */
SADMM_INLINE struct proxy_turn proxy_turn_since(const struct sadmm_shape *shape,
                                                const struct sadmm_collision_body *body, double since, double dt)
{
    const bool moves = sadmm_body_moves(body->system_body);
    const quat start = q_load(body->orientation);
    struct proxy_turn turn;
    turn.rate = moves ? turning_rate(body->velocity + 3) : 0;
    turn.time_offset = moves ? since + turn_time_offset(turn.rate, dt - since) : 0;
    turn.body = moves ? turned(start, body->velocity + 3, turn.time_offset - since) : start;
    turn.shape = q_normalize(q_mul(turn.body, q_load(shape->orientation)));
    return turn;
}
SADMM_INLINE struct proxy_turn proxy_turn_of(const struct sadmm_shape *shape, const struct sadmm_collision_body *body,
                                             double dt)
{
    return proxy_turn_since(shape, body, 0, dt);
}

/* The shape's box (bounds.h). Not of a plane. */
SADMM_INLINE void proxy_box(const struct sadmm_proxy *p, double dt, double margin, double gravity,
                            struct sadmm_box3 *box)
{
    double extent[3];
    geometry_extents(&p->geometry, p->R, extent);
    shape_box(p->x, extent, shape_reach(margin, p->thin, p->fall, fall_of(gravity, dt)), p->velocity, p->spin, dt, box);
}

/* A shape that is turned there: to the world, and its centre relative to the body's. */
struct proxy_pose {
    mat3 R;
    vec3 arm;
    double rate, time_offset; /* of its turn */
};
SADMM_INLINE struct proxy_pose proxy_pose_of(const struct sadmm_shape *shape, const struct proxy_turn *turn)
{
    struct proxy_pose pose;
    pose.R = q_matrix(turn->shape);
    pose.arm = m3_mul(q_matrix(turn->body), v3_load(shape->position));
    pose.rate = turn->rate, pose.time_offset = turn->time_offset;
    return pose;
}

/* `box` is left alone for a plane. gravity: its size, m/s^2. */
SADMM_INLINE void proxy_put(const struct sadmm_shape *shape, const struct sadmm_geometry *geometry,
                            const struct sadmm_collision_body *body, const struct proxy_pose *pose, double dt,
                            double margin, double gravity, struct sadmm_proxy *p, struct sadmm_box3 *box)
{
    const bool moves = sadmm_body_moves(body->system_body);
    double reach;
    int i;

    p->time_offset = pose->time_offset;
    p->geometry = *geometry;
    for (i = 0; i < 3; ++i) v3_store(pose->R.r[i], p->R + 3 * i);
    v3_store(pose->arm, p->arm);
    for (i = 0; i < 3; ++i) {
        p->com[i] = body->position[i];
        p->x[i] = body->position[i] + p->arm[i];
        p->velocity[i] = moves ? body->velocity[i] : 0;
        p->angular[i] = moves ? body->velocity[3 + i] : 0;
    }
    reach = v3_norm(pose->arm) + geometry_radius(geometry);
    p->spin = moves ? rotation_sweep(pose->rate, reach, dt) : 0;
    p->fall = moves ? own_fall(body->acceleration, reach, dt) : 0;
    p->thin = geometry_thickness(geometry);
    p->inertia = body->inertia;
    p->friction = shape->friction;
    p->restitution = shape->restitution;
    p->body = shape->body;
    p->system_body = body->system_body;
    p->revision = shape->revision;
    p->placed = body->placed;
    p->mean = body->mean;
    for (i = 0; i < 3; ++i) p->reserved[i] = 0;
    if (geometry->type != SADMM_SHAPE_PLANE) proxy_box(p, dt, margin, gravity, box);
}

/* turn: proxy_turn_of. */
SADMM_INLINE void proxy_place(const struct sadmm_shape *shape, const struct sadmm_geometry *geometry,
                              const struct sadmm_collision_body *body, const struct proxy_turn *turn, double dt,
                              double margin, double gravity, struct sadmm_proxy *p, struct sadmm_box3 *box)
{
    const struct proxy_pose pose = proxy_pose_of(shape, turn);
    proxy_put(shape, geometry, body, &pose, dt, margin, gravity, p, box);
}

/* Is a pair that was found there to be turned to it? Halfway is where shapes are placed. */
SADMM_INLINE bool is_midpoint(double time_offset, double dt) { return time_offset == 0.5 * dt; }

/* A shape of a pair that was found `time_offset` seconds into the step: where it is placed, or turned on in
 * `turned`. */
SADMM_INLINE const struct sadmm_proxy *proxy_at(const struct sadmm_proxy *p, double time_offset, double dt,
                                                struct sadmm_proxy *turned)
{
    double Q[9];
    int i, k;
    if (is_midpoint(time_offset, dt) || (p->angular[0] == 0 && p->angular[1] == 0 && p->angular[2] == 0)) return p;
    turn_between(p->angular, p->time_offset, time_offset, Q);
    *turned = *p;
    for (i = 0; i < 3; ++i) {
        for (k = 0; k < 3; ++k)
            turned->R[3 * i + k] = Q[3 * i] * p->R[k] + Q[3 * i + 1] * p->R[3 + k] + Q[3 * i + 2] * p->R[6 + k];
        turned->arm[i] = Q[3 * i] * p->arm[0] + Q[3 * i + 1] * p->arm[1] + Q[3 * i + 2] * p->arm[2];
        turned->x[i] = p->com[i] + turned->arm[i];
    }
    turned->time_offset = time_offset;
    return turned;
}

/* Where proxy_at has a shape, as in its proxy. */
struct proxy_place {
    double R[9], x[3], arm[3];
};
SADMM_INLINE void proxy_place_at(const struct sadmm_proxy *p, double time_offset, double dt, struct proxy_place *place)
{
    double Q[9];
    int i, k;
    if (is_midpoint(time_offset, dt) || (p->angular[0] == 0 && p->angular[1] == 0 && p->angular[2] == 0)) {
        for (i = 0; i < 9; ++i) place->R[i] = p->R[i];
        for (i = 0; i < 3; ++i) {
            place->x[i] = p->x[i];
            place->arm[i] = p->arm[i];
        }
        return;
    }
    turn_between(p->angular, p->time_offset, time_offset, Q);
    for (i = 0; i < 3; ++i) {
        for (k = 0; k < 3; ++k)
            place->R[3 * i + k] = Q[3 * i] * p->R[k] + Q[3 * i + 1] * p->R[3 + k] + Q[3 * i + 2] * p->R[6 + k];
        place->arm[i] = Q[3 * i] * p->arm[0] + Q[3 * i + 1] * p->arm[1] + Q[3 * i + 2] * p->arm[2];
        place->x[i] = p->com[i] + place->arm[i];
    }
}

SADMM_INLINE void rotate_to_world(const double R[9], vec3 v, double out[3])
{
    int k;
    for (k = 0; k < 3; ++k)
        out[k] = R[3 * k] * (double)v.x + R[3 * k + 1] * (double)v.y + R[3 * k + 2] * (double)v.z;
}

/* A plane's own part of what a pair with it reaches, m: what is not in the other shape's box. gravity: fall_of it. */
SADMM_INLINE double proxy_plane_reach(const struct sadmm_proxy *p, double margin, double gravity)
{
    return shape_reach(margin, p->thin, 0, gravity);
}

/* Up to which distance two shapes that come near without touching make contacts. */
SADMM_INLINE double proxy_near_limit(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double margin,
                                     double gravity, double dt)
{
    return pair_limit(margin, a->thin, b->thin, 0, 0, 0, a->fall, b->fall, fall_of(gravity, dt), dt);
}

/* pair_limit of two shapes. speed: relative_speed. */
SADMM_INLINE double proxy_limit(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double speed, double margin,
                                double gravity, double dt)
{
    return pair_limit(margin, a->thin, b->thin, speed, a->spin, b->spin, a->fall, b->fall, fall_of(gravity, dt), dt);
}

/* move_time_offset of two shapes. */
SADMM_INLINE double proxy_time_offset(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double speed, double dt)
{
    return move_time_offset(speed, a->thin < b->thin ? a->thin : b->thin, dt);
}

/* What b moves relative to a in `time_offset` seconds, m; 0 where velocities are so large that they leave no time. */
SADMM_INLINE double offset_displacement(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double time_offset,
                                        int axis)
{
    return time_offset > 0 ? time_offset * (b->velocity[axis] - a->velocity[axis]) : 0;
}

/* Of two dynamic bodies, what share of the way to one point in space the arms of p's take: most of it those of the one
 * that is harder to turn. */
SADMM_INLINE double proxy_share(const struct sadmm_proxy *p, const struct sadmm_proxy *other)
{
    const double inertia = p->inertia + other->inertia;
    return inertia > 0 ? p->inertia / inertia : 0.5;
}

/* Does the box come within `reach` of the plane? */
SADMM_INLINE bool proxy_plane_meets(const struct sadmm_proxy *plane, const struct sadmm_box3 *box, double reach)
{
    double height = 0, lowest = 0;
    int k;
    for (k = 0; k < 3; ++k) {
        double n = plane->R[3 * k + 2];
        height += n * (0.5 * (box->lo[k] + box->hi[k]) - plane->x[k]);
        lowest += fabs(n) * 0.5 * (box->hi[k] - box->lo[k]);
    }
    return height - lowest <= reach + 1e-12 * lowest;
}

#endif
