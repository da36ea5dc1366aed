/* What `subadmm-bench profile` is made of: processes that fail, the Delassus form, the dense solve, and the command. */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "../bench/child.h"
#include "../bench/delassus.h"
#include "../bench/dense_solve.h"
#include "public_problems.h"
#include "run_suite.h"

/* ---- processes --------------------------------------------------------------------------------------------------- */

static void answer(void *argument, int out) { child_write(out, argument, sizeof(int)); }

static void answer_in_part(void *argument, int out) { child_write(out, argument, 1); }

static void crash(void *argument, int out)
{
    (void)argument, (void)out;
    raise(SIGSEGV);
}

static void compute_for_ever(void *argument, int out)
{
    (void)out;
    for (volatile int *x = argument;;) *x = *x + 1;
}

static void wait_for_ever(void *argument, int out)
{
    (void)argument, (void)out;
    for (;;) pause();
}

/* A child that computes is ended by its processor time, one that waits after 8 times as much and a second. */
START_TEST(processes_end_apart)
{
    int given = 42, got = 0;
    ck_assert(child_run(answer, &given, 10, &got, sizeof got) == CHILD_DONE && got == 42);
    ck_assert(child_run(answer_in_part, &given, 10, &got, sizeof got) == CHILD_LOST);
    ck_assert(child_run(crash, &given, 10, &got, sizeof got) == CHILD_LOST);
    ck_assert(child_run(compute_for_ever, &given, 0.1, &got, sizeof got) == CHILD_LATE);
    ck_assert(child_run(wait_for_ever, &given, 0.01, &got, sizeof got) == CHILD_LATE);
    ck_assert_int_eq(given, 42);
    ck_assert_int_eq(waitpid(-1, NULL, WNOHANG), -1); /* none is left */
}
END_TEST

/* ---- the Delassus form ------------------------------------------------------------------------------------------- */

static double number(unsigned k) { return sin(1.7 * k + 0.3); }

/* H^T v + w at v = M^-1 (H r + f) is W r + q, for any r. Terms are of size 1, some tens are added up. */
START_TEST(delassus_form_is_the_problem)
{
    sadmm_problem *problem = public_problem_random((unsigned)_i, 9, 14, 5, 0, 0.5);
    struct sadmm_global_problem g;
    struct delassus d;
    struct sadmm_error error = {SADMM_OK, ""};
    double r[3 * 19], u[3 * 19], v[6 * 9];
    int32_t row[2 * 19];
    ck_assert(sadmm_global_from_problem(problem, &g, &error) == SADMM_OK);
    ck_assert_msg(delassus_make(&g, &d, &error) == SADMM_OK, "%s", error.message);
    ck_assert(d.contacts == 19 && delassus_most_in_row(&d) <= 2 * 19);
    for (unsigned k = 0; k < 3 * 19; ++k) r[k] = number(k);
    delassus_velocities(&d, g.f, r, v);
    memcpy(u, g.w, sizeof u);
    for (size_t e = 0; e < g.H.count; ++e) u[g.H.column[e]] += g.H.value[e] * v[g.H.row[e]];
    for (int32_t k = 0; k < 19; ++k) {
        double here[3] = {d.offset[3 * k], d.offset[3 * k + 1], d.offset[3 * k + 2]};
        const int32_t count = delassus_row(&d, k, row);
        for (int32_t n = 0; n < count; ++n) {
            double block[9], other[9];
            ck_assert(n == 0 || row[n] > row[n - 1]);
            delassus_block(&d, k, row[n], block);
            delassus_block(&d, row[n], k, other);
            for (int i = 0; i < 9; ++i) {
                here[i / 3] += block[i] * r[3 * row[n] + i % 3];
                ck_assert_double_eq_tol(block[i], other[3 * (i % 3) + i / 3], 1e-13);
            }
        }
        for (int i = 0; i < 3; ++i) ck_assert_double_eq_tol(here[i], u[3 * k + i], 1e-12);
    }
    delassus_free(&d);
    sadmm_global_problem_free(&g);
    sadmm_problem_destroy(problem);
}
END_TEST

/* Bilateral rows have no place in it. */
START_TEST(delassus_form_is_of_contacts)
{
    sadmm_problem *problem = public_problem_random(3, 6, 4, 0, 2, 0.5);
    struct sadmm_global_problem g;
    struct delassus d;
    struct sadmm_error error = {SADMM_OK, ""};
    ck_assert(sadmm_global_from_problem(problem, &g, &error) == SADMM_OK);
    ck_assert(delassus_make(&g, &d, &error) == SADMM_ERROR_UNSUPPORTED);
    ck_assert(strstr(error.message, "bilateral rows: must have none"));
    ck_assert(!dense_solve_takes(problem));
    sadmm_global_problem_free(&g);
    sadmm_problem_destroy(problem);
}
END_TEST

/* ---- the dense solve --------------------------------------------------------------------------------------------- */

/* Stacks of 28 contacts each are islands of their own, and solved to rounding by the certificate, which is another
 * program than the solve; masses 1 : 100. 33 boxes are 132 contacts: more than it takes. */
START_TEST(dense_solve_solves)
{
    sadmm_problem *problem = public_problem_stack(7, 0.5, 0.2, 100), *large = public_problem_stack(33, 0.5, 0, 1);
    struct sadmm_global_problem g;
    struct sadmm_error error = {SADMM_OK, ""};
    double r[3 * 28], v[6 * 7], impulses[3 * 28] = {0}, map;
    sadmm_certificate c;
    ck_assert(dense_solve_takes(problem) && !dense_solve_takes(large));
    ck_assert(sadmm_global_from_problem(problem, &g, &error) == SADMM_OK);
    ck_assert(dense_solve(&g, 1e-12, r, v, &map, &error) == SADMM_OK);
    ck_assert_double_le(map, 1e-12);
    for (int32_t k = 0; k < 28; ++k) { /* from the contact's frame: normal z; tangents by H's rows of the upper box */
        sadmm_problem_contact contact;
        ck_assert(sadmm_problem_get_contact(problem, k, &contact) == SADMM_OK);
        for (size_t e = 0; e < g.H.count; ++e)
            if (g.H.column[e] / 3 == k && g.H.row[e] / 6 == contact.body_b && g.H.row[e] % 6 < 3)
                impulses[3 * k + g.H.row[e] % 6] += g.H.value[e] * r[3 * k + g.H.column[e] % 3];
    }
    ck_assert(sadmm_problem_set_solution(problem, v, impulses, NULL) == SADMM_OK);
    ck_assert(sadmm_problem_certify(problem, &c) == SADMM_OK);
    ck_assert_msg(c.ncp_max < 1e-11 && c.momentum_max < 1e-11, "natural map %g, momentum %g", c.ncp_max,
                  c.momentum_max);
    sadmm_global_problem_free(&g);
    sadmm_problem_destroy(problem);
    sadmm_problem_destroy(large);
}
END_TEST

/* ---- the command ------------------------------------------------------------------------------------------------- */

static int sh(const char *text)
{
    const int status = system(text);
    ck_assert(WIFEXITED(status));
    return WEXITSTATUS(status);
}

/* The set's files are the same each time; both methods and the dense solve come to every bound on three small problems;
 * a folder without problems, and a file that is none, are failures that are said. */
START_TEST(command_profiles_a_folder)
{
    static const char script[] =
        "set -e; d=$(mktemp -d); trap 'rm -rf $d' EXIT; cd $d; mkdir a b none\n"
        "$B profile --quick --dump a > list; $B profile --quick --dump b > /dev/null; test $(ls a | wc -l) = 6\n"
        "for f in a/*; do cmp $f b/${f#a/}; done; grep -q 'stack_of_20 *20 bodies *80 contacts' list\n"
        "$B profile --folder a --problem stack --solver fast --solver dense --seconds 5 --csv rows.csv > table\n"
        "awk -F, '$4 == \"fast\" || $4 == \"dense\" { n += $9 } END { exit n != 3 * 2 * 6 }' rows.csv\n"
        "grep -q '^| fast | 100: ' table; grep -q '^| dense | 100: ' table\n"
        "! $B profile --folder none 2> said; grep -q 'no .hdf5 file' said\n"
        "echo x > none/x.hdf5; ! $B profile --folder none > /dev/null 2> said; grep -q x.hdf5 said\n";
    ck_assert_int_eq(setenv("B", SUBADMM_BENCH, 1), 0);
    ck_assert_int_eq(sh(script), 0);
}
END_TEST

/* A solve that takes too long has not solved, and is said so for every bound. */
START_TEST(command_says_what_is_late)
{
    ck_assert_int_eq(setenv("B", SUBADMM_BENCH, 1), 0);
    ck_assert_int_eq(
        sh("set -e; d=$(mktemp -d); trap 'rm -rf $d' EXIT; cd $d\n"
           "$B profile --quick --problem stack_of_20 --solver paper --seconds 1e-7 --csv rows > /dev/null\n"
           "test $(grep -c ',,,0,time limit$' rows) = 12\n"),
        0);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("profile");
    TCase *tests = tcase_create("profile");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, processes_end_apart);
    tcase_add_loop_test(tests, delassus_form_is_the_problem, 0, 4);
    tcase_add_test(tests, delassus_form_is_of_contacts);
    tcase_add_test(tests, dense_solve_solves);
    tcase_add_test(tests, command_profiles_a_folder);
    tcase_add_test(tests, command_says_what_is_late);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
