/* The method `fast`: islands that have more energy than they may (math/limit.h, iterate/limit.cu). */
#ifndef SADMM_CUDA_ITERATE_SLOW_H
#define SADMM_CUDA_ITERATE_SLOW_H

#include "backend_cuda/device/lanes.h"

#include "core/math/limit.h"

/* Has a body more energy than its free motion, `free`, or, for `under_iterated` iterations, does it bounce? `velocity`,
 * `b` and `a`: the lane's components and row of A (three numbers of it for rigid bodies). `speaks`: one lane of each
 * body, the others say no. Every lane of the warp comes here. */
template <int SIZE>
static __device__ __forceinline__ bool suspect_body(bool under_iterated, bool speaks, double free, double velocity,
                                                    double b, const double (&a)[SIZE])
{
    const double now = dot_lanes(velocity, product(velocity, a)) / 2,
                 along = under_iterated ? dot_lanes(velocity, b) / 2 : 0;
    return speaks && (limit_suspects(now, free) || (under_iterated && limit_bounces(now, free, along, SOLVER_EPSILON)));
}

/* The factor of body i's velocities. */
static __device__ __forceinline__ solver_real slow_down(const graph_view &graph, const island_view &islands, int32_t i)
{
    return *islands.limited > 0 ? (solver_real)islands.info[graph.label[i]].slow_down : (solver_real)1;
}

#endif
