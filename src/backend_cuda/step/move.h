/* Bodies as a step ends: moved by their velocity less their trapezoid correction (math/trapezoid.h). What holds for an
 * island is known once all of its bodies have been visited. So a body is moved as if its island were anchored by
 * friction and no contact would penetrate, which is so wherever bodies rest; the next kernel moves those again for
 * which that was wrong. */
#ifndef SADMM_CUDA_STEP_MOVE_H
#define SADMM_CUDA_STEP_MOVE_H

#include "backend_cuda/device/wide.h"
#include "backend_cuda/iterate/slow.h"
#include "backend_cuda/iterate/solution.h"
#include "core/model/extrapolation.h"
#include "core/model/joint_trapezoid.h"

/* Bits of an island where nobody has said anything else. */
enum { TOUCH_AS_A_RULE = TOUCH_INNER | TOUCH_FRICTION };

static __device__ __forceinline__ bool finite_numbers(const double *x, int count)
{
    double sum = 0;
    for (int k = 0; k < count; ++k) sum += x[k] - x[k];
    return sum == 0;
}

/* Is its island solved directly (ncp_island.h)? Where there are such islands. */
static __device__ __forceinline__ bool is_solved(const cuda_view &v, int32_t body)
{
    return v.ncp.solved[v.graph.label[body]] != 0;
}

/* A body as the step began. */
struct body_before {
    struct sadmm_rigid body;
    struct sadmm_extrapolation extrapolation;
};

static __device__ __forceinline__ body_before fetch_body(const cuda_step_view &step, int32_t i)
{
    const body_before before = {*wide_at(step.before, (size_t)i), step.extrapolation_before[i]};
    return before;
}

/* What joints say of a body's island is at: its label; or, where they are solved apart, its part's first body. */
static __device__ __forceinline__ int32_t articulation_label(const cuda_view &v, int32_t body)
{
    return v.joints.apart ? v.joints.is_articulated[body] - 1 : v.graph.label[body];
}

/* Do its joints move it, beside the rest of the step (step/joints.cu)? Known once they have. */
static __device__ __forceinline__ bool moves_apart(const cuda_view &v, int32_t body)
{
    return v.joints.apart && v.joints.is_articulated[body] &&
           (v.joints.touch[articulation_label(v, body)] & ISLAND_ARTICULATED);
}

/* v of body i as the step ends. */
static __device__ __forceinline__ void load_end_velocity(const cuda_view &v, int32_t i, double wide[6])
{
    solver_real velocity[6];
    if (v.step.limits) end_velocity(v, i, velocity);
    else
        for (int k = 0; k < 6; ++k) velocity[k] = row_at(v.bodies.state, (size_t)i)[k];
    for (int k = 0; k < 6; ++k) wide[k] = (double)velocity[k];
    if (!is_supported(v)) return;
    for (int k = 0; k < 6; ++k) wide[k] += v.raw.system.support_motion[6 * (size_t)i + (size_t)k];
}

/* Body i goes to `place`; mean: by the mean of its velocities, if it was not hit (body_moves_by_mean). */
static __device__ __forceinline__ void store_moved(const cuda_view &v, int32_t i, const body_before &before,
                                                   const double place[PLACE], bool mean, double dt)
{
    struct sadmm_extrapolation extrapolation = before.extrapolation;
    struct sadmm_rigid next = before.body;
    for (int k = 0; k < 3; ++k) next.position[k] = place[k];
    for (int k = 0; k < 4; ++k) next.orientation[k] = place[3 + k];
    for (int k = 0; k < 6; ++k) next.velocity[k] = place[7 + k];
    rolling_forget(&next);
    next.was_hit = 0;
    next.mean = mean && !before.body.was_hit;
    extrapolation_keep(&extrapolation, &before.body, &next, dt);
    store_first<offsetof(struct sadmm_rigid, owed)>(next, &v.step.after[i]); /* nothing is owed yet */
    v.step.extrapolation_after[i] = extrapolation;
}

#endif
