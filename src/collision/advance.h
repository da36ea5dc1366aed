/* Conservative advancement: when does a pair that passes a good part of its thinner shape in a step first touch?
 *
 * Halfway through the step it may be past the contact already, and at its start the nearest features are those that the
 * one leaves behind or flies by: a plane laid between them stops a body that passes, a small one at 500 m/s by metres.
 * So such a pair is moved on, by its relative velocity, as far as the nearest points can have closed the distance, and
 * again from there, until it touches, or moves apart, or the step ends. Only its centres of mass move; turned are
 * shapes by half the step, as always (midway.h).
 */
#ifndef SADMM_COLLISION_ADVANCE_H
#define SADMM_COLLISION_ADVANCE_H

#include "manifold_box_pair.h"
#include "proxy.h"

/* Touching: a distance of this share of the thinner shape. */
#define ADVANCE_TOUCH 1e-3
/* Most moves: a graze that takes more is a contact where it is then. */
enum { ADVANCE_MOVES = 16 };

struct advance {
    int moves;
    bool missed; /* nothing touches before the end of the step */
};

/* Is the pair one of these? ahead: proxy_ahead. */
SADMM_INLINE bool advance_needed(double ahead, double dt) { return ahead < 0.5 * dt; }

/* The largest distance that an axis parts two boxes by, at most their distance; normal: from 2 to 1, frame of 1. Corner
 * contacts have a distance and a normal as well, but not of the same plane. */
SADMM_INLINE real boxes_apart(const struct box_pair *boxes, vec3 *normal)
{
    const vec3 t = v3_from_array(boxes->t);
    real most = -SADMM_REAL_MAX;
    int axis, k;
    *normal = v3(0, 0, 1);
    for (axis = 0; axis < 15; ++axis) {
        const vec3 n = box_axis_direction(boxes, axis, 0);
        const real along = v3_dot(n, t), x[3] = {n.x, n.y, n.z};
        real s = real_abs(along);
        for (k = 0; k < 3; ++k)
            s -= boxes->h1[k] * real_abs(x[k]) +
                 boxes->h2[k] * real_abs(x[0] * boxes->R[0][k] + x[1] * boxes->R[1][k] + x[2] * boxes->R[2][k]);
        if (s <= most) continue;
        most = s;
        *normal = along < 0 ? n : v3_neg(n);
    }
    return most;
}

/* No less than this are the two shapes apart, along the normal (from a to b, in the frame of b). m: their manifold, of
 * points at any distance. */
SADMM_INLINE double shapes_apart(const struct sadmm_geometry *a, const struct sadmm_geometry *b,
                                 const struct pair_pose *pose, const struct manifold *m, vec3 *normal)
{
    double least = HUGE_VAL;
    int k;
    if (a->type == SADMM_SHAPE_BOX && b->type == SADMM_SHAPE_BOX) {
        struct box_pair boxes;
        box_pair_make(v3_load(b->size), v3_load(a->size), pose, SADMM_REAL_MAX, &boxes);
        return (double)boxes_apart(&boxes, normal);
    }
    *normal = m->normal;
    for (k = 0; k < m->count; ++k) least = smaller_of(least, (double)m->points[k].separation);
    return least;
}

/* Move *ahead on. m: the manifold there, of points at any distance. False: *ahead is where the contact is to be
 * taken. */
SADMM_RARE bool advance_pair(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const struct pair_pose *pose,
                               const struct manifold *m, double dt, struct advance *state, double *ahead)
{
    const double touch = ADVANCE_TOUCH * smaller_of(a->thin, b->thin);
    vec3 n;
    const double distance = shapes_apart(&a->geometry, &b->geometry, pose, m, &n);
    double normal[3], closing = 0, next;
    int k;
    if (m->count == 0 || distance <= touch || state->moves == ADVANCE_MOVES) return false;
    rotate_to_world(b->R, n, normal);
    for (k = 0; k < 3; ++k) closing -= normal[k] * (b->velocity[k] - a->velocity[k]);
    next = *ahead + distance / closing;
    if (!(closing > 0 && next < dt)) { /* nor with velocities that have no difference */
        state->missed = true;
        return false;
    }
    *ahead = next;
    ++state->moves;
    return true;
}

#endif
