/* For sources whose formulas are in double whatever the solver's precision (solver_real): assembly, penalties and
 * results run once or a few times a step, from raw doubles, through the same inline functions as core and the literal
 * backend. */
#ifndef SADMM_CUDA_DEVICE_DOUBLE_H
#define SADMM_CUDA_DEVICE_DOUBLE_H

#include "context.h"

#undef SADMM_REAL /* math/real.h: double */
#include "core/math/dense6.h"
#include "core/model/system_math.h"

static __device__ __forceinline__ int32_t thread_index(void)
{
    return (int32_t)(blockIdx.x * (unsigned)THREADS + threadIdx.x);
}

static inline __device__ double solver_friction(const model_view &model, double mu)
{
    return model.fast ? contact_friction_inside(mu, SOLVER_EPSILON) : mu;
}

#endif
