/* A triangle mesh or a heightfield as contact finding reads it: one block of memory without pointers, the same on host
 * and device, in the shape data, as hulls are (hull_data.h), and in a frame whose origin is the middle of the box
 * around it. What takes the time is memory, so that a query fetches little: boxes are float, rounded outwards.
 *
 * A block of triangles:
 *
 *   header
 *   double  vertices[vertices][3]
 *   struct  nodes[nodes]                                   a tree of boxes, depth first: mesh_walk.h
 *   int32   corner[triangles][3]                           vertices, counter-clockwise seen from outside
 *   int32   opposite[triangles][3]                         beyond the edge from corner k to the next one; -1: nothing
 *   int32   ring_first[vertices + 1], ring[2 edges]        the vertices that a vertex has edges to
 *   uint16  marks[triangles]
 *
 * Triangles are numbered as the tree comes to them. A block of heights:
 *
 *   header
 *   double  heights[rows][columns]
 *   uint16  marks[2 (columns - 1) (rows - 1)]
 *
 * where triangle 2 c is the lower half (of y) of cell c, 2 c + 1 the upper one, cells row by row.
 */
#ifndef SADMM_COLLISION_MESH_MESH_DATA_H
#define SADMM_COLLISION_MESH_MESH_DATA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "collision/hull/hull_data.h"
#include "core/math/vec3.h"

enum mesh_kind { MESH_TRIANGLES, MESH_HEIGHTS };

struct sadmm_mesh_header {
    int32_t kind, triangles;
    int32_t vertices, nodes; /* of triangles */
    int32_t ring;            /* of triangles: twice the edges */
    int32_t open_edges;
    int32_t doubles, reserved; /* as in sadmm_hull_header */
    int32_t columns, rows;     /* of heights */
    double spacing[2];         /* of heights, m */
    double half_height;        /* of heights: none is farther from 0, m */
};

enum { MESH_HEADER_DOUBLES = 8 };

/* Marks of a triangle: bit k of each of these for its edge from corner k to the next one, or for corner k.
 *   flat    what is on both sides of the edge, or all around the corner, lies in the triangle's plane: points there say
 *           nothing that points elsewhere do not
 *   own     of the triangles that have the edge, or the corner, this one is the first
 *   later   of the triangles around the corner that lie in this one's plane, side by side, another one is the first */
enum {
    MESH_EDGE_FLAT = 0,
    MESH_EDGE_OWN = 3,
    MESH_CORNER_FLAT = 6,
    MESH_CORNER_OWN = 9,
    MESH_CORNER_LATER = 12
};

/* A node's subtree is all nodes up to `next`. */
struct mesh_node {
    float lo[3], hi[3];
    int32_t next;  /* where a walk goes on that has nothing to search for here */
    int32_t first; /* of a leaf: triangle << 3 | how many; of others -1 */
};
enum { MESH_NODE_DOUBLES = 4, MESH_LEAF = 4 };
enum { MESH_MOST_COLUMNS = 16384 }; /* and rows, of heights */

SADMM_INLINE size_t mesh_triangle_doubles(size_t triangles, size_t vertices, size_t nodes, size_t ring)
{
    const size_t bytes = 4 * (6 * triangles + vertices + 1 + ring) + 2 * triangles;
    return MESH_HEADER_DOUBLES + 3 * vertices + MESH_NODE_DOUBLES * nodes + (bytes + 7) / 8;
}
SADMM_INLINE size_t mesh_height_doubles(size_t columns, size_t rows)
{
    return MESH_HEADER_DOUBLES + columns * rows + (2 * (columns - 1) * (rows - 1) + 3) / 4;
}

/* A block, taken apart. */
struct mesh {
    int kind;
    int32_t triangles, vertices, nodes;
    int32_t columns, rows;
    double spacing[2], half_height;
    const double *x; /* vertices, or heights */
    const struct mesh_node *node;
    const int32_t *corner, *opposite, *ring_first, *ring;
    const uint16_t *marks;
};

SADMM_INLINE void mesh_at(const double *blocks, uint32_t at, struct mesh *m)
{
    const double *block = blocks + at, *end;
    const struct sadmm_mesh_header *header = (const struct sadmm_mesh_header *)block;
    m->kind = header->kind;
    m->triangles = header->triangles;
    m->vertices = header->vertices;
    m->nodes = header->nodes;
    m->columns = header->columns;
    m->rows = header->rows;
    m->spacing[0] = header->spacing[0];
    m->spacing[1] = header->spacing[1];
    m->half_height = header->half_height;
    m->x = block + MESH_HEADER_DOUBLES;
    if (m->kind == MESH_HEIGHTS) {
        end = m->x + (size_t)m->columns * (size_t)m->rows;
        m->node = NULL;
        m->corner = m->opposite = m->ring_first = m->ring = NULL;
        m->marks = (const uint16_t *)end;
        return;
    }
    end = m->x + 3 * (size_t)m->vertices;
    m->node = (const struct mesh_node *)end;
    m->corner = (const int32_t *)(end + MESH_NODE_DOUBLES * (size_t)m->nodes);
    m->opposite = m->corner + 3 * (size_t)m->triangles;
    m->ring_first = m->opposite + 3 * (size_t)m->triangles;
    m->ring = m->ring_first + m->vertices + 1;
    m->marks = (const uint16_t *)(m->ring + header->ring);
}

/* ---- vertices, by number ----------------------------------------------------------------------------------------- */

SADMM_INLINE vec3 mesh_vertex(const struct mesh *m, int32_t v)
{
    if (m->kind == MESH_HEIGHTS) {
        const int32_t row = v / m->columns, column = v - row * m->columns;
        return v3((real)(((double)column - 0.5 * (m->columns - 1)) * m->spacing[0]),
                  (real)(((double)row - 0.5 * (m->rows - 1)) * m->spacing[1]), (real)m->x[v]);
    }
    return v3_load(m->x + 3 * (size_t)v);
}

/* The k-th vertex that v has an edge to, -1: there are no more. Of heights some are left out: -2. */
SADMM_INLINE int32_t mesh_neighbour(const struct mesh *m, int32_t v, int k)
{
    if (m->kind == MESH_HEIGHTS) {
        /* along the grid, and along the diagonal of the cells */
        const int32_t row = v / m->columns, column = v - row * m->columns, sign = k % 2 ? -1 : 1,
                      to_column = column + (k / 2 != 1 ? sign : 0), to_row = row + (k / 2 != 0 ? sign : 0);
        if (k >= 6) return -1;
        return to_column >= 0 && to_column < m->columns && to_row >= 0 && to_row < m->rows
                   ? to_row * m->columns + to_column
                   : -2;
    }
    return m->ring_first[v] + k < m->ring_first[v + 1] ? m->ring[m->ring_first[v] + k] : -1;
}

/* The corners of a triangle, and the vertex beyond the edge from corner k to the next one, -1: there is none. */
SADMM_INLINE void mesh_corners(const struct mesh *m, int32_t triangle, int32_t corner[3], int32_t opposite[3])
{
    int k;
    if (m->kind == MESH_HEIGHTS) {
        const int32_t cell = triangle / 2, row = cell / (m->columns - 1), column = cell - row * (m->columns - 1),
                      low = row * m->columns + column, high = low + m->columns + 1;
        const bool upper = triangle % 2 != 0;
        corner[0] = low;
        corner[1] = upper ? high : low + 1;
        corner[2] = upper ? high - 1 : high;
        /* of the lower half: below, to the right, across the diagonal; of the upper one across it, above, to
         * the left */
        if (upper) {
            opposite[0] = low + 1;
            opposite[1] = row + 2 < m->rows ? high + m->columns : -1;
            opposite[2] = column > 0 ? low - 1 : -1;
        } else {
            opposite[0] = row > 0 ? low - m->columns : -1;
            opposite[1] = column + 2 < m->columns ? high + 1 : -1;
            opposite[2] = high - 1;
        }
        return;
    }
    for (k = 0; k < 3; ++k) {
        corner[k] = m->corner[3 * (size_t)triangle + (size_t)k];
        opposite[k] = m->opposite[3 * (size_t)triangle + (size_t)k];
    }
}

SADMM_INLINE bool mesh_marked(uint32_t marks, int mark, int k) { return (marks >> (mark + k) & 1u) != 0; }

/* The next corner, or edge, of a triangle. */
SADMM_INLINE int mesh_next_corner(int k) { return k < 2 ? k + 1 : 0; }

#endif
