#include "convergence_rows.h"

#include <math.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "core/base/memory.h"

static const char *const kinds[] = {"count", "curve", "warm"};

struct row row_start(enum row_kind kind, const char *name, sadmm_method method, const struct series *series)
{
    struct row row = {.kind = kind,
                      .method = method,
                      .series = *series,
                      .tolerance = NAN,
                      .ncp_max = NAN,
                      .ncp_balanced = NAN,
                      .momentum_max = NAN,
                      .distance = NAN,
                      .ms = NAN,
                      .ncp_median = NAN,
                      .ncp_last = NAN,
                      .settle_s = NAN,
                      .energy_excess = NAN,
                      .penetration = NAN,
                      .limited = NAN,
                      .status = "ok"};
    snprintf(row.name, sizeof row.name, "%s", name);
    return row;
}

/* ---- CSV ------------------------------------------------------------------------------------------------------- */

void rows_write_header(FILE *csv)
{
    fputs("kind,name,method,backend,precision,threads,runs_on,bodies,contacts,blocks,limit,iterations,tolerance,"
          "ncp_max,ncp_balanced,momentum_max,ms,ncp_median,ncp_last,settle_s,energy_excess_m,penetration_m,limited,"
          "distance,commit,status\n",
          csv);
}

static void write_number(FILE *out, double x)
{
    if (isnan(x)) putc(',', out);
    else fprintf(out, ",%.4g", x);
}

static void write_integer(FILE *out, int x)
{
    if (x == 0) putc(',', out);
    else fprintf(out, ",%d", x);
}

static void write_row(FILE *out, const struct row *r)
{
    fprintf(out, "%s,", kinds[r->kind]);
    bench_write_csv_text(out, r->name);
    fprintf(out, ",%s,%s,%s,%d,", bench_word_of(bench_methods, (int)r->method),
            bench_word_of(bench_backends, (int)r->series.backend), bench_precision_name(r->series.precision),
            r->series.threads);
    bench_write_csv_text(out, r->series.runs_on);
    fprintf(out, ",%d,%d,%d", r->bodies, r->contacts, r->blocks);
    write_integer(out, r->limit);
    write_integer(out, r->iterations);
    const double numbers[] = {r->tolerance, r->ncp_max,  r->ncp_balanced,  r->momentum_max, r->ms,     r->ncp_median,
                              r->ncp_last,  r->settle_s, r->energy_excess, r->penetration,  r->limited,
                              r->distance};
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; ++k) write_number(out, numbers[k]);
    fprintf(out, ",%s,", sadmm_build_commit());
    bench_write_csv_text(out, r->status);
    putc('\n', out);
    fflush(out); /* for who watches */
}

bool rows_add(struct rows *rows, const struct row *row)
{
    if (!SADMM_GROW(rows->rows, rows->count, rows->count + 1)) return false;
    rows->rows[rows->count++] = *row;
    if (rows->csv) write_row(rows->csv, row);
    return true;
}

void rows_free(struct rows *rows) { sadmm_free(rows->rows); }

/* ---- ratios ---------------------------------------------------------------------------------------------------- */

static bool same_series(const struct series *a, const struct series *b)
{
    return a->backend == b->backend && a->precision == b->precision && a->threads == b->threads;
}

/* The row of another method that measures the same. NULL: there is none. */
static const struct row *counterpart(const struct rows *rows, const struct row *row, sadmm_method method)
{
    for (size_t k = 0; k < rows->count; ++k) {
        const struct row *r = &rows->rows[k];
        if (r->kind != row->kind || r->method != method || strcmp(r->name, row->name) != 0) continue;
        if (!same_series(&r->series, &row->series)) continue;
        if (row->kind == ROW_COUNT ? r->tolerance == row->tolerance : r->iterations == row->iterations) return r;
    }
    return NULL;
}

/* paper / fast of some quantity, over problems. */
struct ratios {
    double log_sum, worst;
    int pairs;         /* rows of both methods there were */
    int count, bounds; /* bounds: counted with the limit, for paper did not get there */
    int lost;          /* fast did not get there, paper did */
    const char *worst_name;
};

static void ratios_add(struct ratios *r, double paper, double fast, const char *name)
{
    double ratio = paper / fast;
    r->log_sum += log(ratio);
    if (r->count++ == 0 || ratio < r->worst) {
        r->worst = ratio;
        r->worst_name = name;
    }
}

/* Two decimals, or two digits of what these would round to nothing. */
static const char *ratio_text(double ratio, char text[24])
{
    snprintf(text, 24, ratio < 0.1 ? "%.2g" : "%.2f", ratio);
    return text;
}

/* none: why there is no ratio at all. */
static void ratios_print(const struct ratios *r, const char *what, const char *unreached, const char *none, FILE *out)
{
    char mean[24], worst[24];
    if (r->pairs == 0) return;
    fprintf(out, "- %s: ", what);
    if (r->count == 0) fprintf(out, "nothing to compare, %s", none);
    else
        fprintf(out, "geometric mean %s over %d, worst %s (%s)", ratio_text(exp(r->log_sum / r->count), mean), r->count,
                ratio_text(r->worst, worst), r->worst_name);
    if (r->bounds) fprintf(out, "; in %d of them %s, so that theirs is a lower bound", r->bounds, unreached);
    if (r->lost) fprintf(out, "; **%d not counted that only paper reaches**", r->lost);
    putc('\n', out);
}

/* ---- cold ------------------------------------------------------------------------------------------------------ */

static const double tolerances[] = {1e-3, 1e-4, 1e-6};
enum { TOLERANCES = sizeof tolerances / sizeof *tolerances };

/* "27 / 31 / > 2000": iterations, or ms, to the tolerances. "-": not measured. */
static void cold_text(const struct rows *rows, const struct row *any, sadmm_method method, bool time, char text[96])
{
    struct row wanted = *any;
    size_t used = 0;
    text[0] = 0;
    for (int t = 0; t < TOLERANCES; ++t) {
        wanted.tolerance = tolerances[t];
        const struct row *row = counterpart(rows, &wanted, method);
        const char *slash = t ? " / " : "";
        if (!row) used += (size_t)snprintf(text + used, 96 - used, "%s-", slash);
        else if (row->iterations == 0)
            used += (size_t)(time ? snprintf(text + used, 96 - used, "%s-", slash)
                                  : snprintf(text + used, 96 - used, "%s> %d", slash, row->limit));
        else
            used += (size_t)(time ? snprintf(text + used, 96 - used, "%s%.3g", slash, row->ms)
                                  : snprintf(text + used, 96 - used, "%s%d", slash, row->iterations));
    }
}

static bool is_cold_row(const struct rows *rows, size_t k, const struct series *series)
{
    const struct row *r = &rows->rows[k];
    return r->kind == ROW_COUNT && r->tolerance == tolerances[0] && same_series(&r->series, series) &&
           (r->method == SADMM_METHOD_PAPER || !counterpart(rows, r, SADMM_METHOD_PAPER));
}

static void print_cold_ratios(const struct rows *rows, const struct series *series, int t, FILE *out)
{
    struct ratios iterations = {0}, times = {0};
    char what[96];
    for (size_t k = 0; k < rows->count; ++k) {
        const struct row *paper = &rows->rows[k];
        if (paper->kind != ROW_COUNT || paper->method != SADMM_METHOD_PAPER || paper->tolerance != tolerances[t] ||
            !same_series(&paper->series, series))
            continue;
        const struct row *fast = counterpart(rows, paper, SADMM_METHOD_FAST);
        if (!fast) continue;
        ++iterations.pairs, ++times.pairs;
        if (fast->iterations == 0) {
            if (paper->iterations) ++iterations.lost;
            continue;
        }
        if (paper->iterations == 0) ++iterations.bounds;
        ratios_add(&iterations, paper->iterations ? paper->iterations : paper->limit, fast->iterations, paper->name);
        if (paper->iterations) ratios_add(&times, paper->ms, fast->ms, paper->name);
    }
    snprintf(what, sizeof what, "iterations to %g, paper / fast", tolerances[t]);
    ratios_print(&iterations, what, "paper does not get there within the limit", "fast gets there in none", out);
    snprintf(what, sizeof what, "time to %g, paper / fast (where both get there)", tolerances[t]);
    ratios_print(&times, what, "", "no problem is one that both get to", out);
}

static void print_heading(const char *what, const struct series *s, FILE *out)
{
    fprintf(out, "### %s: %s %s", what, bench_word_of(bench_backends, (int)s->backend),
            bench_precision_name(s->precision));
    if (s->backend == SADMM_BACKEND_CPU) fprintf(out, ", %d thread%s", s->threads, s->threads == 1 ? "" : "s");
    fprintf(out, "\n\n%s, commit %s\n\n", s->runs_on, sadmm_build_commit());
}

void rows_print_cold(const struct rows *rows, const struct series *series, FILE *out)
{
    bool any = false;
    char paper[96], fast[96], paper_ms[96], fast_ms[96];
    for (size_t k = 0; k < rows->count; ++k) {
        if (!is_cold_row(rows, k, series)) continue;
        const struct row *r = &rows->rows[k];
        if (!any) {
            print_heading("Cold", series, out);
            fprintf(out, "Iterations, and ms, from no impulses to a natural map of 1e-3 / 1e-4 / 1e-6 m/s. > N: not "
                         "within N. -: not reached,\nor not measured.\n\n");
            fprintf(out, "| %-32s | %6s | %11s | %-21s | %-21s | %-21s | %-21s |\n", "problem", "bodies", "constraints",
                    "paper: iterations", "fast: iterations", "paper: ms", "fast: ms");
            fprintf(out, "|---|---|---|---|---|---|---|\n");
        }
        any = true;
        cold_text(rows, r, SADMM_METHOD_PAPER, false, paper);
        cold_text(rows, r, SADMM_METHOD_FAST, false, fast);
        cold_text(rows, r, SADMM_METHOD_PAPER, true, paper_ms);
        cold_text(rows, r, SADMM_METHOD_FAST, true, fast_ms);
        fprintf(out, "| %-32s | %6d | %11d | %-21s | %-21s | %-21s | %-21s |\n", r->name, r->bodies,
                r->contacts + r->blocks, paper, fast, paper_ms, fast_ms);
    }
    if (!any) return;
    putc('\n', out);
    for (int t = 0; t < TOLERANCES; ++t) print_cold_ratios(rows, series, t, out);
    putc('\n', out);
}

/* ---- warm ------------------------------------------------------------------------------------------------------ */

static void pair_text(double paper, double fast, char text[64])
{
    char parts[2][24];
    const double values[2] = {paper, fast};
    for (int k = 0; k < 2; ++k) snprintf(parts[k], sizeof parts[k], isnan(values[k]) ? "-" : "%.2g", values[k]);
    snprintf(text, 64, "%s / %s", parts[0], parts[1]);
}

static void print_warm_row(const struct row *paper, const struct row *fast, FILE *out)
{
    const struct row *any = paper ? paper : fast;
    struct row none = row_start(ROW_WARM, any->name, any->method, &any->series);
    char median[64], balanced[64], settle[64], excess[64], limited[64], ms[64];
    const struct row *p = paper ? paper : &none, *f = fast ? fast : &none;
    pair_text(p->ncp_median, f->ncp_median, median);
    pair_text(p->ncp_balanced, f->ncp_balanced, balanced);
    pair_text(p->settle_s, f->settle_s, settle);
    pair_text(1e3 * p->energy_excess, 1e3 * f->energy_excess, excess);
    pair_text(100 * p->limited, 100 * f->limited, limited);
    pair_text(p->ms, f->ms, ms);
    fprintf(out, "| %-20s | %8d | %4d | %-17s | %-17s | %-13s | %-17s | %-10s | %-13s |", any->name, any->contacts,
            any->iterations, median, balanced, settle, excess, limited, ms);
    for (int k = 0; k < 2; ++k)
        if (strcmp((k ? f : p)->status, "ok") != 0) fprintf(out, " %s: %s", k ? "fast" : "paper", (k ? f : p)->status);
    fputs(" |\n", out);
}

void rows_print_warm(const struct rows *rows, const struct series *series, FILE *out)
{
    enum { MOST_PAIRS = 1024 };
    static char names[MOST_PAIRS][96];
    int pairs = 0;
    struct ratios ratios = {0};
    bool any = false;
    for (size_t k = 0; k < rows->count; ++k) {
        const struct row *r = &rows->rows[k];
        if (r->kind != ROW_WARM || !same_series(&r->series, series)) continue;
        const struct row *paper = counterpart(rows, r, SADMM_METHOD_PAPER),
                         *fast = counterpart(rows, r, SADMM_METHOD_FAST);
        if (r->method == SADMM_METHOD_FAST && paper) continue;
        if (!any) {
            print_heading("Warm", series, out);
            fputs("Steps of k iterations that start from the step before; paper / fast. Medians over the last quarter "
                  "of a run: of the\nnatural map, and of that of the impulses with the velocities that balance "
                  "momentum. settled: from landing until\nthe natural map stays below 1e-5 m/s, -: it does not. "
                  "excess: most energy out of nothing, as a height of all\nbodies. limited: steps that slowed an "
                  "island down.\n\n",
                  out);
            fprintf(out, "| %-20s | %8s | %4s | %-17s | %-17s | %-13s | %-17s | %-10s | %-13s | |\n", "scene",
                    "contacts", "k", "median, m/s", "balanced, m/s", "settled, s", "excess, mm", "limited, %",
                    "step, ms");
            fprintf(out, "|---|---|---|---|---|---|---|---|---|---|\n");
        }
        any = true;
        print_warm_row(paper, fast, out);
        /* An error below 1e-6 m/s counts as that: less does not matter to anybody. */
        double p = paper ? fmax(paper->ncp_balanced, 1e-6) : NAN, f = fast ? fmax(fast->ncp_balanced, 1e-6) : NAN;
        ratios.pairs += paper && fast;
        if (p > 1e-6 || f > 1e-6) {
            snprintf(names[pairs], sizeof names[pairs], "%.63s, k = %d", r->name, r->iterations);
            if (p / f > 0) ratios_add(&ratios, p, f, names[pairs]);
            if (pairs < MOST_PAIRS - 1) ++pairs;
        }
    }
    if (!any) return;
    putc('\n', out);
    ratios_print(&ratios, "balanced error, paper / fast (not below 1e-6 m/s, one of them above)", "",
                 "for no error is above 1e-6 m/s", out);
    putc('\n', out);
}
