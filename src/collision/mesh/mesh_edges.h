/* Triangles by their corners: which are beside each other, and which vertices are. */
#ifndef SADMM_COLLISION_MESH_MESH_EDGES_H
#define SADMM_COLLISION_MESH_MESH_EDGES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mesh_edges {
    int32_t *opposite;          /* 3 a triangle: the vertex beyond the edge from corner k to the next one; -1: none, or
                                   more than one */
    int32_t *beside;            /* the triangle there, -1 */
    int32_t *ring_first, *ring; /* vertices + 1; twice the edges: what a vertex has edges to, ascending */
    int32_t ring_count;
    int32_t open; /* edges without a triangle, or with more than one, beyond */
};

/* corners: 3 a triangle, in [0, vertices). False: out of memory. */
bool sadmm_mesh_edges_find(const int32_t *corners, int32_t triangles, int32_t vertices, struct mesh_edges *out);
void sadmm_mesh_edges_free(struct mesh_edges *edges);

#endif
