/* Axes along which two polytopes are apart, or least deep in each other: a face's normal, the common normal of two
 * edges, or any direction. */
#ifndef SADMM_COLLISION_CONVEX_POLYTOPE_AXIS_H
#define SADMM_COLLISION_CONVEX_POLYTOPE_AXIS_H

#include "polytope_pair.h"

enum polytope_axis_kind { AXIS_FREE, AXIS_FACE_A, AXIS_FACE_B, AXIS_EDGES };

struct polytope_axis {
    vec3 n;          /* unit, from a to b */
    real separation; /* of the two along it, m */
    int kind;
    int a, b;        /* the face, or the edges */
};

/* cache: kind << 30, then the face, or edge of a << 15 | edge of b. */
enum { AXIS_KIND_SHIFT = 30, AXIS_EDGE_SHIFT = 15, AXIS_EDGE_MASK = (1 << AXIS_EDGE_SHIFT) - 1 };

SADMM_INLINE uint32_t axis_memory(const struct polytope_axis *axis)
{
    const uint32_t kind = (uint32_t)axis->kind << AXIS_KIND_SHIFT;
    switch (axis->kind) {
    case AXIS_FACE_A: return kind | (uint32_t)axis->a;
    case AXIS_FACE_B: return kind | (uint32_t)axis->b;
    case AXIS_EDGES: return kind | (uint32_t)axis->a << AXIS_EDGE_SHIFT | (uint32_t)axis->b;
    default: return 0;
    }
}

/* How far the two are apart along n; negative: how deep in each other. */
SADMM_INLINE real axis_separation(const struct polytope_pair *pair, vec3 n)
{
    const struct difference_point zero = {{0, 0, 0}, 0, 0};
    return -v3_dot(n, pair_support(pair, n, &zero).w) - pair_radii(pair);
}

SADMM_INLINE void axis_of_face_a(const struct polytope_pair *pair, int face, struct polytope_axis *axis)
{
    const vec3 n = m3_mul(pair->R, polytope_normal(&pair->a, face));
    const int v = polytope_support(&pair->b, v3_neg(n), 0);
    axis->kind = AXIS_FACE_A;
    axis->a = face;
    axis->b = 0;
    axis->n = n;
    axis->separation = v3_dot(n, v3_sub(polytope_vertex(&pair->b, v), pair->t)) - polytope_offset(&pair->a, face) -
                       pair_radii(pair);
}

SADMM_INLINE void axis_of_face_b(const struct polytope_pair *pair, int face, struct polytope_axis *axis)
{
    const vec3 outward = polytope_normal(&pair->b, face);
    const int v = polytope_support(&pair->a, v3_neg(m3_tmul(pair->R, outward)), 0);
    axis->kind = AXIS_FACE_B;
    axis->a = 0;
    axis->b = face;
    axis->n = v3_neg(outward);
    axis->separation = v3_dot(outward, pair_point_a(pair, v)) - polytope_offset(&pair->b, face) - pair_radii(pair);
}

/* From one end to the other, in the frame of b. */
SADMM_INLINE vec3 edge_of_a(const struct polytope_pair *pair, int e, vec3 *from)
{
    *from = pair_point_a(pair, pair->a.edge_vertex[2 * e]);
    return v3_sub(pair_point_a(pair, pair->a.edge_vertex[2 * e + 1]), *from);
}
SADMM_INLINE vec3 edge_of_b(const struct polytope_pair *pair, int e, vec3 *from)
{
    *from = polytope_vertex(&pair->b, pair->b.edge_vertex[2 * e]);
    return v3_sub(polytope_vertex(&pair->b, pair->b.edge_vertex[2 * e + 1]), *from);
}

/* Between the two faces beside an edge, own frame; 0 where a polytope has none. */
SADMM_INLINE vec3 edge_outward(const struct polytope *p, int e)
{
    if (p->faces == 0) return v3(0, 0, 0);
    return v3_add(polytope_normal(p, p->edge_face[2 * e]), polytope_normal(p, p->edge_face[2 * e + 1]));
}

/* False: the edges are parallel, to within rounding. */
SADMM_INLINE bool axis_of_edges(const struct polytope_pair *pair, int ea, int eb, struct polytope_axis *axis)
{
    vec3 from;
    const vec3 da = edge_of_a(pair, ea, &from), db = edge_of_b(pair, eb, &from);
    const vec3 out = v3_sub(m3_mul(pair->R, edge_outward(&pair->a, ea)), edge_outward(&pair->b, eb));
    vec3 n = v3_cross(da, db);
    const real n2 = v3_norm2(n);
    if (!(n2 > (real)1e-8 * v3_norm2(da) * v3_norm2(db))) return false;
    n = v3_scale(n, (v3_dot(n, out) < 0 ? -1 : 1) / real_sqrt(n2));
    axis->kind = AXIS_EDGES;
    axis->a = ea;
    axis->b = eb;
    axis->n = n;
    axis->separation = axis_separation(pair, n);
    return true;
}

/* The axis in the memory; false: there is none. */
SADMM_INLINE bool axis_recall(const struct polytope_pair *pair, uint32_t cache, struct polytope_axis *axis)
{
    const uint32_t kind = cache >> AXIS_KIND_SHIFT, rest = cache & ((1u << AXIS_KIND_SHIFT) - 1),
                   ea = rest >> AXIS_EDGE_SHIFT, eb = rest & AXIS_EDGE_MASK;
    if (kind == AXIS_FACE_A && rest < (uint32_t)pair->a.faces) axis_of_face_a(pair, (int)rest, axis);
    else if (kind == AXIS_FACE_B && rest < (uint32_t)pair->b.faces) axis_of_face_b(pair, (int)rest, axis);
    else if (kind == AXIS_EDGES && pair->a.faces > 0 && ea < (uint32_t)pair->a.edges && eb < (uint32_t)pair->b.edges)
        return axis_of_edges(pair, (int)ea, (int)eb, axis);
    else return false;
    return true;
}

#endif
