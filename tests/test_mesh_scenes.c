/* Scenes with triangle meshes and heightfields: they pass, in either method and precision, and do not where what they
 * rest on is taken away. The whole of each: test_scene_results_slow. */
#include "fewer.h"
#include "scene_results.h"

static const char *const specs[] = {"terrain:16", "marble_run", "nuts_and_bolts:1"};
enum { SPECS = sizeof specs / sizeof *specs };

START_TEST(scenes_pass)
{
    if (!is_its_turn(_i / WAYS, _i % WAYS)) return;
    expect_success(specs[_i / WAYS], ways[_i % WAYS].method, ways[_i % WAYS].precision);
}
END_TEST

static int64_t end_of(const struct sadmm_scene *scene)
{
    return lround(scene->duration / scene->def.settings.dt);
}

/* ---- hills ------------------------------------------------------------------------------------------------------- */

static int32_t shapes_of(sadmm_world *world, sadmm_shape_type type, int32_t least_vertices)
{
    int32_t count = 0;
    for (int32_t k = 0; k < sadmm_world_shape_count(world); ++k) {
        sadmm_shape_id id;
        sadmm_shape_def def;
        MUST(world, sadmm_world_shape_at(world, k, &id));
        MUST(world, sadmm_world_shape_def(world, id, &def, NULL));
        count += def.type == type && sadmm_hull_vertex_count(def.hull) >= least_vertices;
    }
    return count;
}

START_TEST(the_hills_are_what_they_say)
{
    const struct sadmm_scene scene = open_result_scene("terrain:80", SADMM_METHOD_FAST, SADMM_F64);
    sadmm_world *world = build_scene(&scene);
    ck_assert_int_eq(shapes_of(world, SADMM_SHAPE_MESH, 0), 1);
    ck_assert_int_eq(shapes_of(world, SADMM_SHAPE_HULL, 32), 50);
    ck_assert_int_eq(shapes_of(world, SADMM_SHAPE_SPHERE, 0), 10);
    ck_assert_int_eq(shapes_of(world, SADMM_SHAPE_CAPSULE, 0), 10);
    ck_assert_int_eq(shapes_of(world, SADMM_SHAPE_BOX, 0), 10 + 4);
    sadmm_world_destroy(world);
}
END_TEST

/* A body that is put under the ground or beyond the walls shows; so do two that move, of which one may. */
START_TEST(what_fell_through_the_hills_shows)
{
    struct sadmm_scene scene = open_result_scene("terrain:8", SADMM_METHOD_FAST, SADMM_F64);
    struct sadmm_error error = {0};
    const double places[2][3] = {{0, 0, -3}, {0, 20, 5}};
    for (int32_t body = 5; body < 13; ++body) /* of every kind */
        for (int k = 0; k < 2; ++k) {
            struct sadmm_scene_result result = {0};
            sadmm_world *world = build_scene(&scene);
            const sadmm_body_id id = body_at(world, body);
            sadmm_body_state state = body_state(world, id);
            memcpy(state.position, places[k], sizeof state.position);
            MUST(world, sadmm_world_set_body_state(world, id, &state));
            ck_assert_int_eq(sadmm_scene_observe(&scene, world, end_of(&scene), &result, &error), SADMM_OK);
            const struct sadmm_scene_task *stay = find_task(&result, "stay");
            ck_assert(stay->finished && !stay->passed && find_task(&result, "settle")->passed);
            if (k == 0) ck_assert_double_gt(figure(stay, "below"), 1);
            ck_assert_double_eq(figure(stay, "outside"), k);
            for (int moving = 1; moving <= 2; ++moving) {
                const sadmm_body_id mover = body_at(world, moving == 1 ? body : body == 5 ? 6 : 5);
                state = body_state(world, mover);
                state.angular_velocity[1] = 20;
                MUST(world, sadmm_world_set_body_state(world, mover, &state));
                memset(&result, 0, sizeof result);
                ck_assert_int_eq(sadmm_scene_observe(&scene, world, end_of(&scene), &result, &error), SADMM_OK);
                ck_assert_double_eq(figure(find_task(&result, "settle"), "moving"), moving);
                ck_assert(find_task(&result, "settle")->passed == (moving == 1));
            }
            sadmm_world_destroy(world);
        }
}
END_TEST

/* Contacts of bodies at rest on a heightfield are solved as those of any other ground: 16 bodies after 8 s. */
START_TEST(the_hills_are_solved)
{
    struct sadmm_scene scene = open_result_scene("terrain:16", SADMM_METHOD_FAST, SADMM_F64);
    sadmm_world *world = build_scene(&scene);
    step_world(world, (int)end_of(&scene));
    const sadmm_certificate c = certified_step(world);
    /* m/s, and relative: what is left where bodies come to rest one after the other, far below dt g = 0.05 m/s */
    ck_assert_double_lt(c.ncp_max, 1e-4);
    ck_assert_double_lt(c.momentum_max, 1e-2);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- marbles ----------------------------------------------------------------------------------------------------- */

/* Without friction they slide: v^2 = 2 g h, 1.4 times that of rolling. */
START_TEST(marbles_roll_by_friction)
{
    const struct sadmm_scene scene = open_result_scene("marble_run", SADMM_METHOD_FAST, SADMM_F64);
    struct sadmm_scene_result result = {0};
    sadmm_world *world = build_scene(&scene);
    set_friction(world, 0);
    run_to_result(&scene, world, 0, 500, &result);
    ck_assert_double_eq_tol(figure(find_task(&result, "roll"), "error"), 0.4, 1e-3);
    sadmm_world_destroy(world);
}
END_TEST

/* A marble that is taken off the track, or is gone from the funnel, shows. */
START_TEST(marbles_that_leave_show)
{
    const struct sadmm_scene scene = open_result_scene("marble_run", SADMM_METHOD_FAST, SADMM_F64);
    struct sadmm_scene_result result = {0};
    struct sadmm_error error = {0};
    sadmm_world *world = build_scene(&scene);
    const sadmm_body_id id = body_at(world, 3);
    run_to_result(&scene, world, 0, 10, &result);
    const double on = figure(find_task(&result, "follow the track"), "off");
    ck_assert_double_eq_tol(on, 0.016 - 0.008, 1e-6); /* in the middle of the bottom */
    sadmm_body_state state = body_state(world, id);
    state.position[1] += 0.05;
    MUST(world, sadmm_world_set_body_state(world, id, &state));
    ck_assert_int_eq(sadmm_scene_observe(&scene, world, 11, &result, &error), SADMM_OK);
    ck_assert_double_gt(figure(find_task(&result, "follow the track"), "off"), 0.04);
    ck_assert_int_eq(sadmm_scene_observe(&scene, world, end_of(&scene), &result, &error), SADMM_OK);
    for (int k = 0; k < 3; ++k) ck_assert(result.tasks[k].finished);
    ck_assert(!find_task(&result, "follow the track")->passed && !find_task(&result, "arrive")->passed);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- nuts -------------------------------------------------------------------------------------------------------- */

/* How far a nut comes in 0.3 s with a friction, m. */
static double way_of_a_nut(double mu)
{
    const struct sadmm_scene scene = open_result_scene("nuts_and_bolts:1", SADMM_METHOD_FAST, SADMM_F64);
    sadmm_world *world = build_scene(&scene);
    const double from = body_state(world, body_at(world, 2)).position[2];
    set_friction(world, mu);
    step_world(world, 300);
    const double way = from - body_state(world, body_at(world, 2)).position[2];
    sadmm_world_destroy(world);
    return way;
}

/* A thread holds by friction where mu / cos(15 degrees) exceeds its slope, 16 mm / 2 pi r: from mu = 0.246 (crest) to
 * 0.265 (root) on. It falls by half of the play, or less, before it is held. Below that it runs by at least as much as
 * the formula of nuts_and_bolts.c says for the root, at 0.23 0.3 % of g: 1.3 mm; a tenth less for iterations. */
START_TEST(threads_hold_by_friction_where_they_should)
{
    ck_assert_double_lt(way_of_a_nut(0.28), 6e-5);
    ck_assert_double_gt(way_of_a_nut(0.23), 5e-4);
}
END_TEST

/* A nut that is farther up or down than its turns say shows. */
START_TEST(nuts_that_jump_show)
{
    const struct sadmm_scene scene = open_result_scene("nuts_and_bolts:2", SADMM_METHOD_FAST, SADMM_F64);
    struct sadmm_scene_result result = {0};
    struct sadmm_error error = {0};
    sadmm_world *world = build_scene(&scene);
    run_to_result(&scene, world, 0, 5, &result);
    ck_assert_double_lt(figure(find_task(&result, "run down"), "off"), 6e-5);
    const sadmm_body_id id = body_at(world, 4);
    sadmm_body_state state = body_state(world, id);
    state.position[2] += 1e-3;
    MUST(world, sadmm_world_set_body_state(world, id, &state));
    ck_assert_int_eq(sadmm_scene_observe(&scene, world, 6, &result, &error), SADMM_OK);
    ck_assert_double_eq_tol(figure(find_task(&result, "run down"), "off"), 1e-3, 6e-5);
    ck_assert_int_eq(sadmm_scene_observe(&scene, world, end_of(&scene), &result, &error), SADMM_OK);
    ck_assert(result.tasks[0].finished && !result.tasks[0].passed && !result.tasks[1].passed);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("scenes with meshes");
    TCase *cases = tcase_create("scenes");
    tcase_set_timeout(cases, 100);
    tcase_add_loop_test(cases, scenes_pass, 0, SPECS * WAYS);
    tcase_add_test(cases, the_hills_are_what_they_say);
    tcase_add_test(cases, what_fell_through_the_hills_shows);
    tcase_add_test(cases, the_hills_are_solved);
    tcase_add_test(cases, marbles_roll_by_friction);
    tcase_add_test(cases, marbles_that_leave_show);
    tcase_add_test(cases, threads_hold_by_friction_where_they_should);
    tcase_add_test(cases, nuts_that_jump_show);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
