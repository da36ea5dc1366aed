/* The scene library: worlds built by name, shared by the command, the benchmarks, the tests and the examples.
 *
 * A scene is named by a spec: "name", or "name:N" where the scene takes a size, or "name:N:M" where it takes a second
 * number. Opening a spec parses it and fills the
 * world definition with the scene's own settings, for the library's default method; the caller may change that
 * definition (backend, precision, dt, iterations, ...) before the world is built from it. A scene has a number of
 * iterations for each method, and sub-steps for `fast`: sadmm_scene_set_method sets all three.
 */
#ifndef SADMM_SCENES_H
#define SADMM_SCENES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"
#include "subadmm/world.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_scene_info {
    const char *name;
    const char *arguments;   /* what may follow the name: "[:N]", "[:N[:M]]", or "" */
    const char *description; /* one line */
    double duration;         /* s, simulated time the scene is meant to be run for */
    int iterations[SADMM_METHOD_COUNT]; /* a step, by method */
    int substeps;            /* of a step of `fast`, which share its iterations; 0: one, as in `paper` */
    bool chaotic; /* trajectories that differ by rounding part within the duration: only statistics can be compared */
};

/* The scenes, index in [0, count); NULL outside. Static storage. */
size_t sadmm_scene_count(void);
const struct sadmm_scene_info *sadmm_scene_at(size_t index);

/* An opened spec. */
struct sadmm_scene {
    sadmm_world_def def;                /* the scene's settings; the caller may change them before building */
    double duration;                    /* s */
    const struct sadmm_scene_info *info;
    long n;                             /* the N of "name:N", or the scene's default */
    long m;                             /* the M of "name:N:M", or the scene's default; 0: the scene takes none */
};

/* Parse `spec` and fill `scene`. Errors: INVALID_ARGUMENT (unknown name: the message lists the valid ones; N or M
 * out of the scene's range). */
sadmm_status sadmm_scene_open(const char *spec, struct sadmm_scene *scene, struct sadmm_error *error);

/* Solve the scene by `method` in [0, SADMM_METHOD_COUNT): sets the method in scene->def.settings, and the iterations
 * and sub-steps to the scene's own for it. */
void sadmm_scene_set_method(struct sadmm_scene *scene, sadmm_method method);

/* Create a world from scene->def and fill it. The caller destroys it. Errors: those of sadmm_world_create and of the
 * calls that add bodies and shapes; *world is NULL after an error. */
sadmm_status sadmm_scene_build(const struct sadmm_scene *scene, sadmm_world **world, struct sadmm_error *error);

/* Scripted inputs: call before every step, with the number of steps done so far. Does nothing for most scenes. */
sadmm_status sadmm_scene_before_step(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                     struct sadmm_error *error);

/* ---- success ------------------------------------------------------------------------------------------------------
 *
 * A scene may measure by itself whether it went as it should, task by task: what was to be grasped is held, what was
 * built stands. */

enum { SADMM_SCENE_MOST_TASKS = 8, SADMM_SCENE_MOST_FIGURES = 4, SADMM_SCENE_MEMORY = 64 };

struct sadmm_scene_figure {
    const char *name, *unit; /* static storage */
    double value;
};

struct sadmm_scene_task {
    const char *name; /* static storage */
    struct sadmm_scene_figure figures[SADMM_SCENE_MOST_FIGURES];
    int figure_count;
    bool finished; /* the run has come to where the task is judged */
    bool passed;   /* finished, and as it should be */
};

/* Belongs to one run of one world; zeroed before its first step. */
struct sadmm_scene_result {
    struct sadmm_scene_task tasks[SADMM_SCENE_MOST_TASKS];
    int task_count; /* 0: the scene has no measure of success */
    double memory[SADMM_SCENE_MEMORY]; /* what the scene has to remember from one step to another; its own */
};

/* Look at the world: call before the first step (`step` = 0) and after every one (`step`: steps done). It waits for
 * steps begun where the scene has a measure, and does nothing where it has none. Errors: INVALID_ARGUMENT, those of the
 * world's read-outs. */
sadmm_status sadmm_scene_observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                 struct sadmm_scene_result *result, struct sadmm_error *error);

/* There are tasks, and all of them have passed. */
bool sadmm_scene_passed(const struct sadmm_scene_result *result);

#ifdef __cplusplus
}
#endif

#endif
