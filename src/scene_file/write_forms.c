/* Hulls and meshes of a world as JSON. */
#include "core/base/memory.h"
#include "write_forms.h"

/* *known: it was there. OUT_OF_MEMORY. */
static sadmm_status number_of(struct sadmm_writer *w, struct sadmm_key_tree *numbers, const void *form, bool *known,
                              json_int_t *number)
{
    const double *found = sadmm_key_tree_find(numbers, (uintptr_t)form);
    *known = found != NULL;
    *number = found ? (json_int_t)*found : (json_int_t)sadmm_key_tree_count(numbers);
    if (found) return SADMM_OK;
    if (!sadmm_key_tree_reserve(numbers)) return sadmm_fail_memory(w->error, "a list of hulls or meshes");
    sadmm_key_tree_set(numbers, (uintptr_t)form, (double)*number);
    return SADMM_OK;
}

sadmm_status sadmm_write_hull(struct sadmm_writer *w, const sadmm_hull *hull, json_int_t *number)
{
    const sadmm_hull_def def = {.merge = sadmm_hull_merge(hull), .convex_radius = sadmm_hull_convex_radius(hull)};
    const double *vertices = sadmm_hull_vertices(hull);
    bool known;
    TRY(number_of(w, &w->hull_numbers, hull, &known, number));
    if (known) return SADMM_OK;
    json_t *points = sadmm_put(w, sadmm_append_object(w, w->hulls, &sadmm_hull_fields, &def), "points", json_array());
    for (int32_t v = 0; v < sadmm_hull_vertex_count(hull); ++v)
        sadmm_append(w, points, sadmm_json_reals(vertices + 3 * v, 3));
    return SADMM_OK;
}

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

/* Heights row by row. */
static void write_heights(struct sadmm_writer *w, json_t *object, const sadmm_mesh *mesh, int32_t columns, int32_t rows,
                          const double spacing[2])
{
    json_t *heights = sadmm_put(w, object, "heights", json_array());
    for (int32_t row = 0; row < rows; ++row) {
        json_t *line = sadmm_append(w, heights, json_array());
        for (int32_t column = 0; column < columns; ++column) {
            double x[3] = {0};
            sadmm_mesh_vertex_at(mesh, (int64_t)row * columns + column, x);
            sadmm_append(w, line, sadmm_json_real(x[2]));
        }
    }
    sadmm_put(w, object, "spacing", sadmm_json_reals(spacing, 2));
}

/* Triangles in the order of the definition; those that it left out are not there. */
static sadmm_status write_triangles(struct sadmm_writer *w, json_t *object, const sadmm_mesh *mesh)
{
    const int64_t count = sadmm_mesh_triangle_count(mesh), all = count + sadmm_mesh_left_out(mesh);
    int64_t *at = (int64_t *)sadmm_alloc((size_t)all, sizeof *at); /* by number: 1 + the triangle, 0: left out */
    int32_t corner[3], number = 0;
    if (!at) return sadmm_fail_memory(w->error, "the triangles of a mesh");
    json_t *vertices = sadmm_put(w, object, "vertices", json_array()),
           *triangles = sadmm_put(w, object, "triangles", json_array());
    for (int64_t v = 0; v < sadmm_mesh_vertex_count(mesh); ++v) {
        double x[3] = {0};
        sadmm_mesh_vertex_at(mesh, v, x);
        sadmm_append(w, vertices, sadmm_json_reals(x, 3));
    }
    for (int64_t t = 0; t < count; ++t)
        if (sadmm_mesh_triangle_at(mesh, t, corner, &number) == SADMM_OK) at[number] = 1 + t;
    for (int64_t k = 0; k < all; ++k)
        if (at[k] && sadmm_mesh_triangle_at(mesh, at[k] - 1, corner, &number) == SADMM_OK)
            sadmm_append(w, triangles, json_pack("[iii]", corner[0], corner[1], corner[2]));
    sadmm_free(at);
    return SADMM_OK;
}

sadmm_status sadmm_write_mesh(struct sadmm_writer *w, const sadmm_mesh *mesh, json_int_t *number)
{
    int32_t columns = 0, rows = 0;
    double spacing[2];
    bool known;
    TRY(number_of(w, &w->mesh_numbers, mesh, &known, number));
    if (known) return SADMM_OK;
    json_t *object = sadmm_append(w, w->meshes, json_object());
    sadmm_mesh_grid(mesh, &columns, &rows, spacing);
    if (columns == 0) return write_triangles(w, object, mesh);
    write_heights(w, object, mesh, columns, rows, spacing);
    return SADMM_OK;
}
