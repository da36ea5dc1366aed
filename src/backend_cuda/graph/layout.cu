/* The layout on the host's side (device/layout.h): its arrays, what enqueues its stages, and what is known of a
 * step. */
#include <string.h>

#include "graph.h"

/* ---- arrays ---------------------------------------------------------------------------------------------------- */

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

static struct layout_stream stream_of(const struct sadmm_context *c) { return {c->stream, all_use_pdl(c)}; }

/* 0, 1, ...: values of the sorts, the same in every step. */
static sadmm_status number(struct sadmm_context *c, size_t count, struct sadmm_error *error)
{
    cuda_buffer *numbers = &c->buffers[BUFFER_NUMBERS];
    size_t before = numbers->capacity;
    TRY(CUDA(reserve)(c, BUFFER_NUMBERS, count * sizeof(int32_t), error));
    if (numbers->capacity == before && c->numbered) return SADMM_OK;
    c->numbered = false;
    CUDA_CALL(c,
              LAYOUT(number)((int32_t *)numbers->data, (int32_t)(numbers->capacity / sizeof(int32_t)), stream_of(c),
                             &c->kernel),
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
    const cuda_capacity wanted[] = {
        {BUFFER_LIVE, sizeof(cuda_known)},
        {PINNED_LIVE, sizeof(cuda_known)},
        {BUFFER_LAYOUT, place_arrays(c, nullptr, l)},
        {BUFFER_SORT, temp},
    };
    TRY(reserve_all(c, wanted, error));
    TRY(number(c, sides > (size_t)v->model.bodies ? sides : (size_t)v->model.bodies, error));
    place_arrays(c, (int32_t *)c->buffers[BUFFER_LAYOUT].data, l);
    CUDA_CALL(c, cudaMemsetAsync(l->kept, 0, sizeof *l->kept, c->stream), "cudaMemsetAsync(layout)");
    CUDA_CALL(c, cudaMemsetAsync(c->buffers[BUFFER_LIVE].data, 0, sizeof(cuda_known), c->stream),
              "cudaMemsetAsync(live)");
    l->numbers = (const int32_t *)c->buffers[BUFFER_NUMBERS].data;
    l->temp = c->buffers[BUFFER_SORT].data;
    l->temp_bytes = c->buffers[BUFFER_SORT].capacity;
    c->one_block = LAYOUT(one_block_shared)(v->model.bodies, (int32_t)sides) <= (size_t)c->shared_limit;
    v->model.live = l->live = &((cuda_known *)c->buffers[BUFFER_LIVE].data)->live;
    v->model.statistics = l->statistics = &((cuda_known *)c->buffers[BUFFER_LIVE].data)->statistics;
    v->graph.label = l->label;
    v->graph.island_bodies = l->island_bodies;
    v->graph.body_of = l->body_of;
    v->graph.slot_of = l->slot_of;
    v->graph.offsets = l->offsets;
    v->graph.incident = l->incident;
    v->graph.parts = l->parts;
    return SADMM_OK;
}

/* ---- stages ---------------------------------------------------------------------------------------------------- */

/* Contacts may have been found on the device: the view says where they are. */
static void bind_raw(struct sadmm_context *c)
{
    c->layout.pairs = c->view.raw.pairs;
    c->layout.points = c->view.raw.points;
    c->layout.constraints = c->view.raw.constraints;
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
              c->one_block ? LAYOUT(one_block)(&c->layout, true, islands, nullptr, stream_of(c), &c->kernel)
                           : LAYOUT(statistics)(&c->layout, islands, stream_of(c), &c->kernel),
              c->kernel);
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_layout)(struct sadmm_context *c, const struct cuda_partition *partition,
                                  struct sadmm_error *error)
{
    TRY(check_partition(c, partition, error));
    CUDA_CALL(c,
              c->one_block ? LAYOUT(one_block)(&c->layout, false, false, partition, stream_of(c), &c->kernel)
                           : LAYOUT(make)(&c->layout, partition, stream_of(c), &c->kernel),
              c->kernel);
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_statistics_and_layout)(struct sadmm_context *c, bool islands,
                                             const struct cuda_partition *partition, struct sadmm_error *error)
{
    if (!c->one_block) {
        TRY(CUDA(enqueue_statistics)(c, islands, error));
        return CUDA(enqueue_layout)(c, partition, error);
    }
    bind_raw(c);
    TRY(check_partition(c, partition, error));
    CUDA_CALL(c, LAYOUT(one_block)(&c->layout, true, islands, partition, stream_of(c), &c->kernel), c->kernel);
    return SADMM_OK;
}

/* ---- what is known --------------------------------------------------------------------------------------------- */

sadmm_status CUDA(upload_live)(struct sadmm_context *c, enum cuda_abort abort_code, struct sadmm_error *error)
{
    const struct cuda_live live = {abort_code, c->plan.bodies, c->plan.pairs, c->plan.points};
    return CUDA(upload)(c, c->view.model.live, PINNED_LIVE, 0, &live, sizeof live, error);
}

/* Wait for what the device knows now. */
sadmm_status CUDA(download_known)(struct sadmm_context *c, struct cuda_known *out, struct sadmm_error *error)
{
    CUDA_CALL(c,
              cudaMemcpyAsync(c->buffers[PINNED_LIVE].data, c->view.model.live, sizeof *out, cudaMemcpyDeviceToHost,
                              c->stream),
              "cudaMemcpyAsync from the device");
    TRY(CUDA(wait)(c, error));
    memcpy(out, c->buffers[PINNED_LIVE].data, sizeof *out);
    return SADMM_OK;
}

/* ---- for tests ------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(set_abort)(struct sadmm_context *c, enum cuda_abort abort_code, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    TRY(CUDA(wait)(c, error));
    c->placed = false; /* what was to place records while aborted did nothing */
    return CUDA(upload_live)(c, abort_code, error);
}

/* Statistics and layout as a graph, launched twice: captured, nothing may depend on when it runs or what ran before. */
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
    struct cuda_known known;
    CUDA_ENTER(c);
    TRY(CUDA(wait)(c, error));
    TRY(CUDA(upload_live)(c, abort_code, error));
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
    TRY(status);
    TRY(CUDA(download_known)(c, &known, error));
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
        TRY(CUDA(reserve)(c, PINNED_OUT, one.count * sizeof(int32_t), error));
        TRY(CUDA(download)(c, one.from, one.count * sizeof(int32_t), error));
        if (one.count > 0) memcpy(one.to, c->buffers[PINNED_OUT].data, one.count * sizeof(int32_t));
    }
    return SADMM_OK;
}
