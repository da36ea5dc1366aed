/* The public form of the scene library: objects of the caller's, and errors as this thread's last message. */
#include "subadmm/scenes.h"

#include <stdio.h>
#include <string.h>

#include "core/base/memory.h"
#include "scene_file/scene_file.h"
#include "scenes.h"

#define REFUSE(...) return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, __VA_ARGS__)

int32_t sadmm_scene_library_count(void) { return (int32_t)sadmm_scene_count(); }

sadmm_status sadmm_scene_library_at(int32_t index, const char **name, const char **arguments, const char **description)
{
    const int32_t count = sadmm_scene_library_count();
    if (index < 0 || index >= count) REFUSE("index = %d: must be in [0, %d)", (int)index, (int)count);
    const struct sadmm_scene_info *info = sadmm_scene_at((size_t)index);
    if (name) *name = info->name;
    if (arguments) *arguments = info->arguments;
    if (description) *description = info->description;
    return SADMM_OK;
}

/* text: of `length` bytes; NULL: `spec` says what it is. */
static sadmm_status create(const char *spec, const char *text, size_t length, sadmm_scene **out)
{
    if (!out) REFUSE("out = NULL: must be given");
    *out = NULL;
    sadmm_scene *made = (sadmm_scene *)sadmm_alloc(1, sizeof *made);
    if (!made) return sadmm_fail_memory(NULL, "a scene");
    const sadmm_status status =
        text ? sadmm_scene_open_text(text, length, spec, made, NULL) : sadmm_scene_open(spec, made, NULL);
    if (status == SADMM_OK)
        *out = made;
    else
        sadmm_free(made);
    return status;
}

sadmm_status sadmm_scene_create(const char *spec, sadmm_scene **out) { return create(spec, NULL, 0, out); }

sadmm_status sadmm_scene_create_from_text(const char *text, size_t length, const char *name, sadmm_scene **out)
{
    if (!text) REFUSE("text = NULL: must be given");
    return create(name, text, length, out);
}

void sadmm_scene_destroy(sadmm_scene *scene)
{
    sadmm_scene_close(scene);
    sadmm_free(scene);
}

const char *sadmm_scene_name(const sadmm_scene *scene) { return scene ? scene->info->name : NULL; }
const char *sadmm_scene_description(const sadmm_scene *scene) { return scene ? scene->info->description : NULL; }
double sadmm_scene_duration(const sadmm_scene *scene) { return scene ? scene->duration : 0; }

sadmm_status sadmm_scene_choose_method(sadmm_scene *scene, sadmm_method method)
{
    if (!scene) REFUSE("scene = NULL: must be given");
    if ((int)method < 0 || (int)method >= (int)SADMM_METHOD_COUNT)
        REFUSE("method = %d: must be in [0, %d)", (int)method, (int)SADMM_METHOD_COUNT);
    sadmm_scene_set_method(scene, method);
    return SADMM_OK;
}

sadmm_status sadmm_scene_world_def_sized(const sadmm_scene *scene, sadmm_world_def *def, size_t size,
                                         size_t settings_size)
{
    if (!scene) REFUSE("scene = NULL: must be given");
    if (!def) REFUSE("def = NULL: must be given");
    sadmm_world_def_init(def, size, settings_size);
    def->backend = scene->def.backend;
    def->precision = scene->def.precision;
    def->device = scene->def.device;
    def->contact_margin = scene->def.contact_margin;
    def->tasks = scene->def.tasks;
    /* What is beside its size, as far as the program knows it. */
    const size_t own = sizeof def->settings.struct_size;
    const size_t known = settings_size < sizeof scene->def.settings ? settings_size : sizeof scene->def.settings;
    if (known > own) memcpy((char *)&def->settings + own, (const char *)&scene->def.settings + own, known - own);
    return SADMM_OK;
}

sadmm_status sadmm_scene_create_world(const sadmm_scene *scene, const sadmm_world_def *def, sadmm_world **out)
{
    if (!out) REFUSE("out = NULL: must be given");
    *out = NULL;
    if (!scene) REFUSE("scene = NULL: must be given");
    if (!def) return sadmm_scene_build(scene, out, NULL);
    /* The program's headers may be of another version: a world that is made from it knows what was meant. */
    sadmm_scene with = *scene;
    sadmm_world *probe;
    TRY(sadmm_world_create(def, &probe));
    with.def.settings = sadmm_world_settings(probe);
    sadmm_world_destroy(probe);
    with.def.backend = def->backend;
    with.def.precision = def->precision;
    with.def.device = def->device;
    with.def.contact_margin = def->contact_margin;
    with.def.tasks = def->tasks;
    return sadmm_scene_build(&with, out, NULL);
}

bool sadmm_scene_is_scripted(const sadmm_scene *scene) { return sadmm_scene_has_script(scene); }

sadmm_status sadmm_scene_run_script(const sadmm_scene *scene, sadmm_world *world, int64_t step)
{
    if (!scene) REFUSE("scene = NULL: must be given");
    if (!world) REFUSE("world = NULL: must be given");
    if (step < 0) REFUSE("step = %lld: must be >= 0", (long long)step);
    return sadmm_scene_before_step(scene, world, step, NULL);
}

static sadmm_status write_to(const sadmm_scene *scene, sadmm_world *world, FILE *stream)
{
    if (scene) return sadmm_scene_write(scene, NULL, world, stream, NULL);
    const sadmm_settings settings = sadmm_world_settings(world);
    const sadmm_world_def def = sadmm_world_def_default();
    struct sadmm_scene_about about = {
        .spec = "world", .name = "world", .description = "", .n = -1, .m = -1, .duration = 10};
    for (int k = 0; k < SADMM_METHOD_COUNT; ++k) {
        about.iterations[k] = settings.iterations;
        about.substeps[k] = settings.substeps;
    }
    return sadmm_scene_file_write(&about, &def, world, stream, NULL);
}

sadmm_status sadmm_scene_write_text(const sadmm_scene *scene, sadmm_world *world, char *text, size_t capacity,
                                    size_t *size)
{
    if (!world) REFUSE("world = NULL: must be given");
    if (!size) REFUSE("size = NULL: must be given");
    if (!text && capacity > 0) REFUSE("text = NULL: must be given where capacity = %zu", capacity);
    FILE *stream = tmpfile();
    if (!stream) return sadmm_fail(NULL, SADMM_ERROR_IO, "a temporary file cannot be made");
    sadmm_status status = write_to(scene, world, stream);
    long length = -1;
    if (status == SADMM_OK) {
        length = fflush(stream) == 0 && !ferror(stream) ? ftell(stream) : -1;
        if (length < 0) status = sadmm_fail(NULL, SADMM_ERROR_IO, "a temporary file cannot be written");
    }
    if (status == SADMM_OK) {
        *size = (size_t)length + 1;
        if (text && capacity < *size)
            status = sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "capacity = %zu: must be >= %zu", capacity, *size);
    }
    if (status == SADMM_OK && text) {
        rewind(stream);
        if (fread(text, 1, (size_t)length, stream) == (size_t)length)
            text[length] = 0;
        else
            status = sadmm_fail(NULL, SADMM_ERROR_IO, "a temporary file cannot be read");
    }
    fclose(stream);
    return status;
}
