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

/* The iterations have ended. */
static __device__ __forceinline__ void stamp_solved(const cuda_step_view &step)
{
    step.control->stamps[STAMP_SOLVED] = nanoseconds();
}

/* Are contacts what the step was planned for? */
static __device__ __forceinline__ bool contacts_as_planned(const model_view &model, const cuda_step_view &step)
{
    const struct cuda_graph_statistics *statistics = model.statistics;
    const int32_t rows = step.speculation.copies ? (int32_t)PLAN_CONTACT_ROWS_OF_COPIES
                                                 : plan_contact_rows(model.live->pairs, statistics->rough);
    return rows == step.speculation.contact_rows &&
           statistics->point_slots <= step.speculation.point_slots;
}
/* Is the step? Known once its joints are. */
static __device__ __forceinline__ bool as_planned(const model_view &model, const cuda_step_view &step)
{
    const struct cuda_graph_statistics *statistics = model.statistics;
    const struct cuda_step_speculation speculation = step.speculation;
    const int32_t pairs = model.live->pairs;
    const bool joints = speculation.rows >= 0;
    const int32_t constraints = joints ? step.control->joints.constraints : 0;
    const int32_t warm =
        plan_mostly_warm(pairs + constraints, statistics->warm + (joints ? step.control->joints.warm : 0));
    return contacts_as_planned(model, step) && (speculation.warm < 0 || warm == speculation.warm) &&
           (speculation.cold || !statistics->cold) &&
           (!joints || speculation.rows == (constraints > 0)) && !(speculation.apart && step.control->joints.together);
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
    /* a branch beside this one may still count joints that are apart: finish, turn and commit read them */
    const bool planned = step.speculation.apart ? contacts_as_planned(model, step) : as_planned(model, step);
    if (!model.live->abort_code && !planned) model.live->abort_code = ABORT_PLAN;
}

#endif
