/* How a contact of the last step lives on in this one.
 *
 * Identity: the pair of shapes, the subshape (sadmm_geometry) and the revisions of the shapes (a slot may hold another
 * shape by now), then the feature. Sets are sorted by (shape_a, shape_b, subshape). Impulses are kept as world vectors;
 * where the normal turned, the normal part goes along the new normal and the tangential part is projected into the new
 * tangent plane, within the friction disc. They are forces times a time step: where the steps differ in length, the
 * forces are what carries over.
 *
 * The axis and the side that the pair remembers (`cache`) say where the bodies came from. They hold only while both
 * move by themselves: once a pose has been set (sadmm_collision_body.placed), the pair starts without. Impulses may
 * stay then, for they are no more than a start.
 */
#ifndef SADMM_COLLISION_FIND_CONTACT_MATCH_H
#define SADMM_COLLISION_FIND_CONTACT_MATCH_H

#include "collision/base/keys.h"
#include "collision/convex/polytope_face.h"
#include "collision/shapes/proxy.h"
#include "core/base/contact_set.h"
#include "core/math/step.h"

/* One word from two counts (revisions, placings): a change of either always shows, of both together as well while the
 * counts are less than some ten thousand apart (the multipliers have no shorter relation). */
SADMM_INLINE uint32_t word_of_pair(uint32_t a, uint32_t b) { return a * 0x9E3779B1u + b * 0x85EBCA77u; }

/* ---- which pair -------------------------------------------------------------------------------------------------- */

SADMM_INLINE uint64_t contact_shapes(const struct sadmm_contact_pair *pair)
{
    return ordered_key((uint32_t)pair->shape_a, (uint32_t)pair->shape_b);
}

/* Does the pair come before (shapes, subshape) in the order of a set? shapes: ordered_key of the two. */
SADMM_INLINE bool contact_is_before(const struct sadmm_contact_pair *pair, uint64_t shapes, uint32_t subshape)
{
    const uint64_t own = contact_shapes(pair);
    return own < shapes || (own == shapes && pair->subshape < subshape);
}

/* Index of the first of the sorted pairs [low, high) that does not come before (shapes, subshape). */
SADMM_INLINE int64_t contact_lower_bound(const struct sadmm_contact_pair *pairs, int64_t low, int64_t high,
                                         uint64_t shapes, uint32_t subshape)
{
    while (low < high) {
        int64_t mid = low + (high - low) / 2;
        if (contact_is_before(&pairs[mid], shapes, subshape)) low = mid + 1;
        else high = mid;
    }
    return low;
}

/* Is `old`, a pair of the same two slots, the same manifold of the same two shapes? All is read at once: no part waits
 * for another. */
SADMM_INLINE bool contact_goes_on(const struct sadmm_contact_pair *old, uint32_t subshape, const struct sadmm_proxy *a,
                                  const struct sadmm_proxy *b)
{
    return (old->subshape == subshape) & (old->revision == word_of_pair(a->revision, b->revision));
}

/* What the pair that goes on remembers, 0: nothing that holds. */
SADMM_INLINE uint32_t contact_memory(const struct sadmm_contact_pair *old, const struct sadmm_proxy *a,
                                     const struct sadmm_proxy *b)
{
    const uint32_t placed = old->placed, cache = old->cache;
    return placed == word_of_pair(a->placed, b->placed) ? cache : 0;
}

/* ---- impulses ---------------------------------------------------------------------------------------------------- */

/* ratio: step_ratio. `out` is left alone when nothing carries over. */
SADMM_INLINE void impulse_carry(const double old_normal[3], const double old_impulse[3], const double normal[3],
                                double friction, double ratio, double out[3])
{
    double turned = 0, along = 0, back = 0, size2 = 0, scale = 1, most, t[3], impulse[3];
    bool carries;
    int k;
    for (k = 0; k < 3; ++k) {
        impulse[k] = ratio * old_impulse[k];
        turned += old_normal[k] * normal[k];
        along += old_normal[k] * impulse[k];
    }
    /* No branch: which points press has no order that a processor could foresee. */
    carries = !((turned <= 0) | (along <= 0));
    for (k = 0; k < 3; ++k) {
        t[k] = impulse[k] - along * old_normal[k];
        back += t[k] * normal[k];
    }
    for (k = 0; k < 3; ++k) {
        t[k] -= back * normal[k];
        size2 += t[k] * t[k];
    }
    /* Most points stick, and what would be rounded to the disc's edge is left to the quotient: no root for them. */
    most = friction * along;
    if (carries && !(most * most > (1 + 16 * DBL_EPSILON) * size2)) {
        const double slides = most / sqrt(size2);
        scale = slides < 1 ? slides : 1;
    }
    for (k = 0; k < 3; ++k) out[k] = carries ? along * normal[k] + scale * t[k] : out[k];
}

/* Of the points of the old pair the one of this feature, -1: none. A feature occurs once in a manifold; `hint`: its
 * index in the new one, for most are where they were. */
SADMM_INLINE int32_t contact_find_feature(const struct sadmm_contact_point *points, int32_t count, uint32_t feature,
                                          int32_t hint)
{
    int32_t k;
    if (hint < count && points[hint].feature == feature) return hint;
    for (k = 0; k < count; ++k)
        if (points[k].feature == feature) return k;
    return -1;
}

/* The impulse of the old pair's point of this feature; false: there is none. ratio: step_ratio. */
SADMM_INLINE bool contact_carry(const struct sadmm_contact_pair *old, const struct sadmm_contact_point *old_points,
                                int32_t hint, const double normal[3], double friction, double ratio,
                                struct sadmm_contact_point *point)
{
    const struct sadmm_contact_point *from = old_points + old->first;
    const int32_t k = contact_find_feature(from, old->count, point->feature, hint);
    if (k >= 0) impulse_carry(old->normal, from[k].impulse, normal, friction, ratio, point->impulse);
    return k >= 0;
}

/* Difference of unit normals below which two triangles are of one plane: rounding of single precision. */
#define CONTACT_SAME_PLANE 1e-4

/* Is it a point of the body, the same on every triangle that it slides over? */
SADMM_INLINE bool contact_is_of_body(uint32_t feature)
{
    const uint32_t kind = feature >> AXIS_KIND_SHIFT;
    return kind == FEATURE_VERTEX_A || kind == FEATURE_NEAREST;
}

/* Is the old pair one of the same plane as a triangle with this normal? */
SADMM_INLINE bool contact_is_beside(const struct sadmm_contact_pair *old, uint32_t revision, const double normal[3])
{
    double apart2 = 0;
    int k;
    for (k = 0; k < 3; ++k) apart2 += (old->normal[k] - normal[k]) * (old->normal[k] - normal[k]);
    return old->revision == revision && apart2 <= CONTACT_SAME_PLANE * CONTACT_SAME_PLANE;
}

/* The same of a point that slides over a mesh: the triangle that it was over in the last step may be another one of
 * the same plane. Only points of the body are the same on both (mesh_leaves_out). [first, last): the old pairs of the
 * two shapes. */
SADMM_INLINE void contact_carry_across(const struct sadmm_contact_pair *pairs, int64_t first, int64_t last,
                                       const struct sadmm_contact_point *old_points, uint32_t revision, int32_t hint,
                                       const double normal[3], double friction, double ratio,
                                       struct sadmm_contact_point *point)
{
    int64_t i;
    if (!contact_is_of_body(point->feature)) return;
    for (i = first; i < last; ++i)
        if (contact_is_beside(&pairs[i], revision, normal) &&
            contact_carry(&pairs[i], old_points, hint, normal, friction, ratio, point))
            return;
}

#endif
