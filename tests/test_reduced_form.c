/* Reduced form = literal form, iterate by iterate.
 *
 * Every kernel table of this machine is driven side by side with the literal backend on the same system, through the
 * stepwise entries, with penalty updates in between; v, lambda, beta and both residuals are compared after every
 * iteration. The fused entry of a table is compared with its own stepwise entries, and with itself on other thread
 * counts. What makes the oracle itself trustworthy is at the end: the paper's invariants, checked on its internals.
 */
#include <check.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "backend_ref/literal.h"
#include "core/base/memory.h"
#include "core/model/system_math.h"
#include "run_suite.h"
#include "table_runner.h"

static void runner_step(struct runner *r, bool measure)
{
    CALL(r, r->k->update_velocity(r->c, &r->error));
    CALL(r, r->k->update_constraints(r->c, measure, &r->error));
}

static void runner_penalty(struct runner *r, double ratio)
{
    CALL(r, r->k->update_penalty(r->c, ratio, &r->error));
    CALL(r, r->k->factorize(r->c, &r->error));
}

static void read_betas(struct runner *r, double *beta) { CALL(r, r->k->read_penalty(r->c, beta, &r->error)); }

static double largest_b(const struct runner *r)
{
    double A[36], b[6], largest = 0;
    for (int32_t i = 0; i < r->p->system.body_count; ++i) {
        sadmm_system_body(&r->p->system, &r->settings, i, A, b);
        for (int j = 0; j < 6; ++j) largest = fmax(largest, fabs(b[j]));
    }
    return largest;
}

enum { ITERATIONS = 120 };

static bool is_measured(int done) { return done == 1 || done == 10 || done == 11 || done % 30 == 0; }
static bool is_update(int done) { return done == 11 || done % 30 == 0; }

START_TEST(stepwise_equals_literal)
{
    const struct sadmm_kernels *table = tables[_i / SCENES];
    const struct scene *scene = &scenes[_i % SCENES];
    double tolerance = scene_tolerance(scene, table);
    struct contact_problem *problem = make_problem(scene);
    struct runner ref, own;
    runner_start(&ref, literal(), scene, problem, 1);
    runner_start(&own, table, scene, problem, 2);

    size_t n = (size_t)problem->system.body_count;
    double *beta = malloc(n * sizeof *beta), *own_beta = malloc(n * sizeof *own_beta);
    struct spread v = {0, 0}, lambda = {0, 0}, betas = {0, 0};
    double worst_primal = 0, worst_dual = 0;
    for (int done = 1; done <= ITERATIONS; ++done) {
        bool measure = is_measured(done);
        runner_step(&ref, measure);
        runner_step(&own, measure);
        compare_solutions(&own, &ref, &v, &lambda);
        if (!measure) continue;

        struct sadmm_residual wanted, got;
        CALL(&ref, ref.k->measure_residuals(ref.c, &wanted, &ref.error));
        CALL(&own, own.k->measure_residuals(own.c, &got, &own.error));
        read_betas(&ref, beta);
        read_betas(&own, own_beta);
        double softest = INFINITY;
        for (size_t i = 0; i < n; ++i) {
            add(&betas, own_beta[i] / beta[i], 1);
            softest = fmin(softest, beta[i]);
        }
        /* The reduced form takes the residuals as differences: of lambda, over beta, and of impulses. */
        worst_primal = fmax(worst_primal, fabs(got.primal - wanted.primal) / (wanted.primal + lambda.scale / softest));
        worst_dual = fmax(worst_dual, fabs(got.dual - wanted.dual) / (wanted.dual + lambda.scale + largest_b(&ref)));
        if (is_update(done) && done < ITERATIONS) {
            double ratio = fmin(fmax(wanted.primal / fmax(wanted.dual, 1e-300), 0.25), 4);
            ck_assert(ratio > 0);
            runner_penalty(&ref, ratio);
            runner_penalty(&own, ratio);
        }
    }
    if (getenv("REDUCED_FORM_FIGURES"))
        printf("%-8s f%d %-32s v %.1e lambda %.1e primal %.1e dual %.1e beta %.1e\n", table->variant,
               table->precision == SADMM_F32 ? 32 : 64, scene->name, relative(v), relative(lambda), worst_primal,
               worst_dual, relative(betas));
    ck_assert_msg(relative(v) <= tolerance, "%s: v differs by %g", scene->name, relative(v));
    ck_assert_msg(relative(lambda) <= tolerance, "%s: lambda differs by %g", scene->name, relative(lambda));
    /* Rounding of lambda and of the impulses they are differences of: a body's sum has up to 32 points here (the
     * plates'). */
    double rounding = 32 * table_epsilon(table);
    ck_assert_msg(worst_primal <= rounding, "%s: primal residual differs by %g", scene->name, worst_primal);
    ck_assert_msg(worst_dual <= rounding, "%s: dual residual differs by %g", scene->name, worst_dual);
    /* Sums of a body's rows in another order, then one product an update. */
    ck_assert_msg(relative(betas) <= (table->precision == SADMM_F32 ? 1e-5 : 1e-13), "%s: beta differs by %g",
                  scene->name, relative(betas));

    /* Q and R from the same solution: only their own rounding is added. Torques have arms of a metre or so. */
    struct spread wrenches = {0, 0}, states = {0, 0};
    double *wrench = malloc(6 * n * sizeof *wrench), *own_wrench = malloc(6 * n * sizeof *own_wrench);
    CALL(&ref, ref.k->recover_wrenches(ref.c, wrench, &ref.error));
    CALL(&own, own.k->recover_wrenches(own.c, own_wrench, &own.error));
    for (size_t i = 0; i < 6 * n; ++i) add(&wrenches, own_wrench[i], wrench[i]);
    ck_assert_msg(relative(wrenches) <= 4 * tolerance, "%s: wrenches differ by %g", scene->name, relative(wrenches));
    if (scene->form == RIGID) {
        struct sadmm_rigid *next = malloc(n * sizeof *next), *own_next = malloc(n * sizeof *own_next);
        CALL(&ref, ref.k->integrate(ref.c, next, &ref.error));
        CALL(&own, own.k->integrate(own.c, own_next, &own.error));
        for (size_t i = 0; i < n; ++i) {
            for (int j = 0; j < 3; ++j) add(&states, own_next[i].position[j], next[i].position[j]);
            for (int j = 0; j < 4; ++j) add(&states, own_next[i].orientation[j], next[i].orientation[j]);
            for (int j = 0; j < 6; ++j) add(&states, own_next[i].velocity[j], next[i].velocity[j]);
        }
        ck_assert_msg(relative(states) <= tolerance, "%s: states differ by %g", scene->name, relative(states));
        free(next);
        free(own_next);
    }
    free(wrench);
    free(own_wrench);
    free(beta);
    free(own_beta);
    runner_stop(&ref);
    runner_stop(&own);
    contact_problem_free(problem);
}
END_TEST

/* The same arithmetic in the same order: not one bit may differ, also on another number of threads. */
START_TEST(fused_equals_stepwise)
{
    const struct sadmm_kernels *table = tables[_i / SCENES];
    const struct scene *scene = &scenes[_i % SCENES];
    static const int batches[] = {1, 10, 19, 30, 2, 58};
    ck_assert(table->iterate != NULL);
    struct contact_problem *problem = make_problem(scene);
    struct runner fused[3], step;
    runner_start(&step, table, scene, problem, 1);
    for (int t = 0; t < 3; ++t) runner_start(&fused[t], table, scene, problem, t + 1);

    for (size_t s = 0; s < sizeof batches / sizeof *batches; ++s) {
        struct sadmm_residual wanted, got;
        for (int i = 1; i <= batches[s]; ++i) runner_step(&step, i == batches[s]);
        CALL(&step, step.k->measure_residuals(step.c, &wanted, &step.error));
        for (int t = 0; t < 3; ++t) {
            struct spread v = {0, 0}, lambda = {0, 0};
            CALL(&fused[t], table->iterate(fused[t].c, batches[s], false, true, &fused[t].error));
            CALL(&fused[t], table->measure_residuals(fused[t].c, &got, &fused[t].error));
            compare_solutions(&fused[t], &step, &v, &lambda);
            ck_assert_msg(v.difference == 0 && lambda.difference == 0, "%s, batch %zu, %d threads: v %g, lambda %g",
                          scene->name, s, t + 1, relative(v), relative(lambda));
            ck_assert(got.primal == wanted.primal && got.dual == wanted.dual);
            if (s % 2) runner_penalty(&fused[t], 1.7);
        }
        if (s % 2) runner_penalty(&step, 1.7);
    }
    for (int t = 0; t < 3; ++t) runner_stop(&fused[t]);
    runner_stop(&step);
    contact_problem_free(problem);
}
END_TEST

/* A context is used again for another system, smaller and larger: nothing of the last one may leak into it. */
START_TEST(contexts_can_be_used_again)
{
    const struct sadmm_kernels *table = _i < table_count ? tables[_i] : literal();
    struct runner again = {0};
    again.k = table;
    CALL(&again, table->create(0, &again.c, &again.error));
    for (int s = 0; s < SCENES; ++s) {
        struct contact_problem *problem = make_problem(&scenes[s]);
        struct runner fresh;
        struct spread v = {0, 0}, lambda = {0, 0};
        runner_start(&fresh, table, &scenes[s], problem, 2);
        again.p = contact_problem_copy(problem);
        again.settings = fresh.settings;
        again.plan = fresh.plan;
        CALL(&again, table->begin(again.c, &again.p->system, &again.plan, &again.settings, &again.error));
        runner_assemble(&again);
        for (int i = 0; i < 5; ++i) {
            runner_step(&fresh, true); /* ends measured: the flag must not survive either */
            runner_step(&again, true);
        }
        compare_solutions(&again, &fresh, &v, &lambda);
        ck_assert_msg(v.difference == 0 && lambda.difference == 0, "%s", scenes[s].name);
        contact_problem_free(again.p);
        runner_stop(&fresh);
        contact_problem_free(problem);
    }
    table->destroy(again.c);
}
END_TEST

/* ---- the oracle ---------------------------------------------------------------------------------------------- */

/* What the paper says holds after any iteration: (10) and (11), u = -lambda on both sides; (8), (z_i + z_j, lambda)
 * in C(e). */
START_TEST(literal_invariants)
{
    const struct scene *scene = &scenes[_i];
    struct contact_problem *problem = make_problem(scene);
    struct runner r;
    runner_start(&r, literal(), scene, problem, 1);
    for (int done = 1; done <= 40; ++done) {
        runner_step(&r, false);
        for (size_t k = 0; k < r.c->constraint_count; ++k) {
            const struct ref_constraint *constraint = &r.c->constraints[k];
            double z[6] = {0}, stiffest = 0, scale = 0, z_scale = 1e-3;
            for (int s = 0; s < 2; ++s) {
                const struct ref_side *side = &constraint->side[s];
                if (side->body < 0) continue;
                stiffest = fmax(stiffest, r.c->bodies[side->body].beta);
                for (int i = 0; i < constraint->rows; ++i) {
                    scale =
                        fmax(scale, fmax(fabs(constraint->lambda[i]), r.c->bodies[side->body].beta * fabs(side->x[i])));
                    z_scale =
                        fmax(z_scale, fabs(side->z[i]) + fabs(constraint->e[i]) + scale / r.c->bodies[side->body].beta);
                }
            }
            for (int i = 0; i < constraint->rows; ++i)
                for (int s = 0; s < 2; ++s) {
                    const struct ref_side *side = &constraint->side[s];
                    if (side->body < 0) continue;
                    z[i] += side->z[i];
                    /* 1e-14: a few roundings of the largest term, beta x or lambda. */
                    ck_assert_double_le(fabs(side->u[i] + constraint->lambda[i]), 1e-14 * (scale + stiffest * z_scale));
                }
            double small = 1e-13 * z_scale;
            const double *l = constraint->lambda, *e = constraint->e;
            for (int i = 0; i < constraint->rows; ++i) {
                const double gain = constraint->gain[i], compliance = constraint->compliance[i];
                if (constraint->cone) continue;
                if (constraint->free_row[i]) ck_assert(l[i] == 0 && z[i] == 0);
                else
                    ck_assert_double_le(fabs(gain * z[i] + e[i] + compliance * l[i]),
                                        small * (gain + compliance * stiffest) + 1e-14 * fabs(compliance * e[i]));
            }
            if (constraint->cone) {
                double separation = z[0] + e[0], tangent = 0, slip = 0, dot = 0;
                ck_assert(l[0] >= 0);
                ck_assert_double_ge(separation, -small);
                ck_assert_double_le(l[0] * separation, small * (l[0] + stiffest));
                if (constraint->rows == 1) continue;
                for (int i = 1; i < 3; ++i) {
                    double x = z[i] + e[i];
                    tangent += l[i] * l[i], slip += x * x, dot += l[i] * x;
                }
                tangent = sqrt(tangent), slip = sqrt(slip);
                ck_assert_double_le(tangent, constraint->mu * l[0] * (1 + 1e-14));
                /* Sliding, then at the edge of the cone and against the motion. */
                if (slip > small && l[0] > 0 && constraint->mu > 0) {
                    ck_assert_double_ge(tangent, constraint->mu * l[0] * (1 - 1e-9 - small / slip));
                    ck_assert_double_le(dot, -tangent * slip * (1 - 1e-9 - small / slip));
                }
            }
        }
    }
    runner_stop(&r);
    contact_problem_free(problem);
}
END_TEST

/* (13) and (14) for one cube on the ground: Tr C = sum over 4 contacts of |n|^2 + |t1|^2 + |t2|^2 + the same of r x
 * d, and the latter sum to 2 |r|^2. */
START_TEST(literal_penalty)
{
    struct contact_problem *problem = contact_problem_stack((double[]){2}, 1, 0.5);
    struct runner r;
    runner_start(&r, literal(), &scenes[0], problem, 1);
    double beta, inertia = 2.0 / 3 * 0.02, trace_A = 3 * 2.0 + 3 * inertia, trace_C = 4 * (3 + 2 * 0.03);
    read_betas(&r, &beta);
    ck_assert_double_eq_tol(beta, 16 * trace_A / trace_C + 1e5 * 0.005 * 0.005,
                            1e-13); /* rounding of numbers near 10 */
    runner_penalty(&r, 0.5);
    double halved;
    read_betas(&r, &halved);
    ck_assert(halved == 0.5 * beta);
    runner_stop(&r);
    contact_problem_free(problem);
}
END_TEST

/* Coverage must not shrink in silence. */
START_TEST(tables_are_all_here)
{
    static const struct { sadmm_backend backend; sadmm_precision precision; } expected[] = {
        {SADMM_BACKEND_REF, SADMM_F64}, {SADMM_BACKEND_CPU, SADMM_F32}, {SADMM_BACKEND_CPU, SADMM_F64}};
    for (size_t e = 0; e < sizeof expected / sizeof *expected; ++e) {
        bool found = false;
        for (size_t i = 0; sadmm_kernels_at(i); ++i)
            if (sadmm_kernels_at(i)->backend == expected[e].backend &&
                sadmm_kernels_at(i)->precision == expected[e].precision)
                found = true;
        ck_assert_msg(found, "backend %d precision %d is missing", expected[e].backend, expected[e].precision);
    }
    ck_assert_int_ge(table_count, 2);
    for (int i = 0; i < table_count; ++i) ck_assert_ptr_nonnull(tables[i]->iterate);
    const char *reason = NULL;
    ck_assert_ptr_null(sadmm_ref_find(SADMM_F32, &reason)); /* the oracle is double or nothing */
    ck_assert_ptr_nonnull(reason);
}
END_TEST

int main(void)
{
    collect_tables();
    Suite *suite = suite_create("reduced form");
    TCase *cases = tcase_create("reduced form");
    tcase_set_timeout(cases, 100);
    tcase_add_test(cases, tables_are_all_here);
    tcase_add_loop_test(cases, literal_invariants, 0, SCENES);
    tcase_add_test(cases, literal_penalty);
    tcase_add_loop_test(cases, stepwise_equals_literal, 0, table_count * SCENES);
    tcase_add_loop_test(cases, fused_equals_stepwise, 0, table_count * SCENES);
    tcase_add_loop_test(cases, contexts_can_be_used_again, 0, table_count + 1);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
