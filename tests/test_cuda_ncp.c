/* The dense contact solve on the device: islands of worlds with joints are solved to rounding there, without
 * iterations, and as the host solves them. */
#include "contradictions.h"
#include "cuda_worlds.h"
#include "fewer.h"
#include "grip_worlds.h"

/* Scenes whose islands are trees of joints with contacts, the steps of them from which on they are compared, and how
 * many points an island may have: of 8 some ragdolls have more, and iterate beside others. */
static const struct {
    const char *name;
    int from, steps, points;
} cases[] = {{"ragdolls:1", 95, 6, 128},
             {"ragdolls:2", 130, 3, 128},
             {"ragdolls:2", 130, 2, 8},
             {"grippers:2", 60, 4, 128},
             {"grippers:40", 110, 2, 128},
             {"grippers:300", 110, 2, 128}, /* more mechanisms than large blocks: a warp each */
             {"chain:4", 10, 4, 128}};
enum { CASES = sizeof cases / sizeof *cases };

static sadmm_world *scene_world(const char *name, int points, int precision)
{
    struct sadmm_scene scene = open_scene(name);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = (sadmm_precision)precision;
    scene.def.settings.method = SADMM_METHOD_FAST;
    scene.def.settings.threads = 1;
    scene.def.settings.certify = true;
    scene.def.settings.ncp_points = points;
    return build_scene(&scene);
}

/* One step by each from the same state: velocities, impulses. The bound: both are within 1e-9 m/s of the laws, and what
 * passes on forces through light links is worse by what these are lighter. */
static void expect_same_step(sadmm_world *host, sadmm_world *device, const char *name, int step)
{
    double apart = 0;
    for (int32_t i = 0; i < sadmm_world_body_count(host); ++i) {
        const sadmm_body_state a = body_state(host, body_at(host, i)), b = body_state(device, body_at(device, i));
        for (int k = 0; k < 3; ++k) {
            apart = fmax(apart, fabs(a.linear_velocity[k] - b.linear_velocity[k]));
            apart = fmax(apart, fabs(a.angular_velocity[k] - b.angular_velocity[k]));
        }
    }
    ck_assert_msg(apart <= 1e-7, "%s, step %d: velocities are %g apart", name, step, apart);
}

/* `to` becomes what `from` is. */
static void copy_world(sadmm_world *from, sadmm_world *to)
{
    size_t size;
    MUST(from, sadmm_world_save(from, NULL, 0, &size));
    void *bytes = malloc(size);
    ck_assert_ptr_nonnull(bytes);
    MUST(from, sadmm_world_save(from, bytes, size, &size));
    MUST(to, sadmm_world_restore(to, bytes, size));
    free(bytes);
}

START_TEST(islands_are_solved_as_by_the_host)
{
    const int which = _i / tested_precisions(), precision = _i % tested_precisions(), points = cases[which].points;
    const char *name = cases[which].name;
    sadmm_world *host = scene_world(name, points, precision), *device = scene_world(name, points, precision);
    int solved = 0;
    step_world(host, cases[which].from);
    copy_world(host, device);
    use_device(device, precision, 0);
    for (int step = 0; step < cases[which].steps; ++step) {
        step_world(device, 1);
        step_world(host, 1);
        ck_assert(device->resident.loaded); /* it was the device that made it */
        const sadmm_step_report report = world_report(device);
        solved += report.iterations == 0;
        if (points < 128) continue;
        ck_assert_msg(report.certificate.ncp_max <= 1e-8, "%s, step %d: natural map %g, %d iterations", name, step,
                      report.certificate.ncp_max, report.iterations);
        expect_same_step(host, device, name, step);
    }
    ck_assert_msg(solved == (points < 128 ? 0 : cases[which].steps), "%s: %d steps without iterations", name, solved);
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
}
END_TEST

/* An arm at rest that a drive takes to 30 rad/s in one step, against a light box: much more energy than forces alone
 * would give it, so that a solution is held against that of contacts that give. */
static sadmm_world *driven_arm(int precision, bool on_device)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.threads = 1;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    static const double upright[4] = {1, 0, 0, 0}, place[3] = {0, 0, 0.1};
    const sadmm_body_id arm = add_box(world, 0.5, 0, 0.1, 0.09, 1, 0.5);
    (void)add_box(world, 0.5, 0.17, 0.08, 0.08, 0.1, 0.5);
    sadmm_joint_def joint = sadmm_joint_def_default();
    joint.kind = SADMM_JOINT_REVOLUTE;
    joint.body_b = arm;
    MUST(world, sadmm_world_place_joint(world, &joint, place, upright));
    joint.coordinates[5].drive = SADMM_DRIVE_SPEED;
    joint.coordinates[5].drive_force = 1e9;
    sadmm_joint_id id;
    MUST(world, sadmm_world_add_joint(world, &joint, &id));
    if (on_device) use_device(world, precision, 0);
    step_world(world, 4);
    joint.coordinates[5].target_speed = 30;
    MUST(world, sadmm_world_set_joint_coordinate(world, id, 5, &joint.coordinates[5]));
    step_world(world, 1);
    ck_assert(world->resident.loaded == on_device);
    ck_assert_double_lt(fabs(body_state(world, arm).angular_velocity[2] - 30), 1e-6); /* the tolerance of a step */
    return world;
}

START_TEST(what_drives_ask_for_is_done_as_by_the_host)
{
    sadmm_world *host = driven_arm(_i, false), *device = driven_arm(_i, true);
    ck_assert_int_eq(world_report(device).iterations, 0);
    expect_same_step(host, device, "driven arm", 5);
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
}
END_TEST

static void go_to_device(sadmm_world *world, sadmm_precision precision) { use_device(world, (int)precision, 0); }

/* As on the host. */
START_TEST(strong_jaws_stop_at_what_they_grip) { stop_strong_jaws((sadmm_precision)_i, go_to_device); }
END_TEST

/* As on the host: the island of what contradicts itself is not solved, and one whose joints say the same is. */
START_TEST(contradictions_are_counted)
{
    for (int kind = 0; kind < 2 * CONTRADICTIONS; ++kind) {
        const bool consistent = kind >= CONTRADICTIONS;
        for (int points = 0; points <= 64; points += 64) {
            sadmm_world_def def = sadmm_world_def_default();
            def.backend = SADMM_BACKEND_CPU, def.precision = (sadmm_precision)_i;
            def.settings.threads = 1;
            def.settings.ncp_points = points;
            sadmm_world *world = contradict(&def, (enum contradiction)(kind % CONTRADICTIONS), consistent);
            use_device(world, _i, 0);
            step_world(world, 1); /* the first may be the host's */
            for (int step = 1; step < 4; ++step) {
                step_world(world, 1);
                const sadmm_step_report report = world_report(world);
                ck_assert_msg(world->resident.loaded && report.unsolved == !consistent &&
                                  report.converged == consistent,
                              "%d, ncp_points %d, step %d: %d unsolved", kind, points, step, (int)report.unsolved);
            }
            sadmm_world_destroy(world);
        }
    }
}
END_TEST

/* Impulses grow by a thousand times in an impact, and what regularises them was chosen by those before. */
START_TEST(what_comes_down_hard_is_solved)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = SADMM_BACKEND_CPU, def.precision = (sadmm_precision)_i;
    def.settings.threads = 1, def.settings.certify = true;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    const sadmm_body_id boxes[2] = {add_box(world, 0, 0, 0.1, 0.1, 1, 0.5), add_box(world, 0.3, 0, 0.1, 0.1, 1, 0.5)};
    const double place[3] = {0.15, 0, 0.1}, upright[4] = {1, 0, 0, 0};
    sadmm_joint_def joint = sadmm_joint_def_default();
    joint.kind = SADMM_JOINT_SPHERICAL, joint.body_a = boxes[0], joint.body_b = boxes[1];
    MUST(world, sadmm_world_place_joint(world, &joint, place, upright));
    MUST(world, sadmm_world_add_joint(world, &joint, NULL));
    use_device(world, _i, 0);
    step_world(world, 10);
    for (int k = 0; k < 2; ++k) {
        sadmm_body_state state = body_state(world, boxes[k]);
        state.linear_velocity[2] -= 60;
        MUST(world, sadmm_world_set_body_state(world, boxes[k], &state));
    }
    step_world(world, 1);
    const sadmm_step_report report = world_report(world);
    /* the certificate reads the device's impulses and velocities: those of f32 are rounded */
    ck_assert_msg(world->resident.loaded && report.iterations == 0 && report.unsolved == 0 &&
                      report.certificate.ncp_max < (_i == SADMM_F32 ? 60 * 1e-5 : 1e-9),
                  "natural map %g, %d iterations", report.certificate.ncp_max, report.iterations);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("cuda_ncp");
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    ADD_CASE(suite, islands_are_solved_as_by_the_host, 0, CASES * tested_precisions());
    ADD_CASE(suite, what_drives_ask_for_is_done_as_by_the_host, 0, tested_precisions());
    ADD_CASE(suite, strong_jaws_stop_at_what_they_grip, 0, tested_precisions());
    ADD_CASE(suite, contradictions_are_counted, 0, tested_precisions());
    ADD_CASE(suite, what_comes_down_hard_is_solved, 0, tested_precisions());
    return run_cuda_suite(suite);
}
