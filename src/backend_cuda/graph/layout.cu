/* begin: room for the step, raw data to the device, the statistics, the tier and the layout (graph/layout.h). */
#include <string.h>

#include "core/base/memory.h"
#include "backend_cuda/device/context.h"

/* Live counts and statistics, side by side in device memory and in the staging buffer. */
struct known {
    struct cuda_live live;
    struct cuda_graph_statistics statistics;
};

struct wanted_capacity {
    enum cuda_buffer_name name;
    size_t bytes;
};

template <size_t N>
static sadmm_status make_capacity(struct sadmm_context *c, const wanted_capacity (&wanted)[N],
                                  struct sadmm_error *error)
{
    for (const wanted_capacity &one : wanted) CUDA_TRY(CUDA(reserve)(c, one.name, one.bytes, error));
    return SADMM_OK;
}

/* ---- the layout's room and stages -------------------------------------------------------------------------------- */

/* Clusters of a block or more for every island, and as many blocks as the device can hold at once. */
static int64_t most_parts(const struct sadmm_context *c)
{
    return (int64_t)c->view.model.bodies + (int64_t)c->multiprocessors * (2048 / WARP);
}

/* The arrays in one buffer, in order; returns their bytes. base NULL: only that. */
static size_t place_arrays(const struct sadmm_context *c, int32_t *base, struct layout_view *l)
{
    size_t n = (size_t)l->bodies, sides = 2 * ((size_t)l->pair_capacity + (size_t)l->rows), used = 0;
    auto take = [&](size_t count) {
        size_t at = used;
        used += (count + 3) / 4 * 4; /* each begins at 16 bytes */
        return base ? base + at : nullptr;
    };
    l->label = take(n);
    l->degree = take(n);
    l->island_bodies = take(n);
    l->island_sides = take(n);
    l->sorted_label = take(n);
    l->body_of = take(n);
    l->slot_of = take(n);
    l->offsets = take(n + 1);
    l->side_body = take(sides);
    l->side_slot = take(sides);
    l->sorted = take(sides);
    l->incident = take(sides);
    l->parts = take((size_t)most_parts(c) + 1);
    l->kept = (struct layout_kept *)take(sizeof *l->kept / sizeof(int32_t));
    return used * sizeof(int32_t);
}

/* 0, 1, ...: values of the sorts, the same in every step. */
static sadmm_status number(struct sadmm_context *c, size_t count, struct sadmm_error *error)
{
    cuda_buffer *numbers = &c->buffers[BUFFER_NUMBERS];
    size_t before = numbers->capacity;
    CUDA_TRY(CUDA(reserve)(c, BUFFER_NUMBERS, count * sizeof(int32_t), error));
    if (numbers->capacity == before && c->numbered) return SADMM_OK;
    c->numbered = false;
    CUDA_CALL(
        c,
        LAYOUT(number)((int32_t *)numbers->data, (int32_t)(numbers->capacity / sizeof(int32_t)), c->stream, &c->kernel),
        c->kernel);
    c->numbered = true;
    return SADMM_OK;
}

sadmm_status CUDA(reserve_layout)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    struct layout_view *l = &c->layout;
    size_t sides = 2 * ((size_t)v->contacts.pair_capacity + (size_t)v->rows.count), temp = 0;
    l->bodies = v->model.bodies;
    l->pair_capacity = v->contacts.pair_capacity;
    l->rows = v->rows.count;
    l->warm_start = v->model.warm_start;
    l->most_blocks = c->multiprocessors * (2048 / LAYOUT_THREADS);
    CUDA_CALL(c, LAYOUT(temp_bytes)(v->model.bodies, (int32_t)sides, &temp), "sizing of the layout's sorts");
    const wanted_capacity wanted[] = {
        {BUFFER_LIVE, sizeof(known)},
        {PINNED_LIVE, sizeof(known)},
        {BUFFER_LAYOUT, place_arrays(c, nullptr, l)},
        {BUFFER_SORT, temp},
    };
    CUDA_TRY(make_capacity(c, wanted, error));
    CUDA_TRY(number(c, sides > (size_t)v->model.bodies ? sides : (size_t)v->model.bodies, error));
    place_arrays(c, (int32_t *)c->buffers[BUFFER_LAYOUT].data, l);
    CUDA_CALL(c, cudaMemsetAsync(l->kept, 0, sizeof *l->kept, c->stream), "cudaMemsetAsync(layout)");
    CUDA_CALL(c, cudaMemsetAsync(c->buffers[BUFFER_LIVE].data, 0, sizeof(known), c->stream), "cudaMemsetAsync(live)");
    l->numbers = (const int32_t *)c->buffers[BUFFER_NUMBERS].data;
    l->temp = c->buffers[BUFFER_SORT].data;
    l->temp_bytes = c->buffers[BUFFER_SORT].capacity;
    c->one_block = LAYOUT(one_block_shared)(v->model.bodies, (int32_t)sides) <= (size_t)c->shared_limit;
    v->model.live = l->live = &((known *)c->buffers[BUFFER_LIVE].data)->live;
    v->model.statistics = l->statistics = &((known *)c->buffers[BUFFER_LIVE].data)->statistics;
    v->graph.label = l->label;
    v->graph.island_bodies = l->island_bodies;
    v->graph.body_of = l->body_of;
    v->graph.slot_of = l->slot_of;
    v->graph.offsets = l->offsets;
    v->graph.incident = l->incident;
    v->graph.parts = l->parts;
    return SADMM_OK;
}

/* Contacts may have been found on the device: the view says where they are. */
static void bind_raw(struct sadmm_context *c)
{
    c->layout.pairs = c->view.raw.pairs;
    c->layout.points = c->view.raw.points;
    c->layout.blocks = c->view.raw.blocks;
}

static sadmm_status check_partition(struct sadmm_context *c, const struct cuda_partition *partition,
                                    struct sadmm_error *error)
{
    if (partition->tier != SADMM_CUDA_TIER_STREAM &&
        (partition->parts < 1 || partition->parts > most_parts(c) || partition->cluster < 1 ||
         partition->parts % partition->cluster != 0))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "partition: parts = %d: must be in [1, %lld] and a multiple of cluster = %d >= 1",
                          partition->parts, (long long)most_parts(c), partition->cluster);
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_statistics)(struct sadmm_context *c, bool islands, struct sadmm_error *error)
{
    bind_raw(c);
    CUDA_CALL(c,
              c->one_block ? LAYOUT(one_block)(&c->layout, true, islands, nullptr, c->stream, &c->kernel)
                           : LAYOUT(statistics)(&c->layout, islands, c->stream, &c->kernel),
              c->kernel);
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_layout)(struct sadmm_context *c, const struct cuda_partition *partition,
                                  struct sadmm_error *error)
{
    CUDA_TRY(check_partition(c, partition, error));
    CUDA_CALL(c,
              c->one_block ? LAYOUT(one_block)(&c->layout, false, false, partition, c->stream, &c->kernel)
                           : LAYOUT(make)(&c->layout, partition, c->stream, &c->kernel),
              c->kernel);
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_statistics_and_layout)(struct sadmm_context *c, bool islands,
                                             const struct cuda_partition *partition, struct sadmm_error *error)
{
    if (!c->one_block) {
        CUDA_TRY(CUDA(enqueue_statistics)(c, islands, error));
        return CUDA(enqueue_layout)(c, partition, error);
    }
    bind_raw(c);
    CUDA_TRY(check_partition(c, partition, error));
    CUDA_CALL(c, LAYOUT(one_block)(&c->layout, true, islands, partition, c->stream, &c->kernel), c->kernel);
    return SADMM_OK;
}

/* ---- room ------------------------------------------------------------------------------------------------------- */

/* Raw data, as core has it. Bodies: rigid, or A then b; then velocities. Blocks, then their multipliers. */
static sadmm_status reserve_raw(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    size_t n = (size_t)v->model.bodies, rows = (size_t)v->rows.count;
    size_t body = c->plan.rigid ? sizeof(struct sadmm_rigid) : 42 * sizeof(double);
    size_t bodies = n * (body + 6 * sizeof(double)),
           pairs = (size_t)v->contacts.pair_capacity * sizeof(struct sadmm_contact_pair);
    size_t points = (size_t)v->model.points * sizeof(struct sadmm_contact_point);
    size_t blocks = rows * (sizeof(struct sadmm_problem_block) + 6 * sizeof(double));
    const wanted_capacity wanted[] = {
        {BUFFER_RAW_BODIES, bodies}, {BUFFER_RAW_PAIRS, pairs}, {BUFFER_RAW_POINTS, points},
        {BUFFER_RAW_BLOCKS, blocks}, {PINNED_BODIES, bodies},   {PINNED_PAIRS, pairs},
        {PINNED_POINTS, points},     {PINNED_BLOCKS, blocks},
    };
    CUDA_TRY(make_capacity(c, wanted, error));
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
    raw = (char *)b[BUFFER_RAW_BLOCKS].data;
    v->raw.blocks = (const struct sadmm_problem_block *)raw;
    v->raw.block_lambda = (double *)(raw + rows * sizeof(struct sadmm_problem_block));
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
    CUDA_TRY(CUDA(reserve)(c, BUFFER_SIDES, 2 * pairs * (ROW * sizeof(double) + SIDE_NUMBERS * sizeof(solver_real)),
                           error));
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
    size_t n = (size_t)v->model.bodies, pairs = (size_t)v->contacts.pair_capacity, rows = (size_t)v->rows.stride,
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
    const wanted_capacity wanted[] = {
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
        {BUFFER_ROW_INFO, rows * sizeof(row_about)},
        {BUFFER_ROW_DATA, rows * ROW_PLANES * real_size},
        {BUFFER_RECORDS, records},
        {BUFFER_CHANGE, joins ? records : 0},
        {BUFFER_EXCHANGE, c->partition.tier == SADMM_CUDA_TIER_GRID ? 2 * n * ROW * real_size : 0},
        {BUFFER_SCALARS, SCALAR_BYTES},
        {BUFFER_OUT, out},
        {PINNED_OUT, out},
    };
    const void *const before[] = {c->buffers[BUFFER_ARM].data, c->buffers[BUFFER_LAMBDA].data};
    CUDA_TRY(make_capacity(c, wanted, error));

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
    v->rows.info = (row_about *)b[BUFFER_ROW_INFO].data;
    v->rows.data = (solver_real *)b[BUFFER_ROW_DATA].data;
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

/* ---- begin ------------------------------------------------------------------------------------------------------ */

/* The view's counts. */
static void count(struct sadmm_context *c)
{
    cuda_view *v = &c->view;
    v->model.bodies = c->plan.bodies;
    v->contacts.pair_capacity = (c->plan.pairs + WARP - 1) / WARP * WARP;
    v->model.points = c->plan.points;
    v->rows.count = (int32_t)sadmm_row_constraint_count(c->system);
    v->rows.stride = (v->rows.count + WARP - 1) / WARP * WARP;
    v->model.contact_rows = c->plan.contact_rows;
    v->model.warm_start = c->plan.warm_start;
}

static sadmm_status upload_live(struct sadmm_context *c, enum cuda_abort abort_code, struct sadmm_error *error)
{
    const struct cuda_live live = {abort_code, c->plan.bodies, c->plan.pairs, c->plan.points};
    return CUDA(upload)(c, c->view.model.live, PINNED_LIVE, 0, &live, sizeof live, error);
}

/* Constraints given by rows as blocks: what the kernels know of them. */
static sadmm_status upload_blocks(struct sadmm_context *c, struct sadmm_error *error)
{
    const struct sadmm_rows *rows = c->system->rows;
    const cuda_view *v = &c->view;
    const size_t count = rows->constraint_count, size = count * sizeof(struct sadmm_problem_block);
    struct sadmm_problem_block *blocks = (struct sadmm_problem_block *)sadmm_alloc(count, sizeof *blocks);
    double *lambda = (double *)sadmm_alloc(6 * count, sizeof *lambda);
    sadmm_status status = blocks && lambda ? SADMM_OK : sadmm_fail_memory(error, "the cuda backend's rows");
    for (size_t k = 0; k < count && status == SADMM_OK; ++k) {
        const struct sadmm_row_constraint *constraint = &rows->constraints[k];
        if (!sadmm_rows_as_block(rows, k, &blocks[k]))
            status = sadmm_fail(error, SADMM_ERROR_UNSUPPORTED,
                                "constraint %zu given by rows: the cuda backend has no rows with bounds, nor several kinds in one",
                                k);
        memcpy(lambda + 6 * k, rows->lambda + constraint->first, (size_t)constraint->count * sizeof *lambda);
    }
    if (status == SADMM_OK) status = CUDA(upload)(c, (void *)v->raw.blocks, PINNED_BLOCKS, 0, blocks, size, error);
    if (status == SADMM_OK)
        status = CUDA(upload)(c, v->raw.block_lambda, PINNED_BLOCKS, size, lambda, 6 * count * sizeof *lambda, error);
    sadmm_free(blocks);
    sadmm_free(lambda);
    return status;
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
    return v->rows.count > 0 ? upload_blocks(c, error) : SADMM_OK;
}

/* Wait for what the device knows now. */
static sadmm_status download_known(struct sadmm_context *c, struct known *out, struct sadmm_error *error)
{
    CUDA_CALL(c,
              cudaMemcpyAsync(c->buffers[PINNED_LIVE].data, c->view.model.live, sizeof *out, cudaMemcpyDeviceToHost,
                              c->stream),
              "cudaMemcpyAsync from the device");
    CUDA_TRY(CUDA(wait)(c, error));
    memcpy(out, c->buffers[PINNED_LIVE].data, sizeof *out);
    return SADMM_OK;
}

/* Parts that turn out to be too large: STREAM has none. */
static sadmm_status lay_out(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_partition *partition = &c->partition;
    struct known known;
    CUDA_TRY(CUDA(enqueue_layout)(c, partition, error));
    if (partition->tier == SADMM_CUDA_TIER_STREAM) return SADMM_OK;
    CUDA_TRY(download_known(c, &known, error));
    c->statistics = known.statistics;
    if (known.live.abort_code == ABORT_NONE) return SADMM_OK;
    if (c->wanted != SADMM_CUDA_TIER_AUTO)
        return sadmm_fail(
            error, SADMM_ERROR_UNSUPPORTED,
            "the cuda tier asked for: a thread block would get %d sides and %d bodies: at most %d and %d",
            known.statistics.part_sides, known.statistics.part_bodies, partition->most_sides, partition->most_bodies);
    *partition = {};
    partition->tier = SADMM_CUDA_TIER_STREAM;
    partition->islands = c->fast;
    CUDA_TRY(upload_live(c, ABORT_NONE, error));
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
    CUDA_TRY(upload_live(c, ABORT_NONE, error));
    bool islands = c->fast || (c->wanted != SADMM_CUDA_TIER_GRID && c->wanted != SADMM_CUDA_TIER_STREAM);
    struct known known;
    CUDA_TRY(CUDA(enqueue_statistics)(c, islands, error));
    CUDA_TRY(download_known(c, &known, error));
    c->statistics = known.statistics;
    CUDA_TRY(CUDA(choose_partition)(c, &c->statistics, &c->partition, error));
    CUDA_TRY(CUDA(reserve_solver)(c, error));
    return lay_out(c, error);
}

/* ---- for tests --------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(set_abort)(struct sadmm_context *c, enum cuda_abort abort_code, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(wait)(c, error));
    return upload_live(c, abort_code, error);
}

/* Survey and layout as a graph, launched twice: captured, nothing may depend on when it runs or what ran before. */
static sadmm_status run_graph(struct sadmm_context *c, const struct cuda_partition *partition,
                              struct sadmm_error *error)
{
    cudaGraph_t graph = nullptr;
    cudaGraphExec_t ready = nullptr;
    CUDA_CALL(c, cudaStreamBeginCapture(c->stream, cudaStreamCaptureModeThreadLocal), "cudaStreamBeginCapture");
    sadmm_status status = CUDA(enqueue_statistics_and_layout)(c, true, partition, error);
    CUDA_CALL(c, cudaStreamEndCapture(c->stream, &graph), "cudaStreamEndCapture");
    if (status == SADMM_OK) {
        cudaError_t code = cudaGraphInstantiate(&ready, graph, 0);
        for (int i = 0; i < 2 && code == cudaSuccess; ++i) code = cudaGraphLaunch(ready, c->stream);
        if (code != cudaSuccess) status = CUDA(fail)(c, code, "a graph of the layout", error);
    }
    if (status == SADMM_OK) status = CUDA(wait)(c, error);
    if (ready) cudaGraphExecDestroy(ready);
    if (graph) cudaGraphDestroy(graph);
    return status;
}

extern "C" sadmm_status CUDA(lay_out_again)(struct sadmm_context *c, const struct cuda_partition *partition,
                                            enum cuda_abort abort_code, int way, struct cuda_layout_copy *out,
                                            struct sadmm_error *error)
{
    const cuda_view *v = &c->view;
    struct known known;
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(wait)(c, error));
    CUDA_TRY(upload_live(c, abort_code, error));
    out->one_block = c->one_block && !(way & CUDA_LAYOUT_GENERAL);
    bool chosen = c->one_block;
    c->one_block = out->one_block;
    sadmm_status status = SADMM_OK;
    if (way & CUDA_LAYOUT_GRAPH) {
        status = run_graph(c, partition, error);
    } else {
        status = CUDA(enqueue_statistics)(c, true, error);
        if (status == SADMM_OK) status = CUDA(enqueue_layout)(c, partition, error);
    }
    c->one_block = chosen;
    CUDA_TRY(status);
    CUDA_TRY(download_known(c, &known, error));
    out->live = known.live;
    out->statistics = known.statistics;
    size_t n = (size_t)v->model.bodies, sides = known.statistics.sides >= 0 ? (size_t)known.statistics.sides : 0,
           parts = partition->tier == SADMM_CUDA_TIER_STREAM ? 0 : (size_t)partition->parts + 1;
    const struct {
        int32_t *to;
        const int32_t *from;
        size_t count;
    } arrays[] = {{out->body_of, v->graph.body_of, n},
                  {out->slot_of, v->graph.slot_of, n},
                  {out->offsets, v->graph.offsets, n + 1},
                  {out->incident, v->graph.incident, sides},
                  {out->parts, v->graph.parts, parts}};
    for (const auto &one : arrays) {
        CUDA_TRY(CUDA(reserve)(c, PINNED_OUT, one.count * sizeof(int32_t), error));
        CUDA_TRY(CUDA(download)(c, one.from, one.count * sizeof(int32_t), error));
        if (one.count > 0) memcpy(one.to, c->buffers[PINNED_OUT].data, one.count * sizeof(int32_t));
    }
    return SADMM_OK;
}
