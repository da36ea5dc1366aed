#include "parts.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "core/base/memory.h"

void sadmm_mesh_file_free_parts(struct mesh_parts *parts)
{
    sadmm_free(parts->vertices);
    sadmm_free(parts->corners);
    sadmm_free(parts->face_size);
}

sadmm_status sadmm_mesh_file_fail(const struct mesh_parts *parts, size_t line, sadmm_status status, const char *format,
                                  ...)
{
    char what[SADMM_MESSAGE_SIZE / 2];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    if (line == 0) return sadmm_fail(NULL, status, "%s: %s", parts->source->name, what);
    return sadmm_fail(NULL, status, "%s, line %zu: %s", parts->source->name, line, what);
}

sadmm_status sadmm_mesh_file_add_vertex(struct mesh_parts *parts, size_t line, const double x[3])
{
    if (parts->vertex_count >= MESH_MOST_VERTICES)
        return sadmm_mesh_file_fail(parts, line, SADMM_ERROR_LIMIT, "more than %d vertices", MESH_MOST_VERTICES);
    if (!sadmm_grow(&parts->vertices, parts->vertex_count, parts->vertex_count + 1, 3 * sizeof *parts->vertices))
        return sadmm_fail_memory(NULL, "the vertices of a mesh file");
    for (int k = 0; k < 3; ++k) {
        const double m = x[k] * parts->scale;
        if (!(fabs(m) <= 1e6))
            return sadmm_mesh_file_fail(parts, line, SADMM_ERROR_INVALID_ARGUMENT,
                                        "vertex %zu: %c = %g, by def->scale %g m: must be in [-1e6, 1e6] m",
                                        parts->vertex_count + 1, 'x' + k, x[k], m);
        parts->vertices[3 * parts->vertex_count + (size_t)k] = m + 0.0; /* -0 is 0 */
    }
    ++parts->vertex_count;
    return SADMM_OK;
}

sadmm_status sadmm_mesh_file_add_corner(struct mesh_parts *parts, size_t line, int64_t vertex, size_t count, int from)
{
    if (vertex < 0 || (uint64_t)vertex >= count)
        return sadmm_mesh_file_fail(
            parts, line, SADMM_ERROR_INVALID_ARGUMENT,
            "face %lld: vertex %lld: must be in [%d, %lld], there are %zu vertices%s",
            (long long)(parts->info.faces + parts->info.short_faces + parts->info.other_faces + 1),
            (long long)vertex + from, from, (long long)count - 1 + from, count, from == 1 ? " before it" : "");
    if (parts->corner_count >= MESH_MOST_CORNERS)
        return sadmm_mesh_file_fail(parts, line, SADMM_ERROR_LIMIT, "faces have more than %zu corners",
                                    MESH_MOST_CORNERS);
    if (!SADMM_GROW(parts->corners, parts->corner_count, parts->corner_count + 1))
        return sadmm_fail_memory(NULL, "the faces of a mesh file");
    parts->corners[parts->corner_count++] = (int32_t)vertex;
    return SADMM_OK;
}

sadmm_status sadmm_mesh_file_end_face(struct mesh_parts *parts, bool wanted)
{
    const size_t size = parts->corner_count - parts->face_begin;
    if (size < 3 || !wanted) {
        ++*(wanted ? &parts->info.short_faces : &parts->info.other_faces);
        parts->corner_count = parts->face_begin;
        return SADMM_OK;
    }
    if (!SADMM_GROW(parts->face_size, parts->face_count, parts->face_count + 1))
        return sadmm_fail_memory(NULL, "the faces of a mesh file");
    parts->face_size[parts->face_count++] = (int32_t)size;
    parts->face_begin = parts->corner_count;
    ++parts->info.faces;
    parts->info.split_faces += size > 3;
    return SADMM_OK;
}
