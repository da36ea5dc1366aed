/* Convex polytopes of the narrow phase: a hull, or what a box, a capsule's segment and a sphere's centre are beside
 * one, with a round of `radius` around it. All are blocks of the world's shape data (hull_data.h).
 */
#ifndef SADMM_COLLISION_CONVEX_POLYTOPE_H
#define SADMM_COLLISION_CONVEX_POLYTOPE_H

#include <stdbool.h>

#include "collision/base/row3.h"
#include "collision/hull/hull_data.h"
#include "collision/shapes/shape.h"

/* Up to so many vertices all are tested; of more a search climbs along edges, where these lead to the top. */
enum { POLYTOPE_SCAN = 48 };

struct polytope {
    const double *x, *y, *z;                    /* vertices, before `scale` */
    const double *nx, *ny, *nz, *offset;        /* faces */
    const uint16_t *face_first, *corner_vertex, *corner_edge, *edge_vertex, *edge_face, *vertex_first, *vertex_next;
    int vertices, faces, edges;
    vec3 scale;
    bool climbs; /* hull_data.h */
    bool scaled; /* the unit cube, its faces as far out as `scale` says */
    real radius; /* m */
};

SADMM_INLINE void polytope_at(const double *hulls, uint32_t at, struct polytope *p)
{
    const double *block = hulls + at;
    const struct sadmm_hull_header *header = (const struct sadmm_hull_header *)block;
    const int v = header->vertex_stride, f = header->face_stride;
    p->vertices = header->vertices;
    p->faces = header->faces;
    p->edges = header->edges;
    p->climbs = header->climbs != 0;
    p->x = block + HULL_HEADER_DOUBLES;
    p->y = p->x + v;
    p->z = p->y + v;
    p->nx = p->z + v;
    p->ny = p->nx + f;
    p->nz = p->ny + f;
    p->offset = p->nz + f;
    p->face_first = (const uint16_t *)(p->offset + f);
    p->corner_vertex = p->face_first + header->faces + 1;
    p->corner_edge = p->corner_vertex + 2 * header->edges;
    p->edge_vertex = p->corner_edge + 2 * header->edges;
    p->edge_face = p->edge_vertex + 2 * header->edges;
    p->vertex_first = p->edge_face + 2 * header->edges;
    p->vertex_next = p->vertex_first + header->vertices + 1;
    p->scale = v3(1, 1, 1);
    p->scaled = false;
    p->radius = (real)header->convex_radius;
}

/* Of a sphere, capsule, box or hull. */
SADMM_INLINE void polytope_of(const struct sadmm_geometry *g, const double *hulls, struct polytope *p)
{
    switch ((sadmm_shape_type)g->type) {
    case SADMM_SHAPE_SPHERE:
        polytope_at(hulls, HULL_POINT, p);
        p->radius = (real)g->size[0];
        return;
    case SADMM_SHAPE_CAPSULE:
        polytope_at(hulls, HULL_SEGMENT, p);
        p->radius = (real)g->size[0];
        p->scale = v3(0, 0, (real)g->size[1]);
        return;
    case SADMM_SHAPE_BOX:
        polytope_at(hulls, HULL_CUBE, p);
        p->scale = v3_load(g->size);
        p->scaled = true;
        return;
    case SADMM_SHAPE_HULL:
    case SADMM_SHAPE_MESH:
    case SADMM_SHAPE_CYLINDER: /* no polytopes: convex.h */
    case SADMM_SHAPE_CONE:
    case SADMM_SHAPE_ELLIPSOID:
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    polytope_at(hulls, g->hull, p);
}

SADMM_INLINE vec3 polytope_vertex(const struct polytope *p, int v)
{
    return v3(p->scale.x * (real)p->x[v], p->scale.y * (real)p->y[v], p->scale.z * (real)p->z[v]);
}

SADMM_INLINE vec3 polytope_normal(const struct polytope *p, int face)
{
    return v3((real)p->nx[face], (real)p->ny[face], (real)p->nz[face]);
}

SADMM_INLINE real polytope_offset(const struct polytope *p, int face)
{
    const vec3 n = polytope_normal(p, face);
    return p->scaled ? real_abs(n.x) * p->scale.x + real_abs(n.y) * p->scale.y + real_abs(n.z) * p->scale.z
                     : (real)p->offset[face];
}

/* ---- of many x, y, z, their number a multiple of HULL_LANES: is one of them within all of four planes? ----------- */

struct four_planes {
    vec3 n[4]; /* n . (x, y, z) is at least this: */
    real least[4];
};

#if defined(__AVX2__) && defined(SADMM_REAL_IS_DOUBLE) && !defined(__CUDACC__)

/* Four at a time. */
SADMM_INLINE bool any_within(const double *x, const double *y, const double *z, int count, const struct four_planes *p)
{
    int k, i;
    for (k = 0; k < count; k += 4) {
        const row3 xk = r3_load(x + k), yk = r3_load(y + k), zk = r3_load(z + k);
        row3_mask within = r3_fill(p->n[0].x) * xk + r3_fill(p->n[0].y) * yk + r3_fill(p->n[0].z) * zk >=
                           r3_fill(p->least[0]);
        for (i = 1; i < 4; ++i)
            within &= r3_fill(p->n[i].x) * xk + r3_fill(p->n[i].y) * yk + r3_fill(p->n[i].z) * zk >=
                      r3_fill(p->least[i]);
        if (_mm256_movemask_pd((row3)within)) return true;
    }
    return false;
}

#else

SADMM_INLINE bool any_within(const double *x, const double *y, const double *z, int count, const struct four_planes *p)
{
    int k, i;
    for (k = 0; k < count; ++k) {
        const vec3 at = v3((real)x[k], (real)y[k], (real)z[k]);
        for (i = 0; i < 4 && v3_dot(p->n[i], at) >= p->least[i];) ++i;
        if (i == 4) return true;
    }
    return false;
}

#endif

/* ---- the first largest d . (x, y, z) of many --------------------------------------------------------------------- */

#if defined(__AVX2__) && defined(SADMM_REAL_IS_DOUBLE) && !defined(__CUDACC__)

/* Four at a time: the same products and sums, and of equal ones the first. count: a multiple of four. */
SADMM_INLINE int first_largest(const double *x, const double *y, const double *z, int count, vec3 d)
{
    typedef int64_t places __attribute__((vector_size(32)));
    const row3 dx = r3_fill(d.x), dy = r3_fill(d.y), dz = r3_fill(d.z);
    places at = {0, 1, 2, 3}, best = at;
    row3 most = dx * r3_load(x) + dy * r3_load(y) + dz * r3_load(z);
    double value;
    int k, i, found;
    for (k = 4; k < count; k += 4) {
        const row3 value4 = dx * r3_load(x + k) + dy * r3_load(y + k) + dz * r3_load(z + k);
        const row3_mask more = value4 > most;
        at += 4;
        most = (row3)_mm256_blendv_pd(most, value4, (row3)more);
        best = (places)_mm256_blendv_pd((row3)best, (row3)at, (row3)more);
    }
    value = most[0];
    found = (int)best[0];
    for (i = 1; i < 4; ++i)
        if (most[i] > value || (most[i] == value && best[i] < found)) {
            value = most[i];
            found = (int)best[i];
        }
    return found;
}

#else

SADMM_INLINE int first_largest(const double *x, const double *y, const double *z, int count, vec3 d)
{
    real most = v3_dot(d, v3((real)x[0], (real)y[0], (real)z[0]));
    int k, best = 0;
    for (k = 1; k < count; ++k) {
        const real value = v3_dot(d, v3((real)x[k], (real)y[k], (real)z[k]));
        if (value > most) {
            most = value;
            best = k;
        }
    }
    return best;
}

#endif

/* The vertex farthest along d; `from`: where to begin a climb. */
SADMM_INLINE int polytope_support(const struct polytope *p, vec3 d, int from)
{
    const vec3 s = v3(d.x * p->scale.x, d.y * p->scale.y, d.z * p->scale.z);
    real most;
    int best = from;
    if (p->vertices <= POLYTOPE_SCAN || !p->climbs) return first_largest(p->x, p->y, p->z, hull_stride(p->vertices), s);
    most = v3_dot(s, v3((real)p->x[best], (real)p->y[best], (real)p->z[best]));
    for (;;) {
        const int last = p->vertex_first[best + 1], before = best;
        int k;
        for (k = p->vertex_first[before]; k < last; ++k) {
            const int v = p->vertex_next[k];
            const real value = v3_dot(s, v3((real)p->x[v], (real)p->y[v], (real)p->z[v]));
            if (value > most) {
                most = value;
                best = v;
            }
        }
        if (best == before) return best;
    }
}

/* The face whose normal is nearest to d. */
SADMM_INLINE int polytope_face_along(const struct polytope *p, vec3 d)
{
    return first_largest(p->nx, p->ny, p->nz, hull_stride(p->faces), d);
}

/* The height of x over that face, of all but `except`, over which it is highest. */
SADMM_INLINE real polytope_height(const struct polytope *p, vec3 x, int except)
{
    real most = -SADMM_REAL_MAX;
    int f;
    for (f = 0; f < p->faces; ++f) {
        const real height = v3_dot(polytope_normal(p, f), x) - polytope_offset(p, f);
        if (f != except) most = real_max(most, height);
    }
    return most;
}

/* The edge between two vertices, -1: there is none. */
SADMM_INLINE int polytope_edge_between(const struct polytope *p, int v0, int v1)
{
    int e;
    for (e = 0; e < p->edges; ++e) {
        const int from = p->edge_vertex[2 * e], to = p->edge_vertex[2 * e + 1];
        if ((from == v0 && to == v1) || (from == v1 && to == v0)) return e;
    }
    return -1;
}

#endif
