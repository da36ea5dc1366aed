/* A context of the CUDA backend: device, streams, buffers, what the entries are made of. What kernels see is in
 * view.h. */
#ifndef SADMM_CUDA_DEVICE_CONTEXT_H
#define SADMM_CUDA_DEVICE_CONTEXT_H

#include "core/model/settings.h"
#include "view.h"

/* Scalars that are 0 before they are used. */
enum cuda_scalar { SCALAR_PRIMAL = 1, SCALAR_DUAL = 2, SCALAR_BARRIER = 4 };

/* Device or pinned memory that only grows. */
struct cuda_buffer {
    void *data;
    size_t capacity; /* bytes */
    bool pinned;
};

enum cuda_buffer_name {
    /* device */
    BUFFER_STATE, BUFFER_B, BUFFER_LINES, BUFFER_HALFWAY, BUFFER_C, BUFFER_BETA,
    BUFFER_NORMAL, BUFFER_DIFFERENCE, BUFFER_PAIR_BODIES, BUFFER_ARM, BUFFER_LAMBDA,
    BUFFER_ROW_CONSTRAINTS, BUFFER_ROWS, BUFFER_ROW_RESPONSES, BUFFER_RECORDS, BUFFER_CHANGE, BUFFER_EXCHANGE,
    BUFFER_LIVE, BUFFER_LAYOUT, BUFFER_SORT,
    BUFFER_NUMBERS, BUFFER_SCALARS, BUFFER_SETTINGS, BUFFER_GRAVITY, BUFFER_WEIGHTS, BUFFER_SIDES, BUFFER_MOTIONS,
    BUFFER_TOUCH,
    BUFFER_RAW_BODIES, BUFFER_RAW_PAIRS, BUFFER_RAW_POINTS, BUFFER_RAW_MIGRATIONS, BUFFER_RAW_ROWS, BUFFER_OUT,
    BUFFER_WORLD_BODIES, BUFFER_WORLD_EXTRAPOLATION, BUFFER_WORLD_WRENCH, BUFFER_WORLD_VELOCITY, BUFFER_WORLD_IMPULSE,
    BUFFER_WORLD_SLOTS, BUFFER_WORLD_PLACES, BUFFER_WORLD_CONTROL, BUFFER_WORLD_HIT, BUFFER_WORLD_KINEMATIC,
    BUFFER_WORLD_SUPPORT,
    BUFFER_JOINTS, BUFFER_GEARS, BUFFER_TABLES, BUFFER_JOINT_MEMORY, BUFFER_COUPLING_MEMORY, BUFFER_JOINT_ROWS,
    BUFFER_JOINT_TOUCH,
    BUFFER_JOINT_MOMENTUM, BUFFER_JOINTS_AT, BUFFER_STIFFENING, BUFFER_CLOSED,
    BUFFER_ARTICULATIONS, BUFFER_ARTICULATION_SIDES, BUFFER_PUSH, BUFFER_PUSHED, BUFFER_PUSH_SORT,
    BUFFER_NCP, BUFFER_NCP_IMPULSE, BUFFER_NCP_MEMORY, BUFFER_COPIES, BUFFER_MEASURES,
    /* pinned */
    PINNED_LIVE, PINNED_SETTINGS, PINNED_BODIES, PINNED_PAIRS, PINNED_POINTS, PINNED_MIGRATIONS, PINNED_ROWS,
    PINNED_OUT,
    PINNED_REPORTS, PINNED_UPDATES,
    BUFFER_COUNT
};

/* What an iteration takes, in nanoseconds: floors of the tiers, of a cluster for each of its blocks, and of each side
 * that a multiprocessor holds; and a kernel of a graph that waits for another. */
struct cuda_timings {
    double block, cluster, member, grid, side, kernel;
};

struct sadmm_context {
    int device;
    cudaStream_t stream;
    cudaStream_t side;        /* of a step's graph: what does not wait for contacts (step/record.cu) */
    cudaEvent_t fork, join;
    cudaStream_t joint_side;  /* likewise: joints */
    cudaEvent_t joint_join;
    int multiprocessors, shared_limit; /* shared_limit: bytes a block may have */
    bool cooperative, clusters, pdl;   /* what the device can launch, with the code that was loaded for it */
    cuda_timings timings;

    const struct sadmm_system *system;
    struct sadmm_plan plan;
    struct sadmm_settings settings;
    double numbers[SADMM_SETTING_NUMBERS]; /* that are, or will be, in BUFFER_SETTINGS; dt = 0: unknown */
    cuda_view view;
    cuda_buffer buffers[BUFFER_COUNT];
    bool starting;      /* no iteration yet: the next Step 1 uses J^T lambda^0, which `records` may not hold yet */
    bool placed;        /* pairs and row blocks know the places of their sides */
    bool backward;      /* the next sweeps go over bodies and constraints from the last one to the first */
    bool measured;      /* records and change are apart: the next Step 1 uses records + ratio change */
    bool rescaled;      /* ... by view.iteration.ratio; else it is 1 */
    bool fast;          /* the method */
    bool bounces;       /* some contact may have restitution: kernels that know of it take more registers */
    bool step1_done;    /* fast: Step 1 ran in this solve */
    int weight_updates; /* fast: in this solve */
    int exact_since; /* fast: iterations since the momentum residuals were taken */
    int checks;     /* fast: at the stop rule, in this step */
    bool prologue; /* fast: the iterating kernels of the step enqueued do prologue and epilogue (iterate/prologue.h) */
    unsigned cleared; /* enum cuda_scalar: those that a kernel of this step has set to 0 for their first use */
    bool recording; /* a graph of the whole step: nothing is allocated, no graph launched in it; */
    bool skips;     /* what is enqueued is left out of it */

    enum sadmm_cuda_tier wanted;     /* by a test */
    int wanted_cluster;              /* blocks a cluster, by a test; 0: any */
    struct cuda_graph_statistics statistics;         /* of the last begin */
    struct cuda_partition partition; /* what its layout was made for */
    struct layout_view layout;
    bool one_block;                  /* the layout takes one kernel of one block */
    bool numbered;                   /* BUFFER_NUMBERS is filled */

    struct cuda_step *step; /* the world, where whole steps are made here */
    int64_t first_capacity;     /* for tests: first capacities for candidates and points; 0: by the number of shapes */
    unsigned refused;       /* bit of a tier: a part was too large */

    cudaGraphExec_t graph; /* GRAPH_ITERATIONS plain iterations */
    bool graph_valid;      /* for this step's view */
    const char *kernel;    /* launched last: what an asynchronous error is about, or what ran before it */
};

/* ---- device/context.cu ---- */

sadmm_status CUDA(fail)(struct sadmm_context *, cudaError_t code, const char *what, struct sadmm_error *error);
void CUDA(release_buffers)(struct sadmm_context *);
/* At least `bytes` in a buffer; what it held is lost when it grows. */
sadmm_status CUDA(reserve)(struct sadmm_context *, enum cuda_buffer_name name, size_t bytes, struct sadmm_error *error);
/* Are kernels launched with PDL (pdl.h)? In recorded steps, but for cooperative launches: in small worlds all of them
 * but first sweeps of tier STREAM; in others, where they are long, those from the islands on (launch_pdl,
 * launch_partition). With PDL for all of them, when sweeps fetched nothing before they waited, pile:100000 and
 * pile:20000 took 1 to 2 % longer, with none 2 and 0.5. */
static inline bool uses_pdl(const struct sadmm_context *c) { return c->pdl && c->recording; }
static inline bool all_use_pdl(const struct sadmm_context *c)
{
    return uses_pdl(c) && all_pdl(c->view.model.bodies);
}
/* Launch blocks of THREADS on the stream; 0 blocks: nothing to do. */
sadmm_status CUDA(launch)(struct sadmm_context *, cuda_kernel kernel, const char *name, int64_t blocks,
                          const cuda_args *args, struct sadmm_error *error);
/* The same with blocks of so many threads. */
sadmm_status CUDA(launch_of)(struct sadmm_context *, cuda_kernel kernel, const char *name, int64_t blocks, int threads,
                             const cuda_args *args, struct sadmm_error *error);
/* The same with `shared` bytes of a block's own memory. */
sadmm_status CUDA(launch_shared)(struct sadmm_context *, cuda_kernel kernel, const char *name, int64_t blocks,
                                 int threads, size_t shared, const cuda_args *args, struct sadmm_error *error);
/* The same, with PDL in large worlds, too; and never with PDL, for what reads before it waits, whatever came before. */
sadmm_status CUDA(launch_pdl)(struct sadmm_context *, cuda_kernel kernel, const char *name, int64_t blocks,
                              int threads, const cuda_args *args, struct sadmm_error *error);
sadmm_status CUDA(launch_without_pdl)(struct sadmm_context *, cuda_kernel kernel, const char *name, int64_t blocks,
                                      int threads, const cuda_args *args, struct sadmm_error *error);
/* How many of the partition's clusters the device runs side by side; 0: clusters that large do not exist. */
cudaError_t CUDA(active_clusters)(const struct sadmm_context *, cuda_kernel kernel,
                                  const struct cuda_partition *partition, int *clusters);
/* Launch a kernel on the partition's blocks; with PDL, too. */
sadmm_status CUDA(launch_partition)(struct sadmm_context *, cuda_kernel kernel, const char *name,
                                    const struct cuda_partition *partition, const cuda_args *args,
                                    struct sadmm_error *error);
/* Set a scalar to 0, unless this step has. */
sadmm_status CUDA(clear)(struct sadmm_context *, enum cuda_scalar scalar, struct sadmm_error *error);
/* Through pinned memory, asynchronously; the pinned buffer is free again once the stream is idle. */
sadmm_status CUDA(upload)(struct sadmm_context *, void *to, enum cuda_buffer_name staging, size_t at, const void *from,
                          size_t bytes, struct sadmm_error *error);
/* Into PINNED_OUT, which holds that many bytes, and wait. */
sadmm_status CUDA(download)(struct sadmm_context *, const void *from, size_t bytes, struct sadmm_error *error);
/* To the device and from it, through pinned memory that is free again; a null `to` is left out. */
sadmm_status CUDA(put)(struct sadmm_context *, void *to, const void *from, size_t bytes, struct sadmm_error *error);
sadmm_status CUDA(get)(struct sadmm_context *, void *to, const void *from, size_t bytes, struct sadmm_error *error);
sadmm_status CUDA(wait)(struct sadmm_context *, struct sadmm_error *error);
/* The settings that are no numbers: from the next launch, or recording, on. */
void CUDA(plan_settings)(struct sadmm_context *, const struct sadmm_settings *settings);
/* All of them, the numbers into device memory. Nothing may be enqueued. */
sadmm_status CUDA(use_settings)(struct sadmm_context *, const struct sadmm_settings *settings,
                                struct sadmm_error *error);

/* The context's device is current while this lives; then the caller's again. (Unnamed: a test program links these
 * sources twice, for a device and emulated, and each must keep its own.) */
namespace {
struct device_scope {
    int before;
    cudaError_t code;
    explicit device_scope(int device) : before(device), code(cudaGetDevice(&before))
    {
        if (code == cudaSuccess && before != device) code = cudaSetDevice(device);
    }
    ~device_scope() { (void)cudaSetDevice(before); }
    device_scope(const device_scope &) = delete;
    device_scope &operator=(const device_scope &) = delete;
};
} /* namespace */
#define CUDA_ENTER(c)                   \
    device_scope scope((c)->device);    \
    CUDA_CALL((c), scope.code, "cudaSetDevice")

/* ---- device/arrays.cu ---- */

/* This precision's data for the view's counts and the partition (allocates). */
sadmm_status CUDA(reserve_solver)(struct sadmm_context *, struct sadmm_error *error);

#define CUDA_CALL(c, call, name)                                                \
    do {                                                                        \
        cudaError_t try_code = (call);                                          \
        if (try_code != cudaSuccess) return CUDA(fail)((c), try_code, (name), error); \
    } while (0)

/* Several buffers, as by CUDA(reserve). */
struct cuda_capacity {
    enum cuda_buffer_name name;
    size_t bytes;
};
template <size_t N>
static inline sadmm_status reserve_all(struct sadmm_context *c, const cuda_capacity (&wanted)[N],
                                       struct sadmm_error *error)
{
    for (const cuda_capacity &one : wanted) TRY(CUDA(reserve)(c, one.name, one.bytes, error));
    return SADMM_OK;
}

static inline int64_t blocks_for(int64_t threads) { return (threads + THREADS - 1) / THREADS; }

#include "entries.h"

#endif
