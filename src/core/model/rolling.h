/* Contacts that roll: bodies that move by the mean of their velocities before and after a step (math/trapezoid.h) and
 * touch where their surfaces are curved, or at a corner that goes round with its body.
 *
 * Time. Their normal and arms are those of the step's *end*, so that it is there that the contact's velocity is what
 * the law says: J_1 v_1. With the ones halfway, J, what is left of J_1 v_1 would do work in every step. They are
 * carried on from the last step's and this step's, which are both found halfway (collision/find/contact_migrate.h).
 * Impulses act along J, though: what J^T lambda differs from J_1^T lambda by is `owed`, and each body is given it with
 * the next step.
 *
 * Spin. Where moments differ a solution is the spin halfway (spin.h), and the body goes on by itself from there to the
 * step's end. So the next step of a body that rolls on a round surface is solved for the spin at its end: what it gains
 * by itself, to first order, is in b, and taken off again before the body turns on. Not in islands with joints, whose
 * rows are of the spin halfway, nor where it turns about edges and corners.
 *
 * Stiffness. A body that rocks on a radius of curvature r, its centre of mass h above the contact, has the stiffness
 * N (r - h), N the load, against turning across the normal. Its torque is that of the pose halfway, explicit, and
 * stable for omega dt < 2; beyond, and without friction from less, rocking would grow out of rounding. So where
 * (omega dt)^2 is more than ROLLING_STIFF the body gets half of dt^2 times the stiffness added to its inertia, and
 * moves by the velocity after the step: with that any dt is stable, and rocking dies away. In double. */
#ifndef SADMM_CORE_MODEL_ROLLING_H
#define SADMM_CORE_MODEL_ROLLING_H

#include "core/base/contact_set.h"
#include "core/math/rolling.h"
#include "system.h"

/* (omega dt)^2, half a radian a step: from there to 1 frictionless rocking is no longer stable by itself. */
#define ROLLING_STIFF 0.25

/* What a body takes along from contacts that rolled. Few have any of it, so that it is not read, or cleared, where a
 * bit does not say that it is there: records of bodies are what large worlds move. TURNS_ON: the step's solution is the
 * spin at its end, not halfway (spin.h). STIFFENED: in the step at hand its stiffness has what joints add
 * (stiffening.h). */
enum rolling_kept { ROLLING_OWES = 1, ROLLING_IS_STIFF = 2, ROLLING_TURNS_ON = 4, ROLLING_IS_STIFFENED = 8 };

/* Does rocking have to be taken out of the body? */
SADMM_INLINE bool rolling_is_stiff(const struct sadmm_rigid *body) { return (body->rolls & ROLLING_IS_STIFF) != 0; }

/* Has it stiffness of any kind? */
SADMM_INLINE bool rolling_stiffens(const struct sadmm_rigid *body)
{
    return (body->rolls & (ROLLING_IS_STIFF | ROLLING_IS_STIFFENED)) != 0;
}

/* Is it solved for the spin at the step's end? */
SADMM_INLINE bool rolling_turns_on(const struct sadmm_rigid *body) { return (body->rolls & ROLLING_TURNS_ON) != 0; }

/* Nothing of the last step counts: its state was set. */
SADMM_INLINE void rolling_forget(struct sadmm_rigid *body) { body->rolls = body->mean = 0; }

/* What is not of account becomes 0. */
SADMM_INLINE void rolling_clear(struct sadmm_rigid *body)
{
    int k;
    for (k = 0; k < 6 && !(body->rolls & ROLLING_OWES); ++k) body->owed[k] = 0;
    for (k = 0; k < 6 && !(body->rolls & ROLLING_IS_STIFF); ++k) body->stiffness[k] = 0;
}

/* Adds to b what the body is owed, N s, N m s. */
SADMM_INLINE void rolling_pay(const struct sadmm_rigid *body, double b[6])
{
    int k;
    for (k = 0; k < 6 && body->rolls & ROLLING_OWES; ++k) b[k] += body->owed[k];
}

/* A contact halfway through the step. migration: NULL, then it is what it is. */
struct rolling_halfway {
    double normal[3], arm_a[3], arm_b[3];
};
SADMM_INLINE struct rolling_halfway rolling_halfway_of(const double normal[3], const struct sadmm_contact_point *point,
                                                       const struct sadmm_contact_migration *migration)
{
    struct rolling_halfway out;
    int k;
    for (k = 0; k < 3; ++k) {
        out.normal[k] = normal[k] - (migration ? migration->normal[k] : 0);
        out.arm_a[k] = point->arm_a[k] - (migration ? migration->arm_a[k] : 0);
        out.arm_b[k] = point->arm_b[k] - (migration ? migration->arm_b[k] : 0);
    }
    return out;
}

/* Part of what contacts give the body in a step of dt. */
SADMM_INLINE double rolling_wrench(const struct sadmm_rigid *before, double dt, int k)
{
    return before->rolls & ROLLING_OWES ? before->owed[k] / dt : 0;
}

/* Is the stiffness of a body with these principal moments more than the step resolves? */
SADMM_INLINE bool rolling_is_unresolved(const double inertia[3], double dt, const double stiffness[6])
{
    const double least = inertia[0] < inertia[1] ? (inertia[0] < inertia[2] ? inertia[0] : inertia[2])
                                                 : (inertia[1] < inertia[2] ? inertia[1] : inertia[2]),
                 /* of one contact the larger eigenvalue is half of the trace */
        most = (stiffness[0] + stiffness[1] + stiffness[2]) / 2;
    return dt * dt * most > ROLLING_STIFF * least;
}

/* The body's contacts begin to be added up, where they have not. */
SADMM_INLINE void rolling_begin(struct sadmm_rigid *body)
{
    if (body->rolls) return;
    rolling_clear(body);
    body->rolls = ROLLING_OWES | ROLLING_IS_STIFF;
}

/* Sums over its contacts, which may be the body's own; from: where it was as the step began; articulated: its island
 * has joints, or nothing round rolls. */
SADMM_INLINE void rolling_keep(struct sadmm_rigid *body, const double from[3], double dt, bool articulated,
                               double owed[6], const double stiffness[6])
{
    int k;
    rolling_moved(from, body->position, owed);
    body->rolls = ROLLING_OWES | (rolling_is_unresolved(body->inertia, dt, stiffness) ? ROLLING_IS_STIFF : 0) |
                  (articulated ? 0 : ROLLING_TURNS_ON);
    for (k = 0; k < 6; ++k) {
        body->owed[k] = owed[k];
        body->stiffness[k] = stiffness[k];
    }
}

#endif
