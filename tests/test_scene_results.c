/* What scenes say about their own success: that they pass, in either method and precision where that is short, and that
 * they do not where what they rest on is taken away. The long ones: test_scene_results_slow. */
#include "fewer.h"
#include "scene_results.h"

START_TEST(every_measure_is_whole)
{
    const struct sadmm_scene_info *info = sadmm_scene_at((size_t)_i);
    struct sadmm_scene scene = open_result_scene(info->name, SADMM_METHOD_FAST, SADMM_F64);
    struct sadmm_scene_result result = {0};
    if (lacks_hulls(&scene)) return;
    sadmm_world *world = build_scene(&scene);
    run_to_result(&scene, world, 0, 2, &result);
    ck_assert(!sadmm_scene_passed(&result)); /* nothing is done in two steps */
    for (int k = 0; k < result.task_count; ++k) {
        const struct sadmm_scene_task *task = &result.tasks[k];
        ck_assert(task->name[0] && task->figure_count > 0 && !task->finished && !task->passed);
        for (int f = 0; f < task->figure_count; ++f)
            ck_assert(task->figures[f].name[0] && task->figures[f].unit && isfinite(task->figures[f].value));
        for (int j = 0; j < k; ++j) ck_assert_str_ne(result.tasks[j].name, task->name);
    }
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(scenes_without_a_measure_have_none)
{
    struct sadmm_scene scene = open_scene("incline");
    struct sadmm_scene_result result = {0};
    struct sadmm_error error = {0};
    sadmm_world *world = build_scene(&scene);
    run_to_result(&scene, world, 0, 3, &result);
    ck_assert_int_eq(result.task_count, 0);
    ck_assert(!sadmm_scene_passed(&result));
    ck_assert_int_eq(sadmm_scene_observe(&scene, world, 0, NULL, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_scene_observe(NULL, world, 0, &result, &error), SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- grasps ------------------------------------------------------------------------------------------------------ */

START_TEST(grippers_hold)
{
    if (!is_its_turn(0, _i)) return;
    expect_success("grippers", ways[_i].method, ways[_i].precision);
}
END_TEST

/* 30 N from both sides carry 60 mu N; the lightest object has 2 N: with 0.02 all fall. */
START_TEST(grippers_hold_by_friction_alone)
{
    struct sadmm_scene scene = open_result_scene("grippers:15", SADMM_METHOD_FAST, SADMM_F64);
    struct sadmm_scene_result result = {0};
    sadmm_world *world = build_scene(&scene);
    set_friction(world, 0.02);
    run_to_result(&scene, world, 0, 1000, &result);
    const struct sadmm_scene_task *task = find_task(&result, "hold");
    ck_assert(task->finished && !task->passed);
    ck_assert_double_lt(figure(task, "held"), 0.5);
    sadmm_world_destroy(world);
}
END_TEST

/* What the scene says of itself: Table I's bodies, the joints of 34 links and a car, nothing else that could hold. */
START_TEST(the_hand_is_what_it_says)
{
    struct sadmm_scene scene = open_result_scene("hand_demo", SADMM_METHOD_FAST, SADMM_F64);
    sadmm_world *world = build_scene(&scene);
    int dynamic = 0, tips = 0;
    for (int32_t k = 0; k < sadmm_world_body_count(world); ++k) {
        const sadmm_body_def body = body_def(world, body_at(world, k));
        dynamic += body.type == SADMM_BODY_DYNAMIC;
        const size_t length = strlen(body.name);
        if (length > 4 && strcmp(body.name + length - 4, " tip") == 0) {
            ++tips;
            ck_assert_double_eq_tol(body.mass, 0.01, 1e-12);
        }
    }
    ck_assert_int_eq(dynamic, 1686 / 6); /* Table I's degrees of freedom */
    ck_assert_int_eq(tips, 5);
    ck_assert_int_eq(sadmm_world_joint_count(world), 33 + 4);
    ck_assert_int_eq(sadmm_world_coupling_count(world), 1);
    int32_t chain[2] = {0, 0}; /* joints among the hand's links, and among the car's parts */
    for (int32_t k = 0; k < 33 + 4; ++k) {
        sadmm_joint_id id;
        sadmm_joint_def def;
        MUST(world, sadmm_world_joint_at(world, k, &id));
        MUST(world, sadmm_world_joint_def(world, id, &def));
        ck_assert_int_eq(def.kind, SADMM_JOINT_REVOLUTE);
        const int32_t a = (int32_t)def.body_a.slot - 1, b = (int32_t)def.body_b.slot - 1;
        chain[0] += a >= 2 && a < 2 + 34 && b >= 2 && b < 2 + 34;
        chain[1] += strcmp(body_def(world, body_at(world, a)).name, "car") == 0;
    }
    ck_assert_int_eq(chain[0], 33);
    ck_assert_int_eq(chain[1], 4);
    /* Table I: 1773 contacts on average, of the run; 10 %. Here without what the hand touches. */
    step_world(world, 1);
    ck_assert_double_eq_tol(world_report(world).contacts / 1773.0, 1, 0.1);
    sadmm_world_destroy(world);
}
END_TEST

/* The golden cube alone: 9.5 s of the recording. */
static struct sadmm_scene_task run_golden(const struct sadmm_scene *scene, double mu)
{
    struct sadmm_scene_result result = {0};
    sadmm_world *world = build_scene(scene);
    if (mu > 0) set_friction(world, mu);
    run_to_result(scene, world, 0, lround(9.6 / scene->def.settings.dt), &result);
    sadmm_world_destroy(world);
    return *find_task(&result, "golden cube");
}

START_TEST(the_hand_lifts_the_golden_cube)
{
    const struct sadmm_scene scene = open_result_scene("hand_demo", SADMM_METHOD_FAST, SADMM_F32);
    const struct sadmm_scene_task task = run_golden(&scene, 0);
    ck_assert(task.finished && task.passed);
    ck_assert_double_eq_tol(figure(&task, "held"), 5, 1e-6);
    /* 1 kg: the difference of two forces of 13 and 23 N, while the hand is at rest to 1e-4 m/s. */
    ck_assert_double_eq_tol(figure(&task, "reaction"), 9.81, 0.05);
}
END_TEST

/* Pads press with some 50 N from both sides and carry 100 mu N; the cube has 10 N: with 0.05 it stays on the table. */
START_TEST(the_hand_holds_by_friction_alone)
{
    const struct sadmm_scene scene = open_result_scene("hand_demo", SADMM_METHOD_FAST, SADMM_F32);
    const struct sadmm_scene_task task = run_golden(&scene, 0.05);
    ck_assert(task.finished && !task.passed);
    ck_assert_double_lt(figure(&task, "lifted"), 0.01);
}
END_TEST

/* Two worlds of a scene, one ahead of the other, each with its own result: nothing is shared. */
START_TEST(scripts_keep_nothing_of_their_own)
{
    static const char *const specs[] = {"hand_demo", "grippers:3", "jenga"};
    const struct sadmm_scene scene = open_result_scene(specs[_i], SADMM_METHOD_FAST, SADMM_F64);
    struct sadmm_scene_result results[3];
    sadmm_world *worlds[3];
    memset(results, 0, sizeof results);
    for (int k = 0; k < 3; ++k) worlds[k] = build_scene(&scene);
    run_to_result(&scene, worlds[0], 0, 120, &results[0]);
    for (int64_t step = 0; step < 120; ++step) {
        run_to_result(&scene, worlds[1], step, step + 1, &results[1]);
        if (step >= 20) run_to_result(&scene, worlds[2], step - 20, step - 19, &results[2]);
    }
    ck_assert(state_hash(worlds[0]) == state_hash(worlds[1]));
    ck_assert(state_hash(worlds[0]) != state_hash(worlds[2]));
    run_to_result(&scene, worlds[2], 100, 120, &results[2]);
    ck_assert(state_hash(worlds[0]) == state_hash(worlds[2]));
    for (int k = 1; k < 3; ++k)
        ck_assert(memcmp(results[0].memory, results[k].memory, sizeof results[0].memory) == 0);
    for (int k = 0; k < 3; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* ---- structures and machines ------------------------------------------------------------------------------------- */

START_TEST(others_pass)
{
    static const char *const specs[] = {"jenga", "bridge", "ragdolls:3", "mixer:150"};
    if (!is_its_turn(_i / 2, _i % 2)) return;
    expect_success(specs[_i / 2], SADMM_METHOD_FAST, _i % 2 ? SADMM_F32 : SADMM_F64);
}
END_TEST

/* The tower for 10 of its 600 s: it is where it was built to the slop's hundredth, and a plank pushed at shows. */
START_TEST(the_tower_does_not_creep)
{
    struct sadmm_scene scene = open_result_scene("kapla_tower", SADMM_METHOD_FAST, SADMM_F64);
    struct sadmm_scene_result result = {0};
    sadmm_world *world = build_scene(&scene);
    run_to_result(&scene, world, 0, 1000, &result);
    const struct sadmm_scene_task *task = find_task(&result, "stand");
    ck_assert(!task->finished);
    ck_assert_double_lt(figure(task, "moved"), 1e-7);
    const sadmm_body_id id = body_at(world, 102); /* the last plank of the top floor */
    sadmm_body_state state = body_state(world, id);
    state.linear_velocity[1] = 1;
    MUST(world, sadmm_world_set_body_state(world, id, &state));
    run_to_result(&scene, world, 1000, 1100, &result);
    ck_assert_double_gt(figure(task, "moved"), 0.03); /* v^2 / (2 mu g) = 64 mm if it slides alone */
    sadmm_world_destroy(world);
}
END_TEST

/* Nothing that a scene measures may hide a NaN: a ragdoll's part that is thrown off by hand is apart, and fails. */
START_TEST(a_torn_ragdoll_fails)
{
    struct sadmm_scene scene = open_result_scene("ragdolls:1", SADMM_METHOD_FAST, SADMM_F64);
    struct sadmm_scene_result result = {0};
    struct sadmm_error error = {0};
    sadmm_world *world = build_scene(&scene);
    const int64_t steps = lround(scene.duration / scene.def.settings.dt);
    run_to_result(&scene, world, 0, 10, &result);
    sadmm_body_state state = body_state(world, body_at(world, 3)); /* the head */
    state.position[0] += 1;
    MUST(world, sadmm_world_set_body_state(world, body_at(world, 3), &state));
    ck_assert_int_eq(sadmm_scene_observe(&scene, world, steps, &result, &error), SADMM_OK);
    ck_assert(result.tasks[0].finished && !sadmm_scene_passed(&result));
    ck_assert_double_gt(figure(&result.tasks[0], "apart"), 0.5);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("scene results");
    TCase *cases = tcase_create("results");
    tcase_set_timeout(cases, 100);
    tcase_add_loop_test(cases, every_measure_is_whole, 0, (int)sadmm_scene_count());
    tcase_add_test(cases, scenes_without_a_measure_have_none);
    tcase_add_loop_test(cases, grippers_hold, 0, WAYS);
    tcase_add_test(cases, grippers_hold_by_friction_alone);
    tcase_add_test(cases, the_hand_is_what_it_says);
    tcase_add_test(cases, the_hand_lifts_the_golden_cube);
    tcase_add_test(cases, the_hand_holds_by_friction_alone);
    tcase_add_loop_test(cases, scripts_keep_nothing_of_their_own, 0, 3);
    tcase_add_loop_test(cases, others_pass, 0, 8);
    tcase_add_test(cases, the_tower_does_not_creep);
    tcase_add_test(cases, a_torn_ragdoll_fails);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
