/* Boxes, planes and meshes. */
#include "draw_shapes.h"

/* Corner k: bit i of k says whether it is at the upper end along axis i. */
static vec3 corner(const double half[3], int k)
{
    return v3(k & 1 ? half[0] : -half[0], k & 2 ? half[1] : -half[1], k & 4 ? half[2] : -half[2]);
}

void sadmm_draw_box_faces(const struct sadmm_pen *pen, const double half[3])
{
    static const int faces[6][4] = {{1, 3, 7, 5}, {2, 0, 4, 6}, {3, 2, 6, 7}, {0, 1, 5, 4}, {4, 5, 7, 6}, {2, 3, 1, 0}};
    for (int f = 0; f < 6; ++f) {
        const int *at = faces[f];
        const vec3 normal = v3_axis(f / 2, f % 2 ? -1 : 1);
        pen_facet(pen, corner(half, at[0]), corner(half, at[1]), corner(half, at[2]), normal);
        pen_facet(pen, corner(half, at[0]), corner(half, at[2]), corner(half, at[3]), normal);
    }
}

void sadmm_draw_box_edges(const struct sadmm_pen *pen, const double half[3])
{
    for (int k = 0; k < 8; ++k)
        for (int axis = 1; axis < 8; axis *= 2)
            if (!(k & axis)) pen_line(pen, corner(half, k), corner(half, k + axis));
}

void sadmm_draw_plane_faces(const struct sadmm_pen *pen)
{
    const double s = pen->draw->plane_size;
    const vec3 up = v3(0, 0, 1);
    pen_facet(pen, v3(-s, -s, 0), v3(s, -s, 0), v3(s, s, 0), up);
    pen_facet(pen, v3(-s, -s, 0), v3(s, s, 0), v3(-s, s, 0), up);
}

void sadmm_draw_plane_edges(const struct sadmm_pen *pen)
{
    enum { CELLS = 10 };
    const double s = pen->draw->plane_size;
    for (int k = 0; k <= CELLS; ++k) {
        const double at = s * (2 * k - CELLS) / CELLS;
        pen_line(pen, v3(-s, at, 0), v3(s, at, 0));
        pen_line(pen, v3(at, -s, 0), v3(at, s, 0));
    }
}

static void triangle_of(const sadmm_mesh *mesh, int64_t t, vec3 corners[3])
{
    int32_t at[3], number;
    double x[3];
    (void)sadmm_mesh_triangle_at(mesh, t, at, &number); /* it is there */
    for (int k = 0; k < 3; ++k) {
        (void)sadmm_mesh_vertex_at(mesh, at[k], x);
        corners[k] = v3_load(x);
    }
}

void sadmm_draw_mesh_faces(const struct sadmm_pen *pen, const sadmm_mesh *mesh)
{
    vec3 c[3];
    for (int64_t t = 0; pen->draw->triangle && t < sadmm_mesh_triangle_count(mesh); ++t) {
        triangle_of(mesh, t, c);
        pen_triangle(pen, c[0], c[1], c[2]);
    }
}

/* Of every triangle all three, so that those of one triangle only are not missed. */
void sadmm_draw_mesh_edges(const struct sadmm_pen *pen, const sadmm_mesh *mesh)
{
    vec3 c[3];
    for (int64_t t = 0; pen->draw->line && t < sadmm_mesh_triangle_count(mesh); ++t) {
        triangle_of(mesh, t, c);
        for (int k = 0; k < 3; ++k) pen_line(pen, c[k], c[(k + 1) % 3]);
    }
}
