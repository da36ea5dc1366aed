#include "open_scene.h"

int cli_open_scene(const char *spec, struct sadmm_scene *scene)
{
    struct sadmm_error error = {0};
    if (sadmm_scene_open(spec, scene, &error) == SADMM_OK) return CLI_DONE;
    const bool file = sadmm_scene_is_file(spec) || sadmm_scene_is_model(spec);
    return cli_error(file ? CLI_FAILED : CLI_USAGE, "%s", error.message);
}

void cli_protect_scene(const char *spec)
{
    if (sadmm_scene_is_file(spec)) outputs_protect(spec);
}
