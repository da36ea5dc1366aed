/* Programmatic dependent launch: in a step's graph a kernel comes to its multiprocessors while the one before it ends
 * (device/context.h says which).
 *
 * A kernel that is launched so waits (wait_for_stream) before it reads anything that the kernel before it writes. What
 * that one does not write may be fetched earlier: the kernels before it have ended, since it has waited itself. It
 * waits in any case, also where it has nothing to do: the kernel after it waits for this one alone. */
#ifndef SADMM_CUDA_DEVICE_EARLY_H
#define SADMM_CUDA_DEVICE_EARLY_H

#include <stdint.h>

#include <cuda_runtime.h>

#define EARLY_ARCH 900 /* of the first devices that do this */

/* Wait until the kernels enqueued before have ended. */
static __device__ __forceinline__ void wait_for_stream(void)
{
#if !defined(SADMM_CUDA_EMULATED) && __CUDA_ARCH__ >= EARLY_ARCH
    asm volatile("griddepcontrol.wait;" ::: "memory");
#endif
}

/* The next kernel may begin, once all blocks of this one have come here, and run up to its own wait. To be called after
 * this one's wait. */
static __device__ __forceinline__ void let_next_begin(void)
{
#if !defined(SADMM_CUDA_EMULATED) && __CUDA_ARCH__ >= EARLY_ARCH
    asm volatile("griddepcontrol.launch_dependents;");
#endif
}

/* In small worlds all kernels are launched early, but for first sweeps of tier STREAM (launch_late). In others blocks
 * come in waves, and those of the next kernel would take their room. */
enum { MOST_BODIES_ALL_EARLY = 16384 };
static __host__ __device__ __forceinline__ bool all_early(int32_t bodies) { return bodies <= MOST_BODIES_ALL_EARLY; }
static __device__ __forceinline__ void let_next_begin(int32_t bodies)
{
    if (all_early(bodies)) let_next_begin();
}

/* Of kernels that are launched early in small worlds alone: what they begin with. In others they do neither, for what
 * that takes counts where blocks are many and short: with 100,000 bodies 32 in place of 23 us for the step's start, 33 in
 * place of 22 for its contacts. */
static __device__ __forceinline__ void wait_if(bool early)
{
    if (early) wait_for_stream();
}
static __device__ __forceinline__ void follow_if(bool early)
{
    if (!early) return;
    wait_for_stream();
    let_next_begin();
}

#ifndef SADMM_CUDA_EMULATED
static inline cudaLaunchAttribute early_attribute(void)
{
    cudaLaunchAttribute early = {};
    early.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    early.val.programmaticStreamSerializationAllowed = 1;
    return early;
}

/* A launch; early: like those. */
static inline cudaError_t launch_on(cudaStream_t stream, bool early, const void *kernel, dim3 blocks, dim3 threads,
                                    size_t shared, void **parameters)
{
    cudaLaunchAttribute attribute = early_attribute();
    cudaLaunchConfig_t launch = {};
    launch.gridDim = blocks;
    launch.blockDim = threads;
    launch.dynamicSmemBytes = shared;
    launch.stream = stream;
    launch.attrs = &attribute;
    launch.numAttrs = early;
    return cudaLaunchKernelExC(&launch, kernel, parameters);
}
#endif

#endif
