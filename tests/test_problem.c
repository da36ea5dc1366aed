/* The problem level on every backend: closed-form solutions, warm starts, stop rules, what a failure leaves.
 * One file: every test runs with each method, and most with every table, by the same fixtures and tolerances. */
#include <check.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "contact_problems.h"
#include "core/solve/kernels.h"
#include "core/solve/problem_internal.h"
#include "fixed_work.h"
#include "run_suite.h"
#include "subadmm/problem.h"

#define OK(call)                                                                                              \
    do {                                                                                                      \
        sadmm_status ok_status = (call);                                                                      \
        ck_assert_msg(ok_status == SADMM_OK, "%s: %s", sadmm_status_name(ok_status), sadmm_last_message());   \
    } while (0)

static const struct sadmm_kernels *tables[8];
static int table_count;

/* Solved until the certificate is at `stop`; then v and impulses of these small problems (condition below 100, numbers
 * around 1) are within `tolerance`. f32 stops at a few of its roundings. */
struct accuracy { double stop, momentum, tolerance; };
static struct accuracy accuracy_of(sadmm_precision precision)
{
    return precision == SADMM_F64 ? (struct accuracy){1e-13, 1e-13, 1e-11} : (struct accuracy){2e-6, 2e-6, 1e-4};
}

/* Every test runs with each method: a case a method, whose fixture sets this. */
static sadmm_method method;
static void use_paper(void) { method = SADMM_METHOD_PAPER; }
static void use_fast(void) { method = SADMM_METHOD_FAST; }

static sadmm_settings method_settings(void)
{
    sadmm_settings s = fixed_settings();
    s.method = method;
    return s;
}

static sadmm_settings converge(sadmm_precision precision)
{
    sadmm_settings s = method_settings();
    s.tolerance = accuracy_of(precision).stop;
    s.iterations = 20000;
    return s;
}

static void solve(sadmm_problem *p, const struct sadmm_kernels *table)
{
    sadmm_settings s = converge(table->precision);
    sadmm_solve_report report;
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &report));
    ck_assert_msg(report.converged, "%s f%d: natural map %g, momentum %g after %d", table->variant,
                  table->precision == SADMM_F64 ? 64 : 32, report.certificate.ncp_max, report.certificate.momentum_max,
                  report.iterations);
}

#define CLOSE(got, wanted, table) ck_assert_double_eq_tol(got, wanted, accuracy_of((table)->precision).tolerance)

/* ---- one ball: a single contact, closed form ----------------------------------------------------------------- */

enum { BALL_MASS = 2 };
static const double radius = 0.5, inertia = 0.2, fall = BALL_MASS * 9.81 * 0.005; /* weight over a step, N s */

/* A ball with start velocity (vx, vz) over the ground. `flip` makes the ground body b, with the normal downwards. */
static sadmm_problem *ball(double vx, double vz, double e, double mu, bool flip)
{
    double A[36] = {0}, b[6] = {BALL_MASS * vx, 0, BALL_MASS * vz - fall, 0, 0, 0};
    sadmm_problem *p;
    OK(sadmm_problem_create(&p));
    for (int i = 0; i < 6; ++i) A[7 * i] = i < 3 ? BALL_MASS : inertia;
    OK(sadmm_problem_set_bodies(p, 1, A, b, NULL));
    sadmm_problem_contact c = {.body_a = -1, .body_b = 0, .normal = {0, 0, 1}, .arm_b = {0, 0, -radius},
                               .arm_a = {NAN, 1, 1} /* ignored */, .error = e, .friction = mu};
    if (flip) {
        c.body_a = 0, c.body_b = -1, c.normal[2] = -1;
        memset(c.arm_a, 0, sizeof c.arm_a);
        c.arm_a[2] = -radius;
    }
    OK(sadmm_problem_set_contacts(p, 1, &c, NULL));
    return p;
}

START_TEST(ball_on_the_ground)
{
    const struct sadmm_kernels *table = tables[_i / 2];
    bool flip = _i % 2;
    double slip_mass = 1 / (1.0 / BALL_MASS + radius * radius / inertia); /* of the contact's tangential motion, kg */
    const struct {
        const char *what;
        double vx, vz, e, mu, expected_n, expected_t;
    } cases[] = {
        {"resting", 0, 0, 0, 0.5, fall, 0},
        /* Grips: the contact point stops, lambda_t = -x_t / (1/m + r^2/I). */
        {"gripping", 0.05, 0, 0, 0.5, fall, -0.05 * slip_mass},
        /* Slips: lambda_t = -mu lambda_n against the motion. */
        {"slipping", 1, 0, 0, 0.5, fall, -0.5 * fall},
        {"slipping backwards", -1, 0, 0, 0.2, fall, 0.2 * fall},
        {"frictionless", 1, 0, 0, 0, fall, 0},
        {"landing", 0, -1, 0, 0.5, BALL_MASS + fall, 0},
        {"landing and slipping", 3, -1, 0, 0.3, BALL_MASS + fall, -0.3 * (BALL_MASS + fall)},
        {"flying off", 1, 1, 0, 0.5, 0, 0},
        {"too far to touch", 1, -1, 1.2, 0.5, 0, 0},
        {"closing part of the way", 0, -1, 0.4, 0.5, BALL_MASS * 0.6 + fall, 0},
        {"pushed out of the ground", 0, 0, -0.3, 0.5, BALL_MASS * 0.3 + fall, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        sadmm_problem *p = ball(cases[k].vx, cases[k].vz, cases[k].e, cases[k].mu, flip);
        solve(p, table);
        double v[6], r[3], on_ball = flip ? -1 : 1; /* impulses are on body b */
        OK(sadmm_problem_get_solution(p, v, r, NULL));
        double n = cases[k].expected_n, t = cases[k].expected_t;
        CLOSE(on_ball * r[0], t, table);
        CLOSE(on_ball * r[1], 0, table);
        CLOSE(on_ball * r[2], n, table);
        CLOSE(v[0], cases[k].vx + t / BALL_MASS, table);
        CLOSE(v[2], cases[k].vz + (n - fall) / BALL_MASS, table);
        CLOSE(v[4], -radius * t / inertia, table); /* (r x f)_y = -radius f_x */
        sadmm_problem_destroy(p);
    }
}
END_TEST

/* ---- a block on a slope -------------------------------------------------------------------------------------- */

/* Four contacts share the load in many ways; the motion is unique. Slope tan(angle) against mu. */
START_TEST(block_on_a_slope)
{
    const struct sadmm_kernels *table = tables[_i];
    static const double slopes[] = {0.3, 0.49, 0.51, 0.8};
    const double mu = 0.5, mass = 3;
    for (int k = 0; k < 4; ++k) {
        double angle = atan(slopes[k]), g = 9.81 * 0.005;
        struct contact_problem *given = contact_problem_stack(&mass, 1, mu);
        sadmm_settings s = fixed_settings();
        s.gravity[0] = 9.81 * sin(angle), s.gravity[2] = -9.81 * cos(angle);
        contact_problem_raw(given, &s, 0);
        sadmm_problem *p;
        OK(sadmm_problem_create(&p));
        OK(sadmm_problem_set_bodies(p, 1, given->A, given->b, NULL));
        sadmm_problem_contact contacts[4];
        for (int i = 0; i < 4; ++i) {
            memset(&contacts[i], 0, sizeof contacts[i]);
            contacts[i].body_a = -1;
            contacts[i].normal[2] = 1;
            contacts[i].friction = mu;
            memcpy(contacts[i].arm_b, given->contacts.points[i].arm_b, sizeof contacts[i].arm_b);
        }
        OK(sadmm_problem_set_contacts(p, 4, contacts, NULL));
        solve(p, table);
        double v[6], r[12], sum[3] = {0, 0, 0};
        OK(sadmm_problem_get_solution(p, v, r, NULL));
        for (int i = 0; i < 12; ++i) sum[i % 3] += r[i];
        double slide = slopes[k] > mu ? g * (sin(angle) - mu * cos(angle)) : 0;
        CLOSE(v[0], slide, table);
        for (int i = 1; i < 6; ++i) CLOSE(v[i], 0, table);
        CLOSE(sum[0], mass * (slide - g * sin(angle)), table);
        CLOSE(sum[2], mass * g * cos(angle), table);
        sadmm_problem_destroy(p);
        contact_problem_free(given);
    }
}
END_TEST

/* ---- blocks -------------------------------------------------------------------------------------------------- */

/* Diagonal A of two bodies; rows act on coordinate `row` as v_b - v_a. */
static sadmm_problem *two_bodies(const double b[12], sadmm_problem_block *block, sadmm_block_kind kind, int rows)
{
    double A[72] = {0};
    sadmm_problem *p;
    for (int i = 0; i < 12; ++i) A[36 * (i / 6) + 7 * (i % 6)] = i < 6 ? 1.5 : 4;
    OK(sadmm_problem_create(&p));
    OK(sadmm_problem_set_bodies(p, 2, A, b, NULL));
    memset(block, 0, sizeof *block);
    block->kind = kind;
    block->rows = rows;
    block->body_a = 0;
    block->body_b = 1;
    for (int r = 0; r < rows; ++r) block->jacobian_a[7 * r] = -1, block->jacobian_b[7 * r] = 1;
    return p;
}

static const double push[12] = {1, -2, 3, 0.5, 0.2, -0.3, 2, 2, -1, 0.1, 0.7, 0.9};

/* v_b - v_a = -e with total momentum kept: v_a = (b_a + b_b + m_b e) / (m_a + m_b). */
START_TEST(weld)
{
    const struct sadmm_kernels *table = tables[_i];
    sadmm_problem_block block;
    sadmm_problem *p = two_bodies(push, &block, SADMM_BLOCK_HARD, 6);
    for (int r = 0; r < 6; ++r) block.error[r] = 0.1 * r - 0.2;
    OK(sadmm_problem_set_blocks(p, 1, &block, NULL));
    solve(p, table);
    double v[12], lambda[6];
    OK(sadmm_problem_get_solution(p, v, NULL, lambda));
    for (int r = 0; r < 6; ++r) {
        double va = (push[r] + push[6 + r] + 4 * block.error[r]) / 5.5;
        CLOSE(v[r], va, table);
        CLOSE(v[6 + r], va - block.error[r], table);
        CLOSE(lambda[r], push[r] - 1.5 * va, table); /* A_a v_a = b_a - lambda */
    }
    sadmm_problem_destroy(p);
}
END_TEST

/* Rows of zeros carry nothing, whatever their error and start value (Sec. III-C of the paper). */
START_TEST(joint_with_free_rows)
{
    const struct sadmm_kernels *table = tables[_i];
    sadmm_problem_block block;
    const double lambda0[6] = {0, 5, 0, 5, 0, 5};
    sadmm_problem *p = two_bodies(push, &block, SADMM_BLOCK_HARD, 6);
    for (int r = 1; r < 6; r += 2) {
        block.jacobian_a[7 * r] = block.jacobian_b[7 * r] = 0;
        block.error[r] = 3;
    }
    OK(sadmm_problem_set_blocks(p, 1, &block, lambda0));
    solve(p, table);
    double v[12], lambda[6];
    OK(sadmm_problem_get_solution(p, v, NULL, lambda));
    for (int r = 0; r < 6; ++r) {
        if (r % 2) {
            CLOSE(v[r], push[r] / 1.5, table);
            CLOSE(v[6 + r], push[6 + r] / 4, table);
            ck_assert(lambda[r] == 0);
        } else {
            CLOSE(v[r], (push[r] + push[6 + r]) / 5.5, table);
            CLOSE(v[6 + r], v[r], table);
        }
    }
    sadmm_problem_destroy(p);
}
END_TEST

/* lambda = -(k e + c x) with x = v_b - v_a: x (1 + c w) = x_free - w k e, w = 1/m_a + 1/m_b. Soft, damped, stiff; a
 * row of the same block each. c = 1e4 kg against 5.5 kg of bodies is nearly hard. */
START_TEST(springs)
{
    const struct sadmm_kernels *table = tables[_i];
    static const double k[] = {2, 0, 3, 50, 1e3, 0.5}, c[] = {0, 4, 3, 10, 1e4, 0.1},
                        e[] = {0.3, 0.3, -0.2, 0.05, 0.01, 1};
    sadmm_problem_block block;
    sadmm_problem *p = two_bodies(push, &block, SADMM_BLOCK_SOFT, 6);
    memcpy(block.stiffness, k, sizeof k);
    memcpy(block.damping, c, sizeof c);
    memcpy(block.error, e, sizeof e);
    OK(sadmm_problem_set_blocks(p, 1, &block, NULL));
    solve(p, table);
    double v[12], lambda[6], w = 1 / 1.5 + 1.0 / 4;
    OK(sadmm_problem_get_solution(p, v, NULL, lambda));
    for (int r = 0; r < 6; ++r) {
        double free_x = push[6 + r] / 4 - push[r] / 1.5;
        double x = (free_x - w * k[r] * e[r]) / (1 + c[r] * w), expected = -(k[r] * e[r] + c[r] * x);
        CLOSE(lambda[r], expected, table);
        CLOSE(v[r], (push[r] - expected) / 1.5, table);
        CLOSE(v[6 + r], (push[6 + r] + expected) / 4, table);
    }
    sadmm_problem_destroy(p);
}
END_TEST

/* A spring to the static world on either side: m v = b - (k e + c x) with x = +-v. */
START_TEST(spring_to_the_world)
{
    const struct sadmm_kernels *table = tables[_i];
    for (int side = 0; side < 2; ++side) {
        double A[36] = {0}, b[6] = {1, 0, 0, 0, 0, 0}, v[6], lambda[6];
        sadmm_problem *p;
        for (int i = 0; i < 6; ++i) A[7 * i] = 2;
        OK(sadmm_problem_create(&p));
        OK(sadmm_problem_set_bodies(p, 1, A, b, NULL));
        sadmm_problem_block block = {
            .kind = SADMM_BLOCK_SOFT, .rows = 1, .body_a = side ? -1 : 0, .body_b = side ? 0 : -1};
        double sign = side ? 1 : -1;
        for (int j = 0; j < 36; ++j)
            block.jacobian_a[j] = block.jacobian_b[j] = NAN; /* the static side's are not read */
        for (int j = 0; j < 6; ++j) (side ? block.jacobian_b : block.jacobian_a)[j] = j == 0 ? sign : 0;
        block.error[0] = 0.2, block.stiffness[0] = 5, block.damping[0] = 3;
        OK(sadmm_problem_set_blocks(p, 1, &block, NULL));
        solve(p, table);
        OK(sadmm_problem_get_solution(p, v, NULL, lambda));
        CLOSE(v[0], (1 - sign * 1.0) / 5, table); /* 2 v = 1 - sign (1 + 3 sign v) */
        CLOSE(lambda[0], -(1 + 3 * sign * v[0]), table);
        sadmm_problem_destroy(p);
    }
}
END_TEST

/* ---- contacts of a pair, in any grouping --------------------------------------------------------------------- */

/* A stack as a problem, contacts in the order given by `order` (NULL: as built). */
static sadmm_problem *stack_problem(const int *order, double friction)
{
    static const double masses[] = {1, 2, 0.5};
    struct contact_problem *given = contact_problem_stack(masses, 3, friction);
    sadmm_settings s = fixed_settings();
    sadmm_problem_contact contacts[12];
    sadmm_problem *p;
    s.gravity[0] = 3;
    contact_problem_raw(given, &s, 0);
    OK(sadmm_problem_create(&p));
    OK(sadmm_problem_set_bodies(p, 3, given->A, given->b, NULL));
    for (int i = 0; i < 12; ++i) {
        int k = order ? order[i] : i;
        const struct sadmm_contact_pair *pair = &given->contacts.pairs[k / 4];
        const struct sadmm_contact_point *point = &given->contacts.points[k];
        memset(&contacts[i], 0, sizeof contacts[i]);
        contacts[i].body_a = pair->body_a;
        contacts[i].body_b = pair->body_b;
        memcpy(contacts[i].normal, pair->normal, sizeof pair->normal);
        memcpy(contacts[i].arm_a, point->arm_a, sizeof point->arm_a);
        memcpy(contacts[i].arm_b, point->arm_b, sizeof point->arm_b);
        contacts[i].friction = pair->friction;
    }
    OK(sadmm_problem_set_contacts(p, 12, contacts, NULL));
    contact_problem_free(given);
    return p;
}

START_TEST(order_of_contacts_does_not_matter)
{
    const struct sadmm_kernels *table = tables[_i];
    static const int shuffled[] = {0, 4, 8, 1, 5, 9, 2, 6, 10, 3, 7, 11};
    double v[18], w[18];
    sadmm_problem *p = stack_problem(NULL, 0.5), *q = stack_problem(shuffled, 0.5);
    solve(p, table);
    solve(q, table);
    OK(sadmm_problem_get_solution(p, v, NULL, NULL));
    OK(sadmm_problem_get_solution(q, w, NULL, NULL));
    for (int i = 0; i < 18; ++i) CLOSE(w[i], v[i], table);
    sadmm_problem_destroy(p);
    sadmm_problem_destroy(q);
}
END_TEST

/* Contacts that look like one pair's but do not fit a rigid pair of bodies (arm_b - arm_a differs), and more than fit
 * in a pair: every backend must still solve what was asked, iterate by iterate. */
START_TEST(contacts_that_do_not_share_a_pair)
{
    const struct sadmm_kernels *table = tables[_i];
    enum { CONTACTS = 21 };
    double A[72] = {0}, b[12], v[2][12], r[2][3 * CONTACTS];
    sadmm_problem_contact contacts[CONTACTS];
    sadmm_problem *p;
    contact_problem_seed(5);
    for (int i = 0; i < 12; ++i) A[36 * (i / 6) + 7 * (i % 6)] = i < 6 ? 1 : 3, b[i] = contact_problem_random();
    b[6] -= 3, b[8] -= 4; /* body 1 comes along the normal */
    for (int k = 0; k < CONTACTS; ++k) {
        memset(&contacts[k], 0, sizeof contacts[k]);
        contacts[k].body_b = 1;
        contacts[k].normal[0] = 0.6, contacts[k].normal[2] = 0.8;
        contacts[k].friction = 0.5;
        contacts[k].error = -0.1;
        for (int i = 0; i < 3; ++i) {
            contacts[k].arm_a[i] = contact_problem_random();
            /* The first 12 share the offset, 0.25 to the bit or so; the others have their own. */
            contacts[k].arm_b[i] = contacts[k].arm_a[i] + (k < 12 ? 0.25 : contact_problem_random());
        }
    }
    OK(sadmm_problem_create(&p));
    for (int t = 0; t < 2; ++t) {
        sadmm_settings s = method_settings();
        s.iterations = 50;
        OK(sadmm_problem_set_bodies(p, 2, A, b, NULL));
        OK(sadmm_problem_set_contacts(p, CONTACTS, contacts, NULL));
        OK(sadmm_problem_solve(p, t ? table->backend : SADMM_BACKEND_REF, t ? table->precision : SADMM_F64, &s, NULL));
        OK(sadmm_problem_get_solution(p, v[t], r[t], NULL));
    }
    double shared = 0, own = 0; /* contacts of both sorts do carry something */
    for (int i = 0; i < 3 * CONTACTS; ++i) *(i < 36 ? &shared : &own) += fabs(r[0][i]);
    ck_assert(shared > 0.1 && own > 0.1);
    /* Rounding over 50 iterations, of numbers up to 5. */
    double tolerance = table->precision == SADMM_F64 ? 1e-13 : 5e-5;
    for (int i = 0; i < 12; ++i) ck_assert_double_eq_tol(v[1][i], v[0][i], tolerance);
    for (int i = 0; i < 3 * CONTACTS; ++i) ck_assert_double_eq_tol(r[1][i], r[0][i], tolerance);
    sadmm_problem_destroy(p);
}
END_TEST

/* Contacts of one pair of bodies, all of which a pair could share, were it not for its limit. */
START_TEST(pairs_have_a_largest_number_of_points)
{
    enum { FULL = SADMM_MAX_POINTS, MOST = 3 * FULL + 1 };
    static const int counts[] = {1, FULL - 1, FULL, FULL + 1, 2 * FULL, 2 * FULL + 1, MOST};
    double A[72] = {0}, b[12] = {0, 0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0}, v[2][12], r[2][3 * MOST];
    sadmm_problem_contact contacts[MOST] = {0};
    sadmm_problem *p;
    for (int i = 0; i < 12; ++i) A[36 * (i / 6) + 7 * (i % 6)] = 1;
    for (int k = 0; k < MOST; ++k) { /* face on face, the second body 1 above the first */
        contacts[k].body_b = 1;
        contacts[k].normal[2] = 1;
        contacts[k].friction = 0.5;
        contacts[k].arm_a[0] = contacts[k].arm_b[0] = 0.25 * (k % 5);
        contacts[k].arm_a[1] = contacts[k].arm_b[1] = 0.25 * (k / 5);
        contacts[k].arm_a[2] = 0.5, contacts[k].arm_b[2] = -0.5;
    }
    OK(sadmm_problem_create(&p));
    for (size_t c = 0; c < sizeof counts / sizeof *counts; ++c) {
        for (int t = 0; t < table_count; ++t) {
            OK(sadmm_problem_set_bodies(p, 2, A, b, NULL));
            OK(sadmm_problem_set_contacts(p, counts[c], contacts, NULL));
            const struct sadmm_contact_set *set = sadmm_problem_contact_set(p);
            ck_assert_uint_eq(set->point_count, (size_t)counts[c]);
            ck_assert_uint_eq(set->pair_count, (size_t)(counts[c] + 7) / 8);
            for (int k = 0; k < (int)set->pair_count; ++k) {
                ck_assert_int_eq(set->pairs[k].first, 8 * k);
                ck_assert_int_eq(set->pairs[k].count, 8 * k + 8 < counts[c] ? 8 : counts[c] - 8 * k);
            }
            sadmm_settings s = method_settings();
            s.iterations = 50;
            OK(sadmm_problem_solve(p, tables[t]->backend, tables[t]->precision, &s, NULL));
            OK(sadmm_problem_get_solution(p, v[t > 0], r[t > 0], NULL));
            /* The first table is the oracle. Rounding over 50 iterations, of numbers up to 1. */
            ck_assert(tables[0]->backend == SADMM_BACKEND_REF);
            double tolerance = tables[t]->precision == SADMM_F64 ? 1e-13 : 2e-5;
            for (int i = 0; t > 0 && i < 12; ++i) ck_assert_double_eq_tol(v[1][i], v[0][i], tolerance);
            for (int i = 0; t > 0 && i < 3 * counts[c]; ++i) ck_assert_double_eq_tol(r[1][i], r[0][i], tolerance);
        }
        ck_assert(fabs(r[0][2]) > 1e-3); /* they do carry something */
    }
    sadmm_problem_destroy(p);
}
END_TEST

/* ---- starts and stops ---------------------------------------------------------------------------------------- */

START_TEST(warm_and_cold_starts)
{
    const struct sadmm_kernels *table = tables[_i];
    sadmm_problem *p = stack_problem(NULL, 0.5);
    sadmm_settings s = method_settings();
    sadmm_solve_report first, second;
    double v1[18], v2[18], r1[36], r2[36];
    s.iterations = 40;
    s.penalty_period = 0;

    s.warm_start = false; /* the same again, bit for bit */
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &first));
    OK(sadmm_problem_get_solution(p, v1, r1, NULL));
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &second));
    OK(sadmm_problem_get_solution(p, v2, r2, NULL));
    ck_assert(memcmp(v1, v2, sizeof v1) == 0 && memcmp(r1, r2, sizeof r1) == 0);
    ck_assert(first.certificate.ncp_max == second.certificate.ncp_max);

    s.warm_start = true; /* goes on from there */
    s.iterations = 400;
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &second));
    ck_assert_double_lt(second.certificate.ncp_max, 0.1 * first.certificate.ncp_max);
    /* From the solution, one iteration stays there. */
    solve(p, table);
    s.iterations = 1;
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &second));
    ck_assert_double_le(second.certificate.ncp_max, 10 * accuracy_of(table->precision).stop);
    sadmm_problem_destroy(p);
}
END_TEST

START_TEST(stop_rules_and_report)
{
    const struct sadmm_kernels *table = tables[_i];
    bool wide = table->precision == SADMM_F64;
    sadmm_problem *p = stack_problem(NULL, 0.5);
    sadmm_settings s = method_settings();
    sadmm_solve_report r;
    sadmm_certificate c;
    s.warm_start = false;

    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &r)); /* nothing asked */
    ck_assert(r.backend == table->backend && r.precision == table->precision);
    ck_assert(r.iterations == s.iterations && !r.converged && r.threads >= 1);
    ck_assert(r.solve_ms >= 0 && isfinite(r.solve_ms));
    OK(sadmm_problem_certify(p, &c)); /* the certificate of what can be read back */
    ck_assert(memcmp(&c, &r.certificate, sizeof c) == 0);

    s.measure_residuals = true;
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &r));
    ck_assert(r.residual.primal > 0 && r.residual.dual > 0 && r.residual.primal < 1 && r.residual.dual < 1);

    s.iterations = 20000;
    s.residual_tolerance = wide ? 1e-9 : 1e-6;
    s.check_period = 7;
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &r));
    ck_assert(r.converged && r.iterations % 7 == 0 && r.iterations < 20000);
    ck_assert(r.residual.primal <= s.residual_tolerance && r.residual.dual <= s.residual_tolerance);

    s.residual_tolerance = 0;
    s.tolerance = 1e-5;
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &r));
    ck_assert(r.converged && r.certificate.ncp_max <= 1e-5);

    s.iterations = 5; /* not enough: the limit holds and the report says so */
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &r));
    ck_assert(!r.converged && r.iterations == 5);
    sadmm_problem_destroy(p);
}
END_TEST

/* Nothing constrains these bodies: v = A^-1 b at once, also with bodies that do meet something. */
START_TEST(free_bodies)
{
    const struct sadmm_kernels *table = tables[_i];
    double A[72] = {0}, b[12], v[12], v0[12];
    sadmm_settings s = method_settings();
    sadmm_problem *p;
    for (int i = 0; i < 12; ++i) {
        A[36 * (i / 6) + 7 * (i % 6)] = 1 + i;
        b[i] = (i + 1) * (i - 5);
        v0[i] = 100;
    }
    s.iterations = 3;
    OK(sadmm_problem_create(&p));
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, NULL)); /* nothing at all is a problem too */
    OK(sadmm_problem_set_bodies(p, 2, A, b, v0));
    OK(sadmm_problem_get_solution(p, v, NULL, NULL));
    for (int i = 0; i < 12; ++i) ck_assert(v[i] == 100);
    for (int contacts = 0; contacts < 2; ++contacts) {
        sadmm_problem_contact c = {.body_a = -1, .body_b = 1, .normal = {1, 0, 0}, .error = 100};
        OK(sadmm_problem_set_contacts(p, contacts, &c, NULL)); /* far away */
        OK(sadmm_problem_solve(p, table->backend, table->precision, &s, NULL));
        OK(sadmm_problem_get_solution(p, v, NULL, NULL));
        /* b / A, but for rounding; three iterations are not the end for a body that a contact holds on to. */
        for (int i = 0; i < (contacts ? 6 : 12); ++i) CLOSE(v[i], i - 5, table);
    }
    sadmm_problem_destroy(p);
}
END_TEST

/* ---- what a failure leaves ----------------------------------------------------------------------------------- */

START_TEST(overflow_is_reported_and_undone)
{
    const struct sadmm_kernels *table = tables[_i];
    double A[36] = {0}, b[6], v0[6] = {1, 2, 3, 4, 5, 6}, r0[3] = {0.1, 0.2, 0.3}, v[6], r[3], l[6];
    const double l0[6] = {7, 0, 0, 0, 0, 0};
    sadmm_settings s = method_settings();
    sadmm_solve_report report;
    sadmm_problem *p;
    for (int i = 0; i < 6; ++i) A[7 * i] = 1e-300, b[i] = 1e60; /* v = A^-1 b is beyond double */
    OK(sadmm_problem_create(&p));
    OK(sadmm_problem_set_bodies(p, 1, A, b, v0));
    sadmm_problem_contact c = {.body_a = -1, .body_b = 0, .normal = {0, 0, 1}, .friction = 0.5};
    sadmm_problem_block block = {.kind = SADMM_BLOCK_HARD, .rows = 1, .body_a = 0, .body_b = -1, .jacobian_a = {0, 1}};
    OK(sadmm_problem_set_contacts(p, 1, &c, r0));
    OK(sadmm_problem_set_blocks(p, 1, &block, l0));
    memset(&report, 77, sizeof report);
    sadmm_solve_report before = report;
    ck_assert_int_eq(sadmm_problem_solve(p, table->backend, table->precision, &s, &report), SADMM_ERROR_NON_FINITE);
    ck_assert(strlen(sadmm_problem_message(p)) > 0);
    ck_assert_str_eq(sadmm_problem_message(p), sadmm_last_message());
    ck_assert(memcmp(&report, &before, sizeof report) == 0);
    OK(sadmm_problem_get_solution(p, v, r, l));
    ck_assert(memcmp(v, v0, sizeof v) == 0 && memcmp(r, r0, sizeof r) == 0 && memcmp(l, l0, sizeof l) == 0);

    memset(b, 0, sizeof b); /* and the problem can still be used */
    for (int i = 0; i < 6; ++i) A[7 * i] = 1e-3;
    OK(sadmm_problem_set_bodies(p, 1, A, b, v0));
    OK(sadmm_problem_solve(p, table->backend, table->precision, &s, &report));
    sadmm_problem_destroy(p);
}
END_TEST

/* Numbers so large that products of them may not be numbers are refused by name. Squares that would overflow do not:
 * the solution is v = A^-1 b = 1e200 m/s. In single precision that is none, and the solve says so. */
START_TEST(what_is_large_is_solved_or_refused)
{
    const struct sadmm_kernels *table = tables[_i];
    double A[36] = {0}, b[6] = {0}, v[6];
    sadmm_settings s = method_settings();
    sadmm_solve_report report;
    sadmm_certificate certificate;
    sadmm_problem_block block = {.kind = SADMM_BLOCK_CONTACT, .rows = 3, .body_a = -1, .body_b = 0};
    sadmm_problem *p;
    for (int i = 0; i < 6; ++i) A[7 * i] = 1e-140;
    b[0] = 1e60;
    OK(sadmm_problem_create(&p));
    OK(sadmm_problem_set_bodies(p, 1, A, b, NULL));
    for (int r = 0; r < 3; ++r) block.jacobian_b[6 * r + (r + 2) % 3] = 1;
    block.jacobian_b[7] = 1e308;
    ck_assert_int_eq(sadmm_problem_set_blocks(p, 1, &block, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_msg(
        strstr(sadmm_problem_message(p), "blocks[0].jacobian_b[7] = 1e+308: must be finite and within +-1e+60"), "%s",
        sadmm_problem_message(p));

    const sadmm_problem_contact apart = {.body_a = -1, .body_b = 0, .normal = {0, 0, 1}, .error = 1, .friction = 0.5};
    OK(sadmm_problem_set_contacts(p, 1, &apart, NULL));
    s.residual_tolerance = 1e50; /* rounding of 1e60 is below */
    sadmm_status status = sadmm_problem_solve(p, table->backend, table->precision, &s, &report);
    if (table->precision == SADMM_F32) {
        ck_assert_int_eq(status, SADMM_ERROR_NON_FINITE);
    } else {
        OK(status);
        ck_assert(report.residual.primal <= s.residual_tolerance && report.residual.dual <= s.residual_tolerance);
        ck_assert(report.converged);
        /* 6 rows of a few roundings each, relative */
        ck_assert(report.certificate.siconos >= 0 && report.certificate.siconos <= 64 * DBL_EPSILON);
        OK(sadmm_problem_get_solution(p, v, NULL, NULL));
        v[0] *= 1.5; /* |A v - b| = b / 2, relative to |A v| = 1.5 b; sliding without an impulse is no error */
        OK(sadmm_problem_set_solution(p, v, NULL, NULL));
        OK(sadmm_problem_certify(p, &certificate));
        ck_assert_double_eq_tol(certificate.siconos, 1.0 / 3, 64 * DBL_EPSILON);
        ck_assert_double_eq_tol(certificate.momentum_max, 1.0 / 3, 64 * DBL_EPSILON);
    }
    sadmm_problem_destroy(p);
}
END_TEST

/* Where a product overflows all the same (J A^-1 J^T = 1e60^2 / 1e-200) there is no certificate, not one that is
 * NaN. */
START_TEST(what_overflows_has_no_certificate)
{
    double A[36] = {0}, b[6] = {0};
    sadmm_certificate certificate, before;
    sadmm_problem_block block = {.kind = SADMM_BLOCK_CONTACT, .rows = 3, .body_a = -1, .body_b = 0};
    sadmm_problem *p;
    for (int i = 0; i < 6; ++i) A[7 * i] = 1e-200;
    for (int r = 0; r < 3; ++r) block.jacobian_b[6 * r + (r + 2) % 3] = 1e60;
    OK(sadmm_problem_create(&p));
    OK(sadmm_problem_set_bodies(p, 1, A, b, NULL));
    OK(sadmm_problem_set_blocks(p, 1, &block, NULL));
    memset(&certificate, 7, sizeof certificate);
    before = certificate;
    ck_assert_int_eq(sadmm_problem_certify(p, &certificate), SADMM_ERROR_NON_FINITE);
    ck_assert_msg(strstr(sadmm_problem_message(p), "the error of the solution is not a finite number"), "%s",
                  sadmm_problem_message(p));
    ck_assert(memcmp(&certificate, &before, sizeof certificate) == 0);
    sadmm_problem_destroy(p);
}
END_TEST

START_TEST(devices)
{
    sadmm_problem *p = stack_problem(NULL, 0.5);
    sadmm_settings s = method_settings();
    sadmm_solve_report first, second;
    ck_assert_int_eq(sadmm_problem_set_device(p, -1), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_problem_message(p), "device = -1: must be >= 0");
    /* Hosts have no devices to choose from, and what was kept is given up and made again. */
    s.warm_start = false;
    OK(sadmm_problem_solve(p, SADMM_BACKEND_CPU, SADMM_F64, &s, &first));
    OK(sadmm_problem_set_device(p, 3));
    OK(sadmm_problem_solve(p, SADMM_BACKEND_CPU, SADMM_F64, &s, &second));
    ck_assert(first.certificate.ncp_max == second.certificate.ncp_max);
    sadmm_backend_info info;
    OK(sadmm_backend_query(SADMM_BACKEND_CUDA, &info));
    if (info.available[SADMM_F64]) { /* the index is inspected where there is something to choose from */
        OK(sadmm_problem_set_device(p, 0));
        OK(sadmm_problem_solve(p, SADMM_BACKEND_CUDA, SADMM_F64, &s, &second));
        OK(sadmm_problem_set_device(p, 1000));
        ck_assert_int_eq(sadmm_problem_solve(p, SADMM_BACKEND_CUDA, SADMM_F64, &s, &second),
                         SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_msg(strstr(sadmm_problem_message(p), "device = 1000") != NULL, "%s", sadmm_problem_message(p));
    }
    sadmm_problem_destroy(p);
}
END_TEST

START_TEST(backends)
{
    sadmm_problem *p = stack_problem(NULL, 0.5);
    sadmm_settings s = method_settings();
    sadmm_solve_report report;
    OK(sadmm_problem_solve(p, SADMM_BACKEND_AUTO, SADMM_F32, &s, &report));
    ck_assert(report.backend != SADMM_BACKEND_AUTO && report.backend != SADMM_BACKEND_REF &&
              report.precision == SADMM_F32);
    ck_assert_int_eq(sadmm_problem_solve(p, SADMM_BACKEND_REF, SADMM_F32, &s, &report), SADMM_ERROR_UNAVAILABLE);
    ck_assert_msg(strstr(sadmm_problem_message(p), "double"), "%s", sadmm_problem_message(p));
    ck_assert_int_eq(sadmm_problem_solve(p, SADMM_BACKEND_COUNT, SADMM_F64, &s, &report), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_solve(p, (sadmm_backend)-1, SADMM_F64, &s, &report), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_solve(p, SADMM_BACKEND_CPU, (sadmm_precision)2, &s, &report),
                     SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_problem_destroy(p);
}
END_TEST

/* ---- reading back -------------------------------------------------------------------------------------------- */

START_TEST(what_was_set_can_be_read)
{
    struct contact_problem *given = contact_problem_mixed(3, 0.5);
    sadmm_settings s = fixed_settings();
    int32_t n = given->system.body_count, blocks = given->block_count;
    int32_t points = (int32_t)given->contacts.point_count;
    contact_problem_raw(given, &s, 0.1);
    contact_problem_warm(given, 1, 1);
    sadmm_problem_contact *contacts = calloc((size_t)points, sizeof *contacts), contact;
    double *impulses = calloc((size_t)points, 3 * sizeof *impulses), *A = calloc((size_t)n, 36 * sizeof *A);
    double *b = calloc((size_t)n, 6 * sizeof *b), *v = calloc((size_t)n, 6 * sizeof *v);
    double *r = calloc((size_t)points, 3 * sizeof *r), *l = calloc((size_t)blocks, 6 * sizeof *l);
    for (size_t k = 0; k < given->contacts.pair_count; ++k) {
        const struct sadmm_contact_pair *pair = &given->contacts.pairs[k];
        for (int32_t i = pair->first; i < pair->first + pair->count; ++i) {
            const struct sadmm_contact_point *point = &given->contacts.points[i];
            contacts[i].body_a = pair->body_a, contacts[i].body_b = pair->body_b;
            memcpy(contacts[i].normal, pair->normal, sizeof pair->normal);
            memcpy(contacts[i].arm_a, point->arm_a, sizeof point->arm_a);
            memcpy(contacts[i].arm_b, point->arm_b, sizeof point->arm_b);
            memcpy(impulses + 3 * i, point->impulse, sizeof point->impulse);
            contacts[i].error = point->error;
            contacts[i].friction = pair->friction;
        }
    }
    sadmm_problem *p;
    OK(sadmm_problem_create(&p));
    ck_assert_str_eq(sadmm_problem_message(p), "");
    OK(sadmm_problem_set_bodies(p, n, given->A, given->b, given->system.velocity));
    OK(sadmm_problem_set_contacts(p, points, contacts, impulses));
    OK(sadmm_problem_set_blocks(p, blocks, given->blocks, given->block_lambda));
    ck_assert(sadmm_problem_body_count(p) == n && sadmm_problem_contact_count(p) == points &&
              sadmm_problem_block_count(p) == blocks);

    OK(sadmm_problem_get_bodies(p, A, b, v));
    ck_assert(memcmp(A, given->A, (size_t)n * 36 * sizeof *A) == 0 &&
              memcmp(b, given->b, (size_t)n * 6 * sizeof *b) == 0);
    ck_assert(memcmp(v, given->system.velocity, (size_t)n * 6 * sizeof *v) == 0);
    OK(sadmm_problem_get_bodies(p, NULL, NULL, NULL));
    for (int32_t k = 0; k < points; ++k) {
        OK(sadmm_problem_get_contact(p, k, &contact));
        ck_assert(contact.body_a == contacts[k].body_a && contact.body_b == contacts[k].body_b);
        ck_assert(contact.error == contacts[k].error && contact.friction == contacts[k].friction);
        for (int i = 0; i < 3; ++i) {
            /* Normals are kept to the bit when they are unit to rounding, as these are, and made so otherwise. */
            ck_assert(contact.normal[i] == contacts[k].normal[i]);
            ck_assert(contact.arm_a[i] == contacts[k].arm_a[i] && contact.arm_b[i] == contacts[k].arm_b[i]);
        }
    }
    for (int32_t k = 0; k < blocks; ++k) {
        sadmm_problem_block block;
        OK(sadmm_problem_get_block(p, k, &block));
        ck_assert(block.kind == given->blocks[k].kind && block.rows == given->blocks[k].rows);
        for (int j = 0; j < 6 * block.rows; ++j) {
            if (block.body_a >= 0) ck_assert(block.jacobian_a[j] == given->blocks[k].jacobian_a[j]);
            if (block.body_b >= 0) ck_assert(block.jacobian_b[j] == given->blocks[k].jacobian_b[j]);
        }
    }
    OK(sadmm_problem_get_solution(p, v, r, l));
    ck_assert(memcmp(r, impulses, (size_t)points * 3 * sizeof *r) == 0);
    ck_assert(memcmp(l, given->block_lambda, (size_t)blocks * 6 * sizeof *l) == 0);

    /* set_solution leaves alone what is NULL. */
    for (int32_t i = 0; i < 6 * n; ++i) v[i] = i;
    OK(sadmm_problem_set_solution(p, v, NULL, NULL));
    OK(sadmm_problem_get_solution(p, b, A, NULL)); /* room enough in both */
    ck_assert(memcmp(b, v, (size_t)n * 6 * sizeof *v) == 0 && memcmp(A, impulses, (size_t)points * 3 * sizeof *r) == 0);

    /* Nearly unit normals are made unit. */
    sadmm_problem_contact tilted = contacts[0];
    for (int i = 0; i < 3; ++i) tilted.normal[i] *= 1 + 5e-7;
    OK(sadmm_problem_set_contacts(p, 1, &tilted, NULL));
    OK(sadmm_problem_get_contact(p, 0, &contact));
    double n2 = 0;
    for (int i = 0; i < 3; ++i) n2 += contact.normal[i] * contact.normal[i];
    ck_assert_double_eq_tol(n2, 1, 1e-15);

    /* New bodies drop every constraint; v0 = NULL starts from A^-1 b. */
    OK(sadmm_problem_set_bodies(p, 1, given->A, given->b, NULL));
    ck_assert(sadmm_problem_contact_count(p) == 0 && sadmm_problem_block_count(p) == 0);
    OK(sadmm_problem_get_bodies(p, NULL, NULL, v));
    for (int i = 0; i < 6; ++i) {
        double Av = 0;
        for (int j = 0; j < 6; ++j) Av += given->A[6 * i + j] * v[j];
        ck_assert_double_eq_tol(Av, given->b[i], 1e-13 * (1 + fabs(given->b[i]))); /* Cholesky of a 6 x 6 */
    }
    sadmm_problem_destroy(p);
    sadmm_problem_destroy(NULL);
    free(contacts);
    free(impulses);
    free(A);
    free(b);
    free(v);
    free(r);
    free(l);
    contact_problem_free(given);
}
END_TEST

static void add_case(Suite *suite, const char *name, void (*use_method)(void))
{
    TCase *cases = tcase_create(name);
    tcase_set_timeout(cases, 60);
    tcase_add_checked_fixture(cases, use_method, NULL);
    tcase_add_loop_test(cases, ball_on_the_ground, 0, 2 * table_count);
    tcase_add_loop_test(cases, block_on_a_slope, 0, table_count);
    tcase_add_loop_test(cases, weld, 0, table_count);
    tcase_add_loop_test(cases, joint_with_free_rows, 0, table_count);
    tcase_add_loop_test(cases, springs, 0, table_count);
    tcase_add_loop_test(cases, spring_to_the_world, 0, table_count);
    tcase_add_loop_test(cases, order_of_contacts_does_not_matter, 0, table_count);
    tcase_add_loop_test(cases, contacts_that_do_not_share_a_pair, 0, table_count);
    tcase_add_test(cases, pairs_have_a_largest_number_of_points);
    tcase_add_loop_test(cases, warm_and_cold_starts, 0, table_count);
    tcase_add_loop_test(cases, stop_rules_and_report, 0, table_count);
    tcase_add_loop_test(cases, free_bodies, 0, table_count);
    tcase_add_loop_test(cases, overflow_is_reported_and_undone, 0, table_count);
    tcase_add_loop_test(cases, what_is_large_is_solved_or_refused, 0, table_count);
    tcase_add_test(cases, what_overflows_has_no_certificate);
    tcase_add_test(cases, devices);
    tcase_add_test(cases, backends);
    suite_add_tcase(suite, cases);
}

int main(void)
{
    for (size_t i = 0; sadmm_kernels_at(i) && i < 8; ++i) tables[table_count++] = sadmm_kernels_at(i);
    Suite *suite = suite_create("problem");
    add_case(suite, "paper", use_paper);
    add_case(suite, "fast", use_fast);
    TCase *reading = tcase_create("reading");
    tcase_add_test(reading, what_was_set_can_be_read);
    suite_add_tcase(suite, reading);
    return run_suite(suite);
}
