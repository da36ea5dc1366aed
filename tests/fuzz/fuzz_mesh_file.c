/* Mesh files: a good file of a cube in any format and variant, damaged byte by byte, word by word and line by line, or
 * bytes that are nobody's file. Whatever they are:
 *
 *   - they are refused with a reason and nothing in hand, or
 *   - have triangles of vertices that are there, are used, are finite and within 1e6 m, and are all counted
 *   - the same bytes give the same again, in an allocation that ends where they do
 *   - a file that was not damaged is a cube
 */
#include <string.h>
#include <unistd.h>

#include "bytes.h"
#include "core/base/memory.h"
#include "subadmm/mesh_file.h"

enum { LARGEST = 1 << 14 };

struct file {
    char bytes[LARGEST];
    size_t size;
};

/* ---- a good file ------------------------------------------------------------------------------------------------- */

static const double corners[8][3] = {
    {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1},
};
static const int faces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

static void add_bytes(struct file *f, const void *bytes, size_t size)
{
    if (size > LARGEST - f->size) size = LARGEST - f->size;
    memcpy(f->bytes + f->size, bytes, size);
    f->size += size;
}

#define ADD(f, ...)                                                           \
    do {                                                                      \
        char line[256];                                                       \
        add_bytes(f, line, (size_t)snprintf(line, sizeof line, __VA_ARGS__)); \
    } while (0)

static void add_number(struct file *f, uint64_t bits, size_t size, bool big)
{
    for (size_t k = 0; k < size; ++k) {
        const uint8_t byte = (uint8_t)(bits >> 8 * (big ? size - 1 - k : k));
        add_bytes(f, &byte, 1);
    }
}

static void add_float(struct file *f, double x, bool big)
{
    const float value = (float)x;
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    add_number(f, bits, 4, big);
}

static void add_double(struct file *f, double x, bool big)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    add_number(f, bits, 8, big);
}

static void make_obj(struct bytes *in, struct file *f)
{
    const char *const end = take_choice(in, 2) ? "\r\n" : "\n";
    const bool back = take_choice(in, 2), triangles = take_choice(in, 2), more = take_choice(in, 2);
    ADD(f, "# a cube%s%so cube%s", end, more ? "mtllib a.mtl\nvt 0 0\nvn 0 0 1\n" : "", end);
    for (int v = 0; v < 8; ++v)
        ADD(f, "v %g %.3f %e%s%s", corners[v][0], corners[v][1], corners[v][2], more ? " 1" : "", end);
    ADD(f, "g top part%s", end);
    for (int k = 0; k < 6; ++k) {
        int v[4];
        for (int c = 0; c < 4; ++c) v[c] = back ? faces[k][c] - 8 : faces[k][c] + 1;
        if (triangles) ADD(f, "f %d/1/1 %d//1 %d/1%sf %d %d %d%s", v[0], v[1], v[2], end, v[0], v[2], v[3], end);
        else ADD(f, "f %d %d \\%s %d %d # a side%s", v[0], v[1], end, v[2], v[3], end);
    }
    if (more) ADD(f, "l 1 2 3%sp 1%susemtl m%s", end, end, end);
}

/* Triangle k of 12 as corners. */
static void triangle(int k, int v[3])
{
    const int *face = faces[k / 2];
    v[0] = face[0];
    v[1] = face[k % 2 ? 2 : 1];
    v[2] = face[k % 2 ? 3 : 2];
}

static void make_stl(struct bytes *in, struct file *f, bool binary)
{
    char header[80] = {0};
    const char *const end = take_choice(in, 2) ? "\r\n" : "\n";
    int v[3];
    if (binary) {
        snprintf(header, sizeof header, "%s", take_choice(in, 2) ? "solid cube" : "a cube");
        add_bytes(f, header, sizeof header);
        add_number(f, 12, 4, false);
    } else {
        ADD(f, "solid cube%s", end);
    }
    for (int k = 0; k < 12; ++k) {
        triangle(k, v);
        if (binary) {
            for (int n = 0; n < 3; ++n) add_float(f, 0, false);
            for (int c = 0; c < 9; ++c) add_float(f, corners[v[c / 3]][c % 3], false);
            add_number(f, 0, 2, false);
            continue;
        }
        ADD(f, " facet normal 0 0 1%s  outer loop%s", end, end);
        for (int c = 0; c < 3; ++c)
            ADD(f, "   vertex %g %.2f %e%s", corners[v[c]][0], corners[v[c]][1], corners[v[c]][2], end);
        ADD(f, "  endloop%s endfacet%s", end, end);
        if (k == 5 && header[0] == 0) ADD(f, "endsolid cube%ssolid other%s", end, end);
    }
    if (!binary) ADD(f, "endsolid%s", end);
}

static void make_ply(struct bytes *in, struct file *f, int encoding)
{
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    const char *const ends[] = {"\n", "\r\n", "\r"}, *const end = ends[take_choice(in, 3)];
    const bool more = take_choice(in, 2), first = take_choice(in, 2), big = encoding == 2;
    ADD(f, "ply%sformat %s 1.0%scomment a cube%s", end, names[encoding], end, end);
    for (int pass = 0; pass < 2; ++pass) {
        if ((pass == 0) == first)
            ADD(f, "element face 6%sproperty list uchar %s vertex_ind%s%s", end, more ? "uint" : "int",
                more ? "ices" : "ex", end);
        else
            ADD(f, "element vertex 8%sproperty %s x%sproperty float y%sproperty float z%s%s%s", end,
                more ? "double" : "float32", end, end, end, more ? "property short colour" : "", more ? end : "");
    }
    if (more) ADD(f, "element edge 1%sproperty int a%sproperty list char ushort b%s", end, end, end);
    ADD(f, "end_header%s", end);
    for (int pass = 0; pass < 2; ++pass)
        for (int k = 0; k < ((pass == 0) == first ? 6 : 8); ++k) {
            const bool face = (pass == 0) == first;
            const int *v = faces[k % 6];
            const double *x = corners[k];
            if (encoding == 0) {
                if (face) ADD(f, "4 %d %d %d %d%s", v[0], v[1], v[2], v[3], end);
                else ADD(f, "%g %g %g%s%s", x[0], x[1], x[2], more ? " -7" : "", end);
            } else if (face) {
                add_number(f, 4, 1, big);
                for (int c = 0; c < 4; ++c) add_number(f, (uint64_t)v[c], 4, big);
            } else {
                if (more) add_double(f, x[0], big);
                else add_float(f, x[0], big);
                add_float(f, x[1], big);
                add_float(f, x[2], big);
                if (more) add_number(f, 7, 2, big);
            }
        }
    if (!more) return;
    if (encoding == 0) ADD(f, "0 2 3 4%s", end);
    else add_number(f, 1, 4, big), add_number(f, 1, 1, big), add_number(f, 5, 2, big);
}

/* ---- damage ------------------------------------------------------------------------------------------------------ */

static void replace(struct file *f, size_t at, size_t length, const void *bytes, size_t size)
{
    static char rest[LARGEST];
    if (at > f->size) at = f->size;
    if (length > f->size - at) length = f->size - at;
    const size_t behind = f->size - at - length;
    memcpy(rest, f->bytes + at + length, behind);
    f->size = at;
    add_bytes(f, bytes, size);
    add_bytes(f, rest, behind);
}

static bool numeral(char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == 'e'; }

static void damage(struct bytes *in, struct file *f)
{
    static const char *const numbers[] = {
        "nan",
        "-inf",
        "1e400",
        "-1",
        "0",
        "-0",
        "4294967295",
        "2147483647",
        "-2147483648",
        "9223372036854775807",
        "-9223372036854775808",
        "99999999999999999999",
        "1e-320",
        "1e6",
        "1000001",
        "3",
        "9",
        "8",
        "-8",
        "-9",
        "0x10",
        "1.5",
        "+2",
        ".",
        "e",
        "-",
        "1e",
        "1000000000",
        "255",
        "256",
        "4/",
        "/1",
        "1/2/3/4",
        "",
    };
    static const char *const words[] = {
        "v ",
        "f ",
        "fo ",
        "l ",
        "p ",
        "vn ",
        "g ",
        "o ",
        "curv ",
        "call x",
        "\\\n",
        "\\\r\n",
        "\\",
        "#",
        "solid ",
        "endsolid",
        "facet normal ",
        "vertex ",
        "endloop",
        "outer loop",
        "endfacet",
        "element vertex 8\n",
        "element face 6\n",
        "element edge 1000000000000\n",
        "element other 9223372036854775807\n",
        "element tristrips 1\n",
        "property list uchar int vertex_indices\n",
        "property list int double x\n",
        "property list float int vertex_index\n",
        "property char q\n",
        "property list uint uint q\n",
        "end_header\n",
        "format ascii 1.0\n",
        "format binary_big_endian 1.0\n",
        "comment ",
        "obj_info ",
        "\r\n",
        "\n",
        "\r",
        "\t",
        " ",
        "f 1 2\n",
        "f 1 2 3 4 5 6 7 8\n",
        "f 1 3 2 4\n",
        "f 1 1 1 1 1\n",
        "f -1 -2 -3\n",
        "v 0.5 0.25 0\n",
        "v 1e-200 0 0\n",
        "\xEF\xBB\xBF",
        "ply\n",
    };
    static const uint32_t values[] = {0,          1,          0x7f,       0x80,       0xff,       0x7fff,
                                      0xffff,     0x7fffffff, 0x80000000, 0xffffffff, 0x7f800000, 0xff800000,
                                      0x7fc00000, 0x00000001, 0x497423f0, 0x4974240f};
    const size_t at = f->size > 0 ? (size_t)(take_byte(in) << 8 | take_byte(in)) % f->size : 0;
    size_t from = at, to;
    char byte;
    switch (take_choice(in, 10)) {
    case 0:
        byte = (char)take_byte(in);
        replace(f, at, 1, &byte, 1);
        return;
    case 1: replace(f, at, 1 + (size_t)take_byte(in), "", 0); return;
    case 2: { /* again, or elsewhere */
        char copy[256];
        const size_t length = (size_t)take_byte(in) < f->size - at ? (size_t)take_byte(in) % (f->size - at + 1) : 0;
        memcpy(copy, f->bytes + at, length);
        replace(f, take_choice(in, 2) ? at : (size_t)take_byte(in), 0, copy, length);
        return;
    }
    case 3:
    case 4: { /* a number */
        const char *const number = numbers[take_choice(in, (int)(sizeof numbers / sizeof *numbers))];
        while (from < f->size && !numeral(f->bytes[from])) ++from;
        for (to = from; to < f->size && numeral(f->bytes[to]);) ++to;
        replace(f, from, to - from, number, strlen(number));
        return;
    }
    case 5: { /* a line of its own */
        const char *const word = words[take_choice(in, (int)(sizeof words / sizeof *words))];
        while (from < f->size && f->bytes[from] != '\n' && f->bytes[from] != '\r') ++from;
        replace(f, from + 1, 0, word, strlen(word));
        return;
    }
    case 6: {
        const char *const word = words[take_choice(in, (int)(sizeof words / sizeof *words))];
        replace(f, at, 0, word, strlen(word));
        return;
    }
    case 7: {
        const uint32_t value = values[take_choice(in, (int)(sizeof values / sizeof *values))];
        const bool big = take_choice(in, 2);
        char bytes[4];
        for (int k = 0; k < 4; ++k) bytes[k] = (char)(value >> 8 * (big ? 3 - k : k));
        replace(f, at, 4, bytes, 4);
        return;
    }
    case 8: /* a line away */
        while (from < f->size && f->bytes[from] != '\n') ++from;
        for (to = from + 1; to < f->size && f->bytes[to] != '\n';) ++to;
        replace(f, from, to - from, "", 0);
        return;
    default:
        if (take_choice(in, 4) == 0) f->size = at;
    }
}

/* True: it is as good as it was. */
static bool make_file(struct bytes *in, struct file *f)
{
    const int kind = take_choice(in, 8);
    f->size = 0;
    switch (kind) {
    case 0:
    case 1: make_obj(in, f); break;
    case 2: make_stl(in, f, false); break;
    case 3: make_stl(in, f, true); break;
    case 4:
    case 5:
    case 6: make_ply(in, f, kind - 4); break;
    default:
        while (bytes_left(in) && f->size < LARGEST) f->bytes[f->size++] = (char)take_byte(in);
        return false;
    }
    const int changes = take_choice(in, take_rarely(in, 8) ? 24 : 6);
    for (int k = 0; k < changes; ++k) damage(in, f);
    return changes == 0;
}

/* ---- what must hold ---------------------------------------------------------------------------------------------- */

static void check_mesh(const sadmm_mesh_file *mesh, const sadmm_mesh_file_def *def)
{
    static bool used[LARGEST];
    const int32_t vertices = sadmm_mesh_file_vertex_count(mesh), triangles = sadmm_mesh_file_triangle_count(mesh);
    const double *x = sadmm_mesh_file_vertices(mesh);
    const int32_t *t = sadmm_mesh_file_triangles(mesh);
    sadmm_mesh_file_info info;
    MUST(sadmm_mesh_file_describe(mesh, &info) == SADMM_OK, "%s", sadmm_last_message());
    MUST(vertices > 0 && vertices < LARGEST && triangles > 0, "%d vertices, %d triangles", (int)vertices,
         (int)triangles);
    memset(used, 0, (size_t)vertices);
    for (int32_t c = 0; c < 3 * triangles; ++c) {
        MUST(t[c] >= 0 && t[c] < vertices, "corner %d is %d of %d", (int)c, (int)t[c], (int)vertices);
        used[t[c]] = true;
    }
    for (int32_t v = 0; v < vertices; ++v) {
        MUST(used[v], "vertex %d", (int)v);
        for (int k = 0; k < 3; ++k)
            MUST(fabs(x[3 * v + k]) <= 1e6 && (x[3 * v + k] != 0 || !signbit(x[3 * v + k])), "%g", x[3 * v + k]);
        for (int32_t w = 0; def->merge && w < v && v < 64; ++w)
            MUST(memcmp(x + 3 * v, x + 3 * w, 3 * sizeof *x) != 0, "vertices %d and %d", (int)v, (int)w);
    }
    MUST(info.vertices == vertices + info.merged_vertices + info.unused_vertices && info.unused_vertices >= 0,
         "%lld vertices, %lld merged", (long long)info.vertices, (long long)info.merged_vertices);
    MUST(info.faces > 0 && info.faces >= info.split_faces && info.split_faces >= info.crossing_faces, "%lld faces",
         (long long)info.faces);
    MUST(triangles + info.degenerate_triangles >= info.faces + info.split_faces, "%d triangles", (int)triangles);
    MUST(def->merge || info.merged_vertices == 0, "merged");
}

static void check_cube(const sadmm_mesh_file *mesh, const sadmm_mesh_file_def *def)
{
    const double *x = sadmm_mesh_file_vertices(mesh);
    const int32_t *t = sadmm_mesh_file_triangles(mesh);
    double volume = 0;
    MUST(sadmm_mesh_file_triangle_count(mesh) == 12, "%d", (int)sadmm_mesh_file_triangle_count(mesh));
    MUST(!def->merge || sadmm_mesh_file_vertex_count(mesh) == 8, "%d", (int)sadmm_mesh_file_vertex_count(mesh));
    for (int k = 0; k < 12; ++k) {
        const double *a = x + 3 * t[3 * k], *b = x + 3 * t[3 * k + 1], *c = x + 3 * t[3 * k + 2];
        volume += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                  a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    MUST(fabs(volume / 6 / pow(def->scale, 3) - 1) < 1e-12, "%.17g", volume / 6);
}

static void must_be_the_same(const sadmm_mesh_file *a, const sadmm_mesh_file *b)
{
    const int32_t vertices = sadmm_mesh_file_vertex_count(a), triangles = sadmm_mesh_file_triangle_count(a);
    MUST(vertices == sadmm_mesh_file_vertex_count(b) && triangles == sadmm_mesh_file_triangle_count(b), "counts");
    MUST(memcmp(sadmm_mesh_file_vertices(a), sadmm_mesh_file_vertices(b), (size_t)vertices * 24) == 0, "vertices");
    MUST(memcmp(sadmm_mesh_file_triangles(a), sadmm_mesh_file_triangles(b), (size_t)triangles * 12) == 0, "triangles");
}

static sadmm_status read_path(const struct file *f, sadmm_mesh_file_def def, sadmm_mesh_file **mesh)
{
    char path[64];
    snprintf(path, sizeof path, "%s/fuzz-mesh-%ld", access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp",
             (long)getpid());
    FILE *file = fopen(path, "wb");
    MUST(file && fwrite(f->bytes, 1, f->size, file) == f->size && fclose(file) == 0, "%s", path);
    def.bytes = NULL;
    def.size = 0;
    def.path = path;
    const sadmm_status status = sadmm_mesh_file_read(&def, mesh);
    unlink(path);
    return status;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct file f;
    struct bytes in = bytes_of(data, size);
    sadmm_mesh_file_def def = sadmm_mesh_file_def_default();
    sadmm_mesh_file *mesh = NULL, *again = NULL;
    if (take_rarely(&in, 4)) def.scale = take_scale(&in, 1e-9, 1e9);
    if (take_rarely(&in, 8)) def.object = take_choice(&in, 2) ? "part" : "cube";
    if (take_rarely(&in, 8)) def.format = (sadmm_mesh_file_format)take_choice(&in, SADMM_MESH_FILE_FORMAT_COUNT);
    def.merge = take_choice(&in, 4) != 3;
    def.drop_degenerate = take_choice(&in, 4) != 3;
    const int allocations = take_rarely(&in, 16) ? take_choice(&in, 64) : -1;
    const bool plain = allocations < 0 && !def.object && def.format == SADMM_MESH_FILE_ANY && def.scale < 1e6;
    const bool good = make_file(&in, &f) && plain;

    uint8_t *exact = malloc(f.size ? f.size : 1); /* so that the address sanitizer sees a read past the end */
    MUST(exact, "memory");
    memcpy(exact, f.bytes, f.size);
    def.bytes = exact;
    def.size = f.size;
    sadmm_test_fail_allocations_after(allocations);
    sadmm_status status = sadmm_mesh_file_read(&def, &mesh);
    sadmm_test_fail_allocations_after(-1);
    if (status == SADMM_OK) {
        check_mesh(mesh, &def);
        if (good) check_cube(mesh, &def);
        if (one_input_in(data, size, 64)) MUST(read_path(&f, def, &again) == SADMM_OK, "%s", sadmm_last_message());
        else MUST(sadmm_mesh_file_read(&def, &again) == SADMM_OK, "%s", sadmm_last_message());
        must_be_the_same(mesh, again);
    } else {
        MUST(!good, "%s", sadmm_last_message());
        MUST(status > SADMM_OK && status < SADMM_STATUS_COUNT && status != SADMM_ERROR_IO && !mesh, "status %d",
             (int)status);
        MUST(status != SADMM_ERROR_OUT_OF_MEMORY || allocations >= 0, "%s", sadmm_last_message());
        MUST(sadmm_last_message()[0], "%s without a message", sadmm_status_name(status));
    }
    sadmm_mesh_file_destroy(mesh);
    sadmm_mesh_file_destroy(again);
    free(exact);
    return 0;
}
