/* Hits of bodies in flight, each at its moment within a step: against the laws of Newton and Coulomb in closed form,
 * and against an event-driven simulation of balls in a box. On CUDA in test_cuda_hits.c (HITS_ON_CUDA), which includes
 * this file. */
#ifdef HITS_ON_CUDA
#include "cuda_worlds.h"
#else
enum { EMULATED = 0 };
#endif
#include "bouncing.h"
#include "collision/base/manifold.h"
#include "collision/find/box_row.h"
#include "collision/find/candidates.h"
#include "collision/flight/swept_body.h"
#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/math/rigid.h"
#include "fewer.h"
#ifndef HITS_ON_CUDA
#include "fixed_work.h"
#include "run_suite.h"
#endif

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
    double tolerance; /* of velocities, as a share: rounding of the precision, summed up over some steps */
} backends[] = {
#ifdef HITS_ON_CUDA
    {SADMM_BACKEND_CUDA, SADMM_F64, 1e-9},
    {SADMM_BACKEND_CUDA, SADMM_F32, 2e-5}, /* iterations in float, with masses of 1 to 10,000, beside contacts to
                                              come */
#else
    {SADMM_BACKEND_CPU, SADMM_F64, 1e-9},
    {SADMM_BACKEND_CPU, SADMM_F32, 1e-6},
    {SADMM_BACKEND_REF, SADMM_F64, 1e-9},
#endif
};
enum { TABLES = sizeof backends / sizeof backends[0] };

/* The emulated device takes seconds for what others do in milliseconds. */
static int some(int count) { return EMULATED ? (count + 19) / 20 : fewer(count); }

static uint64_t random_state;

static double random_in(double low, double high)
{
    random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (high - low) * ((double)(random_state >> 11) / 9007199254740992.0);
}

/* What has no restitution at all is left to the solve. */
static const double ALMOST_NONE = 1e-12;

/* A world of a backend. */
static sadmm_world *world_of(sadmm_world_def *def, sadmm_backend backend)
{
#ifdef HITS_ON_CUDA
    def->backend = SADMM_BACKEND_CPU;
    sadmm_world *world = create_world(def);
    if (backend == SADMM_BACKEND_CUDA) use_device(world, (int)def->precision, 0);
    return world;
#else
    def->backend = backend;
    return create_world(def);
#endif
}

static sadmm_world *new_world(int table, double dt, double gravity)
{
    sadmm_world_def def = fixed_world_def();
    def.precision = backends[table].precision;
    def.settings.dt = dt;
    def.settings.threads = 1;
    def.settings.restitution_threshold = 1e-6; /* slow ones are hits as well */
    def.settings.gravity[2] = -gravity;
    return world_of(&def, backends[table].backend);
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; ++k) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* ---- balls by formula -------------------------------------------------------------------------------------------- */

/* A ball, or what does not give way: mass 0. */
struct ball {
    double x[3], v[3], w[3], radius, mass;
};

static double inertia_of(const struct ball *b) { return 0.4 * b->mass * b->radius * b->radius; }

/* Two that touch with the normal n from a to b, which is at the distance of their radii from their centres. */
static void exchange(struct ball *a, struct ball *b, const double n[3], double restitution, double friction)
{
    double x[3], arm_a[3], arm_b[3], at_a[3], at_b[3], lambda[3], slip = 0;
    for (int k = 0; k < 3; ++k) arm_a[k] = a->radius * n[k], arm_b[k] = -b->radius * n[k];
    cross(a->w, arm_a, at_a);
    cross(b->w, arm_b, at_b);
    for (int k = 0; k < 3; ++k) x[k] = b->v[k] + at_b[k] - a->v[k] - at_a[k];
    const double normal = dot(x, n);
    double by_mass = 0, across = 0;
    for (int side = 0; side < 2; ++side) {
        const struct ball *of = side ? b : a;
        if (!(of->mass > 0)) continue;
        by_mass += 1 / of->mass;
        across += 1 / of->mass + of->radius * of->radius / inertia_of(of);
    }
    const double push = -(1 + restitution) * normal / by_mass;
    for (int k = 0; k < 3; ++k) slip += (x[k] - normal * n[k]) * (x[k] - normal * n[k]);
    slip = sqrt(slip);
    const double holds = slip / across, drag = slip > 0 ? fmin(holds, friction * push) / slip : 0;
    for (int k = 0; k < 3; ++k) lambda[k] = push * n[k] - drag * (x[k] - normal * n[k]);
    for (int side = 0; side < 2; ++side) {
        struct ball *of = side ? b : a;
        double turn[3];
        if (!(of->mass > 0)) continue;
        cross(side ? arm_b : arm_a, lambda, turn);
        for (int k = 0; k < 3; ++k) {
            of->v[k] += (side ? 1 : -1) * lambda[k] / of->mass;
            of->w[k] += (side ? 1 : -1) * turn[k] / inertia_of(of);
        }
    }
}

/* When they touch first if both go on, HUGE_VAL: never. */
static double meeting(const struct ball *a, const struct ball *b)
{
    double d[3], u[3];
    const double reach = a->radius + b->radius;
    for (int k = 0; k < 3; ++k) d[k] = b->x[k] - a->x[k], u[k] = b->v[k] - a->v[k];
    const double along = dot(d, u), square = dot(u, u), root = along * along - square * (dot(d, d) - reach * reach);
    if (!(along < 0 && root > 0)) return HUGE_VAL;
    return (-along - sqrt(root)) / square;
}

static sadmm_body_id add_ball(sadmm_world *world, const struct ball *ball, sadmm_body_type type, double friction,
                              double restitution)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = type;
    if (type == SADMM_BODY_DYNAMIC) {
        body.mass = ball->mass;
        for (int k = 0; k < 3; ++k) body.inertia[k] = inertia_of(ball);
    }
    memcpy(body.position, ball->x, sizeof body.position);
    memcpy(body.linear_velocity, ball->v, sizeof body.linear_velocity);
    memcpy(body.angular_velocity, ball->w, sizeof body.angular_velocity);
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = SADMM_SHAPE_SPHERE;
    shape.size[0] = ball->radius;
    shape.friction = friction;
    shape.restitution = restitution;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

/* Position, where ways are straight, and velocities. scale: of the velocities. */
static void expect_ball(sadmm_world *world, sadmm_body_id id, const struct ball *ball, double scale, double tolerance,
                        const char *what)
{
    const sadmm_body_state state = body_state(world, id);
    for (int k = 0; k < 3; ++k) {
        ck_assert_msg(fabs(state.linear_velocity[k] - ball->v[k]) <= tolerance * scale, "%s: v[%d] = %.12g, not %.12g",
                      what, k, state.linear_velocity[k], ball->v[k]);
        ck_assert_msg(fabs(state.angular_velocity[k] - ball->w[k]) * ball->radius <= tolerance * scale,
                      "%s: w[%d] = %.12g, not %.12g", what, k, state.angular_velocity[k], ball->w[k]);
        ck_assert_msg(fabs(state.position[k] - ball->x[k]) <= tolerance * (1 + fabs(ball->x[k])),
                      "%s: x[%d] = %.12g, not %.12g", what, k, state.position[k], ball->x[k]);
    }
}

enum { COLLISIONS = 300 };

/* Two balls that meet anywhere within a step, off centre, with spin: dynamic ones, or one of them static or kinematic.
 * Steps of v dt up to five radii. */
START_TEST(two_balls_meet)
{
    static const sadmm_body_type types[] = {SADMM_BODY_DYNAMIC, SADMM_BODY_STATIC, SADMM_BODY_KINEMATIC};
    random_state = 7;
    for (int c = 0; c < some(COLLISIONS); ++c) {
        const sadmm_body_type type = types[c % 3];
        const double dt = c % 2 ? 0.005 : 0.02, speed = pow(10, random_in(-0.3, 1.7)),
                     friction = c % 4 ? random_in(0, 1) : 0,
                     restitution = c % 5 == 0   ? ALMOST_NONE
                                   : c % 5 == 1 ? 1
                                                : random_in(0, 1);
        struct ball a = {.radius = random_in(0.05, 0.3), .mass = pow(10, random_in(-2, 2))},
                    b = {.radius = random_in(0.05, 0.3), .mass = pow(10, random_in(-2, 2))};
        sadmm_world *world = new_world(_i, dt, 0);
        double n[3], moment, aside = 0;
        for (int k = 0; k < 3; ++k) {
            a.v[k] = speed * random_in(-1, 1), b.v[k] = type == SADMM_BODY_STATIC ? 0 : speed * random_in(-1, 1);
            a.w[k] = 0.3 * speed / a.radius * random_in(-1, 1);
            b.w[k] = type == SADMM_BODY_STATIC ? 0 : 0.3 * speed / b.radius * random_in(-1, 1);
            n[k] = random_in(-1, 1);
        }
        const double size = sqrt(dot(n, n)), u[3] = {b.v[0] - a.v[0], b.v[1] - a.v[1], b.v[2] - a.v[2]};
        for (int k = 0; k < 3; ++k) n[k] /= size;
        if (dot(n, u) > 0)
            for (int k = 0; k < 3; ++k) n[k] = -n[k];
        aside = -dot(n, u) / sqrt(dot(u, u));
        if (aside < 0.2) { /* a graze: the moment is ill determined */
            sadmm_world_destroy(world);
            continue;
        }
        moment = random_in(0, 3) * dt; /* of the touch, with the centres along n */
        for (int k = 0; k < 3; ++k) b.x[k] = a.x[k] + (a.radius + b.radius) * n[k] - moment * u[k];
        ck_assert_double_eq_tol(meeting(&a, &b), moment, 1e-9);
        const sadmm_body_id id[2] = {add_ball(world, &a, SADMM_BODY_DYNAMIC, friction, restitution),
                                     add_ball(world, &b, type, friction, restitution)};
        step_world(world, 3);
        for (int k = 0; k < 3; ++k) a.x[k] += moment * a.v[k], b.x[k] += moment * b.v[k];
        if (type != SADMM_BODY_DYNAMIC) b.mass = 0;
        exchange(&a, &b, n, restitution, friction);
        for (int k = 0; k < 3; ++k) a.x[k] += (3 * dt - moment) * a.v[k], b.x[k] += (3 * dt - moment) * b.v[k];
        const char *kind = type == SADMM_BODY_DYNAMIC ? "dynamic" : type == SADMM_BODY_STATIC ? "static" : "kinematic";
        /* what velocities are rounded by turns the normal, by the more the farther the balls go */
        const double tolerance = backends[_i].tolerance * (1 + speed * dt / fmin(a.radius, b.radius));
        expect_ball(world, id[0], &a, speed, tolerance, kind);
        if (type == SADMM_BODY_DYNAMIC) expect_ball(world, id[1], &b, speed, tolerance, kind);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Off centre, the plane laid through where two balls are nearest halfway through a step is crossed before they touch:
 * what touches in the next step hits then. */
START_TEST(a_hit_is_not_taken_too_soon)
{
    for (int c = 0; c < 20; c += EMULATED ? 7 : 1) {
        const double dt = 0.005, speed = 4, offset = 0.7, along = sqrt(1 - offset * offset),
                     moment = (1 + 0.02 * (c + 0.5)) * dt; /* of the touch */
        struct ball a = {.v = {speed, 0, 0}, .radius = 0.05, .mass = 1}, b = {.radius = 0.05, .mass = 1};
        const double n[3] = {along, offset, 0};
        sadmm_world *world = new_world(_i, dt, 0);
        a.x[0] = -0.1 * along - moment * speed, b.x[1] = 0.1 * offset;
        const sadmm_body_id id[2] = {add_ball(world, &a, SADMM_BODY_DYNAMIC, 0.3, 0.8),
                                     add_ball(world, &b, SADMM_BODY_DYNAMIC, 0.3, 0.8)};
        step_world(world, 2);
        a.x[0] += moment * speed;
        exchange(&a, &b, n, 0.8, 0.3);
        for (int k = 0; k < 3; ++k) a.x[k] += (2 * dt - moment) * a.v[k], b.x[k] += (2 * dt - moment) * b.v[k];
        expect_ball(world, id[0], &a, speed, 10 * backends[_i].tolerance, "a");
        expect_ball(world, id[1], &b, speed, 10 * backends[_i].tolerance, "b");
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Balls in a row, at gaps that the first one crosses within the step, or none: the last one takes all of the motion. */
START_TEST(a_row_hands_the_motion_on)
{
    static const double gaps[] = {0, 1e-3, 0.01, 0.1, 0.3, 0.5, 0.9, 1.1, 2};
    for (int count = 3; count <= (EMULATED ? 3 : 12); count += 3)
        for (int g = 0; g < (int)(sizeof gaps / sizeof *gaps); g += EMULATED ? 4 : 1) {
            const double speed = 2, dt = 0.005, radius = 0.05;
            sadmm_world *world = new_world(_i, dt, 0);
            sadmm_body_id id[12];
            double x = 0;
            for (int k = 0; k < count; ++k) {
                const struct ball ball = {.x = {x, 0, 0}, .v = {k == 0 ? speed : 0, 0, 0}, .radius = radius, .mass = 1};
                id[k] = add_ball(world, &ball, SADMM_BODY_DYNAMIC, 0.5, 1);
                x += 2 * radius + (k == 0 ? 0.0123 : gaps[g] * speed * dt);
            }
            step_world(world, EMULATED ? 20 : 60);
            for (int k = 0; k < count; ++k)
                ck_assert_double_eq_tol(body_state(world, id[k]).linear_velocity[0], k == count - 1 ? speed : 0,
                                        speed * 10 * backends[_i].tolerance);
            sadmm_world_destroy(world);
        }
}
END_TEST

/* A ball that waits close above a floor is hit from above: it passes the hit on to the floor and back. */
START_TEST(a_hit_goes_through_to_the_floor)
{
    static const double gaps[] = {0, 0.5e-3, 2e-3, 4e-3, 6e-3};
    for (int g = 0; g < 5; g += EMULATED ? 3 : 1) {
        sadmm_world *world = new_world(_i, 0.001, 0);
        const struct ball below = {.x = {0, 0, 0.1 + gaps[g]}, .radius = 0.1, .mass = 10},
                          above = {.x = {0, 0, 0.3 + gaps[g] + 0.0033}, .v = {0, 0, -5}, .radius = 0.1, .mass = 10};
        add_floor(world, 0);
        const sadmm_body_id id[2] = {add_ball(world, &below, SADMM_BODY_DYNAMIC, 0, 1),
                                     add_ball(world, &above, SADMM_BODY_DYNAMIC, 0, 1)};
        step_world(world, 30);
        ck_assert_double_eq_tol(body_state(world, id[0]).linear_velocity[2], 0, 5 * backends[_i].tolerance);
        ck_assert_double_eq_tol(body_state(world, id[1]).linear_velocity[2], 5, 5 * backends[_i].tolerance);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* A smooth post that turns about its axis at a hinge, its face 1 mm beside the ball's surface: the ball is in an island
 * with joints, and nothing pushes it. */
static void add_post_beside(sadmm_world *world, double radius)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_body_id id[2];
    body.mass = 3;
    for (int k = 0; k < 3; ++k) body.inertia[k] = 0.1;
    for (int k = 0; k < 2; ++k) {
        body.type = k ? SADMM_BODY_DYNAMIC : SADMM_BODY_STATIC;
        body.position[0] = radius + 0.001 + 0.1;
        body.position[2] = 0.7;
        MUST(world, sadmm_world_add_body(world, &body, &id[k]));
    }
    shape.type = SADMM_SHAPE_BOX;
    shape.size[0] = shape.size[1] = 0.1, shape.size[2] = 0.6;
    shape.friction = 0;
    MUST(world, sadmm_world_add_shape(world, id[1], &shape, NULL));
    joint.kind = SADMM_JOINT_REVOLUTE;
    joint.body_a = id[0], joint.body_b = id[1];
    MUST(world, sadmm_world_add_joint(world, &joint, NULL));
}

/* A ball that falls and bounces: between two bounces its energy is what it was, times the square of its restitution at
 * each. */
static void fall_and_bounce(int table, double restitution, double dt, bool beside_a_post)
{
    const double g = 9.81, radius = 0.1;
    const struct ball ball = {.x = {0, 0, radius + 1}, .radius = radius, .mass = 2};
    sadmm_world *world = new_world(table, dt, g);
    double energy = g, next = sqrt(2 / g), speed = 0;
    int beside = 0;
    add_floor(world, 0);
    const sadmm_body_id id = add_ball(world, &ball, SADMM_BODY_DYNAMIC, 0, restitution);
    if (beside_a_post) add_post_beside(world, radius);
    for (int k = 1; k * dt < 1.2; ++k) {
        step_world(world, 1);
        while (next <= k * dt) { /* the energy of the bounce, and how long it takes */
            energy *= restitution * restitution;
            next += 2 * sqrt(2 * energy) / g;
        }
        const sadmm_body_state state = body_state(world, id);
        ck_assert_double_eq_tol(g * (state.position[2] - radius) +
                                    state.linear_velocity[2] * state.linear_velocity[2] / 2,
                                energy, g * backends[table].tolerance * 10);
        beside += state.linear_velocity[2] > speed && world_report(world).contacts > 1; /* the floor, the post */
        speed = state.linear_velocity[2];
    }
    ck_assert_int_eq(beside > 0, beside_a_post); /* it bounced in steps in which it was in the post's island */
#ifdef HITS_ON_CUDA
    /* no bounce was planned, and some steps have them twice; beside the post a pair is fast before */
    if (!beside_a_post) ck_assert_int_gt(world_report(world).repeated, 0);
#endif
    sadmm_world_destroy(world);
}

START_TEST(a_ball_falls_and_bounces)
{
    static const double restitutions[] = {1, 0.8, 0.5}, steps[] = {0.001, 0.005, 0.02};
    for (int e = EMULATED ? 1 : 0; e < (EMULATED ? 2 : 3); ++e)
        for (int d = EMULATED ? 2 : 0; d < 3; ++d)
            for (int beside = 0; beside < 2; ++beside) fall_and_bounce(_i, restitutions[e], steps[d], beside);
}
END_TEST

#ifndef HITS_ON_CUDA
/* What the last step's contacts hold up is left to the solve; what rounding left of the speeds in it holds up nothing.
 */
START_TEST(rounding_holds_nothing_up)
{
    static const struct {
        double push, speed, spin;
        bool presses;
    } cases[] = {
        {2.3e-7, 10, 0, false},     /* a graze in single precision */
        {2.3e-7, 0, 100, false},    /* at the rim */
        {9.81 * 0.001, 30, 0, true}, /* its weight on a train, in steps of 1 ms */
        {9.81 * 1e-6, 1e-3, 0, true},
        {1e-12, 0, 0, true},
        {0, 0, 0, false},
        {-1, 10, 0, false},
    };
    for (int k = 0; k < (int)(sizeof cases / sizeof *cases); ++k)
        for (int side = 0; side < 2; ++side) {
            struct sadmm_contact_pair pair = {.normal = {0, 0, 1}};
            struct sadmm_contact_point point = {
                .impulse = {0, 0, cases[k].push}, .arm_a = {0.1, 0, 0}, .arm_b = {0.1, 0, 0}};
            struct sadmm_proxy proxy[2] = {{.velocity = {0}}, {.velocity = {0}}};
            proxy[side].velocity[0] = cases[k].speed;
            proxy[side].angular[1] = cases[k].spin;
            ck_assert(swept_body_presses(&pair, &point, &proxy[0], !side, &proxy[1], side) == cases[k].presses);
        }
}
END_TEST
#endif

/* ---- boxes ------------------------------------------------------------------------------------------------------- */

/* The corner of a box that is lowest if it is turned by `angle` about y: from the centre, m. */
static void lowest_edge(const double half[3], double angle, double edge[2])
{
    edge[0] = 0;
    edge[1] = HUGE_VAL;
    for (int s = 0; s < 4; ++s) {
        const double x = (s & 1 ? 1 : -1) * half[0], z = (s & 2 ? 1 : -1) * half[2],
                     along = x * cos(angle) + z * sin(angle), up = z * cos(angle) - x * sin(angle);
        if (up < edge[1]) edge[0] = along, edge[1] = up;
    }
}

/* A box that turns about y, one of its axes, comes down on a plane with an edge along y, without friction: its edge
 * leaves with epsilon times its speed, by an impulse of that over 1/m + x^2 / I. The moment is chosen, the height
 * follows. */
START_TEST(a_turning_box_hits_a_plane)
{
    const double half[3] = {0.1, 0.15, 0.2}, dt = 0.01, mass = 1.5;
    int tested = 0;
    double inertia[3];
    sadmm_box_inertia(mass, half, inertia);
    random_state = 11;
    for (int c = 0; c < (EMULATED ? 10 : 60); ++c) {
        const double restitution = c % 4 == 0 ? ALMOST_NONE : random_in(0, 1), speed = random_in(0.5, 4),
                     spin = random_in(-15, 15), moment = random_in(0.1, 0.9) * dt, angle = random_in(0.2, 1.3),
                     start = angle - spin * moment;
        double edge[2], least = HUGE_VAL;
        lowest_edge(half, angle, edge);
        const double height = speed * moment - edge[1], approach = speed + spin * edge[0],
                     impulse = (1 + restitution) * approach / (1 / mass + edge[0] * edge[0] / inertia[1]),
                     fast = -speed + impulse / mass, turn = spin - edge[0] * impulse / inertia[1];
        /* No edge touches sooner, and after the hit none comes down to the plane within the step. */
        for (int k = 1; k <= 200; ++k) {
            const double before = moment * (k - 1) / 200, after = (dt - moment) * k / 200;
            double own[2];
            lowest_edge(half, start + spin * before, own);
            least = fmin(least, height - speed * before + own[1]);
            lowest_edge(half, angle + turn * after, own);
            least = fmin(least, -edge[1] + fast * after + own[1] + 1e-12);
        }
        if (least < 0 || approach < 0.1) continue;
        sadmm_world *world = new_world(_i, dt, 0);
        const sadmm_body_state state = {.position = {0, 0, height},
                                        .orientation = {cos(start / 2), 0, sin(start / 2), 0},
                                        .linear_velocity = {0.3, 0, -speed},
                                        .angular_velocity = {0, spin, 0}};
        add_floor(world, 0);
        const sadmm_body_id id = add_thrown(world, SADMM_SHAPE_BOX, half, &state, mass, 0, restitution);
        MUST(world, sadmm_world_set_body_state(world, id, &state));
        step_world(world, 1);
        const sadmm_body_state after = body_state(world, id);
        ck_assert_double_eq_tol(after.linear_velocity[0], 0.3, 1e-6);
        ck_assert_double_eq_tol(after.linear_velocity[2], fast, 1e-6 * speed);
        ck_assert_double_eq_tol(after.angular_velocity[1], turn, 1e-6 * (1 + fabs(turn)));
        ck_assert_double_eq_tol(after.position[2], -edge[1] + fast * (dt - moment), 1e-7);
        ++tested;
        sadmm_world_destroy(world);
    }
    ck_assert_int_ge(tested, EMULATED ? 2 : 15);
}
END_TEST

/* Angular momentum, and energy with m g z. */
static vec3 tumbling_sums(sadmm_world *world, sadmm_body_id id, double g, double *energy)
{
    const sadmm_body_def b = body_def(world, id);
    const vec3 w = v3_load(b.angular_velocity),
               L = rigid_angular_momentum(q_load(b.orientation), v3_load(b.inertia), w);
    *energy = (b.mass * dot(b.linear_velocity, b.linear_velocity) + v3_dot(L, w)) / 2 + b.mass * g * b.position[2];
    return L;
}

/* A box with three moments that tumbles and bounces on ice: nothing turns it about the vertical, and it keeps its
 * energy. */
START_TEST(a_tumbling_box_keeps_its_turning)
{
    const double half[3] = {0.1, 0.06, 0.03}, g = 9.81;
    random_state = 23;
    for (int c = 0; c < some(8); ++c) {
        sadmm_world *world = new_world(_i, 0.005, g);
        sadmm_body_state state = {.position = {0, 0, 0.5}, .orientation = {1, 0, 0, 0}};
        double energy[2];
        for (int k = 0; k < 3; ++k) state.angular_velocity[k] = random_in(-10, 10);
        add_floor(world, 0);
        const sadmm_body_id id = add_thrown(world, SADMM_SHAPE_BOX, half, &state, 1.5, 0, 1);
        MUST(world, sadmm_world_set_body_state(world, id, &state));
        const vec3 before = tumbling_sums(world, id, g, &energy[0]);
        step_world(world, EMULATED ? 80 : 200);
        const vec3 after = tumbling_sums(world, id, g, &energy[1]);
        /* single precision, 200 times; one velocity for a whole step would be off by 1e-2 */
        ck_assert_double_eq_tol(after.z, before.z, 1e-5 * v3_norm(before));
        /* what few iterations leave of contacts that do not press */
        ck_assert_double_eq_tol(energy[1] / energy[0], 1, 1e-4);
        ck_assert(v3_norm(v3_sub(after, before)) > 0.1 * v3_norm(before)); /* it has hit */
        sadmm_world_destroy(world);
    }
}
END_TEST

/* A hit through the centre of mass, without friction, turns nothing: a ball with three moments that tumbles, with a
 * torque or damped, turns as it does beside the wall, whenever it hits. */
START_TEST(a_hit_leaves_turning_alone)
{
    const double dt = 0.01, torque[3] = {0.02, -0.03, 0.05}, none[3] = {0, 0, 0};
    random_state = 29;
    for (int c = 0; c < 12; ++c) {
        sadmm_world *world = new_world(_i, dt, 0);
        sadmm_body_id id[2];
        const double moment = random_in(0.05, 0.95) * dt, spin = c % 2 ? 5 : 40;
        double w[3];
        for (int k = 0; k < 3; ++k) w[k] = random_in(-spin, spin);
        add_floor(world, 0);
        for (int s = 0; s < 2; ++s) {
            sadmm_body_def body = sadmm_body_def_default();
            sadmm_shape_def shape = sadmm_shape_def_default();
            body.mass = 1;
            body.inertia[0] = 0.005, body.inertia[1] = 0.01, body.inertia[2] = 0.013;
            body.angular_damping = c % 3 ? 0 : 3;
            body.position[0] = s;
            body.position[2] = s ? 1 : 0.1 + 2 * moment;
            body.linear_velocity[2] = -2;
            for (int k = 0; k < 3; ++k) body.angular_velocity[k] = w[k];
            MUST(world, sadmm_world_add_body(world, &body, &id[s]));
            shape.type = SADMM_SHAPE_SPHERE;
            shape.size[0] = 0.1;
            shape.friction = 0;
            shape.restitution = 1;
            MUST(world, sadmm_world_add_shape(world, id[s], &shape, NULL));
            MUST(world, sadmm_world_set_body_wrench(world, id[s], none, c % 4 < 2 ? torque : none));
        }
        step_world(world, 1);
        const sadmm_body_state hit = body_state(world, id[0]), beside = body_state(world, id[1]);
        ck_assert_double_eq_tol(hit.linear_velocity[2], 2, 2 * backends[_i].tolerance);
        for (int k = 0; k < 3; ++k)
            ck_assert_double_eq_tol(hit.angular_velocity[k], beside.angular_velocity[k], spin * backends[_i].tolerance);
        for (int k = 0; k < 4; ++k)
            ck_assert_double_eq_tol(hit.orientation[k], beside.orientation[k], spin * dt * backends[_i].tolerance);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* ---- what is conserved ------------------------------------------------------------------------------------------- */

/* Twice the kinetic energy. */
static double energy_of(sadmm_world *world, sadmm_body_id id)
{
    const sadmm_body_def body = body_def(world, id);
    const double *q = body.orientation, *w = body.angular_velocity;
    double sum = body.mass * dot(body.linear_velocity, body.linear_velocity);
    const double turned[3][3] = {
        {1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] + q[0] * q[3]), 2 * (q[1] * q[3] - q[0] * q[2])},
        {2 * (q[1] * q[2] - q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]), 2 * (q[2] * q[3] + q[0] * q[1])},
        {2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])}};
    for (int k = 0; k < 3; ++k) sum += body.inertia[k] * dot(turned[k], w) * dot(turned[k], w);
    return sum;
}

/* Bodies of any two types with any spin that hit each other: without friction and with restitution 1 the energy stays,
 * with less, and with friction, none is made; momentum stays in any case. */
START_TEST(any_two_shapes_hit)
{
    static const sadmm_shape_type types[] = {SADMM_SHAPE_SPHERE,   SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX,
                                             SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE,    SADMM_SHAPE_ELLIPSOID};
    enum { TYPES = sizeof types / sizeof types[0] };
    const int all = 3 * TYPES * TYPES, stride = EMULATED ? 19 : 1; /* every type and every law */
    int hit = 0, cases = 0;
    random_state = 5;
    for (int c = 0; c < (EMULATED ? all : some(all)); c += stride, ++cases) {
        const double restitution = c % 3 == 0 ? 1 : random_in(0, 1), friction = c % 3 == 2 ? random_in(0, 1) : 0,
                     dt = 0.005, speed = random_in(2, 20);
        sadmm_world *world = new_world(_i, dt, 0);
        sadmm_body_id id[2];
        double momentum[3] = {0, 0, 0}, energy = 0, mass[2];
        for (int s = 0; s < 2; ++s) {
            const double size[3] = {random_in(0.1, 0.2), random_in(0.1, 0.2), random_in(0.1, 0.2)};
            sadmm_body_def body = sadmm_body_def_default();
            sadmm_shape_def shape = sadmm_shape_def_default();
            mass[s] = body.mass = random_in(0.5, 2);
            sadmm_box_inertia(body.mass, size, body.inertia);
            for (int k = 0; k < 3; ++k) {
                body.position[k] = (s ? 0.45 : -0.45) * (k == 0) + random_in(-0.05, 0.05);
                body.linear_velocity[k] = (s ? -speed : speed) * (k == 0) + random_in(-0.5, 0.5);
                body.angular_velocity[k] = random_in(-8, 8);
                body.orientation[k] = random_in(-1, 1);
            }
            body.orientation[3] = random_in(0.5, 1);
            const double *q = body.orientation, n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
            for (int k = 0; k < 4; ++k) body.orientation[k] /= n;
            MUST(world, sadmm_world_add_body(world, &body, &id[s]));
            shape.type = types[(s ? c / 3 / TYPES : c / 3) % TYPES];
            memcpy(shape.size, size, sizeof size);
            shape.friction = friction;
            shape.restitution = restitution;
            MUST(world, sadmm_world_add_shape(world, id[s], &shape, NULL));
            for (int k = 0; k < 3; ++k) momentum[k] += body.mass * body.linear_velocity[k];
            energy += energy_of(world, id[s]);
        }
        for (int step = 0; step < (int)(0.6 / speed / dt) + 2; ++step) {
            double now[3] = {0, 0, 0}, left = 0;
            step_world(world, 1);
            for (int s = 0; s < 2; ++s) {
                const sadmm_body_state state = body_state(world, id[s]);
                for (int k = 0; k < 3; ++k) now[k] += mass[s] * state.linear_velocity[k];
                left += energy_of(world, id[s]);
            }
            const double lost = 1 - left / energy;
            for (int k = 0; k < 3; ++k) ck_assert_double_eq_tol(now[k], momentum[k], 40 * backends[_i].tolerance);
            /* what is slower than the threshold, or hits too often, is the solve's: it pushes what it finds
             * overlapped */
            ck_assert_msg(lost > -1e-4, "case %d: %g of the energy is made", c, -lost);
            if (c % 3 == 0) ck_assert_msg(lost < 1e-4, "case %d: %g is lost", c, lost);
        }
        hit += body_state(world, id[0]).linear_velocity[0] < 0.9 * speed;
        sadmm_world_destroy(world);
    }
    ck_assert_int_eq(hit, cases); /* all do */
}
END_TEST

/* ---- balls in a box, against an event-driven simulation ---------------------------------------------------------- */

enum { BALLS = 24, WALLS = 6 };
static const double BOX = 0.6; /* its walls are planes this far from the middle */

static void add_walls(sadmm_world *world, double friction, double restitution)
{
    for (int k = 0; k < WALLS; ++k) {
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_body_id id;
        const double side = k % 2 ? 1 : -1, root = sqrt(0.5);
        body.type = SADMM_BODY_STATIC;
        body.position[k / 2] = side * BOX;
        if (k / 2 == 0) body.orientation[0] = root, body.orientation[2] = -side * root; /* z along -side x */
        if (k / 2 == 1) body.orientation[0] = root, body.orientation[1] = side * root;
        if (k / 2 == 2 && side > 0) body.orientation[0] = 0, body.orientation[1] = 1;
        MUST(world, sadmm_world_add_body(world, &body, &id));
        shape.type = SADMM_SHAPE_PLANE;
        shape.friction = friction;
        shape.restitution = restitution;
        MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    }
}

/* When a ball meets a wall, by the acceleration along its axis. */
static double meets_wall(const struct ball *b, int wall, const double acceleration[3])
{
    const double side = wall % 2 ? 1 : -1, a = side * acceleration[wall / 2], v = side * b->v[wall / 2],
                 gap = BOX - b->radius - side * b->x[wall / 2];
    if (a == 0) return v > 0 ? gap / v : HUGE_VAL;
    if (!(v * v + 2 * a * gap >= 0)) return HUGE_VAL;
    if (a > 0) return 2 * gap / (v + sqrt(v * v + 2 * a * gap));
    return v > 0 ? 2 * gap / (v + sqrt(v * v + 2 * a * gap)) : HUGE_VAL;
}

/* Go on by `seconds`, hit after hit; returns how many. acceleration: of all balls. */
static int simulate(struct ball *balls, int count, double seconds, const double acceleration[3], double restitution,
                    double friction)
{
    int hits = 0;
    for (double left = seconds;;) {
        double first = left;
        int one = -1, other = -1;
        for (int i = 0; i < count; ++i) {
            for (int w = 0; w < WALLS; ++w) {
                const double side = w % 2 ? 1 : -1, at = meets_wall(&balls[i], w, acceleration);
                /* one that leaves the wall meets it again later */
                if (at < first && !(at < 1e-12 && side * balls[i].v[w / 2] <= 0)) first = at, one = i, other = -1 - w;
            }
            for (int j = i + 1; j < count; ++j) {
                const double at = meeting(&balls[i], &balls[j]);
                if (at < first) first = at, one = i, other = j;
            }
        }
        for (int i = 0; i < count; ++i)
            for (int k = 0; k < 3; ++k) {
                balls[i].x[k] += first * balls[i].v[k] + first * first / 2 * acceleration[k];
                balls[i].v[k] += first * acceleration[k];
            }
        left -= first;
        if (one < 0) return hits;
        double n[3] = {0, 0, 0};
        ++hits;
        if (other < 0) {
            struct ball wall = {.mass = 0};
            n[(-1 - other) / 2] = (-1 - other) % 2 ? 1 : -1;
            exchange(&balls[one], &wall, n, restitution, friction);
        } else {
            for (int k = 0; k < 3; ++k)
                n[k] = (balls[other].x[k] - balls[one].x[k]) / (balls[one].radius + balls[other].radius);
            exchange(&balls[one], &balls[other], n, restitution, friction);
        }
    }
}

/* Of different sizes and masses, on a grid. */
static void throw_balls(sadmm_world *world, struct ball *balls, double friction, double restitution, double speed,
                        sadmm_body_id id[])
{
    for (int i = 0; i < BALLS; ++i) {
        struct ball *b = &balls[i];
        const int cell[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
        memset(b, 0, sizeof *b);
        b->radius = random_in(0.04, 0.1);
        b->mass = random_in(0.5, 3);
        for (int k = 0; k < 3; ++k) {
            b->x[k] = 0.38 * cell[k] + random_in(-0.05, 0.05);
            b->v[k] = random_in(-speed, speed);
            b->w[k] = friction > 0 ? random_in(-10, 10) : 0;
        }
        id[i] = add_ball(world, b, SADMM_BODY_DYNAMIC, friction, restitution);
    }
}

/* With gravity or without, with friction or without. Errors grow by some factor at each hit of a ball, so that a few of
 * them can be compared: 3 a ball here. */
START_TEST(balls_in_a_box_do_what_formulas_say)
{
    static const char *const names[] = {"elastic",
                                        "in gravity",
                                        "inelastic",
                                        "with friction, elastic",
                                        "with friction, in gravity",
                                        "with friction, inelastic"};
    for (int c = EMULATED ? 4 : 0; c < (EMULATED ? 5 : 6); ++c) {
        const double dt = c % 2 ? 0.005 : 0.01, speed = 5, friction = c < 3 ? 0 : 0.4,
                     restitution = c % 3 == 0 ? 1 : 0.9, g = c % 3 == 1 ? 9.81 : 0, acceleration[3] = {0, 0, -g};
        const int steps = (int)(0.2 / dt + 0.5);
        sadmm_world *world = new_world(_i, dt, g);
        struct ball balls[BALLS];
        sadmm_body_id id[BALLS];
        random_state = 100 + (uint64_t)c;
        add_walls(world, friction, restitution);
        throw_balls(world, balls, friction, restitution, speed, id);
        step_world(world, steps);
        ck_assert_int_gt(simulate(balls, BALLS, steps * dt, acceleration, restitution, friction), BALLS);
        for (int i = 0; i < BALLS; ++i)
            expect_ball(world, id[i], &balls[i], speed, 1000 * backends[_i].tolerance, names[c]);
        sadmm_world_destroy(world);
    }
}
END_TEST

#ifndef HITS_ON_CUDA
/* 666 balls of 5 cm in a box of 2 m keep their energy; here the threshold is the default, and hits below it take what
 * they do: 0.1 m/s of 2. */
START_TEST(an_elastic_gas_keeps_its_energy)
{
    sadmm_world_def def = fixed_world_def();
    double start = 0, now = 0;
    def.settings.dt = 0.001;
    def.settings.gravity[2] = 0;
    def.backend = SADMM_BACKEND_CPU;
    sadmm_world *world = create_world(&def);
    random_state = 3;
    for (int k = 0; k < WALLS; ++k) {
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_body_id id;
        const double side = k % 2 ? 1 : -1;
        body.type = SADMM_BODY_STATIC;
        body.position[k / 2] = side * 2;
        MUST(world, sadmm_world_add_body(world, &body, &id));
        shape.type = SADMM_SHAPE_BOX;
        shape.friction = 0;
        for (int j = 0; j < 3; ++j) shape.size[j] = j == k / 2 ? 1 : 2;
        MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    }
    sadmm_body_id id[666];
    for (int i = 0; i < 666; ++i) {
        struct ball b = {.radius = 0.05, .mass = 1};
        const int cell[3] = {i % 9, i / 9 % 9, i / 81};
        for (int k = 0; k < 3; ++k) b.x[k] = -0.9 + 0.22 * cell[k], b.v[k] = random_in(-2, 2);
        id[i] = add_ball(world, &b, SADMM_BODY_DYNAMIC, 0, 1);
        start += energy_of(world, id[i]);
    }
    step_world(world, fewer(300));
    for (int i = 0; i < 666; ++i) now += energy_of(world, id[i]);
    ck_assert_double_eq_tol(now / start, 1, 1e-3);
    sadmm_world_destroy(world);
}
END_TEST
#endif

/* ---- what is read ------------------------------------------------------------------------------------------------ */

/* A bounce that begins and ends within a step is in the contacts, the wrench and the events of that step. */
START_TEST(a_bounce_can_be_read)
{
    for (int substeps = 1; substeps <= 4; substeps += 3) {
        const double dt = 0.01, speed = 3, mass = 2, radius = 0.1, restitution = 0.5,
                     impulse = mass * speed * (1 + restitution);
        sadmm_world *world = new_world(_i, dt, 0);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.substeps = substeps;
        MUST(world, sadmm_world_set_settings(world, &settings));
        const struct ball ball = {
            .x = {0, 0, radius + 0.4 * speed * dt}, .v = {0.5, 0, -speed}, .radius = radius, .mass = mass};
        sadmm_contact list[8];
        sadmm_event events[8];
        double sum[3] = {0, 0, 0}, wrench[6];
        int32_t count;
        add_floor(world, 0);
        const sadmm_body_id id = add_ball(world, &ball, SADMM_BODY_DYNAMIC, 0, restitution);
        MUST(world, sadmm_world_record_events(world, 8));
        step_world(world, 1);
        count = sadmm_world_contact_count(world);
        ck_assert(count >= (substeps == 1) && count <= 8); /* contacts are those of the last sub-step */
        if (substeps == 1) {
            MUST(world, sadmm_world_contacts(world, 0, count, list));
            for (int32_t k = 0; k < count; ++k)
                for (int j = 0; j < 3; ++j) sum[j] += list[k].impulse[j];
            ck_assert_double_eq_tol(sum[2], impulse, impulse * backends[_i].tolerance);
            ck_assert_double_eq_tol(list[count - 1].position[0], 0.5 * 0.4 * dt, 1e-9);
        }
        MUST(world, sadmm_world_body_contact_wrench(world, id, wrench));
        ck_assert_double_eq_tol(wrench[2], impulse / dt, impulse / dt * backends[_i].tolerance);
        ck_assert_double_eq_tol(norm3(wrench + 3), 0, impulse / dt * 1e-9);
        MUST(world, sadmm_world_take_events(world, 8, events, &count, NULL));
        ck_assert_int_eq(count, 1);
        ck_assert_int_eq(events[0].type, SADMM_EVENT_CONTACT_BEGUN);
        ck_assert_double_eq_tol(events[0].speed, speed, 1e-6);
        ck_assert_double_eq_tol(events[0].impulse[2], impulse, impulse * 1e-6);
        step_world(world, 1);
        MUST(world, sadmm_world_take_events(world, 8, events, &count, NULL));
        ck_assert_int_eq(count, 1);
        ck_assert_int_eq(events[0].type, SADMM_EVENT_CONTACT_ENDED);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Off: the solve does what it can, and nothing is at its moment. */
START_TEST(hits_can_be_left_to_the_solve)
{
    for (int hits = 0; hits <= 2; ++hits) {
        sadmm_world *world = new_world(_i, 0.005, 0);
        sadmm_settings settings = sadmm_world_settings(world);
        const struct ball a = {.x = {-0.21, 0, 0}, .v = {4, 0, 0}, .radius = 0.1, .mass = 1},
                          b = {.radius = 0.1, .mass = 1}, c = {.x = {0.205, 0, 0}, .radius = 0.1, .mass = 1};
        settings.hits = hits;
        MUST(world, sadmm_world_set_settings(world, &settings));
        add_ball(world, &a, SADMM_BODY_DYNAMIC, 0, 1);
        add_ball(world, &b, SADMM_BODY_DYNAMIC, 0, 1);
        const sadmm_body_id last = add_ball(world, &c, SADMM_BODY_DYNAMIC, 0, 1);
        step_world(world, 1);
        /* with one hit a body, the middle one's second one is the solve's, which takes it in the same step */
        if (hits == 2)
            ck_assert_double_eq_tol(body_state(world, last).linear_velocity[0], 4, 4 * backends[_i].tolerance);
        if (hits == 0) ck_assert_double_lt(body_state(world, last).linear_velocity[0], 3.9);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* ---- what does not show in a result ------------------------------------------------------------------------------ */

/* Boxes and balls in a box of walls. */
static void throw_all(sadmm_world *world, double restitution)
{
    random_state = 17;
    add_walls(world, 0.4, restitution);
    for (int i = 0; i < BALLS; ++i) {
        const int cell[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
        const double size[3] = {random_in(0.04, 0.1), random_in(0.04, 0.1), random_in(0.04, 0.1)};
        sadmm_body_state state = {.orientation = {1, 0, 0, 0}};
        for (int k = 0; k < 3; ++k) {
            state.position[k] = 0.38 * cell[k] + random_in(-0.05, 0.05);
            state.linear_velocity[k] = random_in(-4, 4);
            state.angular_velocity[k] = random_in(-8, 8);
        }
        add_thrown(world, i % 2 ? SADMM_SHAPE_BOX : SADMM_SHAPE_SPHERE, size, &state, random_in(0.5, 3), 0.4,
                   restitution);
    }
}

#ifndef HITS_ON_CUDA
/* Threads, a save in the middle, and whether a step is one or several. */
START_TEST(bits_are_the_same)
{
    enum { STEPS = 24, SAVED = 9 };
    uint64_t hash = 0;
    void *saved = NULL;
    size_t size = 0;
    for (int c = 0; c < 4; ++c) {
        sadmm_world *world = new_world(_i, 0.01, 9.81);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.threads = c == 1 ? 4 : 1;
        settings.substeps = c == 3 ? 1 : 2;
        settings.dt = c == 3 ? 0.005 : 0.01;
        settings.iterations = c == 3 ? 10 : 20;
        MUST(world, sadmm_world_set_settings(world, &settings));
        sadmm_test_force_threads(c == 1);
        if (c != 2) throw_all(world, 0.7);
        else MUST(world, sadmm_world_restore(world, saved, size));
        for (int k = c == 2 ? SAVED : 0; k < STEPS; ++k) {
            if (c == 0 && k == SAVED) {
                MUST(world, sadmm_world_save(world, NULL, 0, &size));
                saved = malloc(size);
                MUST(world, sadmm_world_save(world, saved, size, &size));
            }
            step_world(world, c == 3 ? 2 : 1);
        }
        if (c == 0) hash = state_hash(world);
        ck_assert_msg(state_hash(world) == hash, "case %d", c);
        sadmm_test_force_threads(false);
        sadmm_world_destroy(world);
    }
    free(saved);
}
END_TEST
#endif

/* Without restitution nothing is followed. */
START_TEST(what_does_not_bounce_is_left_to_the_solve)
{
    uint64_t hash[2];
    for (int hits = 0; hits < 2; ++hits) {
        sadmm_world *world = new_world(_i, 0.005, 9.81);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.hits = hits ? SADMM_MOST_HITS : 0;
        MUST(world, sadmm_world_set_settings(world, &settings));
        throw_all(world, 0);
        step_world(world, EMULATED ? 6 : 30);
        hash[hits] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert(hash[0] == hash[1]);
}
END_TEST

#ifdef HITS_ON_CUDA
/* Balls, boxes and capsules, one of several shapes, a kinematic and a jointed one: steps that the device makes are
 * those that the host makes with its kernels, to the bit, in one sub-step or two. */
static void throw_more(sadmm_world *world)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_body_id id[2];
    throw_all(world, 0.8);
    body.type = SADMM_BODY_KINEMATIC;
    body.linear_velocity[0] = 1, body.angular_velocity[1] = 2;
    MUST(world, sadmm_world_add_body(world, &body, &id[0]));
    shape.type = SADMM_SHAPE_CAPSULE;
    shape.size[0] = 0.05, shape.size[1] = 0.08;
    shape.restitution = 0.5;
    MUST(world, sadmm_world_add_shape(world, id[0], &shape, NULL));
    body = sadmm_body_def_default();
    body.mass = 1;
    for (int s = 0; s < 2; ++s) {
        body.position[0] = -0.5 + 0.15 * s, body.position[2] = 0.52;
        body.linear_velocity[2] = -3;
        for (int k = 0; k < 3; ++k) body.inertia[k] = 0.01 * (1 + k + s);
        MUST(world, sadmm_world_add_body(world, &body, &id[s]));
        for (int k = 0; k < 2; ++k) {
            shape.position[1] = 0.06 * k;
            shape.type = k ? SADMM_SHAPE_BOX : SADMM_SHAPE_SPHERE;
            shape.size[0] = shape.size[1] = shape.size[2] = 0.04;
            MUST(world, sadmm_world_add_shape(world, id[s], &shape, NULL));
        }
    }
    joint.kind = SADMM_JOINT_SPHERICAL;
    joint.body_a = id[0], joint.body_b = id[1];
    joint.position_a[0] = 0.075, joint.position_b[0] = -0.075;
    MUST(world, sadmm_world_add_joint(world, &joint, NULL));
}

/* Three environments in the same place: on the device their hits are taken side by side. */
static void throw_apart(sadmm_world *world)
{
    random_state = 19;
    add_walls(world, 0.3, 0.9);
    for (int i = 0; i < 36; ++i) {
        const int cell[3] = {i / 3 % 3 - 1, i / 9 % 2, i / 18};
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_body_id id;
        body.mass = 1 + i % 4;
        body.environment = 5 * (i % 3);
        for (int k = 0; k < 3; ++k) {
            body.inertia[k] = 0.004;
            body.position[k] = 0.36 * cell[k] + random_in(-0.03, 0.03);
            body.linear_velocity[k] = random_in(-5, 5);
        }
        MUST(world, sadmm_world_add_body(world, &body, &id));
        shape.type = SADMM_SHAPE_SPHERE;
        shape.size[0] = random_in(0.1, 0.14);
        shape.restitution = 0.9;
        MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    }
}

/* Above a floor of triangles, on which hits are the solve's; bodies fall on it that have just been hit. */
static void throw_on_mesh(sadmm_world *world)
{
    static const double vertices[] = {-1, -1, -0.5, 1, -1, -0.52, 1, 1, -0.5, -1, 1, -0.48, 0, 0, -0.55};
    static const int32_t triangles[] = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4};
    sadmm_mesh_def mesh = sadmm_mesh_def_default();
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    sadmm_mesh *floor;
    mesh.vertices = vertices, mesh.vertex_count = 5;
    mesh.triangles = triangles, mesh.triangle_count = 4;
    ck_assert_int_eq(sadmm_mesh_create(&mesh, &floor), SADMM_OK);
    body.type = SADMM_BODY_STATIC;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = SADMM_SHAPE_MESH;
    shape.mesh = floor;
    shape.restitution = 0.6;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    sadmm_mesh_destroy(floor); /* the world has it */
    throw_all(world, 0.8);
    body = sadmm_body_def_default();
    shape = sadmm_shape_def_default();
    for (int s = 0; s < 2; ++s) {
        body.mass = 1;
        body.position[0] = -0.5 + 0.2 * s, body.position[2] = -0.35;
        body.linear_velocity[0] = s ? -2 : 3, body.linear_velocity[2] = -1;
        for (int k = 0; k < 3; ++k) body.inertia[k] = 0.003 + 0.001 * k;
        MUST(world, sadmm_world_add_body(world, &body, &id));
        shape.type = s ? SADMM_SHAPE_CONE : SADMM_SHAPE_ELLIPSOID;
        for (int k = 0; k < 3; ++k) shape.size[k] = 0.06 + 0.02 * k;
        shape.restitution = 0.8;
        MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    }
}

/* Without restitution: what passes by its own size in a step, and a bar that goes round by a radian. */
static void throw_fast(sadmm_world *world)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    random_state = 23;
    add_walls(world, 0.4, 0);
    for (int i = 0; i < 18; ++i) {
        const double size[3] = {random_in(0.01, 0.03), random_in(0.01, 0.03), random_in(0.01, 0.03)};
        sadmm_body_state state = {.orientation = {1, 0, 0, 0}};
        for (int k = 0; k < 3; ++k) {
            state.position[k] = random_in(-0.35, 0.35);
            state.linear_velocity[k] = -60 * state.position[k] + random_in(-2, 2);
            state.angular_velocity[k] = random_in(-40, 40);
        }
        add_thrown(world, i % 2 ? SADMM_SHAPE_BOX : SADMM_SHAPE_SPHERE, size, &state, random_in(0.5, 3), 0.4, 0);
    }
    for (int i = 0; i < 3; ++i) { /* in the second step one hits the next, and that one the last */
        const struct ball ball = {
            .x = {i ? -0.1 + 0.05 * i : -0.35, 0.36, 0.36}, .v = {i ? 0 : 10}, .radius = 0.01, .mass = i ? 1 : 3};
        add_ball(world, &ball, SADMM_BODY_DYNAMIC, 0, 0);
    }
    body.type = SADMM_BODY_KINEMATIC;
    body.angular_velocity[2] = 50;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.size[0] = 0.3, shape.size[1] = shape.size[2] = 0.01;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
}

/* Points of the last step's hits on what is static, or through a centre of mass. */
static void count_hits(const sadmm_world *world, int *on_static, int *centred)
{
    for (size_t k = 0; k < world->start.hit_count; ++k) {
        const struct sadmm_world_hit *hit = &world->start.hits[k];
        *centred += hit->feature >= INNER_BALL_FEATURE;
        for (int s = 0; s < 2; ++s) *on_static += hit->dynamic[s] < 0 && hit->kinematic[s] < 0;
    }
}

/* What contacts and hits give bodies, kinematic ones as well: sums in another order. */
static void expect_same_wrenches(sadmm_world *a, sadmm_world *b)
{
    for (int32_t i = 0; i < sadmm_world_body_count(a); ++i) {
        double wrench[2][6];
        if (body_def(a, body_at(a, i)).type == SADMM_BODY_STATIC) continue;
        MUST(a, sadmm_world_body_contact_wrench(a, body_at(a, i), wrench[0]));
        MUST(b, sadmm_world_body_contact_wrench(b, body_at(b, i), wrench[1]));
        for (int k = 0; k < 6; ++k)
            ck_assert_double_eq_tol(wrench[1][k], wrench[0][k], 1e-9 * (1 + norm3(wrench[0]) + norm3(wrench[0] + 3)));
    }
}

/* Where the two differ first; their hits. */
static void say_difference(sadmm_world *worlds[2], int c, int step)
{
    for (int w = 0; w < 2; ++w)
        for (size_t k = 0; k < worlds[w]->start.hit_count; ++k) {
            const struct sadmm_world_hit *hit = &worlds[w]->start.hits[k];
            printf("%s: shapes %d %d (%u), at %.17g %.17g %.17g, %.9g m/s, impulse %.17g\n", w ? "device" : "host",
                   hit->shape_a, hit->shape_b, hit->subshape, hit->position[0], hit->position[1], hit->position[2],
                   hit->speed, hit->impulse[2]);
        }
    for (int32_t i = 0; i < sadmm_world_body_count(worlds[0]); ++i) {
        const sadmm_body_state a = body_state(worlds[0], body_at(worlds[0], i)),
                               b = body_state(worlds[1], body_at(worlds[1], i));
        const double *x = a.position, *y = b.position;
        ck_assert_msg(memcmp(&a, &b, sizeof a) == 0,
                      "case %d, step %d, body %d: at %.17g %.17g %.17g, %.17g %.17g %.17g; %.17g and %.17g m/s", c,
                      step, i, x[0], x[1], x[2], y[0], y[1], y[2], a.linear_velocity[0], b.linear_velocity[0]);
    }
    ck_abort_msg("case %d, step %d: something that is no state differs", c, step);
}

START_TEST(host_and_device_agree)
{
    enum { STEPS = EMULATED ? 6 : 40 };
    for (int c = 0; c < 6; ++c) {
        const int substeps = c == 1 || c == 5 ? 2 : 1;
        sadmm_world *worlds[2];
        size_t hits = 0;
        int on_static = 0, centred = 0;
        for (int w = 0; w < 2; ++w) {
            sadmm_world *world = worlds[w] = new_world(_i, 0.02, 9.81);
            sadmm_settings settings = sadmm_world_settings(world);
            settings.substeps = substeps;
            if (c == 4) settings.hits = 1; /* which bodies that pass keep, if there would be more */
            MUST(world, sadmm_world_set_settings(world, &settings));
            if (c < 2) throw_more(world);
            else if (c == 2) throw_apart(world);
            else if (c == 3) throw_on_mesh(world);
            else throw_fast(world);
            if (w == 0) by_host(world);
            else if (c == 1) tune_capacities(tables[backends[_i].precision], world->context, 1);
        }
        for (int k = 0; k < STEPS; ++k) {
            for (int w = 0; w < 2; ++w) step_world(worlds[w], 1);
            if (state_hash(worlds[0]) != state_hash(worlds[1])) say_difference(worlds, c, k);
            ck_assert_uint_eq(worlds[0]->start.hit_count, worlds[1]->start.hit_count);
            ck_assert_uint_eq(worlds[0]->start.hit_first, worlds[1]->start.hit_first);
            expect_same_wrenches(worlds[0], worlds[1]);
            hits += worlds[0]->start.hit_count;
            count_hits(worlds[0], &on_static, &centred);
            if (c == 2) continue; /* one environment's after the other's */
            ck_assert(memcmp(worlds[0]->start.hits, worlds[1]->start.hits,
                             worlds[0]->start.hit_count * sizeof *worlds[0]->start.hits) == 0);
        }
        ck_assert_uint_gt(hits, c < 4 ? 2 * STEPS : 4);
        ck_assert(c < 4 || on_static > 0);
        ck_assert(c != 4 || centred > 0);
        for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
    }
}
END_TEST

/* Two sub-steps are two steps of half the length. */
START_TEST(substeps_are_short_steps)
{
    uint64_t hash[2];
    size_t hits = 0;
    for (int c = 0; c < 2; ++c) {
        sadmm_world *world = new_world(_i, 0.01, 9.81);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.substeps = 2 - c;
        settings.dt /= 1 + c;
        settings.iterations /= 1 + c;
        MUST(world, sadmm_world_set_settings(world, &settings));
        throw_all(world, 0.7);
        for (int step = 0; step < (1 + c) * (EMULATED ? 5 : 24); ++step) {
            step_world(world, 1);
            hits += world->start.hit_count;
        }
        hash[c] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert(hash[0] == hash[1]);
    ck_assert_uint_gt(hits, 0);
}
END_TEST

static void aim(sadmm_world *world, const sadmm_body_id id[2])
{
    for (int i = 0; i < 2; ++i) {
        sadmm_body_state state = body_state(world, id[i]);
        const double x[3] = {i ? 1 : -1, 0.01 * i, 0}, v[3] = {i ? -30 : 30, 1, 2};
        memcpy(state.position, x, sizeof x);
        memcpy(state.linear_velocity, v, sizeof v);
        MUST(world, sadmm_world_set_body_state(world, id[i], &state));
    }
}

/* Hits are planned once some pair is fast, and that step is made again: to the host's bits, also at the next meeting,
 * after so many calm steps that the plan has ended. */
START_TEST(hits_are_planned)
{
    enum { MEETING = 5 };
    const int substeps = 1 + (_i == 0), calm = EMULATED && _i > 0 ? 4 : 264;
    sadmm_world *worlds[2];
    sadmm_body_id id[2][2];
    sadmm_step_report report;
    size_t hits = 0;
    for (int w = 0; w < 2; ++w) {
        const struct ball ball = {.radius = 0.02, .mass = 1};
        sadmm_world *world = worlds[w] = new_world(_i, 0.01, 0);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.substeps = substeps;
        MUST(world, sadmm_world_set_settings(world, &settings));
        for (int i = 0; i < 2; ++i) id[w][i] = add_ball(world, &ball, SADMM_BODY_DYNAMIC, 0.5, 0);
        aim(world, id[w]);
        if (w == 0) by_host(world);
    }
    for (int k = 0; k < MEETING + calm + MEETING; ++k) {
        if (k == MEETING + calm)
            for (int w = 0; w < 2; ++w) aim(worlds[w], id[w]);
        for (int w = 0; w < 2; ++w) step_world(worlds[w], 1);
        ck_assert_msg(state_hash(worlds[0]) == state_hash(worlds[1]), "step %d", k);
        ck_assert_uint_eq(worlds[0]->start.hit_count, worlds[1]->start.hit_count);
        hits += worlds[0]->start.hit_count;
    }
    ck_assert_uint_eq(hits, 2);
    MUST(worlds[1], sadmm_world_report(worlds[1], &report));
    ck_assert_int_ge(report.repeated, 1);
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* What is more than the device takes is the solve's: a body of 65 shapes. */
START_TEST(what_is_too_much_is_left_to_the_solve)
{
    uint64_t hash[2];
    for (int hits = 0; hits < 2; ++hits) {
        sadmm_world *world = new_world(_i, 0.01, 9.81);
        sadmm_settings settings = sadmm_world_settings(world);
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_body_id id;
        settings.hits = hits ? SADMM_MOST_HITS : 0;
        MUST(world, sadmm_world_set_settings(world, &settings));
        add_floor(world, 0.5);
        body.mass = 1;
        body.position[2] = 0.25;
        body.linear_velocity[2] = -4;
        for (int k = 0; k < 3; ++k) body.inertia[k] = 0.01;
        MUST(world, sadmm_world_add_body(world, &body, &id));
        shape.type = SADMM_SHAPE_SPHERE;
        shape.size[0] = 0.1;
        shape.restitution = 0.7;
        for (int k = 0; k < 65; ++k) MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
        step_world(world, 6);
        ck_assert_double_gt(body_state(world, id).linear_velocity[2], 1);
        hash[hits] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert(hash[0] == hash[1]);
}
END_TEST
#else
/* A row gives every box that meets one, of which some are wide, some have moved, and some are not there. */
START_TEST(a_row_has_all_that_meet)
{
    enum { SLOTS = 200 };
    struct sadmm_candidates c = {.slot_count = SLOTS};
    struct sadmm_swept_box boxes[SLOTS] = {0};
    struct sadmm_seen seen[SLOTS] = {0};
    unsigned char state[SLOTS];
    struct sadmm_box_row row = {0};
    c.boxes = boxes, c.seen = seen, c.state = state;
    random_state = 3;
    for (int test = 0; test < 20; ++test) {
        size_t in_row = 0;
        for (int slot = 0; slot < SLOTS; ++slot) {
            state[slot] = slot % 7 ? SLOT_PRESENT : 0;
            seen[slot].moves = test > 0 && slot % 5;
            for (int k = 0; k < 3; ++k) {
                const double middle = random_in(-10, 10) * (k == test % 3 ? 2 : 1),
                             half = slot % 31 == 1 ? 15 : random_in(0.1, 1);
                boxes[slot].box.lo[k] = middle - half;
                boxes[slot].box.hi[k] = middle + half;
            }
        }
        ck_assert(sadmm_box_row_make(&row, &c));
        for (uint32_t slot = 1; slot < SLOTS; slot += 9) {
            if (!state[slot]) continue;
            for (int k = 0; k < 3; ++k) boxes[slot].box.lo[k] -= 30;
            sadmm_box_row_move(&row, slot);
        }
        for (int slot = 0; slot < SLOTS; ++slot) {
            bool listed[SLOTS] = {false};
            size_t first, last;
            sadmm_box_row_find(&row, &boxes[slot].box, &first, &last);
            for (size_t i = first; i < last; ++i) listed[(uint32_t)row.keys[i]] = true;
            for (size_t i = 0; i < row.beside_count; ++i) listed[row.beside[i]] = true;
            in_row += last - first;
            for (int other = 0; test > 0 && other < SLOTS; ++other)
                ck_assert(!state[other] || !boxes_overlap(&boxes[slot].box, &boxes[other].box) || listed[other]);
        }
        ck_assert_uint_lt(in_row, SLOTS * SLOTS / 2); /* and not all others */
    }
    sadmm_box_row_free(&row);
}
END_TEST
#endif

int main(void)
{
    Suite *suite = suite_create("hits");
    TCase *tests = tcase_create("hits");
#ifdef HITS_ON_CUDA
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
#endif
    const int end = EMULATED ? 1 : TABLES; /* hits are taken in double, whatever the precision */
    tcase_add_loop_test(tests, two_balls_meet, 0, end);
    tcase_add_loop_test(tests, a_hit_is_not_taken_too_soon, 0, end);
    tcase_add_loop_test(tests, a_row_hands_the_motion_on, 0, end);
    tcase_add_loop_test(tests, a_hit_goes_through_to_the_floor, 0, end);
    tcase_add_loop_test(tests, a_ball_falls_and_bounces, 0, end);
    tcase_add_loop_test(tests, a_turning_box_hits_a_plane, 0, end);
    tcase_add_loop_test(tests, a_hit_leaves_turning_alone, 0, end);
    tcase_add_loop_test(tests, a_tumbling_box_keeps_its_turning, 0, end);
    tcase_add_loop_test(tests, any_two_shapes_hit, 0, end);
    tcase_add_loop_test(tests, balls_in_a_box_do_what_formulas_say, 0, end);
    tcase_add_loop_test(tests, a_bounce_can_be_read, 0, end);
    tcase_add_loop_test(tests, hits_can_be_left_to_the_solve, 0, end);
    tcase_add_loop_test(tests, what_does_not_bounce_is_left_to_the_solve, 0, end);
#ifdef HITS_ON_CUDA
    tcase_add_loop_test(tests, host_and_device_agree, 0, TABLES);
    tcase_add_loop_test(tests, substeps_are_short_steps, 0, TABLES);
    tcase_add_loop_test(tests, hits_are_planned, 0, TABLES);
    tcase_add_loop_test(tests, what_is_too_much_is_left_to_the_solve, 0, end);
#else
    tcase_add_loop_test(tests, bits_are_the_same, 0, end);
    tcase_add_test(tests, rounding_holds_nothing_up);
    if (!races_are_looked_for()) {
        tcase_add_test(tests, an_elastic_gas_keeps_its_energy);
        tcase_add_test(tests, a_row_has_all_that_meet);
    }
#endif
    tcase_set_timeout(tests, 60);
    suite_add_tcase(suite, tests);
#ifdef HITS_ON_CUDA
    return run_cuda_suite(suite);
#else
    return run_suite(suite);
#endif
}
