/* A character: an upright capsule that is moved by shape casts, as games do it, and walks as far as they let it. It
 * slides along what is in its way, climbs steps and slopes up to a limit, falls, rides what it stands on, and pushes
 * what moves with a force of its own. It is a kinematic body, so that others feel it; what stops it, the casts decide.
 *
 * Every station below is a walk of its own, and says whether it ended as it should. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>

#include <subadmm/subadmm.h>

static const double radius = 0.3, half_length = 0.6; /* m: 1.8 m tall */
static const double skin = 0.01;                     /* m, kept from everything */
static const double most_step = 0.35;                /* m */
static const double least_up = 0.70710678118654752;  /* of a normal it stands on: slopes up to 45 degrees */
static const double push_force = 250;                /* N */
static const double walking_speed = 1.5;             /* m/s */
static const double upright[4] = {1, 0, 0, 0}, down[3] = {0, 0, -1}, up[3] = {0, 0, 1};

struct character {
    sadmm_world *world;
    sadmm_body_id body;
    sadmm_shape_def capsule;
    sadmm_query_filter filter; /* all but itself */
    double position[3];        /* of its middle, m */
    double falling;            /* speed down, m/s */
    bool stands;
    double ground_velocity[3]; /* m/s, of what it stands on */
};

#define DO(call)                                 \
    do {                                         \
        const sadmm_status status_ = (call);     \
        if (status_ != SADMM_OK) return status_; \
    } while (0)

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* ---- casts ------------------------------------------------------------------------------------------------------- */

/* How far the capsule may go from `from`, up to `length` m, and what it meets: hit->shape is all 0 where it is nothing.
 * It stops at a distance of `skin`. */
static sadmm_status cast(struct character *c, const double from[3], const double direction[3], double length,
                         double *way, sadmm_ray_hit *hit)
{
    DO(sadmm_world_cast_shape(c->world, &c->capsule, from, upright, direction, length + skin, &c->filter, hit));
    *way = hit->shape.slot ? fmax(hit->distance - skin, 0) : length;
    return SADMM_OK;
}

/* What lies under a hit: at the edge of a step the capsule's normal is slanted, that of the step is not. A ray finds
 * it, down beside the hit. */
static sadmm_status look_at_ground(struct character *c, const double at[3], const sadmm_ray_hit *hit, double normal[3],
                                   double *height)
{
    const double aside[2] = {hit->point[0] - at[0], hit->point[1] - at[1]}, length = hypot(aside[0], aside[1]);
    const double share = length > 1e-6 ? 0.01 / length : 0;
    const sadmm_ray ray = {.origin = {hit->point[0] + share * aside[0], hit->point[1] + share * aside[1],
                                      hit->point[2] + 0.1},
                           .direction = {0, 0, -1},
                           .length = 0.2};
    sadmm_ray_hit below;
    DO(sadmm_world_cast_ray(c->world, &ray, &c->filter, &below));
    for (int k = 0; k < 3; ++k) normal[k] = below.shape.slot ? below.normal[k] : hit->normal[k];
    *height = below.shape.slot ? below.point[2] : hit->point[2];
    return SADMM_OK;
}

static double feet(const struct character *c) { return c->position[2] - half_length - radius; }

/* ---- the ground -------------------------------------------------------------------------------------------------- */

/* Velocity of a body's point. */
static sadmm_status velocity_at(sadmm_world *world, sadmm_body_id id, const double point[3], double velocity[3])
{
    sadmm_body_state s;
    DO(sadmm_world_body_state(world, id, &s));
    const double arm[3] = {point[0] - s.position[0], point[1] - s.position[1], point[2] - s.position[2]},
                 *w = s.angular_velocity;
    velocity[0] = s.linear_velocity[0] + w[1] * arm[2] - w[2] * arm[1];
    velocity[1] = s.linear_velocity[1] + w[2] * arm[0] - w[0] * arm[2];
    velocity[2] = s.linear_velocity[2] + w[0] * arm[1] - w[1] * arm[0];
    return SADMM_OK;
}

/* Down onto the ground; or a step of falling, where there is none to stand on within reach. */
static sadmm_status settle(struct character *c, double dt)
{
    const double reach = c->stands ? most_step : 0, fall = c->falling * dt;
    double way, normal[3], height;
    sadmm_ray_hit hit;
    DO(cast(c, c->position, down, fmax(reach, fall) + skin, &way, &hit));
    c->stands = false;
    for (int k = 0; k < 3; ++k) c->ground_velocity[k] = 0;
    if (hit.shape.slot) {
        DO(look_at_ground(c, c->position, &hit, normal, &height));
        c->stands = normal[2] >= least_up;
    }
    if (c->stands) {
        c->position[2] -= way;
        c->falling = 0;
        return velocity_at(c->world, hit.body, hit.point, c->ground_velocity);
    }
    c->position[2] -= fmin(way, fall);
    c->falling = hit.shape.slot && way < fall ? 0 : c->falling + 9.81 * dt;
    return SADMM_OK;
}

/* ---- walking ----------------------------------------------------------------------------------------------------- */

/* Up, forward and down again, if there is ground there to stand on that is no more than a step above the feet. */
static sadmm_status try_step(struct character *c, const double direction[3], double length, bool *done)
{
    double at[3] = {c->position[0], c->position[1], c->position[2]}, rise, way, fall, normal[3], height;
    sadmm_ray_hit hit;
    *done = false;
    DO(cast(c, at, up, most_step, &rise, &hit));
    at[2] += rise;
    DO(cast(c, at, direction, fmax(length, 2 * skin), &way, &hit));
    for (int k = 0; k < 2; ++k) at[k] += way * direction[k];
    DO(cast(c, at, down, rise, &fall, &hit));
    if (!hit.shape.slot || way < skin) return SADMM_OK;
    at[2] -= fall;
    DO(look_at_ground(c, at, &hit, normal, &height));
    if (normal[2] < least_up || height > feet(c) + most_step || at[2] < c->position[2] - skin) return SADMM_OK;
    for (int k = 0; k < 3; ++k) c->position[k] = at[k];
    *done = true;
    return SADMM_OK;
}

/* A force on a dynamic body, at the height of its centre, for a step. */
static sadmm_status push(struct character *c, const sadmm_ray_hit *hit, double dt)
{
    sadmm_body_def body;
    DO(sadmm_world_body_def(c->world, hit->body, &body));
    if (body.type != SADMM_BODY_DYNAMIC) return SADMM_OK;
    const double impulse[3] = {-hit->normal[0] * push_force * dt, -hit->normal[1] * push_force * dt, 0},
                 point[3] = {hit->point[0], hit->point[1], body.position[2]};
    return sadmm_world_apply_body_impulse_at(c->world, hit->body, impulse, point);
}

/* By `d`, m, sliding along what is in the way. */
static sadmm_status walk_by(struct character *c, const double d[3], double dt)
{
    double left[3] = {d[0], d[1], d[2]};
    for (int tries = 0; tries < 4; ++tries) {
        const double length = sqrt(dot(left, left));
        if (length < 1e-9) return SADMM_OK;
        const double direction[3] = {left[0] / length, left[1] / length, left[2] / length};
        double way, normal[3];
        sadmm_ray_hit hit;
        DO(cast(c, c->position, direction, length, &way, &hit));
        for (int k = 0; k < 3; ++k) c->position[k] += way * direction[k];
        if (!hit.shape.slot) return SADMM_OK;
        for (int k = 0; k < 3; ++k) normal[k] = hit.normal[k];
        if (normal[2] < least_up) {
            const double ahead = hypot(left[0], left[1]), flat[3] = {left[0] / ahead, left[1] / ahead, 0};
            bool stepped = false;
            if (c->stands && ahead > 1e-9) DO(try_step(c, flat, length - way, &stepped));
            if (stepped) return SADMM_OK;
            DO(push(c, &hit, dt));
            /* a wall, however it leans: nobody walks up there */
            const double across = hypot(normal[0], normal[1]);
            if (across > 1e-9) normal[0] /= across, normal[1] /= across, normal[2] = 0;
        }
        for (int k = 0; k < 3; ++k) left[k] *= (length - way) / length;
        const double into = fmin(dot(left, normal), 0);
        for (int k = 0; k < 3; ++k) left[k] -= into * normal[k];
    }
    return SADMM_OK;
}

/* One step of the world with the character walking along x. */
static sadmm_status step(struct character *c, double speed)
{
    const double dt = sadmm_world_settings(c->world).dt;
    const double walk[3] = {(speed + c->ground_velocity[0]) * dt, c->ground_velocity[1] * dt,
                            c->ground_velocity[2] * dt};
    DO(walk_by(c, walk, dt));
    DO(settle(c, dt));
    DO(sadmm_world_move_body(c->world, c->body, c->position, upright));
    return sadmm_world_step(c->world);
}

/* ---- the world --------------------------------------------------------------------------------------------------- */

static sadmm_status add_box(sadmm_world *world, sadmm_body_type type, const double size[3], double x, double y,
                            double z, double tilt, double mass, sadmm_body_id *id)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def box = sadmm_shape_def_default();
    body.type = type;
    body.mass = mass;
    sadmm_box_inertia(mass, size, body.inertia);
    body.position[0] = x, body.position[1] = y, body.position[2] = z;
    body.orientation[0] = cos(tilt / 2), body.orientation[2] = -sin(tilt / 2);
    box.type = SADMM_SHAPE_BOX;
    for (int k = 0; k < 3; ++k) box.size[k] = size[k];
    DO(sadmm_world_add_body(world, &body, id));
    return sadmm_world_add_shape(world, *id, &box, NULL);
}

/* A slope that begins at x = 2, 4 m long. */
static sadmm_status add_slope(sadmm_world *world, double y, double tilt)
{
    const double size[3] = {2, 1, 0.2};
    sadmm_body_id id;
    return add_box(world, SADMM_BODY_STATIC, size, 2 + 2 * cos(tilt) + 0.2 * sin(tilt), y,
                   2 * sin(tilt) - 0.2 * cos(tilt), tilt, 1, &id);
}

struct course {
    sadmm_body_id box, platform;
};

static sadmm_status add_course(sadmm_world *world, struct course *course)
{
    static const double stair[3] = {2, 1, 0.125}, wall[3] = {0.5, 1, 0.25}, crate[3] = {0.25, 0.25, 0.25},
                        deck[3] = {1, 1, 0.1};
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default();
    sadmm_body_id id;
    sadmm_body_state moving;
    body.type = SADMM_BODY_STATIC;
    plane.type = SADMM_SHAPE_PLANE;
    DO(sadmm_world_add_body(world, &body, &id));
    DO(sadmm_world_add_shape(world, id, &plane, NULL));
    for (int k = 0; k < 4; ++k) /* 25 cm high, 40 cm deep */
        DO(add_box(world, SADMM_BODY_STATIC, stair, 4 + 0.4 * k, 0, 0.125 + 0.25 * k, 0, 1, &id));
    DO(add_box(world, SADMM_BODY_STATIC, wall, 3, 4, 0.25, 0, 1, &id));
    DO(add_slope(world, 8, 0.5));
    DO(add_slope(world, 12, 1));
    DO(add_box(world, SADMM_BODY_KINEMATIC, deck, 0, 16, 0.1, 0, 1, &course->platform));
    DO(sadmm_world_body_state(world, course->platform, &moving));
    moving.linear_velocity[0] = 0.8;
    DO(sadmm_world_set_body_state(world, course->platform, &moving));
    return add_box(world, SADMM_BODY_DYNAMIC, crate, 2, 20, 0.25, 0, 30, &course->box);
}

static sadmm_status add_character(sadmm_world *world, struct character *c)
{
    sadmm_body_def body = sadmm_body_def_default();
    c->world = world;
    c->capsule = sadmm_shape_def_default();
    c->capsule.type = SADMM_SHAPE_CAPSULE;
    c->capsule.size[0] = radius;
    c->capsule.size[1] = half_length;
    body.type = SADMM_BODY_KINEMATIC;
    body.name = "character";
    DO(sadmm_world_add_body(world, &body, &c->body));
    c->filter = sadmm_query_filter_default();
    c->filter.ignored = c->body;
    return sadmm_world_add_shape(world, c->body, &c->capsule, NULL);
}

/* From (0, y) on for some seconds. */
static sadmm_status walk(struct character *c, double y, double z, double speed, double seconds)
{
    sadmm_body_state state;
    c->position[0] = 0, c->position[1] = y, c->position[2] = z + half_length + radius + skin;
    c->falling = 0;
    c->stands = true;
    DO(sadmm_world_body_state(c->world, c->body, &state));
    for (int k = 0; k < 3; ++k) state.position[k] = c->position[k];
    DO(sadmm_world_set_body_state(c->world, c->body, &state)); /* there at once */
    for (int k = 0; k < seconds * 200; ++k) DO(step(c, speed));
    return SADMM_OK;
}

/* ---- the walks --------------------------------------------------------------------------------------------------- */

static int wrong;

static void expect(const char *what, double value, double low, double high)
{
    const bool good = value >= low && value <= high;
    printf("%s: %.3f m%s\n", what, value, good ? "" : "  NOT AS EXPECTED");
    wrong += !good;
}

/* Distances are to the skin of 1 cm and a step of 7.5 mm. */
static sadmm_status walk_all(sadmm_world *world)
{
    struct character c = {.world = world};
    struct course course;
    sadmm_body_state state, before;
    DO(add_course(world, &course));
    DO(add_character(world, &c));
    DO(sadmm_world_body_state(world, course.platform, &before));
    DO(walk(&c, 16, 0.2, 0, 2));
    DO(sadmm_world_body_state(world, course.platform, &state));
    expect("on the platform, from its middle", fabs(c.position[0] - (state.position[0] - before.position[0])), 0, 0.01);
    expect("  that has gone", c.position[0], 1.58, 1.61);
    DO(walk(&c, 0, 0, walking_speed, 2.8));
    expect("up stairs of 4 x 0.25 m, feet at", feet(&c), 1, 1.02);
    DO(walk(&c, 4, 0, walking_speed, 3));
    expect("before a wall of 0.5 m", c.position[0], 2.18, 2.21);
    expect("  with its feet at", feet(&c), 0, 0.02);
    DO(walk(&c, 8, 0, walking_speed, 3));
    expect("up a slope of 29 degrees, feet at", feet(&c), 0.9, 1.6);
    DO(walk(&c, 12, 0, walking_speed, 3));
    expect("before a slope of 57 degrees, feet at", feet(&c), 0, 0.02);
    DO(walk(&c, 20, 0, walking_speed, 4));
    DO(sadmm_world_body_state(world, course.box, &state));
    expect("a crate of 30 kg was pushed", state.position[0] - 2, 1, 5);
    expect("  and is still at the height", state.position[2], 0.24, 0.26);
    DO(walk(&c, 24, 3, 0, 2));
    expect("after a fall of 3 m, feet at", feet(&c), 0, 0.02);
    return SADMM_OK;
}

int main(void)
{
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world;
    if (sadmm_world_create(&def, &world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    const sadmm_status status = walk_all(world);
    if (status != SADMM_OK) fprintf(stderr, "%s\n", sadmm_world_message(world));
    sadmm_world_destroy(world);
    return status != SADMM_OK || wrong > 0;
}
