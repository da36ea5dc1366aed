/* Scenes that a command is given: a spec, or the path of a scene file. */
#ifndef SADMM_CLI_OPEN_SCENE_H
#define SADMM_CLI_OPEN_SCENE_H

#include "cli.h"
#include "scenes/scenes.h"

/* Open a scene; a file that is none is a failure, an unknown name wrong usage. Returns an exit code, and says why. */
int cli_open_scene(const char *spec, struct sadmm_scene *scene);
/* If it is a file, no output may be written over it. Before outputs are opened. */
void cli_protect_scene(const char *spec);

#endif
