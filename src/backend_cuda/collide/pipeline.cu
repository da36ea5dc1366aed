/* The pipeline on the host's side: buffers that only grow, input, the stages of a find, contact sets to and fro.
 *
 * What rarely changes (shapes, overrides, which shapes there are) is kept in pinned memory as it was last uploaded, and
 * uploaded again only when it differs. Pinned memory is written only while nothing reads it: every entry that leaves
 * work on the stream behind sets `pending`, and the next one waits first.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <algorithm>

#include "core/base/memory.h"
#include "view.h"
#include "backend_cuda/device/parallel.h"

/* Memory of the device or pinned memory of the host. */
struct collision_buffer {
    void *data;
    size_t capacity; /* bytes */
};

enum buffer_name {
    /* device */
    PROXIES, FILTERS, PLACED, LEAF_KEYS, LEAF_KEYS_2, LEAF_SLOTS, LEAF_SLOTS_2, NODES, GROUPS, PARENTS, ARRIVALS,
    COUNTER, GRID, CANDIDATES, CANDIDATES_2, MANIFOLDS, MATCHES, SIZES, PLACES, TEMP,
    PAIRS, POINTS, PAIR_KEYS, COUNTS, PAIRS_2, POINTS_2, PAIR_KEYS_2, COUNTS_2,
    SHAPES, BODIES, PRESENT, PLANES, DISABLED_PAIRS, FRICTION_PAIRS, FRICTION_VALUES,
    /* pinned: first what was uploaded to the last buffers above, in their order */
    PINNED_SHAPES, PINNED_BODIES, PINNED_PRESENT, PINNED_PLANES, PINNED_DISABLED_PAIRS, PINNED_FRICTION_PAIRS,
    PINNED_FRICTION_VALUES, PINNED_PAIRS, PINNED_POINTS, PINNED_PAIR_KEYS, PINNED_COUNTS,
    BUFFERS
};
enum { SET_BUFFERS = COUNTS_2 - COUNTS, INPUTS = PINNED_SHAPES - SHAPES };

static const char *const buffer_names[BUFFERS] = {
    "placed shapes", "filters", "boxes", "tree keys", "sorted tree keys", "leaves", "sorted leaves", "tree", "groups",
    "parents", "arrivals", "counter", "grid", "candidates", "sorted candidates", "manifolds", "matches", "sizes",
    "places", "sort",
    "contact pairs", "contact points", "contact keys", "contact counts",
    "contact pairs", "contact points", "contact keys", "contact counts",
    "shapes", "bodies", "list of shapes", "planes", "disabled pairs", "friction pairs", "friction values",
    "staged shapes", "staged bodies", "staged list of shapes", "staged planes", "staged disabled pairs",
    "staged friction pairs", "staged friction values", "staged contact pairs", "staged contact points",
    "staged contact keys", "staged contact counts",
};

/* Shapes from which the tree pays, room from which the radix sort does. */
enum { TREE_FROM = 6144 };
static const int64_t RADIX_FROM = 16385;
/* As on the host: contact points are indexed by 32 bits. */
static const int64_t MOST_CANDIDATES = INT32_MAX / SADMM_MAX_POINTS;
/* A mover of this many median radii is large. */
static const double LARGE = 8;

struct contact_counts {
    int32_t pairs, points;
    double dt;
};

namespace {

/* The device is current while this lives; then the caller's again. Internal linkage: the emulated build has its own. */
class current_device {
public:
    cudaError_t code;
    explicit current_device(int device) : before(device)
    {
        code = cudaGetDevice(&before);
        if (code == cudaSuccess && before != device) code = cudaSetDevice(device);
    }
    ~current_device() { (void)cudaSetDevice(before); }
    current_device(const current_device &) = delete;
    current_device &operator=(const current_device &) = delete;

private:
    int before;
};

} // namespace

struct sadmm_cuda_collision {
    int device;
    struct collision_kernels kernels;
    struct collision_view view;
    struct collision_buffer buffers[BUFFERS];
    size_t input_bytes[INPUTS]; /* as uploaded; SIZE_MAX: not */

    int current;                /* of the two sets */
    struct contact_counts counts[2];
    bool can_undo;

    cudaStream_t stream;        /* where work is pending */
    bool pending;
    const char *kernel;         /* launched last: what an asynchronous error is about, or what ran before it */

    int32_t tree_from;
    int64_t radix_from;
    int64_t candidate_room, point_room;
    int temp_leaves, temp_candidates; /* what TEMP is large enough for */
    struct sadmm_cuda_collision_stats stats;

    /* host arrays, made when shapes change */
    uint32_t *present;
    uint64_t *planes;
    double *radii;
    size_t present_capacity, plane_capacity, radius_capacity;
};

#define CUDA_CALL(c, call, what)                                                 \
    do {                                                                         \
        cudaError_t try_code = (call);                                           \
        if (try_code != cudaSuccess) return fail((c), try_code, (what), error);  \
    } while (0)
#define ENTER(c)                          \
    current_device scope((c)->device);    \
    CUDA_CALL((c), scope.code, "cudaSetDevice")

/* ---- errors, memory, launches ---------------------------------------------------------------------------------- */

static sadmm_status fail(const struct sadmm_cuda_collision *c, cudaError_t code, const char *what,
                         struct sadmm_error *error)
{
    (void)cudaGetLastError(); /* an error that does not last must not be found by the next call */
    return sadmm_fail(error, code == cudaErrorMemoryAllocation ? SADMM_ERROR_OUT_OF_MEMORY : SADMM_ERROR_DEVICE,
                      "CUDA device %d: %s: %s", c->device, what, cudaGetErrorString(code));
}

static sadmm_status wait(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    cudaError_t code = cudaStreamSynchronize(c->stream);
    if (code == cudaSuccess) {
        c->pending = false;
        return SADMM_OK;
    }
    char what[160];
    snprintf(what, sizeof what, "kernel %s (the last one launched, or one before it)", c->kernel ? c->kernel : "none");
    return fail(c, code, what, error);
}

/* From here on there may be work on the stream; what an earlier entry left there is done. */
static sadmm_status begin_work(struct sadmm_cuda_collision *c, void *stream, struct sadmm_error *error)
{
    if (c->pending) TRY(wait(c, error));
    c->stream = (cudaStream_t)stream;
    c->pending = true;
    return SADMM_OK;
}

static void release(struct sadmm_cuda_collision *c, int name)
{
    struct collision_buffer *b = &c->buffers[name];
    if (b->data) (void)(name >= PINNED_SHAPES ? cudaFreeHost(b->data) : cudaFree(b->data));
    b->data = nullptr;
    b->capacity = 0;
}

/* At least count x size bytes; what the buffer held is lost when it grows. */
static sadmm_status room(struct sadmm_cuda_collision *c, int name, size_t count, size_t size, struct sadmm_error *error)
{
    struct collision_buffer *b = &c->buffers[name];
    size_t bytes = count * size, wanted = b->capacity + b->capacity / 2;
    if (b->data && bytes <= b->capacity) return SADMM_OK;
    if (wanted < bytes) wanted = bytes;
    if (wanted < 256) wanted = 256;
    char what[96];
    snprintf(what, sizeof what, "allocation of %zu bytes for collision's %s", wanted, buffer_names[name]);
    if (sadmm_test_allocation_fails()) return fail(c, cudaErrorMemoryAllocation, what, error);
    release(c, name);
    CUDA_CALL(c, name >= PINNED_SHAPES ? cudaMallocHost(&b->data, wanted) : cudaMalloc(&b->data, wanted), what);
    b->capacity = wanted;
    ++c->stats.allocations;
    /* Sets are copied whole when they grow, and the grid is read where there is no tree. */
    if (name == GRID || (name >= PAIRS && name < SHAPES))
        CUDA_CALL(c, cudaMemsetAsync(b->data, 0, wanted, c->stream), what);
    return SADMM_OK;
}

template <class T> static T *in(const struct sadmm_cuda_collision *c, int name) { return (T *)c->buffers[name].data; }

#ifdef SADMM_CUDA_EMULATED
struct emulated_call {
    void (*kernel)(const collision_view);
    struct collision_view view;
};
static void run_emulated(const emulated_call call, const int) { call.kernel(call.view); }
#endif

static sadmm_status launch(struct sadmm_cuda_collision *c, const struct collision_launch &what, int64_t threads,
                           struct sadmm_error *error)
{
    const unsigned blocks = (unsigned)((threads + what.threads - 1) / what.threads);
    if (threads <= 0) return SADMM_OK;
    c->kernel = what.name;
#ifdef SADMM_CUDA_EMULATED
    const emulated_call call = {what.kernel, c->view};
    cudaError_t code = cuda_emulation_launch(run_emulated, blocks, (unsigned)what.threads, what.shared, call, 0);
#else
    const dim3 grid(blocks), threads_a_block((unsigned)what.threads);
    void *parameters[] = {&c->view};
    cudaError_t code = cudaLaunchKernel((const void *)what.kernel, grid, threads_a_block, parameters, 0, c->stream);
#endif
    CUDA_CALL(c, code, what.name);
    return SADMM_OK;
}

static sadmm_status copy(struct sadmm_cuda_collision *c, void *to, const void *from, size_t bytes, bool to_device,
                         struct sadmm_error *error)
{
    const auto kind = to_device ? cudaMemcpyHostToDevice : cudaMemcpyDeviceToHost;
    if (bytes > 0)
        CUDA_CALL(c, cudaMemcpyAsync(to, from, bytes, kind, c->stream),
                  to_device ? "cudaMemcpyAsync to the device" : "cudaMemcpyAsync from the device");
    return SADMM_OK;
}

/* ---- input ----------------------------------------------------------------------------------------------------- */

/* Bring one of the input buffers up to date. `changed`: no need to compare. */
static sadmm_status upload_input(struct sadmm_cuda_collision *c, int name, const void *data, size_t count, size_t size,
                                 bool changed, struct sadmm_error *error)
{
    const int staged = name + INPUTS;
    const size_t bytes = count * size;
    size_t *uploaded = &c->input_bytes[name - SHAPES];
    if (!changed && *uploaded == bytes && (bytes == 0 || memcmp(in<void>(c, staged), data, bytes) == 0))
        return SADMM_OK;
    *uploaded = SIZE_MAX;
    TRY(room(c, name, count, size, error));
    TRY(room(c, staged, count, size, error));
    if (bytes > 0) memcpy(in<void>(c, staged), data, bytes);
    TRY(copy(c, in<void>(c, name), in<void>(c, staged), bytes, true, error));
    *uploaded = bytes;
    return SADMM_OK;
}

/* A slot's revision changes with everything that matters. */
static bool shapes_changed(const struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input)
{
    const struct sadmm_shape *before = in<struct sadmm_shape>(c, PINNED_SHAPES);
    if (c->input_bytes[0] != input->shape_count * sizeof *before) return true;
    for (size_t slot = 0; slot < input->shape_count; ++slot) {
        const struct sadmm_shape *now = &input->shapes[slot], *old = &before[slot];
        if (now->alive != old->alive || now->revision != old->revision || now->body != old->body)
            return true;
    }
    return false;
}

static bool grow(void *array, size_t *capacity, size_t needed, size_t size)
{
    return sadmm_grow((void **)array, capacity, 0, needed, size);
}

/* The list of shapes: leaves, then planes; and from which radius a mover is large. */
static sadmm_status list_shapes(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    size_t leaves = 0, planes = 0;
    if (!grow(&c->present, &c->present_capacity, input->shape_count, sizeof *c->present) ||
        !grow(&c->radii, &c->radius_capacity, input->shape_count, sizeof *c->radii))
        return sadmm_fail_memory(error, "collision's list of shapes");
    for (size_t slot = 0; slot < input->shape_count; ++slot) {
        const struct sadmm_shape *shape = &input->shapes[slot];
        if (!shape->alive || shape->type == SADMM_SHAPE_PLANE) continue;
        c->radii[leaves] = shape_radius((int)shape->type, shape->size);
        c->present[leaves++] = (uint32_t)slot;
    }
    for (size_t slot = 0; slot < input->shape_count; ++slot)
        if (input->shapes[slot].alive && input->shapes[slot].type == SADMM_SHAPE_PLANE)
            c->present[leaves + planes++] = (uint32_t)slot;
    if (!grow(&c->planes, &c->plane_capacity, planes, sizeof *c->planes))
        return sadmm_fail_memory(error, "collision's list of planes");
    v->leaf_count = (int32_t)leaves;
    v->plane_count = (int32_t)planes;
    v->large = HUGE_VAL;
    if (leaves > 0) {
        std::nth_element(c->radii, c->radii + leaves / 2, c->radii + leaves);
        v->large = LARGE * c->radii[leaves / 2];
    }
    return SADMM_OK;
}

/* Planes by group; bodies, and with them groups, may be others without any change of a shape. */
static sadmm_status list_planes(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const size_t count = (size_t)v->plane_count;
    v->shared_planes = 0;
    for (size_t i = 0; i < count; ++i) {
        const uint32_t slot = c->present[(size_t)v->leaf_count + i];
        const int32_t group = input->bodies[input->shapes[slot].body].environment;
        c->planes[i] = group < 0 ? slot : ordered_key((uint32_t)group + 1, slot);
        if (group < 0) ++v->shared_planes;
    }
    std::sort(c->planes, c->planes + count);
    return upload_input(c, PLANES, c->planes, count, sizeof *c->planes, false, error);
}

static int32_t group_bits(const struct sadmm_collision_input *input)
{
    int32_t last = 0, bits = 0;
    for (size_t i = 0; i < input->body_count; ++i) last = std::max(last, input->bodies[i].environment);
    while (last >> bits) ++bits;
    return bits;
}

/* `bodies`: on the device already; NULL: the input's. */
static sadmm_status take_input(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                               const struct sadmm_collision_body *bodies, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    if (input->shape_count > (size_t)INT32_MAX / 2 || input->body_count > (size_t)INT32_MAX ||
        input->disabled_body_pair_count > (size_t)INT32_MAX || input->friction_pair_count > (size_t)INT32_MAX)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%zu shapes, %zu bodies: at most %d and %d can be indexed",
                          input->shape_count, input->body_count, (int)(INT32_MAX / 2), (int)INT32_MAX);
    if (shapes_changed(c, input)) {
        c->input_bytes[0] = SIZE_MAX;
        TRY(list_shapes(c, input, error));
        TRY(upload_input(c, PRESENT, c->present, (size_t)(v->leaf_count + v->plane_count), sizeof *c->present, true,
                         error));
        TRY(upload_input(c, SHAPES, input->shapes, input->shape_count, sizeof *input->shapes, true, error));
    }
    if (!bodies) TRY(upload_input(c, BODIES, input->bodies, input->body_count, sizeof *input->bodies, true, error));
    TRY(list_planes(c, input, error));
    TRY(upload_input(c, DISABLED_PAIRS, input->disabled_body_pairs, input->disabled_body_pair_count,
                     sizeof *input->disabled_body_pairs, false, error));
    TRY(upload_input(c, FRICTION_PAIRS, input->friction_pairs, input->friction_pair_count,
                     sizeof *input->friction_pairs, false, error));
    TRY(upload_input(c, FRICTION_VALUES, input->friction_values, input->friction_pair_count,
                     sizeof *input->friction_values, false, error));

    v->shapes = in<struct sadmm_shape>(c, SHAPES);
    v->bodies = bodies ? bodies : in<struct sadmm_collision_body>(c, BODIES);
    v->body_count = (int32_t)input->body_count;
    v->group_bits = group_bits(input);
    v->halt = nullptr;
    v->present = in<uint32_t>(c, PRESENT);
    v->planes = in<uint64_t>(c, PLANES);
    v->disabled_pairs = in<uint64_t>(c, DISABLED_PAIRS);
    v->friction_pairs = in<uint64_t>(c, FRICTION_PAIRS);
    v->friction_values = in<double>(c, FRICTION_VALUES);
    v->disabled_count = (int32_t)input->disabled_body_pair_count;
    v->friction_count = (int32_t)input->friction_pair_count;
    v->step.dt = input->dt;
    v->step.margin = input->margin;
    v->step.gravity = input->gravity;
    for (v->slot_bits = 1; input->shape_count >> v->slot_bits; ++v->slot_bits) {}
    return SADMM_OK;
}

/* ---- stages ---------------------------------------------------------------------------------------------------- */

static sadmm_status make_shape_room(struct sadmm_cuda_collision *c, size_t slots, bool tree, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const size_t leaves = (size_t)v->leaf_count;
    TRY(room(c, PROXIES, slots, sizeof *v->proxies, error));
    TRY(room(c, FILTERS, slots, sizeof *v->filters, error));
    TRY(room(c, PLACED, slots, sizeof *v->placed, error));
    TRY(room(c, LEAF_KEYS, leaves, sizeof *v->leaf_keys, error));
    TRY(room(c, LEAF_SLOTS, leaves, sizeof *v->leaf_slots, error));
    if (tree) {
        TRY(room(c, LEAF_KEYS_2, leaves, sizeof *v->leaf_keys, error));
        TRY(room(c, LEAF_SLOTS_2, leaves, sizeof *v->leaf_slots, error));
        TRY(room(c, NODES, 2 * leaves, sizeof *v->nodes, error));
        TRY(room(c, GROUPS, 2 * leaves, sizeof *v->groups, error));
        TRY(room(c, PARENTS, 2 * leaves, sizeof *v->parents, error));
        TRY(room(c, ARRIVALS, leaves, sizeof *v->arrivals, error));
    }
    TRY(room(c, COUNTER, 1, sizeof *v->candidate_count, error));
    TRY(room(c, GRID, 1, sizeof *v->grid, error));
    v->proxies = in<struct sadmm_proxy>(c, PROXIES);
    v->filters = in<struct collision_filter>(c, FILTERS);
    v->placed = in<struct collision_leaf>(c, PLACED);
    v->leaf_keys = in<uint64_t>(c, LEAF_KEYS);
    v->leaf_slots = in<uint32_t>(c, LEAF_SLOTS);
    v->nodes = in<struct collision_node>(c, NODES);
    v->groups = in<struct collision_groups>(c, GROUPS);
    v->parents = in<int32_t>(c, PARENTS);
    v->arrivals = in<int32_t>(c, ARRIVALS);
    v->candidate_count = in<unsigned long long>(c, COUNTER);
    v->grid = in<struct collision_grid>(c, GRID);
    return SADMM_OK;
}

static struct collision_set set_of(const struct sadmm_cuda_collision *c, int which)
{
    const int shift = which * SET_BUFFERS;
    struct collision_set set;
    set.pairs = in<struct sadmm_contact_pair>(c, PAIRS + shift);
    set.points = in<struct sadmm_contact_point>(c, POINTS + shift);
    set.keys = in<uint64_t>(c, PAIR_KEYS + shift);
    set.counts = in<struct sadmm_cuda_contact_counts>(c, COUNTS + shift);
    return set;
}

static sadmm_status make_set_room(struct sadmm_cuda_collision *c, int which, size_t pairs, size_t points,
                                  struct sadmm_error *error)
{
    const int shift = which * SET_BUFFERS;
    TRY(room(c, PAIRS + shift, pairs, sizeof(struct sadmm_contact_pair), error));
    TRY(room(c, POINTS + shift, points, sizeof(struct sadmm_contact_point), error));
    TRY(room(c, PAIR_KEYS + shift, pairs, sizeof(uint64_t), error));
    if (in<void>(c, COUNTS + shift)) return SADMM_OK;
    TRY(room(c, COUNTS + shift, 1, sizeof(struct sadmm_cuda_contact_counts), error));
    CUDA_CALL(c, cudaMemsetAsync(in<void>(c, COUNTS + shift), 0, sizeof(struct sadmm_cuda_contact_counts), c->stream),
              "cudaMemsetAsync(counts)");
    return SADMM_OK;
}

static sadmm_status make_candidate_room(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const size_t candidates = (size_t)c->candidate_room;
    TRY(room(c, CANDIDATES, candidates, sizeof *v->candidates, error));
    TRY(room(c, CANDIDATES_2, candidates, sizeof *v->candidates, error));
    TRY(room(c, MANIFOLDS, candidates, sizeof *v->manifolds, error));
    TRY(room(c, MATCHES, candidates, sizeof *v->matches, error));
    TRY(room(c, SIZES, candidates + SIZES_BEYOND, sizeof *v->sizes, error));
    TRY(room(c, PLACES, candidates + 1, sizeof *v->places, error));
    v->found = in<uint64_t>(c, CANDIDATES);
    v->manifolds = in<struct manifold>(c, MANIFOLDS);
    v->matches = in<int32_t>(c, MATCHES);
    v->sizes = in<uint8_t>(c, SIZES);
    v->places = in<uint64_t>(c, PLACES);
    v->candidate_room = (int32_t)c->candidate_room;
    v->point_room = (int32_t)c->point_room;
    return SADMM_OK;
}

/* From the other set into this one. */
static void use_sets(struct sadmm_cuda_collision *c, int into)
{
    c->view.before = set_of(c, 1 - into);
    c->view.after = set_of(c, into);
}

/* Memory that sorts and scans of these sizes need. */
static sadmm_status make_temp_room(struct sadmm_cuda_collision *c, int leaves, int candidates,
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
    TRY(room(c, TEMP, most, 1, error));
    c->temp_leaves = leaves;
    c->temp_candidates = candidates;
    return SADMM_OK;
}

static sadmm_status build_tree(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    uint64_t *const keys[2] = {in<uint64_t>(c, LEAF_KEYS), in<uint64_t>(c, LEAF_KEYS_2)};
    uint32_t *const slots[2] = {in<uint32_t>(c, LEAF_SLOTS), in<uint32_t>(c, LEAF_SLOTS_2)};
    size_t bytes = c->buffers[TEMP].capacity;
    int at = 0;
    v->leaf_keys = keys[0];
    v->leaf_slots = slots[0];
    c->kernel = "leaf sort";
    CUDA_CALL(c, COLLISION(sort)(in<void>(c, TEMP), &bytes, keys, slots, v->leaf_count, 64, &at, c->stream), c->kernel);
    v->leaf_keys = keys[at];
    v->leaf_slots = slots[at];
    TRY(launch(c, c->kernels.build, v->leaf_count, error));
    return launch(c, c->kernels.refit, v->leaf_count, error);
}

static bool ranked(const struct sadmm_cuda_collision *c) { return c->view.candidate_room < c->radix_from; }

static sadmm_status sort_candidates(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    uint64_t *const keys[2] = {v->found, in<uint64_t>(c, CANDIDATES_2)};
    size_t bytes = c->buffers[TEMP].capacity;
    int at = 0;
    v->candidates = keys[1];
    if (ranked(c)) return launch(c, c->kernels.rank, (int64_t)v->candidate_room * RANK_SHARES, error);
    c->kernel = "candidate sort";
    CUDA_CALL(c, COLLISION(sort)(in<void>(c, TEMP), &bytes, keys, nullptr, v->candidate_room, 2 * v->slot_bits, &at,
                                 c->stream), c->kernel);
    v->candidates = keys[at];
    return SADMM_OK;
}

static sadmm_status find_candidates(struct sadmm_cuda_collision *c, bool tree, struct sadmm_error *error)
{
    const struct collision_view *v = &c->view;
    if (!ranked(c)) TRY(launch(c, c->kernels.clear, v->candidate_room, error));
    if (tree) {
        TRY(launch(c, c->kernels.walk, v->leaf_count, error));
    } else {
        const int64_t rows = (v->leaf_count + TILE_ROWS - 1) / TILE_ROWS;
        TRY(launch(c, c->kernels.tiles, rows * TILE_ROWS * tile_columns(v->leaf_count), error));
    }
    return sort_candidates(c, error);
}

static sadmm_status make_contacts(struct sadmm_cuda_collision *c, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const int64_t lanes = (int64_t)v->candidate_room * POINT_LANES;
    size_t bytes = c->buffers[TEMP].capacity;
    TRY(launch(c, c->kernels.narrow, (int64_t)v->candidate_room + SIZES_BEYOND, error));
    if (ranked(c)) return launch(c, c->kernels.emit_few, lanes, error);
    c->kernel = "scan of the contacts";
    CUDA_CALL(c, COLLISION(sum)(in<void>(c, TEMP), &bytes, v->sizes, v->places, v->candidate_room + 1, c->stream),
              c->kernel);
    return launch(c, c->kernels.emit, lanes, error);
}

/* Places, and with them the tree where it pays. */
static sadmm_status place_shapes(struct sadmm_cuda_collision *c, bool tree, struct sadmm_error *error)
{
    const struct collision_view *v = &c->view;
    c->view.leaf_keys = in<uint64_t>(c, LEAF_KEYS);
    c->view.leaf_slots = in<uint32_t>(c, LEAF_SLOTS);
    if (tree) TRY(launch(c, c->kernels.grid, 1, error));
    TRY(launch(c, c->kernels.place, std::max(v->leaf_count + v->plane_count, 1), error));
    return tree ? build_tree(c, error) : SADMM_OK;
}

/* More than needed, so that a growing number of contacts does not repeat every step. */
static int64_t generous(int64_t needed, int64_t most) { return std::min(needed + needed / 4, most); }

/* Everything after the input, repeated until everything fits; `counts` of the new set. */
static sadmm_status run_stages(struct sadmm_cuda_collision *c, size_t slots, struct sadmm_cuda_contact_counts *counts,
                               struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const bool tree = v->leaf_count >= c->tree_from;
    struct sadmm_cuda_contact_counts *const staged = in<struct sadmm_cuda_contact_counts>(c, PINNED_COUNTS);
    const int64_t first = std::max((int64_t)1024, (int64_t)8 * v->leaf_count);
    if (c->candidate_room == 0) c->candidate_room = std::min(first, MOST_CANDIDATES);
    if (c->point_room == 0) c->point_room = c->candidate_room;

    TRY(make_shape_room(c, slots, tree, error));
    TRY(make_temp_room(c, v->leaf_count, (int)c->candidate_room, error));
    TRY(make_set_room(c, c->current, 0, 0, error));
    TRY(place_shapes(c, tree, error));
    for (;;) {
        TRY(make_candidate_room(c, error));
        TRY(make_set_room(c, 1 - c->current, (size_t)c->candidate_room, (size_t)c->point_room, error));
        use_sets(c, 1 - c->current);
        TRY(make_temp_room(c, v->leaf_count, (int)c->candidate_room, error));
        TRY(find_candidates(c, tree, error));
        TRY(make_contacts(c, error));
        TRY(copy(c, staged, v->after.counts, sizeof *staged, false, error));
        TRY(wait(c, error));
        c->pending = true;
        *counts = *staged;
        if (counts->candidates > MOST_CANDIDATES)
            return sadmm_fail(error, SADMM_ERROR_LIMIT, "%lld pairs of shapes may touch: at most %d can be indexed",
                              (long long)counts->candidates, (int)MOST_CANDIDATES);
        if (counts->candidates > c->candidate_room) c->candidate_room = generous(counts->candidates, MOST_CANDIDATES);
        else if (counts->points > c->point_room) c->point_room = generous(counts->points, INT32_MAX);
        else return SADMM_OK;
        ++c->stats.repeats;
        CUDA_CALL(c, cudaMemsetAsync(v->candidate_count, 0, sizeof *v->candidate_count, c->stream),
                  "cudaMemsetAsync(counter)");
    }
}

/* ---- entries --------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status COLLISION(create)(int device, struct sadmm_cuda_collision **out, struct sadmm_error *error)
{
    int count = 0;
    *out = nullptr;
    cudaError_t code = cudaGetDeviceCount(&count);
    if (code != cudaSuccess || count == 0) {
        (void)cudaGetLastError();
        return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE, "no CUDA device: %s",
                          code != cudaSuccess ? cudaGetErrorString(code) : "the driver lists none");
    }
    if (device < 0 || device >= count)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "device = %d: must be in [0, %d]", device, count - 1);
    struct sadmm_cuda_collision *c = (struct sadmm_cuda_collision *)sadmm_alloc(1, sizeof *c);
    if (!c) return sadmm_fail_memory(error, "collision detection on the device");
    c->device = device;
    c->tree_from = TREE_FROM;
    c->radix_from = RADIX_FROM;
    for (size_t &bytes : c->input_bytes) bytes = SIZE_MAX;
    COLLISION(broad_phase_kernels)(&c->kernels);
    COLLISION(sort_kernels)(&c->kernels);
    COLLISION(narrow_phase_kernels)(&c->kernels);
    COLLISION(matching_kernels)(&c->kernels);
    *out = c;
    return SADMM_OK;
}

extern "C" void COLLISION(destroy)(struct sadmm_cuda_collision *c)
{
    if (!c) return;
    {
        current_device scope(c->device);
        if (c->pending) (void)cudaStreamSynchronize(c->stream);
        for (int name = 0; name < BUFFERS; ++name) release(c, name);
        (void)cudaGetLastError();
    }
    sadmm_free(c->present);
    sadmm_free(c->planes);
    sadmm_free(c->radii);
    sadmm_free(c);
}

extern "C" sadmm_status COLLISION(upload)(struct sadmm_cuda_collision *c, void *stream,
                                          const struct sadmm_contact_set *set, struct sadmm_error *error)
{
    const int which = 1 - c->current;
    c->can_undo = false;
    if (set->pair_count > (size_t)MOST_CANDIDATES || set->point_count > (size_t)INT32_MAX)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%zu pairs with %zu points: at most %d pairs can be indexed",
                          set->pair_count, set->point_count, (int)MOST_CANDIDATES);
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(make_set_room(c, which, set->pair_count, set->point_count, error));
    TRY(room(c, PINNED_PAIRS, set->pair_count, sizeof *set->pairs, error));
    TRY(room(c, PINNED_POINTS, set->point_count, sizeof *set->points, error));
    TRY(room(c, PINNED_PAIR_KEYS, set->pair_count, sizeof(uint64_t), error));
    TRY(room(c, PINNED_COUNTS, 1, sizeof(struct sadmm_cuda_contact_counts), error));

    const struct collision_set to = set_of(c, which);
    struct sadmm_cuda_contact_counts *counts = in<struct sadmm_cuda_contact_counts>(c, PINNED_COUNTS);
    uint64_t *keys = in<uint64_t>(c, PINNED_PAIR_KEYS);
    counts->candidates = (int64_t)set->pair_count;
    counts->pairs = (int32_t)set->pair_count;
    counts->points = (int32_t)set->point_count;
    counts->dt = set->dt;
    for (size_t i = 0; i < set->pair_count; ++i)
        keys[i] = ordered_key((uint32_t)set->pairs[i].shape_a, (uint32_t)set->pairs[i].shape_b);
    if (set->pair_count > 0) memcpy(in<void>(c, PINNED_PAIRS), set->pairs, set->pair_count * sizeof *set->pairs);
    if (set->point_count > 0) memcpy(in<void>(c, PINNED_POINTS), set->points, set->point_count * sizeof *set->points);
    TRY(copy(c, to.pairs, in<void>(c, PINNED_PAIRS), set->pair_count * sizeof *set->pairs, true, error));
    TRY(copy(c, to.points, in<void>(c, PINNED_POINTS), set->point_count * sizeof *set->points, true, error));
    TRY(copy(c, to.keys, keys, set->pair_count * sizeof *keys, true, error));
    TRY(copy(c, to.counts, counts, sizeof *counts, true, error));
    c->current = which;
    c->counts[which].pairs = counts->pairs;
    c->counts[which].points = counts->points;
    c->counts[which].dt = counts->dt;
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(find)(struct sadmm_cuda_collision *c, void *stream,
                                        const struct sadmm_collision_input *input, struct sadmm_cuda_contacts *out,
                                        struct sadmm_error *error)
{
    struct sadmm_cuda_contact_counts counts;
    c->can_undo = false;
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(room(c, PINNED_COUNTS, 1, sizeof counts, error));
    TRY(take_input(c, input, nullptr, error));
    TRY(run_stages(c, input->shape_count, &counts, error));
    c->pending = false; /* run_stages has waited */
    c->current = 1 - c->current;
    c->counts[c->current].pairs = counts.pairs;
    c->counts[c->current].points = counts.points;
    c->counts[c->current].dt = counts.dt;
    c->can_undo = true;
    ++c->stats.finds;
    if (out) {
        const struct collision_set set = set_of(c, c->current);
        out->pairs = set.pairs;
        out->points = set.points;
        out->device_counts = set.counts;
        out->counts = counts;
    }
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(download)(struct sadmm_cuda_collision *c, void *stream,
                                            struct sadmm_contact_set *contacts, struct sadmm_error *error)
{
    const struct contact_counts counts = c->counts[c->current];
    const size_t pairs = (size_t)counts.pairs, points = (size_t)counts.points;
    const struct collision_set from = set_of(c, c->current);
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(room(c, PINNED_PAIRS, pairs, sizeof *contacts->pairs, error));
    TRY(room(c, PINNED_POINTS, points, sizeof *contacts->points, error));
    TRY(copy(c, in<void>(c, PINNED_PAIRS), from.pairs, pairs * sizeof *contacts->pairs, false, error));
    TRY(copy(c, in<void>(c, PINNED_POINTS), from.points, points * sizeof *contacts->points, false, error));
    TRY(wait(c, error));
    if (!sadmm_grow((void **)&contacts->pairs, &contacts->pair_capacity, contacts->pair_count, pairs,
                    sizeof *contacts->pairs) ||
        !sadmm_grow((void **)&contacts->points, &contacts->point_capacity, contacts->point_count, points,
                    sizeof *contacts->points))
        return sadmm_fail_memory(error, "contacts");
    if (pairs > 0) memcpy(contacts->pairs, in<void>(c, PINNED_PAIRS), pairs * sizeof *contacts->pairs);
    if (points > 0) memcpy(contacts->points, in<void>(c, PINNED_POINTS), points * sizeof *contacts->points);
    contacts->pair_count = pairs;
    contacts->point_count = points;
    contacts->dt = counts.dt;
    return SADMM_OK;
}

/* ---- enqueued finds -------------------------------------------------------------------------------------------- */

extern "C" sadmm_status COLLISION(attach)(struct sadmm_cuda_collision *c, void *stream,
                                          const struct sadmm_collision_input *input,
                                          const struct sadmm_collision_body *bodies, const int32_t *halt,
                                          struct sadmm_error *error)
{
    c->can_undo = false;
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(take_input(c, input, bodies, error));
    c->view.halt = halt;
    return make_shape_room(c, input->shape_count, c->view.leaf_count >= c->tree_from, error);
}

/* Grow a buffer and keep what it holds. */
static sadmm_status keep_room(struct sadmm_cuda_collision *c, int name, size_t count, size_t size,
                              struct sadmm_error *error)
{
    struct collision_buffer old = c->buffers[name];
    if (!old.data || count * size <= old.capacity) return room(c, name, count, size, error);
    c->buffers[name].data = nullptr; /* the capacity stays: growth is by half at least */
    sadmm_status status = room(c, name, count, size, error);
    if (status == SADMM_OK) {
        cudaError_t code = cudaMemcpyAsync(in<void>(c, name), old.data, old.capacity, cudaMemcpyDeviceToDevice, c->stream);
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

extern "C" sadmm_status COLLISION(reserve)(struct sadmm_cuda_collision *c, int64_t *candidates, int64_t *points,
                                           struct sadmm_error *error)
{
    const int64_t likely = std::max((int64_t)1024, (int64_t)8 * c->view.leaf_count);
    ENTER(c);
    TRY(wait(c, error));
    if (*candidates > MOST_CANDIDATES)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%lld pairs of shapes may touch: at most %d can be indexed",
                          (long long)*candidates, (int)MOST_CANDIDATES);
    const int64_t first_points = c->point_room > 0 ? c->point_room : *points > 0 ? 1 : likely;
    c->candidate_room = std::max(c->candidate_room, *candidates > 0 ? *candidates : std::min(likely, MOST_CANDIDATES));
    c->point_room = std::max(first_points, *points);
    TRY(make_candidate_room(c, error));
    TRY(make_temp_room(c, c->view.leaf_count, (int)c->candidate_room, error));
    for (int which = 0; which < 2; ++which) {
        const int shift = which * SET_BUFFERS;
        TRY(keep_room(c, PAIRS + shift, (size_t)c->candidate_room, sizeof(struct sadmm_contact_pair), error));
        TRY(keep_room(c, PAIR_KEYS + shift, (size_t)c->candidate_room, sizeof(uint64_t), error));
        TRY(keep_room(c, POINTS + shift, (size_t)c->point_room, sizeof(struct sadmm_contact_point), error));
        TRY(make_set_room(c, which, 0, 0, error));
    }
    *candidates = c->candidate_room;
    *points = c->point_room;
    return SADMM_OK;
}

extern "C" sadmm_status COLLISION(enqueue)(struct sadmm_cuda_collision *c, void *stream, int into,
                                           struct sadmm_error *error)
{
    const bool tree = c->view.leaf_count >= c->tree_from;
    c->stream = (cudaStream_t)stream;
    c->pending = true;
    use_sets(c, into);
    TRY(place_shapes(c, tree, error));
    TRY(find_candidates(c, tree, error));
    return make_contacts(c, error);
}

extern "C" struct sadmm_cuda_contacts COLLISION(set)(const struct sadmm_cuda_collision *c, int which)
{
    const struct collision_set set = set_of(c, which);
    struct sadmm_cuda_contacts out = {set.pairs, set.points, set.counts, {}};
    return out;
}

extern "C" void COLLISION(set_step)(struct sadmm_cuda_collision *c, double dt, double gravity)
{
    c->view.step.dt = dt;
    c->view.step.gravity = gravity;
}

extern "C" void COLLISION(settle)(struct sadmm_cuda_collision *c, int current,
                                  struct sadmm_cuda_contact_counts counts)
{
    c->current = current;
    c->counts[current].pairs = counts.pairs;
    c->counts[current].points = counts.points;
    c->counts[current].dt = counts.dt;
    c->can_undo = false;
    c->pending = false;
}

extern "C" int COLLISION(current)(const struct sadmm_cuda_collision *c) { return c->current; }

extern "C" void COLLISION(undo)(struct sadmm_cuda_collision *c)
{
    if (!c->can_undo) return;
    c->can_undo = false;
    c->current = 1 - c->current;
}

extern "C" struct sadmm_cuda_collision_stats COLLISION(stats)(const struct sadmm_cuda_collision *c)
{
    struct sadmm_cuda_collision_stats stats = c->stats;
    stats.candidate_room = c->candidate_room;
    stats.point_room = c->point_room;
#ifdef SADMM_CUDA_EMULATED
    stats.visits = node_visits;
#endif
    return stats;
}

extern "C" void COLLISION(tune)(struct sadmm_cuda_collision *c, const struct sadmm_cuda_collision_tuning *tuning)
{
    c->tree_from = tuning->tree_from > 0 ? tuning->tree_from : TREE_FROM;
    c->radix_from = tuning->radix_from > 0 ? tuning->radix_from : RADIX_FROM;
    if (tuning->first_room > 0)
        c->candidate_room = c->point_room = std::min(tuning->first_room, MOST_CANDIDATES);
}
