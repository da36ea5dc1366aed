/* Hulls without the library: faces by trying all planes through three points, distances by trying all pairs of
 * features. Slow, and nothing of it is shared with the library but the layout of a block. */
#ifndef SADMM_TESTS_HULL_REFERENCE_H
#define SADMM_TESTS_HULL_REFERENCE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "collision/hull/hull_data.h"

enum { TEST_HULL_POINTS = 64, TEST_HULL_FACES = 2 * TEST_HULL_POINTS, TEST_HULL_EDGES = 3 * TEST_HULL_POINTS };

struct test_hull {
    int vertices, faces, edges;
    double convex_radius; /* radius of the ball around every point of it */
    double x[TEST_HULL_POINTS][3];
    double plane[TEST_HULL_FACES][4];
    int corners[TEST_HULL_FACES], corner[TEST_HULL_FACES][TEST_HULL_POINTS];
    int edge[TEST_HULL_EDGES][2], edge_face[TEST_HULL_EDGES][2];
};

static inline double t_dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static inline void t_sub(const double a[3], const double b[3], double c[3])
{
    for (int k = 0; k < 3; ++k) c[k] = a[k] - b[k];
}
static inline void t_cross(const double a[3], const double b[3], double c[3])
{
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    c[0] = x, c[1] = y, c[2] = z;
}
static inline double t_norm(const double a[3]) { return sqrt(t_dot(a, a)); }

/* Corners of the face, by angle around its middle. */
static inline void test_hull_order(struct test_hull *h, int face, const int *on, int ons)
{
    double middle[3] = {0, 0, 0}, a[3], b[3], angle[TEST_HULL_POINTS];
    int *corner = h->corner[face];
    for (int m = 0; m < ons; ++m)
        for (int c = 0; c < 3; ++c) middle[c] += h->x[on[m]][c] / ons;
    t_sub(h->x[on[0]], middle, a);
    t_cross(h->plane[face], a, b);
    for (int m = 0; m < ons; ++m) {
        double d[3];
        int at = m;
        t_sub(h->x[on[m]], middle, d);
        angle[m] = m == 0 ? 0 : atan2(t_dot(d, b), t_dot(d, a));
        if (angle[m] < 0) angle[m] += 8 * atan(1);
        for (; at > 0 && angle[corner[at - 1]] > angle[m]; --at) corner[at] = corner[at - 1];
        corner[at] = m;
    }
    for (int m = 0; m < ons; ++m) corner[m] = on[corner[m]];
    h->corners[face] = ons;
}

/* The hull of points of which none is inside it, or inside a face. flat: how far a point of a face is off its plane, at
 * most. */
static inline void test_hull_of(const double (*points)[3], int count, double flat, struct test_hull *h)
{
    memset(h, 0, sizeof *h);
    h->vertices = count;
    memcpy(h->x, points, (size_t)count * sizeof *points);
    for (int i = 0; i < count; ++i)
        for (int j = i + 1; j < count; ++j)
            for (int k = j + 1; k < count; ++k) {
                double u[3], v[3], n[3], length, *plane = h->plane[h->faces];
                int above = 0, below = 0, on[TEST_HULL_POINTS], ons = 0;
                t_sub(points[j], points[i], u);
                t_sub(points[k], points[i], v);
                t_cross(u, v, n);
                length = t_norm(n);
                if (length < 1e-9 * (t_norm(u) * t_norm(v))) continue;
                for (int m = 0; m < count; ++m) {
                    double d[3];
                    t_sub(points[m], points[i], d);
                    const double height = t_dot(n, d) / length;
                    if (m == i || m == j || m == k || fabs(height) <= flat) on[ons++] = m;
                    else if (height > 0) ++above;
                    else ++below;
                }
                if ((above && below) || on[0] != i || on[1] != j || on[2] != k) continue; /* each face once */
                for (int m = 0; m < 3; ++m) plane[m] = (above ? -1 : 1) * n[m] / length;
                plane[3] = -HUGE_VAL;
                for (int m = 0; m < ons; ++m) plane[3] = fmax(plane[3], t_dot(plane, points[on[m]]));
                test_hull_order(h, h->faces++, on, ons);
            }
    for (int f = 0; f < h->faces; ++f)
        for (int m = 0; m < h->corners[f]; ++m) {
            const int from = h->corner[f][m], to = h->corner[f][(m + 1) % h->corners[f]];
            int e = 0;
            while (e < h->edges && !(h->edge[e][0] == to && h->edge[e][1] == from)) ++e;
            h->edge_face[e][e < h->edges] = f;
            if (e < h->edges) continue;
            h->edge[e][0] = from;
            h->edge[e][1] = to;
            ++h->edges;
        }
}

static inline int test_hull_edge(const struct test_hull *h, int from, int to)
{
    int e = 0;
    while (!((h->edge[e][0] == from && h->edge[e][1] == to) || (h->edge[e][0] == to && h->edge[e][1] == from))) ++e;
    return e;
}

/* The block, of hull_doubles(vertices, faces, edges) doubles. */
static inline void test_hull_data(const struct test_hull *h, double *block)
{
    struct sadmm_hull_header *header = (struct sadmm_hull_header *)block;
    const int v = hull_stride(h->vertices), f = hull_stride(h->faces);
    double *number = block + HULL_HEADER_DOUBLES;
    uint16_t *link = (uint16_t *)(number + 3 * v + 4 * f), *first, *next;
    int at = 0;
    memset(header, 0, sizeof *header);
    header->vertices = h->vertices;
    header->faces = h->faces;
    header->edges = h->edges;
    header->vertex_stride = v;
    header->face_stride = f;
    header->doubles = hull_doubles(h->vertices, h->faces, h->edges);
    header->convex_radius = h->convex_radius;
    header->climbs = 1; /* of convex faces, flat but for rounding */
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < v; ++i) number[k * v + i] = h->x[i < h->vertices ? i : 0][k];
    for (int k = 0; k < 4; ++k)
        for (int i = 0; i < f; ++i) number[3 * v + k * f + i] = h->plane[i < h->faces ? i : 0][k];
    for (int i = 0; i <= h->faces; ++i) {
        *link++ = (uint16_t)at;
        if (i < h->faces) at += h->corners[i];
    }
    for (int i = 0; i < h->faces; ++i)
        for (int m = 0; m < h->corners[i]; ++m) *link++ = (uint16_t)h->corner[i][m];
    for (int i = 0; i < h->faces; ++i)
        for (int m = 0; m < h->corners[i]; ++m)
            *link++ = (uint16_t)test_hull_edge(h, h->corner[i][m], h->corner[i][(m + 1) % h->corners[i]]);
    if (h->faces == 0) link += 4 * h->edges; /* corners that there are not */
    for (int e = 0; e < 2 * h->edges; ++e) *link++ = (uint16_t)h->edge[e / 2][e % 2];
    for (int e = 0; e < 2 * h->edges; ++e) *link++ = (uint16_t)h->edge_face[e / 2][e % 2];
    first = link;
    next = link + h->vertices + 1;
    at = 0;
    for (int i = 0; i < h->vertices; ++i) {
        first[i] = (uint16_t)at;
        for (int e = 0; e < 2 * h->edges; ++e)
            if (h->edge[e / 2][e % 2] == i) next[at++] = (uint16_t)h->edge[e / 2][1 - e % 2];
    }
    first[h->vertices] = (uint16_t)at;
}

/* ---- what is known of two hulls in the world --------------------------------------------------------------------- */

/* Along unit n, how far b is beyond a. */
static inline double test_apart_along(const double (*a)[3], int na, const double (*b)[3], int nb, const double n[3])
{
    double most = -HUGE_VAL, least = HUGE_VAL;
    for (int i = 0; i < na; ++i) most = fmax(most, t_dot(n, a[i]));
    for (int i = 0; i < nb; ++i) least = fmin(least, t_dot(n, b[i]));
    return least - most;
}

static inline double test_point_segment(const double p[3], const double a[3], const double b[3])
{
    double d[3], r[3], x[3];
    t_sub(b, a, d);
    t_sub(p, a, r);
    const double t = fmin(1, fmax(0, t_dot(r, d) / t_dot(d, d)));
    for (int k = 0; k < 3; ++k) x[k] = r[k] - t * d[k];
    return t_norm(x);
}

static inline double test_point_triangle(const double p[3], const double a[3], const double b[3], const double c[3])
{
    double u[3], v[3], n[3], r[3];
    const double *corner[3] = {a, b, c};
    bool inside = true;
    t_sub(b, a, u);
    t_sub(c, a, v);
    t_cross(u, v, n);
    for (int k = 0; k < 3; ++k) {
        double side[3], out[3], d[3];
        t_sub(corner[(k + 1) % 3], corner[k], side);
        t_cross(side, n, out);
        t_sub(p, corner[k], d);
        inside = inside && t_dot(out, d) <= 0;
    }
    if (inside) {
        t_sub(p, a, r);
        return fabs(t_dot(r, n)) / t_norm(n);
    }
    return fmin(test_point_segment(p, a, b), fmin(test_point_segment(p, b, c), test_point_segment(p, c, a)));
}

static inline double test_segments(const double p0[3], const double p1[3], const double q0[3], const double q1[3])
{
    double u[3], v[3], w[3], n[3], best;
    t_sub(p1, p0, u);
    t_sub(q1, q0, v);
    t_sub(p0, q0, w);
    best = fmin(fmin(test_point_segment(p0, q0, q1), test_point_segment(p1, q0, q1)),
                fmin(test_point_segment(q0, p0, p1), test_point_segment(q1, p0, p1)));
    t_cross(u, v, n);
    const double n2 = t_dot(n, n);
    if (n2 > 1e-12 * t_dot(u, u) * t_dot(v, v)) {
        double wv[3], wu[3];
        t_cross(v, w, wv);
        t_cross(u, w, wu);
        const double s = t_dot(wv, n) / n2, t = t_dot(wu, n) / n2;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1) best = fmin(best, fabs(t_dot(w, n)) / sqrt(n2));
    }
    return best;
}

/* Vertices of h in the world: R x + t, rows of R. */
static inline void test_hull_place(const struct test_hull *h, double R[3][3], const double t[3], double (*out)[3])
{
    for (int i = 0; i < h->vertices; ++i)
        for (int k = 0; k < 3; ++k) out[i][k] = t_dot(R[k], h->x[i]) + t[k];
}

/* The largest separation over all face normals and all products of two edges: less than 0, minus the depth. */
static inline double test_hulls_axes(const struct test_hull *a, const double (*xa)[3], double Ra[3][3],
                                     const struct test_hull *b, const double (*xb)[3], double Rb[3][3])
{
    double best = -HUGE_VAL, n[3];
    for (int f = 0; f < a->faces; ++f) {
        for (int k = 0; k < 3; ++k) n[k] = t_dot(Ra[k], a->plane[f]);
        best = fmax(best, test_apart_along(xa, a->vertices, xb, b->vertices, n));
    }
    for (int f = 0; f < b->faces; ++f) {
        for (int k = 0; k < 3; ++k) n[k] = -t_dot(Rb[k], b->plane[f]);
        best = fmax(best, test_apart_along(xa, a->vertices, xb, b->vertices, n));
    }
    for (int e = 0; e < a->edges; ++e)
        for (int g = 0; g < b->edges; ++g) {
            double u[3], v[3];
            t_sub(xa[a->edge[e][1]], xa[a->edge[e][0]], u);
            t_sub(xb[b->edge[g][1]], xb[b->edge[g][0]], v);
            t_cross(u, v, n);
            const double length = t_norm(n);
            if (length < 1e-7 * t_norm(u) * t_norm(v)) continue;
            for (int side = 0; side < 2; ++side) {
                for (int k = 0; k < 3; ++k) n[k] = side ? -n[k] : n[k] / length;
                best = fmax(best, test_apart_along(xa, a->vertices, xb, b->vertices, n));
            }
        }
    return best;
}

/* The distance of two hulls that are apart. */
static inline double test_hulls_distance(const struct test_hull *a, const double (*xa)[3], const struct test_hull *b,
                                         const double (*xb)[3])
{
    double best = HUGE_VAL;
    for (int swap = 0; swap < 2; ++swap) {
        const struct test_hull *p = swap ? b : a, *q = swap ? a : b;
        const double(*xp)[3] = swap ? xb : xa, (*xq)[3] = swap ? xa : xb;
        for (int i = 0; i < p->vertices; ++i)
            for (int f = 0; f < q->faces; ++f)
                for (int m = 1; m + 1 < q->corners[f]; ++m)
                    best = fmin(best, test_point_triangle(xp[i], xq[q->corner[f][0]], xq[q->corner[f][m]],
                                                          xq[q->corner[f][m + 1]]));
        for (int i = 0; i < p->vertices && q->faces == 0; ++i)
            for (int e = 0; e < q->edges; ++e)
                best = fmin(best, test_point_segment(xp[i], xq[q->edge[e][0]], xq[q->edge[e][1]]));
    }
    for (int e = 0; e < a->edges; ++e)
        for (int g = 0; g < b->edges; ++g)
            best = fmin(best, test_segments(xa[a->edge[e][0]], xa[a->edge[e][1]], xb[b->edge[g][0]],
                                            xb[b->edge[g][1]]));
    return best;
}

#endif
