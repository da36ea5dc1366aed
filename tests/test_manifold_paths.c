/* Manifolds along paths (manifold_paths.h), some 800,000 poses; test_manifold_paths_slow.c walks further. */
#include "manifold_paths.h"
#include "run_suite.h"

START_TEST(boxes)
{
    struct path_counts counts = walk_paths(PATH_BOX_BOX, _i != 0, 4000, 60, 1);
    ck_assert_int_gt(counts.contacts, counts.poses * 3 / 4);
    ck_assert_int_gt(counts.strict, counts.poses / 3);
    ck_assert_int_gt(counts.kept, 500);
    ck_assert_int_gt(counts.reversed, 50);
}
END_TEST

START_TEST(spheres_and_boxes)
{
    struct path_counts counts = walk_paths(PATH_SPHERE_BOX, _i != 0, 2000, 60, 2);
    ck_assert_int_gt(counts.contacts, counts.poses * 3 / 4);
    ck_assert_int_gt(counts.strict, counts.poses / 3);
    ck_assert_int_gt(counts.kept, 100);
}
END_TEST

START_TEST(capsules_and_boxes)
{
    struct path_counts counts = walk_paths(PATH_CAPSULE_BOX, _i != 0, 2000, 60, 3);
    ck_assert_int_gt(counts.contacts, counts.poses * 3 / 4);
    ck_assert_int_gt(counts.strict, counts.poses / 3);
    ck_assert_int_gt(counts.kept, 10);
}
END_TEST

START_TEST(capsules)
{
    struct path_counts counts = walk_paths(PATH_CAPSULE_CAPSULE, _i != 0, 1000, 60, 4);
    ck_assert_int_gt(counts.contacts, counts.poses * 3 / 4);
    ck_assert_int_gt(counts.strict, counts.poses / 3);
    ck_assert_int_gt(counts.kept, 100);
}
END_TEST

/* Two boxes of a falling pile, edge to edge: rotation vector and centre of the second one as the first one sees it, in
 * five steps. Between the last two the edges pass the parallel; the boxes come no nearer than touching. */
START_TEST(edges_pass_the_parallel)
{
    static const double poses[][2][3] = {
        {{0.86485, -0.80638, 1.53855}, {-0.04716, -0.04842, 0.11577}},
        {{0.88231, -0.84123, 1.49960}, {-0.04838, -0.04694, 0.11982}},
        {{0.89565, -0.87063, 1.45165}, {-0.04887, -0.04591, 0.12447}},
        {{0.90471, -0.89433, 1.40248}, {-0.04894, -0.04458, 0.12947}},
        {{0.91013, -0.91421, 1.35455}, {-0.04909, -0.04280, 0.13468}},
    };
    struct path p = {.a = box_at(0.08, 0.04, 0.04, 0, 0, 0), .b = box_at(0.08, 0.04, 0.04, 0, 0, 0), .thin = 0.08};
    uint32_t cache = 0;
    for (size_t step = 0; step < sizeof poses / sizeof poses[0]; ++step) {
        const double *turned = poses[step][0];
        struct world_manifold m;
        struct ways w;
        double truth, axis[3];
        rotation(p.b.R, turned[0], turned[1], turned[2], sqrt(dot3(turned, turned)));
        memcpy(p.b.x, poses[step][1], sizeof p.b.x);
        find_ways(&p.a, &p.b, &w);
        truth = best_way(&w, NULL, -2, axis);
        m = path_touch(&p, _i != 0, 0.02, cache);
        ck_assert_int_gt(m.count, 0);
        ck_assert_double_ge(separation_along(&p.a, &p.b, m.normal),
                            truth - path_margin(&p, PATH_BOX_BOX, _i != 0, truth));
        ck_assert_double_gt(dot3(m.normal, axis), 0);
        cache = m.cache;
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("manifold paths");
    TCase *cases = tcase_create("paths");
    tcase_set_timeout(cases, 60);
    tcase_add_loop_test(cases, boxes, 0, 2); /* in double, in float */
    tcase_add_loop_test(cases, spheres_and_boxes, 0, 2);
    tcase_add_loop_test(cases, capsules_and_boxes, 0, 2);
    tcase_add_loop_test(cases, capsules, 0, 2);
    tcase_add_loop_test(cases, edges_pass_the_parallel, 0, 2);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
