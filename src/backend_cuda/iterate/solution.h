/* What a body or a pair gives back, in double. */
#ifndef SADMM_CUDA_ITERATE_SOLUTION_H
#define SADMM_CUDA_ITERATE_SOLUTION_H

#include "backend_cuda/device/double.h"
#include "backend_cuda/device/wide.h"
#include "core/model/body_trapezoid.h"
#include "core/model/spin.h"

/* Multiplier of a point as a world vector on b. */
static __device__ __forceinline__ vec3 point_impulse(const contact_view &contacts, int32_t p, int32_t k)
{
    const solver_real *lambda = contacts.lambda + point_slot(contacts, p, k);
    return v3((double)lambda[0], (double)lambda[contacts.lambda_stride], (double)lambda[2 * contacts.lambda_stride]);
}

static __device__ __forceinline__ const double *halfway_of(const cuda_view &v, int32_t i)
{
    return row_at(v.bodies.halfway, (size_t)i);
}

/* Q: where a body for which `velocity` is solved gets to by that less its trapezoid correction (math/trapezoid.h):
 * position, orientation, and velocity at the end. halfway: its orientation then (spin.h); dt: the settings', fetched
 * early. */
enum { PLACE = 13 };
static __device__ __forceinline__ void move_body(const struct sadmm_rigid *body, const double halfway[4],
                                                 const double velocity[6], double dt, const double gravity[3],
                                                 enum trapezoid_kind kind, double place[PLACE])
{
    double correction[6] = {}, mean[6];
    if (kind == TRAPEZOID_SHARED) trapezoid_shared(gravity, dt, correction);
    /* turned by it only where moments are equal */
    if (kind == TRAPEZOID_OWN) body_trapezoid(body, body->velocity, velocity, correction);
    for (int k = 0; k < 6; ++k) mean[k] = velocity[k] - correction[k];
    spin_move_from(body, halfway, velocity, mean, kind != TRAPEZOID_OWN, dt, place, place + 3, place + 7);
}

/* Once, for both places. */
static __device__ __noinline__ quat turned_by(quat q, vec3 w, double dt) { return rigid_turn(q, w, dt); }

/* Both places of a body that rests or moves by itself, as move_body finds them: one tumble is enough. */
static __device__ __forceinline__ void move_body_both(const struct sadmm_rigid *body, const double halfway[4],
                                                      const double velocity[6], double dt, double stays[PLACE],
                                                      double own[PLACE])
{
    const vec3 x = v3_load(body->position);
    const quat q = q_load(body->orientation), whole = turned_by(q, v3_load(velocity + 3), dt);
    double correction[6], mean[6];
    body_trapezoid(body, body->velocity, velocity, correction);
    for (int k = 0; k < 6; ++k) {
        mean[k] = velocity[k] - correction[k];
        stays[7 + k] = own[7 + k] = velocity[k];
    }
    v3_store(rigid_move(x, v3_load(velocity), dt), stays);
    v3_store(rigid_move(x, v3_load(mean), dt), own);
    q_store(whole, stays + 3);
    if (rigid_is_isotropic(v3_load(body->inertia))) {
        q_store(turned_by(q, v3_load(mean + 3), dt), own + 3);
        return;
    }
    const struct rigid_spin end = spin_end(body, q_load(halfway), velocity + 3, dt);
    q_store(end.orientation, own + 3);
    v3_store(end.angular, own + 10);
    v3_store(spin_turned_whole(end, whole).angular, stays + 10);
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
