#include "scenes.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/settings_fields.h"
#include "family.h"
#include "scene_file/scene_file.h"

#define ADDRESS(name) &sadmm_family_##name,
static const struct sadmm_scene_family *const families[] = {SADMM_SCENE_FAMILIES(ADDRESS)};

enum { FAMILY_COUNT = sizeof families / sizeof families[0] };

size_t sadmm_scene_count(void)
{
    return FAMILY_COUNT;
}

const struct sadmm_scene_info *sadmm_scene_at(size_t index)
{
    return index < FAMILY_COUNT ? &families[index]->info : NULL;
}

static const struct sadmm_scene_family *find(const char *name, size_t length)
{
    for (size_t i = 0; i < FAMILY_COUNT; ++i) {
        if (strlen(families[i]->info.name) == length && memcmp(families[i]->info.name, name, length) == 0)
            return families[i];
    }
    return NULL;
}

/* NULL: a scene from a file, or none that was opened. */
static const struct sadmm_scene_family *family_of(const struct sadmm_scene *scene)
{
    return scene && scene->info && !scene->loaded ? find(scene->info->name, strlen(scene->info->name)) : NULL;
}

static sadmm_status fail_unknown(const char *spec, struct sadmm_error *error)
{
    char names[SADMM_MESSAGE_SIZE] = "";
    size_t used = 0;

    for (size_t i = 0; i < FAMILY_COUNT && used < sizeof names; ++i) {
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s%s", i ? ", " : "", families[i]->info.name,
                                 families[i]->info.arguments);
    }
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene = \"%.16s\": must be one of %s", spec, names);
}

/* A number of the spec. Digits only, so that "+5", " 5" and "5x" are refused and not half read. */
static sadmm_status parse_number(const char *spec, char name, const char *text, size_t length, long min, long max,
                                 long *out, struct sadmm_error *error)
{
    char *end;

    errno = 0;
    *out = isdigit((unsigned char)text[0]) ? strtol(text, &end, 10) : -1;
    if (*out < 0 || errno || end != text + length)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "scene = \"%.80s\": %c must be a whole number in [%ld, %ld]", spec, name, min, max);
    if (*out < min || *out > max)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene = \"%.80s\": %c must be in [%ld, %ld]", spec,
                          name, min, max);
    return SADMM_OK;
}

/* The N and M of "name:N:M"; `text`: what follows the first colon. */
static sadmm_status parse_numbers(const struct sadmm_scene_family *family, const char *spec, const char *text, long *n,
                                  long *m, struct sadmm_error *error)
{
    const char *second = strchr(text, ':');
    sadmm_status status;

    if (family->n_max == 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene = \"%.80s\": %s takes no size", spec,
                          family->info.name);
    status = parse_number(spec, 'N', text, second && family->m_max > 0 ? (size_t)(second - text) : strlen(text),
                          family->n_min, family->n_max, n, error);
    if (status != SADMM_OK || !second) return status;
    return parse_number(spec, 'M', second + 1, strlen(second + 1), family->m_min, family->m_max, m, error);
}

static sadmm_status fail_unopened(struct sadmm_error *error)
{
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene: must come from sadmm_scene_open");
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

struct sadmm_scene_loaded {
    struct sadmm_scene_info info;
    struct sadmm_scene_file *file;
};

bool sadmm_scene_is_file(const char *spec) { return spec && sadmm_scene_file_is_path(spec); }

static bool ends_in(const char *text, const char *end)
{
    const size_t length = strlen(text), enough = strlen(end);
    if (length < enough) return false;
    for (text += length - enough; *text; ++text, ++end)
        if (tolower((unsigned char)*text) != *end) return false;
    return true;
}

bool sadmm_scene_is_model(const char *spec)
{
    static const char *const ends[] = {".urdf", ".xml", ".mjcf", ".usd", ".usda", ".usdc", ".usdz"};
    for (size_t k = 0; spec && k < sizeof ends / sizeof *ends; ++k)
        if (ends_in(spec, ends[k])) return true;
    return false;
}

static sadmm_status refuse_model(const char *path, struct sadmm_error *error)
{
    const int stem = (int)(strrchr(path, '.') - path);
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                      "%.60s: is a robot's file, which the Python package reads: \"python -m subadmm convert %.60s "
                      "%.*s.json\" makes a scene file of it, \"python -m subadmm view %.60s\" shows it run; in Python, "
                      "subadmm.load",
                      path, path, stem < 60 ? stem : 60, path, path);
}

/* A scene of a file that has been read, and that belongs to it. */
static sadmm_status take_file(struct sadmm_scene_file *file, struct sadmm_scene *scene, struct sadmm_error *error)
{
    const struct sadmm_scene_about *about = sadmm_scene_file_about(file);
    struct sadmm_scene_loaded *loaded = (struct sadmm_scene_loaded *)sadmm_alloc(1, sizeof *loaded);
    if (!loaded) {
        sadmm_scene_file_close(file);
        return sadmm_fail_memory(error, "a scene");
    }
    loaded->file = file;
    loaded->info = (struct sadmm_scene_info){.name = about->name,
                                             .arguments = "",
                                             .description = about->description,
                                             .duration = about->duration,
                                             .substeps = about->substeps[SADMM_METHOD_FAST]};
    memcpy(loaded->info.iterations, about->iterations, sizeof about->iterations);
    *scene = (struct sadmm_scene){.def = sadmm_scene_file_def(file),
                                  .duration = about->duration,
                                  .info = &loaded->info,
                                  .n = about->n < 0 ? 0 : about->n,
                                  .m = about->m < 0 ? 0 : about->m,
                                  .loaded = loaded};
    return SADMM_OK;
}

sadmm_status sadmm_scene_open_file(const char *path, struct sadmm_scene *scene, struct sadmm_error *error)
{
    struct sadmm_scene_file *file;
    if (!path) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "path = NULL: must be a string");
    if (!scene) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "out = NULL: must be given");
    TRY(sadmm_scene_file_open(path, &file, error));
    return take_file(file, scene, error);
}

sadmm_status sadmm_scene_open_text(const char *text, size_t length, const char *name, struct sadmm_scene *scene,
                                   struct sadmm_error *error)
{
    struct sadmm_scene_file *file;
    if (!text) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "text = NULL: must be given");
    if (!scene) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "out = NULL: must be given");
    TRY(sadmm_scene_file_parse(text, length, name, &file, error));
    return take_file(file, scene, error);
}

void sadmm_scene_close(struct sadmm_scene *scene)
{
    if (!scene || !scene->loaded) return;
    sadmm_scene_file_close(scene->loaded->file);
    sadmm_free(scene->loaded);
    scene->loaded = NULL;
    scene->info = NULL;
}

sadmm_status sadmm_scene_write(const struct sadmm_scene *scene, const char *spec, sadmm_world *world, FILE *stream,
                               struct sadmm_error *error)
{
    if (!scene || !scene->info) return fail_unopened(error);
    if (!world) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "world = NULL: must be given");
    if (!stream) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "stream = NULL: must be given");
    const struct sadmm_scene_info *info = scene->info;
    struct sadmm_scene_about about = {.spec = spec ? spec : info->name,
                                      .name = info->name,
                                      .description = info->description,
                                      .n = *info->arguments ? scene->n : -1,
                                      .m = scene->m > 0 ? scene->m : -1,
                                      .substeps = {[SADMM_METHOD_PAPER] = 1,
                                                   [SADMM_METHOD_FAST] = info->substeps > 0 ? info->substeps : 1}};
    memcpy(about.iterations, info->iterations, sizeof about.iterations);
    if (scene->loaded) about = *sadmm_scene_file_about(scene->loaded->file);
    about.duration = scene->duration;
    return sadmm_scene_file_write(&about, &scene->def, world, stream, error);
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

sadmm_status sadmm_scene_open(const char *spec, struct sadmm_scene *scene, struct sadmm_error *error)
{
    const struct sadmm_scene_family *family;
    const char *colon;
    long n, m;

    if (!spec) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene = NULL: must be a string");
    if (!scene) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "out = NULL: must be given");
    if (sadmm_scene_is_model(spec)) return refuse_model(spec, error);
    if (sadmm_scene_is_file(spec)) return sadmm_scene_open_file(spec, scene, error);
    colon = strchr(spec, ':');
    family = find(spec, colon ? (size_t)(colon - spec) : strlen(spec));
    if (!family) return fail_unknown(spec, error);
    n = family->n_default;
    m = family->m_default;
    if (colon) {
        sadmm_status status = parse_numbers(family, spec, colon + 1, &n, &m, error);
        if (status != SADMM_OK) return status;
    }
    *scene = (struct sadmm_scene){
        .def = sadmm_world_def_default(), .duration = family->info.duration, .info = &family->info, .n = n, .m = m
    };
    sadmm_settings_fix_work(&scene->def.settings); /* as in the paper */
    if (family->configure) family->configure(n, &scene->def);
    sadmm_scene_set_method(scene, scene->def.settings.method);
    return SADMM_OK;
}

void sadmm_scene_set_method(struct sadmm_scene *scene, sadmm_method method)
{
    const int substeps = scene->info->substeps;
    scene->def.settings.method = method;
    scene->def.settings.iterations = scene->info->iterations[method];
    scene->def.settings.substeps = method == SADMM_METHOD_FAST && substeps > 0 ? substeps : 1;
    if (scene->loaded) scene->def.settings.substeps = sadmm_scene_file_about(scene->loaded->file)->substeps[method];
}

sadmm_status sadmm_scene_build(const struct sadmm_scene *scene, sadmm_world **world, struct sadmm_error *error)
{
    const struct sadmm_scene_family *family = family_of(scene);
    sadmm_status status;

    if (!world) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "out = NULL: must be given");
    *world = NULL;
    if (!family && !(scene && scene->loaded)) return fail_unopened(error);
    status = sadmm_world_create(&scene->def, world);
    if (status != SADMM_OK) {
        char message[SADMM_MESSAGE_SIZE]; /* sadmm_fail writes the buffer that sadmm_last_message reads */
        snprintf(message, sizeof message, "%s", sadmm_last_message());
        *world = NULL;
        return sadmm_fail(error, status, "%s", message);
    }
    status = family ? family->fill(scene, *world, error) : sadmm_scene_file_fill(scene->loaded->file, *world, error);
    if (status != SADMM_OK) {
        sadmm_world_destroy(*world);
        *world = NULL;
    }
    return status;
}

sadmm_status sadmm_scene_before_step(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                     struct sadmm_error *error)
{
    const struct sadmm_scene_family *family = family_of(scene);

    if (scene && scene->loaded) return SADMM_OK;
    if (!family) return fail_unopened(error);
    return family->before_step ? family->before_step(scene, world, step, error) : SADMM_OK;
}

bool sadmm_scene_has_script(const struct sadmm_scene *scene)
{
    const struct sadmm_scene_family *family = family_of(scene);
    return family && family->before_step;
}

sadmm_status sadmm_scene_observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                 struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const struct sadmm_scene_family *family = family_of(scene);

    if (!family && !(scene && scene->loaded)) return fail_unopened(error);
    if (!result) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "result = NULL: must be given");
    return family && family->observe ? family->observe(scene, world, step, result, error) : SADMM_OK;
}

bool sadmm_scene_passed(const struct sadmm_scene_result *result)
{
    bool all = result->task_count > 0;
    for (int k = 0; k < result->task_count; ++k) all = all && result->tasks[k].passed;
    return all;
}
