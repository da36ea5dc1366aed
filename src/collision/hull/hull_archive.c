/* A hull in a saved world. What is read is held against all that contact finding relies on: indices in range, faces,
 * edges and neighbours that say the same. */
#include <math.h>

#include "core/base/archive.h"
#include "core/base/check.h"
#include "core/base/memory.h"
#include "hull.h"
#include "hull_data.h"

/* 16-bit numbers from `*at` on, ascending from 0 to `end`. */
static bool ascends(const uint16_t *first, int32_t count, int32_t end)
{
    if (first[0] != 0 || first[count] != end) return false;
    for (int32_t k = 0; k < count; ++k)
        if (first[k] > first[k + 1]) return false;
    return true;
}

static bool below(const uint16_t *numbers, int32_t count, int32_t limit)
{
    for (int32_t k = 0; k < count; ++k)
        if (numbers[k] >= limit) return false;
    return true;
}

struct links {
    const uint16_t *face_first, *corner_vertex, *corner_edge, *edge_vertex, *edge_face, *vertex_first, *vertex_next;
};

/* Corner c of face f: the edge from it to the face's next corner runs that way there. */
static bool corner_fits(const struct links *l, int32_t f, int32_t c)
{
    const int32_t next = c + 1 < l->face_first[f + 1] ? c + 1 : l->face_first[f], edge = 2 * l->corner_edge[c];
    for (int32_t side = 0; side < 2; ++side)
        if (l->edge_face[edge + side] == f && l->edge_vertex[edge + side] == l->corner_vertex[c] &&
            l->edge_vertex[edge + 1 - side] == l->corner_vertex[next])
            return true;
    return false;
}

static bool links_fit(const struct sadmm_hull_header *h, const struct links *l)
{
    const int32_t halves = 2 * h->edges;
    if (!ascends(l->face_first, h->faces, halves) || !ascends(l->vertex_first, h->vertices, halves) ||
        !below(l->corner_vertex, halves, h->vertices) || !below(l->corner_edge, halves, h->edges) ||
        !below(l->edge_vertex, halves, h->vertices) || !below(l->edge_face, halves, h->faces) ||
        !below(l->vertex_next, halves, h->vertices))
        return false;
    for (int32_t f = 0; f < h->faces; ++f) {
        if (l->face_first[f + 1] - l->face_first[f] < 3) return false;
        for (int32_t c = l->face_first[f]; c < l->face_first[f + 1]; ++c)
            if (!corner_fits(l, f, c)) return false;
    }
    for (int32_t v = 0; v < h->vertices; ++v)
        if (l->vertex_first[v] == l->vertex_first[v + 1]) return false;
    return true;
}

static bool header_fits(const struct sadmm_hull *hull)
{
    const struct sadmm_hull_header *h = (const struct sadmm_hull_header *)hull->block;
    return h->vertices >= 4 && h->vertices <= HULL_MOST_VERTICES && h->edges >= 6 && h->edges <= HULL_MOST_EDGES &&
           h->faces >= 4 && h->faces == 2 - h->vertices + h->edges && h->vertex_stride == hull_stride(h->vertices) &&
           h->face_stride == hull_stride(h->faces) && h->doubles == hull_doubles(h->vertices, h->faces, h->edges) &&
           (size_t)h->doubles == hull->doubles && h->reserved == 0 && h->convex_radius >= 0 &&
           isfinite(h->convex_radius) && h->vertices == hull->vertex_count && h->edges == hull->edge_count &&
           h->faces == hull->face_count;
}

static bool block_fits(const struct sadmm_hull *hull)
{
    const struct sadmm_hull_header *h = (const struct sadmm_hull_header *)hull->block;
    if (hull->doubles < HULL_HEADER_DOUBLES || !header_fits(hull)) return false;
    const size_t numbers = 3 * (size_t)h->vertex_stride + 4 * (size_t)h->face_stride;
    const double *x = hull->block + HULL_HEADER_DOUBLES;
    struct links l = {.face_first = (const uint16_t *)(x + numbers)};
    l.corner_vertex = l.face_first + h->faces + 1;
    l.corner_edge = l.corner_vertex + 2 * h->edges;
    l.edge_vertex = l.corner_edge + 2 * h->edges;
    l.edge_face = l.edge_vertex + 2 * h->edges;
    l.vertex_first = l.edge_face + 2 * h->edges;
    l.vertex_next = l.vertex_first + h->vertices + 1;
    return sadmm_all_finite(x, numbers) && links_fit(h, &l);
}

/* The faces that callers see: lists of corners. */
static bool faces_fit(const struct sadmm_hull *hull)
{
    if (hull->face_first[0] != 0) return false;
    for (int32_t f = 0; f < hull->face_count; ++f)
        if (hull->face_first[f] > hull->face_first[f + 1]) return false;
    if (hull->face_first[hull->face_count] != 2 * hull->edge_count) return false;
    for (int32_t c = 0; c < 2 * hull->edge_count; ++c)
        if (hull->corners[c] < 0 || hull->corners[c] >= hull->vertex_count) return false;
    return true;
}

/* How much there is of it; false: no hull has that. */
static bool counts_fit(const struct sadmm_hull *hull)
{
    return hull->vertex_count >= 4 && hull->vertex_count <= HULL_MOST_VERTICES && hull->edge_count >= 6 &&
           hull->edge_count <= HULL_MOST_EDGES && hull->face_count >= 4 && hull->face_count <= HULL_MOST_EDGES;
}

static void archive_lists(struct sadmm_archive *archive, struct sadmm_hull *hull)
{
    const size_t vertices = (size_t)hull->vertex_count, faces = (size_t)hull->face_count,
                 corners = 2 * (size_t)hull->edge_count;
    if (archive->reading &&
        !(sadmm_archive_expect(archive, counts_fit(hull) && hull->doubles <= archive->size / sizeof(double),
                               "a hull") &&
          sadmm_archive_room(archive, &hull->block, hull->doubles, sizeof *hull->block) &&
          sadmm_archive_room(archive, &hull->vertices, 3 * vertices, sizeof *hull->vertices) &&
          sadmm_archive_room(archive, &hull->face_first, faces + 1, sizeof *hull->face_first) &&
          sadmm_archive_room(archive, &hull->corners, corners, sizeof *hull->corners)))
        return;
    sadmm_archive_bytes(archive, hull->block, hull->doubles * sizeof *hull->block);
    sadmm_archive_bytes(archive, hull->vertices, 3 * vertices * sizeof *hull->vertices);
    sadmm_archive_bytes(archive, hull->face_first, (faces + 1) * sizeof *hull->face_first);
    sadmm_archive_bytes(archive, hull->corners, corners * sizeof *hull->corners);
    if (archive->reading && archive->status == SADMM_OK)
        sadmm_archive_expect(archive,
                             block_fits(hull) && faces_fit(hull) && sadmm_all_finite(hull->vertices, 3 * vertices) &&
                                 hull->merge >= 0 && hull->merge <= 1e-2 && sadmm_all_finite(hull->half, 3) &&
                                 sadmm_all_finite(hull->position, 3) && sadmm_all_finite(hull->orientation, 4),
                             "a hull");
}

void sadmm_hull_archive(struct sadmm_archive *archive, sadmm_hull **hull)
{
    uint64_t doubles;
    if (archive->reading) {
        *hull = (sadmm_hull *)sadmm_alloc(1, sizeof **hull);
        if (!*hull) {
            if (archive->status == SADMM_OK) archive->status = sadmm_fail_memory(archive->error, "a hull");
            return;
        }
        atomic_init(&(*hull)->uses, 1);
    }
    struct sadmm_hull *h = *hull;
    doubles = h->doubles;
    SADMM_ARCHIVE(archive, h->vertex_count);
    SADMM_ARCHIVE(archive, h->edge_count);
    SADMM_ARCHIVE(archive, h->face_count);
    SADMM_ARCHIVE(archive, doubles);
    SADMM_ARCHIVE(archive, h->merge);
    SADMM_ARCHIVE(archive, h->convex_radius);
    SADMM_ARCHIVE(archive, h->half);
    SADMM_ARCHIVE(archive, h->position);
    SADMM_ARCHIVE(archive, h->orientation);
    SADMM_ARCHIVE(archive, h->volume);
    SADMM_ARCHIVE(archive, h->centre);
    SADMM_ARCHIVE(archive, h->moments);
    SADMM_ARCHIVE(archive, h->axes);
    h->doubles = (size_t)doubles;
    archive_lists(archive, h);
}
