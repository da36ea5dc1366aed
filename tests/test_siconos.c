/* siconos, an independent solver of the same problem, as an oracle: its error measure against ours, its solutions
 * against ours. Only where libsiconos_numerics is installed. */
#include <check.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <Friction_cst.h>
#include <GlobalFrictionContactProblem.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <NumericsSparseMatrix.h>
#include <SolverOptions.h>
#include <gfc3d_compute_error.h>

#include "fclib/global_problem.h"
#include "fixed_work.h"
#include "public_problems.h"

/* ---- the same problem for siconos -------------------------------------------------------------------------------- */

static NumericsMatrix *make_matrix(const struct sadmm_triplets *m)
{
    NumericsMatrix *out = NM_create(NM_SPARSE, m->rows, m->columns);
    NM_triplet_alloc(out, (CS_INT)m->count);
    for (size_t e = 0; e < m->count; ++e) NM_entry(out, m->row[e], m->column[e], m->value[e]);
    return out;
}

static double *copy(const double *x, size_t count)
{
    double *out = malloc((count ? count : 1) * sizeof *out); /* siconos frees it */
    ck_assert_ptr_nonnull(out);
    memcpy(out, x, count * sizeof *out);
    return out;
}

static double norm(const double *x, size_t count)
{
    double sum = 0;
    for (size_t k = 0; k < count; ++k) sum += x[k] * x[k];
    return sqrt(sum);
}

static GlobalFrictionContactProblem *make_siconos(sadmm_problem *problem)
{
    struct sadmm_global_problem g;
    struct sadmm_error error = {0};
    ck_assert_msg(sadmm_global_from_problem(problem, &g, &error) == SADMM_OK, "%s", error.message);
    ck_assert_int_eq(g.hard_rows, 0);
    GlobalFrictionContactProblem *s = globalFrictionContactProblem_new();
    s->dimension = 3;
    s->numberOfContacts = g.contacts;
    s->M = make_matrix(&g.M);
    s->H = make_matrix(&g.H);
    s->q = copy(g.f, 6 * (size_t)g.bodies);
    s->b = copy(g.w, 3 * (size_t)g.contacts);
    s->mu = copy(g.mu, (size_t)g.contacts);
    s->norm_q = norm(s->q, 6 * (size_t)g.bodies);
    s->norm_b = norm(s->b, 3 * (size_t)g.contacts);
    sadmm_global_problem_free(&g);
    return s;
}

/* siconos' measure of a solution; it recomputes u from v. */
static double siconos_error(GlobalFrictionContactProblem *s, const struct sadmm_global_solution *x)
{
    SolverOptions *options = solver_options_create(SICONOS_GLOBAL_FRICTION_3D_NSGS_WR);
    double *r = copy(x->r, 3 * (size_t)x->contacts), *u = copy(x->u, 3 * (size_t)x->contacts);
    double *v = copy(x->v, 6 * (size_t)x->bodies), error = -1;
    gfc3d_compute_error(s, r, u, v, 1e-12, options, s->norm_q, s->norm_b, &error);
    free(r);
    free(u);
    free(v);
    solver_options_delete(options);
    return error;
}

static sadmm_certificate certify(sadmm_problem *problem)
{
    sadmm_certificate c;
    ck_assert_int_eq(sadmm_problem_certify(problem, &c), SADMM_OK);
    return c;
}

static struct sadmm_global_solution solution_of(sadmm_problem *problem)
{
    struct sadmm_global_solution x;
    struct sadmm_error error = {0};
    ck_assert_msg(sadmm_global_solution_from_problem(problem, &x, &error) == SADMM_OK, "%s", error.message);
    return x;
}

static void solve(sadmm_problem *problem, sadmm_backend backend, sadmm_method method, int iterations, bool warm)
{
    sadmm_settings s = fixed_settings();
    s.dt = 1;
    s.method = method;
    s.penalty_mass_factor = 0;
    s.penalty_offset = 1;
    s.iterations = iterations;
    s.warm_start = warm;
    ck_assert_msg(sadmm_problem_solve(problem, backend, SADMM_F64, &s, NULL) == SADMM_OK, "%s",
                  sadmm_problem_message(problem));
}

static const struct {
    const char *name;
    int kind; /* 0: stack, 1: random */
    int count;
    double friction, lean, other;
} problems[] = {
    {"five boxes at rest", 0, 5, 0.5, 0, 1},
    {"five boxes, leaning, sticking", 0, 5, 0.8, 0.2, 1},
    {"four boxes, leaning, sliding", 0, 4, 0.1, 0.3, 1},
    {"masses 1 and 10", 0, 4, 0.6, 0.1, 10},
    {"without friction", 0, 3, 0, 0.2, 1},
    {"random, mu 0.3", 1, 8, 0.3, 0, 0},
    {"random, mu 0.9", 1, 12, 0.9, 0, 0},
};
enum { PROBLEM_COUNT = sizeof problems / sizeof *problems };

static sadmm_problem *make(int k)
{
    if (problems[k].kind == 0)
        return public_problem_stack(problems[k].count, problems[k].friction, problems[k].lean, problems[k].other);
    return public_problem_random((unsigned)k, problems[k].count, problems[k].count, problems[k].count / 2, 0,
                                 problems[k].friction);
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

/* The measure at points far from and near the solution. Both compute the same double formula from the same data, in
 * another order of sums over at most some hundred terms: 1e-11 relative plus rounding at the solution's scale of 1. */
START_TEST(same_measure)
{
    sadmm_problem *problem = make(_i);
    GlobalFrictionContactProblem *s = make_siconos(problem);
    const int iterations[] = {1, 3, 30, 300};
    for (size_t k = 0; k < sizeof iterations / sizeof *iterations; ++k) {
        solve(problem, SADMM_BACKEND_REF, SADMM_METHOD_PAPER, iterations[k], false);
        struct sadmm_global_solution x = solution_of(problem);
        double theirs = siconos_error(s, &x), ours = certify(problem).siconos;
        ck_assert_msg(fabs(ours - theirs) <= 1e-11 * theirs + 1e-15, "%s, %d iterations: %.17g, siconos %.17g",
                      problems[_i].name, iterations[k], ours, theirs);
        sadmm_global_solution_free(&x);
    }
    globalFrictionContact_free(s);
    sadmm_problem_destroy(problem);
}
END_TEST

/* Ours is siconos' solution where it is unique: v (and with it u). Its solver here is a nonsmooth Newton method,
 * another kind than ours. Both stop at a measure of 1e-12; v follows within that times the conditioning of these small
 * problems: 1e-9 of the largest velocity. Impulses are not unique (four contacts under a box) and are not compared. */
START_TEST(same_solution)
{
    const sadmm_method method = (sadmm_method)(_i / PROBLEM_COUNT);
    const int at = _i % PROBLEM_COUNT;
    sadmm_problem *problem = make(at);
    GlobalFrictionContactProblem *s = make_siconos(problem);
    size_t contacts = 3 * (size_t)s->numberOfContacts, rows = 6 * (size_t)sadmm_problem_body_count(problem);
    SolverOptions *options = solver_options_create(SICONOS_GLOBAL_FRICTION_3D_NSN_AC_WR);
    options->iparam[SICONOS_IPARAM_MAX_ITER] = 2000;
    options->dparam[SICONOS_DPARAM_TOL] = 1e-12;
    double *r = calloc(contacts, sizeof *r), *u = calloc(contacts, sizeof *u), *v = calloc(rows, sizeof *v);
    ck_assert_int_eq(gfc3d_driver(s, r, u, v, options), 0);

    for (int batch = 0; batch < 200 && (batch == 0 || certify(problem).siconos > 1e-12); ++batch)
        solve(problem, SADMM_BACKEND_CPU, method, 100, batch > 0);
    struct sadmm_global_solution x = solution_of(problem);
    ck_assert_msg(certify(problem).siconos <= 1e-12, "%s: ours ends at %g", problems[at].name,
                  certify(problem).siconos);
    ck_assert_double_le(siconos_error(s, &x), 1.0001e-12);

    double scale = 1e-12, difference = 0, sliding = 0;
    for (size_t k = 0; k < rows; ++k) {
        scale = fmax(scale, fabs(v[k]));
        difference = fmax(difference, fabs(v[k] - x.v[k]));
    }
    for (size_t k = 0; k < contacts; ++k) {
        scale = fmax(scale, fabs(u[k]));
        sliding = fmax(sliding, fabs(u[k] - x.u[k]));
    }
    /* At rest the velocities are zero and the step's dt g = 0.05 m/s is the scale. */
    scale = fmax(scale, 0.05);
    ck_assert_msg(difference <= 1e-9 * scale && sliding <= 1e-9 * scale, "%s: v differs by %g, u by %g, scale %g",
                  problems[at].name, difference, sliding, scale);

    sadmm_global_solution_free(&x);
    free(r);
    free(u);
    free(v);
    solver_options_delete(options);
    globalFrictionContact_free(s);
    sadmm_problem_destroy(problem);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("siconos");
    TCase *tests = tcase_create("oracle");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, same_measure, 0, PROBLEM_COUNT);
    tcase_add_loop_test(tests, same_solution, 0, SADMM_METHOD_COUNT * PROBLEM_COUNT);
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_ENV);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
