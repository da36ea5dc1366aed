/* A context: device, stream, buffers that only grow, launches, errors. */
#include <stdio.h>
#include <string.h>

#include <algorithm>

#include "collision/base/bounds.h"
#include "core/base/memory.h"
#include "context.h"

/* ---- errors --------------------------------------------------------------------------------------------------- */

sadmm_status CUDA(fail)(struct sadmm_context *c, cudaError_t code, const char *what, struct sadmm_error *error)
{
    (void)cudaGetLastError(); /* an error that does not last must not be found by the next call */
    return sadmm_fail(error, code == cudaErrorMemoryAllocation ? SADMM_ERROR_OUT_OF_MEMORY : SADMM_ERROR_DEVICE,
                      "CUDA device %d: %s: %s", c->device, what, cudaGetErrorString(code));
}

sadmm_status CUDA(wait)(struct sadmm_context *c, struct sadmm_error *error)
{
    cudaError_t code = cudaStreamSynchronize(c->stream);
    if (code == cudaSuccess) return SADMM_OK;
    char what[160];
    snprintf(what, sizeof what, "kernel %s (the last one launched, or one before it)", c->kernel ? c->kernel : "none");
    return CUDA(fail)(c, code, what, error);
}

/* ---- memory --------------------------------------------------------------------------------------------------- */

static const char *const buffer_names[] = {
    "states",
    "b",
    "matrices",
    "turns halfway",
    "C",
    "penalties",
    "normals",
    "arms between bodies",
    "pairs' bodies",
    "arms",
    "impulses",
    "constraints given by rows",
    "rows",
    "responses of rows",
    "wrench records",
    "changes of wrench records",
    "exchanged velocities",
    "live counts",
    "layout",
    "sorts",
    "numbers",
    "scalars",
    "settings",
    "gravity",
    "weights",
    "records of sides",
    "momentum of islands",
    "trapezoid corrections of bodies",
    "bodies' input",
    "pairs' input",
    "points' input",
    "input of points' migrations",
    "rows' input",
    "results",
    "world's bodies",
    "world's changes of velocity",
    "world's wrenches",
    "world's starting velocities",
    "world's starting impulses",
    "world's body slots",
    "world's places of bodies",
    "control of a step",
    "bodies after hits",
    "kinematic bodies",
    "what bodies ride on",
    "joints",
    "gears",
    "tables of springs",
    "what joints keep",
    "what couplings keep",
    "rows of joints",
    "islands of joints",
    "momentum of joints",
    "joints at bodies",
    "stiffness of joints",
    "bodies of closed joints",
    "articulations",
    "contacts of articulations",
    "pushes of islands",
    "bodies that are pushed",
    "places of pushed pairs",
    "trees of articulations",
    "impulses of solved islands",
    "memory of solved islands",
    "states of environments",
    "measures of environments",
    "staged counts",
    "staged settings",
    "staged bodies",
    "staged pairs",
    "staged points",
    "staged migrations",
    "staged rows",
    "staged results",
    "reports",
    "changes of bodies",
};
static_assert(sizeof buffer_names / sizeof *buffer_names == BUFFER_COUNT, "a name a buffer");

static void release(cuda_buffer *buffer)
{
    if (buffer->data) (void)(buffer->pinned ? cudaFreeHost(buffer->data) : cudaFree(buffer->data));
    buffer->data = nullptr;
    buffer->capacity = 0;
}

void CUDA(release_buffers)(struct sadmm_context *c)
{
    for (cuda_buffer &buffer : c->buffers) release(&buffer);
}

sadmm_status CUDA(reserve)(struct sadmm_context *c, enum cuda_buffer_name name, size_t bytes, struct sadmm_error *error)
{
    cuda_buffer *buffer = &c->buffers[name];
    if (bytes <= buffer->capacity && buffer->data) return SADMM_OK;
    const size_t wanted = sadmm_grown_capacity(buffer->capacity, bytes, 256);
    char what[96];
    snprintf(what, sizeof what, "allocation of %zu bytes for the cuda backend's %s", wanted, buffer_names[name]);
    if (sadmm_test_allocation_fails()) return CUDA(fail)(c, cudaErrorMemoryAllocation, what, error);
    release(buffer);
    buffer->pinned = name >= PINNED_LIVE;
    CUDA_CALL(c, buffer->pinned ? cudaMallocHost(&buffer->data, wanted) : cudaMalloc(&buffer->data, wanted), what);
    buffer->capacity = wanted;
    return SADMM_OK;
}

sadmm_status CUDA(clear)(struct sadmm_context *c, enum cuda_scalar scalar, struct sadmm_error *error)
{
    const cuda_view *v = &c->view;
    if (c->cleared & (unsigned)scalar) {
        c->cleared &= ~(unsigned)scalar;
        return SADMM_OK;
    }
    if (c->skips) return SADMM_OK;
    if (scalar == SCALAR_BARRIER) {
        CUDA_CALL(c, cudaMemsetAsync(v->iteration.barrier, 0, sizeof *v->iteration.barrier, c->stream),
                  "cudaMemsetAsync(barrier)");
    } else {
        CUDA_CALL(c,
                  cudaMemsetAsync(v->iteration.residual + (scalar == SCALAR_DUAL), 0, sizeof *v->iteration.residual,
                                  c->stream),
                  "cudaMemsetAsync(residual)");
    }
    return SADMM_OK;
}

sadmm_status CUDA(upload)(struct sadmm_context *c, void *to, enum cuda_buffer_name staging, size_t at, const void *from,
                          size_t bytes, struct sadmm_error *error)
{
    if (bytes == 0) return SADMM_OK;
    unsigned char *staged = (unsigned char *)c->buffers[staging].data + at;
    memcpy(staged, from, bytes);
    CUDA_CALL(c, cudaMemcpyAsync(to, staged, bytes, cudaMemcpyHostToDevice, c->stream),
              "cudaMemcpyAsync to the device");
    return SADMM_OK;
}

sadmm_status CUDA(download)(struct sadmm_context *c, const void *from, size_t bytes, struct sadmm_error *error)
{
    if (bytes > 0)
        CUDA_CALL(c, cudaMemcpyAsync(c->buffers[PINNED_OUT].data, from, bytes, cudaMemcpyDeviceToHost, c->stream),
                  "cudaMemcpyAsync from the device");
    return CUDA(wait)(c, error);
}

sadmm_status CUDA(put)(struct sadmm_context *c, void *to, const void *from, size_t bytes, struct sadmm_error *error)
{
    TRY(CUDA(reserve)(c, PINNED_ROWS, bytes, error));
    TRY(CUDA(upload)(c, to, PINNED_ROWS, 0, from, bytes, error));
    return CUDA(wait)(c, error);
}

sadmm_status CUDA(get)(struct sadmm_context *c, void *to, const void *from, size_t bytes, struct sadmm_error *error)
{
    enum { PIECE = 16 << 20 }; /* pinned memory is scarce */
    if (!to) return SADMM_OK;
    TRY(CUDA(reserve)(c, PINNED_OUT, std::min(bytes, (size_t)PIECE), error));
    for (size_t at = 0; at < bytes; at += PIECE) {
        const size_t piece = std::min(bytes - at, (size_t)PIECE);
        TRY(CUDA(download)(c, (const char *)from + at, piece, error));
        memcpy((char *)to + at, c->buffers[PINNED_OUT].data, piece);
    }
    return SADMM_OK;
}

void CUDA(plan_settings)(struct sadmm_context *c, const struct sadmm_settings *settings)
{
    c->settings = *settings;
    c->fast = settings->method == SADMM_METHOD_FAST;
    c->view.model.fast = c->fast;
    c->view.model.wrenches = settings->recover_wrenches;
}

sadmm_status CUDA(use_settings)(struct sadmm_context *c, const struct sadmm_settings *settings,
                                struct sadmm_error *error)
{
    double numbers[SADMM_SETTING_NUMBERS];
    const struct cuda_settings kept = {*settings, gravity_size(settings->gravity)};
    TRY(CUDA(reserve)(c, BUFFER_SETTINGS, sizeof kept, error));
    TRY(CUDA(reserve)(c, PINNED_SETTINGS, sizeof kept, error));
    CUDA(plan_settings)(c, settings);
    c->view.model.settings = &((const struct cuda_settings *)c->buffers[BUFFER_SETTINGS].data)->settings;
    sadmm_settings_numbers(settings, numbers);
    if (memcmp(c->numbers, numbers, sizeof numbers) == 0) return SADMM_OK;
    TRY(CUDA(upload)(c, c->buffers[BUFFER_SETTINGS].data, PINNED_SETTINGS, 0, &kept, sizeof kept, error));
    memcpy(c->numbers, numbers, sizeof numbers);
    return SADMM_OK;
}

/* ---- launches ------------------------------------------------------------------------------------------------- */

enum { MOST_ATTRIBUTES = 2 };

/* Blocks of a partition run side by side in clusters (`cluster` > 1), or all of them (GRID: a cooperative launch). */
static cudaLaunchConfig_t configure(const struct sadmm_context *c, const struct cuda_partition *partition, bool pdl,
                                    cudaLaunchAttribute attribute[MOST_ATTRIBUTES])
{
    cudaLaunchConfig_t launch = {};
    launch.gridDim = dim3((unsigned)partition->parts);
    launch.blockDim = dim3((unsigned)partition->threads);
    launch.dynamicSmemBytes = partition->shared;
    launch.stream = c->stream;
    launch.attrs = attribute;
    if (partition->tier == SADMM_CUDA_TIER_GRID) {
        cudaLaunchAttribute *next = &attribute[launch.numAttrs++];
        next->id = cudaLaunchAttributeCooperative;
        next->val.cooperative = 1;
    } else if (partition->cluster > 1) {
        cudaLaunchAttribute *next = &attribute[launch.numAttrs++];
        next->id = cudaLaunchAttributeClusterDimension;
        next->val.clusterDim.x = (unsigned)partition->cluster;
        next->val.clusterDim.y = next->val.clusterDim.z = 1;
    }
#ifndef SADMM_CUDA_EMULATED
    if (pdl && partition->tier != SADMM_CUDA_TIER_GRID)
        attribute[launch.numAttrs++] = pdl_attribute();
#else
    (void)pdl;
#endif
    return launch;
}

cudaError_t CUDA(active_clusters)(const struct sadmm_context *c, cuda_kernel kernel,
                                  const struct cuda_partition *partition, int *clusters)
{
    cudaLaunchAttribute attributes[MOST_ATTRIBUTES];
    const cudaLaunchConfig_t launch = configure(c, partition, false, attributes);
    return cudaOccupancyMaxActiveClusters(clusters, (const void *)kernel, &launch);
}

static sadmm_status launch_configured(struct sadmm_context *c, cuda_kernel kernel, const char *name,
                                      const struct cuda_partition *partition, bool pdl, const cuda_args *args,
                                      struct sadmm_error *error)
{
    if (c->skips) return SADMM_OK;
    cudaLaunchAttribute attributes[MOST_ATTRIBUTES];
    const cudaLaunchConfig_t launch = configure(c, partition, pdl, attributes);
    c->kernel = name;
#ifdef SADMM_CUDA_EMULATED
    cudaError_t code = cuda_emulation_launch(&launch, kernel, c->view, *args);
#else
    void *parameters[] = {&c->view, const_cast<cuda_args *>(args)};
    cudaError_t code = cudaLaunchKernelExC(&launch, (const void *)kernel, parameters);
#endif
    CUDA_CALL(c, code, name);
    return SADMM_OK;
}

sadmm_status CUDA(launch)(struct sadmm_context *c, cuda_kernel kernel, const char *name, int64_t blocks,
                          const cuda_args *args, struct sadmm_error *error)
{
    return CUDA(launch_of)(c, kernel, name, blocks, THREADS, args, error);
}

sadmm_status CUDA(launch_partition)(struct sadmm_context *c, cuda_kernel kernel, const char *name,
                                    const struct cuda_partition *partition, const cuda_args *args,
                                    struct sadmm_error *error)
{
    return launch_configured(c, kernel, name, partition, uses_pdl(c), args, error);
}

static sadmm_status launch_blocks(struct sadmm_context *c, cuda_kernel kernel, const char *name, int64_t blocks,
                                  int threads, size_t shared, bool pdl, const cuda_args *args,
                                  struct sadmm_error *error)
{
    struct cuda_partition plain = {};
    if (blocks <= 0) return SADMM_OK;
    plain.parts = (int32_t)blocks;
    plain.cluster = 1;
    plain.threads = threads;
    plain.shared = shared;
    return launch_configured(c, kernel, name, &plain, pdl, args, error);
}

sadmm_status CUDA(launch_of)(struct sadmm_context *c, cuda_kernel kernel, const char *name, int64_t blocks, int threads,
                             const cuda_args *args, struct sadmm_error *error)
{
    return launch_blocks(c, kernel, name, blocks, threads, 0, all_use_pdl(c), args, error);
}

sadmm_status CUDA(launch_shared)(struct sadmm_context *c, cuda_kernel kernel, const char *name, int64_t blocks,
                                 int threads, size_t shared, const cuda_args *args, struct sadmm_error *error)
{
    return launch_blocks(c, kernel, name, blocks, threads, shared, all_use_pdl(c), args, error);
}

sadmm_status CUDA(launch_pdl)(struct sadmm_context *c, cuda_kernel kernel, const char *name, int64_t blocks,
                              int threads, const cuda_args *args, struct sadmm_error *error)
{
    return launch_blocks(c, kernel, name, blocks, threads, 0, uses_pdl(c), args, error);
}

sadmm_status CUDA(launch_without_pdl)(struct sadmm_context *c, cuda_kernel kernel, const char *name, int64_t blocks,
                                      int threads, const cuda_args *args, struct sadmm_error *error)
{
    return launch_blocks(c, kernel, name, blocks, threads, 0, false, args, error);
}
