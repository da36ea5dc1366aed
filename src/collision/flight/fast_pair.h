/* Which pairs of shapes may hit each other within a step (swept_bodies.h), by their velocities and sizes alone. For the
 * host and devices. */
#ifndef SADMM_COLLISION_FLIGHT_FAST_PAIR_H
#define SADMM_COLLISION_FLIGHT_FAST_PAIR_H

#include "collision/shapes/proxy.h"

/* How far a pair may go within the step, m. gravity: its size. */
SADMM_INLINE double pair_way(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double gravity, double dt)
{
    const bool both = a->system_body >= 0 && b->system_body >= 0; /* they fall alike */
    return relative_speed(a->velocity, b->velocity) * dt + a->spin + b->spin + a->fall + b->fall +
           (both ? 0 : fall_of(gravity, dt));
}

/* The solve has such an impact by the plane in which they touch, with the way until then in the arms of a dynamic body
 * that is harder to turn (contact_emit.h), and iterations leave a share of it: what goes by its thickness in a step
 * would get through. way: pair_way. */
SADMM_INLINE bool pair_passes(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double way)
{
    const double thin_a = sadmm_body_moves(a->system_body) ? a->thin : HUGE_VAL,
                 thin_b = sadmm_body_moves(b->system_body) ? b->thin : HUGE_VAL;
    return (a->system_body >= 0 || b->system_body >= 0) && way > min_of(thin_a, thin_b);
}

/* Are hits of the pair looked for? threshold: of restitution, m/s. */
SADMM_INLINE bool pair_is_fast(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double threshold,
                               double gravity, double dt)
{
    const double way = pair_way(a, b, gravity, dt);
    return way > threshold * dt &&
           ((a->restitution > 0) | (b->restitution > 0) || pair_passes(a, b, way));
}

#endif
