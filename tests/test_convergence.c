/* Convergence against what it was: tests/convergence_baseline.csv.
 *
 *     cold   the fewest iterations from which the error of a frozen problem, impulses from 0, stays below a bound: the
 *            natural map at v = A^-1 (b + J^T lambda), 1e-6 m/s in double, 1e-4 m/s in single precision
 *     warm   the error of a scene's steps of 10 iterations each, from the last one's impulses: the mean on a
 *            logarithmic scale of the natural map over the last half of 200 steps, m/s
 *
 *     test_convergence           compares
 *     test_convergence --write   writes the file anew: after a change that is meant to
 *
 * What may be worse before it fails. A machine's instruction set changes the order of sums, by rounding:
 *     cold   10 % and 1: counts are the same with AVX2 and without, and go up by 3 %
 *     warm   half as much again: f32 differs by 20 % with AVX2 and without
 *     heaps  a factor of 2: two that differ by rounding are different heaps, and differ by 1.4 */
#include <errno.h>

#include "../bench/problem_set.h"
#include "fixed_work.h"
#include "scene_tools.h"

static const char path[] = CONVERGENCE_BASELINE;

enum { COLD_MOST = 3000, WARM_STEPS = 200, WARM_ITERATIONS = 10, IN_A_ROW = 3 };

struct convergence_case {
    const char *name;
    bool cold, heap, fast_only;
};

static const struct convergence_case cases[] = {
    {"stack of 10", true, false, false},
    {"stack of 20", true, false, false},
    {"plates on cubes, tilted", true, false, false},
    {"cards", true, false, false},
    {"bar", true, false, false},
    {"chain 1:1000", true, false, true}, /* `paper` does not come there */
    {"pyramid 10", true, false, false},
    {"random pile 60", true, true, false},
    {"incline, above", true, false, false},
    {"vertical_stacks:6", false, false, false},
    {"oblique_stacks:1", false, false, false},
    {"card_houses:1", false, false, false},
    {"pyramid:20", false, false, false},
    {"sliding_cubes:50", false, false, false},
    {"arch:15", false, false, false},
    {"chain:10", false, false, false},
    {"pile:60", false, true, false},
    {"mixed_pile:60", false, true, false},
    {"ragdolls:2", false, true, false},
};
enum { CASES = sizeof cases / sizeof *cases, VARIANTS = 4 * CASES }; /* by method and precision */

static const char *method_name(int variant) { return variant % 4 / 2 ? "paper" : "fast"; }
static sadmm_method method_of(int variant) { return variant % 4 / 2 ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST; }
static sadmm_precision precision_of(int variant) { return variant % 2 ? SADMM_F32 : SADMM_F64; }

/* ---- cold -------------------------------------------------------------------------------------------------------- */

static double cold_error(const struct set_problem *set, int variant, int iterations)
{
    struct sadmm_error error = {SADMM_OK, ""};
    sadmm_settings s = fixed_settings();
    sadmm_certificate c;
    s.method = method_of(variant);
    s.iterations = iterations;
    s.dt = set->dt;
    s.penalty_period = set->penalty_period;
    s.warm_start = false;
    s.threads = 1;
    ck_assert_msg(sadmm_problem_solve(set->problem, SADMM_BACKEND_CPU, precision_of(variant), &s, NULL) == SADMM_OK,
                  "%s: %s", set->name, sadmm_problem_message(set->problem));
    ck_assert(problem_set_balance(set->problem, &error) == SADMM_OK);
    ck_assert(sadmm_problem_certify(set->problem, &c) == SADMM_OK);
    return c.ncp_max;
}

/* Counts of 5, and 3 % more each: where three in a row are below, the first of them. COLD_MOST: none. */
static double cold_count(const char *name, int variant)
{
    const double bound = precision_of(variant) == SADMM_F64 ? 1e-6 : 1e-4;
    struct set_problem set;
    struct sadmm_error error = {SADMM_OK, ""};
    size_t at = 0;
    int below = 0, first = COLD_MOST;
    while (strcmp(problem_set_name(at), name) != 0) ++at;
    ck_assert_msg(problem_set_make(at, &set, &error) == SADMM_OK, "%s", error.message);
    for (int k = 5; k < COLD_MOST && below < IN_A_ROW; k += 1 + k / 33) {
        const bool is_below = cold_error(&set, variant, k) <= bound;
        if (is_below && below == 0) first = k;
        below = is_below ? below + 1 : 0;
    }
    problem_set_free(&set);
    return below == IN_A_ROW ? first : COLD_MOST;
}

/* ---- warm -------------------------------------------------------------------------------------------------------- */

/* Less is nothing that matters, and soon rounding, m/s. */
static double least_of(int variant) { return precision_of(variant) == SADMM_F64 ? 1e-10 : 1e-6; }

static double warm_error(const char *name, int variant)
{
    struct sadmm_scene scene = open_scene(name);
    double sum = 0;
    sadmm_scene_set_method(&scene, method_of(variant));
    sadmm_settings_fix_work(&scene.def.settings);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = precision_of(variant);
    scene.def.settings.iterations = WARM_ITERATIONS;
    scene.def.settings.substeps = 1;
    scene.def.settings.certify = true;
    scene.def.settings.threads = 1;
    sadmm_world *world = build_scene(&scene);
    for (int i = 0; i < WARM_STEPS; ++i) {
        struct sadmm_error error = {SADMM_OK, ""};
        ck_assert(sadmm_scene_before_step(&scene, world, i, &error) == SADMM_OK);
        MUST(world, sadmm_world_step(world));
        if (i >= WARM_STEPS / 2) sum += log(fmax(world_report(world).certificate.ncp_max, least_of(variant)));
    }
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);
    return exp(sum / (WARM_STEPS - WARM_STEPS / 2));
}

static bool is_left_out(int variant)
{
    return cases[variant / 4].fast_only && method_of(variant) == SADMM_METHOD_PAPER;
}

static double measure(int variant)
{
    const struct convergence_case *of = &cases[variant / 4];
    return of->cold ? cold_count(of->name, variant) : warm_error(of->name, variant);
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

static void line_start(int variant, char text[128])
{
    const struct convergence_case *of = &cases[variant / 4];
    snprintf(text, 128, "\"%s\",%s,%s,%s,", of->name, of->cold ? "cold" : "warm", method_name(variant),
             precision_of(variant) == SADMM_F64 ? "f64" : "f32");
}

/* NAN: the file has no such line. */
static double baseline(int variant)
{
    char start[128], line[256];
    double value = NAN;
    FILE *file = fopen(path, "r");
    ck_assert_msg(file, "%s: %s", path, strerror(errno));
    line_start(variant, start);
    while (fgets(line, sizeof line, file))
        if (!strncmp(line, start, strlen(start))) value = strtod(line + strlen(start), NULL);
    fclose(file);
    return value;
}

START_TEST(baseline_is_written)
{
    FILE *file = fopen(path, "w");
    ck_assert_msg(file, "%s: %s", path, strerror(errno));
    fputs("what,start,method,precision,value\n", file);
    for (int variant = 0; variant < VARIANTS; ++variant) {
        char start[128];
        if (is_left_out(variant)) continue;
        line_start(variant, start);
        fprintf(file, "%s%.4g\n", start, measure(variant));
    }
    ck_assert_int_eq(fclose(file), 0);
}
END_TEST

/* ---- tests ------------------------------------------------------------------------------------------------------- */

/* The most that a value may be. */
static double most(int variant, double before)
{
    const struct convergence_case *of = &cases[variant / 4];
    return of->heap ? 2 * before : of->cold ? 1 + 1.1 * before : 1.5 * before;
}

START_TEST(convergence_is_what_it_was)
{
    char start[128];
    if (is_left_out(_i)) return;
    const double before = baseline(_i), now = measure(_i);
    line_start(_i, start);
    ck_assert_msg(isfinite(before), "%s has no line %s: test_convergence --write", path, start);
    ck_assert_msg(now <= most(_i, before),
                  "%s%.4g: was %.4g, may be %.4g (after a change that is meant to: "
                  "test_convergence --write)",
                  start, now, before, most(_i, before));
    if (before > 1.5 * now) printf("%s%.4g: was %.4g; test_convergence --write keeps it so\n", start, now, before);
}
END_TEST

/* A line that is not there, and a value that is too large, are seen. */
START_TEST(worse_is_seen)
{
    ck_assert_double_lt(most(0, 100), 112);
    ck_assert_double_ge(baseline(0), 5);
    ck_assert(cold_count(cases[0].name, 0) > most(0, baseline(0) / 2));
}
END_TEST

int main(int argc, char **argv)
{
    const bool write = argc == 2 && !strcmp(argv[1], "--write");
    Suite *suite = suite_create("convergence");
    TCase *tests = tcase_create("convergence");
    tcase_set_timeout(tests, 60);
    if (write) tcase_add_test(tests, baseline_is_written);
    if (!write) tcase_add_loop_test(tests, convergence_is_what_it_was, 0, VARIANTS);
    if (!write) tcase_add_test(tests, worse_is_seen);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
