/* The method `fast`: weights of constraints given by rows (math/weight.h). In double. */
#include "core/math/array3.h"
#include "core/math/row.h"
#include "core/math/weight.h"
#include "cpu_rows.h"

static struct row_weight *weights_of(struct sadmm_context *c, const struct row_block *block, int l)
{
    return c->row_weights + c->system->rows->constraints[block->constraint[l]].first;
}

/* Of every row; and what a row's multiplier counts for in the load of its constraint: a row that pushes by how much, a
 * row that only turns by the push that would take as much energy. */
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
        out->scale = push > 0 ? push : sqrt(out->response / inverse_mass);
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
    double load2 = 0, lambda2 = 0, w = 0;
    for (int r = 0; r < count; ++r) {
        double lambda = (double)slots[r].lambda[l], load = weights[r].scale * lambda;
        load2 += load * load;
        lambda2 += lambda * lambda;
        w += weights[r].response / count;
    }
    const double share = weight_share(load2, island->speed, island->mass);
    for (int r = 0; r < count; ++r) {
        struct row_weight *out = &weights[r];
        const double lambda = (double)slots[r].lambda[l];
        const bool coupled = !block->cone && sadmm_row_is_coupled(c->system->rows, first + (size_t)r);
        out->along = coupled ? sqrt(share) * lambda : 0;
        out->weight = block->cone ? weight_of_cone(share, lambda2, w)
                      : coupled   ? weight_of_coupled_row(out->response)
                                  : weight_of_single_row(share, lambda, out->response);
        slots[r].step[l] = row_step(slots[r].gain[l], slots[r].compliance[l], (real)(inv_n * out->weight));
        slots[r].along[l] = (real)(sqrt(inv_n) * out->along);
        block->inv_s[l] = (real)(inv_n * out->weight); /* of cones: that of all rows */
    }
}

void CPU(weigh_rows)(struct sadmm_context *c, size_t index)
{
    struct row_block *block = &c->row_blocks[index];
    for (int l = 0; l < LANES; ++l)
        if (block->constraint[l] >= 0) weigh(c, block, l);
}
