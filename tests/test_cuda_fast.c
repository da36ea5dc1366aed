/* The method `fast` on the CUDA backend: its entries against the CPU's from identical inputs, and tiers that must agree
 * to the last bit, weights, levels and limit included. test_fast.c drives every registered table beside the literal
 * backend. The same checks run on the emulated device (test_cuda_fast_emulated.c). One file: its tests share
 * how runs are started, iterated and compared. */
#include <float.h>

#include "core/solve/certificate.h"
#include "core/solve/solve_error.h"
#include "core/math/relax.h"
#include "cuda_runner.h"
#include "fixed_work.h"

/* Batches of all lengths, since what is relaxed depends on it, 18 and 35 with graphs in the STREAM tier; new weights
 * in between, often enough for levels. */
static const int batches[] = {1, 2, 18, 3, 1, 5, 35, 4};
enum { BATCHES = sizeof batches / sizeof *batches };

static const struct sadmm_kernels *cpu(void)
{
    const char *reason;
    return sadmm_cpu_find(SADMM_F64, &reason);
}

static void start(struct runner *r, const struct sadmm_kernels *k, const struct scene *scene, enum sadmm_cuda_tier tier)
{
    runner_start_method(r, k, scene, tier, SADMM_METHOD_FAST);
}

static void update_weights(struct runner *r)
{
    CALL(r, r->k->update_weights(r->c, &r->error));
    CALL(r, r->k->factorize(r->c, &r->error));
}

static void iterate(struct runner *r, int count, bool measure)
{
    CALL(r, r->k->iterate(r->c, count, false, measure, &r->error));
}

static int32_t limit(struct runner *r)
{
    int32_t limited = 0;
    if (r->plan.energy_limit) CALL(r, r->k->limit_energy(r->c, &limited, &r->error));
    return limited;
}

/* ---- entries against the CPU's ----------------------------------------------------------------------------------- */

/* One pass: weights, factor, an iteration, its residuals, new weights, another iteration. As in test_cuda.c, rounding
 * of the inputs (6e-8, 1e-16) by a condition number of A + C of a hundred or a few. */
static const double entry_tolerance[2] = {1e-5, 5e-14};
/* All batches: 71 iterations. One does not take two states apart in the norm of A + beta C, so that what is rounded is
 * passed on at most as it is; in the largest velocity it may show larger by the square root of what that norm differs
 * by between bodies that touch, of their masses' ratio of 100 (as scene_tolerance in table_runner.h). */
static const double run_tolerance[2] = {71 * 10 * FLT_EPSILON / 2, 71 * 10 * DBL_EPSILON / 2};

/* The largest |v| and |lambda| so far: a velocity on its way to 0 is not measured by itself. */
struct scales {
    double v, lambda;
};

static void compare(struct runner *own, struct runner *wanted, struct scales *scales, double tolerance,
                    const char *what)
{
    runner_read(own);
    runner_read(wanted);
    const struct spread v = velocity_spread(own, wanted), lambda = lambda_spread(own, wanted);
    scales->v = fmax(scales->v, v.scale);
    scales->lambda = fmax(scales->lambda, lambda.scale);
    ck_assert_msg(v.difference <= tolerance * scales->v, "%s: v %g", what, v.difference / scales->v);
    ck_assert_msg(lambda.difference <= tolerance * scales->lambda, "%s: lambda %g", what,
                  lambda.difference / scales->lambda);
}

START_TEST(entries_equal_cpu)
{
    const struct sadmm_kernels *table = tables[_i / SCENES];
    const struct scene *scene = &scenes[_i % SCENES];
    const double tolerance = entry_tolerance[table->precision];
    struct runner ref, own;
    struct scales scales = {0, 0};
    start(&ref, cpu(), scene, SADMM_CUDA_TIER_AUTO);
    start(&own, table, scene, SADMM_CUDA_TIER_AUTO);
    const size_t n = (size_t)own.p->system.body_count;
    double *beta = calloc(n + 1, sizeof *beta);
    CALL(&own, table->read_penalty(own.c, beta, &own.error));
    for (size_t i = 0; i < n; ++i) ck_assert_double_eq(beta[i], 1);
    free(beta);

    iterate(&ref, 1, true);
    iterate(&own, 1, true);
    compare(&own, &ref, &scales, tolerance, "iteration");
    const struct sadmm_residual wanted = runner_residual(&ref), got = runner_residual(&own);
    /* Differences of multipliers over weights of 0.1 kg and more; of impulses. */
    ck_assert_msg(fabs(got.primal - wanted.primal) <= tolerance * (wanted.primal + 10 * scales.lambda),
                  "%s: primal %g, %g", scene->name, got.primal, wanted.primal);
    ck_assert_msg(fabs(got.dual - wanted.dual) <= tolerance * (wanted.dual + 10 * scales.lambda + 100),
                  "%s: dual %g, %g", scene->name, got.dual, wanted.dual);

    update_weights(&ref);
    update_weights(&own);
    iterate(&ref, 1, false);
    iterate(&own, 1, false);
    compare(&own, &ref, &scales, tolerance, "new weights");

    for (int s = 0; s < BATCHES; ++s) {
        iterate(&ref, batches[s], false);
        iterate(&own, batches[s], false);
        update_weights(&ref);
        update_weights(&own);
    }
    compare(&own, &ref, &scales, run_tolerance[table->precision], "batches");
    ck_assert_int_eq(limit(&own), limit(&ref));
    compare(&own, &ref, &scales, run_tolerance[table->precision], "limit");
    runner_stop(&ref);
    runner_stop(&own);
}
END_TEST

/* ---- tiers ------------------------------------------------------------------------------------------------------- */

static void check_equal(struct runner *a, struct runner *b, const struct scene *scene)
{
    for (int s = 0; s < BATCHES; ++s) {
        const bool measure = s % 2 == 0;
        char what[128];
        snprintf(what, sizeof what, "%s, tier %d, batch %d", scene->name, (int)tier_of(a->k, a->c, NULL), s);
        iterate(a, batches[s], measure);
        iterate(b, batches[s], measure);
        check_same(a, b, what);
        if (measure) {
            const struct sadmm_residual x = runner_residual(a), y = runner_residual(b);
            ck_assert_msg(x.primal == y.primal && x.dual == y.dual, "%s: residuals", what);
        }
        update_weights(a);
        update_weights(b);
    }
    ck_assert_int_eq(limit(a), limit(b));
    check_same(a, b, "after the limit");
}

/* Every tier against STREAM, from the last thread to the first on the emulated device. */
START_TEST(tiers_agree)
{
    const struct sadmm_kernels *table = tables[_i / SCENES];
    const struct scene *scene = &scenes[_i % SCENES];
    for (size_t t = 0; t + 1 < tier_count; ++t) {
        struct runner stream, fused;
        if (!(scene->tiers >> tiers[t] & 1)) continue;
        start(&stream, table, scene, SADMM_CUDA_TIER_STREAM);
#ifdef CUDA_EMULATED
        cuda_emulation_descending = t % 2;
#endif
        start(&fused, table, scene, tiers[t]);
        check_equal(&fused, &stream, scene);
#ifdef CUDA_EMULATED
        cuda_emulation_descending = 0;
#endif
        runner_stop(&stream);
        runner_stop(&fused);
    }
}
END_TEST

static void start_unrelaxed(struct runner *r, const struct sadmm_kernels *k, enum sadmm_cuda_tier tier)
{
    start(r, k, &scenes[0], tier);
    r->settings.relaxation = 1;
    CALL(r, k->begin(r->c, &r->p->system, &r->plan, &r->settings, &r->error));
    runner_assemble(r);
}

/* Without over-relaxation every iteration is plain: it keeps the projected multipliers, not the old ones and a
 * change. */
START_TEST(unrelaxed_tiers_agree)
{
    const struct sadmm_kernels *table = tables[_i];
    for (size_t t = 0; t + 1 < tier_count; ++t) {
        struct runner stream, fused;
        start_unrelaxed(&stream, table, SADMM_CUDA_TIER_STREAM);
        start_unrelaxed(&fused, table, tiers[t]);
        iterate(&stream, 20, false);
        iterate(&fused, 20, false);
        check_same(&fused, &stream, "unrelaxed");
        runner_stop(&stream);
        runner_stop(&fused);
    }
}
END_TEST

/* Batches without new weights between them: what bodies keep from one to the next, and where it is taken again in the
 * middle of one, after 128 iterations. The CPU's within the tolerance of all batches: these are longer, but have one
 * set of weights. */
START_TEST(batches_go_on)
{
    static const int counts[] = {1, 90, 3, 170}, some[] = {0, 2, 8}; /* 8: row blocks */
    const struct sadmm_kernels *table = tables[_i / 3];
    const struct scene *scene = &scenes[some[_i % 3]];
    struct runner ref;
    struct scales scales = {0, 0};
    start(&ref, cpu(), scene, SADMM_CUDA_TIER_AUTO);
    for (size_t k = 0; k < sizeof counts / sizeof *counts; ++k) iterate(&ref, counts[k], false);
    for (size_t t = 0; t + 1 < tier_count; ++t) {
        struct runner stream, fused;
        if (!(scene->tiers >> tiers[t] & 1)) continue;
        start(&stream, table, scene, SADMM_CUDA_TIER_STREAM);
        start(&fused, table, scene, tiers[t]);
        for (size_t k = 0; k < sizeof counts / sizeof *counts; ++k) {
            iterate(&stream, counts[k], false);
            iterate(&fused, counts[k], false);
            check_same(&fused, &stream, scene->name);
        }
        compare(&fused, &ref, &scales, run_tolerance[table->precision], scene->name);
        runner_stop(&stream);
        runner_stop(&fused);
    }
    runner_stop(&ref);
}
END_TEST

/* Sums over islands of several powers of sixteen, and islands that begin anywhere: chains of one contact each, one of
 * them of more than two thousand bodies. */
static struct contact_problem *chains(void)
{
    static const double up[3] = {0, 0, 1};
    struct contact_problem *p = contact_problem_new();
    for (int i = 0; i < 4200; ++i) {
        const int below = i < 2100 ? i - 1 : i % 40 ? i - 1 : -1;
        contact_problem_box(p, 1 + i % 3, 0.1, 0.1, 0.1, 0, 0, 0.1 + 0.2 * i);
        contact_problem_touch(p, below, i, (double[3]){0, 0, 0.2 * i}, up, 0, 0.5, 0);
    }
    return p;
}

START_TEST(many_bodies)
{
    static const struct scene many = {"chains", chains, RIGID, true, 0};
    const struct sadmm_kernels *table = tables[_i];
    struct runner ref, own;
    struct scales scales = {0, 0};
    start(&ref, cpu(), &many, SADMM_CUDA_TIER_AUTO);
    start(&own, table, &many, SADMM_CUDA_TIER_STREAM);
    iterate(&ref, 2, false);
    iterate(&own, 2, false);
    update_weights(&ref);
    update_weights(&own);
    iterate(&ref, 1, false);
    iterate(&own, 1, false);
    compare(&own, &ref, &scales, entry_tolerance[table->precision], "chains");
    ck_assert_int_eq(limit(&own), limit(&ref));
    runner_stop(&ref);
    runner_stop(&own);
}
END_TEST

#ifdef CUDA_EMULATED
/* Boxes beside each other, of which the first `held` rest on the ground: an island each. */
static struct contact_problem *boxes(int count, int held)
{
    static const double up[3] = {0, 0, 1};
    struct contact_problem *p = contact_problem_new();
    for (int i = 0; i < count; ++i) {
        contact_problem_box(p, 1 + i % 3, 0.1, 0.1, 0.1, i, 0, 0.1);
        for (int k = 0; i < held && k < 4; ++k)
            contact_problem_touch(p, -1, i, (double[3]){i + (k & 1 ? 0.1 : -0.1), k & 2 ? 0.1 : -0.1, 0}, up, 0, 0.5,
                                  0);
    }
    return p;
}
static struct contact_problem *resting(void) { return boxes(2000, 2000); }
static struct contact_problem *few_in_flight(void) { return boxes(1200, 10); }
static struct contact_problem *many_in_flight(void) { return boxes(1600, 10); }

/* 2,000 islands of a side and a body: a block of 1,024 threads (f32; f64: 512) takes 256 sides (128), and by cost a
 * part may be all sides. So there are 4 (8) rounds of one block on each of the emulated device's 4 multiprocessors. */
START_TEST(islands_in_rounds)
{
    static const struct scene scene = {"resting boxes", resting, RIGID, true, 0};
    const struct sadmm_kernels *table = tables[_i];
    struct runner block, stream;
    int32_t parts = 0;
    start(&block, table, &scene, SADMM_CUDA_TIER_BLOCK);
    start(&stream, table, &scene, SADMM_CUDA_TIER_STREAM);
    tier_of(table, block.c, &parts);
    ck_assert_int_eq(parts, table->precision == SADMM_F32 ? 16 : 32);
    iterate(&block, 3, false);
    iterate(&stream, 3, false);
    check_same(&block, &stream, "islands in rounds");
    runner_stop(&block);
    runner_stop(&stream);
}
END_TEST

/* Of 1,200 bodies in the air the emulated multiprocessors have 300 each, 2.4 us an iteration, below STREAM's 2.75; of
 * 1,600 400, 3.2 us. `paper` has STREAM iterate them as all tiers do. */
START_TEST(bodies_in_the_air_are_streamed)
{
    static const struct scene few = {"few in flight", few_in_flight, RIGID, true, 0},
                              many = {"many in flight", many_in_flight, RIGID, true, 0};
    const struct sadmm_kernels *table = tables[_i];
    struct runner r[3];
    start(&r[0], table, &few, SADMM_CUDA_TIER_AUTO);
    start(&r[1], table, &many, SADMM_CUDA_TIER_AUTO);
    runner_start_method(&r[2], table, &many, SADMM_CUDA_TIER_AUTO, SADMM_METHOD_PAPER);
    ck_assert_int_ne(tier_of(table, r[0].c, NULL), SADMM_CUDA_TIER_STREAM);
    ck_assert_int_eq(tier_of(table, r[1].c, NULL), SADMM_CUDA_TIER_STREAM);
    ck_assert_int_ne(tier_of(table, r[2].c, NULL), SADMM_CUDA_TIER_STREAM);
    for (int k = 0; k < 3; ++k) runner_stop(&r[k]);
}
END_TEST
#endif

/* A column of boxes at rest with the impulses that hold it, and separations of some um: loads pass 60 bodies, so that
 * warm steps take larger weights and ease the separations (math/weight.h). */
static void start_deep_stack(struct runner *r, const struct sadmm_kernels *k, enum sadmm_cuda_tier tier)
{
    static const double up[3] = {0, 0, 1};
    enum { BOXES = 60 };
    runner_create(r, k);
    if (k->backend == SADMM_BACKEND_CUDA) force_tier(k, r->c, tier);
    r->settings = fixed_settings();
    r->settings.method = SADMM_METHOD_FAST;
    r->p = contact_problem_new();
    for (int i = 0; i < BOXES; ++i) {
        contact_problem_box(r->p, 1, 0.1, 0.1, 0.1, 0, 0, 0.1 + 0.2 * i);
        for (int c = 0; c < 4; ++c) {
            contact_problem_touch(r->p, i - 1, i, (double[3]){c & 1 ? 0.1 : -0.1, c & 2 ? 0.1 : -0.1, 0.2 * i}, up,
                                  1e-6 * (i + c), 0.5, 0);
            r->p->contacts.points[4 * i + c].impulse[2] = (BOXES - i) * 9.81 * r->settings.dt / 4;
        }
    }
    r->plan = sadmm_plan_make(&r->p->system, &r->settings);
    ck_assert(r->plan.warm && r->plan.rigid);
    CALL(r, k->begin(r->c, &r->p->system, &r->plan, &r->settings, &r->error));
    runner_assemble(r);
}

START_TEST(deep_stacks)
{
    const struct sadmm_kernels *table = tables[_i];
    struct runner ref, own[MOST_TIERS];
    struct scales scales = {0, 0};
    start_deep_stack(&ref, cpu(), SADMM_CUDA_TIER_AUTO);
    iterate(&ref, 3, false);
    for (size_t t = tier_count; t-- > 0;) {
        start_deep_stack(&own[t], table, tiers[t]);
        iterate(&own[t], 3, false);
        /* three iterations of an entry's error each */
        compare(&own[t], &ref, &scales, 3 * entry_tolerance[table->precision], "deep stack");
        if (t + 1 < tier_count) check_same(&own[t], &own[tier_count - 1], "deep stack, tiers");
    }
    for (size_t t = 0; t < tier_count; ++t) runner_stop(&own[t]);
    runner_stop(&ref);
}
END_TEST

/* Between an abort and its end nothing changes, weights included. */
START_TEST(aborted_does_nothing)
{
    const struct sadmm_kernels *table = tables[_i];
    const struct scene *scene = find_scene("pyramid");
    for (size_t t = 0; t < tier_count; ++t) {
        struct runner plain, aborted;
        start(&plain, table, scene, tiers[t]);
        start(&aborted, table, scene, tiers[t]);
        iterate(&plain, 3, false);
        iterate(&aborted, 3, false);
        set_abort(&aborted, ABORT_PARTITION);
        iterate(&aborted, RELAX_RESIDUAL_PERIOD, true); /* residuals will be recomputed when those of the other are */
        set_abort(&aborted, ABORT_NONE);
        check_same(&aborted, &plain, "aborted");
        for (int k = 0; k < 2; ++k) {
            struct runner *r = k ? &aborted : &plain;
            update_weights(r);
            if (k) set_abort(r, ABORT_PARTITION);
            if (k) CALL(r, table->factorize(r->c, &r->error));
            if (k) set_abort(r, ABORT_NONE);
            iterate(r, 4, false);
        }
        check_same(&aborted, &plain, "after the abort");
        set_abort(&aborted, ABORT_PARTITION);
        ck_assert_int_eq(limit(&aborted), 0);
        check_same(&aborted, &plain, "nothing is limited");
        runner_stop(&plain);
        runner_stop(&aborted);
    }
}
END_TEST

/* ---- solves ------------------------------------------------------------------------------------------------------ */

static struct sadmm_solve_report solve(struct runner *r, const struct scene *scene, int iterations, double tolerance)
{
    struct sadmm_solve_report report;
    r->settings = fixed_settings();
    r->settings.method = SADMM_METHOD_FAST;
    r->settings.warm_start = scene->warm;
    r->settings.measure_residuals = true;
    r->settings.iterations = iterations;
    r->settings.tolerance = tolerance;
    r->settings.check_period = 20;
    contact_problem_free(r->p);
    r->p = make_problem(scene, &r->settings);
    r->plan = sadmm_plan_make(&r->p->system, &r->settings);
    CALL(r, sadmm_schedule_solve(r->k, r->c, &r->p->system, &r->settings, &r->plan, NULL, &report, &r->error));
    return report;
}

/* Through the schedule, in a fresh context and in one that has seen larger and smaller systems and the other method. */
START_TEST(runs_repeat)
{
    const struct sadmm_kernels *table = tables[_i];
    struct runner used, fresh;
    runner_create(&used, table);
    for (size_t s = 0; s < SCENES; ++s) {
        CALL(&used, runner_begin(&used, &scenes[s], SADMM_METHOD_PAPER));
        runner_create(&fresh, table);
        struct sadmm_solve_report a = solve(&fresh, &scenes[s], 45, 0), b = solve(&used, &scenes[s], 45, 0);
        struct spread v = velocity_spread(&used, &fresh), lambda = lambda_spread(&used, &fresh);
        ck_assert_msg(v.difference == 0 && lambda.difference == 0, "%s: v %g, lambda %g", scenes[s].name, v.difference,
                      lambda.difference);
        ck_assert_int_eq(a.limited, b.limited);
        runner_stop(&fresh);
    }
    runner_stop(&used);
}
END_TEST

/* To a certificate, in no more iterations than the CPU (a convergence check every 20). */
START_TEST(solutions_are_certified)
{
    static const char *const names[] = {"pyramid", "towers, frictionless", "octagons, frictionless"};
    const struct sadmm_kernels *table = tables[_i];
    for (size_t k = 0; k < sizeof names / sizeof *names; ++k) {
        struct runner ref, own;
        runner_create(&ref, cpu());
        runner_create(&own, table);
        /* m/s; single precision rounds velocities of some m/s by 1e-7 each */
        const double tolerance = table->precision == SADMM_F32 ? 1e-5 : 1e-8;
        struct sadmm_solve_report wanted = solve(&ref, find_scene(names[k]), 600, tolerance),
                                  got = solve(&own, find_scene(names[k]), 600, tolerance);
        ck_assert_msg(got.converged && wanted.converged, "%s: %g after %d", names[k], got.certificate.ncp_max,
                      got.iterations);
        ck_assert_msg(got.iterations <= wanted.iterations + 20, "%s: %d and %d iterations", names[k], got.iterations,
                      wanted.iterations);
        runner_stop(&ref);
        runner_stop(&own);
    }
}
END_TEST

static int32_t check_convergence(struct runner *r, int done)
{
    int32_t unmet = -1;
    if (r->k->precision == SADMM_F32) CALL(r, SYMBOL(check_convergence, f32)(r->c, done, &unmet, &r->error));
    else CALL(r, SYMBOL(check_convergence, f64)(r->c, done, &unmet, &r->error));
    return unmet;
}

static void start_with_rule(struct runner *r, const struct sadmm_kernels *k, const struct scene *scene,
                            enum sadmm_cuda_tier tier)
{
    start(r, k, scene, tier);
    r->settings.tolerance = 1e-3;
    CALL(r, k->begin(r->c, &r->p->system, &r->plan, &r->settings, &r->error));
    runner_assemble(r);
}

/* Convergence checks of every tier find as many islands above the tolerance as the host does, whatever their
 * constraints are, row blocks included; and islands that met it stay as they are. */
START_TEST(convergence_checks_find_what_the_host_does)
{
    static const int counts[] = {1, 4, 15, 40};
    const struct sadmm_kernels *table = tables[_i / SCENES];
    const struct scene *scene = &scenes[_i % SCENES];
    struct sadmm_solve_errors errors = {0};
    int32_t most = 0;
    for (size_t t = 0; t + 1 < tier_count; ++t) {
        struct runner stream, own;
        if (!(scene->tiers >> tiers[t] & 1)) continue;
        start_with_rule(&stream, table, scene, SADMM_CUDA_TIER_STREAM);
        start_with_rule(&own, table, scene, tiers[t]);
        int32_t unmet = 0;
        for (int k = 0, done = 0; k < (int)(sizeof counts / sizeof *counts); ++k) {
            char what[100];
            iterate(&stream, counts[k], false);
            iterate(&own, counts[k], false);
            done += counts[k];
            snprintf(what, sizeof what, "%s, tier %d, %d iterations", scene->name, (int)tiers[t], done);
            unmet = check_convergence(&own, done);
            ck_assert_int_eq(unmet, check_convergence(&stream, done));
            check_same(&own, &stream, what);
            CALL(&own, sadmm_solve_errors_find(&errors, &own.p->system, &own.settings, table->precision, &own.error));
            const int64_t host = sadmm_solve_errors_sum(&errors, own.settings.tolerance).unsolved;
            ck_assert_msg(unmet == host, "%s: %d islands, the host has %lld", what, unmet, (long long)host);
            most = unmet > most ? unmet : most;
        }
        if (unmet == 0) { /* all have stopped */
            iterate(&own, 9, false);
            check_same(&own, &stream, "after the last island has stopped");
        }
        runner_stop(&stream);
        runner_stop(&own);
    }
    sadmm_solve_errors_free(&errors);
    if (strncmp(scene->name, "mixed", 5) == 0 || strncmp(scene->name, "towers", 6) == 0) ck_assert_int_gt(most, 0);
}
END_TEST

/* Iterations that end with more energy than contacts can leave: an island is slowed down, here and on the CPU. */
START_TEST(islands_are_slowed_down)
{
    const struct sadmm_kernels *table = tables[_i];
    int32_t limited = 0;
    for (size_t s = 0; s < SCENES; ++s) {
        struct runner ref, own;
        if (scenes[s].form != RIGID) continue;
        runner_create(&ref, cpu());
        runner_create(&own, table);
        for (int iterations = 1; iterations <= 3; ++iterations) {
            struct sadmm_solve_report wanted = solve(&ref, &scenes[s], iterations, 0),
                                      got = solve(&own, &scenes[s], iterations, 0);
            ck_assert_msg(got.limited == wanted.limited, "%s, %d iterations: %d and %d islands", scenes[s].name,
                          iterations, got.limited, wanted.limited);
            limited += got.limited;
        }
        runner_stop(&ref);
        runner_stop(&own);
    }
    ck_assert_int_gt(limited, 0);
}
END_TEST

#ifdef CUDA_EMULATED
/* Let runtime calls of a solve fail in turn: always a status and a message, never a leak. */
START_TEST(calls_that_fail)
{
    const struct sadmm_kernels *table = tables[_i];
    const struct scene *scene = find_scene("pyramid");
    sadmm_settings settings = fixed_settings();
    settings.method = SADMM_METHOD_FAST;
    settings.iterations = 6; /* new weights after 5 */
    int failed = 0;
    for (long calls = 0; solve_fails_at(table, SADMM_CUDA_TIER_AUTO, scene, &settings, calls); ++calls) ++failed;
    ck_assert_int_gt(failed, 40);
}
END_TEST
#endif

/* Under sanitizers, on the emulated device, which is slow there: one precision, and some of the scenes. */
int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    const int parts = tested_precisions();
    find_tiers();
    Suite *suite = suite_create("cuda_fast");
    for (int p = 0; p < parts; ++p) {
        const int first = p * SCENES, some = first + (parts == 2 ? SCENES : SCENES / 3);
        add_case(suite, p ? "entries_f64" : "entries_f32", entries_equal_cpu, first, first + SCENES);
        add_case(suite, p ? "checks_f64" : "checks_f32", convergence_checks_find_what_the_host_does, first, some);
        add_case(suite, p ? "tiers_f64" : "tiers_f32", tiers_agree, first, some);
    }
    ADD_CASE(suite, unrelaxed_tiers_agree, 0, parts);
    ADD_CASE(suite, batches_go_on, 0, 3 * parts);
    ADD_CASE(suite, many_bodies, 0, parts);
    ADD_CASE(suite, deep_stacks, 0, parts);
    ADD_CASE(suite, aborted_does_nothing, 0, parts);
    ADD_CASE(suite, runs_repeat, 0, parts);
    ADD_CASE(suite, solutions_are_certified, 0, parts);
    ADD_CASE(suite, islands_are_slowed_down, 0, parts);
#ifdef CUDA_EMULATED
    ADD_CASE(suite, calls_that_fail, 0, parts);
    ADD_CASE(suite, islands_in_rounds, 0, parts);
    ADD_CASE(suite, bodies_in_the_air_are_streamed, 0, parts);
#endif
    return run_cuda_suite(suite);
}
