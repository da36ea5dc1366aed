/* The method `fast`: what the momentum of bodies misses, r = b - A v + J^T lambda, before iterations change it by what
 * v and lambda change. In double, from this precision's b, v and lambda, in the order of a body's records. */
#include "core/math/array3.h"
#include "cpu_rows.h"

/* The impulse of point k of a pair's lane, on b, and its arm about a (b where a is static). */
static void load_point(const struct sadmm_context *c, const struct pair_block *block, int l, int k, double impulse[3],
                       double arm[3])
{
    size_t at = block->first + (size_t)k;
    const vec *r;
    if (c->plan.contact_rows == 3) {
        const struct point_slot *slot = (const struct point_slot *)c->slots + at;
        r = &slot->arm;
        impulse[0] = (double)slot->lambda.x[l], impulse[1] = (double)slot->lambda.y[l];
        impulse[2] = (double)slot->lambda.z[l];
    } else {
        const struct normal_slot *slot = (const struct normal_slot *)c->slots + at;
        double normal = (double)slot->lambda[l];
        r = &slot->arm;
        impulse[0] = normal * (double)block->normal.x[l], impulse[1] = normal * (double)block->normal.y[l];
        impulse[2] = normal * (double)block->normal.z[l];
    }
    arm[0] = (double)r->x[l], arm[1] = (double)r->y[l], arm[2] = (double)r->z[l];
}

static void add_pair(const struct sadmm_context *c, size_t record, int side, double r[6])
{
    const struct pair_block *block = &c->pair_blocks[record / (size_t)LANES];
    int l = (int)(record % (size_t)LANES);
    double sign = side ? 1 : -1, impulse[3], arm[3];
    const double d[3] = {(double)block->d.x[l], (double)block->d.y[l], (double)block->d.z[l]};
    for (int k = 0; k < c->system->contacts->pairs[block->pair[l]].count; ++k) {
        load_point(c, block, l, k, impulse, arm);
        for (int j = 0; j < 3; ++j) {
            arm[j] += side ? d[j] : 0;
            r[j] += sign * impulse[j];
        }
        add_cross(arm, impulse, sign, r + 3);
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
            size_t row = (size_t)c->incident[at];
            int side = row >= c->record_count;
            size_t record = side ? row - c->record_count : row;
            if (record < cpu_pair_records(c)) add_pair(c, record, side, r);
            else add_rows(c, record, side, r);
        }
        store_momentum_residual(c, i, r);
    }
}
