/* Steps 2-4 of constraints given by Jacobian rows: general contacts, hard and soft blocks. */
#include <string.h>

#include "core/math/contact.h"
#include "cpu.h"

/* Row r of J_a v_a + J_b v_b. */
static real row_velocity(const struct row_block *block, int r, const real *va, const real *vb)
{
    real x = 0;
    for (int j = 0; j < 6; ++j) x += block->jacobian_a[6 * r + j] * va[j] + block->jacobian_b[6 * r + j] * vb[j];
    return x;
}

/* lambda^{l+1} (Step 3), s = 1/beta_a + 1/beta_b. */
static void update_lambda(const struct row_block *block, const real *va, const real *vb, real s, real out[6])
{
    real y[3];
    for (int r = 0; r < block->rows; ++r) {
        real x = row_velocity(block, r, va, vb), old = block->lambda[r];
        if (block->kind == SADMM_BLOCK_SOFT)
            out[r] = soft_multiplier(block->stiffness[r], block->damping[r], block->error[r], x, s, old);
        else if (block->kind == SADMM_BLOCK_HARD)
            out[r] = block->active[r] ? old - (x + block->error[r]) / s : 0;
        else
            y[r] = old - (x + block->error[r]) / s;
    }
    if (block->kind == SADMM_BLOCK_CONTACT) contact_project_rows(y, block->friction, out);
}

/* The same with the block's own weights: s lambda has n / B in place of s, n the number of dynamic bodies. And the change
 * by itself. */
static void update_lambda_fast(const struct row_block *block, const real *va, const real *vb, real inv_n, real change[6],
                               real out[6])
{
    real u[6], along = 0, step[6] = {0};
    for (int r = 0; r < block->rows; ++r) {
        u[r] = row_velocity(block, r, va, vb);
        if (block->kind != SADMM_BLOCK_SOFT) u[r] += block->error[r];
        along += block->along[r] * u[r];
    }
    for (int r = 0; r < block->rows; ++r) {
        real old = block->lambda[r], weight = inv_n * block->weight[r];
        step[r] = weight * u[r];
        if (block->kind == SADMM_BLOCK_SOFT)
            change[r] = soft_change(block->stiffness[r], block->damping[r], block->error[r], u[r], 1 / weight, old);
        else
            change[r] = block->active[r] ? -(step[r] + inv_n * block->along[r] * along) : 0;
        out[r] = old + change[r];
    }
    if (block->kind == SADMM_BLOCK_CONTACT) contact_change_rows(block->lambda, step, block->friction, change, out);
}

/* J^T lambda on both sides. */
static void write_wrenches(const struct sadmm_context *c, real *wrenches, size_t record, const struct row_block *block,
                           const real lambda[6])
{
    real *on_a = wrenches + record * ROW, *on_b = wrenches + (c->record_count + record) * ROW;
    memset(on_a, 0, ROW * sizeof *on_a);
    memset(on_b, 0, ROW * sizeof *on_b);
    for (int r = 0; r < block->rows; ++r)
        for (int j = 0; j < 6; ++j) {
            on_a[j] += block->jacobian_a[6 * r + j] * lambda[r];
            on_b[j] += block->jacobian_b[6 * r + j] * lambda[r];
        }
}

static void sweep_row_block(struct sadmm_context *c, size_t k, enum cpu_sweep sweep, double *primal)
{
    struct row_block *block = &c->row_blocks[k];
    size_t record = c->pair_block_count * (size_t)LANES + k;
    if (sweep == CPU_SWEEP_START) {
        write_wrenches(c, c->wrenches, record, block, block->lambda);
        return;
    }
    const real *va = &c->state[(size_t)block->body_a * ROW], *vb = &c->state[(size_t)block->body_b * ROW];
    real lambda[6], delta[6], inv_beta = real_max(va[STATE_INV_BETA], vb[STATE_INV_BETA]);
    bool both = block->body_a < c->bodies && block->body_b < c->bodies;
    if (c->fast) update_lambda_fast(block, va, vb, both ? (real)0.5 : 1, delta, lambda);
    else update_lambda(block, va, vb, va[STATE_INV_BETA] + vb[STATE_INV_BETA], lambda);
    real relaxation = (real)c->settings.relaxation, largest = 0, passed[6];
    for (int r = 0; r < block->rows; ++r) {
        real old = block->lambda[r];
        if (!c->fast) delta[r] = lambda[r] - old;
        passed[r] = c->fast ? delta[r] : sweep == CPU_SWEEP_MEASURE ? lambda[r] : lambda[r] + delta[r];
        block->lambda[r] = sweep == CPU_SWEEP_RELAX ? old + relaxation * delta[r] : lambda[r];
        if (c->fast) inv_beta = block->active[r] ? 1 / (block->weight[r] + block->along[r] * block->along[r]) : 0;
        largest = real_max(largest, real_abs(delta[r]) * inv_beta);
    }
    write_wrenches(c, c->wrenches, record, block, passed);
    if (sweep == CPU_SWEEP_MEASURE) write_wrenches(c, c->change, record, block, delta);
    if (cpu_sweep_measures(sweep)) *primal = fmax(*primal, (double)largest);
}

void CPU(sweep_row_blocks)(struct sadmm_context *c, size_t begin, size_t end, enum cpu_sweep sweep, double *primal)
{
    for (size_t k = begin; k < end; ++k) sweep_row_block(c, k, sweep, primal);
}
