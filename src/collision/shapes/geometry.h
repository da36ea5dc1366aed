/* What depends on the type of a single geometry; what depends on two is in collision_table.h. */
#ifndef SADMM_COLLISION_SHAPES_GEOMETRY_H
#define SADMM_COLLISION_SHAPES_GEOMETRY_H

#include "core/math/max.h"
#include "core/math/real.h"
#include "shape.h"

/* Every switch over the types names them all and has no default: the compiler says where a new one is missing. */

/* The order of the two shapes of a pair: by this, of equal ones by slot. As types are numbered, but for meshes, which
 * are what their triangles' other shapes are seen from: they come last. */
SADMM_INLINE int geometry_rank(int type) { return type == SADMM_SHAPE_MESH ? (int)SADMM_SHAPE_TYPE_COUNT : type; }

/* Who includes this may say that there are no meshes (SADMM_WITHOUT_MESHES): a device's compiler leaves out what they
 * need, which takes it minutes. */
SADMM_INLINE bool geometry_is_mesh(const struct sadmm_geometry *g)
{
#ifdef SADMM_WITHOUT_MESHES
    (void)g;
    return false;
#else
    return g->type == SADMM_SHAPE_MESH;
#endif
}

/* Is it one of those that hulls and the like meet by convex.h, and for which a world has shape data (hull_data.h)? */
SADMM_INLINE int geometry_is_smooth(const struct sadmm_geometry *g)
{
    return g->type >= SADMM_SHAPE_CYLINDER && g->type <= SADMM_SHAPE_ELLIPSOID;
}

/* Smallest extent, m; a plane has none that limits, and of a mesh it is the whole that counts. */
SADMM_INLINE double geometry_thickness(const struct sadmm_geometry *g)
{
    switch ((sadmm_shape_type)g->type) {
    case SADMM_SHAPE_SPHERE:
    case SADMM_SHAPE_CAPSULE: return 2 * g->size[0];
    case SADMM_SHAPE_CYLINDER: return 2 * min_of(g->size[0], g->size[1]);
    case SADMM_SHAPE_CONE: /* its height, or what a line of its side and the rim across from it are apart */
        return 2 * g->size[1] *
               min_of(1, 2 * g->size[0] / sqrt(g->size[0] * g->size[0] + 4 * (g->size[1] * g->size[1])));
    case SADMM_SHAPE_BOX:
    case SADMM_SHAPE_ELLIPSOID:
    case SADMM_SHAPE_HULL: return 2 * min_of(g->size[0], min_of(g->size[1], g->size[2]));
    case SADMM_SHAPE_MESH: return -2 * min_of(-g->size[0], min_of(-g->size[1], -g->size[2]));
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    return HUGE_VAL;
}

/* Radius of the ball around the shape's centre that holds it, m; 0 for a plane (planes do not move). */
SADMM_INLINE double geometry_radius(const struct sadmm_geometry *g)
{
    switch ((sadmm_shape_type)g->type) {
    case SADMM_SHAPE_SPHERE: return g->size[0];
    case SADMM_SHAPE_CAPSULE: return g->size[0] + g->size[1];
    case SADMM_SHAPE_CYLINDER:
    case SADMM_SHAPE_CONE: return sqrt(g->size[0] * g->size[0] + g->size[1] * g->size[1]);
    case SADMM_SHAPE_ELLIPSOID: return max_of(g->size[0], max_of(g->size[1], g->size[2]));
    case SADMM_SHAPE_BOX:
    case SADMM_SHAPE_HULL:
    case SADMM_SHAPE_MESH: return sqrt(g->size[0] * g->size[0] + g->size[1] * g->size[1] + g->size[2] * g->size[2]);
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    return 0;
}

/* Half extents along the world axes, m. R: shape to world. Not for planes, which have no end. */
SADMM_INLINE void geometry_extents(const struct sadmm_geometry *g, const double R[9], double extent[3])
{
    const double *size = g->size;
    int k;
    switch ((sadmm_shape_type)g->type) {
    case SADMM_SHAPE_SPHERE:
        for (k = 0; k < 3; ++k) extent[k] = size[0];
        return;
    case SADMM_SHAPE_CAPSULE:
        for (k = 0; k < 3; ++k) extent[k] = size[0] + fabs(R[3 * k + 2]) * size[1];
        return;
    case SADMM_SHAPE_CYLINDER:
    case SADMM_SHAPE_CONE: /* its base reaches as far down as up */
        for (k = 0; k < 3; ++k)
            extent[k] =
                sqrt(R[3 * k] * R[3 * k] + R[3 * k + 1] * R[3 * k + 1]) * size[0] + fabs(R[3 * k + 2]) * size[1];
        return;
    case SADMM_SHAPE_ELLIPSOID:
        for (k = 0; k < 3; ++k) {
            const double x = R[3 * k] * size[0], y = R[3 * k + 1] * size[1], z = R[3 * k + 2] * size[2];
            extent[k] = sqrt(x * x + y * y + z * z);
        }
        return;
    case SADMM_SHAPE_BOX:
    case SADMM_SHAPE_HULL:
    case SADMM_SHAPE_MESH:
        for (k = 0; k < 3; ++k)
            extent[k] = fabs(R[3 * k]) * size[0] + fabs(R[3 * k + 1]) * size[1] + fabs(R[3 * k + 2]) * size[2];
        return;
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    for (k = 0; k < 3; ++k) extent[k] = HUGE_VAL;
}

/* Manifolds that a pair may have at most: subshape = (subshape of a) x (subshapes of b) + (subshape of b). 0: a mesh is
 * one of them, whose triangle is the subshape (mesh_walk.h finds them). */
SADMM_INLINE uint32_t pair_subshapes(const struct sadmm_geometry *a, const struct sadmm_geometry *b)
{
    return (uint32_t)a->subshapes * (uint32_t)b->subshapes;
}

#endif
