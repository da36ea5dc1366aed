/* Which islands and bodies the dense contact solve takes (ncp_island.h). */
#ifndef SADMM_CUDA_STEP_NCP_BODIES_H
#define SADMM_CUDA_STEP_NCP_BODIES_H

#include "world.h"

enum {
    NCP_BODIES = 128,   /* of an island, at most; */
    NCP_PARTS = 32,     /* articulations; */
    NCP_CONTACTS = 128, /* points; */
    NCP_NUMBERS = 256   /* numbers of the dense problem */
};

/* Are all islands left to the iterations? Where some are seen from their supports, or are pushed apart. */
static __device__ __forceinline__ bool ncp_is_left(const cuda_view &v)
{
    return v.model.live->abort_code || is_supported(v) || (v.push.planned && v.push.due[PUSH_DUE]);
}

static __device__ __forceinline__ mat3 inertia_of(const struct cuda_articulation_body &body)
{
    mat3 inertia;
    inertia.r[0] = v3(body.inertia[0], body.inertia[3], body.inertia[4]);
    inertia.r[1] = v3(body.inertia[3], body.inertia[1], body.inertia[5]);
    inertia.r[2] = v3(body.inertia[4], body.inertia[5], body.inertia[2]);
    return inertia;
}

#endif
