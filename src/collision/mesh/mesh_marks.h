/* Marks of triangles (mesh_data.h): which edges and corners are flat, and which triangle makes the points of those that
 * several share. */
#ifndef SADMM_COLLISION_MESH_MESH_MARKS_H
#define SADMM_COLLISION_MESH_MESH_MARKS_H

#include <stdbool.h>

#include "mesh_data.h"

/* The marks of every triangle of a block that has all else. beside: 3 a triangle; NULL: a heightfield. False: out of
 * memory. */
bool sadmm_mesh_mark_triangles(const struct mesh *m, const int32_t *beside, uint16_t *marks);

#endif
