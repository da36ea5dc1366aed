/* subadmm-bench stand: a scene that is built at rest, over many steps. Whole-step times, deepest penetration, how far
 * any body has moved from where it was put as a share of the smallest body, and whether that counts as standing. */
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
    int method, backend, precision;
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
        const bool three = shape.type == SADMM_SHAPE_BOX || shape.type == SADMM_SHAPE_HULL ||
                           shape.type == SADMM_SHAPE_ELLIPSOID,
                   two = shape.type == SADMM_SHAPE_CYLINDER || shape.type == SADMM_SHAPE_CONE;
        for (int k = 0; k < (three ? 3 : two ? 2 : 1) && shape.type != SADMM_SHAPE_PLANE; ++k)
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
    bool allocated = s->ms;
    for (int k = 0; k < PHASES; ++k) {
        s->phases[k] = sadmm_alloc((size_t)o->steps + 1, sizeof *s->phases[k]);
        allocated = allocated && s->phases[k];
    }
    if (!allocated) return sadmm_fail_memory(&s->error, "the times");
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
           bench_word_of(bench_methods, (int)settings->method), settings->iterations, settings->dt, s->done,
           settings->dt * (double)s->done);
    printf("%s %s, %d thread%s, %s, commit %s\n", info.name, bench_precision_name(s->last.precision), s->last.threads,
           s->last.threads == 1 ? "" : "s", machine, sadmm_build_commit());
    printf("bodies         %d, contacts %d at the end\n", s->last.bodies, s->last.contacts);
    printf("whole step     %.3f ms median, %.3f 95 %%, %.3f at most\n", s->ms[s->done / 2],
           s->ms[(long)(0.95 * (double)(s->done - 1))], s->ms[s->done - 1]);
    for (int k = 0; k < PHASES; ++k) qsort(s->phases[k], (size_t)s->done, sizeof *s->phases[k], bench_compare_doubles);
    printf("  of it        %.3f ms collide, %.3f assemble, %.3f solve, %.3f finish (medians)\n",
           s->phases[0][s->done / 2], s->phases[1][s->done / 2], s->phases[2][s->done / 2], s->phases[3][s->done / 2]);
    printf("penetration    %.3g m at most: %.3g of the smallest body (%.3g m)\n", s->penetration, penetration, s->size);
    printf("drift          %.3g m at most, %.3g m at the end: %.3g of the smallest body\n", s->worst_drift, s->drift,
           drift);
    printf("certificate    ncp %.3g m/s, momentum %.3g (one step more)\n", s->ncp, s->last.certificate.momentum_max);
    printf("%s: drift %s penetration %s %g of the smallest body\n", stands ? "stands" : "does not stand",
           stands ? "and" : "or", stands ? "at most" : "above", o->limit);
    return stands ? 0 : 1;
}

static int parse(int argc, char **argv, struct options *o)
{
    const struct bench_option options[] = {
        BENCH_TEXT("scene", "SPEC", &o->scene, "default pyramid:100"),
        BENCH_REAL("dt", "S", &o->dt, 1, "default 1/60"),
        BENCH_NUMBER("steps", &o->steps, 1, 10000000, "default 2000"),
        BENCH_WORD("method", &o->method, bench_methods, BENCH_ONE_METHOD, "default fast"),
        BENCH_NUMBER("iterations", &o->iterations, 1, 1000000, "a step, default the scene's for the method"),
        BENCH_WORD("backend", &o->backend, bench_backends, BENCH_ONE_BACKEND, "default cpu"),
        BENCH_WORD("precision", &o->precision, bench_precisions, BENCH_ONE_PRECISION, "default f32"),
        BENCH_NUMBER("threads", &o->threads, 0, 1024, "at most, 0: as many as there are; default 2"),
        BENCH_NUMBER("device", &o->device, 0, 1023, "accelerator, default 0"),
        BENCH_REAL("limit", "X", &o->limit, 1e6,
                   "most drift and penetration of what stands, as a share of the smallest body; default 0.01"),
    };
    return bench_parse(command, options, sizeof options / sizeof *options,
                       "Exit status: 0 it stands, 1 it does not (or something failed).\n", argc, argv);
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
    if ((code = bench_open_scene(command, o.scene, &scene)) != 0) return code;
    sadmm_settings *settings = &scene.def.settings;
    scene.def.backend = (sadmm_backend)o.backend;
    scene.def.precision = (sadmm_precision)o.precision;
    scene.def.device = (int)o.device;
    settings->dt = o.dt;
    sadmm_scene_set_method(&scene, (sadmm_method)o.method);
    if (o.iterations > 0) settings->iterations = (int)o.iterations;
    settings->threads = (int)o.threads;
    sadmm_status status = sadmm_scene_build(&scene, &s.world, &s.error);
    if (status == SADMM_OK) status = run(&s, &o);
    if (status == SADMM_OK) code = report(&s, &o);
    else fprintf(stderr, "subadmm-bench %s: step %ld: %s\n", command, s.done + 1, s.error.message), code = 1;
    sadmm_world_destroy(s.world);
    sadmm_scene_close(&scene);
    sadmm_free(s.bodies);
    sadmm_free(s.ms);
    for (int k = 0; k < PHASES; ++k) sadmm_free(s.phases[k]);
    return code;
}
