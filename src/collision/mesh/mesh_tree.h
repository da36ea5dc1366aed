/* The tree of boxes over the triangles of a mesh. */
#ifndef SADMM_COLLISION_MESH_MESH_TREE_H
#define SADMM_COLLISION_MESH_MESH_TREE_H

#include "box_tree.h"

/* vertices: 3 numbers each; corners: 3 a triangle. The same input gives the same tree. False: out of memory. */
bool sadmm_mesh_tree_make(const double *vertices, const int32_t *corners, int32_t triangles, struct box_tree *tree);

#endif
