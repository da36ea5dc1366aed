/* Scale of gravity and damping of bodies against formulas: on every CPU backend here, on CUDA in
 * test_cuda_body_forces.c (BODIES_ON_CUDA), which includes this file.
 *
 * Velocities of what moves under constant forces, gravity by any scale, and damping are exact at the end of every step,
 * v = e^(-c t) v_0 + (1 - e^(-c t)) a / c (core/model/forces.h): only rounding remains, of as many steps as there are.
 */
#include "body_worlds.h"

/* Rounding of `steps` steps, each to half a unit of the largest number at hand. */
static double rounding(int solver, int steps, double size) { return 4 * steps * epsilon_of(solver) * size; }

/* v after t of a v_0 and an acceleration a. */
static double damped(double v, double a, double c, double t)
{
    return c > 0 ? exp(-c * t) * v - expm1(-c * t) * a / c : v + a * t;
}

/* ---- free motion ------------------------------------------------------------------------------------------------- */

START_TEST(a_body_falls_by_its_scale)
{
    static const double scales[] = {1, 0, -1, 0.5, 3};
    enum { COUNT = sizeof scales / sizeof *scales, STEPS = 40 };
    const sadmm_world_def def = bodies_def();
    const double t = STEPS * def.settings.dt;
    sadmm_world *world = bodies_world(&def, _i);
    for (int k = 0; k < COUNT; ++k) {
        sadmm_body_def body = point_def(k, 0, 1);
        body.gravity_scale = scales[k];
        body.linear_velocity[0] = 2;
        add_defined(world, &body);
    }
    step_world(world, STEPS);
    for (int k = 0; k < COUNT; ++k) {
        const sadmm_body_state s = body_state(world, body_at(world, k));
        const double a = -scales[k] * G;
        expect_near(s.linear_velocity[2], a * t, rounding(_i, STEPS, G * 3 * t), "velocity");
        expect_near(s.position[2], 1 + a * t * t / 2, rounding(_i, STEPS, G * 3 * t * t), "height");
        expect_near(s.position[0], k + 2 * t, rounding(_i, STEPS, 4), "way");
    }
    sadmm_world_destroy(world);
}
END_TEST

/* From a twentieth of the step to a million steps' worth of damping in one; with a speed across gravity, and gravity of
 * its own. */
START_TEST(damped_motion_decays_exactly)
{
    static const double rates[] = {0, 1e-9, 0.5, 20, 400, 1e6};
    enum { COUNT = sizeof rates / sizeof *rates, STEPS = 20 };
    const int substeps = 1 + 2 * (_i / SOLVERS), solver = _i % SOLVERS;
    sadmm_world_def def = bodies_def();
    def.settings.substeps = substeps;
    const double t = STEPS * def.settings.dt;
    sadmm_world *world = bodies_world(&def, solver);
    for (int k = 0; k < COUNT; ++k) {
        sadmm_body_def body = point_def(k, 0, 0);
        body.gravity_scale = 2;
        body.linear_damping = rates[k];
        body.angular_damping = rates[k] / 2;
        body.linear_velocity[0] = 3;
        body.angular_velocity[1] = 7;
        add_defined(world, &body);
    }
    step_world(world, STEPS);
    for (int k = 0; k < COUNT; ++k) {
        const sadmm_body_state s = body_state(world, body_at(world, k));
        const double c = rates[k];
        expect_near(s.linear_velocity[0], damped(3, 0, c, t), rounding(solver, STEPS * substeps, 3), "speed");
        expect_near(s.linear_velocity[2], damped(0, -2 * G, c, t), rounding(solver, STEPS * substeps, 2 * G * t),
                    "falling speed");
        expect_near(s.angular_velocity[1], damped(7, 0, c / 2, t), rounding(solver, STEPS * substeps, 7), "spin");
    }
    sadmm_world_destroy(world);
}
END_TEST

/* Positions move by means of velocities, the trapezoidal rule: of second order. x(t) = v_0 (1 - e^(-c t)) / c. */
START_TEST(ways_are_of_second_order)
{
    enum { HALVINGS = 3 };
    const double c = 4, v = 3, t = 0.32;
    double error[HALVINGS];
    for (int h = 0; h < HALVINGS; ++h) {
        sadmm_world_def def = bodies_def();
        def.settings.dt = 0.04 / (1 << h);
        sadmm_body_def body = point_def(0, 0, 0);
        body.gravity_scale = 0;
        body.linear_damping = c;
        body.linear_velocity[0] = v;
        sadmm_world *world = bodies_world(&def, _i);
        const sadmm_body_id id = add_defined(world, &body);
        step_world(world, 8 << h);
        error[h] = body_state(world, id).position[0] + v * expm1(-c * t) / c;
        sadmm_world_destroy(world);
    }
    /* e = dt^2 c^2 x / 12 and terms of fourth order, a hundredth of it here. */
    expect_near(error[0], 0.04 * 0.04 * c * c / 12 * -v * expm1(-c * t) / c, 0.02 * error[0], "error");
    for (int h = 1; h < HALVINGS; ++h) expect_near(error[h - 1] / error[h], 4, 0.05, "a halving");
}
END_TEST

/* ---- with contacts and joints ------------------------------------------------------------------------------------ */

/* What rests weighs its share of m g; what gravity lifts leaves, as does what it leaves alone and something pushed. */
START_TEST(a_box_weighs_its_share)
{
    static const double scales[] = {1, 0.25, 4, -0.5};
    enum { COUNT = 4, STEPS = 60 };
    sadmm_world_def def = bodies_def();
    const double t = STEPS * def.settings.dt;
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_id id[COUNT];
    add_floor(world, 0.5);
    for (int k = 0; k < COUNT; ++k) {
        sadmm_body_def body = cube_def(k, 0, 0.1);
        body.gravity_scale = scales[k];
        id[k] = add_cube(world, &body, 0.5);
    }
    step_world(world, STEPS);
    for (int k = 0; k < COUNT; ++k) {
        const sadmm_body_state s = body_state(world, id[k]);
        double wrench[6];
        MUST(world, sadmm_world_body_contact_wrench(world, id[k], wrench));
        /* impulses of some m g dt, each to a few units of rounding, over dt */
        const double close = 200 * epsilon_of(_i) * 4 * 2 * G;
        if (scales[k] > 0) {
            expect_near(wrench[2], 2 * scales[k] * G, close, "weight");
            expect_near(s.position[2], 0.1, 1e-6, "height"); /* within the slop */
        } else {
            ck_assert(wrench[2] == 0);
            expect_near(s.position[2], 0.1 - scales[k] * G * t * t / 2, rounding(_i, STEPS, G * t * t), "height");
        }
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A block that slides on the ground, damped: v' = -mu s g - c v, friction constant until it stops. */
START_TEST(a_damped_block_slides_as_coulomb_says)
{
    enum { STEPS = 40 };
    const double mu = 0.2, c = 1.5, scale = 0.5, v = 3;
    sadmm_world_def def = bodies_def();
    def.settings.iterations = 300;
    const double t = STEPS * def.settings.dt;
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def body = cube_def(0, 0, 0.1);
    body.gravity_scale = scale;
    body.linear_damping = c;
    body.linear_velocity[0] = v;
    add_floor(world, mu);
    const sadmm_body_id id = add_cube(world, &body, mu);
    step_world(world, STEPS);
    /* the solver's error: of the change in a step, by its iterations */
    expect_near(body_state(world, id).linear_velocity[0], damped(v, -mu * scale * G, c, t),
                1e-7 + rounding(_i, STEPS, v), "speed");
    sadmm_world_destroy(world);
}
END_TEST

/* Two cubes that touch in the air, weightless the lower one, twice its weight the upper one: they fall as one, at g,
 * and the upper one presses by 2 m g - m g = m g. So do two of different damping, m a_i = m g - c_i m v + - N, ever
 * more slowly, at v' = g - (c_1 + c_2) v / 2, and N = m (c_1 - c_2) v / 2. */
START_TEST(bodies_of_different_forces_stay_together)
{
    enum { STEPS = 40 };
    sadmm_world_def def = bodies_def();
    const double dt = def.settings.dt, t = STEPS * dt, m = 2;
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_id id[4];
    for (int k = 0; k < 4; ++k) {
        sadmm_body_def body = cube_def(k / 2, 0, k % 2 ? 0.2 : 0);
        if (k < 2) body.gravity_scale = k % 2 ? 2 : 0;
        else body.linear_damping = k % 2 ? 0.5 : 3;
        id[k] = add_cube(world, &body, 0.5);
    }
    step_world(world, STEPS);
    const double v = damped(0, G, 1.75, t);
    for (int k = 0; k < 4; ++k) {
        const sadmm_body_state s = body_state(world, id[k]);
        double wrench[6];
        MUST(world, sadmm_world_body_contact_wrench(world, id[k], wrench));
        const double speed = k < 2 ? G * t : v, force = (k % 2 ? 1 : -1) * (k < 2 ? m * G : m * 2.5 * v / 2);
        /* of two damped bodies: the mean of their exact solutions, which is the solution of their mean to second order
         * in dt (c_1 - c_2), 1e-4 of it; the force is the mean over the step, v half a step ago */
        expect_near(s.linear_velocity[2], -speed, k < 2 ? rounding(_i, STEPS, speed) + 1e-9 : 1e-3 * v, "speed");
        expect_near(wrench[2], force, k < 2 ? 1e-5 * m * G : 0.02 * fabs(force), "force between them");
    }
    for (int k = 0; k < 4; k += 2) { /* apart by the slop at most, after what would be 2 m by their own forces */
        const sadmm_body_state low = body_state(world, id[k]), high = body_state(world, id[k + 1]);
        expect_near(high.position[2] - low.position[2], 0.2, 1e-5, "distance");
    }
    sadmm_world_destroy(world);
}
END_TEST

/* Airborne bodies that touch have gravity's trapezoid correction in common (docs/internals/algorithm.md, "Positions"),
 * unless gravity is not what they have in common: weightless ones go by v t, damped ones by what damping leaves of
 * it. */
START_TEST(bodies_that_touch_in_the_air_go_their_way)
{
    enum { STEPS = 40 };
    const double v = 0.5, c = 2;
    const sadmm_world_def def = bodies_def();
    const double dt = def.settings.dt, t = STEPS * dt;
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_id id[4];
    for (int k = 0; k < 4; ++k) {
        sadmm_body_def body = cube_def(k / 2, 0, k % 2 ? 0.2 : 0);
        body.gravity_scale = 0;
        body.linear_velocity[2] = v;
        if (k >= 2) body.linear_damping = c;
        id[k] = add_cube(world, &body, 0.5);
    }
    step_world(world, STEPS);
    ck_assert_int_gt(sadmm_world_contact_count(world), 0);
    for (int k = 0; k < 4; ++k) {
        const double z = body_state(world, id[k]).position[2] - (k % 2 ? 0.2 : 0);
        if (k < 2) expect_near(z, v * t, rounding(_i, STEPS, v) + 1e-9, "weightless");
        else expect_near(z, -v * expm1(-c * t) / c, c * dt * v * t, "damped"); /* no correction: of first order */
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A wheel on a hinge to the static world, driven by a torque T: w' = T / I - c w; the drive's bound is reached. */
START_TEST(a_driven_wheel_is_damped)
{
    enum { STEPS = 50 };
    static const double unit[4] = {1, 0, 0, 0}, place[3] = {0, 0, 0};
    const double c = 3, torque = 2, inertia = 0.5;
    sadmm_world_def def = bodies_def();
    def.settings.iterations = 300;
    const double t = STEPS * def.settings.dt;
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def body = point_def(0, 0, 0);
    body.angular_damping = c;
    const sadmm_body_id id = add_defined(world, &body);
    sadmm_joint_def hinge = sadmm_joint_def_default();
    hinge.kind = SADMM_JOINT_REVOLUTE;
    hinge.body_b = id;
    hinge.coordinates[5].drive = SADMM_DRIVE_SPEED;
    hinge.coordinates[5].target_speed = 1e3;
    hinge.coordinates[5].drive_force = torque;
    MUST(world, sadmm_world_place_joint(world, &hinge, place, unit));
    MUST(world, sadmm_world_add_joint(world, &hinge, NULL));
    step_world(world, STEPS);
    expect_near(body_state(world, id).angular_velocity[2], damped(0, torque / inertia, c, t),
                1e-7 + rounding(_i, STEPS, 1.4), "spin");
    sadmm_world_destroy(world);
}
END_TEST

/* What bounces leaves with its share of the speed that it comes with, which damping has had of it in that step:
 * e exp(-c dt) v. */
START_TEST(a_damped_ball_bounces_with_what_it_has)
{
    const double c = 20, v = 2, restitution = 0.5;
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def body = point_def(0, 0, 0.1);
    sadmm_shape_def ball = sadmm_shape_def_default();
    body.gravity_scale = 0;
    body.linear_damping = c;
    body.linear_velocity[2] = -v;
    const sadmm_body_id id = add_defined(world, &body);
    ball.type = SADMM_SHAPE_SPHERE;
    ball.size[0] = 0.1;
    ball.restitution = restitution;
    MUST(world, sadmm_world_add_shape(world, id, &ball, NULL));
    add_floor(world, 0.5);
    step_world(world, 1);
    expect_near(body_state(world, id).linear_velocity[2], restitution * exp(-c * def.settings.dt) * v,
                1e-7 + rounding(_i, 4, v), "speed");
    sadmm_world_destroy(world);
}
END_TEST

/* ---- the calls --------------------------------------------------------------------------------------------------- */

/* Set between steps, they act from the next one on, and go along where a backend keeps the world. */
START_TEST(they_may_be_set_between_steps)
{
    const sadmm_world_def def = bodies_def();
    const double dt = def.settings.dt;
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def body = point_def(0, 0, 0);
    const sadmm_body_id id = add_defined(world, &body);
    double v = 0;
    for (int round = 0; round < 6; ++round) {
        static const double scales[6] = {1, 2, 2, -1, -1, 0.5}, rates[6] = {0, 0, 10, 10, 0, 1e3};
        const double force[3] = {0, 0, round == 4 ? 5 : 0}, none[3] = {0};
        MUST(world, sadmm_world_set_body_gravity_scale(world, id, scales[round]));
        MUST(world, sadmm_world_set_body_damping(world, id, rates[round], 2 * rates[round]));
        MUST(world, sadmm_world_set_body_wrench(world, id, force, none));
        for (int step = 0; step < 3; ++step) MUST(world, sadmm_world_step_async(world));
        v = damped(v, -scales[round] * G + force[2] / 2, rates[round], 3 * dt);
        expect_near(body_state(world, id).linear_velocity[2], v, rounding(_i, 3 * (round + 1), 1), "speed");
        const sadmm_body_def read = body_def(world, id);
        ck_assert(read.gravity_scale == scales[round] && read.linear_damping == rates[round]);
        ck_assert(read.angular_damping == 2 * rates[round]);
    }
    sadmm_world_destroy(world);
}
END_TEST

#ifndef BODIES_ON_CUDA
START_TEST(bad_values_are_refused)
{
    static const double bad_scales[] = {NAN, INFINITY, -INFINITY, 1.01e6, -1.01e6},
                        bad_rates[] = {NAN, INFINITY, -1e-9, 1.01e6};
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def body = point_def(0, 0, 0);
    body.gravity_scale = 3, body.linear_damping = 4, body.angular_damping = 5;
    const sadmm_body_id id = add_defined(world, &body);
    sadmm_body_id other;
    for (size_t k = 0; k < sizeof bad_scales / sizeof *bad_scales; ++k) {
        sadmm_body_def bad = body;
        bad.gravity_scale = bad_scales[k];
        ck_assert_int_eq(sadmm_world_add_body(world, &bad, &other), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert(strstr(sadmm_world_message(world), "def->gravity_scale"));
        ck_assert_int_eq(sadmm_world_set_body_gravity_scale(world, id, bad_scales[k]), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert(strstr(sadmm_world_message(world), "scale"));
    }
    for (size_t k = 0; k < sizeof bad_rates / sizeof *bad_rates; ++k) {
        sadmm_body_def bad = body;
        bad.linear_damping = bad_rates[k];
        ck_assert_int_eq(sadmm_world_add_body(world, &bad, &other), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert(strstr(sadmm_world_message(world), "def->linear_damping"));
        bad.linear_damping = 0, bad.angular_damping = bad_rates[k];
        ck_assert_int_eq(sadmm_world_add_body(world, &bad, &other), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert(strstr(sadmm_world_message(world), "def->angular_damping"));
        ck_assert_int_eq(sadmm_world_set_body_damping(world, id, bad_rates[k], 0), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert(strstr(sadmm_world_message(world), "linear"));
        ck_assert_int_eq(sadmm_world_set_body_damping(world, id, 0, bad_rates[k]), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert(strstr(sadmm_world_message(world), "angular"));
    }
    const sadmm_body_def read = body_def(world, id);
    ck_assert(read.gravity_scale == 3 && read.linear_damping == 4 && read.angular_damping == 5);

    body.type = SADMM_BODY_STATIC;
    body.gravity_scale = NAN; /* ignored, as its mass is */
    other = add_defined(world, &body);
    ck_assert_int_eq(sadmm_world_set_body_gravity_scale(world, other, 1), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_set_body_damping(world, other, 1, 1), SADMM_ERROR_INVALID_ARGUMENT);
    MUST(world, sadmm_world_remove_body(world, other));
    ck_assert_int_eq(sadmm_world_set_body_gravity_scale(world, other, 1), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_set_body_damping(world, other, 1, 1), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_set_body_gravity_scale(NULL, id, 1), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_set_body_damping(NULL, id, 1, 1), SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_world_destroy(world);
}
END_TEST

/* What gravity does to a body far beyond its margin in the first step is a contact already: scales count in the reach
 * of contacts. 100 g in 5 ms are 25 mm. */
START_TEST(contacts_reach_as_far_as_a_heavy_body_falls)
{
    sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def body = cube_def(0, 0, 0.1 + 0.02);
    body.gravity_scale = 100;
    add_floor(world, 0.5);
    const sadmm_body_id id = add_cube(world, &body, 0.5);
    step_world(world, 1);
    ck_assert_int_gt(sadmm_world_contact_count(world), 0);
    step_world(world, 3);
    ck_assert_double_gt(body_state(world, id).position[2], 0.1 - 1e-5);
    sadmm_world_destroy(world);
}
END_TEST

/* Two that fly side by side, until one is braked: it is hit in that very step. */
START_TEST(contacts_reach_as_far_as_damping_brakes)
{
    sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def body = cube_def(0, 0, 0);
    body.gravity_scale = 0;
    body.linear_velocity[0] = 20;
    const sadmm_body_id behind = add_cube(world, &body, 0.5);
    body.position[0] = 0.25; /* 0.05 m apart, of the 0.1 m that they go in a step */
    body.linear_damping = 1e6;
    const sadmm_body_id ahead = add_cube(world, &body, 0.5);
    step_world(world, 1);
    ck_assert_int_gt(sadmm_world_contact_count(world), 0);
    step_world(world, 3);
    ck_assert_double_gt(body_state(world, ahead).position[0] - body_state(world, behind).position[0], 0.2 - 1e-3);
    sadmm_world_destroy(world);
}
END_TEST
#endif

#ifdef BODIES_ON_CUDA
/* Cubes of all kinds that fall on each other and a floor, some faster than their velocities show; what is set goes
 * along with steps that are made on the device. */
static sadmm_world *falling_world(int precision)
{
    sadmm_world_def def = bodies_def();
    def.settings.iterations = 20;
    sadmm_world *world = bodies_world(&def, precision);
    add_floor(world, 0.5);
    for (int k = 0; k < 8; ++k) {
        sadmm_body_def body = cube_def(0.25 * (k / 2), 0, k % 2 ? 0.34 : 0.11);
        body.gravity_scale = k == 1 ? 60 : k == 3 ? -1 : 0.5 * k;
        body.linear_damping = k == 4 ? 1e4 : k;
        body.angular_damping = 3 * k;
        body.linear_velocity[0] = k == 5 ? 3 : 0;
        add_cube(world, &body, 0.4);
    }
    return world;
}

START_TEST(the_device_makes_the_hosts_steps)
{
    sadmm_world *host = falling_world(_i), *device = falling_world(_i);
    by_host(host);
    for (int step = 0; step < 14; ++step) {
        sadmm_world *const both[2] = {host, device};
        for (int w = 0; w < 2 && step % 4 == 2; ++w) {
            MUST(both[w], sadmm_world_set_body_gravity_scale(both[w], body_at(both[w], 3), step));
            MUST(both[w], sadmm_world_set_body_damping(both[w], body_at(both[w], 6), 50 * step, 0));
        }
        step_world(host, 1);
        step_world(device, 1);
        expect_same_world(host, device, "a step");
    }
    ck_assert(device->resident.loaded && !host->resident.loaded); /* it was the device that made them */
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
}
END_TEST
#endif

int main(void)
{
    Suite *suite = suite_create("body forces");
    TCase *cases = tcase_create("body forces");
#ifdef BODIES_ON_CUDA
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    tcase_set_timeout(cases, 600);
    tcase_add_loop_test(cases, the_device_makes_the_hosts_steps, 0, SOLVERS);
#else
    tcase_add_loop_test(cases, bad_values_are_refused, 0, 1);
    tcase_add_loop_test(cases, contacts_reach_as_far_as_a_heavy_body_falls, 0, SOLVERS);
    tcase_add_loop_test(cases, contacts_reach_as_far_as_damping_brakes, 0, SOLVERS);
#endif
    tcase_add_loop_test(cases, a_body_falls_by_its_scale, 0, SOLVERS);
    tcase_add_loop_test(cases, damped_motion_decays_exactly, 0, 2 * SOLVERS);
    tcase_add_loop_test(cases, ways_are_of_second_order, 0, SOLVERS);
    tcase_add_loop_test(cases, a_box_weighs_its_share, 0, SOLVERS);
    tcase_add_loop_test(cases, a_damped_block_slides_as_coulomb_says, 0, SOLVERS);
    tcase_add_loop_test(cases, bodies_of_different_forces_stay_together, 0, SOLVERS);
    tcase_add_loop_test(cases, bodies_that_touch_in_the_air_go_their_way, 0, SOLVERS);
    tcase_add_loop_test(cases, a_driven_wheel_is_damped, 0, SOLVERS);
    tcase_add_loop_test(cases, a_damped_ball_bounces_with_what_it_has, 0, SOLVERS);
    tcase_add_loop_test(cases, they_may_be_set_between_steps, 0, SOLVERS);
    suite_add_tcase(suite, cases);
    return RUN_BODIES_SUITE(suite);
}
