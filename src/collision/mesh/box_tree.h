/* A tree of boxes: over the triangles of a mesh, and over the shapes of a world (query_tree.h). Its nodes are those of
 * mesh_data.h. */
#ifndef SADMM_COLLISION_MESH_BOX_TREE_H
#define SADMM_COLLISION_MESH_BOX_TREE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "mesh_data.h"

struct float_box {
    float lo[3], hi[3];
};

/* Along one axis, rounded outwards. */
static inline void float_box_set(double lo, double hi, int axis, struct float_box *box)
{
    box->lo[axis] = (float)lo;
    box->hi[axis] = (float)hi;
    if ((double)box->lo[axis] > lo) box->lo[axis] = nextafterf(box->lo[axis], -HUGE_VALF);
    if ((double)box->hi[axis] < hi) box->hi[axis] = nextafterf(box->hi[axis], HUGE_VALF);
}

/* So many nodes wait at most when a tree is gone through depth first, first parts first. */
enum { BOX_TREE_WAITING = 96 };

struct box_tree {
    int32_t *order;          /* boxes as the tree comes to them */
    struct mesh_node *nodes; /* depth first */
    int32_t count;
};

/* Sizes and twice the middles are numbers. The same boxes give the same tree; none: one without nodes. False: out of
 * memory. */
bool sadmm_box_tree_make(const struct float_box *boxes, int32_t count, struct box_tree *tree);
void sadmm_box_tree_free(struct box_tree *tree);

#endif
