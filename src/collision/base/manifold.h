/* What two pieces that touch give: one normal and up to eight points. The narrow phase is a set of inline functions
 * on small structs, one header a family of pairs, compiled by gcc (double) and nvcc (float and double): no allocation,
 * bounded loops, no state but the cache word.
 *
 * Pair convention. a is the shape of the lower (type, slot): plane, sphere, capsule, box. Everything is computed and
 * given in the frame of b, the shape with more structure: positions stay near b's centre, where float is precise
 * (pair_pose does the differences in double). The normal runs from a to b, a separation below 0 is penetration and a
 * point lies halfway between the two surfaces.
 *
 * limit: points with separation <= limit are kept; a deep manifold is never dropped, and rounding favours contact.
 *
 * cache: the axis the pair used in its last step and the direction of the normal along it, 0: none. Where two axes
 * are nearly as good (apex of a house of cards, a body past the midplane of a thin one) the cached axis and side stay
 * unless clearly beaten; otherwise the normal would flip from step to step. A direction is cached as something that
 * still is the same when the bodies have turned a little: the side of a face, which turns with its body, or else a
 * vector in the frame of b. The sign of a cross product of two edges is none: it changes where they become parallel.
 *
 * feature: which features of the two shapes make the point. Ids do not depend on which box was the reference, so that
 * impulses survive a change of it. A feature occurs once in a manifold.
 */
#ifndef SADMM_COLLISION_BASE_MANIFOLD_H
#define SADMM_COLLISION_BASE_MANIFOLD_H

#include <stdbool.h>

#include "row3.h"

enum { SADMM_MANIFOLD_POINTS = 8 };

/* Features of the balls in two bodies, and of a deepest point (inner_ball.h); no other has them. */
#define INNER_BALL_FEATURE    0xfffffff0u
#define INNER_DEEPEST_FEATURE 0xfffffff4u

struct manifold_point {
    vec3 position;   /* m, frame of b */
    real separation; /* m */
    uint32_t feature;
};

struct manifold {
    vec3 normal; /* unit, frame of b, from a to b */
    int count;   /* 0: not in contact */
    uint32_t cache;
    double time_offset; /* s: of the step's start, where the pair is (pair_manifold.h: find_manifold) */
    struct manifold_point points[SADMM_MANIFOLD_POINTS];
};

/* Pose of a in the frame of b. Rows of R: p_b = R p_a + t. */
struct pair_pose {
    row3 R[3];
    row3 t;
    row3 centre[2]; /* of mass, of the body of a and of b, in the frame of b, where `tips` says so: */
    bool tips[2];   /* the body moves, and one of the two shapes has round rims (convex_clip.h) */
};

/* How clearly the cached axis must be beaten: this share of the depth, and of the thinner shape's extent. */
#define MANIFOLD_KEEP_DEPTH ((real)0.1)
#define MANIFOLD_KEEP_EXTENT ((real)0.005)
/* Lateral tolerance of clipping, as a share of the smaller face's half extent: corners of aligned boxes stay
 * corners. */
#define MANIFOLD_SNAP ((real)1e-3)
/* A line contact is given by its two ends as long as nothing between them is deeper by more than this share of the
 * thinner extent; otherwise the deepest point comes third. */
#define MANIFOLD_FLAT ((real)1e-4)
/* Edges of a box whose distances along a normal differ by less than twice this share of the thinner extent support it
 * equally: the one nearer to the other box counts. */
#define MANIFOLD_EVEN ((real)5e-4)
/* Square of the angle below which edges are parallel: their cross product is rounding, and the faces speak for them. */
#define MANIFOLD_PARALLEL2 (sizeof(real) == 4 ? (real)1e-7 : (real)1e-16)
/* cos 8 degrees: axes within this angle are the same direction for the choice of an axis. */
#define MANIFOLD_COS_NEAR ((real)0.99026806874157036)
/* cos 45 degrees: an axis that has turned by more since the last step is another one. */
#define MANIFOLD_COS_SAME ((real)0.70710678118654752)
/* cos 26 degrees: directions within this angle of the opposite of the last normal are the other side. */
#define MANIFOLD_COS_OPPOSITE ((real)0.9)

SADMM_INLINE void manifold_add(struct manifold *m, vec3 position, real separation, uint32_t feature)
{
    if (m->count < SADMM_MANIFOLD_POINTS) {
        struct manifold_point *p = &m->points[m->count++];
        p->position = position;
        p->separation = separation;
        p->feature = feature;
    }
}

/* One point between surface points pa (on a) and pb (on b) along m->normal. */
SADMM_INLINE void manifold_add_between(struct manifold *m, vec3 pa, vec3 pb, uint32_t feature)
{
    manifold_add(m, v3_scale(v3_add(pa, pb), (real)0.5), v3_dot(m->normal, v3_sub(pb, pa)), feature);
}

/* Where a's origin is, and its third axis. */
SADMM_INLINE vec3 pose_origin(const struct pair_pose *pose) { return r3_vec3(pose->t); }
SADMM_INLINE vec3 pose_axis(const struct pair_pose *pose)
{
    return v3(r3_vec3(pose->R[0]).z, r3_vec3(pose->R[1]).z, r3_vec3(pose->R[2]).z);
}

/* A direction (unit) in the upper 27 bits of a cache word: 9 bits a coordinate, to 0.2 degrees. */
enum { MANIFOLD_DIRECTION_SHIFT = 5 };

/* A coordinate, in [1, 511]. What is no direction, of bodies so far apart that squares overflow, is in [0, 511]: NaN is
 * 0. */
SADMM_INLINE uint32_t manifold_coordinate_bits(real x)
{
    const real scale = 255, middle = (real)256.5, most = (real)511.5; /* from below: rounds to the nearest */
    const real at = middle + scale * x, high = at > 0 ? at : 0;
    return (uint32_t)(int32_t)(high < most ? high : most);
}

SADMM_INLINE uint32_t manifold_direction_bits(vec3 n)
{
    return (manifold_coordinate_bits(n.x) | manifold_coordinate_bits(n.y) << 9 | manifold_coordinate_bits(n.z) << 18)
           << MANIFOLD_DIRECTION_SHIFT;
}

/* The direction in a cache word, unit but for the rounding to 9 bits. */
SADMM_INLINE vec3 manifold_cached_direction(uint32_t cache)
{
    uint32_t bits = cache >> MANIFOLD_DIRECTION_SHIFT;
    const real unit = (real)1 / 255;
    return v3(unit * (real)((int32_t)(bits & 511) - 256), unit * (real)((int32_t)(bits >> 9 & 511) - 256),
              unit * (real)((int32_t)(bits >> 18 & 511) - 256));
}

SADMM_INLINE void v3_to_array(vec3 v, real a[3]) { a[0] = v.x; a[1] = v.y; a[2] = v.z; }
SADMM_INLINE vec3 v3_from_array(const real a[3]) { return v3(a[0], a[1], a[2]); }

#endif
