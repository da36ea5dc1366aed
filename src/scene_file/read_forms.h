/* A scene file's lists of hulls and meshes. */
#ifndef SADMM_SCENE_FILE_READ_FORMS_H
#define SADMM_SCENE_FILE_READ_FORMS_H

#include "filler.h"

sadmm_status sadmm_read_hulls(struct sadmm_filler *f);
sadmm_status sadmm_read_meshes(struct sadmm_filler *f);

#endif
