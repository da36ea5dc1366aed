/* Surfaces (faces) and edges of shapes, each in its own frame. */
#ifndef SADMM_WORLD_DRAW_DRAW_SHAPES_H
#define SADMM_WORLD_DRAW_DRAW_SHAPES_H

#include "collision/shapes/shape.h"
#include "pen.h"

/* Of a sphere, capsule, cylinder, cone or ellipsoid. */
void sadmm_draw_round_faces(const struct sadmm_pen *pen, const struct sadmm_geometry *geometry);
void sadmm_draw_round_edges(const struct sadmm_pen *pen, const struct sadmm_geometry *geometry);

/* half: extents of the box around the frame's origin. */
void sadmm_draw_box_faces(const struct sadmm_pen *pen, const double half[3]);
void sadmm_draw_box_edges(const struct sadmm_pen *pen, const double half[3]);
void sadmm_draw_plane_faces(const struct sadmm_pen *pen);
void sadmm_draw_plane_edges(const struct sadmm_pen *pen);

/* block: of a hull (collision/hull/hull_data.h), in its own frame. */
void sadmm_draw_hull_faces(const struct sadmm_pen *pen, const double *block);
void sadmm_draw_hull_edges(const struct sadmm_pen *pen, const double *block);
/* In the frame of the vertices. */
void sadmm_draw_mesh_faces(const struct sadmm_pen *pen, const sadmm_mesh *mesh);
void sadmm_draw_mesh_edges(const struct sadmm_pen *pen, const sadmm_mesh *mesh);

#endif
