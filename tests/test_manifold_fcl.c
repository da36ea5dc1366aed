/* Boxes against FCL's own box against box, an implementation from another line (ODE's): it agrees on whether boxes
 * overlap, on the depth, and on the normal where one axis is clearly the best.
 *
 * Tolerances: both prefer faces to edges by 5 % of the depth; ours also by 0.5 % of the thinner box.
 */
#include "manifold_tools.h"

int fcl_boxes(const double half_a[3], const double Ra[9], const double xa[3], const double half_b[3],
              const double Rb[9], const double xb[3], double *depth, double normal[3]);

static void compare(double thin, uint64_t seed, int pairs)
{
    struct random r = {seed};
    int contacts = 0, same_normal = 0;
    for (int n = 0; n < pairs; ++n) {
        struct solid a = box_at(0.05, 0.03, thin, 0, 0, 0), b = box_at(0.05, 0.03, thin, 0, 0, 0);
        double d[3], depth, normal[3], chosen, thickness = 2 * thin;
        random_rotation(&r, a.R);
        random_rotation(&r, b.R);
        for (int k = 0; k < 3; ++k) b.size[k] *= random_in(&r, 0.7, 1.4);
        spread_direction(n, pairs, d);
        /* together along whatever separates them until they touch, then up to a quarter of the thickness in or out */
        double axis[3];
        for (int k = 0; k < 3; ++k) b.x[k] = d[k] * 0.2;
        for (int i = 0; i < 20; ++i) {
            double separation = box_separation(&a, &b, axis),
                   shift = i < 19 ? fmax(separation, 0) : separation + random_in(&r, -0.1, 0.25) * thickness;
            for (int k = 0; k < 3; ++k) b.x[k] -= axis[k] * shift;
        }
        int theirs = fcl_boxes(a.size, a.R, a.x, b.size, b.R, b.x, &depth, normal);
        struct world_manifold m = touch(&a, &b, 0, 0);
        double best = box_separation(&a, &b, NULL);
        if (fabs(best) < 1e-12) continue; /* touching: rounding decides */
        ck_assert_int_eq(theirs > 0, m.count > 0);
        ck_assert_int_eq(best <= 0, m.count > 0);
        if (m.count == 0) continue;
        ++contacts;
        chosen = -separation_along(&a, &b, m.normal);
        ck_assert_double_le(fabs(chosen - depth), 0.06 * fmax(depth, chosen) + 0.005 * thickness);
        same_normal += dot3(m.normal, normal) > 0.999;
    }
    ck_assert_int_gt(contacts, pairs / 4);
    /* the rest: a face here and an edge there, within the preference */
    ck_assert_int_gt(same_normal, contacts * 9 / 10);
}

START_TEST(cubes_agree) { compare(0.05, 1, 4000); }
END_TEST

START_TEST(cards_agree) { compare(0.0005, 2, 4000); }
END_TEST

int main(void)
{
    Suite *suite = suite_create("manifold against FCL");
    TCase *cases = tcase_create("boxes");
    SRunner *runner;
    int failed;

    tcase_add_test(cases, cubes_agree);
    tcase_add_test(cases, cards_agree);
    suite_add_tcase(suite, cases);
    runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
