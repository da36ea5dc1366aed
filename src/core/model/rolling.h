/* Contacts that roll: bodies that move by the mean of their velocities before and after a step (math/lead.h) and touch
 * where their surfaces are curved, or at a corner that goes round with its body.
 *
 * Time. Their normal and arms are those of the step's *end*, so that it is there that the contact's velocity is what
 * the law says: J_1 v_1. With the ones halfway, J, what is left of J_1 v_1 would do work in every step. They are carried
 * on from the last step's and this step's, which are both found halfway (collision/contact_migrate.h). Impulses act
 * along J, though: what J^T lambda differs from J_1^T lambda by is `owed`, and each body is given it with the next step.
 *
 * Stiffness. A body that rocks on a radius of curvature r, its centre of mass h above the contact, has the stiffness
 * N (r - h), N the load, against turning across the normal. Its torque is that of the pose halfway, explicit, and
 * stable for omega dt < 2; beyond, and without friction from less, rocking would grow out of rounding. So where
 * (omega dt)^2 is more than ROLLING_STIFF the body gets half of dt^2 times the stiffness added to its inertia, and moves
 * by the velocity after the step: with that any dt is stable, and rocking dies away. In double. */
#ifndef SADMM_CORE_MODEL_ROLLING_H
#define SADMM_CORE_MODEL_ROLLING_H

#include "core/base/contact_set.h"
#include "core/math/rolling.h"
#include "system.h"

/* (omega dt)^2, half a radian a step: from there to 1 frictionless rocking is no longer stable by itself. */
#define ROLLING_STIFF 0.25

/* Does rocking have to be taken out of the body? */
SADMM_INLINE bool rolling_is_stiff(const struct sadmm_rigid *body)
{
    return body->stiffness[0] + body->stiffness[1] + body->stiffness[2] > 0;
}

/* Nothing of the last step counts: its state was set. */
SADMM_INLINE void rolling_forget(struct sadmm_rigid *body)
{
    int k;
    for (k = 0; k < 6; ++k) body->owed[k] = body->stiffness[k] = 0;
    body->mean = 0;
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
SADMM_INLINE double rolling_wrench(const struct sadmm_rigid *before, double dt, int k) { return before->owed[k] / dt; }

/* What it comes to for a body with these principal moments: nothing where the step resolves the rocking. */
SADMM_INLINE void rolling_judge(const double inertia[3], double dt, double stiffness[6])
{
    const double least = inertia[0] < inertia[1] ? (inertia[0] < inertia[2] ? inertia[0] : inertia[2])
                                                 : (inertia[1] < inertia[2] ? inertia[1] : inertia[2]),
                 /* of one contact the larger eigenvalue is half of the trace */
        most = (stiffness[0] + stiffness[1] + stiffness[2]) / 2;
    int k;
    if (dt * dt * most > ROLLING_STIFF * least) return;
    for (k = 0; k < 6; ++k) stiffness[k] = 0;
}

#endif
