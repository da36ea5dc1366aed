/* Whole steps on the device (backend_cuda/device/step.h) against the same kernels driven by the host, step by step.
 *
 * Contacts are the same bits on both sides, and so are the solver's kernels: everything that can be read of a world
 * must be equal to the last bit, however the steps were enqueued, planned or repeated. A stop rule that is never met
 * sends a world through the host: `by_host`. The same checks run on the emulated device (test_cuda_step_emulated.c).
 * One file: nearly every test makes this one comparison (expect_same_world), in another situation.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "between_steps.h"
#include "core/base/memory.h"
#include "cuda_worlds.h"
#include "fixed_work.h"

/* The last device: another one than the first where there are several. */
static int last_device(void)
{
    struct sadmm_context *context;
    struct sadmm_error error;
    int device = 0;
    while (tables[0]->create(device + 1, &context, &error) == SADMM_OK) {
        tables[0]->destroy(context);
        ++device;
    }
    return device;
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

static const struct {
    int count, height;
    double friction;
    int fast; /* iterations of the method `fast`; 0: paper */
} cases[] = {
    {1, 1, 0.5, 0}, {3, 2, 0.5, 0},  {3, 2, 0, 0},  {EMULATED ? 4 : 9, EMULATED ? 2 : 4, 0.6, 0},
    {1, 1, 0.5, 7}, {3, 2, 0.5, 23}, {3, 2, 0, 12}, {EMULATED ? 4 : 9, EMULATED ? 2 : 4, 0.6, EMULATED ? 6 : 95}};
enum { CASES = sizeof cases / sizeof *cases };

/* From the first fall to rest: contacts appear, change and stay; cold steps with penalty updates or new weights, then
 * warm ones. 95 iterations are enough for levels. */
START_TEST(resident_steps_equal_steps_by_host)
{
    const int precision = _i / CASES, at = _i % CASES;
    sadmm_world *host = towers(cases[at].count, cases[at].height, cases[at].friction, precision);
    sadmm_world *device = towers(cases[at].count, cases[at].height, cases[at].friction, precision);
    char what[80];
    if (cases[at].fast) {
        use_fast(host, cases[at].fast);
        use_fast(device, cases[at].fast);
    }
    by_host(host);
    for (int step = 0; step < (EMULATED ? 16 : 24); ++step) {
        MUST(host, sadmm_world_step(host));
        MUST(device, sadmm_world_step(device));
        ck_assert(device->resident.loaded == (step > 0 || !cases[at].fast) && !host->resident.loaded);
        if (step % 4 && step > 8) continue; /* also several steps between two reads */
        snprintf(what, sizeof what, "case %d, %s, step %d", at, precision ? "f64" : "f32", step);
        expect_same_world(host, device, what);
    }
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
}
END_TEST

/* The queue, however long, gives what single steps give; also where its first steps have to be repeated with larger
 * capacities. */
START_TEST(enqueued_steps_equal_single_steps)
{
    const int precision = _i;
    sadmm_world *single = towers(3, 2, 0.5, precision), *queue = towers(3, 2, 0.5, precision);
    tune_capacities(tables[precision], queue->context, 1);
    for (int step = 0; step < 20; ++step) {
        MUST(single, sadmm_world_step(single));
        MUST(queue, sadmm_world_step_async(queue));
    }
    MUST(queue, sadmm_world_wait(queue));
    expect_same_world(single, queue, "20 steps");
    sadmm_step_report report;
    ck_assert_int_eq(sadmm_world_report(queue, &report), SADMM_OK);
    ck_assert_int_gt(report.repeated, 0); /* the first contact changes the plan */
    ck_assert_int_eq(report.repeated, queue->resident.repeats); /* loaded once */
    sadmm_world_destroy(single);
    sadmm_world_destroy(queue);
}
END_TEST

/* What may be changed between steps, one after the other. */
static void change(sadmm_world *world, int step)
{
    const double force[3] = {0.5, -0.2, 0.1 * step}, torque[3] = {0, 0.01, 0.02};
    sadmm_body_id id = body_at(world, 1 + step % 5);
    if (step % 2 == 0) MUST(world, sadmm_world_set_body_wrench(world, id, force, torque));
    if (step % 7 == 3) {
        sadmm_body_state state = body_state(world, id);
        state.linear_velocity[2] += 0.3;
        state.position[0] += 0.003;
        MUST(world, sadmm_world_set_body_state(world, id, &state));
    }
    if (step % 7 == 5) { /* unread, twice: the later one counts, and the world may be ahead of the host */
        place(world, id, 0.5 * (step % 5), 0.02, 0.3);
        place(world, id, 0.5 * (step % 5), 0.01, 0.41);
    }
    if (step == 6) add_box(world, 0.1, 0.3, 1.2, 0.1, 2, 0.5);
    if (step == 9) MUST(world, sadmm_world_remove_body(world, body_at(world, 3)));
    if (step == 12) MUST(world, sadmm_world_set_body_pair_contact(world, body_at(world, 1), body_at(world, 2), false));
    if (step == 14) {
        sadmm_settings settings = sadmm_world_settings(world);
        settings.dt = 0.004;
        settings.iterations = 20;
        MUST(world, sadmm_world_set_settings(world, &settings));
    }
    if (step == 16) {
        sadmm_body_state state = body_state(world, body_at(world, 0));
        state.position[2] = -0.05; /* the ground sinks */
        MUST(world, sadmm_world_set_body_state(world, body_at(world, 0), &state));
    }
}

START_TEST(changes_between_steps_equal_those_by_host)
{
    const int precision = _i;
    sadmm_world *host = towers(4, 2, 0.5, precision), *device = towers(4, 2, 0.5, precision);
    sadmm_world *queue = towers(4, 2, 0.5, precision);
    by_host(host);
    for (int step = 0; step < 22; ++step) {
        change(host, step);
        change(device, step);
        change(queue, step);
        MUST(host, sadmm_world_step(host));
        MUST(device, sadmm_world_step(device));
        MUST(queue, sadmm_world_step_async(queue));
        if (step % 3 == 0) expect_same_world(host, device, "single steps");
    }
    expect_same_world(host, device, "single steps");
    expect_same_world(host, queue, "enqueued steps");
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
    sadmm_world_destroy(queue);
}
END_TEST

/* The scenes of between_steps.h, with their answers; and by the host to the same bits. */
static sadmm_world *world_between(int scene, int precision, bool host)
{
    sadmm_world_def def = between_def(scene == 0 ? 1.0 / 60 : 0.005, scene == 1 || scene == 2 ? 0 : 9.81);
    def.precision = (sadmm_precision)precision;
    sadmm_world *world = create_world(&def);
    use_device(world, precision, 0);
    if (host) by_host(world);
    if (scene == 0) card_stays_on_plate(world);
    if (scene == 1) force_does_not_drive_through(world, 2);
    if (scene == 2) torque_does_not_turn_through(world, 2);
    if (scene >= 3 && scene < 6) pose_that_is_set_forgets_the_side(world, scene - 3);
    /* f32: rounding of impulses, over the mass */
    if (scene == 6) stack_rests_through_steps_of_any_length(world, 2, precision == SADMM_F32 ? 1e-5 : 1e-9);
    return world;
}
enum { SCENES_BETWEEN = 7 };

START_TEST(what_is_kept_between_steps)
{
    const int precision = _i / SCENES_BETWEEN, scene = _i % SCENES_BETWEEN;
    sadmm_world *host = world_between(scene, precision, true), *device = world_between(scene, precision, false);
    ck_assert(device->resident.loaded && !host->resident.loaded);
    expect_same_world(host, device, "between steps");
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
}
END_TEST

/* Between the backend and the host and back, with warm starts kept. */
START_TEST(worlds_come_and_go)
{
    const int precision = _i;
    sadmm_world *host = towers(3, 3, 0.5, precision), *both = towers(3, 3, 0.5, precision);
    by_host(host);
    for (int step = 0; step < 18; ++step) {
        sadmm_settings settings = sadmm_world_settings(both);
        settings.residual_tolerance = step / 3 % 2 ? 1e-300 : 0;
        settings.check_period = 1000000;
        MUST(both, sadmm_world_set_settings(both, &settings));
        MUST(host, sadmm_world_step(host));
        MUST(both, sadmm_world_step(both));
        ck_assert(both->resident.loaded == (step / 3 % 2 == 0));
    }
    expect_same_world(host, both, "18 steps");
    sadmm_world_destroy(host);
    sadmm_world_destroy(both);
}
END_TEST

/* Bodies, contacts and impulses, bit for bit. */
static void expect_same_problems(sadmm_problem *a, sadmm_problem *b)
{
    const int32_t bodies = sadmm_problem_body_count(a), contacts = sadmm_problem_contact_count(a);
    sadmm_problem *const problems[2] = {a, b};
    double *numbers[2];
    sadmm_problem_contact *points[2];
    const size_t body = 36 + 6 + 6, each = (size_t)bodies * body + 3 * (size_t)contacts;
    ck_assert_int_gt(contacts, 0);
    ck_assert_int_eq(sadmm_problem_body_count(b), bodies);
    ck_assert_int_eq(sadmm_problem_contact_count(b), contacts);
    for (int k = 0; k < 2; ++k) {
        double *A = numbers[k] = calloc(each, sizeof *A), *rest = A + 36 * (size_t)bodies;
        points[k] = calloc((size_t)contacts, sizeof *points[k]);
        ck_assert_int_eq(sadmm_problem_get_bodies(problems[k], A, rest, rest + 6 * (size_t)bodies), SADMM_OK);
        ck_assert_int_eq(sadmm_problem_get_solution(problems[k], NULL, rest + 12 * (size_t)bodies, NULL), SADMM_OK);
        for (int32_t c = 0; c < contacts; ++c)
            ck_assert_int_eq(sadmm_problem_get_contact(problems[k], c, &points[k][c]), SADMM_OK);
    }
    ck_assert_int_eq(memcmp(numbers[0], numbers[1], each * sizeof(double)), 0);
    ck_assert_int_eq(memcmp(points[0], points[1], (size_t)contacts * sizeof *points[0]), 0);
    for (int k = 0; k < 2; ++k) {
        free(numbers[k]);
        free(points[k]);
    }
}

/* Certificate, residuals and the frozen problem of a resident step. */
START_TEST(readings_of_a_resident_step)
{
    const int precision = _i;
    sadmm_world *host = towers(2, 3, 0.5, precision), *device = towers(2, 3, 0.5, precision);
    by_host(host);
    for (int pass = 0; pass < 2; ++pass) {
        sadmm_world *world = pass ? device : host;
        sadmm_settings settings = sadmm_world_settings(world);
        settings.certify = settings.measure_residuals = true;
        MUST(world, sadmm_world_set_settings(world, &settings));
        step_world(world, 12);
    }
    sadmm_step_report a = world_report(host), b = world_report(device);
    ck_assert_double_ge(a.certificate.ncp_max, 0);
    ck_assert(memcmp(&a.certificate, &b.certificate, sizeof a.certificate) == 0);
    ck_assert_double_ge(a.residual.primal, 0);
    ck_assert(a.residual.primal == b.residual.primal && a.residual.dual == b.residual.dual);
    sadmm_problem *frozen[2];
    for (int pass = 0; pass < 2; ++pass) {
        ck_assert_int_eq(sadmm_problem_create(&frozen[pass]), SADMM_OK);
        MUST(pass ? device : host, sadmm_world_freeze(pass ? device : host, frozen[pass]));
    }
    expect_same_problems(frozen[0], frozen[1]);
    for (int pass = 0; pass < 2; ++pass) sadmm_problem_destroy(frozen[pass]);
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
}
END_TEST

static void expect_same_wrench(sadmm_world *a, sadmm_world *b)
{
    double wa[6], wb[6];
    MUST(a, sadmm_world_body_contact_wrench(a, body_at(a, 1), wa));
    MUST(b, sadmm_world_body_contact_wrench(b, body_at(b, 1), wb));
    ck_assert_msg(memcmp(wa, wb, sizeof wa) == 0, "wrenches differ: %g and %g", wa[2], wb[2]);
}

/* A step that makes a body not finite names it and leaves the world before it, with everything set since. */
START_TEST(a_step_that_fails_leaves_the_world_before_it)
{
    const int precision = _i;
    const double zero[3] = {0}, force[3] = {0, 0, 3};
    sadmm_world *world = towers(3, 2, 0.5, precision), *other = towers(3, 2, 0.5, precision);
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id feather[2];
    def.mass = 1;
    def.position[2] = 9;
    def.name = "feather";
    for (int k = 0; k < 3; ++k) def.inertia[k] = 1;
    for (int pass = 0; pass < 2; ++pass)
        MUST(pass ? other : world, sadmm_world_add_body(pass ? other : world, &def, &feather[pass]));
    step_world(world, 5);
    step_world(other, 5);
    const sadmm_body_state state = body_state(world, feather[0]);
    sadmm_body_state fast = state;
    fast.angular_velocity[0] = 1e200; /* its square is no number */
    MUST(world, sadmm_world_set_body_state(world, feather[0], &fast));
    uint64_t before = state_hash(world);
    sadmm_status status = sadmm_world_step_async(world);
    MUST(world, sadmm_world_set_body_wrench(world, body_at(world, 1), force, zero));
    for (int k = 0; k < 2 && status == SADMM_OK; ++k) status = sadmm_world_step_async(world);
    if (status == SADMM_OK) status = sadmm_world_wait(world);
    ck_assert_int_eq(status, SADMM_ERROR_NON_FINITE);
    ck_assert_msg(strstr(sadmm_world_message(world), "feather") != NULL, "%s", sadmm_world_message(world));
    ck_assert(state_hash(world) == before);
    ck_assert_int_eq(world_report(world).step, 5);
    ck_assert_int_eq(sadmm_world_wait(world), SADMM_OK); /* once */
    expect_same_wrench(world, other); /* of the last step done, not of the one that failed */
    /* and on: the wrench set behind the failing step counts */
    MUST(world, sadmm_world_set_body_state(world, feather[0], &state));
    MUST(other, sadmm_world_set_body_wrench(other, body_at(other, 1), force, zero));
    step_world(world, 3);
    step_world(other, 3);
    expect_same_world(world, other, "after the failure");
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* Contacts that were read before a step that fails can be read after it; those that were not are gone with it, and
 * calls that have no status leave its error for the next one that has. */
START_TEST(contacts_after_a_step_that_fails)
{
    const int precision = _i;
    sadmm_world *world = towers(2, 2, 0.5, precision), *other = towers(2, 2, 0.5, precision);
    sadmm_contact *contacts[2];
    sadmm_problem *frozen[2];
    step_world(world, 6);
    step_world(other, 6);
    const int32_t count = sadmm_world_contact_count(world);
    ck_assert_int_gt(count, 0);
    const sadmm_body_state state = body_state(world, body_at(world, 4));
    sadmm_body_state fast = state;
    fast.angular_velocity[0] = 1e200;
    for (int pass = 0; pass < 2; ++pass) {
        if (pass) {
            MUST(world, sadmm_world_set_body_state(world, body_at(world, 4), &fast));
            sadmm_status status = sadmm_world_step_async(world);
            ck_assert_int_eq(sadmm_world_contact_count(world), count);
            if (status == SADMM_OK) status = sadmm_world_wait(world);
            ck_assert_int_eq(status, SADMM_ERROR_NON_FINITE);
            ck_assert_int_eq(sadmm_world_wait(world), SADMM_OK); /* once */
        }
        contacts[pass] = calloc((size_t)count, sizeof *contacts[pass]);
        ck_assert_int_eq(sadmm_world_contact_count(world), count);
        MUST(world, sadmm_world_contacts(world, 0, count, contacts[pass]));
        ck_assert_int_eq(sadmm_problem_create(&frozen[pass]), SADMM_OK);
        MUST(world, sadmm_world_freeze(world, frozen[pass]));
    }
    ck_assert(memcmp(contacts[0], contacts[1], (size_t)count * sizeof *contacts[0]) == 0);
    const int32_t bodies = sadmm_problem_body_count(frozen[0]);
    double *b[2] = {calloc((size_t)bodies, 6 * sizeof(double)), calloc((size_t)bodies, 6 * sizeof(double))};
    for (int pass = 0; pass < 2; ++pass)
        ck_assert_int_eq(sadmm_problem_get_bodies(frozen[pass], NULL, b[pass], NULL), SADMM_OK);
    ck_assert(memcmp(b[0], b[1], 6 * (size_t)bodies * sizeof(double)) == 0);

    /* Not read before: another step, then one that fails. */
    MUST(world, sadmm_world_set_body_state(world, body_at(world, 4), &state));
    step_world(world, 1);
    step_world(other, 1);
    expect_same_world(world, other, "after the failure");
    step_world(world, 1);
    step_world(other, 1);
    MUST(world, sadmm_world_set_body_state(world, body_at(world, 4), &fast));
    ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_NON_FINITE);
    ck_assert_int_eq(sadmm_world_contact_count(world), 0);
    MUST(world, sadmm_world_set_body_state(world, body_at(world, 4), &state));
    MUST(other, sadmm_world_set_body_state(other, body_at(other, 4), &state));
    step_world(world, 1);
    step_world(other, 1);
    expect_same_world(world, other, "after the second failure");
    for (int pass = 0; pass < 2; ++pass) {
        free(contacts[pass]);
        free(b[pass]);
        sadmm_problem_destroy(frozen[pass]);
    }
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* Every tier gives the same bits, from the first step (no contacts) to the last: parts are made again as contacts come.
 */
START_TEST(tiers_agree)
{
    const int precision = _i / 2, fast = _i % 2;
    const int steps = EMULATED ? 6 : 12;
    sadmm_world *first = towers(4, 2, 0.5, precision);
    if (fast) use_fast(first, 12);
    step_world(first, steps);
    for (int tier = SADMM_CUDA_TIER_BLOCK; tier <= SADMM_CUDA_TIER_STREAM; ++tier) {
        sadmm_world *world = towers(4, 2, 0.5, precision);
        if (fast) use_fast(world, 12);
        char what[40];
        force_tier(tables[precision], world->context, (enum sadmm_cuda_tier)tier);
        for (int step = 0; step < steps; ++step) {
            sadmm_status status = sadmm_world_step(world);
            if (strstr(sadmm_world_message(world), "the device has no clusters")) break;
            ck_assert_msg(status == SADMM_OK, "tier %d, step %d: %s", tier, step, sadmm_world_message(world));
        }
        if (world_report(world).step > 0) {
            snprintf(what, sizeof what, "tier %d", tier);
            expect_same_world(first, world, what);
            ck_assert_int_eq(tier_of(tables[precision], world->context, NULL), tier);
        }
        sadmm_world_destroy(world);
    }
    sadmm_world_destroy(first);
}
END_TEST

/* A box hits the one below, spinning. */
static void throw_down(sadmm_world **worlds, int count, int body)
{
    for (int w = 0; w < count; ++w) {
        sadmm_body_state state = body_state(worlds[w], body_at(worlds[w], body));
        state.linear_velocity[2] = -20;
        state.angular_velocity[0] = 30;
        MUST(worlds[w], sadmm_world_set_body_state(worlds[w], body_at(worlds[w], body), &state));
    }
}

/* The method `fast` in the queue: levels in cold steps, islands that are slowed down, and the methods in turn. */
START_TEST(fast_steps_in_the_queue)
{
    const int precision = _i;
    sadmm_world *host = towers(3, 2, 0.5, precision), *queue = towers(3, 2, 0.5, precision);
    int limited = 0;
    by_host(host);
    tune_capacities(tables[precision], queue->context, 1);
    static const struct {
        int steps, iterations; /* 0: the method `paper` */
        bool warm;
    } runs[] = {{8, 1, true}, {2, 93, false}, {3, 0, true}, {4, 6, true}};
    for (size_t k = 0; k < sizeof runs / sizeof *runs; ++k) {
        sadmm_world *worlds[] = {host, queue};
        for (int w = 0; w < 2; ++w) {
            sadmm_settings settings = sadmm_world_settings(worlds[w]);
            settings.method = runs[k].iterations ? SADMM_METHOD_FAST : SADMM_METHOD_PAPER;
            settings.iterations = runs[k].iterations ? runs[k].iterations : 10;
            settings.warm_start = runs[k].warm;
            MUST(worlds[w], sadmm_world_set_settings(worlds[w], &settings));
        }
        for (int step = 0; step < runs[k].steps; ++step) {
            if (step == 3) throw_down(worlds, 2, 2 + (int)k);
            MUST(host, sadmm_world_step(host));
            MUST(queue, sadmm_world_step_async(queue));
            limited += world_report(host).limited;
        }
        expect_same_world(host, queue, "fast steps");
    }
    ck_assert_int_gt(limited, 0);
    sadmm_world_destroy(host);
    sadmm_world_destroy(queue);
}
END_TEST

/* A tower tall enough to have its separations eased. */
static sadmm_world *tall_tower(int precision)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    for (int i = 0; i < 26; ++i) add_box(world, 0, 0, 0.1 + 0.2 * i, 0.1, 1, 0.5);
    use_device(world, precision, 0);
    return world;
}

/* Steps that the host makes, with the same kernels, between steps on the device: those with more convergence checks
 * than fit a graph. */
START_TEST(steps_by_host_in_between)
{
    const int precision = _i;
    sadmm_world *host = tall_tower(precision), *device = tall_tower(precision), *worlds[] = {host, device};
    by_host(host);
    for (int phase = 0; phase < 3; ++phase) {
        for (int w = 0; w < 2; ++w) {
            sadmm_settings settings = sadmm_world_settings(worlds[w]);
            settings.iterations = phase == 1 ? 70 : 20;
            settings.check_period = phase == 1 ? 1 : 1000000; /* as by_host() has it */
            settings.tolerance = phase == 1 ? 1e-300 : 0;     /* never met: no island stops */
            MUST(worlds[w], sadmm_world_set_settings(worlds[w], &settings));
            step_world(worlds[w], 3);
        }
        expect_same_world(host, device, phase == 0 ? "before" : phase == 1 ? "in between" : "after");
    }
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
}
END_TEST

/* With a stop rule: where balls rest a box lands, with four points where the plan has one. What the step still does,
 * convergence checks included, stays within what was planned for (the address sanitizer sees it), and it is
 * repeated. */
START_TEST(more_points_than_planned_with_a_stop_rule)
{
    const int precision = _i;
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = SADMM_METHOD_FAST;
    def.settings.tolerance = 1e-6;
    def.settings.check_period = 5;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    for (int i = 0; i < 6; ++i) add_solid(world, SADMM_SHAPE_SPHERE, i, 0, 0.1, 0.1, 1, 0.5);
    add_box(world, 0, 2, 0.15, 0.1, 1, 0.5);
    use_device(world, precision, 0);
    step_world(world, 4);
    ck_assert_int_eq(world_report(world).contacts, 6);
    int64_t repeated = 0;
    for (int step = 0; step < 40 && repeated == 0; ++step) {
        step_world(world, 1);
        repeated = world_report(world).repeated;
    }
    ck_assert_int_gt(repeated, 0);
    ck_assert_int_eq(world_report(world).contacts, 6 + 4);
    sadmm_world_destroy(world);
}
END_TEST

/* A box of a tower is turned: pairs have eight points where the plan has four. The step is repeated, and is the
 * host's. */
START_TEST(more_points_than_planned_in_a_tall_tower)
{
    const int precision = _i;
    sadmm_world *worlds[2];
    for (int w = 0; w < 2; ++w) {
        worlds[w] = tall_tower(precision);
        if (w == 0) by_host(worlds[w]);
        step_world(worlds[w], 3);
        sadmm_body_state state = body_state(worlds[w], body_at(worlds[w], 24));
        const double half[4] = {cos(0.39269908169872414), 0, 0, sin(0.39269908169872414)}; /* 45 degrees about z */
        memcpy(state.orientation, half, sizeof half);
        MUST(worlds[w], sadmm_world_set_body_state(worlds[w], body_at(worlds[w], 24), &state));
        step_world(worlds[w], 2);
    }
    ck_assert_int_eq(world_report(worlds[1]).contacts, 24 * 4 + 2 * 8);
    ck_assert_int_gt(world_report(worlds[1]).repeated, 0);
    expect_same_world(worlds[0], worlds[1], "turned");
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* Two towers that do not touch each other, or one of them, `lift` above the ground, with a stop rule. */
static sadmm_world *stopping_towers(int first, int count, double lift, int precision, double tolerance,
                                    int check_period)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = SADMM_METHOD_FAST;
    def.settings.iterations = 60;
    def.settings.tolerance = tolerance;
    def.settings.check_period = check_period;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    for (int t = first; t < first + count; ++t)
        for (int i = 0; i < 3; ++i) /* equal, or the heavier the higher: they land together, and solve apart */
            add_box(world, 2.0 * t, 0.01 * i, 0.1 + lift + 0.201 * i, 0.1, t == 0 ? 1 : 1 + 20 * i, 0.5);
    use_device(world, precision, 0);
    return world;
}

/* The stop rule of whole steps: in every tier an island stops when it would stop if it were alone, and then as the
 * host's convergence check has it. */
START_TEST(islands_stop_by_themselves)
{
    static const enum sadmm_cuda_tier stopping_tiers[] = {SADMM_CUDA_TIER_BLOCK, SADMM_CUDA_TIER_STREAM,
                                                          SADMM_CUDA_TIER_GRID, SADMM_CUDA_TIER_CLUSTER};
    const int precision = _i / 4, steps = EMULATED ? 18 : 60;
    const double tolerance = precision == SADMM_F32 ? 1e-5 : 1e-7;
    sadmm_world *both = stopping_towers(0, 2, 0.008, precision, tolerance, 3), *alone[2];
    for (int t = 0; t < 2; ++t) {
        alone[t] = stopping_towers(t, 1, 0.008, precision, tolerance, 3);
        sadmm_settings settings = sadmm_world_settings(alone[t]);
        settings.residual_tolerance = 1e30; /* always met: sends the world through the host */
        MUST(alone[t], sadmm_world_set_settings(alone[t], &settings));
    }
    force_tier(tables[precision], both->context, stopping_tiers[_i % 4]);
    int apart = 0, above = 0;
    for (int step = 0; step < steps; ++step) {
        sadmm_status status = sadmm_world_step(both);
        if (strstr(sadmm_world_message(both), "the device has no clusters")) break;
        ck_assert_msg(status == SADMM_OK, "%s", sadmm_world_message(both));
        sadmm_step_report got = world_report(both), want[2];
        int64_t left = 0;
        for (int t = 0; t < 2; ++t) {
            MUST(alone[t], sadmm_world_step(alone[t]));
            want[t] = world_report(alone[t]);
            if (want[t].contacts == 0 && got.contacts > 0)
                want[t].iterations = 3; /* in the air: until the first check */
            left += !want[t].converged && want[t].contacts > 0;
            for (int i = 0; i < 3; ++i) {
                sadmm_body_state a = body_state(both, body_at(both, 1 + 3 * t + i)),
                                 b = body_state(alone[t], body_at(alone[t], 1 + i));
                ck_assert_msg(memcmp(&a, &b, sizeof a) == 0, "step %d, tower %d, box %d", step, t, i);
            }
        }
        if (step == 0) continue; /* the first step is the host's, which checks all islands together */
        ck_assert_int_eq(got.converged, left == 0);
        ck_assert_int_eq(got.unsolved, left);
        ck_assert_int_eq(got.iterations,
                         want[0].iterations > want[1].iterations ? want[0].iterations : want[1].iterations);
        ck_assert_double_eq_tol(got.iterations_mean, (want[0].iterations + want[1].iterations) / 2.0, 1e-12);
        apart += want[0].iterations != want[1].iterations;
        above += left > 0;
    }
    if (world_report(both).step == steps) ck_assert_int_gt(apart, 0);
    ck_assert_int_lt(above, steps); /* and some steps did meet it */
    for (int t = 0; t < 2; ++t) sadmm_world_destroy(alone[t]);
    sadmm_world_destroy(both);
}
END_TEST

/* One island: every tier stops after as many iterations, with the same bits; what stopped meets the tolerance; and a
 * rule that is inspected only at the end changes nothing. */
START_TEST(tiers_stop_alike)
{
    const int precision = _i, steps = EMULATED ? 8 : 60;
    const double tolerance = precision == SADMM_F32 ? 1e-5 : 1e-7;
    sadmm_world *first = stopping_towers(1, 1, 0.001, precision, tolerance, 4),
                *budget = stopping_towers(1, 1, 0.001, precision, 0, 4),
                *late = stopping_towers(1, 1, 0.001, precision, 1e-300, 60);
    sadmm_settings settings = sadmm_world_settings(first);
    settings.certify = true;
    MUST(first, sadmm_world_set_settings(first, &settings));
    int met = 0;
    for (int step = 0; step < steps; ++step) {
        MUST(first, sadmm_world_step(first));
        const sadmm_step_report report = world_report(first);
        if (!report.converged) continue;
        ++met;
        ck_assert_double_le(report.certificate.ncp_max, tolerance * 1.001); /* the device's sums have another order */
        ck_assert_int_eq(report.unsolved, 0);
    }
    ck_assert_int_gt(met, 0);
    for (int tier = SADMM_CUDA_TIER_BLOCK; tier <= SADMM_CUDA_TIER_STREAM; ++tier) {
        sadmm_world *world = stopping_towers(1, 1, 0.001, precision, tolerance, 4);
        char what[40];
        snprintf(what, sizeof what, "tier %d", tier);
        force_tier(tables[precision], world->context, (enum sadmm_cuda_tier)tier);
        for (int step = 0; step < steps; ++step) {
            sadmm_status status = sadmm_world_step(world);
            if (strstr(sadmm_world_message(world), "the device has no clusters")) break;
            ck_assert_msg(status == SADMM_OK, "tier %d, step %d: %s", tier, step, sadmm_world_message(world));
        }
        if (world_report(world).step == steps) {
            expect_same_world(first, world, what);
            ck_assert_int_eq(world_report(world).iterations, world_report(first).iterations);
        }
        sadmm_world_destroy(world);
    }
    step_world(budget, steps);
    step_world(late, steps);
    expect_same_world(budget, late, "a check at the end");
    ck_assert_int_eq(world_report(late).converged, false);
    ck_assert_int_eq(world_report(late).unsolved, 1);
    /* nothing of the rule is left without it */
    settings = sadmm_world_settings(late);
    settings.method = SADMM_METHOD_PAPER;
    settings.tolerance = 0;
    MUST(late, sadmm_world_set_settings(late, &settings));
    step_world(late, 2);
    ck_assert_int_eq(world_report(late).converged, false);
    ck_assert_int_eq(world_report(late).unsolved, -1);
    ck_assert_int_eq(world_report(late).iterations, settings.iterations);
    ck_assert_double_eq(world_report(late).iterations_mean, settings.iterations);
    sadmm_world_destroy(first);
    sadmm_world_destroy(budget);
    sadmm_world_destroy(late);
}
END_TEST

/* Worlds of two precisions on one device, and one on another device, step by step in turn: each as if it were alone. */
START_TEST(worlds_side_by_side)
{
    const int steps = EMULATED ? 5 : 20, device = last_device();
    sadmm_world *worlds[3], *alone[3];
    for (int k = 0; k < 3; ++k) {
        worlds[k] = towers_on(2 + k % 2, 2, 0.5, k % 2, k == 2 ? device : 0);
        alone[k] = towers(2 + k % 2, 2, 0.5, k % 2);
    }
    for (int step = 0; step < steps; ++step)
        for (int k = 0; k < 3; ++k) MUST(worlds[k], sadmm_world_step_async(worlds[k]));
    for (int k = 0; k < 3; ++k) {
        step_world(alone[k], steps);
        expect_same_world(worlds[k], alone[k], k == 2 ? "the last device" : "the first device");
        sadmm_world_destroy(alone[k]);
    }
    for (int k = 0; k < 3; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* No memory: the step fails, nothing is lost, and the next one with memory goes on. */
START_TEST(lack_of_memory)
{
    const int precision = _i;
    sadmm_world *plain = towers(2, 1, 0.5, precision);
    step_world(plain, 4);
    int failures = 0;
    for (long n = 0;; n += EMULATED ? 5 : n < 40 ? 1 : 3) {
        sadmm_world *world = towers(2, 1, 0.5, precision);
        sadmm_test_fail_allocations_after(n);
        sadmm_status status = sadmm_world_step(world);
        bool reached = status != SADMM_OK;
        sadmm_test_fail_allocations_after(-1);
        if (reached) {
            ++failures;
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            ck_assert_int_eq(world_report(world).step, 0);
        }
        step_world(world, (int)(4 - world_report(world).step));
        expect_same_world(plain, world, "after lack of memory");
        sadmm_world_destroy(world);
        if (!reached) break;
    }
    ck_assert_int_ge(failures, EMULATED ? 6 : 30); /* buffers, sets, graphs' arguments */
    sadmm_world_destroy(plain);
}
END_TEST

/* Contacts are read with the bodies of their step. Where a step has begun to replace these and failed, there are
 * none. */
START_TEST(contacts_are_read_with_their_own_bodies)
{
    sadmm_world *world = towers(2, 1, 0.5, _i);
    int failures = 0;
    step_world(world, 6);
    const int32_t count = sadmm_world_contact_count(world);
    ck_assert_int_gt(count, 0);
    sadmm_contact *before = calloc((size_t)count, sizeof *before), *after = calloc((size_t)count, sizeof *after);
    MUST(world, sadmm_world_contacts(world, 0, count, before));
    for (int k = 0; k < 40; ++k) add_box(world, k, 3, 1, 0.1, 1, 0.5); /* more than there is room for */
    for (long n = 0;; ++n) {
        sadmm_test_fail_allocations_after(n);
        sadmm_status status = sadmm_world_step(world);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) break;
        ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
        ck_assert_int_eq(sadmm_world_contact_count(world), count);
        MUST(world, sadmm_world_contacts(world, 0, count, after));
        ck_assert(memcmp(before, after, (size_t)count * sizeof *before) == 0);
        ++failures;
    }
    ck_assert_int_gt(failures, 2);
    ck_assert_int_gt(sadmm_world_contact_count(world), 0);
    free(before);
    free(after);
    sadmm_world_destroy(world);
}
END_TEST

/* More bodies than worlds have whose kernels are all launched with PDL (device/pdl.h) and whose shapes are placed
 * thread by thread (collide/pipeline.cu), pairs on the floor and in the air that push each other apart, in two
 * sub-steps. The emulated device has a few of them. */
START_TEST(large_worlds_equal_those_by_host)
{
    sadmm_world *worlds[2];
    for (int k = 0; k < 2; ++k) {
        worlds[k] = towers(0, 0, 0.5, _i);
        for (int t = 0; t < (EMULATED ? 6 : 8400); ++t)
            for (int i = 0; i < 2; ++i)
                add_box(worlds[k], 0.25 * (t % 100) + 0.02 * i, 0.25 * (t / 100), (t % 2 ? 0.6 : 0.1) + 0.1995 * i, 0.1,
                        1 + i, 0.5);
        use_fast(worlds[k], 20);
        sadmm_settings settings = sadmm_world_settings(worlds[k]);
        settings.substeps = 2;
        MUST(worlds[k], sadmm_world_set_settings(worlds[k], &settings));
    }
    by_host(worlds[0]);
    for (int step = 0; step < (EMULATED ? 4 : 12); ++step) {
        for (int k = 0; k < 2; ++k) MUST(worlds[k], sadmm_world_step(worlds[k]));
        expect_same_world(worlds[1], worlds[0], "a large world");
    }
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Boxes in any orientation that fall into a heap, twice: what a kernel reads before it is there shows in time, as other
 * numbers in every run. */
START_TEST(large_heaps_repeat)
{
    uint64_t hash[2];
    for (int k = 0; k < 2; ++k) {
        sadmm_world *world = towers(0, 0, 0.5, _i);
        uint32_t random = 1;
        for (int n = 0; n < (EMULATED ? 30 : 26 * 26 * 25); ++n) {
            const sadmm_body_id id =
                add_box(world, 0.3 * (n % 26), 0.3 * (n / 26 % 26), 0.2 + 0.3 * (n / 676), 0.1, 1, 0.5);
            sadmm_body_state state = body_state(world, id);
            double *q = state.orientation, length = 0;
            for (int j = 0; j < 4; ++j) {
                random = 1664525u * random + 1013904223u;
                q[j] = random / 4294967296.0 - 0.5;
                length = hypot(length, q[j]);
            }
            for (int j = 0; j < 4; ++j) q[j] /= length;
            MUST(world, sadmm_world_set_body_state(world, id, &state));
        }
        use_fast(world, 40);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.substeps = 2;
        MUST(world, sadmm_world_set_settings(world, &settings));
        for (int step = 0; step < (EMULATED ? 8 : 150); ++step) MUST(world, sadmm_world_step_async(world));
        MUST(world, sadmm_world_wait(world));
        hash[k] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert(hash[0] == hash[1]);
}
END_TEST

#ifdef CUDA_EMULATED
/* Every call of the runtime may fail: an error that names the device, nothing leaks. */
START_TEST(calls_that_fail)
{
    const int precision = _i;
    int failed = 0;
    for (long calls = 0;; calls += 1 + calls / 6) {
        sadmm_world *world = towers(2, 1, 0.5, precision);
        sadmm_status status = SADMM_OK;
        cuda_emulation_calls_left = calls;
        for (int step = 0; step < 2 && status == SADMM_OK; ++step) status = sadmm_world_step_async(world);
        if (status == SADMM_OK) status = sadmm_world_wait(world);
        bool reached = cuda_emulation_calls_left < 0;
        cuda_emulation_calls_left = -1;
        if (reached && status != SADMM_OK) {
            ++failed;
            ck_assert_msg(status == SADMM_ERROR_DEVICE, "call %ld: %s", calls, sadmm_status_name(status));
            ck_assert_msg(strstr(sadmm_world_message(world), "CUDA device 0: ") != NULL, "%s",
                          sadmm_world_message(world));
        }
        sadmm_world_destroy(world);
        ck_assert_msg(cuda_emulation_allocations == 0, "call %ld: %ld left", calls, cuda_emulation_allocations);
        if (!reached) break;
    }
    ck_assert_int_gt(failed, 20);
}
END_TEST
#endif

/* Under sanitizers, on the emulated device, which is slow there: one precision, and some of the scenes. */
int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    const int parts = tested_precisions();
    Suite *suite = suite_create("cuda_step");
    for (int p = 0; p < parts; ++p)
        add_case(suite, p ? "resident_f64" : "resident_f32", resident_steps_equal_steps_by_host, p * CASES,
                 (p + 1) * CASES);
    ADD_CASE(suite, enqueued_steps_equal_single_steps, 0, parts);
    ADD_CASE(suite, changes_between_steps_equal_those_by_host, 0, parts);
    ADD_CASE(suite, what_is_kept_between_steps, 0, parts * SCENES_BETWEEN);
    ADD_CASE(suite, worlds_come_and_go, 0, parts);
    ADD_CASE(suite, readings_of_a_resident_step, 0, parts);
    ADD_CASE(suite, a_step_that_fails_leaves_the_world_before_it, 0, parts);
    ADD_CASE(suite, contacts_after_a_step_that_fails, 0, parts);
    ADD_CASE(suite, tiers_agree, 0, 2 * parts);
    ADD_CASE(suite, fast_steps_in_the_queue, 0, parts);
    ADD_CASE(suite, steps_by_host_in_between, 0, parts);
    ADD_CASE(suite, more_points_than_planned_in_a_tall_tower, 0, parts);
    ADD_CASE(suite, more_points_than_planned_with_a_stop_rule, 0, parts);
    ADD_CASE(suite, islands_stop_by_themselves, 0, 4 * parts);
    ADD_CASE(suite, tiers_stop_alike, 0, parts);
    ADD_CASE(suite, worlds_side_by_side, 0, 1);
    ADD_CASE(suite, lack_of_memory, 0, parts);
    ADD_CASE(suite, contacts_are_read_with_their_own_bodies, 0, parts);
#ifdef CUDA_EMULATED
    ADD_CASE(suite, calls_that_fail, 0, parts);
#endif
    ADD_CASE(suite, large_worlds_equal_those_by_host, 0, parts);
    ADD_CASE(suite, large_heaps_repeat, 0, 1);
    return run_cuda_suite(suite);
}
