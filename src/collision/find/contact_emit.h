/* Manifolds to contacts: from the frame of b to world terms. a, b: the proxies of the pair's shapes. */
#ifndef SADMM_COLLISION_FIND_CONTACT_EMIT_H
#define SADMM_COLLISION_FIND_CONTACT_EMIT_H

#include "core/math/array3.h"
#include "collision/base/manifold.h"
#include "contact_match.h"
#include "contact_migrate.h"

/* The value set for the two shapes (keys: unordered_key of slots, sorted), else the geometric mean. */
SADMM_INLINE double contact_friction(const uint64_t *keys, const double *values, int64_t count, uint32_t slot_a,
                                     uint32_t slot_b, const struct sadmm_proxy *a, const struct sadmm_proxy *b)
{
    if (count > 0) {
        const int64_t at = find_key(keys, count, unordered_key(slot_a, slot_b));
        if (at >= 0) return values[at];
    }
    return a->friction == b->friction ? a->friction : sqrt(a->friction * b->friction);
}

/* normal: the contact's, in the world. first: index of its first point. */
SADMM_INLINE void contact_emit_pair(uint32_t slot_a, uint32_t slot_b, uint32_t subshape, const struct sadmm_proxy *a,
                                    const struct sadmm_proxy *b, const struct manifold *m, const double normal[3],
                                    double friction, int32_t first, struct sadmm_contact_pair *pair)
{
    int k;
    pair->body_a = a->system_body;
    pair->body_b = b->system_body;
    pair->shape_a = (int32_t)slot_a;
    pair->shape_b = (int32_t)slot_b;
    pair->first = first;
    pair->count = m->count;
    for (k = 0; k < 3; ++k) pair->normal[k] = normal[k];
    pair->friction = friction;
    pair->restitution = a->restitution > b->restitution ? a->restitution : b->restitution;
    pair->cache = m->cache;
    pair->revision = word_of_pair(a->revision, b->revision);
    pair->placed = word_of_pair(a->placed, b->placed);
    pair->subshape = subshape;
}

/* What the points of a pair have in common. The contact was found `time_offset` seconds after the step's start
 * (midpoint.h) and is referred to the start: arms to the centres of mass there, separations by the velocities. */
struct pair_motion {
    double between[3]; /* from a's centre of mass to b's, at the time offset, m */
    double shift_a[3], shift_b[3]; /* from arms at the time offset to arms at the start, of one point in space, m */
    double turn_a[3], turn_b[3]; /* times an arm at the time offset: by how much rotation has reduced the separation
                                    until then, m / m */
    double closed; /* by the centres of mass, along the normal, and by what the shifts make of turning in the step, m */
};

/* The share of a way across the normal that arms may take up: an impulse on a longer arm turns its body instead of
 * stopping it, by a share of the approach that goes as the arm's square, and that may be a way through what is thin. */
#define ARMS_GIVE 0.02
SADMM_RARE double arms_take(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double normal[3],
                            const double way[3], double dt)
{
    const double thin = min_of(a->thin, b->thin), along = dot3(normal, way),
                 across = dot3(way, way) - along * along, step = relative_speed(a->velocity, b->velocity) * dt,
                 most = ARMS_GIVE * thin * thin * thin;
    return across * step > most ? sqrt(most / (across * step)) : 1;
}

/* time_offset: manifold.time_offset; offset_a, offset_b: of the shapes' rotations. The point stays where it is on a
 * body beside one that is not dynamic. Of two dynamic bodies the arms of the one that is harder to turn take up most of
 * the way: those of a bullet must be its own. halfway: it was found there, where arms take up all of it. */
SADMM_INLINE void pair_motion_by(const struct sadmm_proxy *a, double offset_a, const struct sadmm_proxy *b,
                                 double offset_b, const double normal[3], double time_offset, bool halfway, double dt,
                                 struct pair_motion *m)
{
    const bool both = a->system_body >= 0 && b->system_body >= 0;
    const double share_a = both ? proxy_share(a, b) : 0, share_b = both ? proxy_share(b, a) : 0;
    double across_a[3] = {0, 0, 0}, across_b[3] = {0, 0, 0}; /* n x w, since n . (w x r) = r . (n x w) */
    double way[3], take;
    int k;
    add_cross(normal, a->angular, 1, across_a);
    add_cross(normal, b->angular, 1, across_b);
    for (k = 0; k < 3; ++k) way[k] = offset_displacement(a, b, time_offset, k);
    take = both && !halfway ? arms_take(a, b, normal, way, dt) : 1;
    m->closed = 0;
    for (k = 0; k < 3; ++k) {
        m->between[k] = b->com[k] - a->com[k] + way[k];
        m->shift_a[k] = -share_a * (take * way[k]);
        m->shift_b[k] = share_b * (take * way[k]);
        m->turn_a[k] = offset_a * across_a[k];
        m->turn_b[k] = -offset_b * across_b[k];
        m->closed -= normal[k] * way[k];
    }
    m->closed += dt * (dot3(across_a, m->shift_a) - dot3(across_b, m->shift_b));
}

/* Where they are placed. */
SADMM_INLINE void pair_motion_of(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double normal[3],
                                 double time_offset, double dt, struct pair_motion *m)
{
    pair_motion_by(a, a->time_offset, b, b->time_offset, normal, time_offset, is_midpoint(time_offset, dt), dt, m);
}
/* The same of a pair that was found halfway. */
SADMM_INLINE void pair_motion_halfway(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double normal[3],
                                      double time_offset, double dt, struct pair_motion *m)
{
    pair_motion_by(a, a->time_offset, b, b->time_offset, normal, time_offset, true, dt, m);
}

/* Without an impulse. Rb, b_arm: of b, at its time offset. */
SADMM_INLINE void contact_emit_point_at(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double Rb[9],
                                        const double b_arm[3], const struct pair_motion *motion,
                                        const struct manifold_point *from, struct sadmm_contact_point *point)
{
    double arm_a[3], arm_b[3];
    int k;
    rotate_to_world(Rb, from->position, arm_b);
    for (k = 0; k < 3; ++k) {
        arm_b[k] += b_arm[k];
        arm_a[k] = arm_b[k] + motion->between[k];
        point->arm_b[k] = sadmm_body_moves(b->system_body) ? arm_b[k] + motion->shift_b[k] : 0;
        point->arm_a[k] = sadmm_body_moves(a->system_body) ? arm_a[k] + motion->shift_a[k] : 0;
        point->impulse[k] = 0;
    }
    point->separation = (double)from->separation + motion->closed + dot3(motion->turn_a, arm_a) +
                        dot3(motion->turn_b, arm_b);
    point->error = 0;
    point->feature = from->feature;
    point->migrates = 0;
}

SADMM_INLINE void contact_emit_point(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                     const struct pair_motion *motion, const struct manifold_point *from,
                                     struct sadmm_contact_point *point)
{
    contact_emit_point_at(a, b, b->R, b->arm, motion, from, point);
}

/* The same of a pair that was not found halfway; normal: set, in the world. */
SADMM_RARE void contact_emit_turned(const struct sadmm_proxy *a, const struct sadmm_proxy *b, vec3 manifold_normal,
                                    double time_offset, double dt, const struct manifold_point *from, double normal[3],
                                    struct sadmm_contact_point *point)
{
    struct proxy_place of_b;
    struct pair_motion motion;
    proxy_place_at(b, time_offset, dt, &of_b);
    rotate_to_world(of_b.R, manifold_normal, normal);
    /* what does not turn is turned by nothing */
    pair_motion_by(a, time_offset, b, time_offset, normal, time_offset, is_midpoint(time_offset, dt), dt, &motion);
    contact_emit_point_at(a, b, of_b.R, of_b.arm, &motion, from, point);
}

#endif
