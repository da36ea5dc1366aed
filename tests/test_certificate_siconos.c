/* The certificate's siconos measure against siconos' own gfc3d_compute_error, on random problems and random (v, r). */
#include <check.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <GlobalFrictionContactProblem.h>
#include <NumericsMatrix.h>
#include <SolverOptions.h>
#include <gfc3d_compute_error.h>

#include "contact_problems.h"
#include "core/model/system_math.h"
#include "core/solve/certificate.h"
#include "fixed_work.h"
#include "run_suite.h"

/* Dense matrices are stored by columns; NM_zentry's arguments changed between versions. */
static void set_entry(NumericsMatrix *matrix, int row, int column, double value)
{
    matrix->matrix0[(size_t)row + (size_t)column * (size_t)matrix->size0] = value;
}

/* siconos: M v = q + H r, u = H^T v + b. H is (6 bodies x 3 contacts). */
static double siconos_error(const struct sadmm_system *system)
{
    int n = 6 * system->body_count, contacts = (int)(system->contacts->point_count + system->rows->constraint_count);
    GlobalFrictionContactProblem *problem = globalFrictionContactProblem_new();
    double *v = calloc((size_t)n, sizeof *v), *r = calloc(3 * (size_t)contacts, sizeof *r);
    double *u = calloc(3 * (size_t)contacts, sizeof *u), error;
    problem->dimension = 3;
    problem->numberOfContacts = contacts;
    problem->M = NM_create(NM_DENSE, n, n);
    problem->H = NM_create(NM_DENSE, n, 3 * contacts);
    problem->q = calloc((size_t)n, sizeof(double));
    problem->b = calloc(3 * (size_t)contacts, sizeof(double));
    problem->mu = calloc((size_t)contacts, sizeof(double));

    memcpy(problem->q, system->b, (size_t)n * sizeof(double));
    memcpy(v, system->velocity, (size_t)n * sizeof(double));
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < 6; ++j) set_entry(problem->M, i, i / 6 * 6 + j, system->A[6 * i + j]);
    for (size_t p = 0; p < system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &system->contacts->pairs[p];
        mat3 frame = sadmm_contact_frame(pair->normal);
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
            const struct sadmm_contact_point *point = &system->contacts->points[k];
            problem->mu[k] = pair->friction;
            problem->b[3 * k] = point->error;
            v3_store(m3_mul(frame, v3_load(point->impulse)), r + 3 * k);
            for (int row = 0; row < 3; ++row) {
                double J[6];
                for (int side = 0; side < 2; ++side) {
                    int32_t body = side ? pair->body_b : pair->body_a;
                    if (body < 0) continue;
                    sadmm_contact_row(frame.r[row], side ? point->arm_b : point->arm_a, side ? 1 : -1, J);
                    for (int j = 0; j < 6; ++j) set_entry(problem->H, 6 * body + j, 3 * k + row, J[j]);
                }
            }
        }
    }
    const struct sadmm_rows *rows = system->rows;
    for (size_t i = 0; i < rows->constraint_count; ++i) {
        const struct sadmm_row_constraint *constraint = &rows->constraints[i];
        int k = (int)(system->contacts->point_count + i);
        problem->mu[k] = constraint->friction;
        for (int row = 0; row < 3; ++row) {
            problem->b[3 * k + row] = rows->bias[constraint->first + row];
            r[3 * k + row] = rows->lambda[constraint->first + row];
            for (int side = 0; side < 2; ++side) {
                int32_t body = side ? constraint->body_b : constraint->body_a;
                const double *J = (side ? rows->jacobian_b : rows->jacobian_a) + 6 * constraint->first;
                for (int j = 0; body >= 0 && j < 6; ++j)
                    set_entry(problem->H, 6 * body + j, 3 * k + row, J[6 * row + j]);
            }
        }
    }

    SolverOptions options; /* only lends its work space */
    memset(&options, 0, sizeof options);
    options.dWorkSize = 2 * (size_t)n;
    options.dWork = calloc(options.dWorkSize, sizeof(double));
    double norm_q = 0, norm_b = 0;
    for (int i = 0; i < n; ++i) norm_q = hypot(norm_q, problem->q[i]);
    for (int i = 0; i < 3 * contacts; ++i) norm_b = hypot(norm_b, problem->b[i]);
    gfc3d_compute_error(problem, r, u, v, 1e-8, &options, norm_q, norm_b, &error);
    free(options.dWork);
    globalFrictionContact_free(problem);
    free(v);
    free(r);
    free(u);
    return error;
}

/* Speeds and impulses from rest to violent: the two halves of the measure are normalised by different terms. */
START_TEST(same_value)
{
    static const double speeds[] = {0, 1e-3, 1, 50}, impulses[] = {0, 1e-6, 0.1, 30};
    sadmm_settings s = fixed_settings();
    struct sadmm_error error;
    struct contact_problem *p = contact_problem_mixed(10 + (uint64_t)_i, _i % 3 == 0 ? 0 : 0.3 * (1 + _i % 3));
    p->block_count = 4; /* the contacts; siconos has no joints */
    contact_problem_raw(p, &s, 0.1);
    for (int k = 0; k < 16; ++k) {
        sadmm_certificate c;
        contact_problem_warm(p, speeds[k % 4], impulses[k / 4]);
        ck_assert(sadmm_certify(&p->system, NULL, &c, &error) == SADMM_OK);
        double expected = siconos_error(&p->system);
        ck_assert(expected > 0);
        /* Sums of a few hundred terms, in another order. */
        ck_assert_msg(fabs(c.siconos - expected) <= 1e-12 * expected, "%.17g, siconos says %.17g", c.siconos, expected);
    }
    contact_problem_free(p);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("certificate and siconos");
    TCase *cases = tcase_create("certificate and siconos");
    tcase_add_loop_test(cases, same_value, 0, 6);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
