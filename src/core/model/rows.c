#include "rows.h"

#include <string.h>

#include "core/base/memory.h"

void sadmm_rows_clear(struct sadmm_rows *rows) { rows->constraint_count = rows->row_count = 0; }

void sadmm_rows_free(struct sadmm_rows *rows)
{
    void *arrays[] = {rows->constraints, rows->jacobian_a, rows->jacobian_b, rows->gain, rows->bias,
                      rows->compliance,  rows->lo,         rows->hi,         rows->lambda};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; ++k) sadmm_free(arrays[k]);
    memset(rows, 0, sizeof *rows);
}

bool sadmm_rows_reserve(struct sadmm_rows *rows, size_t constraints, size_t row_count)
{
    double **numbers[] = {&rows->gain, &rows->bias, &rows->compliance, &rows->lo, &rows->hi, &rows->lambda};
    double **jacobians[] = {&rows->jacobian_a, &rows->jacobian_b};
    if (!SADMM_GROW(rows->constraints, rows->constraint_count, constraints)) return false;
    if (6 * row_count <= SADMM_ROOM(rows->jacobian_b)) return true; /* it is the last one to grow */
    for (int k = 0; k < 8; ++k) {
        double **array = k < 6 ? numbers[k] : jacobians[k - 6];
        size_t width = k < 6 ? 1 : 6;
        if (!sadmm_grow(array, rows->row_count, row_count, width * sizeof **array)) return false;
    }
    return true;
}

int32_t sadmm_rows_add(struct sadmm_rows *rows, int32_t count, int32_t body_a, int32_t body_b)
{
    size_t first = rows->row_count, n = (size_t)count;
    if (!sadmm_rows_reserve(rows, rows->constraint_count + 1, first + n)) return -1;
    rows->constraints[rows->constraint_count++] = (struct sadmm_row_constraint){
        .body_a = body_a, .body_b = body_b, .first = (int32_t)first, .count = count};
    rows->row_count += n;
    memset(rows->jacobian_a + 6 * first, 0, 6 * n * sizeof(double));
    memset(rows->jacobian_b + 6 * first, 0, 6 * n * sizeof(double));
    for (size_t r = first; r < rows->row_count; ++r) {
        sadmm_row_hard(rows, (int32_t)r, 0);
        rows->lambda[r] = 0;
    }
    return (int32_t)first;
}

void sadmm_rows_set_rigid(struct sadmm_rows *rows, const double offset[3])
{
    struct sadmm_row_constraint *constraint = &rows->constraints[rows->constraint_count - 1];
    constraint->rigid = true;
    memcpy(constraint->offset, offset, sizeof constraint->offset);
}

bool sadmm_rows_add_block(struct sadmm_rows *rows, const sadmm_problem_block *block, const double *lambda)
{
    const int32_t first = sadmm_rows_add(rows, block->rows, block->body_a, block->body_b);
    if (first < 0) return false;
    struct sadmm_row_constraint *constraint = &rows->constraints[rows->constraint_count - 1];
    size_t at = (size_t)first, n = (size_t)block->rows;
    constraint->cone = block->kind == SADMM_BLOCK_CONTACT;
    constraint->friction = constraint->cone ? block->friction : 0;
    if (block->body_a >= 0) memcpy(rows->jacobian_a + 6 * at, block->jacobian_a, 6 * n * sizeof(double));
    if (block->body_b >= 0) memcpy(rows->jacobian_b + 6 * at, block->jacobian_b, 6 * n * sizeof(double));
    for (int32_t r = 0; r < block->rows; ++r) {
        if (block->kind == SADMM_BLOCK_SOFT)
            sadmm_row_soft(rows, first + r, block->stiffness[r], block->damping[r], block->error[r]);
        else if (block->kind == SADMM_BLOCK_ROWS)
            sadmm_row_set(rows, first + r, block->gain[r], block->error[r], block->compliance[r], block->lower[r],
                          block->upper[r]);
        else
            sadmm_row_hard(rows, first + r, block->error[r]);
        if (lambda) rows->lambda[first + r] = lambda[r];
    }
    return true;
}

void sadmm_rows_block(const struct sadmm_rows *rows, size_t k, sadmm_problem_block *block)
{
    const struct sadmm_row_constraint *constraint = &rows->constraints[k];
    const size_t at = (size_t)constraint->first, n = (size_t)constraint->count;
    bool hard = true;
    memset(block, 0, sizeof *block);
    block->rows = constraint->count;
    block->body_a = constraint->body_a;
    block->body_b = constraint->body_b;
    memcpy(block->jacobian_a, rows->jacobian_a + 6 * at, 6 * n * sizeof(double));
    memcpy(block->jacobian_b, rows->jacobian_b + 6 * at, 6 * n * sizeof(double));
    memcpy(block->error, rows->bias + at, n * sizeof(double));
    for (size_t r = at; r < at + n; ++r) hard = hard && rows->gain[r] == 1 && sadmm_row_is_coupled(rows, r);
    block->kind = hard ? SADMM_BLOCK_HARD : SADMM_BLOCK_ROWS;
    if (hard) return;
    memcpy(block->gain, rows->gain + at, n * sizeof(double));
    memcpy(block->compliance, rows->compliance + at, n * sizeof(double));
    memcpy(block->lower, rows->lo + at, n * sizeof(double));
    memcpy(block->upper, rows->hi + at, n * sizeof(double));
}

bool sadmm_row_acts(const struct sadmm_rows *rows, size_t r)
{
    for (size_t j = 6 * r; j < 6 * r + 6; ++j)
        if (rows->jacobian_a[j] != 0 || rows->jacobian_b[j] != 0) return true;
    return false;
}
