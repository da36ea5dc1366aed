#include "triangles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

static const double flattest = 1e-12; /* height of a triangle, of its longest edge */

struct placed {
    double x[3];
    int32_t number;
};

static int compare(const void *a, const void *b)
{
    const struct placed *const p = (const struct placed *)a, *const q = (const struct placed *)b;
    for (int k = 0; k < 3; ++k)
        if (p->x[k] != q->x[k]) return p->x[k] < q->x[k] ? -1 : 1;
    return (p->number > q->number) - (p->number < q->number);
}

sadmm_status sadmm_mesh_file_merge(struct mesh_parts *parts, int32_t *triangles, size_t count)
{
    const size_t vertices = parts->vertex_count;
    struct placed *list = (struct placed *)sadmm_alloc(vertices, sizeof *list);
    int32_t *first = (int32_t *)sadmm_alloc(vertices, sizeof *first);
    if (list && first) {
        for (size_t v = 0; v < vertices; ++v) {
            memcpy(list[v].x, parts->vertices + 3 * v, sizeof list[v].x);
            list[v].number = (int32_t)v;
        }
        qsort(list, vertices, sizeof *list, compare);
        for (size_t k = 0; k < vertices; ++k) {
            /* There is no -0: equal numbers are equal bits. */
            const bool again = k > 0 && memcmp(list[k].x, list[k - 1].x, sizeof list[k].x) == 0;
            first[list[k].number] = again ? first[list[k - 1].number] : list[k].number;
            parts->info.merged_vertices += again;
        }
        for (size_t c = 0; c < 3 * count; ++c) triangles[c] = first[triangles[c]];
    }
    const bool done = list && first;
    sadmm_free(list);
    sadmm_free(first);
    return done ? SADMM_OK : sadmm_fail_memory(NULL, "the vertices of a mesh file");
}

/* With two corners at one place, there is no height either. */
static bool is_degenerate(const double *a, const double *b, const double *c)
{
    double edge[3][3], longest = 0, area = 0;
    for (int k = 0; k < 3; ++k) {
        edge[0][k] = b[k] - a[k];
        edge[1][k] = c[k] - b[k];
        edge[2][k] = a[k] - c[k];
    }
    for (int e = 0; e < 3; ++e)
        longest = fmax(longest, edge[e][0] * edge[e][0] + edge[e][1] * edge[e][1] + edge[e][2] * edge[e][2]);
    for (int k = 0; k < 3; ++k) {
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        const double x = edge[0][l] * edge[1][m] - edge[0][m] * edge[1][l];
        area += x * x;
    }
    return !(sqrt(area) > flattest * longest);
}

size_t sadmm_mesh_file_drop_degenerate(struct mesh_parts *parts, int32_t *triangles, size_t count, bool drop)
{
    size_t kept = 0;
    for (size_t t = 0; t < count; ++t) {
        int32_t corner[3];
        memcpy(corner, triangles + 3 * t, sizeof corner);
        const double *const x = parts->vertices;
        const bool degenerate =
            is_degenerate(x + 3 * (size_t)corner[0], x + 3 * (size_t)corner[1], x + 3 * (size_t)corner[2]);
        parts->info.degenerate_triangles += degenerate;
        if (degenerate && drop) continue;
        memcpy(triangles + 3 * kept++, corner, sizeof corner);
    }
    return kept;
}

sadmm_status sadmm_mesh_file_drop_unused(struct mesh_parts *parts, int32_t *triangles, size_t count)
{
    int32_t *number = (int32_t *)sadmm_alloc(parts->vertex_count, sizeof *number);
    size_t kept = 0;
    if (!number) return sadmm_fail_memory(NULL, "the vertices of a mesh file");
    for (size_t c = 0; c < 3 * count; ++c) number[triangles[c]] = 1;
    for (size_t v = 0; v < parts->vertex_count; ++v) {
        if (!number[v]) continue;
        number[v] = (int32_t)kept;
        memmove(parts->vertices + 3 * kept++, parts->vertices + 3 * v, 3 * sizeof *parts->vertices);
    }
    for (size_t c = 0; c < 3 * count; ++c) triangles[c] = number[triangles[c]];
    parts->info.unused_vertices = parts->info.vertices - parts->info.merged_vertices - (int64_t)kept;
    parts->vertex_count = kept;
    sadmm_free(number);
    return SADMM_OK;
}
