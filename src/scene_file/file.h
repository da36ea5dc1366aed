/* A scene file that has been read. */
#ifndef SADMM_SCENE_FILE_FILE_H
#define SADMM_SCENE_FILE_FILE_H

#include "document.h"
#include "scene_file.h"

struct sadmm_scene_file {
    json_t *root;
    char *name;                     /* of the file, for messages */
    struct sadmm_scene_about about; /* its strings are the document's, or `name` */
    sadmm_world_def def;
};

#endif
