/* What a world hands to collision and keeps from step to step, as scenes with a plain right answer. Each takes an empty
 * world that no step was made in (of whatever backend) and checks what comes out of it. */
#ifndef SADMM_TESTS_BETWEEN_STEPS_H
#define SADMM_TESTS_BETWEEN_STEPS_H

#include "fixed_work.h"
#include "scene_tools.h"

static inline sadmm_world_def between_def(double dt, double gravity)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.dt = dt;
    def.settings.gravity[2] = -gravity;
    def.settings.threads = 1; /* a body or two */
    return def;
}

/* A body of 1 kg, or a static one, of one box. */
static inline sadmm_body_id between_box(sadmm_world *world, bool moves, double x, double y, double z, double a,
                                        double b, double c)
{
    const double half[3] = { a, b, c };
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = moves ? SADMM_BODY_DYNAMIC : SADMM_BODY_STATIC;
    body.mass = 1;
    sadmm_box_inertia(1, half, body.inertia);
    body.position[0] = x;
    body.position[1] = y;
    body.position[2] = z;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = SADMM_SHAPE_BOX;
    memcpy(shape.size, half, sizeof half);
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

static inline double height_of(sadmm_world *world, sadmm_body_id id) { return body_state(world, id).position[2]; }

static inline void place(sadmm_world *world, sadmm_body_id id, double x, double y, double z)
{
    sadmm_body_state state = { .position = { x, y, z }, .orientation = { 1, 0, 0, 0 } };
    MUST(world, sadmm_world_set_body_state(world, id, &state));
}

/* ---- what is at rest before the step: world of between_def(1.0 / 60, 9.81) --------------------------------------- */

/* A card of 1 mm, 0.03 mm above a plate of 1 mm: its margin is 0.02 mm, and in the first step it falls g dt^2 = 2.7
 * mm. */
static inline void card_stays_on_plate(sadmm_world *world)
{
    between_box(world, false, 0, 0, 0, 0.05, 0.05, 0.0005);
    sadmm_body_id card = between_box(world, true, 0, 0, 0.00103, 0.04, 0.03, 0.0005);
    for (int step = 0; step < 15; ++step) {
        MUST(world, sadmm_world_step(world));
        /* never deeper than a fifth of the card */
        ck_assert_msg(height_of(world, card) > 0.0008, "step %d: the card is at %g m", step, height_of(world, card));
    }
    /* at rest on the plate, but for the slop and what 20 iterations leave */
    ck_assert_double_eq_tol(height_of(world, card), 0.001, 3e-5);
}

/* ---- world of between_def(0.005, 0) ------------------------------------------------------------------------------ */

/* A force moves a cube of 2 cm by 5 cm in its first step, through a plate of 1 mm that is 5 mm away: with a wrench set
 * before the first step, and with one set when steps have been made. */
static inline void force_does_not_drive_through(sadmm_world *world, int steps_before)
{
    const double force[3] = { 0, 0, -2000 }, none[3] = { 0, 0, 0 };
    between_box(world, false, 0, 0, 0, 0.05, 0.05, 0.0005);
    sadmm_body_id cube = between_box(world, true, 0, 0, 0.0155, 0.01, 0.01, 0.01);
    for (int step = 0; step < steps_before; ++step) MUST(world, sadmm_world_step(world));
    MUST(world, sadmm_world_set_body_wrench(world, cube, force, none));
    for (int step = 0; step < 5; ++step) {
        MUST(world, sadmm_world_step(world));
        /* one step's error of 20 iterations from nothing; the plate's far side is at 9.5 mm */
        ck_assert_msg(height_of(world, cube) > 0.0102, "step %d: the cube is at %g m", step, height_of(world, cube));
    }
}

/* A torque turns a rod of 1 m by 0.2 rad in its first step; its end meets a thin post 2 mm away. */
static inline void torque_does_not_turn_through(sadmm_world *world, int steps_before)
{
    const double none[3] = { 0, 0, 0 }, half = 0.005;
    between_box(world, false, 0.45, half + 0.002 + 0.0005, 0, 0.005, 0.0005, 0.05);
    sadmm_body_id rod = between_box(world, true, 0, 0, 0, 0.5, half, half);
    sadmm_body_def def;
    MUST(world, sadmm_world_body_def(world, rod, &def));
    const double torque[3] = { 0, 0, 0.2 / (0.005 * 0.005) * def.inertia[2] };
    for (int step = 0; step < steps_before; ++step) MUST(world, sadmm_world_step(world));
    MUST(world, sadmm_world_set_body_wrench(world, rod, none, torque));
    MUST(world, sadmm_world_step(world));
    /* The rod's upper side at the post, for a small turn. Without the post it would be 9 cm on. */
    sadmm_body_state state = body_state(world, rod);
    const double side = state.position[1] + half + 0.45 * 2 * state.orientation[3];
    ck_assert_msg(state.orientation[3] >= 0 && side < half + 0.003, "the side of the rod is at %g m", side);
}

/* ---- world of between_def(0.005, 9.81) --------------------------------------------------------------------------- */

/* A cube that rested on a slab of 4 cm is put below it, overlapping by 0.1 mm: it falls. What the pair knew of the
 * cube's side was true before. `which`: the cube is moved; the slab is; both, so that they change places. */
static inline void pose_that_is_set_forgets_the_side(sadmm_world *world, int which)
{
    sadmm_body_id slab = between_box(world, which == 2, 0, 0, 0, 0.4, 0.4, 0.02);
    sadmm_body_id cube = between_box(world, true, 0, 0, 0.07, 0.05, 0.05, 0.05);
    if (which == 2) between_box(world, false, 0, 0, -0.07, 0.4, 0.4, 0.05); /* what a slab that moves lies on */
    for (int step = 0; step < 8; ++step) MUST(world, sadmm_world_step(world));
    ck_assert_double_eq_tol(height_of(world, cube), 0.07, 1e-4);
    double highest = -0.07 + 1e-4;
    if (which == 0) place(world, cube, 0, 0, highest);
    if (which == 1) {
        place(world, slab, 0, 0, 0.14 - 1e-4);
        highest = 0.07;
    }
    if (which == 2) { /* from here on there is nothing below either */
        place(world, cube, 2, 0, 0.3);
        place(world, slab, 2, 0, 0.37 - 1e-4);
        highest = 0.3;
    }
    for (int step = 0; step < 8; ++step) {
        MUST(world, sadmm_world_step(world));
        /* a fifth of the overlap beyond the slop is taken out in a step: no more than all of it, upwards */
        ck_assert_msg(height_of(world, cube) < highest + 1e-4, "step %d: the cube is at %g m", step,
                      height_of(world, cube));
    }
}

/* A stack at rest stays at rest when steps of another length follow, as forces go on and not impulses. `tolerance`:
 * m/s, what the iterations before had left. */
static inline void stack_rests_through_steps_of_any_length(sadmm_world *world, int height, double tolerance)
{
    static const double dt[] = { 0.01, 0.0005, 0.02, 0.003 };
    sadmm_body_id top = { 0 };
    between_box(world, false, 0, 0, -0.1, 1, 1, 0.1);
    for (int i = 0; i < height; ++i) top = between_box(world, true, 0.01 * (i % 2), 0, 0.1 + 0.2 * i, 0.1, 0.1, 0.1);
    for (int step = 0; step < 40; ++step) MUST(world, sadmm_world_step(world));
    for (int k = 0; k < 4; ++k) {
        sadmm_settings settings = sadmm_world_settings(world);
        settings.dt = dt[k];
        MUST(world, sadmm_world_set_settings(world, &settings));
        for (int step = 0; step < 3; ++step) {
            MUST(world, sadmm_world_step(world));
            sadmm_body_state state = body_state(world, top);
            for (int i = 0; i < 3; ++i)
                ck_assert_msg(fabs(state.linear_velocity[i]) <= tolerance &&
                                  fabs(state.angular_velocity[i]) <= 10 * tolerance,
                              "dt = %g s, step %d: the top moves at %g m/s and %g rad/s along %d", dt[k], step,
                              state.linear_velocity[i], state.angular_velocity[i], i);
        }
    }
}

#endif
