/* Hulls and meshes into a scene file. */
#ifndef SADMM_SCENE_FILE_WRITE_FORMS_H
#define SADMM_SCENE_FILE_WRITE_FORMS_H

#include "writer.h"

/* The number of a hull or a mesh in its list, where it is written first if it is new. OUT_OF_MEMORY. */
sadmm_status sadmm_write_hull(struct sadmm_writer *w, const sadmm_hull *hull, json_int_t *number);
sadmm_status sadmm_write_mesh(struct sadmm_writer *w, const sadmm_mesh *mesh, json_int_t *number);

#endif
