/* How the CUDA backend's fused entry runs (device/view.h), and how tests choose it. */
#ifndef SADMM_CUDA_DEVICE_TIER_H
#define SADMM_CUDA_DEVICE_TIER_H

#include "core/solve/kernels.h"

#ifdef __cplusplus
extern "C" {
#endif

enum sadmm_cuda_tier {
    SADMM_CUDA_TIER_AUTO = 0,
    SADMM_CUDA_TIER_BLOCK,   /* islands packed into thread blocks */
    SADMM_CUDA_TIER_CLUSTER, /* islands packed into clusters of thread blocks */
    SADMM_CUDA_TIER_GRID,    /* one cooperative launch with grid barriers */
    SADMM_CUDA_TIER_STREAM   /* two kernels an iteration */
};

/* From the next begin on. A begin whose system does not fit the tier fails with SADMM_ERROR_UNSUPPORTED. `kernels`: the
 * table that made the context. */
void sadmm_cuda_force_tier(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                           enum sadmm_cuda_tier tier);
/* Likewise: blocks a cluster (2, 4, 8 or 16) where a begin chooses CLUSTER; 0: the one that is likely the fastest. */
void sadmm_cuda_force_cluster(const struct sadmm_kernels *kernels, struct sadmm_context *context, int blocks);
/* The tier the last begin chose, and its blocks (0 for STREAM). */
enum sadmm_cuda_tier sadmm_cuda_tier_of(const struct sadmm_kernels *kernels, const struct sadmm_context *context,
                                        int32_t *blocks);

/* Whole steps: the first capacities for candidates and points; 0: by the number of shapes. Before the world's first
 * step. */
void sadmm_cuda_tune_capacities(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                                int64_t first_capacity);

#ifdef __cplusplus
}
#endif
#endif
