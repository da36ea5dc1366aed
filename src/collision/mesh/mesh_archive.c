/* A mesh in a saved world. What is read is held against all that contact finding relies on: indices in range, a tree
 * whose walks end. */
#include <math.h>

#include "core/base/archive.h"
#include "core/base/check.h"
#include "core/base/memory.h"
#include "mesh.h"
#include "mesh_data.h"

static bool within(const int32_t *numbers, size_t count, int32_t least, int32_t limit)
{
    for (size_t k = 0; k < count; ++k)
        if (numbers[k] < least || numbers[k] >= limit) return false;
    return true;
}

static bool heights_fit(const struct sadmm_mesh *mesh, const struct sadmm_mesh_header *h)
{
    return h->columns >= 2 && h->rows >= 2 && h->columns <= MESH_MOST_COLUMNS && h->rows <= MESH_MOST_COLUMNS &&
           mesh->doubles == mesh_height_doubles((size_t)h->columns, (size_t)h->rows) &&
           h->triangles == 2 * (h->columns - 1) * (h->rows - 1) && h->spacing[0] > 0 && h->spacing[1] > 0 &&
           sadmm_all_finite(h->spacing, 2) && h->half_height >= 0 && isfinite(h->half_height) &&
           sadmm_all_finite(mesh->block + MESH_HEADER_DOUBLES, (size_t)h->columns * (size_t)h->rows) && !mesh->source;
}

/* A walk goes forward, to a node below or to `next`. */
static bool nodes_fit(const struct mesh *m)
{
    for (int32_t i = 0; i < m->nodes; ++i) {
        const struct mesh_node *node = &m->node[i];
        if (node->next <= i || node->next > m->nodes || node->first < -1) return false;
        if (node->first < 0 ? node->next == i + 1 : node->next != i + 1) return false;
        if (node->first >= 0 && (int64_t)(node->first >> 3) + (node->first & 7) > m->triangles) return false;
        for (int k = 0; k < 3; ++k)
            if (!(node->lo[k] <= node->hi[k])) return false;
    }
    return true;
}

static bool triangles_fit(const struct sadmm_mesh *mesh, const struct sadmm_mesh_header *h)
{
    struct mesh m;
    if (h->triangles < 1 || h->vertices < 3 || h->nodes < 1 || h->ring < 0 ||
        mesh->doubles != mesh_triangle_doubles((size_t)h->triangles, (size_t)h->vertices, (size_t)h->nodes,
                                               (size_t)h->ring))
        return false;
    mesh_at(mesh->block, 0, &m);
    const size_t triangles = (size_t)m.triangles;
    if (!sadmm_all_finite(m.x, 3 * (size_t)m.vertices) || !within(m.corner, 3 * triangles, 0, m.vertices) ||
        !within(m.opposite, 3 * triangles, -1, m.vertices) || !within(m.ring, (size_t)h->ring, 0, m.vertices) ||
        !within(m.ring_first, (size_t)m.vertices + 1, 0, h->ring + 1) || !nodes_fit(&m))
        return false;
    for (int32_t v = 0; v < m.vertices; ++v)
        if (m.ring_first[v] > m.ring_first[v + 1]) return false;
    return true;
}

static bool mesh_fits(const struct sadmm_mesh *mesh)
{
    const struct sadmm_mesh_header *h = (const struct sadmm_mesh_header *)mesh->block;
    if (mesh->doubles < MESH_HEADER_DOUBLES || h->doubles < 0 || (size_t)h->doubles != mesh->doubles ||
        h->reserved != 0 || !sadmm_all_finite(mesh->half, 3) || !sadmm_all_finite(mesh->middle, 3))
        return false;
    return h->kind == MESH_HEIGHTS ? heights_fit(mesh, h) : h->kind == MESH_TRIANGLES && triangles_fit(mesh, h);
}

/* Of vertices or heights, where they are kept as they were given. */
static size_t numbers_given(const struct sadmm_mesh_header *header)
{
    return header->kind == MESH_HEIGHTS ? (size_t)header->columns * (size_t)header->rows : 3 * (size_t)header->vertices;
}

void sadmm_mesh_archive(struct sadmm_archive *archive, sadmm_mesh **mesh)
{
    size_t sources = 0, given = 0;
    if (archive->reading) {
        *mesh = (sadmm_mesh *)sadmm_alloc(1, sizeof **mesh);
        if (!*mesh) {
            if (archive->status == SADMM_OK) archive->status = sadmm_fail_memory(archive->error, "a mesh");
            return;
        }
        atomic_init(&(*mesh)->uses, 1);
    }
    struct sadmm_mesh *m = *mesh;
    SADMM_ARCHIVE(archive, m->half);
    SADMM_ARCHIVE(archive, m->middle);
    SADMM_ARCHIVE(archive, m->left_out);
    sadmm_archive_array(archive, &m->block, &m->doubles, sizeof *m->block, INT32_MAX);
    const struct sadmm_mesh_header *header = (const struct sadmm_mesh_header *)m->block;
    if (!archive->reading && m->source) sources = (size_t)header->triangles;
    if (!archive->reading && m->given) given = numbers_given(header);
    sadmm_archive_array(archive, &m->source, &sources, sizeof *m->source, INT32_MAX);
    sadmm_archive_array(archive, &m->given, &given, sizeof *m->given, INT32_MAX);
    if (!archive->reading || archive->status != SADMM_OK) return;
    if (!sadmm_archive_expect(archive, mesh_fits(m), "a mesh")) return;
    header = (const struct sadmm_mesh_header *)m->block;
    sadmm_archive_expect(archive,
                         (sources == 0 || sources == (size_t)header->triangles) &&
                             (given == 0 || given == numbers_given(header)) && sadmm_all_finite(m->given, given),
                         "a mesh");
}
