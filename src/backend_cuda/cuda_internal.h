/* The CUDA backend: reduced form (docs/algorithm.md), one source for both precisions (SADMM_REAL, SADMM_VARIANT).
 *
 * Units of work
 *   - A contact pair shares normal, friction and bodies among its points, so one thread takes a pair. With
 *     d = x_a - x_b a point's relative velocity is u + w x r_a (u = v_b - v_a + w_b x d, w = w_b - w_a), and the pair's
 *     wrench needs only f = sum E_k and tau = sum r_k x E_k (E = 2 lambda - lambda_prev): on a (-f, -tau), on b (f, tau
 *     + d x f).
 *   - The pair writes both wrenches as one record; bodies gather records over a CSR list in a fixed order. No float
 *     atomics: a result does not depend on timing, grid size or tier, bit for bit (the sources are compiled without
 *     contraction of a * b + c for the same reason).
 *   - Eight lanes take a body: lane r < 6 owns component r of A v, of the gathered sum and of H g, H = (A + beta C)^-1.
 *
 * Order. Bodies are numbered by island, stably, where islands matter: "slots" (cuda_layout.h). Pairs and row blocks keep
 * their raw order. Static bodies join nothing and share the state row after the last body, which is 0. Within a body's
 * list records ascend, so that the sums are the same in every tier.
 *
 * Tiers of the fused entry
 *   BLOCK   islands packed into thread blocks; pairs in registers, bodies and records in shared memory; only
 *           __syncthreads
 *   GRID    one cooperative launch; pairs in registers, factors in shared memory, velocities and records in L2; grid
 *           barriers
 *   STREAM  two kernels an iteration, in a CUDA graph: any size
 * BLOCK and GRID are one kernel (cuda_resident.cu) over a partition into `parts`.
 *
 * Raw data (bodies, contact pairs and points, blocks as core has them, in double) is copied to the device as it is and
 * turned into this layout there, so that a collision stage on the device can later produce the contacts in place.
 */
#ifndef SADMM_CUDA_INTERNAL_H
#define SADMM_CUDA_INTERNAL_H

#include <stddef.h>
#include <stdint.h>

#include <cuda_runtime.h>

#include "../core/kernels.h"
#include "layout_internal.h"

typedef SADMM_REAL solver_real;

#define SADMM_JOIN2(a, b) a##b
#define SADMM_JOIN(a, b) SADMM_JOIN2(a, b)
/* A symbol of this precision, e.g. sadmm_cuda_begin_f32. */
#define CUDA(name) SADMM_JOIN(sadmm_cuda_##name, SADMM_VARIANT)

enum {
    ROW = 8,              /* a wrench or a body's state: 6 used, 32 bytes in f32 */
    RECORD = 2 * ROW,     /* wrench on a, wrench on b */
    STATE_INV_BETA = 6,   /* slot of a state row */
    MATRIX = 40,          /* a symmetric 6x6, rows of 6; the padding keeps four bodies' rows on different banks */
    PACKED = 21,          /* lower triangle, rows first */
    THREADS = 256,        /* a block, everywhere */
    WARP = 32,
    LANES = 8             /* threads a body */
};

/* Planes of the row blocks' data, each row_stride long. */
enum {
    ROW_J_A = 0,
    ROW_J_B = 36,
    ROW_ERROR = 72,
    ROW_STIFFNESS = 78,
    ROW_DAMPING = 84,
    ROW_LAMBDA = 90,
    ROW_FRICTION = 96,
    ROW_PLANES = 97
};

struct alignas(16) real4 {
    solver_real x, y, z, w;
};

struct row_about {
    int32_t kind, rows, body_a, body_b; /* slots */
    int32_t active;                     /* bit r: row r exists (a hard row of zeros is no constraint, Sec. III-C) */
};

/* What kernels see. Pointers are device memory. Bodies are counted in slots unless "raw" (cuda_layout.h). */
struct cuda_view {
    struct cuda_live *live;
    struct cuda_facts *facts;
    int32_t bodies;      /* exact, known to the host (state row `bodies` is the static world) */
    int32_t pair_room;   /* multiple of 32; = stride of point planes; row block k's record is pair_room + k */
    int32_t rows;        /* row blocks: exact, known to the host */
    int32_t points;
    int32_t row_stride;
    int32_t contact_rows;
    int32_t warm_start;

    solver_real *state; /* (bodies + 1) x ROW: v, w, 1/beta, 0; the last row is the static world, all 0 */
    solver_real *b;     /* bodies x ROW */
    solver_real *A, *H; /* bodies x MATRIX */
    double *C;          /* bodies x PACKED */
    double *beta;       /* bodies, kg */

    real4 *normal;      /* pairs: n, mu */
    real4 *difference;  /* pairs: d, 1/s */
    int2 *pair_bodies;
    int32_t *pair_count;
    real4 *arm;         /* points: r_a (r_b when a is static), e */
    real4 *lambda;      /* points, 3 rows a contact */
    solver_real *lambda_n; /* points, 1 row a contact */

    row_about *row_info;
    solver_real *row_data; /* ROW_PLANES x row_stride */

    /* pairs (pair_room of them), then row blocks. After a measured iteration `records` holds J^T lambda and `change`
     * J^T (lambda - lambda_prev), else `records` holds J^T (2 lambda - lambda_prev). */
    solver_real *records, *change;

    const int32_t *offsets, *incident; /* body -> its halves, ascending */
    const int32_t *body_of, *slot_of;  /* slot -> raw body, raw body -> slot */
    const int32_t *parts;              /* first body slot of each part, and the end */
    unsigned *barrier;                 /* arrivals at the grid barrier since launch */
    unsigned long long *residual;      /* primal, dual: bit patterns of doubles >= 0, which order like the numbers */

    struct sadmm_system raw;           /* rigid, A, b, velocity, blocks, block_lambda */
    const struct sadmm_contact_pair *raw_pairs;
    const struct sadmm_contact_point *raw_points;
    struct sadmm_settings settings;
    double *out; /* results in raw order */
};

/* This step's counts; 0 when it is halted. */
static __device__ __forceinline__ int32_t live_bodies(const cuda_view &v) { return v.live->halt ? 0 : v.bodies; }
static __device__ __forceinline__ int32_t live_pairs(const cuda_view &v) { return v.live->halt ? 0 : v.live->pairs; }
static __device__ __forceinline__ int32_t live_rows(const cuda_view &v) { return v.live->halt ? 0 : v.rows; }

/* What differs between launches of a kernel. */
struct cuda_args {
    int32_t count;      /* iterations, or a kind of block */
    int32_t measure;
    int32_t join;       /* the first Step 1 takes records + ratio change */
    solver_real ratio;
    double factor;
};

typedef void (*cuda_kernel)(const cuda_view, const cuda_args);

/* Device or pinned memory that only grows. */
struct cuda_buffer {
    void *data;
    size_t capacity; /* bytes */
    bool pinned;
};

enum cuda_buffer_name {
    /* device */
    BUFFER_STATE, BUFFER_B, BUFFER_A, BUFFER_H, BUFFER_C, BUFFER_BETA,
    BUFFER_NORMAL, BUFFER_DIFFERENCE, BUFFER_PAIR_BODIES, BUFFER_PAIR_COUNT, BUFFER_ARM, BUFFER_LAMBDA,
    BUFFER_ROW_INFO, BUFFER_ROW_DATA, BUFFER_RECORDS, BUFFER_CHANGE, BUFFER_LIVE, BUFFER_LAYOUT, BUFFER_SORT,
    BUFFER_NUMBERS, BUFFER_SCALARS,
    BUFFER_RAW_BODIES, BUFFER_RAW_PAIRS, BUFFER_RAW_POINTS, BUFFER_RAW_BLOCKS, BUFFER_OUT,
    /* pinned */
    PINNED_LIVE, PINNED_BODIES, PINNED_PAIRS, PINNED_POINTS, PINNED_BLOCKS, PINNED_OUT,
    BUFFER_COUNT
};

struct sadmm_context {
    int device;
    cudaStream_t stream;
    int multiprocessors, shared_limit; /* shared_limit: bytes a block may have */
    bool cooperative;

    const struct sadmm_system *system;
    struct sadmm_plan plan;
    struct sadmm_settings settings;
    cuda_view view;
    cuda_buffer buffers[BUFFER_COUNT];
    bool measured; /* records and change are apart: the next Step 1 uses records + ratio change */
    double ratio;

    enum sadmm_cuda_tier wanted;
    struct cuda_facts facts;         /* of the last begin */
    struct cuda_partition partition; /* what its layout was made for */
    struct layout_view layout;
    bool one_block;                  /* the layout takes one kernel of one block */
    bool numbered;                   /* BUFFER_NUMBERS is filled */
    cuda_kernel resident;
    const char *resident_name;

    cudaGraphExec_t graph; /* GRAPH_ITERATIONS plain iterations */
    bool graph_valid;      /* for this step's view */
    const char *kernel;    /* launched last: what an asynchronous error is about, or what ran before it */
};

/* ---- cuda_context.cu ---- */

sadmm_status CUDA(fail)(struct sadmm_context *, cudaError_t code, const char *what, struct sadmm_error *error);
/* At least `bytes` in a buffer; what it held is lost when it grows. */
sadmm_status CUDA(room)(struct sadmm_context *, enum cuda_buffer_name name, size_t bytes, struct sadmm_error *error);
/* Launch on the stream; 0 blocks: nothing to do. */
sadmm_status CUDA(launch)(struct sadmm_context *, cuda_kernel kernel, const char *name, int64_t blocks, size_t shared,
                          bool cooperative, const cuda_args *args, struct sadmm_error *error);
/* Through pinned memory, asynchronously; the pinned buffer is free again once the stream is idle. */
sadmm_status CUDA(upload)(struct sadmm_context *, void *to, enum cuda_buffer_name staging, size_t at, const void *from,
                          size_t bytes, struct sadmm_error *error);
/* The first `bytes` of view.out into PINNED_OUT, and wait. */
sadmm_status CUDA(download)(struct sadmm_context *, const void *from, size_t bytes, struct sadmm_error *error);
sadmm_status CUDA(wait)(struct sadmm_context *, struct sadmm_error *error);

/* The context's device is current while this lives; then the caller's again. (Unnamed: a test program links these sources
 * twice, for a device and emulated, and each must keep its own.) */
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

/* ---- cuda_layout.cu -------------------------------------------------------------------------------------------------
 * Counts and rooms in the view, then layout_room (it allocates); then per step, by enqueueing only: survey and layout of
 * what view.raw_pairs, raw_points and raw.blocks point to. */

sadmm_status CUDA(layout_room)(struct sadmm_context *, struct sadmm_error *error);
/* The facts; islands: also which bodies hang together (what BLOCK and CLUSTER need). */
sadmm_status CUDA(enqueue_survey)(struct sadmm_context *, bool islands, struct sadmm_error *error);
/* Slots, offsets, incident, parts. A part that exceeds what the partition allows sets live->halt = HALT_PARTITION. */
sadmm_status CUDA(enqueue_layout)(struct sadmm_context *, const struct cuda_partition *, struct sadmm_error *error);

/* The same in one go; small scenes: in one kernel. */
sadmm_status CUDA(enqueue_survey_and_layout)(struct sadmm_context *, bool islands, const struct cuda_partition *,
                                             struct sadmm_error *error);

/* ---- cuda_iterate.cu, cuda_resident.cu ---- */

/* Records of the start values: J^T lambda^0. */
sadmm_status CUDA(start_records)(struct sadmm_context *, struct sadmm_error *error);
/* 1/s of every pair, from 1/beta. */
sadmm_status CUDA(weigh_pairs)(struct sadmm_context *, struct sadmm_error *error);
/* The instance of the resident kernel for this step, and what it costs. */
cuda_kernel CUDA(resident_kernel)(int contact_rows, int point_slots, bool grid, const char **name);
size_t CUDA(resident_shared)(int32_t bodies, int32_t pairs, int32_t rows, int32_t incident, bool grid);
/* Let every instance use `bytes` of shared memory a block. */
cudaError_t CUDA(resident_allow)(int bytes);

#define CUDA_TRY(call)                                  \
    do {                                                \
        sadmm_status try_status = (call);               \
        if (try_status != SADMM_OK) return try_status;  \
    } while (0)
#define CUDA_CALL(c, call, name)                                                \
    do {                                                                        \
        cudaError_t try_code = (call);                                          \
        if (try_code != cudaSuccess) return CUDA(fail)((c), try_code, (name), error); \
    } while (0)

/* Shared memory of a block, sized at launch. */
#ifdef SADMM_CUDA_EMULATED
#define CUDA_DYNAMIC_SHARED(name) unsigned char *const name = cuda_emulation_shared()
#else
#define CUDA_DYNAMIC_SHARED(name) extern __shared__ __align__(16) unsigned char name[]
#endif

static inline int64_t blocks_for(int64_t threads) { return (threads + THREADS - 1) / THREADS; }

#include "cuda_entries.h"

#endif
