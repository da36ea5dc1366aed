/* A palm that is moved by hand, with one jaw or two on slides that close on a cube by speed drives of limited force. */
#ifndef SADMM_TESTS_GRIP_WORLDS_H
#define SADMM_TESTS_GRIP_WORLDS_H

#include <math.h>

#include "scene_tools.h"

struct grip {
    sadmm_world *world;
    sadmm_body_id palm, cube, jaw[2];
    double dt;
};

static inline sadmm_body_id add_grip_box(sadmm_world *world, const double half[3], double x, double mass, double mu)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    def.mass = mass;
    for (int j = 0; j < 3; ++j) {
        const double a = half[(j + 1) % 3], b = half[(j + 2) % 3];
        def.inertia[j] = mass * (a * a + b * b) / 3;
    }
    def.position[0] = x, def.position[2] = 0.4;
    shape.type = SADMM_SHAPE_BOX;
    memcpy(shape.size, half, sizeof shape.size);
    shape.friction = mu;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

/* A jaw on a slide along +-x, towards the cube. */
static inline sadmm_body_id add_jaw(struct grip *g, int side, double mass, double mu, double force)
{
    static const double half[3] = {0.01, 0.03, 0.03};
    const double sign = side ? -1 : 1, x = sign * (0.03 + 0.01 + 0.001), place[3] = {x, 0, 0.4},
                 towards[4] = {sqrt(0.5), 0, -sign * sqrt(0.5), 0}; /* z turned to -x, or to x */
    const sadmm_body_id jaw = add_grip_box(g->world, half, x, mass, mu);
    sadmm_joint_def slide = sadmm_joint_def_default();
    slide.kind = SADMM_JOINT_PRISMATIC, slide.body_a = g->palm, slide.body_b = jaw;
    slide.coordinates[2].drive = SADMM_DRIVE_SPEED;
    slide.coordinates[2].target_speed = 0.1;
    slide.coordinates[2].drive_force = force;
    MUST(g->world, sadmm_world_place_joint(g->world, &slide, place, towards));
    MUST(g->world, sadmm_world_add_joint(g->world, &slide, NULL));
    return jaw;
}

/* With one jaw the other side is a block of the palm's. */
static inline struct grip make_grip(const sadmm_world_def *def, int jaws, double cube, double jaw, double mu,
                                    double force)
{
    static const double half[3] = {0.03, 0.03, 0.03};
    struct grip g = {.world = create_world(def), .dt = def->settings.dt};
    sadmm_body_def palm = sadmm_body_def_default();
    palm.type = SADMM_BODY_KINEMATIC;
    palm.position[2] = 0.5;
    MUST(g.world, sadmm_world_add_body(g.world, &palm, &g.palm));
    if (jaws == 1) {
        sadmm_shape_def block = sadmm_shape_def_default();
        block.type = SADMM_SHAPE_BOX;
        block.size[0] = 0.01, block.size[1] = block.size[2] = 0.03;
        block.position[0] = -0.04, block.position[2] = -0.1;
        block.friction = mu;
        MUST(g.world, sadmm_world_add_shape(g.world, g.palm, &block, NULL));
    }
    for (int side = 0; side < jaws; ++side) g.jaw[side] = add_jaw(&g, side, jaw, mu, force);
    g.cube = add_grip_box(g.world, half, 0, cube, mu);
    return g;
}

/* The palm is at this height after the next step. */
static inline void lift_palm(const struct grip *g, double z)
{
    const double place[3] = {0, 0, z}, unit[4] = {1, 0, 0, 0};
    MUST(g->world, sadmm_world_move_body(g->world, g->palm, place, unit));
}

static const double grip_ratios[] = {1, 10, 100, 1000}, grip_steps[] = {0.001, 0.005, 1.0 / 60};
enum {
    GRIP_RATIOS = sizeof grip_ratios / sizeof *grip_ratios,
    GRIP_STEPS = sizeof grip_steps / sizeof *grip_steps
};

/* A cube of so many times a jaw's mass is held with twice the force that it takes while the palm is shaken, by 20 mm at
 * 2.3 Hz. Coulomb: it does not slip, past the palm's block or, of two, a jaw. 1e-5 m: errors of 1e-6 m/s would add up
 * to that in 10 s. */
static inline void hold_cube(double ratio, double dt, int jaws, sadmm_precision precision, double duration)
{
    const double g = 9.81, mu = 0.5, mass = 0.1 * ratio, amplitude = 0.02, pulse = 2 * M_PI * 2.3,
                 most = amplitude * pulse * pulse, force = 2 * mass * (g + most) / (2 * mu) + 2 * 0.1 * most;
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = SADMM_BACKEND_CPU, def.precision = precision;
    def.settings.dt = dt, def.settings.threads = 1;
    struct grip grip = make_grip(&def, jaws, mass, 0.1, mu, force);
    double start[3] = {0, 0, 0}, worst = 0;
    int unsolved = 0;
    MUST(grip.world, sadmm_world_set_body_gravity_scale(grip.world, grip.cube, 0));
    const int closing = (int)ceil(0.5 / dt), shaking = (int)ceil(1 / dt), steps = (int)(duration / dt);
    for (int step = 0; step < steps; ++step) {
        const double t = (step + 1 - shaking) * dt, z = 0.5 + amplitude * sin(pulse * t) * fmin(1, t);
        if (step == closing) MUST(grip.world, sadmm_world_set_body_gravity_scale(grip.world, grip.cube, 1));
        if (t > 0) lift_palm(&grip, z);
        step_world(grip.world, 1);
        unsolved += step >= closing && world_report(grip.world).unsolved > 0; /* impacts come before */
        sadmm_body_state cube = body_state(grip.world, grip.cube);
        cube.position[2] -= jaws == 2 ? body_state(grip.world, grip.jaw[0]).position[2] : t > 0 ? z : 0.5;
        cube.position[0] = 0; /* across the jaws two drives of limited force hold nothing */
        if (t <= 0) memcpy(start, cube.position, sizeof start);
        else worst = fmax(worst, distance(start, cube.position));
    }
    ck_assert_msg(worst <= 1e-5, "ratio %g, dt %g, %d jaws, f%d: slips by %g m", ratio, dt, jaws,
                  precision == SADMM_F64 ? 64 : 32, worst);
    ck_assert_int_eq(unsolved, 0);
    sadmm_world_destroy(grip.world);
}

/* Light jaws with drives of such forces stop at a heavy cube: impulses of up to 1e5 m/s by a jaw's mass are solved to
 * what rounding leaves of them. 1e-5 m: the slop. prepare: of the world before its first step, or NULL. */
static inline void stop_strong_jaws(sadmm_precision precision, void (*prepare)(sadmm_world *, sadmm_precision))
{
    static const double forces[] = {2e5, 4e5, 8e5, 2e6};
    for (int k = 0; k < 4; ++k) {
        sadmm_world_def def = sadmm_world_def_default();
        def.backend = SADMM_BACKEND_CPU, def.precision = precision;
        def.settings.threads = 1;
        struct grip grip = make_grip(&def, 2, 1e4, 0.1, 0.5, forces[k]);
        int unsolved = 0;
        double deepest = 0;
        MUST(grip.world, sadmm_world_set_body_gravity_scale(grip.world, grip.cube, 0));
        if (prepare) prepare(grip.world, precision);
        for (int step = 0; step < 100; ++step) {
            step_world(grip.world, 1);
            unsolved += world_report(grip.world).unsolved > 0;
            deepest = fmax(deepest, world_report(grip.world).penetration_max);
        }
        ck_assert_msg(unsolved == 0 && deepest <= 1e-5, "%g N: %d steps unsolved, %g m deep", forces[k], unsolved,
                      deepest);
        sadmm_world_destroy(grip.world);
    }
}

/* All of them. */
static inline void hold_cubes(sadmm_precision precision, double duration)
{
    for (int k = 0; k < 2 * GRIP_RATIOS * GRIP_STEPS; ++k)
        hold_cube(grip_ratios[k % GRIP_RATIOS], grip_steps[k / GRIP_RATIOS % GRIP_STEPS],
                  1 + k / GRIP_RATIOS / GRIP_STEPS, precision, duration);
}

#endif
