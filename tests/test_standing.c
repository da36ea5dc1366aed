/* Structures that stand by exact friction and nothing else: no sleeping, no damping. Short versions of the scenes, by
 * both methods; test_standing_slow has the full ones.
 *
 * The limits: a drift of 1 mm is 0.3 % of a box and far above the slop; 1e-3 m/s is a tenth of what gravity adds in a
 * fifth of a step. The certificate at rest (warm-started): 1e-6 m/s in double is 5e-9 m a step; single precision holds
 * 1000 N on a 10 g box to 1e-7 relative, which is 1e-5 m/s and more for the light box.
 */
#include "standing.h"

START_TEST(vertical_stacks)
{
    const sadmm_method method = (sadmm_method)(_i / 2);
    const struct standing_case limits[] = {
        { "vertical_stacks:12", method, SADMM_F64, 5.0, 0.5, 1e-3, 1e-3, 1e-6, 1438.0 / 10 },
        { "vertical_stacks:12", method, SADMM_F32, 5.0, 0.5, 1e-3, 1e-3, 1e-4, 1438.0 / 10 },
    };
    sadmm_world *world = run_standing(&limits[_i % 2]);
    expect_vertical_stacks(world);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(oblique_stacks)
{
    const sadmm_method method = (sadmm_method)(_i / 2);
    const struct standing_case limits[] = {
        { "oblique_stacks:2", method, SADMM_F64, 5.0, 0.1, 1e-3, 1e-3, 1e-6, 1087.0 * 2 / 7 },
        { "oblique_stacks:2", method, SADMM_F32, 5.0, 0.1, 1e-3, 1e-3, 1e-4, 1087.0 * 2 / 7 },
    };
    sadmm_world_destroy(run_standing(&limits[_i % 2]));
}
END_TEST

START_TEST(pyramid)
{
    const sadmm_method method = (sadmm_method)(_i / 2);
    const struct standing_case limits[] = {
        { "pyramid:10", method, SADMM_F64, 5.0, 0.1, 1e-3, 1e-3, 1e-6, 0 },
        { "pyramid:10", method, SADMM_F32, 5.0, 0.1, 1e-3, 1e-3, 1e-4, 0 },
    };
    sadmm_world_destroy(run_standing(&limits[_i % 2]));
}
END_TEST

START_TEST(settled_pile)
{
    const sadmm_method method = (sadmm_method)(_i / 2);
    const struct standing_case limits[] = {
        { "settled_pile:500", method, SADMM_F64, 1.0, 0.1, 1e-5, 1e-3, 1e-6, 0 }, /* at rest at once: small drift */
        { "settled_pile:500", method, SADMM_F32, 1.0, 0.1, 1e-5, 1e-3, 1e-6, 0 },
    };
    sadmm_world_destroy(run_standing(&limits[_i % 2]));
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("standing");
    TCase *cases = tcase_create("standing");

    tcase_set_timeout(cases, 100);
    tcase_add_loop_test(cases, vertical_stacks, 0, 2 * SADMM_METHOD_COUNT);
    tcase_add_loop_test(cases, oblique_stacks, 0, 2 * SADMM_METHOD_COUNT);
    tcase_add_loop_test(cases, pyramid, 0, 2 * SADMM_METHOD_COUNT);
    tcase_add_loop_test(cases, settled_pile, 0, 2 * SADMM_METHOD_COUNT);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
