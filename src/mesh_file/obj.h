/* OBJ files: lines of text. */
#ifndef SADMM_MESH_FILE_OBJ_H
#define SADMM_MESH_FILE_OBJ_H

#include "parts.h"

sadmm_status sadmm_mesh_file_read_obj(struct mesh_parts *parts);

#endif
