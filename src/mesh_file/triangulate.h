/* Faces into triangles. */
#ifndef SADMM_MESH_FILE_TRIANGULATE_H
#define SADMM_MESH_FILE_TRIANGULATE_H

#include "parts.h"

/* corner_count - 2 face_count triangles of all faces, as mesh_file.h says, 3 vertices each; to be freed in any case.
 * Counts the faces that cross themselves. */
sadmm_status sadmm_mesh_file_triangulate(struct mesh_parts *parts, int32_t **triangles);

#endif
