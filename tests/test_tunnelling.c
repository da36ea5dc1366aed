/* Nothing falls or is shot through what is thin, misses it by what accelerations add within a step, or is passed
 * through by what turns (collision/manifold/advance.h, inner_ball.h); nor do bodies that are shot at one another
 * (world/step/hits.c). */
#include "fewer.h"
#include "fixed_work.h"
#include "shots.h"

/* ---- drops and shots at random --------------------------------------------------------------------------------- */

static const int forms[] = {
    SADMM_SHAPE_SPHERE, SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX, SADMM_SHAPE_HULL,      SADMM_SHAPE_CYLINDER,
    SADMM_SHAPE_CONE,   DROP_COMPOUND,       DROP_NEEDLE,     SADMM_SHAPE_ELLIPSOID, DROP_LEAF};

START_TEST(drops_stay_on_their_side) { drop_worlds(forms[_i], 1, 1); }
END_TEST

/* What single drops ask for: trapezoid corrections of bodies that nothing presses on (core/math/trapezoid.h), the
 * middle of a cone whose tip is behind a surface, the ball in one that rocks. */
START_TEST(these_drops_stay_on_their_side)
{
    static const struct drop_case cases[] = {
        {SADMM_SHAPE_SPHERE, DROP_FLOATING, 0.02, SADMM_BACKEND_CPU, SADMM_F64, 5019},
        {SADMM_SHAPE_CONE, DROP_GRID, 0.005, SADMM_BACKEND_CPU, SADMM_F64, 5025},
        {SADMM_SHAPE_CONE, DROP_HEIGHTS, 0.005, SADMM_BACKEND_CPU, SADMM_F64, 5045},
        {SADMM_SHAPE_CONE, DROP_GRID, 0.01, SADMM_BACKEND_CPU, SADMM_F64, 5046},
        /* what is hit and turns on within the step, or is anchored; what parts from a pair that bounces
         * (system_math.h) */
        {SADMM_SHAPE_HULL, DROP_FLOATING, 0.02, SADMM_BACKEND_CPU, SADMM_F64, 20083},
        {SADMM_SHAPE_CONE, DROP_FLOATING, 0.02, SADMM_BACKEND_CPU, SADMM_F64, 20023},
        {DROP_COMPOUND, DROP_FLOATING, 0.02, SADMM_BACKEND_CPU, SADMM_F64, 20019},
        {DROP_LEAF, DROP_FLOATING, 0.02, SADMM_BACKEND_CPU, SADMM_F64, 20027},
    };
    if (!drop_form_is_there(cases[_i].form)) return;
    /* another rounding has another body of a world go through, by chance (docs/guide/limits.md) */
    const struct drop_result r = drop_all(&cases[_i]);
    ck_assert_msg(r.through <= 1, "%d are through, the first is %d", r.through, (int)r.first);
}
END_TEST

/* Several shapes of a body that pass by their thickness: iterations leave a share of such an impact's speed. */
START_TEST(compounds_stay_on_their_side)
{
    static const struct drop_case cases[] = {
        {DROP_COMPOUND, DROP_PLANE, 0.02, SADMM_BACKEND_CPU, SADMM_F64, 20027},
        {DROP_COMPOUND, DROP_PLATE, 0.01, SADMM_BACKEND_CPU, SADMM_F64, 20006},
        {DROP_COMPOUND, DROP_PLATE, 0.005, SADMM_BACKEND_CPU, SADMM_F64, 20053},
        {DROP_COMPOUND, DROP_PLATE, 0.01, SADMM_BACKEND_CPU, SADMM_F64, 20054},
    };
    int through = 0;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) through += drop_all(&cases[k]).through;
    ck_assert_msg(through <= 1, "%d are through", through);
}
END_TEST

/* Two dynamic bodies that pass by their own size in a step hit each other at their moment, where the solve would have a
 * lever as long as their way. */
START_TEST(shots_do_not_go_through)
{
    /* by another rounding one of a few hundred goes through, by chance (docs/guide/limits.md) */
    const int worlds = fewer(4), through = shots_all((uint64_t)(11 + 4 * _i), worlds);
    ck_assert_msg(through <= 1, "%d of %d are through", through, worlds * SHOT_PAIRS);
}
END_TEST

/* What turns by radians once it is hit: looks that do not end, touches of what begins to approach after it touched,
 * more hits than a body may have. */
START_TEST(these_shots_do_not_go_through)
{
    static const uint64_t worlds[] = {1026, 1030, 1067, 1126, 1187, 1190, 1227, 1251};
    int through = 0;
    for (size_t k = 0; k < sizeof worlds / sizeof *worlds; ++k) through += shots_all(worlds[k], 1);
    ck_assert_msg(through <= 1, "%d are through", through);
}
END_TEST

/* ---- accelerations ---------------------------------------------------------------------------------------------- */

static sadmm_world *open_world(double dt, double gravity)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.gravity[0] = def.settings.gravity[1] = 0;
    def.settings.gravity[2] = -gravity;
    return create_world(&def);
}

static sadmm_body_id add(sadmm_world *world, const sadmm_body_def *body, sadmm_shape_def *shape)
{
    sadmm_body_id id;
    MUST(world, sadmm_world_add_body(world, body, &id));
    MUST(world, sadmm_world_add_shape(world, id, shape, NULL));
    return id;
}

static sadmm_body_id add_ball(sadmm_world *world, double radius, double mass, const double position[3],
                              double restitution)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    body.mass = mass;
    sadmm_sphere_inertia(mass, radius, body.inertia);
    for (int k = 0; k < 3; ++k) body.position[k] = position[k];
    shape.type = SADMM_SHAPE_SPHERE;
    shape.size[0] = radius;
    shape.friction = 0;
    shape.restitution = restitution;
    return add(world, &body, &shape);
}

/* A ball with restitution 1 falls on a plane, so far that its speed alone reaches it in one step and not in the one
 * before, or only with what gravity adds: it sinks in by no more than the slop, and what it has in energy, g z + v^2/2,
 * is at no time more than at its start. */
START_TEST(a_bounce_gains_nothing)
{
    static const struct {
        double radius, drop, dt;
    } cases[] = {{0.008, 0.0120, 0.010}, {0.001, 0.0172, 0.010}, {0.010, 0.0341, 1.0 / 60}};
    const double g = 9.81, radius = cases[_i].radius, dt = cases[_i].dt;
    for (int k = 0; k < 30; ++k) {
        const double drop = cases[_i].drop * (1 + 0.01 * k), at[3] = {0, 0, radius + drop};
        sadmm_world *world = open_world(dt, g);
        sadmm_body_def ground = sadmm_body_def_default();
        sadmm_shape_def plane = sadmm_shape_def_default();
        ground.type = SADMM_BODY_STATIC;
        plane.type = SADMM_SHAPE_PLANE;
        plane.friction = 0;
        plane.restitution = 1;
        add(world, &ground, &plane);
        const sadmm_body_id ball = add_ball(world, radius, 0.01, at, 1);
        for (int step = 0; step < (int)(2.5 * sqrt(2 * drop / g) / dt) + 4; ++step) {
            step_world(world, 1);
            const sadmm_body_state s = body_state(world, ball);
            const double z = s.position[2] - radius, v = s.linear_velocity[2];
            ck_assert_msg(z >= -1e-5, "drop %g m, step %d: %g m deep", drop, step, -z); /* the default slop */
            if (v > 0)                                                                  /* to 1e-6: 20 iterations */
                ck_assert_msg(z + v * v / (2 * g) <= drop * (1 + 1e-6), "drop %g m rises to %g m", drop,
                              z + v * v / (2 * g));
        }
        sadmm_world_destroy(world);
    }
}
END_TEST

/* A ball pushed by a constant force against a plate of 2 mm, or a mesh, from 25 distances. */
START_TEST(a_push_is_stopped)
{
    static const double forces[] = {1, 2, 5, 20};
    static const double vertices[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    static const int32_t triangles[] = {0, 1, 2, 0, 2, 3};
    const double force[3] = {0, 0, -forces[_i % 4]}, torque[3] = {0, 0, 0}, radius = 0.005;
    sadmm_mesh_def def = sadmm_mesh_def_default();
    sadmm_mesh *mesh = NULL;
    def.vertices = vertices;
    def.vertex_count = 4;
    def.triangles = triangles;
    def.triangle_count = 2;
    ck_assert_int_eq(sadmm_mesh_create(&def, &mesh), SADMM_OK);
    for (int k = 0; k < 25; ++k) {
        const double at[3] = {0.1, 0.2, radius + 0.002 + 0.004 * k};
        sadmm_world *world = open_world(0.005, 0);
        sadmm_body_def ground = sadmm_body_def_default();
        sadmm_shape_def plate = sadmm_shape_def_default();
        ground.type = SADMM_BODY_STATIC;
        plate.type = _i < 4 ? SADMM_SHAPE_BOX : SADMM_SHAPE_MESH;
        plate.mesh = _i < 4 ? NULL : mesh;
        plate.size[0] = plate.size[1] = 1;
        plate.size[2] = 0.001;
        if (_i < 4) plate.position[2] = -0.001;
        add(world, &ground, &plate);
        const sadmm_body_id ball = add_ball(world, radius, 0.01, at, 0);
        MUST(world, sadmm_world_set_body_wrench(world, ball, force, torque));
        step_world(world, 60);
        ck_assert_msg(body_state(world, ball).position[2] > 0.99 * radius, "from %g m: %g m", at[2],
                      body_state(world, ball).position[2]);
        sadmm_world_destroy(world);
    }
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* ---- turning ---------------------------------------------------------------------------------------------------- */

/* A bar of 2 m turns about its middle, kinematic or of a tonne, and hits a ball of 10 g that is at rest in its way, 0.7
 * m out: the ball is faster than half of what hits it. Up to 0.3 rad a step by the plane in which they touch: what a
 * tangent is off by then, r x^3 / 3 at most, is less than the ball and the bar together. Beyond at its moment. */
START_TEST(a_turning_bar_hits)
{
    static const struct {
        double bar, ball; /* m: thickness, radius */
    } cases[] = {{0.04, 0.05}, {0.01, 0.02}, {0.004, 0.005}, {0.001, 0.002}};
    static const double rates[] = {3, 6, 12, 30, 60, 200, 600};
    const double reach = 0.7, dt = 0.005, thickness = cases[_i / 2].bar, radius = cases[_i / 2].ball;
    uint64_t seed = 5;
    for (int k = 0; k < 60; ++k) {
        const double rate = rates[k % 7], angle = drop_between(&seed, 0.15, 3);
        const double at[3] = {reach * cos(angle), reach * sin(angle), 0};
        sadmm_world *world = open_world(dt, 0);
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        shape.type = SADMM_SHAPE_BOX;
        shape.size[0] = 1;
        shape.size[1] = thickness / 2;
        shape.size[2] = 0.05;
        shape.friction = 0;
        body.type = _i % 2 ? SADMM_BODY_KINEMATIC : SADMM_BODY_DYNAMIC;
        body.mass = 1000;
        sadmm_box_inertia(body.mass, shape.size, body.inertia);
        body.angular_velocity[2] = rate;
        add(world, &body, &shape);
        const sadmm_body_id ball = add_ball(world, radius, 0.01, at, 0);
        step_world(world, (int)(angle / rate / dt) + 3);
        const sadmm_body_state s = body_state(world, ball);
        const double *v = s.linear_velocity;
        ck_assert_msg(sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) > 0.5 * rate * reach, "%g rad/s, at %g rad", rate,
                      angle);
        sadmm_world_destroy(world);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("tunnelling");
    TCase *tests = tcase_create("tunnelling");
    tcase_add_loop_test(tests, drops_stay_on_their_side, 0, (int)(sizeof forms / sizeof *forms));
    tcase_add_loop_test(tests, these_drops_stay_on_their_side, 0, 8);
    tcase_add_test(tests, compounds_stay_on_their_side);
    tcase_add_loop_test(tests, shots_do_not_go_through, 0, 2);
    tcase_add_test(tests, these_shots_do_not_go_through);
    tcase_add_loop_test(tests, a_bounce_gains_nothing, 0, 3);
    tcase_add_loop_test(tests, a_push_is_stopped, 0, 8);
    tcase_add_loop_test(tests, a_turning_bar_hits, 0, 8);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
