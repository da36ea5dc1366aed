/* Convex bodies of the narrow phase, polytopes (polytope.h) and smooth ones, by what they are the hull of: pieces, each
 * the set c + E u of all |u| <= 1.
 *
 *   polytope    its vertices                     E = 0
 *   cylinder    discs at the bottom, 0, and at the top, 1
 *   cone        a disc at the bottom, 0, and the apex, 1
 *   ellipsoid   itself, 0
 *
 * A piece reaches h(d) = c . d + |E^T d| along d, and as far as that is smooth so is all that is made of it: distance
 * and depth are a minimum over directions of the largest of a few smooth functions (convex_axis.h). A disc's h has a
 * kink along its axis, and there the body has a flat, as a polytope's face is one: what is flat is asked by its normal.
 */
#ifndef SADMM_COLLISION_CONVEX_CONVEX_H
#define SADMM_COLLISION_CONVEX_CONVEX_H

#include "polytope.h"
#include "collision/base/manifold.h"

enum convex_form { CONVEX_POLYTOPE, CONVEX_CYLINDER, CONVEX_CONE, CONVEX_ELLIPSOID };

struct convex {
    struct polytope p; /* of others than POLYTOPE a point, without a radius */
    vec3 size;         /* as in sadmm_shape_def */
    int form;
};

SADMM_INLINE int convex_form_of(int type)
{
    switch ((sadmm_shape_type)type) {
    case SADMM_SHAPE_CYLINDER: return CONVEX_CYLINDER;
    case SADMM_SHAPE_CONE: return CONVEX_CONE;
    case SADMM_SHAPE_ELLIPSOID: return CONVEX_ELLIPSOID;
    case SADMM_SHAPE_SPHERE:
    case SADMM_SHAPE_CAPSULE:
    case SADMM_SHAPE_BOX:
    case SADMM_SHAPE_HULL:
    case SADMM_SHAPE_MESH:
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    return CONVEX_POLYTOPE;
}

SADMM_INLINE void convex_of(const struct sadmm_geometry *g, const double *hulls, struct convex *c)
{
    c->form = convex_form_of(g->type);
    c->size = v3_load(g->size);
    if (c->form == CONVEX_POLYTOPE) polytope_of(g, hulls, &c->p);
    else polytope_at(hulls, HULL_POINT, &c->p);
}

/* ---- pieces ------------------------------------------------------------------------------------------------------ */

/* The piece that reaches farthest along d (own frame, any length but 0); `from`: where a search begins. */
SADMM_INLINE int convex_piece(const struct convex *c, vec3 d, int from)
{
    switch (c->form) {
    case CONVEX_CYLINDER: return d.z >= 0;
    case CONVEX_CONE: return 2 * c->size.y * d.z >= c->size.x * real_sqrt(d.x * d.x + d.y * d.y);
    case CONVEX_ELLIPSOID: return 0;
    default: return polytope_support(&c->p, d, from);
    }
}

/* Its point farthest along d. */
SADMM_INLINE vec3 convex_point(const struct convex *c, int piece, vec3 d)
{
    if (c->form == CONVEX_POLYTOPE) return polytope_vertex(&c->p, piece);
    if (c->form == CONVEX_ELLIPSOID) {
        const vec3 e = v3(c->size.x * d.x, c->size.y * d.y, c->size.z * d.z);
        const real s = 1 / v3_norm(e);
        return v3(s * c->size.x * e.x, s * c->size.y * e.y, s * c->size.z * e.z);
    } else {
        const real r = real_sqrt(d.x * d.x + d.y * d.y), z = piece ? c->size.y : -c->size.y;
        if (!(r > 0) || (piece && c->form == CONVEX_CONE)) return v3(0, 0, z); /* along the axis: any of the disc */
        return v3(c->size.x * (d.x / r), c->size.x * (d.y / r), z);
    }
}

/* How that point moves as d (unit) turns: the second derivatives of h along two tangents of d, 11, 12 and 22. */
SADMM_INLINE void convex_bend(const struct convex *c, int piece, vec3 d, vec3 t1, vec3 t2, real bend[3])
{
    bend[0] = bend[1] = bend[2] = 0;
    if (c->form == CONVEX_ELLIPSOID) {
        const vec3 s2 = v3(c->size.x * c->size.x, c->size.y * c->size.y, c->size.z * c->size.z);
        const vec3 w = v3(s2.x * d.x, s2.y * d.y, s2.z * d.z);
        const real reach = real_sqrt(v3_dot(w, d)), w1 = v3_dot(w, t1) / reach, w2 = v3_dot(w, t2) / reach;
        bend[0] = (s2.x * t1.x * t1.x + s2.y * t1.y * t1.y + s2.z * t1.z * t1.z - w1 * w1) / reach;
        bend[1] = (s2.x * t1.x * t2.x + s2.y * t1.y * t2.y + s2.z * t1.z * t2.z - w1 * w2) / reach;
        bend[2] = (s2.x * t2.x * t2.x + s2.y * t2.y * t2.y + s2.z * t2.z * t2.z - w2 * w2) / reach;
    } else if (c->form != CONVEX_POLYTOPE && !(piece && c->form == CONVEX_CONE)) {
        const real r = real_sqrt(d.x * d.x + d.y * d.y);
        if (r > 0) { /* along the rim */
            const real e1 = (d.x * t1.y - d.y * t1.x) / r, e2 = (d.x * t2.y - d.y * t2.x) / r, s = c->size.x / r;
            bend[0] = s * e1 * e1;
            bend[1] = s * e1 * e2;
            bend[2] = s * e2 * e2;
        }
    }
}

/* ---- flats: faces of a polytope, and caps ------------------------------------------------------------------------ */

/* The flat whose normal is nearest to d (own frame, unit), -1: none has a cosine of `least` with it. */
SADMM_INLINE int convex_flat(const struct convex *c, vec3 d, real least)
{
    int f;
    switch (c->form) {
    case CONVEX_CYLINDER: return d.z >= least ? 1 : d.z <= -least ? 0 : -1;
    case CONVEX_CONE: return d.z <= -least ? 0 : -1;
    case CONVEX_ELLIPSOID: return -1;
    default: break;
    }
    if (c->p.faces == 0) return -1;
    f = polytope_face_along(&c->p, d);
    return v3_dot(polytope_normal(&c->p, f), d) >= least ? f : -1;
}

SADMM_INLINE bool convex_has_flat(const struct convex *c, uint32_t flat)
{
    switch (c->form) {
    case CONVEX_CYLINDER: return flat < 2;
    case CONVEX_CONE: return flat < 1;
    case CONVEX_ELLIPSOID: return false;
    default: return flat < (uint32_t)c->p.faces;
    }
}

SADMM_INLINE vec3 convex_flat_normal(const struct convex *c, int flat)
{
    return c->form == CONVEX_POLYTOPE ? polytope_normal(&c->p, flat) : v3(0, 0, flat ? 1 : -1);
}

SADMM_INLINE real convex_flat_offset(const struct convex *c, int flat)
{
    return c->form == CONVEX_POLYTOPE ? polytope_offset(&c->p, flat) : c->size.y;
}

#endif
