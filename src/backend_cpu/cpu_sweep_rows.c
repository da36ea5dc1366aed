/* Steps 2-4 of constraints given by rows, LANES of them at a time. Written once, specialised at compile time by the law
 * and by what the sweep is for. */
#include "cpu_rows.h"

/* What rows add to the wrenches of their two bodies. */
struct row_sum {
    lanes on_a[ROW], on_b[ROW];
};

static inline void add_row(struct row_sum *sum, const struct row_slot *slot, lanes lambda)
{
    for (int j = 0; j < 6; ++j) {
        sum->on_a[j] += slot->jacobian_a[j] * lambda;
        sum->on_b[j] += slot->jacobian_b[j] * lambda;
    }
}

static inline void write_wrenches(const struct sadmm_context *c, real *wrenches, size_t index,
                                  const struct row_sum *sum)
{
    size_t record = (c->pair_block_count + index) * (size_t)LANES;
    store_rows(wrenches + record * ROW, sum->on_a);
    store_rows(wrenches + (c->record_count + record) * ROW, sum->on_b);
}

static inline lanes row_velocity(const struct row_slot *slot, const lanes va[ROW], const lanes vb[ROW])
{
    lanes x = slot->jacobian_a[0] * va[0] + slot->jacobian_b[0] * vb[0];
    for (int j = 1; j < 6; ++j) x += slot->jacobian_a[j] * va[j] + slot->jacobian_b[j] * vb[j];
    return x;
}

/* By how much more the side with less weight moves (16): the larger 1/beta, fast: 1/B. */
static lanes inverse_weight(const struct sadmm_context *c, const struct row_block *block, int r)
{
    lanes out = {0};
    for (int l = 0; l < LANES; ++l) {
        if (!c->fast) {
            out[l] = real_max(cpu_inv_beta(c, block->body_a[l]), cpu_inv_beta(c, block->body_b[l]));
            continue;
        }
        if (block->constraint[l] < 0) continue;
        const struct sadmm_row_constraint *constraint = &c->system->rows->constraints[block->constraint[l]];
        if (r >= constraint->count) continue;
        const struct row_weight *weight = &c->row_weights[constraint->first + r];
        const double B = weight->weight + weight->along * weight->along;
        out[l] = B > 0 ? (real)(1 / B) : 0;
    }
    return out;
}

/* lambda^ of a contact's three rows and the change, by the residual of x + e = 0 (math/contact.h). */
static inline void solve_cone(const struct row_block *block, const struct row_slot *slots, const lanes residual[6],
                              bool changes, lanes delta[6], lanes lambda[6])
{
    lanes step[3], y[3];
    for (int r = 0; r < 3; ++r) {
        step[r] = residual[r] * block->inv_s;
        y[r] = slots[r].lambda - step[r];
    }
    const struct lane_law law = lane_law_of(y[0], y[1] * y[1] + y[2] * y[2], block->friction);
    for (int r = 0; r < 3; ++r) {
        lambda[r] = law.shrink * y[r];
        if (r == 0) lambda[r] = law.push;
        delta[r] = lambda[r] - slots[r].lambda;
        if (changes) delta[r] = pick(law.moves, delta[r], -step[r]);
    }
}

/* The same of scalar rows (math/row.h). */
static inline void solve_scalars(const struct row_block *block, const struct row_slot *slots, const lanes residual[6],
                                 lanes delta[6], lanes lambda[6])
{
    lanes along = {0};
    for (int r = 0; r < block->slots; ++r) along += slots[r].along * residual[r];
    for (int r = 0; r < block->slots; ++r) {
        const struct row_slot *slot = &slots[r];
        lanes change = -(slot->step * residual[r] + slot->along * along), next = slot->lambda + change;
        lambda[r] = pick(next < slot->lo, slot->lo, pick(next > slot->hi, slot->hi, next));
        delta[r] = pick((next < slot->lo) | (next > slot->hi), lambda[r] - slot->lambda, change);
    }
}

static inline __attribute__((always_inline)) void sweep_block(struct sadmm_context *c, size_t index, bool cone,
                                                              enum cpu_sweep sweep, lanes relaxation, double *primal)
{
    const struct row_block *block = &c->row_blocks[index];
    struct row_slot *slots = c->row_slots + block->first;
    struct row_sum next = {0}, change = {0};
    if (sweep == CPU_SWEEP_START) {
        for (int r = 0; r < block->slots; ++r) add_row(&next, &slots[r], slots[r].lambda);
        write_wrenches(c, c->wrenches, index, &next);
        return;
    }
    const row8 *state = (const row8 *)c->state;
    lanes va[ROW], vb[ROW], residual[6], delta[6], lambda[6], largest = {0};
#define ROW_A(l) state[block->body_a[l]]
#define ROW_B(l) state[block->body_b[l]]
    LOAD_ROWS(va, ROW_A);
    LOAD_ROWS(vb, ROW_B);
#undef ROW_A
#undef ROW_B
    const int count = cone ? 3 : block->slots;
    for (int r = 0; r < count; ++r) {
        const struct row_slot *slot = &slots[r];
        lanes x = row_velocity(slot, va, vb);
        residual[r] = cone ? x + slot->bias : slot->gain * x + slot->bias + slot->compliance * slot->lambda;
    }
    if (cone) solve_cone(block, slots, residual, cpu_sweep_passes_changes(sweep), delta, lambda);
    else solve_scalars(block, slots, residual, delta, lambda);
    for (int r = 0; r < count; ++r) {
        struct row_slot *slot = &slots[r];
        if (cpu_sweep_measures(sweep)) largest = larger(largest, magnitude(delta[r]) * inverse_weight(c, block, r));
        if (cpu_sweep_passes_changes(sweep)) {
            add_row(&next, slot, delta[r]);
        } else if (sweep == CPU_SWEEP_MEASURE) {
            add_row(&next, slot, lambda[r]);
            add_row(&change, slot, delta[r]);
        } else {
            add_row(&next, slot, lambda[r] + delta[r]);
        }
        if (sweep == CPU_SWEEP_RELAX) slot->lambda += relaxation * delta[r];
        else if (sweep == CPU_SWEEP_RELAX_WARM)
            slot->lambda = pick(relaxation > 1, slot->lambda + relaxation * delta[r], lambda[r]);
        else slot->lambda = lambda[r];
    }
    write_wrenches(c, c->wrenches, index, &next);
    if (sweep == CPU_SWEEP_MEASURE) write_wrenches(c, c->change, index, &change);
    if (cpu_sweep_measures(sweep)) *primal = fmax(*primal, (double)horizontal_max(largest));
}

void CPU(sweep_rows)(struct sadmm_context *c, size_t begin, size_t end, enum cpu_sweep sweep, double *primal)
{
    const lanes all = fill((real)c->settings.relaxation);
#define SWEEP(kind)                                                                                   \
    case kind:                                                                                        \
        for (size_t k = begin; k < end; ++k) {                                                        \
            const struct row_block *block = &c->row_blocks[k];                                        \
            const lanes relaxation = kind == CPU_SWEEP_RELAX_WARM                                     \
                                         ? cpu_relaxation_if_warm(c, block->body_a, block->body_b)    \
                                         : all;                                                       \
            if (block->cone) sweep_block(c, k, true, kind, relaxation, primal);                       \
            else sweep_block(c, k, false, kind, relaxation, primal);                                  \
        }                                                                                             \
        break
    switch (sweep) {
        SWEEP(CPU_SWEEP_START);
        SWEEP(CPU_SWEEP_ITERATE);
        SWEEP(CPU_SWEEP_MEASURE);
        SWEEP(CPU_SWEEP_RELAX);
        SWEEP(CPU_SWEEP_PLAIN);
        SWEEP(CPU_SWEEP_RELAX_WARM);
        SWEEP(CPU_SWEEP_PLAIN_MEASURE);
    }
#undef SWEEP
}
