#include "open_scene.h"

int cli_open_scene(const char *spec, struct sadmm_scene *scene)
{
    struct sadmm_error error = {0};
    if (sadmm_scene_open(spec, scene, &error) == SADMM_OK) return CLI_DONE;
    return cli_error(sadmm_scene_is_file(spec) ? CLI_FAILED : CLI_USAGE, "%s", error.message);
}

void cli_protect_scene(const char *spec)
{
    if (sadmm_scene_is_file(spec)) outputs_protect(spec);
}
