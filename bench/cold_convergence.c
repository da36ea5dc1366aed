#include "cold_convergence.h"

#include <math.h>

#include "cli/interrupt.h"
#include "core/base/clock.h"
#include "core/base/memory.h"
#include "core/base/settings_fields.h"
#include "core/solve/schedule.h"

enum { MOST_SAMPLES = 1280, MOST_REPEATS = 15, ENOUGH_IN_A_ROW = 3 };
static const double tolerances[] = {1e-3, 1e-4, 1e-6};

struct sample {
    int iterations;
    double ncp_max, ncp_balanced, momentum_max, distance, ms;
};

struct cold {
    const struct set_problem *problem;
    const struct cold_plan *plan;
    const struct series *series;
    sadmm_settings settings;
    double *velocities; /* with a reference */
    struct sadmm_error *error;
};

static sadmm_status check(struct cold *c, sadmm_status status)
{
    return status == SADMM_OK ? status : sadmm_fail(c->error, status, "%s", sadmm_problem_message(c->problem->problem));
}

/* A cold solve and its errors: infinite when it ended in what is not finite. */
static sadmm_status solve(struct cold *c, int iterations, struct sample *s)
{
    sadmm_problem *problem = c->problem->problem;
    sadmm_solve_report report;
    sadmm_certificate balanced;
    c->settings.iterations = iterations;
    *s = (struct sample){iterations, INFINITY, INFINITY, INFINITY, NAN, NAN};
    sadmm_status status = sadmm_problem_solve(problem, c->series->backend, c->series->precision, &c->settings, &report);
    if (status == SADMM_ERROR_NON_FINITE) return SADMM_OK;
    TRY(check(c, status));
    TRY(problem_set_balance(problem, c->error));
    TRY(check(c, sadmm_problem_certify(problem, &balanced)));
    s->ncp_max = report.certificate.ncp_max;
    s->momentum_max = report.certificate.momentum_max;
    s->ncp_balanced = balanced.ncp_max;
    s->ms = report.solve_ms;
    if (!c->velocities) return SADMM_OK;
    TRY(check(c, sadmm_problem_get_solution(problem, c->velocities, NULL, NULL)));
    s->distance = reference_distance(c->plan->reference, c->velocities);
    return SADMM_OK;
}

/* The best time of several solves. */
static sadmm_status time_solve(struct cold *c, struct sample *s)
{
    double best = s->ms, begin = sadmm_clock_ms();
    for (int k = 0; k < 2 || (k < MOST_REPEATS && sadmm_clock_ms() - begin < c->plan->time_ms); ++k) {
        TRY(solve(c, s->iterations, s));
        best = fmin(best, s->ms);
    }
    s->ms = best;
    return SADMM_OK;
}

/* Not below it when it is NaN. */
static bool below(const struct sample *s, double tolerance) { return s->ncp_balanced <= tolerance; }

static sadmm_status add(struct cold *c, struct rows *rows, struct row *row, const struct sample *s)
{
    row->iterations = s->iterations;
    row->ncp_max = s->ncp_max;
    row->ncp_balanced = s->ncp_balanced;
    row->momentum_max = s->momentum_max;
    row->distance = s->distance;
    row->ms = s->ms;
    return rows_add(rows, row) ? SADMM_OK : sadmm_fail_memory(c->error, "the rows");
}

/* The fewest iterations in (above, under] that are below the tolerance, by bisection. */
static sadmm_status refine(struct cold *c, double tolerance, int above, struct sample *under)
{
    while (under->iterations - above > 1) {
        struct sample middle;
        TRY(solve(c, above + (under->iterations - above) / 2, &middle));
        if (below(&middle, tolerance)) *under = middle;
        else above = middle.iterations;
    }
    return time_solve(c, under);
}

/* 1, 2, 3, 5, 7, 10, 20, 30, ...: the points that are written. */
static bool is_curve_point(int iterations)
{
    while (iterations % 10 == 0) iterations /= 10;
    return iterations == 1 || iterations == 2 || iterations == 3 || iterations == 5 || iterations == 7;
}

/* Of the iteration counts that are tried: as many as take a second or two, so that an error that rises
 * again is seen. */
static int density_for(const struct set_problem *problem)
{
    double work = sadmm_problem_contact_count(problem->problem) + 10.0 * sadmm_problem_block_count(problem->problem);
    return (int)fmin(100, fmax(10, 6e4 / fmax(work, 1)));
}

/* About `density` of them between k and e k. */
static int next_sample(int iterations, int density)
{
    int next = iterations + (iterations + density - 1) / density;
    for (int k = iterations + 1; k < next; ++k)
        if (is_curve_point(k)) return k;
    return next;
}

/* The curve, and all samples. */
static sadmm_status sample_curve(struct cold *c, struct rows *rows, struct row *row, struct sample *samples, int *count)
{
    const int density = c->plan->density > 0 ? c->plan->density : density_for(c->problem);
    int below_in_a_row = 0;
    for (int k = 1; k <= c->plan->limit && *count < MOST_SAMPLES && !interrupted(); k = next_sample(k, density)) {
        struct sample *s = &samples[(*count)++];
        TRY(solve(c, k, s));
        if (is_curve_point(k)) {
            TRY(time_solve(c, s));
            TRY(add(c, rows, row, s));
        }
        below_in_a_row = below(s, c->plan->enough) ? below_in_a_row + 1 : 0;
        if (below_in_a_row >= ENOUGH_IN_A_ROW && is_curve_point(k)) break;
    }
    return SADMM_OK;
}

static sadmm_status converge(struct cold *c, struct rows *rows, struct row *row)
{
    struct sample samples[MOST_SAMPLES];
    int count = 0;
    TRY(sample_curve(c, rows, row, samples, &count));
    row->kind = ROW_COUNT;
    for (size_t t = 0; t < sizeof tolerances / sizeof *tolerances && !interrupted(); ++t) {
        int first = count; /* of those that stay below */
        while (first > 0 && below(&samples[first - 1], tolerances[t])) --first;
        struct sample reached = first < count ? samples[first] : (struct sample){0, NAN, NAN, NAN, NAN, NAN};
        if (first < count) TRY(refine(c, tolerances[t], first > 0 ? samples[first - 1].iterations : 0, &reached));
        row->tolerance = tolerances[t];
        snprintf(row->status, sizeof row->status, first < count ? "ok" : "not reached");
        TRY(add(c, rows, row, &reached));
    }
    return SADMM_OK;
}

sadmm_status cold_convergence(const struct set_problem *problem, sadmm_method method, const struct series *series,
                              const struct cold_plan *plan, struct rows *rows, struct sadmm_error *error)
{
    struct cold c = {
        .problem = problem, .plan = plan, .series = series, .settings = sadmm_settings_default(), .error = error};
    sadmm_settings_fix_work(&c.settings);
    c.settings.method = method;
    c.settings.dt = problem->dt;
    c.settings.penalty_period = problem->penalty_period;
    c.settings.threads = series->threads;
    c.settings.warm_start = false;

    struct row row = row_start(ROW_CURVE, problem->name, method, series);
    row.bodies = sadmm_problem_body_count(problem->problem);
    row.contacts = sadmm_problem_contact_count(problem->problem);
    row.blocks = sadmm_problem_block_count(problem->problem);
    row.limit = plan->limit;
    if (plan->reference) {
        c.velocities = sadmm_alloc((size_t)row.bodies, 6 * sizeof *c.velocities);
        if (!c.velocities) return sadmm_fail_memory(error, "the velocities");
    }
    const sadmm_status status = converge(&c, rows, &row);
    sadmm_free(c.velocities);
    return status;
}
