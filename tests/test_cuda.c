/* The CUDA backend, entry by entry, tier by tier.
 *
 * test_reduced_form.c drives every registered table beside the literal backend; here is what only this backend has:
 * each entry alone from identical inputs, tiers of the fused entry that must agree to the last bit, contexts side by
 * side, devices that are missing or fail. The same checks run on the emulated device (test_cuda_emulated.c,
 * cuda_emulation/), where every build can run them; here they run on a real one, or the program is skipped and says
 * why.
 */
#include "cuda_runner.h"
#include "fixed_work.h"
#include "row_laws.h"

/* ---- entries against the literal form -------------------------------------------------------------------------- */

/* One pass of every entry from identical inputs. An entry rounds its inputs to the precision (6e-8, 1e-16) and sums
 * some tens of terms; Step 1 multiplies by (A + beta C)^-1, whose condition number here is under a hundred. */
static const double entry_tolerance[2] = {1e-5, 1e-12};

START_TEST(entries_equal_literal)
{
    const struct sadmm_kernels *table = tables[_i / SCENES];
    const struct scene *scene = &scenes[_i % SCENES];
    double tolerance = entry_tolerance[table->precision];
    struct runner ref, own;
    runner_start(&ref, literal(), scene, SADMM_CUDA_TIER_AUTO);
    runner_start(&own, table, scene, SADMM_CUDA_TIER_AUTO);
    size_t n = (size_t)own.p->system.body_count;

    /* A-D: the start values come back. */
    runner_read(&ref);
    runner_read(&own);
    ck_assert_msg(relative(velocity_spread(&own, &ref)) <= tolerance, "start v: %g",
                  relative(velocity_spread(&own, &ref)));
    ck_assert_msg(relative(lambda_spread(&own, &ref)) <= tolerance, "start lambda");

    /* E-H */
    double *beta = calloc(n + 1, sizeof *beta), *own_beta = calloc(n + 1, sizeof *own_beta);
    CALL(&ref, ref.k->read_penalty(ref.c, beta, &ref.error));
    CALL(&own, own.k->read_penalty(own.c, own_beta, &own.error));
    for (size_t i = 0; i < n; ++i)
        ck_assert_msg(fabs(own_beta[i] / beta[i] - 1) <= tolerance, "beta of body %zu: %g, %g", i, own_beta[i],
                      beta[i]);

    /* I-K */
    CALL(&ref, ref.k->update_velocity(ref.c, &ref.error));
    CALL(&own, own.k->update_velocity(own.c, &own.error));
    runner_read(&ref);
    runner_read(&own);
    ck_assert_msg(relative(velocity_spread(&own, &ref)) <= tolerance, "Step 1: %g",
                  relative(velocity_spread(&own, &ref)));

    /* L-O, (16), (17) */
    CALL(&ref, ref.k->update_constraints(ref.c, true, &ref.error));
    CALL(&own, own.k->update_constraints(own.c, true, &own.error));
    runner_read(&ref);
    runner_read(&own);
    struct spread lambda = lambda_spread(&own, &ref);
    ck_assert_msg(relative(lambda) <= tolerance, "Steps 2-4: %g", relative(lambda));
    struct sadmm_residual wanted = runner_residual(&ref), got = runner_residual(&own);
    /* The reduced form takes the residuals as differences of multipliers and impulses, so those set their rounding. */
    double softest = INFINITY;
    for (size_t i = 0; i < n; ++i) softest = fmin(softest, beta[i]);
    ck_assert_msg(fabs(got.primal - wanted.primal) <= tolerance * (wanted.primal + lambda.scale / softest),
                  "primal %g, %g", got.primal, wanted.primal);
    ck_assert_msg(fabs(got.dual - wanted.dual) <= tolerance * (wanted.dual + 10 * lambda.scale + 100), "dual %g, %g",
                  got.dual, wanted.dual);

    /* P, and the extrapolation that follows it */
    CALL(&ref, ref.k->update_penalty(ref.c, 2.5, &ref.error));
    CALL(&own, own.k->update_penalty(own.c, 2.5, &own.error));
    CALL(&ref, ref.k->factorize(ref.c, &ref.error));
    CALL(&own, own.k->factorize(own.c, &own.error));
    CALL(&ref, ref.k->read_penalty(ref.c, beta, &ref.error));
    CALL(&own, own.k->read_penalty(own.c, own_beta, &own.error));
    for (size_t i = 0; i < n; ++i) ck_assert(fabs(own_beta[i] / beta[i] - 1) <= tolerance);
    runner_step(&ref, false);
    runner_step(&own, false);
    runner_read(&ref);
    runner_read(&own);
    ck_assert_msg(relative(velocity_spread(&own, &ref)) <= tolerance, "v after (15): %g",
                  relative(velocity_spread(&own, &ref)));
    ck_assert_msg(relative(lambda_spread(&own, &ref)) <= 4 * tolerance, "lambda after (15): %g",
                  relative(lambda_spread(&own, &ref)));

    /* R and Q */
    double *wrench = calloc(6 * n + 1, sizeof *wrench), *own_wrench = calloc(6 * n + 1, sizeof *own_wrench);
    struct spread wrenches = {0, 0}, moved = {0, 0};
    CALL(&ref, ref.k->recover_wrenches(ref.c, wrench, &ref.error));
    CALL(&own, own.k->recover_wrenches(own.c, own_wrench, &own.error));
    for (size_t i = 0; i < 6 * n; ++i) add(&wrenches, own_wrench[i], wrench[i]);
    ck_assert_msg(relative(wrenches) <= 4 * tolerance, "wrenches: %g", relative(wrenches));
    struct sadmm_rigid *next = calloc(n + 1, sizeof *next), *own_next = calloc(n + 1, sizeof *own_next);
    if (scene->form == RIGID) {
        CALL(&ref, ref.k->integrate(ref.c, next, &ref.error));
        CALL(&own, own.k->integrate(own.c, own_next, &own.error));
        for (size_t i = 0; i < n; ++i) {
            for (int j = 0; j < 3; ++j) add(&moved, own_next[i].position[j], next[i].position[j]);
            for (int j = 0; j < 4; ++j) add(&moved, own_next[i].orientation[j], next[i].orientation[j]);
            for (int j = 0; j < 6; ++j) add(&moved, own_next[i].velocity[j], next[i].velocity[j]);
            ck_assert(own_next[i].mass == next[i].mass); /* what does not move is kept */
        }
        ck_assert_msg(relative(moved) <= tolerance, "integrate: %g", relative(moved));
    } else {
        ck_assert_int_eq(own.k->integrate(own.c, own_next, &own.error), SADMM_ERROR_UNSUPPORTED);
    }
    free(next);
    free(own_next);
    free(wrench);
    free(own_wrench);
    free(beta);
    free(own_beta);
    runner_stop(&ref);
    runner_stop(&own);
}
END_TEST

/* ---- tiers ----------------------------------------------------------------------------------------------------- */

/* The same arithmetic in the same order, wherever the state is kept. 34 covers two launches of the graph and a rest. */
START_TEST(tiers_equal_stepwise)
{
    const struct sadmm_kernels *table = tables[_i / SCENES];
    const struct scene *scene = &scenes[_i % SCENES];
    static const int batches[] = {1, 2, 34, 7};
    for (size_t t = 0; t < tier_count; ++t) {
        struct runner step, fused;
        char what[128];
        if (!(scene->tiers >> tiers[t] & 1)) {
            runner_create(&fused, table);
            force_tier(table, fused.c, tiers[t]);
            ck_assert_int_eq(runner_begin(&fused, scene, SADMM_METHOD_PAPER), SADMM_ERROR_UNSUPPORTED);
            force_tier(table, fused.c, SADMM_CUDA_TIER_AUTO); /* and the context stays usable */
            CALL(&fused, runner_begin(&fused, scene, SADMM_METHOD_PAPER));
            runner_stop(&fused);
            continue;
        }
        runner_start(&step, table, scene, SADMM_CUDA_TIER_STREAM);
        runner_start(&fused, table, scene, tiers[t]);
        for (size_t s = 0; s < sizeof batches / sizeof *batches; ++s) {
            bool measure = s % 2 == 0;
            for (int i = 1; i <= batches[s]; ++i) runner_step(&step, measure && i == batches[s]);
            CALL(&fused, table->iterate(fused.c, batches[s], false, measure, &fused.error));
            snprintf(what, sizeof what, "%s, tier %d, batch %zu", scene->name, (int)tiers[t], s);
            if (measure) {
                struct sadmm_residual wanted = runner_residual(&step), got = runner_residual(&fused);
                ck_assert_msg(got.primal == wanted.primal && got.dual == wanted.dual, "%s: residuals", what);
                struct runner *both[] = {&step, &fused};
                for (int k = 0; s == 2 && k < 2; ++k) {
                    CALL(both[k], table->update_penalty(both[k]->c, 0.6, &both[k]->error));
                    CALL(both[k], table->factorize(both[k]->c, &both[k]->error));
                }
            }
            check_same(&fused, &step, what);
        }
        runner_stop(&step);
        runner_stop(&fused);
    }
}
END_TEST

/* Every size of cluster that holds an island; on the emulated device also with threads in the other order. */
START_TEST(cluster_sizes)
{
    static const struct {
        const char *scene;
        int from[2]; /* blocks a cluster at least, by precision */
    } cases[] = {{"mixed", {2, 2}},           {"pyramid", {2, 2}},  {"towers, shuffled", {2, 2}},
                 {"towers, frictionless", {2, 2}}, {"octagons", {2, 2}}, {"large", {4, 8}},
                 {"free bodies", {2, 2}},     {"nothing", {2, 2}}};
    const struct sadmm_kernels *table = tables[_i];
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        const struct scene *scene = find_scene(cases[k].scene);
        struct runner wanted;
        runner_start(&wanted, table, scene, SADMM_CUDA_TIER_STREAM);
        CALL(&wanted, table->iterate(wanted.c, 6, false, true, &wanted.error));
        CALL(&wanted, table->iterate(wanted.c, 5, false, false, &wanted.error));
        const struct sadmm_residual residual = runner_residual(&wanted);
        for (int size = 2; size <= 16; size *= 2) {
            struct runner got;
            char what[128];
            snprintf(what, sizeof what, "%s in clusters of %d", scene->name, size);
            runner_create(&got, table);
            force_tier(table, got.c, SADMM_CUDA_TIER_CLUSTER);
            force_cluster(table, got.c, size);
            const sadmm_status status = runner_begin(&got, scene, SADMM_METHOD_PAPER);
            if (size < cases[k].from[table->precision]) {
                ck_assert_msg(status == SADMM_ERROR_UNSUPPORTED, "%s", what);
                ck_assert_msg(strstr(got.error.message, "an island does not fit") != NULL, "%s", got.error.message);
                runner_stop(&got);
                continue;
            }
            ck_assert_msg(status == SADMM_OK, "%s: %s", what, got.error.message);
            int32_t blocks = 0;
            ck_assert_int_eq(tier_of(table, got.c, &blocks), SADMM_CUDA_TIER_CLUSTER);
            ck_assert_msg(blocks > 0 && blocks % size == 0, "%s: %d blocks", what, blocks);
#ifdef CUDA_EMULATED
            cuda_emulation_descending = size % 3 == 1; /* 4 and 16 */
#endif
            runner_assemble(&got);
            CALL(&got, table->iterate(got.c, 6, false, true, &got.error));
            CALL(&got, table->iterate(got.c, 5, false, false, &got.error));
#ifdef CUDA_EMULATED
            cuda_emulation_descending = 0;
#endif
            const struct sadmm_residual same = runner_residual(&got);
            ck_assert_msg(same.primal == residual.primal && same.dual == residual.dual, "%s: residuals", what);
            check_same(&got, &wanted, what);
            runner_stop(&got);
        }
        runner_stop(&wanted);
    }
}
END_TEST

/* The tier that is likely the fastest: small islands in blocks, a large one in a cluster, and all else that does not
 * fit in the two kernels of STREAM. */
static struct contact_problem *scene_huge(void) { return contact_problem_pyramid(40, 0.5); }
START_TEST(tiers_chosen)
{
    static const struct scene huge = {"huge", scene_huge, RIGID, true, 0};
    const struct {
        const struct scene *scene;
        enum sadmm_cuda_tier tier;
    } cases[] = {{find_scene("towers"), SADMM_CUDA_TIER_BLOCK},
                 {find_scene("free bodies"), SADMM_CUDA_TIER_BLOCK},
                 {find_scene("large"), SADMM_CUDA_TIER_CLUSTER},
#ifdef CUDA_EMULATED
                 {&huge, SADMM_CUDA_TIER_STREAM},
#endif
                 {find_scene("nothing"), SADMM_CUDA_TIER_BLOCK}};
    const struct sadmm_kernels *table = tables[_i];
    (void)huge;
    struct runner r;
    runner_create(&r, table);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        CALL(&r, runner_begin(&r, cases[k].scene, SADMM_METHOD_PAPER));
        ck_assert_msg(tier_of(table, r.c, NULL) == cases[k].tier, "%s: tier %d", cases[k].scene->name,
                      (int)tier_of(table, r.c, NULL));
    }
    runner_stop(&r);
}
END_TEST

/* Between an abort and its end an iteration changes nothing, in any tier. */
START_TEST(aborted_does_nothing)
{
    static const char *const names[] = {"mixed", "large"};
    const struct sadmm_kernels *table = tables[_i / 2];
    const struct scene *scene = find_scene(names[_i % 2]);
    for (size_t t = 0; t < tier_count; ++t) {
        struct runner plain, aborted;
        if (!(scene->tiers >> tiers[t] & 1)) continue;
        runner_start(&plain, table, scene, tiers[t]);
        runner_start(&aborted, table, scene, tiers[t]);
        CALL(&plain, table->iterate(plain.c, 3, false, false, &plain.error));
        CALL(&aborted, table->iterate(aborted.c, 3, false, false, &aborted.error));
        set_abort(&aborted, ABORT_PARTITION);
        CALL(&aborted, table->iterate(aborted.c, 20, false, false, &aborted.error)); /* 20: STREAM launches its graph */
        runner_step(&aborted, false);
        set_abort(&aborted, ABORT_NONE);
        check_same(&aborted, &plain, "aborted");
        CALL(&plain, table->iterate(plain.c, 4, false, true, &plain.error));
        CALL(&aborted, table->iterate(aborted.c, 4, false, true, &aborted.error));
        check_same(&aborted, &plain, "after the abort");
        const struct sadmm_residual wanted = runner_residual(&plain), got = runner_residual(&aborted);
        ck_assert(got.primal == wanted.primal && got.dual == wanted.dual);
        /* A measured iteration that is aborted measures nothing. */
        set_abort(&aborted, ABORT_NON_FINITE);
        CALL(&aborted, table->iterate(aborted.c, 2, false, true, &aborted.error));
        const struct sadmm_residual none = runner_residual(&aborted);
        ck_assert(none.primal == 0 && none.dual == 0);
        set_abort(&aborted, ABORT_NONE);
        check_same(&aborted, &plain, "aborted and measured");
        runner_stop(&plain);
        runner_stop(&aborted);
    }
}
END_TEST

/* ---- contexts -------------------------------------------------------------------------------------------------- */

static void solve(struct runner *r, const struct scene *scene)
{
    struct sadmm_solve_report report;
    r->settings = fixed_settings();
    r->settings.method = SADMM_METHOD_PAPER;
    r->settings.warm_start = scene->warm;
    r->settings.measure_residuals = true;
    r->settings.iterations = 41; /* three penalty updates where the scene starts cold */
    r->settings.penalty_period = 12;
    contact_problem_free(r->p);
    r->p = make_problem(scene, &r->settings);
    r->plan = sadmm_plan_make(&r->p->system, &r->settings);
    CALL(r, sadmm_schedule_solve(r->k, r->c, &r->p->system, &r->settings, &r->plan, NULL, &report, &r->error));
}

static void check_same_solution(struct runner *a, struct runner *b, const char *what)
{
    struct spread v = velocity_spread(a, b), lambda = lambda_spread(a, b);
    ck_assert_msg(v.difference == 0 && lambda.difference == 0, "%s: v %g, lambda %g", what, v.difference,
                  lambda.difference);
}

/* A whole solve through the schedule, twice, in a fresh context and in one that has seen larger and smaller systems; on
 * the emulated device the second one also runs its threads in the other order. */
START_TEST(runs_repeat)
{
    const struct sadmm_kernels *table = tables[_i];
    struct runner used, fresh;
    runner_create(&used, table);
    for (size_t s = 0; s < SCENES; ++s) {
        runner_create(&fresh, table);
        solve(&fresh, &scenes[s]);
#ifdef CUDA_EMULATED
        cuda_emulation_descending = 1;
#endif
        solve(&used, &scenes[s]);
#ifdef CUDA_EMULATED
        cuda_emulation_descending = 0;
#endif
        check_same_solution(&used, &fresh, scenes[s].name);
        runner_stop(&fresh);
    }
    runner_stop(&used);
}
END_TEST

/* Two contexts whose entries take turns do not disturb each other. */
START_TEST(contexts_side_by_side)
{
    const struct sadmm_kernels *table = tables[_i];
    struct runner alone, one, two;
    runner_start(&alone, table, &scenes[0], SADMM_CUDA_TIER_AUTO);
    runner_start(&one, table, &scenes[0], SADMM_CUDA_TIER_STREAM);
    runner_start(&two, table, &scenes[3], SADMM_CUDA_TIER_STREAM);
    for (int i = 0; i < 5; ++i) runner_step(&alone, false);
    for (int i = 0; i < 5; ++i) {
        CALL(&one, table->update_velocity(one.c, &one.error));
        runner_step(&two, false);
        CALL(&one, table->update_constraints(one.c, false, &one.error));
    }
    check_same(&one, &alone, "alternating");
    runner_stop(&alone);
    runner_stop(&one);
    runner_stop(&two);
}
END_TEST

/* ---- errors ---------------------------------------------------------------------------------------------------- */

START_TEST(no_such_device)
{
    struct sadmm_context *c = (struct sadmm_context *)&tables;
    struct sadmm_error error;
    ck_assert_int_eq(tables[_i]->create(4711, &c, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_null(c);
    ck_assert_msg(strstr(error.message, "device = 4711") != NULL, "%s", error.message);
    ck_assert_int_eq(tables[_i]->create(-1, &c, &error), SADMM_ERROR_INVALID_ARGUMENT);
}
END_TEST

#ifdef CUDA_EMULATED
/* Let each runtime call of a solve fail in turn: always a status and a message, never a leak, and a new context works.
 * */
START_TEST(calls_that_fail)
{
    const struct sadmm_kernels *table = tables[_i];
    const struct scene *scene = &scenes[0];
    sadmm_settings settings = fixed_settings();
    settings.method = SADMM_METHOD_PAPER;
    settings.warm_start = false;
    settings.measure_residuals = true;
    int failed = 0;
    for (size_t t = 0; t < tier_count; ++t) {
        enum sadmm_cuda_tier tier = tiers[t];
        /* 18 iterations are a graph in the STREAM tier; the others launch once, however many there are. */
        settings.penalty_period = tier == SADMM_CUDA_TIER_STREAM ? 18 : 1;
        settings.iterations = settings.penalty_period + 1;
        for (long calls = 0; solve_fails_at(table, tier, scene, &settings, calls); ++calls) ++failed;
    }
    ck_assert_int_gt(failed, 100);
}
END_TEST
#endif

/* Bounds, springs and hard rows, alone and together in one constraint. */
START_TEST(laws_of_rows_hold)
{
    for (int m = 0; m < 2; ++m)
        for (int k = 0; k < LAW_CASES; ++k) check_law(tables[_i], law_methods[m], k, (k + m) % 2);
    check_many_laws(tables[_i]);
}
END_TEST

/* ---------------------------------------------------------------------------------------------------------------- */

/* Under sanitizers, on the emulated device, which is slow there: one precision, and some of the scenes. */
int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    const int parts = tested_precisions();
    const bool clusters = find_tiers();
    Suite *suite = suite_create("cuda");
    for (int p = 0; p < parts; ++p) {
        add_case(suite, p ? "entries_f64" : "entries_f32", entries_equal_literal, p * SCENES, (p + 1) * SCENES);
        add_case(suite, p ? "tiers_f64" : "tiers_f32", tiers_equal_stepwise, p * SCENES,
                 p * SCENES + (parts == 2 ? SCENES : SCENES / 3));
    }
    if (clusters) {
        ADD_CASE(suite, cluster_sizes, 0, parts);
        ADD_CASE(suite, tiers_chosen, 0, parts);
    }
    ADD_CASE(suite, aborted_does_nothing, 0, 4);
    ADD_CASE(suite, runs_repeat, 0, parts);
    ADD_CASE(suite, contexts_side_by_side, 0, parts);
    ADD_CASE(suite, no_such_device, 0, parts);
    ADD_CASE(suite, laws_of_rows_hold, 0, parts);
#ifdef CUDA_EMULATED
    ADD_CASE(suite, calls_that_fail, 0, parts);
#endif
    return run_cuda_suite(suite);
}
