/* Meshes: who is beside whom, what is flat, what a walk finds, what is refused. */
#include <check.h>

#include "collision/mesh/mesh_walk.h"
#include "core/base/memory.h"
#include "mesh_tools.h"
#include "run_suite.h"

static struct mesh view_of(const sadmm_mesh *mesh)
{
    struct mesh view;
    mesh_at(mesh->block, 0, &view);
    return view;
}

static bool same_vec(vec3 a, vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

static double bumpy(double x, double y) { return 0.3 * sin(3 * x) * cos(2 * y) + 0.1 * x; }
static double valley(double x, double y) { return fabs(x) + 0 * y; }

/* ---- neighbours -------------------------------------------------------------------------------------------------- */

static int corner_at(const struct mesh *m, int32_t triangle, vec3 x)
{
    int32_t corner[3], opposite[3];
    mesh_corners(m, triangle, corner, opposite);
    for (int k = 0; k < 3; ++k)
        if (same_vec(mesh_vertex(m, corner[k]), x)) return k;
    return -1;
}

/* All pairs of triangles say what the block says. */
static void check_neighbours(const struct mesh *m)
{
    for (int32_t t = 0; t < m->triangles; ++t) {
        int32_t corner[3], opposite[3];
        mesh_corners(m, t, corner, opposite);
        for (int k = 0; k < 3; ++k) {
            const vec3 a = mesh_vertex(m, corner[k]), b = mesh_vertex(m, corner[mesh_next_corner(k)]);
            int beside = 0;
            bool first_edge = true, first_corner = true, found = false;
            for (int32_t other = 0; other < m->triangles; ++other) {
                const int ka = corner_at(m, other, a), kb = corner_at(m, other, b);
                if (other < t && ka >= 0) first_corner = false;
                if (other == t || ka < 0 || kb < 0) continue;
                ++beside;
                if (other < t) first_edge = false;
                int32_t corner_2[3], opposite_2[3];
                mesh_corners(m, other, corner_2, opposite_2);
                found |= corner_2[3 - ka - kb] == opposite[k];
            }
            ck_assert(beside == 1 ? found : opposite[k] == -1);
            ck_assert(mesh_marked(m->marks[t], MESH_EDGE_OWN, k) == (beside != 1 || first_edge));
            ck_assert(mesh_marked(m->marks[t], MESH_CORNER_OWN, k) == first_corner);
        }
    }
}

/* The vertices that a vertex has edges to: those of triangles that have it. */
static void check_rings(const struct mesh *m)
{
    const int32_t vertices = m->kind == MESH_HEIGHTS ? m->columns * m->rows : m->vertices;
    for (int32_t v = 0; v < vertices; ++v) {
        char seen[512] = {0};
        int listed = 0, expected = 0;
        for (int i = 0; mesh_neighbour(m, v, i) != -1; ++i) {
            const int32_t next = mesh_neighbour(m, v, i);
            if (next < 0) continue;
            ck_assert_int_lt(next, (int)sizeof seen);
            ck_assert(!seen[next]);
            seen[next] = 1;
            ++listed;
        }
        char wanted[512] = {0};
        for (int32_t t = 0; t < m->triangles; ++t) {
            int32_t corner[3], opposite[3];
            mesh_corners(m, t, corner, opposite);
            for (int k = 0; k < 3; ++k)
                if (corner[k] == v) wanted[corner[(k + 1) % 3]] = wanted[corner[(k + 2) % 3]] = 1;
        }
        for (size_t i = 0; i < sizeof wanted; ++i) expected += wanted[i];
        ck_assert_int_eq(listed, expected);
        ck_assert_mem_eq(seen, wanted, sizeof seen);
    }
}

START_TEST(neighbours_are_those_that_share_corners)
{
    const double half[3] = {1, 2, 0.5};
    struct soup *soups[] = {soup_ground(9, 7, 0.25, 0.24, 5, bumpy), soup_box(half, 3), soup_ball(half, 4)};
    for (int k = 0; k < 3; ++k) {
        sadmm_mesh *mesh = soup_mesh(soups[k]);
        const struct mesh view = view_of(mesh);
        ck_assert_int_eq(sadmm_mesh_triangle_count(mesh), (int64_t)soups[k]->triangles);
        ck_assert_int_eq(sadmm_mesh_left_out(mesh), 0);
        ck_assert_int_eq(sadmm_mesh_open_edges(mesh), k == 0 ? 2 * 8 + 2 * 6 : 0);
        check_neighbours(&view);
        check_rings(&view);
        sadmm_mesh_destroy(mesh);
        free(soups[k]);
    }
}
END_TEST

/* Three triangles at one edge, as the blades of a fan: none of them has a neighbour there. */
START_TEST(edges_of_three_triangles_are_ends)
{
    struct soup *s = soup_new();
    const int32_t a = soup_vertex(s, 0, 0, 0), b = soup_vertex(s, 0, 0, 1);
    for (int k = 0; k < 3; ++k) soup_triangle(s, a, b, soup_vertex(s, cos(2.1 * k), sin(2.1 * k), 0));
    sadmm_mesh *mesh = soup_mesh(s);
    const struct mesh view = view_of(mesh);
    ck_assert_int_eq(sadmm_mesh_open_edges(mesh), 7);
    check_neighbours(&view);
    check_rings(&view);
    sadmm_mesh_destroy(mesh);
    free(s);
}
END_TEST

/* A field is the mesh of its triangles: the same corners, neighbours and marks, but for the order. */
START_TEST(a_heightfield_is_a_mesh)
{
    double (*const heights[])(double, double) = {soup_flat, bumpy, valley};
    for (int kind = 0; kind < 3; ++kind) {
        enum { COLUMNS = 7, ROWS = 5 };
        double z[COLUMNS * ROWS];
        struct soup *s = soup_ground(COLUMNS, ROWS, 0.5, 0, 1, heights[kind]);
        for (int v = 0; v < COLUMNS * ROWS; ++v) z[v] = s->x[3 * v + 2];
        const sadmm_heightfield_def def = {sizeof def, z, COLUMNS, ROWS, {0.5, 0.5}};
        sadmm_mesh *field, *mesh = soup_mesh(s);
        ck_assert_int_eq(sadmm_heightfield_create(&def, &field), SADMM_OK);
        const struct mesh f = view_of(field), m = view_of(mesh);
        ck_assert_int_eq(f.triangles, m.triangles);
        ck_assert_mem_eq(field->middle, mesh->middle, sizeof field->middle);
        ck_assert_mem_eq(field->half, mesh->half, sizeof field->half);
        ck_assert_int_eq(sadmm_mesh_open_edges(field), sadmm_mesh_open_edges(mesh));
        check_neighbours(&f);
        check_rings(&f);
        for (int32_t t = 0; t < m.triangles; ++t) {
            const int32_t twin = mesh->source[t]; /* the ground lists its triangles as a field counts them */
            int32_t corner[3], opposite[3], corner_2[3], opposite_2[3];
            mesh_corners(&m, t, corner, opposite);
            mesh_corners(&f, twin, corner_2, opposite_2);
            for (int k = 0; k < 3; ++k) {
                ck_assert(same_vec(mesh_vertex(&m, corner[k]), mesh_vertex(&f, corner_2[k])));
                ck_assert_int_eq(opposite[k] < 0, opposite_2[k] < 0);
                if (opposite[k] >= 0) ck_assert(same_vec(mesh_vertex(&m, opposite[k]), mesh_vertex(&f, opposite_2[k])));
                ck_assert(mesh_marked(m.marks[t], MESH_EDGE_FLAT, k) == mesh_marked(f.marks[twin], MESH_EDGE_FLAT, k));
                ck_assert(mesh_marked(m.marks[t], MESH_CORNER_FLAT, k) ==
                          mesh_marked(f.marks[twin], MESH_CORNER_FLAT, k));
            }
        }
        sadmm_mesh_destroy(field);
        sadmm_mesh_destroy(mesh);
        free(s);
    }
}
END_TEST

/* ---- flat -------------------------------------------------------------------------------------------------------- */

static void count_flat(const struct mesh *m, int *edges, int *corners)
{
    *edges = *corners = 0;
    for (int32_t t = 0; t < m->triangles; ++t)
        for (int k = 0; k < 3; ++k) {
            *edges += mesh_marked(m->marks[t], MESH_EDGE_FLAT, k);
            *corners += mesh_marked(m->marks[t], MESH_CORNER_FLAT, k);
        }
}

START_TEST(flat_is_what_lies_in_one_plane)
{
    enum { N = 6 };
    const double half[3] = {1, 1, 1};
    struct soup *s = soup_ground(N + 1, N + 1, 0.5, 0.24, 3, soup_flat);
    sadmm_mesh *mesh = soup_mesh(s);
    struct mesh view = view_of(mesh);
    int edges, corners;
    count_flat(&view, &edges, &corners);
    ck_assert_int_eq(edges, 6 * N * N - 4 * N); /* all sides but those at the end */
    int inner = 0;
    for (size_t c = 0; c < 3 * s->triangles; ++c) {
        const double *x = s->x + 3 * s->corner[c];
        inner += fabs(x[0]) < 0.5 * 0.5 * N - 1e-9 && fabs(x[1]) < 0.5 * 0.5 * N - 1e-9;
    }
    ck_assert_int_eq(corners, inner);
    sadmm_mesh_destroy(mesh);
    free(s);

    /* a box of 6 faces of N x N squares: its edges stand out, all else is flat */
    s = soup_box(half, N);
    mesh = soup_mesh(s);
    view = view_of(mesh);
    count_flat(&view, &edges, &corners);
    ck_assert_int_eq(edges, 6 * (6 * N * N - 4 * N));
    ck_assert_int_eq(corners, 6 * 6 * (N - 1) * (N - 1)); /* six triangles at each inner corner */
    sadmm_mesh_destroy(mesh);
    free(s);
}
END_TEST

/* ---- walks ------------------------------------------------------------------------------------------------------- */

static void check_walk(const struct mesh *m, const struct sadmm_box3 *box)
{
    struct mesh_walk walk;
    mesh_walk_begin(m, box, &walk);
    int32_t next = mesh_walk_next(m, &walk);
    for (int32_t t = 0; t < m->triangles; ++t) {
        if (!mesh_triangle_near(m, t, box)) continue;
        ck_assert_int_eq(next, t);
        next = mesh_walk_next(m, &walk);
    }
    ck_assert_int_eq(next, -1);
}

START_TEST(walks_find_all_that_is_near)
{
    const double half[3] = {1, 2, 0.5};
    uint64_t seed = 77;
    double z[40 * 25];
    struct soup *soups[] = {soup_ground(40, 25, 0.1, 0.24, 5, bumpy), soup_box(half, 12), soup_ball(half, 12)};
    sadmm_mesh *meshes[4];
    for (int v = 0; v < 40 * 25; ++v) z[v] = 0.2 * soup_number(&seed);
    const sadmm_heightfield_def field = {sizeof field, z, 40, 25, {0.1, 0.15}};
    for (int k = 0; k < 3; ++k) meshes[k] = soup_mesh(soups[k]);
    ck_assert_int_eq(sadmm_heightfield_create(&field, &meshes[3]), SADMM_OK);
    for (int k = 0; k < 4; ++k) {
        const struct mesh view = view_of(meshes[k]);
        for (int i = 0; i < 300; ++i) {
            struct sadmm_box3 box;
            const double size = pow(10, 2 * soup_number(&seed) - 1.5);
            for (int a = 0; a < 3; ++a) {
                const double at = 1.5 * meshes[k]->half[a] * soup_number(&seed);
                box.lo[a] = at - size;
                box.hi[a] = at + size;
            }
            check_walk(&view, &box);
        }
        const struct sadmm_box3 all = {{-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9}}, beside = {{50, 50, 50}, {51, 51, 51}};
        check_walk(&view, &all);
        check_walk(&view, &beside);
        sadmm_mesh_destroy(meshes[k]);
        if (k < 3) free(soups[k]);
    }
}
END_TEST

/* ---- input ------------------------------------------------------------------------------------------------------- */

/* Vertices of one place are one; triangles that are none are left out, and counted. */
START_TEST(what_is_no_triangle_is_left_out)
{
    struct soup *s = soup_new();
    for (int k = 0; k < 2; ++k) { /* two triangles of a square, each with corners of its own, as an STL file has them */
        const int32_t a = soup_vertex(s, 0, 0, 5), b = soup_vertex(s, 1, k, 5), c = soup_vertex(s, k ? 0.0 : 1, 1, 5);
        soup_triangle(s, a, b, c);
    }
    soup_triangle(s, 0, 0, 1);
    soup_triangle(s, 0, 3, 1);                            /* two corners in one place */
    soup_triangle(s, 0, 1, soup_vertex(s, 0.5, -0.0, 5)); /* in one line */
    sadmm_mesh *mesh = soup_mesh(s);
    double lo[3], hi[3];
    ck_assert_int_eq(sadmm_mesh_triangle_count(mesh), 2);
    ck_assert_int_eq(sadmm_mesh_left_out(mesh), 3);
    ck_assert_int_eq(sadmm_mesh_open_edges(mesh), 4);
    ck_assert_int_eq(sadmm_mesh_bounds(mesh, lo, hi), SADMM_OK);
    ck_assert(lo[0] == 0 && lo[1] == 0 && lo[2] == 5 && hi[0] == 1 && hi[1] == 1 && hi[2] == 5);
    sadmm_mesh_destroy(mesh);
    free(s);
}
END_TEST

static void refused(const sadmm_mesh_def *def, const char *message)
{
    sadmm_mesh *mesh = (sadmm_mesh *)def;
    ck_assert_int_eq(sadmm_mesh_create(def, &mesh), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_null(mesh);
    ck_assert_msg(strstr(sadmm_last_message(), message) != NULL, "%s", sadmm_last_message());
}

static void field_refused(const sadmm_heightfield_def *def, const char *message)
{
    sadmm_mesh *mesh = (sadmm_mesh *)def;
    ck_assert_int_eq(sadmm_heightfield_create(def, &mesh), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_null(mesh);
    ck_assert_msg(strstr(sadmm_last_message(), message) != NULL, "%s", sadmm_last_message());
}

START_TEST(bad_meshes_are_refused)
{
    const double x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, far[] = {0, 0, 0, 1, 0, 2e6, 0, 1, 0},
                 none[] = {0, 0, 0, 1, NAN, 0, 0, 1, 0}, line[] = {0, 0, 0, 1, 1, 1, 3, 3, 3};
    const int32_t corners[] = {0, 1, 2}, beyond[] = {0, 1, 3}, below[] = {0, -1, 2};
    sadmm_mesh_def def = {sizeof def, x, 3, corners, 1};
    ck_assert_int_eq(sadmm_mesh_create(&def, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    refused(NULL, "def");
    def.vertices = NULL;
    refused(&def, "def->vertices");
    def.vertices = far;
    refused(&def, "def->vertices[5] = 2e+06: must be in [-1e6, 1e6]");
    def.vertices = none;
    refused(&def, "def->vertices[4] = nan");
    def.vertices = line;
    refused(&def, "none of 1 has three corners");
    def.vertices = x;
    def.vertex_count = 2;
    refused(&def, "def->vertex_count = 2: must be in [3,");
    def.vertex_count = 3;
    def.triangles = NULL;
    refused(&def, "def->triangles");
    def.triangles = beyond;
    refused(&def, "def->triangles[2] = 3: must be in [0, 3)");
    def.triangles = below;
    refused(&def, "def->triangles[1] = -1");
    def.triangles = corners;
    def.triangle_count = 0;
    refused(&def, "def->triangle_count = 0: must be in [1,");
    ck_assert_int_eq(sadmm_mesh_bounds(NULL, NULL, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_mesh_destroy(NULL);
    ck_assert_int_eq(sadmm_mesh_triangle_count(NULL) + sadmm_mesh_left_out(NULL) + sadmm_mesh_open_edges(NULL), 0);
    ck_assert_uint_eq(sadmm_mesh_bytes(NULL), 0);

    const double z[4] = {0, 1, 2, INFINITY};
    sadmm_heightfield_def field = {sizeof field, z, 2, 2, {1, 1}};
    field_refused(NULL, "def");
    field_refused(&field, "def->heights[3] = inf: must be in [-1e6, 1e6]");
    field.spacing[1] = 0;
    field_refused(&field, "def->spacing[1] = 0: must be in [1e-6, 1e6]");
    field.columns = 1;
    field_refused(&field, "def->columns = 1: must be in [2, 16384]");
    field.columns = field.rows = 16384;
    field_refused(&field, "def->columns x rows = 268435456: must be at most");
    field.columns = 2;
    field.rows = 16385;
    field_refused(&field, "def->rows = 16385");
    field.heights = NULL;
    field_refused(&field, "def->heights");
}
END_TEST

START_TEST(memory_may_run_out)
{
    struct soup *s = soup_ground(6, 6, 1, 0.2, 1, bumpy);
    const sadmm_mesh_def def = {sizeof def, s->x, s->vertices, s->corner, s->triangles};
    const sadmm_heightfield_def field = {sizeof field, s->x, 6, 6, {1, 1}};
    for (int kind = 0; kind < 2; ++kind) {
        sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
        sadmm_mesh *mesh = NULL;
        long failures = 0;
        for (; status != SADMM_OK; ++failures) {
            sadmm_test_fail_allocations_after(failures);
            status = kind ? sadmm_heightfield_create(&field, &mesh) : sadmm_mesh_create(&def, &mesh);
            sadmm_test_fail_allocations_after(-1);
            ck_assert(status == SADMM_OK || (status == SADMM_ERROR_OUT_OF_MEMORY && !mesh));
        }
        ck_assert_int_gt(failures, kind ? 3 : 15);
        sadmm_mesh_destroy(mesh);
    }
    free(s);
}
END_TEST

/* The same triangles make the same block, whatever was made before. */
START_TEST(meshes_are_repeatable)
{
    const double half[3] = {1, 2, 0.5};
    struct soup *s = soup_ball(half, 20);
    sadmm_mesh *a = soup_mesh(s), *b = soup_mesh(s);
    ck_assert_uint_eq(a->doubles, b->doubles);
    ck_assert_mem_eq(a->block, b->block, a->doubles * sizeof *a->block);
    ck_assert_uint_eq(sadmm_mesh_bytes(a), a->doubles * sizeof *a->block);
    sadmm_mesh_destroy(a);
    sadmm_mesh_destroy(b);
    free(s);
}
END_TEST

/* ---- what is read back ------------------------------------------------------------------------------------------- */

/* Of a mesh, made again from what it returns of itself: the same triangles by the same numbers, in the same places. */
static void check_made_again(const sadmm_mesh *mesh)
{
    const int64_t vertices = sadmm_mesh_vertex_count(mesh), triangles = sadmm_mesh_triangle_count(mesh);
    struct soup *s = soup_new();
    for (int64_t v = 0; v < vertices; ++v) {
        double x[3];
        ck_assert_int_eq(sadmm_mesh_vertex_at(mesh, v, x), SADMM_OK);
        soup_vertex(s, x[0], x[1], x[2]);
    }
    for (int64_t t = 0; t < triangles; ++t) {
        int32_t corner[3], number;
        ck_assert_int_eq(sadmm_mesh_triangle_at(mesh, t, corner, &number), SADMM_OK);
        ck_assert(number >= 0 && number < triangles);
        memcpy(s->corner + 3 * number, corner, sizeof corner);
    }
    s->triangles = (size_t)triangles;
    sadmm_mesh *again = soup_mesh(s);
    ck_assert_int_eq(sadmm_mesh_vertex_count(again), vertices);
    ck_assert_int_eq(sadmm_mesh_triangle_count(again), triangles);
    for (int64_t v = 0; v < vertices; ++v) {
        double x[3], y[3];
        sadmm_mesh_vertex_at(mesh, v, x);
        sadmm_mesh_vertex_at(again, v, y);
        ck_assert_mem_eq(x, y, sizeof x);
    }
    ck_assert_uint_eq(sadmm_mesh_bytes(again), sadmm_mesh_bytes(mesh));
    ck_assert_mem_eq(again->block, mesh->block, sadmm_mesh_bytes(mesh));
    sadmm_mesh_destroy(again);
    free(s);
}

/* Vertices in the order of the definition, those in one place once, unused ones not at all; triangles by their numbers
 * there, without those left out. */
START_TEST(meshes_are_read_back)
{
    struct soup *s = soup_new();
    static const double x[6][3] = {{1.3, 0.1, 0}, {9, 9, 9}, {0, 1, 0.7}, {1.3, 0.1, 0}, {-1, 0, 0.3}, {0.2, 0, -1}};
    for (int v = 0; v < 6; ++v) soup_vertex(s, x[v][0], x[v][1], x[v][2]);
    soup_triangle(s, 0, 3, 2); /* two corners in one place: left out */
    soup_triangle(s, 3, 2, 4);
    soup_triangle(s, 0, 4, 5);
    sadmm_mesh *mesh = soup_mesh(s);
    static const int32_t place[4] = {0, 2, 4, 5}, corners[3][3] = {{0}, {0, 1, 2}, {0, 2, 3}};
    double got[3];
    ck_assert_int_eq(sadmm_mesh_vertex_count(mesh), 4);
    for (int v = 0; v < 4; ++v) {
        ck_assert_int_eq(sadmm_mesh_vertex_at(mesh, v, got), SADMM_OK);
        ck_assert_mem_eq(got, x[place[v]], sizeof got);
    }
    unsigned seen = 0;
    for (int t = 0; t < 2; ++t) {
        int32_t corner[3], number;
        ck_assert_int_eq(sadmm_mesh_triangle_at(mesh, t, corner, &number), SADMM_OK);
        ck_assert(number == 1 || number == 2);
        ck_assert_mem_eq(corner, corners[number], sizeof corner);
        seen |= 1u << number;
    }
    ck_assert_uint_eq(seen, 6);
    int32_t columns = 7, rows = 7, number, corner[3];
    ck_assert_int_eq(sadmm_mesh_grid(mesh, &columns, &rows, got), SADMM_OK);
    ck_assert(columns == 0 && rows == 0 && got[0] == 0 && got[1] == 0);
    ck_assert_int_eq(sadmm_mesh_vertex_at(mesh, 4, got), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_last_message(), "vertex = 4: must be in [0, 4)");
    ck_assert_int_eq(sadmm_mesh_vertex_at(mesh, -1, got), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_mesh_triangle_at(mesh, 2, corner, &number), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_last_message(), "triangle = 2: must be in [0, 2)");
    ck_assert_int_eq(sadmm_mesh_triangle_at(mesh, -1, corner, &number), SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_mesh_destroy(mesh);
    free(s);
    const double size[3] = {1, 1.2, 0.5};
    s = soup_ball(size, 9);
    for (size_t i = 2; i < 3 * s->vertices; i += 3) s->x[i] += 0.7; /* its middle is not the origin */
    mesh = soup_mesh(s);
    check_made_again(mesh);
    sadmm_mesh_destroy(mesh);
    free(s);
}
END_TEST

START_TEST(heightfields_are_read_back)
{
    double z[3 * 4], got[3], spacing[2];
    for (int i = 0; i < 12; ++i) z[i] = 1.3 * sin(i) - 0.2;
    const sadmm_heightfield_def def = {sizeof def, z, 3, 4, {0.5, 0.25}};
    sadmm_mesh *mesh = NULL;
    int32_t columns, rows, corner[3], number;
    ck_assert_int_eq(sadmm_heightfield_create(&def, &mesh), SADMM_OK);
    ck_assert_int_eq(sadmm_mesh_grid(mesh, &columns, &rows, spacing), SADMM_OK);
    ck_assert(columns == 3 && rows == 4 && spacing[0] == 0.5 && spacing[1] == 0.25);
    ck_assert_int_eq(sadmm_mesh_vertex_count(mesh), 12);
    for (int i = 0; i < 12; ++i) {
        ck_assert_int_eq(sadmm_mesh_vertex_at(mesh, i, got), SADMM_OK);
        ck_assert(got[0] == 0.5 * (i % 3 - 1) && got[1] == 0.25 * (i / 3 - 1.5));
        ck_assert_mem_eq(got + 2, z + i, sizeof *z);
    }
    ck_assert_int_eq(sadmm_mesh_triangle_at(mesh, 7, corner, &number), SADMM_OK);
    ck_assert(number == 7 && corner[0] == 4 && corner[1] == 8 && corner[2] == 7); /* cell (1, 1), its upper half */
    sadmm_mesh_destroy(mesh);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("mesh");
    TCase *tests = tcase_create("mesh");
    tcase_set_timeout(tests, 60);
    tcase_add_test(tests, neighbours_are_those_that_share_corners);
    tcase_add_test(tests, edges_of_three_triangles_are_ends);
    tcase_add_test(tests, a_heightfield_is_a_mesh);
    tcase_add_test(tests, flat_is_what_lies_in_one_plane);
    tcase_add_test(tests, walks_find_all_that_is_near);
    tcase_add_test(tests, what_is_no_triangle_is_left_out);
    tcase_add_test(tests, bad_meshes_are_refused);
    tcase_add_test(tests, memory_may_run_out);
    tcase_add_test(tests, meshes_are_repeatable);
    tcase_add_test(tests, meshes_are_read_back);
    tcase_add_test(tests, heightfields_are_read_back);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
