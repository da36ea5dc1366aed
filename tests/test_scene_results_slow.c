/* Every scene that measures its success passes as a whole, in either method and precision. */
#include "scene_results.h"

static const char *const specs[] = {"hand_demo", "grippers:100", "kapla_tower", "jenga",     "bridge",     "ragdolls",
                                    "mixer",     "arch",         "dry_stone",   "mesh_pile", "peg_in_hole",
                                    "terrain",   "marble_run",   "nuts_and_bolts:10"};
enum { SPECS = sizeof specs / sizeof *specs };

START_TEST(scenes_pass)
{
    const sadmm_method method = _i % 2 ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST;
    const struct sadmm_scene scene = open_scene(specs[_i / 4]);
    if (lacks_hulls(&scene)) return;
    expect_success(specs[_i / 4], method, _i / 2 % 2 ? SADMM_F32 : SADMM_F64);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("scene results, whole");
    TCase *cases = tcase_create("results");
    tcase_set_timeout(cases, 300);
    tcase_add_loop_test(cases, scenes_pass, 0, 4 * SPECS);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
