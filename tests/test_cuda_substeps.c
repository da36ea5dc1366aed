/* Sub-steps of steps that the device makes alone (sadmm_settings.substeps, backend_cuda/device/step.h): against the
 * same kernels driven by the host, and against steps of dt / substeps, to the last bit, however the steps were
 * enqueued, planned or repeated. The same checks run on the emulated device (test_cuda_substeps_emulated.c).
 */
#include "between_steps.h"
#include "bouncing.h"
#include "cuda_worlds.h"
#include "fixed_work.h"

static void use_substeps(sadmm_world *world, int substeps)
{
    sadmm_settings settings = sadmm_world_settings(world);
    settings.substeps = substeps;
    MUST(world, sadmm_world_set_settings(world, &settings));
}

/* A step of `substeps` sub-steps as so many steps. Their iterations: of the whole, divisible. */
static void step_short(sadmm_world *world, int substeps)
{
    const sadmm_settings whole = sadmm_world_settings(world);
    sadmm_settings share = whole;
    share.dt = whole.dt / substeps;
    share.iterations = whole.iterations / substeps;
    share.substeps = 1;
    MUST(world, sadmm_world_set_settings(world, &share));
    step_world(world, substeps);
    MUST(world, sadmm_world_set_settings(world, &whole));
}

static const struct {
    int count, height, substeps;
    double friction;
    int fast; /* iterations of the method `fast`; 0: paper */
} cases[] = {{3, 2, 4, 0.5, 24}, {3, 2, 3, 0, 12}, {1, 1, 2, 0.5, 7}, {2, 2, 5, 0.5, 0},
             {4, 2, 2, 0.6, EMULATED ? 12 : 95}};
enum { CASES = sizeof cases / sizeof *cases };

/* From the first fall to rest: contacts appear in some sub-step, first cold, then warm. */
START_TEST(resident_substeps_equal_those_by_host)
{
    const int precision = _i / CASES, at = _i % CASES;
    sadmm_world *worlds[2];
    char what[80];
    for (int k = 0; k < 2; ++k) {
        worlds[k] = towers(cases[at].count, cases[at].height, cases[at].friction, precision);
        if (cases[at].fast) use_fast(worlds[k], cases[at].fast);
        use_substeps(worlds[k], cases[at].substeps);
    }
    by_host(worlds[0]);
    for (int step = 0; step < (EMULATED ? 10 : 24); ++step) {
        for (int k = 0; k < 2; ++k) MUST(worlds[k], sadmm_world_step(worlds[k]));
        ck_assert(worlds[1]->resident.loaded == (step > 0 || !cases[at].fast) && !worlds[0]->resident.loaded);
        snprintf(what, sizeof what, "case %d, %s, step %d", at, precision ? "f64" : "f32", step);
        if (step % 3 != 1) expect_same_world(worlds[0], worlds[1], what); /* also several steps between two reads */
    }
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

START_TEST(substeps_equal_short_steps)
{
    enum { SUBSTEPS = 4 };
    const int precision = _i;
    sadmm_world *whole = towers(3, 2, 0.5, precision), *parts = towers(3, 2, 0.5, precision);
    use_fast(whole, 24);
    use_fast(parts, 24);
    use_substeps(whole, SUBSTEPS);
    for (int step = 0; step < 8; ++step) {
        MUST(whole, sadmm_world_step(whole));
        step_short(parts, SUBSTEPS);
        ck_assert_msg(state_hash(whole) == state_hash(parts), "step %d", step);
        ck_assert_int_eq(sadmm_world_contact_count(whole), sadmm_world_contact_count(parts));
    }
    ck_assert(whole->resident.loaded && parts->resident.loaded);
    ck_assert_double_eq_tol(world_report(whole).time, world_report(parts).time, 1e-12); /* rounding of sums */
    ck_assert_int_eq(world_report(whole).step, 8);
    sadmm_world_destroy(whole);
    sadmm_world_destroy(parts);
}
END_TEST

/* Restitution: by the velocities of the sub-step that an impact falls into, once. Also the counts of the report. */
START_TEST(impacts_equal_those_by_host_and_of_short_steps)
{
    enum { SUBSTEPS = 4 };
    const int precision = _i / 2;
    sadmm_world *worlds[3]; /* resident, by the host, short steps */
    double bounced = 0;
    for (int k = 0; k < 3; ++k) {
        sadmm_world_def def = fixed_world_def();
        def.backend = SADMM_BACKEND_CPU;
        def.precision = (sadmm_precision)precision;
        def.settings.method = _i % 2 ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST;
        def.settings.dt = 0.02;
        def.settings.iterations = 10 * SUBSTEPS;
        def.settings.substeps = SUBSTEPS;
        worlds[k] = create_world(&def);
        add_bouncers(worlds[k], 0.3);
        use_device(worlds[k], precision, 0);
    }
    by_host(worlds[1]);
    for (int step = 0; step < (EMULATED ? 15 : 40); ++step) {
        int limited = 0;
        for (int k = 0; k < 2; ++k) MUST(worlds[k], sadmm_world_step(worlds[k]));
        sadmm_settings whole = sadmm_world_settings(worlds[2]), share = whole;
        share.dt = whole.dt / SUBSTEPS;
        share.iterations = whole.iterations / SUBSTEPS;
        share.substeps = 1;
        MUST(worlds[2], sadmm_world_set_settings(worlds[2], &share));
        for (int k = 0; k < SUBSTEPS; ++k) {
            step_world(worlds[2], 1);
            const int now = world_report(worlds[2]).limited;
            limited = now > limited ? now : limited;
        }
        MUST(worlds[2], sadmm_world_set_settings(worlds[2], &whole));
        expect_same_world(worlds[0], worlds[1], "impacts by the host");
        ck_assert_msg(state_hash(worlds[0]) == state_hash(worlds[2]), "impacts of short steps: step %d", step);
        ck_assert_int_eq(world_report(worlds[0]).limited, limited);
        bounced = fmax(bounced, upward_speed(worlds[0]));
    }
    ck_assert_double_gt(bounced, 1); /* they came down at 2 m/s and more */
    for (int k = 0; k < 3; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Steps in the queue, as bodies land and one comes to lie 10 mm deep, for which steps are repeated with pushes; twice,
 * to the same bits. */
START_TEST(enqueued_substeps_equal_single_steps)
{
    const int precision = _i;
    sadmm_world *worlds[3];
    for (int k = 0; k < 3; ++k) {
        worlds[k] = towers(3, 2, 0.5, precision);
        for (int i = 0; i < 8; ++i) add_box(worlds[k], 2 + 0.5 * i, 0, 0.11, 0.1, 1, 0.5); /* land in the ninth step */
        use_fast(worlds[k], 24);
        use_substeps(worlds[k], 3);
        if (k > 0) tune_capacities(tables[precision], worlds[k]->context, 1);
    }
    for (int step = 0; step < 12; ++step) {
        for (int k = 0; k < 3 && step == 4; ++k) place(worlds[k], body_at(worlds[k], 7), 2, 0, 0.09);
        MUST(worlds[0], sadmm_world_step(worlds[0]));
        for (int k = 1; k < 3; ++k) MUST(worlds[k], sadmm_world_step_async(worlds[k]));
    }
    for (int k = 1; k < 3; ++k) {
        MUST(worlds[k], sadmm_world_wait(worlds[k]));
        expect_same_world(worlds[0], worlds[k], "12 steps");
        ck_assert_int_gt(world_report(worlds[k]).repeated, 0);
    }
    for (int k = 0; k < 3; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Also the number of sub-steps changes between steps, and states, wrenches and bodies do. */
static void change(sadmm_world *world, int step)
{
    const double force[3] = {0.5, -0.2, 0.1 * step}, torque[3] = {0, 0.01, 0.02};
    static const int substeps[] = {4, 1, 2, 2, 3};
    if (step % 2 == 0) use_substeps(world, substeps[step / 2 % 5]);
    if (step % 3 == 0) MUST(world, sadmm_world_set_body_wrench(world, body_at(world, 1 + step % 5), force, torque));
    if (step == 5) place(world, body_at(world, 2), 0.5, 0.02, 0.41);
    if (step == 7) add_box(world, 0.1, 0.3, 1.2, 0.1, 2, 0.5);
    if (step == 9) MUST(world, sadmm_world_remove_body(world, body_at(world, 3)));
    if (step == 10) {
        sadmm_settings settings = sadmm_world_settings(world);
        settings.dt = 0.004;
        MUST(world, sadmm_world_set_settings(world, &settings));
    }
}

START_TEST(changes_between_steps_equal_those_by_host)
{
    const int precision = _i;
    sadmm_world *worlds[3];
    for (int k = 0; k < 3; ++k) {
        worlds[k] = towers(3, 2, 0.5, precision);
        use_fast(worlds[k], 20);
    }
    by_host(worlds[0]);
    for (int step = 0; step < 14; ++step) {
        for (int k = 0; k < 3; ++k) change(worlds[k], step);
        for (int k = 0; k < 2; ++k) MUST(worlds[k], sadmm_world_step(worlds[k]));
        MUST(worlds[2], sadmm_world_step_async(worlds[2]));
        if (step % 3 == 0) expect_same_world(worlds[0], worlds[1], "single steps");
    }
    expect_same_world(worlds[0], worlds[1], "single steps");
    expect_same_world(worlds[0], worlds[2], "enqueued steps");
    for (int k = 0; k < 3; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* A force sets a box off in mid-air, so fast that it leaves what the first sub-step thought it might reach, then it
 * hits others. Before it hits there are no contacts: nothing but the reach can have been why a step was repeated. */
START_TEST(a_shape_leaves_its_reach)
{
    const int precision = _i;
    const double force[3] = {8000, 0, 0}, none[3] = {0, 0, 0};
    sadmm_world *worlds[2];
    for (int k = 0; k < 2; ++k) {
        sadmm_world_def def = between_def(0.005, 0);
        def.precision = (sadmm_precision)precision;
        def.settings.iterations = 24;
        def.settings.substeps = 4;
        worlds[k] = create_world(&def);
        add_box(worlds[k], 0, 0, 0, 0.1, 1, 0.5);
        for (int i = 0; i < 3; ++i) add_box(worlds[k], 1.2 + 0.25 * i, 0.05 * i, 0.02, 0.1, 1, 0.5);
        use_device(worlds[k], precision, 0);
    }
    by_host(worlds[0]);
    for (int step = 0; step < 10; ++step) {
        if (step == 2)
            for (int k = 0; k < 2; ++k)
                MUST(worlds[k], sadmm_world_set_body_wrench(worlds[k], body_at(worlds[k], 0), force, none));
        for (int k = 0; k < 2; ++k) MUST(worlds[k], sadmm_world_step(worlds[k]));
        expect_same_world(worlds[0], worlds[1], "a box that is set off");
        const sadmm_step_report report = world_report(worlds[1]);
        if (step == 1) ck_assert_int_eq(report.repeated, 0);
        if (step == 2) ck_assert_int_gt(report.repeated, 0);
        if (step == 2) ck_assert_int_eq(report.contacts, 0);
    }
    ck_assert_double_gt(body_state(worlds[1], body_at(worlds[1], 1)).linear_velocity[0], 1); /* was hit */
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Nothing touches for some steps; then the first contact comes in a later sub-step, when it was planned for none. */
START_TEST(the_first_contact_comes_late)
{
    const int precision = _i / 4;
    sadmm_world *worlds[2];
    for (int k = 0; k < 2; ++k) {
        sadmm_world_def def = between_def(0.005, 0);
        def.precision = (sadmm_precision)precision;
        def.settings.gravity[2] = -9.81;
        def.settings.iterations = 24;
        def.settings.substeps = 4;
        worlds[k] = create_world(&def);
        add_floor(worlds[k], 0.5);
        /* On an edge: the landing turns the box, and it is not held. A sub-step takes it 2.5 mm down. */
        const sadmm_body_id box = add_box(worlds[k], 0, 0, 0.19 + 0.0025 * (_i % 4), 0.1, 1, 0.5);
        sadmm_body_state state = body_state(worlds[k], box);
        state.orientation[0] = cos(0.3);
        state.orientation[1] = sin(0.3);
        state.linear_velocity[2] = -2;
        MUST(worlds[k], sadmm_world_set_body_state(worlds[k], box, &state));
        use_device(worlds[k], precision, 0);
    }
    by_host(worlds[0]);
    int touched = 0;
    for (int step = 0; step < 20; ++step) {
        for (int k = 0; k < 2; ++k) MUST(worlds[k], sadmm_world_step(worlds[k]));
        expect_same_world(worlds[0], worlds[1], "a box that falls on its edge");
        if (step < 3) ck_assert_int_eq(world_report(worlds[1]).contacts, 0);
        touched += world_report(worlds[1]).contacts > 0;
    }
    ck_assert_int_gt(touched, 0);
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* So many shapes that candidates are searched for in a tree, and sorted by their bits: pairs of balls that roll off
 * each other in the air, at a few metres a second so that they come across others. */
START_TEST(many_shapes)
{
    enum { SIDE = 80 }; /* 6,400: 6,144 and more take the tree */
    const int precision = _i;
    sadmm_world *worlds[2];
    for (int k = 0; k < 2; ++k) {
        sadmm_world_def def = between_def(0.005, 9.81);
        def.precision = (sadmm_precision)precision;
        def.settings.iterations = 6;
        def.settings.substeps = 3;
        worlds[k] = create_world(&def);
        for (int i = 0; i < SIDE * SIDE; ++i) {
            const double x = 0.13 * (i % SIDE) - (i % 2 ? 0.035 : 0), y = 0.13 * (i / SIDE);
            const sadmm_body_id id = add_solid(worlds[k], SADMM_SHAPE_SPHERE, x, y, 0.02 * (i % 3), 0.05, 1, 0.5);
            sadmm_body_state state = body_state(worlds[k], id);
            state.linear_velocity[i % 2] = i % 5 - 2;
            MUST(worlds[k], sadmm_world_set_body_state(worlds[k], id, &state));
        }
        use_device(worlds[k], precision, 0);
    }
    by_host(worlds[0]);
    for (int step = 0; step < (EMULATED ? 3 : 20); ++step) {
        for (int k = 0; k < 2; ++k) MUST(worlds[k], sadmm_world_step(worlds[k]));
        if (step == 1) ck_assert_int_gt(world_report(worlds[1]).contacts, 1000); /* then they part */
    }
    ck_assert(worlds[1]->resident.loaded);
    expect_same_world(worlds[0], worlds[1], "many shapes");
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* A heap that tumbles: islands in the air, on edges and on the floor, whose bodies take the trapezoid correction or do
 * not, in more blocks than one. Against the host's steps, and, on the emulated device, in either order of blocks and
 * threads. */
START_TEST(heaps_equal_those_by_host)
{
    enum { BODIES = 64, WORLDS = EMULATED ? 3 : 2 };
    const int precision = _i / 2, substeps = 1 + _i % 2;
    sadmm_world *worlds[WORLDS];
    for (int k = 0; k < WORLDS; ++k) {
        sadmm_world_def def = between_def(0.005, 9.81);
        def.precision = (sadmm_precision)precision;
        def.settings.method = SADMM_METHOD_FAST;
        def.settings.iterations = 12;
        def.settings.substeps = substeps;
        worlds[k] = create_world(&def);
        add_floor(worlds[k], 0.5);
        for (int i = 0; i < BODIES; ++i) {
            const double x = 0.11 * (i % 4), y = 0.11 * (i / 4 % 4), z = 0.1 + 0.12 * (i / 16);
            const sadmm_body_id id = add_box(worlds[k], x, y, z, 0.05, 1, 0.5);
            sadmm_body_state state = body_state(worlds[k], id);
            const double turn = 0.1 * (i * 7 % 11);
            state.orientation[0] = cos(turn);
            state.orientation[1 + i % 3] = sin(turn);
            state.linear_velocity[2] = -2;
            MUST(worlds[k], sadmm_world_set_body_state(worlds[k], id, &state));
        }
        use_device(worlds[k], precision, 0);
    }
    by_host(worlds[0]);
    for (int step = 0; step < (EMULATED ? 24 : 100); ++step) {
        for (int k = 0; k < WORLDS; ++k) {
#ifdef CUDA_EMULATED
            cuda_emulation_descending = k == 2;
#endif
            MUST(worlds[k], sadmm_world_step(worlds[k]));
        }
#ifdef CUDA_EMULATED
        cuda_emulation_descending = 0;
#endif
        for (int k = 1; k < WORLDS && step % 4 == 3; ++k) expect_same_world(worlds[0], worlds[k], "heaps");
    }
    ck_assert(worlds[1]->resident.loaded && sadmm_world_contact_count(worlds[1]) > BODIES);
    for (int k = 0; k < WORLDS; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Whatever the tier, and with the stop rule, where each island stops by itself. */
START_TEST(tiers_agree)
{
    static const enum sadmm_cuda_tier tiers[] = {SADMM_CUDA_TIER_BLOCK, SADMM_CUDA_TIER_CLUSTER, SADMM_CUDA_TIER_GRID,
                                                 SADMM_CUDA_TIER_STREAM};
    const int precision = _i / 2;
    const bool stops = _i % 2;
    sadmm_world *first = NULL;
    for (int k = 0; k < 4; ++k) {
        sadmm_world *world = towers(3, 2, 0.5, precision);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.method = SADMM_METHOD_FAST;
        settings.iterations = 40;
        settings.substeps = 2;
        settings.tolerance = stops ? 1e-3 : 0;
        settings.check_period = 5;
        MUST(world, sadmm_world_set_settings(world, &settings));
        force_tier(tables[precision], world->context, tiers[k]);
        step_world(world, 9);
        ck_assert(world->resident.loaded && tier_of(tables[precision], world->context, NULL) == tiers[k]);
        const sadmm_step_report report = world_report(world);
        ck_assert_int_le(report.iterations, 40);
        ck_assert(report.iterations_mean <= report.iterations);
        ck_assert(report.converged == (stops && report.unsolved == 0));
        if (first) expect_same_world(first, world, "tiers");
        if (first) sadmm_world_destroy(world);
        else first = world;
    }
    sadmm_world_destroy(first);
}
END_TEST

/* What a step with a stop rule reports: the sum of what its sub-steps did. */
START_TEST(a_stop_rule_ends_each_substep)
{
    const int precision = _i;
    sadmm_world *whole = towers(3, 2, 0.5, precision), *parts = towers(3, 2, 0.5, precision);
    for (int k = 0; k < 2; ++k) {
        sadmm_world *world = k ? parts : whole;
        sadmm_settings settings = sadmm_world_settings(world);
        settings.method = SADMM_METHOD_FAST;
        settings.iterations = 80;
        settings.substeps = k ? 1 : 2;
        MUST(world, sadmm_world_set_settings(world, &settings));
        settings.tolerance = 1e-3;
        settings.check_period = 5;
        if (k) step_short(world, 2); /* the first step is the host's, whose rule is for all islands together */
        else step_world(world, 1);
        MUST(world, sadmm_world_set_settings(world, &settings));
    }
    for (int step = 0; step < 8; ++step) {
        MUST(whole, sadmm_world_step(whole));
        const sadmm_settings settings = sadmm_world_settings(parts);
        sadmm_settings half = settings;
        int iterations = 0;
        double mean = 0, depth = 0;
        half.dt /= 2;
        half.iterations /= 2;
        MUST(parts, sadmm_world_set_settings(parts, &half));
        for (int k = 0; k < 2; ++k) {
            step_world(parts, 1);
            const sadmm_step_report report = world_report(parts);
            iterations += report.iterations;
            mean += report.iterations_mean;
            depth = fmax(depth, report.penetration_max);
        }
        MUST(parts, sadmm_world_set_settings(parts, &settings));
        const sadmm_step_report report = world_report(whole);
        ck_assert_msg(state_hash(whole) == state_hash(parts), "step %d", step);
        /* where not all of them converged it is the budget of those with contacts */
        if (report.converged) ck_assert_int_eq(report.iterations, iterations);
        else ck_assert_int_ge(report.iterations, iterations);
        ck_assert_double_eq(report.iterations_mean, mean);
        ck_assert_double_eq(report.penetration_max, depth);
    }
    sadmm_world_destroy(whole);
    sadmm_world_destroy(parts);
}
END_TEST

/* A body that is finite after the first sub-step, and not after the second: the world stays before the step. */
START_TEST(a_later_substep_that_fails)
{
    const int precision = _i;
    sadmm_world *world = towers(2, 2, 0.5, precision), *other = towers(2, 2, 0.5, precision);
    for (int k = 0; k < 2; ++k) {
        sadmm_body_def def = sadmm_body_def_default();
        sadmm_body_id feather;
        def.mass = 1;
        def.position[0] = 9;
        def.name = "feather";
        for (int i = 0; i < 3; ++i) def.inertia[i] = 1;
        MUST(k ? other : world, sadmm_world_add_body(k ? other : world, &def, &feather));
        use_fast(k ? other : world, 24);
        use_substeps(k ? other : world, 4);
    }
    step_world(world, 5);
    step_world(other, 5);
    const sadmm_body_id feather = body_at(world, sadmm_world_body_count(world) - 1);
    const sadmm_body_state state = body_state(world, feather);
    sadmm_body_state far = state;
    sadmm_settings settings = sadmm_world_settings(world);
    /* 1.70e308 + 0.06e308 a sub-step: the largest number is 1.7977e308. In single precision the solver's velocities end
     * at 3.4e38: there the first sub-step fails. */
    settings.dt = 1;
    far.position[0] = 1.7e308;
    far.linear_velocity[0] = precision == SADMM_F64 ? 0.24e308 : 1e300;
    MUST(world, sadmm_world_set_settings(world, &settings));
    MUST(world, sadmm_world_set_body_state(world, feather, &far));
    const uint64_t before = state_hash(world);
    ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_NON_FINITE);
    ck_assert_msg(strstr(sadmm_world_message(world), "feather") != NULL, "%s", sadmm_world_message(world));
    ck_assert(state_hash(world) == before);
    ck_assert_int_eq(world_report(world).step, 5);
    /* and on, as if nothing had been */
    settings.dt = 0.005;
    MUST(world, sadmm_world_set_settings(world, &settings));
    for (int k = 0; k < 2; ++k) { /* a pose that is set counts as one, in both */
        sadmm_body_state away = state;
        away.position[0] += 1;
        MUST(k ? other : world, sadmm_world_set_body_state(k ? other : world, feather, &away));
    }
    step_world(world, 3);
    step_world(other, 3);
    expect_same_world(world, other, "after the failure");
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* Under sanitizers, on the emulated device, which is slow there: one precision. */
int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    const int parts = tested_precisions();
    Suite *suite = suite_create("cuda_substeps");
    ADD_CASE(suite, resident_substeps_equal_those_by_host, 0, parts * CASES);
    ADD_CASE(suite, substeps_equal_short_steps, 0, parts);
    ADD_CASE(suite, impacts_equal_those_by_host_and_of_short_steps, 0, 2 * parts);
    ADD_CASE(suite, enqueued_substeps_equal_single_steps, 0, parts);
    ADD_CASE(suite, changes_between_steps_equal_those_by_host, 0, parts);
    ADD_CASE(suite, a_shape_leaves_its_reach, 0, parts);
    ADD_CASE(suite, the_first_contact_comes_late, 0, 4 * parts);
    ADD_CASE(suite, many_shapes, 0, EMULATED ? 1 : parts);
    ADD_CASE(suite, heaps_equal_those_by_host, 0, 2 * parts);
    ADD_CASE(suite, tiers_agree, 0, 2 * parts);
    ADD_CASE(suite, a_stop_rule_ends_each_substep, 0, parts);
    ADD_CASE(suite, a_later_substep_that_fails, 0, parts);
    return run_cuda_suite(suite);
}
