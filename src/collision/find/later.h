/* Contacts of bodies that were hit within the step (world/step/hits.c): before the later of both hits the pair was
 * never where it is taken to come from. It is searched for in what is left of the step, and what overlaps at the start
 * alone does not overlap. */
#ifndef SADMM_COLLISION_FIND_LATER_H
#define SADMM_COLLISION_FIND_LATER_H

#include <float.h>

#include "collision/shapes/proxy.h"
#include "contact_emit.h"

/* The shape in a step that begins `since` seconds later and is as much shorter, placed halfway through that. hit: of
 * its body, not later than since. */
SADMM_INLINE void proxy_begin_later(const struct sadmm_proxy *p, double hit, double since, double dt,
                                    struct sadmm_proxy *out)
{
    const double on = turn_time_offset(turning_rate(p->angular), dt - since);
    struct sadmm_proxy own = *p, turned;
    int k;
    own.time_offset -= hit; /* it turns from there */
    *out = *proxy_at(&own, since + on - hit, 0, &turned);
    out->time_offset = on;
    for (k = 0; k < 3; ++k) {
        out->com[k] += since * p->velocity[k];
        out->x[k] = out->com[k] + out->arm[k];
    }
}

/* As proxy_at of such a pair: its motion is taken back to the start of the whole step. */
SADMM_RARE const struct sadmm_proxy *proxy_at_later(const struct sadmm_proxy *p, double hit, double since,
                                                    double time_offset, double dt, struct sadmm_proxy *out)
{
    const double left = dt - since, on = time_offset == since + 0.5 * left ? 0.5 * left : time_offset - since;
    struct sadmm_proxy later, turned;
    int k;
    proxy_begin_later(p, hit, since, dt, &later);
    *out = *proxy_at(&later, on, left, &turned);
    out->time_offset += since;
    for (k = 0; k < 3; ++k) {
        out->com[k] = p->com[k];
        out->x[k] = p->com[k] + out->arm[k];
    }
    return out;
}

/* What gravity would be for it to add as much in what is left as it adds in the whole step: velocities are those of
 * that one's start. */
SADMM_INLINE double gravity_later(double gravity, double dt, double left)
{
    return gravity * (dt / left) * (dt / left);
}

/* Where points part, a separation below 0 at the start is none: it is how far they have come by since they were hit. */
SADMM_RARE void open_separation(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double normal[3],
                                struct sadmm_contact_point *point)
{
    double opens = 0, across_a[3] = {0, 0, 0}, across_b[3] = {0, 0, 0};
    int k;
    if (!(point->separation < 0)) return;
    add_cross(normal, a->angular, 1, across_a);
    add_cross(normal, b->angular, 1, across_b);
    for (k = 0; k < 3; ++k) opens += normal[k] * (b->velocity[k] - a->velocity[k]);
    opens += dot3(across_b, point->arm_b) - dot3(across_a, point->arm_a);
    if (opens > 0) point->separation = DBL_MIN;
}

#endif
