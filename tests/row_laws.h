/* Laws of rows (core/math/row.h) against cases solved by hand, for any table. */
#ifndef SADMM_TESTS_ROW_LAWS_H
#define SADMM_TESTS_ROW_LAWS_H

#include <check.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "core/model/rows.h"
#include "core/solve/schedule.h"
#include "fixed_work.h"

static const sadmm_method law_methods[] = {SADMM_METHOD_PAPER, SADMM_METHOD_FAST};

/* A solve of a system as it is. */
static struct sadmm_solve_report solve_rows(const struct sadmm_kernels *table, struct sadmm_system *system,
                                       const sadmm_settings *settings)
{
    struct sadmm_context *c = NULL;
    struct sadmm_error error = {SADMM_OK, ""};
    struct sadmm_solve_report report;
    struct sadmm_plan plan = sadmm_plan_make(system, settings);
    ck_assert_int_eq(table->create(0, &c, &error), SADMM_OK);
    sadmm_status status = sadmm_schedule_solve(table, c, system, settings, &plan, NULL, &report, &error);
    ck_assert_msg(status == SADMM_OK, "%s", error.message);
    table->destroy(c);
    return report;
}

static sadmm_settings settings_of(sadmm_method method, int iterations)
{
    sadmm_settings s = fixed_settings();
    s.method = method;
    s.iterations = iterations;
    s.threads = 1;
    s.warm_start = false;
    return s;
}

/* ---- laws ------------------------------------------------------------------------------------------------------ */

struct law {
    double gain, bias, compliance, lo, hi;
};
#define HARD(e) {1, e, 0, -INFINITY, INFINITY}
#define SOFT(k, c, e) {c, (k) * (e), 1, -INFINITY, INFINITY}
#define LIMIT(e) {1, e, 0, 0, INFINITY}
#define MOTOR(speed, most) {1, -(speed), 0, -(most), most}
#define DRY(most) MOTOR(0, most)

enum { MASS = 2 };

/* A body of 2 kg that is pushed with b N s, alone with one row: 2 v = b + lambda. */
static const struct {
    struct law law;
    double b, lambda, v;
} law_cases[] = {
    {HARD(0.5), 1, -2, -0.5},              /* v = -e */
    {LIMIT(0.5), -3, 2, -0.5},             /* pushed against the limit: v = -e */
    {LIMIT(0.5), -0.5, 0, -0.25},          /* does not reach it */
    {LIMIT(0.5), 3, 0, 1.5},               /* moves away */
    {LIMIT(-0.5), 0, 1, 0.5},              /* beyond it: pushed out */
    {MOTOR(2, 5), 0, 4, 2},                /* strong enough */
    {MOTOR(2, 3), 0, 3, 1.5},              /* saturated */
    {MOTOR(-2, 3), 1, -3, -1},             /* the other way */
    {MOTOR(1, 3), 8, -3, 2.5},             /* holds back what is faster, as much as it can */
    {DRY(3), 2, -2, 0},                    /* holds */
    {DRY(3), 5, -3, 1},                    /* slips */
    {DRY(3), -5, 3, -1},                   /* slips back */
    {DRY(0), 5, 0, 2.5},                   /* none */
    {SOFT(0, 2, 0.3), 4, -2, 1},           /* a damper: 2 v = 4 - 2 v */
    {SOFT(4, 0, 0.5), 1, -2, -0.5},        /* a plain force, k e */
    {SOFT(4, 2, 0.5), 4, -3, 0.5},         /* both: 2 v = 4 - 2 - 2 v */
    {{2, 2, 1, 0, INFINITY}, 4, 0, 2},     /* a soft stop holds nothing back */
    {{2, 2, 1, 0, INFINITY}, -8, 3, -2.5}, /* and pushes: 2 v = -8 - 2 - 2 v */
    {{2, 2, 1, -1, 1}, 4, -1, 1.5},        /* a spring whose force is limited */
    {{1, 7, 0, 0.25, 0.25}, 1, 0.25, 0.625}, /* a force that is given */
};
enum { LAW_CASES = sizeof law_cases / sizeof *law_cases };

static void set_law(struct sadmm_rows *rows, int32_t r, const struct law *law)
{
    sadmm_row_set(rows, r, law->gain, law->bias, law->compliance, law->lo, law->hi);
}

/* Bodies with A = m I. */
static struct sadmm_system *bodies_of(const double *masses, const double *b, int32_t count)
{
    static struct sadmm_system system;
    static struct sadmm_contact_set none;
    static struct sadmm_rows rows;
    static double A[4 * 36], given[4 * 6], velocity[4 * 6];
    memset(A, 0, sizeof A);
    memset(velocity, 0, sizeof velocity);
    for (int32_t i = 0; i < count; ++i)
        for (int j = 0; j < 6; ++j) A[36 * i + 7 * j] = masses[i], given[6 * i + j] = b[6 * i + j];
    sadmm_rows_clear(&rows);
    system = (struct sadmm_system){.body_count = count, .A = A, .b = given, .velocity = velocity, .contacts = &none,
                                   .errors_given = true, .rows = &rows};
    return &system;
}

/* Slowest is a force at its bound in the method `paper`: v goes by m / (m + beta) = 0.94 an iteration. What is left is
 * rounding. */
static double close_enough(const struct sadmm_kernels *table) { return table->precision == SADMM_F32 ? 2e-5 : 1e-12; }

static void check_law(const struct sadmm_kernels *table, sadmm_method method, int k, bool on_b)
{
    const double mass = MASS, sign = on_b ? 1 : -1;
    double b[6] = {0};
    b[0] = sign * law_cases[k].b;
    struct sadmm_system *system = bodies_of(&mass, b, 1);
    int32_t r = sadmm_rows_add(system->rows, 1, on_b ? -1 : 0, on_b ? 0 : -1);
    (on_b ? system->rows->jacobian_b : system->rows->jacobian_a)[0] = sign; /* x = sign v */
    set_law(system->rows, r, &law_cases[k].law);
    const sadmm_settings settings = settings_of(method, 1000);
    solve_rows(table, system, &settings);
    const double lambda = system->rows->lambda[0], x = sign * system->velocity[0], tolerance = close_enough(table);
    ck_assert_msg(fabs(lambda - law_cases[k].lambda) <= tolerance, "case %d: lambda = %.17g", k, lambda);
    ck_assert_msg(fabs(x - law_cases[k].v) <= tolerance, "case %d: x = %.17g", k, x);
}

/* Six laws in one constraint of two bodies, a coordinate each, so that all depend on their own row alone: x = v_b - v_a
 * = x_free + w lambda with w = 1/m_a + 1/m_b, and lambda solves the law with that. Two of the rows are coupled in the
 * method `fast`. */
static void check_many_laws(const struct sadmm_kernels *table)
{
    static const struct law laws[2][6] = {
        {HARD(0.5), LIMIT(0.1), MOTOR(2, 0.5), DRY(0.125), SOFT(2, 3, 0.1), HARD(-0.25)},
        {LIMIT(5), SOFT(0, 4, 0), MOTOR(-1, 8), {3, 1, 1, -0.5, 0.5}, DRY(64), SOFT(50, 0, 0.05)},
    };
    static const double push[12] = {1, -2, 3, 0.5, 0.2, -0.3, 2, -4, -1, 0.1, 0.7, 0.9}, masses[2] = {1.5, 4};
    const double w = 1 / masses[0] + 1 / masses[1];
    for (int m = 0; m < 2; ++m)
        for (int set = 0; set < 2; ++set) {
            struct sadmm_system *system = bodies_of(masses, push, 2);
            struct sadmm_rows *rows = system->rows;
            const sadmm_settings settings = settings_of(law_methods[m], 1000);
            sadmm_rows_add(rows, 6, 0, 1);
            for (int r = 0; r < 6; ++r) {
                rows->jacobian_a[7 * r] = -1, rows->jacobian_b[7 * r] = 1;
                set_law(rows, r, &laws[set][r]);
            }
            solve_rows(table, system, &settings);
            for (int r = 0; r < 6; ++r) {
                const struct law *law = &laws[set][r];
                double x_free = push[6 + r] / masses[1] - push[r] / masses[0];
                double wanted = -(law->gain * x_free + law->bias) / (law->compliance + law->gain * w);
                wanted = fmin(fmax(wanted, law->lo), law->hi);
                ck_assert_msg(fabs(rows->lambda[r] - wanted) <= close_enough(table), "set %d, row %d: %.17g, not %.17g",
                              set, r, rows->lambda[r], wanted);
                ck_assert_double_eq_tol(system->velocity[6 + r], (push[6 + r] + wanted) / masses[1],
                                        close_enough(table));
            }
        }
}

#endif
