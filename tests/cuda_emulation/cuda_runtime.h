/* A CUDA device in ordinary C++, for machines that have none: what src/backend_cuda asks of the runtime, and its
 * kernels run thread by thread. Put this folder before the toolkit's on the include path and define
 * SADMM_CUDA_EMULATED.
 *
 * Every CUDA thread is a fiber; a barrier or a shuffle gives way to the others. A barrier that not every thread of its
 * warp, block or grid reaches, fails the launch instead of hanging. Fibers, and blocks, run in ascending or descending
 * order on request: a missing barrier, or a block that needs what another one does, shows as a difference between the
 * two. Device and shared memory is filled with NaN
 * patterns when it is allocated, and each block has its own heap block, so that sanitizers see every access out of
 * bounds.
 *
 * Not emulated: memory ordering, and any concurrency between blocks of a launch that is neither cooperative nor in
 * clusters; blocks of a cluster run side by side, clusters one after the other.
 *
 * One file, as the toolkit's: it stands in for that header, by its name.
 */
#ifndef SADMM_CUDA_EMULATION_H
#define SADMM_CUDA_EMULATION_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "emulation_control.h"
#include "fiber.h"

#define __global__
#define __device__
#define __host__
#define __forceinline__ inline __attribute__((always_inline))
#define __noinline__ __attribute__((noinline))
#define __launch_bounds__(...)
#define __grid_constant__

struct int2 {
    int x, y;
};
struct alignas(16) int4 {
    int x, y, z, w;
};
struct dim3 {
    unsigned x, y, z;
    dim3(unsigned x = 1, unsigned y = 1, unsigned z = 1) : x(x), y(y), z(z) {}
};

/* ---- threads as fibers ----------------------------------------------------------------------------------------- */

inline dim3 threadIdx, blockIdx, gridDim, blockDim;

namespace cuda_emulation {

enum { WARP_SIZE = 32, STACK = 128 * 1024 };
enum waiting { NOT, AT_WARP, AT_BLOCK, AT_ALL };

struct fiber {
    flow own;
    unsigned block, thread;
    waiting at;
    bool begun, done;
    unsigned long long shuffled[2]; /* in turn: a lane may write the next value before all have read the last */
    unsigned shuffles;
};

struct launch_state {
    std::vector<fiber> fibers;
    std::vector<std::unique_ptr<unsigned char, void (*)(void *)>> shared; /* by block */
    unsigned threads, first_block;
    size_t next, left, stacks; /* the next one, in order, that has not begun; that are not done; stacks in use */
    flow scheduler;
    fiber *current;
    const std::function<void()> *body;
};

inline launch_state *running;
inline std::vector<std::unique_ptr<char[]>> stacks;

inline void give_way(waiting at)
{
    fiber *self = running->current;
    self->at = at;
    flow_switch(&self->own, &running->scheduler);
}

inline fiber *fiber_at(launch_state *l, size_t k)
{
    return &l->fibers[cuda_emulation_descending ? l->fibers.size() - 1 - k : k];
}

/* It is that one's turn. */
inline void turn_to(launch_state *l, fiber *f)
{
    l->current = f;
    threadIdx.x = f->thread;
    blockIdx.x = f->block;
}

/* The turn of the next one that has not begun; false: all have. */
inline bool begin_next(launch_state *l)
{
    if (l->next == l->fibers.size()) return false;
    fiber *f = fiber_at(l, l->next++);
    f->begun = true;
    turn_to(l, f);
    return true;
}

/* A thread that comes to its end without a barrier leaves its stack to the next one, whose turn it is: most threads of
 * most launches do, and need no change of stacks. */
inline void fiber_main(void)
{
    launch_state *l = running;
    flow_begin(&l->scheduler);
    for (fiber *last;;) {
        (*l->body)();
        last = l->current;
        last->done = true;
        --l->left;
        if (!begin_next(l)) break;
        flow_hand_over(&last->own, &l->current->own);
    }
    flow_switch(&l->current->own, &l->scheduler, true);
}

/* Memory begins where a device's does: structures ask for up to 32 bytes. */
inline unsigned char *poisoned(size_t bytes)
{
    void *block = nullptr;
    if (posix_memalign(&block, 256, bytes ? bytes : 1) != 0) return nullptr;
    const uint16_t poison = 0x7ff8; /* in a row: not a number, in both precisions, and an index far out of bounds */
    for (size_t k = 0; k < bytes; k += sizeof poison)
        memcpy((unsigned char *)block + k, &poison, bytes - k < sizeof poison ? bytes - k : sizeof poison);
    return (unsigned char *)block;
}

/* Let fibers [begin, end) past a barrier all of them wait at. */
inline bool release(launch_state *l, size_t begin, size_t end, waiting at)
{
    for (size_t i = begin; i < end; ++i)
        if (l->fibers[i].done || l->fibers[i].at != at) return false;
    for (size_t i = begin; i < end; ++i) l->fibers[i].at = NOT;
    return true;
}

/* Run `blocks` blocks side by side; false when threads wait for each other for ever. */
inline bool run_blocks(const std::function<void()> &body, unsigned first, unsigned blocks, unsigned threads,
                       size_t shared)
{
    launch_state l;
    l.fibers.resize((size_t)blocks * threads);
    l.threads = threads;
    l.first_block = first;
    l.body = &body;
    running = &l;
    for (unsigned i = 0; i < blocks; ++i) l.shared.emplace_back(poisoned(shared), free);
    for (size_t i = 0; i < l.fibers.size(); ++i) {
        l.fibers[i].block = first + (unsigned)(i / threads);
        l.fibers[i].thread = (unsigned)(i % threads);
    }
    l.next = l.stacks = 0;
    l.left = l.fibers.size();
    while (l.left > 0) {
        bool moved = false;
        for (size_t k = 0; k < l.fibers.size(); ++k) {
            fiber *f = fiber_at(&l, k);
            if (f->done || f->at != NOT) continue;
            if (!f->begun) {
                if (l.stacks == stacks.size()) stacks.emplace_back(new char[STACK]);
                flow_prepare(&f->own, stacks[l.stacks++].get(), STACK, fiber_main);
                begin_next(&l); /* it is this one: those before it have begun */
            } else turn_to(&l, f);
            flow_switch(&l.scheduler, &f->own);
            moved = true;
        }
        for (size_t i = 0; i < l.fibers.size(); i += WARP_SIZE) release(&l, i, i + WARP_SIZE, AT_WARP);
        for (size_t i = 0; i < l.fibers.size(); i += threads) release(&l, i, i + threads, AT_BLOCK);
        release(&l, 0, l.fibers.size(), AT_ALL);
        if (moved) continue;
        for (size_t i = 0; i < l.stacks; ++i) flow_abandon(stacks[i].get(), STACK);
        return false;
    }
    return true;
}

inline unsigned long long exchange(unsigned mask, unsigned long long value, unsigned from)
{
    fiber *self = running->current, *warp = self - self->thread % WARP_SIZE;
    if (mask != 0xffffffffu) abort(); /* the backend has no use for partial warps */
    unsigned turn = self->shuffles++ % 2;
    self->shuffled[turn] = value;
    give_way(AT_WARP);
    return warp[from].shuffled[turn];
}

} // namespace cuda_emulation

inline void __syncthreads(void) { cuda_emulation::give_way(cuda_emulation::AT_BLOCK); }
inline void __syncwarp(unsigned) { cuda_emulation::give_way(cuda_emulation::AT_WARP); }
/* Of the blocks that run side by side: all of a cooperative launch, or a cluster. */
inline void cuda_emulation_barrier_together(void) { cuda_emulation::give_way(cuda_emulation::AT_ALL); }

inline unsigned char *cuda_emulation_shared(void)
{
    cuda_emulation::launch_state *l = cuda_emulation::running;
    return l->shared[l->current->block - l->first_block].get();
}

/* The address in another block's shared memory that `own` is in the caller's; rank: among the blocks side by side. */
inline const void *cuda_emulation_in_block(const void *own, unsigned rank)
{
    cuda_emulation::launch_state *l = cuda_emulation::running;
    if (rank >= l->shared.size()) abort();
    return l->shared[rank].get() + ((const unsigned char *)own - cuda_emulation_shared());
}

template <class T> static inline T cuda_emulation_exchange(unsigned mask, T value, unsigned from)
{
    unsigned long long bits = 0;
    memcpy(&bits, &value, sizeof value);
    bits = cuda_emulation::exchange(mask, bits, from);
    memcpy(&value, &bits, sizeof value);
    return value;
}
template <class T> static inline T __shfl_sync(unsigned mask, T value, int from, int width)
{
    unsigned lane = threadIdx.x % cuda_emulation::WARP_SIZE;
    return cuda_emulation_exchange(mask, value, lane / (unsigned)width * (unsigned)width + (unsigned)from);
}
template <class T> static inline T __shfl_xor_sync(unsigned mask, T value, int bits)
{
    return cuda_emulation_exchange(mask, value, threadIdx.x % cuda_emulation::WARP_SIZE ^ (unsigned)bits);
}

template <class T> static inline T __shfl_up_sync(unsigned mask, T value, int by)
{
    unsigned lane = threadIdx.x % cuda_emulation::WARP_SIZE;
    return cuda_emulation_exchange(mask, value, lane >= (unsigned)by ? lane - (unsigned)by : lane);
}
inline unsigned __ballot_sync(unsigned mask, bool vote)
{
    cuda_emulation::fiber *self = cuda_emulation::running->current;
    const unsigned turn = self->shuffles % 2;
    cuda_emulation::exchange(mask, vote, 0);
    const cuda_emulation::fiber *warp = self - self->thread % cuda_emulation::WARP_SIZE;
    unsigned votes = 0;
    for (unsigned lane = 0; lane < cuda_emulation::WARP_SIZE; ++lane)
        votes |= (unsigned)warp[lane].shuffled[turn] << lane;
    return votes;
}
template <class T> static inline T __ldcs(const T *from) { return *from; }
template <class T> static inline T __ldcg(const T *from) { return *from; }
inline void __threadfence(void) {}
inline void __threadfence_system(void) {}
inline int __popc(unsigned bits) { return __builtin_popcount(bits); }
inline int __ffs(int bits) { return __builtin_ffs(bits); }

inline long long __double_as_longlong(double value)
{
    long long bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}
inline double __longlong_as_double(long long bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}
inline float rsqrtf(float x) { return 1 / sqrtf(x); }
inline double rsqrt(double x) { return 1 / sqrt(x); }
/* Fibers give way at barriers only, so every access is atomic. */
inline void atomicMax(unsigned long long *to, unsigned long long value) { *to = std::max(*to, value); }
inline int atomicMax(int *to, int value)
{
    int before = *to;
    *to = std::max(before, value);
    return before;
}
inline int atomicMin(int *to, int value)
{
    int before = *to;
    *to = std::min(before, value);
    return before;
}
inline int atomicOr(int *to, int bits)
{
    int before = *to;
    *to |= bits;
    return before;
}
inline int atomicAdd(int *to, int value)
{
    int before = *to;
    *to += value;
    return before;
}
inline unsigned long long atomicAdd(unsigned long long *to, unsigned long long value)
{
    unsigned long long before = *to;
    *to += value;
    return before;
}
/* The others go first: what is compared with was read some time ago. */
inline int atomicCAS(int *to, int expected, int value)
{
    cuda_emulation::give_way(cuda_emulation::NOT);
    int before = *to;
    if (before == expected) *to = value;
    return before;
}

/* ---- the runtime ----------------------------------------------------------------------------------------------- */

enum cudaError_t {
    cudaSuccess = 0,
    cudaErrorInvalidValue,
    cudaErrorMemoryAllocation,
    cudaErrorNotReady,
    cudaErrorInvalidDevice,
    cudaErrorGraphExecUpdateFailure,
    cudaErrorLaunchFailure,
    cudaErrorLaunchTimeout,
};
enum { cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost, cudaMemcpyDeviceToDevice };
enum cudaDeviceAttr {
    cudaDevAttrMultiProcessorCount,
    cudaDevAttrMaxSharedMemoryPerBlockOptin,
    cudaDevAttrCooperativeLaunch,
    cudaDevAttrClusterLaunch
};
enum { cudaStreamNonBlocking, cudaStreamCaptureModeThreadLocal };
enum { cudaFuncAttributeMaxDynamicSharedMemorySize, cudaFuncAttributeNonPortableClusterSizeAllowed };
enum { cudaLaunchAttributeCooperative = 1, cudaLaunchAttributeClusterDimension };

struct cudaDeviceProp {
    char name[256];
    int major, minor, multiProcessorCount;
};
struct cudaFuncAttributes {
    int ptxVersion;
};
struct cudaGraphExecUpdateResultInfo {
    int unused;
};
typedef struct cuda_emulation_stream *cudaStream_t;
struct cuda_emulation_stream {
    int device;
};
struct cudaLaunchAttribute {
    int id;
    struct {
        int cooperative;
        dim3 clusterDim;
    } val;
};
struct cudaLaunchConfig_t {
    dim3 gridDim, blockDim;
    size_t dynamicSmemBytes;
    cudaStream_t stream;
    cudaLaunchAttribute *attrs;
    unsigned numAttrs;
};
typedef std::vector<std::function<bool()>> *cudaGraph_t;
typedef cudaGraph_t cudaGraphExec_t;

namespace cuda_emulation {

enum { DEVICES = 2, MULTIPROCESSORS = 4, BLOCKS_PER_MULTIPROCESSOR = 4, THREADS_PER_MULTIPROCESSOR = 2048 };
enum { SHARED_LIMIT = 96 * 1024 };
inline int device;
inline cudaGraph_t capture; /* what is recorded, when a stream is being captured */

/* The call of this thread that cuda_emulation_fail_after() chose fails. */
inline bool fails(void)
{
    if (cuda_emulation_lost) return true;
    if (cuda_emulation_calls_left < 0) return false;
    return cuda_emulation_calls_left-- == 0;
}

} // namespace cuda_emulation

/* Now, or when the graph that is being captured is launched. */
template <class Node> static inline cudaError_t cuda_emulation_enqueue(Node node)
{
    if (cuda_emulation::capture) cuda_emulation::capture->push_back(node);
    else if (!node()) return cudaErrorLaunchTimeout;
    return cudaSuccess;
}

#define CUDA_EMULATION_CALL \
    if (cuda_emulation::fails()) return cudaErrorLaunchFailure

inline const char *cudaGetErrorString(cudaError_t code)
{
    switch (code) {
    case cudaSuccess: return "no error";
    case cudaErrorMemoryAllocation: return "out of memory";
    case cudaErrorInvalidDevice: return "invalid device ordinal";
    case cudaErrorLaunchTimeout: return "emulated threads wait for each other for ever";
    case cudaErrorLaunchFailure: return "unspecified launch failure (emulated)";
    default: return "invalid argument (emulated)";
    }
}
inline cudaError_t cudaGetLastError(void) { return cudaSuccess; }

inline cudaError_t cudaGetDeviceCount(int *count)
{
    *count = cuda_emulation::DEVICES;
    return cudaSuccess;
}
inline cudaError_t cudaGetDevice(int *device)
{
    *device = cuda_emulation::device;
    return cudaSuccess;
}
inline cudaError_t cudaSetDevice(int device)
{
    if (device < 0 || device >= cuda_emulation::DEVICES) return cudaErrorInvalidDevice;
    cuda_emulation::device = device;
    return cudaSuccess;
}
inline cudaError_t cudaGetDeviceProperties(cudaDeviceProp *properties, int)
{
    memset(properties, 0, sizeof *properties);
    snprintf(properties->name, sizeof properties->name, "emulated device");
    properties->multiProcessorCount = cuda_emulation::MULTIPROCESSORS;
    return cudaSuccess;
}
inline cudaError_t cudaDeviceGetAttribute(int *value, cudaDeviceAttr attribute, int)
{
    CUDA_EMULATION_CALL;
    *value = attribute == cudaDevAttrMultiProcessorCount            ? cuda_emulation::MULTIPROCESSORS
             : attribute == cudaDevAttrMaxSharedMemoryPerBlockOptin ? cuda_emulation::SHARED_LIMIT
                                                                    : 1;
    return cudaSuccess;
}
inline cudaError_t cudaFuncSetAttribute(const void *, int, int)
{
    CUDA_EMULATION_CALL;
    return cudaSuccess;
}
inline cudaError_t cudaFuncGetAttributes(cudaFuncAttributes *attributes, const void *)
{
    CUDA_EMULATION_CALL;
    attributes->ptxVersion = 90;
    return cudaSuccess;
}
inline cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessor(int *blocks, const void *, int threads, size_t)
{
    CUDA_EMULATION_CALL;
    *blocks = std::min((int)cuda_emulation::BLOCKS_PER_MULTIPROCESSOR,
                       cuda_emulation::THREADS_PER_MULTIPROCESSOR / std::max(threads, 1));
    return cudaSuccess;
}
inline cudaError_t cudaOccupancyMaxActiveClusters(int *clusters, const void *kernel, const cudaLaunchConfig_t *config)
{
    int blocks = 0;
    cudaError_t code = cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, (int)config->blockDim.x,
                                                                     config->dynamicSmemBytes);
    *clusters = blocks * cuda_emulation::MULTIPROCESSORS / (int)config->attrs->val.clusterDim.x;
    return code;
}

inline cudaError_t cudaMallocHost(void **block, size_t bytes)
{
    CUDA_EMULATION_CALL;
    *block = cuda_emulation::poisoned(bytes);
    if (!*block) return cudaErrorMemoryAllocation;
    ++cuda_emulation_allocations;
    return cudaSuccess;
}
inline cudaError_t cudaMalloc(void **block, size_t bytes) { return cudaMallocHost(block, bytes); }
inline cudaError_t cudaFreeHost(void *block)
{
    free(block);
    --cuda_emulation_allocations;
    return cudaSuccess;
}
inline cudaError_t cudaFree(void *block) { return cudaFreeHost(block); }
inline cudaError_t cudaMemcpyAsync(void *to, const void *from, size_t bytes, int, cudaStream_t)
{
    CUDA_EMULATION_CALL;
    return cuda_emulation_enqueue([=]() { return memcpy(to, from, bytes) == to; });
}
inline cudaError_t cudaMemsetAsync(void *to, int value, size_t bytes, cudaStream_t)
{
    CUDA_EMULATION_CALL;
    return cuda_emulation_enqueue([=]() { return memset(to, value, bytes) == to; });
}

inline cudaError_t cudaStreamCreateWithFlags(cudaStream_t *stream, int)
{
    CUDA_EMULATION_CALL;
    *stream = new cuda_emulation_stream{cuda_emulation::device};
    ++cuda_emulation_allocations;
    return cudaSuccess;
}
inline cudaError_t cudaStreamDestroy(cudaStream_t stream)
{
    delete stream;
    --cuda_emulation_allocations;
    return cudaSuccess;
}
inline cudaError_t cudaStreamSynchronize(cudaStream_t)
{
    ++cuda_emulation_waits;
    CUDA_EMULATION_CALL;
    return cudaSuccess;
}

typedef struct cuda_emulation_stream *cudaEvent_t;
enum { cudaEventDisableTiming };
inline cudaError_t cudaEventCreateWithFlags(cudaEvent_t *event, int) { return cudaStreamCreateWithFlags(event, 0); }
inline cudaError_t cudaEventDestroy(cudaEvent_t event) { return cudaStreamDestroy(event); }
inline cudaError_t cudaEventRecord(cudaEvent_t, cudaStream_t)
{
    CUDA_EMULATION_CALL;
    return cudaSuccess;
}
inline cudaError_t cudaStreamWaitEvent(cudaStream_t, cudaEvent_t, unsigned)
{
    CUDA_EMULATION_CALL;
    return cudaSuccess;
}
/* What was enqueued has been done: who asks need not wait, but would. */
inline cudaError_t cudaEventQuery(cudaEvent_t)
{
    ++cuda_emulation_waits;
    CUDA_EMULATION_CALL;
    return cudaSuccess;
}

inline cudaError_t cudaStreamBeginCapture(cudaStream_t, int)
{
    CUDA_EMULATION_CALL;
    cuda_emulation::capture = new std::vector<std::function<bool()>>;
    return cudaSuccess;
}
inline cudaError_t cudaStreamEndCapture(cudaStream_t, cudaGraph_t *graph)
{
    *graph = cuda_emulation::capture;
    cuda_emulation::capture = nullptr;
    CUDA_EMULATION_CALL;
    return cudaSuccess;
}
inline cudaError_t cudaGraphDestroy(cudaGraph_t graph)
{
    delete graph;
    return cudaSuccess;
}
inline cudaError_t cudaGraphInstantiate(cudaGraphExec_t *out, cudaGraph_t graph, unsigned long long)
{
    CUDA_EMULATION_CALL;
    *out = new std::vector<std::function<bool()>>(*graph);
    ++cuda_emulation_graphs_made;
    ++cuda_emulation_allocations;
    return cudaSuccess;
}
inline cudaError_t cudaGraphExecDestroy(cudaGraphExec_t graph)
{
    delete graph;
    --cuda_emulation_allocations;
    return cudaSuccess;
}
inline cudaError_t cudaGraphExecUpdate(cudaGraphExec_t exec, cudaGraph_t graph, cudaGraphExecUpdateResultInfo *)
{
    if (exec->size() != graph->size()) return cudaErrorGraphExecUpdateFailure;
    *exec = *graph;
    return cudaSuccess;
}
inline cudaError_t cudaGraphLaunch(cudaGraphExec_t exec, cudaStream_t)
{
    CUDA_EMULATION_CALL;
    for (const auto &node : *exec)
        if (!node()) return cudaErrorLaunchTimeout;
    return cudaSuccess;
}

/* Internal linkage: the argument types are others in every precision, under the same names. */
template <class View, class Args>
static cudaError_t cuda_emulation_launch(const cudaLaunchConfig_t *config, void (*kernel)(const View, const Args),
                                         const View &view, const Args &args)
{
    CUDA_EMULATION_CALL;
    const unsigned blocks = config->gridDim.x, threads = config->blockDim.x;
    const size_t shared = config->dynamicSmemBytes;
    unsigned together = 1; /* blocks that run side by side */
    for (unsigned i = 0; i < config->numAttrs; ++i)
        together = config->attrs[i].id == cudaLaunchAttributeCooperative ? blocks : config->attrs[i].val.clusterDim.x;
    if (shared > cuda_emulation::SHARED_LIMIT || threads == 0 || threads > 1024 || threads % cuda_emulation::WARP_SIZE)
        return cudaErrorInvalidValue;
    if (together == 0 || together > cuda_emulation::MULTIPROCESSORS * cuda_emulation::BLOCKS_PER_MULTIPROCESSOR ||
        blocks % together)
        return cudaErrorInvalidValue;
    return cuda_emulation_enqueue([=]() {
        std::function<void()> body = [&]() { kernel(view, args); };
        gridDim.x = blocks;
        blockDim.x = threads;
        for (unsigned done = 0; done < blocks; done += together) {
            const unsigned first = cuda_emulation_descending ? blocks - together - done : done;
            if (!cuda_emulation::run_blocks(body, first, together, threads, shared)) return false;
        }
        return true;
    });
}

/* Blocks that run one after another. */
template <class View, class Args>
static cudaError_t cuda_emulation_launch(void (*kernel)(const View, const Args), unsigned blocks, unsigned threads,
                                         size_t shared, const View &view, const Args &args)
{
    const cudaLaunchConfig_t config = {blocks, threads, shared, nullptr, nullptr, 0};
    return cuda_emulation_launch(&config, kernel, view, args);
}

#endif
