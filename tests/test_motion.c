/* `subadmm-bench motion` as its users see it: rows for a heap and for scenes with a known answer, whose errors are
 * checked against that answer. */
#include <check.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>

#include "run_suite.h"

static const char command[] = SUBADMM_BENCH; /* the build gives its path */
static const double g = 9.81;

enum { MAX_TEXT = 1 << 18 };

static int run(const char *arguments, char *out)
{
    char text[1024];
    snprintf(text, sizeof text, "%s motion %s 2>&1 </dev/null", command, arguments);
    FILE *pipe = popen(text, "r");
    ck_assert_ptr_nonnull(pipe);
    out[fread(out, 1, MAX_TEXT - 1, pipe)] = 0;
    const int status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

static json_t *run_json(const char *arguments)
{
    static char out[MAX_TEXT];
    char text[900];
    json_error_t error;
    snprintf(text, sizeof text, "%s --json -", arguments);
    const int code = run(text, out);
    ck_assert_msg(code == 0, "exit code %d\n%s", code, out);
    json_t *document = json_loads(out, 0, &error);
    ck_assert_msg(document != NULL, "%s\n%s", error.text, out);
    return document;
}

static double real_of(const json_t *object, const char *name)
{
    const json_t *value = json_object_get(object, name);
    ck_assert_msg(json_is_number(value) && isfinite(json_number_value(value)), "%s: no number", name);
    return json_number_value(value);
}

static const char *text_of(const json_t *object, const char *name)
{
    const char *text = json_string_value(json_object_get(object, name));
    ck_assert_msg(text && *text, "%s: no text", name);
    return text;
}

static const json_t *row_of(const json_t *document, double dt, int iterations)
{
    size_t k;
    json_t *row;
    json_array_foreach(json_object_get(document, "rows"), k, row)
        if (fabs(real_of(row, "dt") - dt) < 1e-9 && real_of(row, "iterations") == iterations) return row;
    ck_abort_msg("no row of dt = %g with %d iterations", dt, iterations);
}

/* What holds for every scene. */
static void check_head(const json_t *document, const char *scene, const char *kind, size_t rows)
{
    size_t k;
    json_t *row;
    ck_assert_str_eq(text_of(document, "bench"), "motion");
    ck_assert_str_eq(text_of(document, "scene"), scene);
    ck_assert_str_eq(text_of(document, "kind"), kind);
    ck_assert(*text_of(document, "commit") && *text_of(document, "compiler") && *text_of(document, "runs_on"));
    ck_assert(real_of(document, "threads") == 1);
    ck_assert(json_is_false(json_object_get(document, "interrupted")));
    ck_assert_uint_eq(json_array_size(json_object_get(document, "rows")), rows);
    int best = 0, front = 0;
    json_array_foreach(json_object_get(document, "rows"), k, row) {
        ck_assert_str_eq(text_of(row, "scene"), scene);
        ck_assert_str_eq(text_of(row, "backend"), "cpu");
        ck_assert_str_eq(text_of(row, "status"), "ok");
        ck_assert(real_of(row, "threads") == 1);
        ck_assert(real_of(row, "ms_per_simulated_second") > 0);
        const double quantiles[] = {0, real_of(row, "overlap_median"), real_of(row, "overlap_p99"),
                                    real_of(row, "overlap_p999"), real_of(row, "overlap_max"), 1};
        for (int q = 1; q < 6; ++q) ck_assert(quantiles[q - 1] <= quantiles[q]);
        const double share = real_of(row, "overlap_deep_share");
        ck_assert(share >= 0 && share <= 1);
        ck_assert_double_eq_tol(share * real_of(row, "overlap_pairs"), real_of(row, "overlap_deep_pairs"), 1e-9);
        ck_assert(real_of(row, "error") <= real_of(row, "error_max"));
        ck_assert_uint_eq(json_array_size(json_object_get(row, "course")), 12);
        best += json_is_true(json_object_get(row, "best"));
        front += json_is_true(json_object_get(row, "front"));
    }
    ck_assert(best == 1 && front >= 1);
}

/* A sphere rolls at a = 5/7 g sin, which is constant: steps of any length move it exactly. */
START_TEST(rolling_has_no_error)
{
    json_t *document = run_json("--scene rolling --precision f64 --seconds 1 --halvings 2 --iterations 50 --match 0 "
                                "--reference-iterations 100 --repeats 1");
    const double a = 5.0 / 7 * g * sin(atan(0.4));
    check_head(document, "rolling", "trajectory", 3);
    for (int h = 0; h <= 2; ++h) {
        const double dt = 0.005 / (1 << h);
        const json_t *row = row_of(document, dt, 50);
        ck_assert(real_of(row, "substeps") == 1);
        /* 1e-8: of 1.3 m what 50 iterations leave of each step's change of speed; semi-implicit Euler's error with dt
         * is a t dt / 2, 6.5 mm. */
        ck_assert_double_lt(real_of(row, "error"), 1e-8);
        ck_assert_double_lt(real_of(row, "error_step"), 1e-8);
        ck_assert(real_of(row, "error_max") == real_of(row, "error")); /* one body */
        ck_assert_double_lt(real_of(row, "error_solver"), 1e-6);
        /* Height and kinetic energy at the end: it has gone down by s sin, and the rest is 7/10 m v^2. */
        const json_t *last = json_array_get(json_object_get(row, "course"), 11);
        ck_assert_double_eq_tol(real_of(last, "time"), 1, 1e-9);
        /* 1e-4: in J the sphere's weight times the slop of 1e-5 m, in m ten times the slop. */
        ck_assert_double_eq_tol(real_of(last, "kinetic"), 0.7 * a * a, 1e-4);
        const double height = 0.1 * cos(atan(0.4)) - 0.5 * a * sin(atan(0.4));
        ck_assert_double_eq_tol(real_of(last, "height"), height, 1e-4);
        ck_assert(real_of(last, "spread") == 0);
    }
    ck_assert_double_lt(real_of(json_object_get(document, "reference"), "floor"), 1e-8);
    json_decref(document);
}
END_TEST

/* Light cubes that are kicked land in a step, which takes place at its start: what friction loses in the whole of it,
 * mu g dt, is missing in the way, and after that they go on exactly until they stop. */
static double missing_way(double dt) { return 0.5 * g * dt * dt / 2; }

START_TEST(kicked_cubes_have_the_error_of_their_landing)
{
    json_t *document = run_json("--scene kicked_cubes:3 --precision f64 --seconds 0.8 --halvings 1 --iterations 100 "
                                "--match 0 --repeats 1");
    check_head(document, "kicked_cubes:3", "trajectory", 2);
    for (int h = 0; h <= 1; ++h) {
        const double dt = 0.005 / (1 << h), error = missing_way(dt) - missing_way(0.005 / 64);
        /* 1e-6: 100 iterations a step. Half of the bodies stay where they are: they do not count. */
        ck_assert_double_eq_tol(real_of(row_of(document, dt, 100), "error"), error, 1e-6);
    }
    json_decref(document);
}
END_TEST

/* A small heap: what must hold of any. Rows of 10, 20 (matched) and 40 iterations, and of 10 and 40 with half the step,
 * where 10 is also what matches. */
START_TEST(heap)
{
    json_t *document = run_json("--scene pile:20 --precision f64 --seconds 1 --halvings 1 --iterations 10,40 "
                                "--match 20 --seeds 2 --starts 3 --reference 4 --reference-iterations 100");
    check_head(document, "pile:20", "heap", 5);
    const double floor = real_of(json_object_get(document, "reference"), "floor");
    size_t k;
    json_t *row;
    json_array_foreach(json_object_get(document, "rows"), k, row) {
        ck_assert(real_of(row, "runs") == 2);
        ck_assert(real_of(row, "error") > floor);
        ck_assert(real_of(row, "overlap_pairs") > 1 && real_of(row, "overlap_max") > 0);
        /* At a twelfth of the run all boxes fall, but for the lowest, which have landed; at the end they lie. */
        const json_t *first = json_array_get(json_object_get(row, "course"), 0);
        const json_t *last = json_array_get(json_object_get(row, "course"), 11);
        const double fallen = real_of(first, "kinetic") / (0.5 * 20 * pow(g * real_of(first, "time"), 2));
        ck_assert(fallen > 0.8 && fallen < 1 + 1e-6);
        ck_assert(real_of(last, "kinetic") < real_of(first, "kinetic"));
        ck_assert(real_of(last, "height") < real_of(first, "height") && real_of(last, "height") > 0.03);
        ck_assert(real_of(last, "spread") > 0.05 && real_of(last, "spread") < 1);
    }
    ck_assert_double_lt(real_of(row_of(document, 0.0025, 40), "error_step"),
                        real_of(row_of(document, 0.005, 40), "error_step"));
    ck_assert_double_lt(real_of(row_of(document, 0.005, 40), "error_solver"),
                        real_of(row_of(document, 0.005, 10), "error_solver"));
    json_decref(document);
}
END_TEST

START_TEST(table)
{
    static char out[MAX_TEXT];
    ck_assert_int_eq(run("--scene falling_chain:3 --halvings 1 --iterations 20 --match 20 --repeats 1", out), 0);
    ck_assert_msg(strstr(out, "falling_chain:3, 0.5 s in frames of 5 ms, fast") && strstr(out, "**|"), "%s", out);
}
END_TEST

static const struct {
    const char *arguments, *says;
} refused[] = {
    {"--scene nowhere", "must be one of"},
    {"--halvings 11", "--halvings 11: must be in [0, 10]"},
    {"--reference 0", "--reference 0: must be in [1, 10]"},
    {"--scene bounce --reference 10", "--reference 10: must be fewer: dt >= 1e-6 s"},
    {"--halvings 6", "--halvings 6: must be fewer than --reference"},
    {"--iterations 0", "--iterations 0: must be"},
    {"--backend all", "--backend all: must be ref, cpu or cuda"},
    {"--horizon 0", "--horizon 0: must be in (0, 3600]"},
    {"--seeds 0", "--seeds 0: must be in [1, 1000]"},
};

START_TEST(bad_options_are_refused)
{
    static char out[MAX_TEXT];
    const int code = run(refused[_i].arguments, out);
    ck_assert_msg(code == 2 && strstr(out, refused[_i].says), "%s: exit code %d\n%s", refused[_i].arguments, code, out);
}
END_TEST

/* Sub-steps of a fourth have the error of steps of a fourth: the same trajectory. */
START_TEST(substeps_have_the_error_of_short_steps)
{
    json_t *document = run_json("--scene rolling --precision f64 --seconds 1 --halvings 2 --substeps 1,4 "
                                "--iterations 40,160 --match 0 --reference-iterations 100 --repeats 1");
    const json_t *found[2] = {NULL, NULL};
    size_t k;
    json_t *row;
    check_head(document, "rolling", "trajectory", 12);
    json_array_foreach(json_object_get(document, "rows"), k, row) {
        const bool whole = fabs(real_of(row, "dt") - 0.005) < 1e-9;
        if (real_of(row, "substeps") == 4 && whole && real_of(row, "iterations") == 160) found[0] = row;
        if (real_of(row, "substeps") == 1 && fabs(real_of(row, "dt") - 0.00125) < 1e-9 &&
            real_of(row, "iterations") == 40)
            found[1] = row;
    }
    ck_assert(found[0] && found[1]);
    for (const char *const *name = (const char *const[]){"error", "error_step", "error_solver", NULL}; *name; ++name)
        ck_assert_msg(real_of(found[0], *name) == real_of(found[1], *name), "%s: %g and %g", *name,
                      real_of(found[0], *name), real_of(found[1], *name));
    json_decref(document);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("motion");
    TCase *cases = tcase_create("motion");
    tcase_set_timeout(cases, 60);
    tcase_add_test(cases, rolling_has_no_error);
    tcase_add_test(cases, kicked_cubes_have_the_error_of_their_landing);
    tcase_add_test(cases, substeps_have_the_error_of_short_steps);
    tcase_add_test(cases, heap);
    tcase_add_test(cases, table);
    tcase_add_loop_test(cases, bad_options_are_refused, 0, sizeof refused / sizeof *refused);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
