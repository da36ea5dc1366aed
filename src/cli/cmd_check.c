/* subadmm check: do all backends and precisions of this machine compute what the literal one computes? */
#include <math.h>

#include "check_runs.h"
#include "cli.h"
#include "interrupt.h"
#include "open_scene.h"

enum { OPTION_STEPS, OPTION_METHOD, OPTION_ITERATIONS, OPTION_JSON, OPTION_QUIET };

static const struct cli_option options[] = {
    [OPTION_STEPS] = {"steps", "N", "steps to compare, in [1, 100000] (default 20)"},
    [OPTION_METHOD] = {"method", "NAME", "paper or fast (default fast)"},
    [OPTION_ITERATIONS] = {"iterations", "N", "iterations a step (default the scene's for the method)"},
    [OPTION_JSON] = {"json", "[FILE|-]", "write JSON to FILE, or to standard output (-, the default)"},
    [OPTION_QUIET] = {"quiet", NULL, "no table"},
};

struct check_options {
    long steps, iterations; /* iterations 0: the scene's */
    sadmm_method method;
    const char *json;
    bool quiet, method_given;
};

static int set_option(void *target, size_t index, const char *value)
{
    struct check_options *o = target;
    bool ok = true;
    switch (index) {
    case OPTION_STEPS: ok = cli_read_int("--steps", value, 1, 100000, &o->steps); break;
    case OPTION_METHOD:
        ok = cli_read_method("--method", value, &o->method);
        o->method_given = true;
        break;
    case OPTION_ITERATIONS: ok = cli_read_int("--iterations", value, 1, 1000000, &o->iterations); break;
    case OPTION_JSON: ok = cli_read_output("--json", value, &o->json); break;
    case OPTION_QUIET: o->quiet = true; break;
    }
    return ok ? CLI_DONE : CLI_USAGE;
}

/* ---- tolerances -------------------------------------------------------------------------------------------------- */

struct tolerances {
    double position, velocity, step_velocity, step_impulse, kernel_velocity, kernel_impulse;
    const char *reason;
};

#define AMPLIFIED "one step, the same amplified by the iterations; run, "
#define DOUBLING "of the speed, doubling in 2.5 steps"

/* Kernels: inputs rounded to the precision (6e-8, 1e-16), sums of some tens of terms, one product with (A + beta C)^-1.
 * One step: iterates are the same in exact arithmetic, so differences are rounding, amplified by the iterations;
 * measured on all scenes they stay below 3e-12 (f64) and 7e-5 (f32). Run: contact makes motion sensitive, and a
 * difference doubles in 2.5 steps on the worst scene (card_houses), so this one only finds gross mistakes, and only in
 * short runs. */
static struct tolerances tolerances_of(sadmm_precision precision, const struct check_reference *r)
{
    const bool single = precision == SADMM_F32, fast = r->scene->def.settings.method == SADMM_METHOD_FAST;
    double steps = (double)r->steps, speed = r->speed > 0 ? r->speed : 1;
    double share = fmin((single ? 1e-3 : 1e-8) * exp2(steps / 2.5), 1);
    return (struct tolerances){
        .position = share * speed * r->scene->def.settings.dt * steps,
        .velocity = share * speed,
        .step_velocity = single ? 1e-4 : 1e-10,
        .step_impulse = single ? 1e-3 : 1e-9,
        .kernel_velocity = !single ? 1e-12 : fast ? 1e-4 : 1e-5,
        .kernel_impulse = single ? 1e-5 : 1e-12,
        .reason = !single ? "f64: kernels, 1e-16 of rounding in sums of tens of terms; " AMPLIFIED "1e-8 " DOUBLING
                  : fast  ? "f32: kernels, 6e-8 of rounding in sums of tens of terms, in velocities times the weight "
                            "of a constraint over a body's mass; " AMPLIFIED "1e-3 " DOUBLING
                          : "f32: kernels, 6e-8 of rounding in sums of tens of terms; " AMPLIFIED "1e-3 " DOUBLING,
    };
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

enum verdict { AGREES, DISAGREES, FAILED, SKIPPED };
static const char *const verdict_names[] = {"agrees", "DISAGREES", "FAILED", "skipped"};

struct row {
    sadmm_backend backend;
    sadmm_precision precision;
    enum verdict verdict;
    struct check_difference difference;
    struct tolerances tolerances;
    char note[SADMM_MESSAGE_SIZE]; /* why it was skipped or failed */
};

enum { MOST_ROWS = 2 * SADMM_BACKEND_COUNT };

static bool within(const struct check_difference *d, const struct tolerances *t)
{
    return d->position <= t->position && d->velocity <= t->velocity && d->step_velocity <= t->step_velocity &&
           d->step_impulse <= t->step_impulse && d->kernel_velocity <= t->kernel_velocity &&
           d->kernel_impulse <= t->kernel_impulse;
}

static void compare(const struct check_reference *r, struct row *row)
{
    struct sadmm_error error = {0};
    sadmm_backend_info info;
    if (sadmm_backend_query(row->backend, &info) != SADMM_OK || !info.available[row->precision]) {
        row->verdict = SKIPPED;
        snprintf(row->note, sizeof row->note, "%s", info.reason);
        return;
    }
    row->tolerances = tolerances_of(row->precision, r);
    bool compared = check_table(r, row->backend, row->precision, &row->difference, &error);
    if (interrupted()) { /* the reference, too, may be that of fewer steps */
        row->verdict = SKIPPED;
        snprintf(row->note, sizeof row->note, "interrupted");
    } else if (!compared) {
        row->verdict = FAILED;
        snprintf(row->note, sizeof row->note, "%s", error.message);
    } else {
        row->verdict = within(&row->difference, &row->tolerances) ? AGREES : DISAGREES;
    }
}

/* ---- reports ----------------------------------------------------------------------------------------------------- */

static size_t count_rows(const struct row *rows, size_t count, enum verdict verdict)
{
    size_t n = 0;
    for (size_t k = 0; k < count; ++k) n += rows[k].verdict == verdict;
    return n;
}

static void print_rows(const char *spec, const struct check_reference *r, const struct row *rows, size_t count)
{
    const char *reasons[2] = {NULL, NULL};
    const sadmm_settings *settings = &r->scene->def.settings;
    printf("%s, %ld steps, %s, %d iterations; largest difference from ref f64 (<= tolerance)\n\n", spec, r->steps,
           cli_method_name(settings->method), settings->iterations);
    printf("%-10s %-21s %-21s %-21s %-21s %-21s %-21s\n", "", "run: position, m", "run: velocity, m/s",
           "one step: velocity", "one step: impulse", "kernels: velocity", "kernels: impulse");
    for (size_t k = 0; k < count; ++k) {
        const struct row *row = &rows[k];
        const struct check_difference *d = &row->difference;
        const struct tolerances *t = &row->tolerances;
        printf("%-5s%-5s ", cli_backend_name(row->backend), cli_precision_name(row->precision));
        if (row->verdict == SKIPPED || row->verdict == FAILED) {
            printf("%s: %s\n", verdict_names[row->verdict], row->note);
            continue;
        }
        reasons[row->precision] = t->reason;
        const double shown[][2] = {{d->position, t->position},           {d->velocity, t->velocity},
                                   {d->step_velocity, t->step_velocity}, {d->step_impulse, t->step_impulse},
                                   {d->kernel_velocity, t->kernel_velocity}, {d->kernel_impulse, t->kernel_impulse}};
        for (size_t i = 0; i < sizeof shown / sizeof *shown; ++i) printf("%-9.2e (%-8.1e)  ", shown[i][0], shown[i][1]);
        printf("%s\n", verdict_names[row->verdict]);
    }
    printf("\n");
    for (int p = SADMM_F32; p <= SADMM_F64; ++p)
        if (reasons[p]) printf("%s\n", reasons[p]);
    printf("one step: problems of steps");
    for (size_t k = 0; k < r->frozen_count; ++k) printf(" %ld", r->frozen[k].step);
    printf(
        " frozen, differences relative to the largest velocity and impulse; kernels: the same after one iteration\n");
    printf("%zu agree, %zu disagree, %zu failed, %zu skipped\n", count_rows(rows, count, AGREES),
           count_rows(rows, count, DISAGREES), count_rows(rows, count, FAILED), count_rows(rows, count, SKIPPED));
}

static void set_pair(json_t *o, const char *name, double difference, double tolerance)
{
    json_t *pair = json_object();
    json_object_set_new(pair, "difference", cli_json_real(difference));
    json_object_set_new(pair, "tolerance", cli_json_real(tolerance));
    json_object_set_new(o, name, pair);
}

static json_t *row_json(const struct row *row)
{
    json_t *o = json_object();
    bool measured = row->verdict == AGREES || row->verdict == DISAGREES;
    json_object_set_new(o, "backend", json_string(cli_backend_name(row->backend)));
    json_object_set_new(o, "precision", json_string(cli_precision_name(row->precision)));
    json_object_set_new(o, "verdict", json_string(verdict_names[row->verdict]));
    json_object_set_new(o, "note", *row->note ? json_string(row->note) : json_null());
    if (!measured) return o;
    set_pair(o, "run_position", row->difference.position, row->tolerances.position);
    set_pair(o, "run_velocity", row->difference.velocity, row->tolerances.velocity);
    set_pair(o, "step_velocity", row->difference.step_velocity, row->tolerances.step_velocity);
    set_pair(o, "step_impulse", row->difference.step_impulse, row->tolerances.step_impulse);
    set_pair(o, "kernel_velocity", row->difference.kernel_velocity, row->tolerances.kernel_velocity);
    set_pair(o, "kernel_impulse", row->difference.kernel_impulse, row->tolerances.kernel_impulse);
    json_object_set_new(o, "tolerance_reason", json_string(row->tolerances.reason));
    return o;
}

static json_t *rows_json(const char *spec, const struct check_reference *r, const struct row *rows, size_t count)
{
    json_t *root = json_object(), *array = json_array(), *frozen = json_array();
    for (size_t k = 0; k < count; ++k) json_array_append_new(array, row_json(&rows[k]));
    for (size_t k = 0; k < r->frozen_count; ++k) json_array_append_new(frozen, json_integer(r->frozen[k].step));
    json_object_set_new(root, "scene", json_string(spec));
    json_object_set_new(root, "steps", json_integer(r->steps));
    json_object_set_new(root, "method", json_string(cli_method_name(r->scene->def.settings.method)));
    json_object_set_new(root, "iterations", json_integer(r->scene->def.settings.iterations));
    json_object_set_new(root, "frozen_steps", frozen);
    json_object_set_new(root, "agree", json_integer((json_int_t)count_rows(rows, count, AGREES)));
    json_object_set_new(root, "disagree", json_integer((json_int_t)count_rows(rows, count, DISAGREES)));
    json_object_set_new(root, "failed", json_integer((json_int_t)count_rows(rows, count, FAILED)));
    json_object_set_new(root, "skipped", json_integer((json_int_t)count_rows(rows, count, SKIPPED)));
    json_object_set_new(root, "interrupted", json_boolean(interrupted() != 0));
    json_object_set_new(root, "tables", array);
    cli_json_add_build(root);
    return root;
}

/* ---- the command ------------------------------------------------------------------------------------------------- */

static int check_scene(const struct check_options *o, const char *spec, const struct sadmm_scene *scene,
                       struct output *json)
{
    struct check_reference reference;
    struct sadmm_error error = {0};
    struct row rows[MOST_ROWS];
    size_t count = 0;
    bool table = !o->quiet && !outputs_on_stdout();
    if (!check_reference_make(&reference, scene, o->steps, &error))
        return cli_error(CLI_FAILED, "%s with ref: %s", spec, error.message);
    for (int backend = SADMM_BACKEND_REF; backend < SADMM_BACKEND_COUNT; ++backend)
        for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision) {
            if (backend == SADMM_BACKEND_REF && precision == SADMM_F64) continue; /* what is compared with */
            rows[count] = (struct row){.backend = (sadmm_backend)backend, .precision = (sadmm_precision)precision};
            compare(&reference, &rows[count++]);
        }
    bool ok = count_rows(rows, count, DISAGREES) + count_rows(rows, count, FAILED) == 0;
    int code = ok ? CLI_DONE : CLI_FAILED;
    if (table) print_rows(spec, &reference, rows, count);
    if (json) {
        int written = cli_write_json(rows_json(spec, &reference, rows, count), json);
        if (code == CLI_DONE) code = written;
    }
    check_reference_free(&reference);
    return code;
}

static int run(int argc, char **argv)
{
    struct check_options o = {.steps = 20};
    struct sadmm_scene scene;
    struct output *json;
    const char *spec;
    int code = cli_parse(&cli_check, argc, argv, set_option, &o, &spec);
    if (code >= 0) return code;
    if ((code = cli_open_scene(spec, &scene)) != CLI_DONE) return code;
    if (o.method_given) sadmm_scene_set_method(&scene, o.method);
    if (o.iterations > 0) scene.def.settings.iterations = (int)o.iterations;
    scene.def.settings.hits = 0; /* what is compared is the solve */
    interrupts_expect();
    cli_protect_scene(spec);
    code = cli_open_json(o.json, &json);
    if (code == CLI_DONE) code = check_scene(&o, spec, &scene, json);
    sadmm_scene_close(&scene);
    return code;
}

const struct cli_command cli_check = {
    .name = "check",
    .operands = "SCENE",
    .summary = "compare every backend and precision with the literal one on a scene",
    .text =
        "Run: each table simulates the scene on its own. One step: contact problems of the literal run are frozen and\n"
        "solved by each table with equal iterations. Kernels: the same with one. Hits are left to the solve "
        "(settings.hits = 0).\n"
        "Exit status 1 when a difference exceeds its tolerance.\n",
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands_min = 1,
    .operands_max = 1,
    .run = run,
};
