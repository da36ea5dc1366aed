/* What a world hands to collision and keeps from step to step, on the host's backends. The same scenes run on the
 * device in test_cuda_step.c. */
#include "between_steps.h"
#include "world/state/ids.h"

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
    sadmm_method method;
} solvers[] = {
    { SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_FAST }, { SADMM_BACKEND_REF, SADMM_F64, SADMM_METHOD_FAST },
    { SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_PAPER }, { SADMM_BACKEND_REF, SADMM_F64, SADMM_METHOD_PAPER },
    { SADMM_BACKEND_CPU, SADMM_F32, SADMM_METHOD_FAST },
};
enum { SOLVERS = sizeof solvers / sizeof solvers[0] };

static sadmm_world *make(int solver, double dt, double gravity)
{
    sadmm_world_def def = between_def(dt, gravity);
    def.backend = solvers[solver].backend;
    def.precision = solvers[solver].precision;
    def.settings.method = solvers[solver].method;
    if (def.settings.method == SADMM_METHOD_PAPER) def.settings.iterations = 200;
    return create_world(&def);
}

START_TEST(a_card_does_not_fall_through_a_plate)
{
    sadmm_world *world = make(_i, 1.0 / 60, 9.81);
    card_stays_on_plate(world);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(a_force_does_not_drive_through_a_plate)
{
    sadmm_world *world = make(_i / 2, 0.005, 0);
    force_does_not_drive_through(world, _i % 2 * 3);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(a_torque_does_not_turn_through_a_post)
{
    sadmm_world *world = make(_i / 2, 0.005, 0);
    torque_does_not_turn_through(world, _i % 2 * 3);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(a_pose_that_is_set_forgets_the_side)
{
    sadmm_world *world = make(_i / 3, 0.005, 9.81);
    pose_that_is_set_forgets_the_side(world, _i % 3);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(a_stack_rests_through_steps_of_any_length)
{
    sadmm_world *world = make(_i, 0.005, 9.81);
    stack_rests_through_steps_of_any_length(world, 6, solvers[_i].precision == SADMM_F32 ? 1e-5 : 1e-9);
    sadmm_world_destroy(world);
}
END_TEST

/* A block that slides down a slope gains g (sin - mu cos) dt in every step; from the fourth on that is where the solve
 * starts, and a step of another length starts from its own share. */
START_TEST(a_slide_goes_on_in_steps_of_any_length)
{
    static const double dt[] = { 0.005, 0.01, 0.002, 0.005 };
    const double slope = 0.6, mu = 0.5, gain = 9.81 * (sin(slope) - mu * cos(slope));
    sadmm_world_def def = between_def(0.005, 9.81);
    def.backend = solvers[_i].backend;
    def.settings.method = solvers[_i].method;
    def.settings.gravity[0] = 9.81 * sin(slope);
    def.settings.gravity[2] = -9.81 * cos(slope);
    /* few: what the start lacks is still missing after them */
    def.settings.iterations = solvers[_i].method == SADMM_METHOD_PAPER ? 60 : 10;
    sadmm_world *world = create_world(&def);
    between_box(world, false, 50, 0, -0.1, 100, 1, 0.1);
    sadmm_body_id block = between_box(world, true, 0, 0, 0.05, 0.2, 0.2, 0.05);
    step_world(world, 60);
    for (int k = 0; k < 4; ++k) {
        sadmm_settings settings = sadmm_world_settings(world);
        settings.dt = dt[k];
        MUST(world, sadmm_world_set_settings(world, &settings));
        for (int step = 0; step < 3; ++step) {
            double before = body_state(world, block).linear_velocity[0];
            step_world(world, 1);
            double gained = body_state(world, block).linear_velocity[0] - before;
            ck_assert_msg(fabs(gained - gain * dt[k]) <= 1e-4 * gain * dt[k], "dt = %g s: %g m/s gained instead of %g",
                          dt[k], gained, gain * dt[k]);
        }
    }
    sadmm_world_destroy(world);
}
END_TEST

/* Velocities, and the pose that a body has, may be set as often as one likes; so may wrenches. */
START_TEST(only_another_pose_makes_a_world_forget)
{
    struct sadmm_scene scene = open_scene("pile:10");
    sadmm_world *world = build_scene(&scene);
    for (int step = 0; step < 10; ++step) {
        for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
            sadmm_body_id id = body_at(world, i);
            sadmm_body_state state = body_state(world, id);
            const struct sadmm_world_body *body = sadmm_world_find_body(world, id, "id", &world->error);
            const uint32_t before = body->extrapolation.placed;
            MUST(world, sadmm_world_set_body_state(world, id, &state));
            ck_assert_uint_eq(body->extrapolation.placed, before);
            if (body->type == SADMM_BODY_STATIC) continue;
            state.linear_velocity[0] += 0.001;
            state.angular_velocity[2] += 0.001;
            MUST(world, sadmm_world_set_body_state(world, id, &state));
            ck_assert_uint_eq(body->extrapolation.placed, before);
            if (step < 9) continue;
            state.position[i % 3] += 1e-9;
            MUST(world, sadmm_world_set_body_state(world, id, &state));
            ck_assert_uint_ne(body->extrapolation.placed, before);
        }
        step_world(world, 1);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* Without a margin a cube on a slab has its contacts where the two touch, whatever side rounding puts it on. */
START_TEST(contacts_without_a_margin_are_where_bodies_touch)
{
    int touched = 0;
    for (int ulps = -64; ulps <= 64; ++ulps) {
        sadmm_world_def def = between_def(0.005, 0);
        def.contact_margin = 0;
        sadmm_world *world = create_world(&def);
        const bool below = _i % 2;
        const double z = 0.15 + ulps * (0.03125 * DBL_EPSILON);
        sadmm_contact contacts[16];
        if (_i < 2) between_box(world, false, 0, 0, 0, 1, 1, 0.1);
        between_box(world, true, 0.01, 0.02, below ? -z : z, 0.05, 0.05, 0.05);
        if (_i >= 2) between_box(world, false, 0, 0, 0, 1, 1, 0.1);
        step_world(world, 1);
        int32_t count = sadmm_world_contact_count(world);
        ck_assert_int_le(count, 16);
        MUST(world, sadmm_world_contacts(world, 0, count, contacts));
        for (int32_t k = 0; k < count; ++k)
            ck_assert_msg(fabs(contacts[k].position[0] - 0.01) <= 0.0501 &&
                              fabs(contacts[k].position[1] - 0.02) <= 0.0501,
                          "%d ulps: a contact at %g %g", ulps, contacts[k].position[0], contacts[k].position[1]);
        touched += count > 0;
        sadmm_world_destroy(world);
    }
    ck_assert_int_gt(touched, 60); /* the overlaps at least */
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("between_steps");
    TCase *test = tcase_create("between_steps");
    tcase_add_loop_test(test, a_card_does_not_fall_through_a_plate, 0, SOLVERS);
    tcase_add_loop_test(test, a_force_does_not_drive_through_a_plate, 0, 2 * SOLVERS);
    tcase_add_loop_test(test, a_torque_does_not_turn_through_a_post, 0, 2 * SOLVERS);
    tcase_add_loop_test(test, a_pose_that_is_set_forgets_the_side, 0, 3 * SOLVERS);
    tcase_add_loop_test(test, a_stack_rests_through_steps_of_any_length, 0, SOLVERS);
    tcase_add_loop_test(test, a_slide_goes_on_in_steps_of_any_length, 0, 4);
    tcase_add_test(test, only_another_pose_makes_a_world_forget);
    tcase_add_loop_test(test, contacts_without_a_margin_are_where_bodies_touch, 0, 4);
    suite_add_tcase(suite, test);
    return run_suite(suite);
}
