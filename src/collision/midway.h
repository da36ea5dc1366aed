/* Contacts are found where the bodies are halfway through the step by their velocities at its start, not where they
 * are at its start: with normals and arms of the step's middle, what the velocities close is right to second order,
 * as an integral by the midpoint is. A normal that turns within the step, a corner that swings down: all of that is a
 * first-order error of geometry taken at the start.
 *
 * Gaps are taken back to the start of the step by the same normals and arms, so that "gap + dt x velocity" is the gap
 * at its end. Impulses act at one point of space, whatever moves through it: arms are measured from the centres of mass
 * at the start of the step to a point that both bodies have in common, or pairs would make angular momentum.
 */
#ifndef SADMM_COLLISION_MIDWAY_H
#define SADMM_COLLISION_MIDWAY_H

#include "core/math/quat.h"

/* Most that a shape is turned ahead, rad: a body that turns faster has no middle of a step to speak of. */
#define MIDWAY_TURN 0.25
/* Most that two shapes are moved halfway relative to each other, as a share of the thinner one's extent: beyond, what
 * they touch with may be another part of them by then (advance.h). */
#define MIDWAY_TRAVEL 0.1

/* How far on a body is turned, s: half a step, but for MIDWAY_TURN. rate: turning_rate. */
SADMM_INLINE double turn_ahead(double rate, double dt)
{
    return rate * dt > 2 * MIDWAY_TURN ? MIDWAY_TURN / rate : 0.5 * dt;
}

/* The orientation `ahead` seconds on. The half angle is taken for its tangent (an error of third order), so that only
 * roots and divisions are asked of a processor: all give the same bits. */
SADMM_INLINE quat turned(quat q, const double angular[3], double ahead)
{
    quat turn;
    turn.w = 1;
    turn.x = (real)(0.5 * ahead * angular[0]);
    turn.y = (real)(0.5 * ahead * angular[1]);
    turn.z = (real)(0.5 * ahead * angular[2]);
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

/* How far on the centres of mass of a pair are moved, s. speed: relative_speed; thin: the thinner shape's extent. */
SADMM_INLINE double move_ahead(double speed, double thin, double dt)
{
    return 0.5 * speed * dt > MIDWAY_TRAVEL * thin ? MIDWAY_TRAVEL * thin / speed : 0.5 * dt;
}

#endif
