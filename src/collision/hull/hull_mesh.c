#include "hull_mesh.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

void sadmm_hull_mesh_free(struct hull_mesh *mesh)
{
    sadmm_free(mesh->point);
    sadmm_free(mesh->face_first);
    sadmm_free(mesh->corner);
    sadmm_free(mesh->corner_edge);
    sadmm_free(mesh->edge_corner);
    memset(mesh, 0, sizeof *mesh);
}

static int32_t corner_count(const struct hull_mesh *mesh)
{
    return mesh->face_count > 0 ? mesh->face_first[mesh->face_count] : 0;
}

bool sadmm_hull_mesh_add(struct hull_mesh *mesh, const int32_t *points, int32_t count)
{
    const size_t faces = (size_t)mesh->face_count, corners = (size_t)corner_count(mesh);
    if (!SADMM_GROW(mesh->face_first, faces ? faces + 1 : 0, faces + 2) ||
        !SADMM_GROW(mesh->corner, corners, corners + (size_t)count))
        return false;
    memcpy(mesh->corner + corners, points, (size_t)count * sizeof *points);
    mesh->face_first[++mesh->face_count] = (int32_t)corners + count;
    return true;
}

/* ---- vertices ---- */

/* How many faces have a point as corner; false: one has it twice. `last`: face + 1 that came to a point last. */
static bool count_uses(const struct hull_mesh *mesh, int32_t *uses, int32_t *last)
{
    for (int32_t f = 0; f < mesh->face_count; ++f)
        for (int32_t c = mesh->face_first[f]; c < mesh->face_first[f + 1]; ++c) {
            const int32_t p = mesh->corner[c];
            if (last[p] == f + 1) return false;
            last[p] = f + 1;
            ++uses[p];
        }
    return true;
}

/* Leave out the corners at points of fewer than three faces: there are no edges that end there. */
static bool drop_corners(struct hull_mesh *mesh, const int32_t *uses)
{
    int32_t kept = 0;
    for (int32_t f = 0, begin = 0; f < mesh->face_count; ++f) {
        const int32_t end = mesh->face_first[f + 1], first = kept;
        for (int32_t c = begin; c < end; ++c)
            if (uses[mesh->corner[c]] >= 3) mesh->corner[kept++] = mesh->corner[c];
        begin = end;
        mesh->face_first[f + 1] = kept;
        if (kept - first < 3) return false;
    }
    return true;
}

/* Points that are left become vertices; `uses` becomes the vertex of a point. */
static bool number_vertices(struct hull_mesh *mesh, int32_t *uses, int32_t point_count)
{
    int32_t vertices = 0;
    for (int32_t p = 0; p < point_count; ++p) vertices += uses[p] >= 3;
    if (!SADMM_GROW(mesh->point, 0, (size_t)vertices)) return false;
    mesh->vertex_count = 0;
    for (int32_t p = 0; p < point_count; ++p) {
        if (uses[p] < 3) continue;
        mesh->point[mesh->vertex_count] = p;
        uses[p] = mesh->vertex_count++;
    }
    for (int32_t c = 0; c < corner_count(mesh); ++c) mesh->corner[c] = uses[mesh->corner[c]];
    return true;
}

/* ---- edges ---- */

struct half_edge {
    int32_t low, high, corner; /* vertices; the corner that it leaves, which is at one of them */
};

static int compare_half_edges(const void *a, const void *b)
{
    const struct half_edge *p = (const struct half_edge *)a, *q = (const struct half_edge *)b;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    if (p->high != q->high) return p->high < q->high ? -1 : 1;
    return (p->corner > q->corner) - (p->corner < q->corner);
}

static void list_half_edges(const struct hull_mesh *mesh, struct half_edge *list)
{
    for (int32_t f = 0; f < mesh->face_count; ++f)
        for (int32_t c = mesh->face_first[f], end = mesh->face_first[f + 1]; c < end; ++c) {
            const int32_t from = mesh->corner[c], to = mesh->corner[c + 1 < end ? c + 1 : mesh->face_first[f]];
            list[c].low = from < to ? from : to;
            list[c].high = from < to ? to : from;
            list[c].corner = c;
        }
}

/* Both corners that an edge leaves, by either of them, into `other`. */
static bool pair_half_edges(const struct hull_mesh *mesh, const struct half_edge *list, int32_t *other)
{
    const int32_t count = corner_count(mesh);
    if (count % 2 != 0) return false;
    for (int32_t k = 0; k < count; k += 2) {
        const struct half_edge *a = &list[k], *b = &list[k + 1];
        if (a->low != b->low || a->high != b->high || mesh->corner[a->corner] == mesh->corner[b->corner]) return false;
        if (k + 2 < count && list[k + 2].low == a->low && list[k + 2].high == a->high) return false;
        other[a->corner] = b->corner;
        other[b->corner] = a->corner;
    }
    return true;
}

static enum hull_mesh_is link_edges(struct hull_mesh *mesh)
{
    const int32_t count = corner_count(mesh);
    enum hull_mesh_is is = HULL_MESH_NO_MEMORY;
    struct half_edge *list = (struct half_edge *)sadmm_alloc((size_t)count, sizeof *list);
    int32_t *other = (int32_t *)sadmm_alloc((size_t)count, sizeof *other);
    mesh->edge_count = 0;
    if (list && other && SADMM_GROW(mesh->corner_edge, 0, (size_t)count) &&
        SADMM_GROW(mesh->edge_corner, 0, (size_t)count)) {
        list_half_edges(mesh, list);
        qsort(list, (size_t)count, sizeof *list, compare_half_edges);
        is = pair_half_edges(mesh, list, other) ? HULL_MESH_CLOSED : HULL_MESH_OPEN;
        for (int32_t c = 0; c < count && is == HULL_MESH_CLOSED; ++c) {
            if (other[c] > c) {
                mesh->edge_corner[2 * mesh->edge_count] = c;
                mesh->edge_corner[2 * mesh->edge_count + 1] = other[c];
                mesh->corner_edge[c] = mesh->edge_count++;
            } else mesh->corner_edge[c] = mesh->corner_edge[other[c]];
        }
    }
    sadmm_free(list);
    sadmm_free(other);
    return is;
}

enum hull_mesh_is sadmm_hull_mesh_close(struct hull_mesh *mesh, int32_t point_count)
{
    enum hull_mesh_is is = HULL_MESH_NO_MEMORY;
    int32_t *uses = (int32_t *)sadmm_alloc((size_t)point_count, sizeof *uses);
    int32_t *last = (int32_t *)sadmm_alloc((size_t)point_count, sizeof *last);
    if (uses && last) {
        if (!count_uses(mesh, uses, last) || !drop_corners(mesh, uses)) is = HULL_MESH_OPEN;
        else if (number_vertices(mesh, uses, point_count)) is = link_edges(mesh);
    }
    sadmm_free(uses);
    sadmm_free(last);
    if (is == HULL_MESH_CLOSED && mesh->vertex_count - mesh->edge_count + mesh->face_count != 2) is = HULL_MESH_OPEN;
    return is;
}

/* ---- order ---- */

struct face_key {
    const int32_t *corner;
    int32_t count, face;
};

static int compare_faces(const void *a, const void *b)
{
    const struct face_key *p = (const struct face_key *)a, *q = (const struct face_key *)b;
    for (int32_t k = 0; k < p->count && k < q->count; ++k)
        if (p->corner[k] != q->corner[k]) return p->corner[k] < q->corner[k] ? -1 : 1;
    return (p->count > q->count) - (p->count < q->count);
}

/* Corners of a face into `out`, the lowest first. */
static void rotate(const int32_t *corner, int32_t count, int32_t *out)
{
    int32_t lowest = 0;
    for (int32_t k = 1; k < count; ++k)
        if (corner[k] < corner[lowest]) lowest = k;
    for (int32_t k = 0; k < count; ++k) out[k] = corner[(lowest + k) % count];
}

bool sadmm_hull_mesh_order(struct hull_mesh *mesh, const int32_t *rank, double *planes)
{
    const size_t faces = (size_t)mesh->face_count, corners = (size_t)corner_count(mesh),
                 vertices = (size_t)mesh->vertex_count;
    struct face_key *keys = (struct face_key *)sadmm_alloc(faces, sizeof *keys);
    int32_t *turned = (int32_t *)sadmm_alloc(corners, sizeof *turned);
    int32_t *point = (int32_t *)sadmm_alloc(vertices, sizeof *point);
    double *moved = planes ? (double *)sadmm_alloc(faces, 4 * sizeof *moved) : NULL;
    bool done = keys && turned && point && (moved || !planes);
    for (int32_t v = 0; done && v < mesh->vertex_count; ++v) point[rank[v]] = mesh->point[v];
    for (size_t c = 0; done && c < corners; ++c) mesh->corner[c] = rank[mesh->corner[c]];
    for (int32_t f = 0; done && f < mesh->face_count; ++f) {
        const int32_t first = mesh->face_first[f], count = mesh->face_first[f + 1] - first;
        rotate(mesh->corner + first, count, turned + first);
        keys[f] = (struct face_key){turned + first, count, f};
    }
    if (done) {
        qsort(keys, faces, sizeof *keys, compare_faces);
        memcpy(mesh->point, point, vertices * sizeof *point);
        int32_t at = 0;
        for (size_t f = 0; f < faces; ++f) {
            memcpy(mesh->corner + at, keys[f].corner, (size_t)keys[f].count * sizeof *mesh->corner);
            mesh->face_first[f + 1] = at += keys[f].count;
            if (moved) memcpy(moved + 4 * f, planes + 4 * keys[f].face, 4 * sizeof *moved);
        }
        if (moved) memcpy(planes, moved, 4 * faces * sizeof *moved);
        done = link_edges(mesh) == HULL_MESH_CLOSED;
    }
    sadmm_free(keys);
    sadmm_free(turned);
    sadmm_free(point);
    sadmm_free(moved);
    return done;
}

int32_t sadmm_hull_mesh_face_of(const struct hull_mesh *mesh, int32_t corner)
{
    int32_t low = 0, high = mesh->face_count; /* the last face that begins no later */
    while (high - low > 1) {
        const int32_t middle = low + (high - low) / 2;
        if (mesh->face_first[middle] <= corner) low = middle;
        else high = middle;
    }
    return low;
}
