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

static __device__ __forceinline__ void add_pair_wrench(const contact_view &contacts, const raw_view &raw, int32_t p,
                                                       int side, double per_dt, double wrench[6])
{
    const struct sadmm_contact_pair *pair = &raw.pairs[p];
    for (int32_t k = 0; k < pair->count; ++k) {
        const struct sadmm_contact_point *point = &raw.points[pair->first + k];
        vec3 f = point_impulse(contacts, p, k), m = v3_cross(v3_load(side ? point->arm_b : point->arm_a), f);
        double sign = side ? per_dt : -per_dt;
        wrench[0] += sign * f.x, wrench[1] += sign * f.y, wrench[2] += sign * f.z;
        wrench[3] += sign * m.x, wrench[4] += sign * m.y, wrench[5] += sign * m.z;
    }
}

/* R: (12) with lambda = -u, J^T lambda / dt over the sides [begin, end) of a body, by eight lanes that take every
 * eighth side each; the sum is in all of them. per_dt: 1 / dt. Every lane of the warp comes here. */
static __device__ __forceinline__ void contact_wrench(const graph_view &graph, const contact_view &contacts,
                                                      const raw_view &raw, int32_t begin, int32_t end, int32_t lane,
                                                      double per_dt, double wrench[6])
{
    for (int k = 0; k < 6; ++k) wrench[k] = 0;
    for (int32_t at = begin + lane; at < end; at += LANES) {
        int32_t record = graph.incident[at] / 2, side = graph.incident[at] & 1;
        if (record < contacts.pair_capacity)
            add_pair_wrench(contacts, raw, record, side, per_dt, wrench); /* contacts given by geometry only */
    }
#pragma unroll
    for (int o = 1; o < LANES; o *= 2)
#pragma unroll
        for (int k = 0; k < 6; ++k) wrench[k] += __shfl_xor_sync(0xffffffffu, wrench[k], o);
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
