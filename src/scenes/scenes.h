/* The scene library: worlds built by name, shared by the command, the benchmarks, the tests and the examples.
 *
 * A scene is named by a spec: "name", or "name:N" where the scene takes a size. Opening a spec parses it and fills the
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
    const char *arguments;   /* what may follow the name: ":N", or "" */
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
};

/* Parse `spec` and fill `scene`. Errors: INVALID_ARGUMENT (unknown name: the message lists the valid ones; N out of
 * the scene's range). */
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

#ifdef __cplusplus
}
#endif

#endif
