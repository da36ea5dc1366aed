/* Contacts are found at the midpoint of the step, where the velocities at its start take the bodies, not at its start.
 * With normals and arms of the midpoint the change of separation is of second order, like the midpoint rule for
 * integrals; with the geometry of the start it is of first order, e.g. where a normal turns within the step, or a
 * corner swings down.
 *
 * Separations are extrapolated back to the start of the step with the same normals and arms, so that "separation + dt x
 * velocity" is the separation at its end. Both bodies get their impulse at the same point in space: arms go from the
 * centres of mass at the start of the step to that point, or pairs would create angular momentum.
 */
#ifndef SADMM_COLLISION_BASE_MIDPOINT_H
#define SADMM_COLLISION_BASE_MIDPOINT_H

#include "core/math/quat.h"

/* Largest rotation of a shape to its time offset, rad: bodies that turn faster have a smaller time offset. */
#define MIDPOINT_TURN 0.25
/* Largest relative motion of two shapes to the midpoint, as a share of the thinner one's extent: after more they may
 * touch with other features (advance.h). */
#define MIDPOINT_TRAVEL 0.1

/* Time offset of a body's rotation, s: half a step, or what MIDPOINT_TURN allows. rate: turning_rate. */
SADMM_INLINE double turn_time_offset(double rate, double dt)
{
    return rate * dt > 2 * MIDPOINT_TURN ? MIDPOINT_TURN / rate : 0.5 * dt;
}

/* The orientation after `time_offset` seconds. The half angle replaces its tangent (an error of third order), so that
 * only roots and divisions are needed, which have the same bits on all processors. */
SADMM_INLINE quat turned(quat q, const double angular[3], double time_offset)
{
    quat turn;
    turn.w = 1;
    turn.x = (real)(0.5 * time_offset * angular[0]);
    turn.y = (real)(0.5 * time_offset * angular[1]);
    turn.z = (real)(0.5 * time_offset * angular[2]);
    return q_normalize(q_mul(turn, q));
}

/* The rotation from where a body is `from` seconds into the step by `turned` to where it is at `to`, by its velocity at
 * the start; row-major. Halved until tangents do as well here, but for 1e-3 of a turn of 5 rad. */
SADMM_INLINE void turn_between(const double angular[3], double from, double to, double Q[9])
{
    enum { HALVINGS = 5 };
    double to_w = 1, to_v[3], from_v[3], w, v[3], size;
    int k;
    for (k = 0; k < 3; ++k) {
        to_v[k] = 0.5 * to * angular[k] / (1 << HALVINGS);
        from_v[k] = -0.5 * from * angular[k];
    }
    for (k = 0; k < HALVINGS; ++k) { /* twice the angle, but for a factor */
        const double square = to_v[0] * to_v[0] + to_v[1] * to_v[1] + to_v[2] * to_v[2],
                     scale = 1 / (to_w * to_w + square), twice = 2 * to_w * scale;
        to_w = (to_w * to_w - square) * scale;
        to_v[0] *= twice;
        to_v[1] *= twice;
        to_v[2] *= twice;
    }
    /* about one axis: they only scale each other */
    w = to_w - (to_v[0] * from_v[0] + to_v[1] * from_v[1] + to_v[2] * from_v[2]);
    for (k = 0; k < 3; ++k) v[k] = to_v[k] + to_w * from_v[k];
    size = 1 / sqrt(w * w + v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    w *= size;
    for (k = 0; k < 3; ++k) v[k] *= size;
    Q[0] = 1 - 2 * (v[1] * v[1] + v[2] * v[2]);
    Q[1] = 2 * (v[0] * v[1] - w * v[2]);
    Q[2] = 2 * (v[0] * v[2] + w * v[1]);
    Q[3] = 2 * (v[0] * v[1] + w * v[2]);
    Q[4] = 1 - 2 * (v[0] * v[0] + v[2] * v[2]);
    Q[5] = 2 * (v[1] * v[2] - w * v[0]);
    Q[6] = 2 * (v[0] * v[2] - w * v[1]);
    Q[7] = 2 * (v[1] * v[2] + w * v[0]);
    Q[8] = 1 - 2 * (v[0] * v[0] + v[1] * v[1]);
}

/* Time offset of a pair's centres of mass, s. speed: relative_speed; thin: the thinner shape's extent. */
SADMM_INLINE double move_time_offset(double speed, double thin, double dt)
{
    return 0.5 * speed * dt > MIDPOINT_TRAVEL * thin ? MIDPOINT_TRAVEL * thin / speed : 0.5 * dt;
}

#endif
