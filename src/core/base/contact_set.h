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
 * (-2 - body)-th driven one, which moves by a velocity that is given and feels nothing. So whatever is not >= 0 is as
 * static to all but relative velocities. */
SADMM_INLINE bool sadmm_body_moves(int32_t body) { return body != -1; }
SADMM_INLINE bool sadmm_body_is_driven(int32_t body) { return body < -1; }
/* Of the driven body, its number, and back. */
SADMM_INLINE int32_t sadmm_driven(int32_t body) { return -2 - body; }

/* A manifold of a pair of shapes: one normal, up to SADMM_MAX_POINTS points. Two shapes may have several, told apart by
 * `child` (collision/geometry.h). */
struct sadmm_contact_pair {
    int32_t body_a, body_b;   /* system body, -1: static, below: driven */
    int32_t shape_a, shape_b; /* world shape slot (world level), else -1 */
    int32_t first, count;     /* points */
    double normal[3];         /* unit, from a to b */
    double friction;          /* mu */
    double restitution;
    uint32_t cache;           /* narrow phase: axis and side of the last step (collision/manifold.h), 0 = none */
    uint32_t revision, placed; /* of the two shapes, and of their bodies' poses (collision/contact_match.h) */
    uint32_t child;
};

struct sadmm_contact_point {
    double arm_a[3], arm_b[3]; /* from the centre of mass, m, world; arm_a is 0 when a is static (same for b) */
    double gap;                /* m (world level) */
    double error;              /* e, m/s: given at the problem level; at the world level see math/contact.h */
    double impulse[3];         /* lambda on b, world frame, N s: warm start in, solution out */
    uint32_t feature;
    uint32_t reserved;
};

/* A contact set that grows. Order: pairs by (shape_a, shape_b, child), points in pair order: point index = contact
 * index. */
struct sadmm_contact_set {
    struct sadmm_contact_pair *pairs;
    struct sadmm_contact_point *points;
    size_t pair_count, pair_capacity, point_count, point_capacity;
    double dt; /* of the step that its impulses are for, s; 0: of none */
};

void sadmm_contact_set_free(struct sadmm_contact_set *contacts);

#ifdef __cplusplus
}
#endif
#endif
