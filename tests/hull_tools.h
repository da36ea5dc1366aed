/* Hulls in tests: clouds of points, and what must hold of every hull that is made. Where ck_assert_msg is defined
 * before (a fuzzer), checks go there. */
#ifndef TESTS_HULL_TOOLS_H
#define TESTS_HULL_TOOLS_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "collision/convex/polytope.h"
#include "collision/hull/hull.h"
#include "core/math/quat.h"
#include "subadmm/subadmm.h"

/* ---- points ---- */

enum { CLOUD = 4096 };
struct cloud {
    double x[3 * CLOUD];
    size_t count;
};

static inline void add_point(struct cloud *c, double x, double y, double z)
{
    double *to = c->x + 3 * c->count++;
    to[0] = x, to[1] = y, to[2] = z;
}

static inline struct cloud box_cloud(double hx, double hy, double hz)
{
    struct cloud c = {.count = 0};
    for (int v = 0; v < 8; ++v) add_point(&c, v & 1 ? hx : -hx, v & 2 ? hy : -hy, v & 4 ? hz : -hz);
    return c;
}

/* Regular, with corners at radius r; from z = -h to h. */
static inline struct cloud prism_cloud(int corners, double r, double h)
{
    struct cloud c = {.count = 0};
    for (int k = 0; k < corners; ++k)
        for (int side = -1; side <= 1; side += 2)
            add_point(&c, r * cos(2 * M_PI * k / corners), r * sin(2 * M_PI * k / corners), side * h);
    return c;
}

/* The 32 corners of an icosahedron and a dodecahedron on the unit sphere: 60 triangles. */
static inline struct cloud ball_cloud(void)
{
    const double g = (1 + sqrt(5)) / 2, i = 1 / sqrt(1 + g * g), d = 1 / sqrt(3);
    struct cloud c = {.count = 0};
    for (int k = 0; k < 3; ++k)
        for (int s = 0; s < 4; ++s) {
            const double a = s & 1 ? 1 : -1, b = s & 2 ? 1 : -1;
            double p[3], q[3];
            p[k] = 0, p[(k + 1) % 3] = a * i, p[(k + 2) % 3] = b * g * i;
            q[k] = 0, q[(k + 1) % 3] = a * g * d, q[(k + 2) % 3] = b * d / g;
            add_point(&c, p[0], p[1], p[2]);
            add_point(&c, q[0], q[1], q[2]);
        }
    for (int v = 0; v < 8; ++v) add_point(&c, v & 1 ? d : -d, v & 2 ? d : -d, v & 4 ? d : -d);
    return c;
}

/* Numbers in [-1, 1], the same in every run. */
static inline double next_number(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(int64_t)(*state >> 11) / 4503599627370496.0 - 1;
}

static inline void place_cloud(struct cloud *c, const double orientation[4], double x, double y, double z)
{
    const mat3 turn = q_matrix(q_normalize(q_load(orientation)));
    for (size_t i = 0; i < c->count; ++i)
        v3_store(v3_add(m3_mul(turn, v3_load(c->x + 3 * i)), v3(x, y, z)), c->x + 3 * i);
}

static inline void shuffle_cloud(struct cloud *c, uint64_t seed)
{
    for (size_t i = c->count; i-- > 1;) {
        const size_t j = (size_t)((next_number(&seed) + 1) / 2 * (double)i);
        double keep[3];
        memcpy(keep, c->x + 3 * i, sizeof keep);
        memcpy(c->x + 3 * i, c->x + 3 * j, sizeof keep);
        memcpy(c->x + 3 * j, keep, sizeof keep);
    }
}

static inline sadmm_status try_round_hull(const struct cloud *c, double merge, double convex_radius, sadmm_hull **hull)
{
    sadmm_hull_def def = sadmm_hull_def_default();
    def.points = c->x;
    def.point_count = c->count;
    def.merge = merge;
    def.convex_radius = convex_radius;
    return sadmm_hull_create(&def, hull);
}

static inline sadmm_status try_hull(const struct cloud *c, double merge, sadmm_hull **hull)
{
    return try_round_hull(c, merge, 0, hull);
}

/* ---- what must hold ---- */

/* Check writes down every assertion that it passes: there are too many here. */
#define HOLDS(condition)                                         \
    do {                                                         \
        if (!(condition)) ck_assert_msg(false, "%s", #condition); \
    } while (0)

static inline int compare_keys(const void *a, const void *b)
{
    const uint64_t p = *(const uint64_t *)a, q = *(const uint64_t *)b;
    return (p > q) - (p < q);
}

/* Every edge is in two faces, which go along it either way. */
static inline void check_edges(const sadmm_hull *hull)
{
    const size_t count = 2 * (size_t)sadmm_hull_edge_count(hull);
    uint64_t *keys = (uint64_t *)malloc(2 * count * sizeof *keys);
    size_t n = 0;
    for (int32_t f = 0; f < sadmm_hull_face_count(hull); ++f) {
        sadmm_hull_face face;
        HOLDS(sadmm_hull_face_at(hull, f, &face) == SADMM_OK);
        HOLDS(n + (size_t)face.corner_count <= count);
        for (int32_t c = 0; c < face.corner_count; ++c, ++n) {
            const uint64_t from = (uint64_t)face.corners[c], to = (uint64_t)face.corners[(c + 1) % face.corner_count];
            keys[n] = from << 32 | to;
            keys[count + n] = to << 32 | from;
        }
    }
    HOLDS(n == count);
    qsort(keys, count, sizeof *keys, compare_keys);
    qsort(keys + count, count, sizeof *keys, compare_keys);
    for (size_t k = 0; k < count; ++k) HOLDS(keys[k] == keys[count + k] && (k == 0 || keys[k] != keys[k - 1]));
    free(keys);
}

/* Vertices are points, bit for bit, in their order; every face begins with its lowest corner, and they are in order. */
static inline void check_order(const sadmm_hull *hull, const struct cloud *points)
{
    const double *x = sadmm_hull_vertices(hull);
    sadmm_hull_face last = {.corner_count = 0}, face;
    size_t at = 0;
    for (int32_t v = 0; v < sadmm_hull_vertex_count(hull); ++v, ++at) {
        while (at < points->count && memcmp(points->x + 3 * at, x + 3 * v, 3 * sizeof *x) != 0) ++at;
        HOLDS(at < points->count);
    }
    for (int32_t f = 0; f < sadmm_hull_face_count(hull); ++f, last = face) {
        HOLDS(sadmm_hull_face_at(hull, f, &face) == SADMM_OK);
        HOLDS(face.corner_count >= 3);
        for (int32_t c = 1; c < face.corner_count; ++c) HOLDS(face.corners[c] > face.corners[0]);
        int32_t k = 0;
        while (f > 0 && k < face.corner_count && k < last.corner_count && face.corners[k] == last.corners[k]) ++k;
        HOLDS(f == 0 || k == last.corner_count || (k < face.corner_count && face.corners[k] > last.corners[k]));
    }
}

/* No point is outside of a face by more than `bend`, m, and no corner inside of its own. */
static inline void check_convex(const sadmm_hull *hull, const struct cloud *points, double bend)
{
    for (int32_t f = 0; f < sadmm_hull_face_count(hull); ++f) {
        sadmm_hull_face face;
        HOLDS(sadmm_hull_face_at(hull, f, &face) == SADMM_OK);
        const vec3 n = v3_load(face.normal);
        HOLDS(fabs(v3_norm(n) - 1) < 1e-14);
        for (size_t i = 0; i < points->count; ++i) {
            const double outside = v3_dot(n, v3_load(points->x + 3 * i)) - face.offset;
            if (outside > bend)
                ck_assert_msg(false, "point %zu is %g m outside of face %d, more than %g", i, outside, (int)f,
                              bend);
        }
        for (int32_t c = 0; c < face.corner_count; ++c) {
            const double *corner = sadmm_hull_vertices(hull) + 3 * face.corners[c];
            const double inside = face.offset - v3_dot(n, v3_load(corner));
            if (inside > bend)
                ck_assert_msg(false, "a corner is %g m inside of face %d, more than %g", inside, (int)f, bend);
        }
    }
}

/* The block that contact finding reads says the same in its own frame. convex_radius: m. */
static inline void check_block(const sadmm_hull *hull, double convex_radius)
{
    struct polytope p;
    const mat3 turn = q_matrix(q_load(hull->orientation));
    polytope_at(hull->block, 0, &p);
    const struct sadmm_hull_header *header = (const struct sadmm_hull_header *)hull->block;
    HOLDS(p.vertices == sadmm_hull_vertex_count(hull) && p.faces == sadmm_hull_face_count(hull) &&
          p.edges == sadmm_hull_edge_count(hull));
    HOLDS((size_t)header->doubles == hull->doubles &&
          header->doubles == hull_doubles(p.vertices, p.faces, p.edges));
    double most[3] = {0};
    for (int v = 0; v < header->vertex_stride; ++v) {
        const int same = v < p.vertices ? v : 0;
        const double x[3] = {p.x[v], p.y[v], p.z[v]};
        const vec3 given = v3_add(v3_load(hull->position), m3_mul(turn, v3_load(x)));
        HOLDS(v3_norm(v3_sub(given, v3_load(hull->vertices + 3 * same))) <= convex_radius);
        for (int k = 0; k < 3; ++k) most[k] = fmax(most[k], fabs(x[k]));
    }
    for (int k = 0; k < 3; ++k) HOLDS(most[k] + hull->convex_radius == hull->half[k]);
    HOLDS(header->convex_radius == hull->convex_radius && p.radius == hull->convex_radius);
    for (int f = 0; f < p.faces; ++f) {
        const vec3 n = polytope_normal(&p, f);
        double offset = -INFINITY;
        HOLDS(p.face_first[f + 1] - p.face_first[f] == hull->face_first[f + 1] - hull->face_first[f]);
        for (int c = p.face_first[f]; c < p.face_first[f + 1]; ++c) {
            const int next = c + 1 < p.face_first[f + 1] ? c + 1 : p.face_first[f], e = p.corner_edge[c];
            HOLDS(p.corner_vertex[c] == hull->corners[c]);
            offset = fmax(offset, v3_dot(n, polytope_vertex(&p, p.corner_vertex[c])));
            const int way = p.edge_face[2 * e] == f ? 0 : 1; /* the first face's corners run along the edge */
            HOLDS(e < p.edges && p.edge_face[2 * e + way] == f);
            HOLDS(p.edge_vertex[2 * e + way] == p.corner_vertex[c]);
            HOLDS(p.edge_vertex[2 * e + 1 - way] == p.corner_vertex[next]);
        }
        HOLDS(offset == p.offset[f]);
    }
    HOLDS(p.vertex_first[0] == 0 && p.vertex_first[p.vertices] == 2 * p.edges);
    int found = 0;
    for (int e = 0; e < p.edges; ++e)
        for (int way = 0; way < 2; ++way) {
            const int from = p.edge_vertex[2 * e + way], to = p.edge_vertex[2 * e + 1 - way];
            for (int k = p.vertex_first[from]; k < p.vertex_first[from + 1]; ++k) found += p.vertex_next[k] == to;
        }
    HOLDS(found == 2 * p.edges);
}

/* All of it. bend: what faces may be bent by, m. */
static inline void check_hull(const sadmm_hull *hull, const struct cloud *points, double bend)
{
    double size = 0;
    for (size_t k = 0; k < 3 * points->count; ++k) size = fmax(size, fabs(points->x[k]));
    HOLDS(sadmm_hull_vertex_count(hull) - sadmm_hull_edge_count(hull) + sadmm_hull_face_count(hull) == 2);
    check_edges(hull);
    check_order(hull, points);
    check_convex(hull, points, bend + 1e-14 * size);
    check_block(hull, 1e-14 * size);
}

#endif
