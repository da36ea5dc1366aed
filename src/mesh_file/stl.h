/* STL files: a word and three points a triangle, in text or in bytes. */
#ifndef SADMM_MESH_FILE_STL_H
#define SADMM_MESH_FILE_STL_H

#include <stdbool.h>

#include "parts.h"

/* Bytes of a binary file: what is before the triangles, and of each of them. */
enum { STL_HEADER = 84, STL_TRIANGLE = 50 };

/* The file has the size that its number of triangles says. */
bool sadmm_mesh_file_is_binary_stl(const struct mesh_source *source);
sadmm_status sadmm_mesh_file_read_stl(struct mesh_parts *parts);

#endif
