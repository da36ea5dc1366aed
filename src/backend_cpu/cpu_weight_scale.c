/* The method `fast`: weight scales of the islands (math/weight.h), from what contacts and momentum miss. In double;
 * sums over an island go in the order of pairs and of bodies. */
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
        double arm[3], lambda[3], error, friction = 0;
        if (c->plan.contact_rows == 3) {
            const struct point_slot *slot = (const struct point_slot *)c->slots + block->first + k;
            arm[0] = (double)slot->arm.x[l], arm[1] = (double)slot->arm.y[l], arm[2] = (double)slot->arm.z[l];
            lambda[0] = (double)slot->lambda.x[l], lambda[1] = (double)slot->lambda.y[l];
            lambda[2] = (double)slot->lambda.z[l];
            error = (double)slot->error[l];
            friction = (double)block->friction[l];
        } else {
            const struct normal_slot *slot = (const struct normal_slot *)c->slots + block->first + k;
            arm[0] = (double)slot->arm.x[l], arm[1] = (double)slot->arm.y[l], arm[2] = (double)slot->arm.z[l];
            for (int j = 0; j < 3; ++j) lambda[j] = (double)slot->lambda[l] * n[j];
            error = (double)slot->error[l];
        }
        const double arm_b[3] = {arm[0] + d[0], arm[1] + d[1], arm[2] + d[2]};
        double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        add_cross(b + 3, arm_b, 1, u);
        add_cross(a + 3, arm, -1, u);
        for (int j = 0; j < 3; ++j) u[j] += error * n[j];
        sum += contact_violation(lambda, u, n, friction, c->pair_response[record]);
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

static void add_up_misses(struct sadmm_context *c)
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
    add_up_misses(c);
    for (int32_t i = 0; i < c->bodies; ++i) {
        struct cpu_island *island = &c->islands[i];
        if (c->label[i] == i && !island->rows) island->rescale = weight_rescale(&island->weights, &island->sums);
    }
}
