/* A convex polytope as contact finding reads it: one block of memory without pointers, the same on host and device.
 *
 * The shape data of a world is an array of doubles with a block for every hull; a geometry has the offset of its block.
 * The first blocks are always the same: the unit cube, a segment and a point, which boxes, capsules and spheres are to
 * a hull (polytope.h scales them).
 *
 * A block:
 *
 *   header                                                    counts, and the radius of the ball that rounds the hull
 *   double   x, y, z of the vertices                          each vertex_stride long
 *   double   x, y, z, offset of the faces                     each face_stride long: normal . point <= offset inside
 *   uint16   face_first[faces + 1]                            a face's corners: [face_first[f], face_first[f + 1])
 *   uint16   corner_vertex[2 edges], corner_edge[2 edges]     counter-clockwise seen from outside; the edge that leaves
 *   uint16   edge_vertex[2 edges], edge_face[2 edges]         from, to; the face whose corners run that way, the other
 *   uint16   vertex_first[vertices + 1], vertex_next[2 edges] a vertex's neighbours along edges
 *
 * Padding up to a stride repeats the first entry, and never wins a search for the first largest. Normals are unit and
 * point outward; an offset is the largest of its face's corners', so that no vertex is outside by more than what nearly
 * flat faces were merged by.
 */
#ifndef SADMM_COLLISION_HULL_HULL_DATA_H
#define SADMM_COLLISION_HULL_HULL_DATA_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/inline.h"

enum {
    HULL_MOST_VERTICES = 8192,
    HULL_MOST_EDGES = 32767, /* an axis of two edges is remembered in 2 + 15 + 15 bits */
    HULL_LANES = 4           /* strides are multiples of it */
};

struct sadmm_hull_header {
    int32_t vertices, faces, edges; /* all faces have 2 x edges corners */
    int32_t climbs; /* not 0: along edges every way up ends at the top, but for rounding. Not so where faces are
                       merged */
    int32_t vertex_stride, face_stride;
    int32_t doubles; /* the whole block */
    int32_t reserved;
    double convex_radius; /* m: the hull is the points' with a ball of this radius around every point of it */
};

enum { HULL_HEADER_DOUBLES = 5 };

SADMM_INLINE int32_t hull_stride(int32_t count) { return (count + HULL_LANES - 1) / HULL_LANES * HULL_LANES; }

/* 16-bit numbers of a block, and all of it in doubles. */
SADMM_INLINE int32_t hull_links(int32_t vertices, int32_t faces, int32_t edges)
{
    return faces + 1 + 4 * edges + 4 * edges + vertices + 1 + 2 * edges;
}
SADMM_INLINE int32_t hull_doubles(int32_t vertices, int32_t faces, int32_t edges)
{
    return HULL_HEADER_DOUBLES + 3 * hull_stride(vertices) + 4 * hull_stride(faces) +
           (hull_links(vertices, faces, edges) + 3) / 4;
}

/* Offsets of the blocks that all shape data begins with, and of the first of its own. */
enum {
    HULL_CUBE = 0,      /* half extents 1. Vertex v: bit k set where coordinate k is +1 */
    HULL_CUBE_DOUBLES = HULL_HEADER_DOUBLES + 24 + 32 + 34, /* 8 vertices, 6 faces, 12 edges: 7 + 48 + 48 + 9 + 24 = 136
                                                               links */
    HULL_SEGMENT = HULL_CUBE + HULL_CUBE_DOUBLES, /* (0, 0, -1) to (0, 0, 1); no face */
    HULL_SEGMENT_DOUBLES = HULL_HEADER_DOUBLES + 12 + 0 + 4, /* 2 vertices, 1 edge: 1 + 4 + 4 + 3 + 2 = 14 links */
    HULL_POINT = HULL_SEGMENT + HULL_SEGMENT_DOUBLES,
    HULL_POINT_DOUBLES = HULL_HEADER_DOUBLES + 12 + 0 + 1, /* 1 vertex: 1 + 2 = 3 links */
    HULL_FIRST_OWN = HULL_POINT + HULL_POINT_DOUBLES
};

#endif
