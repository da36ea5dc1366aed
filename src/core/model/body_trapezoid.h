/* The trapezoid correction of bodies (math/trapezoid.h) where a step ends: which one a body takes, and what a contact
 * point says of its two bodies. One text for every backend, host and device, and for islands with joints; in double. */
#ifndef SADMM_CORE_MODEL_BODY_TRAPEZOID_H
#define SADMM_CORE_MODEL_BODY_TRAPEZOID_H

#include "core/base/contact_set.h"
#include "core/math/trapezoid.h"
#include "rolling.h"

/* Of a body that was hit, its turning's alone (sadmm_rigid.was_hit). island, own: bits of its contacts. */
SADMM_INLINE enum trapezoid_kind body_trapezoid_kind(const struct sadmm_rigid *body, int island, int own)
{
    return body->was_hit ? TRAPEZOID_OWN : trapezoid_kind_of(island, own);
}
SADMM_INLINE void body_trapezoid(const struct sadmm_rigid *body, const double before[6], const double velocity[6],
                                 double correction[6])
{
    trapezoid_own(before, velocity, correction);
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) correction[k] = body->was_hit ? 0 : correction[k];
}

/* Does it move by the mean of its velocities (sadmm_rigid.mean), so that its contacts may roll? What was hit moves by
 * the velocity that it ends with. */
SADMM_INLINE bool body_moves_by_mean(const struct sadmm_rigid *body, enum trapezoid_kind kind)
{
    return kind == TRAPEZOID_OWN && !body->was_hit;
}

/* Bits of the island that a contact gives it by itself. inner: between two dynamic bodies. */
SADMM_INLINE int body_contact_touch(bool inner, double friction)
{
    return inner ? TOUCH_INNER : friction > 0 ? TOUCH_FRICTION : TOUCH_SMOOTH;
}

/* A contact point, halfway through the step: how it opens by the velocities of a and b, and, into along, by their
 * corrections. */
SADMM_INLINE struct trapezoid_separation body_point_way(const struct rolling_halfway *at,
                                                        const struct sadmm_contact_point *point,
                                                        const double *const v[2], const double *const correction[2],
                                                        double along[2])
{
    const struct trapezoid_separation separation = {
        point->separation,
        trapezoid_along(at->normal, v[1], at->arm_b) - trapezoid_along(at->normal, v[0], at->arm_a),
        {size3(point->arm_a), size3(point->arm_b)},
        point->migrates};
    along[0] = -trapezoid_along(at->normal, correction[0], at->arm_a);
    along[1] = trapezoid_along(at->normal, correction[1], at->arm_b);
    return separation;
}

#endif
