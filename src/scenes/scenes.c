#include "scenes.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "family.h"

static const struct sadmm_scene_family *const families[] = {
    &sadmm_family_sliding_cubes, &sadmm_family_vertical_stacks, &sadmm_family_oblique_stacks,
    &sadmm_family_card_houses,   &sadmm_family_pyramid,         &sadmm_family_pile,
    &sadmm_family_mixed_pile,    &sadmm_family_sliding_pile,    &sadmm_family_settled_pile,
    &sadmm_family_burst,         &sadmm_family_kicked_cubes,    &sadmm_family_incline,
    &sadmm_family_bounce,        &sadmm_family_spin_plate,      &sadmm_family_rolling,
    &sadmm_family_rocking,       &sadmm_family_two_balls,       &sadmm_family_dominoes,
    &sadmm_family_falling_chain, &sadmm_family_chain,           &sadmm_family_four_bar,
    &sadmm_family_slider_crank,  &sadmm_family_bricard,
};

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

static const struct sadmm_scene_family *family_of(const struct sadmm_scene *scene)
{
    return scene && scene->info ? find(scene->info->name, strlen(scene->info->name)) : NULL;
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

/* The N of "name:N": digits only, so that "+5", " 5" and "5x" are refused and not half read. */
static sadmm_status parse_size(const struct sadmm_scene_family *family, const char *text, long *n,
                               struct sadmm_error *error)
{
    char *end;

    if (family->n_max == 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene = \"%s:%.40s\": %s takes no size",
                          family->info.name, text, family->info.name);
    errno = 0;
    *n = isdigit((unsigned char)text[0]) ? strtol(text, &end, 10) : -1;
    if (*n < 0 || errno || *end)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "scene = \"%s:%.40s\": N must be a whole number in [%ld, %ld]", family->info.name, text,
                          family->n_min, family->n_max);
    if (*n < family->n_min || *n > family->n_max)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene = \"%s:%ld\": N must be in [%ld, %ld]",
                          family->info.name, *n, family->n_min, family->n_max);
    return SADMM_OK;
}

sadmm_status sadmm_scene_open(const char *spec, struct sadmm_scene *scene, struct sadmm_error *error)
{
    const struct sadmm_scene_family *family;
    const char *colon;
    long n;

    if (!spec) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene = NULL: must be a string");
    if (!scene) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene out = NULL: must not be NULL");
    colon = strchr(spec, ':');
    family = find(spec, colon ? (size_t)(colon - spec) : strlen(spec));
    if (!family) return fail_unknown(spec, error);
    n = family->n_default;
    if (colon) {
        sadmm_status status = parse_size(family, colon + 1, &n, error);
        if (status != SADMM_OK) return status;
    }
    *scene = (struct sadmm_scene){
        .def = sadmm_world_def_default(), .duration = family->info.duration, .info = &family->info, .n = n
    };
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
}

sadmm_status sadmm_scene_build(const struct sadmm_scene *scene, sadmm_world **world, struct sadmm_error *error)
{
    const struct sadmm_scene_family *family = family_of(scene);
    sadmm_status status;

    if (!world) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "world out = NULL: must not be NULL");
    *world = NULL;
    if (!family) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene: must come from sadmm_scene_open");
    status = sadmm_world_create(&scene->def, world);
    if (status != SADMM_OK) {
        char message[SADMM_MESSAGE_SIZE]; /* sadmm_fail writes the buffer that sadmm_last_message reads */
        snprintf(message, sizeof message, "%s", sadmm_last_message());
        *world = NULL;
        return sadmm_fail(error, status, "%s", message);
    }
    status = family->fill(scene, *world, error);
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

    if (!family) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "scene: must come from sadmm_scene_open");
    return family->before_step ? family->before_step(scene, world, step, error) : SADMM_OK;
}
