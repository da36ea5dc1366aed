/* A triangle of a mesh while a manifold with it is computed: a polytope of two faces, and what the surface around it
 * says.
 *
 * A mesh is a surface with one side. What pushes a body away from it is a face, or an edge or a corner that stands out.
 * So a direction `u` out of the surface is one to push along at an edge or a corner only if nothing of the surface
 * around rises along it: u is in the normal cone there (mesh_allows). Where the nearest points say otherwise, they are
 * an artefact of where the surface is divided: what counts is the face, or a triangle next to it.
 */
#ifndef SADMM_COLLISION_MESH_MESH_TRIANGLE_H
#define SADMM_COLLISION_MESH_MESH_TRIANGLE_H

#include "collision/convex/polytope_axis.h"
#include "mesh_data.h"

enum { MESH_FRONT = 0, MESH_BACK = 1 }; /* the polytope's faces */

struct mesh_triangle {
    double x[HULL_LANES], y[HULL_LANES], z[HULL_LANES]; /* corners, from the first one, m */
    double nx[HULL_LANES], ny[HULL_LANES], nz[HULL_LANES], offset[HULL_LANES];
    vec3 origin; /* the first corner, frame of the mesh */
    vec3 normal; /* unit, outward */
    int32_t corner[3], opposite[3];
    uint32_t marks;
};

SADMM_INLINE void mesh_triangle_of(const struct mesh *m, int32_t triangle, struct mesh_triangle *t)
{
    vec3 x[3];
    int k;
    mesh_corners(m, triangle, t->corner, t->opposite);
    t->marks = m->marks[triangle];
    t->origin = mesh_vertex(m, t->corner[0]);
    for (k = 0; k < 3; ++k) x[k] = v3_sub(mesh_vertex(m, t->corner[k]), t->origin);
    t->normal = v3_cross(x[1], x[2]);
    t->normal = v3_scale(t->normal, 1 / v3_norm(t->normal));
    for (k = 0; k < HULL_LANES; ++k) {
        const vec3 at = x[k < 3 ? k : 0];
        const real side = k == MESH_BACK ? -1 : 1;
        t->x[k] = (double)at.x;
        t->y[k] = (double)at.y;
        t->z[k] = (double)at.z;
        t->nx[k] = (double)(side * t->normal.x);
        t->ny[k] = (double)(side * t->normal.y);
        t->nz[k] = (double)(side * t->normal.z);
        t->offset[k] = (double)real_max(0, real_max(side * v3_dot(t->normal, x[1]), side * v3_dot(t->normal, x[2])));
    }
}

/* As the narrow phase of hulls reads it. */
SADMM_INLINE void mesh_triangle_polytope(const struct mesh_triangle *t, struct polytope *p)
{
    static const uint16_t face_first[] = {0, 3, 6}, corner_vertex[] = {0, 1, 2, 0, 2, 1},
                          corner_edge[] = {0, 1, 2, 2, 1, 0}, edge_vertex[] = {0, 1, 1, 2, 2, 0},
                          edge_face[] = {0, 1, 0, 1, 0, 1}, vertex_first[] = {0, 2, 4, 6},
                          vertex_next[] = {1, 2, 0, 2, 1, 0};
    p->vertices = 3;
    p->faces = 2;
    p->edges = 3;
    p->climbs = false;
    p->scaled = false;
    p->x = t->x;
    p->y = t->y;
    p->z = t->z;
    p->nx = t->nx;
    p->ny = t->ny;
    p->nz = t->nz;
    p->offset = t->offset;
    p->face_first = face_first;
    p->corner_vertex = corner_vertex;
    p->corner_edge = corner_edge;
    p->edge_vertex = edge_vertex;
    p->edge_face = edge_face;
    p->vertex_first = vertex_first;
    p->vertex_next = vertex_next;
    p->scale = v3(1, 1, 1);
    p->radius = 0;
}

SADMM_INLINE vec3 mesh_corner(const struct mesh_triangle *t, int k)
{
    return v3((real)t->x[k], (real)t->y[k], (real)t->z[k]);
}

/* Is all that is around it in its plane? */
SADMM_INLINE bool mesh_is_flat(const struct mesh_triangle *t)
{
    const uint32_t all = 7u << MESH_EDGE_FLAT | 7u << MESH_CORNER_FLAT;
    return (t->marks & all) == all;
}

/* ---- what the surface allows ------------------------------------------------------------------------------------- */

/* Sine below which an edge lies across a direction, or goes down along it: rounding of normals. */
#define MESH_ACROSS (sizeof(real) == 4 ? (real)1e-4 : (real)1e-6)

/* Does the surface go down, or across, from corner k to the vertex? */
SADMM_INLINE bool mesh_falls(const struct mesh *m, const struct mesh_triangle *t, int k, int32_t vertex, vec3 u)
{
    const vec3 d = v3_sub(v3_sub(mesh_vertex(m, vertex), t->origin), mesh_corner(t, k));
    const real along = v3_dot(u, d);
    return along <= 0 || along * along <= MESH_ACROSS * MESH_ACROSS * v3_norm2(d);
}

/* The part of the triangle that is farthest out along u: an edge (its number), a corner or the face. */
enum mesh_part { MESH_FACE, MESH_EDGE, MESH_CORNER };
SADMM_INLINE enum mesh_part mesh_part_along(const struct mesh_triangle *t, vec3 u, int *number)
{
    real h[3], top, size2 = 0, even;
    int k, count = 0;
    for (k = 0; k < 3; ++k) {
        const vec3 x = mesh_corner(t, k);
        h[k] = v3_dot(u, x);
        size2 = real_max(size2, v3_norm2(x));
    }
    even = 4 * MESH_ACROSS * real_sqrt(size2); /* a search ends with a direction as far off as that */
    top = real_max(h[0], real_max(h[1], h[2]));
    for (k = 0; k < 3; ++k) count += h[k] >= top - even;
    *number = 0;
    if (count == 3) return MESH_FACE;
    for (k = 0; k < 3; ++k) {
        const bool high = h[k] >= top - even, next_high = h[mesh_next_corner(k)] >= top - even;
        if (high && (count == 1 || next_high)) *number = k;
    }
    return count == 2 ? MESH_EDGE : MESH_CORNER;
}

/* Is u the triangle's normal, but for rounding? Of nearest points at the end of a face, as many searches say. */
SADMM_INLINE bool mesh_is_front(const struct mesh_triangle *t, vec3 u)
{
    return v3_dot(u, t->normal) > 0 && v3_norm2(v3_cross(u, t->normal)) <= 16 * MESH_ACROSS * MESH_ACROSS;
}

/* Is u, out of the surface, a direction that it pushes along, seen from this triangle? */
SADMM_INLINE bool mesh_allows(const struct mesh *m, const struct mesh_triangle *t, vec3 u)
{
    const bool outward = v3_dot(u, t->normal) > 0;
    int k, i;
    if (mesh_is_front(t, u)) return true;
    switch (mesh_part_along(t, u, &k)) {
    case MESH_FACE: return outward;
    case MESH_EDGE: return t->opposite[k] < 0 ? outward : mesh_falls(m, t, k, t->opposite[k], u);
    case MESH_CORNER: break;
    }
    if (!outward && (t->opposite[k] < 0 || t->opposite[k > 0 ? k - 1 : 2] < 0)) return false;
    for (i = 0;; ++i) {
        const int32_t next = mesh_neighbour(m, t->corner[k], i);
        if (next == -1) return true;
        if (next >= 0 && !mesh_falls(m, t, k, next, u)) return false;
    }
}

/* Is this the triangle that an edge or a corner speaks for, of those that have it? */
SADMM_INLINE bool mesh_owns(const struct mesh_triangle *t, vec3 u)
{
    int k;
    switch (mesh_part_along(t, u, &k)) {
    case MESH_EDGE: return mesh_marked(t->marks, MESH_EDGE_OWN, k);
    case MESH_CORNER: return mesh_marked(t->marks, MESH_CORNER_OWN, k);
    case MESH_FACE: break;
    }
    return true;
}

#endif
