#include "known_make.h"

#include <math.h>
#include <string.h>

#include "core/math/quat.h"

static const double g = 9.81, pi = 3.14159265358979323846;

/* ---- dice ------------------------------------------------------------------------------------------------------ */

struct dice {
    uint64_t state;
};

/* SplitMix64. */
static double between(struct dice *d, double low, double high)
{
    uint64_t x = d->state += 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    return low + (high - low) * (double)(x >> 11) * 0x1p-53;
}

static double by_ratio(struct dice *d, double low, double high) { return low * pow(high / low, between(d, 0, 1)); }

static vec3 direction(struct dice *d)
{
    const double z = between(d, -1, 1), turn = between(d, 0, 2 * pi), across = sqrt(1 - z * z);
    return v3(across * cos(turn), across * sin(turn), z);
}

static vec3 level_direction(struct dice *d)
{
    const double turn = between(d, 0, 2 * pi);
    return v3(cos(turn), sin(turn), 0);
}

static quat turned(vec3 axis, double angle) { return q_exp(v3_scale(axis, angle)); }

/* ---- parts of motions ------------------------------------------------------------------------------------------ */

/* Moments of what reaches so far along its axes, each a share of the scale. */
static void give_moments(struct dice *d, struct exact_body *body, double scale, double low, double high)
{
    double square[3];
    for (int k = 0; k < 3; ++k) square[k] = pow(scale * between(d, low, high), 2) / 5;
    for (int k = 0; k < 3; ++k) body->inertia[k] = body->mass * (square[(k + 1) % 3] + square[(k + 2) % 3]);
}

static struct exact_body *add_body(struct dice *d, struct known_motion *m)
{
    struct exact_body *body = &m->system.bodies[m->system.body_count++];
    body->mass = 4000 * pow(m->scale, 3) * between(d, 0.5, 2);
    body->state.orientation[0] = 1;
    give_moments(d, body, m->scale, 0.5, 1);
    return body;
}

static struct exact_link *add_link(struct known_motion *m, enum exact_link_kind kind, enum exact_hold hold, int a,
                                   int b)
{
    struct exact_link *link = &m->system.links[m->system.link_count++];
    *link = (struct exact_link){.kind = kind, .hold = hold, .a = a, .b = b};
    return link;
}

static void add_shape(struct known_motion *m, int body, sadmm_shape_type type, vec3 centre, double x, double y,
                      double z)
{
    sadmm_shape_def *shape = &m->shapes[body];
    *shape = sadmm_shape_def_default();
    shape->type = type;
    shape->size[0] = x, shape->size[1] = y, shape->size[2] = z;
    v3_store(centre, shape->position);
    m->has_shapes = true;
}

static struct exact_surface surface_of(enum exact_surface_kind kind, vec3 centre, double x, double y, double z)
{
    struct exact_surface surface = {.kind = kind, .size = {x, y, z}, .axis = {0, 0, 1}};
    v3_store(centre, surface.centre);
    return surface;
}

static vec3 in_body(const sadmm_body_state *s, vec3 x) { return m3_tmul(q_matrix(q_load(s->orientation)), x); }

static vec3 speed_at(const sadmm_body_state *s, vec3 arm)
{
    return v3_add(v3_load(s->linear_velocity), v3_cross(v3_load(s->angular_velocity), arm));
}

/* The body of the link touches the ground, over a place, and rolls, or slides along nothing, by its spin. */
static void put_down(struct known_motion *m, const struct exact_link *link, vec3 over)
{
    sadmm_body_state *s = &m->system.bodies[link->b].state;
    double at[3];
    exact_lowest(&link->surface[1], s, at);
    const vec3 arm = v3_load(at), v = v3_neg(v3_cross(v3_load(s->angular_velocity), arm));
    v3_store(v3_sub(over, arm), s->position);
    v3_store(link->hold == EXACT_SLIDES ? v3(0, 0, v.z) : v, s->linear_velocity);
}

static enum exact_hold hold_of(struct known_motion *m, bool ice)
{
    m->friction = ice ? 0 : 10;
    return ice ? EXACT_SLIDES : EXACT_GRIPS;
}

static double slowest(const struct known_motion *m) { return sqrt(g / m->scale); }

/* ---- in flight ------------------------------------------------------------------------------------------------- */

static void make_thrown(struct dice *d, struct known_motion *m, int equal)
{
    struct exact_body *body = add_body(d, m);
    if (equal) body->inertia[1] = body->inertia[2] = body->inertia[0];
    v3_store(v3_scale(direction(d), between(d, 0, 5)), body->state.linear_velocity);
    v3_store(v3_scale(direction(d), slowest(m) * between(d, 0.3, 1)), body->state.angular_velocity);
    q_store(turned(direction(d), between(d, 0, pi)), body->state.orientation);
}

static struct exact_body *add_ball(struct dice *d, struct known_motion *m, double radius)
{
    struct exact_body *ball = add_body(d, m);
    const int place = m->system.body_count - 1;
    for (int k = 0; k < 3; ++k) ball->inertia[k] = 0.4 * ball->mass * radius * radius;
    add_shape(m, place, SADMM_SHAPE_SPHERE, v3(0, 0, 0), radius, 0, 0);
    return ball;
}

static void make_bounces(struct dice *d, struct known_motion *m, int variant)
{
    struct exact_body *ball = add_ball(d, m, m->scale);
    const double speed = slowest(m) * m->scale;
    (void)variant;
    m->ground = GROUND_SOLID;
    m->event = EVENT_HITS_GROUND;
    m->friction = between(d, 0, 0.8);
    m->restitution = between(d, 0.5, 1);
    m->seconds *= 1.5;
    ball->state.position[2] = m->scale * between(d, 1.2, 2);
    v3_store(v3_scale(level_direction(d), speed * between(d, 0, 1)), ball->state.linear_velocity);
    ball->state.linear_velocity[2] = -speed * between(d, 0, 1);
    v3_store(v3_scale(direction(d), slowest(m) * between(d, 0, 1)), ball->state.angular_velocity);
}

static void make_hit(struct dice *d, struct known_motion *m, int variant)
{
    const double radius[2] = {m->scale, m->scale * between(d, 0.5, 1)}, reach = radius[0] + radius[1],
                 speed = slowest(m) * m->scale * between(d, 1, 4), gap = reach * between(d, 0.2, 1);
    const vec3 way = direction(d);
    vec3 across, other;
    (void)variant;
    v3_tangents(way, &across, &other);
    m->event = EVENT_HITS_BALL;
    m->friction = between(d, 0, 0.8);
    m->restitution = between(d, 0.1, 1);
    m->seconds = 2 * gap / speed;
    for (int i = 0; i < 2; ++i) {
        struct exact_body *ball = add_ball(d, m, radius[i]);
        v3_store(v3_scale(direction(d), speed / m->scale * between(d, 0, 0.3)), ball->state.angular_velocity);
        if (!i) continue;
        v3_store(v3_madd(v3_scale(way, reach + gap), reach * between(d, 0, 0.7), across), ball->state.position);
        v3_store(v3_scale(way, -speed), ball->state.linear_velocity);
    }
}

/* ---- sliding and skidding -------------------------------------------------------------------------------------- */

static void make_slides(struct dice *d, struct known_motion *m, int stops)
{
    struct exact_body *box = add_body(d, m);
    const double slope = stops ? 0 : between(d, 0.3, 0.6), half[3] = {m->scale, m->scale * 0.8, m->scale * 0.3},
                 turn = between(d, 0, 2 * pi), speed = slowest(m) * m->scale * between(d, 0.3, 1);
    m->ground = GROUND_SOLID;
    m->friction = between(d, 0.1, 0.3);
    m->gravity[0] = g * sin(slope), m->gravity[2] = -g * cos(slope);
    sadmm_box_inertia(box->mass, half, box->inertia);
    add_shape(m, 0, SADMM_SHAPE_BOX, v3(0, 0, 0), half[0], half[1], half[2]);
    q_store(turned(v3(0, 0, 1), turn), box->state.orientation);
    box->state.position[2] = half[2];
    box->state.linear_velocity[0] = speed;
    m->system.gravity[0] = m->gravity[0] + m->friction * m->gravity[2]; /* all that accelerates it */
    m->system.gravity[2] = 0;
    if (!stops) return;
    m->event = EVENT_STOPS;
    m->event_time = speed / (m->friction * g);
    m->seconds = m->event_time * between(d, 1.2, 1.6);
}

/* A ball, a capsule or a cylinder down a slope. */
static void make_rolls(struct dice *d, struct known_motion *m, int variant)
{
    struct exact_body *body = add_body(d, m);
    const double slope = between(d, 0.1, 0.6);
    const sadmm_shape_type type = m->number % 3 == 0   ? SADMM_SHAPE_SPHERE
                                  : m->number % 3 == 1 ? SADMM_SHAPE_CAPSULE
                                                       : SADMM_SHAPE_CYLINDER;
    (void)variant;
    m->ground = GROUND_SOLID;
    m->gravity[0] = g * sin(slope), m->gravity[2] = -g * cos(slope);
    memcpy(m->system.gravity, m->gravity, sizeof m->gravity);
    struct exact_link *link = add_link(m, EXACT_ON_GROUND, hold_of(m, false), -1, 0);
    link->surface[1] = surface_of(EXACT_BALL, v3(0, 0, 0), m->scale, 0, 0);
    add_shape(m, 0, type, v3(0, 0, 0), m->scale, m->scale * between(d, 0.4, 1), 0);
    m->shapes[0].orientation[0] = m->shapes[0].orientation[1] = sqrt(0.5); /* along y */
    body->state.angular_velocity[1] = slowest(m) * between(d, 0, 1);
    put_down(m, link, v3(0, 0, 0));
}

/* A ball that is set down with any speed and spin: friction turns it until it rolls, after 2/7 of its slip / (mu g). */
static void make_skids(struct dice *d, struct known_motion *m, int variant)
{
    struct exact_body *ball = add_ball(d, m, m->scale);
    (void)variant;
    m->ground = GROUND_SOLID;
    m->friction = between(d, 0.1, 0.5);
    struct exact_link *link = add_link(m, EXACT_ON_GROUND, EXACT_SLIDES, -1, 0);
    link->friction = m->friction;
    link->surface[1] = surface_of(EXACT_BALL, v3(0, 0, 0), m->scale, 0, 0);
    ball->state.position[2] = m->scale;
    v3_store(v3_scale(level_direction(d), slowest(m) * m->scale * between(d, 0.5, 1.5)), ball->state.linear_velocity);
    v3_store(v3_scale(direction(d), slowest(m) * between(d, 0.5, 1.5)), ball->state.angular_velocity);
    const vec3 slip = speed_at(&ball->state, v3(0, 0, -m->scale));
    v3_store(v3_scale(slip, 1 / v3_norm(slip)), link->way);
    m->event = EVENT_GRIPS;
    m->event_time = v3_norm(slip) / (3.5 * m->friction * g);
    m->seconds = m->event_time * between(d, 1.2, 1.6);
}

/* ---- rocking and rolling --------------------------------------------------------------------------------------- */

/* A body whose centre of mass is off its middle, so that this is above it: tilted, and spinning a little. */
static void lean(struct dice *d, const struct known_motion *m, struct exact_body *body, double most)
{
    const quat tilt = turned(level_direction(d), between(d, 0.3, most)),
               yaw = turned(v3(0, 0, 1), between(d, 0, 2 * pi));
    q_store(q_mul(tilt, q_mul(yaw, q_load(body->state.orientation))), body->state.orientation);
    v3_store(v3_scale(direction(d), slowest(m) * between(d, 0, 0.4)), body->state.angular_velocity);
}

static void make_ball(struct dice *d, struct known_motion *m, int ice)
{
    struct exact_body *body = add_body(d, m);
    const quat axes = turned(direction(d), between(d, 0, pi)); /* of the moments: any */
    const quat back = {axes.w, -axes.x, -axes.y, -axes.z};
    const vec3 middle = m3_mul(q_matrix(back), v3(0, 0, m->scale * between(d, 0.2, 0.6)));
    struct exact_link *link = add_link(m, EXACT_ON_GROUND, hold_of(m, ice), -1, 0);
    link->surface[1] = surface_of(EXACT_BALL, middle, m->scale, 0, 0);
    add_shape(m, 0, SADMM_SHAPE_SPHERE, middle, m->scale, 0, 0);
    q_store(axes, body->state.orientation);
    lean(d, m, body, 1);
    put_down(m, link, v3(0, 0, 0));
}

static void make_ellipsoid(struct dice *d, struct known_motion *m, int ice)
{
    struct exact_body *body = add_body(d, m);
    double a[3], least = HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
        a[k] = m->scale * between(d, 0.6, 1.3);
        least = fmin(least, a[k]);
    }
    const vec3 middle = v3(0, 0, least * between(d, 0.3, 0.6));
    struct exact_link *link = add_link(m, EXACT_ON_GROUND, hold_of(m, ice), -1, 0);
    link->surface[1] = surface_of(EXACT_ELLIPSOID, middle, a[0], a[1], a[2]);
    add_shape(m, 0, SADMM_SHAPE_ELLIPSOID, middle, a[0], a[1], a[2]);
    lean(d, m, body, 0.7);
    put_down(m, link, v3(0, 0, 0));
}

/* A cylinder or a capsule on its side, along y. */
static void make_roller(struct dice *d, struct known_motion *m, int ice)
{
    struct exact_body *body = add_body(d, m);
    const vec3 middle = v3(0, 0, m->scale * between(d, 0.2, 0.6));
    const vec3 up = v3(0, 0, 1), y = v3(0, 1, 0);
    const quat yaw = turned(up, between(d, 0, 2 * pi));
    struct exact_link *link = add_link(m, EXACT_ON_GROUND, hold_of(m, ice), -1, 0);
    link->surface[1] = surface_of(EXACT_BALL, middle, m->scale, 0, 0);
    add_shape(m, 0, m->number / 2 % 2 ? SADMM_SHAPE_CAPSULE : SADMM_SHAPE_CYLINDER, middle, m->scale,
              m->scale * between(d, 0.4, 1), 0);
    m->shapes[0].orientation[0] = m->shapes[0].orientation[1] = sqrt(0.5);
    q_store(q_mul(yaw, turned(y, between(d, 0.4, 1))), body->state.orientation);
    v3_store(v3_scale(m3_mul(q_matrix(yaw), y), slowest(m) * between(d, -0.4, 0.4)), body->state.angular_velocity);
    put_down(m, link, v3(0, 0, 0));
}

/* On the edge of a cap or a base. */
static void make_rim(struct dice *d, struct known_motion *m, int cone)
{
    struct exact_body *body = add_body(d, m);
    const double radius = m->scale, half = m->scale * (cone ? between(d, 0.5, 0.9) : between(d, 0.1, 0.3)),
                 low = cone ? -half / 2 : -half, steep = cone ? pi / 2 - atan(radius / (2 * half)) : pi / 2,
                 tilt = between(d, 0.3, 0.8) * steep;
    struct exact_link *link = add_link(m, EXACT_ON_GROUND, hold_of(m, false), -1, 0);
    const double across =
                     cone ? 0.15 * (radius * radius + half * half) : radius * radius / 4 + half * half / 3,
                 along = cone ? 0.3 * radius * radius : radius * radius / 2;
    body->inertia[0] = body->inertia[1] = body->mass * across;
    body->inertia[2] = body->mass * along;
    link->surface[1] = surface_of(EXACT_RIM, v3(0, 0, low), radius, 0, 0);
    add_shape(m, 0, cone ? SADMM_SHAPE_CONE : SADMM_SHAPE_CYLINDER, v3(0, 0, cone ? half / 2 : 0), radius, half, 0);
    q_store(turned(level_direction(d), tilt), body->state.orientation);
    const vec3 axis = m3_mul(q_matrix(q_load(body->state.orientation)), v3(0, 0, 1));
    v3_store(v3_add(v3_scale(axis, slowest(m) * between(d, -1.5, 1.5)),
                    v3_scale(v3(0, 0, 1), slowest(m) * between(d, -2, 2))),
             body->state.angular_velocity);
    m->lean[0] = cos(0.95 * steep), m->lean[1] = cos(0.05 * steep);
    m->seconds *= 0.5;
    put_down(m, link, v3(0, 0, 0));
}

/* A cone on its side goes round its tip, which stays at the origin; down the slope and back. */
static void make_cone(struct dice *d, struct known_motion *m, int variant)
{
    struct exact_body *body = add_body(d, m);
    const double radius = m->scale * between(d, 0.4, 1), half = m->scale * between(d, 0.5, 0.9),
                 slope = between(d, 0.1, 0.3), way = between(d, 0.4, 1.2),
                 speed = slowest(m) * between(d, -0.2, 0.2), angle = atan(radius / (2 * half));
    const vec3 y = v3(0, 1, 0), z = v3(0, 0, 1);
    (void)variant;
    body->inertia[0] = body->inertia[1] = body->mass * 0.15 * (radius * radius + half * half);
    body->inertia[2] = body->mass * 0.3 * radius * radius;
    m->gravity[0] = g * sin(slope), m->gravity[2] = -g * cos(slope);
    memcpy(m->system.gravity, m->gravity, sizeof m->gravity);
    add_shape(m, 0, SADMM_SHAPE_CONE, v3(0, 0, half / 2), radius, half, 0);
    struct exact_link *tip = add_link(m, EXACT_ON_GROUND, hold_of(m, false), -1, 0),
                      *edge = add_link(m, EXACT_ON_GROUND, EXACT_GRIPS_ACROSS, -1, 0);
    tip->surface[1] = surface_of(EXACT_RIM, v3(0, 0, 1.5 * half), 0, 0, 0);
    edge->surface[1] = surface_of(EXACT_RIM, v3(0, 0, -half / 2), radius, 0, 0);
    /* its axis points from the base to the tip: down to it, along -x turned by `way` */
    const quat yaw = turned(z, way);
    q_store(q_mul(yaw, turned(y, -(pi / 2 + angle))), body->state.orientation);
    v3_store(v3_scale(m3_mul(q_matrix(yaw), v3(1, 0, 0)), -speed / tan(angle)), body->state.angular_velocity);
    const vec3 arm = m3_mul(q_matrix(q_load(body->state.orientation)), v3(0, 0, 1.5 * half));
    v3_store(v3_neg(arm), body->state.position);
    v3_store(v3_neg(v3_cross(v3_load(body->state.angular_velocity), arm)), body->state.linear_velocity);
    m->seconds *= 2;
}

/* ---- two that rock on each other ------------------------------------------------------------------------------- */

enum pair_kind { PAIR_OF_BALLS, PAIR_ON_ICE, PAIR_OF_ROLLERS };

static void make_pair(struct dice *d, struct known_motion *m, int kind)
{
    const double radius[2] = {m->scale * between(d, 1.5, 2), m->scale * between(d, 0.6, 1)};
    const enum exact_hold hold = hold_of(m, kind == PAIR_ON_ICE);
    const vec3 y = v3(0, 1, 0);
    vec3 middle[2] = {{0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < 2; ++i) {
        struct exact_body *body = add_body(d, m);
        middle[i] = v3(0, 0, radius[i] * (i ? between(d, 0.8, 0.95) : between(d, 0.3, 0.6)));
        if (i == 0) body->mass *= between(d, 2, 5);
        give_moments(d, body, radius[i], 0.5, 1);
        const double tilt = between(d, 0.1, 0.3) * (i ? -1 : 1);
        q_store(kind == PAIR_OF_ROLLERS ? turned(y, tilt) : turned(level_direction(d), tilt), body->state.orientation);
        add_shape(m, i, kind == PAIR_OF_ROLLERS ? SADMM_SHAPE_CYLINDER : SADMM_SHAPE_SPHERE, middle[i], radius[i],
                  m->scale * between(d, 0.5, 1), 0);
        if (kind == PAIR_OF_ROLLERS) m->shapes[i].orientation[0] = m->shapes[i].orientation[1] = sqrt(0.5);
    }
    struct exact_link *low = add_link(m, EXACT_ON_GROUND, hold, -1, 0), *high = add_link(m, EXACT_ON_BALL, hold, 0, 1);
    low->surface[1] = high->surface[0] = surface_of(EXACT_BALL, middle[0], radius[0], 0, 0);
    high->surface[1] = surface_of(EXACT_BALL, middle[1], radius[1], 0, 0);
    put_down(m, low, v3(0, 0, 0));
    const double slant = between(d, -0.1, 0.1);
    const vec3 normal = m3_mul(q_matrix(kind == PAIR_OF_ROLLERS ? turned(y, slant) : turned(level_direction(d), slant)),
                               v3(0, 0, 1));
    sadmm_body_state *state[2] = {&m->system.bodies[0].state, &m->system.bodies[1].state};
    const vec3 centre = v3_add(v3_load(state[0]->position), m3_mul(q_matrix(q_load(state[0]->orientation)), middle[0]));
    v3_store(v3_sub(v3_madd(centre, radius[0] + radius[1], normal),
                    m3_mul(q_matrix(q_load(state[1]->orientation)), middle[1])),
             state[1]->position);
    m->seconds *= kind == PAIR_ON_ICE ? 0.5 : 1;
}

/* ---- on joints ------------------------------------------------------------------------------------------------- */

/* One or two bodies that hang on points, or on axes of any direction, and spin. */
static void hang(struct dice *d, struct known_motion *m, int bodies, bool axes, double spin)
{
    vec3 place = v3(0, 0, 0), still = v3(0, 0, 0), turning = v3(0, 0, 0);
    m->jointed = true;
    for (int i = 0; i < bodies; ++i) {
        struct exact_body *body = add_body(d, m);
        const vec3 arm = v3_scale(direction(d), m->scale * between(d, 0.5, 1)); /* from the joint, world */
        const quat q = turned(direction(d), between(d, 0, pi));
        struct exact_link *point = add_link(m, EXACT_POINT, EXACT_GRIPS, i - 1, i);
        q_store(q, body->state.orientation);
        v3_store(v3_neg(m3_tmul(q_matrix(q), arm)), point->point[1]);
        v3_store(i ? in_body(&body[-1].state, v3_sub(place, v3_load(body[-1].state.position))) : place,
                 point->point[0]);
        vec3 w = v3_scale(axes ? direction(d) : spin > 1 ? arm : direction(d), slowest(m) * between(d, 0.5, 1) * spin);
        if (spin > 1) w = v3_scale(w, 1 / v3_norm(arm));
        if (axes) {
            struct exact_link *axis = add_link(m, EXACT_AXIS, EXACT_GRIPS, i - 1, i);
            const vec3 along = v3_scale(w, 1 / v3_norm(w));
            v3_store(i ? in_body(&body[-1].state, along) : along, axis->axis);
            w = v3_add(w, turning);
        }
        v3_store(w, body->state.angular_velocity);
        v3_store(v3_add(place, arm), body->state.position);
        v3_store(v3_add(still, v3_cross(w, arm)), body->state.linear_velocity);
        const vec3 next = v3_scale(direction(d), m->scale * between(d, 0.5, 1)); /* from the centre of mass */
        still = speed_at(&body->state, next);
        place = v3_add(v3_load(body->state.position), next);
        turning = w;
    }
}

static void make_pendulum(struct dice *d, struct known_motion *m, int bodies) { hang(d, m, bodies, false, 0.5); }
static void make_hinged(struct dice *d, struct known_motion *m, int bodies) { hang(d, m, bodies, true, 0.5); }
static void make_top(struct dice *d, struct known_motion *m, int bodies) { hang(d, m, bodies, false, 3); }

/* ---- all of them ----------------------------------------------------------------------------------------------- */

static const struct kind {
    const char *name;
    void (*make)(struct dice *d, struct known_motion *m, int variant);
    int variant;
    enum known_ground ground; /* where `make` leaves it */
    int order;
} kinds[] = {
    {"thrown, equal moments", make_thrown, 1, GROUND_NONE, 0},
    {"thrown, three moments", make_thrown, 0, GROUND_NONE, 2},
    {"two balls hit", make_hit, 0, GROUND_NONE, 0},
    {"a ball bounces", make_bounces, 0, GROUND_SOLID, 0},
    {"a box slides down a slope", make_slides, 0, GROUND_SOLID, 0},
    {"a box slides until it stops", make_slides, 1, GROUND_SOLID, 2},
    {"round bodies roll down a slope", make_rolls, 0, GROUND_SOLID, 0},
    {"a ball skids until it rolls", make_skids, 0, GROUND_SOLID, 2},
    {"a ball rolls, off centre", make_ball, 0, GROUND_SOLID, 2},
    {"a ball off centre on triangles", make_ball, 0, GROUND_CLOTH, 2},
    {"a ball off centre on ice", make_ball, 1, GROUND_SOLID, 2},
    {"an ellipsoid rolls", make_ellipsoid, 0, GROUND_SOLID, 2},
    {"an ellipsoid on triangles", make_ellipsoid, 0, GROUND_CLOTH, 2},
    {"an ellipsoid on ice", make_ellipsoid, 1, GROUND_SOLID, 2},
    {"cylinders and capsules rock", make_roller, 0, GROUND_SOLID, 2},
    {"cylinders and capsules on triangles", make_roller, 0, GROUND_CLOTH, 1},
    {"cylinders and capsules on ice", make_roller, 1, GROUND_SOLID, 2},
    {"a disc rolls on its edge", make_rim, 0, GROUND_SOLID, 2},
    {"a cone rolls on its base's edge", make_rim, 1, GROUND_SOLID, 1},
    {"a cone on that edge on triangles", make_rim, 1, GROUND_CLOTH, 1},
    {"a cone rolls on its side", make_cone, 0, GROUND_SOLID, 2},
    {"a cone on its side on triangles", make_cone, 0, GROUND_CLOTH, 1},
    {"a ball rocks on a ball that rocks", make_pair, PAIR_OF_BALLS, GROUND_SOLID, 2},
    {"a ball on a ball, on ice", make_pair, PAIR_ON_ICE, GROUND_SOLID, 1},
    {"a cylinder on a cylinder that rocks", make_pair, PAIR_OF_ROLLERS, GROUND_SOLID, 2},
    {"a body on a ball joint", make_pendulum, 1, GROUND_NONE, 2},
    {"two in a row on ball joints", make_pendulum, 2, GROUND_NONE, 2},
    {"a top", make_top, 1, GROUND_NONE, 2},
    {"a body on a hinge", make_hinged, 1, GROUND_NONE, 2},
    {"two in a row on hinges", make_hinged, 2, GROUND_NONE, 2},
};

int known_motion_kinds(void) { return (int)(sizeof kinds / sizeof *kinds); }
const char *known_motion_name(int kind) { return kinds[kind].name; }
int known_motion_order(int kind) { return kinds[kind].order; }

static void draw(int kind, int number, int attempt, struct known_motion *m)
{
    struct dice d = {((uint64_t)kind << 40) + ((uint64_t)number << 20) + (uint64_t)attempt};
    between(&d, 0, 1);
    *m = (struct known_motion){.kind = kind, .number = number, .gravity = {0, 0, -g}, .ground = kinds[kind].ground,
                               .odd_ground = number % 2 != 0};
    memcpy(m->system.gravity, m->gravity, sizeof m->gravity);
    m->scale = by_ratio(&d, 0.03, 0.3);
    m->seconds = 4 * sqrt(m->scale / g);
    kinds[kind].make(&d, m, kinds[kind].variant);
    m->dt = m->seconds / floor(between(&d, 60, KNOWN_FRAMES));
}

/* ---- what is taken --------------------------------------------------------------------------------------------- */

/* Contacts press by a part of the weight all the while, what hits does so faster than the threshold of restitution, and
 * what leans does not fall over. */
static bool holds(const struct known_motion *drawn)
{
    enum { SAMPLES = 100 };
    struct known_motion m = *drawn;
    double now = 0;
    m.system.least_load = HUGE_VAL;
    for (int k = 0; k < SAMPLES; ++k) {
        known_motion_advance(&m, &now, m.seconds / SAMPLES);
        const double up = m3_mul(q_matrix(q_load(m.system.bodies[0].state.orientation)), v3(0, 0, 1)).z;
        if (m.lean[1] > 0 && (fabs(up) < m.lean[0] || fabs(up) > m.lean[1])) return false;
        if (m.event == EVENT_NONE && m.system.least_load < 0.2 * m.system.bodies[m.system.body_count - 1].mass * g)
            return false;
    }
    if (m.event == EVENT_HITS_GROUND || m.event == EVENT_HITS_BALL)
        return m.system.least_load < HUGE_VAL &&
               m.system.least_load > 0.3 * m.system.bodies[m.system.body_count - 1].mass;
    return true;
}

void known_motion_make(int kind, int number, struct known_motion *motion)
{
    int attempt = 0;
    do draw(kind, number, attempt++, motion);
    while (!holds(motion) && attempt < 1000);
    motion->system.least_load = HUGE_VAL;
}
