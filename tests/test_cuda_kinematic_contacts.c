/* Kinematic bodies in steps that the device makes alone, against the same kernels driven by the host: states, contacts,
 * wrenches, joints, events, rays, whatever is set between steps. The emulated device
 * (test_cuda_kinematic_contacts_emulated.c) has the host's sines: equal to the last bit. A GPU's own differ by
 * rounding, so that there worlds in which kinematic bodies turn are compared for a short while and closely; those in
 * which none turns are equal there, too. */
#include "cuda_worlds.h"
#include "fixed_work.h"

enum { LIFT, BELT, PUSHER, REST, LEFT, RIGHT, POST, TABLE, KINEMATIC, FIRST_DYNAMIC = KINEMATIC + 1 };

static sadmm_body_id add_kinematic(sadmm_world *world, double x, double z, double half)
{
    const double size[3] = {half, 0.5, 0.1};
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = SADMM_BODY_KINEMATIC;
    body.position[0] = x, body.position[2] = z;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = SADMM_SHAPE_BOX;
    shape.friction = 0.6;
    memcpy(shape.size, size, sizeof size);
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

/* A lift with a tower, a belt that drags, a wall that pushes a row, a plate at rest, two that carry a beam, a post with
 * a door on it, and a turntable. turns: the last two turn. */
static sadmm_world *yard(int precision, sadmm_method method, int substeps, bool turns)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = method;
    def.settings.iterations = 24;
    def.settings.penalty_period = 10;
    def.settings.substeps = substeps;
    sadmm_world *world = create_world(&def);
    static const double where[KINEMATIC][3] = {{-4, 0, 0.3}, {-2, 0.1, 0.6}, {0, 0.2, 0.1}, {2, 0.1, 0.3},
                                               {4, 0.3, 0.1}, {4.6, 0.3, 0.1}, {7, 0.5, 0.1}, {9, 0.2, 0.4}};
    add_floor(world, 0.5);
    for (int k = 0; k < KINEMATIC; ++k) add_kinematic(world, where[k][0], where[k][1], where[k][2]);
    for (int i = 0; i < 3; ++i) add_box(world, -4 + 0.01 * i, 0, 0.202 + 0.201 * i, 0.1, 1 + i, 0.5);
    add_box(world, -2, 0, 0.301, 0.1, 2, 0.5);
    for (int i = 0; i < 3; ++i) add_box(world, 0.22 + 0.21 * i, 0.02 * i, 0.1, 0.1, 1, 0.3);
    add_box(world, 2, 0, 0.301, 0.1, 2, 0.5);
    const sadmm_body_id beam = add_box(world, 4.3, 0, 0.501, 0.1, 3, 0.5);
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.type = SADMM_SHAPE_BOX;
    shape.size[0] = 0.35, shape.size[1] = 0.1, shape.size[2] = 0.1;
    MUST(world, sadmm_world_add_shape(world, beam, &shape, NULL));
    const sadmm_body_id ball = add_solid(world, SADMM_SHAPE_SPHERE, 9.2, 0, 0.502, 0.2, 1, 0.5);
    shape.type = SADMM_SHAPE_SPHERE;
    shape.size[0] = 0.1;
    shape.restitution = 0.6;
    sadmm_body_def drop = body_def(world, ball);
    drop.position[0] = 2.15, drop.position[1] = 0.3, drop.position[2] = 0.5;
    sadmm_body_id falling;
    MUST(world, sadmm_world_add_body(world, &drop, &falling));
    MUST(world, sadmm_world_add_shape(world, falling, &shape, NULL));
    sadmm_joint_def door = sadmm_joint_def_default();
    const double at[3] = {7.15, 0, 0.5}, upright[4] = {1, 0, 0, 0};
    door.kind = SADMM_JOINT_REVOLUTE;
    door.body_a = body_at(world, 1 + POST), door.body_b = add_box(world, 7.4, 0, 0.5, 0.15, 1, 0.5);
    door.coordinates[5].friction = 0.05;
    MUST(world, sadmm_world_place_joint(world, &door, at, upright));
    MUST(world, sadmm_world_add_joint(world, &door, NULL));
    sadmm_body_state state = body_state(world, body_at(world, 1 + TABLE));
    state.angular_velocity[2] = turns ? 1.5 : 0;
    state.linear_velocity[1] = turns ? 0 : 0.2;
    MUST(world, sadmm_world_set_body_state(world, body_at(world, 1 + TABLE), &state));
    MUST(world, sadmm_world_record_events(world, 256));
    use_device(world, precision, 0);
    return world;
}

static void go(sadmm_world *world, int which, double x, double z)
{
    sadmm_body_state state = body_state(world, body_at(world, 1 + which));
    state.linear_velocity[0] = x, state.linear_velocity[2] = z;
    MUST(world, sadmm_world_set_body_state(world, body_at(world, 1 + which), &state));
}

static void move(sadmm_world *world, int which, double x, double y, double z, double turn)
{
    const double position[3] = {x, y, z}, orientation[4] = {cos(turn / 2), 0, 0, sin(turn / 2)};
    MUST(world, sadmm_world_move_body(world, body_at(world, 1 + which), position, orientation));
}

/* What is set between two steps, in either world. Targets do not read what the device has: they wait for nothing. */
static void change(sadmm_world *world, int step, bool turns)
{
    if (step % 4 == 0) go(world, LIFT, 0.1, 0.3 * cos(0.2 * step));
    if (step == 2) go(world, BELT, 0.5, 0);
    move(world, PUSHER, 0.004 * step, 0, 0.2, 0);
    if (step == 6 || step == 7) { /* the state that is set last counts, and what is set after it */
        move(world, LEFT, 4, 0.3, 0.2, 0);
        go(world, LEFT, 0.2, 0);
        go(world, RIGHT, 0.2, 0);
        if (step == 7) move(world, RIGHT, 4.61, 0, 0.3, 0);
    }
    if (step > 3) move(world, POST, 7 + 0.002 * step, 0, 0.5, turns ? 0.03 * (step - 3) : 0);
    if (step == 9) {
        sadmm_settings settings = sadmm_world_settings(world);
        settings.dt *= 0.75;
        MUST(world, sadmm_world_set_settings(world, &settings));
    }
    if (step == 12) MUST(world, sadmm_world_remove_body(world, body_at(world, 1 + REST)));
}

static void expect_same_events(sadmm_world *a, sadmm_world *b, const char *what)
{
    sadmm_event x[256], y[256];
    int32_t count, other;
    MUST(a, sadmm_world_take_events(a, 256, x, &count, NULL));
    MUST(b, sadmm_world_take_events(b, 256, y, &other, NULL));
    ck_assert_msg(count == other && memcmp(x, y, (size_t)count * sizeof *x) == 0, "%s: events", what);
}

static void expect_same_rays(sadmm_world *a, sadmm_world *b, const char *what)
{
    sadmm_ray rays[40];
    sadmm_ray_hit x[40], y[40];
    for (int k = 0; k < 40; ++k) rays[k] = (sadmm_ray){{-5 + 0.4 * k, 0.05, 3}, {0.01, 0, -1}, HUGE_VAL};
    MUST(a, sadmm_world_cast_rays(a, 40, rays, NULL, x));
    MUST(b, sadmm_world_cast_rays(b, 40, rays, NULL, y));
    for (int k = 0; k < 40; ++k)
        ck_assert_msg(x[k].shape.slot == y[k].shape.slot && x[k].distance == y[k].distance, "%s: ray %d", what, k);
}

/* What either of them freezes: the velocities of contacts among it. */
static void expect_same_problem(sadmm_world *a, sadmm_world *b, const char *what)
{
    sadmm_world *const worlds[2] = {a, b};
    sadmm_problem *problem[2];
    for (int w = 0; w < 2; ++w) {
        ck_assert_int_eq(sadmm_problem_create(&problem[w]), SADMM_OK);
        MUST(worlds[w], sadmm_world_freeze(worlds[w], problem[w]));
    }
    const int32_t count = sadmm_problem_contact_count(problem[0]);
    ck_assert_int_eq(sadmm_problem_contact_count(problem[1]), count);
    for (int32_t k = 0; k < count; ++k) {
        sadmm_problem_contact x, y;
        ck_assert_int_eq(sadmm_problem_get_contact(problem[0], k, &x), SADMM_OK);
        ck_assert_int_eq(sadmm_problem_get_contact(problem[1], k, &y), SADMM_OK);
        ck_assert_msg(memcmp(x.velocity, y.velocity, sizeof x.velocity) == 0 && x.error == y.error, "%s: contact %d",
                      what, k);
    }
    for (int w = 0; w < 2; ++w) sadmm_problem_destroy(problem[w]);
}

static void expect_same(sadmm_world *a, sadmm_world *b, bool turns, const char *what)
{
    if (EMULATED || !turns) {
        expect_same_world(a, b, what);
        expect_same_events(a, b, what);
        expect_same_rays(a, b, what);
        expect_same_problem(a, b, what);
        return;
    }
    for (int32_t i = 0; i < sadmm_world_body_count(a); ++i) { /* rounding of sines, in so short a run */
        const sadmm_body_state x = body_state(a, body_at(a, i)), y = body_state(b, body_at(b, i));
        ck_assert_msg(distance(x.position, y.position) < 1e-4, "%s: body %d: %g", what, i,
                      distance(x.position, y.position));
    }
}

static const struct {
    sadmm_method method;
    int substeps;
    bool turns;
} ways[] = {{SADMM_METHOD_FAST, 1, false}, {SADMM_METHOD_FAST, 1, true}, {SADMM_METHOD_FAST, 3, true},
            {SADMM_METHOD_FAST, 3, false}, {SADMM_METHOD_PAPER, 1, true}, {SADMM_METHOD_PAPER, 2, false}};
enum { WAYS = sizeof ways / sizeof *ways };

static void make_pair(int precision, int way, sadmm_world *worlds[2])
{
    for (int w = 0; w < 2; ++w)
        worlds[w] = yard(precision, ways[way].method, ways[way].substeps, ways[way].turns);
    by_host(worlds[0]);
}

START_TEST(resident_steps_equal_those_by_host)
{
    const int precision = _i / WAYS, way = _i % WAYS;
    sadmm_world *worlds[2];
    char what[80];
    make_pair(precision, way, worlds);
    for (int step = 0; step < 18; ++step) {
        for (int w = 0; w < 2; ++w) {
            change(worlds[w], step, ways[way].turns);
            step_world(worlds[w], 1);
        }
        snprintf(what, sizeof what, "way %d, %s, step %d", way, precision ? "f64" : "f32", step);
        ck_assert(worlds[1]->resident.loaded == (step > 0 || ways[way].method == SADMM_METHOD_PAPER));
        ck_assert(!worlds[0]->resident.loaded);
        expect_same(worlds[0], worlds[1], ways[way].turns, what);
    }
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* Targets and steps are enqueued without a wait for what has become of them; capacities are outgrown on the way. */
START_TEST(steps_run_ahead)
{
    sadmm_world *worlds[2];
    make_pair(_i, 0, worlds);
    for (int w = 0; w < 2; ++w) {
        MUST(worlds[w], sadmm_world_record_events(worlds[w], 0));
        tune_capacities(tables[_i], worlds[w]->context, 8);
        step_world(worlds[w], 1);
    }
    for (int step = 1; step < 12; ++step)
        for (int w = 0; w < 2; ++w) {
            move(worlds[w], PUSHER, 0.004 * step, 0, 0.2, 0);
            move(worlds[w], LIFT, -4, 0, 0.002 * step * step, 0);
            MUST(worlds[w], sadmm_world_step_async(worlds[w]));
            if (w == 1) ck_assert(worlds[w]->resident.running);
        }
    bool pending;
    double position[3], orientation[4];
    MUST(worlds[1], sadmm_world_body_move(worlds[1], body_at(worlds[1], 1 + LIFT), &pending, position, orientation));
    ck_assert(!pending);
    expect_same_world(worlds[0], worlds[1], "after 12 steps");
    ck_assert(body_state(worlds[1], body_at(worlds[1], 1 + LIFT)).position[2] == 0.002 * 121);
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* Saved with a target that no step has taken along, and restored into another world. */
START_TEST(a_saved_world_goes_on)
{
    sadmm_world *worlds[2];
    size_t size;
    make_pair(_i / 2, _i % 2 ? 2 : 0, worlds);
    for (int step = 0; step < 5; ++step) {
        change(worlds[1], step, ways[_i % 2 ? 2 : 0].turns);
        step_world(worlds[1], 1);
    }
    move(worlds[1], LIFT, -3.99, 0, 0.01, 0.02);
    worlds[1]->def.backend = SADMM_BACKEND_AUTO; /* use_device has chosen */
    MUST(worlds[1], sadmm_world_save(worlds[1], NULL, 0, &size));
    void *bytes = malloc(size);
    MUST(worlds[1], sadmm_world_save(worlds[1], bytes, size, &size));
    MUST(worlds[0], sadmm_world_restore(worlds[0], bytes, size));
    for (int w = 0; w < 2; ++w) step_world(worlds[w], 4);
    ck_assert(worlds[0]->resident.loaded && worlds[1]->resident.loaded);
    expect_same_world(worlds[0], worlds[1], "restored");
    free(bytes);
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* A step that fails names the kinematic body that made it, and keeps targets and states. */
START_TEST(a_step_that_fails_keeps_targets)
{
    sadmm_world *world = yard(_i, SADMM_METHOD_PAPER, 1, false);
    bool pending;
    double position[3], orientation[4];
    step_world(world, 3);
    sadmm_settings settings = sadmm_world_settings(world), wild = settings;
    const sadmm_body_id table = body_at(world, 1 + TABLE);
    const sadmm_body_state state = body_state(world, table);
    sadmm_body_state fast = state;
    fast.position[1] = 1e308, fast.linear_velocity[1] = 1.7e308;
    wild.dt = 1;
    MUST(world, sadmm_world_set_settings(world, &wild));
    MUST(world, sadmm_world_set_body_state(world, table, &fast));
    move(world, LIFT, -4, 0, 0.003, 0);
    const uint64_t before = state_hash(world);
    ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_NON_FINITE);
    char name[32];
    snprintf(name, sizeof name, "slot %u,", table.slot);
    ck_assert_msg(strstr(sadmm_world_message(world), name), "%s", sadmm_world_message(world));
    ck_assert(state_hash(world) == before && world_report(world).step == 3);
    MUST(world, sadmm_world_body_move(world, body_at(world, 1 + LIFT), &pending, position, orientation));
    ck_assert(pending && position[2] == 0.003);
    MUST(world, sadmm_world_set_settings(world, &settings));
    MUST(world, sadmm_world_set_body_state(world, table, &state));
    step_world(world, 1);
    ck_assert(world->resident.loaded);
    ck_assert(body_state(world, body_at(world, 1 + LIFT)).position[2] == 0.003);
    MUST(world, sadmm_world_body_move(world, body_at(world, 1 + LIFT), &pending, position, orientation));
    ck_assert(!pending);
    sadmm_world_destroy(world);
}
END_TEST

/* A world of one plate, and a box of 0.2 m above (x, y). */
static sadmm_world *plate_and_box(int precision, int substeps, double length, double x, double y, double z)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.substeps = substeps;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    add_kinematic(world, 0, 0.1, length);
    add_box(world, x, y, z, 0.1, 2, 0.5);
    use_device(world, precision, 0);
    return world;
}

/* Where nothing else is, a belt that drags alone says how what it touches moves. */
START_TEST(a_belt_alone)
{
    sadmm_world *worlds[2];
    for (int w = 0; w < 2; ++w) worlds[w] = plate_and_box(_i, 1, 2, 0, 0, 0.3001);
    by_host(worlds[0]);
    for (int step = 0; step < 8; ++step) {
        for (int w = 0; w < 2; ++w) {
            if (step == 3) go(worlds[w], 0, 1, 0);
            step_world(worlds[w], 1);
        }
        expect_same_world(worlds[0], worlds[1], "a belt");
    }
    ck_assert(worlds[1]->resident.loaded);
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* A rod that turns by a third of a radian in a step hits what only its last sub-steps come near to. */
START_TEST(a_rod_turns_far_in_a_step)
{
    sadmm_world *worlds[2];
    int touched = 0;
    for (int w = 0; w < 2; ++w) {
        worlds[w] = plate_and_box(_i, 4, 2, 1.5, 1.05, 0.1);
        sadmm_body_state state = body_state(worlds[w], body_at(worlds[w], 1));
        state.angular_velocity[2] = 0.3 / sadmm_world_settings(worlds[w]).dt;
        MUST(worlds[w], sadmm_world_set_body_state(worlds[w], body_at(worlds[w], 1), &state));
    }
    by_host(worlds[0]);
    for (int step = 0; step < 3; ++step) {
        for (int w = 0; w < 2; ++w) step_world(worlds[w], 1);
        touched += norm3(body_state(worlds[1], body_at(worlds[1], 2)).linear_velocity) > 1;
        if (EMULATED) expect_same_world(worlds[0], worlds[1], "a rod");
    }
    ck_assert_int_gt(touched, 0);
    ck_assert(worlds[1]->resident.loaded);
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* More points on one body than a block lists at once. */
START_TEST(many_bodies_on_one)
{
    sadmm_world *worlds[2];
    for (int w = 0; w < 2; ++w) {
        sadmm_world_def def = fixed_world_def();
        def.backend = SADMM_BACKEND_CPU;
        def.precision = (sadmm_precision)_i;
        def.settings.iterations = 3;
        worlds[w] = create_world(&def);
        const double half[3] = {20, 20, 0.1};
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_body_id plate;
        body.type = SADMM_BODY_KINEMATIC;
        body.linear_velocity[0] = 0.1;
        MUST(worlds[w], sadmm_world_add_body(worlds[w], &body, &plate));
        shape.type = SADMM_SHAPE_BOX;
        memcpy(shape.size, half, sizeof half);
        MUST(worlds[w], sadmm_world_add_shape(worlds[w], plate, &shape, NULL));
        add_kinematic(worlds[w], 0, 5, 0.1);
        for (int i = 0; i < 300; ++i) add_box(worlds[w], 0.3 * (i % 20), 0.3 * (i / 20), 0.1999, 0.1, 1 + i % 3, 0.5);
        use_device(worlds[w], _i, 0);
    }
    by_host(worlds[0]);
    for (int w = 0; w < 2; ++w) step_world(worlds[w], 2);
    ck_assert(worlds[1]->resident.loaded);
    ck_assert_int_ge(world_report(worlds[1]).pairs, 300);
    expect_same_world(worlds[0], worlds[1], "300 boxes");
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("cuda_kinematic_contacts");
    const int precisions = tested_precisions();
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    ADD_CASE(suite, resident_steps_equal_those_by_host, 0, precisions * WAYS);
    ADD_CASE(suite, steps_run_ahead, 0, precisions);
    ADD_CASE(suite, a_saved_world_goes_on, 0, 2 * precisions);
    ADD_CASE(suite, a_step_that_fails_keeps_targets, 0, precisions);
    ADD_CASE(suite, a_belt_alone, 0, precisions);
    ADD_CASE(suite, a_rod_turns_far_in_a_step, 0, precisions);
    ADD_CASE(suite, many_bodies_on_one, 0, precisions);
    return run_cuda_suite(suite);
}
