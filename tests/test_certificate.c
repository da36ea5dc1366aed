/* The certificate against hand computation: 0 at exact solutions, known values beside them. */
#include <check.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "contact_problems.h"
#include "core/base/memory.h"
#include "core/model/system_math.h"
#include "core/solve/certificate.h"
#include "core/solve/solve_error.h"
#include "fixed_work.h"
#include "run_suite.h"
#include "subadmm/problem.h"

/* Expected values below are exact in real arithmetic with factors near 1: a few roundings. */
#define ROUNDING 1e-14

/* A ball of 2 kg and radius 0.5 m on the ground, one contact under its centre: normal z, arm (0, 0, -0.5). */
static const double mass = 2, radius = 0.5, inertia = 0.2, weight = 2 * 9.81 * 0.005; /* N s a step of 5 ms */
static double w_normal(void) { return 1 / mass; }
static double w_tangent(void) { return 1 / mass + radius * radius / inertia; } /* the larger */

static sadmm_problem *ball(double e, double friction)
{
    double A[36] = {0}, b[6] = {0, 0, -weight, 0, 0, 0};
    sadmm_problem *p;
    ck_assert(sadmm_problem_create(&p) == SADMM_OK);
    for (int i = 0; i < 6; ++i) A[7 * i] = i < 3 ? mass : inertia;
    ck_assert(sadmm_problem_set_bodies(p, 1, A, b, NULL) == SADMM_OK);
    sadmm_problem_contact contact = {
        .body_a = -1, .body_b = 0, .normal = {0, 0, 1}, .arm_b = {0, 0, -radius}, .error = e, .friction = friction};
    ck_assert(sadmm_problem_set_contacts(p, 1, &contact, NULL) == SADMM_OK);
    return p;
}

/* Certificate with linear velocity v and impulse r. */
static sadmm_certificate certify(sadmm_problem *p, double vx, double vz, double rx, double rz)
{
    sadmm_certificate c;
    const double v[6] = {vx, 0, vz, 0, 0, 0}, r[3] = {rx, 0, rz};
    ck_assert(sadmm_problem_set_solution(p, v, r, NULL) == SADMM_OK);
    ck_assert(sadmm_problem_certify(p, &c) == SADMM_OK);
    return c;
}

START_TEST(zero_at_exact_solutions)
{
    static const struct {
        const char *what;
        double e, mu, vx, vz, rx, rz; /* e and r in units of 1 and of the weight */
    } cases[] = {
        {"resting", 0, 0.5, 0, 0, 0, 1},
        {"sticking inside the cone", 0, 0.5, 0, 0, 0.3, 1},
        {"sliding", 0, 0.5, 0.7, 0, -0.5, 1},
        {"sliding without friction", 0, 0, 0.7, 0, 0, 1},
        {"apart", 0.2, 0.5, 1, 0, 0, 0},
        {"separating", 0, 0.5, 1, 0.3, 0, 0},
        {"closing the separation exactly", 0.2, 0.5, 0, -0.2, 0, 1},
        {"pushed out", -0.1, 0.5, 0, 0.1, 0, 1},
        {"grazing", 0, 0.5, 0.4, 0, 0, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        sadmm_problem *p = ball(cases[k].e, cases[k].mu);
        sadmm_certificate c = certify(p, cases[k].vx, cases[k].vz, weight * cases[k].rx, weight * cases[k].rz);
        ck_assert_msg(c.ncp_max <= ROUNDING && c.ncp_mean <= ROUNDING, "%s: %g", cases[k].what, c.ncp_max);
        sadmm_problem_destroy(p);
    }
    sadmm_problem *p = ball(0, 0.5); /* the whole: momentum too */
    sadmm_certificate c = certify(p, 0, 0, 0, weight);
    ck_assert(c.momentum_max <= ROUNDING && c.siconos <= ROUNDING && c.siconos >= 0);
    ck_assert(c.ncp_worst == 0 && c.momentum_worst == 0);
    sadmm_problem_destroy(p);
}
END_TEST

START_TEST(known_contact_errors)
{
    const double r = weight, w = w_tangent();
    const struct {
        const char *what;
        double e, mu, vx, vz, rx, rz, expected;
    } cases[] = {
        {"sinking", 0, 0.5, 0, -1e-3, 0, r, 1e-3},
        {"sinking into a penetration", -0.05, 0.5, 0, -1e-3, 0, r, 0.051},
        {"creeping, friction has room", 0, 0.5, 1e-3, 0, 0, r, 1e-3},
        {"sliding fast, no friction force", 0, 0.5, 10, 0, 0, r, 0.5 * r * w},
        {"held apart by a little force", 0, 0.5, 0, 1, 0, 1e-3 * r, 1e-3 * r * w},
        {"held apart slowly", 0, 0.5, 0, 1e-4, 0, r, 1e-4},
        {"pulling", 0, 0.5, 0, 0, 0, -r, r * w},
        {"outside the cone", 0, 0.5, 0, 0, 0.8 * r, r, 0.3 * r * w},
        {"dragged along", 0, 0.5, 10, 0, 0.5 * r, r, 1.0 * r * w},
        /* Without friction there is one row and w is its own entry. */
        {"frictionless, held apart", 0, 0, 0, 1, 0, 1e-3 * r, 1e-3 * r * w_normal()},
        {"frictionless, with friction", 0, 0, 0, 0, 0.1 * r, r, 0.1 * r * w_normal()},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        sadmm_problem *p = ball(cases[k].e, cases[k].mu);
        sadmm_certificate c = certify(p, cases[k].vx, cases[k].vz, cases[k].rx, cases[k].rz);
        ck_assert_msg(fabs(c.ncp_max - cases[k].expected) <= ROUNDING && c.ncp_mean == c.ncp_max,
                      "%s: %.17g, not %.17g", cases[k].what, c.ncp_max, cases[k].expected);
        sadmm_problem_destroy(p);
    }
}
END_TEST

START_TEST(momentum_error)
{
    sadmm_problem *p = ball(0, 0.5);
    sadmm_certificate c = certify(p, 0, 0, 0, 0.75 * weight); /* a quarter of the weight is not carried */
    ck_assert_double_eq_tol(c.momentum_max, 0.25, ROUNDING);
    c = certify(p, 0, -weight / mass, 0, 0); /* free fall: exact momentum */
    ck_assert_double_eq_tol(c.momentum_max, 0, ROUNDING);
    c = certify(p, 0, 0, 0.1 * weight, weight); /* angular: r x f = 0.5 * 0.1 weight, below the linear 0.1 */
    ck_assert_double_eq_tol(c.momentum_max, 0.1, ROUNDING);
    sadmm_problem_destroy(p);

    /* The worst of several bodies, over the largest term of any of them. */
    double A[108] = {0}, b[18] = {0}, v[18] = {0};
    for (int i = 0; i < 18; ++i) A[36 * (i / 6) + 7 * (i % 6)] = 1;
    b[0] = v[0] = 8;
    v[8] = 0.5, b[8] = 0.25;  /* body 1: off by 1/4 */
    v[15] = -2, b[15] = -1;   /* body 2, angular: off by 1 */
    ck_assert(sadmm_problem_create(&p) == SADMM_OK);
    ck_assert(sadmm_problem_set_bodies(p, 3, A, b, v) == SADMM_OK);
    ck_assert(sadmm_problem_certify(p, &c) == SADMM_OK);
    ck_assert_double_eq_tol(c.momentum_max, 1.0 / 8, ROUNDING);
    ck_assert_int_eq(c.momentum_worst, 2);
    ck_assert(c.ncp_max == 0 && c.ncp_mean == 0 && c.ncp_worst == -1);
    sadmm_problem_destroy(p);
}
END_TEST

/* siconos: |A v - b - H r| / max(|b|, |A v|, |H r|) + |r - P_K(r - u^)| / max(|u|, |r|), u^ = u + mu |u_t| n,
 * K the friction cone. */
START_TEST(siconos_measure)
{
    const double r = weight, mu = 0.5;
    sadmm_problem *p = ball(0, mu);
    double s = 1e-3;
    /* Sinking at s: r - u^ = (r + s, 0) stays in the cone: the map is s. Momentum: m s. */
    ck_assert_double_eq_tol(certify(p, 0, -s, 0, r).siconos, mass * s / r + s / r, ROUNDING);
    /* Creeping at s without a friction force: r - u^ = (r - mu s, -s) in the cone: |(mu s, s)|. */
    ck_assert_double_eq_tol(certify(p, s, 0, 0, r).siconos, mass * s / r + s * sqrt(1 + mu * mu) / r, ROUNDING);
    /* Outside: force (r, 2 r): projected to n = (2 mu + 1) r / (1 + mu^2) = 1.6 r, t = 0.8 r. Moved by (0.6, -1.2) r.
     * H r is (2 r, 0, r) and the torque -radius * 2 r: momentum |(2, 1)| r over |(2, 1, 1)| r. */
    double norm_r = sqrt(5) * r, norm_Hr = sqrt(6) * r;
    ck_assert_double_eq_tol(certify(p, 0, 0, 2 * r, r).siconos,
                            sqrt(4 + 1) * r / norm_Hr + sqrt(0.36 + 1.44) * r / norm_r, ROUNDING);
    /* In the polar cone: r = 0 and u = (s, 0), so r - u^ = (-s, 0) goes to 0 = r. Momentum: b + m s. */
    ck_assert_double_eq_tol(certify(p, 0, s, 0, 0).siconos, (r + mass * s) / r, ROUNDING);
    sadmm_problem_destroy(p);
}
END_TEST

static sadmm_problem *two_unit_bodies(sadmm_problem_block *block)
{
    double A[72] = {0}, b[12] = {0};
    sadmm_problem *p;
    for (int i = 0; i < 12; ++i) A[36 * (i / 6) + 7 * (i % 6)] = i < 6 ? 1 : 4; /* kg, kg m^2 */
    ck_assert(sadmm_problem_create(&p) == SADMM_OK);
    ck_assert(sadmm_problem_set_bodies(p, 2, A, b, NULL) == SADMM_OK);
    memset(block, 0, sizeof *block);
    block->body_a = 0;
    block->body_b = 1;
    return p;
}

START_TEST(hard_and_soft_rows)
{
    sadmm_problem_block block;
    sadmm_certificate c;
    sadmm_problem *p = two_unit_bodies(&block);
    /* x of row r is v_b[r] - v_a[r]; a row's own J A^-1 J^T is 1 + 1/4. Rows 2 and up are free. */
    block.kind = SADMM_BLOCK_HARD;
    block.rows = 6;
    for (int r = 0; r < 2; ++r) block.jacobian_a[7 * r] = -1, block.jacobian_b[7 * r] = 1;
    block.error[0] = 0.1, block.error[1] = -0.3, block.error[4] = 7;
    const double v[12] = {0.2, 0.1, 5, 5, 5, 5, 0.3, 0.2, 1, 1, 1, 1}, lambda[6] = {3, -4, 0, 0, 0, 0};
    ck_assert(sadmm_problem_set_blocks(p, 1, &block, NULL) == SADMM_OK);
    ck_assert(sadmm_problem_set_solution(p, v, NULL, lambda) == SADMM_OK);
    ck_assert(sadmm_problem_certify(p, &c) == SADMM_OK);
    ck_assert_double_eq_tol(c.ncp_max, 0.2, ROUNDING); /* x + e = (0.2, -0.2) */
    /* K is a whole line a row: the map is u itself; |r| = 5 is the larger norm. b = 0. */
    double Av2 = 0.05 + 4 * 25 + 16 * (0.13 + 4), Hr = sqrt(50);
    double momentum2 = pow(0.2 + 3, 2) + pow(0.1 - 4, 2) + 100 + pow(1.2 - 3, 2) + pow(0.8 + 4, 2) + 16 * 4;
    ck_assert_double_eq_tol(c.siconos, sqrt(momentum2) / fmax(sqrt(Av2), Hr) + sqrt(0.08) / 5, ROUNDING);

    /* lambda + k e + c x over 1 + c w, times w = 5/4; a stiff row tends to |x + (k e + lambda) / c|. */
    block.kind = SADMM_BLOCK_SOFT;
    block.rows = 2;
    block.stiffness[0] = 10, block.damping[0] = 2;
    block.stiffness[1] = 1e9, block.damping[1] = 1e9;
    const double soft_lambda[6] = {-1.5, 2e8, 0, 0, 0, 0};
    ck_assert(sadmm_problem_set_blocks(p, 1, &block, NULL) == SADMM_OK);
    ck_assert(sadmm_problem_set_solution(p, v, NULL, soft_lambda) == SADMM_OK);
    ck_assert(sadmm_problem_certify(p, &c) == SADMM_OK);
    /* Row 0: -1.5 + 10 * 0.1 + 2 * 0.1 = -0.3. Row 1: 2e8 - 3e8 + 1e8 = 0 exactly solved. */
    ck_assert_double_eq_tol(c.ncp_max, 0.3 * 1.25 / (1 + 2 * 1.25), 1e-9 * 1.25 /* row 1 rounds 1e-16 * 3e8 / 1e9 */);
    ck_assert(c.siconos == -1);
    /* Row 0 exact; row 1 off by 1e7 N s of 1e9 kg: 1 cm/s. */
    const double stiff_lambda[6] = {-1.2, 2e8 + 1e7, 0, 0, 0, 0};
    ck_assert(sadmm_problem_set_solution(p, v, NULL, stiff_lambda) == SADMM_OK);
    ck_assert(sadmm_problem_certify(p, &c) == SADMM_OK);
    ck_assert_double_eq_tol(c.ncp_max, 0.01, 1e-10 /* 1/(1 + c w) = 1/(c w) to 1e-9 */);
    sadmm_problem_destroy(p);
}
END_TEST

/* Contacts first, then blocks; the mean is over both. */
START_TEST(worst_constraint)
{
    sadmm_problem_block blocks[2];
    sadmm_certificate c;
    sadmm_problem *p = two_unit_bodies(&blocks[0]);
    blocks[0].kind = SADMM_BLOCK_HARD;
    blocks[0].rows = 1;
    blocks[0].jacobian_a[0] = 1;
    blocks[1] = blocks[0];
    sadmm_problem_contact contacts[2];
    memset(contacts, 0, sizeof contacts);
    for (int k = 0; k < 2; ++k) contacts[k].body_a = -1, contacts[k].body_b = k, contacts[k].normal[2] = 1;
    ck_assert(sadmm_problem_set_contacts(p, 2, contacts, NULL) == SADMM_OK);
    for (int worst = 0; worst < 4; ++worst) {
        for (int k = 0; k < 2; ++k) {
            contacts[k].error = worst == k ? -4 : -1;
            blocks[k].error[0] = worst == k + 2 ? 4 : 1;
        }
        ck_assert(sadmm_problem_set_contacts(p, 2, contacts, NULL) == SADMM_OK);
        ck_assert(sadmm_problem_set_blocks(p, 2, blocks, NULL) == SADMM_OK);
        ck_assert(sadmm_problem_certify(p, &c) == SADMM_OK);
        ck_assert_int_eq(c.ncp_worst, worst);
        ck_assert_double_eq_tol(c.ncp_max, 4, ROUNDING);
        ck_assert_double_eq_tol(c.ncp_mean, 7.0 / 4, ROUNDING);
    }
    sadmm_problem_destroy(p);
}
END_TEST

/* The same data in its different clothes: rigid bodies and separations, A and b and e, contacts as Jacobian rows. */
START_TEST(one_value_for_every_form)
{
    sadmm_settings s = fixed_settings();
    struct sadmm_error error;
    sadmm_certificate rigid, raw, rows;
    struct contact_problem *p = contact_problem_mixed((uint64_t)_i, 0.4);
    p->block_count = 0; /* so that contacts can become the only blocks */
    contact_problem_warm(p, 1, 0.5);
    ck_assert(sadmm_certify(&p->system, &s, &rigid, &error) == SADMM_OK);
    contact_problem_raw(p, &s, 0);
    ck_assert(sadmm_certify(&p->system, NULL, &raw, &error) == SADMM_OK);
    ck_assert(rigid.ncp_max == raw.ncp_max && rigid.momentum_max == raw.momentum_max && rigid.siconos == raw.siconos);

    for (size_t k = 0; k < p->contacts.pair_count; ++k) {
        const struct sadmm_contact_pair *pair = &p->contacts.pairs[k];
        mat3 frame = sadmm_contact_frame(pair->normal);
        for (int32_t i = pair->first; i < pair->first + pair->count; ++i) {
            const struct sadmm_contact_point *point = &p->contacts.points[i];
            sadmm_problem_block *block = contact_problem_block(p, SADMM_BLOCK_CONTACT, 3, pair->body_a, pair->body_b);
            vec3 lambda = m3_mul(frame, v3_load(point->impulse));
            for (int r = 0; r < 3; ++r) {
                sadmm_contact_row(frame.r[r], point->arm_a, -1, block->jacobian_a + 6 * r);
                sadmm_contact_row(frame.r[r], point->arm_b, 1, block->jacobian_b + 6 * r);
            }
            block->error[0] = point->error;
            block->friction = pair->friction;
            v3_store(lambda, p->block_lambda + 6 * (p->block_count - 1));
        }
    }
    p->contacts.pair_count = p->contacts.point_count = 0;
    contact_problem_rows(p);
    ck_assert(sadmm_certify(&p->system, NULL, &rows, &error) == SADMM_OK);
    /* Sums in another order; numbers up to 1e3. */
    ck_assert_double_eq_tol(rows.ncp_max, raw.ncp_max, 1e-12 * raw.ncp_max);
    ck_assert_double_eq_tol(rows.ncp_mean, raw.ncp_mean, 1e-12 * raw.ncp_max);
    ck_assert_double_eq_tol(rows.momentum_max, raw.momentum_max, 1e-12);
    ck_assert_double_eq_tol(rows.siconos, raw.siconos, 1e-12);
    ck_assert(rows.ncp_worst == raw.ncp_worst && rows.momentum_worst == raw.momentum_worst);
    contact_problem_free(p);
}
END_TEST

/* A solution that is not finite must never look good: it has no certificate. */
START_TEST(not_a_number_shows)
{
    static const double masses[] = {1, 1, 1};
    sadmm_settings s = fixed_settings();
    struct sadmm_error error;
    sadmm_certificate c = sadmm_certificate_none();
    struct contact_problem *p = contact_problem_stack(masses, 3, 0.5);
    for (int body = 0; body < 3; ++body) {
        p->system.velocity[6 * body + 2] = NAN;
        ck_assert_int_eq(sadmm_certify(&p->system, &s, &c, &error), SADMM_ERROR_NON_FINITE);
        p->system.velocity[6 * body + 2] = 0;
    }
    p->contacts.points[5].impulse[0] = NAN;
    ck_assert_int_eq(sadmm_certify(&p->system, &s, &c, &error), SADMM_ERROR_NON_FINITE);
    ck_assert(c.ncp_max == -1);
    contact_problem_free(p);
}
END_TEST

START_TEST(workspace_is_kept_and_failures_change_nothing)
{
    sadmm_settings s = fixed_settings();
    struct sadmm_error error;
    struct sadmm_certificate_workspace workspace = {0};
    sadmm_certificate c = sadmm_certificate_none(), first;
    struct contact_problem *p = contact_problem_pyramid(4, 0.5);
    ck_assert(c.ncp_max == -1 && c.ncp_worst == -1 && c.momentum_max == -1 && c.siconos == -1);
    sadmm_test_fail_allocations_after(0);
    ck_assert_int_eq(sadmm_certify_with(&workspace, &p->system, &s, &c, &error), SADMM_ERROR_OUT_OF_MEMORY);
    sadmm_test_fail_allocations_after(-1);
    ck_assert(c.ncp_max == -1);
    ck_assert(sadmm_certify_with(&workspace, &p->system, &s, &first, &error) == SADMM_OK);
    sadmm_test_fail_allocations_after(0); /* the workspace is large enough: nothing to allocate */
    ck_assert(sadmm_certify_with(&workspace, &p->system, &s, &c, &error) == SADMM_OK);
    sadmm_test_fail_allocations_after(-1);
    ck_assert(c.ncp_max == first.ncp_max && c.siconos == first.siconos);

    contact_problem_raw(p, &s, 0);
    p->A[36 * 2 + 7] = -1;
    ck_assert_int_eq(sadmm_certify_with(&workspace, &p->system, &s, &c, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_msg(strstr(error.message, "body 2"), "%s", error.message);
    ck_assert(c.ncp_max == first.ncp_max);
    sadmm_certificate_workspace_free(&workspace);
    contact_problem_free(p);
}
END_TEST

static int64_t unsolved(struct contact_problem *p, const sadmm_settings *s)
{
    struct sadmm_solve_errors errors = {0};
    struct sadmm_error error = {SADMM_OK, ""};
    ck_assert_int_eq(sadmm_solve_errors_find(&errors, &p->system, s, SADMM_F64, &error), SADMM_OK);
    const int64_t count = sadmm_solve_errors_sum(&errors, s->tolerance).unsolved;
    sadmm_solve_errors_free(&errors);
    return count;
}

/* Three boxes side by side on exact impulses, a fourth on top of the last: three islands. Then one impulse is wrong, by
 * so much of a box's weight: what the box owes is as much of g dt; then a velocity. */
START_TEST(islands_that_miss_the_tolerance)
{
    struct contact_problem *p = contact_problem_new();
    sadmm_settings s = fixed_settings();
    const double weight = 9.81 * s.dt, off = 0.01;
    s.tolerance = 1e-9;
    for (int i = 0; i < 4; ++i) {
        double x = i < 3 ? i : 2, z = i < 3 ? 0 : 0.2;
        contact_problem_box(p, 1, 0.1, 0.1, 0.1, x, 0, z + 0.1);
        contact_problem_touch(p, i < 3 ? -1 : 2, i, (double[]){x, 0, z}, (double[]){0, 0, 1}, 0, 0.5, 0);
        p->contacts.points[i].impulse[2] = (i == 2 ? 2 : 1) * weight;
    }
    ck_assert_int_eq(unsolved(p, &s), 0);
    p->contacts.points[3].impulse[2] += off * weight; /* both boxes of one island */
    for (int above = 0; above < 2; ++above) {
        s.tolerance = (above ? 0.999 : 1.001) * off * weight;
        ck_assert_int_eq(unsolved(p, &s), above);
    }
    s.tolerance = 1e-9;
    ck_assert_int_eq(unsolved(p, &s), 1);
    p->system.velocity[2] = -1e-6;
    ck_assert_int_eq(unsolved(p, &s), 2);
    contact_problem_free(p);
}
END_TEST

/* The same natural map as the certificate's, and where a number is not one, the tolerance is missed. */
START_TEST(errors_of_islands_are_the_certificates)
{
    struct sadmm_solve_errors errors = {0};
    struct sadmm_error error = {SADMM_OK, ""};
    struct contact_problem *p = contact_problem_new();
    sadmm_settings s = fixed_settings();
    sadmm_certificate c;
    for (int i = 0; i < 3; ++i) {
        contact_problem_box(p, 1 + i, 0.1, 0.15, 0.2, 0, 0, 0.2 * i + 0.1);
        for (int k = 0; k < 3; ++k)
            contact_problem_touch(p, i - 1, i, (double[]){0.1 * k, 0.05 * k * k, 0.2 * i}, (double[]){0, 0.6, 0.8},
                                  -1e-3 * k, k == 2 ? 0 : 0.5, 0);
        for (int k = 0; k < 6; ++k) p->system.velocity[6 * i + k] = 0.01 * (k + 1) * (i - 1);
    }
    for (size_t k = 0; k < p->contacts.point_count; ++k)
        for (int j = 0; j < 3; ++j) p->contacts.points[k].impulse[j] = 0.01 * (double)(k % 4) * (j + 1);
    ck_assert_int_eq(sadmm_certify(&p->system, &s, &c, &error), SADMM_OK);
    ck_assert_int_eq(sadmm_solve_errors_find(&errors, &p->system, &s, SADMM_F64, &error), SADMM_OK);
    ck_assert_double_gt(c.ncp_max, 1e-3);
    ck_assert_double_eq_tol(sadmm_solve_errors_sum(&errors, 1).law, c.ncp_max, 1e-14); /* rounding of 0.1 m/s */
    p->system.velocity[0] = NAN;
    ck_assert_int_eq(sadmm_solve_errors_find(&errors, &p->system, &s, SADMM_F64, &error), SADMM_OK);
    ck_assert_int_eq(sadmm_solve_errors_sum(&errors, 1e300).unsolved, 1);
    sadmm_solve_errors_free(&errors);
    contact_problem_free(p);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("certificate");
    TCase *cases = tcase_create("certificate");
    tcase_add_test(cases, zero_at_exact_solutions);
    tcase_add_test(cases, known_contact_errors);
    tcase_add_test(cases, momentum_error);
    tcase_add_test(cases, siconos_measure);
    tcase_add_test(cases, islands_that_miss_the_tolerance);
    tcase_add_test(cases, errors_of_islands_are_the_certificates);
    tcase_add_test(cases, hard_and_soft_rows);
    tcase_add_test(cases, worst_constraint);
    tcase_add_loop_test(cases, one_value_for_every_form, 1, 5);
    tcase_add_test(cases, not_a_number_shows);
    tcase_add_test(cases, workspace_is_kept_and_failures_change_nothing);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
