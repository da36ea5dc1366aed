#include "mesh_marks.h"

#include <math.h>

#include "core/base/memory.h"
#include "mesh_triangle.h"

/* Sine of the angle between two triangles below which they lie in one plane: vertices given in single precision bend
 * flat ground by about so much. */
static const double flattest = 1e-5;

/* Does the vertex lie in the triangle's plane, seen from its corner k? */
static bool is_in_plane(const struct mesh *m, const struct mesh_triangle *t, int k, int32_t vertex)
{
    const vec3 d = v3_sub(v3_sub(mesh_vertex(m, vertex), t->origin), mesh_corner(t, k));
    return fabs(v3_dot(t->normal, d)) <= flattest * v3_norm(d);
}

/* Is everything around corner k in the triangle's plane? What lies at the end of the surface is not all around:
 * at_end, by vertex. */
static bool is_flat_corner(const struct mesh *m, const struct mesh_triangle *t, int k, const bool *at_end)
{
    if (at_end[t->corner[k]]) return false;
    for (int i = 0;; ++i) {
        const int32_t next = mesh_neighbour(m, t->corner[k], i);
        if (next == -1) return true;
        if (next >= 0 && !is_in_plane(m, t, k, next)) return false;
    }
}

/* The triangle beyond an edge of a heightfield, -1. */
static int32_t beside_height(const struct mesh *m, int32_t triangle, int k)
{
    const int32_t cells = m->columns - 1, cell = triangle / 2, row = cell / cells, column = cell % cells;
    if (triangle % 2) {
        if (k == 0) return triangle - 1;
        if (k == 1) return row + 2 < m->rows ? triangle - 1 + 2 * cells : -1;
        return column > 0 ? triangle - 3 : -1;
    }
    if (k == 2) return triangle + 1;
    if (k == 0) return row > 0 ? triangle + 1 - 2 * cells : -1;
    return column + 1 < cells ? triangle + 3 : -1;
}

/* The triangle beyond edge k, if it lies in the plane of `triangle`, else -1. */
static int32_t beside_in_plane(const struct mesh *m, const int32_t *beside, int32_t triangle, int k)
{
    struct mesh_triangle t;
    const int32_t other = beside ? beside[3 * triangle + k] : beside_height(m, triangle, k);
    if (other < 0) return -1;
    mesh_triangle_of(m, triangle, &t);
    return is_in_plane(m, &t, k, t.opposite[k]) ? other : -1;
}

/* From triangle to triangle around a vertex, in one plane, beginning across edge k: is one of them before `first`? */
static bool is_one_before(const struct mesh *m, const int32_t *beside, int32_t first, int k, int32_t vertex)
{
    int32_t from = first, at = beside_in_plane(m, beside, first, k);
    while (at > first) {
        int32_t corner[3], opposite[3], next = -1;
        mesh_corners(m, at, corner, opposite);
        for (int i = 0; i < 3; ++i) {
            const int32_t other = beside ? beside[3 * at + i] : beside_height(m, at, i);
            if ((corner[i] == vertex || corner[mesh_next_corner(i)] == vertex) && other != from)
                next = beside_in_plane(m, beside, at, i);
        }
        from = at;
        at = next;
    }
    return at >= 0 && at < first;
}

bool sadmm_mesh_mark_triangles(const struct mesh *m, const int32_t *beside, uint16_t *marks)
{
    const size_t vertices = m->kind == MESH_HEIGHTS ? (size_t)m->columns * (size_t)m->rows : (size_t)m->vertices;
    bool *at_end = (bool *)sadmm_alloc(vertices, sizeof *at_end), *owned = (bool *)sadmm_alloc(vertices, sizeof *owned);
    struct mesh_triangle t;
    if (at_end && owned) {
        for (int32_t triangle = 0; triangle < m->triangles; ++triangle) {
            int32_t corner[3], opposite[3];
            mesh_corners(m, triangle, corner, opposite);
            for (int k = 0; k < 3; ++k)
                if (opposite[k] < 0) at_end[corner[k]] = at_end[corner[mesh_next_corner(k)]] = true;
        }
        for (int32_t triangle = 0; triangle < m->triangles; ++triangle) {
            unsigned all = 0;
            mesh_triangle_of(m, triangle, &t);
            for (int k = 0; k < 3; ++k) {
                const int32_t other = beside ? beside[3 * triangle + k] : beside_height(m, triangle, k);
                if (other >= 0 && is_in_plane(m, &t, k, t.opposite[k])) all |= 1u << (MESH_EDGE_FLAT + k);
                if (other < 0 || other > triangle) all |= 1u << (MESH_EDGE_OWN + k);
                if (is_flat_corner(m, &t, k, at_end)) all |= 1u << (MESH_CORNER_FLAT + k);
                if (!owned[t.corner[k]]) all |= 1u << (MESH_CORNER_OWN + k);
                if (is_one_before(m, beside, triangle, k, t.corner[k]) ||
                    is_one_before(m, beside, triangle, k > 0 ? k - 1 : 2, t.corner[k]))
                    all |= 1u << (MESH_CORNER_LATER + k);
                owned[t.corner[k]] = true;
            }
            marks[triangle] = (uint16_t)all;
        }
    }
    const bool made = at_end && owned;
    sadmm_free(at_end);
    sadmm_free(owned);
    return made;
}
