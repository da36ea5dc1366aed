/* The method `fast`: weights of constraints given by rows (math/weight.h). In double. */
#include "core/math/array3.h"
#include "core/math/row.h"
#include "core/math/weight.h"
#include "cpu_rows.h"

static struct row_weight *weights_of(struct sadmm_context *c, const struct row_block *block, int l)
{
    return c->row_weights + c->system->rows->constraints[block->constraint[l]].first;
}

/* Of every row; and what its multiplier counts for in the load of its constraint. */
static void respond(struct sadmm_context *c, const struct row_block *block, int l)
{
    const int32_t bodies[2] = {block->body_a[l], block->body_b[l]};
    double inverse_mass = 0;
    for (int side = 0; side < 2; ++side)
        if (bodies[side] < c->bodies) inverse_mass += 1 / cpu_body_mass(c, bodies[side]);
    for (int r = 0; r < cpu_row_count(c, block, l); ++r) {
        struct row_weight *out = weights_of(c, block, l) + r;
        double push = 0, row[6];
        out->response = 0;
        for (int side = 0; side < 2; ++side) {
            if (bodies[side] >= c->bodies) continue;
            cpu_load_row(c, block, l, side, r, row);
            out->response += packed_form(&c->A_inverse[(size_t)bodies[side] * PACKED6], row);
            push = fmax(push, length3(row));
        }
        out->scale = weight_row_scale(push, out->response, inverse_mass);
    }
}

void CPU(respond_rows)(struct sadmm_context *c, size_t index)
{
    const struct row_block *block = &c->row_blocks[index];
    for (int l = 0; l < LANES; ++l)
        if (block->constraint[l] >= 0) respond(c, block, l);
}

static void weigh(struct sadmm_context *c, struct row_block *block, int l)
{
    const struct cpu_island *island = cpu_island_of(c, block->body_a[l], block->body_b[l]);
    const bool both = block->body_a[l] < c->bodies && block->body_b[l] < c->bodies;
    const int count = cpu_row_count(c, block, l);
    const size_t first = (size_t)c->system->rows->constraints[block->constraint[l]].first;
    const double inv_n = both ? 0.5 : 1;
    struct row_slot *slots = c->row_slots + block->first;
    struct row_weight *weights = weights_of(c, block, l);
    struct weight_row_sums sums = {0};
    for (int r = 0; r < count; ++r)
        weight_add_row(&sums, (double)slots[r].lambda[l], weights[r].scale, weights[r].response, count);
    const double share = weight_share(&island->weights, sums.load2);
    for (int r = 0; r < count; ++r) {
        struct row_weight *out = &weights[r];
        const struct weight_law law = {block->cone,
                                       sadmm_row_is_coupled(c->system->rows, first + (size_t)r),
                                       (double)slots[r].gain[l],
                                       (double)slots[r].compliance[l],
                                       (double)slots[r].lo[l],
                                       (double)slots[r].hi[l],
                                       weight_row_floor(c->plan.rigid, c->settings.iterations)};
        const struct weight_row B = weight_of_row(&sums, share, &law, (double)slots[r].lambda[l], out->response);
        out->weight = B.weight;
        out->along = B.along;
        slots[r].step[l] = row_step(slots[r].gain[l], slots[r].compliance[l], (real)(inv_n * out->weight));
        slots[r].along[l] = (real)(sqrt(inv_n) * out->along);
        block->inv_s[l] = (real)(inv_n * out->weight); /* of cones: that of all rows */
    }
}

void CPU(weigh_rows)(struct sadmm_context *c, size_t index)
{
    struct row_block *block = &c->row_blocks[index];
    for (int l = 0; l < LANES; ++l)
        if (block->constraint[l] >= 0 && cpu_is_weighed(c, cpu_island_of(c, block->body_a[l], block->body_b[l])))
            weigh(c, block, l);
}
