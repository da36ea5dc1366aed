/* What changes between steps on a backend that keeps the world: states, wrenches and settings that are set while steps
 * run ahead, and a device that fails. Everything must be equal, to the last bit, to what the same kernels give when the
 * host drives them step by step (test_cuda_step.c). The same checks run on the emulated device
 * (test_cuda_changes_emulated.c).
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "core/base/memory.h"
#include "cuda_worlds.h"

static sadmm_world *small_world(int precision, int fast)
{
    sadmm_world *world = towers(3, 2, 0.5, precision);
    if (fast) use_fast(world, 12);
    return world;
}

static void set_wrench(sadmm_world *world, int body, double x, double z)
{
    const double force[3] = {x, 0.3, z}, torque[3] = {0.01, 0, 0.1 * x};
    MUST(world, sadmm_world_set_body_wrench(world, body_at(world, body), force, torque));
}

static void set_state(sadmm_world *world, int body, double x, double spin)
{
    sadmm_body_state state = {{x, 0.02, 0.5 + 0.3 * body}, {1, 0, 0, 0}, {0.1, 0, -0.4}, {0, spin, 0}};
    MUST(world, sadmm_world_set_body_state(world, body_at(world, body), &state));
}

/* ---- the device's memory ----------------------------------------------------------------------------------------- */

#ifdef CUDA_EMULATED /* whose memory is the host's */
static void from_device(double *to, const double *from, size_t count) { memcpy(to, from, count * sizeof *to); }
#else
int cudaMemcpy(void *to, const void *from, size_t size, int kind); /* the runtime's, which the library has in it */
static void from_device(double *to, const double *from, size_t count)
{
    ck_assert_int_eq(cudaMemcpy(to, from, count * sizeof *to, 2), 0); /* 2: device to host */
}
#endif

static void expect_no_array(sadmm_world *world)
{
    sadmm_device_array array;
    ck_assert_int_eq(sadmm_world_device_array(world, SADMM_ARRAY_BODY_STATE, &array), SADMM_ERROR_UNAVAILABLE);
}

/* Without a copy, and the numbers that are read with one; not while the host has newer ones. */
START_TEST(arrays_are_where_the_device_has_them)
{
    sadmm_world *world = small_world(_i, 0);
    const int32_t bodies = sadmm_world_body_count(world);
    int32_t count, rows[64];
    expect_no_array(world);
    for (int round = 0; round < 6; ++round) {
        sadmm_device_array state, wrench;
        if (round == 3) {
            set_wrench(world, 1, 3, 4);
            expect_no_array(world);
        }
        for (int step = 0; step <= round; ++step) MUST(world, sadmm_world_step_async(world));
        MUST(world, sadmm_world_device_array(world, SADMM_ARRAY_BODY_STATE, &state));
        MUST(world, sadmm_world_device_array(world, SADMM_ARRAY_BODY_CONTACT_WRENCH, &wrench));
        MUST(world, sadmm_world_dynamic_bodies(world, rows, 64, &count));
        ck_assert_int_eq(state.rows, count);
        ck_assert_int_eq(wrench.rows, count);
        ck_assert_int_eq(state.columns, 13);
        ck_assert_int_eq(wrench.columns, 6);
        ck_assert_int_ge(state.stride, 13);
        ck_assert(state.values && wrench.values && state.stream && state.device == 0);
        double read[64 * 13], read_wrench[64 * 6], there[13];
        MUST(world, sadmm_world_get_array(world, SADMM_ARRAY_BODY_STATE, 0, bodies, read));
        MUST(world, sadmm_world_get_array(world, SADMM_ARRAY_BODY_CONTACT_WRENCH, 0, bodies, read_wrench));
        for (int32_t i = 0; i < count; ++i) {
            from_device(there, state.values + i * state.stride, 13);
            ck_assert_mem_eq(there, read + 13 * rows[i], 13 * sizeof *read);
            from_device(there, wrench.values + i * wrench.stride, 6);
            ck_assert_mem_eq(there, read_wrench + 6 * rows[i], 6 * sizeof *read);
        }
    }
    ck_assert_int_le(bodies, 64);
    MUST(world, sadmm_world_remove_body(world, body_at(world, bodies - 1)));
    expect_no_array(world);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- saved worlds ------------------------------------------------------------------------------------------------ */

/* A world on the device is saved while it runs, with a change that no step has taken along, and goes on there as if it
 * had not been; restored into another one, or into itself, it makes the same steps. */
static void expect_saved(sadmm_world *world, sadmm_world *other, int steps)
{
    size_t size;
    int32_t count, *moving = malloc((size_t)sadmm_world_body_count(world) * sizeof *moving);
    MUST(world, sadmm_world_dynamic_bodies(world, moving, sadmm_world_body_count(world), &count));
    for (int k = 0; k < steps; ++k) MUST(world, sadmm_world_step_async(world));
    set_wrench(world, moving[count / 2], 2, 3);
    free(moving);
    world->def.backend = SADMM_BACKEND_AUTO; /* use_device has chosen */
    MUST(world, sadmm_world_save(world, NULL, 0, &size));
    void *bytes = malloc(size);
    MUST(world, sadmm_world_save(world, bytes, size, &size));
    step_world(world, steps);
    MUST(other, sadmm_world_restore(other, bytes, size));
    step_world(other, steps);
    expect_same_world(world, other, "restored");
    const uint64_t hash = state_hash(world);
    MUST(world, sadmm_world_restore(world, bytes, size));
    step_world(world, steps);
    ck_assert_uint_eq(state_hash(world), hash);
    free(bytes);
}

START_TEST(a_saved_world_goes_on)
{
    const int precision = _i / 2, fast = _i % 2;
    sadmm_world *world = small_world(precision, fast), *other = small_world(precision, fast);
    step_world(other, 2);
    expect_saved(world, other, 7);
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* With motors, joints, and hulls on a mesh. */
START_TEST(a_saved_scene_goes_on)
{
    const char *const specs[] = {"ragdolls:1", "terrain:8", "grippers:1"};
    struct sadmm_scene scene = open_scene(specs[_i % 3]);
    scene.def.precision = (sadmm_precision)(_i / 3);
    if (lacks_hulls(&scene)) return;
    sadmm_world *world = build_scene(&scene), *other = build_scene(&scene);
    use_device(world, _i / 3, 0);
    use_device(other, _i / 3, 0);
    expect_saved(world, other, EMULATED ? 4 : 150);
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* ---- updates ----------------------------------------------------------------------------------------------------- */

/* Several changes of one body before a step: the last one counts, of states and of wrenches, and neither disturbs the
 * other. */
static void update_often(sadmm_world *world, int step)
{
    set_wrench(world, 1, 300, 400);
    set_wrench(world, 2, -1, step);
    if (step % 3 == 1) {
        set_state(world, 3, 5, 20);
        set_wrench(world, 3, 70, 7);
        set_state(world, 3, 6, -9);
        set_state(world, 3, 1.01 + 0.01 * step, 0.5);
        set_wrench(world, 3, 0.5, 1);
    }
    set_wrench(world, 1, -200, 100);
    set_wrench(world, 1, 0.4, 0.1 * step);
}

static void expect_last_update_wins(int precision)
{
    sadmm_world *host = small_world(precision, 1), *device = small_world(precision, 1),
                *queue = small_world(precision, 1);
    sadmm_world *worlds[] = {host, device, queue};
    by_host(host);
    for (int step = 0; step < 12; ++step) {
        for (int w = 0; w < 3; ++w) {
            update_often(worlds[w], step);
            MUST(worlds[w], w == 2 ? sadmm_world_step_async(worlds[w]) : sadmm_world_step(worlds[w]));
        }
        if (step % 4 == 3) expect_same_world(host, device, "single steps");
    }
    expect_same_world(host, device, "single steps");
    expect_same_world(host, queue, "enqueued steps");
    for (int w = 0; w < 3; ++w) sadmm_world_destroy(worlds[w]);
}

/* Whatever the order that threads come in. */
START_TEST(the_last_change_of_a_body_counts)
{
#ifdef CUDA_EMULATED
    for (cuda_emulation_descending = 1; cuda_emulation_descending >= 0; --cuda_emulation_descending)
        expect_last_update_wins(_i);
    cuda_emulation_descending = 0;
#else
    expect_last_update_wins(_i);
#endif
}
END_TEST

/* However often a body is set, the step takes one change of a kind along. */
START_TEST(changes_of_a_body_do_not_pile_up)
{
    sadmm_world *world = small_world(_i, 0);
    step_world(world, 2);
    for (int k = 0; k < 100000; ++k) {
        set_wrench(world, 1, k, 1);
        if (k % 100 == 0) set_state(world, 1 + k % 3, 0.1, 0.2);
    }
    ck_assert_uint_eq(world->resident.dirty_count, 3);
    step_world(world, 1);
    ck_assert_uint_le(SADMM_ROOM(world->resident.updates), 64);
    ck_assert_uint_eq(world->resident.dirty_count, 0);
    sadmm_world_destroy(world);
}
END_TEST

/* Materials, sizes and places of shapes that are set while the device has the world: the steps of a world that was
 * given to it with them. */
START_TEST(shapes_that_change)
{
    static const double size[3] = {0.12, 0.1, 0.1}, place[3] = {0.01, 0, 0.02}, turned[4] = {0.6, 0, 0, 0.8};
    const int precision = _i / 3, what = _i % 3;
    sadmm_world *world = small_world(precision, 1), *unchanged = small_world(precision, 1),
                *fresh = small_world(precision, 1);
    sadmm_shape_id id;
    size_t bytes;
    for (int body = 1; body <= 2; ++body) set_wrench(world, body, 4, 1), set_wrench(unchanged, body, 4, 1);
    step_world(world, 6), step_world(unchanged, 6);
    MUST(world, sadmm_world_shape_at(world, 2, &id));
    if (what == 0) MUST(world, sadmm_world_set_shape_material(world, id, 0.01, 0));
    if (what == 1) MUST(world, sadmm_world_set_shape_size(world, id, size));
    if (what == 2) MUST(world, sadmm_world_set_shape_frame(world, id, place, turned));
    world->def.backend = SADMM_BACKEND_AUTO; /* use_device has chosen */
    MUST(world, sadmm_world_save(world, NULL, 0, &bytes));
    void *saved = malloc(bytes);
    MUST(world, sadmm_world_save(world, saved, bytes, &bytes));
    MUST(fresh, sadmm_world_restore(fresh, saved, bytes));
    free(saved);
    step_world(world, 6), step_world(fresh, 6), step_world(unchanged, 6);
    ck_assert(state_hash(world) != state_hash(unchanged));
    expect_same_world(world, fresh, "shapes that change");
    sadmm_world_destroy(world), sadmm_world_destroy(fresh), sadmm_world_destroy(unchanged);
}
END_TEST

/* Getters between changes and steps, waited for or not: they give what was set, and the rest as the last step left
 * it. */
START_TEST(reading_between_changes)
{
    const int precision = _i;
    sadmm_world *host = small_world(precision, 0), *queue = small_world(precision, 0), *worlds[] = {host, queue};
    by_host(host);
    for (int step = 0; step < 14; ++step) {
        for (int w = 0; w < 2; ++w) {
            if (step % 2) set_wrench(worlds[w], 2, 0.3 * step, 1);
            if (step % 5 == 2) set_state(worlds[w], 4, 1 + 0.01 * step, 1);
        }
        if (step % 3 == 0) { /* bodies read while a change waits for its step, and another one after that */
            for (int i = 1; i < sadmm_world_body_count(host); ++i) {
                sadmm_body_state a = body_state(host, body_at(host, i)), b = body_state(queue, body_at(queue, i));
                ck_assert_msg(memcmp(&a, &b, sizeof a) == 0, "step %d, body %d: z %.17g, %.17g", step, i, a.position[2],
                              b.position[2]);
            }
            for (int w = 0; w < 2; ++w) set_state(worlds[w], 5, 0.52, -1);
        }
        for (int w = 0; w < 2; ++w) {
            if (step % 5 == 2) set_wrench(worlds[w], 4, 1, 2);
            MUST(worlds[w], sadmm_world_step_async(worlds[w]));
        }
        /* while the step may still run */
        for (int w = 0; w < 2 && step % 4 == 1; ++w) set_state(worlds[w], 6, 0.5, 0.1 * step);
        if (step % 4 == 1) ck_assert(state_hash(host) == state_hash(queue));
    }
    expect_same_world(host, queue, "14 steps");
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* Queries wait for the steps begun and see the bodies as these and changes have left them. */
START_TEST(queries_between_changes)
{
    const int precision = _i;
    sadmm_world *host = small_world(precision, 0), *queue = small_world(precision, 0), *worlds[] = {host, queue};
    enum { RAYS = 40 };
    int hits = 0;
    by_host(host);
    for (int step = 0; step < 10; ++step) {
        sadmm_ray_hit found[2][RAYS];
        sadmm_ray rays[RAYS];
        for (int i = 0; i < RAYS; ++i) {
            const double angle = 0.157 * i + step;
            const sadmm_ray ray = {{4 * cos(angle), 4 * sin(angle), 0.05 * i}, {-cos(angle), -sin(angle), 0}, HUGE_VAL};
            rays[i] = ray;
        }
        for (int w = 0; w < 2; ++w) {
            if (step % 4 == 2) set_state(worlds[w], 4, 1 + 0.01 * step, 1);
            MUST(worlds[w], sadmm_world_step_async(worlds[w]));
            if (step % 4 == 3) set_state(worlds[w], 5, 0.52, -1);
            if (step % 3 == 1) continue;
            MUST(worlds[w], sadmm_world_cast_rays(worlds[w], RAYS, rays, NULL, found[w]));
        }
        for (int i = 0; i < RAYS && step % 3 != 1; ++i) {
            const sadmm_ray_hit *a = &found[0][i], *b = &found[1][i];
            ck_assert_msg(a->shape.slot == b->shape.slot && a->distance == b->distance, "step %d, ray %d", step, i);
            hits += a->shape.slot != 0;
        }
    }
    ck_assert_int_gt(hits, 20);
    expect_same_world(host, queue, "10 steps");
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* Changes come with every step: a few, and then more than there was room for. They are in the steps' graphs then, which
 * are recorded for that once, and once more for the room. */
START_TEST(changes_with_every_step)
{
    enum { TOWERS = 34, FEW = 3, MANY = 2 * TOWERS, MORE_FROM = 24, STEPS = 32 };
    const int precision = _i / 2, fast = _i % 2;
    sadmm_world *worlds[2];
    for (int w = 0; w < 2; ++w) {
        worlds[w] = towers(TOWERS, 2, 0.5, precision);
        if (fast) use_fast(worlds[w], 9);
    }
    by_host(worlds[0]);
#ifdef CUDA_EMULATED
    long graphs = 0;
#endif
    for (int step = 0; step < STEPS; ++step) {
        for (int w = 0; w < 2; ++w) {
            for (int body = 1; body <= (step < MORE_FROM ? FEW : MANY); ++body)
                set_wrench(worlds[w], body, 0.01 * step, 0.02 * body);
            MUST(worlds[w], sadmm_world_step_async(worlds[w]));
        }
        if (step % 8 == 7) expect_same_world(worlds[0], worlds[1], "changes with every step");
#ifdef CUDA_EMULATED
        if (step == 20 || step == 26) graphs = cuda_emulation_graphs_made;
        if (step == 23 || step == 31) ck_assert_int_eq(cuda_emulation_graphs_made, graphs);
#endif
    }
    for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
}
END_TEST

/* ---- settings ---------------------------------------------------------------------------------------------------- */

/* Every number of the settings changes, a few at every step. */
static void change_numbers(sadmm_world *world, int step)
{
    sadmm_settings s = sadmm_world_settings(world);
    s.gravity[0] = 0.1 * (step % 4);
    s.gravity[2] = -9.81 + 0.2 * (step % 3);
    if (step % 2) s.dt = 0.004 + 0.0005 * (step % 5);
    if (step % 3 == 1) s.relaxation = 1.6 + 0.02 * step;
    if (step % 4 == 2) s.correction_factor = 0.1 + 0.01 * step;
    if (step % 4 == 3) s.slop = 1e-5 * step;
    if (step % 5 == 1) s.correction_speed = 0.5 + 0.02 * step;
    if (step % 5 == 2) s.restitution_threshold = 0.2 + 0.01 * step;
    s.penalty_mass_factor = 16 + step % 2;
    s.penalty_offset = 1e5 + 1e3 * (step % 3);
    s.penalty_ratio_limit = 4 + step % 2;
    if (s.tolerance > 0) s.tolerance = 1e-5 * (1 + step % 3);
    MUST(world, sadmm_world_set_settings(world, &s));
}

/* In both methods, with new weights and penalties in steps that start cold, a stop rule, and every tier: as by the
 * host, which stops all islands together: there is one. */
START_TEST(numbers_of_the_settings_change_at_every_step)
{
    enum { PAPER_COLD, PAPER, FAST_COLD, FAST, STOPPING, CASES_OF_SETTINGS };
    const int precision = _i / 2, stream = _i % 2;
    for (int at = 0; at < CASES_OF_SETTINGS; ++at) {
        sadmm_world *worlds[2];
        for (int w = 0; w < 2; ++w) {
            worlds[w] = towers(1, 2, 0.5, precision);
            sadmm_settings s = sadmm_world_settings(worlds[w]);
            s.method = at < FAST_COLD ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST;
            s.iterations = EMULATED ? 12 : 24;
            s.penalty_period = 4;
            s.warm_start = at != PAPER_COLD && at != FAST_COLD;
            s.check_period = 4;
            s.tolerance = at == STOPPING ? 1e-5 : 0;
            /* sends the world through the host; never met, or always where the certificate is to decide */
            s.residual_tolerance = w > 0 ? 0 : at == STOPPING ? 1e300 : 1e-300;
            if (w == 0 && at != STOPPING) s.check_period = 1000000;
            MUST(worlds[w], sadmm_world_set_settings(worlds[w], &s));
            if (stream) force_tier(tables[precision], worlds[w]->context, SADMM_CUDA_TIER_STREAM);
        }
        for (int step = 0; step < 10; ++step) {
            for (int w = 0; w < 2; ++w) {
                change_numbers(worlds[w], step);
                MUST(worlds[w], sadmm_world_step_async(worlds[w]));
            }
            if (step % 5 != 4) continue;
            char what[60];
            snprintf(what, sizeof what, "case %d, step %d", at, step);
            expect_same_world(worlds[0], worlds[1], what);
            ck_assert(worlds[1]->resident.loaded && !worlds[0]->resident.loaded);
        }
        for (int w = 0; w < 2; ++w) sadmm_world_destroy(worlds[w]);
    }
}
END_TEST

/* A step that is done again, with those behind it, has its own numbers. */
START_TEST(steps_done_again_have_their_own_settings)
{
    const int precision = _i;
    sadmm_world *host = small_world(precision, 0), *queue = small_world(precision, 0);
    by_host(host);
    tune_capacities(tables[precision], queue->context, 1);
    for (int step = 0; step < 20; ++step) { /* contacts come in the first ones */
        change_numbers(host, step);
        change_numbers(queue, step);
        MUST(host, sadmm_world_step(host));
        MUST(queue, sadmm_world_step_async(queue));
    }
    expect_same_world(host, queue, "20 steps");
    ck_assert_int_gt(world_report(queue).repeated, 0);
    sadmm_world_destroy(host);
    sadmm_world_destroy(queue);
}
END_TEST

#ifdef CUDA_EMULATED
/* Nothing is recorded again, loaded or waited for when a number changes; other settings may wait and record. */
START_TEST(a_change_of_numbers_costs_no_wait)
{
    const int precision = _i;
    sadmm_world *world = small_world(precision, 1);
    step_world(world, 12); /* at rest: the plan stays as it is */
    const int64_t repeated = world_report(world).repeated;
    const long graphs = cuda_emulation_graphs_made, waits = cuda_emulation_waits;
    for (int step = 0; step < 4; ++step) {
        sadmm_settings s = sadmm_world_settings(world);
        s.gravity[2] -= 0.01;
        s.dt = 0.0049 + 1e-5 * step;
        s.relaxation = 1.7 + 0.01 * step;
        s.slop *= 1.1;
        MUST(world, sadmm_world_set_settings(world, &s));
        set_wrench(world, 1, 0, 0.1);
        MUST(world, sadmm_world_step_async(world));
    }
    ck_assert_int_eq(cuda_emulation_graphs_made, graphs);
    ck_assert_int_eq(cuda_emulation_waits, waits);
    ck_assert_int_eq(world_report(world).repeated, repeated);
    ck_assert_int_eq(cuda_emulation_graphs_made, graphs);
    ck_assert_int_eq(world->resident.enqueued, 15); /* loaded once: the first step was the host's */
    sadmm_settings s = sadmm_world_settings(world);
    s.iterations += 3;
    MUST(world, sadmm_world_set_settings(world, &s));
    step_world(world, 1);
    ck_assert_int_eq(cuda_emulation_graphs_made, graphs + 2);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- a device that fails ----------------------------------------------------------------------------------------- */

enum { FAILING_STEPS = 5 };

static sadmm_world *failing_world(int precision, int fast)
{
    sadmm_world *world = towers(2, 1, 0.5, precision);
    if (fast) use_fast(world, 7);
    return world;
}

static void change_before(sadmm_world *world, int64_t step)
{
    sadmm_settings s = sadmm_world_settings(world);
    s.gravity[0] = step % 3 == 0 ? 0.1 : 0;
    MUST(world, sadmm_world_set_settings(world, &s));
    set_wrench(world, 1, 0.2, 0.3 * (double)step);
}

/* Steps in pairs, readings between them, and a body that is moved: until `FAILING_STEPS` are done, whatever fails.
 * Returns how many calls failed. */
static int go_on_to_the_end(sadmm_world *world, const char *what)
{
    for (int failed = 0;;) {
        sadmm_step_report report;
        sadmm_status status = sadmm_world_report(world, &report);
        if (status == SADMM_OK && report.step >= FAILING_STEPS) return failed;
        if (status == SADMM_OK) {
            change_before(world, report.step);
            if (report.step == 2) set_state(world, 2, 0.7, 0.2);
            status = sadmm_world_step_async(world);
        }
        if (status == SADMM_OK && report.step + 1 < FAILING_STEPS && report.step != 1) {
            change_before(world, report.step + 1);
            status = sadmm_world_step_async(world);
        }
        if (status == SADMM_OK && report.step % 4 == 0) {
            int32_t count = sadmm_world_contact_count(world);
            sadmm_contact contacts[64];
            status = sadmm_world_contacts(world, 0, count < 64 ? count : 64, contacts);
        }
        if (status == SADMM_OK) {
            sadmm_body_state state;
            status = sadmm_world_body_state(world, body_at(world, 1), &state);
        }
        if (status == SADMM_OK) continue;
        ++failed;
        ck_assert_msg(status == SADMM_ERROR_DEVICE, "%s: %s: %s", what, sadmm_status_name(status),
                      sadmm_world_message(world));
        ck_assert_msg(strstr(sadmm_world_message(world), "CUDA device 0: ") != NULL, "%s", sadmm_world_message(world));
        ck_assert_msg(failed <= 1, "%s: fails again: %s", what, sadmm_world_message(world));
    }
}

/* Any one call of the runtime fails: the world goes on from the last step done, to the same bits. */
START_TEST(a_call_that_fails_loses_nothing)
{
    const int precision = _i / 2, fast = _i % 2;
    sadmm_world *plain = failing_world(precision, fast);
    ck_assert_int_eq(go_on_to_the_end(plain, "nothing"), 0);
    int failed = 0;
    for (long calls = _i;; calls += 1 + calls / 8) {
        sadmm_world *world = failing_world(precision, fast);
        char what[40];
        snprintf(what, sizeof what, "call %ld", calls);
        cuda_emulation_calls_left = calls;
        failed += go_on_to_the_end(world, what);
        const bool reached = cuda_emulation_calls_left < 0;
        cuda_emulation_calls_left = -1;
        expect_same_world(plain, world, what);
        sadmm_world_destroy(world);
        if (!reached) break;
    }
    ck_assert_int_gt(failed, 20);
    sadmm_world_destroy(plain);
    ck_assert_int_eq(cuda_emulation_allocations, 0);
}
END_TEST

static void expect_lost(sadmm_world *world, sadmm_status status)
{
    ck_assert_msg(status == SADMM_ERROR_DEVICE, "%s: %s", sadmm_status_name(status), sadmm_world_message(world));
    ck_assert_msg(strstr(sadmm_world_message(world), "CUDA device 0: ") != NULL, "%s", sadmm_world_message(world));
}

/* The device is lost while steps run ahead: every step says so, everything that the host had read is there, and what
 * was set; and when the device is back, the world goes on from there. */
START_TEST(a_device_that_is_lost)
{
    const int precision = _i / 2, all_read = _i % 2;
    sadmm_world *plain = small_world(precision, 1), *world = small_world(precision, 1);
    step_world(plain, 5);
    step_world(world, 5);
    sadmm_contact first;
    if (all_read) MUST(world, sadmm_world_contacts(world, 0, 1, &first));
    const uint64_t read = state_hash(world);
    ck_assert(state_hash(plain) == read);
    for (int step = 0; step < 2; ++step) MUST(world, sadmm_world_step_async(world));
    set_wrench(world, 2, 1, 2);
    cuda_emulation_lost = 1;
    expect_lost(world, sadmm_world_wait(world));
    ck_assert_msg(strstr(sadmm_world_message(world), "after step 5") != NULL, "%s", sadmm_world_message(world));
    ck_assert_int_eq(sadmm_world_wait(world), SADMM_OK); /* once */
    ck_assert(state_hash(world) == read);
    ck_assert_int_eq(world_report(world).step, 5);
    ck_assert_double_eq(world_report(world).time, world_report(plain).time);
    for (int k = 0; k < 3; ++k) {
        expect_lost(world, k == 1 ? sadmm_world_step_async(world) : sadmm_world_step(world));
        ck_assert(state_hash(world) == read);
    }
    set_state(world, 4, 0.3, 1);
    ck_assert_double_eq(body_state(world, body_at(world, 4)).position[0], 0.3);
    cuda_emulation_lost = 0;
    set_wrench(plain, 2, 1, 2);
    set_state(plain, 4, 0.3, 1);
    step_world(plain, 4);
    step_world(world, 4);
    if (all_read) expect_same_world(plain, world, "after the loss");
    ck_assert_int_eq(world_report(world).step, 9);
    sadmm_world_destroy(plain);
    sadmm_world_destroy(world);
}
END_TEST

/* It does not come back: the world goes on elsewhere. */
START_TEST(a_world_moves_to_another_backend)
{
    const int precision = _i;
    sadmm_world *world = small_world(precision, 1);
    step_world(world, 12);
    const sadmm_body_state before = body_state(world, body_at(world, 2));
    const int32_t contacts = sadmm_world_contact_count(world);
    MUST(world, sadmm_world_step_async(world));
    cuda_emulation_lost = 1;
    expect_lost(world, sadmm_world_set_backend(world, SADMM_BACKEND_CPU, (sadmm_precision)precision, 0));
    MUST(world, sadmm_world_set_backend(world, SADMM_BACKEND_CPU, (sadmm_precision)precision, 0));
    step_world(world, 10);
    cuda_emulation_lost = 0;
    ck_assert_int_eq(world_report(world).backend, SADMM_BACKEND_CPU);
    ck_assert_int_eq(world_report(world).step, 22);
    ck_assert_int_eq(world_report(world).contacts, contacts);
    const sadmm_body_state after = body_state(world, body_at(world, 2));
    ck_assert_double_eq_tol(after.position[2], before.position[2], 1e-3); /* it rests, or nearly so */
    ck_assert_int_eq(sadmm_world_set_backend(world, SADMM_BACKEND_CPU, SADMM_F64, -1), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_set_backend(world, SADMM_BACKEND_COUNT, SADMM_F64, 0), SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_world_destroy(world);
}
END_TEST
#endif

int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    const int parts = tested_precisions();
    Suite *suite = suite_create("cuda_changes");
    ADD_CASE(suite, the_last_change_of_a_body_counts, 0, parts);
    ADD_CASE(suite, changes_of_a_body_do_not_pile_up, 0, parts);
    ADD_CASE(suite, shapes_that_change, 0, 3 * parts);
    ADD_CASE(suite, reading_between_changes, 0, parts);
    ADD_CASE(suite, queries_between_changes, 0, parts);
    ADD_CASE(suite, numbers_of_the_settings_change_at_every_step, 0, 2 * parts);
    ADD_CASE(suite, steps_done_again_have_their_own_settings, 0, parts);
    ADD_CASE(suite, changes_with_every_step, 0, 2 * parts);
    ADD_CASE(suite, arrays_are_where_the_device_has_them, 0, parts);
    ADD_CASE(suite, a_saved_world_goes_on, 0, 2 * parts);
    ADD_CASE(suite, a_saved_scene_goes_on, 0, 3 * parts);
#ifdef CUDA_EMULATED
    ADD_CASE(suite, a_change_of_numbers_costs_no_wait, 0, parts);
    ADD_CASE(suite, a_call_that_fails_loses_nothing, 0, 2 * parts);
    ADD_CASE(suite, a_device_that_is_lost, 0, 2 * parts);
    ADD_CASE(suite, a_world_moves_to_another_backend, 0, parts);
#endif
    return run_cuda_suite(suite);
}
