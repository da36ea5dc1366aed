/* The method `fast`: weight scales of the islands (math/weight.h), from the residuals of contacts and momentum. In
 * double; sums over an island go in the order of pairs and of bodies. */
#include "core/math/array3.h"
#include "core/math/weight.h"
#include "cpu_rows.h"

static double pair_violation(const struct sadmm_context *c, size_t record)
{
    const struct pair_block *block = &c->pair_blocks[record / (size_t)LANES];
    size_t l = record % (size_t)LANES;
    const double n[3] = {(double)block->normal.x[l], (double)block->normal.y[l], (double)block->normal.z[l]};
    const double d[3] = {(double)block->d.x[l], (double)block->d.y[l], (double)block->d.z[l]};
    double a[6], b[6], sum = 0;
    cpu_load_v(c, (size_t)block->body_a[l], a);
    cpu_load_v(c, (size_t)block->body_b[l], b);
    for (int k = 0; k < c->system->contacts->pairs[block->pair[l]].count; ++k) {
        const struct cpu_point point = cpu_load_point(c, block, l, k);
        const double arm_b[3] = {point.arm[0] + d[0], point.arm[1] + d[1], point.arm[2] + d[2]};
        double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        add_cross(b + 3, arm_b, 1, u);
        add_cross(a + 3, point.arm, -1, u);
        for (int j = 0; j < 3; ++j) u[j] += point.error * n[j];
        sum += contact_violation(point.impulse, u, n, (double)block->friction[l], c->pair_response[record]);
    }
    return sum;
}

void CPU(add_up_imbalance)(struct sadmm_context *c, int thread, int threads)
{
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) c->body_sums[BODY_SUMS * i + 3] = cpu_residual_energy(c, i);
    sadmm_share(c->pair_block_count * (size_t)LANES, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k)
        if (c->pair_blocks[k / (size_t)LANES].pair[k % (size_t)LANES] >= 0) c->pair_violation[k] = pair_violation(c, k);
}

static void add_up_residuals(struct sadmm_context *c)
{
    for (int32_t i = 0; i < c->bodies; ++i)
        c->islands[c->label[i]].sums.momentum_residual += c->body_sums[BODY_SUMS * i + 3];
    for (size_t k = 0; k < c->pair_block_count * (size_t)LANES; ++k) {
        if (c->pair_blocks[k / (size_t)LANES].pair[k % (size_t)LANES] < 0) continue;
        const struct sadmm_contact_pair *pair = cpu_pair(c, k);
        cpu_island_of(c, pair->body_a, pair->body_b)->sums.violation += c->pair_violation[k];
    }
}

void CPU(update_weight_scales)(struct sadmm_context *c)
{
    add_up_residuals(c);
    for (int32_t i = 0; i < c->bodies; ++i) {
        struct cpu_island *island = &c->islands[i];
        if (c->label[i] == i && !island->rows && !island->warm)
            island->scale_weights = weight_update_scale(&island->weights, &island->sums);
    }
}
