/* Which triangles of a mesh are near a shape, by the lanes of a warp: those that collision/mesh/mesh_walk.h comes to,
 * in any order. A thread by itself would wait for memory at every cell of a heightfield and every node of a tree. */
#ifndef SADMM_CUDA_COLLIDE_MESH_LANES_H
#define SADMM_CUDA_COLLIDE_MESH_LANES_H

#include "backend_cuda/device/parallel.h"
#include "collision/mesh/box_tree.h"
#include "collision/mesh/mesh_walk.h"

/* Nodes that wait, last in, first out. The lanes take a node each, which at most as many more wait for; fewer lanes do
 * where many wait, in the end one: depth first, as box_tree.c makes the nodes, of a subtree no more wait than
 * BOX_TREE_WAITING. */
enum {
    NODES_SIDE_BY_SIDE = 224,
    NODES_WAITING = NODES_SIDE_BY_SIDE + BOX_TREE_WAITING + 1
};
struct waiting_nodes {
    int32_t node[NODES_WAITING];
};

/* Every lane of the warp calls it; f(triangle) is called by one of them for each. */
template <class F>
static __device__ __forceinline__ void each_cell_near(const struct mesh *mesh, const struct mesh_walk *walk, int lane,
                                                      const F &f)
{
    const int32_t width = 2 * (walk->column_end - walk->column), count = width * (walk->row_end - walk->row);
    for (int32_t k = lane; k < count; k += WARP_LANES) {
        const int32_t row = walk->row + k / width,
                      triangle = 2 * (row * (mesh->columns - 1) + walk->column) + k % width;
        if (mesh_triangle_near(mesh, triangle, &walk->box)) f(triangle);
    }
}

template <class F>
static __device__ __forceinline__ void each_leaf_near(const struct mesh *mesh, const struct sadmm_box3 *box, int lane,
                                                      struct waiting_nodes *waiting, const F &f)
{
    int32_t count = mesh->nodes > 0;
    if (lane == 0) waiting->node[0] = 0;
    while (count > 0) {
        const int32_t room = NODES_SIDE_BY_SIDE - count, most = room < WARP_LANES ? room : (int32_t)WARP_LANES,
                      wanted = count < most ? count : most, taken = wanted > 1 ? wanted : 1;
        struct mesh_node node = {};
        int32_t at = -1, second = -1;
        __syncwarp(0xffffffffu);
        if (lane < taken) {
            at = waiting->node[count - 1 - lane];
            node = mesh->node[at];
        }
        const bool near = at >= 0 && mesh_node_near(&node, box), parts = near && node.first < 0;
        if (parts) second = mesh->node[at + 1].next;
        const unsigned lanes = __ballot_sync(0xffffffffu, parts);
        __syncwarp(0xffffffffu);
        /* the last one's parts on top, of which the first one, as a walk through the tree goes */
        const int32_t place = count - taken + 2 * __popc(lanes & ~((2u << lane) - 1));
        if (parts) {
            waiting->node[place] = second;
            waiting->node[place + 1] = at + 1;
        }
        count += 2 * __popc(lanes) - taken;
        if (!near || parts) continue;
        const int32_t first = node.first >> 3, end = first + (node.first & 7);
        for (int32_t triangle = first; triangle < end; ++triangle)
            if (mesh_triangle_near(mesh, triangle, box)) f(triangle);
    }
    __syncwarp(0xffffffffu);
}

template <class F>
static __device__ __forceinline__ void each_triangle_near(const struct mesh *mesh, const struct sadmm_box3 *box,
                                                          int lane, struct waiting_nodes *waiting, const F &f)
{
    struct mesh_walk walk;
    mesh_walk_begin(mesh, box, &walk);
    if (mesh->kind == MESH_HEIGHTS) each_cell_near(mesh, &walk, lane, f);
    else each_leaf_near(mesh, box, lane, waiting, f);
}

#endif
