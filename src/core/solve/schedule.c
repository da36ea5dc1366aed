/* A solve, from the raw system to (v, lambda): the paper's Fig. 4 without collision detection and integration.
 *
 *     begin            room for this step (the only allocation)
 *     assemble         A bodies, B contacts, C/D hard and soft blocks (classes the plan lacks are not called)
 *     E-H              C_i, beta_i, factor of A_i + beta_i C_i
 *     I-P              iterations in stretches: a stretch ends where someone has to look (penalty update, stop rule, new
 *                      weights, end)
 *     read_solution
 */
#include "schedule.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#include "certificate.h"
#include "core/base/clock.h"
#include "loads.h"
#include "core/math/weight.h"
#include "core/model/system_math.h"

static sadmm_status assemble(const struct sadmm_kernels *k, struct sadmm_context *c, const struct sadmm_plan *plan,
                             struct sadmm_error *error)
{
    TRY(k->assemble_bodies(c, error));
    if (plan->points || plan->blocks[SADMM_BLOCK_CONTACT]) TRY(k->assemble_contacts(c, error));
    if (plan->blocks[SADMM_BLOCK_HARD]) TRY(k->assemble_joints(c, error));
    if (plan->blocks[SADMM_BLOCK_SOFT]) TRY(k->assemble_springs(c, error));
    TRY(k->init_penalty(c, error));
    return k->factorize(c, error);
}

static sadmm_status iterate(const struct sadmm_kernels *k, struct sadmm_context *c, int count, bool measure,
                            struct sadmm_error *error)
{
    if (k->iterate) return k->iterate(c, count, measure, error);
    for (int i = 0; i < count; ++i) {
        TRY(k->update_velocity(c, error));
        TRY(k->update_constraints(c, measure && i + 1 == count, error));
    }
    return SADMM_OK;
}

/* Iterations until the next multiple of `period` (0: none) after `done`, at most `limit`. */
static int until(int done, int period, int limit)
{
    if (period <= 0) return limit;
    int left = period - done % period;
    return left < limit ? left : limit;
}

/* Are weights taken anew after `done` iterations? */
static bool is_refresh(int done)
{
    int at = WEIGHT_FIRST_REFRESH;
    while (at < done && at <= INT_MAX / 2) at = weight_next_refresh(at);
    return at == done;
}

static int until_refresh(int done, int limit)
{
    int at = WEIGHT_FIRST_REFRESH;
    while (at <= done && at <= INT_MAX / 2) at = weight_next_refresh(at);
    return at > done && at - done < limit ? at - done : limit;
}

int sadmm_schedule_budget(const struct sadmm_plan *plan, const struct sadmm_settings *settings)
{
    return sadmm_plan_is_constrained(plan) ? settings->iterations : 1;
}

struct sadmm_stretch sadmm_schedule_stretch(const struct sadmm_plan *plan, const struct sadmm_settings *settings, int done)
{
    bool stop_rule = sadmm_plan_is_constrained(plan) &&
                     (settings->residual_tolerance > 0 || settings->certificate_tolerance > 0);
    int budget = sadmm_schedule_budget(plan, settings);
    struct sadmm_stretch next = {.count = budget - done};
    if (plan->penalty_updates) next.count = until(done, settings->penalty_period, next.count);
    if (plan->weight_refresh) next.count = until_refresh(done, next.count);
    if (stop_rule) next.count = until(done, settings->check_period, next.count);
    int after = done + next.count;
    next.last = after == budget;
    next.update = plan->penalty_updates && !next.last && after % settings->penalty_period == 0;
    next.refresh = plan->weight_refresh && !next.last && is_refresh(after);
    next.look = stop_rule && (next.last || after % settings->check_period == 0);
    next.measure = plan->residuals && (next.update || (next.last && settings->measure_residuals) ||
                                       (next.look && settings->residual_tolerance > 0));
    return next;
}

static bool finite_array(const double *x, size_t count)
{
    double sum = 0; /* NaN and infinity survive a sum of x - x */
    for (size_t i = 0; i < count; ++i) sum += x[i] - x[i];
    return sum == 0;
}

static bool finite_impulses(const struct sadmm_contact_set *contacts, int plan_threads)
{
    const int threads = sadmm_pass_threads(plan_threads, contacts->point_count);
    double sum = 0;
    (void)threads;
#pragma omp parallel for schedule(static) num_threads(threads) if (threads > 1) reduction(+ : sum)
    for (size_t k = 0; k < contacts->point_count; ++k) {
        const double *impulse = contacts->points[k].impulse;
        sum += (impulse[0] - impulse[0]) + (impulse[1] - impulse[1]) + (impulse[2] - impulse[2]);
    }
    return sum == 0;
}

static sadmm_status certificate_met(const struct sadmm_kernels *k, struct sadmm_context *c, struct sadmm_system *system,
                                    const struct sadmm_settings *s, struct sadmm_solve_report *report, bool *met,
                                    struct sadmm_error *error)
{
    TRY(k->read_solution(c, error));
    TRY(sadmm_certify(system, s, &report->certificate, error));
    *met = report->certificate.ncp_max <= s->certificate_tolerance &&
           report->certificate.momentum_max <= s->certificate_momentum_tolerance;
    return SADMM_OK;
}

static sadmm_status run(const struct sadmm_kernels *k, struct sadmm_context *c, struct sadmm_system *system,
                        const struct sadmm_settings *s, const struct sadmm_plan *plan,
                        struct sadmm_solve_report *report, struct sadmm_error *error)
{
    int budget = sadmm_schedule_budget(plan, s);
    for (int done = 0; done < budget;) {
        struct sadmm_stretch next = sadmm_schedule_stretch(plan, s, done);
        TRY(iterate(k, c, next.count, next.measure, error));
        done += next.count;
        report->iterations = done;
        if (next.measure) TRY(k->measure_residuals(c, &report->residual, error));
        if (next.look) {
            bool met = true;
            if (s->residual_tolerance > 0)
                met = report->residual.primal <= s->residual_tolerance && report->residual.dual <= s->residual_tolerance;
            if (met && s->certificate_tolerance > 0)
                TRY(certificate_met(k, c, system, s, report, &met, error));
            if (met) {
                report->converged = true;
                return SADMM_OK;
            }
        }
        if (next.refresh) {
            TRY(k->update_weights(c, error));
            TRY(k->factorize(c, error));
        }
        if (next.update) {
            double ratio = sadmm_penalty_ratio(report->residual.primal, report->residual.dual, s->penalty_ratio_limit);
            if (ratio != 1) {
                TRY(k->update_penalty(c, ratio, error));
                TRY(k->factorize(c, error));
            }
        }
    }
    return SADMM_OK;
}

sadmm_status sadmm_schedule_solve(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                                  struct sadmm_system *system, const struct sadmm_settings *settings,
                                  const struct sadmm_plan *plan, struct sadmm_solve_report *report,
                                  struct sadmm_phase_times *ms, struct sadmm_error *error)
{
    double start = sadmm_clock_ms();
    report->backend = kernels->backend;
    report->precision = kernels->precision;
    report->iterations = 0;
    report->converged = false;
    report->limited = 0;
    report->residual.primal = report->residual.dual = -1;
    report->certificate = sadmm_certificate_none();
    report->threads = kernels->backend == SADMM_BACKEND_REF ? 1 : plan->threads;

    if (plan->predict) TRY(sadmm_loads_predict(system, settings, error));
    TRY(kernels->begin(context, system, plan, settings, error));
    TRY(assemble(kernels, context, plan, error));
    double assembled = sadmm_clock_ms();
    TRY(run(kernels, context, system, settings, plan, report, error));
    if (plan->limit) TRY(kernels->limit_velocity(context, &report->limited, error));
    TRY(kernels->read_solution(context, error));
    double end = sadmm_clock_ms();
    report->solve_ms = end - start;
    if (ms) {
        ms->assemble = assembled - start;
        ms->solve = end - assembled;
    }
    if (!finite_array(system->velocity, 6 * (size_t)system->body_count) ||
        !finite_array(system->block_lambda, 6 * (size_t)system->block_count) || !finite_impulses(system->contacts, plan->threads))
        return sadmm_fail(error, SADMM_ERROR_NON_FINITE, "the solve gave a velocity or multiplier that is not finite");
    return SADMM_OK;
}
