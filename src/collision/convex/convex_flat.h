/* Flats of two convex bodies, caps and faces, as directions that part them. There a - b has a flat, and along a cap's
 * axis h has a kink that Newton's method (convex_newton.h) does not see: a flat is asked by its normal. */
#ifndef SADMM_COLLISION_CONVEX_CONVEX_FLAT_H
#define SADMM_COLLISION_CONVEX_CONVEX_FLAT_H

#include "convex_clip.h"

struct convex_axis {
    vec3 n;          /* unit, from a to b */
    real separation; /* m */
    vec3 pa, pb;     /* nearest points: of the bodies, rounds included */
};

/* cache: the lower bits of a direction, or a flat above them. */
enum { CONVEX_MEMORY_DIRECTION = 1, CONVEX_MEMORY_FLAT_A, CONVEX_MEMORY_FLAT_B, CONVEX_MEMORY_MASK = 31 };

/* The axis of a flat; the nearest points for what has one point alone there. */
SADMM_CALLED void convex_flat_axis(const struct convex_pair *pair, bool of_a, int flat, struct convex_axis *axis)
{
    const struct difference_point zero = {{0, 0, 0}, 0, 0};
    const vec3 outward = convex_flat_normal(of_a ? &pair->a : &pair->b, flat),
               n = of_a ? m3_mul(pair->R, outward) : v3_neg(outward);
    const struct difference_point point = convex_support(pair, n, &zero);
    axis->n = n;
    axis->separation = -v3_dot(n, point.w) - convex_radii(pair);
    axis->pa = v3_madd(convex_point_a(pair, point.a, n), pair->a.p.radius, n);
    axis->pb = v3_madd(convex_point_b(pair, point.b, n), -pair->b.p.radius, n);
    if (of_a) axis->pa = v3_madd(axis->pb, -axis->separation, n);
    else axis->pb = v3_madd(axis->pa, axis->separation, n);
}

/* The better one of the flats beside n; its memory, 0: there is none within 8 degrees. */
SADMM_INLINE uint32_t convex_flat_beside(const struct convex_pair *pair, vec3 n, struct convex_axis *axis)
{
    const int fa = convex_flat(&pair->a, m3_tmul(pair->R, n), MANIFOLD_COS_NEAR),
              fb = convex_flat(&pair->b, v3_neg(n), MANIFOLD_COS_NEAR);
    const int shift = MANIFOLD_DIRECTION_SHIFT;
    struct convex_axis other;
    uint32_t memory = 0;
    if (fa >= 0) {
        convex_flat_axis(pair, true, fa, axis);
        memory = CONVEX_MEMORY_FLAT_A | (uint32_t)fa << shift;
    }
    if (fb >= 0) {
        convex_flat_axis(pair, false, fb, &other);
        if (fa < 0 || other.separation > axis->separation) {
            *axis = other;
            memory = CONVEX_MEMORY_FLAT_B | (uint32_t)fb << shift;
        }
    }
    return memory;
}

/* Is the point that a flat's axis has on it in the flat? Of the other body's points that are farthest along its normal
 * it is one, but the flat may face others. */
SADMM_INLINE bool convex_is_on_flat(const struct convex_pair *pair, const struct convex_axis *axis, bool of_a, int flat,
                                    real tolerance)
{
    const struct convex *c = of_a ? &pair->a : &pair->b;
    struct convex_feature feature;
    vec3 x = of_a ? v3_madd(axis->pa, -pair->a.p.radius, axis->n) : v3_madd(axis->pb, pair->b.p.radius, axis->n);
    if (of_a) x = m3_tmul(pair->R, v3_sub(x, pair->t));
    convex_feature_of(c, convex_flat_normal(c, flat), &feature);
    return convex_is_on(&feature, x, tolerance);
}

/* Do two points that face each other along a flat's normal prove that no direction beside it is better? memory: of the
 * flat. */
SADMM_INLINE bool convex_is_flat_witness(const struct convex_pair *pair, const struct convex_axis *axis,
                                         uint32_t memory)
{
    struct manifold m;
    bool witness;
    if (convex_is_on_flat(pair, axis, (memory & CONVEX_MEMORY_MASK) == CONVEX_MEMORY_FLAT_A,
                          (int)(memory >> MANIFOLD_DIRECTION_SHIFT), 0))
        return true;
    convex_clip_manifold(pair, axis->n, axis->separation, SADMM_REAL_MAX, &m, &witness);
    return witness;
}

#endif
