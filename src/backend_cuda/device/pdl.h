/* Programmatic dependent launch (PDL): in a step's graph a kernel starts on its multiprocessors while the one before it
 * ends (device/context.h says which).
 *
 * A kernel that is launched so waits (pdl_wait) before it reads anything that the kernel before it writes. What
 * that one does not write may be fetched earlier: the kernels before it have ended, since it has waited itself. It
 * waits in any case, also where it has nothing to do: the kernel after it waits for this one alone. */
#ifndef SADMM_CUDA_DEVICE_PDL_H
#define SADMM_CUDA_DEVICE_PDL_H

#include <stdint.h>

#include <cuda_runtime.h>

#define PDL_ARCH 900 /* of the first devices that do this */

/* Wait until the kernels enqueued before have ended. */
static __device__ __forceinline__ void pdl_wait(void)
{
#if !defined(SADMM_CUDA_EMULATED) && __CUDA_ARCH__ >= PDL_ARCH
    asm volatile("griddepcontrol.wait;" ::: "memory");
#endif
}

/* The next kernel may begin, once all blocks of this one have come here, and run up to its own wait. To be called after
 * this one's wait. */
static __device__ __forceinline__ void pdl_trigger(void)
{
#if !defined(SADMM_CUDA_EMULATED) && __CUDA_ARCH__ >= PDL_ARCH
    asm volatile("griddepcontrol.launch_dependents;");
#endif
}

/* In small worlds all kernels are launched with PDL, except first sweeps of tier STREAM (launch_without_pdl). In others
 * blocks come in waves, and those of the next kernel would take their room. */
enum { MOST_BODIES_ALL_PDL = 16384 };
static __host__ __device__ __forceinline__ bool all_pdl(int32_t bodies) { return bodies <= MOST_BODIES_ALL_PDL; }
static __device__ __forceinline__ void pdl_trigger(int32_t bodies)
{
    if (all_pdl(bodies)) pdl_trigger();
}

/* Of kernels that use PDL in small worlds alone: what they begin with. In others they do neither, for what
 * that takes counts where blocks are many and short: with 100,000 bodies 32 in place of 23 us for the step's start, 33
 * in place of 22 for its contacts. */
static __device__ __forceinline__ void pdl_wait_only_if(bool pdl)
{
    if (pdl) pdl_wait();
}
static __device__ __forceinline__ void pdl_wait_if(bool pdl)
{
    if (!pdl) return;
    pdl_wait();
    pdl_trigger();
}

#ifndef SADMM_CUDA_EMULATED
static inline cudaLaunchAttribute pdl_attribute(void)
{
    cudaLaunchAttribute pdl = {};
    pdl.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    pdl.val.programmaticStreamSerializationAllowed = 1;
    return pdl;
}

/* A launch; pdl: with programmatic dependent launch. */
static inline cudaError_t launch_on(cudaStream_t stream, bool pdl, const void *kernel, dim3 blocks, dim3 threads,
                                    size_t shared, void **parameters)
{
    cudaLaunchAttribute attribute = pdl_attribute();
    cudaLaunchConfig_t launch = {};
    launch.gridDim = blocks;
    launch.blockDim = threads;
    launch.dynamicSmemBytes = shared;
    launch.stream = stream;
    launch.attrs = &attribute;
    launch.numAttrs = pdl;
    return cudaLaunchKernelExC(&launch, kernel, parameters);
}
#endif

#endif
