#include "mesh_edges.h"

#include <string.h>

#include "core/base/memory.h"

/* A side of a triangle, in the list of its lower vertex. */
struct side {
    int32_t high; /* the other vertex */
    int32_t at;   /* 3 x triangle + corner that it begins at */
};

static int32_t next_corner(int32_t at) { return at % 3 == 2 ? at - 2 : at + 1; }

/* Sides by their lower vertex, then the other one, then the triangle. first: vertices + 1. Lists are short. */
static void sort_sides(const int32_t *corners, int32_t triangles, int32_t vertices, int32_t *first, struct side *sides)
{
    for (int32_t at = 0; at < 3 * triangles; ++at) {
        const int32_t a = corners[at], b = corners[next_corner(at)];
        ++first[(a < b ? a : b) + 1];
    }
    for (int32_t v = 0; v < vertices; ++v) first[v + 1] += first[v];
    for (int32_t at = 0; at < 3 * triangles; ++at) {
        const int32_t a = corners[at], b = corners[next_corner(at)];
        sides[first[a < b ? a : b]++] = (struct side){a < b ? b : a, at};
    }
    for (int32_t v = vertices; v > 0; --v) first[v] = first[v - 1]; /* each was moved on to its end */
    first[0] = 0;
    for (int32_t v = 0; v < vertices; ++v)
        for (int32_t i = first[v] + 1; i < first[v + 1]; ++i) {
            const struct side side = sides[i];
            int32_t k = i;
            for (; k > first[v] && sides[k - 1].high > side.high; --k) sides[k] = sides[k - 1];
            sides[k] = side;
        }
}

/* The end of the sides of the edge that begins at side i. */
static int32_t edge_end(const struct side *sides, int32_t i, int32_t last)
{
    int32_t end = i + 1;
    while (end < last && sides[end].high == sides[i].high) ++end;
    return end;
}

static void join(const int32_t *corners, const struct side *two, struct mesh_edges *out)
{
    for (int k = 0; k < 2; ++k) {
        const int32_t own = two[k].at, other = two[1 - k].at;
        out->opposite[own] = corners[next_corner(next_corner(other))];
        out->beside[own] = other / 3;
    }
}

/* Each edge is in two rings; counted first, then filled. */
static bool make_rings(const struct side *sides, const int32_t *first, int32_t vertices, int32_t edges,
                       struct mesh_edges *out)
{
    out->ring_count = 2 * edges;
    out->ring_first = (int32_t *)sadmm_alloc((size_t)vertices + 1, sizeof *out->ring_first);
    out->ring = (int32_t *)sadmm_alloc(2 * (size_t)edges, sizeof *out->ring);
    if (!out->ring_first || !out->ring) return false;
    for (int32_t v = 0; v < vertices; ++v)
        for (int32_t i = first[v]; i < first[v + 1]; i = edge_end(sides, i, first[v + 1])) {
            ++out->ring_first[v + 1];
            ++out->ring_first[sides[i].high + 1];
        }
    for (int32_t v = 0; v < vertices; ++v) out->ring_first[v + 1] += out->ring_first[v];
    for (int32_t v = 0; v < vertices; ++v)
        for (int32_t i = first[v]; i < first[v + 1]; i = edge_end(sides, i, first[v + 1])) {
            out->ring[out->ring_first[v]++] = sides[i].high;
            out->ring[out->ring_first[sides[i].high]++] = v;
        }
    for (int32_t v = vertices; v > 0; --v) out->ring_first[v] = out->ring_first[v - 1];
    out->ring_first[0] = 0;
    return true;
}

bool sadmm_mesh_edges_find(const int32_t *corners, int32_t triangles, int32_t vertices, struct mesh_edges *out)
{
    const size_t count = 3 * (size_t)triangles;
    int32_t *first = (int32_t *)sadmm_alloc((size_t)vertices + 1, sizeof *first), edges = 0;
    struct side *sides = (struct side *)sadmm_alloc(count, sizeof *sides);
    memset(out, 0, sizeof *out);
    out->opposite = (int32_t *)sadmm_alloc(count, sizeof *out->opposite);
    out->beside = (int32_t *)sadmm_alloc(count, sizeof *out->beside);
    bool made = first && sides && out->opposite && out->beside;
    if (made) {
        sort_sides(corners, triangles, vertices, first, sides);
        memset(out->opposite, 0xff, count * sizeof *out->opposite);
        memset(out->beside, 0xff, count * sizeof *out->beside);
        for (int32_t v = 0; v < vertices; ++v)
            for (int32_t i = first[v], end; i < first[v + 1]; i = end) {
                end = edge_end(sides, i, first[v + 1]);
                ++edges;
                if (end - i == 2) join(corners, sides + i, out);
                else ++out->open;
            }
        made = make_rings(sides, first, vertices, edges, out);
    }
    sadmm_free(first);
    sadmm_free(sides);
    if (!made) sadmm_mesh_edges_free(out);
    return made;
}

void sadmm_mesh_edges_free(struct mesh_edges *edges)
{
    sadmm_free(edges->opposite);
    sadmm_free(edges->beside);
    sadmm_free(edges->ring_first);
    sadmm_free(edges->ring);
    memset(edges, 0, sizeof *edges);
}
