/* Mesh files: from bytes to what callers see of them.
 *
 * A reader of its own, since none of the libraries that distributions carry stood up to damaged files
 * (docs/internals/decisions.md). Each format puts together vertices and faces (parts.h); all that follows is the same
 * for all: faces become triangles, equal vertices one, triangles without area and vertices without a triangle go.
 */
#include "subadmm/mesh_file.h"

#include <locale.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "format.h"
#include "obj.h"
#include "parts.h"
#include "ply.h"
#include "source.h"
#include "stl.h"
#include "triangles.h"
#include "triangulate.h"

struct sadmm_mesh_file {
    double *vertices;
    int32_t *triangles;
    int32_t vertex_count, triangle_count;
    sadmm_mesh_file_info info;
};

static const sadmm_mesh_file_def defaults = {
    .format = SADMM_MESH_FILE_ANY, .scale = 1, .merge = true, .drop_degenerate = true};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_mesh_file_def, &defaults, drop_degenerate);

void sadmm_mesh_file_def_init(sadmm_mesh_file_def *def, size_t size) { sadmm_growing_init(&growing, def, size, 0); }

void sadmm_mesh_file_destroy(sadmm_mesh_file *file)
{
    if (!file) return;
    sadmm_free(file->vertices);
    sadmm_free(file->triangles);
    sadmm_free(file);
}

static sadmm_status check_def(const sadmm_mesh_file_def *def)
{
    if (!def->path && !def->bytes)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def->path and def->bytes = NULL: one must be given");
    if (def->path && def->bytes)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def->path and def->bytes: only one may be given");
    if ((def->size > 0) != (def->bytes != NULL))
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def->size = %zu: must be %s", def->size,
                          def->bytes ? "> 0 with def->bytes" : "0 with def->path");
    if ((unsigned)def->format >= SADMM_MESH_FILE_FORMAT_COUNT)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def->format = %d: must be in [0, %d)", (int)def->format,
                          SADMM_MESH_FILE_FORMAT_COUNT);
    if (def->object && (def->object[0] == 0 || strpbrk(def->object, " \t\v\f\r\n")))
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def->object = \"%.40s\": must be one word", def->object);
    return sadmm_check_range("def->scale", def->scale, 1e-9, 1e9, NULL);
}

static sadmm_status read_parts(struct mesh_parts *parts)
{
    sadmm_status (*const readers[])(struct mesh_parts *) = {
        [SADMM_MESH_FILE_OBJ] = sadmm_mesh_file_read_obj,
        [SADMM_MESH_FILE_STL] = sadmm_mesh_file_read_stl,
        [SADMM_MESH_FILE_PLY] = sadmm_mesh_file_read_ply,
    };
    if (parts->object && parts->info.format != SADMM_MESH_FILE_OBJ)
        return sadmm_mesh_file_fail(parts, 0, SADMM_ERROR_INVALID_ARGUMENT,
                                    "def->object = \"%.40s\": must be NULL, objects are of OBJ files only",
                                    parts->object);
    /* Decimal points are points. */
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (plain == (locale_t)0) return sadmm_fail_memory(NULL, "a locale");
    const locale_t own = uselocale(plain);
    const sadmm_status status = readers[parts->info.format](parts);
    uselocale(own);
    freelocale(plain);
    return status;
}

static sadmm_status fail_without_triangle(const struct mesh_parts *parts)
{
    const sadmm_mesh_file_info *const info = &parts->info;
    if (info->faces > 0)
        return sadmm_mesh_file_fail(parts, 0, SADMM_ERROR_INVALID_ARGUMENT,
                                    "no triangle: all of its %lld faces are degenerate", (long long)info->faces);
    if (parts->object)
        return sadmm_mesh_file_fail(parts, 0, SADMM_ERROR_INVALID_ARGUMENT,
                                    "no triangle: no face is of def->object = \"%.40s\", %lld are of others",
                                    parts->object, (long long)info->other_faces);
    return sadmm_mesh_file_fail(parts, 0, SADMM_ERROR_INVALID_ARGUMENT,
                                "no triangle: it has %lld vertices and no face of three corners or more",
                                (long long)info->vertices);
}

/* The parts' vertices become the file's. */
static sadmm_status finish(struct mesh_parts *parts, const sadmm_mesh_file_def *def, sadmm_mesh_file *file)
{
    size_t count = parts->corner_count - 2 * parts->face_count;
    parts->info.vertices = (int64_t)parts->vertex_count;
    if (count == 0) return fail_without_triangle(parts);
    TRY(sadmm_mesh_file_triangulate(parts, &file->triangles));
    if (def->merge) TRY(sadmm_mesh_file_merge(parts, file->triangles, count));
    count = sadmm_mesh_file_drop_degenerate(parts, file->triangles, count, def->drop_degenerate);
    if (count == 0) return fail_without_triangle(parts);
    TRY(sadmm_mesh_file_drop_unused(parts, file->triangles, count));
    file->vertices = parts->vertices;
    parts->vertices = NULL;
    file->vertex_count = (int32_t)parts->vertex_count;
    file->triangle_count = (int32_t)count;
    file->info = parts->info;
    return SADMM_OK;
}

static sadmm_status read_source(const sadmm_mesh_file_def *def, const struct mesh_source *source, sadmm_mesh_file *file)
{
    struct mesh_parts parts = {.source = source, .scale = def->scale, .object = def->object};
    parts.info.format = sadmm_mesh_file_format_of(def, source);
    sadmm_status status = read_parts(&parts);
    if (status == SADMM_OK) status = finish(&parts, def, file);
    sadmm_mesh_file_free_parts(&parts);
    return status;
}

sadmm_status sadmm_mesh_file_read(const sadmm_mesh_file_def *given, sadmm_mesh_file **out)
{
    struct mesh_source source;
    sadmm_mesh_file_def taken;
    const sadmm_mesh_file_def *const def = &taken;
    TRY(sadmm_check_given(out, "out", NULL));
    *out = NULL;
    TRY(sadmm_growing_take(&growing, &taken, given, "def", NULL));
    TRY(check_def(def));
    sadmm_mesh_file *file = (sadmm_mesh_file *)sadmm_alloc(1, sizeof *file);
    if (!file) return sadmm_fail_memory(NULL, "a mesh file");
    sadmm_status status = sadmm_mesh_file_open(def, &source);
    if (status == SADMM_OK) status = read_source(def, &source, file);
    sadmm_mesh_file_close(&source);
    if (status == SADMM_OK) *out = file;
    else sadmm_mesh_file_destroy(file);
    return status;
}

/* ---- what callers see ---- */

int32_t sadmm_mesh_file_vertex_count(const sadmm_mesh_file *file) { return file ? file->vertex_count : 0; }

int32_t sadmm_mesh_file_triangle_count(const sadmm_mesh_file *file) { return file ? file->triangle_count : 0; }

const double *sadmm_mesh_file_vertices(const sadmm_mesh_file *file) { return file ? file->vertices : NULL; }

const int32_t *sadmm_mesh_file_triangles(const sadmm_mesh_file *file) { return file ? file->triangles : NULL; }

sadmm_status sadmm_mesh_file_describe_sized(const sadmm_mesh_file *file, sadmm_mesh_file_info *info, size_t size)
{
    TRY(sadmm_check_given(file, "file", NULL));
    return sadmm_give_bytes(info, size, &file->info, sizeof file->info, SADMM_SIZE_TO(sadmm_mesh_file_info, others),
                            "info", NULL);
}
