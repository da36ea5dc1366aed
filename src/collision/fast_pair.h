/* Which pairs of shapes may hit each other within a step (swept_bodies.h), by their velocities and sizes alone. For the
 * host and devices. */
#ifndef SADMM_COLLISION_FAST_PAIR_H
#define SADMM_COLLISION_FAST_PAIR_H

#include "proxy.h"

/* How far a pair may go within the step, m. gravity: its size. */
SADMM_INLINE double pair_way(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double gravity, double dt)
{
    const bool both = a->system_body >= 0 && b->system_body >= 0; /* they fall alike */
    return relative_speed(a->velocity, b->velocity) * dt + a->spin + b->spin + a->fall + b->fall +
           (both ? 0 : fall_of(gravity, dt));
}

/* The solve has such an impact with the way until then in the arms of the body that is harder to turn (contact_emit.h):
 * that lets the other one through unless it is so much lighter that the arms do not matter. */
#define ARMS_MATTER 0.01
/* And by the plane in which they touch: what turns by more than so many rad takes it away from what it hits. */
#define TURNS_AWAY  0.3

/* Might the solve let them through each other? way: pair_way. */
SADMM_INLINE bool pair_passes(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double way, double dt)
{
    const bool a_is_light = b->system_body < 0 || (a->system_body >= 0 && a->inertia < b->inertia);
    const struct sadmm_proxy *light = a_is_light ? a : b, *heavy = a_is_light ? b : a;
    if (!(way > smaller_of(a->thin, b->thin)) || light->system_body < 0 || !sadmm_body_moves(heavy->system_body))
        return false;
    const double size = length3(light->arm) + geometry_radius(&light->geometry);
    return turning_rate(heavy->angular) * dt > TURNS_AWAY ||
           (heavy->system_body >= 0 && way * way * light->inertia > ARMS_MATTER * size * size * heavy->inertia);
}

/* Are hits of the pair looked for? threshold: of restitution, m/s. */
SADMM_INLINE bool pair_is_fast(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double threshold,
                               double gravity, double dt)
{
    const double way = pair_way(a, b, gravity, dt);
    return way > threshold * dt &&
           ((a->restitution > 0) | (b->restitution > 0) || pair_passes(a, b, way, dt));
}

#endif
