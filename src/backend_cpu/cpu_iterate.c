/* The iteration, stepwise and fused: sweeps over bodies and constraints, a barrier after each. */
#include <string.h>

#include "core/math/relax.h"
#include "cpu.h"
#include "cpu_flush.h"

static void update_bodies(struct sadmm_context *c, int thread, int threads, bool settled)
{
    size_t begin, end;
    cpu_share(c->body_block_count, thread, threads, &begin, &end);
    CPU(sweep_bodies)(c, begin, end, settled);
}

static void update_constraints(struct sadmm_context *c, int thread, int threads, enum cpu_sweep sweep, double *primal)
{
    size_t begin, end;
    if (c->pair_block_count) {
        cpu_share(c->pair_block_count, thread, threads, &begin, &end);
        CPU(sweep_pairs)(c, begin, end, sweep, primal);
    }
    if (c->row_block_count) {
        cpu_share(c->row_block_count, thread, threads, &begin, &end);
        CPU(sweep_row_blocks)(c, begin, end, sweep, primal);
    }
}

/* After a measured iteration: wrenches = J^T (lambda + ratio d lambda), see update_penalty. */
static void join_wrenches(struct sadmm_context *c, int thread, int threads)
{
    size_t begin, end;
    real ratio = (real)c->ratio;
    cpu_share(2 * c->record_count, thread, threads, &begin, &end);
    for (size_t at = begin * ROW; at < end * ROW; ++at) c->wrenches[at] += ratio * c->change[at];
}

static void clear_max(struct sadmm_context *c)
{
    memset(c->thread_max, 0, (size_t)c->plan.threads * THREAD_MAX_STRIDE * sizeof *c->thread_max);
}

void CPU(sum_wrenches)(struct sadmm_context *c)
{
    CPU_PARALLEL
    {
        double none = 0;
        update_constraints(c, cpu_thread(), cpu_threads(), CPU_SWEEP_START, &none);
    }
}

void CPU(start_wrenches)(struct sadmm_context *c)
{
    CPU(sum_wrenches)(c);
    c->settled = false;
    c->measured = false;
    c->ratio = 1;
}

static sadmm_status refuse_fast(const struct sadmm_context *c, struct sadmm_error *error)
{
    if (!c->fast) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "method = fast: its iterations are not taken step by step");
}

sadmm_status CPU(update_velocity)(struct sadmm_context *c, struct sadmm_error *error)
{
    if (refuse_fast(c, error) != SADMM_OK) return SADMM_ERROR_UNSUPPORTED;
    CPU_PARALLEL
    {
        if (c->measured) {
            join_wrenches(c, cpu_thread(), cpu_threads());
            CPU_BARRIER;
        }
        update_bodies(c, cpu_thread(), cpu_threads(), c->settled);
    }
    c->settled = true;
    c->measured = false;
    c->ratio = 1;
    return SADMM_OK;
}

sadmm_status CPU(update_constraints)(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    if (refuse_fast(c, error) != SADMM_OK) return SADMM_ERROR_UNSUPPORTED;
    clear_max(c);
    CPU_PARALLEL
    {
        double primal = 0;
        update_constraints(c, cpu_thread(), cpu_threads(), measure ? CPU_SWEEP_MEASURE : CPU_SWEEP_ITERATE, &primal);
        c->thread_max[cpu_thread() * THREAD_MAX_STRIDE] = primal;
    }
    c->measured = measure;
    if (measure) c->residual.primal = cpu_reduce_max(c);
    return SADMM_OK;
}

/* Before iteration i of a stretch? */
static bool takes_defects(const struct sadmm_context *c, int i)
{
    int since = c->exact_since + i;
    return since > 0 && since % RELAX_DEFECT_PERIOD == 0;
}

/* The method `fast`: constraints first, then bodies (math/relax.h). */
static void iterate_fast(struct sadmm_context *c, int thread, int threads, int count, bool measure, double *primal)
{
    const double relaxation = c->settings.relaxation;
    size_t begin, end, first, past;
    cpu_share(c->body_block_count, thread, threads, &begin, &end);
    cpu_share((size_t)c->bodies, thread, threads, &first, &past);
    for (int i = 0; i < count; ++i) {
        if (takes_defects(c, i)) {
            CPU(take_defects)(c, first, past);
            CPU_BARRIER;
        }
        bool farther = relax_constraints(i, count), settled = c->settled || i > 0;
        update_constraints(c, thread, threads,
                           farther   ? CPU_SWEEP_RELAX
                           : measure ? CPU_SWEEP_PLAIN_MEASURE
                                     : CPU_SWEEP_PLAIN,
                           primal);
        CPU_BARRIER;
        CPU(sweep_bodies_fast)(c, begin, end, settled, relax_velocity(i, count, settled) ? relaxation : 1,
                               farther ? relaxation : 1);
        CPU_BARRIER;
    }
}

sadmm_status CPU(iterate)(struct sadmm_context *c, int count, bool measure, struct sadmm_error *error)
{
    (void)error;
    clear_max(c);
    CPU_PARALLEL
    {
        int thread = cpu_thread(), threads = cpu_threads();
        double primal = 0;
        unsigned mode = c->fast ? cpu_flush_tiny() : 0; /* what fast passes on goes to 0 */
        if (c->measured) {
            join_wrenches(c, thread, threads);
            CPU_BARRIER;
        }
        if (c->fast) iterate_fast(c, thread, threads, count, measure, &primal);
        for (int i = 0; i < count && !c->fast; ++i) {
            bool last = measure && i + 1 == count;
            update_bodies(c, thread, threads, c->settled || i > 0);
            CPU_BARRIER;
            update_constraints(c, thread, threads, last ? CPU_SWEEP_MEASURE : CPU_SWEEP_ITERATE, &primal);
            CPU_BARRIER;
        }
        c->thread_max[thread * THREAD_MAX_STRIDE] = primal;
        if (c->fast) cpu_flush_restore(mode);
    }
    c->settled = c->settled || count > 0;
    if (count > 0) c->exact_since = (c->exact_since + count - 1) % RELAX_DEFECT_PERIOD + 1;
    c->measured = measure && !c->fast;
    c->ratio = 1;
    if (measure) c->residual.primal = cpu_reduce_max(c);
    return SADMM_OK;
}

/* Eqs. (16) and (17) after a measured iteration. The primal part was taken in the sweep; the dual one is the momentum
 * residual A v - b - J^T lambda, for which the wrenches hold J^T lambda. */
sadmm_status CPU(measure_residuals)(struct sadmm_context *c, struct sadmm_residual *residual, struct sadmm_error *error)
{
    (void)error;
    if (c->fast) CPU(sum_wrenches)(c); /* they hold changes */
    clear_max(c);
    CPU_PARALLEL
    {
        size_t begin, end;
        cpu_share(c->body_block_count, cpu_thread(), cpu_threads(), &begin, &end);
        c->thread_max[cpu_thread() * THREAD_MAX_STRIDE] = CPU(dual_residual)(c, begin, end);
    }
    residual->primal = c->residual.primal;
    residual->dual = cpu_reduce_max(c);
    return SADMM_OK;
}
