/* Initialised impulses (core/solve/impulse_initialisation.h): a solution where bodies rest on what is nearer to the
 * ground, and nothing anywhere else. */
#include "contact_problems.h"
#include "core/model/system_math.h"
#include "core/solve/certificate.h"
#include "core/solve/impulse_initialisation.h"
#include "core/solve/plan.h"
#include "fixed_work.h"
#include "run_suite.h"

#include <check.h>

static const double g_dt = 9.81 * 0.005; /* of the default settings, m/s */

static sadmm_certificate initialise(struct contact_problem *problem, const sadmm_settings *settings)
{
    struct sadmm_error error = {SADMM_OK, ""};
    sadmm_certificate certificate;
    ck_assert_int_eq(sadmm_impulses_initialise(&problem->system, settings, &error), SADMM_OK);
    ck_assert_int_eq(sadmm_certify(&problem->system, settings, &certificate, &error), SADMM_OK);
    return certificate;
}

static double largest_impulse(const struct contact_problem *problem)
{
    double largest = 0;
    for (size_t k = 0; k < problem->contacts.point_count; ++k)
        largest = fmax(largest, v3_norm(v3_load(problem->contacts.points[k].impulse)));
    return largest;
}

/* Every body keeps 1e-7 of its motion (impulse_initialisation.c, STIFF), and what carries it is a solution to that. */
START_TEST(piles_at_rest_are_solved)
{
    static const double masses[] = {100, 1, 0.01, 3};
    struct contact_problem *problems[] = {contact_problem_stack(masses, 4, 0.5), contact_problem_pyramid(12, 0.5),
                                          contact_problem_stack(masses, 4, 0), contact_problem_plates(1, 0.5)};
    sadmm_settings s = fixed_settings();
    for (size_t k = 0; k < sizeof problems / sizeof *problems; ++k) {
        sadmm_certificate c = initialise(problems[k], &s);
        ck_assert_msg(c.ncp_max <= 1e-5 * g_dt, "%zu: natural map %g", k, c.ncp_max);
        ck_assert_msg(c.momentum_max <= 1e-6, "%zu: momentum %g", k, c.momentum_max);
        ck_assert_double_gt(largest_impulse(problems[k]), 0);
        contact_problem_free(problems[k]);
    }
}
END_TEST

/* The ground carries all. */
START_TEST(loads_add_up)
{
    struct contact_problem *problem = contact_problem_pyramid(10, 0.5);
    sadmm_settings s = fixed_settings();
    double sum = 0;
    initialise(problem, &s);
    for (size_t p = 0; p < problem->contacts.pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &problem->contacts.pairs[p];
        for (int k = 0; k < pair->count && pair->body_a < 0; ++k)
            sum += problem->contacts.points[pair->first + k].impulse[2];
    }
    ck_assert_double_eq_tol(sum, 55 * g_dt, 1e-5 * 55 * g_dt); /* softness of the supports, 10 rows of it */
    contact_problem_free(problem);
}
END_TEST

/* Nothing is known of what slides, flies up, is pushed out, or has no ground; nor does an island without initial
 * impulses spoil another. */
START_TEST(others_start_from_nothing)
{
    static const double one[] = {1, 1};
    sadmm_settings s = fixed_settings();
    struct contact_problem *problems[5];
    for (int k = 0; k < 5; ++k) problems[k] = contact_problem_stack(one, 2, k == 0 ? 0.1 : 0.5);
    s.gravity[0] = 5;
    problems[1]->rigid[0].velocity[0] = 3;
    problems[2]->rigid[0].velocity[2] = 3;
    problems[3]->contacts.points[1].separation = -1e-3;
    problems[4]->contacts.pairs[0].body_a = 1; /* the lower one no longer on the ground */
    for (int k = 0; k < 5; ++k) {
        if (k == 1) s.gravity[0] = 0;
        initialise(problems[k], &s);
        ck_assert_msg(largest_impulse(problems[k]) == 0, "%d: largest impulse %g", k, largest_impulse(problems[k]));
        for (int i = 0; i < 2; ++i) {
            double A[36], b[6];
            sadmm_system_body(&problems[k]->system, &s, i, A, b);
            /* of 1 kg: v = b, but for a Cholesky factor's rounding */
            for (int j = 0; j < 3; ++j) ck_assert_double_eq_tol(problems[k]->system.velocity[6 * i + j], b[j], 1e-15);
        }
        contact_problem_free(problems[k]);
    }
    struct contact_problem *two = contact_problem_stack(one, 2, 0.5);
    int32_t thrown = contact_problem_box(two, 1, 0.1, 0.1, 0.1, 5, 0, 0.1);
    two->rigid[thrown].velocity[0] = 3;
    contact_problem_touch(two, -1, thrown, (double[]){5, 0, 0}, (double[]){0, 0, 1}, 0, 0.5, 0);
    initialise(two, &s);
    ck_assert_double_gt(two->contacts.points[0].impulse[2], 0);
    ck_assert_double_eq(two->contacts.points[two->contacts.point_count - 1].impulse[2], 0);
    contact_problem_free(two);
}
END_TEST

/* A cube of which one edge is a little off the ground, or in it: by less than a thousandth of what it falls in a step
 * it rests there all the same, by a hundredth it does not. */
START_TEST(small_errors_are_left_to_the_iteration)
{
    static const double one[] = {1}, shares[] = {5e-4, 1e-2};
    sadmm_settings s = fixed_settings();
    for (int k = 0; k < 4; ++k) {
        struct contact_problem *problem = contact_problem_stack(one, 1, 0.5);
        const double off = shares[k % 2] * g_dt * s.dt, separation = k < 2 ? off : -s.slop - off / s.correction_factor;
        problem->contacts.points[1].separation = problem->contacts.points[3].separation = separation;
        initialise(problem, &s);
        ck_assert_msg((largest_impulse(problem) > 0) == (k % 2 == 0), "separation %g m: largest impulse %g", separation,
                      largest_impulse(problem));
        contact_problem_free(problem);
    }
}
END_TEST

/* Where impulses are initialised, and that backends start from them even where nothing else is kept. */
START_TEST(plans_that_initialise)
{
    static const double one[] = {1, 1};
    struct contact_problem *p = contact_problem_stack(one, 2, 0.5);
    for (int warm = 0; warm < 2; ++warm) {
        sadmm_settings s = fixed_settings();
        s.warm_start = warm;
        s.method = SADMM_METHOD_FAST;
        p->system.first = true;
        struct sadmm_plan plan = sadmm_plan_make(&p->system, &s);
        ck_assert(plan.initialise && plan.warm_start && !plan.warm && plan.weight_updates);
        p->system.first = false;
        plan = sadmm_plan_make(&p->system, &s);
        ck_assert(!plan.initialise && plan.warm_start == s.warm_start);
        p->system.first = true;
        s.method = SADMM_METHOD_PAPER;
        plan = sadmm_plan_make(&p->system, &s);
        ck_assert(!plan.initialise && plan.warm_start == s.warm_start);
    }
    contact_problem_free(p);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("loads");
    TCase *cases = tcase_create("loads");
    tcase_add_test(cases, piles_at_rest_are_solved);
    tcase_add_test(cases, loads_add_up);
    tcase_add_test(cases, others_start_from_nothing);
    tcase_add_test(cases, small_errors_are_left_to_the_iteration);
    tcase_add_test(cases, plans_that_initialise);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
