/* The iteration, stepwise and fused: sweeps over bodies and constraints, a barrier after each. */
#include <string.h>

#include "core/math/relax.h"
#include "cpu.h"
#include "cpu_flush.h"

static void update_constraints(struct sadmm_context *c, int thread, int threads, enum cpu_sweep sweep, double *primal)
{
    size_t begin, end;
    if (c->pair_block_count) {
        sadmm_share(c->pair_block_count, thread, threads, &begin, &end);
        CPU(sweep_pairs)(c, begin, end, sweep, primal);
    }
    if (c->row_block_count) {
        sadmm_share(c->row_block_count, thread, threads, &begin, &end);
        CPU(sweep_rows)(c, begin, end, sweep, primal);
    }
}

/* After a measured iteration: wrenches = J^T (lambda + ratio d lambda), see update_penalty. */
static void join_wrenches(struct sadmm_context *c, int thread, int threads)
{
    size_t begin, end;
    real ratio = (real)c->ratio;
    sadmm_share(2 * c->record_count, thread, threads, &begin, &end);
    for (size_t at = begin * ROW; at < end * ROW; ++at) c->wrenches[at] += ratio * c->change[at];
}

static void clear_max(struct sadmm_context *c)
{
    memset(c->thread_max, 0, (size_t)c->plan.threads * THREAD_MAX_STRIDE * sizeof *c->thread_max);
}

static void sum_share(void *context, int thread, int threads)
{
    double none = 0;
    update_constraints((struct sadmm_context *)context, thread, threads, CPU_SWEEP_START, &none);
}

void CPU(sum_wrenches)(struct sadmm_context *c) { cpu_parallel(c, sum_share, c); }

void CPU(start_wrenches)(struct sadmm_context *c)
{
    CPU(sum_wrenches)(c);
    c->step1_done = false;
    c->measured = false;
    c->ratio = 1;
}

static sadmm_status refuse_fast(const struct sadmm_context *c, struct sadmm_error *error)
{
    if (!c->fast) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "method = fast: its iterations are not taken step by step");
}

static void velocity_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    if (c->measured) {
        join_wrenches(c, thread, threads);
        sadmm_barrier_wait(&c->barrier, threads);
    }
    CPU(sweep_bodies)(c, thread, threads, c->step1_done);
}

sadmm_status CPU(update_velocity)(struct sadmm_context *c, struct sadmm_error *error)
{
    if (refuse_fast(c, error) != SADMM_OK) return SADMM_ERROR_UNSUPPORTED;
    cpu_parallel(c, velocity_share, c);
    c->step1_done = true;
    c->measured = false;
    c->ratio = 1;
    return SADMM_OK;
}

/* Iterations, or a part of one. */
struct batch {
    struct sadmm_context *c;
    int count;
    bool goes_on, measure;
};

static void constraints_share(void *argument, int thread, int threads)
{
    const struct batch *s = (const struct batch *)argument;
    double primal = 0;
    update_constraints(s->c, thread, threads, s->measure ? CPU_SWEEP_MEASURE : CPU_SWEEP_ITERATE, &primal);
    s->c->thread_max[thread * THREAD_MAX_STRIDE] = primal;
}

sadmm_status CPU(update_constraints)(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    if (refuse_fast(c, error) != SADMM_OK) return SADMM_ERROR_UNSUPPORTED;
    clear_max(c);
    cpu_parallel(c, constraints_share, &(struct batch){c, 1, false, measure});
    c->measured = measure;
    if (measure) c->residual.primal = cpu_reduce_max(c);
    return SADMM_OK;
}

/* Before iteration i of a batch? */
static bool recomputes_residuals(const struct sadmm_context *c, int i)
{
    int since = c->exact_since + i;
    return since > 0 && since % RELAX_RESIDUAL_PERIOD == 0;
}

/* The method `fast`: constraints first, then bodies (math/relax.h). */
static void iterate_fast(const struct batch *s, int thread, int threads, double *primal)
{
    struct sadmm_context *c = s->c;
    const double relaxation = c->settings.relaxation;
    const bool on = s->goes_on && c->any_warm; /* of islands that start warm */
    const int batch = on ? s->count + 1 : s->count;
    size_t first, past;
    cpu_share_bodies(c, thread, threads, &first, &past);
    for (int i = 0; i < s->count; ++i) {
        if (recomputes_residuals(c, i)) {
            CPU(recompute_residuals)(c, first, past);
            sadmm_barrier_wait(&c->barrier, threads);
        }
        const bool relaxes = relax_constraints(i, batch), step1_done = c->step1_done || i > 0,
                   warm = on && c->any_cold && i + 1 == s->count;
        update_constraints(c, thread, threads,
                           warm         ? CPU_SWEEP_RELAX_WARM
                           : relaxes    ? CPU_SWEEP_RELAX
                           : s->measure ? CPU_SWEEP_PLAIN_MEASURE
                                        : CPU_SWEEP_PLAIN,
                           primal);
        sadmm_barrier_wait(&c->barrier, threads);
        CPU(sweep_bodies_fast)(c, thread, threads, step1_done, relax_velocity(i, batch, step1_done) ? relaxation : 1,
                               relaxes ? relaxation : 1, warm);
        sadmm_barrier_wait(&c->barrier, threads);
    }
}

static void iterate_share(void *argument, int thread, int threads)
{
    const struct batch *s = (const struct batch *)argument;
    struct sadmm_context *c = s->c;
    double primal = 0;
    unsigned mode = c->fast ? cpu_flush_tiny() : 0; /* what fast passes on goes to 0 */
    if (c->measured) {
        join_wrenches(c, thread, threads);
        sadmm_barrier_wait(&c->barrier, threads);
    }
    if (c->fast) iterate_fast(s, thread, threads, &primal);
    for (int i = 0; i < s->count && !c->fast; ++i) {
        bool last = s->measure && i + 1 == s->count;
        CPU(sweep_bodies)(c, thread, threads, c->step1_done || i > 0);
        sadmm_barrier_wait(&c->barrier, threads);
        update_constraints(c, thread, threads, last ? CPU_SWEEP_MEASURE : CPU_SWEEP_ITERATE, &primal);
        sadmm_barrier_wait(&c->barrier, threads);
    }
    c->thread_max[thread * THREAD_MAX_STRIDE] = primal;
    if (c->fast) cpu_flush_restore(mode);
}

sadmm_status CPU(iterate)(struct sadmm_context *c, int count, bool goes_on, bool measure, struct sadmm_error *error)
{
    (void)error;
    clear_max(c);
    cpu_parallel(c, iterate_share, &(struct batch){c, count, goes_on, measure});
    c->step1_done = c->step1_done || count > 0;
    if (count > 0) c->exact_since = (c->exact_since + count - 1) % RELAX_RESIDUAL_PERIOD + 1;
    c->measured = measure && !c->fast;
    c->ratio = 1;
    if (measure) c->residual.primal = cpu_reduce_max(c);
    return SADMM_OK;
}

static void dual_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    c->thread_max[thread * THREAD_MAX_STRIDE] = CPU(dual_residual)(c, thread, threads);
}

/* Eqs. (16) and (17) after a measured iteration. The primal part was taken in the sweep; the dual one is the momentum
 * residual A v - b - J^T lambda, for which the wrenches hold J^T lambda. */
sadmm_status CPU(measure_residuals)(struct sadmm_context *c, struct sadmm_residual *residual, struct sadmm_error *error)
{
    (void)error;
    if (c->fast) CPU(sum_wrenches)(c); /* they hold changes */
    clear_max(c);
    cpu_parallel(c, dual_share, c);
    residual->primal = c->residual.primal;
    residual->dual = cpu_reduce_max(c);
    return SADMM_OK;
}
