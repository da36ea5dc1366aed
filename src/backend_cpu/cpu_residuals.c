/* The method `fast`: the momentum residual of bodies, r = b - A v + J^T lambda, before iterations change it by what
 * v and lambda change. In double, from this precision's b, v and lambda, in the order of a body's records. */
#include "cpu_rows.h"

/* The impulse on b of point k of a lane, and its arm about a (b where a is static). */
static void load_point(const struct sadmm_context *c, const struct pair_block *block, size_t l, int k, vec3d *impulse,
                       vec3d *arm)
{
    const size_t at = block->first + (size_t)k;
    if (c->plan.contact_rows == 3) {
        const struct point_slot *slot = (const struct point_slot *)c->slots + at;
        *arm = vec3d_of_lane(&slot->arm, l);
        *impulse = vec3d_of_lane(&slot->lambda, l);
    } else {
        const struct normal_slot *slot = (const struct normal_slot *)c->slots + at;
        *arm = vec3d_of_lane(&slot->arm, l);
        *impulse = (double)slot->lambda[l] * vec3d_of_lane(&block->normal, l);
    }
}

/* Of `r` the angular part is z, x, y. */
static void add_pair(const struct sadmm_context *c, size_t record, int side, vec6d *r)
{
    const struct pair_block *block = &c->pair_blocks[record / (size_t)LANES];
    const size_t l = record % (size_t)LANES;
    const double sign = side ? 1 : -1;
    const vec3d d = side ? vec3d_of_lane(&block->d, l) : (vec3d){0};
    const int count = c->system->contacts->pairs[block->pair[l]].count;
    for (int k = 0; k < count; ++k) {
        vec3d impulse, arm;
        load_point(c, block, l, k, &impulse, &arm);
        r->linear += sign * impulse;
        r->angular += sign * vec3d_cross_zxy(arm + d, impulse);
    }
}

static void add_rows(const struct sadmm_context *c, size_t record, int side, vec6d *r)
{
    int lane;
    const struct row_block *block = cpu_row_block(c, record, &lane);
    for (int k = 0; k < cpu_row_count(c, block, lane); ++k) {
        double row[6], lambda = (double)c->row_slots[block->first + (size_t)k].lambda[lane];
        cpu_load_row(c, block, lane, side, k, row);
        r->linear += vec3d_load(row) * lambda;
        r->angular += vec3d_zxy(vec3d_load(row + 3)) * lambda;
    }
}

static void store_momentum_residual(struct sadmm_context *c, size_t i, vec6d residual)
{
    const int32_t general = cpu_general(c, i);
    double r[6];
    vec6d_store(residual, r);
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
        vec6d r = cpu_free_momentum(c, i);
        r.angular = vec3d_zxy(r.angular);
        for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) {
            int side;
            const size_t record = cpu_record(c, at, &side);
            if (record < cpu_pair_records(c)) add_pair(c, record, side, &r);
            else add_rows(c, record, side, &r);
        }
        r.angular = vec3d_yzx(r.angular);
        store_momentum_residual(c, i, r);
    }
}
