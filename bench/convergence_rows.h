/* What `subadmm-bench convergence` measures, a row each, and the tables made from the rows. */
#ifndef BENCH_CONVERGENCE_ROWS_H
#define BENCH_CONVERGENCE_ROWS_H

#include <stdbool.h>
#include <stdio.h>

#include "core/base/error.h"
#include "subadmm/settings.h"

enum row_kind {
    ROW_COUNT, /* cold: iterations and time to a tolerance */
    ROW_CURVE, /* cold: errors after a number of iterations */
    ROW_WARM,  /* a scene with that many iterations a step */
};

/* A backend in a precision on a number of threads. */
struct series {
    sadmm_backend backend;
    sadmm_precision precision;
    int threads;
    char runs_on[128];
};

/* NAN and 0 iterations: not measured, or not reached. */
struct row {
    enum row_kind kind;
    char name[64];
    sadmm_method method;
    struct series series;
    int bodies, contacts, blocks;
    int limit;                                  /* COUNT: iterations that were tried */
    int iterations;                             /* COUNT: needed; CURVE: done; WARM: a step */
    double tolerance;                           /* COUNT, m/s */
    double ncp_max, ncp_balanced, momentum_max; /* CURVE, COUNT at its iterations; WARM: medians */
    double distance;                            /* CURVE, COUNT: from a reference solution, m/s */
    double ms;                                  /* COUNT, CURVE: of the solve; WARM: of a step (median) */
    double ncp_median, ncp_last, settle_s, energy_excess, penetration; /* WARM */
    double limited; /* WARM: share of steps in which an island was slowed down (sadmm_step_report) */
    char status[SADMM_MESSAGE_SIZE];                                   /* "ok", or why there is nothing */
};

/* A row with nothing measured yet. */
struct row row_start(enum row_kind kind, const char *name, sadmm_method method, const struct series *series);

struct rows {
    struct row *rows;
    size_t count;
    FILE *csv; /* NULL: not wanted. Every row is written when it is added */
};

void rows_write_header(FILE *csv);
bool rows_add(struct rows *rows, const struct row *row);
void rows_free(struct rows *rows);

/* Markdown tables of the rows of one series. */
void rows_print_cold(const struct rows *rows, const struct series *series, FILE *out);
void rows_print_warm(const struct rows *rows, const struct series *series, FILE *out);

#endif
