/* A polyhedron as faces, loops of corners. */
#ifndef SADMM_COLLISION_HULL_HULL_MESH_H
#define SADMM_COLLISION_HULL_HULL_MESH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct hull_mesh {
    int32_t vertex_count, face_count, edge_count;
    int32_t *point;      /* of a vertex: the point that it is */
    int32_t *face_first; /* corners of a face: [face_first[f], face_first[f + 1]) */
    int32_t *corner;     /* vertices, counter-clockwise seen from outside */
    /* Edges, once sadmm_hull_mesh_link has run; their order is that in which the corners come to them. */
    int32_t *corner_edge; /* the edge that leaves a corner */
    int32_t *edge_corner; /* 2 an edge: the corners that it leaves, in its own direction and in the other */
};

void sadmm_hull_mesh_free(struct hull_mesh *mesh);

/* One more face, whose corners are points so far; false: out of memory. */
bool sadmm_hull_mesh_add(struct hull_mesh *mesh, const int32_t *points, int32_t count);

enum hull_mesh_is { HULL_MESH_CLOSED, HULL_MESH_OPEN, HULL_MESH_NO_MEMORY };

/* Faces that have been added, of `point_count` points: number the vertices in the order of the points, leave out those
 * that are corners of two faces alone, and link edges. CLOSED: every edge is between two faces that go along it either
 * way, no face comes to a vertex twice, and vertices - edges + faces = 2. */
enum hull_mesh_is sadmm_hull_mesh_close(struct hull_mesh *mesh, int32_t point_count);

/* Number the vertices of a closed mesh by `rank` (of a vertex, a permutation), begin every face with its lowest and put
 * faces in order; `planes`, 4 numbers a face, go along. False: out of memory. */
bool sadmm_hull_mesh_order(struct hull_mesh *mesh, const int32_t *rank, double *planes);

/* The face that a corner is of. */
int32_t sadmm_hull_mesh_face_of(const struct hull_mesh *mesh, int32_t corner);

#endif
