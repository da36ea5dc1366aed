/* Extrapolation of a body's velocity: what is kept from step to step for the velocity a solve starts from, and whether
 * its pose was set.
 *
 * A contact that slides holds its impulse at the cone's edge whatever the velocity does, so a step's change of speed
 * has to come from the momentum balance alone, by a factor m / (m + J^T beta J) an iteration: a few per cent of it are
 * still missing after a hundred. Where the last steps changed a body's velocity by the same amount (sliding under
 * gravity or friction), the next one starts from that change and nothing is missing. Only after three such steps: with
 * few iterations velocities jitter, and extrapolating the jitter would amplify it. What stays the same is the
 * acceleration: a change counts by the length of its step. A pose that is set ends a streak: the body is where other
 * contacts are.
 */
#ifndef SADMM_CORE_MODEL_EXTRAPOLATION_H
#define SADMM_CORE_MODEL_EXTRAPOLATION_H

#include "core/math/step.h"
#include "rolling.h"

enum { EXTRAPOLATION_STEPS = 3 };
/* Changes that differ by less than this share are the same. */
#define EXTRAPOLATION_SHARE 0.25 /* measured: bench/constants.py, heaps standing */

/* A component of that velocity, from the velocity's; ratio: step_ratio. */
SADMM_INLINE double extrapolate_velocity(double velocity, int32_t streak, double change, double ratio)
{
    return velocity + (streak >= EXTRAPOLATION_STEPS ? ratio * change : 0);
}

SADMM_INLINE void extrapolation_start(const struct sadmm_rigid *body, const struct sadmm_extrapolation *extrapolation,
                                      double dt, double velocity[6])
{
    const double ratio = step_ratio(dt, extrapolation->dt);
    for (int k = 0; k < 6; ++k)
        velocity[k] = extrapolate_velocity(body->velocity[k], extrapolation->streak[k / 3], extrapolation->change[k],
                                           ratio);
}

/* Components of an orientation that was read and is set again: it is made a unit quaternion once more. */
#define EXTRAPOLATION_ROUNDING (8 * DBL_EPSILON)

/* A pose is set before the next step; false: the one that the body has already, which changes nothing. */
SADMM_INLINE bool extrapolation_place(struct sadmm_extrapolation *extrapolation, const struct sadmm_rigid *body,
                                      const double position[3], const double orientation[4])
{
    bool same = true;
    for (int k = 0; k < 3; ++k) same = same && position[k] == body->position[k];
    for (int k = 0; k < 4; ++k) same = same && fabs(orientation[k] - body->orientation[k]) <= EXTRAPOLATION_ROUNDING;
    if (same) return false;
    ++extrapolation->placed;
    extrapolation->streak[0] = extrapolation->streak[1] = 0;
    return true;
}

/* A state is set before the next step. */
SADMM_INLINE void extrapolation_set(struct sadmm_extrapolation *extrapolation, struct sadmm_rigid *body,
                                    const double position[3], const double orientation[4], const double velocity[6])
{
    bool other = extrapolation_place(extrapolation, body, position, orientation);
    for (int k = 0; k < 6; ++k) other = other || velocity[k] != body->velocity[k];
    if (other) rolling_forget(body);
    for (int k = 0; k < 3; ++k) body->position[k] = position[k];
    for (int k = 0; k < 4; ++k) body->orientation[k] = orientation[k];
    for (int k = 0; k < 6; ++k) body->velocity[k] = velocity[k];
}

/* The step of length dt made `body` into `next`. */
SADMM_INLINE void extrapolation_keep(struct sadmm_extrapolation *extrapolation, const struct sadmm_rigid *body,
                                     const struct sadmm_rigid *next, double dt)
{
    double ratio = step_ratio(dt, extrapolation->dt);
    for (int part = 0; part < 2; ++part) {
        double size = 0, differs = 0;
        for (int k = 3 * part; k < 3 * part + 3; ++k) {
            double change = next->velocity[k] - body->velocity[k],
                   difference = change - ratio * extrapolation->change[k];
            size += change * change;
            differs += difference * difference;
            extrapolation->change[k] = change;
        }
        bool same = differs <= EXTRAPOLATION_SHARE * EXTRAPOLATION_SHARE * size;
        int32_t before = extrapolation->streak[part];
        extrapolation->streak[part] = same ? (before < EXTRAPOLATION_STEPS ? before + 1 : EXTRAPOLATION_STEPS) : 0;
    }
    extrapolation->dt = dt;
}

#endif
