/* What a test may ask of the emulated device (cuda_runtime.h beside this), and its two kernel tables. */
#ifndef SADMM_EMULATION_CONTROL_H
#define SADMM_EMULATION_CONTROL_H

#include "core/solve/kernels.h"
#include "backend_cuda/device/tier.h"

#ifdef __cplusplus
extern "C" {
#endif

extern int cuda_emulation_descending;   /* run blocks and threads from the last one to the first */
extern long cuda_emulation_calls_left;  /* runtime calls that succeed before one fails; < 0: none fails */
extern int cuda_emulation_lost;         /* every runtime call fails */
extern long cuda_emulation_allocations; /* device and pinned blocks, streams and graphs alive */
extern long cuda_emulation_graphs_made,
    cuda_emulation_waits; /* instantiations; calls that wait for a stream or an event */

extern const struct sadmm_kernels cuda_emulation_tables[2]; /* by precision */
void cuda_emulation_force_tier(const struct sadmm_kernels *, struct sadmm_context *, enum sadmm_cuda_tier);
void cuda_emulation_force_cluster(const struct sadmm_kernels *, struct sadmm_context *, int blocks);
enum sadmm_cuda_tier cuda_emulation_tier_of(const struct sadmm_kernels *, const struct sadmm_context *,
                                            int32_t *blocks);

void cuda_emulation_tune_capacities(const struct sadmm_kernels *, struct sadmm_context *, int64_t first_capacity);

#ifdef __cplusplus
}
#endif
#endif
