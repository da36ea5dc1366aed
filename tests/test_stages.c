/* The schedule of a step (core/solve/stages.h): the list against what the settings say of it, for many settings. */
#include <stdint.h>

#include "core/math/weight.h"
#include "core/solve/stages.h"
#include "fixed_work.h"
#include "run_suite.h"

enum { MOST_STAGES = 4096 };

struct list {
    struct sadmm_stage stages[MOST_STAGES];
    int count;
};

/* The whole list; `met_after`: the check after so many iterations is met (0: none). */
static void take_list(struct list *list, const struct sadmm_plan *plan, const sadmm_settings *settings, bool world,
                      int met_after)
{
    struct sadmm_stages stages = sadmm_stages_of(plan, settings, world);
    list->count = 0;
    while (sadmm_stages_next(&stages, &list->stages[list->count])) {
        const struct sadmm_stage *stage = &list->stages[list->count++];
        ck_assert_int_lt(list->count, MOST_STAGES);
        if (stage->kind == SADMM_STAGE_CHECK && stage->done == met_after) stages.stopped = true;
    }
}

static int count_of(const struct list *list, enum sadmm_stage_kind kind)
{
    int count = 0;
    for (int i = 0; i < list->count; ++i) count += list->stages[i].kind == kind;
    return count;
}

/* Does `kind` stand behind exactly `done` iterations, before any other? */
static bool stands_after(const struct list *list, enum sadmm_stage_kind kind, int done)
{
    for (int i = 0; i < list->count; ++i)
        if (list->stages[i].kind == kind && list->stages[i].done == done) return true;
    return false;
}

static struct sadmm_plan contacts_plan(const sadmm_settings *settings, bool warm)
{
    struct sadmm_plan plan = {.bodies = 2, .pairs = 1, .points = 4, .contact_rows = 3, .rigid = true, .threads = 1};
    sadmm_plan_complete(&plan, settings, warm, !warm);
    return plan;
}

/* A step of three sub-steps: what finds, solves and moves comes three times, in the same order each time, with a turn
 * between two; the rest once, at the ends. A solve alone has none. */
START_TEST(substeps_repeat_what_a_step_does)
{
    static struct list one, three;
    sadmm_settings settings = fixed_settings();
    settings.certify = true;
    settings.iterations = 20; /* of a sub-step */
    const struct sadmm_plan plan = contacts_plan(&settings, false);
    take_list(&one, &plan, &settings, true, 0);
    ck_assert_int_eq(count_of(&one, SADMM_STAGE_TURN), 0);
    settings.substeps = 3;
    take_list(&three, &plan, &settings, true, 0);
    const int body = one.count - 3; /* without GATHER, CERTIFY, COMMIT */
    ck_assert_int_eq(three.count, 3 * body + 2 + 3);
    ck_assert_int_eq(three.stages[0].kind, SADMM_STAGE_GATHER);
    ck_assert_int_eq(three.stages[three.count - 2].kind, SADMM_STAGE_CERTIFY);
    ck_assert_int_eq(three.stages[three.count - 1].kind, SADMM_STAGE_COMMIT);
    for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < body; ++i) {
            const struct sadmm_stage *a = &one.stages[1 + i], *b = &three.stages[1 + k * (body + 1) + i];
            ck_assert_int_eq(a->kind, b->kind);
            ck_assert(a->count == b->count && a->done == b->done && a->last == b->last);
        }
        if (k < 2) ck_assert_int_eq(three.stages[(k + 1) * (body + 1)].kind, SADMM_STAGE_TURN);
    }
    take_list(&three, &plan, &settings, false, 0);
    ck_assert_int_eq(count_of(&three, SADMM_STAGE_TURN), 0);
    ck_assert_int_eq(count_of(&three, SADMM_STAGE_ENERGY_LIMIT), 1);
}
END_TEST

START_TEST(a_world_without_constraints)
{
    static struct list list;
    sadmm_settings settings = fixed_settings();
    struct sadmm_plan plan = {.bodies = 1, .rigid = true, .threads = 1};
    settings.recover_wrenches = false;
    sadmm_plan_complete(&plan, &settings, false, false);
    take_list(&list, &plan, &settings, true, 0);
    /* Step 1 once is exact; nothing that belongs to constraints is there. */
    static const enum sadmm_stage_kind wanted[] = {SADMM_STAGE_GATHER, SADMM_STAGE_HITS, SADMM_STAGE_FIND,
        SADMM_STAGE_JOINT_ROWS, SADMM_STAGE_PLAN, SADMM_STAGE_BODIES, SADMM_STAGE_PENALTY, SADMM_STAGE_ITERATE,
        SADMM_STAGE_SOLUTION, SADMM_STAGE_INTEGRATE, SADMM_STAGE_KINEMATIC, SADMM_STAGE_KEEP, SADMM_STAGE_COMMIT};
    ck_assert_int_eq(list.count, (int)(sizeof wanted / sizeof *wanted));
    for (int i = 0; i < list.count; ++i) ck_assert_int_eq(list.stages[i].kind, wanted[i]);
    ck_assert_int_eq(list.stages[7].count, 1);
}
END_TEST

START_TEST(a_solve_has_nothing_of_a_world)
{
    static struct list list;
    sadmm_settings settings = fixed_settings();
    settings.certify = true;
    struct sadmm_plan plan = contacts_plan(&settings, false);
    take_list(&list, &plan, &settings, false, 0);
    ck_assert_int_eq(list.stages[0].kind, SADMM_STAGE_BODIES);
    ck_assert_int_eq(list.stages[list.count - 1].kind, SADMM_STAGE_SOLUTION);
}
END_TEST

static uint32_t random_next(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

static sadmm_settings random_settings(uint32_t *state)
{
    sadmm_settings s = fixed_settings();
    s.method = random_next(state) % 2 ? SADMM_METHOD_FAST : SADMM_METHOD_PAPER;
    s.iterations = 1 + (int)(random_next(state) % 200);
    s.check_period = 1 + (int)(random_next(state) % 40);
    s.penalty_period = (int)(random_next(state) % 40);
    s.penalty_update_warm = random_next(state) % 2;
    s.measure_residuals = random_next(state) % 2;
    s.residual_tolerance = random_next(state) % 3 == 0 ? 1e-6 : 0;
    s.tolerance = random_next(state) % 3 == 0 ? 1e-6 : 0;
    return s;
}

/* Is `done` one of the iterations after which weights are renewed? Each time twice as late, from 40 on half as late
 * again. */
static bool renews(int done)
{
    static const int all[] = {5, 10, 20, 40, 60, 90, 135, 202};
    bool any = false;
    for (size_t k = 0; k < sizeof all / sizeof *all; ++k) any = any || all[k] == done;
    return any;
}

/* Every iteration is done once; what is due after one of them stands behind it, and nothing else does. */
START_TEST(everything_stands_where_it_is_due)
{
    static struct list list;
    uint32_t state = 1;
    for (int trial = 0; trial < 200; ++trial) {
        const sadmm_settings s = random_settings(&state);
        const struct sadmm_plan plan = contacts_plan(&s, random_next(&state) % 2);
        const bool stops = s.residual_tolerance > 0 || s.tolerance > 0;
        int iterations = 0, balances = 0, checks = 0, renewals = 0;
        take_list(&list, &plan, &s, true, 0);
        for (int i = 0; i < list.count; ++i)
            if (list.stages[i].kind == SADMM_STAGE_ITERATE) {
                ck_assert_int_ge(list.stages[i].count, 1);
                iterations += list.stages[i].count;
                ck_assert_int_eq(list.stages[i].done, iterations);
                ck_assert_int_eq(list.stages[i].last, iterations == s.iterations);
            } else if (i > 0) {
                ck_assert_int_gt(list.stages[i].kind, list.stages[i - 1].kind); /* in the order of the kinds */
            }
        ck_assert_int_eq(iterations, s.iterations);
        for (int done = 1; done <= s.iterations; ++done) {
            const bool last = done == s.iterations;
            const bool check = stops && (last || done % s.check_period == 0);
            const bool balance = plan.penalty_updates && !last && done % s.penalty_period == 0;
            const bool renewal = plan.weight_updates && !last && renews(done);
            ck_assert_int_eq(stands_after(&list, SADMM_STAGE_CHECK, done), check);
            ck_assert_int_eq(stands_after(&list, SADMM_STAGE_BALANCE, done), balance);
            ck_assert_int_eq(stands_after(&list, SADMM_STAGE_WEIGHTS, done), renewal);
            checks += check;
            balances += balance;
            renewals += renewal;
            if (balance || (check && s.residual_tolerance > 0) || ((last || check) && s.measure_residuals))
                ck_assert(stands_after(&list, SADMM_STAGE_RESIDUALS, done));
        }
        ck_assert_int_eq(count_of(&list, SADMM_STAGE_CHECK), checks);
        ck_assert_int_eq(count_of(&list, SADMM_STAGE_BALANCE), balances);
        ck_assert_int_eq(count_of(&list, SADMM_STAGE_WEIGHTS), renewals);
        ck_assert_int_eq(count_of(&list, SADMM_STAGE_ENERGY_LIMIT), 1); /* in either method: momentum */
    }
}
END_TEST

/* A check that is met ends the iterations, and only them. */
START_TEST(a_met_check_ends_the_iterations)
{
    static struct list list;
    sadmm_settings s = fixed_settings();
    s.method = SADMM_METHOD_FAST;
    s.iterations = 100;
    s.check_period = 5; /* weights are due there as well */
    s.tolerance = 1e-6;
    struct sadmm_plan plan = contacts_plan(&s, false);
    take_list(&list, &plan, &s, true, WEIGHT_FIRST_UPDATE);
    ck_assert_int_eq(count_of(&list, SADMM_STAGE_ITERATE), 1);
    ck_assert_int_eq(count_of(&list, SADMM_STAGE_WEIGHTS), 0);
    ck_assert_int_eq(count_of(&list, SADMM_STAGE_ENERGY_LIMIT), 1);
    ck_assert_int_eq(count_of(&list, SADMM_STAGE_SOLUTION), 1);
    ck_assert_int_eq(count_of(&list, SADMM_STAGE_COMMIT), 1);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("stages");
    TCase *cases = tcase_create("stages");
    tcase_add_test(cases, substeps_repeat_what_a_step_does);
    tcase_add_test(cases, a_world_without_constraints);
    tcase_add_test(cases, a_solve_has_nothing_of_a_world);
    tcase_add_test(cases, everything_stands_where_it_is_due);
    tcase_add_test(cases, a_met_check_ends_the_iterations);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
