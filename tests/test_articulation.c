/* Articulations and their block direct solve (core/solve/articulation.h): where loads and masses are far beyond what an
 * iteration of few steps brings along a mechanism. */
#include "failed_step.h"
#include "fewer.h"
#include "fixed_work.h"
#include "scene_tools.h"
#include "solvers.h"

#include "core/model/joint_law.h"
#include "core/solve/articulation_order.h"

static const double UNIT[4] = {1, 0, 0, 0};
static const double ABOUT_Y[4] = {0.70710678118654752, -0.70710678118654752, 0, 0}; /* z of the frame along y */
static const sadmm_body_id WORLD = {0, 0};

static sadmm_world *new_world(int solver, double dt, int iterations)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = solvers[solver].backend;
    def.precision = solvers[solver].precision;
    def.settings.method = solvers[solver].method;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.iterations = iterations;
    def.settings.gravity[2] = -9.81;
    return create_world(&def);
}

static sadmm_body_id add_body(sadmm_world *world, double mass, const double inertia[3], double x, double z)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = mass;
    memcpy(def.inertia, inertia, sizeof def.inertia);
    def.position[0] = x;
    def.position[2] = z;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static sadmm_joint_id join(sadmm_world *world, sadmm_joint_kind kind, sadmm_body_id a, sadmm_body_id b, double x,
                           double z, const double orientation[4], const sadmm_joint_coordinate *about)
{
    const double place[3] = {x, 0, z};
    sadmm_joint_def def = sadmm_joint_def_default();
    sadmm_joint_id id;
    def.kind = kind;
    def.body_a = a;
    def.body_b = b;
    if (about) def.coordinates[5] = *about;
    MUST(world, sadmm_world_place_joint(world, &def, place, orientation));
    MUST(world, sadmm_world_add_joint(world, &def, &id));
    return id;
}

/* ---- loads far above the mass that bears them -------------------------------------------------------------------- */

/* A chain of 100 links of 0.2 m and 1 kg with a weight at its end hangs: 20 iterations, 100 steps. */
START_TEST(a_chain_bears_many_times_its_weight)
{
    static const double weights[] = {1000, 50000};
    enum { LINKS = 100 };
    const double length = 0.2, inertia[3] = {0.0033, 0.0033, 0.001}, weight = weights[_i / SOLVERS],
                 heavy[3] = {0.01 * weight, 0.01 * weight, 0.01 * weight}, rest = -LINKS * length - 0.1;
    sadmm_world *world = new_world(_i % SOLVERS, 0.005, 20);
    sadmm_body_id last = WORLD, end = WORLD;
    for (int k = 0; k <= LINKS; ++k) {
        end = k < LINKS ? add_body(world, 1, inertia, 0, -length * (k + 0.5)) : add_body(world, weight, heavy, 0, rest);
        join(world, SADMM_JOINT_SPHERICAL, last, end, 0, -length * k, UNIT, NULL);
        last = end;
    }
    for (int step = 0; step < 100; ++step) {
        step_world(world, 1);
        /* of 20 m. The regularisation of a row leaves a billionth of the speed that its load would give a link
         * (core/model/articulation.h), and the feedback takes that back: 1.4e-7 and 7e-6 m in all */
        ck_assert_double_lt(fabs(body_state(world, end).position[2] - rest), 2e-10 * weight);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A cube of so many kg at the end of a beam of 0.1 kg cubes on fixed joints, 0.1 m wide all; the last one. */
static sadmm_body_id add_beam(sadmm_world *world, double load)
{
    enum { BODIES = 3 };
    sadmm_body_id last = WORLD;
    for (int k = 0; k <= BODIES; ++k) {
        const double mass = k < BODIES ? 0.1 : load, moment = 1.7e-3 * mass, inertia[3] = {moment, moment, moment};
        const sadmm_body_id body = add_body(world, mass, inertia, 0.1 * k + 0.05, 0);
        join(world, SADMM_JOINT_FIXED, last, body, 0.1 * k, 0, UNIT, NULL);
        last = body;
    }
    return last;
}

START_TEST(a_light_beam_does_not_sag)
{
    sadmm_world *world = new_world(_i, 0.005, 20);
    const sadmm_body_id last = add_beam(world, 100);
    for (int step = 0; step < 200; ++step) {
        step_world(world, 1);
        /* the regularisation of a row leaves a billionth of the 10 m/s that the load would give a body a step: 1.4e-7
         * m */
        ck_assert_double_lt(fabs(body_state(world, last).position[2]), 1e-6);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* Two welds of bodies of 1 kg that are to be 1 mm, 1 cm or 10 cm elsewhere: no motion meets both. Neither presses
 * against the other by more than what would move the bodies by all that it asks for, correction_speed at most. With
 * the dense contact solve, whose rows are exact, and without. */
START_TEST(locks_that_disagree_do_not_press_against_each_other)
{
    static const double inertia[3] = {0.1, 0.1, 0.1}, by[3] = {0.001, 0.01, 0.1};
    for (int k = 0; k < 6; ++k) {
        sadmm_world *world = new_world(_i, 0.005, 20);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.gravity[2] = 0;
        settings.ncp_points = k < 3 ? 0 : 64;
        MUST(world, sadmm_world_set_settings(world, &settings));
        const sadmm_body_id a = add_body(world, 1, inertia, 0, 0), b = add_body(world, 1, inertia, 1, 0);
        sadmm_joint_id joints[2];
        joints[0] = join(world, SADMM_JOINT_FIXED, a, b, 0.5, 0, UNIT, NULL);
        sadmm_joint_def other;
        MUST(world, sadmm_world_joint_def(world, joints[0], &other));
        other.position_a[0] += by[k % 3];
        MUST(world, sadmm_world_add_joint(world, &other, &joints[1]));
        for (int step = 0; step < 100; ++step) {
            step_world(world, 1);
            for (int j = 0; j < 2; ++j) {
                sadmm_joint_state state;
                MUST(world, sadmm_world_joint_state(world, joints[j], &state));
                for (int r = 0; r < 6; ++r)
                    ck_assert_msg(fabs(state.wrench_b[r]) * settings.dt <= settings.correction_speed,
                                  "%g m apart, ncp_points %d, step %d: %g N s", by[k % 3], settings.ncp_points, step,
                                  state.wrench_b[r] * settings.dt);
            }
            ck_assert_double_lt(fabs(body_state(world, a).linear_velocity[0] +
                                     body_state(world, b).linear_velocity[0]), 1e-5);
        }
        sadmm_world_destroy(world);
    }
}
END_TEST

/* 1 t: the regularisation of locks leaves 1.5e-4 m/s or rad/s, which one refinement takes away, all but its square:
 * 2.8e-7. */
START_TEST(heavy_locks_are_refined)
{
    sadmm_world *world = new_world(_i, 0.005, 20);
    add_beam(world, 1000);
    for (int step = 0; step < 50; ++step) ck_assert_double_lt(certified_step(world).ncp_max, 1e-6);
    sadmm_world_destroy(world);
}
END_TEST

/* A motor turns a link of 0.1 kg with 1000 kg at its end, against their weight: 1 rad/s, from the first step on. */
START_TEST(a_motor_moves_ten_thousand_times_its_link)
{
    const double light[3] = {1e-3, 1e-3, 1e-3}, heavy[3] = {10, 10, 10}, dt = 0.005;
    const sadmm_joint_coordinate drive = {.drive = SADMM_DRIVE_SPEED, .target_speed = 1, .drive_force = INFINITY};
    sadmm_world *world = new_world(_i, dt, 20);
    const sadmm_body_id link = add_body(world, 0.1, light, 0.1, 0), load = add_body(world, 1000, heavy, 0.3, 0);
    const sadmm_joint_id motor = join(world, SADMM_JOINT_REVOLUTE, WORLD, link, 0, 0, ABOUT_Y, &drive);
    join(world, SADMM_JOINT_FIXED, link, load, 0.2, 0, UNIT, NULL);
    for (int step = 1; step <= 400; ++step) {
        sadmm_joint_state state;
        step_world(world, 1);
        MUST(world, sadmm_world_joint_state(world, motor, &state));
        /* a torque of 2600 N m gives the link by itself 1e4 rad/s a step, and their regularisation leaves rows a
         * billionth of that and more where the load swings in: 9e-5 */
        ck_assert_double_lt(fabs(state.speed[5] - 1), 2e-4);
        /* by the mean of the speeds before and after the first step: half a step behind */
        ck_assert_double_lt(fabs(state.position[5] - (step - 0.5) * dt), 1e-4);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A rotor at 1000 rad/s on a revolute joint, 10 s: nothing drifts. */
START_TEST(a_fast_rotor_stays)
{
    const double inertia[3] = {0.01, 0.01, 0.02};
    sadmm_world *world = new_world(_i, 0.001, 20);
    const sadmm_body_id rotor = add_body(world, 1, inertia, 0, 0);
    const sadmm_joint_id joint = join(world, SADMM_JOINT_REVOLUTE, WORLD, rotor, 0, 0, UNIT, NULL);
    sadmm_body_state state = body_state(world, rotor);
    sadmm_joint_state held;
    state.angular_velocity[2] = 1000;
    MUST(world, sadmm_world_set_body_state(world, rotor, &state));
    step_world(world, 10000);
    MUST(world, sadmm_world_joint_state(world, joint, &held));
    for (int k = 0; k < 5; ++k) ck_assert_double_lt(fabs(held.position[k]), 1e-9); /* rounding of 1600 turns */
    ck_assert_double_lt(fabs(held.speed[5] - 1000), 1e-6);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- loops ------------------------------------------------------------------------------------------------------- */

/* IFToMM's benchmark A02: three uprights and two crossbars, rods of 1 m and 1 kg, crossbars at 1 m/s, gravity 9.81.
 * With all rods on one line the linkage may part into two motions, and it passes there twice a turn. Returns how far
 * the first upright's tip is from (0.3284573768, 0.9445187937) m after 10 s (Exudyn, its step 1.25e-4 s; it changes by
 * 2e-6 m from twice that). reversed: each crossbar's second hinge has its ends the other way round. */
static double double_four_bar(double dt, bool reversed)
{
    const double thin = 1e-6, upright[3] = {1.0 / 12, 1.0 / 12, thin}, across[3] = {thin, 1.0 / 12, 1.0 / 12};
    sadmm_world *world = new_world(0, dt, 20);
    sadmm_body_id uprights[3];
    for (int k = 0; k < 3; ++k) {
        uprights[k] = add_body(world, 1, upright, k, 0.5);
        sadmm_body_state state = body_state(world, uprights[k]);
        state.linear_velocity[0] = 0.5, state.angular_velocity[1] = 1;
        MUST(world, sadmm_world_set_body_state(world, uprights[k], &state));
        join(world, SADMM_JOINT_REVOLUTE, WORLD, uprights[k], k, 0, ABOUT_Y, NULL);
    }
    for (int k = 0; k < 2; ++k) {
        const sadmm_body_id bar = add_body(world, 1, across, k + 0.5, 1);
        sadmm_body_state state = body_state(world, bar);
        state.linear_velocity[0] = 1;
        MUST(world, sadmm_world_set_body_state(world, bar, &state));
        join(world, SADMM_JOINT_REVOLUTE, uprights[k], bar, k, 1, ABOUT_Y, NULL);
        join(world, SADMM_JOINT_REVOLUTE, reversed ? bar : uprights[k + 1], reversed ? uprights[k + 1] : bar, k + 1, 1,
             ABOUT_Y, NULL);
    }
    step_world(world, (int)lround(10 / dt));
    const sadmm_body_state end = body_state(world, uprights[0]);
    const double *q = end.orientation, x = end.position[0] + q[1] * q[3] + q[0] * q[2],
                 z = end.position[2] + 0.5 - q[1] * q[1] - q[2] * q[2];
    sadmm_world_destroy(world);
    return hypot(x - 0.3284573768, z - 0.9445187937);
}

START_TEST(a_double_four_bar_is_where_it_should_be)
{
    for (double dt = 0.0025; dt > 0.0005; dt /= 2) /* third order: seen 3600, 6000 and 6900 dt^3 m/s^3 */
        ck_assert_double_lt(double_four_bar(dt, false), 1e4 * dt * dt * dt);
    /* with coarse steps the other way round parts at a place where all rods are on one line, by chance: 5e-3 m at
     * 1.25 ms; with these it does not */
    ck_assert_double_lt(double_four_bar(0.000625, true), 1e-4);
    for (int reversed = 0; reversed < fewer(2); ++reversed)
        ck_assert_double_lt(double_four_bar(0.00025, reversed), 1e-5);
}
END_TEST

/* ---- all laws ---------------------------------------------------------------------------------------------------- */

/* Numbers in [0, 1) from an integer hash, the same everywhere. */
static double random_at(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / (1 << 24);
}

/* A random tree of bodies of 10 g to 100 kg with joints of every kind, laws on what is free, some loops: one iteration
 * a step, and the step is solved all the same: rows by the certificate's natural map, and the momentum of every
 * body. */
START_TEST(mechanisms_are_solved_by_one_iteration)
{
    enum { BODIES = 24 };
    uint32_t state = (uint32_t)_i * 7919 + 1;
    sadmm_world *world = new_world(0, 0.005, 1);
    sadmm_body_id bodies[BODIES];
    for (int k = 0; k < BODIES; ++k) {
        const double mass = pow(10, -2 + 4 * random_at(&state)), size = mass * (0.01 + 0.02 * random_at(&state)),
                     inertia[3] = {size, 1.2 * size, 0.9 * size};
        bodies[k] = add_body(world, mass, inertia, 0.2 * k + 0.1, 0.3 * random_at(&state));
    }
    for (int k = 0; k < BODIES; ++k) {
        const int kind = (int)(random_at(&state) * SADMM_JOINT_KIND_COUNT), parent = (int)(random_at(&state) * k);
        const double place[3] = {0.2 * k, 0.1 * random_at(&state), 0.1}, half = random_at(&state),
                     turn[4] = {cos(half), sin(half), 0, 0};
        sadmm_joint_def def = sadmm_joint_def_default();
        def.kind = (sadmm_joint_kind)kind;
        def.locks = 21;
        def.body_a = k == 0 ? WORLD : bodies[parent];
        def.body_b = bodies[k];
        MUST(world, sadmm_world_place_joint(world, &def, place, turn));
        if (joint_is_radial(def.kind)) {
            def.position_b[0] += 0.3;
            if (kind == SADMM_JOINT_SPRING) def.coordinates[0].spring_stiffness = 200;
        } else if (kind == SADMM_JOINT_REVOLUTE) {
            sadmm_joint_coordinate *c = &def.coordinates[5];
            if (k % 3 == 0) c->friction = 0.2 * random_at(&state);
            if (k % 3 == 1) c->limited = true, c->lower = -0.02, c->upper = 0.05;
            if (k % 3 == 2) c->drive = SADMM_DRIVE_SPEED, c->target_speed = 2, c->drive_force = 0.5;
        }
        MUST(world, sadmm_world_add_joint(world, &def, NULL));
    }
    for (int step = 0; step < 20; ++step) {
        const sadmm_certificate certificate = certified_step(world);
        /* a billionth of the speed that a load gives the body that bears it by itself (core/model/articulation.h): 100
         * kg that are pulled at some m/s on 10 g, 1e4 m/s and more. The iteration alone is off by some m/s. */
        ck_assert_msg(certificate.ncp_max < 1e-4, "mechanism %d, step %d: natural map %g", _i, step,
                      certificate.ncp_max);
        /* to rounding: velocities and multipliers are of one solution, in double */
        ck_assert_msg(certificate.momentum_max < 1e-9, "mechanism %d, step %d: momentum %g", _i, step,
                      certificate.momentum_max);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* ---- steps that fail --------------------------------------------------------------------------------------------- */

/* What was solved before the iterations of a step that failed says nothing of a later step, which solves articulations
 * only after them: here another velocity of theirs, and no warm start. */
START_TEST(a_failed_step_leaves_nothing)
{
    static const double inertia[3] = {0.01, 0.01, 0.01};
    uint64_t hash[2];
    for (int fails = 0; fails < 2; ++fails) {
        sadmm_world *world = new_world(_i, 0.005, 20);
        const sadmm_body_id arm = add_body(world, 1, inertia, 0.1, 0), other = add_body(world, 1, inertia, 9, 0);
        join(world, SADMM_JOINT_REVOLUTE, WORLD, arm, 0, 0, ABOUT_Y, NULL);
        step_world(world, 5);
        if (fails) fail_a_step(world, other);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.warm_start = false;
        MUST(world, sadmm_world_set_settings(world, &settings));
        sadmm_body_state turning = body_state(world, arm);
        for (int k = 0; k < 3; ++k) turning.linear_velocity[k] = turning.angular_velocity[k] = 0;
        turning.linear_velocity[2] = -0.1, turning.angular_velocity[1] = 1;
        MUST(world, sadmm_world_set_body_state(world, arm, &turning));
        step_world(world, 3);
        hash[fails] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

/* ---- the order --------------------------------------------------------------------------------------------------- */

static void expect_order(const struct articulation_structure *s)
{
    for (int32_t b = 0; b < s->blocks; ++b) ck_assert_int_gt(s->row[b], s->column[b]);
    for (int32_t node = 0; node < s->columns + s->blocks; ++node)
        for (int32_t at = s->first_update[node]; at < s->first_update[node + 1]; ++at) {
            const int32_t from = s->column[s->update[2 * at]],
                          column = node < s->columns ? node : s->column[node - s->columns];
            ck_assert_int_lt(from, column); /* columns before it alone */
            ck_assert_int_eq(from, s->column[s->update[2 * at + 1]]);
        }
}

/* A hub has more constraints than the block direct solve takes; what hangs on one of its spokes is, by itself. */
START_TEST(constraints_left_out_are_in_no_part)
{
    enum { SPOKES = 65, CHAIN = 9, CONSTRAINTS = SPOKES + CHAIN };
    int32_t bodies[2 * CONSTRAINTS];
    struct sadmm_articulation_order order = {0};
    for (int32_t k = 0; k < CONSTRAINTS; ++k) { /* the chain's last one is at the last spoke */
        bodies[2 * k] = k < SPOKES ? 0 : SPOKES + CONSTRAINTS - k;
        bodies[2 * k + 1] = k < SPOKES ? k + 1 : bodies[2 * k] - 1;
    }
    ck_assert(sadmm_articulation_order_make(&order, bodies, CONSTRAINTS, CONSTRAINTS + 1, 64));
    ck_assert_int_eq(order.parts, 0); /* the spokes press on the chain */
    ck_assert(sadmm_articulation_order_make(&order, bodies + 2, CONSTRAINTS - 1, CONSTRAINTS + 1, 64));
    ck_assert_int_eq(order.parts, 1); /* 64 may be at a body; the chain is at the last one still */
    ck_assert_int_eq(sadmm_articulation_part(&order, 0).columns, CONSTRAINTS - 1);
    /* With the chain apart it is one. */
    bodies[2 * (CONSTRAINTS - 1) + 1] = -1;
    ck_assert(sadmm_articulation_order_make(&order, bodies, CONSTRAINTS, CONSTRAINTS + 1, 64));
    ck_assert_int_eq(order.parts, 1);
    const struct articulation_structure s = sadmm_articulation_part(&order, 0);
    ck_assert_int_eq(s.columns, CHAIN);
    for (int32_t p = 0; p < s.columns; ++p) ck_assert_int_ge(s.constraint[p], SPOKES);
    expect_order(&s);
    sadmm_articulation_order_free(&order);
}
END_TEST

/* So is a part whose factor fills up, while a sparse one beside it stays. */
START_TEST(parts_that_fill_up_are_left_out)
{
    enum { BODIES = 60, EACH = 10, CHAIN = 20, CONSTRAINTS = BODIES * EACH + CHAIN };
    static int32_t bodies[2 * CONSTRAINTS];
    struct sadmm_articulation_order order = {0};
    uint32_t random = 1;
    for (int32_t k = 0; k < CONSTRAINTS; ++k) {
        random = random * 1664525 + 1013904223;
        bodies[2 * k] = k < BODIES * EACH ? k % BODIES : BODIES + k - BODIES * EACH;
        bodies[2 * k + 1] =
            k < BODIES * EACH ? (k + 1 + (int32_t)(random >> 8) % (BODIES - 1)) % BODIES : bodies[2 * k] + 1;
    }
    ck_assert(sadmm_articulation_order_make(&order, bodies, CONSTRAINTS, BODIES + CHAIN + 1, 64));
    ck_assert_int_eq(order.parts, 1);
    const struct articulation_structure s = sadmm_articulation_part(&order, 0);
    ck_assert_int_eq(s.columns, CHAIN);
    expect_order(&s);
    sadmm_articulation_order_free(&order);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("articulation");
    TCase *tests = tcase_create("articulation");
    tcase_set_timeout(tests, 120);
    tcase_add_loop_test(tests, a_chain_bears_many_times_its_weight, 0, 2 * SOLVERS);
    tcase_add_loop_test(tests, a_light_beam_does_not_sag, 0, SOLVERS);
    tcase_add_loop_test(tests, locks_that_disagree_do_not_press_against_each_other, 0, SOLVERS);
    tcase_add_loop_test(tests, heavy_locks_are_refined, 0, SOLVERS);
    tcase_add_loop_test(tests, a_motor_moves_ten_thousand_times_its_link, 0, SOLVERS);
    tcase_add_loop_test(tests, a_fast_rotor_stays, 0, 2);
    tcase_add_test(tests, a_double_four_bar_is_where_it_should_be);
    tcase_add_loop_test(tests, mechanisms_are_solved_by_one_iteration, 0, 40);
    tcase_add_loop_test(tests, a_failed_step_leaves_nothing, 0, SOLVERS);
    tcase_add_test(tests, constraints_left_out_are_in_no_part);
    tcase_add_test(tests, parts_that_fill_up_are_left_out);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
