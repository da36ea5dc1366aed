/* PLY files: a header that says which rows of which values follow, and the rows, in text or in bytes. */
#ifndef SADMM_MESH_FILE_PLY_H
#define SADMM_MESH_FILE_PLY_H

#include "parts.h"

sadmm_status sadmm_mesh_file_read_ply(struct mesh_parts *parts);

#endif
