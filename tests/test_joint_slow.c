/* Joints for long: every kind under loads that turn, 1e5 steps. */
#include "core/model/joint_law.h"
#include "fixed_work.h"
#include "scene_tools.h"

static const double UNIT[4] = {1, 0, 0, 0};
static const sadmm_body_id WORLD = {0, 0};

static sadmm_body_id add_body(sadmm_world *world, double x)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = 2;
    def.inertia[0] = 0.02, def.inertia[1] = 0.03, def.inertia[2] = 0.04;
    def.position[0] = x;
    def.linear_damping = def.angular_damping = 0.5; /* loads do work for 100 s; what is free would fly off */
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

/* A body on the static world and one on that. The largest error of a locked coordinate. */
START_TEST(kinds_hold_for_long)
{
    enum { STEPS = 100000 };
    const sadmm_joint_kind kind = (sadmm_joint_kind)_i;
    sadmm_world_def world_def = fixed_world_def();
    world_def.backend = SADMM_BACKEND_CPU;
    world_def.settings.threads = 1;
    world_def.settings.dt = 0.001;
    sadmm_world *world = create_world(&world_def);
    const sadmm_body_id bodies[2] = {add_body(world, 0.1), add_body(world, 0.3)};
    sadmm_joint_id joints[2];
    double worst = 0, moved = 0;
    for (int k = 0; k < 2; ++k) {
        sadmm_joint_def def = sadmm_joint_def_default();
        const double place[3] = {k ? 0.2 : 0, 0, 0};
        def.kind = kind;
        def.body_a = k ? bodies[0] : WORLD;
        def.body_b = bodies[k];
        def.locks = 1 + 2 + 16; /* of CUSTOM */
        def.coordinates[0].spring_stiffness = kind == SADMM_JOINT_SPRING ? 500 : 0;
        MUST(world, sadmm_world_place_joint(world, &def, place, UNIT));
        if (joint_is_radial(kind)) def.position_b[0] = def.position_b[1] = 0.02; /* a length of its own */
        MUST(world, sadmm_world_add_joint(world, &def, &joints[k]));
    }
    for (int step = 0; step < STEPS; ++step) {
        const double t = 0.001 * step;
        for (int k = 0; k < 2; ++k) {
            const double force[3] = {5 * sin(3 * t + k), 4 * cos(2 * t), 2 * 9.81 + 3 * sin(t)},
                         torque[3] = {0.05 * sin(5 * t), 0.05 * cos(4 * t), 0.05 * sin(2 * t + k)};
            MUST(world, sadmm_world_set_body_wrench(world, bodies[k], force, torque));
        }
        step_world(world, 1);
        for (int k = 0; k < 2; ++k) {
            sadmm_joint_state state;
            sadmm_joint_def def;
            MUST(world, sadmm_world_joint_state(world, joints[k], &state));
            MUST(world, sadmm_world_joint_def(world, joints[k], &def));
            for (int c = 0; c < 6; ++c) {
                if (def.locks >> c & 1) worst = fmax(worst, fabs(state.position[c]));
                else moved = fmax(moved, fabs(state.position[c]));
            }
        }
    }
    ck_assert_msg(worst < 1e-5, "kind %d: %g", (int)kind, worst); /* m and rad, asked for; of third order in the step */
    ck_assert(kind == SADMM_JOINT_FIXED || moved > 0.01);          /* the others went somewhere */
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("joint slow");
    TCase *tests = tcase_create("joint slow");
    tcase_set_timeout(tests, 600);
    tcase_add_loop_test(tests, kinds_hold_for_long, 0, SADMM_JOINT_KIND_COUNT);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
