/* The poses of test_manifold_hull.c, further: a million of each kind of pair, of hulls with few corners. */
#include "hull_touches.h"
#include "run_suite.h"

enum { PARTS = 10 };

START_TEST(hulls)
{
    const struct extent extent = {1000000 / PARTS, 10, 6};
    touch_hulls(1000 + (uint64_t)_i, &extent);
}
END_TEST

START_TEST(round_shapes)
{
    const struct extent extent = {1000000 / PARTS, 12, 0};
    touch_round(1000 + (uint64_t)_i, _i % 2, &extent);
}
END_TEST

START_TEST(rounded_hulls)
{
    const struct extent extent = {250000 / PARTS, 10, 3}; /* four near ones each */
    touch_rounded(1000 + (uint64_t)_i, _i % 2, &extent);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("manifold hull, long");
    TCase *cases = tcase_create("hulls");
    tcase_set_timeout(cases, 600);
    tcase_add_loop_test(cases, hulls, 0, PARTS);
    tcase_add_loop_test(cases, round_shapes, 0, 2 * PARTS); /* spheres, capsules */
    tcase_add_loop_test(cases, rounded_hulls, 0, 2 * PARTS); /* with hulls, with boxes */
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
