/* Scene files: a world, as it is at its beginning, as JSON text. docs/guide/scene-files.md describes the format,
 * docs/scene.schema.json defines it.
 *
 * Both sides of the format are here: what the writer writes of a world the reader makes of it again, bit for bit, and
 * what is written of that is the same text. Neither knows the scene library (scenes/scenes.h), which opens files in the
 * same way as names.
 *
 *   fields.c     members that are fields of the library's definitions: one table each, for both sides
 *   write.c, write_forms.c, write_parts.c, write_text.c   a world to text: the whole; hulls and meshes; joints and what
 *                is between; the text
 *   document.c   text to JSON values; errors with the path of a member
 *   read.c       the head of a file: what it is called, settings
 *   fill.c, read_forms.c, read_parts.c      the rest of it into a world: bodies, shapes; hulls and meshes; joints ...
 *   orientation.c   orientations that become those of the file
 *   missing.c    in place of all these, in builds without jansson
 *
 * Errors, of every call: UNAVAILABLE in builds without jansson; OUT_OF_MEMORY.
 */
#ifndef SADMM_SCENE_FILE_H
#define SADMM_SCENE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "core/base/error.h"
#include "subadmm/world.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a file says beside the world. */
struct sadmm_scene_about {
    const char *spec, *name, *description; /* never NULL */
    long n, m;                             /* of "name:N:M"; -1: it has none */
    double duration;                       /* s, finite, >= 0 */
    int iterations[SADMM_METHOD_COUNT];    /* a step, by method; of settings.method: the settings' */
    int substeps[SADMM_METHOD_COUNT];      /* the same */
};

struct sadmm_scene_file;

/* Is this the name of a scene file? It ends in .json, or there is a / in it. */
bool sadmm_scene_file_is_path(const char *text);

/* *out: what the file holds, the caller's until sadmm_scene_file_close; NULL after an error. It takes some 6 KB of
 * memory a body. Its head (all but bodies, shapes and what is between them) is checked, the rest where worlds are
 * filled. Errors: INVALID_ARGUMENT (the message names the line, or the path of the member, its value and what is
 * allowed), IO, LIMIT (more than 4 GiB). */
sadmm_status sadmm_scene_file_open(const char *path, struct sadmm_scene_file **out, struct sadmm_error *error);
/* The same of a text in memory, which is only read while the call lasts. name: what messages call it; NULL: nothing. */
sadmm_status sadmm_scene_file_parse(const char *text, size_t length, const char *name, struct sadmm_scene_file **out,
                                    struct sadmm_error *error);
void sadmm_scene_file_close(struct sadmm_scene_file *file); /* NULL is fine */

/* Valid as long as the file. */
const struct sadmm_scene_about *sadmm_scene_file_about(const struct sadmm_scene_file *file);
/* A default definition with the file's precision, margin and settings. */
sadmm_world_def sadmm_scene_file_def(const struct sadmm_scene_file *file);

/* Fill an empty world with what the file has in it. Errors: INVALID_ARGUMENT (as above), those of the calls that add to
 * a world. After an error the world is to be destroyed. A file may fill any number of worlds, on any number of
 * threads. */
sadmm_status sadmm_scene_file_fill(const struct sadmm_scene_file *file, sadmm_world *world, struct sadmm_error *error);

/* Write a world, with its settings, and of `def` precision and margin. Errors: IO, those of the calls that read a
 * world. */
sadmm_status sadmm_scene_file_write(const struct sadmm_scene_about *about, const sadmm_world_def *def,
                                    sadmm_world *world, FILE *stream, struct sadmm_error *error);

#ifdef __cplusplus
}
#endif

#endif
