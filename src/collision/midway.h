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

/* How far on the centres of mass of a pair are moved, s. speed: relative_speed; thin: the thinner shape's extent. */
SADMM_INLINE double move_ahead(double speed, double thin, double dt)
{
    return 0.5 * speed * dt > MIDWAY_TRAVEL * thin ? MIDWAY_TRAVEL * thin / speed : 0.5 * dt;
}

#endif
