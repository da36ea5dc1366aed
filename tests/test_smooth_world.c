/* Worlds with cylinders, cones, ellipsoids and rounded boxes: they roll as the formulas say, stand and lie still, and
 * rock back. On planes, on boxes and on meshes, which they meet by other ways. */
#include <check.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "collision/hull/hull_data.h"
#include "core/base/definition_fields.h"
#include "core/math/quat.h"
#include "fixed_work.h"
#include "mesh_tools.h"
#include "run_suite.h"
#include "subadmm/subadmm.h"
#include "world/step/gather.h"

#define MUST(world, call)                                                                        \
    do {                                                                                         \
        const sadmm_status must = (call);                                                        \
        ck_assert_msg(must == SADMM_OK, "%s: %s", #call, world ? sadmm_world_message(world) : sadmm_last_message()); \
    } while (0)

static const double G = 9.81;

enum { PLANE, BOX, MESH, GROUNDS };

/* Gravity leans by `angle` towards +x. The ground is a plane, the top of a box, or a mesh that is flat, divided without
 * any order. */
static sadmm_world *make_world_for(sadmm_backend backend, double dt, double angle, int on)
{
    struct soup *soup = on == MESH ? soup_ground(41, 41, 0.5, 0.24, 3, soup_flat) : NULL;
    sadmm_mesh *mesh = soup ? soup_mesh(soup) : NULL;
    sadmm_world_def def = fixed_world_def();
    sadmm_body_def ground = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_world *world = NULL;
    sadmm_body_id id;
    def.backend = backend;
    def.settings.dt = dt;
    def.settings.iterations = 100;
    def.settings.gravity[0] = G * sin(angle);
    def.settings.gravity[1] = 0;
    def.settings.gravity[2] = -G * cos(angle);
    MUST(NULL, sadmm_world_create(&def, &world));
    ground.type = SADMM_BODY_STATIC;
    ground.environment = -1;
    MUST(world, sadmm_world_add_body(world, &ground, &id));
    shape.type = on == MESH ? SADMM_SHAPE_MESH : on == BOX ? SADMM_SHAPE_BOX : SADMM_SHAPE_PLANE;
    shape.mesh = mesh;
    shape.size[0] = shape.size[1] = 20;
    shape.size[2] = 1;
    shape.position[2] = on == BOX ? -1 : 0;
    shape.friction = 1;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    sadmm_mesh_destroy(mesh);
    free(soup);
    return world;
}

static sadmm_world *make_world(double dt, double angle, int on)
{
    return make_world_for(SADMM_BACKEND_CPU, dt, angle, on);
}

/* A solid of this shape, the shape's frame at a position and orientation; the body's own frame is that of its mass. */
static sadmm_body_id add_solid(sadmm_world *world, const sadmm_shape_def *form, const double position[3],
                               const double orientation[4], sadmm_mass *mass)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = *form;
    sadmm_body_id id;
    MUST(NULL, sadmm_shape_mass(form, 1000, mass));
    body.mass = mass->mass;
    memcpy(body.inertia, mass->inertia, sizeof body.inertia);
    memcpy(body.position, position, sizeof body.position);
    memcpy(body.orientation, orientation, sizeof body.orientation);
    MUST(NULL, sadmm_mass_pose_of_body(mass, body.position, body.orientation));
    MUST(world, sadmm_world_add_body(world, &body, &id));
    MUST(NULL, sadmm_mass_pose_in_body(mass, shape.position, shape.orientation));
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

static sadmm_shape_def shape_of(sadmm_shape_type type, double s0, double s1, double s2)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.type = type;
    shape.size[0] = s0, shape.size[1] = s1, shape.size[2] = s2;
    shape.friction = 1;
    return shape;
}

static sadmm_body_state state_of(sadmm_world *world, sadmm_body_id id)
{
    sadmm_body_state state;
    MUST(world, sadmm_world_body_state(world, id, &state));
    return state;
}

static void steps(sadmm_world *world, int count)
{
    for (int k = 0; k < count; ++k) MUST(world, sadmm_world_step(world));
}

static double norm_of(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

static const double about_x[4] = {0.70710678118654752, 0.70710678118654752, 0, 0}, upright[4] = {1, 0, 0, 0};

/* Down an incline without slipping: g sin(angle) / (1 + I / (m R^2)), 2/3 for a cylinder, 5/7 for an ellipsoid that
 * rolls on a circle. */
START_TEST(rolling_down)
{
    const double angle = 0.3, dt = 0.005, R = 0.2;
    const bool ellipsoid = _i / GROUNDS;
    sadmm_world *world = make_world(dt, angle, _i % GROUNDS);
    const sadmm_shape_def shape = ellipsoid ? shape_of(SADMM_SHAPE_ELLIPSOID, R, R, 0.3)
                                            : shape_of(SADMM_SHAPE_CYLINDER, R, 0.3, 0);
    const double at[3] = {0, 0, R};
    sadmm_mass mass;
    const sadmm_body_id id = add_solid(world, &shape, at, about_x, &mass);
    const double acceleration = G * sin(angle) / (1 + mass.inertia[2] / (mass.mass * R * R));
    ck_assert_double_eq_tol(acceleration, (ellipsoid ? 5.0 / 7 : 2.0 / 3) * G * sin(angle), 1e-12);
    for (int step = 1; step <= 300; ++step) {
        steps(world, 1);
        const sadmm_body_state s = state_of(world, id);
        /* its axis turns about y; that the contact is where the body is halfway through the step moves it by 1e-6 of
         * R */
        ck_assert_double_eq_tol(s.linear_velocity[0], acceleration * step * dt, 1e-5 * acceleration * step * dt + 1e-7);
        ck_assert_double_eq_tol(s.angular_velocity[1] * R, s.linear_velocity[0], 1e-5 * s.linear_velocity[0] + 1e-7);
        ck_assert_double_eq_tol(s.linear_velocity[1], 0, 1e-7);
        ck_assert_double_eq_tol(s.position[2], R, 2e-5);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* Standing and lying still for ten seconds: no creep. */
START_TEST(standing_still)
{
    static const double lie[4] = {0.70710678118654752, 0, 0.70710678118654752, 0};
    sadmm_world *world =
        make_world_for(_i / GROUNDS ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU, 0.005, 0, _i % GROUNDS);
    sadmm_shape_def shape = shape_of(SADMM_SHAPE_CYLINDER, 0.2, 0.3, 0), cone = shape_of(SADMM_SHAPE_CONE, 0.3, 0.3, 0),
                    egg = shape_of(SADMM_SHAPE_ELLIPSOID, 0.4, 0.3, 0.2);
    const double corners[24] = {-.2, -.2, -.1, .2, -.2, -.1, -.2, .2, -.1, .2, .2, -.1,
                                -.2, -.2, .1,  .2, -.2, .1,  -.2, .2, .1,  .2, .2, .1};
    const sadmm_hull_def points = {
        .struct_size = sizeof points, .points = corners, .point_count = 8, .convex_radius = 0.05};
    sadmm_body_id ids[6];
    double position[6][3], start[6][3];
    sadmm_mass mass;
    sadmm_hull *hull = NULL;
    int count = 0;
    const double at[][3] = {{0, 0, 0.3}, {2, 0, 0.2}, {-2, 0, 0.3}, {0, 2, 0.2}, {0, 0, 0.9}, {3, 3, 0.15}};
    ids[count++] = add_solid(world, &shape, at[0], upright, &mass);
    ids[count++] = add_solid(world, &shape, at[1], lie, &mass);
    ids[count++] = add_solid(world, &cone, at[2], upright, &mass);
    ids[count++] = add_solid(world, &egg, at[3], upright, &mass);
    ids[count++] = add_solid(world, &shape, at[4], upright, &mass); /* on the first */
    if (sadmm_hull_create(&points, &hull) == SADMM_OK) { /* not without qhull */
        shape = shape_of(SADMM_SHAPE_HULL, 0, 0, 0);
        shape.hull = hull;
        ids[count++] = add_solid(world, &shape, at[5], upright, &mass);
        sadmm_hull_destroy(hull);
    }
    steps(world, 200);
    for (int k = 0; k < count; ++k) memcpy(start[k], state_of(world, ids[k]).position, sizeof start[k]);
    for (int round = 0; round < 9; ++round) {
        steps(world, 200);
        for (int k = 0; k < count; ++k) {
            const sadmm_body_state s = state_of(world, ids[k]);
            ck_assert_msg(norm_of(s.linear_velocity) < 1e-9, "body %d: %g m/s", k, norm_of(s.linear_velocity));
            ck_assert_msg(norm_of(s.angular_velocity) < 1e-8, "body %d: %g rad/s", k, norm_of(s.angular_velocity));
            memcpy(position[k], s.position, sizeof position[k]);
        }
    }
    for (int k = 0; k < count; ++k)
        for (int i = 0; i < 3; ++i) ck_assert_double_eq_tol(position[k][i], start[k][i], 9e-9);
    sadmm_world_destroy(world);
}
END_TEST

/* Tilted about its rim by less than where its centre of mass is over the rim, atan(R / height of the centre), a cone
 * rocks back and comes to rest upright; by more it falls. */
START_TEST(a_tilted_cone)
{
    const double R = 0.2, half = 0.3, critical = atan(R / (half / 2));
    const bool falls = _i / GROUNDS;
    const double tilt = critical * (falls ? 1.05 : 0.8);
    const double turn[4] = {cos(tilt / 2), 0, sin(tilt / 2), 0};
    const sadmm_shape_def cone = shape_of(SADMM_SHAPE_CONE, R, half, 0);
    sadmm_world *world = make_world(0.002, 0, _i % GROUNDS);
    /* tilted towards +x, about the point of the rim there */
    const double at[3] = {0, 0, R * sin(tilt) + half * cos(tilt)};
    sadmm_mass mass;
    const sadmm_body_id id = add_solid(world, &cone, at, turn, &mass);
    steps(world, 1500);
    const sadmm_body_state s = state_of(world, id);
    const mat3 Q = q_matrix(q_load(s.orientation));
    if (falls) {
        ck_assert_double_lt(Q.r[2].z, 0.9);
    } else {
        ck_assert_double_eq_tol(Q.r[2].z, 1, 1e-6);
        ck_assert_double_lt(norm_of(s.angular_velocity), 1e-3);
        ck_assert_double_eq_tol(s.position[2], half / 2, 1e-4);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A cone on its side rolls around its apex. Its velocity is a turn about the line that it lies on, of W / tan(a) where
 * it goes around by W and its axis is inclined by a; nothing slows it down or moves the apex. */
START_TEST(a_cone_rolls_around_its_apex)
{
    const double R = 0.15, half = 0.3, a = atan2(R, 2 * half), W = 0.5, dt = 0.001;
    const sadmm_shape_def cone = shape_of(SADMM_SHAPE_CONE, R, half, 0);
    sadmm_world *world = make_world(dt, 0, _i % GROUNDS);
    /* apex at the origin, the line it lies on along +x: the axis, from the base to the apex, to -x and down by a */
    const double turn_angle = -(M_PI / 2 + a), turn[4] = {cos(turn_angle / 2), 0, sin(turn_angle / 2), 0};
    const double at[3] = {half * cos(a), 0, half * sin(a)};
    sadmm_mass mass;
    const sadmm_body_id id = add_solid(world, &cone, at, turn, &mass);
    sadmm_body_state s = state_of(world, id);
    s.angular_velocity[0] = -W / tan(a);
    s.linear_velocity[1] = -s.angular_velocity[0] * s.position[2]; /* w x r */
    MUST(world, sadmm_world_set_body_state(world, id, &s));
    const double reach = hypot(s.position[0], s.position[1]);
    for (int k = 1; k <= 8; ++k) {
        steps(world, 250);
        s = state_of(world, id);
        const double angle = W * 250 * k * dt;
        /* first order in dt: a part of 1e-3 of the way */
        ck_assert_double_eq_tol(s.position[0], reach * cos(angle), 5e-3 * reach);
        ck_assert_double_eq_tol(s.position[1], reach * sin(angle), 5e-3 * reach);
        const mat3 Q = q_matrix(q_load(s.orientation));
        const vec3 apex = v3_add(v3_load(s.position), m3_mul(Q, v3(0, 0, 1.5 * half)));
        ck_assert_double_le(v3_norm(apex), 5e-3 * reach);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* An ellipsoid rocks about the bottom: w^2 = m g (r - c) / (I + m c^2), c the height of its centre, r = a^2 / c the
 * radius of curvature there. */
START_TEST(an_ellipsoid_rocks)
{
    const double a = 0.4, b = 0.3, c = 0.25, tilt = 0.02, dt = 0.001;
    const sadmm_shape_def egg = shape_of(SADMM_SHAPE_ELLIPSOID, a, b, c);
    sadmm_world *world = make_world(dt, 0, _i % GROUNDS);
    const double turn[4] = {cos(tilt / 2), 0, sin(tilt / 2), 0}, low = hypot(a * sin(tilt), c * cos(tilt));
    const double at[3] = {0, 0, low};
    sadmm_mass mass;
    const sadmm_body_id id = add_solid(world, &egg, at, turn, &mass);
    const double w = sqrt(mass.mass * G * (a * a / c - c) / (mass.inertia[1] + mass.mass * c * c));
    const double period = 2 * M_PI / w;
    double last = 1, crossing[5];
    int found = 0;
    for (int step = 0; found < 5 && step < 6000; ++step) {
        steps(world, 1);
        const double rate = state_of(world, id).orientation[2];
        if (rate * last < 0 && step > 0) crossing[found++] = step * dt + dt * last / (last - rate);
        last = rate;
    }
    ck_assert_int_eq(found, 5);
    /* the amplitude's part is (0.02)^2 and less, the step's (w dt)^2 */
    ck_assert_double_eq_tol((crossing[4] - crossing[0]) / 2, period, 2e-3 * period);
    sadmm_world_destroy(world);
}
END_TEST

/* Shapes that need only the first blocks of the shape data come and go with hulls, and without. */
START_TEST(shape_data_stays_as_long_as_it_is_needed)
{
    sadmm_world *world = make_world(0.005, 0, BOX);
    const sadmm_shape_def shape = shape_of(SADMM_SHAPE_CYLINDER, 0.2, 0.3, 0);
    const double at[3] = {0, 0, 0.3}, corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const sadmm_hull_def points = {.struct_size = sizeof points, .points = corners, .point_count = 4};
    sadmm_hull *hull = NULL;
    sadmm_mass mass;
    sadmm_shape_id first, second;
    ck_assert_ptr_null(sadmm_world_collision_input(world, 0).hulls);
    const sadmm_body_id id = add_solid(world, &shape, at, upright, &mass);
    ck_assert_uint_eq(sadmm_world_collision_input(world, 0).hull_doubles, HULL_FIRST_OWN);
    MUST(world, sadmm_world_add_shape(world, id, &shape, &first));
    if (sadmm_hull_create(&points, &hull) == SADMM_OK) {
        sadmm_shape_def other = shape_of(SADMM_SHAPE_HULL, 0, 0, 0);
        other.hull = hull;
        MUST(world, sadmm_world_add_shape(world, id, &other, &second));
        ck_assert_uint_gt(sadmm_world_collision_input(world, 0).hull_doubles, HULL_FIRST_OWN);
        MUST(world, sadmm_world_remove_shape(world, second));
        ck_assert_uint_eq(sadmm_world_collision_input(world, 0).hull_doubles, HULL_FIRST_OWN);
        sadmm_hull_destroy(hull);
    }
    MUST(world, sadmm_world_remove_shape(world, first));
    ck_assert_uint_eq(sadmm_world_collision_input(world, 0).hull_doubles, HULL_FIRST_OWN);
    steps(world, 3);
    MUST(world, sadmm_world_remove_body(world, id));
    ck_assert_ptr_null(sadmm_world_collision_input(world, 0).hulls);
    steps(world, 1);
    sadmm_world_destroy(world);
}
END_TEST

/* Read back as given; refused by name. */
START_TEST(definitions)
{
    static const sadmm_shape_type types[] = {SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE, SADMM_SHAPE_ELLIPSOID};
    sadmm_world *world = make_world(0.005, 0, BOX);
    const double at[3] = {0, 0, 1};
    for (int k = 0; k < 3; ++k) {
        sadmm_shape_def shape = shape_of(types[k], 0.3, 0.2, 0.1), read;
        sadmm_mass mass;
        sadmm_shape_id id;
        const sadmm_body_id body = add_solid(world, &shape, at, upright, &mass);
        MUST(world, sadmm_world_add_shape(world, body, &shape, &id));
        MUST(world, sadmm_world_shape_def(world, id, &read, NULL));
        ck_assert_int_eq(read.type, types[k]);
        ck_assert_mem_eq(read.size, shape.size, sizeof read.size);
        for (int i = 0; i < (k < 2 ? 2 : 3); ++i) {
            char text[60];
            shape.size[i] = 0;
            snprintf(text, sizeof text, "def->size[%d] = 0: must be in [1e-06, 1e+06] m", i);
            ck_assert_int_eq(sadmm_world_add_shape(world, body, &shape, NULL), SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_ptr_nonnull(strstr(sadmm_world_message(world), text));
            shape.size[i] = 0.3;
        }
    }
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("worlds with smooth bodies");
    TCase *cases = tcase_create("worlds");
    tcase_set_timeout(cases, 60);
    tcase_add_loop_test(cases, rolling_down, 0, 2 * GROUNDS);
    tcase_add_loop_test(cases, standing_still, 0, 2 * GROUNDS);
    tcase_add_loop_test(cases, a_tilted_cone, 0, 2 * GROUNDS);
    tcase_add_loop_test(cases, a_cone_rolls_around_its_apex, 0, GROUNDS);
    tcase_add_loop_test(cases, an_ellipsoid_rocks, 0, GROUNDS);
    tcase_add_test(cases, shape_data_stays_as_long_as_it_is_needed);
    tcase_add_test(cases, definitions);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
