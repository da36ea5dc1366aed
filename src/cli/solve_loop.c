#include "solve_loop.h"

#include <math.h>
#include <string.h>

#include "core/memory.h"

/* Levels after a stall, as multiples of the first: both sides of it, farther out every time. */
static const double factors[] = {1, 10, 0.1, 100, 0.01, 1e3, 1e-3};
enum { FACTOR_COUNT = sizeof factors / sizeof *factors };

/* A level is kept while the measure halves within this many stretches. */
enum { PATIENCE = 6 };

struct solution {
    double *velocities, *impulses, *lambda;
};

static bool solution_create(struct solution *s, const sadmm_problem *problem)
{
    s->velocities = sadmm_alloc(6 * (size_t)sadmm_problem_body_count(problem), sizeof(double));
    s->impulses = sadmm_alloc(3 * (size_t)sadmm_problem_contact_count(problem), sizeof(double));
    s->lambda = sadmm_alloc(6 * (size_t)sadmm_problem_block_count(problem), sizeof(double));
    return s->velocities && s->impulses && s->lambda;
}

static void solution_free(struct solution *s)
{
    sadmm_free(s->velocities);
    sadmm_free(s->impulses);
    sadmm_free(s->lambda);
}

/* The mean mass of the bodies on a logarithmic scale, kg. */
static sadmm_status mean_mass(const sadmm_problem *problem, double *mass, struct sadmm_error *error)
{
    size_t count = (size_t)sadmm_problem_body_count(problem);
    double *A = sadmm_alloc(36 * count, sizeof *A), sum = 0;
    if (!A) return sadmm_fail_memory(error, "the bodies' masses");
    sadmm_status status = sadmm_problem_get_bodies(problem, A, NULL, NULL);
    for (size_t i = 0; status == SADMM_OK && i < count; ++i)
        sum += log((A[36 * i] + A[36 * i + 7] + A[36 * i + 14]) / 3);
    sadmm_free(A);
    if (status != SADMM_OK) return sadmm_fail(error, status, "%s", sadmm_problem_message(problem));
    *mass = count ? exp(sum / (double)count) : 1;
    return SADMM_OK;
}

static sadmm_status stretch(sadmm_problem *problem, const struct solve_plan *plan, struct solve_outcome *out,
                            sadmm_certificate *certificate)
{
    sadmm_settings s = plan->settings;
    long left = plan->max_iterations - out->iterations;
    s.iterations = left < plan->stretch ? (int)left : plan->stretch;
    s.warm_start = out->iterations > 0;
    /* The paper's offset is in kg/s^2 and is multiplied by dt^2. */
    s.penalty_offset = out->level / (s.dt * s.dt);
    sadmm_status status = sadmm_problem_solve(problem, plan->backend, plan->precision, &s, &out->report);
    if (status != SADMM_OK) return status;
    out->iterations += out->report.iterations;
    out->ms += out->report.solve_ms;
    return sadmm_problem_certify(problem, certificate);
}

static sadmm_status loop(sadmm_problem *problem, const struct solve_plan *plan, struct solve_outcome *out,
                         struct solution *best)
{
    double first = out->level, reference = INFINITY; /* the measure that has to be halved */
    int unimproved = 0;
    for (;;) {
        sadmm_certificate c;
        sadmm_status status = stretch(problem, plan, out, &c);
        if (status != SADMM_OK) return status;
        if (out->levels_tried == 0 || !(c.siconos >= out->certificate.siconos)) {
            if (out->levels_tried == 0) out->levels_tried = 1;
            out->certificate = c;
            status = sadmm_problem_get_solution(problem, best->velocities, best->impulses, best->lambda);
            if (status != SADMM_OK) return status;
        }
        out->converged = c.siconos <= plan->tolerance;
        if (out->converged || out->iterations >= plan->max_iterations || out->report.iterations == 0) break;
        if (c.siconos <= 0.5 * reference) {
            reference = c.siconos;
            unimproved = 0;
        } else if (++unimproved >= PATIENCE && plan->level <= 0) {
            out->level = first * factors[out->levels_tried++ % FACTOR_COUNT];
            reference = INFINITY;
            unimproved = 0;
        }
    }
    if (out->converged) return SADMM_OK;
    return sadmm_problem_set_solution(problem, best->velocities, best->impulses, best->lambda);
}

sadmm_status solve_loop(sadmm_problem *problem, const struct solve_plan *plan, struct solve_outcome *out,
                        struct sadmm_error *error)
{
    struct solution best = {0};
    memset(out, 0, sizeof *out);
    out->level = plan->level;
    if (plan->level <= 0) {
        sadmm_status status = mean_mass(problem, &out->level, error);
        if (status != SADMM_OK) return status;
    }
    sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
    if (!solution_create(&best, problem)) sadmm_fail_memory(error, "the best solution");
    else if ((status = loop(problem, plan, out, &best)) != SADMM_OK)
        sadmm_fail(error, status, "%s", sadmm_problem_message(problem));
    solution_free(&best);
    return status;
}
