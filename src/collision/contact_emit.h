/* Manifolds to contacts: from the frame of b to world terms. a, b: the proxies of the pair's shapes. */
#ifndef SADMM_COLLISION_CONTACT_EMIT_H
#define SADMM_COLLISION_CONTACT_EMIT_H

#include "contact_match.h"
#include "manifold.h"

SADMM_INLINE void rotate_to_world(const double R[9], vec3 v, double out[3])
{
    int k;
    for (k = 0; k < 3; ++k)
        out[k] = R[3 * k] * (double)v.x + R[3 * k + 1] * (double)v.y + R[3 * k + 2] * (double)v.z;
}

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

/* normal: the manifold's, in the world. first: index of its first point. */
SADMM_INLINE void contact_emit_pair(uint32_t slot_a, uint32_t slot_b, uint32_t child, const struct sadmm_proxy *a,
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
    pair->child = child;
}

SADMM_INLINE void contact_between(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double between[3])
{
    int k;
    for (k = 0; k < 3; ++k) between[k] = b->com[k] - a->com[k];
}

/* Without an impulse. between: from the centre of mass of a's body to that of b's. */
SADMM_INLINE void contact_emit_point(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double between[3],
                                     const struct manifold_point *from, struct sadmm_contact_point *point)
{
    double p[3];
    int k;
    rotate_to_world(b->R, from->position, p);
    for (k = 0; k < 3; ++k) {
        const double arm = p[k] + b->arm[k];
        point->arm_b[k] = b->system_body >= 0 ? arm : 0;
        point->arm_a[k] = a->system_body >= 0 ? arm + between[k] : 0;
        point->impulse[k] = 0;
    }
    point->gap = (double)from->separation;
    point->error = 0;
    point->feature = from->feature;
    point->reserved = 0;
}

#endif
