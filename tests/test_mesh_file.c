/* Mesh files: a cube in every format and variant, faces that are not convex, what is passed over and counted, what is
 * refused and how it is reported. All files are made here. */
#include <check.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/memory.h"
#include "run_suite.h"
#include "subadmm/subadmm.h"

/* ---- files ---- */

struct bytes {
    char at[1 << 14];
    size_t size;
};

static const double corners[8][3] = {
    {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1},
};
static const int faces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

static void add(struct bytes *b, const char *text)
{
    ck_assert_uint_lt(b->size + strlen(text), sizeof b->at);
    memcpy(b->at + b->size, text, strlen(text));
    b->size += strlen(text);
}

#define ADD(b, ...)                               \
    do {                                          \
        char line[256];                           \
        snprintf(line, sizeof line, __VA_ARGS__); \
        add(b, line);                             \
    } while (0)

static void add_number(struct bytes *b, uint64_t bits, int size, bool big)
{
    for (int k = 0; k < size; ++k) b->at[b->size++] = (char)(bits >> 8 * (big ? size - 1 - k : k));
}

static void add_float(struct bytes *b, double x, bool big)
{
    const float value = (float)x;
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    add_number(b, bits, 4, big);
}

static struct bytes cube_obj(const char *end, bool back)
{
    struct bytes b = {.size = 0};
    ADD(&b, "# a cube%so cube%s", end, end);
    for (int v = 0; v < 8; ++v) ADD(&b, "v %g %g %g%s", corners[v][0], corners[v][1], corners[v][2], end);
    for (int k = 0; k < 6; ++k) {
        add(&b, "f");
        for (int c = 0; c < 4; ++c) ADD(&b, " %d", back ? faces[k][c] - 8 : faces[k][c] + 1);
        add(&b, end);
    }
    return b;
}

static void cube_triangle(int k, int v[3])
{
    v[0] = faces[k / 2][0];
    v[1] = faces[k / 2][k % 2 ? 2 : 1];
    v[2] = faces[k / 2][k % 2 ? 3 : 2];
}

static struct bytes cube_stl(const char *end)
{
    struct bytes b = {.size = 0};
    int v[3];
    ADD(&b, "solid cube%s", end);
    for (int k = 0; k < 12; ++k) {
        cube_triangle(k, v);
        ADD(&b, "facet normal nan 0 1%s outer loop%s", end, end);
        for (int c = 0; c < 3; ++c)
            ADD(&b, "  vertex %g %g %g%s", corners[v[c]][0], corners[v[c]][1], corners[v[c]][2], end);
        ADD(&b, " endloop%sendfacet%s", end, end);
    }
    ADD(&b, "endsolid cube%s", end);
    return b;
}

static struct bytes cube_stl_binary(const char *title)
{
    struct bytes b = {.size = 84};
    int v[3];
    snprintf(b.at, 80, "%s", title);
    b.at[80] = 12;
    for (int k = 0; k < 12; ++k) {
        cube_triangle(k, v);
        for (int n = 0; n < 3; ++n) add_float(&b, NAN, false);
        for (int c = 0; c < 9; ++c) add_float(&b, corners[v[c / 3]][c % 3], false);
        add_number(&b, 0x1234, 2, false);
    }
    return b;
}

/* 0: text, 1: little, 2: big */
static struct bytes cube_ply(int encoding, const char *end)
{
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    const bool big = encoding == 2;
    struct bytes b = {.size = 0};
    ADD(&b, "ply%sformat %s 1.0%scomment of nobody%selement vertex 8%sproperty uchar red%s", end, names[encoding], end,
        end, end, end);
    ADD(&b, "property float x%sproperty double y%sproperty short z%selement face 6%s", end, end, end, end);
    ADD(&b, "property float quality%sproperty list ushort int vertex_indices%send_header%s", end, end, end);
    for (int k = 0; k < 8; ++k) {
        const double *x = corners[k];
        if (encoding == 0) {
            ADD(&b, "10 %g %g %g%s", x[0], x[1], x[2], end);
            continue;
        }
        uint64_t bits;
        memcpy(&bits, &x[1], sizeof bits);
        add_number(&b, 10, 1, big);
        add_float(&b, x[0], big);
        add_number(&b, bits, 8, big);
        add_number(&b, (uint64_t)x[2], 2, big);
    }
    for (int k = 0; k < 6; ++k) {
        if (encoding == 0) {
            ADD(&b, "0.5 4 %d %d %d %d%s", faces[k][0], faces[k][1], faces[k][2], faces[k][3], end);
            continue;
        }
        add_float(&b, 0.5, big);
        add_number(&b, 4, 2, big);
        for (int c = 0; c < 4; ++c) add_number(&b, (uint64_t)faces[k][c], 4, big);
    }
    return b;
}

/* ---- reading ---- */

static sadmm_mesh_file_def text_def(const char *text)
{
    sadmm_mesh_file_def def = sadmm_mesh_file_def_default();
    def.bytes = text;
    def.size = strlen(text);
    return def;
}

static sadmm_mesh_file_def bytes_def(const struct bytes *b)
{
    sadmm_mesh_file_def def = sadmm_mesh_file_def_default();
    def.bytes = b->at;
    def.size = b->size;
    return def;
}

static sadmm_mesh_file *must_read(sadmm_mesh_file_def def)
{
    sadmm_mesh_file *file = NULL;
    const sadmm_status status = sadmm_mesh_file_read(&def, &file);
    ck_assert_msg(status == SADMM_OK, "%s", sadmm_last_message());
    ck_assert_ptr_nonnull(file);
    return file;
}

static sadmm_mesh_file_info info_of(const sadmm_mesh_file *file)
{
    sadmm_mesh_file_info info;
    ck_assert_int_eq(sadmm_mesh_file_describe(file, &info), SADMM_OK);
    return info;
}

static double volume_of(const sadmm_mesh_file *file)
{
    const double *x = sadmm_mesh_file_vertices(file);
    const int32_t *t = sadmm_mesh_file_triangles(file);
    double six = 0;
    for (int32_t k = 0; k < sadmm_mesh_file_triangle_count(file); ++k) {
        const double *a = x + 3 * t[3 * k], *b = x + 3 * t[3 * k + 1], *c = x + 3 * t[3 * k + 2];
        six += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    return six / 6;
}

static void expect_triangles(const sadmm_mesh_file *file, int count, const int32_t *triangles)
{
    ck_assert_int_eq(sadmm_mesh_file_triangle_count(file), count);
    for (int c = 0; c < 3 * count; ++c)
        ck_assert_msg(sadmm_mesh_file_triangles(file)[c] == triangles[c], "corner %d is %d", c,
                      (int)sadmm_mesh_file_triangles(file)[c]);
}

static void expect_refusal(sadmm_mesh_file_def def, sadmm_status wanted, const char *message)
{
    sadmm_mesh_file *file = (sadmm_mesh_file *)&def;
    const sadmm_status status = sadmm_mesh_file_read(&def, &file);
    ck_assert_msg(status == wanted, "%s: %s", sadmm_status_name(status), sadmm_last_message());
    ck_assert_ptr_null(file);
    ck_assert_msg(strstr(sadmm_last_message(), message), "\"%s\" is not in \"%s\"", message, sadmm_last_message());
}

static void refuses(const char *text, const char *message)
{
    expect_refusal(text_def(text), SADMM_ERROR_INVALID_ARGUMENT, message);
}

/* ---- the same cube ---- */

static void expect_cube(const struct bytes *b, sadmm_mesh_file_format format, bool binary)
{
    static const int32_t fans[6] = {0, 3, 2, 0, 2, 1};
    sadmm_mesh_file *file = must_read(bytes_def(b));
    const sadmm_mesh_file_info info = info_of(file);
    const bool stl = format == SADMM_MESH_FILE_STL;
    ck_assert(info.format == format && info.binary == binary);
    ck_assert_int_eq(sadmm_mesh_file_vertex_count(file), 8);
    ck_assert_int_eq(sadmm_mesh_file_triangle_count(file), 12);
    ck_assert_int_eq(info.vertices, stl ? 36 : 8);
    ck_assert_int_eq(info.merged_vertices, stl ? 28 : 0);
    ck_assert_int_eq(info.unused_vertices + info.crossing_faces + info.degenerate_triangles + info.short_faces, 0);
    ck_assert_int_eq(info.points + info.lines + info.others + info.other_faces, 0);
    ck_assert_int_eq(info.faces, stl ? 12 : 6);
    ck_assert_int_eq(info.split_faces, stl ? 0 : 6);
    ck_assert_double_eq(volume_of(file), 1);
    if (!stl) {
        ck_assert_mem_eq(sadmm_mesh_file_vertices(file), corners, sizeof corners);
        ck_assert_mem_eq(sadmm_mesh_file_triangles(file), fans, sizeof fans);
    }
    /* The hull of it. */
    sadmm_hull_def points = sadmm_hull_def_default();
    points.points = sadmm_mesh_file_vertices(file);
    points.point_count = (size_t)sadmm_mesh_file_vertex_count(file);
    sadmm_hull *hull;
    sadmm_mass mass;
    if (sadmm_hull_create(&points, &hull) == SADMM_OK) {
        ck_assert_int_eq(sadmm_hull_mass(hull, 1000, &mass), SADMM_OK);
        ck_assert_double_eq(mass.mass, 1000);
        sadmm_hull_destroy(hull);
    } else {
        ck_assert_msg(strstr(sadmm_last_message(), "qhull"), "%s", sadmm_last_message());
    }
    sadmm_mesh_file_destroy(file);
}

START_TEST(a_cube_in_every_format)
{
    static const char *const ends[] = {"\n", "\r\n", "\r"};
    struct bytes b;
    for (int e = 0; e < 3; ++e) {
        for (int back = 0; back < 2; ++back) {
            b = cube_obj(ends[e], back);
            expect_cube(&b, SADMM_MESH_FILE_OBJ, false);
        }
        b = cube_stl(ends[e]);
        expect_cube(&b, SADMM_MESH_FILE_STL, false);
        for (int encoding = 0; encoding < 3; ++encoding) {
            b = cube_ply(encoding, ends[e]);
            expect_cube(&b, SADMM_MESH_FILE_PLY, encoding > 0);
        }
    }
    b = cube_stl_binary("anything");
    expect_cube(&b, SADMM_MESH_FILE_STL, true);
    b = cube_stl_binary("solid, says its title");
    expect_cube(&b, SADMM_MESH_FILE_STL, true);
}
END_TEST

START_TEST(a_file_by_its_path)
{
    char folder[] = "/tmp/mesh_file_XXXXXX", path[64], wanted[128];
    ck_assert_ptr_nonnull(mkdtemp(folder));
    sadmm_mesh_file_def def = sadmm_mesh_file_def_default();
    def.path = path;
    const struct bytes b = cube_stl_binary("x");
    snprintf(path, sizeof path, "%s/cube.STL", folder);
    FILE *out = fopen(path, "wb");
    ck_assert(out && fwrite(b.at, 1, b.size, out) == b.size && fclose(out) == 0);
    sadmm_mesh_file *file = must_read(def);
    ck_assert_double_eq(volume_of(file), 1);
    sadmm_mesh_file_destroy(file);
    /* The end of the path counts for more than the bytes, and what the caller says for more than that. */
    char other[64];
    snprintf(other, sizeof other, "%s/cube.ply", folder);
    ck_assert_int_eq(rename(path, other), 0);
    strcpy(path, other);
    snprintf(wanted, sizeof wanted, "def->path (%s), line 1: no PLY: the first line must be \"ply\"", path);
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, wanted);
    def.format = SADMM_MESH_FILE_STL;
    sadmm_mesh_file_destroy(must_read(def));
    /* What is no file. */
    ck_assert_int_eq(truncate(path, 0), 0);
    expect_refusal(def, SADMM_ERROR_IO, "is empty");
    unlink(path);
    expect_refusal(def, SADMM_ERROR_IO, "cube.ply): No such file or directory");
    ck_assert_int_eq(mkfifo(path, 0600), 0);
    expect_refusal(def, SADMM_ERROR_IO, "must be an ordinary file");
    unlink(path);
    def.path = folder;
    expect_refusal(def, SADMM_ERROR_IO, "is a folder: must be a file");
    rmdir(folder);
    def.path = "/dev/zero";
    expect_refusal(def, SADMM_ERROR_IO, "must be an ordinary file");
}
END_TEST

START_TEST(scale_and_signs_of_zero)
{
    sadmm_mesh_file_def def = text_def("v -0 0 0\nv 1e3 0 -0.0\nv 0 25.4E+1 -0e5\nf 1 2 3\n");
    def.scale = 0.001;
    sadmm_mesh_file *file = must_read(def);
    const double wanted[9] = {0, 0, 0, 1, 0, 0, 0, 254 * 0.001, 0};
    ck_assert_mem_eq(sadmm_mesh_file_vertices(file), wanted, sizeof wanted); /* no -0 */
    sadmm_mesh_file_destroy(file);
}
END_TEST

/* A comma for the decimal point does nothing to files, where the machine has such a locale. */
START_TEST(in_any_locale)
{
    static const char *const names[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE.utf8", "nl_NL.UTF-8"};
    for (size_t k = 0; k < sizeof names / sizeof *names && !setlocale(LC_ALL, names[k]); ++k) {}
    sadmm_mesh_file *file = must_read(text_def("v 0.5 0 0\nv 1.5 0 0\nv 0 2.25 0\nf 1 2 3\n"));
    ck_assert_double_eq(sadmm_mesh_file_vertices(file)[0], 0.5);
    ck_assert_double_eq(sadmm_mesh_file_vertices(file)[7], 2.25);
    sadmm_mesh_file_destroy(file);
    setlocale(LC_ALL, "C");
}
END_TEST

/* ---- what OBJ files have besides ---- */

static const char everything[] = "\xEF\xBB\xBF"
                                 "# comment\nmtllib a.mtl\n\n"
                                 "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0 1 0.5 0.5 0.5\nv 9 9 9\n"
                                 "vt 0 0\nvn 0 0 1\nvp 1\ng first part\nusemtl m\ns off\n"
                                 "f 1/1/1 2//1\\\n\\\r\n3/1 # and more\n"
                                 "o second\ng\nf 1/ 3 4//\np 1 2\nl 1 2 3\ncurv 0 1 1 2\nf 1 2\nf 1 2 2\n";

START_TEST(all_that_obj_files_have)
{
    static const int32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    sadmm_mesh_file *file = must_read(text_def(everything));
    const sadmm_mesh_file_info info = info_of(file);
    expect_triangles(file, 2, triangles);
    ck_assert_int_eq(info.vertices, 5);
    ck_assert_int_eq(info.unused_vertices, 1);
    ck_assert_int_eq(sadmm_mesh_file_vertex_count(file), 4);
    ck_assert_int_eq(info.faces, 3);
    ck_assert_int_eq(info.degenerate_triangles, 1);
    ck_assert_int_eq(info.short_faces, 1);
    ck_assert_int_eq(info.points, 1);
    ck_assert_int_eq(info.lines, 1);
    ck_assert_int_eq(info.others, 1);
    sadmm_mesh_file_destroy(file);
}
END_TEST

START_TEST(one_object_of_several)
{
    static const int32_t triangle[3] = {0, 1, 2};
    static const char *const names[] = {"first", "part", "second"};
    sadmm_mesh_file_def def = text_def(everything);
    for (int k = 0; k < 3; ++k) {
        def.object = names[k];
        sadmm_mesh_file *file = must_read(def);
        expect_triangles(file, 1, triangle);
        ck_assert_double_eq(sadmm_mesh_file_vertices(file)[3], 1);
        ck_assert_double_eq(sadmm_mesh_file_vertices(file)[4], k == 2 ? 1 : 0);
        ck_assert_int_eq(info_of(file).other_faces, k == 2 ? 1 : 3);
        sadmm_mesh_file_destroy(file);
    }
    def.object = "third";
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "no face is of def->object = \"third\", 4 are of others");
    def.object = "two words";
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "def->object = \"two words\": must be one word");
    def = text_def("solid a\nendsolid\n");
    def.object = "a";
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "def->object = \"a\": must be NULL");
}
END_TEST

/* ---- merged, degenerate, split ---- */

START_TEST(vertices_stay_apart_if_asked)
{
    const struct bytes b = cube_stl("\n");
    sadmm_mesh_file_def def = bytes_def(&b);
    def.merge = false;
    sadmm_mesh_file *file = must_read(def);
    ck_assert_int_eq(sadmm_mesh_file_vertex_count(file), 36);
    ck_assert_int_eq(info_of(file).merged_vertices, 0);
    for (int c = 0; c < 36; ++c) ck_assert_int_eq(sadmm_mesh_file_triangles(file)[c], c);
    sadmm_mesh_file_destroy(file);
}
END_TEST

START_TEST(degenerate_triangles)
{
    /* Good; twice the same vertex; twice the same place; on a line to within 1e-12 of its length, and not quite. */
    static const char text[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 0.5 5e-13 0\nv 0.5 2e-12 0\n"
                               "f 1 2 3\nf 1 2 2\nf 1 2 4\nf 1 5 2\nf 1 6 2\n";
    static const int32_t kept[6] = {0, 1, 2, 0, 3, 1}, all[15] = {0, 1, 2, 0, 1, 1, 0, 1, 0, 0, 3, 1, 0, 4, 1};
    sadmm_mesh_file_def def = text_def(text);
    sadmm_mesh_file *file = must_read(def);
    expect_triangles(file, 2, kept);
    ck_assert_int_eq(info_of(file).degenerate_triangles, 3);
    ck_assert_int_eq(info_of(file).unused_vertices, 1);
    sadmm_mesh_file_destroy(file);
    def.drop_degenerate = false;
    file = must_read(def);
    expect_triangles(file, 5, all);
    ck_assert_int_eq(info_of(file).degenerate_triangles, 3);
    sadmm_mesh_file_destroy(file);
    refuses("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "no triangle: all of its 1 faces are degenerate");
}
END_TEST

/* The outline of n points of the plane, turned into space; the triangles cover it: their areas, all of one sign, sum up
 * to its own, and no triangle's middle is outside. */
static void expect_cover(int n, const double (*p)[2], int axis, int64_t crossing)
{
    struct bytes b = {.size = 0};
    for (int i = 0; i < n; ++i) {
        double x[3] = {0};
        x[(axis + 1) % 3] = p[i][0], x[(axis + 2) % 3] = p[i][1], x[axis] = 0.125 * p[i][0];
        ADD(&b, "v %.17g %.17g %.17g\n", x[0], x[1], x[2]);
    }
    add(&b, "f");
    for (int i = 0; i < n; ++i) ADD(&b, " %d", i + 1);
    add(&b, "\n");
    sadmm_mesh_file_def def = bytes_def(&b);
    def.merge = false;
    sadmm_mesh_file *file = must_read(def);
    const sadmm_mesh_file_info info = info_of(file);
    ck_assert_int_eq(info.split_faces, 1);
    ck_assert_int_eq(info.crossing_faces, crossing);
    if (crossing == 0) {
        double sum = 0, area = 0;
        ck_assert_int_eq(sadmm_mesh_file_triangle_count(file), n - 2);
        ck_assert_int_eq(info.degenerate_triangles, 0);
        for (int i = 0; i < n; ++i) {
            const double *q = p[(i + 1) % n];
            area += (p[i][0] * q[1] - p[i][1] * q[0]) / 2;
        }
        for (int k = 0; k < n - 2; ++k) {
            const int32_t *t = sadmm_mesh_file_triangles(file) + 3 * k;
            const double *u = p[t[0]], *v = p[t[1]], *w = p[t[2]];
            const double part = ((v[0] - u[0]) * (w[1] - u[1]) - (v[1] - u[1]) * (w[0] - u[0])) / 2;
            ck_assert_msg(part * area > 0, "triangle %d has area %g", k, part);
            sum += part;
            const double middle[2] = {(u[0] + v[0] + w[0]) / 3, (u[1] + v[1] + w[1]) / 3};
            bool inside = false;
            for (int i = 0, j = n - 1; i < n; j = i++)
                if ((p[i][1] > middle[1]) != (p[j][1] > middle[1]) &&
                    middle[0] < (p[j][0] - p[i][0]) * (middle[1] - p[i][1]) / (p[j][1] - p[i][1]) + p[i][0])
                    inside = !inside;
            ck_assert_msg(inside, "the middle of triangle %d is outside", k);
        }
        ck_assert_double_eq_tol(sum, area, 1e-13 * fabs(area));
    }
    sadmm_mesh_file_destroy(file);
}

START_TEST(faces_that_are_not_convex)
{
    static const double arrow[4][2] = {{0, 0}, {2, 1}, {0, 2}, {0.5, 1}},
                        dart[4][2] = {{0.5, 1}, {0, 0}, {2, 1}, {0, 2}};
    static const double ell[6][2] = {{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}};
    static const double comb[12][2] = {{0, 0}, {7, 0}, {7, 3}, {6, 3}, {6, 1}, {5, 1},
                                       {4, 3}, {4, 1}, {2, 1}, {1, 3}, {1, 1}, {0, 3}};
    static const double edges[7][2] = {{0, 0}, {1, 0}, {2, 0}, {2, 1},
                                       {2, 2}, {1, 2}, {0, 2}}; /* corners that are straight */
    static const double hole[10][2] = {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0},
                                       {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}}; /* and a way to it and back */
    static const double bow[4][2] = {{0, 0}, {2, 2}, {2, 0}, {0, 1}};
    static const double spike[5][2] = {{0, 0}, {2, 0}, {2, 2}, {2, 0}, {0, 1}}; /* up, and down the same way */
    double star[5][2], spiral[200][2];
    for (int axis = 0; axis < 3; ++axis) {
        expect_cover(4, arrow, axis, 0);
        expect_cover(4, dart, axis, 0);
        expect_cover(6, ell, axis, 0);
        expect_cover(12, comb, axis, 0);
        expect_cover(7, edges, axis, 0);
        expect_cover(10, hole, axis, 0);
        expect_cover(4, bow, axis, 1);
        expect_cover(5, spike, axis, 1);
        for (int k = 0; k < 5; ++k) star[k][0] = cos(4 * M_PI * k / 5), star[k][1] = sin(4 * M_PI * k / 5);
        expect_cover(5, star, axis, 1);
        for (int k = 0; k < 100; ++k) { /* outwards, and back inside of it; both directions */
            const int back = axis == 1 ? k : 199 - k, forth = axis == 1 ? 199 - k : k;
            const double r = 1 + 0.1 * k, angle = 0.3 * k;
            spiral[forth][0] = r * cos(angle), spiral[forth][1] = r * sin(angle);
            spiral[back][0] = (r - 0.5) * cos(angle), spiral[back][1] = (r - 0.5) * sin(angle);
        }
        expect_cover(200, spiral, axis, 0);
    }
}
END_TEST

static double turn(const double *a, const double *b, const double *c)
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static bool is_on(const double *a, const double *b, const double *p)
{
    return turn(a, b, p) == 0 && (p[0] - a[0]) * (p[0] - b[0]) <= 0 && (p[1] - a[1]) * (p[1] - b[1]) <= 0;
}

/* No two edges meet but at the corner between them. Whole numbers: exact. */
static bool is_simple(int n, const double (*p)[2])
{
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double *a = p[i], *b = p[(i + 1) % n], *c = p[j], *d = p[(j + 1) % n];
            if (j != i && (is_on(c, d, a) != ((j + 1) % n == i))) return false;
            if (turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0) return false;
        }
    return true;
}

START_TEST(all_kinds_of_outlines)
{
    unsigned state = 1;
    int simple = 0;
    for (int run = 0; run < 60000; ++run) {
        double p[9][2];
        int numbers[20];
        for (int k = 0; k < 20; ++k) numbers[k] = (int)((state = 1664525 * state + 1013904223) >> 16);
        const int n = 4 + numbers[18] % 6, size = 3 + numbers[19] % 5;
        for (int k = 0; k < 2 * n; ++k) p[k / 2][k % 2] = numbers[k] % size;
        if (!is_simple(n, p)) continue;
        expect_cover(n, p, run % 3, 0);
        ++simple;
    }
    ck_assert_int_gt(simple, 4000);
}
END_TEST

START_TEST(large_faces)
{
    struct bytes *const b = calloc(1, sizeof *b);
    char *const text = malloc(1 << 20);
    sadmm_mesh_file *file;
    ck_assert(b && text);
    for (int convex = 0; convex < 2; ++convex)
        for (int n = 1024; n < 1027; n += 2) {
            size_t at = 0;
            for (int k = 0; k < n; ++k) {
                const double r = convex || k % 2 ? 1 : 0.9;
                at += (size_t)sprintf(text + at, "v %.17g %.17g 0\n", r * cos(2 * M_PI * k / n),
                                      r * sin(2 * M_PI * k / n));
            }
            at += (size_t)sprintf(text + at, "f");
            for (int k = 0; k < n; ++k) at += (size_t)sprintf(text + at, " %d", k + 1);
            if (!convex && n > 1024) {
                expect_refusal(text_def(text), SADMM_ERROR_LIMIT,
                               "face 1 is not convex and has 1026 corners: at most 1024");
                continue;
            }
            file = must_read(text_def(text));
            ck_assert_int_eq(sadmm_mesh_file_triangle_count(file), n - 2);
            ck_assert_int_eq(info_of(file).crossing_faces, 0);
            sadmm_mesh_file_destroy(file);
        }
    free(text);
    free(b);
}
END_TEST

/* ---- refusals ---- */

START_TEST(refused_arguments)
{
    sadmm_mesh_file_def def = sadmm_mesh_file_def_default();
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "def->path and def->bytes = NULL: one must be given");
    def = text_def("v");
    def.path = "a.obj";
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "def->path and def->bytes: only one may be given");
    def = text_def("");
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "def->size = 0: must be > 0 with def->bytes");
    def.bytes = NULL;
    def.path = "a.obj";
    def.size = 1;
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "def->size = 1: must be 0 with def->path");
    def = text_def("v");
    def.format = SADMM_MESH_FILE_FORMAT_COUNT;
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "def->format = 4: must be in [0, 4)");
    const double scales[] = {0, -1, 1e-10, 1e10, NAN, INFINITY};
    for (int k = 0; k < 6; ++k) {
        def = text_def("v");
        def.scale = scales[k];
        expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "must be in [1e-09, 1e+09]");
    }
}
END_TEST

START_TEST(refused_obj_files)
{
    refuses("v 0 0 0\nv 1 0 nan\n", "def->bytes, line 2: v: \"nan\": must be a finite number");
    refuses("v 0 0 inf\n", "line 1: v: \"inf\": must be a finite number");
    refuses("v 0 0 0x10\n", "line 1: v: \"0x10\": must be a finite number");
    refuses("v 0 0 1,5\n", "\"1,5\": must be a finite number");
    refuses("v 0 0 1e999\n", "line 1: vertex 1: z = inf, by def->scale inf m: must be in [-1e6, 1e6] m");
    refuses("\n\nv 0 -1000001 0\n", "line 3: vertex 1: y = -1e+06, by def->scale -1e+06 m: must be in [-1e6, 1e6] m");
    refuses("v 0 0\n", "line 1: v has 2 numbers: must be 3");
    refuses("v 0 0 1 1 1\n", "line 1: v has 5 numbers");
    refuses("v 0 0 0 1 1 1 1 1\n", "v has more than 7 numbers");
    refuses("v 0 0 0\nf 1 1 2\n", "line 2: face 1: vertex 2: must be in [1, 1], there are 1 vertices before it");
    refuses("v 0 0 0\nf 1 1 0\n", "line 2: f: vertex 0: they are counted from 1");
    refuses("v 0 0 0\nf 1 1 -2\n", "line 2: f: vertex -2: there are 1 vertices before it");
    refuses("v 0 0 0\nf 1 1 -9223372036854775808\n", "there are 1 vertices before it");
    refuses("v 0 0 0\nf 1 1 99999999999999999999\n", "vertex 9223372036854775807: must be in [1, 1]");
    refuses("v 0 0 0\nf 1 1.5 1\n", "line 2: f: \"1.5\": must be a vertex");
    refuses("v 0 0 0\nf 1 1/2/3/4 1\n", "f: \"1/2/3/4\": must be a vertex");
    refuses("v 0 0 0\nf 1 /1 1\n", "f: \"/1\": must be a vertex");
    refuses("v 0 0 0\nf 1 1/x 1\n", "f: \"1/x\": must be a vertex");
    refuses("hello\n", "line 1: no OBJ: lines do not begin with \"hello\"");
    refuses("\x01\xff\x80\n", "lines do not begin with \"???\"");
    refuses("v 0 0 0\np 1\n", "no triangle: it has 1 vertices and no face of three corners or more");
    refuses("\n \n", "no triangle: it has 0 vertices");
    expect_refusal(text_def("call other.obj\n"), SADMM_ERROR_UNSUPPORTED, "line 1: call: other files and commands");
    expect_refusal(text_def("v 0 0 0\ncsh rm x\n"), SADMM_ERROR_UNSUPPORTED, "line 2: csh: other files and commands");
}
END_TEST

START_TEST(refused_stl_files)
{
    static const char top[] = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n";
    char text[512];
    struct bytes b = cube_stl_binary("x");
    sadmm_mesh_file_def def = bytes_def(&b);
    def.format = SADMM_MESH_FILE_STL;
    --def.size;
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT,
                   "no STL: does not begin with \"solid\", and a binary file of 12 triangles (bytes 80 to 83) has 684 "
                   "bytes, this one 683");
    def.size = 83;
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT, "has 83 bytes, binary files 84 or more");
    b = cube_stl_binary("x");
    memset(b.at + 80, -1, 4);
    def = bytes_def(&b);
    def.format = SADMM_MESH_FILE_STL;
    expect_refusal(def, SADMM_ERROR_INVALID_ARGUMENT,
                   "a binary file of 4294967295 triangles (bytes 80 to 83) has 214748364834");
    b = cube_stl_binary("x");
    b.size = 84;
    b.at[80] = 0;
    expect_refusal(bytes_def(&b), SADMM_ERROR_INVALID_ARGUMENT, "no triangle: it has 0 vertices");
    b = cube_stl_binary("x");
    memset(b.at + 84 + 12, -1, 4);
    expect_refusal(bytes_def(&b), SADMM_ERROR_INVALID_ARGUMENT, "def->bytes: vertex 1: x = ");

    refuses("solid\n", "line 2: no text STL: must be \"facet normal\" or \"endsolid\", and the file ends");
    refuses("solid\nhello\n", "line 2: no text STL: must be \"facet normal\" or \"endsolid\"");
    refuses("solid\nendsolid\nmore\n", "line 3: no text STL: must be \"solid\"");
    refuses("solid\nfacet 0 0 1\n", "line 2: no text STL: must be \"normal\"");
    refuses("solid\nfacet normal 0 0 1\nouter\n", "line 3: no text STL: must be \"loop\"");
    refuses("solid\nfacet normal 0 0 1\nouter loop x\n", "line 3: \"x\": must be the end of the line");
    snprintf(text, sizeof text, "%svertex 0 nan 0\n", top);
    refuses(text, "line 6: y = \"nan\": must be a finite number");
    snprintf(text, sizeof text, "%svertex 0 1\n", top);
    refuses(text, "line 6: z = \"\": must be a finite number");
    snprintf(text, sizeof text, "%svertex 0 1 0 0\n", top);
    refuses(text, "line 6: \"0\": must be the end of the line");
    snprintf(text, sizeof text, "%svertex 0 1 0\nvertex 1 1 0\n", top);
    refuses(text, "line 7: no text STL: must be \"endloop\"");
    snprintf(text, sizeof text, "%sendloop\n", top);
    refuses(text, "line 6: no text STL: must be \"vertex\"");
}
END_TEST

START_TEST(refused_ply_headers)
{
    refuses("ply\n", "line 2: no PLY: must be \"format\"");
    refuses("ply\nformat\n", "line 2: format: must have a name and a version");
    refuses("ply\nformat text 1.0\n",
            "line 2: format \"text\": must be ascii, binary_little_endian or binary_big_endian");
    refuses("ply\nformat ascii\n", "line 2: format: must have a version");
    expect_refusal(text_def("ply\nformat ascii 2.0\n"), SADMM_ERROR_UNSUPPORTED, "PLY version \"2.0\": must be 1.0");
#define HEAD "ply\nformat ascii 1.0\n"
    refuses(HEAD "element vertex 1\n", "no PLY: the file ends before \"end_header\"");
    refuses(HEAD "hello\n", "line 3: no PLY: lines of the header do not begin with \"hello\"");
    refuses(HEAD "property int x\n", "line 3: property: must come below an element");
    refuses(HEAD "element\n", "line 3: element: must have a name and a number");
    refuses(HEAD "element vertex\n", "line 3: element: number of rows \"\": must be an integer >= 0");
    refuses(HEAD "element vertex -1\n", "number of rows \"-1\"");
    refuses(HEAD "element face 1\nend_header\n", "element face has no list vertex_indices or vertex_index");
    refuses(HEAD "element vertex 1\nproperty float x\nproperty float z\nelement face 1\n",
            "element vertex has no property y");
    refuses(HEAD "element vertex 1\nproperty float x\nproperty float x\n", "line 5: property x: there is one already");
    refuses(HEAD "element vertex 1\nproperty list int float x\n", "line 4: property x: must be a number");
    refuses(HEAD "element face 1\nproperty list int float vertex_index\n", "vertex_index: must be a list of integers");
    refuses(HEAD "element face 1\nproperty int vertex_index\n", "vertex_index: must be a list of integers");
    refuses(HEAD "element face 1\nproperty list float int a\n", "line 4: property \"float\": must be a type");
    refuses(HEAD "element face 1\nproperty half a\n", "line 4: property \"half\": must be a type");
    refuses(HEAD "element face 1\nproperty int\n", "line 4: property: must have a name");
    refuses(HEAD "element face 1\nproperty list int int vertex_index\nelement face 1\n",
            "element face: there is one already");
    expect_refusal(text_def(HEAD "element tristrips 1\n"), SADMM_ERROR_UNSUPPORTED, "triangle strips are not read");
    expect_refusal(text_def(HEAD "element vertex 4000000000\n"), SADMM_ERROR_LIMIT,
                   "4000000000 vertices: at most 536870912");
}
END_TEST

START_TEST(refused_ply_rows)
{
#define ROWS                                                                                      \
    HEAD "element vertex 3\nproperty float x\nproperty float y\nproperty int z\nelement face 1\n" \
         "property list char int vertex_index\nend_header\n0 0 0\n1 0 0\n"
    refuses(ROWS, "row 3 of 3 of element vertex: the file ends before it");
    refuses(ROWS "0 1\n", "line 12: row 3 of 3 of element vertex: has too few values");
    refuses(ROWS "0 1 0 0\n", "line 12: row 3 of 3 of element vertex: has too many values: 0");
    refuses(ROWS "0 nan 0\n", "line 12: row 3 of 3 of element vertex: must be a finite number: nan");
    refuses(ROWS "0 1 1.5\n", "must be an integer of its type: 1.5");
    refuses(ROWS "0 1 2147483648\n", "must be an integer of its type: 2147483648");
    refuses(ROWS "0 2000000 0\n", "line 12: vertex 3: y = 2e+06");
    refuses(ROWS "0 1 0\n", "row 1 of 1 of element face: the file ends before it");
    refuses(ROWS "0 1 0\n3 0 1 3\n", "line 13: face 1: vertex 3: must be in [0, 2], there are 3 vertices");
    refuses(ROWS "0 1 0\n3 0 1 -1\n", "face 1: vertex -1: must be in [0, 2]");
    refuses(ROWS "0 1 0\n-3 0 1 2\n", "line 13: row 1 of 1 of element face: the length of a list is negative");
    refuses(ROWS "0 1 0\n4 0 1 2\n", "row 1 of 1 of element face: has too few values");
    refuses(ROWS "0 1 0\n2 0 1\n", "no face of three corners or more");
    refuses(ROWS "0 1 0\n3 0 1 2\n1\n", "line 14: there are more lines than the header says");
    struct bytes b = cube_ply(2, "\n");
    --b.size;
    expect_refusal(bytes_def(&b), SADMM_ERROR_INVALID_ARGUMENT,
                   "def->bytes: row 6 of 6 of element face: the file ends there");
    b.size += 2;
    expect_refusal(bytes_def(&b), SADMM_ERROR_INVALID_ARGUMENT,
                   "def->bytes: there are 1 more bytes than the header says");
    --b.size;
    b.at[b.size - 4] = 1;
    expect_refusal(bytes_def(&b), SADMM_ERROR_INVALID_ARGUMENT,
                   "def->bytes: face 6: vertex 16777223: must be in [0, 7]");
}
END_TEST

START_TEST(ply_rows_that_are_counted)
{
    /* Rows of nothing, faces before the vertices, an element of another name. */
    sadmm_mesh_file *file = must_read(text_def(
        HEAD "element nothing 9223372036854775807\nelement face 2\nproperty list int uchar vertex_indices\n"
             "element vertex 3\nproperty int x\nproperty int y\nproperty int z\nelement edge 1\nproperty int a\n"
             "element other 2\nproperty list int int b\nend_header\n3 0 1 2\n1 0\n\n0 0 0\n1 0 0\n0 1 0\n7\n0\n1 x\n"));
    const sadmm_mesh_file_info info = info_of(file);
    ck_assert_int_eq(info.short_faces, 1);
    ck_assert_int_eq(info.lines, 1);
    ck_assert_int_eq(info.others, 2);
    ck_assert_int_eq(sadmm_mesh_file_triangle_count(file), 1);
    sadmm_mesh_file_destroy(file);
}
END_TEST

START_TEST(out_of_memory)
{
    const struct bytes files[] = {cube_obj("\n", false), cube_stl("\n"), cube_stl_binary("x"), cube_ply(0, "\n"),
                                  cube_ply(2, "\n")};
    char arrow[] = "v 0 0 0\nv 2 1 0\nv 0 2 0\nv 0.5 1 0\nf 1 2 3 4\n";
    for (size_t k = 0; k <= sizeof files / sizeof *files; ++k) {
        const sadmm_mesh_file_def def = k < sizeof files / sizeof *files ? bytes_def(&files[k]) : text_def(arrow);
        sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
        int n = 0;
        for (; status == SADMM_ERROR_OUT_OF_MEMORY; ++n) {
            sadmm_mesh_file *file;
            sadmm_test_fail_allocations_after(n);
            status = sadmm_mesh_file_read(&def, &file);
            sadmm_test_fail_allocations_after(-1);
            ck_assert((status == SADMM_OK) == (file != NULL));
            ck_assert_msg(status == SADMM_OK || strstr(sadmm_last_message(), "memory"), "%s", sadmm_last_message());
            sadmm_mesh_file_destroy(file);
        }
        ck_assert_int_eq(status, SADMM_OK);
        ck_assert_int_gt(n, 8);
    }
}
END_TEST

START_TEST(of_null)
{
    sadmm_mesh_file_info info;
    sadmm_mesh_file_destroy(NULL);
    ck_assert_int_eq(sadmm_mesh_file_vertex_count(NULL), 0);
    ck_assert_int_eq(sadmm_mesh_file_triangle_count(NULL), 0);
    ck_assert_ptr_null(sadmm_mesh_file_vertices(NULL));
    ck_assert_ptr_null(sadmm_mesh_file_triangles(NULL));
    ck_assert_int_eq(sadmm_mesh_file_describe(NULL, &info), SADMM_ERROR_INVALID_ARGUMENT);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("mesh_file");
    TCase *tests = tcase_create("mesh_file");
    tcase_add_test(tests, a_cube_in_every_format);
    tcase_add_test(tests, a_file_by_its_path);
    tcase_add_test(tests, scale_and_signs_of_zero);
    tcase_add_test(tests, in_any_locale);
    tcase_add_test(tests, all_that_obj_files_have);
    tcase_add_test(tests, one_object_of_several);
    tcase_add_test(tests, vertices_stay_apart_if_asked);
    tcase_add_test(tests, degenerate_triangles);
    tcase_add_test(tests, faces_that_are_not_convex);
    tcase_add_test(tests, all_kinds_of_outlines);
    tcase_add_test(tests, large_faces);
    tcase_add_test(tests, refused_arguments);
    tcase_add_test(tests, refused_obj_files);
    tcase_add_test(tests, refused_stl_files);
    tcase_add_test(tests, refused_ply_headers);
    tcase_add_test(tests, refused_ply_rows);
    tcase_add_test(tests, ply_rows_that_are_counted);
    tcase_add_test(tests, out_of_memory);
    tcase_add_test(tests, of_null);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
