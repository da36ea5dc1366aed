/* Parts of a step's graph that are done only if a kernel before them says so: nodes with a condition. Where there are
 * none, the part's kernels are launched all the same, and see themselves that they have nothing to do.
 *
 * In such a part a kernel's parameters have no address that a device knows: what a function reads through a reference
 * to them, if it is not inlined, is anything. */
#ifndef SADMM_CUDA_DEVICE_CONDITION_H
#define SADMM_CUDA_DEVICE_CONDITION_H

#include <stddef.h>

#include <cuda_runtime.h>

/* Whose toolkits and drivers have such nodes with all that is used here. */
#define CONDITION_VERSION 13000
#if !defined(SADMM_CUDA_EMULATED) && CUDART_VERSION >= CONDITION_VERSION
#define HAVE_CONDITIONS 1
#else
#define HAVE_CONDITIONS 0
#endif

typedef unsigned long long condition; /* 0: the part is done in any case */

/* By one thread. */
static __device__ __forceinline__ void set_condition(condition handle, bool on)
{
#if HAVE_CONDITIONS
    if (handle) cudaGraphSetConditional(handle, on);
#else
    (void)handle;
    (void)on;
#endif
}

#if HAVE_CONDITIONS
/* Where a stream that is being captured has got to. */
struct capture_end {
    cudaGraph_t graph;
    const cudaGraphNode_t *nodes;
    size_t count;
};
static inline cudaError_t capture_end_of(cudaStream_t stream, struct capture_end *end)
{
    cudaStreamCaptureStatus status = cudaStreamCaptureStatusNone;
    *end = {};
    return cudaStreamGetCaptureInfo(stream, &status, nullptr, &end->graph, &end->nodes, nullptr, &end->count);
}
#endif

/* A condition of the graph that is being captured; 0: it has none. */
static inline cudaError_t make_condition(cudaStream_t stream, condition *out)
{
    *out = 0;
#if HAVE_CONDITIONS
    int driver = 0;
    struct capture_end end;
    cudaError_t code = cudaDriverGetVersion(&driver);
    if (code == cudaSuccess) code = capture_end_of(stream, &end);
    if (code != cudaSuccess || driver < CONDITION_VERSION || !end.graph) return code;
    return cudaGraphConditionalHandleCreate(out, end.graph, 0, cudaGraphCondAssignDefault);
#else
    (void)stream;
    return cudaSuccess;
#endif
}

/* What is enqueued on `part` from here to end_part is a part of the graph that `stream` is captured into, behind what
 * is there. */
static inline cudaError_t begin_part(cudaStream_t stream, condition handle, cudaStream_t part)
{
#if HAVE_CONDITIONS
    cudaGraphNode_t node;
    cudaGraphNodeParams params = {};
    struct capture_end end;
    params.type = cudaGraphNodeTypeConditional;
    params.conditional.handle = handle;
    params.conditional.type = cudaGraphCondTypeIf;
    params.conditional.size = 1;
    cudaError_t code = capture_end_of(stream, &end);
    if (code == cudaSuccess) code = cudaGraphAddNode(&node, end.graph, end.nodes, nullptr, end.count, &params);
    if (code == cudaSuccess)
        code = cudaStreamUpdateCaptureDependencies(stream, &node, nullptr, 1, cudaStreamSetCaptureDependencies);
    if (code != cudaSuccess) return code;
    return cudaStreamBeginCaptureToGraph(part, params.conditional.phGraph_out[0], nullptr, nullptr, 0,
                                         cudaStreamCaptureModeThreadLocal);
#else
    (void)stream;
    (void)handle;
    (void)part;
    return cudaSuccess;
#endif
}

static inline cudaError_t end_part(cudaStream_t part)
{
    cudaGraph_t graph;
    return cudaStreamEndCapture(part, &graph);
}

#endif
