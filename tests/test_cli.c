/* The `subadmm` command as its users see it: exit codes, messages, JSON. What it does with files: test_outputs.c.
 * One file: all subcommands are run, and their JSON is read, by the same functions. */
#include <check.h>
#include <jansson.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "config.h"
#include "text_file.h"
#ifdef SADMM_HAVE_HDF5
#include <hdf5.h>
#endif

/* ---- running it -------------------------------------------------------------------------------------------------- */

static const char command[] = SUBADMM_COMMAND; /* the build gives its path */
static char folder[64];

static void make_folder(void)
{
    strcpy(folder, "/tmp/test_cli_XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
}

static void remove_folder(void)
{
    char text[128];
    snprintf(text, sizeof text, "rm -rf %s", folder);
    ck_assert_int_eq(system(text), 0);
}

static char *read_text(const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return read_text_if_there(path);
}

static char *out, *err; /* of the last run */

/* Run with these arguments in the temporary folder; returns the exit code (128 + n: killed by signal n). */
static int run(const char *arguments)
{
    char text[2048];
    free(out);
    free(err);
    snprintf(text, sizeof text, "cd %s && %s %s >out 2>err </dev/null", folder, command, arguments);
    int status = system(text);
    out = read_text("out");
    err = read_text("err");
    ck_assert_msg(out && err, "%s: could not be run", text);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

#define MUST(arguments, code)                                                                                   \
    do {                                                                                                        \
        int got = run(arguments);                                                                               \
        ck_assert_msg(got == (code), "subadmm %s: exit code %d, expected %d\n%s%s", arguments, got, code, out, err); \
    } while (0)

static json_t *parse(const char *text)
{
    json_error_t error;
    json_t *root = json_loads(text, 0, &error);
    ck_assert_msg(root != NULL, "line %d: %s\n%.400s", error.line, error.text, text);
    return root;
}

static json_t *run_json(const char *arguments)
{
    MUST(arguments, 0);
    return parse(out);
}

/* "a.b.c" of nested objects; NULL when it is not there. */
static json_t *at(json_t *root, const char *path)
{
    char key[64];
    while (root && *path) {
        size_t length = strcspn(path, ".");
        memcpy(key, path, length);
        key[length] = 0;
        root = json_object_get(root, key);
        path += length + (path[length] == '.');
    }
    return root;
}

static double number(json_t *root, const char *path)
{
    json_t *value = at(root, path);
    ck_assert_msg(json_is_number(value), "%s is not a number", path);
    return json_number_value(value);
}

static const char *string(json_t *root, const char *path)
{
    json_t *value = at(root, path);
    ck_assert_msg(json_is_string(value), "%s is not a string", path);
    return json_string_value(value);
}

/* ---- usage ------------------------------------------------------------------------------------------------------- */

static const struct {
    const char *arguments;
    int code;
    const char *says; /* on stderr for code > 0, else on stdout */
} usages[] = {
    {"", 2, "usage: subadmm COMMAND"},
    {"--help", 0, "exit status: 0 done; 1"},
    {"-h", 0, "usage: subadmm COMMAND"},
    {"help", 0, "usage: subadmm COMMAND"},
    {"help help", 0, "usage: subadmm COMMAND"},
    {"help run", 0, "--dump-problem STEP:FILE"},
    {"--help solve", 0, "--tolerance"},
    {"run -h", 0, "--dump-problem STEP:FILE"},
    {"run incline -h", 0, "--dump-problem STEP:FILE"},
    {"backends -h", 0, "usage: subadmm backends"},
    {"help fly", 2, "unknown command 'fly'; valid: scenes"},
    {"--version", 0, "subadmm "},
    {"fly", 2, "unknown command 'fly'; valid: scenes backends settings run check solve help --help --version"},
    {"--fly", 2, "unknown option '--fly'"},
    {"run --help", 0, "--dump-problem STEP:FILE"},
    {"check --help", 0, "Exit status 1 when"},
    {"solve --help", 0, "--tolerance"},
    {"scenes --help", 0, "--json"},
    {"backends --help", 0, "--json"},
    {"run", 2, "SCENE is missing"},
    {"run incline bounce", 2, "unexpected argument 'bounce'"},
    {"run nonsense", 2, "pyramid"},
    {"run robot.urdf", 1,
     "robot.urdf: is a robot's file, which the Python package reads: \"python -m subadmm convert robot.urdf robot.j"},
    {"run ./a.b/robot.XML", 1, "convert ./a.b/robot.XML ./a.b/robot.json\" makes a scene file of it"},
    {"check robot.usda", 1, "\"python -m subadmm view robot.usda\" shows it run"},
    {"scenes robot.mjcf", 1, "robot.mjcf: is a robot's file"},
    {"run pyramid:0", 2, "[1, 300]"},
    {"run pyramid:x", 2, "[1, 300]"},
    {"scenes nonsense --json", 2, "pyramid"},
    {"check nonsense", 2, "pyramid"},
    {"run incline --fly", 2, "unknown option '--fly'; valid: --backend"},
    {"run incline -x", 2, "unknown option '-x'; valid: --backend"},
    {"run incline --steps", 2, "'--steps' needs a value, N"},
    {"run incline --quiet=yes", 2, "'--quiet=yes' takes no value"},
    {"run incline --backend gpu", 2, "must be auto, ref, cpu"},
    {"run incline --device -1", 2, "must be an integer in [0, 1023]"},
    {"run incline --precision double", 2, "must be f32 or f64"},
    {"run incline --steps 1e3", 2, "must be an integer in [0, 1000000000]"},
    {"run incline --steps -1", 2, "must be an integer in"},
    {"run incline --steps ' 5'", 2, "must be an integer in"},
    {"run incline --steps ''", 2, "must be an integer in"},
    {"run incline --steps 99999999999999999999", 2, "must be an integer in"},
    {"run incline --dt 0", 2, "must be a number in [1e-06, 1]"},
    {"run incline --dt nan", 2, "must be a number in"},
    {"run incline --dt 0.01s", 2, "must be a number in"},
    {"run incline --substeps 0", 2, "--substeps '0': must be an integer in [1, 64]"},
    {"run incline --substeps 65", 2, "must be an integer in [1, 64]"},
    {"run incline --dt 1e-6 --substeps 2", 1, "settings.dt / settings.substeps = 1e-06 / 2: must be >= 1e-06"},
    {"run incline --iterations 0", 2, "must be an integer in [1, 1000000]"},
    {"run incline --penalty-period -1", 2, "must be an integer in [0, 1000000]"},
    {"run incline --penalty-period 5", 2, "--penalty-period 5: takes --method paper"},
    {"run incline --method slow", 2, "--method 'slow': must be paper or fast"},
    {"solve x --penalty-offset 5 --method fast", 2, "--penalty-offset: takes --method paper"},
    {"solve x --penalty-mass-factor 5", 2, "--penalty-mass-factor: takes --method paper"},
    {"solve x --penalty-period 5", 2, "--penalty-period: takes --method paper"},
    {"run incline --set slip=1", 2, "--set 'slip=1': must be NAME=VALUE; subadmm settings lists the names"},
    {"run incline --set slop", 2, "--set 'slop': must be NAME=VALUE"},
    {"run incline --set hits=1.5", 2, "--set hits '1.5': must be an integer"},
    {"run incline --set slop=x", 2, "--set slop 'x': must be a number"},
    {"run incline --set certify=1", 2, "--set certify '1': must be true or false"},
    {"run incline --set gravity=0,0", 2, "--set gravity '0,0': must be three numbers"},
    {"run incline --set method=slow", 2, "--set method 'slow': must be paper or fast"},
    {"run incline --set slop=2", 1, "settings.slop = 2: must be in [0, 1]"},
    {"settings", 0, "relaxation                      1.8        [1, 2) "},
    {"settings --json", 0, "\"exclusiveMaximum\": 2"},
    {"run incline --threads 2000", 2, "must be an integer in [0, 1024]"},
    {"run incline --dump-problem x.hdf5", 2, "must be STEP:FILE"},
    {"run incline --dump-problem 0:x.hdf5", 2, "must be an integer in [1,"},
    {"run incline --steps 3 --dump-problem 4:x.hdf5", 2, "must be in [1, 3]"},
    {"check incline --steps 0", 2, "must be an integer in [1, 100000]"},
    {"solve", 2, "FILE.hdf5 is missing"},
    {"solve x --tolerance -1", 2, "must be a number in [0, 1]"},
    {"solve missing.hdf5", 1, "missing.hdf5"},
    {"run incline --precision f32 --backend ref --steps 1", 1, "double"},
};
enum { USAGE_COUNT = sizeof usages / sizeof *usages };

/* A device that no machine has: said where there is a GPU backend, of no interest to the CPU. */
START_TEST(device_is_handed_on)
{
    MUST("run incline --backend cpu --device 1000 --steps 1", 0);
    MUST("run incline --backend cuda --device 1000 --steps 1", 1);
    ck_assert_msg(strstr(err, "1000") || strstr(err, "is not available"), "%s", err);
}
END_TEST

START_TEST(exit_codes_and_messages)
{
    MUST(usages[_i].arguments, usages[_i].code);
    const char *text = usages[_i].code ? err : out;
    ck_assert_msg(strstr(text, usages[_i].says) != NULL, "subadmm %s: '%s' does not say '%s'", usages[_i].arguments,
                  text, usages[_i].says);
    if (usages[_i].code == 0) ck_assert_str_eq(err, "");
    if (usages[_i].code == 2) ck_assert_str_eq(out, "");
}
END_TEST

/* ---- run --------------------------------------------------------------------------------------------------------- */

static void expect_phase(json_t *root, const char *phase)
{
    char path[64];
    snprintf(path, sizeof path, "ms_per_step.%s.median", phase);
    double median = number(root, path);
    snprintf(path, sizeof path, "ms_per_step.%s.p95", phase);
    ck_assert_double_ge(median, 0);
    ck_assert_double_ge(number(root, path), median);
}

START_TEST(run_reports)
{
    json_t *r = run_json("run pyramid:3 --steps 12 --backend cpu --threads 1 --iterations 70 --certify --json -");
    ck_assert_str_eq(err, "");
    ck_assert_str_eq(string(r, "scene"), "pyramid:3");
    ck_assert_str_eq(string(r, "backend"), "cpu");
    ck_assert_str_eq(string(r, "method"), "fast");
    ck_assert_double_eq(number(r, "bodies"), 6);
    ck_assert_double_eq(number(r, "joints"), 0);
    ck_assert_double_eq(number(r, "steps"), 12);
    ck_assert_double_eq(number(r, "iterations"), 70);
    ck_assert_double_eq(number(r, "threads"), 1);
    ck_assert_double_gt(number(r, "dt"), 0);
    /* six boxes on each other and on the ground: 9 faces of at least 3 points */
    ck_assert_double_ge(number(r, "contacts.mean"), 27);
    ck_assert_double_ge(number(r, "contacts.max"), number(r, "contacts.mean"));
    static const char *const phases[] = {"total", "collide", "assemble", "solve", "finish"};
    for (size_t k = 0; k < 5; ++k) expect_phase(r, phases[k]);
    ck_assert_double_ge(number(r, "residual.primal"), 0);
    ck_assert_double_ge(number(r, "residual.dual"), 0);
    ck_assert_double_ge(number(r, "certificate.ncp_max"), number(r, "certificate.ncp_mean"));
    ck_assert_double_ge(number(r, "certificate.ncp_max_run"), number(r, "certificate.ncp_max"));
    ck_assert_double_ge(number(r, "certificate.momentum_max_run"), number(r, "certificate.momentum_max"));
    ck_assert_double_eq(number(r, "limited_steps"), 0); /* it stands */
    ck_assert_double_ge(number(r, "penetration_max"), 0);
    ck_assert_double_ge(number(r, "speed_max_final"), 0);
    /* it stands: what moves, moves less than the 5 % of a box that a collapse takes at once */
    ck_assert_double_lt(number(r, "displacement_max"), 0.01);
    ck_assert_uint_eq(strlen(string(r, "state_hash")), 16);
    ck_assert_uint_eq(strspn(string(r, "state_hash"), "0123456789abcdef"), 16);
    ck_assert(json_is_true(at(r, "finite")));
    ck_assert(json_is_null(at(r, "error")));
    ck_assert_uint_gt(strlen(string(r, "commit")), 0);
    ck_assert_uint_gt(strlen(string(r, "compiler")), 0);
    ck_assert_uint_gt(strlen(string(r, "device")), 0);
    json_decref(r);
}
END_TEST

/* What was not measured is null. */
START_TEST(run_reports_null)
{
    json_t *r = run_json("run pyramid:2 --steps 2 --json");
    ck_assert(json_is_null(at(r, "certificate")));
    ck_assert(json_is_null(at(r, "scene_result"))); /* it measures none */
    ck_assert(json_is_number(at(r, "residual.primal")));
    json_decref(r);
    r = run_json("run pyramid:2 --steps 0 --certify --json=-");
    static const char *const unknown[] = {"contacts.mean", "contacts.max", "ms_per_step.total",
                                          "residual",      "certificate",  "penetration_max", "limited_steps",
                                          "joint_drift",
                                          "backend",       "threads",      "device"};
    for (size_t k = 0; k < sizeof unknown / sizeof *unknown; ++k)
        ck_assert_msg(json_is_null(at(r, unknown[k])), "%s is not null", unknown[k]);
    ck_assert_double_eq(number(r, "displacement_max"), 0);
    ck_assert_double_eq(number(r, "steps"), 0);
    json_decref(r);
}
END_TEST

START_TEST(run_prints)
{
    MUST("run pyramid:2 --steps 3 --certify --explain", 0);
    static const char *const parts[] = {"pyramid:2, 3 dynamic bodies", "ms per step", "certificate", "hash", "weights",
                                        "20 iterations a step (fast)"};
    for (size_t k = 0; k < sizeof parts / sizeof *parts; ++k)
        ck_assert_msg(strstr(out, parts[k]) != NULL, "no '%s' in\n%s", parts[k], out);
    MUST("run pyramid:2 --steps 3 --explain --method paper", 0);
    ck_assert_ptr_nonnull(strstr(out, "penalty"));
    ck_assert_ptr_nonnull(strstr(out, "100 iterations a step (paper)"));
    MUST("run pyramid:2 --steps 3 --quiet", 0);
    ck_assert_str_eq(out, "");
    ck_assert_str_eq(err, ""); /* no progress line where nobody watches */
    /* --explain stays out of the JSON */
    json_decref(run_json("run pyramid:2 --steps 3 --explain --json"));
    ck_assert_ptr_nonnull(strstr(err, "weights"));
    /* to a file: the table is still printed */
    MUST("run pyramid:2 --steps 3 --json r.json", 0);
    ck_assert_ptr_nonnull(strstr(out, "ms per step"));
    char *text = read_text("r.json");
    json_decref(parse(text));
    free(text);
}
END_TEST

/* What a scene measures of its own success, on the way and at the end. */
START_TEST(run_reports_the_scenes_result)
{
    for (int whole = 0; whole < 2; ++whole) {
        json_t *r = run_json(whole ? "run grippers:2 --json" : "run grippers:2 --steps 10 --json");
        json_t *tasks = at(r, "scene_result.tasks"), *task = json_array_get(tasks, 0), *figure;
        ck_assert_uint_eq(json_array_size(tasks), 1);
        ck_assert_str_eq(string(task, "name"), "hold");
        ck_assert(json_boolean_value(at(r, "scene_result.passed")) == whole);
        ck_assert(json_boolean_value(at(task, "passed")) == whole);
        ck_assert(json_boolean_value(at(task, "finished")) == whole);
        figure = json_array_get(at(task, "figures"), 1);
        ck_assert_str_eq(string(figure, "name"), "lifted");
        ck_assert_str_eq(string(figure, "unit"), "m");
        ck_assert((number(figure, "value") > 0.1) == whole);
        json_decref(r);
    }
    MUST("run grippers:2 --steps 10", 0);
    ck_assert_msg(strstr(out, "result         hold           not finished: held 0"), "%s", out);
    MUST("run grippers:2", 0);
    ck_assert_msg(strstr(out, "passed: held 2, lifted 0.19"), "%s", out);
    MUST("run pyramid:2 --steps 3", 0);
    ck_assert_ptr_null(strstr(out, "result"));
}
END_TEST

/* Who stopped when; nothing without a tolerance. */
START_TEST(run_stops)
{
    json_t *r = run_json("run pyramid:3 --steps 12 --backend cpu --iterations 70 --json -");
    ck_assert(json_is_null(at(r, "stop")));
    json_decref(r);
    r = run_json(
        "run pyramid:3 --steps 12 --backend cpu --iterations 70 --tolerance 1e-6 --check-period 7 --certify --json -");
    ck_assert_double_eq(number(r, "stop.tolerance"), 1e-6);
    ck_assert_double_eq(number(r, "stop.steps_met"), 12); /* it stands, from initialised impulses */
    ck_assert_double_le(number(r, "certificate.ncp_max_run"), 1e-6);
    ck_assert_double_ge(number(r, "stop.iterations_mean"), 7);
    ck_assert_double_lt(number(r, "stop.iterations_mean"), 70);
    ck_assert_double_eq(fmod(number(r, "stop.iterations_last"), 7), 0);
    ck_assert_double_eq(number(r, "stop.unsolved_last"), 0);
    json_decref(r);
    r = run_json("run pyramid:3 --steps 3 --backend cpu --method paper --iterations 2 --tolerance 1e-12 --json -");
    ck_assert_double_eq(number(r, "stop.steps_met"), 0);
    ck_assert_double_eq(number(r, "stop.iterations_mean"), 2);
    ck_assert_double_eq(number(r, "stop.unsolved_last"), 1);
    json_decref(r);
    MUST("run pyramid:3 --steps 3 --backend cpu --tolerance 1e-6", 0);
    ck_assert_msg(strstr(out, "tolerance      1e-06 m/s met in 3 steps of 3") != NULL, "%s", out);
    MUST("run pyramid:3 --steps 1 --tolerance -1", 2);
    MUST("run pyramid:3 --steps 1 --tolerance 1e-6 --check-period 0", 2);
}
END_TEST

/* Duration / dt steps when none are asked for. */
START_TEST(run_default_steps)
{
    json_t *scene = run_json("scenes bounce --json -");
    double duration = number(scene, "duration"), dt = number(scene, "settings.dt");
    json_t *r = run_json("run bounce --threads 1 --json -");
    ck_assert_double_eq(number(r, "steps"), round(duration / dt));
    json_decref(r);
    r = run_json("run bounce --dt 0.01 --threads 1 --json -");
    ck_assert_double_eq(number(r, "steps"), round(duration / 0.01));
    ck_assert_double_eq(number(r, "dt"), 0.01);
    json_decref(r);
    json_decref(scene);
}
END_TEST

static void hash_of(const char *arguments, char hash[17])
{
    json_t *r = run_json(arguments);
    snprintf(hash, 17, "%s", string(r, "state_hash"));
    json_decref(r);
}

/* The hash is of the state: equal for any number of threads and from run to run, different for different states. */
START_TEST(same_hash)
{
    static const char *const scenes[] = {"pyramid:6", "sliding_cubes:500"}; /* the second has work for two threads */
    static const char *const precisions[] = {"f32", "f64"};
    char text[256], hash[4][17];
    const char *scene = scenes[_i / 2], *precision = precisions[_i % 2];
    const char *const variants[] = {"--steps 20 --threads 1", "--steps 20 --threads 2", "--steps 20 --threads 2",
                                    "--steps 19 --threads 1"};
    for (int k = 0; k < 4; ++k) {
        snprintf(text, sizeof text, "run %s --backend cpu --precision %s %s --json -", scene, precision, variants[k]);
        hash_of(text, hash[k]);
    }
    ck_assert_str_eq(hash[0], hash[1]);
    ck_assert_str_eq(hash[0], hash[2]);
    ck_assert_str_ne(hash[0], hash[3]);
    /* measuring changes nothing */
    snprintf(text, sizeof text, "run %s --backend cpu --precision %s --steps 20 --certify --trace t.csv --json -",
             scene, precision);
    hash_of(text, hash[3]);
    ck_assert_str_eq(hash[0], hash[3]);
}
END_TEST

/* The sanitizers' own memory does not fit under a limit. */
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

/* 64 stacks of 8 MB do not fit: fewer threads run, and nobody ends the process. */
START_TEST(threads_that_cannot_be_made)
{
    static const char arguments[] = "run %s --steps 30 --backend cpu --threads %d --json -";
    static const char *const scenes[] = {"pile:150", "sliding_cubes:500"};
    char text[256], limited[512], wanted[17];
    snprintf(text, sizeof text, arguments, scenes[_i], 1);
    hash_of(text, wanted);
    snprintf(text, sizeof text, arguments, scenes[_i], 64);
    snprintf(limited, sizeof limited, "cd %s && ulimit -s 8192 && ulimit -v 400000 && %s %s >out 2>err", folder,
             command, text);
    ck_assert_int_eq(system(limited), 0);
    free(out);
    out = read_text("out");
    json_t *r = parse(out);
    ck_assert_str_eq(string(r, "state_hash"), wanted);
    ck_assert(number(r, "threads") < 64);
    json_decref(r);
}
END_TEST

#endif

/* A scene's iterations are those of the method; what is asked for goes first. */
START_TEST(iterations_follow_the_method)
{
    static const struct {
        const char *options, *method, *iterations; /* NULL: as asked for */
    } cases[] = {
        {"", "fast", "iterations.fast"},
        {"--method fast", "fast", "iterations.fast"},
        {"--method paper", "paper", "iterations.paper"},
        {"--iterations 7", "fast", NULL},
        {"--iterations 7 --method paper", "paper", NULL},
    };
    static const char *const scenes[] = {"vertical_stacks:1", "card_houses:1", "incline"};
    char text[256];
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; ++s) {
        snprintf(text, sizeof text, "scenes %s --json -", scenes[s]);
        json_t *scene = run_json(text);
        ck_assert_double_gt(number(scene, "iterations.paper"), number(scene, "iterations.fast"));
        ck_assert_double_eq(number(scene, "settings.iterations"), number(scene, "iterations.fast"));
        for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
            snprintf(text, sizeof text, "run %s --steps 1 %s --json -", scenes[s], cases[k].options);
            json_t *r = run_json(text);
            ck_assert_str_eq(string(r, "method"), cases[k].method);
            ck_assert_double_eq(number(r, "iterations"),
                                cases[k].iterations ? number(scene, cases[k].iterations) : 7);
            json_decref(r);
        }
        json_decref(scene);
    }
}
END_TEST

/* Options reach the simulation. */
START_TEST(options_matter)
{
    static const char *const others[] = {"--iterations 40", "--no-warm-start", "--dt 0.004", "--precision f32",
                                         "--method paper"};
    char text[256], hash[17], other[17];
    hash_of("run pile:20 --backend cpu --precision f64 --steps 100 --iterations 41 --json -", hash);
    for (size_t k = 0; k < sizeof others / sizeof *others; ++k) {
        snprintf(text, sizeof text, "run pile:20 --backend cpu --precision f64 --steps 100 --iterations 41 %s --json -",
                 others[k]);
        hash_of(text, other);
        ck_assert_msg(strcmp(hash, other) != 0, "%s changed nothing", others[k]);
    }
    hash_of("run pile:20 --backend cpu --precision f64 --steps 100 --set iterations=41 --set dt=0.005 --json -", other);
    ck_assert_str_eq(hash, other);
    hash_of("run pile:20 --backend cpu --steps 100 --set correction_factor=0.3 --set gravity=0,1,-5 --json -", other);
    ck_assert_str_ne(hash, other);
    hash_of("run pile:20 --backend cpu --steps 100 --no-warm-start --method paper --penalty-period 10 --json -", hash);
    hash_of("run pile:20 --backend cpu --steps 100 --no-warm-start --method paper --penalty-period 0 --json -", other);
    ck_assert_str_ne(hash, other);
    json_t *r = run_json("run pile:5 --backend ref --steps 1 --json -");
    ck_assert_str_eq(string(r, "backend"), "ref");
    json_decref(r);
}
END_TEST

START_TEST(traces)
{
    MUST("run pyramid:2 --steps 4 --quiet --trace t.csv", 0);
    json_t *scene = run_json("scenes pyramid:2 --json -"), *bodies = at(scene, "bodies");
    char *text = read_text("t.csv"), *line = strtok(text, "\n");
    int rows = 0;
    ck_assert_str_eq(line, "step,time,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz");
    for (; (line = strtok(NULL, "\n")); ++rows) {
        double x[13], time;
        int step, body, end = 0;
        ck_assert_int_eq(sscanf(line, "%d,%lf,%d,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf%n", &step, &time,
                                &body, x, x + 1, x + 2, x + 3, x + 4, x + 5, x + 6, x + 7, x + 8, x + 9, x + 10, x + 11,
                                x + 12, &end),
                         16);
        ck_assert_uint_eq(strlen(line), (size_t)end);
        ck_assert_int_eq(step, rows / 3);
        ck_assert_double_le(fabs(time - step * number(scene, "settings.dt")), 1e-12);
        json_t *about = json_array_get(bodies, (size_t)body);
        ck_assert_str_eq(string(about, "type"), "dynamic");
        /* the first rows are the scene's definition, digit for digit */
        for (size_t i = 0; step == 0 && i < 3; ++i)
            ck_assert_double_eq(x[i], json_number_value(json_array_get(at(about, "position"), i)));
    }
    ck_assert_int_eq(rows, 5 * 3);
    free(text);
    json_decref(scene);
}
END_TEST

/* ---- scenes and backends ----------------------------------------------------------------------------------------- */

static double length(json_t *array)
{
    double sum = 0;
    size_t k;
    json_t *x;
    json_array_foreach(array, k, x) sum += json_number_value(x) * json_number_value(x);
    return sqrt(sum);
}

/* hulls, meshes: how many there are to refer to. */
static void expect_body(json_t *body, size_t index, size_t hulls, size_t meshes)
{
    ck_assert_double_eq(number(body, "index"), (double)index);
    bool dynamic = strcmp(string(body, "type"), "dynamic") == 0;
    ck_assert_uint_eq(json_array_size(at(body, "position")), 3);
    ck_assert_uint_eq(json_array_size(at(body, "linear_velocity")), 3);
    ck_assert_uint_eq(json_array_size(at(body, "angular_velocity")), 3);
    ck_assert_double_eq_tol(length(at(body, "orientation")), 1, 1e-12);
    if (dynamic) ck_assert_double_gt(number(body, "mass"), 0);
    else ck_assert(json_is_null(at(body, "mass")));
    ck_assert_uint_eq(json_array_size(at(body, "inertia")), dynamic ? 3 : 0);
    json_t *shapes = at(body, "shapes"), *shape;
    size_t k;
    json_array_foreach(shapes, k, shape) {
        const char *type = string(shape, "type");
        size_t sizes = !strcmp(type, "box") ? 3 : !strcmp(type, "capsule") ? 2 : !strcmp(type, "sphere") ? 1 : 0;
        ck_assert(sizes > 0 || !strcmp(type, "plane") || !strcmp(type, "hull") || !strcmp(type, "mesh"));
        if (!strcmp(type, "hull"))
            ck_assert(number(shape, "hull") >= 0 && number(shape, "hull") < (double)hulls);
        else ck_assert_ptr_null(json_object_get(shape, "hull"));
        if (!strcmp(type, "mesh")) ck_assert(number(shape, "mesh") >= 0 && number(shape, "mesh") < (double)meshes);
        else ck_assert_ptr_null(json_object_get(shape, "mesh"));
        ck_assert_uint_eq(json_array_size(at(shape, "size")), sizes);
        ck_assert_double_ge(number(shape, "friction"), 0);
        ck_assert_double_ge(number(shape, "restitution"), 0);
        ck_assert_uint_eq(json_array_size(at(shape, "position")), 3);
        ck_assert_double_eq_tol(length(at(shape, "orientation")), 1, 1e-12);
    }
}

/* Of triangles, or of heights: whole, and nothing else. */
static void expect_mesh(json_t *mesh)
{
    json_t *vertices = json_object_get(mesh, "vertices"), *row, *x;
    size_t i, k, columns = 0;
    ck_assert_uint_eq(json_object_size(mesh), 2);
    if (vertices) {
        ck_assert_uint_ge(json_array_size(at(mesh, "triangles")), 1);
        json_array_foreach(vertices, i, row) ck_assert_uint_eq(json_array_size(row), 3);
        json_array_foreach(at(mesh, "triangles"), i, row) {
            ck_assert_uint_eq(json_array_size(row), 3);
            json_array_foreach(row, k, x)
                ck_assert(json_is_integer(x) && json_integer_value(x) >= 0 &&
                          json_integer_value(x) < (json_int_t)json_array_size(vertices));
        }
        return;
    }
    ck_assert_uint_eq(json_array_size(at(mesh, "spacing")), 2);
    ck_assert_uint_ge(json_array_size(at(mesh, "heights")), 2);
    json_array_foreach(at(mesh, "heights"), i, row) {
        if (i == 0) columns = json_array_size(row);
        ck_assert(columns >= 2 && json_array_size(row) == columns);
        json_array_foreach(row, k, x) ck_assert(json_is_number(x));
    }
}

/* What is on bodies and between them, with every number that a definition has. */
static void expect_joints(json_t *scene)
{
    static const char *const gains[] = {"linear_stiffness", "linear_damping", "angular_stiffness", "angular_damping"};
    const double bodies = (double)json_array_size(at(scene, "bodies"));
    json_t *joints = at(scene, "joints"), *couplings = at(scene, "couplings"), *gears = at(scene, "gears"), *o;
    size_t k;
    ck_assert(json_is_array(joints) && json_is_array(couplings) && json_is_array(gears));
    json_array_foreach(joints, k, o) {
        json_t *coordinates = at(o, "coordinates"), *coordinate;
        size_t i;
        ck_assert_uint_eq(json_array_size(coordinates), 6);
        json_array_foreach(coordinates, i, coordinate) {
            json_t *table = at(coordinate, "spring_table");
            ck_assert(json_is_null(table) ||
                      json_array_size(at(table, "positions")) == json_array_size(at(table, "forces")));
            ck_assert_double_ge(number(coordinate, "spring_stiffness"), 0);
        }
    }
    json_array_foreach(couplings, k, o) {
        ck_assert(number(o, "body") >= 0 && number(o, "body") < bodies);
        ck_assert_double_eq_tol(length(at(o, "orientation")), 1, 1e-12);
        ck_assert_double_eq_tol(length(at(o, "target_orientation")), 1, 1e-12);
        ck_assert_uint_eq(json_array_size(at(o, "target_velocity")), 6);
        for (size_t i = 0; i < 4; ++i) ck_assert_double_ge(number(o, gains[i]), 0);
    }
    json_array_foreach(gears, k, o) {
        ck_assert(number(o, "joint_1") >= 0 && number(o, "joint_2") < (double)json_array_size(joints));
        ck_assert(number(o, "ratio") != 0 && isfinite(number(o, "offset")));
    }
}

/* Every scene, at a small size, is reported completely, and has the bodies and joints that a run of it has. */
#ifdef SADMM_HAVE_QHULL
static const bool have_hulls = true;
#else
static const bool have_hulls = false;
#endif

static bool needs_hulls(const char *scene)
{
    static const char *const scenes[] = {"arch", "dry_stone", "mesh_pile", "peg_in_hole", "terrain", "nuts_and_bolts"};
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; ++k)
        if (!strcmp(scene, scenes[k])) return true;
    return false;
}

START_TEST(scenes_are_reported)
{
    json_t *list = run_json("scenes --json"), *info;
    size_t k, i;
    ck_assert_uint_gt(json_array_size(list), 4);
    MUST("scenes", 0);
    char *table = strdup(out);
    json_array_foreach(list, k, info) {
        char text[256], spec[128];
        const char *name = string(info, "name");
        ck_assert_ptr_nonnull(strstr(table, name));
        if (needs_hulls(name) && !have_hulls) continue;
        /* an arch has three stones at least, a peg 10 um of play */
        const char *size = !strcmp(name, "arch") || !strcmp(name, "peg_in_hole") ? ":20" : ":2";
        snprintf(spec, sizeof spec, "%s%s", name, *string(info, "arguments") ? size : "");
        snprintf(text, sizeof text, "scenes %s --json -", spec);
        json_t *scene = run_json(text), *bodies = at(scene, "bodies"), *hulls = at(scene, "hulls"), *body, *hull;
        json_t *meshes = at(scene, "meshes"), *mesh;
        double dynamic = 0;
        json_array_foreach(hulls, i, hull) {
            ck_assert_uint_ge(json_array_size(at(hull, "points")), 4);
            ck_assert(number(hull, "convex_radius") >= 0 && number(hull, "merge") >= 0);
        }
        json_array_foreach(meshes, i, mesh) expect_mesh(mesh);
        json_array_foreach(bodies, i, body) {
            expect_body(body, i, json_array_size(hulls), json_array_size(meshes));
            dynamic += strcmp(string(body, "type"), "dynamic") == 0;
        }
        ck_assert_double_gt(number(scene, "duration"), 0);
        ck_assert_double_gt(number(scene, "settings.iterations"), 0);
        ck_assert_uint_eq(json_array_size(at(scene, "settings.gravity")), 3);
        snprintf(text, sizeof text, "run %s --steps 1 --json -", spec);
        json_t *r = run_json(text);
        ck_assert_double_eq(number(r, "bodies"), dynamic);
        expect_joints(scene);
        ck_assert_double_le(number(r, "joints"), (double)json_array_size(at(scene, "joints")));
        ck_assert_double_le(number(r, "couplings"), (double)json_array_size(at(scene, "couplings")));
        json_decref(r);
        json_decref(scene);
    }
    free(table);
    json_decref(list);
}
END_TEST

/* A mesh that several bodies have is reported once; one of two has a number of its own. */
START_TEST(meshes_are_reported_once)
{
    json_t *track = run_json("scenes marble_run --json -"), *bodies = at(track, "bodies");
    ck_assert_uint_eq(json_array_size(at(track, "meshes")), 2);
    for (size_t k = 0; k < 2; ++k)
        ck_assert_double_eq(number(json_array_get(at(json_array_get(bodies, k), "shapes"), 0), "mesh"), (double)k);
    /* the funnel: three rings of eight vertices; the cone is whole, the wall open at the track's end */
    json_t *funnel = json_array_get(at(track, "meshes"), 1);
    ck_assert_uint_eq(json_array_size(at(funnel, "vertices")), 3 * 8);
    ck_assert_uint_eq(json_array_size(at(funnel, "triangles")), 2 * 8 + 2 * 7);
    json_decref(track);
    if (!have_hulls) return;
    json_t *nuts = run_json("scenes nuts_and_bolts:3 --json -");
    ck_assert_uint_eq(json_array_size(at(nuts, "meshes")), 1);
    for (size_t k = 1; k <= 3; ++k)
        ck_assert_double_eq(
            number(json_array_get(at(json_array_get(at(nuts, "bodies"), k), "shapes"), 0), "mesh"), 0);
    json_decref(nuts);
    json_t *hills = run_json("scenes terrain:2 --json -"), *ground = json_array_get(at(hills, "meshes"), 0);
    ck_assert_double_eq(json_number_value(json_array_get(at(ground, "spacing"), 1)), 0.08);
    json_decref(hills);
}
END_TEST

START_TEST(backends_are_reported)
{
    static const char *const names[] = {"ref", "cpu", "cuda"};
    json_t *r = run_json("backends --json"), *backends = at(r, "backends"), *b;
    size_t k;
    ck_assert_uint_eq(json_array_size(backends), 3);
    json_array_foreach(backends, k, b) {
        ck_assert_str_eq(string(b, "name"), names[k]);
        ck_assert(json_is_boolean(at(b, "f32")) && json_is_boolean(at(b, "f64")));
        ck_assert_uint_gt(strlen(string(b, "reason")), 0);
        /* what is not available says so when it is asked for */
        if (!json_is_true(at(b, "f64"))) {
            char text[128];
            snprintf(text, sizeof text, "run incline --steps 1 --precision f64 --backend %s", names[k]);
            MUST(text, 1);
            ck_assert_ptr_nonnull(strstr(err, string(b, "reason")));
        }
    }
    ck_assert(json_is_true(at(json_array_get(backends, 0), "f64")));
    ck_assert(json_is_true(at(json_array_get(backends, 1), "f32")));
    ck_assert(json_is_true(at(json_array_get(backends, 1), "f64")));
    MUST("backends", 0);
    for (k = 0; k < 3; ++k) ck_assert_ptr_nonnull(strstr(out, names[k]));
    json_decref(r);
}
END_TEST

/* ---- check and solve --------------------------------------------------------------------------------------------- */

START_TEST(backends_agree)
{
    static const char *const scenes[] = {"pyramid:3", "vertical_stacks:1", "bounce"};
    char text[128];
    const char *scene = scenes[_i / 2], *method = _i % 2 ? "paper" : "fast";
    snprintf(text, sizeof text, "check %s%s --steps 10 --json -", scene, _i % 2 ? " --method paper" : "");
    json_t *r = run_json(text), *tables = at(r, "tables"), *t;
    double counted[4] = {0};
    static const char *const verdicts[] = {"agrees", "DISAGREES", "FAILED", "skipped"};
    static const char *const counts[] = {"agree", "disagree", "failed", "skipped"};
    size_t k;
    ck_assert_str_eq(string(r, "method"), method);
    ck_assert_uint_eq(json_array_size(tables), 5); /* {ref, cpu, cuda} x {f32, f64} without ref f64 itself */
    json_array_foreach(tables, k, t) {
        for (int v = 0; v < 4; ++v) counted[v] += strcmp(string(t, "verdict"), verdicts[v]) == 0;
        if (strcmp(string(t, "verdict"), "skipped") == 0) ck_assert_uint_gt(strlen(string(t, "note")), 0);
        else ck_assert_double_le(number(t, "step_velocity.difference"), number(t, "step_velocity.tolerance"));
    }
    for (int v = 0; v < 4; ++v) ck_assert_double_eq(number(r, counts[v]), counted[v]);
    ck_assert_double_ge(counted[0], 2); /* cpu f32 and f64 are always there */
    ck_assert_uint_eq(json_array_size(at(r, "frozen_steps")), 5);
    ck_assert_double_eq(json_number_value(json_array_get(at(r, "frozen_steps"), 4)), 10);
    json_decref(r);
    snprintf(text, sizeof text, "check %s --method %s --steps 1", scene, method);
    MUST(text, 0);
    ck_assert_ptr_nonnull(strstr(out, "0 disagree, 0 failed"));
}
END_TEST

#ifdef SADMM_HAVE_HDF5
START_TEST(dumps_and_solves)
{
    MUST("run pyramid:3 --steps 8 --quiet --dump-problem 5:p.hdf5", 0);
    json_t *r = run_json("solve p.hdf5 --backend cpu --threads 1 --solution s.hdf5 --json -");
    ck_assert(json_is_true(at(r, "converged")));
    ck_assert_double_eq(number(r, "bodies"), 6);
    ck_assert_double_gt(number(r, "contacts"), 0);
    ck_assert_uint_eq(json_array_size(at(r, "u")), (size_t)number(r, "contacts"));
    ck_assert_uint_eq(json_array_size(json_array_get(at(r, "u"), 0)), 3);
    ck_assert_double_le(number(r, "certificate.siconos"), 1e-8);
    ck_assert_double_ge(number(r, "certificate.ncp_max"), 0);
    ck_assert_double_gt(number(r, "iterations"), 0);
    ck_assert_double_gt(number(r, "ms"), 0);
    ck_assert_str_eq(string(r, "method"), "fast");
    ck_assert(json_is_null(at(r, "penalty")));
    json_decref(r);
    /* the copy holds the same problem: the same numbers come out; the other method leads to the same v */
    r = run_json("solve p.hdf5 --backend ref --tolerance 1e-11 --json -");
    json_t *copy = run_json("solve s.hdf5 --backend ref --tolerance 1e-11 --json -");
    ck_assert(json_equal(at(r, "v"), at(copy, "v")));
    json_decref(copy);
    json_t *other =
        run_json("solve p.hdf5 --tolerance 1e-11 --method paper --penalty-offset 5 --penalty-period 0 --json -");
    size_t k;
    json_t *v;
    /* unique velocities, both at 1e-11 of siconos' measure, of a step with dt g = 0.05 m/s */
    json_array_foreach(at(r, "v"), k, v)
        ck_assert_double_le(fabs(json_number_value(v) - json_number_value(json_array_get(at(other, "v"), k))), 1e-8);
    ck_assert_double_eq(number(other, "penalty.offset_kg"), 5);
    json_decref(other);
    json_decref(r);
    static const char *const single[] = {"solve p.hdf5 --precision f32", "solve p.hdf5 --precision f32 --method paper"};
    for (k = 0; k < 2; ++k) {
        MUST(single[k], 0);
        ck_assert_ptr_nonnull(strstr(out, "converged"));
    }
}
END_TEST

/* Change one number of a problem file. */
static void poke(const char *name, const char *dataset, size_t at, double value)
{
    char path[128];
    double data[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT), set = H5Dopen2(file, dataset, H5P_DEFAULT);
    hid_t space = H5Dget_space(set);
    ck_assert_int_lt((long)H5Sget_simple_extent_npoints(space), (long)(sizeof data / sizeof *data));
    ck_assert_int_ge(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), 0);
    data[at] = value;
    ck_assert_int_ge(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), 0);
    H5Sclose(space);
    H5Dclose(set);
    H5Fclose(file);
}

/* What is not a number is refused by its place; numbers that overflow are never called a solution, by no method and in
 * no table. */
START_TEST(solve_wants_numbers)
{
    static const char *const datasets[] = {"M/x", "H/x", "vectors/f", "vectors/w", "vectors/mu"};
    static const double values[] = {NAN, INFINITY, -INFINITY};
    static const char *const options[] = {"", "--method paper --max-iterations 1000", "--quiet --json -"};
    char text[160], name[64];
    MUST("run pyramid:3 --steps 2 --quiet --dump-problem 2:good.hdf5", 0);
    for (size_t k = 0; k < 5; ++k)
        for (size_t v = 0; v < 3; ++v) {
            snprintf(text, sizeof text, "cp %s/good.hdf5 %s/p.hdf5", folder, folder);
            ck_assert_int_eq(system(text), 0);
            snprintf(name, sizeof name, "/fclib_global/%s", datasets[k]);
            poke("p.hdf5", name, 5, values[v]);
            MUST("solve p.hdf5", 1);
            ck_assert_str_eq(out, "");
            snprintf(text, sizeof text, "p.hdf5: %s: value 5 is %g: must be finite", name, values[v]);
            ck_assert_msg(strstr(err, text) != NULL, "'%s' does not say '%s'", err, text);
        }
    snprintf(text, sizeof text, "cp %s/good.hdf5 %s/p.hdf5", folder, folder);
    ck_assert_int_eq(system(text), 0);
    poke("p.hdf5", "/fclib_global/H/x", 5, 1e308);
    for (size_t k = 0; k < 3; ++k) {
        snprintf(text, sizeof text, "solve p.hdf5 %s", options[k]);
        MUST(text, 1);
        ck_assert_msg(!strstr(out, "nan") && !strstr(err, "nan"), "%s\n%s", out, err);
        ck_assert_msg(!strstr(out, "          converged") && !strstr(out, "\"converged\": true"), "%s", out);
        ck_assert_ptr_nonnull(strstr(err, "p.hdf5: "));
    }
}
END_TEST

START_TEST(solve_fails_loudly)
{
    MUST("run pyramid:3 --steps 2 --quiet --dump-problem 2:p.hdf5", 0);
    MUST("solve p.hdf5 --max-iterations 3 --tolerance 1e-14 --json r.json", 1);
    ck_assert_ptr_nonnull(strstr(err, "not converged"));
    char *text = read_text("r.json");
    json_t *r = parse(text);
    ck_assert(json_is_false(at(r, "converged")));
    ck_assert_double_eq(number(r, "iterations"), 3);
    ck_assert_double_gt(number(r, "certificate.siconos"), 1e-14);
    json_decref(r);
    free(text);
    MUST("solve out", 1); /* its own last output: not HDF5 */
    ck_assert_ptr_nonnull(strstr(err, "cannot open as HDF5"));
    MUST("run pyramid:3 --steps 2 --quiet --dump-problem 2:/no/such/folder/p.hdf5", 1);
}
END_TEST
#else
START_TEST(says_what_is_missing)
{
    MUST("solve p.hdf5", 1);
    ck_assert_ptr_nonnull(strstr(err, "built without"));
    MUST("run pyramid:3 --steps 2 --dump-problem 2:p.hdf5", 1);
    ck_assert_ptr_nonnull(strstr(err, "built without"));
}
END_TEST
#endif

int main(void)
{
    Suite *suite = suite_create("cli");
    TCase *tests = tcase_create("command");
    tcase_set_timeout(tests, 120);
    tcase_add_checked_fixture(tests, make_folder, remove_folder);
    tcase_add_test(tests, device_is_handed_on);
    tcase_add_loop_test(tests, exit_codes_and_messages, 0, USAGE_COUNT);
    tcase_add_test(tests, run_reports);
    tcase_add_test(tests, run_reports_null);
    tcase_add_test(tests, run_prints);
    tcase_add_test(tests, run_stops);
    tcase_add_test(tests, run_reports_the_scenes_result);
    tcase_add_test(tests, run_default_steps);
    tcase_add_loop_test(tests, same_hash, 0, 4);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    tcase_add_loop_test(tests, threads_that_cannot_be_made, 0, 2);
#endif
    tcase_add_test(tests, iterations_follow_the_method);
    tcase_add_test(tests, options_matter);
    tcase_add_test(tests, traces);
    tcase_add_test(tests, scenes_are_reported);
    tcase_add_test(tests, meshes_are_reported_once);
    tcase_add_test(tests, backends_are_reported);
    tcase_add_loop_test(tests, backends_agree, 0, 6);
#ifdef SADMM_HAVE_HDF5
    tcase_add_test(tests, dumps_and_solves);
    tcase_add_test(tests, solve_fails_loudly);
    tcase_add_test(tests, solve_wants_numbers);
#else
    tcase_add_test(tests, says_what_is_missing);
#endif
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_ENV);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
