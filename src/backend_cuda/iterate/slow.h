/* The method `fast`: islands that have more energy than they may (math/energy_limit.h, iterate/energy_limit.cu). */
#ifndef SADMM_CUDA_ITERATE_SLOW_H
#define SADMM_CUDA_ITERATE_SLOW_H

#include "backend_cuda/device/lanes.h"
#include "backend_cuda/device/wide.h"

#include "core/math/energy_limit.h"

/* Has a body more energy than its free motion, `free`, or, where `rebounds` is set (in every lane or none) and its
 * island starts `warm`, does it rebound? `velocity`, `b` and `a`: the lane's components and row of A (three numbers of
 * it for rigid bodies). `speaks`: one lane of each body, the others say no. Every lane of the warp comes here. */
template <int SIZE>
static __device__ __forceinline__ bool is_candidate(bool rebounds, bool warm, bool speaks, double free,
                                                    double velocity, double b, const double (&a)[SIZE])
{
    const double now = dot_lanes(velocity, product(velocity, a)) / 2,
                 along = rebounds ? dot_lanes(velocity, b) / 2 : 0;
    return speaks &&
           (energy_limit_exceeded(now, free) ||
            (rebounds && warm && energy_limit_rebounds(now, free, along, SOLVER_EPSILON)));
}

/* Where a body is from the one that names its island. */
static __device__ __forceinline__ void body_place(const cuda_view &v, int32_t body, int32_t label, double d[3])
{
    const struct sadmm_rigid *rigid = v.raw.system.rigid;
#pragma unroll
    for (int k = 0; k < 3; ++k) d[k] = rigid[body].position[k] - rigid[label].position[k];
}

/* The factor of body i's velocities, where its island is anchored. */
static __device__ __forceinline__ solver_real slow_down(const graph_view &graph, const island_view &islands, int32_t i)
{
    return *islands.limited > 0 ? (solver_real)islands.info[graph.label[i]].slow_down : (solver_real)1;
}

/* v of body i as a step ends: what iterations have left, slowed down and with its momentum restored. */
static __device__ __forceinline__ void end_velocity(const cuda_view &v, int32_t i, solver_real velocity[6])
{
    const solver_real *state = row_at(v.bodies.state, (size_t)i);
    const int32_t moved = *v.islands.moved; /* on its way with the other */
    const solver_real slow = slow_down(v.graph, v.islands, i);
#pragma unroll
    for (int k = 0; k < 6; ++k) velocity[k] = state[k] * slow;
    if (!moved) return;
    const int32_t label = v.graph.label[i];
    const cuda_island *island = &v.islands.info[label];
    if (island->anchored) return;
    const double *motion = v.islands.motions + (size_t)v.graph.slot_of[label] * MOTION_TERMS;
    double d[3], wide[6];
    body_place(v, i, label, d);
    for (int k = 0; k < 6; ++k) wide[k] = (double)state[k];
    momentum_move(motion, island->slow_down, d, wide);
    for (int k = 0; k < 6; ++k) velocity[k] = (solver_real)wide[k];
}

#endif
