/* Bad input and failing allocations at the problem level: refused with a message that names the argument, its value
 * and the range, and nothing lost. One file: most tests give bad values to the same problem (`make`), and then check
 * that it is what it was. */
#include <check.h>
#include <limits.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/model/settings.h"
#include "subadmm/problem.h"
#include "run_suite.h"

#define OK(call)                                                                                            \
    do {                                                                                                    \
        sadmm_status ok_status = (call);                                                                    \
        ck_assert_msg(ok_status == SADMM_OK, "%s: %s", sadmm_status_name(ok_status), sadmm_last_message()); \
    } while (0)

/* ---- settings ------------------------------------------------------------------------------------------------ */

#define REAL(field, ...) {#field, offsetof(sadmm_settings, field), false, {__VA_ARGS__}}
#define INTEGER(field, ...) {#field, offsetof(sadmm_settings, field), true, {__VA_ARGS__}}
#define END 12345 /* ends a list */

static const struct bad_setting {
    const char *name;
    size_t offset;
    bool integer;
    double values[6];
} bad_settings[] = {
    REAL(dt, 0, -0.005, 9.9e-7, 1.1, NAN, END),
    REAL(gravity[0], NAN, INFINITY, 1.1e6, END),
    REAL(gravity[2], -INFINITY, -1.1e6, NAN, END),
    INTEGER(method, -1, 2, END),
    REAL(relaxation, 0.99, 2, NAN, END),
    INTEGER(iterations, 0, -1, 1000001, END),
    INTEGER(penalty_period, -1, INT_MIN, END),
    REAL(penalty_mass_factor, -1, 1.1e12, NAN, END),
    REAL(penalty_offset, -1, 1.1e15, NAN, END),
    REAL(penalty_ratio_limit, 0.99, 1.1e6, NAN, END),
    REAL(residual_tolerance, -1e-9, NAN, INFINITY, END),
    REAL(tolerance, -1e-9, NAN, INFINITY, END),
    INTEGER(ncp_points, -1, 129, END),
    INTEGER(check_period, 0, -10, 1000001, END),
    REAL(correction_factor, -0.1, 1.1, NAN, END),
    REAL(slop, -1e-6, 1.1, NAN, END),
    REAL(correction_speed, -1, 1.1e3, NAN, END),
    REAL(restitution_threshold, -1, NAN, INFINITY, END),
    INTEGER(hits, -1, 65, END),
    INTEGER(threads, -1, 1025, END),
};

START_TEST(settings_out_of_range)
{
    const struct bad_setting *bad = &bad_settings[_i];
    for (int k = 0; bad->values[k] != END; ++k) {
        struct sadmm_error error = {SADMM_OK, ""};
        sadmm_settings s = sadmm_settings_default();
        if (bad->integer) *(int *)((char *)&s + bad->offset) = (int)bad->values[k];
        else *(double *)((char *)&s + bad->offset) = bad->values[k];
        ck_assert_msg(sadmm_settings_validate(&s, &error) == SADMM_ERROR_INVALID_ARGUMENT, "%s = %g was taken",
                      bad->name, bad->values[k]);
        char name[32]; /* "gravity[0]" may be named as a whole */
        strcpy(name, bad->name);
        if (strchr(name, '[')) *strchr(name, '[') = 0;
        ck_assert_msg(strstr(error.message, name) && strstr(error.message, "must be"), "%s", error.message);
        ck_assert(error.status == SADMM_ERROR_INVALID_ARGUMENT);
    }
}
END_TEST

START_TEST(settings_at_the_ends_of_their_ranges)
{
    sadmm_settings s = sadmm_settings_default();
    OK(sadmm_settings_validate(&s, NULL));
    s.dt = 1, s.iterations = 1000000, s.penalty_period = 0, s.penalty_mass_factor = 0, s.penalty_offset = 1e15;
    s.penalty_ratio_limit = 1, s.ncp_points = 0, s.check_period = 1, s.correction_factor = 1, s.slop = 0,
    s.correction_speed = 0, s.hits = 64, s.threads = 1024;
    OK(sadmm_settings_validate(&s, NULL));
    s.dt = 1e-6, s.iterations = 1, s.penalty_period = INT_MAX, s.penalty_mass_factor = 1e12, s.penalty_offset = 0;
    s.penalty_ratio_limit = 1e6, s.ncp_points = 128, s.check_period = 1000000, s.correction_factor = 0, s.slop = 1,
                            s.correction_speed = 1e3;
    s.gravity[0] = 1e6, s.gravity[2] = 0;
    OK(sadmm_settings_validate(&s, NULL));
    s.penalty_mass_factor = 0; /* with an offset of 0 there is no penalty */
    ck_assert_int_eq(sadmm_settings_validate(&s, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_msg(strstr(sadmm_last_message(), "penalty_offset"), "%s", sadmm_last_message());
    ck_assert_int_eq(sadmm_settings_take(&s, NULL, NULL), SADMM_ERROR_INVALID_ARGUMENT);
}
END_TEST

/* ---- a problem to be kept ------------------------------------------------------------------------------------ */

struct kept { double A[72], b[12], v[12], impulses[6], lambda[6]; };

/* Two bodies, two contacts, one weld, none of it trivial. */
static sadmm_problem *make(struct kept *given)
{
    sadmm_problem *p;
    sadmm_problem_contact contacts[2];
    sadmm_problem_block block = {.kind = SADMM_BLOCK_HARD, .rows = 2, .body_a = 0, .body_b = 1};
    memset(given, 0, sizeof *given);
    memset(contacts, 0, sizeof contacts);
    for (int i = 0; i < 12; ++i) {
        given->A[36 * (i / 6) + 7 * (i % 6)] = 2 + i;
        given->b[i] = 0.1 * i - 0.3;
        given->v[i] = 1 - 0.2 * i;
    }
    for (int i = 0; i < 6; ++i) given->impulses[i] = 0.01 * (i + 1);
    for (int i = 0; i < 2; ++i) given->lambda[i] = 0.5 - i;
    for (int k = 0; k < 2; ++k) {
        contacts[k].body_a = -1, contacts[k].body_b = k;
        contacts[k].normal[2] = 1;
        contacts[k].arm_b[0] = 0.1 * k, contacts[k].arm_b[2] = -0.2;
        contacts[k].friction = 0.4;
    }
    for (int r = 0; r < 2; ++r) block.jacobian_a[7 * r] = -1, block.jacobian_b[7 * r] = 1;
    OK(sadmm_problem_create(&p));
    OK(sadmm_problem_set_bodies(p, 2, given->A, given->b, given->v));
    OK(sadmm_problem_set_contacts(p, 2, contacts, given->impulses));
    OK(sadmm_problem_set_blocks(p, 1, &block, given->lambda));
    return p;
}

static void check_kept(sadmm_problem *p, const struct kept *given)
{
    struct kept now;
    memset(&now, 0, sizeof now);
    ck_assert(sadmm_problem_body_count(p) == 2 && sadmm_problem_contact_count(p) == 2 &&
              sadmm_problem_block_count(p) == 1);
    OK(sadmm_problem_get_bodies(p, now.A, now.b, now.v));
    OK(sadmm_problem_get_solution(p, now.v, now.impulses, now.lambda));
    ck_assert(memcmp(&now, given, sizeof now) == 0);
}

/* The call is refused with INVALID_ARGUMENT and a message with `part` in it, and the problem stays. */
#define REFUSED(call, part)                                                                             \
    do {                                                                                                \
        ck_assert_int_eq(call, SADMM_ERROR_INVALID_ARGUMENT);                                           \
        ck_assert_msg(strstr(sadmm_problem_message(p), part) != NULL, "%s", sadmm_problem_message(p));  \
        ck_assert_str_eq(sadmm_problem_message(p), sadmm_last_message());                               \
        check_kept(p, &given);                                                                          \
    } while (0)

/* Numbers may change from step to step; everything else is part of what a step consists of. */
START_TEST(settings_are_numbers_or_not)
{
    const sadmm_settings plain = sadmm_settings_default();
    double before[SADMM_SETTING_NUMBERS], after[SADMM_SETTING_NUMBERS];
    sadmm_settings_numbers(&plain, before);
    int at = 0;
#define CHANGE(name)                                                                                   \
    do {                                                                                               \
        sadmm_settings s = plain;                                                                      \
        s.name += 1;                                                                                   \
        ck_assert_msg(sadmm_settings_same_but_numbers(&plain, &s), "%s", #name);                       \
        sadmm_settings_numbers(&s, after);                                                             \
        for (int k = 0; k < SADMM_SETTING_NUMBERS; ++k)                                                \
            ck_assert_msg((before[k] != after[k]) == (k == at && before[k] != s.name), "%s", #name);   \
        ++at;                                                                                          \
    } while (0);
    SADMM_EACH_SETTING_NUMBER(CHANGE)
#undef CHANGE
    static const size_t others[] = {offsetof(sadmm_settings, method), offsetof(sadmm_settings, iterations),
                                    offsetof(sadmm_settings, penalty_period), offsetof(sadmm_settings, check_period),
                                    offsetof(sadmm_settings, penalty_update_warm), offsetof(sadmm_settings, warm_start),
                                    offsetof(sadmm_settings, measure_residuals), offsetof(sadmm_settings, certify),
                                    offsetof(sadmm_settings, recover_wrenches)};
    for (size_t k = 0; k < sizeof others / sizeof *others; ++k) {
        sadmm_settings s = plain;
        *((unsigned char *)&s + others[k]) ^= 1; /* of a bool or an int: another value */
        ck_assert_msg(!sadmm_settings_same_but_numbers(&plain, &s), "setting %zu", k);
    }
    sadmm_settings s = plain, t = plain;
    s.penalty_ratio_limit = 1; /* no update */
    ck_assert(!sadmm_settings_same_but_numbers(&plain, &s));
    s = plain;
    s.tolerance = 0; /* no rule */
    ck_assert(!sadmm_settings_same_but_numbers(&plain, &s));
    t.tolerance = 2e-3;
    ck_assert(sadmm_settings_same_but_numbers(&plain, &t));
    s = plain;
    s.residual_tolerance = 1e-3;
    ck_assert(!sadmm_settings_same_but_numbers(&plain, &s));
}
END_TEST

START_TEST(bad_bodies)
{
    struct kept given;
    sadmm_problem *p = make(&given);
    double A[72], b[12], v[12];
    memcpy(A, given.A, sizeof A);
    memcpy(b, given.b, sizeof b);
    memcpy(v, given.v, sizeof v);

    REFUSED(sadmm_problem_set_bodies(p, -1, A, b, v), "count = -1");
    ck_assert_int_eq(sadmm_problem_set_bodies(p, (1 << 27) + 1, A, b, v), SADMM_ERROR_LIMIT);
    ck_assert_msg(strstr(sadmm_problem_message(p), "134217729"), "%s", sadmm_problem_message(p));
    check_kept(p, &given);
    REFUSED(sadmm_problem_set_bodies(p, 2, NULL, b, v), "A = NULL");
    REFUSED(sadmm_problem_set_bodies(p, 2, A, NULL, v), "b = NULL");

    A[36 + 20] = NAN;
    REFUSED(sadmm_problem_set_bodies(p, 2, A, b, v), "A[1][20] = nan");
    A[36 + 20] = 0.1; /* entry (3, 2) alone: not symmetric */
    REFUSED(sadmm_problem_set_bodies(p, 2, A, b, v), "A[1]: entries (3, 2) = 0.1 and (2, 3) = 0: must be symmetric");
    A[36 + 20] = A[36 + 15] = 1000; /* symmetric, indefinite */
    REFUSED(sadmm_problem_set_bodies(p, 2, A, b, v), "A[1]: must be positive definite");
    A[36 + 20] = A[36 + 15] = 0;
    A[0] = 0;
    REFUSED(sadmm_problem_set_bodies(p, 2, A, b, v), "A[0]: must be positive definite");
    A[0] = -2;
    REFUSED(sadmm_problem_set_bodies(p, 2, A, b, v), "A[0]: must be positive definite");
    A[0] = 2;
    A[0] = A[7] = A[1] = A[6] = 3; /* singular */
    REFUSED(sadmm_problem_set_bodies(p, 2, A, b, v), "A[0]: must be positive definite");
    memcpy(A, given.A, sizeof A);
    b[7] = INFINITY;
    REFUSED(sadmm_problem_set_bodies(p, 2, A, b, v), "b[1][1] = inf");
    b[7] = 0;
    v[11] = -INFINITY;
    REFUSED(sadmm_problem_set_bodies(p, 2, A, b, v), "v0[1][5] = -inf");
    v[11] = 0;
    A[1] = 1e-12, A[6] = 0; /* asymmetric by rounding: taken */
    OK(sadmm_problem_set_bodies(p, 2, A, b, v));
    double back[72];
    OK(sadmm_problem_get_bodies(p, back, NULL, NULL));
    ck_assert(back[1] == 0.5e-12 && back[6] == 0.5e-12);
    sadmm_problem_destroy(p);
}
END_TEST

START_TEST(bad_contacts)
{
    struct kept given;
    sadmm_problem *p = make(&given);
    const sadmm_problem_contact good = {.body_a = 0, .body_b = 1, .normal = {0, 0.6, 0.8}, .friction = 0.5};
    double impulses[6] = {0, 0, 0, 0, NAN, 0};
    sadmm_problem_contact c[2] = {good, good};

#define BAD(field, value, part)                                             \
    do {                                                                    \
        c[1].field = value;                                                 \
        REFUSED(sadmm_problem_set_contacts(p, 2, c, NULL), part);           \
        c[1] = good;                                                        \
    } while (0)

    BAD(body_a, 2, "contacts[1].body_a = 2: must be in [-1, 1]");
    BAD(body_a, -2, "contacts[1].body_a = -2: must be in [-1, 1]");
    BAD(body_b, INT_MAX, "contacts[1].body_b = 2147483647");
    BAD(body_b, 0, "contacts[1].body_a = body_b = 0");
    c[1].body_a = -1;
    BAD(body_b, -1, "contacts[1].body_a = body_b = -1");
    BAD(normal[2], 0.8001, "contacts[1].normal: length = 1.00");
    BAD(normal[1], NAN, "contacts[1].normal[1] = nan");
    c[1].normal[1] = 0;
    BAD(normal[2], 0, "contacts[1].normal: length = 0");
    BAD(arm_a[0], NAN, "contacts[1].arm_a[0] = nan");
    BAD(arm_b[2], INFINITY, "contacts[1].arm_b[2] = inf");
    BAD(velocity[1], NAN, "contacts[1].velocity[1] = nan");
    BAD(velocity[2], 0.5, "contacts[1].velocity = (0, 0, 0.5): must be 0, for neither body is -1");
    BAD(error, NAN, "contacts[1].error = nan");
    BAD(error, -INFINITY, "contacts[1].error = -inf");
    BAD(friction, -0.1, "contacts[1].friction = -0.1: must be in [0, 1e+60]");
    BAD(friction, NAN, "contacts[1].friction = nan");
    BAD(friction, INFINITY, "contacts[1].friction = inf");
#undef BAD
    REFUSED(sadmm_problem_set_contacts(p, 2, c, impulses), "impulses0[1][1] = nan");
    REFUSED(sadmm_problem_set_contacts(p, 2, NULL, NULL), "contacts = NULL");
    REFUSED(sadmm_problem_set_contacts(p, -5, c, NULL), "count = -5");
    ck_assert_int_eq(sadmm_problem_set_contacts(p, (1 << 28) + 1, c, NULL), SADMM_ERROR_LIMIT);
    check_kept(p, &given);

    c[1].body_a = -1;
    c[1].arm_a[0] = NAN; /* ignored on the static side */
    OK(sadmm_problem_set_contacts(p, 2, c, NULL));
    OK(sadmm_problem_get_contact(p, 1, &c[0]));
    ck_assert(c[0].arm_a[0] == 0);
    OK(sadmm_problem_set_contacts(p, 0, NULL, NULL));
    ck_assert_int_eq(sadmm_problem_contact_count(p), 0);
    sadmm_problem_destroy(p);
}
END_TEST

START_TEST(bad_blocks)
{
    struct kept given;
    sadmm_problem *p = make(&given);
    sadmm_problem_block good = {
        .kind = SADMM_BLOCK_SOFT, .rows = 3, .body_a = 0, .body_b = 1, .jacobian_a = {1}, .jacobian_b = {-1}};
    double lambda[12] = {0};
    sadmm_problem_block c[2] = {good, good};

#define BAD(field, value, part)                                   \
    do {                                                          \
        c[1].field = value;                                       \
        REFUSED(sadmm_problem_set_blocks(p, 2, c, NULL), part);   \
        c[1] = good;                                              \
    } while (0)

    BAD(kind, (sadmm_block_kind)4, "blocks[1].kind = 4: must be in [0, 3]");
    BAD(kind, (sadmm_block_kind)-1, "blocks[1].kind = -1");
    const sadmm_problem_block soft = good;
    good.kind = SADMM_BLOCK_ROWS;
    for (int r = 0; r < 6; ++r) good.gain[r] = 1;
    c[1] = good;
    BAD(gain[1], -1, "blocks[1].gain[1] = -1: must be >= 0");
    BAD(gain[2], 0, "blocks[1].gain[2] = blocks[1].compliance[2] = 0: one must be > 0");
    BAD(compliance[0], NAN, "blocks[1].compliance[0] = nan");
    BAD(lower[1], 2, "blocks[1].lower[1] = 2, upper[1] = 0: must be lower <= upper");
    BAD(upper[1], NAN, "upper[1] = nan");
    BAD(lower[0], INFINITY, "blocks[1].lower[0] = inf");
    good = soft;
    c[1] = good;
    BAD(rows, 0, "blocks[1].rows = 0: must be in [1, 6]");
    BAD(rows, 7, "blocks[1].rows = 7: must be in [1, 6]");
    c[1].kind = SADMM_BLOCK_CONTACT;
    BAD(rows, 2, "blocks[1].rows = 2: must be 3 for a contact");
    BAD(body_a, 2, "blocks[1].body_a = 2");
    BAD(body_b, -3, "blocks[1].body_b = -3");
    BAD(body_b, 0, "blocks[1].body_a = body_b = 0");
    BAD(jacobian_a[17], NAN, "blocks[1].jacobian_a[17] = nan");
    BAD(jacobian_b[0], INFINITY, "blocks[1].jacobian_b[0] = inf");
    BAD(error[2], NAN, "blocks[1].error[2] = nan");
    BAD(stiffness[1], -1, "blocks[1].stiffness[1] = -1: must be >= 0");
    BAD(stiffness[1], INFINITY, "blocks[1].stiffness[1] = inf");
    BAD(damping[0], -1e-3, "blocks[1].damping[0] = -0.001");
    BAD(damping[0], NAN, "blocks[1].damping[0] = nan");
    c[1].kind = SADMM_BLOCK_CONTACT;
    BAD(friction, -1, "blocks[1].friction = -1");
    c[1].kind = SADMM_BLOCK_CONTACT;
    c[1].jacobian_b[0] = 0;
    BAD(jacobian_a[0], 0, "blocks[1]: the normal row");
#undef BAD
    lambda[8] = NAN;
    REFUSED(sadmm_problem_set_blocks(p, 2, c, lambda), "lambda0[1][2] = nan");
    REFUSED(sadmm_problem_set_blocks(p, 2, NULL, NULL), "blocks = NULL");
    REFUSED(sadmm_problem_set_blocks(p, -1, c, NULL), "count = -1");
    ck_assert_int_eq(sadmm_problem_set_blocks(p, INT_MAX, c, NULL), SADMM_ERROR_LIMIT);
    check_kept(p, &given);

    /* What the rows, the kind or a static side leave unused is not looked at, and reads back as 0. */
    lambda[8] = 1, lambda[9] = NAN;
    c[1].jacobian_a[18] = c[1].error[3] = c[1].stiffness[5] = c[1].friction = NAN;
    c[0].body_b = -1;
    c[0].jacobian_b[3] = NAN;
    c[0].kind = SADMM_BLOCK_HARD;
    c[0].damping[0] = -1;
    OK(sadmm_problem_set_blocks(p, 2, c, lambda));
    sadmm_problem_block back;
    double l[12];
    OK(sadmm_problem_get_block(p, 1, &back));
    ck_assert(back.jacobian_a[18] == 0 && back.error[3] == 0 && back.stiffness[5] == 0 && back.friction == 0);
    OK(sadmm_problem_get_block(p, 0, &back));
    ck_assert(back.jacobian_b[3] == 0 && back.damping[0] == 0);
    OK(sadmm_problem_get_solution(p, NULL, NULL, l));
    ck_assert(l[8] == 1 && l[9] == 0);
    sadmm_problem_destroy(p);
}
END_TEST

START_TEST(bad_solutions_indices_and_settings)
{
    struct kept given;
    sadmm_problem *p = make(&given);
    double v[12] = {0}, r[6] = {0}, l[6] = {0};
    sadmm_problem_contact contact;
    sadmm_problem_block block;
    sadmm_settings s = sadmm_settings_default();

    v[9] = NAN;
    REFUSED(sadmm_problem_set_solution(p, v, r, l), "velocities[1][3] = nan");
    v[9] = 0, r[2] = INFINITY;
    REFUSED(sadmm_problem_set_solution(p, v, r, l), "impulses[0][2] = inf");
    r[2] = 0, l[1] = NAN;
    REFUSED(sadmm_problem_set_solution(p, v, r, l), "block_lambda[0][1] = nan");
    REFUSED(sadmm_problem_get_contact(p, 2, &contact), "index = 2: must be in [0, 1]");
    REFUSED(sadmm_problem_get_contact(p, -1, &contact), "index = -1");
    REFUSED(sadmm_problem_get_contact(p, 0, NULL), "NULL");
    REFUSED(sadmm_problem_get_block(p, 1, &block), "index = 1: must be in [0, 0]");
    REFUSED(sadmm_problem_get_block(p, 0, NULL), "NULL");
    REFUSED(sadmm_problem_certify(p, NULL), "certificate = NULL");
    REFUSED(sadmm_problem_solve(p, SADMM_BACKEND_CPU, SADMM_F64, NULL, NULL), "settings = NULL");
    s.dt = -1;
    REFUSED(sadmm_problem_solve(p, SADMM_BACKEND_CPU, SADMM_F64, &s, NULL), "settings.dt = -1: must be in [1e-06, 1]");
    sadmm_problem_destroy(p);
}
END_TEST

START_TEST(null_problems)
{
    sadmm_certificate c;
    sadmm_settings s = sadmm_settings_default();
    double x[36];
    sadmm_problem_contact contact;
    sadmm_problem_block block;
    memset(x, 0, sizeof x);
    memset(&contact, 0, sizeof contact);
    memset(&block, 0, sizeof block);
    ck_assert_int_eq(sadmm_problem_create(NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_set_bodies(NULL, 1, x, x, x), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_set_contacts(NULL, 1, &contact, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_set_blocks(NULL, 1, &block, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_get_bodies(NULL, x, x, x), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_get_contact(NULL, 0, &contact), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_get_block(NULL, 0, &block), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_get_solution(NULL, x, x, x), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_set_solution(NULL, x, x, x), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_certify(NULL, &c), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_solve(NULL, SADMM_BACKEND_CPU, SADMM_F64, &s, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert(strstr(sadmm_last_message(), "problem = NULL"));
    ck_assert(sadmm_problem_body_count(NULL) == 0 && sadmm_problem_contact_count(NULL) == 0 &&
              sadmm_problem_block_count(NULL) == 0);
    ck_assert_str_eq(sadmm_problem_message(NULL), "");
}
END_TEST

/* ---- memory -------------------------------------------------------------------------------------------------- */

/* Run `call` with the first, second, ... allocation failing until it goes through; each failure leaves the problem as
 * it was. */
#define EVERY_ALLOCATION(call, least)                                                                 \
    do {                                                                                              \
        int failures = 0;                                                                             \
        for (;; ++failures) {                                                                         \
            sadmm_test_fail_allocations_after(failures);                                              \
            sadmm_status status = (call);                                                             \
            sadmm_test_fail_allocations_after(-1);                                                    \
            if (status == SADMM_OK) break;                                                            \
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);                                      \
            ck_assert_msg(strstr(sadmm_last_message(), "out of memory"), "%s", sadmm_last_message()); \
            ck_assert_int_lt(failures, 1000);                                                         \
            check_kept(p, &given);                                                                    \
        }                                                                                             \
        ck_assert_int_ge(failures, least); /* the path was really taken */                            \
    } while (0)

START_TEST(allocations_that_fail)
{
    struct kept given;
    sadmm_problem *p = NULL, *q = make(&given);
    for (int failures = 0;; ++failures) {
        sadmm_test_fail_allocations_after(failures);
        sadmm_status status = sadmm_problem_create(&p);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) break;
        ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
        ck_assert_ptr_null(p);
    }
    sadmm_problem_destroy(p);
    p = q;

    /* Large enough for buffers that grow to have to. */
    enum { MANY = 64 };
    static sadmm_problem_contact contacts[MANY];
    static sadmm_problem_block blocks[MANY];
    static double A[36 * MANY], b[6 * MANY];
    for (int k = 0; k < MANY; ++k) {
        contacts[k] = (sadmm_problem_contact){.body_a = -1, .body_b = 1, .normal = {1, 0, 0}};
        blocks[k] = (sadmm_problem_block){.kind = SADMM_BLOCK_HARD, .rows = 1, .body_a = -1, .jacobian_b = {1}};
        for (int i = 0; i < 6; ++i) A[36 * k + 7 * i] = 1;
    }
    EVERY_ALLOCATION(sadmm_problem_set_contacts(p, MANY, contacts, NULL), 2);
    sadmm_problem_destroy(p);
    p = make(&given);
    EVERY_ALLOCATION(sadmm_problem_set_blocks(p, MANY, blocks, NULL), 2);
    sadmm_problem_destroy(p);
    p = make(&given);
    EVERY_ALLOCATION(sadmm_problem_set_bodies(p, MANY, A, b, NULL), 3);
    sadmm_problem_destroy(p);
    p = make(&given);
    sadmm_certificate c;
    EVERY_ALLOCATION(sadmm_problem_certify(p, &c), 1);
    sadmm_problem_destroy(p);
}
END_TEST

/* The context, its buffers and the certificate, a backend at a time; a second solve of the same size needs none. */
START_TEST(solves_without_memory)
{
    static const struct { sadmm_backend backend; sadmm_precision precision; sadmm_method method; } runs[] = {
        {SADMM_BACKEND_REF, SADMM_F64, SADMM_METHOD_PAPER}, {SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_PAPER},
        {SADMM_BACKEND_CPU, SADMM_F32, SADMM_METHOD_PAPER}, {SADMM_BACKEND_REF, SADMM_F64, SADMM_METHOD_FAST},
        {SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_FAST}, {SADMM_BACKEND_CPU, SADMM_F32, SADMM_METHOD_FAST}};
    struct kept given;
    sadmm_problem *p = make(&given);
    sadmm_settings s = sadmm_settings_default();
    sadmm_solve_report report;
    s.method = runs[_i].method;
    s.threads = 2;
    EVERY_ALLOCATION(sadmm_problem_solve(p, runs[_i].backend, runs[_i].precision, &s, &report), 3);
    sadmm_test_fail_allocations_after(0);
    sadmm_status status = sadmm_problem_solve(p, runs[_i].backend, runs[_i].precision, &s, &report);
    sadmm_test_fail_allocations_after(-1);
    OK(status);
    sadmm_problem_destroy(p);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("inputs");
    TCase *cases = tcase_create("inputs");
    tcase_add_loop_test(cases, settings_out_of_range, 0, sizeof bad_settings / sizeof *bad_settings);
    tcase_add_test(cases, settings_at_the_ends_of_their_ranges);
    tcase_add_test(cases, settings_are_numbers_or_not);
    tcase_add_test(cases, bad_bodies);
    tcase_add_test(cases, bad_contacts);
    tcase_add_test(cases, bad_blocks);
    tcase_add_test(cases, bad_solutions_indices_and_settings);
    tcase_add_test(cases, null_problems);
    tcase_add_test(cases, allocations_that_fail);
    tcase_add_loop_test(cases, solves_without_memory, 0, 6);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
