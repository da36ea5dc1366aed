/* What a problem is made of: bodies, contacts, blocks. Contacts are grouped into pairs here, blocks become constraint
 * rows (core/model/rows.h). Every call that replaces a part builds the new part first and swaps it in last, so that a
 * failure loses nothing. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/dense6.h"
#include "problem_internal.h"

enum { MAX_BODIES = 1 << 27, MAX_CONSTRAINTS = 1 << 28 };
/* Of the numbers of A, b and the constraints: J A^-1 J^T lambda of rows, masses and multipliers of 1e60, 1e-60 and 1e60
 * is 1e240, within double's 1e308. */
static const double VALUE_LIMIT = 1e60;

/* ---- checks -------------------------------------------------------------------------------------------------- */

static sadmm_status check_count(const char *what, int32_t count, int32_t limit, struct sadmm_error *error)
{
    if (count < 0) REFUSE("count = %d %s: must be in [0, %d]", count, what, limit);
    if (count > limit)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "count = %d %s: must be in [0, %d]", count, what, limit);
    return SADMM_OK;
}

static bool in_range(double x) { return fabs(x) <= VALUE_LIMIT; } /* NaN is not */

/* `values` (count x width), data of the problem; NULL is fine. */
static sadmm_status check_data(const char *name, const double *values, int32_t count, int width,
                               struct sadmm_error *error)
{
    for (size_t i = 0; values && i < (size_t)count * (size_t)width; ++i)
        if (!in_range(values[i]))
            REFUSE("%s[%zu][%zu] = %g: must be finite and within +-%g", name, i / (size_t)width, i % (size_t)width,
                   values[i], VALUE_LIMIT);
    return SADMM_OK;
}

/* A vector inside item `index` of an array argument. */
static sadmm_status check_vector(const char *array, int32_t index, const char *field, const double *x, int size,
                                 double least, struct sadmm_error *error)
{
    for (int i = 0; i < size; ++i) {
        if (!in_range(x[i]))
            REFUSE("%s[%d].%s[%d] = %g: must be finite and within +-%g", array, index, field, i, x[i], VALUE_LIMIT);
        if (x[i] < least) REFUSE("%s[%d].%s[%d] = %g: must be >= %g", array, index, field, i, x[i], least);
    }
    return SADMM_OK;
}

static sadmm_status check_number(const char *array, int32_t index, const char *field, double x,
                                 struct sadmm_error *error)
{
    if (!in_range(x)) REFUSE("%s[%d].%s = %g: must be finite and within +-%g", array, index, field, x, VALUE_LIMIT);
    return SADMM_OK;
}

static sadmm_status check_friction(const char *array, int32_t index, double mu, struct sadmm_error *error)
{
    if (!(mu >= 0) || !in_range(mu)) REFUSE("%s[%d].friction = %g: must be in [0, %g]", array, index, mu, VALUE_LIMIT);
    return SADMM_OK;
}

static sadmm_status check_body_pair(const char *array, int32_t index, int32_t a, int32_t b, int32_t bodies,
                                    struct sadmm_error *error)
{
    if (a < -1 || a >= bodies) REFUSE("%s[%d].body_a = %d: must be in [-1, %d]", array, index, a, bodies - 1);
    if (b < -1 || b >= bodies) REFUSE("%s[%d].body_b = %d: must be in [-1, %d]", array, index, b, bodies - 1);
    if (a == b) REFUSE("%s[%d].body_a = body_b = %d: must be two bodies, at least one of them >= 0", array, index, a);
    return SADMM_OK;
}

/* What is kept of a mass matrix that is symmetric but for its decimals; of a symmetric one every bit. */
static void symmetric_part(const double A[36], double mean[36])
{
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j <= i; ++j)
            mean[6 * i + j] = mean[6 * j + i] = A[6 * i + j] + 0.5 * (A[6 * j + i] - A[6 * i + j]);
}

/* Symmetric to 1e-9 of the diagonal's scale (a file has so many decimals), and what is kept of it positive definite. */
static sadmm_status check_mass(int32_t index, const double A[36], struct sadmm_error *error)
{
    double mean[36], L[36];
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < i; ++j) {
            double scale = sqrt(fabs(A[7 * i])) * sqrt(fabs(A[7 * j]));
            if (!(fabs(A[6 * i + j] - A[6 * j + i]) <= 1e-9 * scale))
                REFUSE("A[%d]: entries (%d, %d) = %g and (%d, %d) = %g: must be symmetric", index, i, j, A[6 * i + j],
                       j, i, A[6 * j + i]);
        }
    symmetric_part(A, mean);
    if (!dense6_cholesky(mean, L)) REFUSE("A[%d]: must be positive definite, and is not to double precision", index);
    return SADMM_OK;
}

static bool row_acts(const sadmm_problem_block *block, int row)
{
    for (int j = 0; j < 6; ++j)
        if ((block->body_a >= 0 && block->jacobian_a[6 * row + j] != 0) ||
            (block->body_b >= 0 && block->jacobian_b[6 * row + j] != 0))
            return true;
    return false;
}

/* `values` (count x width), a start or a solution, which may be anything finite; NULL is fine. */
sadmm_status sadmm_check_values(const char *name, const double *values, int32_t count, int width,
                                struct sadmm_error *error)
{
    for (size_t i = 0; values && i < (size_t)count * (size_t)width; ++i)
        if (!isfinite(values[i]))
            REFUSE("%s[%zu][%zu] = %g: must be finite", name, i / (size_t)width, i % (size_t)width, values[i]);
    return SADMM_OK;
}

/* Memory for what a solve of this size has to save. */
static sadmm_status reserve_saved(sadmm_problem *problem, int32_t bodies, size_t points, size_t rows,
                                  struct sadmm_error *error)
{
    size_t needed = 6 * (size_t)bodies + 3 * points + rows;
    if (SADMM_GROW(problem->saved, 0, needed)) return SADMM_OK;
    return sadmm_fail_memory(error, "the problem's saved values");
}

/* ---- bodies -------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_problem_set_bodies(sadmm_problem *problem, int32_t count, const double *A, const double *b,
                                      const double *v0)
{
    TRY(sadmm_check_problem(problem));
    struct sadmm_error *error = &problem->error;
    TRY(check_count("bodies", count, MAX_BODIES, error));
    if (count > 0 && !A) REFUSE("A = NULL: must be given for %d bodies", count);
    if (count > 0 && !b) REFUSE("b = NULL: must be given for %d bodies", count);
    TRY(check_data("A", A, count, 36, error));
    TRY(check_data("b", b, count, 6, error));
    TRY(sadmm_check_values("v0", v0, count, 6, error));
    for (int32_t i = 0; i < count; ++i) TRY(check_mass(i, A + 36 * (size_t)i, error));
    TRY(reserve_saved(problem, count, 0, 0, error));

    size_t n = (size_t)count;
    double *new_A = sadmm_alloc(36 * n, sizeof(double));
    double *new_b = sadmm_alloc(6 * n, sizeof(double));
    double *velocity = sadmm_alloc(6 * n, sizeof(double));
    if (!new_A || !new_b || !velocity) {
        sadmm_free(new_A);
        sadmm_free(new_b);
        sadmm_free(velocity);
        return sadmm_fail_memory(error, "the problem's bodies");
    }
    for (size_t k = 0; k < n; ++k) {
        double *mean = new_A + 36 * k, L[36];
        symmetric_part(A + 36 * k, mean);
        memcpy(new_b + 6 * k, b + 6 * k, 6 * sizeof(double));
        if (v0) {
            memcpy(velocity + 6 * k, v0 + 6 * k, 6 * sizeof(double));
        } else {
            dense6_cholesky(mean, L);
            dense6_solve(L, b + 6 * k, velocity + 6 * k);
        }
    }

    sadmm_problem_drop_parts(problem);
    problem->body_count = count;
    problem->A = new_A;
    problem->b = new_b;
    problem->velocity = velocity;
    return SADMM_OK;
}

/* ---- contacts ------------------------------------------------------------------------------------------------ */

/* Does its static side move? */
static bool is_kinematic(const sadmm_problem_contact *contact)
{
    return contact->velocity[0] != 0 || contact->velocity[1] != 0 || contact->velocity[2] != 0;
}

static sadmm_status check_contact(int32_t index, const sadmm_problem_contact *contact, int32_t bodies,
                                  struct sadmm_error *error)
{
    TRY(check_body_pair("contacts", index, contact->body_a, contact->body_b, bodies, error));
    TRY(check_vector("contacts", index, "normal", contact->normal, 3, -HUGE_VAL, error));
    const double *n = contact->normal;
    double length = hypot(hypot(n[0], n[1]), n[2]);
    if (!(fabs(length - 1) <= 1e-6)) REFUSE("contacts[%d].normal: length = %g: must be 1 within 1e-6", index, length);
    if (contact->body_a >= 0) TRY(check_vector("contacts", index, "arm_a", contact->arm_a, 3, -HUGE_VAL, error));
    if (contact->body_b >= 0) TRY(check_vector("contacts", index, "arm_b", contact->arm_b, 3, -HUGE_VAL, error));
    TRY(check_number("contacts", index, "error", contact->error, error));
    TRY(check_vector("contacts", index, "velocity", contact->velocity, 3, -HUGE_VAL, error));
    if (contact->body_a >= 0 && contact->body_b >= 0 && is_kinematic(contact))
        REFUSE("contacts[%d].velocity = (%g, %g, %g): must be 0, for neither body is -1", index, contact->velocity[0],
               contact->velocity[1], contact->velocity[2]);
    return check_friction("contacts", index, contact->friction, error);
}

/* Backends share normal, friction and arm_b - arm_a (from b's centre of mass to a's) among the points of a pair. */
static bool continues_pair(const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *first,
                           const struct sadmm_contact_pair *next, const struct sadmm_contact_point *point)
{
    if (pair->count >= SADMM_MAX_POINTS || pair->body_a != next->body_a || pair->body_b != next->body_b) return false;
    if (memcmp(pair->normal, next->normal, sizeof pair->normal) != 0) return false;
    if (memcmp(&pair->friction, &next->friction, sizeof pair->friction) != 0) return false;
    if (pair->body_a < 0 || pair->body_b < 0) return true;
    double scale = 0, difference = 0;
    for (int i = 0; i < 3; ++i) {
        scale = fmax(scale, fmax(fmax(fabs(first->arm_a[i]), fabs(first->arm_b[i])),
                                 fmax(fabs(point->arm_a[i]), fabs(point->arm_b[i]))));
        difference = fmax(difference, fabs((first->arm_b[i] - first->arm_a[i]) - (point->arm_b[i] - point->arm_a[i])));
    }
    return difference <= 1e-12 * scale;
}

/* Number of the contact's kinematic body, which it has to itself or shares with the contact before it; -1: none. */
static int32_t load_kinematic(const sadmm_problem_contact *contact, double *kinematic, int32_t *count)
{
    double own[6] = {0};
    if (!is_kinematic(contact)) return -1;
    for (int k = 0; k < 3; ++k) own[k] = contact->body_a < 0 ? -contact->velocity[k] : contact->velocity[k];
    if (*count == 0 || memcmp(kinematic + 6 * ((size_t)*count - 1), own, sizeof own) != 0)
        memcpy(kinematic + 6 * (size_t)(*count)++, own, sizeof own);
    return *count - 1;
}

/* kinematic: load_kinematic. */
static void load_contact(const sadmm_problem_contact *contact, const double *impulse, int32_t kinematic,
                         struct sadmm_contact_pair *pair, struct sadmm_contact_point *point)
{
    memset(pair, 0, sizeof *pair);
    memset(point, 0, sizeof *point);
    pair->body_a = contact->body_a;
    pair->body_b = contact->body_b;
    if (kinematic >= 0) *(contact->body_a < 0 ? &pair->body_a : &pair->body_b) = sadmm_kinematic(kinematic);
    pair->shape_a = pair->shape_b = -1;
    pair->friction = contact->friction;
    memcpy(pair->normal, contact->normal, sizeof pair->normal);
    double n2 = 0;
    for (int i = 0; i < 3; ++i) n2 += pair->normal[i] * pair->normal[i];
    if (fabs(n2 - 1) > 4 * DBL_EPSILON) /* else it is kept bit for bit */
        for (int i = 0; i < 3; ++i) pair->normal[i] /= sqrt(n2);
    if (contact->body_a >= 0) memcpy(point->arm_a, contact->arm_a, sizeof point->arm_a);
    if (contact->body_b >= 0) memcpy(point->arm_b, contact->arm_b, sizeof point->arm_b);
    point->error = contact->error;
    if (impulse) memcpy(point->impulse, impulse, sizeof point->impulse);
}

sadmm_status sadmm_problem_set_contacts(sadmm_problem *problem, int32_t count, const sadmm_problem_contact *contacts,
                                        const double *impulses0)
{
    TRY(sadmm_check_problem(problem));
    struct sadmm_error *error = &problem->error;
    TRY(check_count("contacts", count, MAX_CONSTRAINTS, error));
    if (count > 0 && !contacts) REFUSE("contacts = NULL: must be given for %d contacts", count);
    for (int32_t k = 0; k < count; ++k) TRY(check_contact(k, &contacts[k], problem->body_count, error));
    TRY(sadmm_check_values("impulses0", impulses0, count, 3, error));
    TRY(reserve_saved(problem, problem->body_count, (size_t)count, problem->rows.row_count, error));

    struct sadmm_contact_set set = {0};
    set.pairs = sadmm_alloc((size_t)count, sizeof *set.pairs);
    set.points = sadmm_alloc((size_t)count, sizeof *set.points);
    int32_t kinematic_count = 0;
    for (int32_t k = 0; k < count; ++k) kinematic_count += is_kinematic(&contacts[k]);
    double *kinematic = kinematic_count > 0 ? sadmm_alloc(6 * (size_t)kinematic_count, sizeof *kinematic) : NULL;
    if (!set.pairs || !set.points || (kinematic_count > 0 && !kinematic)) {
        sadmm_free(set.pairs);
        sadmm_free(set.points);
        sadmm_free(kinematic);
        return sadmm_fail_memory(error, "the problem's contacts");
    }
    set.point_count = (size_t)count;
    kinematic_count = 0;
    for (int32_t k = 0; k < count; ++k) {
        struct sadmm_contact_pair next;
        load_contact(&contacts[k], impulses0 ? impulses0 + 3 * (size_t)k : NULL,
                     load_kinematic(&contacts[k], kinematic, &kinematic_count), &next, &set.points[k]);
        struct sadmm_contact_pair *last = set.pair_count ? &set.pairs[set.pair_count - 1] : NULL;
        if (last && continues_pair(last, &set.points[last->first], &next, &set.points[k])) {
            ++last->count;
        } else {
            next.first = k;
            next.count = 1;
            set.pairs[set.pair_count++] = next;
        }
    }

    sadmm_free(problem->contacts.pairs);
    sadmm_free(problem->contacts.points);
    sadmm_free(problem->kinematic);
    problem->kinematic = kinematic;
    problem->kinematic_count = kinematic_count;
    problem->contacts = set;
    return SADMM_OK;
}

/* ---- blocks -------------------------------------------------------------------------------------------------- */

static sadmm_status check_laws(int32_t index, const sadmm_problem_block *block, struct sadmm_error *error)
{
    TRY(check_vector("blocks", index, "gain", block->gain, block->rows, 0, error));
    TRY(check_vector("blocks", index, "compliance", block->compliance, block->rows, 0, error));
    for (int r = 0; r < block->rows; ++r) {
        const double lower = block->lower[r], upper = block->upper[r];
        if (block->gain[r] == 0 && block->compliance[r] == 0)
            REFUSE("blocks[%d].gain[%d] = blocks[%d].compliance[%d] = 0: one must be > 0", index, r, index, r);
        if (!(in_range(lower) || lower == -INFINITY) || !(in_range(upper) || upper == INFINITY) || lower > upper)
            REFUSE("blocks[%d].lower[%d] = %g, upper[%d] = %g: must be lower <= upper, within +-%g or infinite", index,
                   r, lower, r, upper, VALUE_LIMIT);
    }
    return SADMM_OK;
}

static sadmm_status check_block(int32_t index, const sadmm_problem_block *block, int32_t bodies,
                                struct sadmm_error *error)
{
    if ((unsigned)block->kind > SADMM_BLOCK_ROWS)
        REFUSE("blocks[%d].kind = %d: must be in [0, 3]", index, (int)block->kind);
    bool contact = block->kind == SADMM_BLOCK_CONTACT;
    if (contact ? block->rows != 3 : block->rows < 1 || block->rows > 6)
        REFUSE("blocks[%d].rows = %d: must be %s", index, block->rows, contact ? "3 for a contact" : "in [1, 6]");
    TRY(check_body_pair("blocks", index, block->body_a, block->body_b, bodies, error));
    int rows = block->rows;
    if (block->body_a >= 0)
        TRY(check_vector("blocks", index, "jacobian_a", block->jacobian_a, 6 * rows, -HUGE_VAL, error));
    if (block->body_b >= 0)
        TRY(check_vector("blocks", index, "jacobian_b", block->jacobian_b, 6 * rows, -HUGE_VAL, error));
    TRY(check_vector("blocks", index, "error", block->error, rows, -HUGE_VAL, error));
    if (contact) {
        TRY(check_friction("blocks", index, block->friction, error));
        if (!row_acts(block, 0))
            REFUSE("blocks[%d]: the normal row of a contact must not be zero on both bodies", index);
    }
    if (block->kind == SADMM_BLOCK_SOFT) {
        TRY(check_vector("blocks", index, "stiffness", block->stiffness, rows, 0, error));
        TRY(check_vector("blocks", index, "damping", block->damping, rows, 0, error));
    }
    return block->kind == SADMM_BLOCK_ROWS ? check_laws(index, block, error) : SADMM_OK;
}

/* Only what the block's kind and size use; the rest is 0, so that no reader has to check `rows` first. */
static void load_block(const sadmm_problem_block *given, sadmm_problem_block *block)
{
    size_t rows = (size_t)given->rows, row = 6 * sizeof(double);
    memset(block, 0, sizeof *block);
    block->kind = given->kind;
    block->rows = given->rows;
    block->body_a = given->body_a;
    block->body_b = given->body_b;
    if (given->body_a >= 0) memcpy(block->jacobian_a, given->jacobian_a, rows * row);
    if (given->body_b >= 0) memcpy(block->jacobian_b, given->jacobian_b, rows * row);
    memcpy(block->error, given->error, rows * sizeof(double));
    if (given->kind == SADMM_BLOCK_CONTACT) block->friction = given->friction;
    if (given->kind == SADMM_BLOCK_SOFT) {
        memcpy(block->stiffness, given->stiffness, rows * sizeof(double));
        memcpy(block->damping, given->damping, rows * sizeof(double));
    }
    if (given->kind == SADMM_BLOCK_ROWS) {
        memcpy(block->gain, given->gain, rows * sizeof(double));
        memcpy(block->compliance, given->compliance, rows * sizeof(double));
        memcpy(block->lower, given->lower, rows * sizeof(double));
        memcpy(block->upper, given->upper, rows * sizeof(double));
    }
}

sadmm_status sadmm_check_lambda(const char *name, const sadmm_problem_block *blocks, int32_t count,
                                 const double *lambda, struct sadmm_error *error)
{
    for (int32_t k = 0; lambda && k < count; ++k)
        for (int r = 0; r < blocks[k].rows; ++r)
            if (!isfinite(lambda[6 * (size_t)k + (size_t)r]))
                REFUSE("%s[%d][%d] = %g: must be finite", name, k, r, lambda[6 * (size_t)k + (size_t)r]);
    return SADMM_OK;
}

static bool load_rows(const sadmm_problem_block *blocks, int32_t count, size_t row_count, const double *lambda,
                      struct sadmm_rows *rows)
{
    if (!sadmm_rows_reserve(rows, (size_t)count, row_count)) return false;
    for (int32_t k = 0; k < count; ++k)
        if (!sadmm_rows_add_block(rows, &blocks[k], lambda ? lambda + 6 * (size_t)k : NULL)) return false;
    return true;
}

sadmm_status sadmm_problem_set_blocks(sadmm_problem *problem, int32_t count, const sadmm_problem_block *blocks,
                                      const double *lambda0)
{
    TRY(sadmm_check_problem(problem));
    struct sadmm_error *error = &problem->error;
    TRY(check_count("blocks", count, MAX_CONSTRAINTS, error));
    if (count > 0 && !blocks) REFUSE("blocks = NULL: must be given for %d blocks", count);
    for (int32_t k = 0; k < count; ++k) TRY(check_block(k, &blocks[k], problem->body_count, error));
    TRY(sadmm_check_lambda("lambda0", blocks, count, lambda0, error));
    size_t row_count = 0;
    for (int32_t k = 0; k < count; ++k) row_count += (size_t)blocks[k].rows;
    if (row_count > MAX_CONSTRAINTS)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "blocks: %zu rows in all: must be in [0, %d]", row_count,
                          MAX_CONSTRAINTS);
    TRY(reserve_saved(problem, problem->body_count, problem->contacts.point_count, row_count, error));

    struct sadmm_rows rows = {0};
    sadmm_problem_block *new_blocks = sadmm_alloc((size_t)count, sizeof *new_blocks);
    for (int32_t k = 0; new_blocks && k < count; ++k) load_block(&blocks[k], &new_blocks[k]);
    if (!new_blocks || !load_rows(new_blocks, count, row_count, lambda0, &rows)) {
        sadmm_free(new_blocks);
        sadmm_rows_free(&rows);
        return sadmm_fail_memory(error, "the problem's blocks");
    }

    sadmm_free(problem->blocks);
    sadmm_rows_free(&problem->rows);
    problem->block_count = count;
    problem->blocks = new_blocks;
    problem->rows = rows;
    return SADMM_OK;
}
