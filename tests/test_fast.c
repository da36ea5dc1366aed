/* The method `fast`: every table's iterates are the plainly written ones of `ref`, whatever the threads; its weights
 * are what docs/internals/algorithm.md says; its solutions are certified, in few iterations; and it is safe with too
 * few. One file: weights, iterates and solutions are tested on the same problems (deep_stack, the scenes of
 * table_runner.h) and by the same runners.
 */
#include "backend_ref/literal.h"
#include "core/math/energy_limit.h"
#include "core/math/weight.h"
#include "core/model/islands.h"
#include "core/model/system_math.h"
#include "core/solve/certificate.h"
#include "core/solve/schedule.h"
#include "fewer.h"
#include "fixed_work.h"
#include "scene_tools.h"
#include "table_runner.h"

/* The tables that are tested in single precision alone. */
static const struct sadmm_kernels *single_tables[16];
static int single_count;

static void iterate(struct runner *r, int count, bool measure)
{
    CALL(r, r->k->iterate(r->c, count, false, measure, &r->error));
}

static void update_weights(struct runner *r)
{
    CALL(r, r->k->update_weights(r->c, &r->error));
    CALL(r, r->k->factorize(r->c, &r->error));
}

/* ---- tables ------------------------------------------------------------------------------------------------------ */

/* Batches of all lengths, since what is relaxed depends on it; new weights in between, often enough for levels. */
static const int batches[] = {1, 1, 2, 3, 1, 5, 10, 2, 20, 40};
enum { BATCHES = sizeof batches / sizeof *batches };

static double largest_impulse(const struct spread *lambda, const struct runner *r)
{
    double A[36], b[6], largest = lambda->scale;
    for (int32_t i = 0; i < r->p->system.body_count; ++i) {
        sadmm_system_body(&r->p->system, &r->settings, i, A, b);
        for (int j = 0; j < 6; ++j) largest = fmax(largest, fabs(b[j]));
    }
    return largest;
}

START_TEST(tables_equal_ref)
{
    const struct sadmm_kernels *table = tables[_i / SCENES];
    const struct scene *scene = &scenes[_i % SCENES];
    struct contact_problem *problem = make_problem(scene);
    struct runner ref, own;
    struct spread v = {0, 0}, lambda = {0, 0};
    struct spread primal = {0, 0}, dual = {0, 0};
    runner_start_method(&ref, literal(), scene, problem, 1, SADMM_METHOD_FAST);
    runner_start_method(&own, table, scene, problem, 2, SADMM_METHOD_FAST);
    for (int s = 0; s < BATCHES; ++s) {
        struct sadmm_residual wanted, got;
        bool measure = s % 2;
        iterate(&ref, batches[s], measure);
        iterate(&own, batches[s], measure);
        compare_solutions(&own, &ref, &v, &lambda);
        if (measure) {
            CALL(&ref, ref.k->measure_residuals(ref.c, &wanted, &ref.error));
            CALL(&own, own.k->measure_residuals(own.c, &got, &own.error));
            add(&primal, got.primal, wanted.primal);
            add(&dual, got.dual, wanted.dual);
        }
        update_weights(&ref);
        update_weights(&own);
    }
    if (ref.plan.energy_limit) {
        int32_t wanted, got;
        CALL(&ref, ref.k->limit_energy(ref.c, &wanted, &ref.error));
        CALL(&own, own.k->limit_energy(own.c, &got, &own.error));
        ck_assert_int_eq(got, wanted);
        compare_solutions(&own, &ref, &v, &lambda);
    }
    double tolerance = scene_tolerance(scene, table);
    ck_assert_msg(relative(v) <= tolerance, "%s: v differs by %g", scene->name, relative(v));
    ck_assert_msg(relative(lambda) <= tolerance, "%s: lambda differs by %g", scene->name, relative(lambda));
    /* Differences of what was just compared, so that they are off by as much, and by the roundings of their own
     * terms. */
    double rounding = 4 * table_epsilon(table);
    ck_assert_msg(primal.difference <= tolerance * primal.scale + rounding * v.scale,
                  "%s: primal residual differs by %g of %g", scene->name, primal.difference, primal.scale);
    ck_assert_msg(dual.difference <= tolerance * dual.scale + rounding * largest_impulse(&lambda, &ref),
                  "%s: dual residual differs by %g of %g", scene->name, dual.difference, dual.scale);
    runner_stop(&ref);
    runner_stop(&own);
    contact_problem_free(problem);
}
END_TEST

/* No table leaves the method out: those that would are not passed over by the tests below. */
START_TEST(all_tables_run_fast)
{
    bool both[2] = {false, false};
    for (int i = 0; i < table_count; ++i) {
        ck_assert_msg(tables[i]->update_weights && tables[i]->limit_energy, "%s", tables[i]->variant);
        both[tables[i]->precision] = true;
    }
    ck_assert(both[SADMM_F32] && both[SADMM_F64] && single_count > 0);
}
END_TEST

/* Step by step there is nothing: what an iteration relaxes depends on the batch. */
START_TEST(single_steps_are_refused)
{
    const struct sadmm_kernels *table = tables[_i];
    struct runner r;
    struct contact_problem *problem = make_problem(&scenes[0]);
    runner_start_method(&r, table, &scenes[0], problem, 1, SADMM_METHOD_FAST);
    ck_assert_int_eq(table->update_velocity(r.c, &r.error), SADMM_ERROR_UNSUPPORTED);
    ck_assert_int_eq(table->update_constraints(r.c, false, &r.error), SADMM_ERROR_UNSUPPORTED);
    ck_assert(strstr(r.error.message, "fast") != NULL);
    runner_stop(&r);
    contact_problem_free(problem);
}
END_TEST

/* Sums have one order: not one bit may differ. */
START_TEST(threads_do_not_matter)
{
    const struct sadmm_kernels *table = tables[_i / SCENES];
    const struct scene *scene = &scenes[_i % SCENES];
    struct contact_problem *problem = make_problem(scene);
    struct runner r[3];
    for (int t = 0; t < 3; ++t) runner_start_method(&r[t], table, scene, problem, t + 1, SADMM_METHOD_FAST);
    for (int s = 0; s < BATCHES; ++s)
        for (int t = 0; t < 3; ++t) {
            struct spread v = {0, 0}, lambda = {0, 0};
            struct sadmm_residual wanted, got;
            iterate(&r[t], batches[s], true);
            CALL(&r[0], table->measure_residuals(r[0].c, &wanted, &r[0].error));
            CALL(&r[t], table->measure_residuals(r[t].c, &got, &r[t].error));
            if (s == 6) update_weights(&r[t]);
            compare_solutions(&r[t], &r[0], &v, &lambda);
            ck_assert(v.difference == 0 && lambda.difference == 0);
            ck_assert(got.primal == wanted.primal && got.dual == wanted.dual);
        }
    for (int t = 0; t < 3; ++t) iterate(&r[t], 140, false); /* momentum residuals are taken again within */
    for (int t = 0; t < 3; ++t) {
        struct spread v = {0, 0}, lambda = {0, 0};
        int32_t limited;
        if (r[t].plan.energy_limit) CALL(&r[t], table->limit_energy(r[t].c, &limited, &r[t].error));
        compare_solutions(&r[t], &r[0], &v, &lambda);
        ck_assert(v.difference == 0 && lambda.difference == 0);
    }
    for (int t = 0; t < 3; ++t) runner_stop(&r[t]);
    contact_problem_free(problem);
}
END_TEST

/* ---- weights ----------------------------------------------------------------------------------------------------- */

/* A cube of mass m at rest, carried by four points with m g dt / 4 each: g = J^T lambda changes its velocity by
 * V = g dt, and the load of a point over V is m / 4. Mean response of a point at (h, h, -h): 1/m for the push, and for
 * a torque [r]x over the moment 2/3 m h^2 on average 2/3 |r|^2 / (2/3 m h^2) = 3/m. So B = m/4 + phi m/4, phi = 3. */
START_TEST(weight_is_the_mass_carried)
{
    struct contact_problem *problem = contact_problem_stack((double[]){2}, 1, 0.5);
    struct runner r;
    struct scene warm = scenes[0];
    warm.warm = true;
    double impulse = 2 * 9.81 * 0.005 / 4;
    for (size_t k = 0; k < 4; ++k) problem->contacts.points[k].impulse[2] = impulse;
    runner_start_method(&r, literal(), &warm, problem, 1, SADMM_METHOD_FAST);
    for (int k = 0; k < 4; ++k) {
        /* 1e-9: the least speed, 1e-6 m/s, beside V = 0.05 m/s */
        ck_assert_double_eq_tol(r.c->constraints[k].B[0], 2.0 / 4 + 3 * 2.0 / 4, 1e-9);
        ck_assert_double_eq(r.c->constraints[k].B[7], r.c->constraints[k].B[0]);
    }
    runner_stop(&r);
    contact_problem_free(problem);
}
END_TEST

/* N cubes of 1 kg on top of each other, at rest on exact impulses: the forces that the bodies feel add up to N^2 m g,
 * twice but for the one at the top: the depth is N. Separations of 1 um under every third cube. */
static struct contact_problem *deep_stack(int count)
{
    double masses[64] = {0};
    for (int i = 0; i < count; ++i) masses[i] = 1;
    struct contact_problem *problem = contact_problem_stack(masses, count, 0.5);
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < 4; ++k) {
            problem->contacts.points[4 * i + k].impulse[2] = (count - i) * 9.81 * 0.005 / 4;
            if (i % 3 == 0 && k < 2) problem->contacts.points[4 * i + k].separation = 1e-6;
        }
    return problem;
}

static sadmm_settings warm_settings(int iterations, int threads)
{
    sadmm_settings s = scene_settings(&scenes[0]);
    s.method = SADMM_METHOD_FAST;
    s.warm_start = true;
    s.iterations = iterations;
    s.threads = threads;
    return s;
}

START_TEST(deep_stacks_are_stiff)
{
    struct contact_problem *problem = deep_stack(30);
    const sadmm_settings settings = warm_settings(20, 1);
    struct runner r;
    runner_start_settings(&r, literal(), &settings, problem);
    ck_assert(r.plan.warm);
    const double need = pow(30 / 20.0, 2) * 60 / 20, e = 1e-6 / 0.005;
    ck_assert_double_gt(need, 6);
    /* under half of them, as in weight_is_the_mass_carried, with V less by 6; 1e-8: the least speed, and a sum of 30 */
    const struct ref_constraint *half = &r.c->constraints[4 * 15];
    ck_assert_double_eq_tol(half[0].B[0], 15.0 / 4 * 6 + 3.0 / 8, 1e-7);
    ck_assert_double_eq_tol(half[0].e[0], e * pow(20 / 30.0, 6), 1e-9 * e);
    ck_assert_double_eq(half[2].e[0], 0);
    runner_stop(&r);
    /* Cubes that move at V: no springs, and no reason for other weights. */
    for (int i = 0; i < 30; ++i) problem->system.velocity[6 * i] = 9.81 * 0.005;
    runner_start_settings(&r, literal(), &settings, problem);
    ck_assert_double_eq_tol(r.c->constraints[0].B[0], 30.0 / 4 + 3.0 / 4, 1e-7);
    runner_stop(&r);
    contact_problem_free(problem);
}
END_TEST

/* A table's solution is ref's within a tolerance (the spreads say how far off it was), and the same bits by more
 * threads. */
static void expect_agreement(struct runner *own, struct runner *threads, struct spread *v, double v_tolerance,
                             struct spread *lambda, double lambda_tolerance)
{
    ck_assert_msg(relative(*v) <= v_tolerance, "v differs by %g", relative(*v));
    ck_assert_msg(relative(*lambda) <= lambda_tolerance, "lambda differs by %g", relative(*lambda));
    v->difference = lambda->difference = 0;
    compare_solutions(threads, own, v, lambda);
    ck_assert(v->difference == 0 && lambda->difference == 0);
}

/* The same in every table, whatever the threads: at rest, and at V. */
START_TEST(deep_stacks_equal_ref)
{
    const struct sadmm_kernels *table = tables[_i / 2];
    struct contact_problem *problem = deep_stack(30);
    const sadmm_settings one_thread = warm_settings(20, 1), three_threads = warm_settings(20, 3);
    struct spread v = {0, 0}, lambda = {0, 0};
    struct runner ref, own, three;
    for (int i = 0; i < 30 && _i % 2; ++i) problem->system.velocity[6 * i] = 9.81 * 0.005;
    runner_start_settings(&ref, literal(), &one_thread, problem);
    runner_start_settings(&own, table, &one_thread, problem);
    runner_start_settings(&three, table, &three_threads, problem);
    for (int s = 0; s < 5; ++s) {
        iterate(&ref, 10, false);
        iterate(&own, 10, false);
        iterate(&three, 10, false);
        compare_solutions(&own, &ref, &v, &lambda);
    }
    /* Fifty iterations that pass on what is rounded at most as it is (scene_tolerance; equal masses); and a cube of 1
     * kg is pushed by what its eight impulses are rounded to at the start, which are thousands of times larger than
     * what it moves by. */
    const double rounding = 50 * table_epsilon(table), pushed = 8 * table_epsilon(table) * lambda.scale / v.scale;
    expect_agreement(&own, &three, &v, rounding + pushed, &lambda, rounding);
    runner_stop(&ref);
    runner_stop(&own);
    runner_stop(&three);
    contact_problem_free(problem);
}
END_TEST

/* A problem is no step of a world, but may be solved in short batches: few iterations in one mean nothing. */
START_TEST(few_iterations_of_a_problem_weigh_the_same)
{
    double weight[2];
    for (int k = 0; k < 2; ++k) {
        struct contact_problem *problem = deep_stack(3);
        sadmm_settings settings = warm_settings(k ? 5 : 100, 1);
        struct runner r;
        contact_problem_raw(problem, &settings, 0);
        runner_start_settings(&r, literal(), &settings, problem);
        ck_assert(r.plan.warm && !r.plan.rigid);
        weight[k] = r.c->constraints[0].B[0];
        runner_stop(&r);
        contact_problem_free(problem);
    }
    ck_assert_double_eq(weight[1], weight[0]);
}
END_TEST

/* Of an island that ends with 2 J: how far it goes along the free motion decides. */
START_TEST(rebounds_are_taken_out)
{
    const struct island_energies rebound = {.now = 2, .free = 2}, pushed = {.now = 2, .free = 2, .work = 2};
    ck_assert_double_eq(energy_limit_factor(&rebound, 1e-16), 1);
    ck_assert_double_eq(energy_limit_rebound_factor(&rebound, 2, 1e-16), 1);
    ck_assert_double_eq(energy_limit_rebound_factor(&rebound, 1, 1e-16), 0.5);
    ck_assert_double_eq(energy_limit_rebound_factor(&rebound, -2, 1e-16), 0.25);
    ck_assert_double_eq(energy_limit_rebound_factor(&pushed, 1, 1e-16), 1);
    ck_assert(energy_limit_tests_rebound(1, 59) && !energy_limit_tests_rebound(1, 60) &&
              !energy_limit_tests_rebound(0, 59));
}
END_TEST

/* Work lets an island have more energy, by the share of the impulses that solves the dual problem best. What is
 * rounding of the motions left alone is no energy. */
START_TEST(work_counts_by_its_share)
{
    const struct island_energies none = {.now = 8, .free = 2, .work = 6, .drive = -1, .response = 1},
                                 half = {.now = 8, .free = 2, .work = 6, .drive = 1, .response = 2},
                                 all = {.now = 8, .free = 2, .work = 6, .drive = 3, .response = 2},
                                 rounding = {.now = 1e-16, .rigid = 1};
    ck_assert_double_eq(energy_limit_factor(&none, 1e-16), 0.5);
    ck_assert_double_eq(energy_limit_factor(&half, 1e-16), sqrt(5.0 / 8));
    ck_assert_double_eq(energy_limit_factor(&all, 1e-16), 1);
    ck_assert_double_eq(energy_limit_factor(&rounding, 1e-16), 1);
    ck_assert_double_eq(energy_limit_rebound_factor(&rounding, 0, 1e-16), 1);
}
END_TEST

/* A stack that has just landed: three times the impulses it rests on. Five iterations leave it jumping, and all tables
 * slow it down alike; less where cubes overlap, by 1 mm, since pushing them apart is work. */
START_TEST(under_iterated_tables_equal_ref)
{
    const struct sadmm_kernels *table = tables[_i / 2];
    const bool overlap = _i % 2;
    struct contact_problem *problem = deep_stack(5);
    sadmm_settings one_thread = warm_settings(5, 1), three_threads = warm_settings(5, 3);
    struct spread v = {0, 0}, lambda = {0, 0};
    struct runner ref, own, three;
    int32_t limited[3];
    for (int k = 0; k < 20; ++k) problem->contacts.points[k].impulse[2] *= 3;
    for (int k = 4; k < 20 && overlap; ++k) problem->contacts.points[k].separation = -1e-3;
    runner_start_settings(&ref, literal(), &one_thread, problem);
    runner_start_settings(&own, table, &one_thread, problem);
    runner_start_settings(&three, table, &three_threads, problem);
    struct runner *const runners[] = {&ref, &own, &three};
    for (int k = 0; k < 3; ++k) {
        iterate(runners[k], 5, false);
        CALL(runners[k], runners[k]->k->limit_energy(runners[k]->c, &limited[k], &runners[k]->error));
        ck_assert_int_eq(limited[k], 1);
    }
    compare_solutions(&own, &ref, &v, &lambda);
    /* Five iterations that pass on what is rounded at most as it is (scene_tolerance), each of some ten sums; equal
     * masses. */
    const double tolerance = 5 * 10 * table_epsilon(table);
    expect_agreement(&own, &three, &v, tolerance, &lambda, tolerance);
    for (int k = 0; k < 3; ++k) runner_stop(runners[k]);
    contact_problem_free(problem);
}
END_TEST

/* Overlapping cubes are pushed apart, with more energy than they would have in free motion. A solution is left as it
 * is: that energy is the work of its contacts. */
START_TEST(solutions_are_not_slowed_down)
{
    const struct sadmm_kernels *table = _i < table_count ? tables[_i] : literal();
    struct contact_problem *problem = deep_stack(5);
    sadmm_settings settings = warm_settings(300, 1);
    struct runner r;
    int32_t limited;
    for (int k = 0; k < 20; ++k) problem->contacts.points[k].separation = -1e-3;
    runner_start_settings(&r, table, &settings, problem);
    iterate(&r, 300, false);
    CALL(&r, table->limit_energy(r.c, &limited, &r.error));
    ck_assert_int_eq(limited, 0);
    CALL(&r, table->read_solution(r.c, &r.error));
    ck_assert_double_gt(r.p->system.velocity[6 * 4 + 2], 2 * 9.81 * r.settings.dt);
    runner_stop(&r);
    contact_problem_free(problem);
}
END_TEST

/* The deeper an island is, the smaller the share of a separation within the slop that a step closes, down to a
 * thousandth. With 200 iterations or fewer it is depth^-6 (in 20 bodies); with 80,000 a depth of 20 is as one of 1.
 * Larger separations are closed but for what the slop leaves of them, without a jump; overlaps are left alone. */
START_TEST(small_separations_are_eased)
{
    static const int iterations[] = {1, 200, 800, 80000};
    const double slop = 2e-3, less = _i < 2 ? 1 : sqrt(iterations[_i] / 200.0);
    for (double depth = 1; depth < 20; depth *= 1.25) {
        const double square = depth * depth,
                     share = weight_separation_share(square, weight_spring_need(square, iterations[_i]));
        ck_assert_double_eq_tol(share, fmin(fmax(pow(depth / less, -6), 0.001), 1), 8 * DBL_EPSILON);
        ck_assert_double_eq(weight_separation_error(-slop, share, slop), -slop);
        ck_assert_double_eq(weight_separation_error(0, share, slop), 0);
        for (double error = slop / 8; error < 8 * slop; error *= 2) {
            const double left = error - weight_separation_error(error, share, slop);
            ck_assert_double_eq_tol(left, (1 - share) * fmin(error, slop), 4 * DBL_EPSILON * error);
        }
    }
}
END_TEST

/* The weight of a hard block does not depend on the unit of a row: with row and error times s, lambda is 1/s of it, B
 * too by s^2, and the body moves all the same. */
START_TEST(blocks_have_no_unit)
{
    struct spread v = {0, 0}, lambda = {0, 0};
    struct contact_problem *problem = make_problem(&scenes[11]), *scaled = contact_problem_copy(problem);
    for (int32_t k = 0; k < scaled->block_count; ++k) {
        sadmm_problem_block *block = &scaled->blocks[k];
        if (block->kind != SADMM_BLOCK_HARD) continue;
        for (int r = 0; r < block->rows; ++r) {
            double s = 1 + r;
            block->error[r] *= s;
            scaled->block_lambda[6 * k + r] /= s;
            for (int j = 0; j < 6; ++j) {
                block->jacobian_a[6 * r + j] *= s;
                block->jacobian_b[6 * r + j] *= s;
            }
        }
    }
    struct runner r[2];
    runner_start_method(&r[0], literal(), &scenes[11], problem, 1, SADMM_METHOD_FAST);
    runner_start_method(&r[1], literal(), &scenes[11], scaled, 1, SADMM_METHOD_FAST);
    iterate(&r[0], 20, false);
    iterate(&r[1], 20, false);
    update_weights(&r[0]);
    update_weights(&r[1]);
    iterate(&r[0], 20, false);
    iterate(&r[1], 20, false);
    compare_solutions(&r[1], &r[0], &v, &lambda);
    ck_assert_msg(relative(v) <= 1e-12, "v differs by %g", relative(v)); /* rounding, as between tables */
    ck_assert(lambda.difference > 0);                                    /* it was scaled */
    runner_stop(&r[0]);
    runner_stop(&r[1]);
    contact_problem_free(problem);
    contact_problem_free(scaled);
}
END_TEST

/* The weight scale stays where the residuals are balanced, goes down where the momentum converges slower, up where the
 * impulses creep, by the power 0.3 of how far they are off and a factor of 4 at most an update; it never leaves [0.1,
 * 5]. */
/* 5, 10, 20, 40, 60, 90, ... 681, and no more. */
START_TEST(weights_change_finitely_often)
{
    int at = WEIGHT_FIRST_UPDATE, count = 0, last = 0;
    for (; at != WEIGHT_NO_UPDATE; at = weight_next_update(at), ++count) {
        ck_assert_int_gt(at, last);
        ck_assert_int_le(at, WEIGHT_LAST_UPDATE);
        last = at;
    }
    ck_assert_int_eq(count, 11);
    ck_assert_int_eq(last, 681);
}
END_TEST

START_TEST(weight_scales_follow_the_imbalance)
{
    ck_assert(!weight_stagnates(30) && weight_stagnates(31));
    for (double scale = 0.1; scale <= 5; scale *= 1.5) {
        ck_assert_double_eq(weight_next_scale(scale, 0.5), scale);
        ck_assert_double_eq(weight_next_scale(scale, 29), scale);
        for (double off = 1.1; off < 1e5; off *= 3) {
            const double factor = fmin(pow(off, 0.3), 4);
            ck_assert_double_eq_tol(weight_next_scale(scale, 1 / 3.0 / off), fmax(scale / factor, 0.1),
                                    8 * DBL_EPSILON * scale);
            ck_assert_double_eq_tol(weight_next_scale(scale, 30 * off), fmin(scale * factor, 5), 8 * DBL_EPSILON * 5);
        }
    }
}
END_TEST

/* The residual of a contact, lambda - Pi_C(lambda - u/w), with lambda = (2, 0, 0), mu = 0.5, w = 4 in its frame, by
 * hand; its energy is the same in the world's frame, for any normal. */
START_TEST(contact_residuals_are_known)
{
    static const struct {
        double u[3], residual[3];
        int moves;
    } cases[] = {
        {{-4, -4, 4}, {-1, -1, 1}, 0},   /* (3, 1, -1) is in the cone: |(1, -1)| < 1.5 */
        {{0, -6, 8}, {0, -0.6, 0.8}, 1}, /* (2, 1.5, -2): 2.5 long, and 1 allowed */
        {{12, 4, 0}, {2, 0, 0}, 1},      /* it would pull */
        {{12, 0, 0}, {2, 0, 0}, 1},
    };
    const double lambda[3] = {2, 0, 0}, normals[][3] = {{1, 0, 0}, {0, 0.6, -0.8}, {2 / 3.0, -2 / 3.0, 1 / 3.0}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        double residual[3], y[3], projected[3], energy = 0;
        contact_residual_rows(lambda, cases[k].u, 0.5, 4, residual);
        for (int i = 0; i < 3; ++i) {
            ck_assert_double_eq_tol(residual[i], cases[k].residual[i], 4 * DBL_EPSILON); /* of numbers up to 3 */
            energy += 4 * residual[i] * residual[i];
            y[i] = lambda[i] - cases[k].u[i] / 4;
        }
        ck_assert_int_eq(contact_project_rows(y, 0.5, projected), cases[k].moves);
        for (size_t n = 0; n < sizeof normals / sizeof *normals; ++n) {
            const mat3 frame = sadmm_contact_frame(normals[n]);
            double world_lambda[3], world_u[3];
            v3_store(m3_tmul(frame, v3_load(lambda)), world_lambda);
            v3_store(m3_tmul(frame, v3_load(cases[k].u)), world_u);
            ck_assert_double_eq_tol(contact_violation(world_lambda, world_u, normals[n], 0.5, 4), energy,
                                    64 * DBL_EPSILON * energy); /* some ten roundings of numbers up to 3, squared */
        }
    }
}
END_TEST

START_TEST(islands_are_named_by_their_smallest_body)
{
    struct contact_problem *p = contact_problem_new();
    static const int32_t pairs[][2] = {{7, 3}, {5, 6}, {3, 5}, {-1, 2}, {2, 0}, {4, -1}};
    static const int32_t wanted[] = {0, 1, 0, 3, 4, 3, 3, 3};
    int32_t label[8];
    for (int i = 0; i < 8; ++i) contact_problem_box(p, 1, 0.1, 0.1, 0.1, i, 0, 0);
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; ++k)
        contact_problem_touch(p, pairs[k][0], pairs[k][1], (double[]){0, 0, 0}, (double[]){0, 0, 1}, 0, 0.5, 0);
    sadmm_islands(&p->system, label);
    for (int i = 0; i < 8; ++i) ck_assert_int_eq(label[i], wanted[i]);
    contact_problem_free(p);
}
END_TEST

/* ---- solutions --------------------------------------------------------------------------------------------------- */

static struct sadmm_solve_report solve_with(struct contact_problem *problem, const sadmm_settings *wanted)
{
    const char *reason;
    const struct sadmm_kernels *k = sadmm_kernels_find(SADMM_BACKEND_CPU, SADMM_F64, &reason);
    struct sadmm_error error = {SADMM_OK, ""};
    struct sadmm_solve_report report = {0};
    struct sadmm_context *c = NULL;
    sadmm_settings s = *wanted;
    s.warm_start = false;
    s.threads = 1;
    s.check_period = 5;
    struct sadmm_plan plan = sadmm_plan_make(&problem->system, &s);
    plan.energy_limit = plan.momentum = false; /* the problem, not a time step */
    ck_assert_int_eq(k->create(0, &c, &error), SADMM_OK);
    sadmm_status status = sadmm_schedule_solve(k, c, &problem->system, &s, &plan, NULL, &report, &error);
    ck_assert_msg(status == SADMM_OK, "%s", error.message);
    ck_assert_int_eq(sadmm_certify(&problem->system, &s, &report.certificate, &error), SADMM_OK);
    k->destroy(c);
    return report;
}

static struct sadmm_solve_report solve_cold(struct contact_problem *problem, int iterations, double tolerance)
{
    sadmm_settings s = fixed_settings();
    s.iterations = iterations;
    s.tolerance = tolerance;
    return solve_with(problem, &s);
}

/* Iterations from nothing to an error of 1e-6 m/s, inspected every five; the problem is freed. */
static int cold_iterations(struct contact_problem *problem, sadmm_method method, double relaxation)
{
    sadmm_settings s = fixed_settings();
    s.method = method;
    s.relaxation = relaxation;
    s.iterations = 3000;
    s.tolerance = 1e-6;
    struct sadmm_solve_report report = solve_with(problem, &s);
    ck_assert_msg(method == SADMM_METHOD_PAPER || report.certificate.ncp_max <= 1e-6, "natural map %g after %d",
                  report.certificate.ncp_max, report.iterations);
    contact_problem_free(problem);
    return report.iterations;
}

/* Over-relaxation is worth having; and to 1e-6 m/s fast takes a third of the iterations of paper, in the geometric
 * mean, as docs/internals/accuracy.md has it for problems whose impulses are not initialised. `most` is a guard against
 * regressions and no more: what an over-relaxation of 1.2 takes. */
START_TEST(cold_solves)
{
    static struct contact_problem *(*const problems[])(int) = {stack, pyramid, plates};
    enum { PROBLEMS = sizeof problems / sizeof *problems };
    static const int most[PROBLEMS] = {50, 115, 90};
    const double relaxation = fixed_settings().relaxation;
    double ratio = 1;
    for (int k = 0; k < PROBLEMS; ++k) {
        const int fast = cold_iterations(problems[k](0), SADMM_METHOD_FAST, relaxation);
        const int plain = cold_iterations(problems[k](0), SADMM_METHOD_FAST, 1);
        const int paper = cold_iterations(problems[k](0), SADMM_METHOD_PAPER, relaxation);
        ck_assert_msg(fast < most[k], "problem %d: %d iterations", k, fast);
        ck_assert_msg(fast < plain, "problem %d: %d iterations, %d without over-relaxation", k, fast, plain);
        ck_assert_msg(fast < paper, "problem %d: %d iterations, paper takes %d", k, fast, paper);
        ratio *= (double)paper / fast;
    }
    ck_assert_msg(pow(ratio, 1.0 / PROBLEMS) >= 3, "paper takes %g times as many", pow(ratio, 1.0 / PROBLEMS));
}
END_TEST

/* A weight is the mass that its contact carries, so that masses and their order are nothing to the iteration: stacks of
 * 1:1:1, 1:100:10,000 and 10,000:100:1 take the same number but for one convergence check, once the loads are known. */
START_TEST(masses_do_not_matter)
{
    static const double masses[][3] = {{1, 1, 1}, {0.01, 1, 100}, {100, 1, 0.01}};
    int iterations[3];
    for (int k = 0; k < 3; ++k)
        iterations[k] =
            cold_iterations(contact_problem_stack(masses[k], 3, 0.5), SADMM_METHOD_FAST, fixed_settings().relaxation);
    for (int k = 1; k < 3; ++k)
        ck_assert_msg(abs(iterations[k] - iterations[0]) <= 5, "%d and %d iterations", iterations[k], iterations[0]);
}
END_TEST

/* All kinds of constraints at once, both forms of bodies, with and without friction: it ends at a solution. (Of the
 * random mixed problems, those that can be solved: the others hold welds against each other.) */
START_TEST(solutions_are_certified)
{
    static const int solvable[] = {8, 9, 10, 11};
    const struct scene *scene = &scenes[solvable[_i]];
    struct contact_problem *problem = make_problem(scene), *other = make_problem(scene);
    struct sadmm_solve_report fast = solve_cold(problem, 3000, 1e-9);
    ck_assert_msg(fast.converged, "%s: natural map %g, momentum %g", scene->name, fast.certificate.ncp_max,
                  fast.certificate.momentum_max);
    contact_problem_free(problem);
    contact_problem_free(other);
}
END_TEST

/* What single precision rounds a body's impulses to, at most, over the largest body's b: the certificate's scale, or
 * less. */
static double impulse_rounding(const struct runner *r)
{
    const struct sadmm_system *system = &r->p->system;
    double A[36], b[6], worst = 0, scale = 0;
    for (int32_t body = 0; body < system->body_count; ++body) {
        double sum = 0;
        for (size_t p = 0; p < system->contacts->pair_count; ++p) {
            const struct sadmm_contact_pair *pair = &system->contacts->pairs[p];
            for (int k = 0; k < pair->count && (pair->body_a == body || pair->body_b == body); ++k)
                sum += norm3(system->contacts->points[pair->first + k].impulse);
        }
        sadmm_system_body(system, &r->settings, body, A, b);
        for (int j = 0; j < 6; ++j) scale = fmax(scale, fabs(b[j]));
        worst = fmax(worst, sum);
    }
    return FLT_EPSILON / 2 * worst / scale;
}

/* Two thousand iterations from wrong impulses, in single precision: the momentum error ends where rounding the impulses
 * puts it (where momentum residuals are never recomputed, at five times that). And it is a solution: contacts move by
 * what two bodies do that move and turn by half an ulp of g dt, although the plates' impulses are rounded to more. */
START_TEST(momentum_residuals_do_not_drift)
{
    const struct sadmm_kernels *table = single_tables[_i];
    struct contact_problem *problem = plates(0);
    struct scene warm = scenes[0];
    struct runner r;
    struct sadmm_certificate certificate;
    solve_cold(problem, 1000, 1e-9);
    for (size_t k = 0; k < problem->contacts.point_count; ++k)
        for (int j = 0; j < 3; ++j) problem->contacts.points[k].impulse[j] *= k % 3 ? 0.5 : 1.5;
    warm.warm = true;
    runner_start_method(&r, table, &warm, problem, 1, SADMM_METHOD_FAST);
    ck_assert(r.plan.warm);
    for (int s = 0; s < 20; ++s) iterate(&r, 100, false);
    CALL(&r, table->read_solution(r.c, &r.error));
    ck_assert_int_eq(sadmm_certify(&r.p->system, &r.settings, &certificate, &r.error), SADMM_OK);
    const double rounding = impulse_rounding(&r), still = 4 * FLT_EPSILON / 2 * 9.81 * r.settings.dt;
    ck_assert_msg(certificate.momentum_max <= rounding, "momentum %g, rounding %g", certificate.momentum_max, rounding);
    ck_assert_msg(certificate.ncp_max <= still, "natural map %g", certificate.ncp_max);
    runner_stop(&r);
    contact_problem_free(problem);
}
END_TEST

/* ---- in motion --------------------------------------------------------------------------------------------------- */

/* Kinetic and potential energy, the latter above the lowest place a body's centre may reach: the scene's own floor. */
static double total_energy(sadmm_world *world, const double gravity[3], double *weight)
{
    double energy = 0;
    *weight = 0;
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        sadmm_body_id id = body_at(world, i);
        sadmm_body_def def = body_def(world, id);
        sadmm_body_state s = body_state(world, id);
        if (def.type != SADMM_BODY_DYNAMIC) continue;
        double conjugate[4] = {s.orientation[0], -s.orientation[1], -s.orientation[2], -s.orientation[3]};
        vec3 w = m3_mul(q_matrix(q_load(conjugate)), v3_load(s.angular_velocity));
        energy += def.mass * v3_norm2(v3_load(s.linear_velocity)) / 2 -
                  def.mass * v3_dot(v3_load(gravity), v3_load(s.position));
        energy += (def.inertia[0] * w.x * w.x + def.inertia[1] * w.y * w.y + def.inertia[2] * w.z * w.z) / 2;
        *weight += def.mass * norm3(gravity);
    }
    return energy;
}

static const struct {
    const char *spec;
    double duration, drop; /* s, downward speed at the start in m/s */
} moving[] = {
    {"vertical_stacks:1", 1, 0}, {"oblique_stacks:1", 0.5, 0}, {"card_houses:1", 0.5, 0}, {"pyramid:8", 0.5, 0},
    {"sliding_cubes:50", 0.5, 0}, {"pile:30", 1, 0}, {"burst:2", 0.3, 0}, {"burst:2", 0.2, 100},
};
static const int budgets[] = {1, 2, 5, 10};

/* However few the iterations, energy is not made: there is at most 1 % more than at the start, of what the scene turns
 * over or of its weight times 0.1 m, about the size of its bodies. (So a scene at rest may rise by 1 mm: bodies sink
 * into each other where iterations are cut short, and pushing them out is work.) */
START_TEST(too_few_iterations_are_safe)
{
    struct sadmm_scene scene = open_scene(moving[_i / 4].spec);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = SADMM_F64;
    scene.def.settings.threads = 1;
    scene.def.settings.method = SADMM_METHOD_FAST;
    scene.def.settings.iterations = budgets[_i % 4];
    sadmm_world *world = build_scene(&scene);
    for (int32_t i = 0; i < sadmm_world_body_count(world) && moving[_i / 4].drop > 0; ++i) {
        sadmm_body_state s = body_state(world, body_at(world, i));
        if (body_def(world, body_at(world, i)).type != SADMM_BODY_DYNAMIC) continue;
        s.linear_velocity[2] -= moving[_i / 4].drop;
        MUST(world, sadmm_world_set_body_state(world, body_at(world, i), &s));
    }
    double weight, start = total_energy(world, scene.def.settings.gravity, &weight), most = start, least = start;
    int steps = (int)lround(moving[_i / 4].duration / scene.def.settings.dt);
    for (int k = 0; k < steps; ++k) {
        step_world(world, 1);
        double now = total_energy(world, scene.def.settings.gravity, &weight);
        most = fmax(most, now);
        least = fmin(least, now);
    }
    double scale = fmax(start - least, 0.1 * weight);
    ck_assert_msg(most - start <= 0.01 * scale, "%s, %d iterations: energy rises by %g J of %g J", moving[_i / 4].spec,
                  budgets[_i % 4], most - start, scale);
    sadmm_world_destroy(world);
}
END_TEST

static const struct {
    const char *spec;
    int iterations;
    double duration; /* s */
} resting[] = {
    {"vertical_stacks:4", 5, 4}, {"vertical_stacks:4", 8, 4}, {"card_houses:1", 3, 2}, {"oblique_stacks:1", 2, 2},
};
enum { RESTING = sizeof resting / sizeof *resting };

static double fastest_body(sadmm_world *world)
{
    double fastest = 0;
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        if (body_def(world, body_at(world, i)).type != SADMM_BODY_DYNAMIC) continue;
        fastest = fmax(fastest, norm3(body_state(world, body_at(world, i)).linear_velocity));
    }
    return fastest;
}

/* Few iterations bring what can stand to rest: below 1e-8 of the energy of its free motion, in single precision 1e-6,
 * an island is no longer slowed down (docs/internals/algorithm.md, "Energy limiter"), so that motions as small as that
 * have to die out by themselves. Without what is done for few iterations stacks sway at 0.03 m/s for good. */
START_TEST(few_iterations_come_to_rest)
{
    struct sadmm_scene scene = open_scene(resting[_i % RESTING].spec);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = _i < RESTING ? SADMM_F32 : SADMM_F64;
    scene.def.settings.threads = 1;
    scene.def.settings.method = SADMM_METHOD_FAST;
    scene.def.settings.iterations = resting[_i % RESTING].iterations;
    sadmm_world *world = build_scene(&scene);
    step_world(world, (int)lround(resting[_i % RESTING].duration / scene.def.settings.dt));
    const double still = sqrt(scene.def.precision == SADMM_F32 ? 1e-6 : 1e-8) * 9.81 * scene.def.settings.dt;
    double fastest = fastest_body(world);
    ck_assert_msg(fastest <= still, "%s, %d iterations: %g m/s after %g s", resting[_i % RESTING].spec,
                  resting[_i % RESTING].iterations, fastest, resting[_i % RESTING].duration);
    sadmm_world_destroy(world);
}
END_TEST

/* What is passed on goes to 0, and its rounding with it: bodies come to rest below half an ulp of g dt, which is where
 * they stay if impulses themselves are added up (5e-9 to 8e-9 m/s; dt is 5 ms). */
START_TEST(single_precision_rests)
{
    static const char *const specs[] = {"vertical_stacks:4", "oblique_stacks:1"};
    struct sadmm_scene scene = open_scene(specs[_i]);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = SADMM_F32;
    scene.def.settings.threads = 1;
    scene.def.settings.method = SADMM_METHOD_FAST;
    scene.def.settings.iterations = 20;
    sadmm_world *world = build_scene(&scene);
    step_world(world, 400);
    const double half_ulp = FLT_EPSILON / 2 * 9.81 * scene.def.settings.dt;
    ck_assert_msg(fastest_body(world) <= half_ulp, "%s: %g m/s", specs[_i], fastest_body(world));
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    collect_tables();
    for (int i = 0; i < table_count; ++i)
        if (tables[i]->precision == SADMM_F32) single_tables[single_count++] = tables[i];
    Suite *suite = suite_create("fast");
    TCase *tables_case = tcase_create("tables"), *weights = tcase_create("weights");
    TCase *solutions = tcase_create("solutions"), *motion = tcase_create("motion");
    tcase_add_test(tables_case, all_tables_run_fast);
    tcase_add_loop_test(tables_case, tables_equal_ref, 0, table_count * SCENES);
    tcase_add_loop_test(tables_case, threads_do_not_matter, 0, table_count * SCENES);
    tcase_add_loop_test(tables_case, single_steps_are_refused, 0, table_count);
    tcase_add_test(weights, weight_is_the_mass_carried);
    tcase_add_test(weights, deep_stacks_are_stiff);
    tcase_add_loop_test(weights, deep_stacks_equal_ref, 0, 2 * table_count);
    tcase_add_test(weights, few_iterations_of_a_problem_weigh_the_same);
    tcase_add_test(weights, rebounds_are_taken_out);
    tcase_add_test(weights, work_counts_by_its_share);
    tcase_add_loop_test(weights, under_iterated_tables_equal_ref, 0, 2 * table_count);
    tcase_add_loop_test(weights, solutions_are_not_slowed_down, 0, table_count + 1);
    tcase_add_loop_test(weights, small_separations_are_eased, 0, 4);
    tcase_add_test(weights, blocks_have_no_unit);
    tcase_add_test(weights, weights_change_finitely_often);
    tcase_add_test(weights, weight_scales_follow_the_imbalance);
    tcase_add_test(weights, contact_residuals_are_known);
    tcase_add_test(weights, islands_are_named_by_their_smallest_body);
    tcase_add_test(solutions, cold_solves);
    tcase_add_test(solutions, masses_do_not_matter);
    tcase_add_loop_test(solutions, solutions_are_certified, 0, 4);
    tcase_add_loop_test(solutions, momentum_residuals_do_not_drift, 0, single_count);
    if (!races_are_looked_for()) {
        tcase_add_loop_test(motion, too_few_iterations_are_safe, 0, 4 * (int)(sizeof moving / sizeof *moving));
        tcase_add_loop_test(motion, few_iterations_come_to_rest, 0, 2 * RESTING);
    }
    tcase_add_loop_test(motion, single_precision_rests, 0, 2);
    TCase *const cases[] = {tables_case, weights, solutions, motion};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        tcase_set_timeout(cases[k], 100);
        suite_add_tcase(suite, cases[k]);
    }
    return run_suite(suite);
}
