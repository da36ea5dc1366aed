/* Constraints given by rows: the law of a row (core/math/row.h) against cases solved by hand, bounds that hold to the bit, every
 * table against the literal backend, and that rows cost other islands nothing: not one bit, and not the fast form of their
 * bodies. */
#include <check.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/model/rows.h"
#include "core/model/system_math.h"
#include "core/solve/certificate.h"
#include "core/solve/schedule.h"
#include "contact_problems.h"
#include "run_suite.h"
#include "runner.h"

static const struct sadmm_kernels *tables[8]; /* all that have rows with bounds */
static int table_count;

static void collect_tables(void)
{
    for (size_t i = 0; sadmm_kernels_at(i) && table_count < 8; ++i)
        if (sadmm_kernels_at(i)->backend != SADMM_BACKEND_CUDA) tables[table_count++] = sadmm_kernels_at(i);
}

static const sadmm_method methods[] = {SADMM_METHOD_PAPER, SADMM_METHOD_FAST};

/* A solve of a system as it is. */
static struct sadmm_solve_report solve(const struct sadmm_kernels *table, struct sadmm_system *system,
                                       const sadmm_settings *settings)
{
    struct sadmm_context *c = NULL;
    struct sadmm_error error = {SADMM_OK, ""};
    struct sadmm_solve_report report;
    struct sadmm_plan plan = sadmm_plan_make(system, settings);
    ck_assert_int_eq(table->create(0, &c, &error), SADMM_OK);
    sadmm_status status = sadmm_schedule_solve(table, c, system, settings, &plan, &report, &error);
    ck_assert_msg(status == SADMM_OK, "%s", error.message);
    table->destroy(c);
    return report;
}

static sadmm_settings settings_of(sadmm_method method, int iterations)
{
    sadmm_settings s = sadmm_settings_default();
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
} cases[] = {
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
enum { CASES = sizeof cases / sizeof *cases };

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

/* Slowest is a force at its bound in the method `paper`: v goes by m / (m + beta) = 0.94 an iteration. What is left is rounding. */
static double close_enough(const struct sadmm_kernels *table) { return table->precision == SADMM_F32 ? 2e-5 : 1e-12; }

static void check_law(const struct sadmm_kernels *table, sadmm_method method, int k, bool on_b)
{
    const double mass = MASS, sign = on_b ? 1 : -1;
    double b[6] = {0};
    b[0] = sign * cases[k].b;
    struct sadmm_system *system = bodies_of(&mass, b, 1);
    int32_t r = sadmm_rows_add(system->rows, 1, on_b ? -1 : 0, on_b ? 0 : -1);
    (on_b ? system->rows->jacobian_b : system->rows->jacobian_a)[0] = sign; /* x = sign v */
    set_law(system->rows, r, &cases[k].law);
    const sadmm_settings settings = settings_of(method, 1000);
    solve(table, system, &settings);
    const double lambda = system->rows->lambda[0], x = sign * system->velocity[0], tolerance = close_enough(table);
    ck_assert_msg(fabs(lambda - cases[k].lambda) <= tolerance, "case %d: lambda = %.17g", k, lambda);
    ck_assert_msg(fabs(x - cases[k].v) <= tolerance, "case %d: x = %.17g", k, x);
}

START_TEST(laws_hold)
{
    for (int m = 0; m < 2; ++m)
        for (int k = 0; k < CASES; ++k)
            for (int side = 0; side < 2; ++side) check_law(tables[_i], methods[m], k, side);
}
END_TEST

/* Six laws in one constraint of two bodies, a coordinate each, so that all depend on their own row alone: x = v_b - v_a =
 * x_free + w lambda with w = 1/m_a + 1/m_b, and lambda solves the law with that. Two of the rows are coupled in the method
 * `fast`. */
START_TEST(one_constraint_has_many_laws)
{
    static const struct law laws[2][6] = {
        {HARD(0.5), LIMIT(0.1), MOTOR(2, 0.5), DRY(0.125), SOFT(2, 3, 0.1), HARD(-0.25)},
        {LIMIT(5), SOFT(0, 4, 0), MOTOR(-1, 8), {3, 1, 1, -0.5, 0.5}, DRY(64), SOFT(50, 0, 0.05)},
    };
    static const double push[12] = {1, -2, 3, 0.5, 0.2, -0.3, 2, -4, -1, 0.1, 0.7, 0.9}, masses[2] = {1.5, 4};
    const struct sadmm_kernels *table = tables[_i];
    const double w = 1 / masses[0] + 1 / masses[1];
    for (int m = 0; m < 2; ++m)
        for (int set = 0; set < 2; ++set) {
            struct sadmm_system *system = bodies_of(masses, push, 2);
            struct sadmm_rows *rows = system->rows;
            const sadmm_settings settings = settings_of(methods[m], 1000);
            sadmm_rows_add(rows, 6, 0, 1);
            for (int r = 0; r < 6; ++r) {
                rows->jacobian_a[7 * r] = -1, rows->jacobian_b[7 * r] = 1;
                set_law(rows, r, &laws[set][r]);
            }
            solve(table, system, &settings);
            for (int r = 0; r < 6; ++r) {
                const struct law *law = &laws[set][r];
                double x_free = push[6 + r] / masses[1] - push[r] / masses[0];
                double wanted = -(law->gain * x_free + law->bias) / (law->compliance + law->gain * w);
                wanted = fmin(fmax(wanted, law->lo), law->hi);
                ck_assert_msg(fabs(rows->lambda[r] - wanted) <= close_enough(table), "set %d, row %d: %.17g, not %.17g", set, r,
                              rows->lambda[r], wanted);
                ck_assert_double_eq_tol(system->velocity[6 + r], (push[6 + r] + wanted) / masses[1], close_enough(table));
            }
        }
}
END_TEST

/* Of what the law does not allow, the certificate is the velocity by which an exact solve of the row alone would move it. */
START_TEST(certificate_knows_bounds)
{
    static const struct {
        struct law law;
        double v, lambda, missed;
    } wrong[] = {
        {LIMIT(0.5), -1.5, 0, 1},          /* 1 m/s too deep */
        {LIMIT(0.5), 1, 0, 0},             /* apart, and carries nothing */
        {LIMIT(0.5), 1, 1, 0.5},           /* apart, but carries 1 N s: letting it go is 1/m */
        {LIMIT(0.5), -0.5, 7, 0},          /* touches, carries anything */
        {LIMIT(0.5), -0.5, -1, 0.5},       /* pulls */
        {MOTOR(2, 3), 1, 3, 0},            /* saturated and slow */
        {MOTOR(2, 3), 1, 1, 1},            /* slow, though it could: 2 N s more are 1 m/s */
        {MOTOR(2, 3), 5, 3, 3},            /* pushes what is too fast: to 2 m/s it is 3 */
        {DRY(3), 1, -3, 0},                /* slips against the whole friction */
        {DRY(3), 1, 3, 1},                 /* slips with it */
        {DRY(3), 0, 2, 0},                 /* holds */
        {{2, 2, 1, 0, INFINITY}, 2, 0, 0}, /* soft stop, away */
        {{2, 2, 1, 0, INFINITY}, -3, 0, 1}, /* missing 4 of lambda + 2 + 2 x: 4 w/(1 + 2 w), w = 1/2 */
    };
    const double mass = MASS, b[6] = {0};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; ++k) {
        struct sadmm_system *system = bodies_of(&mass, b, 1);
        struct sadmm_error error;
        sadmm_certificate certificate;
        sadmm_rows_add(system->rows, 1, -1, 0);
        system->rows->jacobian_b[0] = 1;
        system->rows->lambda[0] = wrong[k].lambda;
        system->velocity[0] = wrong[k].v;
        set_law(system->rows, 0, &wrong[k].law);
        ck_assert_int_eq(sadmm_certify(system, NULL, &certificate, &error), SADMM_OK);
        ck_assert_msg(fabs(certificate.ncp_max - wrong[k].missed) <= 1e-15, "%zu: %.17g", k, certificate.ncp_max);
        ck_assert(certificate.siconos == -1); /* it has no such rows */
    }
}
END_TEST

/* ---- bounds, iterate by iterate; tables against ref ----------------------------------------------------------------- */

/* Bodies, contacts and rows of all kinds; some hard and soft ones get bounds, so that constraints mix them. */
static struct contact_problem *bounded_problem(uint64_t seed)
{
    struct contact_problem *p = contact_problem_mixed(seed, 0.5);
    sadmm_settings s = sadmm_settings_default();
    contact_problem_seed(42);
    contact_problem_raw(p, &s, 0.1);
    return p;
}

static void bound_rows(struct sadmm_rows *rows)
{
    for (size_t k = 0; k < rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &rows->constraints[k];
        for (int32_t r = constraint->first; r < constraint->first + constraint->count && !constraint->cone; ++r) {
            const double most = ldexp(1, -(r % 5)); /* exact in either precision */
            if (r % 3 == 0) rows->lo[r] = 0;
            if (r % 3 == 1) rows->lo[r] = -most, rows->hi[r] = most;
        }
    }
}

static int at_bounds(const struct sadmm_rows *rows)
{
    int count = 0;
    for (size_t k = 0; k < rows->constraint_count; ++k)
        for (int32_t r = rows->constraints[k].first; r < rows->constraints[k].first + rows->constraints[k].count; ++r) {
            if (rows->constraints[k].cone) continue;
            ck_assert(rows->lambda[r] >= rows->lo[r] && rows->lambda[r] <= rows->hi[r]);
            count += rows->lambda[r] == rows->lo[r] || rows->lambda[r] == rows->hi[r];
        }
    return count;
}

/* After any number of iterations, with weights that were taken from the multipliers found so far; and what a table has is what the
 * literal backend has. An iteration takes two states no further apart in its own norm; masses over three decades make that
 * a factor of some 30 in velocities, and each of the solve's five sets of weights passes it on once. Measured: 6e-6, 2e-14. */
START_TEST(bounds_hold_in_every_iterate)
{
    static const int iterations[] = {1, 2, 3, 5, 8, 30, 80};
    const struct sadmm_kernels *table = tables[_i];
    const double tolerance = 1000 * (table->precision == SADMM_F32 ? FLT_EPSILON : DBL_EPSILON);
    for (int m = 0; m < 2; ++m)
        for (size_t n = 0; n < sizeof iterations / sizeof *iterations; ++n) {
            struct contact_problem *own = bounded_problem(3), *ref = bounded_problem(3);
            sadmm_settings settings = settings_of(methods[m], iterations[n]);
            settings.threads = 2;
            settings.penalty_period = 0; /* by residuals, whose rounding would be a tolerance of its own */
            bound_rows(&own->rows);
            bound_rows(&ref->rows);
            solve(table, &own->system, &settings);
            solve(literal(), &ref->system, &settings);
            ck_assert_int_ge(at_bounds(&own->rows), 1);
            struct spread v = {0, 0}, lambda = {0, 0};
            for (int32_t i = 0; i < 6 * ref->system.body_count; ++i)
                add(&v, own->system.velocity[i], ref->system.velocity[i]);
            for (size_t r = 0; r < ref->rows.row_count; ++r) add(&lambda, own->rows.lambda[r], ref->rows.lambda[r]);
            ck_assert_msg(relative(v) <= tolerance && relative(lambda) <= tolerance, "method %d, %d iterations: v %g, lambda %g",
                          m, iterations[n], relative(v), relative(lambda));
            contact_problem_free(own);
            contact_problem_free(ref);
        }
}
END_TEST

/* ---- other islands ---------------------------------------------------------------------------------------------------- */

enum { TOWERS = 7, TALL = 3, JOINED = TALL * 3 }; /* the two bodies from JOINED on lie between towers */

static const double up[3] = {0, 0, 1};

static void stand(struct contact_problem *p, int32_t below, int32_t box, double x, double z)
{
    for (int i = 0; i < 4; ++i)
        contact_problem_touch(p, below, box, (double[3]){x + (i & 1 ? 0.1 : -0.1), i & 2 ? 0.1 : -0.1, z}, up, 1e-5 * i, 0.4, 0);
}

/* Towers, and between them two bodies, one on the other, with a hard block or without. Every island is a tower. */
static struct contact_problem *towers(bool joined)
{
    struct contact_problem *p = contact_problem_new();
    for (int t = 0; t < TOWERS; ++t) {
        const int count = t == 3 ? 2 : TALL;
        for (int i = 0; i < count; ++i) {
            const double x = 0.5 * t, z = 0.2 * i;
            const int32_t box = contact_problem_box(p, 1 + 0.3 * i, 0.1, 0.1, 0.1, x, 0, z + 0.1);
            stand(p, i ? box - 1 : -1, box, x, z);
            p->rigid[box].velocity[2] = t == 5 ? -2 : 0; /* lands */
        }
    }
    if (joined) {
        sadmm_problem_block *block = contact_problem_block(p, SADMM_BLOCK_HARD, 2, JOINED, JOINED + 1);
        for (int r = 0; r < 2; ++r) block->jacobian_a[7 * r] = -1, block->jacobian_b[7 * r] = 1;
        block->error[0] = 0.3;
    }
    contact_problem_rows(p);
    return p;
}

static int32_t run_towers(const struct sadmm_kernels *table, struct contact_problem *p, sadmm_method method, bool warm,
                          int threads)
{
    sadmm_settings settings = settings_of(method, warm ? 5 : 45); /* cold: weights are taken again three times */
    settings.threads = threads;
    settings.warm_start = warm;
    settings.penalty_period = 0; /* (15) is one ratio for the whole system, by its largest residuals */
    contact_problem_seed(7);
    if (warm) contact_problem_warm(p, 0.3, 1);
    else p->system.first = true; /* loads are predicted where they can be */
    return solve(table, &p->system, &settings).limited;
}

START_TEST(other_islands_keep_every_bit)
{
    const struct sadmm_kernels *table = tables[_i];
    int limited = 0;
    sadmm_test_force_threads(true);
    for (int m = 0; m < 2; ++m)
        for (int warm = 0; warm < 2; ++warm)
            for (int threads = 1; threads <= 3; ++threads) {
                struct contact_problem *without = towers(false), *with = towers(true);
                bool moved = false;
                const int32_t some = run_towers(table, without, methods[m], warm, 1);
                limited += run_towers(table, with, methods[m], warm, threads);
                ck_assert_int_le(some, TOWERS);
                for (int32_t i = 0; i < without->system.body_count; ++i) {
                    bool same = memcmp(with->system.velocity + 6 * i, without->system.velocity + 6 * i, 6 * sizeof(double)) == 0;
                    if (i == JOINED || i == JOINED + 1) moved = moved || !same;
                    else ck_assert_msg(same, "method %d, warm %d, %d threads: body %d", m, warm, threads, i);
                }
                ck_assert(moved); /* the block is felt */
                for (size_t k = 0; k < without->contacts.pair_count; ++k) {
                    const struct sadmm_contact_pair *pair = &without->contacts.pairs[k];
                    if (pair->body_b == JOINED || pair->body_b == JOINED + 1) continue;
                    for (int32_t i = pair->first; i < pair->first + pair->count; ++i)
                        ck_assert(memcmp(with->contacts.points[i].impulse, without->contacts.points[i].impulse,
                                         3 * sizeof(double)) == 0);
                }
                contact_problem_free(without);
                contact_problem_free(with);
            }
    ck_assert_int_gt(limited, 0); /* the limit of energies was at work beside the rows */
}
END_TEST

/* A, b and e of a step, as sadmm_world_freeze gives them, take the form of the world's bodies: the same bits in the method
 * `paper`. (`fast` knows that a world's step is one of many.) */
START_TEST(frozen_problems_keep_the_fast_form)
{
    const struct sadmm_kernels *table = tables[_i];
    struct contact_problem *world = contact_problem_pyramid(5, 0.5), *frozen = contact_problem_pyramid(5, 0.5);
    const sadmm_settings settings = settings_of(SADMM_METHOD_PAPER, 40);
    contact_problem_raw(frozen, &settings, 0);
    solve(table, &world->system, &settings);
    solve(table, &frozen->system, &settings);
    ck_assert(memcmp(world->system.velocity, frozen->system.velocity,
                     6 * (size_t)world->system.body_count * sizeof(double)) == 0);
    contact_problem_free(world);
    contact_problem_free(frozen);
}
END_TEST

/* ---- the store ---------------------------------------------------------------------------------------------------- */

START_TEST(blocks_become_rows_and_back)
{
    struct sadmm_rows rows = {0};
    sadmm_problem_block in = {.kind = SADMM_BLOCK_SOFT, .rows = 2, .body_a = 3, .body_b = -1, .jacobian_a = {1, 2, 3}}, out;
    const double lambda[6] = {4, 5, 6};
    in.stiffness[0] = 2, in.error[0] = 0.25, in.damping[1] = 7;
    in.jacobian_b[0] = NAN; /* of the static world: not read */
    ck_assert(sadmm_rows_add_block(&rows, &in, lambda));
    ck_assert(rows.bias[0] == 0.5 && rows.gain[0] == 0 && rows.compliance[0] == 1 && rows.gain[1] == 7 && rows.bias[1] == 0);
    ck_assert(rows.lambda[0] == 4 && rows.lambda[1] == 5 && rows.jacobian_a[2] == 3 && rows.jacobian_b[0] == 0);
    ck_assert(sadmm_row_acts(&rows, 0) && !sadmm_row_acts(&rows, 1) && !sadmm_row_is_coupled(&rows, 0));
    ck_assert(sadmm_rows_as_block(&rows, 0, &out));
    ck_assert(out.kind == SADMM_BLOCK_SOFT && out.rows == 2 && out.body_a == 3 && out.body_b == -1);
    ck_assert(out.stiffness[0] * out.error[0] == 0.5 && out.damping[0] == 0 && out.damping[1] == 7);

    in.kind = SADMM_BLOCK_HARD;
    ck_assert(sadmm_rows_add_block(&rows, &in, NULL));
    ck_assert(rows.constraints[1].first == 2 && rows.row_count == 4 && rows.lambda[2] == 0 && rows.bias[2] == 0.25);
    ck_assert(sadmm_row_is_coupled(&rows, 2) && sadmm_rows_as_block(&rows, 1, &out) && out.kind == SADMM_BLOCK_HARD);
    sadmm_row_limit(&rows, 3, 0);
    ck_assert(!sadmm_row_is_coupled(&rows, 3) && !sadmm_rows_as_block(&rows, 1, &out));
    sadmm_row_motor(&rows, 3, 2, 5);
    ck_assert(rows.bias[3] == -2 && rows.lo[3] == -5 && rows.hi[3] == 5);

    const size_t room = rows.row_capacity;
    for (size_t k = rows.row_count; k < room; ++k) ck_assert_int_ge(sadmm_rows_add(&rows, 1, 0, -1), 0);
    for (long left = 0; left < 9; ++left) { /* of nine arrays; the first one may have room yet */
        sadmm_test_fail_allocations_after(left);
        if (sadmm_rows_add(&rows, 6, 0, -1) >= 0) break;
        ck_assert(rows.row_count == room && rows.lambda[0] == 4 && left < 9);
    }
    sadmm_test_fail_allocations_after(-1);
    ck_assert(rows.row_count == room + 6 && rows.lambda[0] == 4 && rows.gain[room] == 1 && rows.hi[room] == INFINITY);
    sadmm_rows_free(&rows);
    ck_assert(rows.row_count == 0 && rows.lambda == NULL);
}
END_TEST

int main(void)
{
    collect_tables();
    Suite *suite = suite_create("rows");
    TCase *laws = tcase_create("laws"), *islands = tcase_create("islands"), *store = tcase_create("store");
    tcase_set_timeout(laws, 60);
    tcase_set_timeout(islands, 60);
    tcase_add_loop_test(laws, laws_hold, 0, table_count);
    tcase_add_loop_test(laws, one_constraint_has_many_laws, 0, table_count);
    tcase_add_test(laws, certificate_knows_bounds);
    tcase_add_loop_test(laws, bounds_hold_in_every_iterate, 0, table_count);
    tcase_add_loop_test(islands, other_islands_keep_every_bit, 0, table_count);
    tcase_add_loop_test(islands, frozen_problems_keep_the_fast_form, 0, table_count);
    tcase_add_test(store, blocks_become_rows_and_back);
    suite_add_tcase(suite, laws);
    suite_add_tcase(suite, islands);
    suite_add_tcase(suite, store);
    return run_suite(suite);
}
