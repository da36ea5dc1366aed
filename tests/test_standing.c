/* Structures that stand by exact friction and nothing else: no sleeping, no damping. Short versions of the scenes, by
 * both methods and in both precisions; test_standing_slow has the full ones. */
#include "fewer.h"
#include "standing.h"

/* In a layer of contacts, bodies sink by the slop; where one edge does and the other does not, a body as tall as it is
 * wide leans by as much. */
#define LAYERS(n) (2 * (n) * SLOP)

static const struct standing_case cases[] = {
    /* 100 kg and 1 kg on 10 g */
    {"vertical_stacks:12", 5, 101.01 / 0.01, INFINITY, 12 * 12, expect_vertical_stacks, 0},
    /* two levels of nine cubes of 50 g under a plate of 10 kg */
    {"oblique_stacks:2", 5, (2 * 10 + 9 * 0.05) / (9 * 0.05) + 1, LAYERS(4), 2 * 144, NULL, 0},
    {"pyramid:10", 5, 10, LAYERS(10), 4 * 10 + 4 * 10 * 9, NULL, 0},
    /* layers of 132, 121, 110, 90 and 47 cubes, whose faces touch and that do not lean */
    {"settled_pile:500", 1, 500.0 / 132, SLOP, 4 * 132 + 8 * (121 + 110 + 47) + 16 * 90, NULL, 0},
};
enum { CASES = sizeof cases / sizeof *cases };

START_TEST(stands)
{
    if (!is_its_turn(_i % CASES, _i / CASES)) return;
    run_standing(&cases[_i % CASES], (sadmm_method)(_i / CASES % SADMM_METHOD_COUNT),
                 _i < CASES * SADMM_METHOD_COUNT ? SADMM_F32 : SADMM_F64);
}
END_TEST

/* Five iterations of `paper` leave contacts that are springs, and bodies sway on them. They come to rest, since what
 * rests takes no trapezoid correction (core/math/trapezoid.h): with it they sway at 5e-3 m/s, a tenth of g dt, for
 * good. The limit is a 500th of that, and 200 times what is left after these 2 s. */
START_TEST(what_sways_comes_to_rest)
{
    struct sadmm_scene scene = open_scene("oblique_stacks:1");
    sadmm_scene_set_method(&scene, SADMM_METHOD_PAPER);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.settings.threads = 1;
    scene.def.settings.iterations = 5;
    sadmm_world *world = build_scene(&scene);
    step_world(world, 400);
    ck_assert_double_lt(top_speed(world), 1e-5);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("standing");
    TCase *tests = tcase_create("standing");

    tcase_set_timeout(tests, 100);
    tcase_add_loop_test(tests, stands, 0, 2 * SADMM_METHOD_COUNT * CASES);
    tcase_add_test(tests, what_sways_comes_to_rest);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
