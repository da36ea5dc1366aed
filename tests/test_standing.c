/* Structures that stand by exact friction and nothing else: no sleeping, no damping. Short versions of the scenes, by
 * both methods and in both precisions; test_standing_slow has the full ones. */
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
    run_standing(&cases[_i % CASES], (sadmm_method)(_i / CASES % SADMM_METHOD_COUNT),
                 _i < CASES * SADMM_METHOD_COUNT ? SADMM_F32 : SADMM_F64);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("standing");
    TCase *tests = tcase_create("standing");

    tcase_set_timeout(tests, 100);
    tcase_add_loop_test(tests, stands, 0, 2 * SADMM_METHOD_COUNT * CASES);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
