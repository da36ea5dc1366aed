/* Builds without jansson have no scene files. */
#include "scene_file.h"

static sadmm_status missing(struct sadmm_error *error)
{
    return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE,
                      "scene files need jansson, which this program was built without (-Dcli=enabled asks for it)");
}

sadmm_status sadmm_scene_file_open(const char *path, struct sadmm_scene_file **out, struct sadmm_error *error)
{
    (void)path;
    *out = NULL;
    return missing(error);
}

sadmm_status sadmm_scene_file_parse(const char *text, size_t length, const char *name, struct sadmm_scene_file **out,
                                    struct sadmm_error *error)
{
    (void)text, (void)length, (void)name;
    *out = NULL;
    return missing(error);
}

void sadmm_scene_file_close(struct sadmm_scene_file *file) { (void)file; }

const struct sadmm_scene_about *sadmm_scene_file_about(const struct sadmm_scene_file *file)
{
    (void)file;
    return NULL;
}

sadmm_world_def sadmm_scene_file_def(const struct sadmm_scene_file *file)
{
    (void)file;
    return sadmm_world_def_default();
}

sadmm_status sadmm_scene_file_fill(const struct sadmm_scene_file *file, sadmm_world *world, struct sadmm_error *error)
{
    (void)file, (void)world;
    return missing(error);
}

sadmm_status sadmm_scene_file_write(const struct sadmm_scene_about *about, const sadmm_world_def *def,
                                    sadmm_world *world, FILE *stream, struct sadmm_error *error)
{
    (void)about, (void)def, (void)world, (void)stream;
    return missing(error);
}
