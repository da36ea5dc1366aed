/* The pipeline (pipeline.h) on the host's side: what it keeps, buffers that only grow, launches. */
#ifndef SADMM_CUDA_COLLIDE_MEMORY_H
#define SADMM_CUDA_COLLIDE_MEMORY_H

#include <stdio.h>

#include "collision/find/seams.h"
#include "core/base/memory.h"
#include "hits_view.h"
#include "view.h"

/* Memory of the device or pinned memory of the host. */
struct collision_buffer {
    void *data;
    size_t capacity; /* bytes */
};

enum buffer_name {
    /* device */
    PROXIES, FILTERS, PLACED, LEAF_KEYS, LEAF_KEYS_2, LEAF_NUMBERS, LEAF_NUMBERS_2, NODES, GROUPS, PARENTS, ARRIVALS,
    COUNTER, GRID, CANDIDATES, CANDIDATES_2, LISTED, IS_LISTED, WALKS, MESH_PAIRS, TOUCHES, MANIFOLDS, MATCHES, SIZES,
    EMIT_GENERAL, PLACES, TEMP, BOXES, REACHES, PAIR_OF,
    PAIRS, POINTS, MIGRATIONS, PAIR_KEYS, COUNTS, PAIRS_2, POINTS_2, MIGRATIONS_2, PAIR_KEYS_2, COUNTS_2,
    PAIRS_3, POINTS_3, MIGRATIONS_3, PAIR_KEYS_3, COUNTS_3,
    TOUCHING,
    COPIES_PAIRS, COPIES_KEYS, COPIES_POINTS, COPIES_MIGRATIONS, COPIES_RANGES,
    HIT_STATE, HIT_MARKS, HIT_HELD, HIT_KINDS, HIT_SWEPT_BODIES, HIT_SINCE, HIT_IMPULSES, HIT_BOXES, HIT_NEAR,
    HIT_LISTED, HIT_FORESEEN, HIT_TAKEN, HIT_RECORDS_OF_STEPS, HIT_GROUPS, HIT_PROGRESS, HIT_GROUP_BODIES,
    HIT_GROUP_LEAVES, HIT_SHARED_LEAVES, HIT_GROUP_OF,
    SHAPES, GEOMETRIES, HULLS, BODIES, PRESENT, PLANES, GROUPED, DISABLED_PAIRS, FRICTION_PAIRS, FRICTION_VALUES,
    SEAMS, SEAM_NEIGHBOURS,
    /* pinned: first what was uploaded to the last buffers above, in their order */
    PINNED_SHAPES, PINNED_GEOMETRIES, PINNED_HULLS, PINNED_BODIES, PINNED_PRESENT, PINNED_PLANES, PINNED_GROUPED,
    PINNED_DISABLED_PAIRS, PINNED_FRICTION_PAIRS, PINNED_FRICTION_VALUES, PINNED_SEAMS, PINNED_SEAM_NEIGHBOURS,
    PINNED_PAIRS, PINNED_POINTS, PINNED_MIGRATIONS, PINNED_PAIR_KEYS, PINNED_COUNTS, PINNED_TOUCHING,
    PINNED_COPIES,
    BUFFERS
};
enum { SET_BUFFERS = COUNTS_2 - COUNTS, INPUTS = PINNED_SHAPES - SHAPES };

static const char *const buffer_names[BUFFERS] = {
    "placed shapes", "filters", "boxes", "tree keys", "sorted tree keys", "leaves", "sorted leaves", "tree", "groups",
    "parents", "arrivals", "counter", "grid", "candidates", "sorted candidates", "listed candidates",
    "which candidates are listed", "walks of listed candidates", "pairs with meshes", "first touches", "manifolds",
    "matches", "sizes",
    "general candidates", "places", "sort", "boxes of sub-steps", "reaches", "pairs of candidates",
    "contact pairs", "contact points", "migrations of points", "contact keys", "contact counts",
    "contact pairs", "contact points", "migrations of points", "contact keys", "contact counts",
    "contact pairs", "contact points", "migrations of points", "contact keys", "contact counts",
    "touching pairs",
    "pairs of environments", "keys of environments", "points of environments", "migrations of environments",
    "contacts of environments",
    "hits", "marks of bodies", "bodies held by joints", "kinds of bodies", "swept bodies", "moments of hits",
    "impulses of hits", "boxes after hits", "pairs after hits", "fast pairs", "foreseen hits", "hits taken",
    "list of hits",
    "groups", "progress of groups", "bodies of groups", "shapes of groups", "shapes of all groups", "groups of bodies",
    "shapes", "geometries", "hulls", "bodies", "list of shapes", "planes", "shapes by environment", "disabled pairs",
    "friction pairs",
    "friction values",
    "neighbours by shape", "neighbours",
    "staged shapes", "staged geometries", "staged hulls", "staged bodies", "staged list of shapes", "staged planes",
    "staged shapes by environment",
    "staged disabled pairs",
    "staged friction pairs", "staged friction values", "staged neighbours by shape", "staged neighbours",
    "staged contact pairs", "staged contact points", "staged migrations",
    "staged contact keys", "staged contact counts", "staged touching pairs",
    "staged contacts of environments",
};

/* As on the host: contact points are indexed by 32 bits. */
static const int64_t MOST_CANDIDATES = INT32_MAX / SADMM_MAX_POINTS;

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
    size_t shape_slots;         /* of the world that is attached */
    uint32_t hull_revision;
    bool smooth;                /* a shape is a smooth body (collision/shapes/geometry.h) */
    bool takes_hits;            /* the world is one of those of hits_view.h; */
    bool hits_ready;            /* and the device has its lists */
    struct hit_lists *hit_lists;
    struct hits_kernels hits_kernels;
    struct hits_view hits;

    int current;                /* of the two sets */
    struct contact_counts counts[2];
    bool can_undo;

    cudaStream_t stream;        /* where work is pending */
    cudaStream_t side;          /* what goes beside it: */
    cudaEvent_t made, hidden;   /* seams, from when there are manifolds until they are done */
    bool pending;
    const char *kernel;         /* launched last: what an asynchronous error is about, or what ran before it */

    int32_t tree_from, by_warp_from, group_leaves;
    int64_t radix_from;
    int64_t candidate_capacity, point_capacity;
    int temp_leaves, temp_candidates; /* what TEMP is large enough for */
    struct sadmm_cuda_collision_stats stats;

    struct sadmm_seams seams;
    uint64_t stills;            /* hash of the shapes that do not move, and where they are, that `seams` is of */

    /* host arrays, made when shapes change */
    uint32_t *present;
    uint64_t *planes;
    uint64_t *grouped;
    double *radii;
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

static inline sadmm_status fail(const struct sadmm_cuda_collision *c, cudaError_t code, const char *what,
                         struct sadmm_error *error)
{
    (void)cudaGetLastError(); /* an error that does not last must not be found by the next call */
    return sadmm_fail(error, code == cudaErrorMemoryAllocation ? SADMM_ERROR_OUT_OF_MEMORY : SADMM_ERROR_DEVICE,
                      "CUDA device %d: %s: %s", c->device, what, cudaGetErrorString(code));
}

static inline sadmm_status wait(struct sadmm_cuda_collision *c, struct sadmm_error *error)
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
static inline sadmm_status begin_work(struct sadmm_cuda_collision *c, void *stream, struct sadmm_error *error)
{
    if (c->pending) TRY(wait(c, error));
    c->stream = (cudaStream_t)stream;
    c->view.pdl = false;
    c->pending = true;
    return SADMM_OK;
}

static inline void release(struct sadmm_cuda_collision *c, int name)
{
    struct collision_buffer *b = &c->buffers[name];
    if (b->data) (void)(name >= PINNED_SHAPES ? cudaFreeHost(b->data) : cudaFree(b->data));
    b->data = nullptr;
    b->capacity = 0;
}

/* Sets are copied whole when they grow, planes have no boxes, and what belongs to candidates is read before it is known
 * how many there are, the pairs of the last find's among it. */
static inline bool starts_as_zeros(int name)
{
    return name == CANDIDATES || name == CANDIDATES_2 || name == MATCHES || name == SIZES || name == BOXES ||
           (name >= PAIR_OF && name < SHAPES);
}

/* At least count x size bytes; what the buffer held is lost when it grows. */
static inline sadmm_status reserve(struct sadmm_cuda_collision *c, int name, size_t count, size_t size,
                                   struct sadmm_error *error)
{
    struct collision_buffer *b = &c->buffers[name];
    const size_t bytes = count * size, wanted = sadmm_grown_capacity(b->capacity, bytes, 256);
    if (b->data && bytes <= b->capacity) return SADMM_OK;
    char what[96];
    snprintf(what, sizeof what, "allocation of %zu bytes for collision's %s", wanted, buffer_names[name]);
    if (sadmm_test_allocation_fails()) return fail(c, cudaErrorMemoryAllocation, what, error);
    release(c, name);
    CUDA_CALL(c, name >= PINNED_SHAPES ? cudaMallocHost(&b->data, wanted) : cudaMalloc(&b->data, wanted), what);
    b->capacity = wanted;
    ++c->stats.allocations;
    if (starts_as_zeros(name))
        CUDA_CALL(c, cudaMemsetAsync(b->data, 0, wanted, c->stream), what);
    return SADMM_OK;
}

template <class T> static T *in(const struct sadmm_cuda_collision *c, int name) { return (T *)c->buffers[name].data; }

#ifdef SADMM_CUDA_EMULATED
template <class View> struct emulated_call {
    void (*kernel)(const View);
    View view;
};
template <class View> static inline void run_emulated(const emulated_call<View> call, const int)
{
    call.kernel(call.view);
}
#endif

/* what: collision_launch, or another of its kind. */
template <class Launch, class View>
static inline sadmm_status launch_view(struct sadmm_cuda_collision *c, const Launch &what, const View &view,
                                       int64_t threads, struct sadmm_error *error)
{
    const unsigned blocks = (unsigned)((threads + what.threads - 1) / what.threads);
    if (threads <= 0) return SADMM_OK;
    c->kernel = what.name;
#ifdef SADMM_CUDA_EMULATED
    const emulated_call<View> call = {what.kernel, view};
    cudaError_t code = cuda_emulation_launch(run_emulated<View>, blocks, (unsigned)what.threads, what.shared, call, 0);
#else
    const dim3 grid(blocks), threads_a_block((unsigned)what.threads);
    void *parameters[] = {const_cast<View *>(&view)};
    cudaError_t code =
        launch_on(c->stream, c->view.pdl, (const void *)what.kernel, grid, threads_a_block, 0, parameters);
#endif
    CUDA_CALL(c, code, what.name);
    return SADMM_OK;
}

static inline sadmm_status launch(struct sadmm_cuda_collision *c, const struct collision_launch &what, int64_t threads,
                                  struct sadmm_error *error)
{
    return launch_view(c, what, c->view, threads, error);
}

static inline sadmm_status copy(struct sadmm_cuda_collision *c, void *to, const void *from, size_t bytes,
                                bool to_device, struct sadmm_error *error)
{
    const auto kind = to_device ? cudaMemcpyHostToDevice : cudaMemcpyDeviceToHost;
    if (bytes > 0)
        CUDA_CALL(c, cudaMemcpyAsync(to, from, bytes, kind, c->stream),
                  to_device ? "cudaMemcpyAsync to the device" : "cudaMemcpyAsync from the device");
    return SADMM_OK;
}

/* One of the sets. */
static inline struct collision_set set_of(const struct sadmm_cuda_collision *c, int which)
{
    const int shift = which * SET_BUFFERS;
    struct collision_set set;
    set.pairs = in<struct sadmm_contact_pair>(c, PAIRS + shift);
    set.points = in<struct sadmm_contact_point>(c, POINTS + shift);
    set.migrations = in<struct sadmm_contact_migration>(c, MIGRATIONS + shift);
    set.keys = in<uint64_t>(c, PAIR_KEYS + shift);
    set.counts = in<struct sadmm_cuda_contact_counts>(c, COUNTS + shift);
    return set;
}

/* ---- parts of a find ------------------------------------------------------------------------------------------- */

/* The step's input, uploaded where it changed. `bodies`: on the device already; NULL: the input's. */
sadmm_status COLLISION(take_input)(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                   const struct sadmm_collision_body *bodies, struct sadmm_error *error);
/* Everything after the input, repeated until everything fits; `counts` of the new set. */
sadmm_status COLLISION(run_stages)(struct sadmm_cuda_collision *c, size_t slots,
                                   struct sadmm_cuda_contact_counts *counts, struct sadmm_error *error);
sadmm_status COLLISION(reserve_set)(struct sadmm_cuda_collision *c, int which, size_t pairs, size_t points,
                                      struct sadmm_error *error);
/* Hits (hits_view.h): from candidates to where what was hit is, before they are searched for again; after the narrow
 * phase; and after `emit`. */
void COLLISION(free_hits)(struct sadmm_cuda_collision *c);
sadmm_status COLLISION(take_hits)(struct sadmm_cuda_collision *c, const struct sadmm_cuda_hits *step,
                                  struct sadmm_error *error);
sadmm_status COLLISION(narrow_hits)(struct sadmm_cuda_collision *c, const struct sadmm_cuda_hits *step,
                                    struct sadmm_error *error);
sadmm_status COLLISION(reopen_hits)(struct sadmm_cuda_collision *c, const struct sadmm_cuda_hits *step,
                                    struct sadmm_error *error);

#endif
