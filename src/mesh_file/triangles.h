/* Triangles of vertices of the file, into what callers get. */
#ifndef SADMM_MESH_FILE_TRIANGLES_H
#define SADMM_MESH_FILE_TRIANGLES_H

#include "parts.h"

/* Merge vertices that are equal: triangles then have the first of them. */
sadmm_status sadmm_mesh_file_merge(struct mesh_parts *parts, int32_t *triangles, size_t count);
/* Count triangles without area, and leave them out if `drop`; returns how many there are. */
size_t sadmm_mesh_file_drop_degenerate(struct mesh_parts *parts, int32_t *triangles, size_t count, bool drop);
/* Leave vertices out that no triangle has. */
sadmm_status sadmm_mesh_file_drop_unused(struct mesh_parts *parts, int32_t *triangles, size_t count);

#endif
