/* How a contact of the last step lives on in this one.
 *
 * Identity: the pair of shapes and their revisions (a slot may hold another shape by now), then the feature. Impulses
 * are kept as world vectors; where the normal turned, the normal part goes along the new normal and the tangential
 * part is projected into the new tangent plane, within the friction disc. They are forces times a time step: where the
 * steps differ in length, the forces are what carries over.
 *
 * The axis and the side that the pair remembers (`cache`) say where the bodies came from. They hold only while both
 * move by themselves: once a pose has been set (sadmm_collision_body.placed), the pair starts without. Impulses may
 * stay then, for they are no more than a start.
 */
#ifndef SADMM_COLLISION_CONTACT_CARRY_H
#define SADMM_COLLISION_CONTACT_CARRY_H

#include "core/math/step.h"

/* One word from two counts (revisions, placings): a change of either always shows, of both together as well while the
 * counts are less than some ten thousand apart (the multipliers have no shorter relation). */
SADMM_INLINE uint32_t word_of_pair(uint32_t a, uint32_t b) { return a * 0x9E3779B1u + b * 0x85EBCA77u; }

/* ratio: step_ratio. `out` is left alone when nothing carries over. */
SADMM_INLINE void impulse_carry(const double old_normal[3], const double old_impulse[3], const double normal[3],
                                double friction, double ratio, double out[3])
{
    double turned = 0, along = 0, back = 0, size = 0, limit, scale, t[3], impulse[3];
    int k;
    for (k = 0; k < 3; ++k) {
        impulse[k] = ratio * old_impulse[k];
        turned += old_normal[k] * normal[k];
        along += old_normal[k] * impulse[k];
    }
    if (turned <= 0 || along <= 0) return;
    for (k = 0; k < 3; ++k) {
        t[k] = impulse[k] - along * old_normal[k];
        back += t[k] * normal[k];
    }
    for (k = 0; k < 3; ++k) {
        t[k] -= back * normal[k];
        size += t[k] * t[k];
    }
    size = sqrt(size);
    limit = friction * along;
    scale = size > limit ? limit / size : 1;
    for (k = 0; k < 3; ++k) out[k] = along * normal[k] + scale * t[k];
}

#endif
