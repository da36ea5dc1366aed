/* Bodies that roll and rock on the device: as on the host, step by step and in the queue. */
#include "cuda_worlds.h"
#include "fixed_work.h"
#include "rolling_worlds.h"

static sadmm_world *new_world(int precision, bool device)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.threads = 1;
    sadmm_world *world = create_world(&def);
    if (device) use_device(world, precision, 0);
    return world;
}

/* The device's energy after a second is the host's, to what both round: 1e-9 in double; in single precision 1e-4, some
 * 400 steps of velocities rounded to 6e-8 each, in phase. By the queue and by the host's stages the same bits. */
START_TEST(rocking_is_the_hosts)
{
    const double tolerance = _i ? 1e-9 : 1e-4, seconds = EMULATED ? 0.4 : 2;
    for (int kind = 0; kind < ROLL_SHAPES; ++kind) {
        const double friction = kind % 2 ? 0 : 10;
        uint64_t hash[2];
        double most;
        sadmm_world *host = new_world(_i, false);
        const double wanted = rock(host, kind, friction, seconds, &most);
        for (int stages = 0; stages < 2; ++stages) {
            sadmm_world *world = new_world(_i, true);
            if (stages) by_host(world);
            ck_assert_double_eq_tol(rock(world, kind, friction, seconds, &most), wanted, tolerance);
            hash[stages] = state_hash(world);
            sadmm_world_destroy(world);
        }
        ck_assert_uint_eq(hash[0], hash[1]);
        sadmm_world_destroy(host);
    }
}
END_TEST

/* Rocking that no step resolves dies away; and a world that is detached in between goes on to the same bits. */
START_TEST(flat_lenses_come_to_rest)
{
    const double a = 0.01, c = 0.0005;
    uint64_t hash[2];
    for (int back = 0; back < 2; ++back) {
        sadmm_world *world = new_world(_i, true);
        const sadmm_body_id id = add_lens(world, a, c);
        step_world(world, 10);
        if (back) { /* a body that is added takes the world back to the host */
            sadmm_body_def far = sadmm_body_def_default();
            sadmm_body_id other;
            far.type = SADMM_BODY_STATIC;
            MUST(world, sadmm_world_add_body(world, &far, &other));
            MUST(world, sadmm_world_remove_body(world, other));
        }
        step_world(world, EMULATED ? 200 : 400);
        hash[back] = state_hash(world);
        ck_assert_double_lt(norm3(body_state(world, id).angular_velocity), 1e-9);
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

/* The same on a slab that slides: what rocks too fast leaves the trapezoid correction out in the whole island, which
 * the ground anchors. By the queue and by the host's stages the same bits. */
START_TEST(a_lens_rides_on_a_sliding_slab)
{
    enum { AXIS = 2 };
    const double a = 0.01, c = 0.0005, half = 0.005, speed = 0.3;
    const double size[3] = {10 * a, 10 * a, half};
    uint64_t hash[2];
    for (int stages = 0; stages < 2; ++stages) {
        sadmm_world *world = new_world(_i, true);
        const sadmm_body_id lens = add_lens(world, a, c);
        sadmm_body_state state = body_state(world, lens);
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_body_id slab;
        body.mass = 1;
        sadmm_box_inertia(body.mass, size, body.inertia);
        body.position[AXIS] = half;
        body.linear_velocity[0] = state.linear_velocity[0] = speed;
        state.position[AXIS] += 2 * half;
        MUST(world, sadmm_world_set_body_state(world, lens, &state));
        MUST(world, sadmm_world_add_body(world, &body, &slab));
        shape.type = SADMM_SHAPE_BOX;
        memcpy(shape.size, size, sizeof size);
        MUST(world, sadmm_world_add_shape(world, slab, &shape, NULL));
        if (stages) by_host(world);
        step_world(world, 10);
        ck_assert_double_gt(body_state(world, slab).linear_velocity[0], 0); /* it slides still */
        hash[stages] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert(hash[0] == hash[1]);
}
END_TEST

int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    const int parts = tested_precisions();
    Suite *suite = suite_create("cuda_rolling");
    ADD_CASE(suite, rocking_is_the_hosts, 0, parts);
    ADD_CASE(suite, flat_lenses_come_to_rest, 0, parts);
    ADD_CASE(suite, a_lens_rides_on_a_sliding_slab, 0, parts);
    return run_cuda_suite(suite);
}
