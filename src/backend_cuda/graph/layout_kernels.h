/* The layout (device/layout.h) of a step, made on the device from core's own pairs and row constraints: compiled once,
 * for both precisions.
 *
 *   statistics  a thread a record: statistics of the pairs, the body of every side, degrees, each body hooked under the
 *               smallest that it touches
 *               a thread a body: hooked right under its root
 *               a thread a record: islands joined, of which few are left to join by then
 *               a thread a body: islands labelled by their smallest body, statistics of the bodies
 *   layout      bodies sorted by label (where islands matter), sides sorted by slot, both stably; where a body's sides
 *               begin; parts
 *
 * Islands are a union-find forest whose roots are only ever hooked under smaller ones (Jaiganesh and Burtscher, A
 * High-Performance Connected Components Implementation for GPUs, HPDC 2018): whatever the timing, an island's root ends
 * up to be its smallest body.
 *
 * A small scene takes one kernel of one block for both stages, its arrays in shared memory (graph/layout_small.cu): a
 * launch costs as much as such a stage. Both ways give the same layout. The functions below only enqueue, so that they
 * can be captured into a graph.
 */
#ifndef SADMM_CUDA_GRAPH_LAYOUT_KERNELS_H
#define SADMM_CUDA_GRAPH_LAYOUT_KERNELS_H

#include <cuda_runtime.h>

#include "core/model/system.h"
#include "backend_cuda/device/pdl.h"
#include "backend_cuda/device/layout.h"

enum { LAYOUT_THREADS = 256, ONE_BLOCK_THREADS = 1024 };

/* Which stages, and what of them. */
struct layout_args {
    int32_t statistics, layout; /* of one_block: which */
    int32_t islands;        /* statistics: find them; layout: slots by island */
    struct cuda_partition partition;
};

/* Where kernels go; pdl: in a recorded step (device/pdl.h). */
struct layout_stream {
    cudaStream_t stream;
    bool pdl;
};

static __host__ __device__ inline bool slots_by_island(const struct cuda_partition *partition)
{
    return partition->islands || partition->tier == SADMM_CUDA_TIER_BLOCK || partition->tier == SADMM_CUDA_TIER_CLUSTER;
}

#ifdef SADMM_CUDA_EMULATED
#define LAYOUT(name) sadmm_cuda_layout_##name##_emulated
#else
#define LAYOUT(name) sadmm_cuda_layout_##name
#endif

/* On failure *kernel says what was launched; after success, what was launched last. */
cudaError_t LAYOUT(statistics)(const struct layout_view *, bool islands, const struct layout_stream &stream,
                               const char **kernel);
cudaError_t LAYOUT(make)(const struct layout_view *, const struct cuda_partition *, const struct layout_stream &stream,
                         const char **kernel);
/* Either or both by one block: statistics, and a layout where there is a partition. `shared`: bytes it takes, SIZE_MAX:
 * such a scene is too large. `allow`: let it take so many. */
size_t LAYOUT(one_block_shared)(int32_t bodies, int32_t sides);
cudaError_t LAYOUT(one_block_allow)(int bytes);
cudaError_t LAYOUT(one_block)(const struct layout_view *, bool statistics, bool islands, const struct cuda_partition *,
                              const struct layout_stream &stream, const char **kernel);
/* What view.temp has to hold. */
cudaError_t LAYOUT(temp_bytes)(int32_t bodies, int32_t sides, size_t *bytes);
/* view.numbers */
cudaError_t LAYOUT(number)(int32_t *numbers, int32_t count, const struct layout_stream &stream, const char **kernel);

/* Shared memory of a block, sized at launch. */
#ifdef SADMM_CUDA_EMULATED
#define LAYOUT_SHARED(name) unsigned char *const name = cuda_emulation_shared()
#else
#define LAYOUT_SHARED(name) extern __shared__ __align__(16) unsigned char name[]
#endif

typedef void (*layout_kernel)(const layout_view, const layout_args);

static inline cudaError_t layout_launch(layout_kernel kernel, int64_t blocks, int threads, size_t shared,
                                        const layout_view *view, const layout_args *args,
                                        const struct layout_stream &stream)
{
    if (blocks <= 0) return cudaSuccess;
#ifdef SADMM_CUDA_EMULATED
    (void)stream;
    return cuda_emulation_launch(kernel, (unsigned)blocks, (unsigned)threads, shared, *view, *args);
#else
    void *parameters[] = {const_cast<layout_view *>(view), const_cast<layout_args *>(args)};
    return launch_on(stream.stream, stream.pdl, (const void *)kernel, dim3((unsigned)blocks), dim3((unsigned)threads),
                     shared, parameters);
#endif
}

#endif
