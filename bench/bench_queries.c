/* subadmm-bench queries: what queries of a scene cost. Rays are aimed from all around at points of the box around the
 * scene's bodies (scattered), and from above, side by side (parallel); overlaps and closest points are those of a ball
 * at such points and, of two bodies that follow each other, of their shapes. The shortest of several repeats each. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "core/base/clock.h"
#include "core/base/memory.h"
#include "scenes/scenes.h"
#include "subadmm/subadmm.h"

static const char command[] = "queries";

enum { REPEATS = 20, ROOM = 4096 };

struct options {
    const char *scene;
    long rays, threads, steps;
};

struct bench {
    sadmm_world *world;
    struct sadmm_error *error;
    double lowest[3], highest[3]; /* around the origins of bodies that move */
    sadmm_ray *rays;
    sadmm_ray_hit *hits;
    int32_t count;
    uint64_t state;
};

static double number(struct bench *b) /* [0, 1) */
{
    b->state ^= b->state >> 12;
    b->state ^= b->state << 25;
    b->state ^= b->state >> 27;
    return (double)((b->state * UINT64_C(0x2545F4914F6CDD1D)) >> 11) * 0x1p-53;
}

static sadmm_status of_world(const struct bench *b, sadmm_status status)
{
    return status == SADMM_OK ? status : sadmm_fail(b->error, status, "%s", sadmm_world_message(b->world));
}

static sadmm_status run_scene(struct bench *b, const struct options *o, struct sadmm_scene *scene)
{
    TRY(sadmm_scene_build(scene, &b->world, b->error));
    for (long k = 0; k < o->steps; ++k) {
        TRY(sadmm_scene_before_step(scene, b->world, k, b->error));
        TRY(of_world(b, sadmm_world_step(b->world)));
    }
    return SADMM_OK;
}

static sadmm_status make_world(struct bench *b, const struct options *o)
{
    struct sadmm_scene scene;
    TRY(sadmm_scene_open(o->scene, &scene, b->error));
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.settings.threads = (int)o->threads;
    const sadmm_status status = run_scene(b, o, &scene);
    sadmm_scene_close(&scene);
    return status;
}

static sadmm_status find_box(struct bench *b)
{
    for (int k = 0; k < 3; ++k) {
        b->lowest[k] = HUGE_VAL;
        b->highest[k] = -HUGE_VAL;
    }
    for (int32_t i = 0; i < sadmm_world_body_count(b->world); ++i) {
        sadmm_body_def def;
        sadmm_body_id id;
        TRY(of_world(b, sadmm_world_body_at(b->world, i, &id)));
        TRY(of_world(b, sadmm_world_body_def(b->world, id, &def)));
        for (int k = 0; k < 3 && def.type == SADMM_BODY_DYNAMIC; ++k) {
            b->lowest[k] = fmin(b->lowest[k], def.position[k]);
            b->highest[k] = fmax(b->highest[k], def.position[k]);
        }
    }
    return b->lowest[0] <= b->highest[0]
               ? SADMM_OK
               : sadmm_fail(b->error, SADMM_ERROR_INVALID_ARGUMENT, "the scene has no bodies");
}

static void point_of(struct bench *b, double x[3])
{
    for (int k = 0; k < 3; ++k) x[k] = b->lowest[k] + number(b) * (b->highest[k] - b->lowest[k]);
}

static void make_rays(struct bench *b, bool parallel)
{
    double reach = 1;
    for (int k = 0; k < 3; ++k) reach = fmax(reach, b->highest[k] - b->lowest[k]);
    for (int32_t i = 0; i < b->count; ++i) {
        sadmm_ray *ray = &b->rays[i];
        double to[3];
        point_of(b, to);
        const double angle = 6.283185307179586 * number(b), rise = number(b);
        const double away[3] = {2 * reach * cos(angle), 2 * reach * sin(angle), reach * rise},
                     above[3] = {0, 0, 2 * reach};
        for (int k = 0; k < 3; ++k) {
            const double *off = parallel ? above : away;
            ray->origin[k] = to[k] + off[k];
            ray->direction[k] = -off[k];
        }
        ray->length = HUGE_VAL;
    }
}

static sadmm_status cast(struct bench *b, double *ms)
{
    const double begin = sadmm_clock_ms();
    TRY(of_world(b, sadmm_world_cast_rays(b->world, b->count, b->rays, NULL, b->hits)));
    *ms = sadmm_clock_ms() - begin;
    return SADMM_OK;
}

static sadmm_status measure_rays(struct bench *b, bool parallel)
{
    double least = HUGE_VAL, ms;
    int32_t hits = 0;
    make_rays(b, parallel);
    for (int k = 0; k < REPEATS && !interrupted(); ++k) {
        TRY(cast(b, &ms));
        least = fmin(least, ms);
    }
    for (int32_t i = 0; i < b->count; ++i) hits += b->hits[i].shape.slot != 0;
    printf("%-34s %10.3f ms   %7.0f ns each, %.0f %% hit\n", parallel ? "rays, parallel" : "rays, scattered", least,
           1e6 * least / b->count, 100.0 * hits / b->count);
    return SADMM_OK;
}

/* The first query after a shape has come, and after bodies have moved. */
static sadmm_status measure_updates(struct bench *b)
{
    const int32_t count = b->count;
    double made = HUGE_VAL, followed = HUGE_VAL, ms;
    sadmm_shape_def ball = sadmm_shape_def_default();
    sadmm_body_state state;
    sadmm_body_id body;
    make_rays(b, false);
    ball.size[0] = 1e-3;
    b->count = 1;
    TRY(of_world(b, sadmm_world_body_at(b->world, sadmm_world_body_count(b->world) - 1, &body)));
    for (int k = 0; k < REPEATS; ++k) {
        sadmm_shape_id shape;
        TRY(of_world(b, sadmm_world_add_shape(b->world, body, &ball, &shape)));
        TRY(cast(b, &ms));
        made = fmin(made, ms);
        TRY(of_world(b, sadmm_world_remove_shape(b->world, shape)));
        TRY(cast(b, &ms));
        TRY(of_world(b, sadmm_world_body_state(b->world, body, &state)));
        TRY(of_world(b, sadmm_world_set_body_state(b->world, body, &state)));
        TRY(cast(b, &ms));
        followed = fmin(followed, ms);
    }
    b->count = count;
    printf("%-34s %10.3f ms\n%-34s %10.3f ms\n", "first query, shapes added", made, "first query, bodies moved",
           followed);
    return SADMM_OK;
}

/* As large as what is a few bodies across. */
static sadmm_status measure_overlaps(struct bench *b)
{
    enum { QUERIES = 1000 };
    static const double as_it_is[4] = {1, 0, 0, 0};
    sadmm_shape_def ball = sadmm_shape_def_default();
    double least = HUGE_VAL, found = 0;
    double volume = 1;
    for (int k = 0; k < 3; ++k) volume *= fmax(b->highest[k] - b->lowest[k], 1e-6);
    ball.size[0] = fmax(1.2 * cbrt(volume / sadmm_world_shape_count(b->world)), 1e-3); /* one body has no extent */
    for (int k = 0; k < REPEATS && !interrupted(); ++k) {
        const double begin = sadmm_clock_ms();
        b->state = 5;
        found = 0;
        for (int q = 0; q < QUERIES; ++q) {
            static sadmm_shape_id ids[ROOM];
            int32_t count;
            double x[3];
            point_of(b, x);
            TRY(of_world(b, sadmm_world_overlap_shape(b->world, &ball, x, as_it_is, NULL, ROOM, ids, &count)));
            found += count;
        }
        least = fmin(least, sadmm_clock_ms() - begin);
    }
    printf("%-34s %10.3f us each, %.1f found\n", "overlaps of a ball", 1e3 * least / QUERIES, found / QUERIES);
    return SADMM_OK;
}

static sadmm_status measure_closest(struct bench *b)
{
    const int32_t shapes = sadmm_world_shape_count(b->world);
    double least = HUGE_VAL;
    int32_t pairs = 0;
    for (int k = 0; k < REPEATS && !interrupted(); ++k) {
        double ms = 0;
        pairs = 0;
        for (int32_t i = 1; i + 1 < shapes && i < 1000; ++i) {
            sadmm_closest_points points;
            sadmm_shape_id one, two;
            TRY(of_world(b, sadmm_world_shape_at(b->world, i, &one)));
            TRY(of_world(b, sadmm_world_shape_at(b->world, i + 1, &two)));
            const double begin = sadmm_clock_ms();
            if (sadmm_world_closest_points(b->world, one, two, &points) != SADMM_OK) continue; /* two planes, say */
            ms += sadmm_clock_ms() - begin;
            ++pairs;
        }
        least = fmin(least, ms);
    }
    if (pairs > 0) printf("%-34s %10.3f us each\n", "closest points of two shapes", 1e3 * least / pairs);
    return SADMM_OK;
}

static sadmm_status run(struct bench *b, const struct options *o)
{
    char name[128];
    TRY(make_world(b, o));
    TRY(find_box(b));
    bench_runs_on(SADMM_BACKEND_CPU, name, sizeof name);
    printf("%s: %d shapes, %ld rays, %ld threads (0: all), %s\n", o->scene, sadmm_world_shape_count(b->world), o->rays,
           o->threads, name);
    TRY(measure_updates(b));
    TRY(measure_rays(b, false));
    TRY(measure_rays(b, true));
    TRY(measure_overlaps(b));
    return measure_closest(b);
}

int bench_queries(int argc, char **argv)
{
    struct options o = {.scene = "settled_pile:10000", .rays = 10000, .threads = 0, .steps = 1};
    const struct bench_option options[] = {
        BENCH_TEXT("scene", "SPEC", &o.scene, "the scene; default settled_pile:10000"),
        BENCH_NUMBER("rays", &o.rays, 1, 10000000, "rays at once; default 10000"),
        BENCH_NUMBER("steps", &o.steps, 0, 1000000, "steps before; default 1"),
        BENCH_NUMBER("threads", &o.threads, 0, 1024, "at most; default 0, all"),
    };
    int code = bench_parse(command, options, sizeof options / sizeof *options, NULL, argc, argv);
    if (code) return code < 0 ? 0 : code;
    struct sadmm_error error = {SADMM_OK, ""};
    struct bench b = {.error = &error, .count = (int32_t)o.rays, .state = 7};
    b.rays = (sadmm_ray *)sadmm_alloc((size_t)o.rays, sizeof *b.rays);
    b.hits = (sadmm_ray_hit *)sadmm_alloc((size_t)o.rays, sizeof *b.hits);
    const sadmm_status status = b.rays && b.hits ? run(&b, &o) : sadmm_fail_memory(&error, "the rays");
    sadmm_world_destroy(b.world);
    sadmm_free(b.rays);
    sadmm_free(b.hits);
    if (status == SADMM_OK) return 0;
    fprintf(stderr, "subadmm-bench %s: %s\n", command, error.message);
    return status == SADMM_ERROR_INVALID_ARGUMENT ? bench_scene_status(o.scene) : 1;
}
