#include "solve_loop.h"

#include <math.h>
#include <string.h>

#include "core/base/error.h"
#include "core/base/memory.h"
#include "interrupt.h"

/* The lanes: offsets as multiples of the first one. Lane 0 has penalty updates. */
static const double factors[] = {1, 1, 10, 0.1, 100, 0.01, 1e3, 1e-3};
enum { LANES = sizeof factors / sizeof *factors };

/* In batches: the first lane stagnates when its measure has not halved in PATIENCE; rates are measured over RATE. */
enum { PATIENCE = 6, RATE = 10 };

struct lane {
    double offset;                            /* kg */
    bool updates;
    double *velocities, *impulses, *lambda;  /* where it is; NULL before its first batch */
    double measure;                          /* the smallest so far */
    double left;                             /* batches it still needs at its present rate */
};

struct loop {
    sadmm_problem *problem;
    const struct solve_plan *plan;
    struct solve_outcome *out;
    struct lane lanes[LANES];
    struct lane best;       /* the best solution of all */
    bool exhausted;         /* further iterations lead nowhere */
    struct sadmm_error *error;
};

/* ---- solutions --------------------------------------------------------------------------------------------------- */

static sadmm_status check(struct loop *l, sadmm_status status)
{
    return status == SADMM_OK ? status : sadmm_fail(l->error, status, "%s", sadmm_problem_message(l->problem));
}

static sadmm_status keep(struct loop *l, struct lane *lane)
{
    if (!lane->velocities) {
        lane->velocities = sadmm_alloc(6 * (size_t)sadmm_problem_body_count(l->problem), sizeof(double));
        lane->impulses = sadmm_alloc(3 * (size_t)sadmm_problem_contact_count(l->problem), sizeof(double));
        lane->lambda = sadmm_alloc(6 * (size_t)sadmm_problem_block_count(l->problem), sizeof(double));
    }
    if (!lane->velocities || !lane->impulses || !lane->lambda) return sadmm_fail_memory(l->error, "a solution");
    return check(l, sadmm_problem_get_solution(l->problem, lane->velocities, lane->impulses, lane->lambda));
}

static sadmm_status restore(struct loop *l, const struct lane *lane)
{
    return check(l, sadmm_problem_set_solution(l->problem, lane->velocities, lane->impulses, lane->lambda));
}

static void lane_free(struct lane *lane)
{
    sadmm_free(lane->velocities);
    sadmm_free(lane->impulses);
    sadmm_free(lane->lambda);
}

/* The mean mass of the bodies on a logarithmic scale, kg. */
static sadmm_status mean_mass(struct loop *l, double *mass)
{
    size_t count = (size_t)sadmm_problem_body_count(l->problem);
    double *A = sadmm_alloc(36 * count, sizeof *A), sum = 0;
    if (!A) return sadmm_fail_memory(l->error, "the bodies' masses");
    sadmm_status status = check(l, sadmm_problem_get_bodies(l->problem, A, NULL, NULL));
    for (size_t i = 0; status == SADMM_OK && i < count; ++i)
        sum += log((A[36 * i] + A[36 * i + 7] + A[36 * i + 14]) / 3);
    sadmm_free(A);
    *mass = count ? exp(sum / (double)count) : 1;
    return status;
}

/* ---- running ----------------------------------------------------------------------------------------------------- */

static bool finished(const struct loop *l)
{
    const struct solve_outcome *out = l->out;
    if (interrupted() && out->iterations > 0) return true; /* there is a solution to report */
    return out->converged || l->exhausted || out->iterations >= l->plan->max_iterations;
}

/* One batch on what is in the problem; `cold`: from nothing. */
static sadmm_status batch(struct loop *l, struct lane *lane, bool cold)
{
    struct solve_outcome *out = l->out;
    sadmm_settings s = l->plan->settings;
    sadmm_certificate c;
    long left = l->plan->max_iterations - out->iterations;
    s.iterations = left < l->plan->batch ? (int)left : l->plan->batch;
    s.warm_start = !cold;
    s.penalty_update_warm = true;
    if (!lane->updates) s.penalty_period = 0;
    /* The paper's offset is in kg/s^2 and is multiplied by dt^2. */
    s.penalty_offset = lane->offset / (s.dt * s.dt);
    TRY(check(l, sadmm_problem_solve(l->problem, l->plan->backend, l->plan->precision, &s, &out->report)));
    TRY(check(l, sadmm_problem_certify(l->problem, &c)));
    bool first = out->iterations == 0;
    out->offset = lane->offset;
    out->iterations += out->report.iterations;
    out->ms += out->report.solve_ms;
    double measure = c.siconos;
    out->converged = measure <= l->plan->tolerance;
    l->exhausted = out->report.iterations < s.iterations; /* without constraints one iteration is exact */
    if (cold || measure < lane->measure) lane->measure = measure;
    if (first || measure < l->best.measure) {
        out->certificate = c;
        l->best.measure = measure;
        TRY(keep(l, &l->best));
    }
    return SADMM_OK;
}

/* Some batches of one lane, from where it is; then how many more it needs if it goes on like that. */
static sadmm_status advance(struct loop *l, struct lane *lane)
{
    bool cold = lane->velocities == NULL;
    double before = lane->measure;
    int done = 0;
    if (!cold) TRY(restore(l, lane));
    for (; done < RATE && !finished(l); ++done) {
        TRY(batch(l, lane, cold && done == 0));
        if (cold && done == RATE / 2 - 1) before = lane->measure; /* the first half is a transient */
    }
    if (finished(l)) return SADMM_OK;
    double decades = log10(before / lane->measure) / (cold ? RATE - RATE / 2 : RATE);
    lane->left = decades > 0 ? log10(lane->measure / l->plan->tolerance) / decades : INFINITY;
    return keep(l, lane);
}

static bool has_other_lanes(const struct solve_plan *plan)
{
    return plan->offset <= 0 && plan->settings.method == SADMM_METHOD_PAPER;
}

/* The first lane alone, until the end or, when there are others, until it stagnates. */
static sadmm_status run_first(struct loop *l)
{
    struct lane *lane = &l->lanes[0];
    double to_halve = INFINITY;
    int unimproved = 0;
    bool cold = true;
    while (!finished(l) && (!has_other_lanes(l->plan) || unimproved < PATIENCE)) {
        TRY(batch(l, lane, cold));
        cold = false;
        ++unimproved;
        if (lane->measure <= 0.5 * to_halve) {
            to_halve = lane->measure;
            unimproved = 0;
        }
    }
    return keep(l, lane);
}

static struct lane *choose(struct loop *l)
{
    struct lane *chosen = &l->lanes[0];
    for (int k = 1; k < LANES; ++k)
        if (l->lanes[k].left < chosen->left) chosen = &l->lanes[k];
    if (chosen->left < INFINITY) return chosen;
    for (int k = 1; k < LANES; ++k) /* nobody gets anywhere at present: the one that got farthest */
        if (l->lanes[k].measure < chosen->measure) chosen = &l->lanes[k];
    return chosen;
}

static sadmm_status run(struct loop *l)
{
    double offset = l->plan->offset;
    if (offset <= 0) TRY(mean_mass(l, &offset));
    for (int k = 0; k < LANES; ++k) {
        l->lanes[k].offset = offset * factors[k];
        l->lanes[k].updates = k == 0;
    }
    l->out->offsets_tried = 1;
    TRY(run_first(l));
    if (!finished(l)) TRY(advance(l, &l->lanes[0]));
    for (int k = 1; k < LANES && !finished(l); ++k) {
        TRY(advance(l, &l->lanes[k]));
        l->out->offsets_tried += k > 1; /* lane 1 has the offset of lane 0 */
    }
    while (!finished(l)) TRY(advance(l, choose(l)));
    return restore(l, &l->best);
}

sadmm_status solve_loop(sadmm_problem *problem, const struct solve_plan *plan, struct solve_outcome *out,
                        struct sadmm_error *error)
{
    struct loop l = {.problem = problem, .plan = plan, .out = out, .error = error};
    memset(out, 0, sizeof *out);
    sadmm_status status = run(&l);
    for (int k = 0; k < LANES; ++k) lane_free(&l.lanes[k]);
    lane_free(&l.best);
    return status;
}
