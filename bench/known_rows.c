#include "known_rows.h"

#include <math.h>
#include <stdlib.h>

#include "bench.h"
#include "cli/interrupt.h"
#include "core/base/memory.h"

/* What is off by less than this share of a body's length has no order left: slop, and what a solve leaves. */
static const double FLOOR = 1e-6;

static double median_of(double *values, int count)
{
    if (count == 0) return NAN;
    qsort(values, (size_t)count, sizeof *values, bench_compare_doubles);
    return 0.5 * (values[(count - 1) / 2] + values[count / 2]);
}

static void print_head(int levels, FILE *out)
{
    fprintf(out, "| motion | error by dt");
    for (int k = 1; k < levels; ++k) fprintf(out, " | dt/%d", 1 << k);
    fprintf(out, " | order | least | energy left | most |\n|---|");
    for (int k = 0; k < levels; ++k) fprintf(out, "---|");
    fprintf(out, "---|---|---|---|\n");
}

/* Of one kind. columns: [count] for every level and the orders. */
static sadmm_status print_kind(int kind, const sadmm_world_def *def, int count, int levels, double *columns, FILE *out,
                               struct sadmm_error *error)
{
    double *orders = columns + (size_t)levels * (size_t)count, left = HUGE_VAL, most = -HUGE_VAL;
    int ordered = 0;
    for (int n = 0; n < count; ++n) {
        struct known_motion motion;
        struct known_result result;
        if (interrupted()) return SADMM_OK;
        known_motion_make(kind, n, &motion);
        TRY(known_motion_run(&motion, def, NULL, levels, &result, error));
        for (int k = 0; k < levels; ++k) columns[k * count + n] = result.error[k] / motion.scale;
        const double before = result.error[levels - 2], last = result.error[levels - 1];
        if (before > FLOOR * motion.scale) orders[ordered++] = log2(before / last);
        left = fmin(left, 1 + result.left);
        most = fmax(most, 1 + result.most);
    }
    fprintf(out, "| %s", known_motion_name(kind));
    for (int k = 0; k < levels; ++k) fprintf(out, " | %.1e", median_of(columns + k * count, count));
    const double median = median_of(orders, ordered); /* sorts them */
    if (ordered > 0) fprintf(out, " | %.1f | %.1f", median, orders[0]);
    else fprintf(out, " | | ");
    fprintf(out, " | %.5f | %.6f |\n", left, most);
    return SADMM_OK;
}

sadmm_status known_print(const sadmm_world_def *def, int count, int levels, FILE *out, struct sadmm_error *error)
{
    double *columns = sadmm_alloc((size_t)count * (size_t)(levels + 1), sizeof *columns);
    sadmm_status status = columns ? SADMM_OK : sadmm_fail_memory(error, "the motions");
    if (status == SADMM_OK) print_head(levels, out);
    for (int kind = 0; kind < known_motion_kinds() && status == SADMM_OK && !interrupted(); ++kind)
        status = print_kind(kind, def, count, levels, columns, out, error);
    sadmm_free(columns);
    return status;
}
