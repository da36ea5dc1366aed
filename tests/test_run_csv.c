/* What `subadmm run` writes step by step: contacts and errors as CSV, and how many steps --seconds makes. */
#include <math.h>
#include <stdbool.h>

#include "commands.h"

enum { MOST_FIELDS = 20, MOST_ROWS = 4000 };

/* A table in memory: fields as they are but for their quotes. */
struct table {
    char *text, *fields[MOST_ROWS][MOST_FIELDS];
    int rows, columns;
};

static struct table table;

/* The rows of a file behind its header, which must be `header`. */
static void read_table(const char *path, const char *header)
{
    free(table.text);
    table.text = read_text(path);
    table.rows = 0;
    table.columns = 1;
    for (const char *c = header; *c; ++c) table.columns += *c == ',';
    char *at = strchr(table.text, '\n');
    ck_assert_ptr_nonnull(at);
    *at++ = 0;
    ck_assert_str_eq(table.text, header);
    while (*at) {
        ck_assert_int_lt(table.rows, MOST_ROWS);
        for (int k = 0; k < table.columns; ++k) {
            char *to = at, *from = at;
            table.fields[table.rows][k] = to;
            const bool quoted = *from == '"';
            for (from += quoted; quoted ? *from != '"' || from[1] == '"' : !strchr(",\n", *from); *to++ = *from++)
                from += quoted && *from == '"';
            from += quoted;
            ck_assert_msg(*from == (k + 1 < table.columns ? ',' : '\n'), "row %d, column %d of %s", table.rows, k,
                          path);
            at = from + 1;
            *to = 0;
        }
        ++table.rows;
    }
}

static double field(int row, int column)
{
    char *end;
    const char *text = table.fields[row][column];
    const double x = strtod(text, &end);
    ck_assert_msg(*text && !*end, "row %d, column %d: '%s' is no number", row, column, text);
    return x;
}

static double number(json_t *root, const char *object, const char *name)
{
    json_t *value = json_object_get(*object ? json_object_get(root, object) : root, name);
    ck_assert_msg(json_is_number(value), "%s.%s is no number", object, name);
    return json_number_value(value);
}

static void write_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    ck_assert(file && fputs(text, file) >= 0 && fclose(file) == 0);
}

#define CONTACT_HEADER "step,time,body_a,body_b,name_a,name_b,px,py,pz,nx,ny,nz,gap,fx,fy,fz"
#define ERROR_HEADER                                                                                                 \
    "step,time,error,error_kind,ncp_max,ncp_mean,momentum_max,siconos,iterations,iterations_mean,unsolved,contacts," \
    "step_ms"

/* A box of 2 kg that lies still on the ground, under a name that a CSV must quote. */
static const char resting[] =
    "{\"format\": \"subadmm scene\", \"format_version\": 1, \"duration\": 0.5, \"settings\": {\"dt\": 0.01},"
    " \"bodies\": [{\"type\": \"static\", \"shapes\": [{\"type\": \"plane\"}]},"
    "  {\"name\": \"a, \\\"b\\\"\\nc\", \"mass\": 2, \"inertia\": [0.01, 0.01, 0.01], \"position\": [0, 0, 0.1],"
    "   \"shapes\": [{\"type\": \"box\", \"size\": [0.1, 0.1, 0.1]}]}]}";

START_TEST(contacts_carry_the_weight)
{
    write_file("rest.json", resting);
    ck_assert_int_eq(sh("$S run rest.json --backend cpu --quiet --contacts-csv c.csv --error-csv e.csv"), 0);
    read_table("e.csv", ERROR_HEADER);
    ck_assert_int_eq(table.rows, 50);
    int counts[51] = {0}, found[51] = {0};
    for (int k = 0; k < table.rows; ++k) counts[k + 1] = (int)field(k, 11);
    read_table("c.csv", CONTACT_HEADER);
    ck_assert_int_eq(table.rows, 50 * 4); /* four corners of a face, in every step */
    double force[51][3] = {{0}};
    for (int row = 0; row < table.rows; ++row) {
        const int step = (int)field(row, 0);
        ck_assert(step >= 1 && step <= 50);
        ++found[step];
        ck_assert_double_eq_tol(field(row, 1), 0.01 * step, 1e-12); /* a sum of rounded steps */
        /* between the plane and the box, whichever is a: the force is on b, and the normal points to it */
        const bool box_is_b = (int)field(row, 3) == 1;
        ck_assert_int_eq((int)field(row, 2), box_is_b ? 0 : 1);
        ck_assert_int_eq((int)field(row, 3), box_is_b ? 1 : 0);
        ck_assert_str_eq(table.fields[row][box_is_b ? 5 : 4], "a, \"b\"\nc");
        ck_assert_str_eq(table.fields[row][box_is_b ? 4 : 5], "");
        for (int i = 0; i < 2; ++i) /* a corner of the box, which drifts by less than a tenth of a millimetre */
            ck_assert_double_eq_tol(fabs(field(row, 6 + i)), 0.1, 1e-4);
        ck_assert_double_eq_tol(field(row, 8), 0, 1e-3);
        ck_assert_double_eq_tol(field(row, 11), box_is_b ? 1 : -1, 1e-6);
        ck_assert_double_eq_tol(field(row, 12), 0, 1e-3);
        for (int i = 0; i < 3; ++i) force[step][i] += (box_is_b ? 1 : -1) * field(row, 13 + i);
    }
    for (int step = 1; step <= 50; ++step) {
        ck_assert_int_eq(found[step], counts[step]);
        /* m g, to within what the default number of iterations leaves of a step: a thousandth of the weight */
        ck_assert_double_eq_tol(force[step][2], 2 * 9.81, 0.02);
        ck_assert_double_eq_tol(force[step][0], 0, 0.02);
    }
}
END_TEST

START_TEST(errors_are_those_of_the_run)
{
    double most[4] = {0}, last = 0;
    ck_assert_int_eq(sh("$S run pyramid:3 --steps 12 --quiet --error-csv e.csv --json r.json"), 0);
    json_t *r = read_json("r.json");
    read_table("e.csv", ERROR_HEADER);
    ck_assert_int_eq(table.rows, 12);
    for (int row = 0; row < table.rows; ++row) {
        ck_assert_int_eq((int)field(row, 0), row + 1);
        ck_assert_double_gt(field(row, 1), last);
        last = field(row, 1);
        for (int k = 0; k < 4; ++k) most[k] = fmax(most[k], field(row, k == 0 ? 2 : k == 1 ? 4 : k == 2 ? 6 : 11));
        ck_assert_uint_gt(strlen(table.fields[row][3]), 0);
        ck_assert_double_le(field(row, 5), field(row, 4)); /* mean, max */
        ck_assert_double_eq(field(row, 8), number(r, "", "iterations"));
        ck_assert_double_eq(field(row, 9), field(row, 8));
        ck_assert_str_eq(table.fields[row][10], ""); /* there is no tolerance to miss */
        ck_assert_double_gt(field(row, 12), 0);
    }
    ck_assert_double_eq(most[0], number(r, "", "error_max"));
    ck_assert_double_eq(most[1], number(r, "certificate", "ncp_max_run"));
    ck_assert_double_eq(most[2], number(r, "certificate", "momentum_max_run"));
    ck_assert_double_eq(most[3], number(r, "contacts", "max"));
    ck_assert_double_eq_tol(last, number(r, "", "seconds"), 1e-12);
    json_decref(r);
    /* with one: how many islands missed it; the sum over steps is what the summary says */
    ck_assert_int_eq(sh("$S run pyramid:3 --steps 5 --tolerance 1e-12 --quiet --error-csv e.csv --json r.json"), 0);
    int unsolved = 0;
    read_table("e.csv", ERROR_HEADER);
    for (int row = 0; row < table.rows; ++row) unsolved += field(row, 10) > 0;
    r = read_json("r.json");
    ck_assert_int_eq(unsolved, (int)number(r, "stop", "steps_unsolved"));
    json_decref(r);
}
END_TEST

/* What is written changes nothing of the run. */
START_TEST(the_run_is_the_same)
{
    ck_assert_int_eq(sh("$S run pile:30 --steps 30 | grep -o 'hash.*' >without && "
                        "$S run pile:30 --steps 30 --contacts-csv c.csv --error-csv e.csv --trace t.csv | "
                        "grep -o 'hash.*' >with && test -s with && cmp with without"),
                     0);
    /* nothing but headers before the first step, and where nothing touches */
    ck_assert_int_eq(sh("$S run pile:30 --steps 0 --quiet --contacts-csv c.csv --error-csv e.csv"), 0);
    expect_text("c.csv", CONTACT_HEADER "\n");
    expect_text("e.csv", ERROR_HEADER "\n");
    ck_assert_int_eq(sh("$S run pile:30 --steps 2 --contacts-csv - 2>log.err | head -1 >c.csv"), 0);
    expect_text("c.csv", CONTACT_HEADER "\n");
}
END_TEST

/* ---- --seconds --------------------------------------------------------------------------------------------------- */

static const struct {
    const char *arguments;
    int steps;
} lengths[] = {
    {"--seconds 0.1 --dt 0.01", 10},
    {"--seconds 0.3 --dt 0.1", 3},      /* 0.3 / 0.1 is 2.9999999999999996 */
    {"--seconds 0.7 --dt 0.1", 7},      /* 6.999999999999999 */
    {"--seconds 0.06 --dt 0.002", 30},
    {"--seconds 0.1 --dt 0.003", 34},   /* rounded up */
    {"--seconds 0.1001 --dt 0.01", 11},
    {"--seconds 1e-9 --dt 0.01", 1},
    {"--seconds 0 --dt 0.01", 0},
    {"--seconds 0.1 --set dt=0.02", 5},
};
enum { LENGTHS = sizeof lengths / sizeof *lengths };

START_TEST(seconds_are_steps)
{
    ck_assert_int_eq(sh("$S run bounce %s --json r.json" LOGGED, lengths[_i].arguments), 0);
    json_t *r = read_json("r.json");
    ck_assert_int_eq((int)number(r, "", "steps"), lengths[_i].steps);
    ck_assert_double_eq_tol(number(r, "", "seconds"), lengths[_i].steps * number(r, "", "dt"), 1e-15);
    char said[64];
    snprintf(said, sizeof said, "steps          %d of %g s, %g s in all", lengths[_i].steps, number(r, "", "dt"),
             number(r, "", "seconds"));
    expect_in("log.out", said);
    json_decref(r);
}
END_TEST

static const struct {
    const char *arguments, *says;
} refused[] = {
    {"--seconds 1 --steps 5", "--steps 5 and --seconds 1: must be one of them"},
    {"--steps 5 --seconds 1", "--steps 5 and --seconds 1: must be one of them"},
    {"--seconds -1", "--seconds '-1': must be a number in [0, 1e+09]"},
    {"--seconds nan", "--seconds 'nan': must be a number in"},
    {"--seconds 2s", "--seconds '2s': must be a number in"},
    {"--seconds 1e9 --dt 1e-3", "--seconds 1e+09: are 1000000000000 steps of 0.001 s, must be 1000000000 at most"},
};
enum { REFUSED = sizeof refused / sizeof *refused };

START_TEST(seconds_are_refused)
{
    ck_assert_int_eq(sh("$S run bounce %s --trace t.csv" LOGGED, refused[_i].arguments), 2);
    expect_in("log.err", refused[_i].says);
    ck_assert_int_eq(files_here(), 0);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("run_csv");
    TCase *tests = tcase_create("run_csv");
    tcase_set_timeout(tests, 60);
    tcase_add_checked_fixture(tests, make_folder, remove_folder);
    tcase_add_test(tests, contacts_carry_the_weight);
    tcase_add_test(tests, errors_are_those_of_the_run);
    tcase_add_test(tests, the_run_is_the_same);
    tcase_add_loop_test(tests, seconds_are_steps, 0, LENGTHS);
    tcase_add_loop_test(tests, seconds_are_refused, 0, REFUSED);
    suite_add_tcase(suite, tests);
    return run_commands_suite(suite);
}
