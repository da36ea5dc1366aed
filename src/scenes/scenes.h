/* The scene library: worlds built by name, shared by the command, the benchmarks, the tests and the examples.
 *
 * A scene is named by a spec: "name", or "name:N" where the scene takes a size, or "name:N:M" where it takes a second
 * number. Opening a spec parses it and fills the
 * world definition with the scene's own settings, for the library's default method; the caller may change that
 * definition (backend, precision, dt, iterations, ...) before the world is built from it. A scene has a number of
 * iterations for each method, and sub-steps for `fast`: sadmm_scene_set_method sets all three.
 *
 * A scene may also come from a file (scene_file/scene_file.h, docs/guide/scene-files.md): the world that it is at its
 * beginning, without what a scene of the library does besides, a script and a measure of success. A spec that ends in
 * .json or has a / in it is the path of one.
 */
#ifndef SADMM_SCENES_H
#define SADMM_SCENES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The scenes, index in [0, count); NULL outside. Static storage. */
size_t sadmm_scene_count(void);
const struct sadmm_scene_info *sadmm_scene_at(size_t index);

/* Is this spec the path of a scene file? */
bool sadmm_scene_is_file(const char *spec);

/* Does it end as a robot's file does, which the Python package reads (.urdf, .xml, .usd...)? */
bool sadmm_scene_is_model(const char *spec);

/* Parse `spec` and fill `scene`. What is opened is to be closed; a scene of the library has nothing to be freed.
 * Errors: INVALID_ARGUMENT (unknown name: the message lists the valid ones; N or M out of the scene's range; a robot's
 * file: the message says what reads it), and of a file those of sadmm_scene_open_file. Nothing is to be closed after an
 * error. */
sadmm_status sadmm_scene_open(const char *spec, struct sadmm_scene *scene, struct sadmm_error *error);

/* Fill `scene` from a scene file, or from `length` bytes of its text (name: what messages call it; NULL: nothing). Its
 * info has the name and description that the file has; n and m are 0 where it has none. What is wrong with bodies,
 * shapes and what is between them is found when a world is built. Errors: INVALID_ARGUMENT (the message names the line,
 * or the path of the member, its value and what is allowed), IO, LIMIT (more than 4 GiB), OUT_OF_MEMORY, UNAVAILABLE (a
 * build without jansson). */
sadmm_status sadmm_scene_open_file(const char *path, struct sadmm_scene *scene, struct sadmm_error *error);
sadmm_status sadmm_scene_open_text(const char *text, size_t length, const char *name, struct sadmm_scene *scene,
                                   struct sadmm_error *error);

/* Free what the scene has of a file; worlds built from it stay. NULL, and a scene of the library, are fine. */
void sadmm_scene_close(struct sadmm_scene *scene);

/* Write a world as a scene file: its state and settings; of the scene its name, duration, precision and margin. spec:
 * what the file says it is of; of a scene from a file, what that said. A world that has made steps is written as it is
 * now, without what steps leave for the next ones. Errors: IO, UNAVAILABLE (a build without jansson), OUT_OF_MEMORY,
 * those of the calls that read a world. */
sadmm_status sadmm_scene_write(const struct sadmm_scene *scene, const char *spec, sadmm_world *world, FILE *stream,
                               struct sadmm_error *error);

/* Solve the scene by `method` in [0, SADMM_METHOD_COUNT): sets the method in scene->def.settings, and the iterations
 * and sub-steps to the scene's own for it. */
void sadmm_scene_set_method(struct sadmm_scene *scene, sadmm_method method);

/* Create a world from scene->def and fill it. The caller destroys it. Errors: those of sadmm_world_create and of the
 * calls that add bodies and shapes, INVALID_ARGUMENT (a file with something wrong); *world is NULL after an error. */
sadmm_status sadmm_scene_build(const struct sadmm_scene *scene, sadmm_world **world, struct sadmm_error *error);

/* Scripted inputs: call before every step, with the number of steps done so far. Does nothing for most scenes, nor for
 * those from files. */
sadmm_status sadmm_scene_before_step(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                     struct sadmm_error *error);

/* Does the scene have such inputs? They are not part of what sadmm_scene_write writes. NULL, and files: false. */
bool sadmm_scene_has_script(const struct sadmm_scene *scene);

/* ---- success ------------------------------------------------------------------------------------------------------
 *
 * A scene may measure by itself whether it went as it should, task by task: what was to be grasped is held, what was
 * built stands. */

/* Inspect the world: call before the first step (`step` = 0) and after every one (`step`: steps done). It waits for
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
