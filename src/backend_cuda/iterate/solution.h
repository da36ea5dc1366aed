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

/* Q: where a body that ends with `velocity` gets to by that less its lead (math/lead.h): position, orientation. dt: the
 * settings', fetched early. */
enum { PLACE = 7 };
static __device__ __forceinline__ void move_body(const struct sadmm_rigid *body, const double velocity[6], double dt,
                                                 const double gravity[3], enum lead_kind kind, double place[PLACE])
{
    double lead[6] = {}, mean[6];
    if (kind == LEAD_SHARED) lead_shared(gravity, dt, lead);
    if (kind == LEAD_OWN) lead_own(body->velocity, velocity, rigid_is_isotropic(v3_load(body->inertia)), lead);
    for (int k = 0; k < 6; ++k) mean[k] = velocity[k] - lead[k];
    v3_store(rigid_move(v3_load(body->position), v3_load(mean), dt), place);
    q_store(rigid_turn(q_load(body->orientation), v3_load(mean + 3), dt), place + 3);
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
