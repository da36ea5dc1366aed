/* The farthest point of a shape along a direction: what bounds a distance from below (advance.h). */
#ifndef SADMM_COLLISION_CONVEX_FARTHEST_H
#define SADMM_COLLISION_CONVEX_FARTHEST_H

#include "collision/shapes/geometry.h"
#include "convex.h"

/* d: unit, own frame. Not of planes and meshes. hulls: the shape data; may be NULL for what does without
 * (geometry.h). */
SADMM_INLINE vec3 geometry_farthest(const struct sadmm_geometry *g, const double *hulls, vec3 d)
{
    const vec3 s = v3_load(g->size);
    struct convex c;
    switch ((sadmm_shape_type)g->type) {
    case SADMM_SHAPE_SPHERE: return v3_scale(d, s.x);
    case SADMM_SHAPE_CAPSULE: return v3_add(v3_scale(d, s.x), v3(0, 0, d.z < 0 ? -s.y : s.y));
    case SADMM_SHAPE_BOX: return v3(d.x < 0 ? -s.x : s.x, d.y < 0 ? -s.y : s.y, d.z < 0 ? -s.z : s.z);
    case SADMM_SHAPE_HULL:
    case SADMM_SHAPE_CYLINDER:
    case SADMM_SHAPE_CONE:
    case SADMM_SHAPE_ELLIPSOID:
    case SADMM_SHAPE_MESH:
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    if (!hulls) return v3(0, 0, 0); /* there are no others then */
    convex_of(g, hulls, &c);
    return v3_madd(convex_point(&c, convex_piece(&c, d, 0), d), c.p.radius, d);
}

/* Radius of a ball around x (own frame) that the shape holds, m; not above 0 where x is outside. Not of planes and
 * meshes. Of an ellipsoid a smaller one: s (1 - |x / s|) for the least semi-axis s. */
SADMM_INLINE real geometry_inner_radius(const struct sadmm_geometry *g, const double *hulls, vec3 x)
{
    const vec3 s = v3_load(g->size);
    const real across = real_sqrt(x.x * x.x + x.y * x.y);
    struct polytope p;
    switch ((sadmm_shape_type)g->type) {
    case SADMM_SHAPE_SPHERE: return s.x - v3_norm(x);
    case SADMM_SHAPE_CAPSULE: return s.x - v3_norm(v3(x.x, x.y, x.z - real_clamp(x.z, -s.y, s.y)));
    case SADMM_SHAPE_BOX: return real_min(s.x - real_abs(x.x), real_min(s.y - real_abs(x.y), s.z - real_abs(x.z)));
    case SADMM_SHAPE_CYLINDER: return real_min(s.x - across, s.y - real_abs(x.z));
    case SADMM_SHAPE_CONE: /* base, and the distance from the line of its side */
        return real_min(x.z + s.y, (s.x * (s.y - x.z) - 2 * s.y * across) / real_sqrt(4 * s.y * s.y + s.x * s.x));
    case SADMM_SHAPE_ELLIPSOID:
        return real_min(s.x, real_min(s.y, s.z)) * (1 - v3_norm(v3(x.x / s.x, x.y / s.y, x.z / s.z)));
    case SADMM_SHAPE_HULL:
        if (!hulls) break;
        polytope_of(g, hulls, &p);
        return p.radius - polytope_height(&p, x, -1);
    case SADMM_SHAPE_MESH:
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    return 0;
}

#endif
