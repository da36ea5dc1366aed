/* What a body or a pair gives back, in double. */
#ifndef SADMM_CUDA_ITERATE_SOLUTION_H
#define SADMM_CUDA_ITERATE_SOLUTION_H

#include "backend_cuda/device/double.h"
#include "core/math/lead.h"

/* Multiplier of a point as a world vector on b. */
static __device__ __forceinline__ vec3 point_impulse(const contact_view &contacts, int32_t p, int32_t k)
{
    const solver_real *lambda = contacts.lambda + point_slot(contacts, p, k);
    return v3((double)lambda[0], (double)lambda[contacts.lambda_stride], (double)lambda[2 * contacts.lambda_stride]);
}

/* Q: a body that ends with velocity `v`, moved with that less its lead (math/lead.h), by the bits of its island and of
 * itself. dt: the settings', fetched early. */
static __device__ __forceinline__ void move_body(const struct sadmm_rigid *body, const solver_real v[6], double dt,
                                                 const double gravity[3], int island, int own, double position[3],
                                                 double orientation[4], double velocity[6])
{
    const enum lead_kind kind = lead_kind_of(island, own);
    double lead[6] = {}, mean[6];
    for (int k = 0; k < 6; ++k) velocity[k] = (double)v[k];
    if (kind == LEAD_SHARED) lead_shared(gravity, dt, lead);
    if (kind == LEAD_OWN) lead_own(body->velocity, velocity, rigid_is_isotropic(v3_load(body->inertia)), lead);
    for (int k = 0; k < 6; ++k) mean[k] = velocity[k] - lead[k];
    v3_store(rigid_move(v3_load(body->position), v3_load(mean), dt), position);
    q_store(rigid_turn(q_load(body->orientation), v3_load(mean + 3), dt), orientation);
}

static __device__ __forceinline__ void store_wrench(const double wrench[6], int32_t lane, double *out)
{
#pragma unroll
    for (int k = 0; k < 6; ++k)
        if (k == lane) out[k] = wrench[k];
}

/* The mean over the sub-steps of a step, once the last one has come. */
static __device__ __forceinline__ void add_wrench(const double wrench[6], int32_t lane, int32_t substep,
                                                  int32_t substeps, double *out)
{
#pragma unroll
    for (int k = 0; k < 6; ++k) {
        if (k != lane) continue;
        const double sum = substep > 0 ? out[k] + wrench[k] : wrench[k];
        out[k] = substeps > 1 && substep + 1 == substeps ? sum / substeps : sum;
    }
}

#endif
