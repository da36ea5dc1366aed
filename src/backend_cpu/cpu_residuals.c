/* The method `fast`: what the momentum of bodies misses, r = b - A v + J^T lambda, before iterations change it by what
 * v and lambda change. In double, from this precision's b, v and lambda, in the order of a body's records. */
#include "core/math/array3.h"
#include "cpu_rows.h"

static void add_pair(const struct sadmm_context *c, size_t record, int side, double r[6])
{
    const struct pair_block *block = &c->pair_blocks[record / (size_t)LANES];
    const size_t l = record % (size_t)LANES;
    const double sign = side ? 1 : -1;
    const double d[3] = {(double)block->d.x[l], (double)block->d.y[l], (double)block->d.z[l]};
    for (int k = 0; k < c->system->contacts->pairs[block->pair[l]].count; ++k) {
        struct cpu_point point = cpu_load_point(c, block, l, k);
        for (int j = 0; j < 3; ++j) {
            point.arm[j] += side ? d[j] : 0;
            r[j] += sign * point.impulse[j];
        }
        add_cross(point.arm, point.impulse, sign, r + 3);
    }
}

static void add_rows(const struct sadmm_context *c, size_t record, int side, double r[6])
{
    int lane;
    const struct row_block *block = cpu_row_block(c, record, &lane);
    for (int k = 0; k < cpu_row_count(c, block, lane); ++k) {
        double row[6], lambda = (double)c->row_slots[block->first + (size_t)k].lambda[lane];
        cpu_load_row(c, block, lane, side, k, row);
        for (int j = 0; j < 6; ++j) r[j] += row[j] * lambda;
    }
}

static void store_momentum_residual(struct sadmm_context *c, size_t i, const double r[6])
{
    const int32_t general = cpu_general(c, i);
    if (general >= 0) {
        for (int k = 0; k < ROW; ++k) c->momentum_residuals[(size_t)general * ROW + (size_t)k] = k < 6 ? (real)r[k] : 0;
        return;
    }
    struct body_block *block = &c->body_blocks[i / (size_t)LANES];
    size_t l = i % (size_t)LANES;
    block->residual_linear.x[l] = (real)r[0], block->residual_linear.y[l] = (real)r[1],
    block->residual_linear.z[l] = (real)r[2];
    block->residual_angular.x[l] = (real)r[3], block->residual_angular.y[l] = (real)r[4];
    block->residual_angular.z[l] = (real)r[5];
}

void CPU(recompute_residuals)(struct sadmm_context *c, size_t begin, size_t end)
{
    for (size_t i = begin; i < end; ++i) {
        double r[6];
        cpu_free_momentum(c, i, r);
        for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) {
            int side;
            const size_t record = cpu_record(c, at, &side);
            if (record < cpu_pair_records(c)) add_pair(c, record, side, r);
            else add_rows(c, record, side, r);
        }
        store_momentum_residual(c, i, r);
    }
}
