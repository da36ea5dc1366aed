/* subadmm-bench ablation: what each thing costs that a step does or leaves out, and what it gives: time and error with
 * and without it. Either a setting is the other way round, or something is added that the scene does not need, far
 * away: one joint, one kinematic body, one body of another kind. */
#include <math.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/base/settings_fields.h"
#include "scene_timing.h"

static const char command[] = "ablation";

struct options {
    int backend, precision, method;
    const char *scenes[BENCH_LIST];
    int scene_count;
    long steps, warm_up, repeats, threads;
    const char *only, *csv;
    bool quick;
};

/* ---- what can be the other way round --------------------------------------------------------------------------- */

static void certificate(sadmm_world_def *def) { def->settings.certify = !def->settings.certify; }
static void wrenches(sadmm_world_def *def) { def->settings.recover_wrenches = !def->settings.recover_wrenches; }
static void residuals(sadmm_world_def *def) { def->settings.measure_residuals = !def->settings.measure_residuals; }
static void warm_start(sadmm_world_def *def) { def->settings.warm_start = !def->settings.warm_start; }
static void penalty_updates(sadmm_world_def *def)
{
    def->settings.penalty_period = def->settings.penalty_period > 0 ? 0 : 30;
    def->settings.penalty_update_warm = true;
}
static void dense_solve(sadmm_world_def *def) { def->settings.ncp_points = def->settings.ncp_points > 0 ? 0 : 64; }
static void hits(sadmm_world_def *def) { def->settings.hits = def->settings.hits > 0 ? 0 : 16; }
static void correction(sadmm_world_def *def) { def->settings.correction_factor = 0; }
static void tolerance(sadmm_world_def *def)
{
    def->settings.tolerance = 1e-6;
    def->settings.iterations = 200;
}
static void fixed_work(sadmm_world_def *def) { sadmm_settings_fix_work(&def->settings); }
static void half(sadmm_world_def *def) { def->settings.iterations = (def->settings.iterations + 1) / 2; }
static void twice(sadmm_world_def *def) { def->settings.iterations *= 2; }
static void substeps(sadmm_world_def *def) { def->settings.substeps *= 2; }
static void precision(sadmm_world_def *def)
{
    def->precision = def->precision == SADMM_F32 ? SADMM_F64 : SADMM_F32;
}
static void method(sadmm_world_def *def)
{
    def->settings.method = def->settings.method == SADMM_METHOD_FAST ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST;
}
/* `ref` solves the literal form, by plain loops. */
static void literal_form(sadmm_world_def *def) { def->backend = SADMM_BACKEND_REF; }

/* ---- what can be added ------------------------------------------------------------------------------------------- */

/* A box, far from everything, in free fall with all else that falls. */
static sadmm_status add_far(sadmm_world *world, sadmm_body_type type, const double inertia[3], double y,
                            sadmm_body_id *id)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    body.type = type;
    body.mass = 1;
    memcpy(body.inertia, inertia, sizeof body.inertia);
    body.position[0] = body.position[2] = 1000;
    body.position[1] = y;
    shape.type = SADMM_SHAPE_BOX;
    for (int k = 0; k < 3; ++k) shape.size[k] = 0.1;
    const sadmm_status status = sadmm_world_add_body(world, &body, id);
    return status == SADMM_OK ? sadmm_world_add_shape(world, *id, &shape, NULL) : status;
}

static const double equal[3] = {0.1, 0.1, 0.1}, unequal[3] = {0.1, 0.11, 0.12};

static sadmm_status one_free_body(sadmm_world *world)
{
    sadmm_body_id id;
    return add_far(world, SADMM_BODY_DYNAMIC, equal, 0, &id);
}

static sadmm_status one_gyroscopic_body(sadmm_world *world)
{
    sadmm_body_id id;
    return add_far(world, SADMM_BODY_DYNAMIC, unequal, 0, &id);
}

static sadmm_status one_kinematic_body(sadmm_world *world)
{
    sadmm_body_id id;
    return add_far(world, SADMM_BODY_KINEMATIC, equal, 0, &id);
}

static sadmm_status one_joint(sadmm_world *world)
{
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_joint_id id;
    sadmm_status status = add_far(world, SADMM_BODY_DYNAMIC, equal, 0, &joint.body_a);
    if (status == SADMM_OK) status = add_far(world, SADMM_BODY_DYNAMIC, equal, 0.5, &joint.body_b);
    joint.kind = SADMM_JOINT_REVOLUTE;
    joint.position_a[1] = 0.25;
    joint.position_b[1] = -0.25;
    return status == SADMM_OK ? sadmm_world_add_joint(world, &joint, &id) : status;
}

static sadmm_status no_friction(sadmm_world *world)
{
    sadmm_status status = SADMM_OK;
    for (int32_t i = 0; i < sadmm_world_shape_count(world) && status == SADMM_OK; ++i) {
        sadmm_shape_id id;
        status = sadmm_world_shape_at(world, i, &id);
        if (status == SADMM_OK) status = sadmm_world_set_shape_material(world, id, 0, 0);
    }
    return status;
}

static const struct variation {
    const char *name, *what;
    void (*set)(sadmm_world_def *);
    sadmm_status (*change)(sadmm_world *);
    bool paper_only;
} variations[] = {
    {.name = "as it is", .what = "the scene"},
    {"certificate", "the true error of each step, or not", certificate, NULL, false},
    {"wrenches", "contact wrenches of bodies, or not", wrenches, NULL, false},
    {"residuals", "of the last iteration, or not", residuals, NULL, false},
    {"warm start", "from the last step's impulses, or not", warm_start, NULL, false},
    {"penalty updates", "eq. (15) of the paper, or not", penalty_updates, NULL, true},
    {"dense solve", "of islands of at most 64 points, or not", dense_solve, NULL, false},
    {"hits", "taken at their moments, or not", hits, NULL, false},
    {"no correction", "penetration stays", correction, NULL, false},
    {"tolerance", "1e-6 m/s, 200 iterations at most", tolerance, NULL, false},
    {"fixed work", "20 iterations", fixed_work, NULL, false},
    {"half", "the iterations", half, NULL, false},
    {"twice", "the iterations", twice, NULL, false},
    {"sub-steps", "twice as many, which share the iterations", substeps, NULL, false},
    {"precision", "the other one", precision, NULL, false},
    {"method", "the other one", method, NULL, false},
    {"literal form", "backend ref", literal_form, NULL, false},
    {"no friction", "one row a contact", NULL, no_friction, false},
    {"one body", "more, which touches nothing", NULL, one_free_body, false},
    {"gyroscopic", "one more of unequal principal moments", NULL, one_gyroscopic_body, false},
    {"kinematic", "one more kinematic body", NULL, one_kinematic_body, false},
    {"joint", "two more bodies on a hinge", NULL, one_joint, false},
};
enum { VARIATIONS = sizeof variations / sizeof *variations };

/* ---- measuring --------------------------------------------------------------------------------------------------- */

struct bench {
    const struct options *o;
    FILE *out, *csv;
    bool failed;
};

/* The best of the repeats; errors are equal in all of them. */
static sadmm_status measure(const struct bench *b, const struct sadmm_scene *scene, const struct variation *v,
                            struct scene_timing *best, struct sadmm_error *error)
{
    const struct scene_timing_plan plan = {.warm_up = (int)b->o->warm_up, .steps = (int)b->o->steps, .certified = 5,
                                           .seconds = 3600, .change = v->change};
    struct sadmm_scene varied = *scene;
    if (v->set) v->set(&varied.def);
    for (long k = 0; k < b->o->repeats && !interrupted(); ++k) {
        struct scene_timing one;
        const sadmm_status status = scene_timing_run(&varied, &plan, &one, error);
        if (status != SADMM_OK) return status;
        if (k == 0 || one.ms.total < best->ms.total) *best = one;
    }
    return SADMM_OK;
}

static void print(const struct bench *b, const char *scene, const struct variation *v, const struct scene_timing *t,
                  const struct scene_timing *base)
{
    const bool same = t->state_hash == base->state_hash;
    fprintf(b->out, "| %s | %s | %.4g | %.2f | %.4g | %.1e | %s |\n", v->name, v->what, t->ms.total,
            t->ms.total / base->ms.total, t->ms.solve, t->ncp_max, v->change ? "" : same ? "yes" : "no");
    fflush(b->out);
    if (!b->csv) return;
    bench_write_csv_text(b->csv, scene);
    fprintf(b->csv, ",%s,", v->name);
    bench_write_csv_text(b->csv, v->what);
    fprintf(b->csv, ",%s,%s,%d,%.4g,%.4f,%.4g,%.3g,%s\n", bench_word_of(bench_backends, (int)t->last.backend),
            bench_precision_name(t->last.precision), t->last.threads, t->ms.total, t->ms.total / base->ms.total,
            t->ms.solve, t->ncp_max, v->change ? "" : same ? "yes" : "no");
    fflush(b->csv);
}

static bool fits(const struct bench *b, const struct variation *v, const struct sadmm_scene *scene)
{
    if (b->o->only && v != variations && !strstr(v->name, b->o->only)) return false;
    if (v->set == literal_form && scene->def.backend == SADMM_BACKEND_CUDA) return false; /* no step of the GPU's */
    return !v->paper_only || scene->def.settings.method == SADMM_METHOD_PAPER;
}

static void measure_scene(struct bench *b, const char *spec)
{
    struct sadmm_scene scene;
    struct sadmm_error error = {SADMM_OK, ""};
    struct scene_timing base = {0}, now;
    if (sadmm_scene_open(spec, &scene, &error) != SADMM_OK) {
        fprintf(stderr, "subadmm-bench %s: %s\n", command, error.message);
        b->failed = true;
        return;
    }
    scene.def.backend = (sadmm_backend)b->o->backend;
    scene.def.precision = (sadmm_precision)b->o->precision;
    sadmm_scene_set_method(&scene, (sadmm_method)b->o->method);
    scene.def.settings.threads = (int)b->o->threads;
    fprintf(b->out,
            "%s, %ld steps after %ld; times: of the scene as it is; same bits: does it end in the same state\n\n"
            "| | what | ms a step | times | of it solve | natural map, m/s | same bits |\n"
            "|---|---|---|---|---|---|---|\n",
            spec, b->o->steps, b->o->warm_up);
    for (int k = 0; k < VARIATIONS && !interrupted(); ++k) {
        if (!fits(b, &variations[k], &scene)) continue;
        const sadmm_status status = measure(b, &scene, &variations[k], &now, &error);
        if (k == 0) base = now;
        if (status == SADMM_OK) print(b, spec, &variations[k], &now, &base);
        else {
            fprintf(stderr, "subadmm-bench %s: %s, %s: %s\n", command, spec, variations[k].name, error.message);
            b->failed = true;
            if (k == 0) break;
        }
    }
    putc('\n', b->out);
    sadmm_scene_close(&scene);
}

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXTS("scene", "SPEC", o->scenes, &o->scene_count,
                    "default vertical_stacks, card_houses:1, pile:300, ragdolls:4, hand_demo; up to 16 times"),
        BENCH_TEXT("only", "TEXT", &o->only, "the scene as it is and what has TEXT in its name"),
        BENCH_WORD("backend", &o->backend, bench_backends, BENCH_ONE_BACKEND, "default cpu"),
        BENCH_WORD("precision", &o->precision, bench_precisions, BENCH_ONE_PRECISION, "default f64"),
        BENCH_WORD("method", &o->method, bench_methods, BENCH_ONE_METHOD, "default fast"),
        BENCH_NUMBER("threads", &o->threads, 0, 1024, "at most, 0: as many as there are; default 1"),
        BENCH_NUMBER("warm-up", &o->warm_up, 0, 1000000, "steps before, default 100"),
        BENCH_NUMBER("steps", &o->steps, 1, 1000000, "that are timed, default 100"),
        BENCH_NUMBER("repeats", &o->repeats, 1, 1000, "the best one counts, default 3"),
        BENCH_FLAG("quick", &o->quick, "one small scene, few steps, once"),
        BENCH_TEXT("csv", "FILE|-", &o->csv, "the rows as CSV"),
    };
    const int code = bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
    return code ? code : bench_check_scenes(command, o->scenes, o->scene_count);
}

int bench_ablation(int argc, char **argv)
{
    static const char *const scenes[] = {"vertical_stacks", "card_houses:1", "pile:300", "ragdolls:4", "hand_demo"};
    struct options o = {.backend = SADMM_BACKEND_CPU, .precision = SADMM_F64, .method = SADMM_METHOD_FAST,
                        .threads = 1, .warm_up = 100, .steps = 100, .repeats = 3};
    struct output *csv = NULL;
    int status = parse(argc, argv, &o);
    if (status) return status < 0 ? 0 : status;
    if (o.quick) {
        o.warm_up = 5, o.steps = 5, o.repeats = 1;
        if (o.scene_count == 0) o.scenes[o.scene_count++] = "vertical_stacks:12";
    }
    const bool all = o.scene_count == 0;
    for (size_t k = 0; all && k < sizeof scenes / sizeof *scenes; ++k) o.scenes[o.scene_count++] = scenes[k];
    if (o.csv && (status = output_open("--csv", o.csv, OUTPUT_STREAM, &csv)) != 0) return status;
    struct bench b = {.o = &o, .out = outputs_on_stdout() ? stderr : stdout};
    if (csv) {
        b.csv = output_stream(csv);
        fputs("scene,name,what,backend,precision,threads,total_ms,times,solve_ms,ncp_max,same\n", b.csv);
    }
    for (int k = 0; k < o.scene_count && !interrupted(); ++k) measure_scene(&b, o.scenes[k]);
    status = output_close(csv);
    return b.failed ? 1 : status;
}
