/* FCLIB files: what is read, what is written, what is refused.
 *
 * Files are written and read here with plain HDF5 calls from dense matrices, so that the module under test never checks
 * itself. One file: reading, writing and refusing share these calls and the sample made with them.
 */
#include <check.h>
#include <hdf5.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/memory.h"
#include "core/math/vec3.h"
#include "fclib/fclib.h"
#include "fixed_work.h"
#include "public_problems.h"
#include "scenes/scenes.h"

/* ---- files of the test ------------------------------------------------------------------------------------------- */

static char folder[64];

static const char *path_of(const char *name)
{
    static char paths[4][128];
    static int next;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static void make_folder(void)
{
    strcpy(folder, "/tmp/test_fclib_XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
}

static void remove_folder(void)
{
    char command[128];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    ck_assert_int_eq(system(command), 0);
    ck_assert_int_eq(H5Fget_obj_count((hid_t)H5F_OBJ_ALL, H5F_OBJ_ALL),
                     0); /* whatever happened, nothing is left open */
}

static char *read_file(const char *path, long *size)
{
    FILE *file = fopen(path, "rb");
    ck_assert_ptr_nonnull(file);
    fseek(file, 0, SEEK_END);
    *size = ftell(file);
    rewind(file);
    char *data = malloc((size_t)*size);
    ck_assert_ptr_nonnull(data);
    ck_assert_int_eq((long)fread(data, 1, (size_t)*size, file), *size);
    fclose(file);
    return data;
}

static void write_file(const char *path, const char *data, long size)
{
    FILE *file = fopen(path, "wb");
    ck_assert_ptr_nonnull(file);
    ck_assert_int_eq((long)fwrite(data, 1, (size_t)size, file), size);
    fclose(file);
}

/* ---- plain HDF5 -------------------------------------------------------------------------------------------------- */

static void put(hid_t file, const char *name, hid_t type, hid_t memory, hsize_t count, const void *data)
{
    hid_t links = H5Pcreate(H5P_LINK_CREATE), space = H5Screate_simple(1, &count, NULL);
    H5Pset_create_intermediate_group(links, 1);
    hid_t set = H5Dcreate2(file, name, type, space, links, H5P_DEFAULT, H5P_DEFAULT);
    ck_assert_int_ge(set, 0);
    if (count) ck_assert_int_ge(H5Dwrite(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), 0);
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(links);
}

static void put_ints(hid_t file, const char *name, int count, const int *data)
{
    put(file, name, H5T_STD_I32LE, H5T_NATIVE_INT, (hsize_t)count, data);
}

static void put_int(hid_t file, const char *name, int value) { put_ints(file, name, 1, &value); }

static void put_reals(hid_t file, const char *name, int count, const double *data)
{
    put(file, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, (hsize_t)count, data);
}

static void *get(hid_t file, const char *name, hid_t memory, size_t size, int *count)
{
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    ck_assert_msg(set >= 0, "%s is missing", name);
    hid_t space = H5Dget_space(set);
    *count = (int)H5Sget_simple_extent_npoints(space);
    void *data = calloc((size_t)*count + 1, size);
    ck_assert_ptr_nonnull(data);
    if (*count) ck_assert_int_ge(H5Dread(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), 0);
    H5Sclose(space);
    H5Dclose(set);
    return data;
}

static int get_int(hid_t file, const char *name)
{
    int count, *data = get(file, name, H5T_NATIVE_INT, sizeof *data, &count), value = data[0];
    ck_assert_int_eq(count, 1);
    free(data);
    return value;
}

static double *get_reals(hid_t file, const char *name, int expected)
{
    int count;
    double *data = get(file, name, H5T_NATIVE_DOUBLE, sizeof *data, &count);
    ck_assert_msg(count == expected, "%s holds %d, %d expected", name, count, expected);
    return data;
}

/* ---- dense matrices and their sparse forms ----------------------------------------------------------------------- */

enum format { TRIPLET = 0, COLUMNS = -1, ROWS = -2 };

/* `slack` unused places at the end, as CSparse leaves them. */
static void put_matrix(hid_t file, const char *group, const double *dense, int m, int n, enum format format, int slack)
{
    char name[64];
    int most = 2 * m * n + slack, count = 0, lines = format == ROWS ? m : n;
    int *p = calloc((size_t)(most + lines + 2), sizeof *p), *i = calloc((size_t)most + 1, sizeof *i);
    double *x = calloc((size_t)most + 1, sizeof *x);
    if (format == TRIPLET) {
        /* Backwards, every other entry in two halves: order and duplicates must not matter. */
        for (int e = m * n - 1; e >= 0; --e) {
            int pieces = dense[e] == 0 ? 0 : 1 + e % 2;
            for (int k = 0; k < pieces; ++k, ++count) i[count] = e / n, p[count] = e % n, x[count] = dense[e] / pieces;
        }
    } else {
        for (int line = 0; line < lines; ++line) {
            for (int k = 0; k < (format == ROWS ? n : m); ++k) {
                double value = format == ROWS ? dense[line * n + k] : dense[k * n + line];
                if (value != 0) i[count] = k, x[count++] = value;
            }
            p[line + 1] = count;
        }
    }
    snprintf(name, sizeof name, "%s/m", group), put_int(file, name, m);
    snprintf(name, sizeof name, "%s/n", group), put_int(file, name, n);
    snprintf(name, sizeof name, "%s/nz", group), put_int(file, name, format == TRIPLET ? count : (int)format);
    snprintf(name, sizeof name, "%s/nzmax", group), put_int(file, name, count + slack);
    snprintf(name, sizeof name, "%s/p", group), put_ints(file, name, format == TRIPLET ? count : lines + 1, p);
    snprintf(name, sizeof name, "%s/i", group), put_ints(file, name, format == TRIPLET ? count : count + slack, i);
    snprintf(name, sizeof name, "%s/x", group), put_reals(file, name, count + slack, x);
    free(p);
    free(i);
    free(x);
}

/* Triplets only: what the module writes. */
static double *get_matrix(hid_t file, const char *group, int m, int n)
{
    char name[64];
    int count;
    snprintf(name, sizeof name, "%s/m", group);
    ck_assert_int_eq(get_int(file, name), m);
    snprintf(name, sizeof name, "%s/n", group);
    ck_assert_int_eq(get_int(file, name), n);
    snprintf(name, sizeof name, "%s/nz", group);
    int nz = get_int(file, name);
    snprintf(name, sizeof name, "%s/nzmax", group);
    ck_assert_int_ge(get_int(file, name), nz);
    snprintf(name, sizeof name, "%s/p", group);
    int *p = get(file, name, H5T_NATIVE_INT, sizeof *p, &count);
    ck_assert_int_eq(count, nz);
    snprintf(name, sizeof name, "%s/i", group);
    int *i = get(file, name, H5T_NATIVE_INT, sizeof *i, &count);
    ck_assert_int_eq(count, nz);
    snprintf(name, sizeof name, "%s/x", group);
    double *x = get_reals(file, name, nz), *dense = calloc((size_t)(m * n + 1), sizeof *dense);
    for (int e = 0; e < nz; ++e) dense[i[e] * n + p[e]] += x[e];
    free(p);
    free(i);
    free(x);
    return dense;
}

/* ---- the sample: 3 bodies, 2 contacts, 10 bilateral rows --------------------------------------------------------- */

enum { DOFS = 18, CONTACTS = 2, HARD = 10 };

struct sample {
    double M[DOFS * DOFS], H[DOFS * 3 * CONTACTS], G[DOFS * HARD];
    double f[DOFS], w[3 * CONTACTS], mu[CONTACTS], b[HARD];
};

/* Bodies of the columns: contact 0: world and 1; contact 1: 2 and 0; rows 0-2 of G: 0 and 1; rows 3-9: 1 and 2. */
static struct sample make_sample(void)
{
    struct sample s;
    memset(&s, 0, sizeof s);
    double next = 0.125; /* numbers that halve exactly */
    for (int body = 0; body < 3; ++body)
        for (int r = 0; r < 6; ++r)
            for (int c = 0; c <= r; ++c) {
                double value = r == c ? 4 + body + r / 8.0 : (next = -next * 1.125, fmod(next, 0.5));
                s.M[(6 * body + r) * DOFS + 6 * body + c] = s.M[(6 * body + c) * DOFS + 6 * body + r] = value;
            }
    const int touched[CONTACTS][2] = {{1, 1}, {2, 0}};
    for (int column = 0; column < 3 * CONTACTS; ++column)
        for (int side = 0; side < 2; ++side)
            for (int r = 0; r < 6; ++r)
                s.H[(6 * touched[column / 3][side] + r) * 3 * CONTACTS + column] = 1 + column + side / 4.0 + r / 16.0;
    for (int column = 0; column < HARD; ++column)
        for (int side = 0; side < 2; ++side)
            for (int r = 0; r < 6; ++r)
                s.G[(6 * (side + (column >= 3)) + r) * HARD + column] = -1 - column - side / 4.0 - r / 16.0;
    for (int k = 0; k < DOFS; ++k) s.f[k] = 0.25 * k - 2;
    for (int k = 0; k < 3 * CONTACTS; ++k) s.w[k] = 0.5 - k;
    for (int k = 0; k < CONTACTS; ++k) s.mu[k] = 0.25 + k;
    for (int k = 0; k < HARD; ++k) s.b[k] = 1.5 * k;
    return s;
}

static void put_sample(const char *path, const struct sample *s, enum format M, enum format H, enum format G, int slack)
{
    hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    ck_assert_int_ge(file, 0);
    put_int(file, "/fclib_global/spacedim", 3);
    put_matrix(file, "/fclib_global/M", s->M, DOFS, DOFS, M, slack);
    put_matrix(file, "/fclib_global/H", s->H, DOFS, 3 * CONTACTS, H, slack);
    put_matrix(file, "/fclib_global/G", s->G, DOFS, HARD, G, slack);
    put_reals(file, "/fclib_global/vectors/f", DOFS, s->f);
    put_reals(file, "/fclib_global/vectors/w", 3 * CONTACTS, s->w);
    put_reals(file, "/fclib_global/vectors/mu", CONTACTS, s->mu);
    put_reals(file, "/fclib_global/vectors/b", HARD, s->b);
    put_reals(file, "/guesses/1/v", DOFS, s->f); /* something else, to be kept */
    H5Fclose(file);
}

static sadmm_problem *load(const char *path)
{
    sadmm_problem *problem;
    struct sadmm_error error = {0};
    ck_assert_msg(sadmm_fclib_load(path, &problem, &error) == SADMM_OK, "%s", error.message);
    return problem;
}

static void expect_sample_bodies(sadmm_problem *problem, const struct sample *s)
{
    double A[3 * 36], b[DOFS];
    ck_assert_int_eq(sadmm_problem_body_count(problem), 3);
    ck_assert_int_eq(sadmm_problem_get_bodies(problem, A, b, NULL), SADMM_OK);
    for (int body = 0; body < 3; ++body)
        for (int r = 0; r < 6; ++r)
            for (int c = 0; c < 6; ++c)
                ck_assert_double_eq(A[36 * body + 6 * r + c], s->M[(6 * body + r) * DOFS + 6 * body + c]);
    ck_assert_mem_eq(b, s->f, sizeof b);
}

/* Block `index`: `rows` columns of `matrix` (n wide) from `first` on, between bodies a < b. */
static void expect_block(sadmm_problem *problem, int index, sadmm_block_kind kind, const double *matrix, int n,
                         int first, int rows, int a, int b, const double *e)
{
    sadmm_problem_block block;
    ck_assert_int_eq(sadmm_problem_get_block(problem, index, &block), SADMM_OK);
    ck_assert_int_eq(block.kind, kind);
    ck_assert_int_eq(block.rows, rows);
    ck_assert_int_eq(block.body_a, a);
    ck_assert_int_eq(block.body_b, b);
    ck_assert_mem_eq(block.error, e + first, (size_t)rows * sizeof *e);
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < 6; ++c) {
            if (a >= 0) ck_assert_double_eq(block.jacobian_a[6 * r + c], matrix[(6 * a + c) * n + first + r]);
            ck_assert_double_eq(block.jacobian_b[6 * r + c], matrix[(6 * b + c) * n + first + r]);
        }
}

/* Every sparse form, alone and mixed, with and without unused places, gives the same problem, number for number. */
START_TEST(reads_all_formats)
{
    static const enum format formats[][3] = {
        {TRIPLET, TRIPLET, TRIPLET}, {COLUMNS, COLUMNS, COLUMNS}, {ROWS, ROWS, ROWS}, {TRIPLET, COLUMNS, ROWS},
    };
    struct sample s = make_sample();
    const char *path = path_of("sample.hdf5");
    put_sample(path, &s, formats[_i / 2][0], formats[_i / 2][1], formats[_i / 2][2], _i % 2 ? 7 : 0);
    sadmm_problem *problem = load(path);
    expect_sample_bodies(problem, &s);
    ck_assert_int_eq(sadmm_problem_contact_count(problem), 0);
    ck_assert_int_eq(sadmm_problem_block_count(problem), 5);
    expect_block(problem, 0, SADMM_BLOCK_CONTACT, s.H, 6, 0, 3, -1, 1, s.w);
    expect_block(problem, 1, SADMM_BLOCK_CONTACT, s.H, 6, 3, 3, 0, 2, s.w);
    expect_block(problem, 2, SADMM_BLOCK_HARD, s.G, HARD, 0, 3, 0, 1, s.b);
    expect_block(problem, 3, SADMM_BLOCK_HARD, s.G, HARD, 3, 6, 1, 2, s.b);
    expect_block(problem, 4, SADMM_BLOCK_HARD, s.G, HARD, 9, 1, 1, 2, s.b);
    for (int k = 0; k < CONTACTS; ++k) {
        sadmm_problem_block block;
        ck_assert_int_eq(sadmm_problem_get_block(problem, k, &block), SADMM_OK);
        ck_assert_double_eq(block.friction, s.mu[k]);
    }
    sadmm_problem_destroy(problem);
}
END_TEST

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static void save(sadmm_problem *problem, const char *path)
{
    struct sadmm_error error = {0};
    ck_assert_msg(sadmm_fclib_save(problem, path, "a title", &error) == SADMM_OK, "%s", error.message);
}

/* The column of a contact direction d on one body: sign (d, arm x d). */
static void expect_column(const double *H, int n, int column, int body, vec3 d, const double arm[3], double sign)
{
    vec3 m = v3_cross(v3_load(arm), d);
    const double expected[6] = {d.x, d.y, d.z, m.x, m.y, m.z};
    for (int r = 0; body >= 0 && r < 6; ++r)
        ck_assert_double_eq(H[(6 * body + r) * n + column], sign * expected[r]);
}

static void expect_contact(const double *H, int n, int column, const sadmm_problem_contact *c)
{
    vec3 d[3] = {v3_load(c->normal)};
    v3_tangents(d[0], &d[1], &d[2]);
    for (int r = 0; r < 3; ++r) {
        expect_column(H, n, column + r, c->body_a, d[r], c->arm_a, -1);
        expect_column(H, n, column + r, c->body_b, d[r], c->arm_b, 1);
    }
}

enum {
    RANDOM_BODIES = 6,
    RANDOM_CONTACTS = 9,
    RANDOM_BLOCKS = 4,
    RANDOM_JOINTS = 6,
    RANDOM_HARD = 1 + 2 + 3 + 4 + 5 + 6
};

static sadmm_problem *random_problem(void)
{
    return public_problem_random(5, RANDOM_BODIES, RANDOM_CONTACTS, RANDOM_BLOCKS, RANDOM_JOINTS, 0.4);
}

START_TEST(writes_the_layout)
{
    enum { N = 6 * RANDOM_BODIES, C = 3 * (RANDOM_CONTACTS + RANDOM_BLOCKS) };
    const char *path = path_of("written.hdf5");
    sadmm_problem *problem = random_problem();
    double A[36 * RANDOM_BODIES], b[N];
    save(problem, path);
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    ck_assert_int_eq(get_int(file, "/fclib_global/spacedim"), 3);
    double *M = get_matrix(file, "/fclib_global/M", N, N), *H = get_matrix(file, "/fclib_global/H", N, C);
    double *G = get_matrix(file, "/fclib_global/G", N, RANDOM_HARD);
    double *f = get_reals(file, "/fclib_global/vectors/f", N), *w = get_reals(file, "/fclib_global/vectors/w", C);
    double *mu = get_reals(file, "/fclib_global/vectors/mu", C / 3);
    double *hard = get_reals(file, "/fclib_global/vectors/b", RANDOM_HARD);

    ck_assert_int_eq(sadmm_problem_get_bodies(problem, A, b, NULL), SADMM_OK);
    ck_assert_mem_eq(f, b, sizeof b);
    for (int r = 0; r < N; ++r)
        for (int c = 0; c < N; ++c)
            ck_assert_double_eq(M[r * N + c], r / 6 == c / 6 ? A[36 * (r / 6) + 6 * (r % 6) + c % 6] : 0);
    for (int k = 0; k < RANDOM_CONTACTS; ++k) {
        sadmm_problem_contact c;
        ck_assert_int_eq(sadmm_problem_get_contact(problem, k, &c), SADMM_OK);
        expect_contact(H, C, 3 * k, &c);
        ck_assert_double_eq(w[3 * k], c.error);
        ck_assert_double_eq(w[3 * k + 1], 0);
        ck_assert_double_eq(w[3 * k + 2], 0);
        ck_assert_double_eq(mu[k], c.friction);
    }
    int row = 0;
    for (int k = 0; k < RANDOM_BLOCKS + RANDOM_JOINTS; ++k) {
        sadmm_problem_block block;
        ck_assert_int_eq(sadmm_problem_get_block(problem, k, &block), SADMM_OK);
        bool contact = block.kind == SADMM_BLOCK_CONTACT;
        int n = contact ? C : RANDOM_HARD, first = contact ? 3 * (RANDOM_CONTACTS + k) : row;
        for (int r = 0; r < block.rows; ++r) {
            ck_assert_double_eq(contact ? w[first + r] : hard[first + r], block.error[r]);
            for (int c = 0; c < 6; ++c) {
                const double *at = contact ? H : G;
                if (block.body_a >= 0)
                    ck_assert_double_eq(at[(6 * block.body_a + c) * n + first + r], block.jacobian_a[6 * r + c]);
                if (block.body_b >= 0)
                    ck_assert_double_eq(at[(6 * block.body_b + c) * n + first + r], block.jacobian_b[6 * r + c]);
            }
        }
        if (!contact) row += block.rows;
    }
    int count;
    hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, 64);
    char *title = get(file, "/fclib_global/info/title", text, 64, &count);
    H5Tclose(text);
    ck_assert_str_eq(title, "a title");
    H5Fclose(file);
    free(M), free(H), free(G), free(f), free(w), free(mu), free(hard), free(title);
    sadmm_problem_destroy(problem);
}
END_TEST

static void expect_same_problem(sadmm_problem *p, sadmm_problem *q)
{
    double A[2][36 * RANDOM_BODIES] = {{0}}, b[2][6 * RANDOM_BODIES] = {{0}};
    ck_assert_int_eq(sadmm_problem_body_count(p), sadmm_problem_body_count(q));
    ck_assert_int_eq(sadmm_problem_contact_count(p), sadmm_problem_contact_count(q));
    ck_assert_int_eq(sadmm_problem_block_count(p), sadmm_problem_block_count(q));
    ck_assert_int_eq(sadmm_problem_get_bodies(p, A[0], b[0], NULL), SADMM_OK);
    ck_assert_int_eq(sadmm_problem_get_bodies(q, A[1], b[1], NULL), SADMM_OK);
    ck_assert_mem_eq(A[0], A[1], sizeof A[0]);
    ck_assert_mem_eq(b[0], b[1], sizeof b[0]);
    for (int k = 0; k < sadmm_problem_block_count(p); ++k) {
        sadmm_problem_block x, y;
        ck_assert_int_eq(sadmm_problem_get_block(p, k, &x), SADMM_OK);
        ck_assert_int_eq(sadmm_problem_get_block(q, k, &y), SADMM_OK);
        ck_assert_int_eq(x.kind, y.kind);
        ck_assert_int_eq(x.rows, y.rows);
        ck_assert_int_eq(x.body_a, y.body_a);
        ck_assert_int_eq(x.body_b, y.body_b);
        ck_assert_double_eq(x.friction, y.friction);
        ck_assert_mem_eq(x.error, y.error, sizeof x.error);
        ck_assert_mem_eq(x.jacobian_a, y.jacobian_a, sizeof x.jacobian_a);
        ck_assert_mem_eq(x.jacobian_b, y.jacobian_b, sizeof x.jacobian_b);
    }
}

/* Once in the form of a file, a problem comes back identical. */
START_TEST(comes_back_identical)
{
    sadmm_problem *problem = random_problem();
    save(problem, path_of("a.hdf5"));
    sadmm_problem *first = load(path_of("a.hdf5"));
    ck_assert_int_eq(sadmm_problem_block_count(first), RANDOM_CONTACTS + RANDOM_BLOCKS + RANDOM_JOINTS);
    save(first, path_of("a.hdf5")); /* over the old one */
    sadmm_problem *second = load(path_of("a.hdf5"));
    expect_same_problem(first, second);
    sadmm_problem_destroy(problem);
    sadmm_problem_destroy(first);
    sadmm_problem_destroy(second);
}
END_TEST

/* Bodies without contacts, and no contacts at all. */
START_TEST(writes_free_bodies)
{
    sadmm_problem *problem = public_problem_random(3, 4, 0, 0, 0, 0);
    save(problem, path_of("free.hdf5"));
    sadmm_problem *back = load(path_of("free.hdf5"));
    expect_same_problem(problem, back);
    sadmm_problem_destroy(problem);
    sadmm_problem_destroy(back);
}
END_TEST

START_TEST(refuses_to_write)
{
    struct sadmm_error error = {0};
    sadmm_problem *problem = public_problem_random(3, 4, 1, 0, 0, 0);
    sadmm_problem_block soft = {.kind = SADMM_BLOCK_SOFT, .rows = 1, .body_a = -1, .body_b = 0, .jacobian_b = {1},
                                .stiffness = {1}};
    ck_assert_int_eq(sadmm_fclib_save(problem, path_of("no/such/folder/x.hdf5"), NULL, &error), SADMM_ERROR_IO);
    ck_assert_int_eq(sadmm_fclib_save(problem, folder, NULL, &error), SADMM_ERROR_IO);
    ck_assert_int_eq(sadmm_fclib_save(problem, "/dev/null", NULL, &error), SADMM_ERROR_IO);
    ck_assert_int_eq(sadmm_fclib_save(NULL, path_of("x.hdf5"), NULL, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_fclib_save(problem, NULL, NULL, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_problem_set_blocks(problem, 1, &soft, NULL), SADMM_OK);
    ck_assert_int_eq(sadmm_fclib_save(problem, path_of("x.hdf5"), NULL, &error), SADMM_ERROR_UNSUPPORTED);
    ck_assert_ptr_nonnull(strstr(error.message, "soft"));
    ck_assert_int_ne(access(path_of("x.hdf5"), F_OK), 0);
    sadmm_problem_destroy(problem);
}
END_TEST

/* ---- solutions --------------------------------------------------------------------------------------------------- */

static void solve(sadmm_problem *problem, double tolerance)
{
    sadmm_settings s = fixed_settings();
    sadmm_certificate c = {.siconos = INFINITY};
    s.dt = 1;
    s.method = SADMM_METHOD_PAPER; /* the penalty below suits problems that are scaled to masses of 1 */
    s.penalty_mass_factor = 0;
    s.penalty_offset = 1;
    s.iterations = 200;
    for (int k = 0; k < 500 && !(c.siconos <= tolerance); ++k) {
        s.warm_start = k > 0;
        ck_assert_msg(sadmm_problem_solve(problem, SADMM_BACKEND_REF, SADMM_F64, &s, NULL) == SADMM_OK, "%s",
                      sadmm_problem_message(problem));
        ck_assert_int_eq(sadmm_problem_certify(problem, &c), SADMM_OK);
    }
    ck_assert_msg(c.siconos <= tolerance, "measure %g", c.siconos);
}

/* The equations of the layout hold between the datasets of the file: u = H^T v + w (same sums in another order: 1e-13)
 * and M v = H r + G l + f, G^T v + b = 0 (to the tolerance of the solve, 1e-9 relative, numbers of order 1). */
static void expect_solution(const char *path, int bodies, int contacts, int hard)
{
    int n = 6 * bodies, c = 3 * contacts;
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    ck_assert_int_ge(file, 0);
    double *M = get_matrix(file, "/fclib_global/M", n, n), *H = get_matrix(file, "/fclib_global/H", n, c);
    double *G = hard ? get_matrix(file, "/fclib_global/G", n, hard) : NULL;
    double *f = get_reals(file, "/fclib_global/vectors/f", n), *w = get_reals(file, "/fclib_global/vectors/w", c);
    double *b = hard ? get_reals(file, "/fclib_global/vectors/b", hard) : NULL;
    double *v = get_reals(file, "/solution/v", n), *u = get_reals(file, "/solution/u", c);
    double *r = get_reals(file, "/solution/r", c), *l = hard ? get_reals(file, "/solution/l", hard) : NULL;
    for (int k = 0; k < n; ++k) {
        double sum = -f[k];
        for (int j = 0; j < n; ++j) sum += M[k * n + j] * v[j];
        for (int j = 0; j < c; ++j) sum -= H[k * c + j] * r[j];
        for (int j = 0; j < hard; ++j) sum -= G[k * hard + j] * l[j];
        ck_assert_double_le(fabs(sum), 1e-7);
    }
    for (int k = 0; k < c; ++k) {
        double sum = w[k];
        for (int j = 0; j < n; ++j) sum += H[j * c + k] * v[j];
        ck_assert_double_le(fabs(sum - u[k]), 1e-13);
        if (k % 3 == 0) ck_assert_double_ge(r[k], 0);
    }
    for (int k = 0; k < hard; ++k) {
        double sum = b[k];
        for (int j = 0; j < n; ++j) sum += G[j * hard + k] * v[j];
        ck_assert_double_le(fabs(sum), 1e-7);
    }
    free(M), free(H), free(G), free(f), free(w), free(b), free(v), free(u), free(r), free(l);
    H5Fclose(file);
}

static int files_in_folder(void)
{
    char command[128], text[16] = "";
    snprintf(command, sizeof command, "ls -A %s | wc -l", folder);
    FILE *pipe = popen(command, "r");
    ck_assert_ptr_nonnull(fgets(text, sizeof text, pipe));
    pclose(pipe);
    return atoi(text);
}

START_TEST(writes_solutions)
{
    struct sadmm_error error = {0};
    /* few joints, so that none is redundant */
    sadmm_problem *original = public_problem_random(11, 8, 4, 2, 2, 0.4);
    save(original, path_of("p.hdf5"));
    sadmm_problem *problem = load(path_of("p.hdf5"));
    solve(problem, 1e-9);
    solve(original, 1e-9);

    /* a copy; a copy over a file with another solution; a new file, from geometry */
    ck_assert_int_eq(sadmm_fclib_save_solution(problem, path_of("p.hdf5"), path_of("copy.hdf5"), &error), SADMM_OK);
    ck_assert_int_eq(sadmm_fclib_save_solution(original, NULL, path_of("new.hdf5"), &error), SADMM_OK);
    ck_assert_int_eq(sadmm_fclib_save_solution(problem, path_of("copy.hdf5"), path_of("again.hdf5"), &error), SADMM_OK);
    ck_assert_int_eq(sadmm_fclib_save_solution(problem, path_of("p.hdf5"), path_of("again.hdf5"), &error), SADMM_OK);
    ck_assert_int_eq(sadmm_fclib_save_solution(problem, path_of("again.hdf5"), path_of("copy.hdf5"), &error), SADMM_OK);
    expect_solution(path_of("copy.hdf5"), 8, 6, 3 + 4);
    expect_solution(path_of("again.hdf5"), 8, 6, 3 + 4);
    expect_solution(path_of("new.hdf5"), 8, 6, 3 + 4);
    hid_t file = H5Fopen(path_of("copy.hdf5"), H5F_ACC_RDONLY, H5P_DEFAULT);
    ck_assert_int_gt(H5Lexists(file, "/fclib_global/info", H5P_DEFAULT), 0); /* the rest is kept */
    H5Fclose(file);

    /* another problem's file */
    sadmm_problem *other = public_problem_random(1, 2, 1, 0, 0, 0.4);
    ck_assert_int_eq(sadmm_fclib_save_solution(other, path_of("p.hdf5"), path_of("bad.hdf5"), &error), SADMM_ERROR_IO);
    ck_assert_int_eq(sadmm_fclib_save_solution(problem, path_of("none.hdf5"), path_of("bad.hdf5"), &error),
                     SADMM_ERROR_IO);
    /* a file onto itself, by another name: it stays */
    ck_assert_int_eq(link(path_of("p.hdf5"), path_of("link.hdf5")), 0);
    ck_assert_int_eq(sadmm_fclib_save_solution(problem, path_of("p.hdf5"), path_of("link.hdf5"), &error),
                     SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "must be another file"));
    sadmm_problem_destroy(load(path_of("link.hdf5")));
    ck_assert_int_eq(files_in_folder(), 5); /* and nothing half done is left */
    sadmm_problem_destroy(original);
    sadmm_problem_destroy(problem);
    sadmm_problem_destroy(other);
}
END_TEST

/* A step of a world, frozen, written, read: the same solution. v is unique and both are solved to 1e-10 of siconos'
 * measure, against velocities of dt g = 0.05 m/s: 1e-7 m/s leaves room for the conditioning of a small stack. */
START_TEST(world_to_file)
{
    struct sadmm_scene scene;
    struct sadmm_error error = {0};
    sadmm_world *world;
    sadmm_problem *frozen;
    ck_assert_msg(sadmm_scene_open("pyramid:3", &scene, &error) == SADMM_OK, "%s", error.message);
    scene.def.backend = SADMM_BACKEND_REF;
    ck_assert_msg(sadmm_scene_build(&scene, &world, &error) == SADMM_OK, "%s", error.message);
    for (int step = 0; step < 5; ++step) ck_assert_int_eq(sadmm_world_step(world), SADMM_OK);
    ck_assert_int_eq(sadmm_problem_create(&frozen), SADMM_OK);
    ck_assert_int_eq(sadmm_world_freeze(world, frozen), SADMM_OK);
    ck_assert_int_gt(sadmm_problem_contact_count(frozen), 0);
    save(frozen, path_of("frozen.hdf5"));
    sadmm_problem *read = load(path_of("frozen.hdf5"));
    ck_assert_int_eq(sadmm_problem_block_count(read), sadmm_problem_contact_count(frozen));
    solve(frozen, 1e-10);
    solve(read, 1e-10);
    size_t count = 6 * (size_t)sadmm_problem_body_count(frozen);
    double *v = calloc(2 * count, sizeof *v);
    ck_assert_int_eq(sadmm_problem_get_solution(frozen, v, NULL, NULL), SADMM_OK);
    ck_assert_int_eq(sadmm_problem_get_solution(read, v + count, NULL, NULL), SADMM_OK);
    for (size_t k = 0; k < count; ++k) ck_assert_double_le(fabs(v[k] - v[count + k]), 1e-7);
    free(v);
    sadmm_problem_destroy(frozen);
    sadmm_problem_destroy(read);
    sadmm_world_destroy(world);
}
END_TEST

static sadmm_problem *frozen_step(const char *spec, int steps)
{
    struct sadmm_scene scene;
    struct sadmm_error error = {0};
    sadmm_world *world;
    sadmm_problem *frozen;
    ck_assert_msg(sadmm_scene_open(spec, &scene, &error) == SADMM_OK, "%s", error.message);
    scene.def.backend = SADMM_BACKEND_CPU;
    ck_assert_msg(sadmm_scene_build(&scene, &world, &error) == SADMM_OK, "%s", error.message);
    for (int step = 0; step < steps; ++step) ck_assert_int_eq(sadmm_world_step(world), SADMM_OK);
    ck_assert_int_eq(sadmm_problem_create(&frozen), SADMM_OK);
    ck_assert_int_eq(sadmm_world_freeze(world, frozen), SADMM_OK);
    sadmm_world_destroy(world);
    return frozen;
}

/* Locks of a world's joints are G and b, M v = f + G r, G^T v + b = 0: 7 hinges of two four-bar linkages, 5 rows each.
 * They come back as they were, and so does the solution; 1e-7 m/s: as above. Drives have no place in such a file:
 * refused, by the constraint that has one. */
START_TEST(joints_to_file)
{
    enum { BODIES = 5, N = 6 * BODIES, JOINTS = 7, ROWS = 5 * JOINTS };
    struct sadmm_error error = {0};
    sadmm_problem *frozen = frozen_step("four_bar:2", 20), *driven = frozen_step("slider_crank", 5);
    double v[N], lambda[6 * JOINTS];
    save(frozen, path_of("joints.hdf5"));
    hid_t file = H5Fopen(path_of("joints.hdf5"), H5F_ACC_RDONLY, H5P_DEFAULT);
    double *G = get_matrix(file, "/fclib_global/G", N, ROWS), *b = get_reals(file, "/fclib_global/vectors/b", ROWS);
    H5Fclose(file);
    sadmm_problem *read = load(path_of("joints.hdf5"));
    ck_assert_int_eq(sadmm_problem_block_count(frozen), JOINTS);
    ck_assert_int_eq(sadmm_problem_block_count(read), JOINTS);
    for (int k = 0; k < JOINTS; ++k) {
        sadmm_problem_block blocks[2];
        ck_assert_int_eq(sadmm_problem_get_block(frozen, k, &blocks[0]), SADMM_OK);
        ck_assert_int_eq(sadmm_problem_get_block(read, k, &blocks[1]), SADMM_OK);
        ck_assert(blocks[0].kind == SADMM_BLOCK_HARD && blocks[1].kind == SADMM_BLOCK_HARD && blocks[1].rows == 5);
        ck_assert_mem_eq(blocks[0].error, blocks[1].error, sizeof blocks[0].error);
        ck_assert_mem_eq(blocks[0].error, b + 5 * k, 5 * sizeof *b);
    }
    solve(read, 1e-10);
    solve(frozen, 1e-10);
    ck_assert_int_eq(sadmm_problem_get_solution(read, v, NULL, lambda), SADMM_OK);
    for (int r = 0; r < ROWS; ++r) { /* solved to 1e-10, below too; three digits for the problem's scale */
        double x = b[r];
        for (int k = 0; k < N; ++k) x += G[k * ROWS + r] * v[k];
        ck_assert_msg(fabs(x) < 1e-7, "row %d: %g", r, x);
    }
    double other[N];
    ck_assert_int_eq(sadmm_problem_get_solution(frozen, other, NULL, NULL), SADMM_OK);
    for (int k = 0; k < N; ++k) ck_assert_double_le(fabs(v[k] - other[k]), 1e-7);

    ck_assert_int_eq(sadmm_fclib_save(driven, path_of("driven.hdf5"), "driven", &error), SADMM_ERROR_UNSUPPORTED);
    ck_assert_msg(strstr(error.message, "block 0 has rows with bounds or springs") != NULL, "%s", error.message);
    free(G);
    free(b);
    sadmm_problem_destroy(frozen);
    sadmm_problem_destroy(driven);
    sadmm_problem_destroy(read);
}
END_TEST

/* ---- files that are refused -------------------------------------------------------------------------------------- */

static void drop(hid_t file, const char *name) { ck_assert_int_ge(H5Ldelete(file, name, H5P_DEFAULT), 0); }

static void replace_int(hid_t file, const char *name, int value)
{
    drop(file, name);
    put_int(file, name, value);
}

/* Change one number of a dataset. */
static void poke_int(hid_t file, const char *name, int at, int value)
{
    int count, *data = get(file, name, H5T_NATIVE_INT, sizeof *data, &count);
    data[at] = value;
    drop(file, name);
    put_ints(file, name, count, data);
    free(data);
}

static void poke_real(hid_t file, const char *name, int at, double value)
{
    int count;
    double *data = get(file, name, H5T_NATIVE_DOUBLE, sizeof *data, &count);
    data[at] = value;
    drop(file, name);
    put_reals(file, name, count, data);
    free(data);
}

#define MU "/fclib_global/vectors/mu"
static void no_group(hid_t f) { drop(f, "/fclib_global"); }
static void local_problem(hid_t f) { no_group(f), put_int(f, "/fclib_local/spacedim", 3); }
static void rolling_problem(hid_t f) { no_group(f), put_int(f, "/fclib_global_rolling/spacedim", 5); }
static void two_dimensions(hid_t f) { replace_int(f, "/fclib_global/spacedim", 2); }
static void four_dimensions(hid_t f) { replace_int(f, "/fclib_global/spacedim", 4); }
static void no_M(hid_t f) { drop(f, "/fclib_global/M"); }
static void no_x(hid_t f) { drop(f, "/fclib_global/H/x"); }
static void no_f(hid_t f) { drop(f, "/fclib_global/vectors/f"); }
static void no_b(hid_t f) { drop(f, "/fclib_global/vectors/b"); }
static void group_for_data(hid_t f) { drop(f, "/fclib_global/vectors/f"), put_int(f, "/fclib_global/vectors/f/x", 1); }
static void short_mu(hid_t f) { double x = 1; drop(f, MU), put_reals(f, MU, 1, &x); }
static void mu_of_ints(hid_t f) { int x[2] = {1, 1}; drop(f, MU), put_ints(f, MU, 2, x); }
static void p_of_reals(hid_t f)
{
    double x[7] = {0};
    drop(f, "/fclib_global/H/p"), put_reals(f, "/fclib_global/H/p", 7, x);
}
static void nan_mu(hid_t f) { poke_real(f, MU, 1, NAN); }
static void infinite_x(hid_t f) { poke_real(f, "/fclib_global/H/x", 3, -INFINITY); }
static void negative_mu(hid_t f) { poke_real(f, MU, 1, -0.5); }
static void bad_nz(hid_t f) { replace_int(f, "/fclib_global/H/nz", -3); }
static void huge_nz(hid_t f) { replace_int(f, "/fclib_global/M/nz", INT_MAX); }
static void negative_size(hid_t f) { replace_int(f, "/fclib_global/H/m", -6); }
static void huge_size(hid_t f) { replace_int(f, "/fclib_global/H/n", INT_MAX); }
static void big_square(hid_t f)
{
    replace_int(f, "/fclib_global/M/m", 2147483640), replace_int(f, "/fclib_global/M/n", 2147483640);
}
static void rows_differ(hid_t f) { replace_int(f, "/fclib_global/H/m", 24); }
static void not_square(hid_t f) { replace_int(f, "/fclib_global/M/n", 24); }
static void index_past_end(hid_t f) { poke_int(f, "/fclib_global/H/i", 5, DOFS); }
static void index_negative(hid_t f) { poke_int(f, "/fclib_global/H/i", 5, -1); }
static void pointers_start(hid_t f) { poke_int(f, "/fclib_global/H/p", 0, 1); }
static void pointers_decrease(hid_t f) { poke_int(f, "/fclib_global/H/p", 2, 1); }
static void pointers_past_end(hid_t f) { poke_int(f, "/fclib_global/H/p", 6, 1 << 20); }
static void couples_bodies(hid_t f) { poke_int(f, "/fclib_global/M/i", 0, 0); } /* this triplet is in the last column */
static void three_bodies(hid_t f) /* contact 0 acts on body 1; let it act on 2 and 0 too */
{
    poke_int(f, "/fclib_global/H/i", 0, 17);
    poke_int(f, "/fclib_global/H/i", 1, 0);
}
static void no_bodies(hid_t f) { for (int k = 0; k < 18; ++k) poke_real(f, "/fclib_global/H/x", k, 0); }
static void not_definite(hid_t f) { poke_real(f, "/fclib_global/M/x", 0, -1e6); }

static void dofs_not_six(hid_t f)
{
    const double mass[3] = {1, 1, 1}, zero[3] = {0, 0, 0};
    double M[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, H[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    no_group(f);
    put_int(f, "/fclib_global/spacedim", 3);
    put_matrix(f, "/fclib_global/M", M, 3, 3, TRIPLET, 0);
    put_matrix(f, "/fclib_global/H", H, 3, 3, TRIPLET, 0);
    put_reals(f, "/fclib_global/vectors/f", 3, mass);
    put_reals(f, "/fclib_global/vectors/w", 3, zero);
    put_reals(f, MU, 1, mass);
}

/* Datasets that promise more than the file holds. */
static void put_empty(hid_t file, const char *name, hsize_t count, bool chunked)
{
    hsize_t chunk = 1 << 16;
    hid_t space = H5Screate_simple(1, &count, NULL), list = H5Pcreate(H5P_DATASET_CREATE);
    if (chunked) H5Pset_chunk(list, 1, &chunk);
    drop(file, name);
    hid_t set = H5Dcreate2(file, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, list, H5P_DEFAULT);
    ck_assert_int_ge(set, 0);
    if (chunked) { /* one chunk is there */
        hsize_t first = 0, one = 1;
        double x = 1;
        hid_t memory = H5Screate_simple(1, &one, NULL);
        H5Sselect_hyperslab(space, H5S_SELECT_SET, &first, NULL, &one, NULL);
        ck_assert_int_ge(H5Dwrite(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, &x), 0);
        H5Sclose(memory);
    }
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(list);
}
static void unwritten(hid_t f) { put_empty(f, "/fclib_global/vectors/f", DOFS, false); }
static void terabytes(hid_t f) { put_empty(f, "/fclib_global/H/x", (hsize_t)1 << 40, true); }
static void terabytes_unwritten(hid_t f) { put_empty(f, "/fclib_global/H/x", (hsize_t)1 << 40, false); }

/* HDF5 unpacks whole chunks: one of 2 GB, of which 18 numbers are the dataset, packed to nothing. */
static void huge_chunk(hid_t f)
{
    const hsize_t count = DOFS, most = H5S_UNLIMITED, chunk = (hsize_t)1 << 28;
    hid_t space = H5Screate_simple(1, &count, &most), list = H5Pcreate(H5P_DATASET_CREATE);
    char packed[64] = {0}; /* what the chunk holds is never inspected */
    H5Pset_chunk(list, 1, &chunk);
    H5Pset_deflate(list, 9);
    drop(f, "/fclib_global/vectors/f");
    hid_t set = H5Dcreate2(f, "/fclib_global/vectors/f", H5T_IEEE_F64LE, space, H5P_DEFAULT, list, H5P_DEFAULT);
    ck_assert_int_ge(set, 0);
    const hsize_t first = 0;
    ck_assert_int_ge(H5Dwrite_chunk(set, H5P_DEFAULT, 0, &first, sizeof packed, packed), 0);
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(list);
}

/* Floating point numbers of 1 MB each. */
static void wide_numbers(hid_t f)
{
    const hsize_t count = CONTACTS;
    hid_t type = H5Tcopy(H5T_IEEE_F64LE), space = H5Screate_simple(1, &count, NULL);
    ck_assert_int_ge(H5Tset_size(type, 1 << 20), 0);
    drop(f, MU);
    hid_t set = H5Dcreate2(f, MU, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    ck_assert_int_ge(set, 0);
    char *data = calloc(CONTACTS, 1 << 20);
    ck_assert_int_ge(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data), 0);
    free(data);
    H5Dclose(set);
    H5Sclose(space);
    H5Tclose(type);
}

static void put_typed(hid_t f, hid_t type)
{
    const hsize_t count = CONTACTS;
    hid_t space = H5Screate_simple(1, &count, NULL);
    const char *const texts[CONTACTS] = {"0.5", "0.5"};
    drop(f, MU);
    hid_t set = H5Dcreate2(f, MU, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    ck_assert_int_ge(set, 0);
    ck_assert_int_ge(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, texts), 0);
    H5Dclose(set);
    H5Sclose(space);
}
static void strings(hid_t f)
{
    hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    put_typed(f, type);
    H5Tclose(type);
}
static void references(hid_t f) { put_typed(f, H5T_STD_REF_OBJ); }

/* Groups that hold each other and themselves. */
static void group_cycle(hid_t f)
{
    drop(f, "/fclib_global/vectors");
    H5Lcreate_hard(f, "/fclib_global", f, "/fclib_global/vectors", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_hard(f, "/", f, "/fclib_global/f", H5P_DEFAULT, H5P_DEFAULT);
}
static void soft_cycle(hid_t f)
{
    drop(f, "/fclib_global/M");
    H5Lcreate_soft("/fclib_global/N", f, "/fclib_global/M", H5P_DEFAULT, H5P_DEFAULT);
    H5Lcreate_soft("/fclib_global/M", f, "/fclib_global/N", H5P_DEFAULT, H5P_DEFAULT);
}

/* Vectors as long as the sizes say, packed to almost nothing; the matrices are next to empty. Before 60 GB of blocks
 * are asked for. */
static void put_zeros(hid_t f, const char *name, hsize_t count)
{
    hsize_t chunk = 1 << 20;
    hid_t space = H5Screate_simple(1, &count, NULL), list = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(list, 1, &chunk);
    H5Pset_deflate(list, 1);
    drop(f, name);
    hid_t set = H5Dcreate2(f, name, H5T_IEEE_F32LE, space, H5P_DEFAULT, list, H5P_DEFAULT);
    double *zeros = calloc(count, sizeof *zeros);
    ck_assert_int_ge(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, zeros), 0);
    free(zeros);
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(list);
}
enum { MANY = 1 << 22 };
static void many_hard_rows(hid_t f)
{
    const double one = 1;
    const int zero = 0;
    drop(f, "/fclib_global/G"), put_int(f, "/fclib_global/G/m", DOFS), put_int(f, "/fclib_global/G/n", MANY);
    put_int(f, "/fclib_global/G/nz", 1), put_ints(f, "/fclib_global/G/i", 1, &zero);
    put_ints(f, "/fclib_global/G/p", 1, &zero), put_reals(f, "/fclib_global/G/x", 1, &one);
    put_zeros(f, "/fclib_global/vectors/b", MANY);
}
static void few_contacts_in_H(hid_t f) { replace_int(f, "/fclib_global/H/nz", 0); }
static void few_entries_in_M(hid_t f) { replace_int(f, "/fclib_global/M/nz", 17); }

static void external_link(hid_t f)
{
    drop(f, "/fclib_global/vectors/f");
    H5Lcreate_external(path_of("sample2.hdf5"), "/fclib_global/vectors/f", f, "/fclib_global/vectors/f", H5P_DEFAULT,
                       H5P_DEFAULT);
}
static void external_group(hid_t f)
{
    drop(f, "/fclib_global/vectors");
    H5Lcreate_external(path_of("sample2.hdf5"), "/fclib_global/vectors", f, "/fclib_global/vectors", H5P_DEFAULT,
                       H5P_DEFAULT);
}
static void external_data(hid_t f)
{
    hsize_t count = DOFS;
    hid_t space = H5Screate_simple(1, &count, NULL), list = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(list, "/proc/self/environ", 0, DOFS * sizeof(double));
    drop(f, "/fclib_global/vectors/f");
    hid_t set = H5Dcreate2(f, "/fclib_global/vectors/f", H5T_IEEE_F64LE, space, H5P_DEFAULT, list, H5P_DEFAULT);
    ck_assert_int_ge(set, 0);
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(list);
}
static void dangling_link(hid_t f)
{
    drop(f, "/fclib_global/vectors/f");
    H5Lcreate_soft("/nowhere", f, "/fclib_global/vectors/f", H5P_DEFAULT, H5P_DEFAULT);
}
static void link_loop(hid_t f)
{
    drop(f, "/fclib_global/vectors/f");
    H5Lcreate_soft("/fclib_global/vectors/f", f, "/fclib_global/vectors/f", H5P_DEFAULT, H5P_DEFAULT);
}

static const struct {
    void (*spoil)(hid_t file);
    sadmm_status status;
    const char *says; /* part of the message */
} refusals[] = {
    {no_group, SADMM_ERROR_IO, "/fclib_global"},
    {local_problem, SADMM_ERROR_UNSUPPORTED, "local"},
    {rolling_problem, SADMM_ERROR_UNSUPPORTED, "rolling"},
    {two_dimensions, SADMM_ERROR_UNSUPPORTED, "spacedim = 2"},
    {four_dimensions, SADMM_ERROR_IO, "spacedim = 4"},
    {no_M, SADMM_ERROR_IO, "/fclib_global/M/m: missing"},
    {no_x, SADMM_ERROR_IO, "/fclib_global/H/x: missing"},
    {no_f, SADMM_ERROR_IO, "vectors/f: missing"},
    {no_b, SADMM_ERROR_IO, "vectors/b: missing"},
    {group_for_data, SADMM_ERROR_IO, "vectors/f"},
    {short_mu, SADMM_ERROR_IO, "holds 1 values, 2 expected"},
    {mu_of_ints, SADMM_ERROR_IO, "must hold floating point"},
    {p_of_reals, SADMM_ERROR_IO, "must hold integers"},
    {nan_mu, SADMM_ERROR_IO, "value 1 is nan"},
    {infinite_x, SADMM_ERROR_IO, "H/x: value 3 is -inf"},
    {negative_mu, SADMM_ERROR_INVALID_ARGUMENT, "-0.5"},
    {bad_nz, SADMM_ERROR_IO, "nz = -3"},
    {huge_nz, SADMM_ERROR_IO, "nz = 2147483647"},
    {negative_size, SADMM_ERROR_IO, "m = -6"},
    {huge_size, SADMM_ERROR_IO, "n = 2147483647"},
    {big_square, SADMM_ERROR_IO, "H has 18 rows, M has 2147483640"},
    {rows_differ, SADMM_ERROR_IO, "H has 24 rows, M has 18"},
    {not_square, SADMM_ERROR_IO, "must be square"},
    {index_past_end, SADMM_ERROR_IO, "outside"},
    {index_negative, SADMM_ERROR_IO, "outside"},
    {pointers_start, SADMM_ERROR_IO, "starts with 1"},
    {pointers_decrease, SADMM_ERROR_IO, "H/p"},
    {pointers_past_end, SADMM_ERROR_IO, "H/p"},
    {couples_bodies, SADMM_ERROR_UNSUPPORTED, "not block diagonal: entry (0, 17) couples bodies 0 and 2"},
    {three_bodies, SADMM_ERROR_UNSUPPORTED, "more than two bodies"},
    {no_bodies, SADMM_ERROR_UNSUPPORTED, "contact 0 (in H) acts on no body"},
    {not_definite, SADMM_ERROR_INVALID_ARGUMENT, "A[2]"},
    {dofs_not_six, SADMM_ERROR_UNSUPPORTED, "multiple of 6"},
    {unwritten, SADMM_ERROR_IO, "only 0 bytes"},
    {terabytes, SADMM_ERROR_IO, "announces 1099511627776 values"},
    {terabytes_unwritten, SADMM_ERROR_IO, "announces 1099511627776 values"},
    {huge_chunk, SADMM_ERROR_IO, "vectors/f: announces 268435456 values, but only 64 bytes"},
    {wide_numbers, SADMM_ERROR_IO, "vectors/mu: numbers of 1048576 bytes: must be of 16 at most"},
    {strings, SADMM_ERROR_IO, "vectors/mu: must hold floating point"},
    {references, SADMM_ERROR_IO, "vectors/mu: must hold floating point"},
    {group_cycle, SADMM_ERROR_IO, "vectors/f: cannot open as a dataset"},
    {soft_cycle, SADMM_ERROR_IO, "/fclib_global/M/m: missing"},
    {many_hard_rows, SADMM_ERROR_UNSUPPORTED, "G has 1 entries that are not 0, in 4194304 columns"},
    {few_contacts_in_H, SADMM_ERROR_UNSUPPORTED, "H has 0 entries that are not 0, for 2 contacts"},
    {few_entries_in_M, SADMM_ERROR_INVALID_ARGUMENT, "M has 17 entries that are not 0, 18 rows"},
    {external_link, SADMM_ERROR_IO, "vectors/f: missing"},
    {external_group, SADMM_ERROR_IO, "vectors/f: missing"},
    {external_data, SADMM_ERROR_IO, "another file"},
    {dangling_link, SADMM_ERROR_IO, "vectors/f: missing"},
    {link_loop, SADMM_ERROR_IO, "vectors/f: missing"},
};
enum { REFUSAL_COUNT = sizeof refusals / sizeof *refusals };

START_TEST(refuses_malformed)
{
    struct sample s = make_sample();
    struct sadmm_error error = {0};
    sadmm_problem *problem = (sadmm_problem *)folder; /* must be overwritten */
    const char *path = path_of("sample.hdf5");
    put_sample(path_of("sample2.hdf5"), &s, TRIPLET, COLUMNS, ROWS, 0);
    put_sample(path, &s, TRIPLET, COLUMNS, ROWS, 0);
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    refusals[_i].spoil(file);
    H5Fclose(file);
    sadmm_status status = sadmm_fclib_load(path, &problem, &error);
    ck_assert_msg(status == refusals[_i].status, "refusal %d: %s: %s", _i, sadmm_status_name(status), error.message);
    ck_assert_msg(strstr(error.message, refusals[_i].says) != NULL, "refusal %d: '%s' does not say '%s'", _i,
                  error.message, refusals[_i].says);
    ck_assert_ptr_null(problem);
}
END_TEST

START_TEST(refuses_what_is_no_file)
{
    struct sadmm_error error = {0};
    sadmm_problem *problem;
    write_file(path_of("text"), "not HDF5 at all\n", 16);
    write_file(path_of("empty"), "", 0);
    ck_assert_int_eq(mkfifo(path_of("pipe"), 0600), 0); /* nobody ever writes into it */
    static const struct {
        const char *name, *says;
    } files[] = {{"text", "cannot open as HDF5"}, {"empty", "cannot open as HDF5"}, {"missing", "No such file"},
                 {"", "is not a file"},           {"pipe", "is not a file"},        {"text/x", "Not a directory"}};
    for (size_t k = 0; k < sizeof files / sizeof *files; ++k) {
        ck_assert_int_eq(sadmm_fclib_load(path_of(files[k].name), &problem, &error), SADMM_ERROR_IO);
        ck_assert_msg(strstr(error.message, files[k].says) != NULL, "'%s' does not say '%s'", error.message,
                      files[k].says);
        ck_assert_ptr_null(problem);
    }
    ck_assert_int_eq(sadmm_fclib_load("/dev/zero", &problem, &error), SADMM_ERROR_IO);
    ck_assert_int_eq(sadmm_fclib_load("", &problem, &error), SADMM_ERROR_IO);
    ck_assert_int_eq(sadmm_fclib_load(NULL, &problem, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_fclib_load(path_of("text"), NULL, &error), SADMM_ERROR_INVALID_ARGUMENT);
}
END_TEST

/* Other programs' files, and the first bytes of an HDF5 file before anything else. */
START_TEST(refuses_foreign)
{
    static const char *const beginnings[] = {"\x89PNG\r\n\x1a\n", "\x1f\x8b\x08", "CDF\001", "\x0e\x03\x13\x01",
                                             "PK\003\004", "\x7f" "ELF", "{\"steps\": 3}",
                                             "\x89HDF\r\n\x1a\n"};
    static char data[4096];
    for (size_t k = 0; k < sizeof beginnings / sizeof *beginnings; ++k)
        for (int fill = 0; fill < 256; fill += 51) {
            struct sadmm_error error = {0};
            sadmm_problem *problem;
            memset(data, fill, sizeof data);
            memcpy(data, beginnings[k], strlen(beginnings[k]));
            write_file(path_of("foreign"), data, sizeof data);
            ck_assert_int_eq(sadmm_fclib_load(path_of("foreign"), &problem, &error), SADMM_ERROR_IO);
            ck_assert_msg(strstr(error.message, "cannot open as HDF5") != NULL, "%s", error.message);
            ck_assert_ptr_null(problem);
        }
}
END_TEST

/* Cut anywhere, a file is refused. */
START_TEST(refuses_truncated)
{
    struct sample s = make_sample();
    long size;
    put_sample(path_of("whole.hdf5"), &s, TRIPLET, COLUMNS, ROWS, 0);
    char *data = read_file(path_of("whole.hdf5"), &size);
    for (long length = 0; length < size; length += 97) {
        struct sadmm_error error = {0};
        sadmm_problem *problem;
        write_file(path_of("cut.hdf5"), data, length);
        ck_assert_msg(sadmm_fclib_load(path_of("cut.hdf5"), &problem, &error) == SADMM_ERROR_IO, "cut at %ld of %ld",
                      length, size);
    }
    free(data);
}
END_TEST

/* Damaged anywhere, a file is read or refused; it never brings the program down, and HDF5 prints nothing about it. */
START_TEST(survives_damage)
{
    struct sample s = make_sample();
    long size, printed;
    put_sample(path_of("whole.hdf5"), &s, TRIPLET, COLUMNS, ROWS, 0);
    char *data = read_file(path_of("whole.hdf5"), &size);
    int refused = 0, kept = dup(STDERR_FILENO);
    fflush(stderr);
    ck_assert_ptr_nonnull(freopen(path_of("stderr"), "w", stderr));
    for (long at = 0; at < size; at += 13) {
        static const char masks[] = {0x01, 0x10, (char)0x80, (char)0xff};
        struct sadmm_error error = {0};
        sadmm_problem *problem;
        data[at] = (char)(data[at] ^ masks[at % 4]);
        write_file(path_of("damaged.hdf5"), data, size);
        data[at] = (char)(data[at] ^ masks[at % 4]);
        if (sadmm_fclib_load(path_of("damaged.hdf5"), &problem, &error) != SADMM_OK) ++refused;
        sadmm_problem_destroy(problem);
    }
    fflush(stderr);
    dup2(kept, STDERR_FILENO);
    free(read_file(path_of("stderr"), &printed));
    ck_assert_int_eq(printed, 0);
    ck_assert_int_gt(refused, 0);
    free(data);
}
END_TEST

/* The error printing that the program chose is back after every call. */
static herr_t own_printer(hid_t stack, void *data)
{
    (void)stack;
    ++*(int *)data;
    return 0;
}

START_TEST(restores_error_printing)
{
    struct sadmm_error error = {0};
    sadmm_problem *problem;
    int calls = 0;
    H5E_auto2_t printer;
    void *data;
    H5Eset_auto2(H5E_DEFAULT, own_printer, &calls);
    ck_assert_int_eq(sadmm_fclib_load(path_of("missing"), &problem, &error), SADMM_ERROR_IO);
    H5Eget_auto2(H5E_DEFAULT, &printer, &data);
    ck_assert(printer == own_printer && data == &calls);
    ck_assert_int_eq(calls, 0);
}
END_TEST

/* Every allocation of a load and of a save fails once: OUT_OF_MEMORY, and nothing half done. */
START_TEST(survives_lack_of_memory)
{
    struct sample s = make_sample();
    struct sadmm_error error = {0};
    sadmm_problem *problem = NULL;
    sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
    int failures = 0;
    put_sample(path_of("s.hdf5"), &s, TRIPLET, COLUMNS, ROWS, 0);
    for (long successes = 0; status != SADMM_OK; ++successes) {
        sadmm_test_fail_allocations_after(successes);
        status = sadmm_fclib_load(path_of("s.hdf5"), &problem, &error);
        sadmm_test_fail_allocations_after(-1);
        ck_assert_msg(status == SADMM_OK || status == SADMM_ERROR_OUT_OF_MEMORY, "%s", error.message);
        ck_assert((status == SADMM_OK) == (problem != NULL));
        ck_assert_int_lt(++failures, 1000);
    }
    ck_assert_int_gt(failures, 10);
    status = SADMM_ERROR_OUT_OF_MEMORY;
    for (long successes = 0; status != SADMM_OK; ++successes) {
        sadmm_test_fail_allocations_after(successes);
        status = sadmm_fclib_save_solution(problem, NULL, path_of("t.hdf5"), &error);
        sadmm_test_fail_allocations_after(-1);
        ck_assert_msg(status == SADMM_OK || status == SADMM_ERROR_OUT_OF_MEMORY, "%s", error.message);
        ck_assert_int_eq(access(path_of("t.hdf5"), F_OK) == 0, status == SADMM_OK);
    }
    ck_assert_int_eq(files_in_folder(), 2);
    sadmm_problem_destroy(problem);
}
END_TEST

int main(void)
{
    /* libhdf5's clean-up at exit can loop, and print, over what a damaged file left in its caches. */
    H5dont_atexit();
    Suite *suite = suite_create("fclib");
    TCase *tests = tcase_create("files");
    tcase_set_timeout(tests, 60);
    tcase_add_checked_fixture(tests, make_folder, remove_folder);
    tcase_add_loop_test(tests, reads_all_formats, 0, 8);
    tcase_add_test(tests, writes_the_layout);
    tcase_add_test(tests, comes_back_identical);
    tcase_add_test(tests, writes_free_bodies);
    tcase_add_test(tests, refuses_to_write);
    tcase_add_test(tests, writes_solutions);
    tcase_add_test(tests, world_to_file);
    tcase_add_test(tests, joints_to_file);
    tcase_add_loop_test(tests, refuses_malformed, 0, REFUSAL_COUNT);
    tcase_add_test(tests, refuses_what_is_no_file);
    tcase_add_test(tests, refuses_foreign);
    tcase_add_test(tests, refuses_truncated);
    tcase_add_test(tests, survives_damage);
    tcase_add_test(tests, restores_error_printing);
    tcase_add_test(tests, survives_lack_of_memory);
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_ENV);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
