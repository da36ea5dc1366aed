/* Problem files: the input says what a small FCLIB file holds, and how it departs from one. Values, lengths, types and
 * shapes of data sets, sets that are missing or are groups: all that this library must see through. (The bytes of the
 * container are libhdf5's.) Whatever the file:
 *
 *   - it is read, or refused with a reason and nothing in hand
 *   - what was read can be written and is read again as the same problem
 *
 * Nearly all of the time is libhdf5's. So the files are in memory and stay open from input to input (opening one costs
 * more than all that is in it), one input in 4 is written and read again, and one in 64 goes through files of a disk.
 */
#include <hdf5.h>
#include <string.h>
#include <unistd.h>

#include "bytes.h"
#include "core/base/memory.h"
#include "fclib/fclib.h"
#include "fclib/open_file.h"

enum { MAX_BODIES = 3, MAX_CONTACTS = 3, MAX_ROWS = 7, MAX_ENTRIES = 36 * MAX_BODIES, MAX_SETS = 40 };

/* ---- what a file is to hold -------------------------------------------------------------------------------------- */

struct set {
    char name[48];
    bool real;
    int count;
    int32_t ints[MAX_ENTRIES];
    double reals[MAX_ENTRIES];
    enum { PLAIN, MATRIX, SCALAR, WRONG_CLASS, OTHER_SIZE, EMPTY_GROUP, UNWRITTEN, MISSING, HOWS } how;
};

struct content {
    struct set sets[MAX_SETS];
    int count;
};

static struct set *add_set(struct content *c, const char *group, const char *name, bool real, int count)
{
    MUST(c->count < MAX_SETS && count <= MAX_ENTRIES, "%s/%s", group, name);
    struct set *set = &c->sets[c->count++];
    memset(set, 0, sizeof *set);
    snprintf(set->name, sizeof set->name, "/fclib_global/%s%s%s", group, *group ? "/" : "", name);
    set->real = real;
    set->count = count;
    return set;
}

static void add_int(struct content *c, const char *group, const char *name, int value)
{
    add_set(c, group, name, false, 1)->ints[0] = value;
}

/* `dense` (rows x columns), stored by triplets, compressed columns or compressed rows. */
static void add_matrix(struct content *c, const char *group, const double *dense, int rows, int columns, int nz)
{
    int entries = 0, outer = nz == -2 ? rows : columns, inner = nz == -2 ? columns : rows;
    for (int k = 0; k < rows * columns; ++k) entries += dense[k] != 0;
    add_int(c, group, "m", rows);
    add_int(c, group, "n", columns);
    add_int(c, group, "nzmax", entries);
    add_int(c, group, "nz", nz < 0 ? nz : entries);
    struct set *p = add_set(c, group, "p", false, nz < 0 ? outer + 1 : entries),
               *i = add_set(c, group, "i", false, entries);
    struct set *x = add_set(c, group, "x", true, entries);
    int at = 0;
    for (int o = 0; o < outer; ++o) {
        for (int n = 0; n < inner; ++n) {
            int row = nz == -2 ? o : n, column = nz == -2 ? n : o;
            if (dense[row * columns + column] == 0) continue;
            x->reals[at] = dense[row * columns + column];
            i->ints[at] = nz >= 0 || nz == -1 ? row : column;
            if (nz >= 0) p->ints[at] = column;
            ++at;
        }
        if (nz < 0) p->ints[o + 1] = at;
    }
}

static void fill(struct bytes *in, struct set *set, double lo, double hi)
{
    for (int k = 0; k < set->count; ++k) set->reals[k] = take_number(in, lo, hi);
}

/* Columns that act on one body or on two. */
static void couple(struct bytes *in, double *dense, int columns, int column, int width, int bodies)
{
    int first = take_choice(in, bodies + 1) - 1, second = take_choice(in, bodies);
    for (int k = 0; k < width; ++k)
        for (int i = 0; i < 6; ++i) {
            if (first >= 0) dense[(6 * first + i) * columns + column + k] = take_in(in, -1, 1);
            dense[(6 * second + i) * columns + column + k] = take_in(in, -1, 1);
        }
}

static void make_content(struct bytes *in, struct content *c)
{
    static double M[36 * MAX_BODIES * MAX_BODIES], H[18 * MAX_BODIES * MAX_CONTACTS], G[6 * MAX_BODIES * MAX_ROWS];
    int bodies = 1 + take_choice(in, MAX_BODIES), contacts = take_choice(in, MAX_CONTACTS + 1);
    int rows = take_choice(in, 2) ? take_choice(in, MAX_ROWS + 1) : 0, n = 6 * bodies;
    memset(M, 0, sizeof M);
    memset(H, 0, sizeof H);
    memset(G, 0, sizeof G);
    for (int k = 0; k < n; ++k) M[k * n + k] = 1 + take_in(in, -0.5, 10);
    if (take_rarely(in, 8)) M[take_choice(in, n) * n + take_choice(in, n)] = take_number(in, -1, 1);
    for (int k = 0; k < contacts; ++k) couple(in, H, 3 * contacts, 3 * k, 3, bodies);
    for (int k = 0; k < rows; ++k) couple(in, G, rows, k, 1, bodies);
    c->count = 0;
    add_int(c, "", "spacedim", 3);
    add_matrix(c, "M", M, n, n, -take_choice(in, 3));
    add_matrix(c, "H", H, n, 3 * contacts, -take_choice(in, 3));
    fill(in, add_set(c, "vectors", "f", true, n), -10, 10);
    fill(in, add_set(c, "vectors", "w", true, 3 * contacts), -1, 1);
    fill(in, add_set(c, "vectors", "mu", true, contacts), 0, 1);
    if (rows > 0) {
        add_matrix(c, "G", G, n, rows, -take_choice(in, 3));
        fill(in, add_set(c, "vectors", "b", true, rows), -1, 1);
    }
}

/* Depart from it. */
static void damage(struct bytes *in, struct content *c)
{
    static const int32_t ints[] = {-1, 0, 1, -2, -3, 2, 3, 5, 6, 7, 12, INT32_MAX, INT32_MIN, INT32_MAX - 1,
                                   1 << 30, 1 << 16};
    for (int changes = take_choice(in, 4); changes > 0; --changes) {
        struct set *set = &c->sets[take_choice(in, c->count)];
        int at = set->count > 0 ? take_choice(in, set->count < 256 ? set->count : 256) : 0;
        switch (take_choice(in, 6)) {
        case 0: set->how = take_choice(in, HOWS); break;
        case 1: set->count = take_choice(in, MAX_ENTRIES + 1); break;
        case 2: set->count += set->count < MAX_ENTRIES ? 1 : -1; break;
        case 3: set->count -= set->count > 0; break;
        default:
            set->ints[at] = ints[take_choice(in, (int)(sizeof ints / sizeof *ints))];
            set->reals[at] = take_extreme(in);
        }
    }
}

/* ---- writing it -------------------------------------------------------------------------------------------------- */

static void write_set(hid_t file, hid_t parents, const struct set *set)
{
    if (set->how == MISSING) return;
    if (set->how == EMPTY_GROUP) {
        H5Gclose(H5Gcreate2(file, set->name, parents, H5P_DEFAULT, H5P_DEFAULT));
        return;
    }
    hsize_t extent[2] = {(hsize_t)set->count, 1};
    hid_t space =
        set->how == SCALAR ? H5Screate(H5S_SCALAR) : H5Screate_simple(set->how == MATRIX ? 2 : 1, extent, NULL);
    bool real = set->real != (set->how == WRONG_CLASS);
    hid_t stored = real ? (set->how == OTHER_SIZE ? H5T_IEEE_F32BE : H5T_IEEE_F64LE)
                        : (set->how == OTHER_SIZE ? H5T_STD_I64BE : H5T_STD_I32LE);
    hid_t data = H5Dcreate2(file, set->name, stored, space, parents, H5P_DEFAULT, H5P_DEFAULT);
    MUST(data >= 0, "%s", set->name);
    if (set->how != UNWRITTEN)
        H5Dwrite(data, set->real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT32, H5S_ALL, H5S_ALL, H5P_DEFAULT,
                 set->real ? (const void *)set->reals : (const void *)set->ints);
    H5Dclose(data);
    H5Sclose(space);
}

static void write_content(hid_t file, const struct content *c)
{
    hid_t parents = H5Pcreate(H5P_LINK_CREATE);
    MUST(file >= 0 && parents >= 0, "a file");
    H5Pset_create_intermediate_group(parents, 1);
    for (int k = 0; k < c->count; ++k) write_set(file, parents, &c->sets[k]);
    H5Pclose(parents);
}

/* ---- reading it -------------------------------------------------------------------------------------------------- */

static void must_be_the_same(sadmm_problem *a, sadmm_problem *b)
{
    double A[2][36 * MAX_BODIES], f[2][6 * MAX_BODIES];
    int32_t bodies = sadmm_problem_body_count(a), blocks = sadmm_problem_block_count(a);
    MUST(bodies <= MAX_BODIES && bodies == sadmm_problem_body_count(b), "%d bodies", bodies);
    MUST(blocks == sadmm_problem_block_count(b), "%d blocks", blocks);
    MUST(sadmm_problem_get_bodies(a, A[0], f[0], NULL) == SADMM_OK, "bodies");
    MUST(sadmm_problem_get_bodies(b, A[1], f[1], NULL) == SADMM_OK, "bodies");
    for (int k = 0; k < 36 * bodies; ++k) MUST(A[0][k] == A[1][k], "A[%d]", k);
    for (int k = 0; k < 6 * bodies; ++k) MUST(f[0][k] == f[1][k], "b[%d]", k);
    for (int32_t k = 0; k < blocks; ++k) {
        sadmm_problem_block x, y;
        MUST(sadmm_problem_get_block(a, k, &x) == SADMM_OK && sadmm_problem_get_block(b, k, &y) == SADMM_OK, "block %d",
             k);
        MUST(x.kind == y.kind && x.rows == y.rows && x.body_a == y.body_a && x.body_b == y.body_b &&
                 x.friction == y.friction,
             "block %d", k);
        for (int i = 0; i < 6 * x.rows; ++i)
            MUST((x.body_a < 0 || x.jacobian_a[i] == y.jacobian_a[i]) && x.jacobian_b[i] == y.jacobian_b[i], "block %d",
                 k);
    }
}

/* ---- where ------------------------------------------------------------------------------------------------------- */

static void must_be_read_again(sadmm_problem *problem, sadmm_status written, sadmm_status read, sadmm_problem *again,
                               const struct sadmm_error *error)
{
    MUST(written == SADMM_OK && read == SADMM_OK, "%s", error->message);
    must_be_the_same(problem, again);
    sadmm_problem_destroy(again);
}

static sadmm_status through_memory(const struct content *content, int allocations, bool both_ways,
                                   sadmm_problem **problem, struct sadmm_error *error)
{
    static hid_t files[2] = {-1, -1};
    sadmm_problem *again = NULL;
    for (int k = 0; k <= both_ways; ++k) {
        if (files[k] >= 0) {
            if (H5Lexists(files[k], "/fclib_global", H5P_DEFAULT) > 0)
                MUST(H5Ldelete(files[k], "/fclib_global", H5P_DEFAULT) >= 0, "file %d", k);
            continue;
        }
        hid_t access = H5Pcreate(H5P_FILE_ACCESS);
        H5Pset_fapl_core(access, 1 << 16, false);
        files[k] = H5Fcreate(k ? "again" : "first", H5F_ACC_TRUNC, H5P_DEFAULT, access);
        H5Pclose(access);
    }
    write_content(files[0], content);
    sadmm_test_fail_allocations_after(allocations);
    sadmm_status status = sadmm_fclib_read(files[0], problem, error), written;
    sadmm_test_fail_allocations_after(-1);
    if (status != SADMM_OK || !both_ways) return status;
    written = sadmm_fclib_write(*problem, files[1], "again", error);
    const sadmm_status read = sadmm_fclib_read(files[1], &again, error);
    must_be_read_again(*problem, written, read, again, error);
    return status;
}

static sadmm_status through_files(const struct content *content, int allocations, sadmm_problem **problem,
                                  struct sadmm_error *error)
{
    static char paths[2][64];
    sadmm_problem *again = NULL;
    for (int k = 0; k < 2; ++k)
        snprintf(paths[k], sizeof paths[k], "%s/fuzz-%ld-%d.hdf5", access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp",
                 (long)getpid(), k);
    hid_t file = H5Fcreate(paths[0], H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    write_content(file, content);
    H5Fclose(file);
    sadmm_test_fail_allocations_after(allocations);
    sadmm_status status = sadmm_fclib_load(paths[0], problem, error), written;
    sadmm_test_fail_allocations_after(-1);
    if (status == SADMM_OK) {
        written = sadmm_fclib_save(*problem, paths[1], "again", error);
        const sadmm_status read = sadmm_fclib_load(paths[1], &again, error);
        must_be_read_again(*problem, written, read, again, error);
    }
    for (int k = 0; k < 2; ++k) unlink(paths[k]);
    return status;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct content content;
    static bool quiet;
    struct bytes in = bytes_of(data, size);
    struct sadmm_error error = {SADMM_OK, ""};
    sadmm_problem *problem = NULL;
    if (!quiet) H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    quiet = true;

    make_content(&in, &content);
    damage(&in, &content);
    int allocations = take_rarely(&in, 16) ? take_choice(&in, 64) : -1;
    sadmm_status status = one_input_in(data, size, 64)
                              ? through_files(&content, allocations, &problem, &error)
                              : through_memory(&content, allocations, one_input_in(data, size, 4), &problem, &error);
    if (status == SADMM_OK) {
        sadmm_problem_destroy(problem);
    } else {
        MUST(status > SADMM_OK && status < SADMM_STATUS_COUNT && !problem, "status %d", (int)status);
        MUST(error.message[0], "%s without a message", sadmm_status_name(status));
    }
    return 0;
}
