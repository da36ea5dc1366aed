/* Meshes: their uses, and what callers see of them. */
#include "mesh.h"

#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "mesh_triangle.h"

/* ---- uses -------------------------------------------------------------------------------------------------------- */

void sadmm_mesh_retain(const sadmm_mesh *mesh)
{
    if (mesh) atomic_fetch_add_explicit(&((sadmm_mesh *)mesh)->uses, 1, memory_order_relaxed);
}

void sadmm_mesh_release(const sadmm_mesh *mesh)
{
    sadmm_mesh *own = (sadmm_mesh *)mesh; /* const to everybody but its last user */
    if (!own || atomic_fetch_sub_explicit(&own->uses, 1, memory_order_acq_rel) != 1) return;
    sadmm_free(own->block);
    sadmm_free(own->source);
    sadmm_free(own->given);
    sadmm_free(own);
}

void sadmm_mesh_destroy(sadmm_mesh *mesh) { sadmm_mesh_release(mesh); }

/* ---- what callers see -------------------------------------------------------------------------------------------- */

static const struct sadmm_mesh_header *header_of(const sadmm_mesh *mesh)
{
    return (const struct sadmm_mesh_header *)mesh->block;
}

int64_t sadmm_mesh_triangle_count(const sadmm_mesh *mesh) { return mesh ? header_of(mesh)->triangles : 0; }
int64_t sadmm_mesh_left_out(const sadmm_mesh *mesh) { return mesh ? mesh->left_out : 0; }
int64_t sadmm_mesh_open_edges(const sadmm_mesh *mesh) { return mesh ? header_of(mesh)->open_edges : 0; }
size_t sadmm_mesh_bytes(const sadmm_mesh *mesh) { return mesh ? mesh->doubles * sizeof *mesh->block : 0; }

sadmm_status sadmm_mesh_bounds(const sadmm_mesh *mesh, double lowest[3], double highest[3])
{
    TRY(sadmm_check_given(mesh, "mesh", NULL));
    TRY(sadmm_check_given(lowest, "lowest", NULL));
    TRY(sadmm_check_given(highest, "highest", NULL));
    for (int k = 0; k < 3; ++k) {
        lowest[k] = mesh->middle[k] - mesh->half[k];
        highest[k] = mesh->middle[k] + mesh->half[k];
    }
    return SADMM_OK;
}

int64_t sadmm_mesh_vertex_count(const sadmm_mesh *mesh)
{
    if (!mesh) return 0;
    const struct sadmm_mesh_header *header = header_of(mesh);
    return header->kind == MESH_HEIGHTS ? (int64_t)header->columns * header->rows : header->vertices;
}

static sadmm_status check_index(int64_t index, int64_t count, const char *name)
{
    if (index >= 0 && index < count) return SADMM_OK;
    return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "%s = %lld: must be in [0, %lld)", name, (long long)index,
                      (long long)count);
}

sadmm_status sadmm_mesh_vertex_at(const sadmm_mesh *mesh, int64_t vertex, double position[3])
{
    struct mesh view;
    TRY(sadmm_check_given(mesh, "mesh", NULL));
    TRY(sadmm_check_given(position, "position", NULL));
    TRY(check_index(vertex, sadmm_mesh_vertex_count(mesh), "vertex"));
    mesh_at(mesh->block, 0, &view);
    v3_store(v3_add(mesh_vertex(&view, (int32_t)vertex), v3_load(mesh->middle)), position);
    if (mesh->given && view.kind == MESH_HEIGHTS) position[2] = mesh->given[vertex];
    else if (mesh->given) memcpy(position, mesh->given + 3 * vertex, 3 * sizeof *position);
    return SADMM_OK;
}

sadmm_status sadmm_mesh_triangle_at(const sadmm_mesh *mesh, int64_t triangle, int32_t vertices[3], int32_t *number)
{
    struct mesh view;
    int32_t opposite[3];
    TRY(sadmm_check_given(mesh, "mesh", NULL));
    TRY(sadmm_check_given(vertices, "vertices", NULL));
    TRY(sadmm_check_given(number, "number", NULL));
    TRY(check_index(triangle, sadmm_mesh_triangle_count(mesh), "triangle"));
    mesh_at(mesh->block, 0, &view);
    mesh_corners(&view, (int32_t)triangle, vertices, opposite);
    *number = mesh->source ? mesh->source[triangle] : (int32_t)triangle;
    return SADMM_OK;
}

sadmm_status sadmm_mesh_grid(const sadmm_mesh *mesh, int32_t *columns, int32_t *rows, double spacing[2])
{
    TRY(sadmm_check_given(mesh, "mesh", NULL));
    TRY(sadmm_check_given(columns, "columns", NULL));
    TRY(sadmm_check_given(rows, "rows", NULL));
    TRY(sadmm_check_given(spacing, "spacing", NULL));
    const struct sadmm_mesh_header *header = header_of(mesh);
    *columns = header->columns;
    *rows = header->rows;
    memcpy(spacing, header->spacing, sizeof header->spacing);
    return SADMM_OK;
}
