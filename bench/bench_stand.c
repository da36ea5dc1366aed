/* subadmm-bench stand: a scene that is built at rest, over many steps. Whole-step times, deepest penetration, how far
 * any body has moved from where it was put as a share of the smallest body, and whether that counts as standing. */
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "core/base/clock.h"
#include "core/base/memory.h"
#include "core/solve/schedule.h"
#include "scenes/scenes.h"

static const char command[] = "stand";

struct options {
    const char *scene;
    sadmm_method method;
    sadmm_backend backend;
    int precision;
    long threads, iterations, steps, device;
    double dt, limit;
};

struct placed {
    sadmm_body_id id;
    double start[3];
};

enum { PHASES = 4 }; /* collide, assemble, solve, finish */

struct stand {
    const struct sadmm_scene *scene;
    sadmm_world *world;
    struct placed *bodies; /* dynamic ones */
    int body_count;
    double size; /* least edge of any dynamic body's box or diameter, m */
    double *ms, *phases[PHASES]; /* whole steps and their parts, ms */
    long done;
    double penetration, drift, worst_drift, ncp;
    sadmm_step_report last;
    struct sadmm_error error;
};

#define TRY(call)                                      \
    do {                                               \
        sadmm_status try_status = (call);              \
        if (try_status != SADMM_OK) return try_status; \
    } while (0)

static sadmm_status check(struct stand *s, sadmm_status status)
{
    return status == SADMM_OK ? status : sadmm_fail(&s->error, status, "%s", sadmm_world_message(s->world));
}

static sadmm_status remember(struct stand *s)
{
    int32_t count = sadmm_world_body_count(s->world);
    s->bodies = sadmm_alloc((size_t)count, sizeof *s->bodies);
    if (!s->bodies) return sadmm_fail_memory(&s->error, "the bodies");
    for (int32_t i = 0; i < count; ++i) {
        sadmm_body_id id;
        sadmm_body_def def;
        TRY(check(s, sadmm_world_body_at(s->world, i, &id)));
        TRY(check(s, sadmm_world_body_def(s->world, id, &def)));
        if (def.type != SADMM_BODY_DYNAMIC) continue;
        struct placed *body = &s->bodies[s->body_count++];
        body->id = id;
        memcpy(body->start, def.position, sizeof body->start);
    }
    s->size = INFINITY;
    for (int32_t i = 0; i < sadmm_world_shape_count(s->world); ++i) {
        sadmm_shape_id id;
        sadmm_shape_def shape;
        TRY(check(s, sadmm_world_shape_at(s->world, i, &id)));
        TRY(check(s, sadmm_world_shape_def(s->world, id, &shape, NULL)));
        for (int k = 0; k < (shape.type == SADMM_SHAPE_BOX ? 3 : 1) && shape.type != SADMM_SHAPE_PLANE; ++k)
            s->size = fmin(s->size, 2 * shape.size[k]);
    }
    return SADMM_OK;
}

static sadmm_status measure_drift(struct stand *s)
{
    s->drift = 0;
    for (int i = 0; i < s->body_count; ++i) {
        sadmm_body_state state;
        TRY(check(s, sadmm_world_body_state(s->world, s->bodies[i].id, &state)));
        double square = 0;
        for (int k = 0; k < 3; ++k) square += pow(state.position[k] - s->bodies[i].start[k], 2);
        s->drift = fmax(s->drift, sqrt(square));
    }
    s->worst_drift = fmax(s->worst_drift, s->drift);
    return SADMM_OK;
}

static sadmm_status step(struct stand *s)
{
    TRY(sadmm_scene_before_step(s->scene, s->world, s->done, &s->error));
    double begin = sadmm_clock_ms();
    TRY(check(s, sadmm_world_step(s->world)));
    s->ms[s->done] = sadmm_clock_ms() - begin;
    TRY(check(s, sadmm_world_report(s->world, &s->last)));
    const sadmm_phase_times *ms = &s->last.ms;
    const double parts[PHASES] = {ms->collide, ms->assemble, ms->solve, ms->finish};
    for (int k = 0; k < PHASES; ++k) s->phases[k][s->done] = parts[k];
    ++s->done;
    s->penetration = fmax(s->penetration, s->last.penetration_max);
    return SADMM_OK;
}

/* The last step is done once more with a certificate, beyond the others. */
static sadmm_status run(struct stand *s, const struct options *o)
{
    s->ms = sadmm_alloc((size_t)o->steps + 1, sizeof *s->ms);
    bool room = s->ms;
    for (int k = 0; k < PHASES; ++k) {
        s->phases[k] = sadmm_alloc((size_t)o->steps + 1, sizeof *s->phases[k]);
        room = room && s->phases[k];
    }
    if (!room) return sadmm_fail_memory(&s->error, "the times");
    TRY(remember(s));
    while (s->done < o->steps && !(interrupted() && s->done > 0)) {
        TRY(step(s));
        if (s->done % 100 == 0) TRY(measure_drift(s));
    }
    TRY(measure_drift(s));
    sadmm_settings settings = sadmm_world_settings(s->world);
    settings.certify = true;
    TRY(check(s, sadmm_world_set_settings(s->world, &settings)));
    TRY(step(s));
    s->ncp = s->last.certificate.ncp_max;
    --s->done;
    return SADMM_OK;
}

/* 0: it stands, 1: it does not. */
static int report(struct stand *s, const struct options *o)
{
    char machine[128];
    double drift = s->worst_drift / s->size, penetration = s->penetration / s->size;
    bool stands = drift <= o->limit && penetration <= o->limit;
    sadmm_backend_info info;
    sadmm_backend_query(s->last.backend, &info);
    bench_runs_on(s->last.backend, machine, sizeof machine);
    qsort(s->ms, (size_t)s->done, sizeof *s->ms, bench_compare_doubles);
    const sadmm_settings *settings = &s->scene->def.settings;
    printf("%s, %s, %d iterations a step, dt %g s, %ld steps (%.4g s)\n", o->scene,
           settings->method == SADMM_METHOD_FAST ? "fast" : "paper", settings->iterations, settings->dt, s->done,
           settings->dt * (double)s->done);
    printf("%s %s, %d thread%s, %s, commit %s\n", info.name, bench_precision_name(s->last.precision), s->last.threads,
           s->last.threads == 1 ? "" : "s", machine, sadmm_build_commit());
    printf("bodies         %d, contacts %d at the end\n", s->last.bodies, s->last.contacts);
    printf("whole step     %.3f ms median, %.3f 95 %%, %.3f at most\n", s->ms[s->done / 2],
           s->ms[(long)(0.95 * (double)(s->done - 1))], s->ms[s->done - 1]);
    for (int k = 0; k < PHASES; ++k) qsort(s->phases[k], (size_t)s->done, sizeof *s->phases[k], bench_compare_doubles);
    printf("  of it        %.3f ms collide, %.3f assemble, %.3f solve, %.3f finish (medians)\n", s->phases[0][s->done / 2],
           s->phases[1][s->done / 2], s->phases[2][s->done / 2], s->phases[3][s->done / 2]);
    printf("penetration    %.3g m at most: %.3g of the smallest body (%.3g m)\n", s->penetration, penetration, s->size);
    printf("drift          %.3g m at most, %.3g m at the end: %.3g of the smallest body\n", s->worst_drift, s->drift, drift);
    printf("certificate    ncp %.3g m/s, momentum %.3g (one step more)\n", s->ncp, s->last.certificate.momentum_max);
    printf("%s: drift %s penetration %s %g of the smallest body\n", stands ? "stands" : "does not stand",
           stands ? "and" : "or", stands ? "at most" : "above", o->limit);
    return stands ? 0 : 1;
}

static void usage(FILE *out)
{
    fprintf(out, "usage: subadmm-bench stand [options]\n\n"
                 "  --scene SPEC          default pyramid:100\n"
                 "  --dt S                default 1/60\n"
                 "  --steps N             default 2000\n"
                 "  --method paper|fast   default fast\n"
                 "  --iterations N        a step, default the scene's for the method\n"
                 "  --backend NAME        ref, cpu (default) or cuda\n"
                 "  --precision f32|f64   default f32\n"
                 "  --threads N           at most, default 2\n"
                 "  --device N            accelerator, default 0\n"
                 "  --limit X             most drift and penetration of what stands, as a share of the smallest body,\n"
                 "                        default 0.01\n\n"
                 "Exit status: 0 it stands, 1 it does not (or something failed).\n");
}

static int bad(const char *option, const char *value, const char *allowed)
{
    return bench_bad_option(command, option, value, allowed);
}

/* 0, 2 for wrong usage, -1 for --help. */
static int parse(int argc, char **argv, struct options *o)
{
    static const struct option longs[] = {
        {"scene", required_argument, NULL, 'S'},
        {"dt", required_argument, NULL, 'T'},
        {"steps", required_argument, NULL, 's'},
        {"method", required_argument, NULL, 'M'},
        {"iterations", required_argument, NULL, 'i'},
        {"backend", required_argument, NULL, 'b'},
        {"precision", required_argument, NULL, 'p'},
        {"threads", required_argument, NULL, 't'},
        {"device", required_argument, NULL, 'd'},
        {"limit", required_argument, NULL, 'l'},
        {"help", no_argument, NULL, 'h'},
        {NULL, 0, NULL, 0},
    };
    for (int option; (option = getopt_long(argc, argv, "h", longs, NULL)) != -1;) {
        switch (option) {
        case 'S': o->scene = optarg; break;
        case 'T':
            if (!bench_parse_seconds(optarg, 1, &o->dt)) return bad("dt", optarg, "in (0, 1]");
            break;
        case 's':
            if (!bench_parse_number(optarg, 1, 10000000, &o->steps)) return bad("steps", optarg, "in [1, 10000000]");
            break;
        case 'M':
            if (!bench_parse_method(optarg, &o->method)) return bad("method", optarg, "paper or fast");
            break;
        case 'i':
            if (!bench_parse_number(optarg, 1, 1000000, &o->iterations))
                return bad("iterations", optarg, "in [1, 1000000]");
            break;
        case 'b':
            if (!bench_parse_backend(optarg, &o->backend) || o->backend == SADMM_BACKEND_AUTO)
                return bad("backend", optarg, "ref, cpu or cuda");
            break;
        case 'p':
            if (!bench_parse_precision(optarg, &o->precision) || o->precision < 0)
                return bad("precision", optarg, "f32 or f64");
            break;
        case 't':
            if (!bench_parse_number(optarg, 0, 1024, &o->threads)) return bad("threads", optarg, "in [0, 1024]");
            break;
        case 'd':
            if (!bench_parse_number(optarg, 0, 1023, &o->device)) return bad("device", optarg, "in [0, 1023]");
            break;
        case 'l':
            if (!bench_parse_seconds(optarg, 1e6, &o->limit)) return bad("limit", optarg, "in (0, 1e6]");
            break;
        case 'h': usage(stdout); return -1;
        default: usage(stderr); return 2;
        }
    }
    if (optind == argc) return 0;
    fprintf(stderr, "subadmm-bench %s: unexpected argument \"%s\"\n", command, argv[optind]);
    return 2;
}

int bench_stand(int argc, char **argv)
{
    struct options o = {.scene = "pyramid:100",
                        .method = SADMM_METHOD_FAST,
                        .backend = SADMM_BACKEND_CPU,
                        .precision = SADMM_F32,
                        .threads = 2,
                        .steps = 2000,
                        .dt = 1.0 / 60,
                        .limit = 0.01};
    struct sadmm_scene scene;
    struct stand s = {.scene = &scene};
    int code = parse(argc, argv, &o);
    if (code) return code < 0 ? 0 : code;
    if (sadmm_scene_open(o.scene, &scene, &s.error) != SADMM_OK) {
        fprintf(stderr, "subadmm-bench %s: %s\n", command, s.error.message);
        return 2;
    }
    sadmm_settings *settings = &scene.def.settings;
    scene.def.backend = o.backend;
    scene.def.precision = (sadmm_precision)o.precision;
    scene.def.device = (int)o.device;
    settings->dt = o.dt;
    sadmm_scene_set_method(&scene, o.method);
    if (o.iterations > 0) settings->iterations = (int)o.iterations;
    settings->threads = (int)o.threads;
    sadmm_status status = sadmm_scene_build(&scene, &s.world, &s.error);
    if (status == SADMM_OK) status = run(&s, &o);
    if (status == SADMM_OK) code = report(&s, &o);
    else fprintf(stderr, "subadmm-bench %s: step %ld: %s\n", command, s.done + 1, s.error.message), code = 1;
    sadmm_world_destroy(s.world);
    sadmm_free(s.bodies);
    sadmm_free(s.ms);
    for (int k = 0; k < PHASES; ++k) sadmm_free(s.phases[k]);
    return code;
}
