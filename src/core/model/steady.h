/* What is remembered of a body from step to step: the velocity a solve starts from, and whether its pose was set.
 *
 * A contact that slides holds its impulse at the cone's edge whatever the velocity does, so a step's change of speed
 * has to come from the momentum balance alone, by a factor m / (m + J^T beta J) an iteration: a few per cent of it are
 * still missing after a hundred. Where the last steps changed a body's velocity by the same amount (sliding under
 * gravity or friction), the next one starts from that change and nothing is missing. Only after three such steps: with
 * few iterations velocities jitter, and following the jitter would feed it. What stays the same is the acceleration: a
 * change counts by the length of its step. A pose that is set ends a streak: the body is where other contacts are.
 */
#ifndef SADMM_CORE_MODEL_STEADY_H
#define SADMM_CORE_MODEL_STEADY_H

#include "core/math/step.h"
#include "rolling.h"

enum { STEADY_STEPS = 3 };
/* Changes that differ by less than this share are the same. */
#define STEADY_SHARE 0.25

/* A component of it, from the velocity's; ratio: step_ratio. */
SADMM_INLINE double steady_velocity(double velocity, int32_t streak, double change, double ratio)
{
    return velocity + (streak >= STEADY_STEPS ? ratio * change : 0);
}

SADMM_INLINE void steady_start(const struct sadmm_rigid *body, const struct sadmm_steady *steady, double dt,
                               double velocity[6])
{
    const double ratio = step_ratio(dt, steady->dt);
    for (int k = 0; k < 6; ++k)
        velocity[k] = steady_velocity(body->velocity[k], steady->streak[k / 3], steady->change[k], ratio);
}

/* Components of an orientation that was read and is set again: it is made a unit quaternion once more. */
#define STEADY_ROUNDING (8 * DBL_EPSILON)

/* A pose is set before the next step; false: the one that the body has already, which changes nothing. */
SADMM_INLINE bool steady_place(struct sadmm_steady *steady, const struct sadmm_rigid *body, const double position[3],
                               const double orientation[4])
{
    bool same = true;
    for (int k = 0; k < 3; ++k) same = same && position[k] == body->position[k];
    for (int k = 0; k < 4; ++k) same = same && fabs(orientation[k] - body->orientation[k]) <= STEADY_ROUNDING;
    if (same) return false;
    ++steady->placed;
    steady->streak[0] = steady->streak[1] = 0;
    return true;
}

/* A state is set before the next step. */
SADMM_INLINE void steady_set(struct sadmm_steady *steady, struct sadmm_rigid *body, const double position[3],
                             const double orientation[4], const double velocity[6])
{
    bool other = steady_place(steady, body, position, orientation);
    for (int k = 0; k < 6; ++k) other = other || velocity[k] != body->velocity[k];
    if (other) rolling_forget(body);
    for (int k = 0; k < 3; ++k) body->position[k] = position[k];
    for (int k = 0; k < 4; ++k) body->orientation[k] = orientation[k];
    for (int k = 0; k < 6; ++k) body->velocity[k] = velocity[k];
}

/* The step of length dt made `body` into `next`. */
SADMM_INLINE void steady_keep(struct sadmm_steady *steady, const struct sadmm_rigid *body,
                              const struct sadmm_rigid *next, double dt)
{
    double ratio = step_ratio(dt, steady->dt);
    for (int part = 0; part < 2; ++part) {
        double size = 0, differs = 0;
        for (int k = 3 * part; k < 3 * part + 3; ++k) {
            double change = next->velocity[k] - body->velocity[k], difference = change - ratio * steady->change[k];
            size += change * change;
            differs += difference * difference;
            steady->change[k] = change;
        }
        bool same = differs <= STEADY_SHARE * STEADY_SHARE * size;
        int32_t before = steady->streak[part];
        steady->streak[part] = same ? (before < STEADY_STEPS ? before + 1 : STEADY_STEPS) : 0;
    }
    steady->dt = dt;
}

#endif
