/* How subadmm-bench stress judges (bench/stress/stress.h): what passes, what is a limit, what fails; the sums that
 * cases measure with; and that the limits of its table are of measures that the cases make. */
#include <check.h>
#include <string.h>

#include "../bench/stress/stress.h"
#include "run_suite.h"

static sadmm_world_def def_of(sadmm_precision precision)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = precision;
    def.settings.threads = 1;
    return def;
}

/* ---- verdicts -------------------------------------------------------------------------------------------------- */

static double measured; /* what the case below measures */

static void measure(struct stress *s)
{
    stress_check(s, "a", 0.5, 1);
    if (measured != 0) stress_check(s, "b", measured, 1);
    stress_check(s, "b", 0.1, 1); /* the largest counts */
}

static const struct stress_case judged = {
    .name = "judged",
    .run = measure,
    .limits = {{"b", 10, 20, 2, STRESS_F32, 5, "why"}},
};

static enum stress_verdict judge(double value, int variant, sadmm_precision precision, double what)
{
    const sadmm_world_def def = def_of(precision);
    const struct stress_check *decisive;
    const struct stress_limit *limit;
    struct stress s;
    measured = what;
    stress_run(&s, &judged, value, variant, true, &def);
    const enum stress_verdict verdict = stress_judge(&s, &decisive, &limit);
    ck_assert_int_eq(limit != NULL, verdict == STRESS_LIMIT);
    if (verdict != STRESS_PASS) ck_assert_str_eq(decisive->what, "b");
    return verdict;
}

START_TEST(what_is_within_its_bound_passes)
{
    ck_assert_int_eq(judge(15, 1, SADMM_F32, 1), STRESS_PASS);
    ck_assert_int_eq(judge(1, 0, SADMM_F64, 0.9), STRESS_PASS);
}
END_TEST

START_TEST(a_limit_is_of_its_values_variants_and_precisions_and_has_a_bound)
{
    ck_assert_int_eq(judge(10, 1, SADMM_F32, 4), STRESS_LIMIT);
    ck_assert_int_eq(judge(20, 1, SADMM_F32, 5), STRESS_LIMIT);
    ck_assert_int_eq(judge(21, 1, SADMM_F32, 4), STRESS_FAIL);
    ck_assert_int_eq(judge(9, 1, SADMM_F32, 4), STRESS_FAIL);
    ck_assert_int_eq(judge(15, 0, SADMM_F32, 4), STRESS_FAIL);
    ck_assert_int_eq(judge(15, 1, SADMM_F64, 4), STRESS_FAIL);
    ck_assert_int_eq(judge(15, 1, SADMM_F32, 5.1), STRESS_FAIL);
    ck_assert_int_eq(judge(15, 1, SADMM_F32, NAN), STRESS_FAIL);
}
END_TEST

static void measure_nothing(struct stress *s) { (void)s; }
static void break_off(struct stress *s)
{
    stress_check(s, "a", 0, 1);
    stress_fail(s, "%s", "broken");
    stress_check(s, "b", 0, 1); /* not any more */
}

START_TEST(nothing_measured_and_what_breaks_off_fail)
{
    const struct stress_case cases[] = {{.run = measure_nothing}, {.run = break_off}};
    const sadmm_world_def def = def_of(SADMM_F64);
    for (int k = 0; k < 2; ++k) {
        const struct stress_check *decisive;
        const struct stress_limit *limit;
        struct stress s;
        stress_run(&s, &cases[k], 0, 0, true, &def);
        ck_assert_int_eq(stress_judge(&s, &decisive, &limit), STRESS_FAIL);
        ck_assert_int_eq(s.check_count, k);
    }
}
END_TEST

/* ---- measures --------------------------------------------------------------------------------------------------- */

/* A box with moments 1, 2 and 3 that is turned by a right angle about z, so that its own x is the world's y, 3 m along
 * x and 2 m above the case's origin: E = m v^2 / 2 + I w^2 / 2, L = r x m v + I w. */
static void add_up(struct stress *s)
{
    struct stress_body box = {.shape = SADMM_SHAPE_BOX,
                              .size = {1, 1, 1},
                              .mass = 2,
                              .inertia = {1, 2, 3},
                              .position = {3, 0, 2},
                              .velocity = {0, 4, 0},
                              .spin = {5, 7, 0}};
    stress_turn(2, M_PI / 2, box.orientation);
    s->origin[0] = 1e3;
    stress_open(s, 10);
    stress_add(s, &box);
    const struct stress_sums sums = stress_sum(s);
    const double momentum[3] = {0, 8, 0}, turning[3] = {-2 * 8 + 2 * 5, 1 * 7, 3 * 8};
    ck_assert_double_eq_tol(sums.kinetic, 16 + (2 * 25 + 1 * 49) / 2.0, 1e-12);
    ck_assert_double_eq_tol(sums.potential, 40, 1e-12);
    ck_assert_double_lt(stress_distance(sums.momentum, momentum), 1e-12);
    ck_assert_double_lt(stress_distance(sums.turning, turning), 1e-12);
    stress_check(s, "a", 0, 0);
}

START_TEST(sums_are_those_of_the_bodies)
{
    const struct stress_case about = {.run = add_up};
    const sadmm_world_def def = def_of(SADMM_F64);
    struct stress s;
    stress_run(&s, &about, 0, 0, true, &def);
    ck_assert_msg(stress_ok(&s), "%s", s.message);
}
END_TEST

/* ---- the table -------------------------------------------------------------------------------------------------- */

START_TEST(limits_are_of_measures_that_cases_make)
{
    const sadmm_world_def def = def_of(SADMM_F64);
    const struct stress_case *about;
    for (size_t k = 0; (about = stress_case_at(k)) != NULL; ++k) {
        ck_assert_int_ge(about->value_count, 1);
        for (int i = 0; i < STRESS_LIMITS && about->limits[i].check; ++i) {
            const struct stress_limit *limit = &about->limits[i];
            struct stress s;
            int value = 0, variant = 0, found = 0;
            while (value < about->value_count &&
                   (about->values[value] < limit->from || about->values[value] > limit->to))
                ++value;
            ck_assert_msg(value < about->value_count, "%s, limit %d: of no value", about->name, i);
            while (limit->variants && !(limit->variants >> variant & 1)) ++variant;
            ck_assert_int_le(variant, about->variant_count);
            stress_run(&s, about, about->values[value], variant, true, &def);
            for (int c = 0; c < s.check_count; ++c) found += !strcmp(s.checks[c].what, limit->check);
            ck_assert_msg(found == 1, "%s: \"%s\" is not measured", about->name, limit->check);
        }
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("stress");
    TCase *cases = tcase_create("stress");
    tcase_set_timeout(cases, 60);
    tcase_add_test(cases, what_is_within_its_bound_passes);
    tcase_add_test(cases, a_limit_is_of_its_values_variants_and_precisions_and_has_a_bound);
    tcase_add_test(cases, nothing_measured_and_what_breaks_off_fail);
    tcase_add_test(cases, sums_are_those_of_the_bodies);
    tcase_add_test(cases, limits_are_of_measures_that_cases_make);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
