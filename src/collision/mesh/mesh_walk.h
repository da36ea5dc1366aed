/* Which triangles of a mesh are near a shape: those whose box meets the shape's, in the mesh's frame, one after the
 * other, by ascending number. By a walk through the tree, or over the cells of a grid, that needs no memory.
 */
#ifndef SADMM_COLLISION_MESH_MESH_WALK_H
#define SADMM_COLLISION_MESH_MESH_WALK_H

#include "collision/base/bounds.h"
#include "collision/shapes/proxy.h"
#include "mesh_data.h"

struct mesh_walk {
    struct sadmm_box3 box;
    int32_t at;                               /* node, or cell */
    int32_t triangle, last;                   /* of the leaf, or the cell: still to be tested */
    int32_t column, column_end, row, row_end; /* of cells: where the walk goes, ends excluded */
};

/* The box in which the shape `a` of a pair meets the mesh b, in the frame of b. own: a's box in the world, with its
 * part of what the pair reaches (bounds.h), for the time that the walk is for; `time`: that time, s. */
SADMM_INLINE void mesh_reach(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const struct sadmm_box3 *own,
                             double margin, double gravity, double dt, double time, struct sadmm_box3 *box)
{
    const double thin = min_of(a->thin, b->thin), speed = v3_norm(v3_load(b->velocity)),
                 reach =
                     shape_reach(margin, thin, b->fall, fall_of(gravity, dt)) + b->spin * (time / dt) + speed * time;
    double middle[3], half[3];
    int i, k;
    for (k = 0; k < 3; ++k) {
        middle[k] = 0.5 * (own->lo[k] + own->hi[k]) - b->x[k];
        half[k] = 0.5 * (own->hi[k] - own->lo[k]) + reach;
    }
    for (i = 0; i < 3; ++i) {
        double at = 0, extent = 0;
        for (k = 0; k < 3; ++k) {
            at += b->R[3 * k + i] * middle[k];
            extent += fabs(b->R[3 * k + i]) * half[k];
        }
        extent += 16 * DBL_EPSILON * (fabs(middle[0]) + fabs(middle[1]) + fabs(middle[2]) + extent); /* rounding */
        box->lo[i] = at - extent;
        box->hi[i] = at + extent;
    }
}

/* Does the triangle's own box meet it? */
SADMM_INLINE bool mesh_triangle_near(const struct mesh *m, int32_t triangle, const struct sadmm_box3 *box)
{
    int32_t corner[3], opposite[3];
    vec3 x, y, z;
    mesh_corners(m, triangle, corner, opposite);
    x = mesh_vertex(m, corner[0]);
    y = mesh_vertex(m, corner[1]);
    z = mesh_vertex(m, corner[2]);
    return !((x.x < box->lo[0] && y.x < box->lo[0] && z.x < box->lo[0]) ||
             (x.y < box->lo[1] && y.y < box->lo[1] && z.y < box->lo[1]) ||
             (x.z < box->lo[2] && y.z < box->lo[2] && z.z < box->lo[2]) ||
             (x.x > box->hi[0] && y.x > box->hi[0] && z.x > box->hi[0]) ||
             (x.y > box->hi[1] && y.y > box->hi[1] && z.y > box->hi[1]) ||
             (x.z > box->hi[2] && y.z > box->hi[2] && z.z > box->hi[2]));
}

/* The cell that has a coordinate, of `cells` along an axis; what is beside them goes to the nearest. */
SADMM_INLINE int32_t mesh_cell(double x, double spacing, int32_t cells)
{
    const double at = x / spacing + 0.5 * cells;
    return at > 0 ? at < cells ? (int32_t)at : cells - 1 : 0;
}

SADMM_INLINE void mesh_walk_begin(const struct mesh *m, const struct sadmm_box3 *box, struct mesh_walk *w)
{
    w->box = *box;
    w->at = 0;
    w->triangle = w->last = 0;
    w->column = w->column_end = w->row = w->row_end = 0;
    if (m->kind != MESH_HEIGHTS) return;
    /* a cell more on each side: which side of a line a number is on may be rounding */
    if (!(box->lo[2] <= m->half_height && box->hi[2] >= -m->half_height)) return;
    if (!(box->hi[0] >= -0.5 * m->columns * m->spacing[0] && box->lo[0] <= 0.5 * m->columns * m->spacing[0] &&
          box->hi[1] >= -0.5 * m->rows * m->spacing[1] && box->lo[1] <= 0.5 * m->rows * m->spacing[1]))
        return;
    w->column = mesh_cell(box->lo[0] - m->spacing[0], m->spacing[0], m->columns - 1);
    w->column_end = mesh_cell(box->hi[0] + m->spacing[0], m->spacing[0], m->columns - 1) + 1;
    w->row = mesh_cell(box->lo[1] - m->spacing[1], m->spacing[1], m->rows - 1);
    w->row_end = mesh_cell(box->hi[1] + m->spacing[1], m->spacing[1], m->rows - 1) + 1;
    w->at = w->column;
}

SADMM_INLINE bool mesh_node_near(const struct mesh_node *node, const struct sadmm_box3 *box)
{
    return (box->lo[0] <= (double)node->hi[0]) & (box->hi[0] >= (double)node->lo[0]) &
           (box->lo[1] <= (double)node->hi[1]) & (box->hi[1] >= (double)node->lo[1]) &
           (box->lo[2] <= (double)node->hi[2]) & (box->hi[2] >= (double)node->lo[2]);
}

/* Set [triangle, last) to the next few to be tested; false: there are no more. */
SADMM_INLINE bool mesh_walk_on(const struct mesh *m, struct mesh_walk *w)
{
    if (m->kind == MESH_HEIGHTS) {
        if (w->row >= w->row_end) return false;
        w->triangle = 2 * (w->row * (m->columns - 1) + w->at);
        w->last = w->triangle + 2;
        if (++w->at == w->column_end) {
            w->at = w->column;
            ++w->row;
        }
        return true;
    }
    while (w->at < m->nodes) {
        const struct mesh_node node = m->node[w->at];
        if (!mesh_node_near(&node, &w->box)) {
            w->at = node.next;
            continue;
        }
        ++w->at;
        if (node.first < 0) continue;
        w->triangle = node.first >> 3;
        w->last = w->triangle + (node.first & 7);
        return true;
    }
    return false;
}

/* The next triangle, -1: there are no more. */
SADMM_INLINE int32_t mesh_walk_next(const struct mesh *m, struct mesh_walk *w)
{
    for (;;) {
        while (w->triangle < w->last) {
            const int32_t triangle = w->triangle++;
            if (mesh_triangle_near(m, triangle, &w->box)) return triangle;
        }
        if (!mesh_walk_on(m, w)) return -1;
    }
}

#endif
