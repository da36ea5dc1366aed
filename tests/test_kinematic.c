/* Kinematic bodies: what they do to others against formulas, on every CPU backend here, on CUDA in
 * test_cuda_kinematic.c (BODIES_ON_CUDA), which includes this file. */
#include "body_worlds.h"
#include "fixed_work.h"

#include "core/base/memory.h"
#include "core/base/parallel.h"

/* What a solve of `iterations` leaves: of the impulses at hand. Both precisions converge that far here. */
static double solved(int solver) { return solvers[solver].precision == SADMM_F32 ? 2e-5 : 1e-8; }

/* A kinematic box with its centre at (x, y, z). */
static sadmm_body_id add_kinematic(sadmm_world *world, const double half[3], double x, double y, double z,
                                   double friction)
{
    sadmm_body_def def = sadmm_body_def_default();
    def.type = SADMM_BODY_KINEMATIC;
    def.position[0] = x, def.position[1] = y, def.position[2] = z;
    const sadmm_body_id id = add_defined(world, &def);
    give_box(world, id, half[0], half[1], half[2], friction);
    return id;
}

static void set_velocity(sadmm_world *world, sadmm_body_id id, double vx, double vy, double vz, double wz)
{
    sadmm_body_state s = body_state(world, id);
    const double linear[3] = {vx, vy, vz}, angular[3] = {0, 0, wz};
    memcpy(s.linear_velocity, linear, sizeof linear);
    memcpy(s.angular_velocity, angular, sizeof angular);
    MUST(world, sadmm_world_set_body_state(world, id, &s));
}

static double force_on(sadmm_world *world, sadmm_body_id id, int axis)
{
    double wrench[6];
    MUST(world, sadmm_world_body_contact_wrench(world, id, wrench));
    return wrench[axis];
}

static const double BELT[3] = {2, 0.5, 0.1};
static const sadmm_body_id NONE = {0, 0};

/* ---- friction ---------------------------------------------------------------------------------------------------- */

/* A belt that runs and stays where it is drags a cube by mu g until both are as fast. */
START_TEST(a_belt_drags_by_friction)
{
    enum { STEPS = 60 };
    const double mu = 0.4, speed = 0.8, mass = 2;
    static const int counts[] = {100, 5, 300}; /* few: nobody brakes what a belt drags */
    const int kind = _i / SOLVERS, iterations = counts[kind], solver = _i % SOLVERS;
    sadmm_world_def def = bodies_def();
    def.settings.iterations = iterations;
    if (kind == 2) def.settings.method = SADMM_METHOD_PAPER;
    const double dt = def.settings.dt;
    sadmm_world *world = bodies_world(&def, solver);
    const sadmm_body_id belt = add_kinematic(world, BELT, 0, 0, -0.1, mu);
    const sadmm_body_def cube = cube_def(0, 0, 0.1);
    const sadmm_body_id id = add_cube(world, &cube, mu);
    sadmm_body_state place = body_state(world, belt);
    place.linear_velocity[0] = speed;
    /* with 5 the first steps, which start cold, are behind by 0.02 m/s */
    double tolerance =
        kind == 1 ? 0.05 * speed : (kind == 2 ? 1e-6 : solved(solver)) + 8 * STEPS * epsilon_of(solver) * speed;
    for (int step = 1; step <= STEPS; ++step) {
        MUST(world, sadmm_world_set_body_state(world, belt, &place));
        step_world(world, 1);
        const double v = fmin(mu * G * step * dt, speed);
        expect_near(body_state(world, id).linear_velocity[0], v, tolerance, "speed");
        ck_assert_int_eq(world_report(world).limited, 0);
        if (kind == 1) continue;
        expect_near(force_on(world, belt, 2), -mass * G, 2e-4 * mass * G, "weight on the belt");
        const bool slips = mu * G * step * dt < speed;
        if (slips) expect_near(force_on(world, belt, 0), -mu * mass * G, 2e-4 * mass * G, "drag on the belt");
        else if (mu * G * (step - 1) * dt > speed) expect_near(force_on(world, belt, 0), 0, 2e-3 * mass * G, "no drag");
        expect_near(force_on(world, belt, 2) + force_on(world, id, 2), 0, 1e-5 * mass * G, "action and reaction");
    }
    expect_near(body_state(world, id).position[2], 0.1, 2e-5, "height");
    sadmm_world_destroy(world);
}
END_TEST

/* A cube rides on a turntable: it stays where it is on it, turned by as much, held by m w^2 r of friction. */
START_TEST(a_turntable_carries)
{
    enum { STEPS = 100 };
    const double w = 2, radius = 0.5, mass = 2; /* w^2 r = 2 m/s^2 of mu g = 7.8 */
    static const double half[3] = {1, 1, 0.1};
    sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    const sadmm_body_id table = add_kinematic(world, half, 0, 0, -0.1, 0.8);
    sadmm_body_def cube = cube_def(radius, 0, 0.1);
    cube.linear_velocity[1] = w * radius, cube.angular_velocity[2] = w;
    const sadmm_body_id id = add_cube(world, &cube, 0.8);
    cube.position[2] = 0.3;
    const sadmm_body_id high = add_cube(world, &cube, 0.8);
    set_velocity(world, table, 0, 0, 0, w);
    for (int step = 1; step <= STEPS; ++step) {
        step_world(world, 1);
        if (step < 20) continue; /* the first ones start cold */
        const sadmm_body_state s = body_state(world, id);
        const double inward = -(force_on(world, id, 0) * s.position[0] + force_on(world, id, 1) * s.position[1]) /
                              hypot(s.position[0], s.position[1]);
        /* of second order: (w dt)^2 = 1e-4 of it */
        expect_near(inward, mass * w * w * radius, 2e-4 * mass * w * w * radius, "friction");
    }
    const double angle = w * STEPS * def.settings.dt;
    const sadmm_body_id both[2] = {id, high};
    for (int k = 0; k < 2; ++k) {
        const sadmm_body_state s = body_state(world, both[k]);
        /* the chord of a step in place of the arc: w dt = 0.01 of a radian, and what a solve leaves of the friction */
        expect_near(s.position[0], radius * cos(angle), 1e-3, "x");
        expect_near(s.position[1], radius * sin(angle), 1e-3, "y");
        expect_near(2 * atan2(s.orientation[3], s.orientation[0]), angle, 1e-3, "turn");
    }
    const sadmm_body_state s = body_state(world, table);
    expect_near(2 * atan2(s.orientation[3], s.orientation[0]), angle, 1e-12, "turn of the table");
    /* the two of them lean on the table by their weights alone: it is the middle that they go around */
    expect_near(force_on(world, table, 2), -2 * mass * G, 1e-3 * mass * G, "weight");
    sadmm_world_destroy(world);
}
END_TEST

/* ---- pushing ----------------------------------------------------------------------------------------------------- */

/* A lift that gains speed at a lifts by m (g + a), and carries the cube along. */
START_TEST(a_lift_carries_weight_and_acceleration)
{
    enum { STEPS = 40 };
    const double a = 3, mass = 2;
    sadmm_world_def def = bodies_def();
    const double dt = def.settings.dt;
    sadmm_world *world = bodies_world(&def, _i);
    const sadmm_body_id lift = add_kinematic(world, BELT, 0, 0, -0.1, 0.5);
    const sadmm_body_def cube = cube_def(0.5, 0.3, 0.1);
    const sadmm_body_id id = add_cube(world, &cube, 0.5);
    step_world(world, 1);
    for (int step = 1; step <= STEPS; ++step) {
        set_velocity(world, lift, 0, 0, a * step * dt, 0);
        step_world(world, 1);
        const sadmm_body_state plate = body_state(world, lift), s = body_state(world, id);
        expect_near(s.linear_velocity[2], a * step * dt, 10 * solved(_i), "speed");
        expect_near(s.position[2] - plate.position[2], 0.2, 2e-5, "distance"); /* within the slop */
        if (step > 2) {
            expect_near(force_on(world, id, 2), mass * (G + a), 1e-3 * mass * G, "force on the cube");
            expect_near(force_on(world, lift, 2), -mass * (G + a), 1e-3 * mass * G, "force on the lift");
            expect_near(force_on(world, lift, 3), -0.3 * mass * (G + a), 1e-3 * mass * G, "torque about x");
            expect_near(force_on(world, lift, 4), 0.5 * mass * (G + a), 1e-3 * mass * G, "torque about y");
        }
    }
    sadmm_world_destroy(world);
}
END_TEST

/* What comes at a cube on a floor without friction leaves it at its own speed, and at (1 + restitution) times that. */
START_TEST(a_pusher_gives_its_speed)
{
    const double v = 1.5, restitution = _i / SOLVERS ? 0.6 : 0;
    const int solver = _i % SOLVERS;
    sadmm_world_def def = bodies_def();
    def.settings.restitution_threshold = 0.1;
    sadmm_world *world = bodies_world(&def, solver);
    static const double half[3] = {0.1, 0.3, 0.3};
    const sadmm_body_id pusher = add_kinematic(world, half, 0, 0, 0.35, 0);
    const sadmm_body_def cube = cube_def(0.25, 0, 0.1);
    const sadmm_body_id id = add_defined(world, &cube);
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.type = SADMM_SHAPE_BOX;
    for (int k = 0; k < 3; ++k) shape.size[k] = 0.1;
    shape.friction = 0;
    shape.restitution = restitution;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    add_floor(world, 0);
    set_velocity(world, pusher, v, 0, 0, 0);
    step_world(world, 30);
    const sadmm_body_state s = body_state(world, id);
    expect_near(s.linear_velocity[0], (1 + restitution) * v, 20 * solved(solver), "speed");
    expect_near(body_state(world, pusher).position[0], v * 30 * def.settings.dt, 1e-12, "way of the pusher");
    expect_near(body_state(world, pusher).linear_velocity[0], v, 0, "speed of the pusher");
    sadmm_world_destroy(world);
}
END_TEST

/* A wall runs into a row of cubes, each ten times as heavy as the one before: all are as fast as the wall; it pushes by
 * the friction of all of them, mu M g (its own face has none, or it could carry a part of the weight). */
START_TEST(a_wall_pushes_a_row)
{
    enum { COUNT = 4 };
    const double v = 0.4, mu = 0.3;
    double all = 0;
    sadmm_world_def def = bodies_def();
    def.settings.iterations = 300;
    sadmm_world *world = bodies_world(&def, _i);
    static const double half[3] = {0.1, 0.3, 0.3};
    const sadmm_body_id wall = add_kinematic(world, half, 0, 0, 0.35, 0);
    sadmm_body_id id[COUNT];
    for (int k = 0; k < COUNT; ++k) {
        static const double size[3] = {0.1, 0.1, 0.1};
        sadmm_body_def cube = cube_def(0.22 + 0.21 * k, 0, 0.1);
        cube.mass = pow(10, k - 1);
        all += cube.mass;
        sadmm_box_inertia(cube.mass, size, cube.inertia);
        id[k] = add_cube(world, &cube, mu);
    }
    add_floor(world, mu);
    set_velocity(world, wall, v, 0, 0, 0);
    step_world(world, 80);
    for (int k = 0; k < COUNT; ++k) {
        const sadmm_body_state s = body_state(world, id[k]);
        expect_near(s.linear_velocity[0], v, 2e-3 * v, "speed");
        expect_near(s.position[0] - body_state(world, wall).position[0], 0.2 * (k + 1), 1e-3, "distance");
    }
    expect_near(force_on(world, wall, 0), -mu * all * G, 0.01 * mu * all * G, "push");
    sadmm_world_destroy(world);
}
END_TEST

/* A stack in a lift, or on a belt, stands as well as one on the ground with the iterations of the default: what it
 * rides on is at rest for it. (Solved as what moves, it has sunk by 1e-4 m after that time, and with 5 iterations it
 * falls.) */
START_TEST(what_rides_stands_as_on_the_ground)
{
    enum { COUNT = 10, STEPS = 120 };
    static const double velocities[3][3] = {{0, 0, 1}, {3, 1, 0}, {-1, 0, -0.5}};
    const double *v = velocities[_i / SOLVERS];
    const int solver = _i % SOLVERS;
    sadmm_world_def def = bodies_def();
    def.settings.iterations = _i / SOLVERS == 2 ? 5 : fixed_settings().iterations;
    def.settings.dt = 1.0 / 60;
    sadmm_world *world = bodies_world(&def, solver);
    static const double half[3] = {1, 1, 0.1};
    const sadmm_body_id lift = add_kinematic(world, half, 0, 0, -0.1, 0.5);
    sadmm_body_id id[COUNT];
    for (int k = 0; k < COUNT; ++k) {
        sadmm_body_def cube = cube_def(0, 0, 0.1 + 0.2 * k);
        memcpy(cube.linear_velocity, v, 3 * sizeof *v);
        id[k] = add_cube(world, &cube, 0.5);
    }
    set_velocity(world, lift, v[0], v[1], v[2], 0);
    step_world(world, STEPS);
    const sadmm_body_state low = body_state(world, lift), top = body_state(world, id[COUNT - 1]);
    expect_near(top.position[2] - low.position[2], 0.2 * COUNT, 1e-6, "height");
    for (int k = 0; k < 2; ++k) expect_near(top.position[k] - low.position[k], 0, 1e-8, "place");
    expect_near(hypot(top.orientation[1], top.orientation[2]), 0, 1e-9, "tilt");
    sadmm_world_destroy(world);
}
END_TEST

/* ---- moved to a pose --------------------------------------------------------------------------------------------- */

START_TEST(it_is_where_it_was_moved_to)
{
    const int substeps = _i / SOLVERS ? 3 : 1, solver = _i % SOLVERS;
    sadmm_world_def def = bodies_def();
    def.settings.substeps = substeps;
    const double dt = def.settings.dt;
    sadmm_world *world = bodies_world(&def, solver);
    const sadmm_body_id plate = add_kinematic(world, BELT, 0, 0, -0.1, 0.5);
    const sadmm_body_def cube = cube_def(0, 0, 0.1);
    const sadmm_body_id id = add_cube(world, &cube, 0.5);
    step_world(world, 1);
    for (int step = 1; step <= 20; ++step) {
        const double angle = 0.002 * step * step, position[3] = {0, 0, -0.1 + 0.005 * step};
        const double orientation[4] = {cos(angle / 2), 0, 0, sin(angle / 2)};
        MUST(world, sadmm_world_move_body(world, plate, position, orientation));
        step_world(world, 1);
        const sadmm_body_state s = body_state(world, plate);
        for (int k = 0; k < 3; ++k) ck_assert(s.position[k] == position[k] && s.linear_velocity[k] == 0);
        for (int k = 0; k < 4; ++k) ck_assert(s.orientation[k] == orientation[k]);
        expect_near(body_state(world, id).linear_velocity[2], 0.005 / dt, 1e-3, "speed of what it lifts");
        expect_near(body_state(world, id).position[2] - position[2], 0.2, 5e-5, "distance");
    }
    /* left alone it stays; a state that is set takes a move back */
    const sadmm_body_state before = body_state(world, plate);
    const double away[3] = {0, 0, -5}, unit[4] = {1, 0, 0, 0};
    MUST(world, sadmm_world_move_body(world, plate, away, unit));
    MUST(world, sadmm_world_set_body_state(world, plate, &before));
    step_world(world, 2);
    const sadmm_body_state after = body_state(world, plate);
    ck_assert(memcmp(after.position, before.position, sizeof after.position) == 0);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- joints ------------------------------------------------------------------------------------------------------ */

/* A body on a fixed joint to a shaft that turns goes round with it, by m w^2 r of force; one on a hinge whose drive
 * holds an angle keeps that angle to the shaft, and one driven by a speed turns by as much more. */
START_TEST(joints_hold_on_to_it)
{
    enum { STEPS = 100 };
    static const double unit[4] = {1, 0, 0, 0};
    const double w = 3, radius = 0.4;
    sadmm_world_def def = bodies_def();
    def.settings.iterations = 200;
    memset(def.settings.gravity, 0, sizeof def.settings.gravity);
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def shaft_def = sadmm_body_def_default();
    shaft_def.type = SADMM_BODY_KINEMATIC;
    shaft_def.angular_velocity[2] = w;
    const sadmm_body_id shaft = add_defined(world, &shaft_def);
    sadmm_joint_id joint[3];
    sadmm_body_id id[3];
    for (int k = 0; k < 3; ++k) {
        const double angle = 2 * k, at[3] = {radius * cos(angle), radius * sin(angle), 0};
        sadmm_body_def body = point_def(at[0], at[1], 0);
        body.linear_velocity[0] = -w * at[1], body.linear_velocity[1] = w * at[0];
        body.angular_velocity[2] = w + (k == 2 ? 5 : 0);
        id[k] = add_defined(world, &body);
        sadmm_joint_def about = sadmm_joint_def_default();
        about.kind = k == 0 ? SADMM_JOINT_FIXED : SADMM_JOINT_REVOLUTE;
        about.body_a = shaft, about.body_b = id[k];
        if (k == 1) {
            about.coordinates[5].drive = SADMM_DRIVE_POSITION;
            about.coordinates[5].drive_stiffness = 100, about.coordinates[5].drive_damping = 10;
        }
        if (k == 2) {
            about.coordinates[5].drive = SADMM_DRIVE_SPEED;
            about.coordinates[5].target_speed = 5;
        }
        MUST(world, sadmm_world_place_joint(world, &about, at, unit));
        MUST(world, sadmm_world_add_joint(world, &about, &joint[k]));
    }
    step_world(world, STEPS);
    const double turned = w * STEPS * def.settings.dt;
    for (int k = 0; k < 3; ++k) {
        const sadmm_body_state s = body_state(world, id[k]);
        sadmm_joint_state state;
        MUST(world, sadmm_world_joint_state(world, joint[k], &state));
        /* of second order in w dt = 0.015: 1e-4 of the way round */
        expect_near(s.position[0], radius * cos(2 * k + turned), 2e-4, "x");
        expect_near(s.position[1], radius * sin(2 * k + turned), 2e-4, "y");
        expect_near(norm3(state.wrench_b), 2 * w * w * radius, 0.01 * 2 * w * w * radius, "centripetal force");
        for (int j = 0; j < 5; ++j) expect_near(state.position[j], 0, 2e-5, "locked");
        expect_near(state.position[5], k == 2 ? 5 * STEPS * def.settings.dt : 0, 1e-3, "angle to the shaft");
        expect_near(state.speed[5], k == 2 ? 5 : 0, 1e-3, "speed to the shaft");
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A bead on a rod that turns: r'' = w^2 r along it, r = r_0 cosh(w t), to second order in dt: twice the steps, a
 * quarter of the error. */
START_TEST(a_bead_leaves_along_a_turning_rod)
{
    enum { STEPS = 50 };
    const double w = 2, radius = 0.3, t = 0.5;
    static const double along[4] = {0.70710678118654752, 0, 0.70710678118654752, 0}; /* z onto x */
    double error[2];
    for (int fine = 0; fine < 2; ++fine) {
        sadmm_world_def def = bodies_def();
        def.settings.iterations = 100;
        def.settings.dt = t / (STEPS << fine);
        memset(def.settings.gravity, 0, sizeof def.settings.gravity);
        sadmm_world *world = bodies_world(&def, _i);
        sadmm_body_def rod = sadmm_body_def_default(), bead = point_def(radius, 0, 0);
        rod.type = SADMM_BODY_KINEMATIC;
        rod.angular_velocity[2] = w;
        bead.linear_velocity[1] = w * radius, bead.angular_velocity[2] = w;
        sadmm_joint_def slide = sadmm_joint_def_default();
        slide.kind = SADMM_JOINT_PRISMATIC;
        slide.body_a = add_defined(world, &rod), slide.body_b = add_defined(world, &bead);
        MUST(world, sadmm_world_place_joint(world, &slide, bead.position, along));
        MUST(world, sadmm_world_add_joint(world, &slide, NULL));
        step_world(world, STEPS << fine);
        const sadmm_body_state s = body_state(world, slide.body_b);
        error[fine] = hypot(s.position[0], s.position[1]) - radius * cosh(w * t);
        expect_near(atan2(s.position[1], s.position[0]), w * t, 2e-4, "angle");
        sadmm_world_destroy(world);
    }
    /* (w dt)^2 of the radius is 1.2e-4 m; a quarter of it at half the step, and a little for the next order */
    ck_assert_msg(fabs(error[0]) < 1e-4, "%g m", error[0]);
    ck_assert_msg(fabs(error[1]) < 0.3 * fabs(error[0]), "%g and %g m", error[0], error[1]);
}
END_TEST

/* Wheels on a carrier that turns: a gear holds their angles to it, q_1 + 2 q_2 = 0, whatever the carrier does. */
START_TEST(gears_on_a_carrier)
{
    enum { STEPS = 60 };
    static const double unit[4] = {1, 0, 0, 0};
    const double w = 1.5, speed = 3;
    sadmm_world_def def = bodies_def();
    def.settings.iterations = 300;
    memset(def.settings.gravity, 0, sizeof def.settings.gravity);
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def carrier = sadmm_body_def_default();
    carrier.type = SADMM_BODY_KINEMATIC;
    carrier.angular_velocity[2] = w;
    const sadmm_body_id frame = add_defined(world, &carrier);
    sadmm_gear_def gear = sadmm_gear_def_default();
    sadmm_joint_id joint[2];
    for (int k = 0; k < 2; ++k) {
        const double place[3] = {k ? -0.2 : 0.3, 0, 0};
        sadmm_body_def wheel = point_def(place[0], 0, 0);
        wheel.linear_velocity[1] = w * place[0];
        wheel.angular_velocity[2] = w;
        sadmm_joint_def hinge = sadmm_joint_def_default();
        hinge.kind = SADMM_JOINT_REVOLUTE;
        hinge.body_a = frame, hinge.body_b = add_defined(world, &wheel);
        if (k == 0) hinge.coordinates[5].drive = SADMM_DRIVE_SPEED, hinge.coordinates[5].target_speed = speed;
        MUST(world, sadmm_world_place_joint(world, &hinge, place, unit));
        MUST(world, sadmm_world_add_joint(world, &hinge, &joint[k]));
    }
    gear.joint_1 = joint[0], gear.joint_2 = joint[1];
    gear.coordinate_1 = gear.coordinate_2 = 5;
    gear.ratio = 2;
    MUST(world, sadmm_world_add_gear(world, &gear, NULL));
    step_world(world, STEPS);
    for (int k = 0; k < 2; ++k) {
        sadmm_joint_state state;
        MUST(world, sadmm_world_joint_state(world, joint[k], &state));
        expect_near(state.speed[5], k ? -speed / 2 : speed, 1e-4, "speed to the carrier");
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A limit stops what the shaft turns the other way: a wheel at rest is taken along by the shaft from the angle on. */
START_TEST(a_limit_takes_along)
{
    static const double unit[4] = {1, 0, 0, 0}, place[3] = {0, 0, 0};
    const double w = 2, limit = 0.1;
    sadmm_world_def def = bodies_def();
    memset(def.settings.gravity, 0, sizeof def.settings.gravity);
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_def shaft_def = sadmm_body_def_default(), wheel = point_def(0, 0, 0);
    shaft_def.type = SADMM_BODY_KINEMATIC;
    shaft_def.angular_velocity[2] = w;
    sadmm_joint_def hinge = sadmm_joint_def_default();
    hinge.kind = SADMM_JOINT_REVOLUTE;
    hinge.body_a = add_defined(world, &shaft_def), hinge.body_b = add_defined(world, &wheel);
    hinge.coordinates[5].limited = true;
    hinge.coordinates[5].lower = -limit, hinge.coordinates[5].upper = INFINITY;
    sadmm_joint_id id;
    sadmm_joint_state state;
    MUST(world, sadmm_world_place_joint(world, &hinge, place, unit));
    MUST(world, sadmm_world_add_joint(world, &hinge, &id));
    step_world(world, 8); /* 0.08 rad */
    MUST(world, sadmm_world_joint_state(world, id, &state));
    expect_near(state.position[5], -8 * w * def.settings.dt, 1e-9, "before it");
    step_world(world, 40);
    MUST(world, sadmm_world_joint_state(world, id, &state));
    expect_near(state.position[5], -limit, 1e-4, "at it");
    expect_near(body_state(world, hinge.body_b).angular_velocity[2], w, 1e-4, "speed");
    sadmm_world_destroy(world);
}
END_TEST

/* ---- what holds of worlds ---------------------------------------------------------------------------------------- */

/* A belt that turns a little, with a cube that slides and one that falls on it. */
static sadmm_world *busy_world(const sadmm_world_def *def, int solver, sadmm_body_id *belt)
{
    sadmm_world *world = bodies_world(def, solver);
    *belt = add_kinematic(world, BELT, 0, 0, -0.1, 0.4);
    for (int k = 0; k < 3; ++k) {
        sadmm_body_def cube = cube_def(0.3 * k - 0.3, 0.02 * k, k < 2 ? 0.1 : 0.15);
        cube.linear_velocity[1] = 0.3 * k;
        add_cube(world, &cube, 0.5);
    }
    add_floor(world, 0.5);
    set_velocity(world, *belt, 0.7, 0.1, 0, 0.5);
    return world;
}

/* Solutions are solutions: the certificate sees the velocity that contacts are given. */
START_TEST(its_contacts_are_certified)
{
    sadmm_world_def def = bodies_def();
    def.settings.iterations = 400;
    sadmm_body_id belt;
    sadmm_world *world = busy_world(&def, _i, &belt);
    for (int step = 0; step < 12; ++step) {
        const sadmm_certificate c = certified_step(world);
        const double small = solvers[_i].precision == SADMM_F32 ? 2e-5 : 1e-6;
        ck_assert_msg(c.ncp_max < small && c.momentum_max < small, "step %d: %g m/s, %g", step, c.ncp_max,
                      c.momentum_max);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A step of sub-steps is as many steps, to the last bit, but for the method's first steps. */
START_TEST(substeps_are_steps)
{
    sadmm_world_def def = bodies_def(), fine = bodies_def();
    enum { SUBSTEPS = 4 };
    def.settings.substeps = SUBSTEPS;
    def.settings.iterations = SUBSTEPS * 50;
    fine.settings.iterations = 50;
    fine.settings.dt = def.settings.dt / SUBSTEPS;
    sadmm_body_id belt, other;
    sadmm_world *coarse = busy_world(&def, _i, &belt), *stepped = busy_world(&fine, _i, &other);
    for (int step = 0; step < 8; ++step) {
        double sum[6] = {0}, mean[6], wrench[6];
        step_world(coarse, 1);
        for (int k = 0; k < SUBSTEPS; ++k) {
            step_world(stepped, 1);
            MUST(stepped, sadmm_world_body_contact_wrench(stepped, other, wrench));
            for (int j = 0; j < 6; ++j) sum[j] += wrench[j] / SUBSTEPS;
        }
        ck_assert_msg(state_hash(coarse) == state_hash(stepped), "step %d", step);
        MUST(coarse, sadmm_world_body_contact_wrench(coarse, belt, mean));
        for (int j = 0; j < 6; ++j) expect_near(mean[j], sum[j], 1e-9 * (1 + fabs(sum[j])), "mean wrench");
    }
    sadmm_world_destroy(coarse);
    sadmm_world_destroy(stepped);
}
END_TEST

/* A frozen step is the same problem: its contacts have the velocity, the step's solution solves it, and so does what
 * comes of solving it anew. */
START_TEST(a_frozen_step_has_its_velocity)
{
    sadmm_world_def def = bodies_def();
    def.settings.iterations = 400;
    sadmm_body_id belt;
    sadmm_world *world = busy_world(&def, _i, &belt);
    sadmm_problem *problem = NULL;
    sadmm_certificate certificate;
    sadmm_solve_report report;
    ck_assert_int_eq(sadmm_problem_create(&problem), SADMM_OK);
    step_world(world, 6);
    MUST(world, sadmm_world_freeze(world, problem));
    const int32_t count = sadmm_problem_contact_count(problem), bodies = sadmm_problem_body_count(problem);
    ck_assert_int_gt(count, 0);
    ck_assert_int_eq(bodies, 3);
    double velocity[18], *impulse = calloc(3 * (size_t)count, sizeof *impulse);
    sadmm_contact *contacts = calloc((size_t)count, sizeof *contacts);
    MUST(world, sadmm_world_contacts(world, 0, count, contacts));
    for (int32_t k = 0; k < count; ++k) {
        sadmm_problem_contact c;
        ck_assert_int_eq(sadmm_problem_get_contact(problem, k, &c), SADMM_OK);
        memcpy(impulse + 3 * k, contacts[k].impulse, sizeof contacts[k].impulse);
        ck_assert(c.body_a == -1 || c.body_b == -1);
        /* the belt's, at the point: v + w x (x - its centre), halfway through the step; of b less that of a */
        const sadmm_body_state s = body_state(world, belt);
        const double x = contacts[k].position[0] - s.position[0] + 0.7 * def.settings.dt / 2,
                     y = contacts[k].position[1] - s.position[1] + 0.1 * def.settings.dt / 2,
                     sign = c.body_a == -1 ? -1 : 1;
        if (c.velocity[0] == 0) continue; /* the floor's */
        /* within what the body itself turns and goes in half a step */
        expect_near(c.velocity[0], sign * (0.7 - 0.5 * y), 2e-3, "velocity");
        expect_near(c.velocity[1], sign * (0.1 + 0.5 * x), 2e-3, "velocity");
    }
    for (int32_t i = 0; i < bodies; ++i) {
        const sadmm_body_state s = body_state(world, body_at(world, i + 1));
        memcpy(velocity + 6 * i, s.linear_velocity, sizeof s.linear_velocity);
        memcpy(velocity + 6 * i + 3, s.angular_velocity, sizeof s.angular_velocity);
    }
    ck_assert_int_eq(sadmm_problem_set_solution(problem, velocity, impulse, NULL), SADMM_OK);
    ck_assert_int_eq(sadmm_problem_certify(problem, &certificate), SADMM_OK);
    const double small = solvers[_i].precision == SADMM_F32 ? 2e-5 : 1e-6;
    ck_assert_msg(certificate.ncp_max < small, "%g", certificate.ncp_max);
    memset(impulse, 0, 3 * (size_t)count * sizeof *impulse);
    ck_assert_int_eq(sadmm_problem_set_solution(problem, NULL, impulse, NULL), SADMM_OK);
    sadmm_settings settings = fixed_settings();
    settings.iterations = 1000;
    ck_assert_int_eq(sadmm_problem_solve(problem, SADMM_BACKEND_CPU, SADMM_F64, &settings, &report), SADMM_OK);
    ck_assert_msg(report.certificate.ncp_max < 1e-6, "%g", report.certificate.ncp_max);
    free(impulse);
    free(contacts);
    sadmm_problem_destroy(problem);
    sadmm_world_destroy(world);
}
END_TEST

/* It meets neither what is static nor what is kinematic, comes and goes, and counts as no dynamic body. */
START_TEST(it_meets_dynamic_bodies_alone)
{
    sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    add_floor(world, 0.5);
    const sadmm_body_id low = add_kinematic(world, BELT, 0, 0, 0, 0.5);
    const sadmm_body_id high = add_kinematic(world, BELT, 0.1, 0, 0.15, 0.5);
    set_velocity(world, high, 0, 0, -1, 0);
    step_world(world, 10);
    ck_assert_int_eq(sadmm_world_contact_count(world), 0);
    ck_assert_int_eq(world_report(world).bodies, 0);
    expect_near(body_state(world, high).position[2], 0.15 - 10 * def.settings.dt, 1e-14, "way");
    const sadmm_body_def cube = cube_def(0, 0, 0.2);
    MUST(world, sadmm_world_remove_body(world, high));
    const sadmm_body_id id = add_cube(world, &cube, 0.5);
    step_world(world, 10);
    ck_assert_int_gt(sadmm_world_contact_count(world), 0);
    expect_near(force_on(world, low, 2), -2 * G, 1e-2 * 2 * G, "weight");
    MUST(world, sadmm_world_remove_body(world, low)); /* it falls to the floor, and is stepped as ever */
    step_world(world, 100);
    expect_near(body_state(world, id).position[2], 0.1, 1e-4, "height");
    sadmm_world_destroy(world);
}
END_TEST

#ifndef BODIES_ON_CUDA
/* Bits do not depend on how many threads there are. */
START_TEST(bits_do_not_depend_on_threads)
{
    uint64_t hash[3];
    sadmm_test_force_threads(true);
    for (int t = 0; t < 3; ++t) {
        sadmm_world_def def = bodies_def();
        def.settings.threads = 1 + 2 * t;
        def.settings.iterations = 20;
        sadmm_body_id belt;
        sadmm_world *world = busy_world(&def, _i, &belt);
        for (int k = 0; k < 40; ++k) {
            const sadmm_body_def cube = cube_def(0.3 * (k % 10) - 1.5, 0.15, 0.2 + 0.21 * (k / 10));
            add_cube(world, &cube, 0.5);
        }
        step_world(world, 15);
        ck_assert_int_gt(sadmm_world_contact_count(world), 40);
        hash[t] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert(hash[1] == hash[0] && hash[2] == hash[0]);
    sadmm_test_force_threads(false);
}
END_TEST

START_TEST(bad_calls_are_refused)
{
    static const double unit[4] = {1, 0, 0, 0}, none[3] = {0}, inertia[3] = {1, 1, 1}, bad[4] = {1, 1, 0, 0};
    sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    const sadmm_body_def dynamic = point_def(0, 0, 0);
    const sadmm_body_id moved = add_kinematic(world, BELT, 0, 0, 0, 0.5), body = add_defined(world, &dynamic);
    sadmm_shape_def plane = sadmm_shape_def_default();
    plane.type = SADMM_SHAPE_PLANE;
    const sadmm_status wrong = SADMM_ERROR_INVALID_ARGUMENT;
    ck_assert_int_eq(sadmm_world_add_shape(world, moved, &plane, NULL), wrong);
    ck_assert_int_eq(sadmm_world_set_body_wrench(world, moved, none, none), wrong);
    ck_assert(strstr(sadmm_world_message(world), "kinematic"));
    ck_assert_int_eq(sadmm_world_apply_body_impulse_at(world, moved, none, none), wrong);
    ck_assert_int_eq(sadmm_world_set_body_mass(world, moved, 1, inertia), wrong);
    ck_assert_int_eq(sadmm_world_set_body_damping(world, moved, 1, 1), wrong);
    ck_assert_int_eq(sadmm_world_move_body(world, body, none, unit), wrong);
    ck_assert(strstr(sadmm_world_message(world), "must be kinematic"));
    for (int k = 0; k < 3; ++k) {
        static const double far[3] = {NAN, INFINITY, 1.1e9};
        double position[3] = {0};
        position[k] = far[k];
        ck_assert_int_eq(sadmm_world_move_body(world, moved, position, unit), wrong);
        ck_assert(strstr(sadmm_world_message(world), "position"));
    }
    ck_assert_int_eq(sadmm_world_move_body(world, moved, none, bad), wrong);
    ck_assert_int_eq(sadmm_world_move_body(world, moved, NULL, unit), wrong);
    ck_assert_int_eq(sadmm_world_move_body(world, moved, none, NULL), wrong);
    ck_assert_int_eq(sadmm_world_move_body(NULL, moved, none, unit), wrong);
    ck_assert_int_eq(sadmm_world_move_body(world, NONE, none, unit), SADMM_ERROR_STALE_ID);
    sadmm_joint_def joint = sadmm_joint_def_default();
    joint.body_a = moved; /* and the static world */
    ck_assert_int_eq(sadmm_world_add_joint(world, &joint, NULL), wrong);
    step_world(world, 1);
    ck_assert(body_def(world, moved).type == SADMM_BODY_KINEMATIC);
    const sadmm_body_state s = body_state(world, moved);
    ck_assert(s.position[0] == 0 && s.linear_velocity[0] == 0);
    sadmm_world_destroy(world);
}
END_TEST

/* A velocity that no position can bear is set, and the step refused; the world is as before. */
START_TEST(a_step_that_fails_changes_nothing)
{
    sadmm_world_def def = bodies_def();
    sadmm_body_id belt;
    sadmm_world *world = busy_world(&def, _i, &belt);
    step_world(world, 3);
    sadmm_body_state s = body_state(world, belt), wild = s;
    wild.position[1] = 1e308;
    wild.linear_velocity[1] = 1.7e308;
    def.settings.dt = 1;
    MUST(world, sadmm_world_set_settings(world, &def.settings));
    MUST(world, sadmm_world_set_body_state(world, belt, &wild));
    const uint64_t before = state_hash(world);
    ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_NON_FINITE);
    ck_assert(state_hash(world) == before && world_report(world).step == 3);
    def.settings = fixed_settings();
    MUST(world, sadmm_world_set_settings(world, &def.settings));
    MUST(world, sadmm_world_set_body_state(world, belt, &s));
    step_world(world, 3);
    sadmm_world_destroy(world);
}
END_TEST

/* Memory may run out anywhere in a step: nothing has changed, and the next one is as if nothing had been. */
START_TEST(memory_may_run_out)
{
    const sadmm_world_def def = bodies_def();
    sadmm_body_id belt, other;
    sadmm_world *world = busy_world(&def, _i, &belt), *beside = busy_world(&def, _i, &other);
    int failures = 0;
    for (;; ++failures) {
        const uint64_t before = state_hash(world);
        sadmm_test_fail_allocations_after(failures);
        const sadmm_status status = sadmm_world_step(world);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) break;
        ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
        ck_assert(state_hash(world) == before);
        ck_assert_int_lt(failures, 1000);
    }
    ck_assert_int_gt(failures, 5);
    step_world(beside, 1);
    ck_assert(state_hash(world) == state_hash(beside));
    sadmm_test_fail_allocations_after(0);
    sadmm_body_def more = sadmm_body_def_default();
    more.type = SADMM_BODY_KINEMATIC;
    more.name = "more";
    ck_assert_int_eq(sadmm_world_add_body(world, &more, &belt), SADMM_ERROR_OUT_OF_MEMORY);
    sadmm_test_fail_allocations_after(-1);
    ck_assert_int_eq(sadmm_world_body_count(world), 5);
    step_world(world, 2);
    step_world(beside, 2);
    ck_assert(state_hash(world) == state_hash(beside));
    sadmm_world_destroy(world);
    sadmm_world_destroy(beside);
}
END_TEST

/* Contacts of problems have the velocity of their static side: refused between two bodies, kept bit for bit. */
START_TEST(problems_have_velocities)
{
    const double A[72] = {[0] = 2,  [7] = 2,  [14] = 2, [21] = 1, [28] = 1, [35] = 1,
                          [36] = 2, [43] = 2, [50] = 2, [57] = 1, [64] = 1, [71] = 1};
    const double b[12] = {0, 0, -1, 0, 0, 0, 0, 0, -1};
    sadmm_problem_contact c[3] = {{.body_a = -1, .body_b = 0, .normal = {0, 0, 1}, .friction = 0.5},
                                  {.body_a = -1, .body_b = 0, .normal = {0, 0, 1}, .friction = 0.5},
                                  {.body_a = 1, .body_b = -1, .normal = {0, 0, -1}, .friction = 0.5}},
                          read;
    sadmm_problem *problem = NULL;
    sadmm_solve_report report;
    double v[12];
    ck_assert_int_eq(sadmm_problem_create(&problem), SADMM_OK);
    ck_assert_int_eq(sadmm_problem_set_bodies(problem, 2, A, b, NULL), SADMM_OK);
    c[0].velocity[0] = c[1].velocity[0] = -0.1; /* the ground goes by +0.1 */
    c[2].velocity[1] = 0.3; /* and under the other one, which presses by 1 and grips by 0.5, by 0.3 */
    ck_assert_int_eq(sadmm_problem_set_contacts(problem, 3, c, NULL), SADMM_OK);
    for (int k = 0; k < 3; ++k) {
        ck_assert_int_eq(sadmm_problem_get_contact(problem, k, &read), SADMM_OK);
        ck_assert(read.body_a == c[k].body_a && read.body_b == c[k].body_b);
        ck_assert(memcmp(read.velocity, c[k].velocity, sizeof read.velocity) == 0);
    }
    sadmm_settings settings = fixed_settings();
    settings.iterations = 500;
    ck_assert_int_eq(sadmm_problem_solve(problem, solvers[_i].backend, solvers[_i].precision, &settings, &report),
                     SADMM_OK);
    /* m/s: of velocities of 0.25, and impulses of 1, some tens of single precision's roundings; here and below */
    ck_assert_msg(report.certificate.ncp_max < 1e-5, "%g", report.certificate.ncp_max);
    ck_assert_int_eq(sadmm_problem_get_solution(problem, v, NULL, NULL), SADMM_OK);
    /* the first one sticks: an impulse of 2 kg x 0.1 m/s of the 0.5 there is; the other one slips at 0.5 / 2 m/s */
    expect_near(v[0], 0.1, 1e-5, "it goes with the ground");
    expect_near(v[7], 0.25, 1e-5, "it slips");
    c[1].body_a = 1;
    ck_assert_int_eq(sadmm_problem_set_contacts(problem, 3, c, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert(strstr(sadmm_problem_message(problem), "contacts[1].velocity"));
    c[1].body_a = -1;
    c[1].velocity[2] = NAN;
    ck_assert_int_eq(sadmm_problem_set_contacts(problem, 3, c, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_problem_destroy(problem);
}
END_TEST
#endif

int main(void)
{
    Suite *suite = suite_create("kinematic");
    TCase *cases = tcase_create("kinematic");
    tcase_set_timeout(cases, 600);
#ifdef BODIES_ON_CUDA
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
#else
    tcase_add_loop_test(cases, bits_do_not_depend_on_threads, 0, SOLVERS);
    tcase_add_loop_test(cases, bad_calls_are_refused, 0, 1);
    tcase_add_loop_test(cases, a_step_that_fails_changes_nothing, 0, SOLVERS);
    tcase_add_loop_test(cases, problems_have_velocities, 0, SOLVERS);
    tcase_add_loop_test(cases, memory_may_run_out, 0, SOLVERS);
#endif
    tcase_add_loop_test(cases, a_belt_drags_by_friction, 0, 3 * SOLVERS);
    tcase_add_loop_test(cases, a_turntable_carries, 0, SOLVERS);
    tcase_add_loop_test(cases, a_lift_carries_weight_and_acceleration, 0, SOLVERS);
    tcase_add_loop_test(cases, a_pusher_gives_its_speed, 0, 2 * SOLVERS);
    tcase_add_loop_test(cases, a_wall_pushes_a_row, 0, SOLVERS);
    tcase_add_loop_test(cases, what_rides_stands_as_on_the_ground, 0, 3 * SOLVERS);
    tcase_add_loop_test(cases, it_is_where_it_was_moved_to, 0, 2 * SOLVERS);
    tcase_add_loop_test(cases, joints_hold_on_to_it, 0, SOLVERS);
    tcase_add_loop_test(cases, a_bead_leaves_along_a_turning_rod, 0, SOLVERS);
    tcase_add_loop_test(cases, gears_on_a_carrier, 0, SOLVERS);
    tcase_add_loop_test(cases, a_limit_takes_along, 0, SOLVERS);
    tcase_add_loop_test(cases, its_contacts_are_certified, 0, SOLVERS);
    tcase_add_loop_test(cases, substeps_are_steps, 0, SOLVERS);
    tcase_add_loop_test(cases, a_frozen_step_has_its_velocity, 0, SOLVERS);
    tcase_add_loop_test(cases, it_meets_dynamic_bodies_alone, 0, SOLVERS);
    suite_add_tcase(suite, cases);
    return RUN_BODIES_SUITE(suite);
}
