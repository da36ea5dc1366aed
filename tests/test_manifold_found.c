/* Pairs that the search of tests/fuzz found, each with a contact whose point was not between the surfaces, or with
 * none. Every point is halfway between surface points of the two that are its separation apart, so that it lies no
 * farther outside of either than half of that.
 *
 * Tolerance: 64 roundings of a double at the size of the pair (poses, a square root, and the projections of the
 * oracle). */
#include <float.h>

#include "manifold_tools.h"
#include "run_suite.h"

static double pair_size(const struct solid *a, const struct solid *b)
{
    return radius_of(a) + radius_of(b);
}

/* The number of points, as given and exchanged. */
static int expect_between(struct solid a, struct solid b, double limit)
{
    double tolerance = 64 * DBL_EPSILON * pair_size(&a, &b);
    int least = SADMM_MANIFOLD_POINTS;
    for (int exchanged = 0; exchanged < 2; ++exchanged) {
        struct world_manifold m = exchanged ? touch(&b, &a, limit, 0) : touch(&a, &b, limit, 0);
        for (int i = 0; i < m.count; ++i) {
            double half = 0.5 * fabs(m.separation[i]) + tolerance;
            ck_assert_double_le(m.separation[i], limit + tolerance);
            ck_assert_double_le(outside(&a, m.position[i]), half);
            ck_assert_double_le(outside(&b, m.position[i]), half);
        }
        least = m.count < least ? m.count : least;
    }
    return least;
}

/* Edges 2 degrees from parallel and apart: at an end of what they have in common they are apart sideways. */
START_TEST(edges_that_drift_apart)
{
    struct solid a = box_at(0.25, 0.5, 0.75, 0, 0, 0), b = box_at(0.25, 0.25, 0.25, 0.85568194512042683,
                                                                 0.027264320978180347, -0.72557704235174225);
    const double Ra[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    const double Rb[9] = {-0.019844139623231172, -0.64670204092177885, 0.76248454436153645,
                          -0.99794651073130314,  0.059266553123667021, 0.024294801914336028,
                          -0.060901328736169602, -0.76043668109083584, -0.64655013897587543};
    memcpy(a.R, Ra, sizeof Ra);
    memcpy(b.R, Rb, sizeof Rb);
    ck_assert_int_ge(expect_between(a, b, 0.01), 1);
}
END_TEST

/* Boxes far apart (the limit is larger still) whose nearest features are edges, in a slightly other direction at the
 * ends. */
START_TEST(edges_far_apart)
{
    struct solid a = box_at(1, 0.5, 1, 0, 0, 0), b = box_at(1, 0.25, 0.5, 0.35177385882228041, -1.597980792741295,
                                                            1.5648656620287567);
    const double Ra[9] = {1, 0, 0, 0, 1, -2.0235374666871598e-09, 0, 2.0235374666871598e-09, 1};
    const double Rb[9] = {-0.99867855962999741, 0.03633961017509086,    -0.03633961017509086,
                          -0.03633961017509086, -0.99933927981499915,   -0.00066072018500165186,
                          -0.03633961017509086, 0.00066072018500165186, 0.99933927981499837};
    memcpy(a.R, Ra, sizeof Ra);
    memcpy(b.R, Rb, sizeof Rb);
    ck_assert_int_ge(expect_between(a, b, 400), 1);
}
END_TEST

/* Corners that touch but for rounding, limit 0: there may be a contact or none, but not one 0.3 m deep and 0.9 m
 * away. */
START_TEST(corners_that_just_touch)
{
    static const double x[2][3] = {{0.99998787646099863, 0.99997786033805414, 1.0000078337997556},
                                   {1.0000000000000022, 1.0000000000000022, 0.99553343119739079}};
    static const double R[2][9] = {
        {0.45871410072960617, -0.29640473857865574, 0.83769063784904962, 0.83769063784904962, 0.45871410072960617,
         -0.29640473857865574, -0.29640473857865574, 0.83769063784904962, 0.45871410072960617},
        {0.37116504804291894, -0.2620024268309763, 0.89083737878805735, 0.89083737878805735, 0.37116504804291894,
         -0.2620024268309763, -0.2620024268309763, 0.89083737878805735, 0.37116504804291894}};
    const double quarter[9] = {1, 0, 0, 0, -2.2204460492503131e-16, -1, 0, 1, -2.2204460492503131e-16};
    struct solid a = box_at(0.5, 0.5, 0.5, 0, 0, 0), b = a;
    memcpy(a.R, quarter, sizeof a.R);
    memcpy(b.x, x[_i], sizeof b.x);
    memcpy(b.R, R[_i], sizeof b.R);
    expect_between(a, b, 0);
}
END_TEST

/* Capsules of unequal radii, 4 degrees from parallel. */
START_TEST(unequal_capsules_side_by_side)
{
    struct solid a = solid_at(SADMM_SHAPE_CAPSULE, 0.016, 0.02, 0, 0, 0, 0),
                 b = solid_at(SADMM_SHAPE_CAPSULE, 0.003, 0.07, 0, 0.019, 0, 0);
    turn(&a, 1, 0, 0, 0.066);
    ck_assert_int_eq(expect_between(a, b, 1e-4), 3); /* the ends and, deeper, the middle */
}
END_TEST

/* Their axes cross: sideways is all the distance that the ends have. */
START_TEST(crossed_capsules)
{
    struct solid a = solid_at(SADMM_SHAPE_CAPSULE, 1e-4, 2, 0, 0, 0, 0),
                 b = solid_at(SADMM_SHAPE_CAPSULE, 0.75, 0.75, 0, 0, 0, 0);
    turn(&a, 1, 0, 0, 0.011);
    ck_assert_int_ge(expect_between(a, b, 0), 1);
}
END_TEST

/* The middle of a line is as deep as the shapes are, by the thinner of the two: not by what is flat for a huge one. */
START_TEST(a_line_along_a_huge_capsule)
{
    struct solid a = solid_at(SADMM_SHAPE_CAPSULE, 846588.2494276989, 1.0758934996354235, 0, 0, 0, 0);
    struct solid b = solid_at(SADMM_SHAPE_CAPSULE, 0.0014078182090317614, 2.1292250208800398, 0, 846588.24014772661,
                              0.0020342516918464191, 131.23161089270479);
    const double R[9] = {0.99999998798558987,   2.4028820280460253e-09, -0.00015501232251127769,
                         2.4028820280460253e-09, 0.99999999951942364,   3.100246450225554e-05,
                         0.00015501232251127769, -3.100246450225554e-05, 0.9999999875050134};
    double tolerance = MANIFOLD_FLAT * 2 * b.size[0] + 64 * DBL_EPSILON * pair_size(&a, &b);
    memcpy(a.R, R, sizeof R);
    struct world_manifold m = touch(&b, &a, 0, 0);
    ck_assert_double_le(least_separation(&m), separation_along(&b, &a, m.normal) + tolerance);
    ck_assert_int_ge(expect_between(a, b, 0), 1);
}
END_TEST

/* A capsule 10^11 times as long as thick through a plate: the segment inside is short for the capsule, not for the
 * box. */
START_TEST(a_needle_through_a_plate)
{
    struct solid a = solid_at(SADMM_SHAPE_CAPSULE, 1.2155676276376767e-06, 304661.66224296024, 0, 0, 0, 0);
    struct solid b =
        box_at(0.9428799426706399, 0.00014325170312147337, 0.94686372766399229, 0, 0, -0.28532006819048761);
    const double R[9] = {-0.83485863744445776, -0.37441020702971728, 0.40351958113126002,
                         0.38628444373443904,  -0.92073181446802255, -0.05511129063266329,
                         0.3921675458438118,   0.10986319992785185,  0.91330974662950715};
    memcpy(a.R, R, sizeof R);
    ck_assert_int_ge(touch(&a, &b, 3e-7, 0).count, 1);
    ck_assert_int_ge(expect_between(a, b, 3e-7), 1);
}
END_TEST

/* A beam of a million metres through a sheet as large, 0.03 degrees from its plane: over such lengths that angle
 * decides which edges of the beam support the contact. (One on the far side was taken, and the boxes counted as far
 * apart.) */
START_TEST(a_beam_through_a_sheet)
{
    struct solid a = box_at(806179.36498047982, 294681.08112263959, 0.87581514584710662, 0, 0, 0);
    struct solid b = box_at(897685.65399164031, 0.9964226240829126, 0.99978921104099738, 0, 0, 0);
    const double R[9] = {-0.99269799655959168, -0.1206255472375137,  -0.0004061775763337106,
                         -0.12062535962662393, 0.99269799655959157,  -0.00045852101457717701,
                         0.00045852101457717701, -0.0004061775763337106, -0.99999981238911029};
    memcpy(a.R, R, sizeof R);
    ck_assert_int_ge(expect_between(a, b, 0.03), 1);
}
END_TEST

/* Boxes further apart than any sensible world is wide, but not than the limit, which grows with their speed: the square
 * of their distance is still a number, and what says how near they are is compared with it. (There was a contact
 * without a normal.) */
START_TEST(boxes_at_a_distance_of_10_to_the_17)
{
    struct solid a = box_at(0.86, 0.47, 0.87, 0, 0, 0), b = box_at(2.8e-6, 2.8e-6, 143, 6e16, -1.6e17, -1.5e17);
    turn(&b, 1, 2, 3, 0.7);
    struct world_manifold m = touch(&a, &b, 1e20, 0); /* checks that the normal is of length 1 */
    double d[3] = {6e16, -1.6e17, -1.5e17}, length = sqrt(dot3(d, d));
    ck_assert_int_ge(m.count, 1);
    /* a distance that dwarfs the boxes: a few roundings */
    ck_assert_double_eq_tol(dot3(m.normal, d), length, 64 * DBL_EPSILON * length);
    ck_assert_double_eq_tol(m.separation[0], length, 64 * DBL_EPSILON * length);
}
END_TEST

/* An edge on a face, limit 0, turned in it by 1e-13, so that only a corner touches, 0.75 m beside the face. */
START_TEST(a_corner_that_touches_beside_a_face)
{
    struct solid a = box_at(0.25, 0.25, 1, 0, 0, 0),
                 b = box_at(1, 1, 0.25, 1.2573569585592357, 0, -0.043964366640632503);
    const double Ra[9] = {0.99938925986090621,   0, 0.034944345389062624, 0, 1, 0,
                          -0.034944345389062624, 0, 0.99938925986090621};
    const double Rb[9] = {1, 0, 0, 0, 1, -1.2429054667427512e-13, 0, 1.2429054667427512e-13, 1};
    memcpy(a.R, Ra, sizeof Ra);
    memcpy(b.R, Rb, sizeof Rb);
    expect_between(a, b, 0);
}
END_TEST

/* Axes that cross at 0.01 degrees, b's frame turned by a quarter: they are as deep as their radii across both axes, and
 * that is the normal; in the plane of the axes they are three times as deep. */
START_TEST(capsules_that_cross_at_a_small_angle)
{
    struct solid a = solid_at(SADMM_SHAPE_CAPSULE, 0.0018, 220, 0, 0, 0, 0),
                 b = solid_at(SADMM_SHAPE_CAPSULE, 0.0015, 21, 0, 0, 0, 0);
    turn(&a, 1, 0, 0, 2.2246660562e-4);
    turn(&b, 0, 0, 1, M_PI / 2);
    for (int exchanged = 0; exchanged < 2; ++exchanged) {
        struct world_manifold m = exchanged ? touch(&b, &a, 0, 0) : touch(&a, &b, 0, 0);
        /* a line of two ends may leave out a middle that is deeper by MANIFOLD_FLAT of the thinner */
        ck_assert_double_eq_tol(least_separation(&m), -0.0033,
                                MANIFOLD_FLAT * 0.003 + 64 * DBL_EPSILON * pair_size(&a, &b));
    }
}
END_TEST

/* The same far from the middle: how far along they meet is a difference of numbers that are nearly equal. */
START_TEST(capsules_that_cross_far_out)
{
    struct solid a = solid_at(SADMM_SHAPE_CAPSULE, 0.0017677670718836312, 220.64506034776068, 0, 0, 0, 0);
    struct solid b = solid_at(SADMM_SHAPE_CAPSULE, 0.0018438936399546844, 112.62544763099666, 0, -0.033656231498237786,
                              0, -151.28666422234826);
    const double R[9] = {0.9999999752543044,      0, 0.00022246660562180064, 0, 1, 0,
                         -0.00022246660562180064, 0, 0.9999999752543044};
    memcpy(a.R, R, sizeof R);
    for (int exchanged = 0; exchanged < 2; ++exchanged) {
        struct world_manifold m = exchanged ? touch(&b, &a, 0, 0) : touch(&a, &b, 0, 0);
        ck_assert_double_eq_tol(least_separation(&m), -a.size[0] - b.size[0],
                                MANIFOLD_FLAT * 2 * a.size[0] + 64 * DBL_EPSILON * pair_size(&a, &b));
    }
}
END_TEST

/* Two strips end to end in a plane but for a turn of 4e-7: their edges may touch, but what is apart is not in
 * contact. */
START_TEST(strips_end_to_end)
{
    struct solid a = box_at(0.94526819780071769, 10202.289490086152, 1.6109996467208182e-06, 0, 0, 0);
    struct solid b = box_at(0.99978921104099738, 10202.289490086152, 1.709675586693204e-06, 1.9450689677522768,
                            2.2038439493046279e-09, 0);
    const double Ra[9] = {1, -1.1330415454889456e-09, 0, 1.1330415454889456e-09, 1, 0, 0, 0, 1};
    const double Rb[9] = {1, 0, 0, 0, 0.99999999999993738, -3.5400089538993208e-07, 0, 3.5400089538993208e-07,
                          0.99999999999993738};
    memcpy(a.R, Ra, sizeof Ra);
    memcpy(b.R, Rb, sizeof Rb);
    struct world_manifold m = touch(&a, &b, 0, 0);
    for (int i = 0; i < m.count; ++i) ck_assert_double_le(m.separation[i], 64 * DBL_EPSILON * pair_size(&a, &b));
}
END_TEST

/* A beam steeply through a sheet of 10 km, in whose length two points near each other are one: not where the one is a
 * third deeper. They lie symmetrically about the middle, so that exchanging the two may exchange sides, but not the
 * depth. */
START_TEST(a_beam_steeply_through_a_sheet)
{
    struct solid a = box_at(9785.2049078719974, 1, 1, 0, 0, 0), b = box_at(0.00015957891549730317, 10745.334976704695,
                                                                           0.99978921104099738, 0, 0, 0);
    const double R[9] = {4.7863059293717924e-07, 0.98668370380980563,   0.16265075664113901,
                         -0.95803849419570308,   -0.046621690659233828, 0.28282266811432327,
                         0.28663957095802539,    -0.1558258213398499,   0.94528094753081759};
    memcpy(a.R, R, sizeof R);
    struct world_manifold m = touch(&a, &b, 0, 0), w = touch(&b, &a, 0, 0);
    ck_assert_double_eq_tol(least_separation(&m), least_separation(&w), 64 * DBL_EPSILON * pair_size(&a, &b));
}
END_TEST

/* A bar crosswise over the edge of a sheet a micrometre thick, 6e-10 m apart, which the axes do not see: no contact 3
 * mm off. */
START_TEST(a_bar_across_the_edge_of_a_sheet)
{
    struct solid a = box_at(0.99978921104099738, 10202.289490086152, 1.6109996467208182e-06, 0, 0, 0);
    struct solid b = box_at(0.0039285482341883159, 0.87581514584710662, 0.00013509763471643217, 1.0037177599422584,
                            1.137253921959679e-09, 0);
    const double Ra[9] = {1, -1.1330415454889456e-09, 0, 1.1330415454889456e-09, 1, 0, 0, 0, 1};
    const double Rb[9] = {1, 0, 0, 0, -0.99999228043630972, -0.0039292579183424553, 0, 0.0039292579183424553,
                          -0.99999228043630972};
    memcpy(a.R, Ra, sizeof Ra);
    memcpy(b.R, Rb, sizeof Rb);
    expect_between(a, b, 0);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("manifolds found");
    TCase *cases = tcase_create("found");
    tcase_add_test(cases, edges_that_drift_apart);
    tcase_add_test(cases, edges_far_apart);
    tcase_add_loop_test(cases, corners_that_just_touch, 0, 2);
    tcase_add_test(cases, unequal_capsules_side_by_side);
    tcase_add_test(cases, crossed_capsules);
    tcase_add_test(cases, a_line_along_a_huge_capsule);
    tcase_add_test(cases, a_needle_through_a_plate);
    tcase_add_test(cases, a_beam_through_a_sheet);
    tcase_add_test(cases, boxes_at_a_distance_of_10_to_the_17);
    tcase_add_test(cases, a_corner_that_touches_beside_a_face);
    tcase_add_test(cases, capsules_that_cross_at_a_small_angle);
    tcase_add_test(cases, capsules_that_cross_far_out);
    tcase_add_test(cases, strips_end_to_end);
    tcase_add_test(cases, a_beam_steeply_through_a_sheet);
    tcase_add_test(cases, a_bar_across_the_edge_of_a_sheet);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
