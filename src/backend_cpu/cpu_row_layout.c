/* Constraints given by rows: which lane each has, and kernels C and D, their rows from the system's doubles into this
 * precision's slots. */
#include "core/base/memory.h"
#include "core/math/contact.h"
#include "core/math/penalty.h"
#include "core/math/row.h"
#include "cpu_rows.h"

/* Constraints are sorted by their number of rows inside windows of this many blocks, as pairs are by their points. */
enum { WINDOW_BLOCKS = 32 };

static const struct sadmm_row_constraint *constraint_of(const struct sadmm_context *c, int32_t index)
{
    return &c->system->rows->constraints[index];
}

static size_t whole_lanes(size_t count) { return (count + (size_t)LANES - 1) / (size_t)LANES * (size_t)LANES; }

/* Stable counting sort of `order` (count) by the number of rows, most first. */
static void sort_window(const struct sadmm_context *c, int32_t *order, const int32_t *from, size_t count)
{
    size_t at[SADMM_MAX_ROWS + 2] = {0};
    for (size_t k = 0; k < count; ++k) ++at[SADMM_MAX_ROWS - constraint_of(c, from[k])->count + 1];
    for (int k = 0; k <= SADMM_MAX_ROWS; ++k) at[k + 1] += at[k];
    for (size_t k = 0; k < count; ++k) order[at[SADMM_MAX_ROWS - constraint_of(c, from[k])->count]++] = from[k];
}

/* row_order: a constraint a lane or -1; cones, then the others, each from a block of their own on. */
static void order_rows(struct sadmm_context *c, size_t cones, size_t scalars)
{
    const size_t count = cones + scalars, padded = c->row_block_count * (size_t)LANES, scalar = whole_lanes(cones);
    int32_t *order = c->row_order, *unsorted = c->row_order + padded;
    size_t cone = 0, next = 0;
    for (size_t at = 0; at < padded; ++at) order[at] = -1;
    for (size_t k = 0; k < count; ++k)
        if (constraint_of(c, (int32_t)k)->cone) order[cone++] = (int32_t)k;
        else unsorted[next++] = (int32_t)k;
    for (size_t begin = 0; begin < scalars; begin += (size_t)WINDOW_BLOCKS * LANES) {
        size_t left = scalars - begin, window = (size_t)WINDOW_BLOCKS * LANES;
        sort_window(c, order + scalar + begin, unsorted + begin, left < window ? left : window);
    }
}

bool CPU(lay_out_rows)(struct sadmm_context *c)
{
    const size_t count = sadmm_row_constraint_count(c->system);
    size_t cones = 0;
    c->row_block_count = c->row_slot_count = 0;
    if (count == 0) return true;
    for (size_t k = 0; k < count; ++k) cones += constraint_of(c, (int32_t)k)->cone;
    const size_t padded = whole_lanes(cones) + whole_lanes(count - cones);
    c->row_block_count = padded / (size_t)LANES;
    if (!SADMM_GROW(c->row_order, 0, padded + count) || !SADMM_GROW(c->row_blocks, 0, c->row_block_count) ||
        (c->fast && !SADMM_GROW(c->row_weights, 0, c->system->rows->row_count)))
        return false;
    order_rows(c, cones, count - cones);
    for (size_t k = 0; k < c->row_block_count; ++k) {
        struct row_block *block = &c->row_blocks[k];
        block->first = c->row_slot_count;
        block->slots = 0;
        block->cone = k * (size_t)LANES < cones;
        for (int l = 0; l < LANES; ++l) {
            int32_t index = c->row_order[k * (size_t)LANES + (size_t)l];
            block->constraint[l] = index;
            if (index >= 0 && constraint_of(c, index)->count > block->slots)
                block->slots = constraint_of(c, index)->count;
        }
        c->row_slot_count += (size_t)block->slots;
    }
    return SADMM_GROW(c->row_slots, 0, c->row_slot_count);
}

/* A row that is not there: its equation, x = 0 with x = 0, has the solution 0. */
static void clear_row(struct row_slot *slot, int l)
{
    for (int j = 0; j < 6; ++j) slot->jacobian_a[j][l] = slot->jacobian_b[j][l] = 0;
    slot->gain[l] = 1;
    slot->bias[l] = slot->compliance[l] = slot->lambda[l] = slot->step[l] = slot->along[l] = 0;
    slot->lo[l] = -(real)INFINITY;
    slot->hi[l] = (real)INFINITY;
}

static void assemble_row(const struct sadmm_context *c, bool cone, size_t r, struct row_slot *slot, int l)
{
    const struct sadmm_rows *in = c->system->rows;
    bool acts = false;
    for (int j = 0; j < 6; ++j) {
        real a = (real)in->jacobian_a[6 * r + (size_t)j], b = (real)in->jacobian_b[6 * r + (size_t)j];
        slot->jacobian_a[j][l] = a;
        slot->jacobian_b[j][l] = b;
        acts = acts || a != 0 || b != 0;
    }
    if (!cone && !acts && in->compliance[r] == 0) return; /* it stays cleared (Sec. III-C) */
    slot->bias[l] = (real)in->bias[r];
    if (c->plan.warm_start) slot->lambda[l] = (real)in->lambda[r];
    if (cone) return;
    slot->gain[l] = (real)in->gain[r];
    slot->compliance[l] = (real)in->compliance[r];
    slot->lo[l] = (real)in->lo[r];
    slot->hi[l] = (real)in->hi[r];
}

static void assemble_lane(struct sadmm_context *c, struct row_block *block, int l)
{
    const int32_t index = block->constraint[l];
    const struct sadmm_row_constraint *constraint = index >= 0 ? constraint_of(c, index) : NULL;
    struct row_slot *slots = c->row_slots + block->first;
    block->body_a[l] = constraint ? cpu_body(c, constraint->body_a) : c->bodies;
    block->body_b[l] = constraint ? cpu_body(c, constraint->body_b) : c->bodies;
    block->friction[l] = constraint ? cpu_friction(c, constraint->friction) : 0;
    block->inv_s[l] = 0;
    for (int r = 0; r < block->slots; ++r) {
        clear_row(&slots[r], l);
        if (constraint && r < constraint->count)
            assemble_row(c, block->cone, (size_t)(constraint->first + r), &slots[r], l);
    }
}

static void assemble_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    sadmm_share(c->row_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k)
        for (int l = 0; l < LANES; ++l) assemble_lane(c, &c->row_blocks[k], l);
}

sadmm_status CPU(assemble_rows)(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    cpu_parallel(c, assemble_share, c);
    return SADMM_OK;
}

void CPU(set_row_steps)(struct sadmm_context *c, size_t index)
{
    struct row_block *block = &c->row_blocks[index];
    for (int l = 0; l < LANES; ++l) {
        block->inv_s[l] = penalty_inverse_s(cpu_inv_beta(c, block->body_a[l]), cpu_inv_beta(c, block->body_b[l]));
        for (int r = 0; r < block->slots && !block->cone; ++r) {
            struct row_slot *slot = &c->row_slots[block->first + (size_t)r];
            slot->step[l] = row_step(slot->gain[l], slot->compliance[l], block->inv_s[l]);
        }
    }
}
