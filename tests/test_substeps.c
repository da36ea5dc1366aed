/* Sub-steps of a world's step (sadmm_settings.substeps) on the host's backends. A step of n of them gives, to the last
 * bit, what n steps of dt / n give, so that most is tested by comparison with these. The same on the device:
 * test_cuda_substeps.c.
 */
#include "bouncing.h"
#include "collision/find/pipeline.h"
#include "core/base/definition_fields.h"
#include "core/base/parallel.h"
#include "fixed_work.h"
#include "scene_tools.h"
#include "world/state/world_state.h"

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
    sadmm_method method;
} solvers[] = {
    {SADMM_BACKEND_CPU, SADMM_F32, SADMM_METHOD_FAST},
    {SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_FAST},
    {SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_PAPER},
    {SADMM_BACKEND_REF, SADMM_F64, SADMM_METHOD_FAST},
    {SADMM_BACKEND_REF, SADMM_F64, SADMM_METHOD_PAPER},
};
enum { SOLVERS = sizeof solvers / sizeof solvers[0] };

static const char *const scenes[] = {"kicked_cubes:3", "falling_chain:5", "vertical_stacks:2", "dominoes:6"};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

static sadmm_world *open_world(int solver, const char *spec, int iterations, struct sadmm_scene *scene)
{
    *scene = open_scene(spec);
    scene->def.backend = solvers[solver].backend;
    scene->def.precision = solvers[solver].precision;
    scene->def.settings.method = solvers[solver].method;
    scene->def.settings.iterations = iterations;
    return build_scene(scene);
}

static void set_steps(sadmm_world *world, double dt, int substeps, int iterations)
{
    sadmm_settings settings = sadmm_world_settings(world);
    settings.dt = dt;
    settings.substeps = substeps;
    settings.iterations = iterations;
    MUST(world, sadmm_world_set_settings(world, &settings));
}

static bool is_dynamic(sadmm_world *world, sadmm_body_id id)
{
    return body_def(world, id).type == SADMM_BODY_DYNAMIC;
}

/* What was seen of the short steps that make up a step. */
struct parts {
    double wrench[64][6], depth;
    int iterations, limited;
    double time;
};

/* `substeps` short steps; `out`: sums of their wrenches and iterations, and the most of the rest. */
static void step_parts(sadmm_world *world, int substeps, struct parts *out)
{
    memset(out, 0, sizeof *out);
    for (int k = 0; k < substeps; ++k) {
        step_world(world, 1);
        const sadmm_step_report report = world_report(world);
        out->iterations += report.iterations;
        out->limited = report.limited > out->limited ? report.limited : out->limited;
        out->depth = fmax(out->depth, report.penetration_max);
        for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
            double wrench[6];
            if (!is_dynamic(world, body_at(world, i))) continue;
            MUST(world, sadmm_world_body_contact_wrench(world, body_at(world, i), wrench));
            for (int j = 0; j < 6; ++j) out->wrench[i][j] += wrench[j];
        }
    }
}

static void expect_parts(sadmm_world *whole, sadmm_world *world, int substeps, const struct parts *parts,
                         const char *what)
{
    const sadmm_step_report report = world_report(whole);
    const int32_t count = sadmm_world_contact_count(whole);
    ck_assert_msg(state_hash(whole) == state_hash(world), "%s: states differ", what);
    ck_assert_int_eq(report.iterations, parts->iterations);
    ck_assert_int_eq(report.limited, parts->limited);
    ck_assert(report.penetration_max == parts->depth);
    for (int32_t i = 0; i < sadmm_world_body_count(whole); ++i) { /* the mean force */
        double wrench[6];
        if (!is_dynamic(whole, body_at(whole, i))) continue;
        MUST(whole, sadmm_world_body_contact_wrench(whole, body_at(whole, i), wrench));
        for (int j = 0; j < 6; ++j)
            ck_assert_msg(wrench[j] == parts->wrench[i][j] / substeps, "%s: wrench %d of body %d: %.17g, not %.17g",
                          what, j, i, wrench[j], parts->wrench[i][j] / substeps);
    }
    /* contacts are the last sub-step's */
    ck_assert_int_eq(count, sadmm_world_contact_count(world));
    sadmm_contact *a = calloc((size_t)count + 1, sizeof *a), *b = calloc((size_t)count + 1, sizeof *b);
    MUST(whole, sadmm_world_contacts(whole, 0, count, a));
    MUST(world, sadmm_world_contacts(world, 0, count, b));
    ck_assert_msg(memcmp(a, b, (size_t)count * sizeof *a) == 0, "%s: contacts differ", what);
    free(a);
    free(b);
}

START_TEST(substeps_equal_short_steps)
{
    const int solver = _i % SOLVERS, scene_at = _i / SOLVERS % SCENES, substeps = 2 + _i % 4;
    const int iterations = solvers[solver].method == SADMM_METHOD_PAPER ? 40 : 10;
    struct sadmm_scene scene;
    struct parts parts;
    struct sadmm_error error;
    char what[96];
    sadmm_world *whole = open_world(solver, scenes[scene_at], iterations * substeps, &scene),
                *short_steps = open_world(solver, scenes[scene_at], iterations, &scene);
    const double dt = scene.def.settings.dt;
    set_steps(whole, dt, substeps, iterations * substeps);
    set_steps(short_steps, dt / substeps, 1, iterations);
    for (int step = 0; step < 25; ++step) {
        snprintf(what, sizeof what, "%s, solver %d, %d sub-steps, step %d", scenes[scene_at], solver, substeps, step);
        MUST(whole, sadmm_scene_before_step(&scene, whole, step, &error));
        MUST(short_steps, sadmm_scene_before_step(&scene, short_steps, step, &error));
        step_world(whole, 1);
        step_parts(short_steps, substeps, &parts);
        expect_parts(whole, short_steps, substeps, &parts, what);
    }
    ck_assert_int_eq(world_report(whole).step, 25);
    ck_assert_double_eq_tol(world_report(whole).time, 25 * dt, 1e-12); /* rounding of a sum of 25 */
    sadmm_world_destroy(whole);
    sadmm_world_destroy(short_steps);
}
END_TEST

/* Impacts fall into any of the sub-steps: approach speeds are those of the sub-step, each gives its restitution once.
 */
START_TEST(impacts_equal_those_of_short_steps)
{
    enum { SUBSTEPS = 4 };
    const int solver = _i % SOLVERS, iterations = solvers[solver].method == SADMM_METHOD_PAPER ? 40 : 10;
    const double dt = 0.02, friction = _i / SOLVERS ? 0.3 : 0;
    struct parts parts;
    char what[64];
    sadmm_world *worlds[2];
    double bounced = 0;
    for (int k = 0; k < 2; ++k) {
        sadmm_world_def def = fixed_world_def();
        def.backend = solvers[solver].backend;
        def.precision = solvers[solver].precision;
        def.settings.method = solvers[solver].method;
        worlds[k] = create_world(&def);
        add_bouncers(worlds[k], friction);
    }
    set_steps(worlds[0], dt, SUBSTEPS, iterations * SUBSTEPS);
    set_steps(worlds[1], dt / SUBSTEPS, 1, iterations);
    for (int step = 0; step < 40; ++step) {
        snprintf(what, sizeof what, "impacts, solver %d, step %d", solver, step);
        step_world(worlds[0], 1);
        step_parts(worlds[1], SUBSTEPS, &parts);
        expect_parts(worlds[0], worlds[1], SUBSTEPS, &parts, what);
        bounced = fmax(bounced, upward_speed(worlds[0]));
    }
    ck_assert_double_gt(bounced, 1); /* they came down at 2 m/s and more */
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Cubes of 1 kg under 1000 kg: iterations so few leave more energy than there is, by `paper` as well. */
START_TEST(limited_is_the_most_of_any_substep)
{
    enum { SUBSTEPS = 4, CUBES = 4 };
    const double dt = 0.02, half[3] = {0.1, 0.1, 0.1};
    struct parts parts;
    int limited = 0;
    sadmm_world *worlds[2];
    for (int k = 0; k < 2; ++k) {
        sadmm_world_def def = fixed_world_def();
        def.backend = solvers[_i].backend;
        def.precision = solvers[_i].precision;
        def.settings.method = solvers[_i].method;
        worlds[k] = create_world(&def);
        add_floor(worlds[k], 1);
        for (int i = 0; i < CUBES; ++i) {
            const sadmm_body_state state = {.position = {0, 0, 0.1 + 0.2 * i}};
            add_thrown(worlds[k], SADMM_SHAPE_BOX, half, &state, i == CUBES - 1 ? 1000 : 1, 1, 0);
        }
    }
    set_steps(worlds[0], dt, SUBSTEPS, 20 * SUBSTEPS);
    set_steps(worlds[1], dt / SUBSTEPS, 1, 20);
    for (int step = 0; step < 30; ++step) {
        step_world(worlds[0], 1);
        step_parts(worlds[1], SUBSTEPS, &parts);
        expect_parts(worlds[0], worlds[1], SUBSTEPS, &parts, "heavy on light");
        limited += parts.limited;
    }
    if (solvers[_i].method == SADMM_METHOD_PAPER) ck_assert_int_gt(limited, 0);
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Shares that do not come out even are rounded up; without contacts Step 1 is exact, once a sub-step. */
START_TEST(iterations_are_shared)
{
    struct sadmm_scene scene;
    sadmm_world *world = open_world(1, "vertical_stacks:2", 20, &scene);
    static const int wanted[][3] = {{1, 20, 20}, {2, 20, 20}, {3, 20, 21}, {7, 20, 21}, {64, 20, 64}, {4, 1, 4}};
    for (size_t k = 0; k < sizeof wanted / sizeof *wanted; ++k) {
        set_steps(world, 0.004, wanted[k][0], wanted[k][1]);
        step_world(world, 1);
        ck_assert_int_eq(world_report(world).iterations, wanted[k][2]);
    }
    sadmm_world_destroy(world);
    world = open_world(1, "falling_chain:1", 20, &scene);
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        sadmm_body_state state = body_state(world, body_at(world, i));
        if (!is_dynamic(world, body_at(world, i))) continue;
        state.position[2] += 100;
        MUST(world, sadmm_world_set_body_state(world, body_at(world, i), &state));
    }
    set_steps(world, 0.004, 5, 20);
    step_world(world, 1);
    ck_assert_int_eq(world_report(world).contacts, 0);
    ck_assert_int_eq(world_report(world).iterations, 5);
    sadmm_world_destroy(world);
}
END_TEST

/* A ball falls on the ground: what its contacts give it in a step, as read, is what its momentum has changed by beside
 * gravity and the force that is set, whatever happens between sub-steps. */
START_TEST(wrenches_keep_momentum)
{
    const double force[3] = {0.7, 0, -1.5}, none[3] = {0, 0, 0}, mass = 2, radius = 0.1, dt = 0.01;
    sadmm_world_def def = fixed_world_def();
    sadmm_body_def ground = sadmm_body_def_default(), ball = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default(), sphere = sadmm_shape_def_default();
    sadmm_body_id id;
    bool hit = false;
    def.backend = solvers[_i].backend;
    def.precision = solvers[_i].precision;
    def.settings.method = solvers[_i].method;
    def.settings.iterations = 5000; /* solved */
    def.settings.dt = dt;
    def.settings.substeps = 5;
    sadmm_world *world = create_world(&def);
    ground.type = SADMM_BODY_STATIC;
    ground.environment = -1;
    MUST(world, sadmm_world_add_body(world, &ground, &id));
    plane.type = SADMM_SHAPE_PLANE;
    MUST(world, sadmm_world_add_shape(world, id, &plane, NULL));
    ball.mass = mass;
    sadmm_sphere_inertia(mass, radius, ball.inertia);
    ball.position[2] = radius + 0.031;
    MUST(world, sadmm_world_add_body(world, &ball, &id));
    sphere.type = SADMM_SHAPE_SPHERE;
    sphere.size[0] = radius;
    MUST(world, sadmm_world_add_shape(world, id, &sphere, NULL));
    MUST(world, sadmm_world_set_body_wrench(world, id, force, none));
    for (int step = 0; step < 20; ++step) {
        double wrench[6];
        const sadmm_body_state before = body_state(world, id);
        step_world(world, 1);
        const sadmm_body_state after = body_state(world, id);
        MUST(world, sadmm_world_body_contact_wrench(world, id, wrench));
        hit = hit || (wrench[2] > 0 && before.linear_velocity[2] < -0.5);
        for (int k = 0; k < 3; ++k) {
            const double given = dt * (wrench[k] + force[k] + (k == 2 ? -9.81 * mass : 0)),
                         gained = mass * (after.linear_velocity[k] - before.linear_velocity[k]);
            /* what the iterations leave of the momentum balance of a body on one contact, and rounding, against the
             * landing's 2 N s */
            ck_assert_double_eq_tol(gained, given, solvers[_i].precision == SADMM_F32 ? 1e-5 : 1e-9);
        }
    }
    ck_assert(hit);
    sadmm_world_destroy(world);
}
END_TEST

/* What the fast backends make of it is what `ref` does: solved, with as much as rounding leaves in a few steps of a
 * scene at rest. */
START_TEST(cpu_and_ref_agree)
{
    struct sadmm_scene scene;
    sadmm_world *worlds[2];
    for (int k = 0; k < 2; ++k) {
        worlds[k] = open_world(k ? 3 : 1, "vertical_stacks:2", 1200, &scene);
        set_steps(worlds[k], 0.005, 4, 1200);
        step_world(worlds[k], 6);
    }
    for (int32_t i = 0; i < sadmm_world_body_count(worlds[0]); ++i) {
        const sadmm_body_state a = body_state(worlds[0], body_at(worlds[0], i)),
                               b = body_state(worlds[1], body_at(worlds[1], i));
        for (int k = 0; k < 3; ++k) {
            ck_assert_double_eq_tol(a.position[k], b.position[k], 1e-10);
            ck_assert_double_eq_tol(a.linear_velocity[k], b.linear_velocity[k], 1e-9);
        }
    }
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

START_TEST(results_do_not_depend_on_threads)
{
    uint64_t hashes[2];
    for (int k = 0; k < 2; ++k) {
        struct sadmm_scene scene;
        sadmm_test_force_threads(true);
        sadmm_world *world = open_world(_i, "pile:40", 24, &scene);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.substeps = 3;
        settings.threads = k ? 4 : 1;
        MUST(world, sadmm_world_set_settings(world, &settings));
        step_world(world, 60);
        ck_assert_int_gt(world_report(world).contacts, 0);
        hashes[k] = state_hash(world);
        sadmm_world_destroy(world);
        sadmm_test_force_threads(false);
    }
    ck_assert(hashes[0] == hashes[1]);
}
END_TEST

/* Finite after the first sub-step, not after the second: the world, and what can be read of its last step, stays. */
START_TEST(a_later_substep_that_fails)
{
    struct sadmm_scene scene;
    sadmm_world *worlds[2];
    sadmm_body_id feather[2];
    double wrench[2][6];
    for (int k = 0; k < 2; ++k) {
        sadmm_body_def def = sadmm_body_def_default();
        worlds[k] = open_world(1, "kicked_cubes:2", 40, &scene);
        def.mass = 1;
        def.position[0] = 50;
        def.name = "feather";
        for (int i = 0; i < 3; ++i) def.inertia[i] = 1;
        MUST(worlds[k], sadmm_world_add_body(worlds[k], &def, &feather[k]));
        set_steps(worlds[k], 0.005, 4, 40);
        step_world(worlds[k], 12);
    }
    sadmm_world *world = worlds[0], *other = worlds[1];
    const sadmm_body_state state = body_state(world, feather[0]);
    sadmm_body_state far = state;
    /* 1.70e308 + 0.06e308 a sub-step; the largest number is 1.7977e308 */
    far.position[0] = 1.7e308;
    far.linear_velocity[0] = 0.24e308;
    set_steps(world, 1, 4, 40);
    MUST(world, sadmm_world_set_body_state(world, feather[0], &far));
    const uint64_t before = state_hash(world);
    const int32_t contacts = sadmm_world_contact_count(world);
    ck_assert_int_gt(contacts, 0);
    ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_NON_FINITE);
    ck_assert_msg(strstr(sadmm_world_message(world), "feather") != NULL, "%s", sadmm_world_message(world));
    ck_assert(state_hash(world) == before);
    ck_assert_int_eq(world_report(world).step, 12);
    ck_assert_int_eq(sadmm_world_contact_count(world), contacts);
    sadmm_contact *a = calloc((size_t)contacts, sizeof *a), *b = calloc((size_t)contacts, sizeof *b);
    MUST(world, sadmm_world_contacts(world, 0, contacts, a));
    MUST(other, sadmm_world_contacts(other, 0, contacts, b));
    ck_assert(memcmp(a, b, (size_t)contacts * sizeof *a) == 0);
    free(a);
    free(b);
    for (int k = 0; k < 2; ++k)
        MUST(worlds[k], sadmm_world_body_contact_wrench(worlds[k], body_at(worlds[k], 1), wrench[k]));
    ck_assert(memcmp(wrench[0], wrench[1], sizeof wrench[0]) == 0);
    /* and on, as if nothing had been */
    set_steps(world, 0.005, 4, 40);
    for (int k = 0; k < 2; ++k) { /* a pose that is set counts, in both */
        sadmm_body_state away = state;
        away.position[0] += 1;
        MUST(worlds[k], sadmm_world_set_body_state(worlds[k], feather[k], &away));
    }
    step_world(world, 5);
    step_world(other, 5);
    ck_assert(state_hash(world) == state_hash(other));
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Impulses are forces that act for the length of a sub-step: what rests goes on resting however steps are divided. */
START_TEST(a_stack_rests_while_substeps_change)
{
    static const int substeps[] = {1, 4, 2, 8, 1, 3};
    struct sadmm_scene scene;
    sadmm_world *world = open_world(_i, "vertical_stacks:1", 40, &scene);
    step_world(world, 200);
    double height[16];
    for (int32_t i = 0; i < sadmm_world_body_count(world) && i < 16; ++i)
        height[i] = body_state(world, body_at(world, i)).position[2];
    for (int step = 0; step < 60; ++step) {
        set_steps(world, 0.005, substeps[step % 6], 20 * substeps[step % 6]);
        step_world(world, 1);
    }
    for (int32_t i = 0; i < sadmm_world_body_count(world) && i < 16; ++i)
        /* the slop; in single precision what impulses are rounded by moves the stack as far again */
        ck_assert_double_eq_tol(body_state(world, body_at(world, i)).position[2], height[i], 2e-5);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(settings_that_are_refused)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    ck_assert_int_eq(def.settings.substeps, 1);
    sadmm_world *world = create_world(&def);
    static const int wrong[] = {0, -3, SADMM_MOST_SUBSTEPS + 1};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; ++k) {
        char text[80];
        sadmm_settings settings = sadmm_world_settings(world);
        settings.substeps = wrong[k];
        ck_assert_int_eq(sadmm_world_set_settings(world, &settings), SADMM_ERROR_INVALID_ARGUMENT);
        snprintf(text, sizeof text, "settings.substeps = %d: must be in [1, %d]", wrong[k], SADMM_MOST_SUBSTEPS);
        ck_assert_str_eq(sadmm_world_message(world), text);
        ck_assert_int_eq(sadmm_world_settings(world).substeps, 1);
    }
    sadmm_settings settings = sadmm_world_settings(world);
    settings.dt = 4e-6;
    settings.substeps = 5;
    ck_assert_int_eq(sadmm_world_set_settings(world, &settings), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_world_message(world), "settings.dt / settings.substeps = 4e-06 / 5: must be >= 1e-06");
    settings.substeps = 4;
    MUST(world, sadmm_world_set_settings(world, &settings));
    settings.dt = 1;
    settings.substeps = SADMM_MOST_SUBSTEPS;
    MUST(world, sadmm_world_set_settings(world, &settings));
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(explain_says_so)
{
    char text[2048];
    struct sadmm_scene scene;
    sadmm_world *world = open_world(1, "vertical_stacks:2", 20, &scene);
    ck_assert_uint_gt(sadmm_world_explain(world, text, sizeof text), 0); /* of no step yet */
    step_world(world, 1);
    sadmm_world_explain(world, text, sizeof text);
    ck_assert_msg(!strstr(text, "sub-steps"), "%s", text);
    set_steps(world, 0.005, 4, 18);
    step_world(world, 1);
    sadmm_world_explain(world, text, sizeof text);
    ck_assert_msg(strstr(text, "sub-steps    4 of 0.00125 s with up to 5 iterations each"), "%s", text);
    ck_assert_msg(strstr(text, "iterations   20 of at most 20"), "%s", text);
    sadmm_world_destroy(world);
}
END_TEST

/* The frozen problem is the last sub-step's: what a solver makes of it is what that sub-step did. */
START_TEST(the_frozen_problem_is_the_last_one)
{
    struct sadmm_scene scene;
    sadmm_world *whole = open_world(1, "kicked_cubes:2", 40, &scene),
                *parts = open_world(1, "kicked_cubes:2", 10, &scene);
    sadmm_problem *frozen[2];
    double *b[2];
    set_steps(whole, 0.004, 4, 40);
    set_steps(parts, 0.001, 1, 10);
    step_world(whole, 5);
    step_world(parts, 20);
    for (int k = 0; k < 2; ++k) {
        ck_assert_int_eq(sadmm_problem_create(&frozen[k]), SADMM_OK);
        MUST(k ? parts : whole, sadmm_world_freeze(k ? parts : whole, frozen[k]));
        b[k] = calloc(6 * (size_t)sadmm_problem_body_count(frozen[k]), sizeof *b[k]);
        ck_assert_int_eq(sadmm_problem_get_bodies(frozen[k], NULL, b[k], NULL), SADMM_OK);
    }
    ck_assert_int_eq(sadmm_problem_body_count(frozen[0]), sadmm_problem_body_count(frozen[1]));
    ck_assert(memcmp(b[0], b[1], 6 * (size_t)sadmm_problem_body_count(frozen[0]) * sizeof *b[0]) == 0);
    step_world(parts, 3);
    const sadmm_certificate of_whole = certified_step(whole), of_parts = certified_step(parts);
    ck_assert(of_whole.ncp_max >= 0 && of_whole.ncp_max == of_parts.ncp_max);
    ck_assert(of_whole.momentum_max == of_parts.momentum_max);
    for (int k = 0; k < 2; ++k) {
        sadmm_problem_destroy(frozen[k]);
        free(b[k]);
        sadmm_world_destroy(k ? parts : whole);
    }
}
END_TEST

/* ---- the broad phase, once a step ------------------------------------------------------------------------------- */

static int updates; /* of the broad phase */

static sadmm_status counted_update(struct sadmm_broad_phase *broad_phase, const struct sadmm_broad_entry *entries,
                                   size_t entry_count, const uint32_t *changed, size_t changed_count,
                                   struct sadmm_error *error)
{
    ++updates;
    return sadmm_broad_phase_sweep.update(broad_phase, entries, entry_count, changed, changed_count, error);
}

/* Bodies that go on as they began leave no box between two sub-steps, at any speed. */
START_TEST(the_broad_phase_runs_once_a_step)
{
    enum { BODIES = 40, SUBSTEPS = 4 };
    struct sadmm_broad_phase_kind kind = sadmm_broad_phase_sweep;
    struct sadmm_geometry ball = {.type = SADMM_SHAPE_SPHERE, .subshapes = 1, .size = {0.1, 0, 0}};
    struct sadmm_shape shapes[BODIES];
    struct sadmm_collision_body bodies[BODIES];
    struct sadmm_contact_set contacts = {0};
    struct sadmm_collision *collision;
    struct sadmm_error error;
    kind.update = counted_update;
    ck_assert_int_eq(sadmm_collision_create_with(&kind, &collision, &error), SADMM_OK);
    for (int i = 0; i < BODIES; ++i) {
        shapes[i] = (struct sadmm_shape){.orientation = {1}, .category = 1, .mask = 1, .body = i, .alive = true};
        bodies[i] = (struct sadmm_collision_body){.position = {i}, .orientation = {1}, .system_body = i};
        bodies[i].velocity[1] = i < BODIES / 2 ? 0.5 * i : -10.0 * i; /* m/s: up to 5 cm, or 2 m, a step */
    }
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = BODIES, .geometries = &ball,
        .geometry_count = 1, .bodies = bodies, .body_count = BODIES, .dt = 0.005 / SUBSTEPS, .margin = 0.02,
        .threads = 1};
    int in_first = 0;
    for (int step = 0; step < 50; ++step)
        for (int k = 0; k < SUBSTEPS; ++k) {
            updates = 0;
            input.substeps_left = SUBSTEPS - 1 - k;
            const sadmm_status status = k ? sadmm_collision_find_again(collision, &input, &contacts, &error)
                                          : sadmm_collision_find(collision, &input, &contacts, &error);
            ck_assert_int_eq(status, SADMM_OK);
            if (k == 0) in_first += updates;
            else ck_assert_msg(updates == 0, "step %d, sub-step %d", step, k);
            for (int i = 0; i < BODIES; ++i) bodies[i].position[1] += input.dt * bodies[i].velocity[1];
        }
    ck_assert_int_gt(in_first, 10); /* they do leave their boxes */
    sadmm_collision_destroy(collision);
    sadmm_contact_set_free(&contacts);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("substeps");
    TCase *tests = tcase_create("substeps");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, substeps_equal_short_steps, 0, SOLVERS * SCENES);
    tcase_add_loop_test(tests, impacts_equal_those_of_short_steps, 0, 2 * SOLVERS);
    tcase_add_loop_test(tests, limited_is_the_most_of_any_substep, 0, SOLVERS);
    tcase_add_test(tests, iterations_are_shared);
    tcase_add_loop_test(tests, wrenches_keep_momentum, 0, SOLVERS);
    tcase_add_test(tests, cpu_and_ref_agree);
    tcase_add_loop_test(tests, results_do_not_depend_on_threads, 0, SOLVERS);
    tcase_add_test(tests, a_later_substep_that_fails);
    tcase_add_loop_test(tests, a_stack_rests_while_substeps_change, 0, 2);
    tcase_add_test(tests, settings_that_are_refused);
    tcase_add_test(tests, explain_says_so);
    tcase_add_test(tests, the_frozen_problem_is_the_last_one);
    tcase_add_test(tests, the_broad_phase_runs_once_a_step);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
