#include "global_problem.h"

#include <string.h>

#include "core/base/memory.h"
#include "core/model/system_math.h"

/* ---- sparse matrices --------------------------------------------------------------------------------------------- */

bool sadmm_triplets_add(struct sadmm_triplets *m, int32_t row, int32_t column, double value)
{
    size_t used = m->count, needed = used + 1;
    if (!SADMM_GROW(m->row, used, needed) || !SADMM_GROW(m->column, used, needed) ||
        !SADMM_GROW(m->value, used, needed))
        return false;
    m->row[used] = row;
    m->column[used] = column;
    m->value[used] = value;
    m->count = needed;
    return true;
}

void sadmm_triplets_free(struct sadmm_triplets *m)
{
    sadmm_free(m->row);
    sadmm_free(m->column);
    sadmm_free(m->value);
    memset(m, 0, sizeof *m);
}

void sadmm_global_problem_free(struct sadmm_global_problem *g)
{
    sadmm_triplets_free(&g->M);
    sadmm_triplets_free(&g->H);
    sadmm_triplets_free(&g->G);
    sadmm_free(g->f);
    sadmm_free(g->w);
    sadmm_free(g->mu);
    sadmm_free(g->b);
    memset(g, 0, sizeof *g);
}

/* ---- from a problem ---------------------------------------------------------------------------------------------- */

struct sizes {
    int64_t bodies, points, blocks; /* of the problem */
    int64_t contacts, hard_rows;    /* of the form */
};

static sadmm_status measure(sadmm_problem *problem, struct sizes *s, struct sadmm_error *error)
{
    s->bodies = sadmm_problem_body_count(problem);
    s->points = sadmm_problem_contact_count(problem);
    s->blocks = sadmm_problem_block_count(problem);
    s->contacts = s->points;
    s->hard_rows = 0;
    for (int32_t k = 0; k < s->blocks; ++k) {
        sadmm_problem_block block;
        sadmm_status status = sadmm_problem_get_block(problem, k, &block);
        if (status != SADMM_OK) return sadmm_fail(error, status, "block %d: %s", k, sadmm_problem_message(problem));
        if (block.kind == SADMM_BLOCK_SOFT)
            return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                              "block %d is soft: a global friction contact problem has no soft constraints", k);
        if (block.kind == SADMM_BLOCK_ROWS)
            return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                              "block %d has rows with bounds or springs: a global friction contact problem has none",
                              k);
        if (block.kind == SADMM_BLOCK_CONTACT) ++s->contacts;
        else s->hard_rows += block.rows;
    }
    if (6 * s->bodies > INT32_MAX || 3 * s->contacts > INT32_MAX || s->hard_rows > INT32_MAX)
        return sadmm_fail(error, SADMM_ERROR_LIMIT,
                          "%lld bodies, %lld contacts, %lld hard rows: matrix sizes must fit 32-bit indices",
                          (long long)s->bodies, (long long)s->contacts, (long long)s->hard_rows);
    return SADMM_OK;
}

/* Add the transposed rows of one body: column of row r = first + r. Zeros are left out. */
static bool add_rows(struct sadmm_triplets *m, int32_t body, const double *jacobian, int rows, int32_t first)
{
    if (body < 0) return true;
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < 6; ++c)
            if (jacobian[6 * r + c] != 0 && !sadmm_triplets_add(m, 6 * body + c, first + r, jacobian[6 * r + c]))
                return false;
    return true;
}

/* J of a contact given by geometry on one body: rows n, t1, t2; sign +1 for b, -1 for a. */
static void contact_rows(const sadmm_problem_contact *contact, const double arm[3], double sign, double J[18])
{
    mat3 frame = sadmm_contact_frame(contact->normal);
    for (int r = 0; r < 3; ++r) sadmm_contact_row(frame.r[r], arm, sign, J + 6 * r);
}

static bool add_bodies(const double *A, const double *b, struct sadmm_global_problem *g)
{
    for (int32_t i = 0; i < g->bodies; ++i)
        for (int32_t r = 0; r < 6; ++r)
            for (int32_t c = 0; c < 6; ++c) {
                double x = A[36 * (size_t)i + 6 * (size_t)r + (size_t)c];
                if ((r == c || x != 0) && !sadmm_triplets_add(&g->M, 6 * i + r, 6 * i + c, x)) return false;
            }
    memcpy(g->f, b, 6 * (size_t)g->bodies * sizeof *b);
    return true;
}

static bool add_contact(const sadmm_problem_contact *contact, int32_t k, struct sadmm_global_problem *g)
{
    double J[18];
    v3_store(m3_mul(sadmm_contact_frame(contact->normal), v3_load(contact->velocity)), g->w + 3 * (size_t)k);
    g->w[3 * (size_t)k] += contact->error;
    g->mu[k] = contact->friction;
    contact_rows(contact, contact->arm_a, -1, J);
    if (!add_rows(&g->H, contact->body_a, J, 3, 3 * k)) return false;
    contact_rows(contact, contact->arm_b, 1, J);
    return add_rows(&g->H, contact->body_b, J, 3, 3 * k);
}

static bool add_block(const sadmm_problem_block *block, int32_t *contact, int32_t *hard, struct sadmm_global_problem *g)
{
    struct sadmm_triplets *m = &g->G;
    int32_t first = *hard;
    if (block->kind == SADMM_BLOCK_CONTACT) {
        m = &g->H;
        first = 3 * *contact;
        g->mu[*contact] = block->friction;
        memcpy(g->w + first, block->error, 3 * sizeof *g->w);
        ++*contact;
    } else {
        memcpy(g->b + first, block->error, (size_t)block->rows * sizeof *g->b);
        *hard += block->rows;
    }
    return add_rows(m, block->body_a, block->jacobian_a, block->rows, first) &&
           add_rows(m, block->body_b, block->jacobian_b, block->rows, first);
}

static sadmm_status fill(sadmm_problem *problem, const struct sizes *s, struct sadmm_global_problem *g,
                         struct sadmm_error *error)
{
    size_t n = (size_t)s->bodies;
    double *A = sadmm_alloc(42 * n, sizeof *A), *b = A ? A + 36 * n : NULL;
    bool allocated = A && g->f && g->w && g->mu && g->b;
    int32_t contact = 0, hard = 0;
    sadmm_status status = SADMM_OK;
    if (allocated) status = sadmm_problem_get_bodies(problem, A, b, NULL);
    if (allocated && status == SADMM_OK) allocated = add_bodies(A, b, g);
    sadmm_free(A);
    for (; allocated && status == SADMM_OK && contact < s->points; ++contact) {
        sadmm_problem_contact c;
        status = sadmm_problem_get_contact(problem, contact, &c);
        if (status == SADMM_OK) allocated = add_contact(&c, contact, g);
    }
    for (int32_t k = 0; allocated && status == SADMM_OK && k < s->blocks; ++k) {
        sadmm_problem_block block;
        status = sadmm_problem_get_block(problem, k, &block);
        if (status == SADMM_OK) allocated = add_block(&block, &contact, &hard, g);
    }
    if (status != SADMM_OK) return sadmm_fail(error, status, "%s", sadmm_problem_message(problem));
    return allocated ? SADMM_OK : sadmm_fail_memory(error, "the matrix form of a problem");
}

sadmm_status sadmm_global_from_problem(sadmm_problem *problem, struct sadmm_global_problem *g,
                                       struct sadmm_error *error)
{
    struct sizes s;
    memset(g, 0, sizeof *g);
    sadmm_status status = measure(problem, &s, error);
    if (status != SADMM_OK) return status;
    g->bodies = (int32_t)s.bodies;
    g->contacts = (int32_t)s.contacts;
    g->hard_rows = (int32_t)s.hard_rows;
    g->M.rows = g->M.columns = g->H.rows = g->G.rows = 6 * g->bodies;
    g->H.columns = 3 * g->contacts;
    g->G.columns = g->hard_rows;
    g->f = sadmm_alloc(6 * (size_t)g->bodies, sizeof *g->f);
    g->w = sadmm_alloc(3 * (size_t)g->contacts, sizeof *g->w);
    g->mu = sadmm_alloc((size_t)g->contacts, sizeof *g->mu);
    g->b = sadmm_alloc((size_t)g->hard_rows, sizeof *g->b);
    status = fill(problem, &s, g, error);
    if (status != SADMM_OK) sadmm_global_problem_free(g);
    return status;
}

/* ---- to a problem ------------------------------------------------------------------------------------------------ */

enum { NO_BODY = -2 }; /* a side that no entry has claimed yet */

/* Put an entry of H or G in a block: row `r` of the block, degree of freedom `dof` of the whole. */
static bool put_entry(sadmm_problem_block *block, int r, int32_t dof, double value)
{
    int32_t body = dof / 6;
    double *J = NULL;
    if (block->body_a == NO_BODY || block->body_a == body) {
        block->body_a = body;
        J = block->jacobian_a;
    } else if (block->body_b == NO_BODY || block->body_b == body) {
        block->body_b = body;
        J = block->jacobian_b;
    }
    if (!J) return false;
    J[6 * r + dof % 6] += value;
    return true;
}

/* The order of entries in a file must not matter: a is the lower body, or the world. */
static void order_sides(sadmm_problem_block *block)
{
    if (block->body_b == NO_BODY) block->body_b = -1;
    if (block->body_b >= 0 && block->body_a < block->body_b) return;
    int32_t body = block->body_a;
    double J[36];
    memcpy(J, block->jacobian_a, sizeof J);
    memcpy(block->jacobian_a, block->jacobian_b, sizeof J);
    memcpy(block->jacobian_b, J, sizeof J);
    block->body_a = block->body_b;
    block->body_b = body;
}

static sadmm_status gather(const struct sadmm_triplets *m, int rows, const char *name, const char *what,
                           sadmm_problem_block *blocks, struct sadmm_error *error)
{
    int32_t count = m->columns / rows;
    for (int32_t k = 0; k < count; ++k) blocks[k].body_a = blocks[k].body_b = NO_BODY;
    for (size_t e = 0; e < m->count; ++e) {
        int32_t k = m->column[e] / rows;
        if (m->value[e] == 0) continue;
        if (!put_entry(&blocks[k], m->column[e] % rows, m->row[e], m->value[e]))
            return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                              "%s %d (in %s) acts on more than two bodies (%d, %d and %d): only pairs are solved", what,
                              k, name, blocks[k].body_a, blocks[k].body_b, m->row[e] / 6);
    }
    for (int32_t k = 0; k < count; ++k) {
        if (blocks[k].body_a == NO_BODY)
            return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "%s %d (in %s) acts on no body: its columns are 0", what,
                              k, name);
        order_sides(&blocks[k]);
    }
    return SADMM_OK;
}

/* Join neighbouring one-row blocks of the same bodies, in place; returns how many blocks remain. */
static int32_t join_rows(sadmm_problem_block *rows, int32_t count)
{
    int32_t n = 0;
    for (int32_t k = 0; k < count; ++k) {
        sadmm_problem_block *last = n > 0 ? &rows[n - 1] : NULL;
        if (last && last->rows < 6 && last->body_a == rows[k].body_a && last->body_b == rows[k].body_b) {
            int r = last->rows++;
            memcpy(last->jacobian_a + 6 * r, rows[k].jacobian_a, 6 * sizeof(double));
            memcpy(last->jacobian_b + 6 * r, rows[k].jacobian_b, 6 * sizeof(double));
            last->error[r] = rows[k].error[0];
        } else {
            if (n != k) rows[n] = rows[k];
            ++n;
        }
    }
    return n;
}

static sadmm_status gather_bodies(const struct sadmm_global_problem *g, double *A, struct sadmm_error *error)
{
    for (size_t e = 0; e < g->M.count; ++e) {
        int32_t row = g->M.row[e], column = g->M.column[e];
        if (row / 6 == column / 6)
            A[36 * (size_t)(row / 6) + (size_t)(6 * (row % 6) + column % 6)] += g->M.value[e];
        else if (g->M.value[e] != 0)
            return sadmm_fail(
                error, SADMM_ERROR_UNSUPPORTED,
                "M is not block diagonal: entry (%d, %d) couples bodies %d and %d; only rigid bodies of 6 "
                "degrees of freedom each are solved",
                row, column, row / 6, column / 6);
    }
    return SADMM_OK;
}

static sadmm_status gather_blocks(const struct sadmm_global_problem *g, sadmm_problem_block *blocks, int32_t *count,
                                  struct sadmm_error *error)
{
    sadmm_problem_block *hard = blocks + g->contacts;
    sadmm_status status = gather(&g->H, 3, "H", "contact", blocks, error);
    if (status == SADMM_OK) status = gather(&g->G, 1, "G", "bilateral constraint", hard, error);
    if (status != SADMM_OK) return status;
    for (int32_t k = 0; k < g->contacts; ++k) {
        blocks[k].kind = SADMM_BLOCK_CONTACT;
        blocks[k].rows = 3;
        blocks[k].friction = g->mu[k];
        memcpy(blocks[k].error, g->w + 3 * (size_t)k, 3 * sizeof(double));
    }
    for (int32_t k = 0; k < g->hard_rows; ++k) {
        hard[k].kind = SADMM_BLOCK_HARD;
        hard[k].rows = 1;
        hard[k].error[0] = g->b[k];
    }
    *count = g->contacts + join_rows(hard, g->hard_rows);
    return SADMM_OK;
}

static size_t count_nonzero(const struct sadmm_triplets *m)
{
    size_t count = 0;
    for (size_t e = 0; e < m->count; ++e) count += m->value[e] != 0;
    return count;
}

/* Before anything is allocated by the sizes: a matrix that has fewer entries than it must have is no reason to. */
static sadmm_status check_counts(const struct sadmm_global_problem *g, struct sadmm_error *error)
{
    size_t M = count_nonzero(&g->M), H = count_nonzero(&g->H), G = count_nonzero(&g->G);
    if (M < 6 * (size_t)g->bodies)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "M has %zu entries that are not 0, %d rows: must have one in each", M, 6 * g->bodies);
    if (H < (size_t)g->contacts)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                          "H has %zu entries that are not 0, for %d contacts: some act on no body", H, g->contacts);
    if (G < (size_t)g->hard_rows)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                          "G has %zu entries that are not 0, in %d columns: some act on no body", G, g->hard_rows);
    return SADMM_OK;
}

sadmm_status sadmm_global_to_problem(const struct sadmm_global_problem *g, sadmm_problem **out,
                                     struct sadmm_error *error)
{
    sadmm_problem *problem = NULL;
    *out = NULL;
    sadmm_status status = check_counts(g, error);
    if (status != SADMM_OK) return status;
    double *A = sadmm_alloc(36 * (size_t)g->bodies, sizeof *A);
    sadmm_problem_block *blocks = sadmm_alloc((size_t)g->contacts + (size_t)g->hard_rows, sizeof *blocks);
    int32_t count = 0;
    if (!A || !blocks) status = sadmm_fail_memory(error, "the blocks of a problem");
    if (status == SADMM_OK) status = gather_bodies(g, A, error);
    if (status == SADMM_OK) status = gather_blocks(g, blocks, &count, error);
    if (status == SADMM_OK) {
        status = sadmm_problem_create(&problem);
        if (status == SADMM_OK) status = sadmm_problem_set_bodies(problem, g->bodies, A, g->f, NULL);
        if (status == SADMM_OK) status = sadmm_problem_set_blocks(problem, count, blocks, NULL);
        if (status != SADMM_OK) sadmm_fail(error, status, "%s", problem ? sadmm_problem_message(problem) : "no memory");
    }
    sadmm_free(A);
    sadmm_free(blocks);
    if (status == SADMM_OK) *out = problem;
    else sadmm_problem_destroy(problem);
    return status;
}

/* ---- solutions --------------------------------------------------------------------------------------------------- */

void sadmm_global_solution_free(struct sadmm_global_solution *s)
{
    sadmm_free(s->v);
    sadmm_free(s->u);
    sadmm_free(s->r);
    sadmm_free(s->l);
    memset(s, 0, sizeof *s);
}

/* out[r] += row r of J times the body's velocity. */
static void add_velocity(const double *J, int rows, const double *v, int32_t body, double *out)
{
    if (body < 0) return;
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < 6; ++c) out[r] += J[6 * r + c] * v[6 * (size_t)body + (size_t)c];
}

static void contact_solution(const sadmm_problem_contact *contact, const double *v, const double impulse[3],
                             double u[3], double r[3])
{
    double J[18];
    mat3 frame = sadmm_contact_frame(contact->normal);
    v3_store(m3_mul(frame, v3_load(contact->velocity)), u);
    u[0] += contact->error;
    contact_rows(contact, contact->arm_a, -1, J);
    add_velocity(J, 3, v, contact->body_a, u);
    contact_rows(contact, contact->arm_b, 1, J);
    add_velocity(J, 3, v, contact->body_b, u);
    v3_store(m3_mul(frame, v3_load(impulse)), r);
}

static sadmm_status fill_solution(sadmm_problem *problem, const struct sizes *s,
                                  struct sadmm_global_solution *solution, double *impulses, double *lambda)
{
    int32_t contact = 0, hard = 0;
    sadmm_status status = sadmm_problem_get_solution(problem, solution->v, impulses, lambda);
    for (; status == SADMM_OK && contact < s->points; ++contact) {
        sadmm_problem_contact c;
        size_t at = 3 * (size_t)contact;
        status = sadmm_problem_get_contact(problem, contact, &c);
        if (status == SADMM_OK)
            contact_solution(&c, solution->v, impulses + at, solution->u + at, solution->r + at);
    }
    for (int32_t k = 0; status == SADMM_OK && k < s->blocks; ++k) {
        sadmm_problem_block block;
        const double *multiplier = lambda + 6 * (size_t)k;
        status = sadmm_problem_get_block(problem, k, &block);
        if (status != SADMM_OK) break;
        if (block.kind == SADMM_BLOCK_CONTACT) {
            double *u = solution->u + 3 * (size_t)contact;
            memcpy(u, block.error, 3 * sizeof *u);
            add_velocity(block.jacobian_a, 3, solution->v, block.body_a, u);
            add_velocity(block.jacobian_b, 3, solution->v, block.body_b, u);
            memcpy(solution->r + 3 * (size_t)contact++, multiplier, 3 * sizeof *multiplier);
        } else {
            memcpy(solution->l + hard, multiplier, (size_t)block.rows * sizeof *multiplier);
            hard += block.rows;
        }
    }
    return status;
}

sadmm_status sadmm_global_solution_from_problem(sadmm_problem *problem, struct sadmm_global_solution *solution,
                                                struct sadmm_error *error)
{
    struct sizes s;
    memset(solution, 0, sizeof *solution);
    sadmm_status status = measure(problem, &s, error);
    if (status != SADMM_OK) return status;
    solution->bodies = (int32_t)s.bodies;
    solution->contacts = (int32_t)s.contacts;
    solution->hard_rows = (int32_t)s.hard_rows;
    solution->v = sadmm_alloc(6 * (size_t)s.bodies, sizeof(double));
    solution->u = sadmm_alloc(3 * (size_t)s.contacts, sizeof(double));
    solution->r = sadmm_alloc(3 * (size_t)s.contacts, sizeof(double));
    solution->l = sadmm_alloc((size_t)s.hard_rows, sizeof(double));
    double *impulses = sadmm_alloc(3 * (size_t)s.points, sizeof(double));
    double *lambda = sadmm_alloc(6 * (size_t)s.blocks, sizeof(double));
    if (!solution->v || !solution->u || !solution->r || !solution->l || !impulses || !lambda)
        status = sadmm_fail_memory(error, "a solution");
    else if ((status = fill_solution(problem, &s, solution, impulses, lambda)) != SADMM_OK)
        sadmm_fail(error, status, "%s", sadmm_problem_message(problem));
    sadmm_free(impulses);
    sadmm_free(lambda);
    if (status != SADMM_OK) sadmm_global_solution_free(solution);
    return status;
}
