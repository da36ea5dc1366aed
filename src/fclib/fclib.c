#include "fclib.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/error.h"
#include "core/base/memory.h"
#include "global_problem.h"
#include "h5.h"
#include "open_file.h"

enum { NAME_SIZE = 64, LARGEST = INT32_MAX - 1 };

bool sadmm_fclib_available(void)
{
    return true;
}

/* ---- sparse matrices --------------------------------------------------------------------------------------------- */

struct stored_matrix {
    int32_t rows, columns, nz;
    int64_t p_count, i_count, x_count;
    int32_t *p, *i;
    double *x;
};

static void stored_matrix_free(struct stored_matrix *m)
{
    sadmm_free(m->p);
    sadmm_free(m->i);
    sadmm_free(m->x);
}

static const char *part(char name[NAME_SIZE], const char *group, const char *member)
{
    snprintf(name, NAME_SIZE, "%s/%s", group, member);
    return name;
}

static sadmm_status read_sizes(hid_t file, const char *group, struct stored_matrix *m, struct sadmm_error *error)
{
    char name[NAME_SIZE];
    TRY(sadmm_h5_read_value(file, part(name, group, "m"), 0, LARGEST, &m->rows, error));
    TRY(sadmm_h5_read_value(file, part(name, group, "n"), 0, LARGEST, &m->columns, error));
    return sadmm_h5_read_value(file, part(name, group, "nz"), -2, INT32_MAX, &m->nz, error);
}

static sadmm_status read_arrays(hid_t file, const char *group, struct stored_matrix *m, struct sadmm_error *error)
{
    char name[NAME_SIZE];
    m->p_count = m->nz >= 0 ? -1 : (int64_t)(m->nz == -1 ? m->columns : m->rows) + 1;
    m->i_count = m->x_count = -1;
    TRY(sadmm_h5_read_int(file, part(name, group, "p"), &m->p_count, &m->p, error));
    TRY(sadmm_h5_read_int(file, part(name, group, "i"), &m->i_count, &m->i, error));
    return sadmm_h5_read_double(file, part(name, group, "x"), &m->x_count, &m->x, error);
}

static sadmm_status add_entry(const char *group, struct sadmm_triplets *out, int32_t row, int32_t column, double value,
                              struct sadmm_error *error)
{
    if (row < 0 || row >= out->rows || column < 0 || column >= out->columns)
        return sadmm_fail(error, SADMM_ERROR_IO, "%s: entry (%d, %d) is outside the %d x %d matrix", group, row, column,
                          out->rows, out->columns);
    return sadmm_triplets_add(out, row, column, value) ? SADMM_OK : sadmm_fail_memory(error, group);
}

static sadmm_status expand_triplets(const char *group, const struct stored_matrix *m, struct sadmm_triplets *out,
                                    struct sadmm_error *error)
{
    if (m->p_count < m->nz || m->i_count < m->nz || m->x_count < m->nz)
        return sadmm_fail(error, SADMM_ERROR_IO, "%s: nz = %d, but p, i, x hold %lld, %lld, %lld values", group, m->nz,
                          (long long)m->p_count, (long long)m->i_count, (long long)m->x_count);
    for (int32_t e = 0; e < m->nz; ++e) TRY(add_entry(group, out, m->i[e], m->p[e], m->x[e], error));
    return SADMM_OK;
}

/* Compressed columns, or rows when `by_row`. */
static sadmm_status expand_compressed(const char *group, const struct stored_matrix *m, bool by_row,
                                      struct sadmm_triplets *out, struct sadmm_error *error)
{
    int64_t entries = m->i_count < m->x_count ? m->i_count : m->x_count;
    int32_t lines = by_row ? m->rows : m->columns;
    if (m->p[0] != 0) return sadmm_fail(error, SADMM_ERROR_IO, "%s/p starts with %d: must be 0", group, m->p[0]);
    for (int32_t line = 0; line < lines; ++line) {
        if (m->p[line + 1] < m->p[line] || m->p[line + 1] > entries)
            return sadmm_fail(error, SADMM_ERROR_IO, "%s/p: value %d is %d: must be in [%d, %lld]", group, line + 1,
                              m->p[line + 1], m->p[line], (long long)entries);
        for (int32_t e = m->p[line]; e < m->p[line + 1]; ++e)
            TRY(add_entry(group, out, by_row ? line : m->i[e], by_row ? m->i[e] : line, m->x[e], error));
    }
    return SADMM_OK;
}

static sadmm_status read_matrix(hid_t file, const char *group, struct sadmm_triplets *out, struct sadmm_error *error)
{
    struct stored_matrix m = {0};
    sadmm_status status = read_sizes(file, group, &m, error);
    if (status == SADMM_OK) status = read_arrays(file, group, &m, error);
    out->rows = m.rows;
    out->columns = m.columns;
    if (status == SADMM_OK)
        status = m.nz >= 0 ? expand_triplets(group, &m, out, error)
                           : expand_compressed(group, &m, m.nz == -2, out, error);
    stored_matrix_free(&m);
    return status;
}

static sadmm_status write_matrix(hid_t file, const char *group, const struct sadmm_triplets *m,
                                 struct sadmm_error *error)
{
    char name[NAME_SIZE];
    if (m->count > INT32_MAX)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%s: %zu entries: must fit 32-bit indices", group, m->count);
    int32_t count = (int32_t)m->count;
    TRY(sadmm_h5_write_int(file, part(name, group, "nzmax"), 1, &count, error));
    TRY(sadmm_h5_write_int(file, part(name, group, "m"), 1, &m->rows, error));
    TRY(sadmm_h5_write_int(file, part(name, group, "n"), 1, &m->columns, error));
    TRY(sadmm_h5_write_int(file, part(name, group, "nz"), 1, &count, error));
    TRY(sadmm_h5_write_int(file, part(name, group, "p"), m->count, m->column, error));
    TRY(sadmm_h5_write_int(file, part(name, group, "i"), m->count, m->row, error));
    return sadmm_h5_write_double(file, part(name, group, "x"), m->count, m->value, error);
}

/* ---- reading a problem ------------------------------------------------------------------------------------------- */

static sadmm_status check_kind(hid_t file, struct sadmm_error *error)
{
    int32_t dimension;
    if (!sadmm_h5_exists(file, "/fclib_global")) {
        if (sadmm_h5_exists(file, "/fclib_local"))
            return sadmm_fail(
                error, SADMM_ERROR_UNSUPPORTED,
                "the file holds a local problem (/fclib_local): only global ones, with bodies, are solved");
        if (sadmm_h5_exists(file, "/fclib_global_rolling"))
            return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                              "the file holds a problem with rolling friction (/fclib_global_rolling)");
        return sadmm_fail(error, SADMM_ERROR_IO, "no group /fclib_global: not an FCLIB file");
    }
    TRY(sadmm_h5_read_value(file, "/fclib_global/spacedim", 2, 3, &dimension, error));
    if (dimension == 2)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "/fclib_global/spacedim = 2: only 3 dimensions are solved");
    return SADMM_OK;
}

static sadmm_status check_shapes(const struct sadmm_global_problem *g, bool bilateral, struct sadmm_error *error)
{
    if (g->M.rows != g->M.columns)
        return sadmm_fail(error, SADMM_ERROR_IO, "/fclib_global/M is %d x %d: must be square", g->M.rows, g->M.columns);
    if (g->H.rows != g->M.rows || (bilateral && g->G.rows != g->M.rows))
        return sadmm_fail(error, SADMM_ERROR_IO, "/fclib_global/%s has %d rows, M has %d: must be equal",
                          g->H.rows != g->M.rows ? "H" : "G", g->H.rows != g->M.rows ? g->H.rows : g->G.rows,
                          g->M.rows);
    if (g->H.columns % 3 != 0)
        return sadmm_fail(error, SADMM_ERROR_IO, "/fclib_global/H has %d columns: must be a multiple of 3",
                          g->H.columns);
    if (g->M.rows % 6 != 0)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                          "M is %d x %d, not a multiple of 6: only rigid bodies of 6 degrees of freedom are solved",
                          g->M.rows, g->M.rows);
    return SADMM_OK;
}

static sadmm_status read_global(hid_t file, struct sadmm_global_problem *g, struct sadmm_error *error)
{
    TRY(check_kind(file, error));
    bool bilateral = sadmm_h5_exists(file, "/fclib_global/G");
    TRY(read_matrix(file, "/fclib_global/M", &g->M, error));
    TRY(read_matrix(file, "/fclib_global/H", &g->H, error));
    if (bilateral) TRY(read_matrix(file, "/fclib_global/G", &g->G, error));
    TRY(check_shapes(g, bilateral, error));
    g->bodies = g->M.rows / 6;
    g->contacts = g->H.columns / 3;
    g->hard_rows = g->G.columns;
    /* The vectors prove that the file holds as much data as the sizes say, before anything is allocated by them. */
    int64_t rows = g->M.rows, columns = g->H.columns, contacts = g->contacts, hard = g->hard_rows;
    TRY(sadmm_h5_read_double(file, "/fclib_global/vectors/f", &rows, &g->f, error));
    TRY(sadmm_h5_read_double(file, "/fclib_global/vectors/w", &columns, &g->w, error));
    TRY(sadmm_h5_read_double(file, "/fclib_global/vectors/mu", &contacts, &g->mu, error));
    if (bilateral) TRY(sadmm_h5_read_double(file, "/fclib_global/vectors/b", &hard, &g->b, error));
    return SADMM_OK;
}

/* Of the file at `path`, or of `file` where path is NULL. */
static sadmm_status read_problem(const char *path, hid_t file, sadmm_problem **out, struct sadmm_error *error)
{
    struct sadmm_h5_session session;
    struct sadmm_global_problem global = {0};
    *out = NULL;
    TRY(sadmm_h5_begin(&session, error));
    sadmm_status status = path ? sadmm_h5_open(path, SADMM_H5_READ, &file, error) : SADMM_OK;
    if (status == SADMM_OK) {
        status = read_global(file, &global, error);
        if (path) H5Fclose(file);
    }
    sadmm_h5_end(&session);
    if (status == SADMM_OK) status = sadmm_global_to_problem(&global, out, error);
    sadmm_global_problem_free(&global);
    return status;
}

sadmm_status sadmm_fclib_load(const char *path, sadmm_problem **out, struct sadmm_error *error)
{
    if (!out) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "out is NULL");
    *out = NULL;
    if (!path) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "path is NULL");
    return read_problem(path, -1, out, error);
}

sadmm_status sadmm_fclib_read(hid_t file, sadmm_problem **out, struct sadmm_error *error)
{
    return read_problem(NULL, file, out, error);
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static sadmm_status write_global(hid_t file, const struct sadmm_global_problem *g, const char *title,
                                 struct sadmm_error *error)
{
    const int32_t dimension = 3;
    TRY(sadmm_h5_write_int(file, "/fclib_global/spacedim", 1, &dimension, error));
    TRY(write_matrix(file, "/fclib_global/M", &g->M, error));
    TRY(write_matrix(file, "/fclib_global/H", &g->H, error));
    if (g->hard_rows > 0) TRY(write_matrix(file, "/fclib_global/G", &g->G, error));
    TRY(sadmm_h5_write_double(file, "/fclib_global/vectors/f", 6 * (size_t)g->bodies, g->f, error));
    TRY(sadmm_h5_write_double(file, "/fclib_global/vectors/w", 3 * (size_t)g->contacts, g->w, error));
    TRY(sadmm_h5_write_double(file, "/fclib_global/vectors/mu", (size_t)g->contacts, g->mu, error));
    if (g->hard_rows > 0)
        TRY(sadmm_h5_write_double(file, "/fclib_global/vectors/b", (size_t)g->hard_rows, g->b, error));
    if (!title) return SADMM_OK;
    TRY(sadmm_h5_write_string(file, "/fclib_global/info/title", title, error));
    TRY(sadmm_h5_write_string(file, "/fclib_global/info/description", "", error));
    return sadmm_h5_write_string(file, "/fclib_global/info/math_info", "", error);
}

static sadmm_status write_solution(hid_t file, const struct sadmm_global_solution *s, struct sadmm_error *error)
{
    static const char *const old[] = {"/solution/v", "/solution/u", "/solution/r", "/solution/l"};
    for (size_t k = 0; k < sizeof old / sizeof *old; ++k) TRY(sadmm_h5_remove(file, old[k], error));
    TRY(sadmm_h5_write_double(file, "/solution/v", 6 * (size_t)s->bodies, s->v, error));
    TRY(sadmm_h5_write_double(file, "/solution/u", 3 * (size_t)s->contacts, s->u, error));
    TRY(sadmm_h5_write_double(file, "/solution/r", 3 * (size_t)s->contacts, s->r, error));
    if (s->hard_rows > 0) TRY(sadmm_h5_write_double(file, "/solution/l", (size_t)s->hard_rows, s->l, error));
    return SADMM_OK;
}

/* The solution must belong to the problem in the file. */
static sadmm_status check_same_sizes(hid_t file, const struct sadmm_global_solution *s, struct sadmm_error *error)
{
    int32_t rows, columns, hard = 0;
    TRY(check_kind(file, error));
    TRY(sadmm_h5_read_value(file, "/fclib_global/M/m", 0, LARGEST, &rows, error));
    TRY(sadmm_h5_read_value(file, "/fclib_global/H/n", 0, LARGEST, &columns, error));
    if (sadmm_h5_exists(file, "/fclib_global/G"))
        TRY(sadmm_h5_read_value(file, "/fclib_global/G/n", 0, LARGEST, &hard, error));
    if (rows == 6 * s->bodies && columns == 3 * s->contacts && hard == s->hard_rows) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_IO,
                      "the file holds %d velocities, %d contact rows and %d bilateral rows, the solution %d, %d and %d",
                      rows, columns, hard, 6 * s->bodies, 3 * s->contacts, s->hard_rows);
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

/* HDF5 writes to files only. */
static sadmm_status check_target(const char *path, struct sadmm_error *error)
{
    struct stat info;
    if (stat(path, &info) != 0 || S_ISREG(info.st_mode)) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_IO, "exists and is not a file");
}

/* Nothing is left of a file that could not be written. */
static sadmm_status finish(const char *path, sadmm_status status)
{
    if (status != SADMM_OK) unlink(path);
    return status;
}

static sadmm_status check_different(const char *source, const char *path, struct sadmm_error *error)
{
    struct stat from, to;
    if (stat(source, &from) != 0) return sadmm_fail(error, SADMM_ERROR_IO, "%.200s: %s", source, strerror(errno));
    if (stat(path, &to) != 0 || from.st_dev != to.st_dev || from.st_ino != to.st_ino) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "path is source (%.200s): must be another file", source);
}

static sadmm_status copy_file(const char *from, const char *to, struct sadmm_error *error)
{
    char buffer[1 << 14];
    size_t count;
    FILE *in = fopen(from, "rb");
    if (!in) return sadmm_fail(error, SADMM_ERROR_IO, "%.200s: %s", from, strerror(errno));
    FILE *out = fopen(to, "wb");
    if (!out) {
        sadmm_fail(error, SADMM_ERROR_IO, "cannot create the file: %s", strerror(errno));
        fclose(in);
        return SADMM_ERROR_IO;
    }
    bool ok = true;
    while (ok && (count = fread(buffer, 1, sizeof buffer, in)) > 0) ok = fwrite(buffer, 1, count, out) == count;
    if (ferror(in)) ok = false;
    fclose(in);
    if (fclose(out) != 0) ok = false;
    return ok ? SADMM_OK : sadmm_fail(error, SADMM_ERROR_IO, "%.200s: could not be copied", from);
}

/* Write what is not NULL into `file_name`: a new file, or (edit) the copy of a problem file. */
static sadmm_status write_file(const char *file_name, bool edit, const struct sadmm_global_problem *global,
                               const char *title, const struct sadmm_global_solution *solution,
                               struct sadmm_error *error)
{
    struct sadmm_h5_session session;
    hid_t file;
    TRY(sadmm_h5_begin(&session, error));
    sadmm_status status = sadmm_h5_open(file_name, edit ? SADMM_H5_EDIT : SADMM_H5_CREATE, &file, error);
    if (status == SADMM_OK) {
        if (edit) status = check_same_sizes(file, solution, error);
        if (status == SADMM_OK && global) status = write_global(file, global, title, error);
        if (status == SADMM_OK && solution) status = write_solution(file, solution, error);
        sadmm_status closed = sadmm_h5_close(file, status == SADMM_OK ? error : NULL);
        if (status == SADMM_OK) status = closed;
    }
    sadmm_h5_end(&session);
    return status;
}

sadmm_status sadmm_fclib_save(sadmm_problem *problem, const char *path, const char *title,
                              struct sadmm_error *error)
{
    struct sadmm_global_problem global;
    if (!problem || !path)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s is NULL", problem ? "path" : "problem");
    TRY(sadmm_global_from_problem(problem, &global, error));
    sadmm_status status = check_target(path, error);
    if (status == SADMM_OK) status = finish(path, write_file(path, false, &global, title ? title : "", NULL, error));
    sadmm_global_problem_free(&global);
    return status;
}

sadmm_status sadmm_fclib_write(sadmm_problem *problem, hid_t file, const char *title, struct sadmm_error *error)
{
    struct sadmm_h5_session session;
    struct sadmm_global_problem global;
    TRY(sadmm_global_from_problem(problem, &global, error));
    sadmm_status status = sadmm_h5_begin(&session, error);
    if (status == SADMM_OK) {
        status = write_global(file, &global, title, error);
        sadmm_h5_end(&session);
    }
    sadmm_global_problem_free(&global);
    return status;
}

sadmm_status sadmm_fclib_save_solution(sadmm_problem *problem, const char *source, const char *path,
                                       struct sadmm_error *error)
{
    struct sadmm_global_problem global = {0};
    struct sadmm_global_solution solution = {0};
    if (!problem || !path)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s is NULL", problem ? "path" : "problem");
    TRY(check_target(path, error));
    if (source) TRY(check_different(source, path, error));
    sadmm_status status = sadmm_global_solution_from_problem(problem, &solution, error);
    if (status == SADMM_OK && !source) status = sadmm_global_from_problem(problem, &global, error);
    if (status == SADMM_OK) {
        if (source) status = copy_file(source, path, error);
        if (status == SADMM_OK)
            status = write_file(path, source != NULL, source ? NULL : &global, "", &solution, error);
        finish(path, status);
    }
    sadmm_global_problem_free(&global);
    sadmm_global_solution_free(&solution);
    return status;
}
