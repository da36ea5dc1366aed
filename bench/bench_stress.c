/* subadmm-bench stress: extreme cases, each judged by physics (stress/stress.h). One line a row: a case at a value, by
 * a backend and a precision. */
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/base/clock.h"
#include "stress/stress.h"

static const char command[] = "stress";
static const char *const verdicts[] = {"pass", "limit", "FAIL"};

struct options {
    const char *cases[BENCH_LIST], *csv;
    int case_count, backend, precision;
    double dt, tolerance;
    long iterations, device, threads;
    bool quick, list;
};

struct tally {
    FILE *csv; /* NULL: none */
    long rows[3];
};

/* ---- what a row says ------------------------------------------------------------------------------------------- */

static void value_text(const struct stress *s, char *text, size_t size)
{
    const char *variant = s->about->variants ? s->about->variants[s->variant] : NULL;
    snprintf(text, size, "%s%s%s %g", variant ? variant : "", variant ? ", " : "", s->about->parameter, s->value);
}

static void measured_text(const struct stress *s, const struct stress_check *decisive, const struct stress_limit *limit,
                          char *text, size_t size)
{
    if (s->message[0]) snprintf(text, size, "%s", s->message);
    else if (!decisive) snprintf(text, size, "nothing was measured");
    else if (limit)
        snprintf(text, size, "%s: %.2g > %.2g, <= %.2g: %s", decisive->what, decisive->worst, decisive->bound,
                 limit->bound, limit->reason);
    else
        snprintf(text, size, "%s: %.2g %s %.2g", decisive->what, decisive->worst,
                 decisive->worst <= decisive->bound ? "<=" : ">", decisive->bound);
}

static void print_heading(struct tally *tally)
{
    if (tally->csv)
        fputs(
            "verdict,case,variant,parameter,value,backend,precision,dt,iterations,tolerance,steps,unsolved,measured\n",
            tally->csv);
    if (!outputs_on_stdout())
        printf(
            "its./tol.: iterations a step at most, and the tolerance, m/s; unsolved: steps that miss it; s: wall time\n"
            "%-5s  %-14s  %-32s  %-8s  %-7s  %-9s  %13s  %6s  %s\n",
            "", "case", "parameter", "by", "dt", "its./tol.", "unsolved/steps", "s", "measured and bound");
}

static void print_row(struct tally *tally, const struct stress *s, double seconds)
{
    char value[96], measured[512], by[16], budget[32], unsolved[32];
    const struct stress_check *decisive;
    const struct stress_limit *limit;
    const enum stress_verdict verdict = stress_judge(s, &decisive, &limit);
    const sadmm_settings *settings = &s->def.settings;
    const char *backend = bench_word_of(bench_backends, (int)s->def.backend),
               *precision = bench_precision_name(s->def.precision);
    ++tally->rows[verdict];
    measured_text(s, decisive, limit, measured, sizeof measured);
    if (tally->csv) {
        fprintf(tally->csv, "%s,%s,", verdicts[verdict], s->about->name);
        bench_write_csv_text(tally->csv, s->about->variants ? s->about->variants[s->variant] : "");
        fputc(',', tally->csv);
        bench_write_csv_text(tally->csv, s->about->parameter);
        fprintf(tally->csv, ",%g,%s,%s,%.3g,%d,%g,%ld,%ld,", s->value, backend, precision, settings->dt,
                settings->iterations, settings->tolerance, s->steps, s->unsolved);
        bench_write_csv_text(tally->csv, measured);
        fputc('\n', tally->csv);
    }
    if (outputs_on_stdout()) return;
    value_text(s, value, sizeof value);
    snprintf(by, sizeof by, "%s %s", backend, precision);
    snprintf(budget, sizeof budget, "%d/%g", settings->iterations, settings->tolerance);
    snprintf(unsolved, sizeof unsolved, "%ld/%ld", s->unsolved, s->steps);
    printf("%-5s  %-14s  %-32s  %-8s  %-7.3g  %-9s  %13s  %6.2f  %s\n", verdicts[verdict], s->about->name, value, by,
           settings->dt, budget, unsolved, seconds, measured);
    fflush(stdout);
}

/* ---- which rows ------------------------------------------------------------------------------------------------- */

static bool is_wanted(const struct options *o, const char *name)
{
    for (int k = 0; k < o->case_count; ++k)
        if (!strcmp(o->cases[k], name)) return true;
    return o->case_count == 0;
}

static void run_case(const struct options *o, const struct stress_case *about, const sadmm_world_def *def,
                     struct tally *tally)
{
    const int variants = about->variants ? about->variant_count : 1;
    for (int k = 0; k < about->value_count * variants && !interrupted(); ++k) {
        const int value = k / variants;
        struct stress s;
        if (o->quick && !(about->quick >> value & 1)) continue;
        const double begin = sadmm_clock_ms();
        stress_run(&s, about, about->values[value], k % variants, o->quick, def);
        print_row(tally, &s, 1e-3 * (sadmm_clock_ms() - begin));
    }
}

/* By one backend and precision, where that is; one that was asked for by name must be. */
static int run_by(const struct options *o, sadmm_backend backend, sadmm_precision precision, struct tally *tally)
{
    sadmm_world_def def = sadmm_world_def_default();
    if (!bench_is_available(backend, precision, stderr))
        return o->backend == (int)backend && o->precision == (int)precision ? 1 : 0;
    def.backend = backend;
    def.precision = precision;
    def.device = (int)o->device;
    def.settings.threads = (int)o->threads;
    if (o->dt > 0) def.settings.dt = o->dt;
    if (o->tolerance > 0) def.settings.tolerance = o->tolerance;
    if (o->iterations > 0) def.settings.iterations = (int)o->iterations;
    const struct stress_case *about;
    for (size_t k = 0; (about = stress_case_at(k)) != NULL; ++k)
        if (is_wanted(o, about->name)) run_case(o, about, &def, tally);
    return 0;
}

static int run(const struct options *o, struct tally *tally)
{
    int code = 0;
    print_heading(tally);
    for (int backend = SADMM_BACKEND_REF; backend < SADMM_BACKEND_COUNT; ++backend)
        for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision)
            if ((o->backend == SADMM_BACKEND_AUTO || o->backend == backend) &&
                (o->precision < 0 || o->precision == precision))
                code |= run_by(o, (sadmm_backend)backend, (sadmm_precision)precision, tally);
    if (!outputs_on_stdout())
        printf("%ld pass, %ld at a limit that is named, %ld FAIL\n", tally->rows[STRESS_PASS],
               tally->rows[STRESS_LIMIT], tally->rows[STRESS_FAIL]);
    return code || tally->rows[STRESS_FAIL] > 0 ? 1 : 0;
}

/* ---- the command ------------------------------------------------------------------------------------------------ */

static int list(void)
{
    const struct stress_case *about;
    for (size_t k = 0; (about = stress_case_at(k)) != NULL; ++k) {
        printf("%-14s  %s\n%16s%s:", about->name, about->about, "", about->parameter);
        for (int i = 0; i < about->value_count; ++i) printf(" %g", about->values[i]);
        for (int i = 0; i < about->variant_count; ++i) printf("%s%s", i ? ", " : "; ", about->variants[i]);
        printf("\n");
    }
    return 0;
}

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXTS("case", "NAME", o->cases, &o->case_count, "only this one; may be repeated"),
        BENCH_WORD("backend", &o->backend, bench_backends, 4, "default cpu"),
        BENCH_WORD("precision", &o->precision, bench_precisions, 3, "default both"),
        BENCH_FLAG("quick", &o->quick, "fewer rows and shorter runs, as the tests do"),
        BENCH_REAL("dt", "S", &o->dt, 1, "time step, default 0.005; some cases have their own"),
        BENCH_NUMBER("iterations", &o->iterations, 1, 1000000, "a step at most, default the library's"),
        BENCH_REAL("tolerance", "M/S", &o->tolerance, 1, "default the library's"),
        BENCH_NUMBER("threads", &o->threads, 0, 1024, "at most, 0: as many as there are; default 1"),
        BENCH_NUMBER("device", &o->device, 0, 1023, "accelerator, default 0"),
        BENCH_TEXT("csv", "FILE", &o->csv, "write the rows there; - is standard output"),
        BENCH_FLAG("list", &o->list, "what the cases are, and their values"),
    };
    int code =
        bench_parse(command, options, sizeof options / sizeof *options,
                    "A row passes if physics holds to the bound, is a limit if the case's table says what limits "
                    "it\nand a weaker bound holds, and else fails.\n"
                    "Exit status: 1 if a row fails.\n",
                    argc, argv);
    for (int k = 0; k < o->case_count && !code; ++k) {
        const struct stress_case *about;
        size_t i = 0;
        while ((about = stress_case_at(i)) != NULL && strcmp(about->name, o->cases[k])) ++i;
        if (!about) code = bench_bad_option(command, "case", o->cases[k], "one of --list");
    }
    return code;
}

int bench_stress(int argc, char **argv)
{
    struct options o = {.backend = SADMM_BACKEND_CPU, .precision = -1, .threads = 1};
    struct tally tally = {0};
    struct output *csv = NULL;
    int code = parse(argc, argv, &o);
    if (code) return code < 0 ? 0 : code;
    if (o.list) return list();
    if (o.csv && (code = output_open("--csv", o.csv, OUTPUT_STREAM, &csv)) != 0) return code;
    if (csv) tally.csv = output_stream(csv);
    code = run(&o, &tally);
    const int written = output_close(csv);
    return code ? code : written;
}
