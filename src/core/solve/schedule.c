/* The host's executor of a solve's stages (stages.h): each stage is an entry of the kernel table, or two. */
#include "schedule.h"

#include "certificate.h"
#include "core/base/clock.h"
#include "core/base/parallel.h"
#include "core/math/penalty.h"
#include "impulse_initialisation.h"

static sadmm_status assemble_bodies(struct sadmm_solve *s)
{
    TRY(s->kernels->begin(s->context, s->system, s->plan, s->settings, s->error));
    return s->kernels->assemble_bodies(s->context, s->error);
}

static sadmm_status init_penalty(struct sadmm_solve *s)
{
    TRY(s->kernels->init_penalty(s->context, s->error));
    return s->kernels->factorize(s->context, s->error);
}

static sadmm_status iterate(struct sadmm_solve *s, int count, bool goes_on, bool measure)
{
    const struct sadmm_kernels *k = s->kernels;
    if (k->iterate) return k->iterate(s->context, count, goes_on, measure, s->error);
    for (int i = 0; i < count; ++i) {
        TRY(k->update_velocity(s->context, s->error));
        TRY(k->update_constraints(s->context, measure && i + 1 == count, s->error));
    }
    return SADMM_OK;
}

/* By so much more the primal residual exceeds the natural map, which costs several iterations to find; in single
 * precision, what rounding may excuse. */
static const double PRIMAL_RATIO = 4, PRIMAL_ROUNDING = 1e-4;

/* Is the primal residual so large that the tolerance is missed? */
static bool is_far(const struct sadmm_solve *s)
{
    const double most = PRIMAL_RATIO * s->settings->tolerance,
                 rounding = s->kernels->precision == SADMM_F32 ? PRIMAL_ROUNDING : 0;
    return s->residual.primal > (most > rounding ? most : rounding);
}

/* all: every island meets the tolerance; enough: others are the dense contact solve's, for which they take less than
 * the iterations that are left. */
static sadmm_status check_tolerance(struct sadmm_solve *s, bool *all, bool *enough)
{
    const double tolerance = s->settings->tolerance;
    TRY(s->kernels->read_solution(s->context, s->error));
    TRY(sadmm_solve_errors_find(s->errors, s->system, s->settings, s->kernels->precision, s->error));
    s->errors_known = true;
    double work = 0;
    *all = *enough = true;
    s->ncp_missed = false;
    for (int32_t i = 0; i < s->errors->body_count; ++i) {
        if (s->errors->label[i] != i || !sadmm_solve_errors_above(s->errors, i, tolerance)) continue;
        double more = 0;
        const bool own = !s->ncp || !sadmm_ncp_has(s->ncp, i, s->settings, &more);
        *all = false;
        *enough = *enough && !own;
        s->ncp_missed = s->ncp_missed || !own;
        work += more;
    }
    const int left = sadmm_stages_budget(s->plan, s->settings) - s->report->iterations;
    *enough = *enough && work <= NCP_POINT_WORK * (double)s->plan->points * left;
    return SADMM_OK;
}

/* Is the stop rule met? stop: nothing is left for iterations. Comparisons are written so that NaN fails them. */
static sadmm_status check_convergence(struct sadmm_solve *s, bool last, bool *met, bool *stop)
{
    const struct sadmm_settings *settings = s->settings;
    const struct sadmm_residual *residual = &s->residual;
    *met = *stop = true;
    if (settings->residual_tolerance > 0)
        *met = *stop =
            residual->primal <= settings->residual_tolerance && residual->dual <= settings->residual_tolerance;
    if (settings->tolerance <= 0 || (!*met && !last)) return SADMM_OK;
    bool all = false, enough = false;
    const bool looked = s->ncp && s->report->iterations > settings->check_period;
    if (last || (s->ncp && !looked) || s->ncp_missed || !is_far(s)) TRY(check_tolerance(s, &all, &enough));
    *met = *met && all;
    *stop = *stop && enough;
    return SADMM_OK;
}

/* For a tolerance alone nobody asks for them. */
static sadmm_status measure(struct sadmm_solve *s, bool balances)
{
    const struct sadmm_settings *settings = s->settings;
    TRY(s->kernels->measure_residuals(s->context, &s->residual, s->error));
    if (settings->measure_residuals || settings->residual_tolerance > 0 || balances) s->report->residual = s->residual;
    return SADMM_OK;
}

static sadmm_status update_weights(struct sadmm_solve *s)
{
    TRY(s->kernels->update_weights(s->context, s->error));
    return s->kernels->factorize(s->context, s->error);
}

static sadmm_status balance_penalty(struct sadmm_solve *s)
{
    const struct sadmm_residual *residual = &s->residual;
    const double ratio = penalty_ratio(residual->primal, residual->dual, s->settings->penalty_ratio_limit);
    if (ratio == 1) return SADMM_OK;
    TRY(s->kernels->update_penalty(s->context, ratio, s->error));
    return s->kernels->factorize(s->context, s->error);
}

static bool finite_array(const double *x, size_t count)
{
    double sum = 0; /* NaN and infinity survive a sum of x - x */
    for (size_t i = 0; i < count; ++i) sum += x[i] - x[i];
    return sum == 0;
}

struct impulse_check {
    const struct sadmm_contact_set *contacts;
    double sum[SADMM_MOST_THREADS]; /* of each member */
};

static void check_impulses(void *argument, int thread, int threads)
{
    struct impulse_check *check = (struct impulse_check *)argument;
    size_t begin, end;
    double sum = 0;
    sadmm_share(check->contacts->point_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) {
        const double *impulse = check->contacts->points[k].impulse;
        sum += (impulse[0] - impulse[0]) + (impulse[1] - impulse[1]) + (impulse[2] - impulse[2]);
    }
    check->sum[thread] = sum;
}

static bool finite_impulses(const struct sadmm_system *system, int plan_threads)
{
    struct impulse_check check;
    check.contacts = system->contacts;
    const int ran = sadmm_parallel(system->team, sadmm_pass_threads(plan_threads, system->contacts->point_count),
                                   check_impulses, &check);
    return finite_array(check.sum, (size_t)ran);
}

static sadmm_status read_solution(struct sadmm_solve *s)
{
    const struct sadmm_system *system = s->system;
    TRY(s->kernels->read_solution(s->context, s->error));
    if (!finite_array(system->velocity, 6 * (size_t)system->body_count) ||
        (system->rows && !finite_array(system->rows->lambda, system->rows->row_count)) ||
        !finite_impulses(system, s->plan->threads))
        return sadmm_fail(s->error, SADMM_ERROR_NON_FINITE,
                          "the solve gave a velocity or multiplier that is not finite");
    return SADMM_OK;
}

sadmm_status sadmm_solve_stage(struct sadmm_solve *s, struct sadmm_stages *stages, const struct sadmm_stage *stage)
{
    const struct sadmm_kernels *k = s->kernels;
    switch (stage->kind) {
    case SADMM_STAGE_INITIALISE: return sadmm_impulses_initialise(s->system, s->settings, s->error);
    case SADMM_STAGE_BODIES: return assemble_bodies(s);
    case SADMM_STAGE_CONTACTS: return k->assemble_contacts(s->context, s->error);
    case SADMM_STAGE_ROWS: return k->assemble_rows(s->context, s->error);
    case SADMM_STAGE_PENALTY: return init_penalty(s);
    case SADMM_STAGE_ITERATE:
        s->report->iterations = stage->done;
        s->errors_known = false;
        return iterate(s, stage->count, stage->goes_on, stage->measure);
    case SADMM_STAGE_RESIDUALS: return measure(s, stages->batch.balance);
    case SADMM_STAGE_CHECK: return check_convergence(s, stage->last, &s->report->converged, &stages->stopped);
    case SADMM_STAGE_WEIGHTS: return update_weights(s);
    case SADMM_STAGE_BALANCE: return balance_penalty(s);
    case SADMM_STAGE_ENERGY_LIMIT: return k->limit_energy(s->context, &s->report->limited, s->error);
    case SADMM_STAGE_SOLUTION: return read_solution(s);
    default: return SADMM_OK; /* the world's */
    }
}

sadmm_solve_report sadmm_solve_report_empty(const struct sadmm_kernels *kernels)
{
    sadmm_solve_report report = {
        .backend = kernels->backend,
        .precision = kernels->precision,
        .residual = {.primal = -1, .dual = -1},
        .certificate = sadmm_certificate_none(),
        .threads = 1,
    };
    return report;
}

sadmm_status sadmm_schedule_solve(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                                  struct sadmm_system *system, const struct sadmm_settings *settings,
                                  const struct sadmm_plan *plan, struct sadmm_solve_errors *errors,
                                  struct sadmm_solve_report *report, struct sadmm_error *error)
{
    struct sadmm_solve_errors own = {0};
    struct sadmm_solve solve = {.kernels = kernels,
                                .context = context,
                                .system = system,
                                .settings = settings,
                                .plan = plan,
                                .report = report,
                                .error = error,
                                .errors = errors ? errors : &own};
    struct sadmm_stages stages = sadmm_stages_of(plan, settings, false);
    struct sadmm_stage stage;
    const double begin = sadmm_clock_ms();
    *report = sadmm_solve_report_empty(kernels);
    sadmm_status status = SADMM_OK;
    while (status == SADMM_OK && sadmm_stages_next(&stages, &stage))
        status = sadmm_solve_stage(&solve, &stages, &stage);
    sadmm_solve_errors_free(&own);
    report->solve_ms = sadmm_clock_ms() - begin;
    if (system->team) report->threads = system->team->ran;
    return status;
}
