/* subadmm scenes: the list, or one whole scene as a scene file. */

#include "cli.h"
#include "open_scene.h"

enum { OPTION_JSON };

static const struct cli_option options[] = {
    [OPTION_JSON] = {"json", "[FILE|-]", "write JSON to FILE, or to standard output (-, the default)"},
};

static int set_option(void *target, size_t index, const char *value)
{
    (void)index;
    return cli_read_output("--json", value, target) ? CLI_DONE : CLI_USAGE;
}

/* A step, by method. */
static json_t *iterations_json(const struct sadmm_scene_info *info)
{
    json_t *o = json_object();
    for (int m = 0; m < SADMM_METHOD_COUNT; ++m)
        json_object_set_new(o, cli_method_name((sadmm_method)m), json_integer(info->iterations[m]));
    return o;
}

static json_t *substeps_json(const struct sadmm_scene_info *info)
{
    const int fast = info->substeps > 0 ? info->substeps : 1;
    return json_pack("{si, si}", cli_method_name(SADMM_METHOD_PAPER), 1, cli_method_name(SADMM_METHOD_FAST), fast);
}

/* ---- the list ---------------------------------------------------------------------------------------------------- */

static json_t *list_json(void)
{
    json_t *array = json_array();
    for (size_t k = 0; k < sadmm_scene_count(); ++k) {
        const struct sadmm_scene_info *info = sadmm_scene_at(k);
        json_t *o = json_object();
        json_object_set_new(o, "name", json_string(info->name));
        json_object_set_new(o, "arguments", json_string(info->arguments));
        json_object_set_new(o, "description", json_string(info->description));
        json_object_set_new(o, "duration", cli_json_real(info->duration));
        json_object_set_new(o, "iterations", iterations_json(info));
        json_object_set_new(o, "substeps", substeps_json(info));
        json_array_append_new(array, o);
    }
    return array;
}

static void list_text(void)
{
    for (size_t k = 0; k < sadmm_scene_count(); ++k) {
        const struct sadmm_scene_info *info = sadmm_scene_at(k);
        int width = printf("%s%s", info->name, info->arguments);
        printf("%*s%6.3g s   %s\n", width < 24 ? 24 - width : 1, "", info->duration, info->description);
    }
}

/* ---- one scene --------------------------------------------------------------------------------------------------- */

static void show_text(const char *spec, const struct sadmm_scene *scene, sadmm_world *world)
{
    const struct sadmm_scene_info *info = scene->info;
    printf("%s%s: %s\n%d bodies, %d shapes, %g s, dt = %g s", scene->loaded ? spec : info->name, info->arguments,
           info->description, sadmm_world_body_count(world), sadmm_world_shape_count(world), scene->duration,
           scene->def.settings.dt);
    if (scene->def.settings.substeps > 1) printf(" in %d sub-steps", scene->def.settings.substeps);
    printf(", %d iterations (paper: %d; --json for all of it)\n", scene->def.settings.iterations,
           info->iterations[SADMM_METHOD_PAPER]);
}

static int write_scene(const char *spec, const struct sadmm_scene *scene, sadmm_world *world, struct output *json)
{
    struct sadmm_error error = {0};
    FILE *stream = output_stream(json);
    const sadmm_status status = sadmm_scene_write(scene, spec, world, stream, &error);
    if (status == SADMM_OK || ferror(stream)) return output_close(json);
    output_drop(json);
    return cli_error(CLI_FAILED, "%s", error.message);
}

static int show_scene(const char *spec, struct output *json)
{
    struct sadmm_scene scene;
    struct sadmm_error error = {0};
    sadmm_world *world = NULL;
    int code = cli_open_scene(spec, &scene);
    if (code != CLI_DONE) return code;
    if (sadmm_scene_build(&scene, &world, &error) != SADMM_OK) code = cli_error(CLI_FAILED, "%s", error.message);
    else if (json) code = write_scene(spec, &scene, world, json);
    else show_text(spec, &scene, world);
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);
    return code;
}

static int run(int argc, char **argv)
{
    const char *name = NULL, *operands[1];
    struct output *json;
    int code = cli_parse(&cli_scenes, argc, argv, set_option, &name, operands);
    if (code >= 0) return code;
    if (operands[0]) cli_protect_scene(operands[0]);
    if ((code = cli_open_json(name, &json)) != CLI_DONE) return code;
    if (operands[0]) return show_scene(operands[0], json);
    if (json) return cli_write_json(list_json(), json);
    list_text();
    return CLI_DONE;
}

const struct cli_command cli_scenes = {
    .name = "scenes",
    .operands = "[SCENE]",
    .summary = "list the scenes, or describe one",
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands_max = 1,
    .run = run,
};
