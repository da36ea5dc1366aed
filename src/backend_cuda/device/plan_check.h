/* Is a step what it was planned for? (device/step.h) */
#ifndef SADMM_CUDA_DEVICE_PLAN_CHECK_H
#define SADMM_CUDA_DEVICE_PLAN_CHECK_H

#include "context.h"
#include "core/solve/plan.h"

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
static __device__ __forceinline__ void stamp_assembled(const cuda_step_view &step)
{
    if (blockIdx.x == 0 && threadIdx.x == 0) step.control->stamps[STAMP_ASSEMBLED] = nanoseconds();
}

/* Is the step what it was planned for? joints: what they are like is known. */
static __device__ __forceinline__ bool as_planned(const model_view &model, const cuda_step_view &step,
                                                  bool joints_known = true)
{
    const struct cuda_graph_statistics *statistics = model.statistics;
    const struct cuda_step_guess guess = step.guess;
    const int32_t pairs = model.live->pairs, rows = plan_contact_rows(pairs, statistics->rough);
    const bool joints = guess.rows >= 0;
    if (joints && !joints_known) return rows == guess.contact_rows && statistics->point_slots <= guess.point_slots;
    const int32_t constraints = joints ? step.control->joints.constraints : 0;
    const int32_t warm =
        plan_mostly_warm(pairs + constraints, statistics->warm + (joints ? step.control->joints.warm : 0));
    return rows == guess.contact_rows && statistics->point_slots <= guess.point_slots &&
           (guess.warm < 0 || warm == guess.warm) && (!joints || guess.rows == (constraints > 0)) &&
           !(guess.apart && step.control->joints.together);
}

/* The grid's first thread compares the statistics with the plan; what runs now and what was assembled is of no use when
 * they differ. Scalars are 0 for the iterations (enum cuda_scalar). */
static __device__ __forceinline__ void check_plan(const model_view &model, const iteration_view &iteration,
                                                  const cuda_step_view &step)
{
    if (blockIdx.x > 0 || threadIdx.x > 0) return;
    stamp_assembled(step);
    iteration.residual[0] = iteration.residual[1] = 0;
    *iteration.barrier = 0;
    /* joints that are apart may still be at it */
    if (!model.live->abort_code && !as_planned(model, step, !step.guess.apart)) model.live->abort_code = ABORT_PLAN;
}

#endif
