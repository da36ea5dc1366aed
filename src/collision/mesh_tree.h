/* The tree of boxes over the triangles of a mesh. */
#ifndef SADMM_COLLISION_MESH_TREE_H
#define SADMM_COLLISION_MESH_TREE_H

#include <stdbool.h>
#include <stdint.h>

#include "mesh_data.h"

struct mesh_tree {
    int32_t *order;          /* triangles as the tree comes to them */
    struct mesh_node *nodes; /* depth first */
    int32_t count;
};

/* vertices: 3 numbers each; corners: 3 a triangle. The same input gives the same tree. False: out of memory. */
bool sadmm_mesh_tree_make(const double *vertices, const int32_t *corners, int32_t triangles, struct mesh_tree *tree);
void sadmm_mesh_tree_free(struct mesh_tree *tree);

#endif
