/* A context's life: which devices there are, opening one, giving everything back; and what tests choose. */
#include <stdio.h>

#include "backend_cuda/graph/graph.h"
#include "backend_cuda/iterate/iterate.h"
#include "backend_cuda/step/world.h"
#include "core/base/memory.h"

/* ---- devices -------------------------------------------------------------------------------------------------- */

struct probe_result {
    bool found;
    char about[512];
};

static probe_result probe(void)
{
    probe_result result = {false, ""};
    int count = 0;
    cudaError_t code = cudaGetDeviceCount(&count);
    if (code != cudaSuccess || count == 0) {
        (void)cudaGetLastError();
        snprintf(result.about, sizeof result.about, "no CUDA device: %s",
                 code != cudaSuccess ? cudaGetErrorString(code) : "the driver lists none");
        return result;
    }
    cudaDeviceProp properties;
    code = cudaGetDeviceProperties(&properties, 0);
    if (code != cudaSuccess) {
        (void)cudaGetLastError();
        snprintf(result.about, sizeof result.about, "CUDA device 0 does not answer: %s", cudaGetErrorString(code));
        return result;
    }
    result.found = true;
    snprintf(result.about, sizeof result.about, "%s, compute capability %d.%d, %d multiprocessors; %d device%s",
             properties.name, properties.major, properties.minor, properties.multiProcessorCount, count,
             count == 1 ? "" : "s");
    return result;
}

extern "C" bool CUDA(probe)(const char **about)
{
    static const probe_result result = probe(); /* once a process: starting the driver takes a while */
    *about = result.about;
    return result.found;
}

static sadmm_status open_device(struct sadmm_context *c, struct sadmm_error *error)
{
    int cooperative = 0, clusters = 0, count = 0;
    CUDA_CALL(c, cudaGetDeviceCount(&count), "cudaGetDeviceCount");
    if (c->device < 0 || c->device >= count)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "device = %d: must be in [0, %d]", c->device, count - 1);
    CUDA_ENTER(c);
    CUDA_CALL(c, cudaDeviceGetAttribute(&c->multiprocessors, cudaDevAttrMultiProcessorCount, c->device),
              "cudaDeviceGetAttribute");
    CUDA_CALL(c, cudaDeviceGetAttribute(&c->shared_limit, cudaDevAttrMaxSharedMemoryPerBlockOptin, c->device),
              "cudaDeviceGetAttribute");
    CUDA_CALL(c, cudaDeviceGetAttribute(&cooperative, cudaDevAttrCooperativeLaunch, c->device),
              "cudaDeviceGetAttribute");
    CUDA_CALL(c, cudaDeviceGetAttribute(&clusters, cudaDevAttrClusterLaunch, c->device), "cudaDeviceGetAttribute");
    c->cooperative = cooperative != 0;
    CUDA_CALL(c, CUDA(persistent_allow)(c->shared_limit, clusters != 0, &c->clusters), "loading the kernels");
    c->pdl = c->clusters && PDL_ARCH <= CLUSTER_ARCH; /* the same devices, the same code */
    CUDA_CALL(c, LAYOUT(one_block_allow)(c->shared_limit), "loading the kernels");
    CUDA_CALL(c, CUDA(articulation_allow)(c->shared_limit), "loading the kernels");
    CUDA_CALL(c, CUDA(ncp_allow)(c->shared_limit), "loading the kernels");
    CUDA_CALL(c, CUDA(joint_close_allow)(c->shared_limit), "loading the kernels");
    CUDA_CALL(c, cudaStreamCreateWithFlags(&c->stream, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
    c->timings = CUDA(timings)(c);
    CUDA_CALL(c, cudaStreamCreateWithFlags(&c->side, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
    CUDA_CALL(c, cudaStreamCreateWithFlags(&c->joint_side, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
    CUDA_CALL(c, cudaEventCreateWithFlags(&c->joint_join, cudaEventDisableTiming), "cudaEventCreateWithFlags");
    CUDA_CALL(c, cudaEventCreateWithFlags(&c->fork, cudaEventDisableTiming), "cudaEventCreateWithFlags");
    CUDA_CALL(c, cudaEventCreateWithFlags(&c->join, cudaEventDisableTiming), "cudaEventCreateWithFlags");
    return SADMM_OK;
}

/* ---- entries -------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(create)(int device, struct sadmm_context **out, struct sadmm_error *error)
{
    struct sadmm_context *c = (struct sadmm_context *)sadmm_alloc(1, sizeof *c);
    *out = nullptr;
    if (!c) return sadmm_fail_memory(error, "the cuda backend's context");
    c->device = device;
    sadmm_status status = open_device(c, error);
    if (status != SADMM_OK) {
        CUDA(destroy)(c);
        return status;
    }
    *out = c;
    return SADMM_OK;
}

extern "C" void CUDA(destroy)(struct sadmm_context *c)
{
    if (!c) return;
    if (c->stream) { /* a device was opened; after a device error these calls fail, and there is nothing left to free */
        device_scope scope(c->device);
        (void)cudaStreamSynchronize(c->stream);
        CUDA(step_destroy)(c);
        if (c->graph) (void)cudaGraphExecDestroy(c->graph);
        CUDA(release_buffers)(c);
        if (c->joint_join) (void)cudaEventDestroy(c->joint_join);
        if (c->joint_side) (void)cudaStreamDestroy(c->joint_side);
        if (c->join) (void)cudaEventDestroy(c->join);
        if (c->fork) (void)cudaEventDestroy(c->fork);
        if (c->side) (void)cudaStreamDestroy(c->side);
        (void)cudaStreamDestroy(c->stream);
        (void)cudaGetLastError();
    }
    sadmm_free(c);
}

extern "C" void CUDA(tune_capacities)(struct sadmm_context *c, int64_t first_capacity)
{
    c->first_capacity = first_capacity;
}

extern "C" void CUDA(set_tier)(struct sadmm_context *c, enum sadmm_cuda_tier tier)
{
    c->wanted = tier;
}

extern "C" void CUDA(set_cluster)(struct sadmm_context *c, int blocks) { c->wanted_cluster = blocks; }

extern "C" enum sadmm_cuda_tier CUDA(get_tier)(const struct sadmm_context *c, int32_t *blocks)
{
    if (blocks) *blocks = c->partition.parts;
    return c->partition.tier;
}
