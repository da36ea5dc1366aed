/* The paths of test_manifold_paths.c, further: a million poses of boxes in double and in float, a quarter of a million
 * of each pair with round shapes. */
#include "manifold_paths.h"
#include "run_suite.h"

START_TEST(boxes)
{
    struct path_counts counts = walk_paths(PATH_BOX_BOX, _i != 0, 17000, 60, 11);
    ck_assert_int_gt(counts.poses, 1000000);
    ck_assert_int_gt(counts.strict, counts.poses / 3);
}
END_TEST

START_TEST(round_shapes)
{
    for (int pair = PATH_SPHERE_BOX; pair < PATH_PAIRS; ++pair) {
        struct path_counts counts = walk_paths((enum path_pair)pair, _i != 0, 4200, 60, 12 + (uint64_t)pair);
        ck_assert_int_gt(counts.poses, 250000);
        ck_assert_int_gt(counts.strict, counts.poses / 3);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("manifold paths, long");
    TCase *cases = tcase_create("paths");
    tcase_set_timeout(cases, 600);
    tcase_add_loop_test(cases, boxes, 0, 2); /* in double, in float */
    tcase_add_loop_test(cases, round_shapes, 0, 2);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
