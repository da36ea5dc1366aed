/* The problem level: bodies with A and b, contacts and blocks with e given, one solve at a time.
 *
 * Storage is that of a sadmm_system (problem_input.c). A solve writes into the system's own arrays; `saved` holds the
 * values it started from, to be put back when it fails. Contexts are kept by backend and precision: solving again
 * allocates only if the problem grew.
 */
#include <string.h>

#include "core/base/memory.h"
#include "core/model/settings.h"
#include "problem_internal.h"
#include "registry.h"
#include "schedule.h"

/* ---- life ---------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_problem_create(sadmm_problem **out)
{
    TRY(sadmm_check_given(out, "out", NULL));
    *out = NULL;
    sadmm_problem *problem = sadmm_alloc(1, sizeof *problem);
    if (!problem) return sadmm_fail_memory(NULL, "a problem");
    *out = problem;
    return SADMM_OK;
}

void sadmm_problem_drop_parts(sadmm_problem *problem)
{
    sadmm_free(problem->contacts.pairs);
    sadmm_free(problem->contacts.points);
    sadmm_free(problem->kinematic);
    sadmm_free(problem->blocks);
    sadmm_rows_free(&problem->rows);
    sadmm_free(problem->A);
    sadmm_free(problem->b);
    sadmm_free(problem->velocity);
    memset(&problem->contacts, 0, sizeof problem->contacts);
    problem->blocks = NULL;
    problem->kinematic = NULL;
    problem->kinematic_count = 0;
    problem->A = problem->b = problem->velocity = NULL;
    problem->body_count = problem->block_count = 0;
}

static void destroy_contexts(sadmm_problem *problem)
{
    for (int backend = 0; backend < SADMM_BACKEND_COUNT; ++backend)
        for (int precision = 0; precision < 2; ++precision) {
            struct sadmm_context **context = &problem->contexts[backend][precision];
            if (*context) problem->tables[backend][precision]->destroy(*context);
            *context = NULL;
        }
}

void sadmm_problem_destroy(sadmm_problem *problem)
{
    if (!problem) return;
    destroy_contexts(problem);
    sadmm_problem_drop_parts(problem);
    sadmm_free(problem->saved);
    sadmm_certificate_workspace_free(&problem->certificate);
    sadmm_solve_errors_free(&problem->errors);
    sadmm_free(problem);
}

const char *sadmm_problem_message(const sadmm_problem *problem)
{
    return problem ? problem->error.message : "";
}

/* ---- solving ------------------------------------------------------------------------------------------------- */

static struct sadmm_system make_system(const sadmm_problem *problem, struct sadmm_contact_set *contacts,
                                       struct sadmm_rows *rows)
{
    struct sadmm_system system = {
        .body_count = problem->body_count,
        .A = problem->A,
        .b = problem->b,
        .velocity = problem->velocity,
        .kinematic = problem->kinematic,
        .kinematic_count = problem->kinematic_count,
        .contacts = contacts,
        .errors_given = true,
        .first = true,
        .rows = rows,
    };
    return system;
}

sadmm_status sadmm_problem_certify(sadmm_problem *problem, sadmm_certificate *certificate)
{
    TRY(sadmm_check_problem(problem));
    struct sadmm_error *error = &problem->error;
    TRY(sadmm_check_given(certificate, "certificate", error));
    struct sadmm_contact_set contacts = problem->contacts; /* the certificate only reads them */
    struct sadmm_rows rows = problem->rows;
    struct sadmm_system system = make_system(problem, &contacts, &rows);
    return sadmm_certify_with(&problem->certificate, &system, NULL, certificate, error);
}

static void copy_values(double *to, const double *from, size_t count)
{
    if (count) memcpy(to, from, count * sizeof *to);
}

/* `saved` holds velocities, impulses and multipliers one after the other; an empty problem has none. */
static void save_solution(sadmm_problem *problem)
{
    if (!problem->saved) return; /* nothing was ever set */
    size_t bodies = 6 * (size_t)problem->body_count, points = 3 * problem->contacts.point_count;
    copy_values(problem->saved, problem->velocity, bodies);
    for (size_t k = 0; k < problem->contacts.point_count; ++k)
        memcpy(problem->saved + bodies + 3 * k, problem->contacts.points[k].impulse, 3 * sizeof(double));
    copy_values(problem->saved + bodies + points, problem->rows.lambda, problem->rows.row_count);
}

static void restore_solution(sadmm_problem *problem)
{
    if (!problem->saved) return;
    size_t bodies = 6 * (size_t)problem->body_count, points = 3 * problem->contacts.point_count;
    copy_values(problem->velocity, problem->saved, bodies);
    for (size_t k = 0; k < problem->contacts.point_count; ++k)
        memcpy(problem->contacts.points[k].impulse, problem->saved + bodies + 3 * k, 3 * sizeof(double));
    copy_values(problem->rows.lambda, problem->saved + bodies + points, problem->rows.row_count);
}

sadmm_status sadmm_problem_set_tasks(sadmm_problem *problem, const sadmm_tasks *tasks)
{
    TRY(sadmm_check_problem(problem));
    return sadmm_team_init(&problem->team, tasks, "tasks", &problem->error);
}

/* The kept context for a table, made when missing. */
static sadmm_status find_context(sadmm_problem *problem, const struct sadmm_kernels *kernels,
                                 struct sadmm_context ***context, struct sadmm_error *error)
{
    *context = &problem->contexts[kernels->backend][kernels->precision];
    problem->tables[kernels->backend][kernels->precision] = kernels;
    return **context ? SADMM_OK : kernels->create(problem->device, *context, error);
}

sadmm_status sadmm_problem_set_device(sadmm_problem *problem, int device)
{
    TRY(sadmm_check_problem(problem));
    struct sadmm_error *error = &problem->error;
    if (device < 0) REFUSE("device = %d: must be >= 0", device);
    if (device != problem->device) destroy_contexts(problem);
    problem->device = device;
    return SADMM_OK;
}

/* Of the report's first version. */
enum { LEAST_REPORT = SADMM_SIZE_TO(sadmm_solve_report, threads) };

sadmm_status sadmm_problem_solve_sized(sadmm_problem *problem, sadmm_backend backend, sadmm_precision precision,
                                       const sadmm_settings *given, sadmm_solve_report *report, size_t report_size)
{
    TRY(sadmm_check_problem(problem));
    struct sadmm_error *error = &problem->error;
    const struct sadmm_kernels *kernels;
    struct sadmm_context **context;
    struct sadmm_solve_report done = {0};

    sadmm_settings settings;
    TRY(sadmm_settings_take(&settings, given, error));
    if (report) TRY(sadmm_check_bytes(report_size, LEAST_REPORT, "report", error));
    int64_t constraints = (int64_t)problem->contacts.point_count + problem->block_count;
    TRY(sadmm_backend_choose(backend, precision, constraints, &kernels, NULL, 0, error));
    TRY(find_context(problem, kernels, &context, error));

    problem->settings = settings;
    problem->system = make_system(problem, &problem->contacts, &problem->rows);
    problem->system.team = &problem->team;
    problem->team.ran = 1;
    problem->plan = sadmm_plan_make(&problem->system, &problem->settings);
    save_solution(problem);
    sadmm_status status = sadmm_schedule_solve(kernels, *context, &problem->system, &problem->settings, &problem->plan,
                                               &problem->errors, &done, error);
    if (status == SADMM_OK && report)
        status = sadmm_certify_with(&problem->certificate, &problem->system, &problem->settings,
                                    &done.certificate, error);
    if (status != SADMM_OK) {
        restore_solution(problem);
        if (status == SADMM_ERROR_DEVICE) { /* a device that failed once is started again by the next solve */
            kernels->destroy(*context);
            *context = NULL;
        }
        return status;
    }
    return report ? sadmm_give_bytes(report, report_size, &done, sizeof done, LEAST_REPORT, "report", error) : SADMM_OK;
}
