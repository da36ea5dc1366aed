#include "core/base/memory.h"
#include "cpu.h"

sadmm_status CPU(create)(int device, struct sadmm_context **out, struct sadmm_error *error)
{
    (void)device;
    *out = (struct sadmm_context *)sadmm_alloc(1, sizeof **out);
    return *out ? SADMM_OK : sadmm_fail_memory(error, "the cpu backend's context");
}

void CPU(destroy)(struct sadmm_context *c)
{
    if (!c) return;
    void *blocks[] = {c->state, c->A, c->C, c->beta, c->body_blocks, c->b, c->momentum_residuals, c->A_columns,
                      c->H_columns, c->pair_blocks, c->slots, c->pair_order, c->row_blocks, c->row_slots, c->row_order,
                      c->row_weights, c->general_of, c->general_bodies, c->general_lanes, c->wrenches, c->change,
                      c->offsets, c->incident, c->thread_max, c->label, c->islands, c->A_inverse, c->pair_response,
                      c->pair_weight, c->pair_violation, c->body_sums, c->floating_of, c->floating, c->floating_bodies,
                      c->floating_pairs, c->touch, c->trapezoids, c->pair_arms};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; ++i) sadmm_free(blocks[i]);
    sadmm_free(c);
}

const struct sadmm_kernels CPU(kernels) = {
    .backend = SADMM_BACKEND_CPU,
    .precision = sizeof(real) == 4 ? SADMM_F32 : SADMM_F64,
    .variant = SADMM_ISA,
    .create = CPU(create),
    .destroy = CPU(destroy),
    .begin = CPU(begin),
    .assemble_bodies = CPU(assemble_bodies),
    .assemble_contacts = CPU(assemble_contacts),
    .assemble_rows = CPU(assemble_rows),
    .init_penalty = CPU(init_penalty),
    .update_weights = CPU(update_weights),
    .factorize = CPU(factorize),
    .update_velocity = CPU(update_velocity),
    .update_constraints = CPU(update_constraints),
    .iterate = CPU(iterate),
    .measure_residuals = CPU(measure_residuals),
    .update_penalty = CPU(update_penalty),
    .limit_energy = CPU(limit_energy),
    .read_solution = CPU(read_solution),
    .read_penalty = CPU(read_penalty),
    .integrate = CPU(integrate),
    .recover_wrenches = CPU(recover_wrenches),
};
