/* Is a step what it was planned for? (step/step.h) */
#ifndef SADMM_CUDA_STEP_PLAN_CHECK_H
#define SADMM_CUDA_STEP_PLAN_CHECK_H

#include "backend_cuda/device/context.h"

/* The device's clock. */
static __device__ __forceinline__ unsigned long long nanoseconds(void)
{
#ifdef SADMM_CUDA_EMULATED
    return 0;
#else
    unsigned long long now;
    asm volatile("mov.u64 %0, %%globaltimer;" : "=l"(now));
    return now;
#endif
}

/* Assembly ends here. The grid's first thread says so. */
static __device__ __forceinline__ void stamp_assembled(const cuda_view &v)
{
    if (blockIdx.x == 0 && threadIdx.x == 0) v.step.control->stamps[STAMP_ASSEMBLED] = nanoseconds();
}

/* Is the step what it was planned for? */
static __device__ __forceinline__ bool as_planned(const cuda_view &v)
{
    const struct cuda_graph_statistics *statistics = v.statistics;
    const struct cuda_step_guess guess = v.step.guess;
    const int32_t pairs = v.live->pairs, rows = pairs == 0 ? 0 : statistics->rough > 0 ? 3 : 1;
    const int32_t warm = pairs > 0 && 2 * (int64_t)statistics->warm >= pairs;
    return rows == guess.contact_rows && statistics->point_slots <= guess.point_slots &&
           (guess.warm < 0 || warm == guess.warm);
}

/* The grid's first thread compares the statistics with the plan; what runs now and what was assembled is of no use when
 * they differ. Scalars are 0 for the iterations (enum cuda_scalar). */
static __device__ __forceinline__ void check_plan(const cuda_view &v)
{
    if (blockIdx.x > 0 || threadIdx.x > 0) return;
    stamp_assembled(v);
    v.residual[0] = v.residual[1] = 0;
    *v.barrier = 0;
    if (!v.live->abort_code && !as_planned(v)) v.live->abort_code = ABORT_PLAN;
}

#endif
