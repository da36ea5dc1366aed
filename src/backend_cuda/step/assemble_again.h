/* Bodies that joints stiffen by forces that the block solve or the dense one has found (core/model/stiffening.h). */
#ifndef SADMM_CUDA_STEP_ASSEMBLE_AGAIN_H
#define SADMM_CUDA_STEP_ASSEMBLE_AGAIN_H

#include "backend_cuda/assemble/body.h"

/* A body whose inertia is another one by the forces that have been found. */
static __device__ __noinline__ void assemble_again(const cuda_view &v, int32_t i)
{
    const struct cuda_articulation_body body = stiffened_body(v, i);
    double A[36], b[6];
    v.joints.bodies[i] = body;
    if (v.joints.apart) return; /* it does not iterate */
    take_articulation_body(body, A, b);
    if (v.model.fast || v.step.limits) put_body<true>(v, i, A, b);
    else put_body<false>(v, i, A, b);
}

#endif
