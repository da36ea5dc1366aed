#include "profile_solvers.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "child.h"
#include "core/base/memory.h"
#include "dense_solve.h"
#include "solve_result.h"

enum { MOST_ITERATIONS = 1000000 };
static const double repeat_time = 0.05, start_time = 0.25; /* s */

/* ---- which there are --------------------------------------------------------------------------------------------- */

/* subadmm-siconos, beside this program. */
static const char *siconos_program(void)
{
    static char path[4096];
    const ssize_t size = readlink("/proc/self/exe", path, sizeof path - 32);
    if (size <= 0) return NULL;
    path[size] = 0;
    char *slash = strrchr(path, '/');
    if (!slash) return NULL;
    strcpy(slash + 1, "subadmm-siconos");
    return access(path, X_OK) == 0 ? path : NULL;
}

static int add_siconos(struct profile_solver *out, int count)
{
    char command[5000], line[64];
    const char *program = siconos_program();
    FILE *list = NULL;
    if (program) {
        snprintf(command, sizeof command, "'%s' --list", program);
        list = popen(command, "r");
    }
    if (!list) {
        fprintf(stderr, "siconos: subadmm-siconos is not beside this program (-Dsiconos=enabled builds it)\n");
        return count;
    }
    while (count < PROFILE_MOST && fgets(line, sizeof line, list)) {
        line[strcspn(line, "\n")] = 0;
        out[count] = (struct profile_solver){.kind = PROFILE_SICONOS};
        snprintf(out[count++].name, sizeof out->name, "siconos %.31s", line);
    }
    pclose(list);
    return count;
}

int profile_solvers(struct profile_solver *out)
{
    static const struct profile_solver ours[] = {
        {"fast", PROFILE_ITERATES, SADMM_METHOD_FAST, SADMM_F64},
        {"paper", PROFILE_ITERATES, SADMM_METHOD_PAPER, SADMM_F64},
        {"fast f32", PROFILE_ITERATES, SADMM_METHOD_FAST, SADMM_F32},
        {"paper f32", PROFILE_ITERATES, SADMM_METHOD_PAPER, SADMM_F32},
        {"dense", PROFILE_DENSE, SADMM_METHOD_FAST, SADMM_F64},
    };
    memcpy(out, ours, sizeof ours);
    return add_siconos(out, (int)(sizeof ours / sizeof *ours));
}

/* ---- in the child ------------------------------------------------------------------------------------------------ */

struct job {
    const struct profile_problem *problem;
    const struct profile_solver *solver;
    double tolerance;
    size_t velocities, lambdas; /* doubles of v and of the impulses */
};

static void iterate(void *argument, int out)
{
    const struct job *job = argument;
    const struct set_problem *set = &job->problem->set;
    sadmm_solve_report report = {0};
    sadmm_settings settings = sadmm_settings_default();
    struct solve_head head = {.seconds = INFINITY};
    double *v = sadmm_alloc(job->velocities + job->lambdas, sizeof *v);
    settings.method = job->solver->method;
    settings.tolerance = job->tolerance;
    settings.iterations = MOST_ITERATIONS;
    settings.dt = set->dt;
    settings.penalty_period = set->penalty_period;
    settings.threads = 1;
    settings.warm_start = false;
    const struct solve_clock begin = solve_clock_now();
    for (int k = 0; solve_again(k, begin, head.seconds, repeat_time); ++k) {
        const struct solve_clock start = solve_clock_now();
        if (sadmm_problem_solve(set->problem, SADMM_BACKEND_CPU, job->solver->precision, &settings, &report) !=
            SADMM_OK)
            _exit(1);
        head.seconds = fmin(head.seconds, solve_clock_since(start));
    }
    head.iterations = report.iterations;
    head.unsolved = !report.converged;
    if (!v || sadmm_problem_get_solution(set->problem, v, NULL, v + job->velocities) != SADMM_OK) _exit(1);
    child_write(out, &head, sizeof head);
    child_write(out, v, (job->velocities + job->lambdas) * sizeof *v);
}

/* r of contact blocks, which are all there is, as the problem has it. */
static void spread(const double *r, size_t contacts, double *lambda)
{
    for (size_t k = 0; k < contacts; ++k) memcpy(lambda + 6 * k, r + 3 * k, 3 * sizeof *r);
}

static void solve_densely(void *argument, int out)
{
    const struct job *job = argument;
    struct solve_head head = {.seconds = INFINITY};
    struct sadmm_global_problem g;
    struct sadmm_error error = {SADMM_OK, ""};
    double *v = sadmm_alloc(job->velocities + job->lambdas, sizeof *v), map = INFINITY;
    if (!v || sadmm_global_from_problem(job->problem->set.problem, &g, &error) != SADMM_OK) _exit(1);
    double *r = sadmm_alloc(3 * (size_t)g.contacts, sizeof *r);
    const struct solve_clock begin = solve_clock_now();
    for (int k = 0; solve_again(k, begin, head.seconds, repeat_time); ++k) {
        const struct solve_clock start = solve_clock_now();
        if (!r || dense_solve(&g, job->tolerance, r, v, &map, &error) != SADMM_OK) _exit(1);
        head.seconds = fmin(head.seconds, solve_clock_since(start));
    }
    head.unsolved = !(map <= job->tolerance);
    spread(r, (size_t)g.contacts, v + job->velocities);
    child_write(out, &head, sizeof head);
    child_write(out, v, (job->velocities + job->lambdas) * sizeof *v);
}

static void become_siconos(void *argument, int out)
{
    static const char *const threads[] = {"OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS",
                                          "BLIS_NUM_THREADS"};
    const struct job *job = argument;
    char tolerance[32], time[32], file[sizeof job->problem->file], solver[sizeof job->solver->name], name[] = "siconos";
    for (size_t k = 0; k < sizeof threads / sizeof *threads; ++k) setenv(threads[k], "1", 1);
    snprintf(tolerance, sizeof tolerance, "%.17g", job->tolerance);
    snprintf(time, sizeof time, "%g", repeat_time);
    snprintf(file, sizeof file, "%s", job->problem->file);
    snprintf(solver, sizeof solver, "%s", strchr(job->solver->name, ' ') + 1);
    dup2(out, STDOUT_FILENO);
    execv(siconos_program(), (char *[]){name, file, solver, tolerance, time, NULL});
}

/* ---- one solve --------------------------------------------------------------------------------------------------- */

static sadmm_status certify(struct profile_problem *p, const struct job *job, const double *v, const double *lambda,
                            struct profile_run *run, struct sadmm_error *error)
{
    sadmm_problem *problem = p->set.problem;
    sadmm_certificate c;
    run->siconos = run->ncp = INFINITY;
    for (size_t k = 0; k < job->velocities; ++k)
        if (!isfinite(v[k])) return SADMM_OK;
    for (size_t k = 0; k < job->lambdas; ++k)
        if (!isfinite(lambda[k])) return SADMM_OK;
    sadmm_status status = sadmm_problem_set_solution(problem, v, NULL, lambda);
    if (status == SADMM_OK) status = sadmm_problem_certify(problem, &c);
    if (status == SADMM_OK) {
        run->siconos = c.siconos;
        TRY(problem_set_balance(problem, error));
        status = sadmm_problem_certify(problem, &c);
    }
    if (status == SADMM_OK) run->ncp = c.ncp_max;
    if (status == SADMM_OK || status == SADMM_ERROR_NON_FINITE) return SADMM_OK;
    return sadmm_fail(error, status, "%s", sadmm_problem_message(problem));
}

/* siconos has r before v, and three numbers a contact. */
static sadmm_status certify_siconos(struct profile_problem *p, const struct job *job, const double *values,
                                    struct profile_run *run, struct sadmm_error *error)
{
    double *lambda = sadmm_alloc(job->lambdas, sizeof *lambda);
    if (!lambda) return sadmm_fail_memory(error, "the impulses");
    spread(values, (size_t)p->contacts, lambda);
    const sadmm_status status = certify(p, job, values + 3 * (size_t)p->contacts, lambda, run, error);
    sadmm_free(lambda);
    return status;
}

static enum profile_end end_of(enum child_end end, double limit, const struct solve_head *head)
{
    switch (end) {
    case CHILD_DONE: return head->seconds > limit ? PROFILE_LATE : head->unsolved ? PROFILE_GAVE_UP : PROFILE_SOLVED;
    case CHILD_LATE: return PROFILE_LATE;
    case CHILD_INTERRUPTED: return PROFILE_INTERRUPTED;
    default: return PROFILE_LOST;
    }
}

sadmm_status profile_run(struct profile_problem *problem, const struct profile_solver *solver, double tolerance,
                         double seconds, struct profile_run *run, struct sadmm_error *error)
{
    struct job job = {.problem = problem,
                      .solver = solver,
                      .tolerance = tolerance,
                      .velocities = 6 * (size_t)sadmm_problem_body_count(problem->set.problem),
                      .lambdas = 6 * (size_t)sadmm_problem_block_count(problem->set.problem)};
    void (*const work[])(void *, int) = {iterate, solve_densely, become_siconos};
    const bool siconos = solver->kind == PROFILE_SICONOS;
    const size_t numbers = job.velocities + (siconos ? 3 * (size_t)problem->contacts : job.lambdas);
    *run = (struct profile_run){.end = PROFILE_UNSUITED, .siconos = INFINITY, .ncp = INFINITY};
    if (solver->kind != PROFILE_ITERATES && problem->hard_rows > 0) return SADMM_OK;
    if (solver->kind == PROFILE_DENSE && !dense_solve_takes(problem->set.problem)) return SADMM_OK;
    struct solve_head *head = sadmm_alloc(1, sizeof *head + numbers * sizeof(double));
    if (!head) return sadmm_fail_memory(error, "a solution");
    const double *values = (const double *)(head + 1);
    /* beside the solve a child starts, reads the file, and repeats short solves */
    const enum child_end end = child_run(work[solver->kind], &job, seconds + start_time + repeat_time, head,
                                         sizeof *head + numbers * sizeof *values);
    sadmm_status status = SADMM_OK;
    run->end = end_of(end, seconds, head);
    if (end == CHILD_DONE) {
        run->seconds = head->seconds;
        run->iterations = head->iterations;
        status = siconos ? certify_siconos(problem, &job, values, run, error)
                         : certify(problem, &job, values, values + job.velocities, run, error);
    }
    sadmm_free(head);
    return status;
}
