/* The stages of a find: capacities and launches, repeated until everything fits, or enqueued once with the capacities
 * there are.
 */
#include <algorithm>

#include "backend_cuda/device/parallel.h"
#include "memory.h"
#include "pipeline.h"

/* ---- stages ---------------------------------------------------------------------------------------------------- */

static sadmm_status reserve_shape(struct sadmm_cuda_collision *c, size_t slots, bool tree, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const size_t leaves = (size_t)v->leaf_count;
    TRY(reserve(c, PROXIES, slots, sizeof *v->proxies, error));
    TRY(reserve(c, FILTERS, slots, sizeof *v->filters, error));
    TRY(reserve(c, PLACED, leaves, sizeof *v->placed, error));
    if (tree) {
        TRY(reserve(c, LEAF_KEYS, leaves, sizeof *v->leaf_keys, error));
        TRY(reserve(c, LEAF_NUMBERS, leaves, sizeof *v->leaf_numbers, error));
        TRY(reserve(c, LEAF_KEYS_2, leaves, sizeof *v->leaf_keys, error));
        TRY(reserve(c, LEAF_NUMBERS_2, leaves, sizeof *v->leaf_numbers, error));
        TRY(reserve(c, NODES, 2 * leaves, sizeof *v->nodes, error));
        TRY(reserve(c, GROUPS, 2 * leaves, sizeof *v->groups, error));
        TRY(reserve(c, PARENTS, 2 * leaves, sizeof *v->parents, error));
        TRY(reserve(c, ARRIVALS, leaves, sizeof *v->arrivals, error));
    }
    TRY(reserve(c, COUNTER, COUNTERS, sizeof *v->candidate_count, error));
    TRY(reserve(c, GRID, 1, sizeof *v->grid, error));
    v->proxies = in<struct sadmm_proxy>(c, PROXIES);
    v->filters = in<struct collision_filter>(c, FILTERS);
    v->placed = in<struct collision_leaf>(c, PLACED);
    v->leaf_keys = in<uint64_t>(c, LEAF_KEYS);
    v->leaf_numbers = in<uint32_t>(c, LEAF_NUMBERS);
    v->nodes = in<struct collision_node>(c, NODES);
    v->groups = in<struct collision_groups>(c, GROUPS);
    v->parents = in<int32_t>(c, PARENTS);
    v->arrivals = in<int32_t>(c, ARRIVALS);
    v->candidate_count = in<unsigned long long>(c, COUNTER);
    v->grid = in<struct collision_grid>(c, GRID);
    return SADMM_OK;
}

sadmm_status COLLISION(reserve_set)(struct sadmm_cuda_collision *c, int which, size_t pairs, size_t points,
                                      struct sadmm_error *error)
{
    const int shift = which * SET_BUFFERS;
    TRY(reserve(c, PAIRS + shift, pairs, sizeof(struct sadmm_contact_pair), error));
    TRY(reserve(c, POINTS + shift, points, sizeof(struct sadmm_contact_point), error));
    TRY(reserve(c, MIGRATIONS + shift, points, sizeof(struct sadmm_contact_migration), error));
    TRY(reserve(c, PAIR_KEYS + shift, pairs, sizeof(uint64_t), error));
    if (in<void>(c, COUNTS + shift)) return SADMM_OK;
    TRY(reserve(c, COUNTS + shift, 1, sizeof(struct sadmm_cuda_contact_counts), error));
    CUDA_CALL(c, cudaMemsetAsync(in<void>(c, COUNTS + shift), 0, sizeof(struct sadmm_cuda_contact_counts), c->stream),
              "cudaMemsetAsync(counts)");
    return SADMM_OK;
}

static sadmm_status reserve_candidate(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const size_t candidates = (size_t)c->candidate_capacity;
    TRY(reserve(c, CANDIDATES, candidates, sizeof *v->candidates, error));
    TRY(reserve(c, CANDIDATES_2, candidates, sizeof *v->candidates, error));
    TRY(reserve(c, LISTED, candidates, sizeof *v->listed, error));
    if (v->hulls) TRY(reserve(c, WALKS, candidates, sizeof *v->walks, error));
    if (v->hulls) TRY(reserve(c, IS_LISTED, candidates, sizeof *v->is_listed, error));
    if (v->mesh_count > 0) TRY(reserve(c, MESH_PAIRS, candidates, sizeof *v->mesh_pairs, error));
    if (v->mesh_count > 0) TRY(reserve(c, TOUCHES, candidates, sizeof *v->touches, error));
    TRY(reserve(c, MANIFOLDS, candidates, sizeof *v->manifolds, error));
    TRY(reserve(c, MATCHES, candidates, sizeof *v->matches, error));
    TRY(reserve(c, PAIR_OF, candidates, sizeof *v->pair_of, error));
    TRY(reserve(c, SIZES, candidates + SIZES_BEYOND, sizeof *v->sizes, error));
    TRY(reserve(c, EMIT_GENERAL, candidates, sizeof *v->general, error));
    TRY(reserve(c, PLACES, candidates + 1, sizeof *v->places, error));
    v->found = in<uint64_t>(c, CANDIDATES);
    v->listed = in<int32_t>(c, LISTED);
    v->walks = in<struct gjk_walk>(c, WALKS);
    v->mesh_pairs = in<uint64_t>(c, MESH_PAIRS);
    v->touches = in<double>(c, TOUCHES);
    v->manifolds = in<struct found_manifold>(c, MANIFOLDS);
    v->matches = in<int32_t>(c, MATCHES);
    v->pair_of = in<int32_t>(c, PAIR_OF);
    v->sizes = in<uint8_t>(c, SIZES);
    v->general = in<int32_t>(c, EMIT_GENERAL);
    v->places = in<uint64_t>(c, PLACES);
    v->candidate_capacity = (int32_t)c->candidate_capacity;
    v->point_capacity = (int32_t)c->point_capacity;
    return SADMM_OK;
}

static void use_sets(struct sadmm_cuda_collision *c, int from, int into)
{
    c->view.before = set_of(c, from);
    c->view.after = set_of(c, into);
}

/* Memory that sorts and scans of these sizes need. */
static bool has_tree(const struct sadmm_cuda_collision *c)
{
    return !c->view.grouped && c->view.leaf_count >= c->tree_from;
}

static sadmm_status reserve_temp(struct sadmm_cuda_collision *c, int leaves, int candidates,
                                   struct sadmm_error *error)
{
    uint64_t *none[2] = {nullptr, nullptr};
    uint32_t *no_values[2] = {nullptr, nullptr};
    size_t most = 0, bytes = 0;
    int unused;
    if (leaves <= c->temp_leaves && candidates <= c->temp_candidates) return SADMM_OK;
    leaves = std::max(leaves, c->temp_leaves);
    candidates = std::max(candidates, c->temp_candidates);
    CUDA_CALL(c, COLLISION(sort)(nullptr, &bytes, none, no_values, leaves, 64, &unused, c->stream),
              "sizing of the leaf sort");
    most = std::max(most, bytes);
    CUDA_CALL(c, COLLISION(sort)(nullptr, &bytes, none, nullptr, candidates, 64, &unused, c->stream),
              "sizing of the candidate sort");
    most = std::max(most, bytes);
    CUDA_CALL(c, COLLISION(sum)(nullptr, &bytes, nullptr, nullptr, candidates + 1, c->stream), "sizing of the scan");
    most = std::max(most, bytes);
    TRY(reserve(c, TEMP, most, 1, error));
    c->temp_leaves = leaves;
    c->temp_candidates = candidates;
    return SADMM_OK;
}

static sadmm_status build_tree(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    uint64_t *const keys[2] = {in<uint64_t>(c, LEAF_KEYS), in<uint64_t>(c, LEAF_KEYS_2)};
    uint32_t *const numbers[2] = {in<uint32_t>(c, LEAF_NUMBERS), in<uint32_t>(c, LEAF_NUMBERS_2)};
    size_t bytes = c->buffers[TEMP].capacity;
    int at = 0;
    v->leaf_keys = keys[0];
    v->leaf_numbers = numbers[0];
    c->kernel = "leaf sort";
    const int bits = LEAF_CLASS_BITS + v->group_bits + 3 * MORTON_BITS;
    CUDA_CALL(c, COLLISION(sort)(in<void>(c, TEMP), &bytes, keys, numbers, v->leaf_count, bits, &at, c->stream),
              c->kernel);
    v->leaf_keys = keys[at];
    v->leaf_numbers = numbers[at];
    TRY(launch(c, c->kernels.build, v->leaf_count, error));
    return launch(c, c->kernels.refit, v->leaf_count, error);
}

static bool ranked(const struct sadmm_cuda_collision *c) { return c->view.candidate_capacity < c->radix_from; }

static sadmm_status sort_candidates(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    uint64_t *const keys[2] = {v->found, in<uint64_t>(c, CANDIDATES_2)};
    size_t bytes = c->buffers[TEMP].capacity;
    int at = 0;
    v->candidates = keys[1];
    if (ranked(c)) return launch(c, c->kernels.rank, (int64_t)v->candidate_capacity * RANK_SHARES, error);
    c->kernel = "candidate sort";
    const int bits = 2 * v->slot_bits + v->subshape_bits;
    CUDA_CALL(c, COLLISION(sort)(in<void>(c, TEMP), &bytes, keys, nullptr, v->candidate_capacity, bits, &at, c->stream),
              c->kernel);
    v->candidates = keys[at];
    return SADMM_OK;
}

/* clear: they may be something. */
static sadmm_status find_candidates(struct sadmm_cuda_collision *c, bool tree, bool clear, struct sadmm_error *error)
{
    const struct collision_view *v = &c->view;
    if (clear && !ranked(c)) TRY(launch(c, c->kernels.clear, v->candidate_capacity, error));
    if (v->grouped) {
        TRY(launch(c, c->kernels.groups, v->leaf_count, error));
    } else if (tree) {
        TRY(launch(c, c->kernels.walk, v->leaf_count, error));
    } else {
        const bool small = v->leaf_count < SMALL_TILES_BELOW;
        const struct collision_launch &tiles = small ? c->kernels.small_tiles : c->kernels.tiles;
        const int64_t rows = (v->leaf_count + tiles.threads - 1) / tiles.threads;
        const int32_t columns = tile_columns(v->leaf_count, small ? SMALL_TILE_COLUMNS : TILE_COLUMNS);
        TRY(launch(c, tiles, rows * tiles.threads * columns, error));
    }
    if (v->mesh_count > 0) {
        const int64_t most = (int64_t)v->leaf_count * v->mesh_count, warps = c->kernels.expand_warps;
        TRY(launch(c, v->substeps == 1 ? c->kernels.expand : c->kernels.expand_first,
                   std::min(most, warps) * MESH_THREADS, error));
    }
    return sort_candidates(c, error);
}

/* Seams of candidates that are not listed, beside what comes next on the stream. */
static sadmm_status hide_beside(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    const cudaStream_t main = c->stream;
    CUDA_CALL(c, cudaEventRecord(c->made, main), "cudaEventRecord");
    CUDA_CALL(c, cudaStreamWaitEvent(c->side, c->made, 0), "cudaStreamWaitEvent");
    c->stream = c->side;
    const sadmm_status status = launch(c, c->kernels.seams, c->view.candidate_capacity, error);
    c->stream = main;
    TRY(status);
    CUDA_CALL(c, cudaEventRecord(c->hidden, c->side), "cudaEventRecord");
    return SADMM_OK;
}

static sadmm_status narrow_phase(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    const struct collision_view *v = &c->view;
    const struct collision_kernels *k = &c->kernels;
    const int64_t candidates = (int64_t)v->candidate_capacity + SIZES_BEYOND;
    const bool one = v->substeps == 1, first = v->substep == 0;
    const struct narrow_kernels *with = !v->hulls           ? &k->plain
                                        : c->smooth         ? &k->with_smooth
                                        : v->mesh_count > 0 ? &k->with_meshes
                                                            : &k->with_hulls;
    if (v->mesh_count > 0)
        TRY(launch(c, one ? with->touch : first ? with->touch_first : with->touch_again, v->candidate_capacity, error));
    TRY(launch(c, one ? with->at_once : first ? with->at_once_first : with->at_once_again, candidates, error));
    if (v->is_listed) TRY(hide_beside(c, error));
    if (v->hulls) TRY(launch(c, with->listed, v->candidate_capacity, error));
    if (!v->is_listed) return SADMM_OK;
    CUDA_CALL(c, cudaStreamWaitEvent(c->stream, c->hidden, 0), "cudaStreamWaitEvent");
    return launch(c, c->kernels.listed_seams, v->candidate_capacity, error);
}

static sadmm_status emit_contacts(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const int64_t lanes = (int64_t)v->candidate_capacity * POINT_LANES, general = GENERAL_BLOCKS * GENERAL_THREADS;
    size_t bytes = c->buffers[TEMP].capacity;
    if (ranked(c)) return launch(c, c->kernels.emit_few, lanes, error);
    c->kernel = "scan of the contacts";
    CUDA_CALL(c, COLLISION(sum)(in<void>(c, TEMP), &bytes, v->sizes, v->places, v->candidate_capacity + 1, c->stream),
              c->kernel);
    TRY(launch(c, c->kernels.emit, lanes, error));
    return launch(c, c->kernels.emit_general,
                  std::min<int64_t>((int64_t)v->candidate_capacity * GENERAL_LANES, general), error);
}

/* hits: what they change of the step, between narrow phase and seams, and before points slide; NULL: nothing. */
static sadmm_status make_contacts(struct sadmm_cuda_collision *c, const struct sadmm_cuda_hits *hits,
                                  struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    v->hides = v->seams.first && !v->hulls && !hits;
    v->is_listed = v->seams.first && v->hulls && !hits ? in<uint8_t>(c, IS_LISTED) : nullptr;
    v->carries = v->mesh_count > 0 && !hits && ranked(c);
    TRY(narrow_phase(c, error));
    if (hits) TRY(COLLISION(narrow_hits)(c, hits, error));
    if (v->seams.first && !v->hides && !v->is_listed) TRY(launch(c, c->kernels.seams, v->candidate_capacity, error));
    TRY(emit_contacts(c, error));
    if (hits) TRY(COLLISION(reopen_hits)(c, hits, error));
    if (v->mesh_count == 0 || v->carries) return SADMM_OK;
    return launch(c, c->kernels.carry, (int64_t)v->candidate_capacity * POINT_LANES, error);
}

static int many_placed(const struct sadmm_cuda_collision *c) { return c->view.leaf_count >= c->by_warp_from; }

/* Places, and with them the tree where it pays. */
static sadmm_status place_shapes(struct sadmm_cuda_collision *c, bool tree, struct sadmm_error *error)
{
    const struct collision_view *v = &c->view;
    c->view.leaf_keys = tree ? in<uint64_t>(c, LEAF_KEYS) : nullptr;
    c->view.leaf_numbers = in<uint32_t>(c, LEAF_NUMBERS);
    if (tree) TRY(launch(c, c->kernels.grid, 1, error));
    TRY(launch(c, (v->substeps == 1 ? c->kernels.place : c->kernels.place_first)[many_placed(c)],
               std::max(v->leaf_count + v->plane_count, 1), error));
    return tree ? build_tree(c, error) : SADMM_OK;
}

sadmm_status COLLISION(run_stages)(struct sadmm_cuda_collision *c, size_t slots,
                                   struct sadmm_cuda_contact_counts *counts, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const bool tree = has_tree(c);
    struct sadmm_cuda_contact_counts *const staged = in<struct sadmm_cuda_contact_counts>(c, PINNED_COUNTS);
    const int64_t first = std::max((int64_t)1024, (int64_t)8 * v->leaf_count);
    if (c->candidate_capacity == 0) c->candidate_capacity = std::min(first, MOST_CANDIDATES);
    if (c->point_capacity == 0) c->point_capacity = c->candidate_capacity;

    TRY(reserve_shape(c, slots, tree, error));
    TRY(reserve_temp(c, v->leaf_count, (int)c->candidate_capacity, error));
    TRY(COLLISION(reserve_set)(c, c->current, 0, 0, error));
    TRY(place_shapes(c, tree, error));
    for (;;) {
        TRY(reserve_candidate(c, error));
        TRY(COLLISION(reserve_set)(c, 1 - c->current, (size_t)c->candidate_capacity, (size_t)c->point_capacity, error));
        use_sets(c, c->current, 1 - c->current);
        TRY(reserve_temp(c, v->leaf_count, (int)c->candidate_capacity, error));
        TRY(find_candidates(c, tree, true, error));
        TRY(make_contacts(c, nullptr, error));
        TRY(copy(c, staged, v->after.counts, sizeof *staged, false, error));
        TRY(wait(c, error));
        c->pending = true;
        *counts = *staged;
        if (counts->candidates > MOST_CANDIDATES)
            return sadmm_fail(error, SADMM_ERROR_LIMIT, "%lld pairs of shapes may touch: at most %d can be indexed",
                              (long long)counts->candidates, (int)MOST_CANDIDATES);
        if (counts->candidates > c->candidate_capacity)
            c->candidate_capacity = std::min(generous(counts->candidates), MOST_CANDIDATES);
        else if (counts->points > c->point_capacity)
            c->point_capacity = std::min<int64_t>(generous(counts->points), INT32_MAX);
        else return SADMM_OK;
        ++c->stats.repeats;
        CUDA_CALL(c, cudaMemsetAsync(v->candidate_count, 0, COUNTERS * sizeof *v->candidate_count, c->stream),
                  "cudaMemsetAsync(counter)");
    }
}

/* ---- enqueued finds -------------------------------------------------------------------------------------------- */

extern "C" sadmm_status COLLISION(attach)(struct sadmm_cuda_collision *c, void *stream,
                                          const struct sadmm_collision_input *input,
                                          const struct sadmm_collision_body *bodies, int32_t *abort_code,
                                          const double *dt, const double *gravity, struct sadmm_error *error)
{
    c->can_undo = false;
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(COLLISION(take_input)(c, input, bodies, error));
    c->view.abort_code = abort_code;
    c->view.dt = dt;
    c->view.gravity = gravity;
    c->shape_slots = input->shape_count;
    return reserve_shape(c, input->shape_count, has_tree(c), error);
}

extern "C" void COLLISION(use_gravities)(struct sadmm_cuda_collision *c, const struct cuda_gravities *gravities)
{
    c->view.gravities = *gravities;
}

extern "C" struct sadmm_shape *COLLISION(shapes_to_set)(struct sadmm_cuda_collision *c)
{
    c->input_bytes[0] = SIZE_MAX;
    return in<struct sadmm_shape>(c, SHAPES);
}

/* Grow a buffer and keep what it holds. */
static sadmm_status keep_capacity(struct sadmm_cuda_collision *c, int name, size_t count, size_t size,
                              struct sadmm_error *error)
{
    struct collision_buffer old = c->buffers[name];
    if (!old.data || count * size <= old.capacity) return reserve(c, name, count, size, error);
    c->buffers[name].data = nullptr; /* the capacity stays: growth is by half at least */
    sadmm_status status = reserve(c, name, count, size, error);
    if (status == SADMM_OK) {
        cudaError_t code =
            cudaMemcpyAsync(in<void>(c, name), old.data, old.capacity, cudaMemcpyDeviceToDevice, c->stream);
        if (code == cudaSuccess) code = cudaStreamSynchronize(c->stream);
        if (code != cudaSuccess) status = fail(c, code, "cudaMemcpyAsync on the device", error);
    }
    if (status != SADMM_OK) {
        release(c, name);
        c->buffers[name] = old;
        return status;
    }
    (void)cudaFree(old.data);
    return SADMM_OK;
}

/* What steps of several sub-steps need besides. */
static sadmm_status reserve_substeps(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    TRY(reserve(c, BOXES, c->shape_slots, sizeof *v->boxes, error));
    TRY(reserve(c, REACHES, c->shape_slots, sizeof *v->reaches, error));
    v->boxes = in<struct sadmm_box3>(c, BOXES);
    v->reaches = in<struct collision_reach>(c, REACHES);
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(reserve)(struct sadmm_cuda_collision *c, bool substeps, int64_t *candidates,
                                           int64_t *points, struct sadmm_error *error)
{
    const int64_t likely = std::max((int64_t)1024, (int64_t)8 * c->view.leaf_count);
    ENTER(c);
    TRY(wait(c, error));
    if (*candidates > MOST_CANDIDATES)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%lld pairs of shapes may touch: at most %d can be indexed",
                          (long long)*candidates, (int)MOST_CANDIDATES);
    const int64_t first_points = c->point_capacity > 0 ? c->point_capacity : *points > 0 ? 1 : likely;
    c->candidate_capacity =
        std::max(c->candidate_capacity, *candidates > 0 ? *candidates : std::min(likely, MOST_CANDIDATES));
    c->point_capacity = std::max(first_points, *points);
    TRY(reserve_candidate(c, error));
    TRY(reserve_temp(c, c->view.leaf_count, (int)c->candidate_capacity, error));
    if (substeps) TRY(reserve_substeps(c, error));
    for (int which = 0; which < (substeps ? SADMM_CUDA_SETS : 2); ++which) {
        const int shift = which * SET_BUFFERS;
        TRY(keep_capacity(c, PAIRS + shift, (size_t)c->candidate_capacity, sizeof(struct sadmm_contact_pair), error));
        TRY(keep_capacity(c, PAIR_KEYS + shift, (size_t)c->candidate_capacity, sizeof(uint64_t), error));
        TRY(keep_capacity(c, POINTS + shift, (size_t)c->point_capacity, sizeof(struct sadmm_contact_point), error));
        TRY(keep_capacity(c, MIGRATIONS + shift, (size_t)c->point_capacity, sizeof(struct sadmm_contact_migration),
                          error));
        TRY(COLLISION(reserve_set)(c, which, 0, 0, error));
    }
    *candidates = c->candidate_capacity;
    *points = c->point_capacity;
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(enqueue)(struct sadmm_cuda_collision *c, void *stream,
                                           const struct sadmm_cuda_find *find, struct sadmm_error *error)
{
    const bool tree = has_tree(c);
    c->stream = (cudaStream_t)stream;
    c->view.pdl = find->pdl;
    c->pending = true;
    c->view.substeps = find->substeps;
    c->view.substep = find->substep;
    c->view.threshold = find->threshold;
    use_sets(c, find->from, find->into);
    if (find->substep > 0) {
        TRY(launch(c, c->kernels.place_again[many_placed(c)],
                   std::max(c->view.leaf_count + c->view.plane_count, 1), error));
        return make_contacts(c, nullptr, error);
    }
    if (!find->hits) { /* else all of this is done */
        TRY(place_shapes(c, tree, error));
        TRY(find_candidates(c, tree, true, error));
    }
    return make_contacts(c, find->hits, error);
}

extern "C" sadmm_status COLLISION(enqueue_hits)(struct sadmm_cuda_collision *c, void *stream,
                                                const struct sadmm_cuda_find *find, struct sadmm_error *error)
{
    const bool tree = has_tree(c);
    int32_t *const abort_code = c->view.abort_code;
    c->stream = (cudaStream_t)stream;
    c->view.pdl = find->pdl;
    c->pending = true;
    c->view.substeps = 1;
    c->view.substep = 0;
    use_sets(c, find->from, find->into);
    TRY(place_shapes(c, tree, error));
    TRY(find_candidates(c, tree, true, error));
    TRY(COLLISION(take_hits)(c, find->hits, error));
    if (tree) { /* as it is, with other boxes */
        TRY(launch(c, c->kernels.build, c->view.leaf_count, error));
        TRY(launch(c, c->kernels.refit, c->view.leaf_count, error));
    }
    c->view.abort_code = &c->hits.state->quiet; /* nothing was hit: nothing is searched for again */
    const sadmm_status status = find_candidates(c, tree, false, error);
    c->view.abort_code = abort_code;
    return status;
}
