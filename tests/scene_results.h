/* Scenes run to their own measure of success. */
#ifndef SADMM_TESTS_SCENE_RESULTS_H
#define SADMM_TESTS_SCENE_RESULTS_H

#include "scene_tools.h"

static const char *const methods[SADMM_METHOD_COUNT] = {[SADMM_METHOD_PAPER] = "paper", [SADMM_METHOD_FAST] = "fast"};

static const struct {
    sadmm_method method;
    sadmm_precision precision;
} ways[] = {
    {SADMM_METHOD_FAST, SADMM_F64},
    {SADMM_METHOD_FAST, SADMM_F32},
    {SADMM_METHOD_PAPER, SADMM_F64},
    {SADMM_METHOD_PAPER, SADMM_F32},
};
enum { WAYS = sizeof ways / sizeof *ways };

/* On the CPU, on one thread: others run beside this one. */
static inline struct sadmm_scene open_result_scene(const char *spec, sadmm_method method, sadmm_precision precision)
{
    struct sadmm_scene scene = open_scene(spec);
    sadmm_scene_set_method(&scene, method);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = precision;
    scene.def.settings.threads = 1;
    return scene;
}

/* Of all shapes. */
static inline void set_friction(sadmm_world *world, double mu)
{
    for (int32_t k = 0; k < sadmm_world_shape_count(world); ++k) {
        sadmm_shape_id id;
        MUST(world, sadmm_world_shape_at(world, k, &id));
        MUST(world, sadmm_world_set_shape_material(world, id, mu, 0));
    }
}

/* Step `begin` to `end`, inspected after each of them; with `begin` = 0 also before the first. */
static inline void run_to_result(const struct sadmm_scene *scene, sadmm_world *world, int64_t begin, int64_t end,
                                 struct sadmm_scene_result *result)
{
    struct sadmm_error error = {0};
    if (begin == 0) ck_assert_int_eq(sadmm_scene_observe(scene, world, 0, result, &error), SADMM_OK);
    for (int64_t step = begin; step < end; ++step) {
        ck_assert_int_eq(sadmm_scene_before_step(scene, world, step, &error), SADMM_OK);
        step_world(world, 1);
        ck_assert_int_eq(sadmm_scene_observe(scene, world, step + 1, result, &error), SADMM_OK);
    }
}

static inline const struct sadmm_scene_task *find_task(const struct sadmm_scene_result *result, const char *name)
{
    for (int k = 0; k < result->task_count; ++k)
        if (strcmp(result->tasks[k].name, name) == 0) return &result->tasks[k];
    ck_abort_msg("no task \"%s\"", name);
    return NULL;
}

static inline double figure(const struct sadmm_scene_task *task, const char *name)
{
    for (int k = 0; k < task->figure_count; ++k)
        if (strcmp(task->figures[k].name, name) == 0) return task->figures[k].value;
    ck_abort_msg("no figure \"%s\"", name);
    return NAN;
}

/* The whole scene has to pass. */
static inline void expect_success(const char *spec, sadmm_method method, sadmm_precision precision)
{
    struct sadmm_scene scene = open_result_scene(spec, method, precision);
    struct sadmm_scene_result result = {0};
    sadmm_world *world = build_scene(&scene);
    run_to_result(&scene, world, 0, lround(scene.duration / scene.def.settings.dt), &result);
    for (int k = 0; k < result.task_count; ++k) {
        const struct sadmm_scene_task *task = &result.tasks[k];
        ck_assert_msg(task->finished && task->passed, "%s, %s, %s: %s: %s %g, %s %g", spec, methods[method],
                      precision == SADMM_F32 ? "f32" : "f64", task->name, task->figures[0].name,
                      task->figures[0].value, task->figure_count > 1 ? task->figures[1].name : "",
                      task->figures[1].value);
    }
    ck_assert(sadmm_scene_passed(&result));
    sadmm_world_destroy(world);
}

#endif
