/* The arrays that a solve works on, by the view's counts, the plan and the partition. */
#include "context.h"

/* What restores the momentum of islands, and says where the trapezoid correction is off. In `paper` their energies,
 * too: the method `fast` has these elsewhere. */
static sadmm_status reserve_motions(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    const size_t n = (size_t)v->model.bodies;
    v->islands.motions = nullptr;
    v->islands.touch = nullptr;
    if (!c->fast) v->islands.info = nullptr;
    if (!c->plan.momentum) return SADMM_OK;
    const size_t islands = c->fast ? 0 : n * ((PACKED + TERMS + 2) * sizeof(double) + sizeof(cuda_island));
    TRY(CUDA(reserve)(c, BUFFER_MOTIONS, n * (MOTION_TERMS + 1) * sizeof(double) + islands, error));
    TRY(CUDA(reserve)(c, BUFFER_TOUCH, n * sizeof(int32_t), error));
    v->islands.touch = (int32_t *)c->buffers[BUFFER_TOUCH].data;
    v->islands.motions = (double *)c->buffers[BUFFER_MOTIONS].data;
    v->islands.motion_arrivals = (unsigned long long *)(v->islands.motions + n * MOTION_TERMS);
    if (!c->fast) {
        v->bodies.A_inverse = (double *)(v->islands.motion_arrivals + n);
        v->bodies.free_energy = v->bodies.A_inverse + n * PACKED;
        v->islands.terms = v->bodies.free_energy + n;
        v->islands.arrivals = (unsigned long long *)(v->islands.terms + n * TERMS);
        v->islands.info = (cuda_island *)(v->islands.arrivals + n);
        CUDA_CALL(c, cudaMemsetAsync(v->islands.arrivals, 0, n * sizeof *v->islands.arrivals, c->stream),
                  "cudaMemsetAsync(arrivals)");
    }
    CUDA_CALL(c, cudaMemsetAsync(v->islands.motion_arrivals, 0, n * sizeof *v->islands.motion_arrivals, c->stream),
              "cudaMemsetAsync(arrivals)");
    return SADMM_OK;
}

/* What only the method `fast` has. */
static sadmm_status reserve_weights(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    const size_t n = (size_t)v->model.bodies, pairs = (size_t)v->contacts.pair_capacity;
    TRY(CUDA(reserve)(c, BUFFER_WEIGHTS,
                      (n * (PACKED + TERMS + 2) + 2 * pairs) * sizeof(double) + n * sizeof(cuda_island) +
                          pairs * sizeof(solver_real),
                      error));
    TRY(
        CUDA(reserve)(c, BUFFER_SIDES, 2 * pairs * (ROW * sizeof(double) + SIDE_NUMBERS * sizeof(solver_real)), error));
    v->bodies.A_inverse = (double *)c->buffers[BUFFER_WEIGHTS].data;
    v->bodies.free_energy = v->bodies.A_inverse + n * PACKED;
    v->islands.terms = v->bodies.free_energy + n;
    v->islands.arrivals = (unsigned long long *)(v->islands.terms + n * TERMS);
    v->weights.weight = v->islands.terms + n * (TERMS + 1);
    v->weights.response = v->weights.weight + pairs;
    v->islands.info = (cuda_island *)(v->weights.response + pairs);
    v->contacts.inv_s = (solver_real *)(v->islands.info + n);
    v->weights.side_wrench = (double *)c->buffers[BUFFER_SIDES].data;
    v->weights.side_arms = (solver_real *)(v->weights.side_wrench + 2 * pairs * ROW);
    CUDA_CALL(c, cudaMemsetAsync(v->islands.arrivals, 0, n * sizeof *v->islands.arrivals, c->stream),
              "cudaMemsetAsync(arrivals)");
    return SADMM_OK;
}

enum { SCALAR_BYTES = 128 };

/* This precision's data, once the statistics are known. */
sadmm_status CUDA(reserve_solver)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    size_t n = (size_t)v->model.bodies, pairs = (size_t)v->contacts.pair_capacity, rows = (size_t)v->rows.count,
           real_size = sizeof(solver_real);
    v->contacts.lanes = c->statistics.point_slots <= 1 ? 1 : 4;
    size_t lanes = (size_t)v->contacts.lanes,
           slots = ((size_t)c->statistics.point_slots + lanes - 1) / lanes * lanes * pairs;
    size_t records = 2 * (pairs + (size_t)v->rows.count) * ROW * real_size;
    size_t points = (size_t)v->model.points;
    bool joins = c->plan.residuals && !c->fast;
    v->bodies.rigid = c->plan.rigid;
    v->bodies.line = v->bodies.rigid ? LINE_RIGID : LINE_GENERAL;
    v->contacts.point_slots = c->statistics.point_slots;
    size_t out = (14 * n + 3 * points + 6 * (size_t)v->rows.count + 2) * sizeof(double);
    const cuda_capacity wanted[] = {
        {BUFFER_STATE, (n + 1 + (v->raw.system.kinematic_count > 0 ? pairs : 0)) * ROW * real_size},
        {BUFFER_B, (c->fast ? 2 : 1) * n * ROW * real_size},
        {BUFFER_LINES, n * (size_t)v->bodies.line * real_size},
        {BUFFER_HALFWAY, v->bodies.rigid ? HALFWAY * n * sizeof(double) : 0},
        {BUFFER_C, n * PACKED * sizeof(double)},
        {BUFFER_BETA, n * sizeof(double)},
        {BUFFER_NORMAL, pairs * sizeof(real4)},
        {BUFFER_DIFFERENCE, pairs * sizeof(real4)},
        {BUFFER_PAIR_BODIES, pairs * sizeof(pair_bodies)},
        {BUFFER_ARM, slots * sizeof(real4)},
        {BUFFER_LAMBDA, 3 * slots * real_size},
        {BUFFER_ROW_CONSTRAINTS, rows * sizeof(row_constraint)},
        {BUFFER_ROWS, rows * SADMM_MAX_ROWS * sizeof(row_data)},
        {BUFFER_ROW_RESPONSES, rows * SADMM_MAX_ROWS * sizeof(row_response)},
        {BUFFER_RECORDS, records},
        {BUFFER_CHANGE, joins ? records : 0},
        {BUFFER_EXCHANGE, c->partition.tier == SADMM_CUDA_TIER_GRID ? 2 * n * ROW * real_size : 0},
        {BUFFER_SCALARS, SCALAR_BYTES},
        {BUFFER_OUT, out},
        {PINNED_OUT, out},
    };
    const void *const before[] = {c->buffers[BUFFER_ARM].data, c->buffers[BUFFER_LAMBDA].data};
    TRY(reserve_all(c, wanted, error));

    /* Lanes without a point read one all the same. */
    for (enum cuda_buffer_name name : {BUFFER_ARM, BUFFER_LAMBDA})
        if (c->buffers[name].data != before[name == BUFFER_LAMBDA])
            CUDA_CALL(c, cudaMemsetAsync(c->buffers[name].data, 0, c->buffers[name].capacity, c->stream),
                      "cudaMemsetAsync(points)");
    void *const none = nullptr;
    cuda_buffer *b = c->buffers;
    v->bodies.state = (solver_real *)b[BUFFER_STATE].data;
    v->bodies.b = (solver_real *)b[BUFFER_B].data;
    v->bodies.halfway = (double *)b[BUFFER_HALFWAY].data;
    v->bodies.momentum_residual = c->fast ? v->bodies.b + n * ROW : nullptr;
    v->bodies.lines = (solver_real *)b[BUFFER_LINES].data;
    v->bodies.C = (double *)b[BUFFER_C].data;
    v->bodies.beta = (double *)b[BUFFER_BETA].data;
    v->contacts.normal = (real4 *)b[BUFFER_NORMAL].data;
    v->contacts.difference = (real4 *)b[BUFFER_DIFFERENCE].data;
    v->contacts.bodies = (pair_bodies *)b[BUFFER_PAIR_BODIES].data;
    v->contacts.arm = (real4 *)b[BUFFER_ARM].data;
    v->contacts.lambda = (solver_real *)b[BUFFER_LAMBDA].data;
    v->contacts.lambda_stride = slots;
    v->rows.constraints = (row_constraint *)b[BUFFER_ROW_CONSTRAINTS].data;
    v->rows.data = (row_data *)b[BUFFER_ROWS].data;
    v->rows.responses = (row_response *)b[BUFFER_ROW_RESPONSES].data;
    v->iteration.records = (solver_real *)b[BUFFER_RECORDS].data;
    v->iteration.change = (solver_real *)(joins ? b[BUFFER_CHANGE].data : none);
    v->iteration.exchange = (solver_real *)b[BUFFER_EXCHANGE].data;
    v->iteration.residual = (unsigned long long *)b[BUFFER_SCALARS].data;
    v->iteration.ratio = (double *)(v->iteration.residual + 2);
    v->islands.limited = (int32_t *)(v->iteration.residual + 3);
    v->islands.candidates = v->islands.limited + 1;
    v->iteration.barrier = (unsigned *)(v->iteration.residual + 4); /* a sector of its own */
    v->islands.stop = (cuda_stop *)(v->iteration.residual + 8);
    v->islands.moved = (int32_t *)(v->iteration.residual + 11);
    v->islands.floating = v->islands.moved + 1;
    v->islands.again = v->islands.moved + 2;
    v->raw.out = (double *)b[BUFFER_OUT].data;
    CUDA_CALL(c, cudaMemsetAsync(v->iteration.residual, 0, SCALAR_BYTES, c->stream), "cudaMemsetAsync(scalars)");
    CUDA_CALL(c, cudaMemsetAsync(v->bodies.state + n * ROW, 0, ROW * real_size, c->stream),
              "cudaMemsetAsync(static world)");
    if (c->fast) TRY(reserve_weights(c, error));
    return reserve_motions(c, error);
}
