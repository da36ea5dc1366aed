/* Scenes: worlds by name, from the library's own scenes or from a scene file (docs/guide/scenes.md,
 * docs/guide/scene-files.md).
 *
 * A scene is named by a spec: "name", or "name:N" where the scene takes a size, or "name:N:M" where it takes a second
 * number. A spec that ends in .json or has a / in it is the path of a scene file. A scene has settings of its own,
 * which the caller may change before a world is made of it. Any number of worlds may be made of one scene; they stay
 * when it is destroyed.
 *
 *     sadmm_scene *scene;
 *     sadmm_world *world;
 *     sadmm_scene_create("pile:300", &scene);
 *     sadmm_scene_create_world(scene, NULL, &world);
 *     for (int64_t step = 0; step < 100; ++step) {
 *         sadmm_scene_run_script(scene, world, step);
 *         sadmm_world_step(world);
 *     }
 *
 * Errors are returned as a status; the message is sadmm_last_message. Every call that can fail: UNAVAILABLE in a build
 * without scenes. A scene that does not change may be used by several threads at a time.
 */
#ifndef SUBADMM_SCENES_H
#define SUBADMM_SCENES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_scene sadmm_scene;

/* The scenes of the library: name, what may follow it ("[:N]", "[:N[:M]]", or ""), and what it is, one line. Each may
 * be NULL. Static storage. index in [0, count). Errors: INVALID_ARGUMENT (range). */
SADMM_API int32_t sadmm_scene_library_count(void); /* 0 in a build without scenes */
SADMM_API sadmm_status sadmm_scene_library_at(int32_t index, const char **name, const char **arguments,
                                              const char **description);

/* *out: the scene, the caller's until sadmm_scene_destroy; NULL after an error. Errors: INVALID_ARGUMENT (an unknown
 * name: the message lists the valid ones; N or M out of the scene's range; a robot's file (.urdf, .xml, .usd...), which
 * the Python package reads; of a file the message names the line, or the path of the member, its value and what is
 * allowed), IO, LIMIT (a file of more than 4 GiB), UNAVAILABLE (files, in a build without jansson), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_scene_create(const char *spec, sadmm_scene **out);
/* The same of the text of a scene file, `length` bytes that are only read while the call lasts. name: what messages
 * call it; NULL: nothing. */
SADMM_API sadmm_status sadmm_scene_create_from_text(const char *text, size_t length, const char *name,
                                                    sadmm_scene **out);
SADMM_API void sadmm_scene_destroy(sadmm_scene *scene); /* NULL is fine */

/* Of the scene, or its file; valid as long as the scene. Of NULL: NULL, and 0. */
SADMM_API const char *sadmm_scene_name(const sadmm_scene *scene);
SADMM_API const char *sadmm_scene_description(const sadmm_scene *scene);
SADMM_API double sadmm_scene_duration(const sadmm_scene *scene); /* s, that it is meant to be run for */

/* Solve it by `method`, with the scene's own iterations and sub-steps for that. Errors: INVALID_ARGUMENT. */
SADMM_API sadmm_status sadmm_scene_choose_method(sadmm_scene *scene, sadmm_method method);

/* The definition, with the settings, that the scene has: to be changed and given to sadmm_scene_create_world. Errors:
 * INVALID_ARGUMENT (NULL). */
SADMM_API sadmm_status sadmm_scene_world_def_sized(const sadmm_scene *scene, sadmm_world_def *def, size_t size,
                                                   size_t settings_size);
static inline sadmm_status sadmm_scene_world_def(const sadmm_scene *scene, sadmm_world_def *def)
{
    return sadmm_scene_world_def_sized(scene, def, sizeof *def, sizeof def->settings);
}

/* *out: a world with everything that the scene has in it, the caller's until sadmm_world_destroy; NULL after an error.
 * def: NULL: the scene's own. Errors: those of sadmm_world_create and of the calls that add bodies, shapes and joints;
 * INVALID_ARGUMENT (a file with something wrong). */
SADMM_API sadmm_status sadmm_scene_create_world(const sadmm_scene *scene, const sadmm_world_def *def,
                                                sadmm_world **out);

/* Some scenes have a script: inputs, such as motors and hands. Call this before every step of a world of the scene,
 * with the number of steps done so far; it does nothing for scenes that have none, nor for those from files. Errors:
 * INVALID_ARGUMENT (NULL), those of the calls that change a world. */
SADMM_API sadmm_status sadmm_scene_run_script(const sadmm_scene *scene, sadmm_world *world, int64_t step);
SADMM_API bool sadmm_scene_is_scripted(const sadmm_scene *scene); /* of NULL: false */

/* Write a world as the text of a scene file, UTF-8 with a 0 at its end, to `text` of `capacity` bytes. *size: bytes
 * written, or needed, with the 0. With text NULL and capacity 0 only *size is set. Name, duration, precision and margin
 * are the scene's; scene NULL: "world", 10 s and the defaults. The world is written as it is now, without what steps
 * leave for the next ones, and without a script. Errors: INVALID_ARGUMENT (capacity less than *size, which is set;
 * nothing is written), UNAVAILABLE (a build without jansson), OUT_OF_MEMORY, those of the calls that read a world. */
SADMM_API sadmm_status sadmm_scene_write_text(const sadmm_scene *scene, sadmm_world *world, char *text,
                                              size_t capacity, size_t *size);

#ifdef __cplusplus
}
#endif
#endif
