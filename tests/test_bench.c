/* The `subadmm-bench` command as its users see it: a small run, its CSV, what it leaves out, bad options. */
#include <check.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "run_suite.h"

static const char command[] = SUBADMM_BENCH; /* the build gives its path */

enum { MAX_TEXT = 1 << 18, MAX_ROWS = 512, MAX_COLUMNS = 32 };

/* Run with these arguments; returns the exit code. `out` gets what it writes to both outputs. */
static int run(const char *arguments, char *out)
{
    char text[1024];
    snprintf(text, sizeof text, "%s %s 2>&1 </dev/null", command, arguments);
    FILE *pipe = popen(text, "r");
    ck_assert_ptr_nonnull(pipe);
    out[fread(out, 1, MAX_TEXT - 1, pipe)] = 0;
    int status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

/* ---- CSV ------------------------------------------------------------------------------------------------------- */

struct table {
    char text[MAX_TEXT];
    char *names[MAX_COLUMNS], *fields[MAX_ROWS][MAX_COLUMNS];
    int rows, columns;
};

/* Cut a line into its fields, quotes taken off ("" inside them is one quote); returns the start of the next line. */
static char *cut(char *at, char *fields[MAX_COLUMNS], int columns)
{
    for (int k = 0; k < columns; ++k) {
        char *to = fields[k] = at;
        bool quoted = *at == '"';
        for (at += quoted; *at && (quoted || (*at != ',' && *at != '\n')); ++at) {
            if (quoted && *at == '"' && *++at != '"') break;
            *to++ = *at;
        }
        char end = *at++;
        *to = 0;
        ck_assert_msg(end == (k == columns - 1 ? '\n' : ','), "field %d ends in '%c'", k, end);
    }
    return at;
}

static void read_csv(const char *path, struct table *table)
{
    FILE *file = fopen(path, "r");
    ck_assert_ptr_nonnull(file);
    table->text[fread(table->text, 1, MAX_TEXT - 1, file)] = 0;
    fclose(file);
    table->columns = 1;
    for (const char *c = table->text; *c != '\n'; ++c) table->columns += *c == ',';
    ck_assert_int_le(table->columns, MAX_COLUMNS);
    char *at = cut(table->text, table->names, table->columns);
    for (table->rows = 0; *at; ++table->rows) {
        ck_assert_int_lt(table->rows, MAX_ROWS);
        at = cut(at, table->fields[table->rows], table->columns);
    }
}

static const char *field(const struct table *table, int row, const char *name)
{
    for (int k = 0; k < table->columns; ++k)
        if (!strcmp(table->names[k], name)) return table->fields[row][k];
    ck_abort_msg("no column \"%s\"", name);
}

static double number(const struct table *table, int row, const char *name)
{
    const char *text = field(table, row, name);
    char *end;
    double value = strtod(text, &end);
    ck_assert_msg(end != text && !*end && isfinite(value), "row %d: %s = \"%s\"", row, name, text);
    return value;
}

static char csv_path[64];

static void make_csv(void)
{
    strcpy(csv_path, "/tmp/test_bench_XXXXXX");
    int file = mkstemp(csv_path);
    ck_assert_int_ge(file, 0);
    fclose(fdopen(file, "w"));
}

static void remove_csv(void) { remove(csv_path); }

/* ---------------------------------------------------------------------------------------------------------------- */

/* Two series of two sizes. Where there is one core, the second series is left out and that is said. */
START_TEST(scaling_measures)
{
    static struct table table;
    static char out[MAX_TEXT];
    char arguments[256];
    snprintf(arguments, sizeof arguments,
             "scaling --sizes 100,200 --threads 1,2 --backend cpu --precision f64 --method %s --steps 9 --warm-up 3 "
             "--csv %s",
             _i ? "paper" : "fast", csv_path);
    int code = run(arguments, out);
    ck_assert_msg(code == 0, "exit code %d\n%s", code, out);
    read_csv(csv_path, &table);
    if (table.rows == 2) ck_assert_msg(strstr(out, "cpu, 2 threads: left out, this machine has 1"), "%s", out);
    else ck_assert_int_eq(table.rows, 4);
    for (int row = 0; row < table.rows; ++row) {
        int size = row % 2 ? 200 : 100;
        char spec[32];
        snprintf(spec, sizeof spec, "sliding_cubes:%d", size);
        ck_assert_str_eq(field(&table, row, "scene"), spec);
        ck_assert_str_eq(field(&table, row, "backend"), "cpu");
        ck_assert_str_eq(field(&table, row, "precision"), "f64");
        ck_assert_str_eq(field(&table, row, "status"), "ok");
        ck_assert(*field(&table, row, "runs_on") && *field(&table, row, "commit"));
        ck_assert(number(&table, row, "threads") == 1 + row / 2);
        ck_assert(number(&table, row, "bodies") == size);
        ck_assert(number(&table, row, "contacts") == 4 * number(&table, row, "pairs")); /* faces on faces */
        ck_assert(number(&table, row, "contacts") >= 4 * size);
        ck_assert(number(&table, row, "iterations") == (_i ? 120 : 20)); /* the scene's for the method */
        ck_assert(number(&table, row, "steps") == 9);
        ck_assert(number(&table, row, "hash_step") == 12);

        double step = number(&table, row, "step_ms"), solver = number(&table, row, "solver_ms");
        static const char *const parts[] = {"collide_ms", "assemble_ms", "solve_ms", "finish_ms"};
        for (int k = 0; k < 4; ++k) { /* each is a median by itself: none is above the whole's */
            double part = number(&table, row, parts[k]);
            ck_assert_msg(part > 0 && part < step, "%s = %g of %g", parts[k], part, step);
        }
        ck_assert(solver > 0 && solver < step);

        /* The raft in f64. Paper: far better than the limits, which are what f32 reaches. Fast: the 13th step of 20
         * iterations after a cold start; 500 cubes have 5e-5 after 10 steps, 1e-5 after 20. */
        ck_assert(number(&table, row, "ncp_max") >= 0 && number(&table, row, "ncp_max") < (_i ? 1e-5 : 1e-4));
        ck_assert(number(&table, row, "momentum_max") >= 0 && number(&table, row, "momentum_max") < 1e-2);
    }
    /* The state does not depend on the number of threads, but on the scene. */
    ck_assert_uint_eq(strlen(field(&table, 0, "state_hash")), 16);
    ck_assert_str_ne(field(&table, 0, "state_hash"), field(&table, 1, "state_hash"));
    for (int row = 2; row < table.rows; ++row)
        ck_assert_str_eq(field(&table, row, "state_hash"), field(&table, row - 2, "state_hash"));
}
END_TEST

/* No time at all: nothing is measured, every row is there and says so. */
START_TEST(scaling_says_what_it_skips)
{
    static struct table table;
    static char out[MAX_TEXT];
    char arguments[256];
    snprintf(arguments, sizeof arguments,
             "scaling --sizes 10,1000000 --threads 1 --backend cpu --max-seconds 1e-9 --csv %s", csv_path);
    ck_assert_int_eq(run(arguments, out), 0);
    read_csv(csv_path, &table);
    ck_assert_int_eq(table.rows, 2);
    ck_assert_msg(strstr(field(&table, 0, "status"), "skipped: no step timed within --max-seconds 1e-09"), "%s", out);
    ck_assert_msg(strstr(field(&table, 1, "status"), "skipped: would take"), "%s", out);
    for (int row = 0; row < 2; ++row) {
        ck_assert_str_eq(field(&table, row, "step_ms"), "");
        ck_assert_str_eq(field(&table, row, "state_hash"), "");
        ck_assert_msg(strstr(out, field(&table, row, "status")), "%s", out);
    }
    ck_assert_int_eq(run("scaling --sizes 10 --threads 1024 --backend cpu --csv -", out), 0);
    ck_assert_msg(strstr(out, "cpu, 1024 threads: left out, this machine has"), "%s", out);
}
END_TEST

/* A file has one size, its own, and steps as the scene that it was written of. */
START_TEST(scaling_takes_a_file)
{
    static struct table table, file;
    static char out[MAX_TEXT];
    char arguments[512], path[64];
    const char *const common = "--threads 1 --backend cpu --precision f64 --steps 3 --warm-up 2";
    snprintf(path, sizeof path, "/tmp/test_bench, %ld.json", (long)getpid()); /* which a CSV must quote */
    FILE *scene = fopen(path, "w");
    ck_assert_ptr_nonnull(scene);
    fputs("{\"format\": \"subadmm scene\", \"format_version\": 1, \"bodies\": [{\"density\": 1000, \"shapes\": ["
          "{\"type\": \"sphere\", \"size\": [0.1]}], \"position\": [0, 0, 0.1]}, {\"type\": \"static\", \"shapes\": ["
          "{\"type\": \"plane\"}]}]}",
          scene);
    ck_assert_int_eq(fclose(scene), 0);
    for (int k = 0; k < 2; ++k) { /* with --scene, and as a word */
        snprintf(arguments, sizeof arguments, "scaling %s '%s' %s --csv %s", k ? "" : "--scene", path, common,
                 csv_path);
        const int code = run(arguments, out);
        ck_assert_msg(code == 0, "exit code %d\n%s", code, out);
        read_csv(csv_path, k ? &file : &table);
    }
    ck_assert_int_eq(table.rows, 1);
    ck_assert_str_eq(field(&table, 0, "scene"), path);
    ck_assert_str_eq(field(&table, 0, "status"), "ok");
    ck_assert(number(&table, 0, "bodies") == 1 && number(&table, 0, "contacts") == 1);
    ck_assert_str_eq(field(&table, 0, "state_hash"), field(&file, 0, "state_hash"));
    snprintf(arguments, sizeof arguments, "scaling '%s' --sizes 10", path);
    ck_assert_int_eq(run(arguments, out), 2);
    ck_assert_msg(strstr(out, "--sizes 10: must be left out, for a scene file has a size of its own"), "%s", out);
    /* nothing is written over it, by any command that takes scenes and writes */
    static const char *const writers[] = {"scaling",   "ablation --quick", "convergence --only warm",
                                          "precision", "environments",     "motion"};
    for (size_t k = 0; k < sizeof writers / sizeof *writers; ++k) {
        snprintf(arguments, sizeof arguments, "%s '%s' --csv '%s'", writers[k], path, path);
        if (!strcmp(writers[k], "motion")) snprintf(arguments, sizeof arguments, "motion '%s' --json '%s'", path, path);
        ck_assert_msg(run(arguments, out) == 2 && strstr(out, "is a file that is read: must be another"), "%s: %s",
                      arguments, out);
    }
    /* read once, so that it may come by a pipe */
    static const char *const once[] = {"stand --steps 2 --threads 1", "queries --rays 10",
                                       "rows --iterations 2 --pairs 1"};
    for (size_t k = 0; k < sizeof once / sizeof *once; ++k) {
        char script[512];
        snprintf(script, sizeof script, "cat '%s' | %s %s /dev/stdin >/dev/null 2>&1", path, command, once[k]);
        ck_assert_msg(system(script) == 0, "%s", script);
    }
    ck_assert_int_eq(remove(path), 0);
    snprintf(arguments, sizeof arguments, "scaling '%s'", path);
    ck_assert_int_eq(run(arguments, out), 1);
    ck_assert_msg(strstr(out, "could not be opened"), "%s", out);
    ck_assert_int_eq(run("scaling robot.urdf", out), 1);
    ck_assert_msg(strstr(out, "python -m subadmm convert robot.urdf robot.json"), "%s", out);
}
END_TEST

/* ---- convergence ----------------------------------------------------------------------------------------------- */

static bool is_row(const struct table *table, int row, const char *kind, const char *name, const char *method)
{
    return !strcmp(field(table, row, "kind"), kind) && (!name || !strcmp(field(table, row, "name"), name)) &&
           (!method || !strcmp(field(table, row, "method"), method));
}

/* Iterations that method needs on that problem. */
static double needed(const struct table *table, const char *name, const char *method, double tolerance)
{
    for (int row = 0; row < table->rows; ++row)
        if (is_row(table, row, "count", name, method) && number(table, row, "tolerance") == tolerance)
            return *field(table, row, "iterations") ? number(table, row, "iterations") : INFINITY;
    ck_abort_msg("no row for %s by %s to %g", name, method, tolerance);
}

/* Counts that an independent program (dense, in another language) found for the paper's iteration. On these problems
 * the error falls so steeply where it passes the tolerance that rounding moves a count by one or two. */
static void expect_known_counts(const struct table *table)
{
    static const struct {
        const char *name;
        double tolerance, iterations;
    } known[] = {
        {"cards", 1e-3, 92},        {"cards", 1e-4, 100},       {"cards", 1e-6, 115},
        {"stack of 10", 1e-3, 98},  {"stack of 10", 1e-4, 169}, {"stack of 10", 1e-6, 301},
        {"stack 100kg 1kg 10g", 1e-6, 124}, {"incline, below", 1e-6, 19},
        {"stack 10g 1kg 100kg", 1e-3, 721}, {"stack 10g 1kg 100kg", 1e-6, INFINITY},
    };
    for (size_t k = 0; k < sizeof known / sizeof *known; ++k) {
        double iterations = needed(table, known[k].name, "paper", known[k].tolerance), wanted = known[k].iterations;
        ck_assert_msg(isinf(wanted) ? isinf(iterations) : fabs(iterations - wanted) <= 2 + 0.01 * wanted,
                      "paper needs %g iterations on %s to %g, not %g", iterations, known[k].name, known[k].tolerance,
                      wanted);
    }
    /* The reason why there is a second method: light bodies that carry heavy ones. */
    ck_assert_double_lt(needed(table, "stack 10g 1kg 100kg", "fast", 1e-6), 200);
}

START_TEST(convergence_measures)
{
    static struct table table;
    static char out[MAX_TEXT];
    char arguments[256];
    int counts = 0, curves = 0, warm = 0;
    snprintf(arguments, sizeof arguments, "convergence --quick --csv %s", csv_path);
    int code = run(arguments, out);
    ck_assert_msg(code == 0, "exit code %d\n%s", code, out);
    ck_assert_msg(strstr(out, "iterations to 0.0001, paper / fast: geometric mean"), "%s", out);
    read_csv(csv_path, &table);
    for (int row = 0; row < table.rows; ++row) {
        double limit = 2000;
        ck_assert(*field(&table, row, "runs_on") && *field(&table, row, "commit"));
        ck_assert_str_eq(field(&table, row, "precision"), "f64");
        ck_assert(number(&table, row, "bodies") >= 1 && number(&table, row, "contacts") >= 4);
        if (is_row(&table, row, "count", NULL, NULL)) {
            bool reached = *field(&table, row, "iterations");
            ++counts;
            ck_assert_str_eq(field(&table, row, "status"), reached ? "ok" : "not reached");
            ck_assert(number(&table, row, "limit") == limit);
            if (!reached) continue;
            ck_assert(number(&table, row, "iterations") >= 1 && number(&table, row, "iterations") <= limit);
            ck_assert(number(&table, row, "ncp_balanced") <= number(&table, row, "tolerance"));
            ck_assert(number(&table, row, "ms") > 0);
        } else if (is_row(&table, row, "curve", NULL, NULL)) {
            ++curves;
            ck_assert(number(&table, row, "ncp_max") >= 0 && number(&table, row, "ncp_balanced") >= 0);
        } else {
            ++warm;
            ck_assert(is_row(&table, row, "warm", "incline", NULL));
            ck_assert_str_eq(field(&table, row, "status"), "ok");
            /* A block that sticks: solved from the first steps on, and nothing gains energy. */
            ck_assert(number(&table, row, "ncp_median") < 1e-9 && number(&table, row, "ncp_balanced") < 1e-6);
            ck_assert(number(&table, row, "energy_excess_m") >= 0 && number(&table, row, "energy_excess_m") < 1e-5);
        }
    }
    ck_assert_int_eq(counts, 8 * 2 * 3); /* problems, methods, tolerances */
    ck_assert_int_ge(curves, 8 * 2 * 10);
    ck_assert_int_eq(warm, 2 * 4);
    expect_known_counts(&table);
}
END_TEST

/* Where no ratio can be made, the table says so, and why. */
START_TEST(convergence_with_nothing_to_compare)
{
    static char out[MAX_TEXT];
    char arguments[256], path[64];
    snprintf(path, sizeof path, "/tmp/test_bench_%ld.json", (long)getpid());
    FILE *scene = fopen(path, "w");
    ck_assert_ptr_nonnull(scene);
    fputs("{\"format\": \"subadmm scene\", \"format_version\": 1, \"bodies\": [{\"density\": 1000, \"shapes\": ["
          "{\"type\": \"sphere\", \"size\": [0.1]}]}]}", /* nothing to touch */
          scene);
    ck_assert_int_eq(fclose(scene), 0);
    snprintf(arguments, sizeof arguments, "convergence '%s' --only warm --seconds 0.02", path);
    ck_assert_int_eq(run(arguments, out), 0);
    ck_assert_msg(strstr(out, "one of them above): nothing to compare, for no error is above 1e-6 m/s\n"), "%s", out);
    ck_assert_int_eq(run("convergence --only cold --limit 1 --problem cards", out), 0);
    ck_assert_msg(strstr(out, "- iterations to 0.001, paper / fast: nothing to compare, fast gets there in none\n"),
                  "%s", out);
    ck_assert_msg(strstr(out, "where both get there): nothing to compare, no problem is one that both get to\n"), "%s",
                  out);
    ck_assert_ptr_null(strstr(out, "geometric mean"));
    ck_assert_int_eq(run("convergence --only cold --limit 1 --problem cards --method fast", out), 0);
    ck_assert_msg(!strstr(out, "paper / fast"), "%s", out); /* of one method there is nothing to say */
    ck_assert_int_eq(remove(path), 0);
}
END_TEST

/* One problem by one method, with fewer iterations than it needs. */
START_TEST(convergence_of_one_problem)
{
    static struct table table;
    static char out[MAX_TEXT];
    char arguments[256];
    snprintf(arguments, sizeof arguments,
             "convergence --only cold --method paper --problem cards --limit 50 --precision f32 --csv %s", csv_path);
    ck_assert_int_eq(run(arguments, out), 0);
    ck_assert_msg(strstr(out, "> 50 / > 50 / > 50"), "%s", out);
    read_csv(csv_path, &table);
    ck_assert_int_eq(table.rows, 9 + 3); /* 1, 2, 3, 5, 7, 10, 20, 30, 50 iterations; three tolerances */
    for (int row = 0; row < table.rows; ++row) {
        ck_assert(is_row(&table, row, row < 9 ? "curve" : "count", "cards", "paper"));
        ck_assert_str_eq(field(&table, row, "precision"), "f32");
        ck_assert_str_eq(field(&table, row, "status"), row < 9 ? "ok" : "not reached");
    }
}
END_TEST

/* Curves against another method's solution: where the natural map is at rounding, velocities are that solution's.
 * 1e-10: a natural map of 1e-12 times the problem's condition, some tens. */
START_TEST(precision_against_a_reference)
{
    static struct table table;
    static char out[MAX_TEXT];
    char arguments[256];
    int exact = 0;
    snprintf(arguments, sizeof arguments, "precision --problem \"stack of 10\" --backend cpu --csv %s", csv_path);
    ck_assert_int_eq(run(arguments, out), 0);
    ck_assert_msg(strstr(out, "reference by Newton's method"), "%s", out);
    ck_assert_msg(strstr(out, "1e-08 m/s first: cpu f64 fast"), "%s", out);
    read_csv(csv_path, &table);
    for (int row = 0; row < table.rows; ++row) {
        if (strcmp(field(&table, row, "kind"), "curve") != 0) continue;
        const double map = number(&table, row, "ncp_balanced"), distance = number(&table, row, "distance");
        if (map > 1e-12) continue;
        ++exact;
        ck_assert_msg(distance < 1e-10, "natural map %g, distance %g", map, distance);
    }
    ck_assert_int_ge(exact, 2); /* paper and fast, in double */
}
END_TEST

/* Iterations after those that come to an error do not lose it again, in a heap where weights that change would. 1e-5
 * m/s: at 7,000 iterations it is 1e-6, and errors go up and down by some times that. */
START_TEST(precision_of_many_iterations)
{
    static struct table table;
    static char out[MAX_TEXT];
    char arguments[256];
    int late = 0;
    snprintf(arguments, sizeof arguments,
             "precision --quick --scene pile:200 --method fast --precision f64 --backend cpu --limit 20000 --csv %s",
             csv_path);
    ck_assert_int_eq(run(arguments, out), 0);
    read_csv(csv_path, &table);
    for (int row = 0; row < table.rows; ++row) {
        if (strcmp(field(&table, row, "kind"), "curve") != 0 || number(&table, row, "iterations") < 7000) continue;
        ++late;
        ck_assert_msg(number(&table, row, "ncp_balanced") < 1e-5, "%g iterations: %g m/s",
                      number(&table, row, "iterations"), number(&table, row, "ncp_balanced"));
    }
    ck_assert_int_eq(late, 3); /* 7,000, 10,000, 20,000 */
}
END_TEST

/* Every variation is measured; what only measures changes no bit, what solves differently does. */
START_TEST(ablation_measures)
{
    static struct table table;
    static char out[MAX_TEXT];
    char arguments[256];
    int same = 0, other = 0, added = 0;
    snprintf(arguments, sizeof arguments, "ablation --quick --csv %s", csv_path);
    const int code = run(arguments, out);
    ck_assert_msg(code == 0, "exit code %d\n%s", code, out);
    read_csv(csv_path, &table);
    for (int row = 0; row < table.rows; ++row) {
        const char *name = field(&table, row, "name"), *bits = field(&table, row, "same");
        const bool measures = !strcmp(name, "certificate") || !strcmp(name, "residuals") || !strcmp(name, "wrenches"),
                   solves = !strcmp(name, "half") || !strcmp(name, "method") || !strcmp(name, "precision");
        ck_assert(number(&table, row, "total_ms") > 0 && number(&table, row, "times") > 0);
        if (measures || row == 0) ck_assert_msg(!strcmp(bits, "yes"), "%s: %s", name, bits);
        if (solves) ck_assert_msg(!strcmp(bits, "no"), "%s: %s", name, bits);
        same += measures;
        other += solves;
        added += !*bits;
    }
    ck_assert(same == 3 && other == 3 && added >= 4);
}
END_TEST

static const struct {
    const char *arguments, *says;
} refused[] = {
    {"", "usage: subadmm-bench COMMAND"},
    {"fly", "unknown command \"fly\""},
    {"scaling --fly", "subadmm-bench scaling: unrecognized option '--fly'"},
    {"kernels --seconds", "subadmm-bench kernels: option '--seconds' requires an argument"},
    {"stand -x", "subadmm-bench stand: invalid option -- 'x'"},
    {"scaling --sizes 0", "--sizes 0: must be up to 16 numbers"},
    {"scaling --sizes 10,x", "--sizes 10,x: must be"},
    {"scaling --sizes 200,100", "--sizes 200,100: must be ascending"},
    {"scaling --scene incline", "incline takes no size"},
    {"scaling --scene pyramid --sizes 10,301", "N must be in [1, 300]"},
    {"scaling --threads 0", "--threads 0: must be"},
    {"scaling --backend gpu", "--backend gpu: must be ref, cpu, cuda or all"},
    {"scaling --precision f16", "--precision f16: must be f32, f64 or both"},
    {"scaling --steps 0", "--steps 0: must be in [1, 100000]"},
    {"scaling --warm-up -1", "--warm-up -1: must be"},
    {"scaling --max-seconds 0", "--max-seconds 0: must be in (0, 86400]"},
    {"scaling --max-seconds nan", "--max-seconds nan: must be"},
    {"scaling --device -1", "--device -1: must be"},
    {"scaling here", "scene = \"here:100\": must be one of"},
    {"scaling pyramid here", "unexpected argument \"here\""},
    {"scaling --scene pyramid here", "unexpected argument \"here\""},
    {"precision --scene moon", "moon"},
    {"profile --seconds 0", "--seconds 0: must be in (0, 3600]"},
    {"profile --fly", "unrecognized option '--fly'"},
    {"ablation --repeats 0", "--repeats 0: must be in [1, 1000]"},
    {"precision --limit 0", "--limit 0: must be in [1, 1000000]"},
    {"convergence --method slow", "--method slow: must be paper, fast or both"},
    {"convergence --only hot", "--only hot: must be cold or warm"},
    {"convergence --limit 0", "--limit 0: must be in [1, 1000000]"},
    {"convergence --budgets 5,0", "--budgets 5,0: must be"},
    {"convergence --scene nowhere", "must be one of"},
    {"convergence --seconds 0", "--seconds 0: must be in (0, 3600]"},
    {"joints", "--reference '': must be the folder of the tables"},
    {"queries there", "scene = \"there\": must be one of"},
    {"rows --scene there", "scene = \"there\": must be one of"},
    {"motion there", "scene = \"there\": must be one of"},
    {"convergence there", "scene = \"there\": must be one of"},
    {"kernels there", "unexpected argument \"there\""},
    {"stand --steps 0", "--steps 0: must be in [1, 10000000]"},
    {"stand --scene nowhere", "must be one of"},
    {"stand --dt 0", "--dt 0: must be in (0, 1]"},
    {"kernels --threads 0", "--threads 0: must be"},
    {"kernels --contacts 1,,2", "--contacts 1,,2: must be"},
    {"kernels --precision f16", "--precision f16: must be"},
    {"kernels --seconds 0", "--seconds 0: must be in (0, 600]"},
};

START_TEST(bad_options_are_refused)
{
    static char out[MAX_TEXT];
    int code = run(refused[_i].arguments, out);
    ck_assert_msg(code == 2 && strstr(out, refused[_i].says), "subadmm-bench %s: exit code %d\n%s",
                  refused[_i].arguments, code, out);
}
END_TEST

/* A block that must not creep stands; one sphere that bounces does not. */
START_TEST(stand_reports_what_stands)
{
    static char out[MAX_TEXT];
    ck_assert_msg(run("stand --scene incline --steps 50 --iterations 30 --threads 1", out) == 0 &&
                      strstr(out, "\nstands"), "%s", out);
    ck_assert_msg(run("stand --scene bounce --steps 50", out) == 1 && strstr(out, "\ndoes not stand"), "%s", out);
}
END_TEST

START_TEST(helps)
{
    static const struct {
        const char *arguments, *says;
    } asked[] = {
        {"-h", "usage: subadmm-bench COMMAND"},         {"--help", "usage: subadmm-bench COMMAND"},
        {"help", "usage: subadmm-bench COMMAND"},       {"help -h", "usage: subadmm-bench COMMAND"},
        {"help scaling", "usage: subadmm-bench scaling"}, {"kernels -h", "usage: subadmm-bench kernels"},
        {"--help stand", "usage: subadmm-bench stand"}, {"convergence --help", "usage: subadmm-bench convergence"},
    };
    static char out[MAX_TEXT];
    for (size_t k = 0; k < sizeof asked / sizeof *asked; ++k) {
        int code = run(asked[k].arguments, out);
        ck_assert_msg(code == 0 && strstr(out, asked[k].says), "subadmm-bench %s: exit code %d\n%s", asked[k].arguments,
                      code, out);
    }
    ck_assert_int_eq(run("help fly", out), 2);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("bench");
    TCase *cases = tcase_create("bench");
    tcase_set_timeout(cases, 60);
    tcase_add_checked_fixture(cases, make_csv, remove_csv);
    tcase_add_loop_test(cases, scaling_measures, 0, 2);
    tcase_add_test(cases, scaling_says_what_it_skips);
    tcase_add_test(cases, scaling_takes_a_file);
    tcase_add_test(cases, convergence_measures);
    tcase_add_test(cases, convergence_of_one_problem);
    tcase_add_test(cases, convergence_with_nothing_to_compare);
    tcase_add_test(cases, precision_against_a_reference);
    tcase_add_test(cases, precision_of_many_iterations);
    tcase_add_test(cases, ablation_measures);
    tcase_add_test(cases, stand_reports_what_stands);
    tcase_add_loop_test(cases, bad_options_are_refused, 0, sizeof refused / sizeof *refused);
    tcase_add_test(cases, helps);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
