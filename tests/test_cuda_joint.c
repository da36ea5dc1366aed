/* Joints on the device: the solve of a step is, the rest is the host's. The same motion as on the CPU, for every law. */
#include "cuda_worlds.h"

static sadmm_body_id add_link(sadmm_world *world, double x)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = 1;
    def.inertia[0] = 0.01, def.inertia[1] = 0.02, def.inertia[2] = 0.015;
    def.position[0] = x;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

/* A chain from the static world, each joint with a law of its own on its free coordinate. */
static sadmm_world *chain(int precision)
{
    static const sadmm_joint_coordinate laws[] = {
        {.friction = 0.5, .drive_force = INFINITY},
        {.spring_stiffness = 30, .spring_damping = 0.2, .drive_force = INFINITY},
        {.limited = true, .lower = -0.1, .upper = 0.05, .drive_force = INFINITY},
        {.drive = SADMM_DRIVE_SPEED, .target_speed = 2, .drive_force = 0.3},
    };
    static const double quarter[4] = {0.70710678118654752, 0.70710678118654752, 0, 0};
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.iterations = 300;
    def.settings.threads = 1;
    sadmm_world *world = create_world(&def);
    sadmm_body_id last = {0, 0};
    for (int k = 0; k < 4; ++k) {
        const double place[3] = {0.2 * k, 0, 0};
        sadmm_joint_def joint = sadmm_joint_def_default();
        joint.kind = SADMM_JOINT_REVOLUTE;
        joint.body_a = last;
        joint.body_b = last = add_link(world, 0.2 * k + 0.1);
        joint.coordinates[5] = laws[k];
        MUST(world, sadmm_world_place_joint(world, &joint, place, quarter));
        MUST(world, sadmm_world_add_joint(world, &joint, NULL));
    }
    return world;
}

START_TEST(joints_are_solved_on_the_device)
{
    sadmm_world *host = chain(_i), *device = chain(_i);
    const double close = _i == SADMM_F32 ? 2e-4 : 1e-8; /* rounding of 30 steps of a chain that swings */
    char text[4000];
    use_device(device, _i, 0);
    for (int step = 0; step < 30; ++step) {
        step_world(host, 1);
        step_world(device, 1);
        for (int k = 0; k < 4; ++k) {
            const sadmm_body_state a = body_state(host, body_at(host, k)), b = body_state(device, body_at(device, k));
            ck_assert_msg(distance(a.position, b.position) < close, "step %d, body %d: %g", step, k,
                          distance(a.position, b.position));
        }
    }
    sadmm_world_explain(device, text, sizeof text);
    ck_assert_ptr_nonnull(strstr(text, "of 4 joints; steps are made by the host"));
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("cuda_joint");
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    ADD_CASE(suite, joints_are_solved_on_the_device, 0, tested_precisions());
    return run_cuda_suite(suite);
}
