/* Constraints given by rows: the law of a row (core/math/row.h) against cases solved by hand, bounds that hold to the
 * bit, every table against the literal backend, and that rows cost other islands nothing: not one bit, and not the fast
 * form of their bodies. */
#include <check.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "contact_problems.h"
#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/model/rows.h"
#include "core/model/system_math.h"
#include "core/solve/certificate.h"
#include "core/solve/schedule.h"
#include "fixed_work.h"
#include "row_laws.h"
#include "run_suite.h"
#include "runner.h"

static const struct sadmm_kernels *tables[8]; /* all that have rows with bounds */
static int table_count;

static void collect_tables(void)
{
    for (size_t i = 0; sadmm_kernels_at(i) && table_count < 8; ++i)
        if (sadmm_kernels_at(i)->backend != SADMM_BACKEND_CUDA) tables[table_count++] = sadmm_kernels_at(i);
}

START_TEST(laws_hold)
{
    for (int m = 0; m < 2; ++m)
        for (int k = 0; k < LAW_CASES; ++k)
            for (int side = 0; side < 2; ++side) check_law(tables[_i], law_methods[m], k, side);
}
END_TEST

START_TEST(one_constraint_has_many_laws) { check_many_laws(tables[_i]); }
END_TEST

/* Of what the law does not allow, the certificate is the velocity by which an exact solve of the row alone would move
 * it. */
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

/* ---- bounds, iterate by iterate; tables against ref -------------------------------------------------------------- */

/* Bodies, contacts and rows of all kinds; some hard and soft ones get bounds, so that constraints mix them. */
static struct contact_problem *bounded_problem(uint64_t seed)
{
    struct contact_problem *p = contact_problem_mixed(seed, 0.5);
    sadmm_settings s = fixed_settings();
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

/* After any number of iterations, with weights that were taken from the multipliers found so far; and what a table has
 * is what the literal backend has. An iteration takes two states no further apart in its own norm; masses over three
 * decades make that a factor of some 30 in velocities, which the rounding of every iteration may grow to, and of what
 * it starts with: masses, rows, factors, multipliers. After 60 there have been five sets of weights. */
START_TEST(bounds_hold_in_every_iterate)
{
    static const int iterations[] = {1, 2, 3, 5, 8, 30, 60};
    const struct sadmm_kernels *table = tables[_i];
    for (int m = 0; m < 2; ++m)
        for (size_t n = 0; n < sizeof iterations / sizeof *iterations; ++n) {
            const double tolerance =
                30 * (4 + iterations[n]) * (table->precision == SADMM_F32 ? FLT_EPSILON : DBL_EPSILON) / 2;
            struct contact_problem *own = bounded_problem(3), *ref = bounded_problem(3);
            sadmm_settings settings = settings_of(law_methods[m], iterations[n]);
            settings.threads = 2;
            settings.penalty_period = 0; /* by residuals, whose rounding would be a tolerance of its own */
            bound_rows(&own->rows);
            bound_rows(&ref->rows);
            solve_rows(table, &own->system, &settings);
            solve_rows(literal(), &ref->system, &settings);
            ck_assert_int_ge(at_bounds(&own->rows), 1);
            struct spread v = {0, 0}, lambda = {0, 0};
            for (int32_t i = 0; i < 6 * ref->system.body_count; ++i)
                add(&v, own->system.velocity[i], ref->system.velocity[i]);
            for (size_t r = 0; r < ref->rows.row_count; ++r) add(&lambda, own->rows.lambda[r], ref->rows.lambda[r]);
            ck_assert_msg(relative(v) <= tolerance && relative(lambda) <= tolerance,
                          "method %d, %d iterations: v %g, lambda %g", m, iterations[n], relative(v), relative(lambda));
            contact_problem_free(own);
            contact_problem_free(ref);
        }
}
END_TEST

/* ---- other islands ----------------------------------------------------------------------------------------------- */

enum { TOWERS = 7, TALL = 3, JOINED = TALL * 3 }; /* the two bodies from JOINED on lie between towers */

static const double up[3] = {0, 0, 1};

static void stand(struct contact_problem *p, int32_t below, int32_t box, double x, double z)
{
    for (int i = 0; i < 4; ++i)
        contact_problem_touch(p, below, box, (double[3]){x + (i & 1 ? 0.1 : -0.1), i & 2 ? 0.1 : -0.1, z}, up, 1e-5 * i,
                              0.4, 0);
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
    else p->system.first = true; /* impulses are initialised where they can be */
    return solve_rows(table, &p->system, &settings).limited;
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
                const int32_t some = run_towers(table, without, law_methods[m], warm, 1);
                limited += run_towers(table, with, law_methods[m], warm, threads);
                ck_assert_int_le(some, TOWERS);
                for (int32_t i = 0; i < without->system.body_count; ++i) {
                    bool same = memcmp(with->system.velocity + 6 * i, without->system.velocity + 6 * i,
                                       6 * sizeof(double)) == 0;
                    if (i == JOINED || i == JOINED + 1) moved = moved || !same;
                    else ck_assert_msg(same, "method %d, warm %d, %d threads: body %d", m, warm, threads, i);
                }
                ck_assert(moved); /* the block acts */
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
    ck_assert_int_gt(limited, 0); /* the energy limit was at work beside the rows */
}
END_TEST

/* A, b and e of a step, as sadmm_world_freeze gives them, take the form of the world's bodies: the same bits in the
 * method `paper`. (`fast` knows that a world's step is one of many.) */
START_TEST(frozen_problems_keep_the_fast_form)
{
    const struct sadmm_kernels *table = tables[_i];
    struct contact_problem *world = contact_problem_pyramid(5, 0.5), *frozen = contact_problem_pyramid(5, 0.5);
    const sadmm_settings settings = settings_of(SADMM_METHOD_PAPER, 40);
    contact_problem_raw(frozen, &settings, 0);
    solve_rows(table, &world->system, &settings);
    solve_rows(table, &frozen->system, &settings);
    ck_assert(memcmp(world->system.velocity, frozen->system.velocity,
                     6 * (size_t)world->system.body_count * sizeof(double)) == 0);
    contact_problem_free(world);
    contact_problem_free(frozen);
}
END_TEST

/* ---- the store --------------------------------------------------------------------------------------------------- */

START_TEST(blocks_become_rows)
{
    struct sadmm_rows rows = {0};
    sadmm_problem_block in = {.kind = SADMM_BLOCK_SOFT, .rows = 2, .body_a = 3, .body_b = -1, .jacobian_a = {1, 2, 3}};
    const double lambda[6] = {4, 5, 6};
    in.stiffness[0] = 2, in.error[0] = 0.25, in.damping[1] = 7;
    in.jacobian_b[0] = NAN; /* of the static world: not read */
    ck_assert(sadmm_rows_add_block(&rows, &in, lambda));
    ck_assert(rows.bias[0] == 0.5 && rows.gain[0] == 0 && rows.compliance[0] == 1 && rows.gain[1] == 7 &&
              rows.bias[1] == 0);
    ck_assert(rows.lambda[0] == 4 && rows.lambda[1] == 5 && rows.jacobian_a[2] == 3 && rows.jacobian_b[0] == 0);
    ck_assert(sadmm_row_acts(&rows, 0) && !sadmm_row_acts(&rows, 1) && !sadmm_row_is_coupled(&rows, 0));
    ck_assert(!rows.constraints[0].cone && rows.constraints[0].count == 2);
    ck_assert(rows.constraints[0].body_a == 3 && rows.constraints[0].body_b == -1);

    in.kind = SADMM_BLOCK_HARD;
    ck_assert(sadmm_rows_add_block(&rows, &in, NULL));
    ck_assert(rows.constraints[1].first == 2 && rows.row_count == 4 && rows.lambda[2] == 0 && rows.bias[2] == 0.25);
    ck_assert(sadmm_row_is_coupled(&rows, 2) && rows.gain[2] == 1 && rows.compliance[2] == 0);
    sadmm_row_limit(&rows, 3, 0);
    ck_assert(!sadmm_row_is_coupled(&rows, 3) && rows.lo[3] == 0);
    sadmm_row_motor(&rows, 3, 2, 5);
    ck_assert(rows.bias[3] == -2 && rows.lo[3] == -5 && rows.hi[3] == 5);

    const size_t capacity = SADMM_ROOM(rows.gain);
    for (size_t k = rows.row_count; k < capacity; ++k) ck_assert_int_ge(sadmm_rows_add(&rows, 1, 0, -1), 0);
    for (long left = 0; left < 9; ++left) { /* of nine arrays; the first one may have capacity left */
        sadmm_test_fail_allocations_after(left);
        if (sadmm_rows_add(&rows, 6, 0, -1) >= 0) break;
        ck_assert(rows.row_count == capacity && rows.lambda[0] == 4 && left < 9);
    }
    sadmm_test_fail_allocations_after(-1);
    ck_assert(rows.row_count == capacity + 6 && rows.lambda[0] == 4 && rows.gain[capacity] == 1 &&
              rows.hi[capacity] == INFINITY);
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
    tcase_add_test(store, blocks_become_rows);
    suite_add_tcase(suite, laws);
    suite_add_tcase(suite, islands);
    suite_add_tcase(suite, store);
    return run_suite(suite);
}
