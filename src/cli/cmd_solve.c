/* subadmm solve: one contact problem from a file, to a tolerance. */
#include <math.h>

#include "cli.h"
#include "core/base/settings_fields.h"
#include "fclib/fclib.h"
#include "fclib/global_problem.h"
#include "interrupt.h"
#include "solve_loop.h"

enum {
    OPTION_BACKEND, OPTION_PRECISION, OPTION_METHOD, OPTION_TOLERANCE, OPTION_MAX_ITERATIONS, OPTION_CHECK_PERIOD,
    OPTION_OFFSET,
    OPTION_MASS_FACTOR, OPTION_PENALTY_PERIOD, OPTION_THREADS, OPTION_SOLUTION, OPTION_JSON, OPTION_QUIET
};

static const struct cli_option options[] = {
    [OPTION_BACKEND] = {"backend", "NAME", "auto, ref, cpu or cuda (default auto)"},
    [OPTION_PRECISION] = {"precision", "P", "f32 or f64 (default f64)"},
    [OPTION_METHOD] = {"method", "NAME", "paper or fast (default fast)"},
    [OPTION_TOLERANCE] = {"tolerance", "T", "of siconos' measure (default 1e-8; f32: 1e-6)"},
    [OPTION_MAX_ITERATIONS] = {"max-iterations", "N", "give up after (default 100000)"},
    [OPTION_CHECK_PERIOD] = {"check-period", "N", "iterations between convergence checks (default 100)"},
    [OPTION_OFFSET] = {"penalty-offset", "KG", "paper: c of eq. (13), kg (default: tried from the mean mass)"},
    [OPTION_MASS_FACTOR] = {"penalty-mass-factor", "M", "paper: M of eq. (13) (default 0)"},
    [OPTION_PENALTY_PERIOD] = {"penalty-period", "N", "paper: iterations between updates, 0 = never (default 30)"},
    [OPTION_THREADS] = {"threads", "N", "CPU threads at most, 0 = as many as pay (default)"},
    [OPTION_SOLUTION] = {"solution", "FILE", "write a copy of the problem's file with this solution in it"},
    [OPTION_JSON] = {"json", "[FILE|-]", "write JSON to FILE, or to standard output (-, the default)"},
    [OPTION_QUIET] = {"quiet", NULL, "no table"},
};

struct solve_options {
    struct solve_plan plan;
    bool tolerance_given, quiet;
    const char *json, *solution;
    const char *penalty; /* the last option given that only the method paper has, or NULL */
};

static bool read_small_int(const char *option, const char *text, long lo, long hi, int *out)
{
    long value;
    if (!cli_read_int(option, text, lo, hi, &value)) return false;
    *out = (int)value;
    return true;
}

static int set_option(void *target, size_t index, const char *value)
{
    struct solve_options *o = target;
    sadmm_settings *s = &o->plan.settings;
    bool ok = true;
    if (index == OPTION_OFFSET || index == OPTION_MASS_FACTOR || index == OPTION_PENALTY_PERIOD)
        o->penalty = options[index].name;
    switch (index) {
    case OPTION_BACKEND: ok = cli_read_backend("--backend", value, &o->plan.backend); break;
    case OPTION_PRECISION: ok = cli_read_precision("--precision", value, &o->plan.precision); break;
    case OPTION_METHOD: ok = cli_read_method("--method", value, &s->method); break;
    case OPTION_TOLERANCE:
        ok = cli_read_real("--tolerance", value, 0, 1, &o->plan.tolerance);
        o->tolerance_given = true;
        break;
    case OPTION_MAX_ITERATIONS:
        ok = cli_read_int("--max-iterations", value, 1, 1000000000, &o->plan.max_iterations);
        break;
    case OPTION_CHECK_PERIOD: ok = read_small_int("--check-period", value, 1, 1000000, &o->plan.batch); break;
    case OPTION_OFFSET: ok = cli_read_real("--penalty-offset", value, 1e-12, 1e12, &o->plan.offset); break;
    case OPTION_MASS_FACTOR:
        ok = cli_read_real("--penalty-mass-factor", value, 0, 1e12, &s->penalty_mass_factor);
        break;
    case OPTION_PENALTY_PERIOD: ok = read_small_int("--penalty-period", value, 0, 1000000, &s->penalty_period); break;
    case OPTION_THREADS: ok = read_small_int("--threads", value, 0, 1024, &s->threads); break;
    case OPTION_SOLUTION: ok = cli_read_output("--solution", value, &o->solution); break;
    case OPTION_JSON: ok = cli_read_output("--json", value, &o->json); break;
    case OPTION_QUIET: o->quiet = true; break;
    }
    return ok ? CLI_DONE : CLI_USAGE;
}

/* ---- reports ----------------------------------------------------------------------------------------------------- */

static json_t *certificate_json(const sadmm_certificate *c)
{
    json_t *o = json_object();
    json_object_set_new(o, "siconos", cli_json_real(c->siconos));
    json_object_set_new(o, "ncp_max", cli_json_real(c->ncp_max));
    json_object_set_new(o, "ncp_mean", cli_json_real(c->ncp_mean));
    json_object_set_new(o, "ncp_worst", c->ncp_worst >= 0 ? json_integer(c->ncp_worst) : json_null());
    json_object_set_new(o, "momentum_max", cli_json_real(c->momentum_max));
    json_object_set_new(o, "momentum_worst", c->momentum_worst >= 0 ? json_integer(c->momentum_worst) : json_null());
    return o;
}

static json_t *triples_json(const double *x, int32_t count)
{
    json_t *array = json_array();
    for (int32_t k = 0; k < count; ++k) json_array_append_new(array, cli_json_reals(x + 3 * (size_t)k, 3));
    return array;
}

/* null where the method has no penalty. */
static json_t *penalty_json(const struct solve_options *o, const struct solve_outcome *out)
{
    if (o->plan.settings.method != SADMM_METHOD_PAPER) return json_null();
    json_t *penalty = json_object();
    json_object_set_new(penalty, "mass_factor", cli_json_real(o->plan.settings.penalty_mass_factor));
    json_object_set_new(penalty, "offset_kg", cli_json_real(out->offset));
    json_object_set_new(penalty, "offsets_tried", json_integer(out->offsets_tried));
    json_object_set_new(penalty, "period", json_integer(o->plan.settings.penalty_period));
    return penalty;
}

static json_t *outcome_json(const char *path, const struct solve_options *o, const struct solve_outcome *out,
                            const struct sadmm_global_solution *s)
{
    json_t *root = json_object();
    json_object_set_new(root, "file", json_string(path));
    json_object_set_new(root, "backend", json_string(cli_backend_name(out->report.backend)));
    json_object_set_new(root, "precision", json_string(cli_precision_name(out->report.precision)));
    json_object_set_new(root, "method", json_string(cli_method_name(o->plan.settings.method)));
    json_object_set_new(root, "bodies", json_integer(s->bodies));
    json_object_set_new(root, "contacts", json_integer(s->contacts));
    json_object_set_new(root, "hard_rows", json_integer(s->hard_rows));
    json_object_set_new(root, "converged", json_boolean(out->converged));
    json_object_set_new(root, "interrupted", json_boolean(interrupted() != 0));
    json_object_set_new(root, "tolerance", cli_json_real(o->plan.tolerance));
    json_object_set_new(root, "iterations", json_integer(out->iterations));
    json_object_set_new(root, "ms", cli_json_real(out->ms));
    json_object_set_new(root, "threads", json_integer(out->report.threads));
    json_object_set_new(root, "penalty", penalty_json(o, out));
    json_object_set_new(root, "certificate", certificate_json(&out->certificate));
    json_object_set_new(root, "u", triples_json(s->u, s->contacts));
    json_object_set_new(root, "r", triples_json(s->r, s->contacts));
    json_object_set_new(root, "v", cli_json_reals(s->v, 6 * (size_t)s->bodies));
    json_object_set_new(root, "l", cli_json_reals(s->l, (size_t)s->hard_rows));
    cli_json_add_build(root);
    json_object_set_new(root, "device", cli_json_device(out->report.backend));
    return root;
}

static void print_outcome(const char *path, const struct solve_options *o, const struct solve_outcome *out,
                          const struct sadmm_global_solution *s)
{
    const sadmm_certificate *c = &out->certificate;
    double closing = 0, sliding = 0, largest = 0;
    for (int32_t k = 0; k < s->contacts; ++k) {
        const double *u = s->u + 3 * (size_t)k, *r = s->r + 3 * (size_t)k;
        closing = fmin(closing, u[0]);
        sliding = fmax(sliding, hypot(u[1], u[2]));
        largest = fmax(largest, r[0]);
    }
    printf("problem        %s: %d bodies, %d contacts, %d bilateral rows\n", path, s->bodies, s->contacts,
           s->hard_rows);
    printf("backend        %s %s, %d thread%s\n", cli_backend_name(out->report.backend),
           cli_precision_name(out->report.precision), out->report.threads, out->report.threads == 1 ? "" : "s");
    printf("solve          %s after %ld iterations, %.3f ms (%s",
           out->converged  ? "converged"
           : interrupted() ? "interrupted"
                           : "NOT converged",
           out->iterations, out->ms, cli_method_name(o->plan.settings.method));
    if (o->plan.settings.method == SADMM_METHOD_PAPER)
        printf(", penalty offset %.3g kg, %d tried", out->offset, out->offsets_tried);
    printf(")\n");
    printf("siconos        %.3g (tolerance %g): the error as Siconos measures it\n", c->siconos, o->plan.tolerance);
    printf("certificate    ncp %.3g m/s at most, %.3g mean: distance of a contact or joint from its law\n"
           "               momentum %.3g: of a body, what impulses do not explain, over the largest\n",
           c->ncp_max, c->ncp_mean, c->momentum_max);
    printf("velocities u   closing %.3g m/s at most, sliding %.3g m/s at most\n", closing < 0 ? -closing : 0, sliding);
    printf("impulses r     normal %.3g N s at most\n", largest);
}

/* ---- the solve --------------------------------------------------------------------------------------------------- */

static int say_unsolved(const char *path, const struct solve_options *o, const struct solve_outcome *out)
{
    return cli_error(CLI_FAILED, "%s: not converged: siconos' measure is %.3g after %ld iterations, %g was asked for",
                     path, out->certificate.siconos, out->iterations, o->plan.tolerance);
}

static int solve_problem(sadmm_problem *problem, const char *path, const struct solve_options *o, struct output *json,
                         struct output *file)
{
    struct solve_outcome out;
    struct sadmm_global_solution solution;
    struct sadmm_error error = {0};
    bool table = !o->quiet && !outputs_on_stdout();
    if (solve_loop(problem, &o->plan, &out, &error) != SADMM_OK ||
        sadmm_global_solution_from_problem(problem, &solution, &error) != SADMM_OK)
        return cli_error(CLI_FAILED, "%s: %s", path, error.message);
    int code = out.converged ? CLI_DONE : say_unsolved(path, o, &out), written[2] = {CLI_DONE, CLI_DONE};
    if (table) print_outcome(path, o, &out, &solution);
    if (json) written[0] = cli_write_json(outcome_json(path, o, &out, &solution), json);
    if (file && sadmm_fclib_save_solution(problem, path, output_path(file), &error) != SADMM_OK)
        written[1] = cli_error(CLI_FAILED, "--solution %s: %s", o->solution, error.message);
    else written[1] = output_close(file);
    sadmm_global_solution_free(&solution);
    return code == CLI_DONE && (written[0] != CLI_DONE || written[1] != CLI_DONE) ? CLI_FAILED : code;
}

static int run(int argc, char **argv)
{
    struct solve_options o = {
        .plan = {.precision = SADMM_F64,
                 .settings = sadmm_settings_default(),
                 .max_iterations = 100000,
                 .batch = 100},
    };
    struct sadmm_error error = {0};
    sadmm_problem *problem = NULL;
    struct output *json, *file = NULL;
    const char *path;
    sadmm_settings_fix_work(&o.plan.settings); /* the loop looks at the certificate */
    o.plan.settings.dt = 1; /* the problem has no time step: offsets are in kg as they are */
    o.plan.settings.penalty_mass_factor = 0;
    int code = cli_parse(&cli_solve, argc, argv, set_option, &o, &path);
    if (code >= 0) return code;
    if (o.penalty && o.plan.settings.method != SADMM_METHOD_PAPER)
        return cli_error(CLI_USAGE, "--%s: takes --method paper, %s has no penalty", o.penalty,
                         cli_method_name(o.plan.settings.method));
    if (!o.tolerance_given) o.plan.tolerance = o.plan.precision == SADMM_F32 ? 1e-6 : 1e-8;
    interrupts_expect();
    outputs_protect(path);
    if ((code = cli_open_json(o.json, &json)) != CLI_DONE) return code;
    if (o.solution && (code = output_open("--solution", o.solution, OUTPUT_FILE, &file)) != CLI_DONE) return code;
    if (sadmm_fclib_load(path, &problem, &error) != SADMM_OK)
        return cli_error(CLI_FAILED, "%s: %s", path, error.message);
    code = solve_problem(problem, path, &o, json, file);
    sadmm_problem_destroy(problem);
    return code;
}

const struct cli_command cli_solve = {
    .name = "solve",
    .operands = "FILE.hdf5",
    .summary = "solve an FCLIB problem file to a tolerance",
    .text =
        "Reads a global 3D friction contact problem of rigid bodies (FCLIB's HDF5 layout) and solves it until\n"
        "siconos' error measure is below the tolerance. Single precision usually ends near 1e-7.\n",
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands_min = 1,
    .operands_max = 1,
    .run = run,
};
