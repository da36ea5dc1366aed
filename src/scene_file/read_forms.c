/* Hulls and meshes of a scene file. */
#include <string.h>

#include "core/base/memory.h"
#include "read_forms.h"

/* Rows of `width` numbers, member `member` of the object at hand, into *numbers, which the caller frees; *rows: how
 * many. Memory is asked for when all have that many. */
static sadmm_status read_rows(struct sadmm_filler *f, const json_t *object, const char *member, size_t width,
                              double **numbers, size_t *rows)
{
    json_t *array;
    char row[64];
    *numbers = NULL;
    TRY(sadmm_read_array(&f->reader, object, member, &array));
    if (!array) return sadmm_refuse(&f->reader, member, "is missing");
    *rows = json_array_size(array);
    for (size_t k = 0; k < *rows; ++k) {
        const json_t *each = json_array_get(array, k);
        if (json_is_array(each) && json_array_size(each) == width) continue;
        snprintf(row, sizeof row, "%s[%zu]", member, k);
        char what[48];
        snprintf(what, sizeof what, "an array of %zu numbers", width);
        return sadmm_refuse_value(&f->reader, row, what, each);
    }
    *numbers = (double *)sadmm_alloc(*rows, width * sizeof **numbers);
    if (!*numbers) return sadmm_fail_memory(f->reader.error, "the numbers of a scene file");
    for (size_t k = 0; k < *rows; ++k) {
        snprintf(row, sizeof row, "%s[%zu]", member, k);
        TRY(sadmm_read_reals(&f->reader, row, json_array_get(array, k), *numbers + width * k, width));
    }
    return SADMM_OK;
}

/* ---- hulls ------------------------------------------------------------------------------------------------------- */

static sadmm_status read_hull(struct sadmm_filler *f, const json_t *object, sadmm_hull **hull)
{
    sadmm_hull_def def = sadmm_hull_def_default();
    double *points = NULL;
    TRY(sadmm_read_fields(&f->reader, object, &sadmm_hull_fields, &def));
    sadmm_status status = read_rows(f, object, "points", 3, &points, &def.point_count);
    if (status == SADMM_OK) {
        def.points = points;
        status = sadmm_refuse_last(f, sadmm_hull_create(&def, hull), ": ");
    }
    sadmm_free(points);
    return status;
}

sadmm_status sadmm_read_hulls(struct sadmm_filler *f)
{
    json_t *list;
    TRY(sadmm_read_array(&f->reader, f->root, "hulls", &list));
    const size_t count = json_array_size(list);
    f->hulls = (sadmm_hull **)sadmm_alloc(count, sizeof *f->hulls);
    if (!f->hulls) return sadmm_fail_memory(f->reader.error, "the hulls of a scene file");
    f->hull_count = count;
    for (size_t k = 0; k < count; ++k) {
        const size_t before = sadmm_enter(&f->reader, "hulls[%zu]", k);
        TRY(read_hull(f, json_array_get(list, k), &f->hulls[k]));
        sadmm_leave(&f->reader, before);
    }
    return SADMM_OK;
}

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

/* Triangles of vertices in [0, vertices). */
static sadmm_status read_corners(struct sadmm_filler *f, const json_t *list, size_t vertices, int32_t *corners)
{
    char corner[64];
    for (size_t k = 0; k < json_array_size(list); ++k) {
        const json_t *triangle = json_array_get(list, k);
        snprintf(corner, sizeof corner, "triangles[%zu]", k);
        if (!json_is_array(triangle) || json_array_size(triangle) != 3)
            return sadmm_refuse_value(&f->reader, corner, "an array of 3 vertices", triangle);
        for (size_t c = 0; c < 3; ++c) {
            int64_t number;
            snprintf(corner, sizeof corner, "triangles[%zu][%zu]", k, c);
            if (vertices == 0) return sadmm_refuse(&f->reader, corner, "names a vertex, and there are none");
            TRY(sadmm_read_whole(&f->reader, corner, json_array_get(triangle, c), 0, (double)(vertices - 1), &number));
            corners[3 * k + c] = (int32_t)number;
        }
    }
    return SADMM_OK;
}

static sadmm_status read_triangles(struct sadmm_filler *f, const json_t *object, sadmm_mesh **mesh)
{
    sadmm_mesh_def def = sadmm_mesh_def_default();
    json_t *list;
    double *vertices = NULL;
    int32_t *corners = NULL;
    TRY(sadmm_read_array(&f->reader, object, "triangles", &list));
    if (!list) return sadmm_refuse(&f->reader, "triangles", "is missing, and there are vertices");
    sadmm_status status = read_rows(f, object, "vertices", 3, &vertices, &def.vertex_count);
    if (status == SADMM_OK) {
        def.triangle_count = json_array_size(list);
        corners = (int32_t *)sadmm_alloc(def.triangle_count, 3 * sizeof *corners);
        status = corners ? read_corners(f, list, def.vertex_count, corners)
                         : sadmm_fail_memory(f->reader.error, "the triangles of a scene file");
    }
    if (status == SADMM_OK) {
        def.vertices = vertices;
        def.triangles = corners;
        status = sadmm_refuse_last(f, sadmm_mesh_create(&def, mesh), ": ");
    }
    sadmm_free(vertices);
    sadmm_free(corners);
    return status;
}

static sadmm_status read_heights(struct sadmm_filler *f, const json_t *object, sadmm_mesh **mesh)
{
    enum { MOST = 16384 }; /* the library's message would name a number of rows that does not fit its type */
    sadmm_heightfield_def def = sadmm_heightfield_def_default();
    const json_t *spacing = json_object_get(object, "spacing");
    json_t *list;
    double *heights = NULL;
    size_t rows = 0;
    TRY(sadmm_read_array(&f->reader, object, "heights", &list));
    if (!list || !spacing) return sadmm_refuse(&f->reader, list ? "spacing" : "heights", "is missing");
    TRY(sadmm_read_reals(&f->reader, "spacing", spacing, def.spacing, 2));
    const json_t *first = json_array_get(list, 0);
    if (json_array_size(list) > MOST || json_array_size(first) > MOST)
        return sadmm_refuse(&f->reader, "heights", "must have at most %d rows and columns, has %zu and %zu", MOST,
                            json_array_size(list), json_array_size(first));
    def.columns = (int32_t)json_array_size(first);
    sadmm_status status = read_rows(f, object, "heights", (size_t)def.columns, &heights, &rows);
    if (status == SADMM_OK) {
        def.rows = (int32_t)rows;
        def.heights = heights;
        status = sadmm_refuse_last(f, sadmm_heightfield_create(&def, mesh), ": ");
    }
    sadmm_free(heights);
    return status;
}

static sadmm_status read_mesh(struct sadmm_filler *f, const json_t *object, sadmm_mesh **mesh)
{
    TRY(sadmm_read_fields(&f->reader, object, &sadmm_mesh_fields, NULL));
    const bool triangles = json_object_get(object, "vertices") || json_object_get(object, "triangles"),
               heights = json_object_get(object, "heights") || json_object_get(object, "spacing");
    if (triangles == heights)
        return sadmm_refuse(&f->reader, NULL, "must have either vertices and triangles, or heights and spacing");
    return triangles ? read_triangles(f, object, mesh) : read_heights(f, object, mesh);
}

sadmm_status sadmm_read_meshes(struct sadmm_filler *f)
{
    json_t *list;
    TRY(sadmm_read_array(&f->reader, f->root, "meshes", &list));
    const size_t count = json_array_size(list);
    f->meshes = (sadmm_mesh **)sadmm_alloc(count, sizeof *f->meshes);
    if (!f->meshes) return sadmm_fail_memory(f->reader.error, "the meshes of a scene file");
    f->mesh_count = count;
    for (size_t k = 0; k < count; ++k) {
        const size_t before = sadmm_enter(&f->reader, "meshes[%zu]", k);
        TRY(read_mesh(f, json_array_get(list, k), &f->meshes[k]));
        sadmm_leave(&f->reader, before);
    }
    return SADMM_OK;
}
