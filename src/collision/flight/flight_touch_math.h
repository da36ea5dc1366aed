/* flight_touch.h for whoever computes it: on the host (flight_touch.c) and on devices. Manifolds of smooth bodies as
 * the includer has them (pair_manifold.h). */
#ifndef SADMM_COLLISION_FLIGHT_FLIGHT_TOUCH_MATH_H
#define SADMM_COLLISION_FLIGHT_FLIGHT_TOUCH_MATH_H

#include <float.h>
#include <string.h>

#include "collision/manifold/pair_manifold.h"
#include "core/math/array3.h"
#include "core/math/rigid.h"
#include "flight.h"

/* Most moves towards a touch; a pair that takes more is the solve's. */
enum { TOUCH_MOVES = 256 };
/* Nearer than this share of the thinner shape, points are followed. */
#define TOUCH_NEAR        1e-3
/* Points within this share of it touch together: what a rounded pose takes for a plane is one. */
#define TOUCH_TOGETHER    1e-9
/* A separation of this share is none. */
#define TOUCH_NONE        1e-12
/* Where nothing near approaches fast enough, this share of the time is passed at once: a point that has come through by
 * then is followed back. */
#define TOUCH_PASSED      0.5
/* But no more than closes this share of the thinner shape, or it would come out on the other side. */
#define TOUCH_PASSED_WAY  0.25
/* Nor more than the two turn by so much in, rad: what turns may come through and go again. */
#define TOUCH_PASSED_TURN 0.25

/* Where moments differ. */
SADMM_INLINE struct rigid_spin flight_tumbled(const struct sadmm_flight *flight, double t)
{
    const struct rigid_spin spin = {q_load(flight->orientation), v3_load(flight->spin)};
    return t == flight->at ? spin : rigid_tumble(spin, v3_load(flight->inertia), t - flight->at);
}

SADMM_CALLED void flight_at(const struct sadmm_flight *flight, double t, struct sadmm_flight_pose *pose)
{
    const quat q = q_load(flight->orientation);
    const vec3 turn = v3_load(flight->turn);
    for (int k = 0; k < 3; ++k) {
        pose->position[k] = flight->position[k] + t * (flight->velocity[k] + t / 2 * flight->acceleration[k]);
        pose->velocity[k] = flight->velocity[k] + t * flight->acceleration[k];
    }
    if (flight->inertia[0] > 0) {
        const struct rigid_spin spin = flight_tumbled(flight, t);
        q_store(spin.orientation, pose->orientation);
        v3_store(spin.angular, pose->spin);
        return;
    }
    q_store(t == flight->at || v3_max_abs(turn) == 0 ? q : rigid_turn(q, turn, t - flight->at), pose->orientation);
    memcpy(pose->spin, flight->spin, sizeof pose->spin);
}

/* A shape at a moment. */
struct placed_shape {
    struct sadmm_flight_pose body;
    double R[9], x[3];
    double reach; /* farthest that a rotation of the body moves a point of the shape by, m / rad */
};

SADMM_INLINE void touch_place(const struct sadmm_swept_shape *s, double t, struct placed_shape *out)
{
    flight_at(s->flight, t, &out->body);
    const quat body = q_load(out->body.orientation);
    const mat3 R = q_matrix(q_normalize(q_mul(body, q_load(s->shape->orientation))));
    const vec3 arm = m3_mul(q_matrix(body), v3_load(s->shape->position));
    for (int i = 0; i < 3; ++i) v3_store(R.r[i], out->R + 3 * i);
    v3_store(v3_add(v3_load(out->body.position), arm), out->x);
    /* a ball that turns about its centre stays what it is */
    out->reach = v3_norm(arm) + (s->geometry->type == SADMM_SHAPE_SPHERE ? 0 : geometry_radius(s->geometry));
}

/* The pair at a moment. */
struct touch_moment {
    struct placed_shape a, b;
    struct pair_pose pose;
    double distance;   /* no less than this are they apart */
    double normal[3];  /* of the distance, world, from a to b */
    struct manifold m; /* where they are near */
    double manifold_normal[3];
};

SADMM_CALLED void touch_test(const struct sadmm_swept_pair *p, double t, struct touch_moment *at)
{
    vec3 n;
    touch_place(&p->a, t, &at->a);
    touch_place(&p->b, t, &at->b);
    at->pose = pair_pose(p->a.geometry->type == SADMM_SHAPE_PLANE, at->a.R, at->a.x, at->b.R, at->b.x);
    at->distance = (double)shapes_apart(p->a.geometry, p->b.geometry, p->hulls, p->subshape, &at->pose, &n);
    rotate_to_world(at->b.R, n, at->normal);
}

/* By the points that come near. */
SADMM_CALLED void touch_test_closely(const struct sadmm_swept_pair *p, struct touch_moment *at)
{
    at->m.count = 0;
    at->m.cache = 0;
    pair_manifold(p->a.geometry, p->b.geometry, p->hulls, p->subshape, &at->pose, SADMM_REAL_MAX, 0, &at->m);
    rotate_to_world(at->b.R, at->m.normal, at->manifold_normal);
    if (at->m.count > 0) memcpy(at->normal, at->manifold_normal, sizeof at->normal);
}

/* Of the manifold's k-th point, in the world. */
SADMM_INLINE void touch_point_at(const struct touch_moment *at, int k, double x[3])
{
    rotate_to_world(at->b.R, at->m.points[k].position, x);
    for (int j = 0; j < 3; ++j) x[j] += at->b.x[j];
}

SADMM_INLINE vec3 touch_velocity_at(const struct placed_shape *s, const double x[3])
{
    const vec3 arm = v3_sub(v3_load(x), v3_load(s->body.position));
    return v3_add(v3_load(s->body.velocity), v3_cross(v3_load(s->body.spin), arm));
}

/* How fast the surfaces approach at a point. */
SADMM_INLINE double touch_approach(const struct touch_moment *at, int k)
{
    double x[3];
    touch_point_at(at, k, x);
    const vec3 relative = v3_sub(touch_velocity_at(&at->b, x), touch_velocity_at(&at->a, x));
    return -v3_dot(relative, v3_load(at->manifold_normal));
}

/* How fast turning may bring what is nearest along the normal, m/s. */
SADMM_INLINE double touch_turning(const struct placed_shape *s, const struct sadmm_flight *flight, vec3 normal)
{
    return s->reach * (v3_norm(v3_cross(normal, v3_load(flight->turn))) + flight->sway);
}

/* The most that the pair closes along the normal until `to`, m/s. */
SADMM_INLINE double touch_closing(const struct sadmm_swept_pair *p, const struct touch_moment *at, double left)
{
    const vec3 n = v3_load(at->normal), v = v3_sub(v3_load(at->b.body.velocity), v3_load(at->a.body.velocity)),
               acceleration = v3_sub(v3_load(p->b.flight->acceleration), v3_load(p->a.flight->acceleration));
    const double falls = -v3_dot(n, acceleration);
    return -v3_dot(n, v) + (falls > 0 ? falls * left : 0) + touch_turning(&at->a, p->a.flight, n) +
           touch_turning(&at->b, p->b.flight, n);
}

/* ---- how long nothing comes through the plane between them ------------------------------------------------------- */

/* What of a shape's points is round about others that it has, which are tested in its place. */
SADMM_INLINE double touch_round_of(const struct sadmm_geometry *g)
{
    return g->type == SADMM_SHAPE_SPHERE || g->type == SADMM_SHAPE_CAPSULE ? g->size[0] : 0;
}

/* How far a shape reaches from its body's centre of mass against `along` where its points move by `by` besides. */
SADMM_CALLED double touch_lowest(const struct sadmm_swept_pair *p, const struct sadmm_swept_shape *s,
                                 const struct placed_shape *at, vec3 along, vec3 by)
{
    const double round = touch_round_of(s->geometry);
    const vec3 d = v3_add(along, by);
    const mat3 R = {{v3_load(at->R), v3_load(at->R + 3), v3_load(at->R + 6)}};
    const vec3 own = v3_scale(m3_tmul(R, d), -1 / v3_norm(d)),
               x = m3_mul(R, v3_madd(geometry_farthest(s->geometry, p->hulls, own), -round, own)),
               arm = v3_sub(v3_load(at->x), v3_load(at->body.position));
    return v3_dot(d, v3_add(arm, x)) - round;
}

/* By what it turns by at that moment. */
SADMM_INLINE vec3 touch_turned_by(const struct sadmm_swept_shape *s, const struct placed_shape *at, vec3 normal,
                                  double t)
{
    const vec3 w = v3_load(s->flight->inertia[0] > 0 ? at->body.spin : s->flight->turn);
    return v3_scale(v3_cross(normal, w), t);
}

/* How far ways of points that turn bend off a line, m/s^2. */
SADMM_INLINE double touch_bending(const struct sadmm_swept_shape *s, const struct placed_shape *at)
{
    const double reach = at->reach - (s->geometry->type == SADMM_SHAPE_CAPSULE ? touch_round_of(s->geometry) : 0);
    return reach * (s->flight->rate * s->flight->rate + s->flight->bend);
}

/* What is left between the two along the normal t seconds on, m, no more than it is. Concave in t: each point's height
 * is a line less what its way bends. */
SADMM_CALLED double touch_left_between(const struct sadmm_swept_pair *p, const struct touch_moment *at, double bends,
                                       double t)
{
    const vec3 n = v3_load(at->normal), x = v3_sub(v3_load(at->b.body.position), v3_load(at->a.body.position)),
               v = v3_sub(v3_load(at->b.body.velocity), v3_load(at->a.body.velocity)), back = v3_neg(n);
    const double of_b = touch_lowest(p, &p->b, &at->b, n, touch_turned_by(&p->b, &at->b, n, t)),
                 of_a = p->a.geometry->type == SADMM_SHAPE_PLANE
                            ? v3_dot(back, v3_sub(v3_load(at->a.x), v3_load(at->a.body.position)))
                            : touch_lowest(p, &p->a, &at->a, back, touch_turned_by(&p->a, &at->a, back, t));
    return v3_dot(n, v3_madd(x, t, v)) + of_b + of_a - bends * t * t / 2;
}

/* How long they come no closer than `room` past the plane, s, at least, `most` at most. */
SADMM_CALLED double touch_free_for(const struct sadmm_swept_pair *p, const struct touch_moment *at, double room,
                                   double most)
{
    const vec3 acceleration = v3_sub(v3_load(p->b.flight->acceleration), v3_load(p->a.flight->acceleration));
    const double bends = touch_bending(&p->a, &at->a) + touch_bending(&p->b, &at->b) +
                         max_of(-v3_dot(v3_load(at->normal), acceleration), 0),
                 now = touch_left_between(p, at, bends, 0) + room;
    if (!(now > 0)) return 0;
    const double trial = bends * most * most > 2 * now ? sqrt(2 * now / bends) : most,
                 then = touch_left_between(p, at, bends, trial) + room;
    return then >= 0 ? trial : trial * now / (now - then);
}

/* ---- the touch --------------------------------------------------------------------------------------------------- */

SADMM_INLINE double touch_thinner(const struct sadmm_swept_pair *p)
{
    return min_of(geometry_thickness(p->a.geometry), geometry_thickness(p->b.geometry));
}

/* Among points that approach fast enough the one that gets there first: by when, s; HUGE_VAL: there is none. */
SADMM_INLINE double touch_first_point(const struct sadmm_swept_pair *p, const struct touch_moment *at,
                                      double *separation)
{
    double first = HUGE_VAL;
    for (int k = 0; k < at->m.count; ++k) {
        const double speed = touch_approach(at, k), own = (double)at->m.points[k].separation;
        if (!(speed > p->threshold) || !(own / speed < first)) continue;
        first = own / speed;
        *separation = own;
    }
    return first;
}

/* What a separation is off by. */
SADMM_INLINE double touch_rounding(const struct touch_moment *at)
{
    double size = at->a.reach + at->b.reach;
    for (int k = 0; k < 3; ++k) size += fabs(at->a.body.position[k]) + fabs(at->b.body.position[k]);
    return 4 * DBL_EPSILON * size;
}

SADMM_INLINE void touch_keep(const struct touch_moment *at, double t, double together, struct sadmm_flight_touch *touch)
{
    touch->time = t;
    touch->count = 0;
    memcpy(touch->normal, at->manifold_normal, sizeof touch->normal);
    for (int k = 0; k < at->m.count; ++k) {
        if ((double)at->m.points[k].separation > together) continue;
        touch_point_at(at, k, touch->point[touch->count]);
        touch->feature[touch->count++] = at->m.points[k].feature;
    }
}

/* How long the pair may go unseen where it is near, s. */
SADMM_INLINE double touch_passed_at_once(const struct sadmm_swept_pair *p, double whole)
{
    const double rate = p->a.flight->rate + p->b.flight->rate;
    return rate * TOUCH_PASSED * whole > TOUCH_PASSED_TURN ? TOUCH_PASSED_TURN / rate : TOUCH_PASSED * whole;
}

/* Do balls around the two, about their centres of mass, meet within the time? Accelerations bend ways by `sags` at
 * most. */
SADMM_INLINE bool touch_balls_meet(const struct sadmm_swept_pair *p, double from, double to)
{
    const struct sadmm_flight *a = p->a.flight, *b = p->b.flight;
    const double left = to - from, reach = v3_norm(v3_load(p->a.shape->position)) + geometry_radius(p->a.geometry) +
                                           v3_norm(v3_load(p->b.shape->position)) + geometry_radius(p->b.geometry);
    double x[3], v[3], acceleration[3];
    if (p->a.geometry->type == SADMM_SHAPE_PLANE) return true;
    for (int k = 0; k < 3; ++k) {
        acceleration[k] = b->acceleration[k] - a->acceleration[k];
        v[k] = b->velocity[k] - a->velocity[k] + from * acceleration[k];
        x[k] = b->position[k] - a->position[k] + from * (b->velocity[k] - a->velocity[k] + from / 2 * acceleration[k]);
    }
    const double along = -dot3(x, v), square = dot3(v, v),
                 s = along <= 0              ? 0
                     : along < left * square ? along / square
                                             : left,
                 sags = left * left / 2 * length3(acceleration);
    for (int k = 0; k < 3; ++k) x[k] += s * v[k];
    return length3(x) <= (1 + TOUCH_NEAR) * (reach + sags);
}

/* A tumbling body's next look goes on from this one: it turns for long from where its flight has it. */
SADMM_INLINE void touch_go_on_from(struct sadmm_flight *flight, const struct placed_shape *at, double t)
{
    if (!(flight->inertia[0] > 0)) return;
    memcpy(flight->orientation, at->body.orientation, sizeof flight->orientation);
    memcpy(flight->spin, at->body.spin, sizeof flight->spin);
    flight->at = t;
}

/* flight: the pair's own, which are changed. */
SADMM_RARE bool touch_find(struct sadmm_swept_pair *p, struct sadmm_flight flight[2], double from, double to,
                           struct sadmm_flight_touch *touch)
{
    const double thin = touch_thinner(p), passed = touch_passed_at_once(p, to - from);
    struct touch_moment at;
    double t = from, low = from; /* low: nothing that approaches fast is through by then */
    for (int move = 0; move < TOUCH_MOVES; ++move) {
        double separation = 0, next, most;
        touch_test(p, t, &at);
        touch_go_on_from(&flight[0], &at.a, t);
        touch_go_on_from(&flight[1], &at.b, t);
        most = touch_closing(p, &at, to - t);
        if (at.distance > TOUCH_NEAR * thin) {
            if (!(most > p->threshold)) return false;
            low = t;
            t += max_of(at.distance / most, touch_free_for(p, &at, 0, to - t));
            if (!(t <= to)) return false;
            continue;
        }
        touch_test_closely(p, &at);
        most = touch_closing(p, &at, to - t); /* what touches has no distance to have a normal of */
        next = touch_first_point(p, &at, &separation);
        if (next < HUGE_VAL && (fabs(separation) <= TOUCH_NONE * thin + touch_rounding(&at) || t + next == t ||
                                (separation < 0 && t <= from) ||
                                (separation < 0 && t + next <= low &&
                                 min_of(-separation, (t - low) * most) <= TOUCH_NEAR * thin))) {
            touch_keep(&at, t, fabs(separation) + TOUCH_TOGETHER * thin, touch);
            return true;
        }
        if (next < HUGE_VAL && t + next <= to) {
            /* it has begun to approach since it touched, slowly: where it is fast it is through already */
            if (separation < 0) t = t + next > low ? t + next : (low + t) / 2;
            else low = t, t += next;
            continue;
        }
        /* what is near parts, or is slow: on to where another point may touch */
        if (!(t < to) || !(most > p->threshold)) return false;
        low = t;
        t = min_of(t + max_of(at.distance / most, touch_free_for(p, &at, TOUCH_PASSED_WAY * thin, passed)), to);
    }
    p->lost = true;
    return false;
}

/* Of one subshape. */
SADMM_CALLED bool swept_touch_of(struct sadmm_swept_pair *pair, double from, double to,
                                 struct sadmm_flight_touch *touch)
{
    struct sadmm_flight flight[2] = {*pair->a.flight, *pair->b.flight};
    struct sadmm_swept_pair own = *pair;
    if (!touch_balls_meet(pair, from, to)) return false;
    own.a.flight = &flight[0];
    own.b.flight = &flight[1];
    const bool found = touch_find(&own, flight, from, to, touch);
    pair->lost = pair->lost || own.lost;
    return found;
}

/* The earlier of the two. */
SADMM_INLINE bool touch_is_earlier(struct sadmm_swept_pair *pair, double from, double to, bool found,
                                  const struct sadmm_flight_touch *best, struct sadmm_flight_touch *touch)
{
    return swept_touch_of(pair, from, found ? best->time : to, touch) && (!found || touch->time < best->time);
}

SADMM_INLINE bool swept_touch(struct sadmm_swept_pair *pair, double from, double to,
                              struct sadmm_flight_touch *touch)
{
    const uint32_t subshapes = pair_subshapes(pair->a.geometry, pair->b.geometry);
    struct sadmm_flight_touch own;
    uint32_t first = 0;
    bool found = false;
    for (pair->subshape = 0; pair->subshape < subshapes; ++pair->subshape) {
        if (!touch_is_earlier(pair, from, to, found, touch, &own)) continue;
        *touch = own;
        first = pair->subshape;
        found = true;
    }
    pair->subshape = first;
    return found;
}

#endif
