#include "hull_write.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "hull_data.h"

size_t sadmm_hull_data_doubles(const struct hull_mesh *mesh)
{
    return (size_t)hull_doubles(mesh->vertex_count, mesh->face_count, mesh->edge_count);
}

/* `count` of `width` numbers each into as many rows of `stride`, the first one repeated at the end. */
static double *write_rows(const double *from, int32_t count, int width, double *to)
{
    const int32_t stride = hull_stride(count);
    for (int k = 0; k < width; ++k)
        for (int32_t i = 0; i < stride; ++i) *to++ = from[(i < count ? i : 0) * width + k];
    return to;
}

static void write_faces(const struct hull_mesh *mesh, uint16_t *first, uint16_t *corner_vertex, uint16_t *corner_edge)
{
    for (int32_t f = 0; f < mesh->face_count; ++f) {
        first[f + 1] = (uint16_t)mesh->face_first[f + 1];
        for (int32_t c = mesh->face_first[f]; c < mesh->face_first[f + 1]; ++c) {
            corner_vertex[c] = (uint16_t)mesh->corner[c];
            corner_edge[c] = (uint16_t)mesh->corner_edge[c];
        }
    }
}

static void write_edges(const struct hull_mesh *mesh, uint16_t *edge_vertex, uint16_t *edge_face)
{
    for (int32_t k = 0; k < 2 * mesh->edge_count; ++k) {
        edge_vertex[k] = (uint16_t)mesh->corner[mesh->edge_corner[k]];
        edge_face[k] = (uint16_t)sadmm_hull_mesh_face_of(mesh, mesh->edge_corner[k]);
    }
}

/* Neighbours of a vertex, in the order of edges. */
static void write_neighbours(const struct sadmm_hull_header *header, const uint16_t *edge_vertex, uint16_t *first,
                             uint16_t *next)
{
    for (int32_t k = 0; k < 2 * header->edges; ++k) ++first[edge_vertex[k] + 1];
    for (int32_t v = 0; v < header->vertices; ++v) first[v + 1] = (uint16_t)(first[v + 1] + first[v]);
    for (int32_t k = 0; k < 2 * header->edges; ++k) next[first[edge_vertex[k]]++] = edge_vertex[k ^ 1];
    for (int32_t v = header->vertices; v > 0; --v) first[v] = first[v - 1]; /* each was moved on to its end */
    first[0] = 0;
}

/* Are all faces flat, but for rounding? Merged ones are not: across them a body is not convex by their edges alone. */
static bool has_flat_faces(const struct hull_mesh *mesh, const double *vertices, const double *planes)
{
    double size = 0, bent = 0;
    for (int32_t k = 0; k < 3 * mesh->vertex_count; ++k) size = fmax(size, fabs(vertices[k]));
    for (int32_t f = 0; f < mesh->face_count; ++f)
        for (int32_t c = mesh->face_first[f]; c < mesh->face_first[f + 1]; ++c) {
            const double *n = planes + 4 * f, *x = vertices + 3 * mesh->corner[c];
            bent = fmax(bent, n[3] - (n[0] * x[0] + n[1] * x[1] + n[2] * x[2]));
        }
    return bent <= 1e-13 * size;
}

/* Where `mesh` has no faces, `ends` has the vertices of its edges; else NULL. */
static void write_block(const struct hull_mesh *mesh, const double *vertices, const double *planes,
                        double convex_radius, const uint16_t *ends, double *block)
{
    const struct sadmm_hull_header header = {
        .vertices = mesh->vertex_count,
        .faces = mesh->face_count,
        .edges = mesh->edge_count,
        .vertex_stride = hull_stride(mesh->vertex_count),
        .face_stride = hull_stride(mesh->face_count),
        .doubles = (int32_t)sadmm_hull_data_doubles(mesh),
        .climbs = has_flat_faces(mesh, vertices, planes),
        .convex_radius = convex_radius,
    };
    memset(block, 0, (size_t)header.doubles * sizeof *block);
    memcpy(block, &header, sizeof header);
    double *rows = write_rows(vertices, header.vertices, 3, block + HULL_HEADER_DOUBLES);
    uint16_t *face_first = (uint16_t *)write_rows(planes, header.faces, 4, rows);
    uint16_t *corner_vertex = face_first + header.faces + 1, *corner_edge = corner_vertex + 2 * header.edges;
    uint16_t *edge_vertex = corner_edge + 2 * header.edges, *edge_face = edge_vertex + 2 * header.edges;
    uint16_t *vertex_first = edge_face + 2 * header.edges, *vertex_next = vertex_first + header.vertices + 1;
    write_faces(mesh, face_first, corner_vertex, corner_edge);
    if (ends) memcpy(edge_vertex, ends, 2 * (size_t)header.edges * sizeof *ends);
    else write_edges(mesh, edge_vertex, edge_face);
    write_neighbours(&header, edge_vertex, vertex_first, vertex_next);
}

void sadmm_hull_data_write(const struct hull_mesh *mesh, const double *vertices, const double *planes,
                           double convex_radius, double *block)
{
    write_block(mesh, vertices, planes, convex_radius, NULL, block);
}

/* ---- blocks that all shape data begins with ---- */

/* Faces by axis, the positive side first. Counter-clockwise from outside, the lowest vertex first. */
static void write_cube(double *block)
{
    static int32_t first[] = {0, 4, 8, 12, 16, 20, 24};
    static int32_t corner[] = {1, 3, 7, 5, 0, 4, 6, 2, 2, 6, 7, 3, 0, 1, 5, 4, 4, 5, 7, 6, 0, 2, 3, 1};
    /* Edges in the order in which the corners come to them. */
    static int32_t corner_edge[] = {0, 1, 2, 3, 4, 5, 6, 7, 6, 8, 1, 9, 10, 3, 11, 4, 11, 2, 8, 5, 7, 9, 0, 10};
    static int32_t edge_corner[] = {0, 22, 1, 10, 2, 17, 3,  13, 4,  15, 5,  19,
                                    6, 8,  7, 20, 9, 18, 11, 21, 12, 23, 14, 16};
    const struct hull_mesh cube = {.vertex_count = 8, .face_count = 6, .edge_count = 12, .face_first = first,
                                   .corner = corner, .corner_edge = corner_edge, .edge_corner = edge_corner};
    double vertices[24], planes[24] = {0};
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k) vertices[3 * v + k] = v >> k & 1 ? 1 : -1;
    for (int f = 0; f < 6; ++f) {
        planes[4 * f + f / 2] = f % 2 ? -1 : 1;
        planes[4 * f + 3] = 1;
    }
    write_block(&cube, vertices, planes, 0, NULL, block);
}

void sadmm_hull_prelude(double *data)
{
    static const double segment[] = {0, 0, -1, 0, 0, 1}, point[] = {0, 0, 0};
    static const uint16_t ends[] = {0, 1};
    write_cube(data + HULL_CUBE);
    write_block(&(struct hull_mesh){.vertex_count = 2, .edge_count = 1}, segment, NULL, 0, ends, data + HULL_SEGMENT);
    write_block(&(struct hull_mesh){.vertex_count = 1}, point, NULL, 0, NULL, data + HULL_POINT);
}
