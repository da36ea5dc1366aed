/* Libraries without scenes. */
#include "subadmm/scenes.h"

#include "core/base/error.h"

static sadmm_status missing(void)
{
    return sadmm_fail(NULL, SADMM_ERROR_UNAVAILABLE, "scenes are not in this library (-Dscenes=enabled asks for them)");
}

int32_t sadmm_scene_library_count(void) { return 0; }

sadmm_status sadmm_scene_library_at(int32_t index, const char **name, const char **arguments, const char **description)
{
    (void)index, (void)name, (void)arguments, (void)description;
    return missing();
}

sadmm_status sadmm_scene_create(const char *spec, sadmm_scene **out)
{
    (void)spec;
    if (out) *out = NULL;
    return missing();
}

sadmm_status sadmm_scene_create_from_text(const char *text, size_t length, const char *name, sadmm_scene **out)
{
    (void)text, (void)length, (void)name;
    if (out) *out = NULL;
    return missing();
}

void sadmm_scene_destroy(sadmm_scene *scene) { (void)scene; }

const char *sadmm_scene_name(const sadmm_scene *scene)
{
    (void)scene;
    return NULL;
}

const char *sadmm_scene_description(const sadmm_scene *scene)
{
    (void)scene;
    return NULL;
}

double sadmm_scene_duration(const sadmm_scene *scene)
{
    (void)scene;
    return 0;
}

sadmm_status sadmm_scene_choose_method(sadmm_scene *scene, sadmm_method method)
{
    (void)scene, (void)method;
    return missing();
}

sadmm_status sadmm_scene_world_def_sized(const sadmm_scene *scene, sadmm_world_def *def, size_t size,
                                         size_t settings_size)
{
    (void)scene, (void)def, (void)size, (void)settings_size;
    return missing();
}

sadmm_status sadmm_scene_create_world(const sadmm_scene *scene, const sadmm_world_def *def, sadmm_world **out)
{
    (void)scene, (void)def;
    if (out) *out = NULL;
    return missing();
}

sadmm_status sadmm_scene_run_script(const sadmm_scene *scene, sadmm_world *world, int64_t step)
{
    (void)scene, (void)world, (void)step;
    return missing();
}

bool sadmm_scene_is_scripted(const sadmm_scene *scene)
{
    (void)scene;
    return false;
}

sadmm_status sadmm_scene_write_text(const sadmm_scene *scene, sadmm_world *world, char *text, size_t capacity,
                                    size_t *size)
{
    (void)scene, (void)world, (void)text, (void)capacity, (void)size;
    return missing();
}
