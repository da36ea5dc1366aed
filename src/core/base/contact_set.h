/* Contacts of a step: what collision finds, the solver solves and the next step starts from. In double, on the host. */
#ifndef SADMM_CORE_BASE_CONTACT_SET_H
#define SADMM_CORE_BASE_CONTACT_SET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "inline.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SADMM_MAX_POINTS = 8 };

/* Which body of a step something is on: 0 and up, one that is solved for (dynamic); -1, the static world; below, the
 * (-2 - body)-th kinematic one, which moves by a velocity that is given and feels nothing. So whatever is not >= 0 is
 * as static to all but relative velocities. */
SADMM_INLINE bool sadmm_body_moves(int32_t body) { return body != -1; }
SADMM_INLINE bool sadmm_body_is_kinematic(int32_t body) { return body < -1; }
/* Of the kinematic body, its number, and back. */
SADMM_INLINE int32_t sadmm_kinematic(int32_t body) { return -2 - body; }

/* A manifold of a pair of shapes: one normal, up to SADMM_MAX_POINTS points. Two shapes may have several, distinguished
 * by `subshape` (collision/shapes/geometry.h). */
struct sadmm_contact_pair {
    int32_t body_a, body_b;   /* system body, -1: static, below: kinematic */
    int32_t shape_a, shape_b; /* world shape slot (world level), else -1 */
    int32_t first, count;     /* points */
    double normal[3];         /* unit, from a to b */
    double friction;          /* mu */
    double restitution;
    uint32_t cache;           /* narrow phase: axis and side of the last step (collision/base/manifold.h), 0 = none */
    uint32_t revision, placed; /* of the two shapes, and of their bodies' poses (collision/find/contact_match.h) */
    uint32_t subshape;
};

struct sadmm_contact_point {
    double arm_a[3], arm_b[3]; /* from the centre of mass, m, world; arm_a is 0 when a is static (same for b) */
    double separation;         /* m (world level) */
    double error;              /* e, m/s: given at the problem level; at the world level what is added to that of
                                  math/contact.h: a push that bodies are to be moved by alone (solve/push.h), mostly
                                  0 */
    double impulse[3];         /* lambda on b, world frame, N s: warm start in, solution out */
    uint32_t feature;
    uint32_t migrates; /* enum contact_migrates */
};

/* Has the set's `migrations` an entry of a point? Of its radius, or of an edge or a corner that goes on from the last
 * step; of a round surface that pressed in that step, so that it will go on from this one if its bodies move by means;
 * or of one that goes on from there, with the arms of this step's end. */
enum contact_migrates { MIGRATES_NOT, MIGRATES_NOWHERE, MIGRATES_SOON, MIGRATES_ON };

/* How the point of a contact moves on its two bodies while these roll on each other. Normal and arms of a pair whose
 * points migrate are those of the step's end (core/model/rolling.h). */
struct sadmm_contact_migration {
    double normal[3], arm_a[3], arm_b[3]; /* what they change by in half a step: 1, m, m; world */
    double radius; /* of the two surfaces' relative curvature, at most, m; 0: a corner, an edge, or not known */
};

/* The shapes of a pair that touches; of one that does not, -1 both. */
struct sadmm_touching_shapes {
    int32_t a, b;
};

/* A pair touches if one of its points carries an impulse, or has a separation of 0 or less. `points`: its own. */
SADMM_INLINE double sadmm_normal_impulse(const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *point)
{
    return pair->normal[0] * point->impulse[0] + pair->normal[1] * point->impulse[1] +
           pair->normal[2] * point->impulse[2];
}
SADMM_INLINE struct sadmm_touching_shapes sadmm_touching_of(const struct sadmm_contact_pair *pair,
                                                            const struct sadmm_contact_point *points)
{
    struct sadmm_touching_shapes out = {-1, -1};
    int32_t k;
    for (k = 0; k < pair->count; ++k)
        if (points[k].separation <= 0 || sadmm_normal_impulse(pair, &points[k]) > 0) {
            out.a = pair->shape_a;
            out.b = pair->shape_b;
        }
    return out;
}

/* A contact set that grows. Order: pairs by (shape_a, shape_b, subshape), points in pair order: point index = contact
 * index. */
struct sadmm_contact_set {
    struct sadmm_contact_pair *pairs;
    struct sadmm_contact_point *points;
    struct sadmm_contact_migration *migrations; /* as points; where there are none of a set, it may be shorter */
    size_t pair_count, point_count;
    size_t migrating; /* points that have one */
    double dt; /* of the step that its impulses are for, s; 0: of none */
};

/* A point of a hit that a step has taken at its moment (world/hits.c). */
struct sadmm_world_hit {
    int32_t shape_a, shape_b; /* slots */
    uint32_t subshape, feature;
    double position[3], normal[3];    /* m; unit, from a to b; world */
    double impulse[3];                /* on b, N s */
    double arm[2][3];                 /* from the centres of mass of a's and b's bodies, m */
    int32_t dynamic[2], kinematic[2]; /* their numbers in the step, -1: none */
    double speed;                     /* of approach, m/s */
    double friction;
};

/* NULL: it has none. */
SADMM_INLINE const struct sadmm_contact_migration *sadmm_migration_of(const struct sadmm_contact_point *points,
                                                                      const struct sadmm_contact_migration *migrations,
                                                                      int32_t k)
{
    return points[k].migrates ? &migrations[k] : 0;
}

/* A pair of dynamic bodies that roll on each other: its impulses act at one point in space of the step's end, not of
 * its start, so that the momentum of its island is not known from that. points: the pair's. */
SADMM_INLINE bool sadmm_pair_rolls(const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *points)
{
    return pair->body_a >= 0 && pair->body_b >= 0 && points[0].migrates == MIGRATES_ON;
}

/* For so many points; those that there are stay. False when memory runs out. */
bool sadmm_contact_set_reserve_migrations(struct sadmm_contact_set *contacts, size_t points);
void sadmm_contact_set_free(struct sadmm_contact_set *contacts);

#ifdef __cplusplus
}
#endif
#endif
