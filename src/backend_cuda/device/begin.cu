/* begin: arrays for a solve, raw data to the device; statistics, tier and layout (graph/layout.h). */
#include <string.h>

#include "backend_cuda/device/context.h"

/* ---- arrays ---------------------------------------------------------------------------------------------------- */

/* Raw data, as core has it. Bodies: rigid, or A then b; then velocities. Blocks, then their multipliers. */
static sadmm_status reserve_raw(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    size_t n = (size_t)v->model.bodies;
    size_t body = c->plan.rigid ? sizeof(struct sadmm_rigid) : 42 * sizeof(double);
    size_t bodies = n * (body + 6 * sizeof(double)),
           pairs = (size_t)v->contacts.pair_capacity * sizeof(struct sadmm_contact_pair);
    size_t points = (size_t)v->model.points * sizeof(struct sadmm_contact_point);
    size_t row_bytes = CUDA(raw_row_bytes)(v->rows.count);
    const cuda_capacity wanted[] = {
        {BUFFER_RAW_BODIES, bodies}, {BUFFER_RAW_PAIRS, pairs}, {BUFFER_RAW_POINTS, points},
        {BUFFER_RAW_ROWS, row_bytes}, {PINNED_BODIES, bodies},   {PINNED_PAIRS, pairs},
        {PINNED_POINTS, points},     {PINNED_ROWS, row_bytes},
    };
    CUDA_TRY(reserve_all(c, wanted, error));
    void *const none = nullptr;
    cuda_buffer *b = c->buffers;
    v->raw.system = *c->system;
    v->raw.system.contacts = nullptr;
    v->raw.system.rows = nullptr;
    char *raw = (char *)b[BUFFER_RAW_BODIES].data;
    v->raw.system.rigid = (const struct sadmm_rigid *)(c->plan.rigid ? raw : none);
    v->raw.system.A = (const double *)(c->plan.rigid ? none : raw);
    v->raw.system.b = c->plan.rigid ? nullptr : v->raw.system.A + 36 * n;
    v->raw.system.velocity = (double *)(raw + n * body);
    CUDA(bind_raw_rows)(c, b[BUFFER_RAW_ROWS].data);
    v->raw.pairs = (struct sadmm_contact_pair *)b[BUFFER_RAW_PAIRS].data;
    v->raw.points = (struct sadmm_contact_point *)b[BUFFER_RAW_POINTS].data;
    return SADMM_OK;
}

/* What only the method `fast` has. */
static sadmm_status reserve_weights(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    const size_t n = (size_t)v->model.bodies, pairs = (size_t)v->contacts.pair_capacity;
    CUDA_TRY(CUDA(reserve)(c, BUFFER_WEIGHTS,
                           (n * (PACKED + TERMS + 2) + 2 * pairs) * sizeof(double) + n * sizeof(cuda_island) +
                               pairs * sizeof(solver_real),
                           error));
    CUDA_TRY(
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
    size_t out = (13 * n + 3 * points + 6 * (size_t)v->rows.count + 2) * sizeof(double);
    const cuda_capacity wanted[] = {
        {BUFFER_STATE, (n + 1) * ROW * real_size},
        {BUFFER_B, (c->fast ? 2 : 1) * n * ROW * real_size},
        {BUFFER_LINES, n * (size_t)v->bodies.line * real_size},
        {BUFFER_C, n * PACKED * sizeof(double)},
        {BUFFER_BETA, n * sizeof(double)},
        {BUFFER_NORMAL, pairs * sizeof(real4)},
        {BUFFER_DIFFERENCE, pairs * sizeof(real4)},
        {BUFFER_PAIR_ENDS, pairs * sizeof(pair_ends)},
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
    CUDA_TRY(reserve_all(c, wanted, error));

    /* Lanes without a point read one all the same. */
    for (enum cuda_buffer_name name : {BUFFER_ARM, BUFFER_LAMBDA})
        if (c->buffers[name].data != before[name == BUFFER_LAMBDA])
            CUDA_CALL(c, cudaMemsetAsync(c->buffers[name].data, 0, c->buffers[name].capacity, c->stream),
                      "cudaMemsetAsync(points)");
    void *const none = nullptr;
    cuda_buffer *b = c->buffers;
    v->bodies.state = (solver_real *)b[BUFFER_STATE].data;
    v->bodies.b = (solver_real *)b[BUFFER_B].data;
    v->bodies.momentum_residual = c->fast ? v->bodies.b + n * ROW : nullptr;
    v->bodies.lines = (solver_real *)b[BUFFER_LINES].data;
    v->bodies.C = (double *)b[BUFFER_C].data;
    v->bodies.beta = (double *)b[BUFFER_BETA].data;
    v->contacts.normal = (real4 *)b[BUFFER_NORMAL].data;
    v->contacts.difference = (real4 *)b[BUFFER_DIFFERENCE].data;
    v->contacts.ends = (pair_ends *)b[BUFFER_PAIR_ENDS].data;
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
    v->islands.suspects = v->islands.limited + 1;
    v->iteration.barrier = (unsigned *)(v->iteration.residual + 4); /* a sector of its own */
    v->islands.stop = (cuda_stop *)(v->iteration.residual + 8);
    v->raw.out = (double *)b[BUFFER_OUT].data;
    CUDA_CALL(c, cudaMemsetAsync(v->iteration.residual, 0, SCALAR_BYTES, c->stream), "cudaMemsetAsync(scalars)");
    CUDA_CALL(c, cudaMemsetAsync(v->bodies.state + n * ROW, 0, ROW * real_size, c->stream),
              "cudaMemsetAsync(static world)");
    return c->fast ? reserve_weights(c, error) : SADMM_OK;
}

/* ---- begin ----------------------------------------------------------------------------------------------------- */

/* The view's counts. */
static void count(struct sadmm_context *c)
{
    cuda_view *v = &c->view;
    v->model.bodies = c->plan.bodies;
    v->contacts.pair_capacity = (c->plan.pairs + WARP - 1) / WARP * WARP;
    v->model.points = c->plan.points;
    v->rows.count = (int32_t)sadmm_row_constraint_count(c->system);
    v->model.contact_rows = c->plan.contact_rows;
    v->model.warm_start = c->plan.warm_start;
}

static sadmm_status upload_raw(struct sadmm_context *c, struct sadmm_error *error)
{
    const struct sadmm_system *system = c->system;
    const struct sadmm_contact_set *contacts = system->contacts;
    const cuda_view *v = &c->view;
    CUDA_TRY(CUDA(upload)(c, (void *)v->raw.pairs, PINNED_PAIRS, 0, contacts->pairs,
                          contacts->pair_count * sizeof *contacts->pairs, error));
    CUDA_TRY(CUDA(upload)(c, (void *)v->raw.points, PINNED_POINTS, 0, contacts->points,
                          contacts->point_count * sizeof *contacts->points, error));
    return CUDA(upload_rows)(c, error);
}

/* Parts that turn out to be too large: STREAM has none. */
static sadmm_status lay_out(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_partition *partition = &c->partition;
    struct cuda_known known;
    CUDA_TRY(CUDA(enqueue_layout)(c, partition, error));
    if (partition->tier == SADMM_CUDA_TIER_STREAM) return SADMM_OK;
    CUDA_TRY(CUDA(download_known)(c, &known, error));
    c->statistics = known.statistics;
    if (known.live.abort_code == ABORT_NONE) return SADMM_OK;
    if (c->wanted != SADMM_CUDA_TIER_AUTO)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                          "the cuda tier asked for: a thread block would get %d sides and %d bodies: at most %d and %d",
                          known.statistics.part_sides, known.statistics.part_bodies, partition->most_sides,
                          partition->most_bodies);
    *partition = {};
    partition->tier = SADMM_CUDA_TIER_STREAM;
    partition->islands = c->fast;
    CUDA_TRY(CUDA(upload_live)(c, ABORT_NONE, error));
    return CUDA(enqueue_layout)(c, partition, error);
}

extern "C" sadmm_status CUDA(begin)(struct sadmm_context *c, const struct sadmm_system *system,
                                    const struct sadmm_plan *plan, const struct sadmm_settings *settings,
                                    struct sadmm_error *error)
{
    int64_t records = (int64_t)plan->pairs + plan->row_constraints + WARP;
    if (records > INT32_MAX / (4 * ROW))
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%lld constraints: at most %d", (long long)(records - WARP),
                          INT32_MAX / (4 * ROW) - WARP);
    if (plan->bodies > INT32_MAX / LINE_GENERAL)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%d bodies: at most %d", plan->bodies, INT32_MAX / LINE_GENERAL);
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(wait)(c, error)); /* the staging buffers are about to be written */
    c->system = system;
    c->plan = *plan;
    c->starting = true;
    c->placed = c->measured = c->rescaled = c->settled = c->prologue = false;
    c->refused = 0;
    c->graph_valid = false;
    CUDA_TRY(CUDA(use_settings)(c, settings, error));
    count(c);
    CUDA_TRY(reserve_raw(c, error));
    CUDA_TRY(CUDA(reserve_layout)(c, error));
    CUDA_TRY(upload_raw(c, error));
    CUDA_TRY(CUDA(upload_live)(c, ABORT_NONE, error));
    bool islands = c->fast || (c->wanted != SADMM_CUDA_TIER_GRID && c->wanted != SADMM_CUDA_TIER_STREAM);
    struct cuda_known known;
    CUDA_TRY(CUDA(enqueue_statistics)(c, islands, error));
    CUDA_TRY(CUDA(download_known)(c, &known, error));
    c->statistics = known.statistics;
    CUDA_TRY(CUDA(choose_partition)(c, &c->statistics, &c->partition, error));
    CUDA_TRY(CUDA(reserve_solver)(c, error));
    return lay_out(c, error);
}
