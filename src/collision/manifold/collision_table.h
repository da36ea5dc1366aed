/* Which pairs of types collide, and how: the one list, for host and device.
 *
 * An entry is PAIR(type of a, type of b, call): a is of the lower type (geometry_rank) or, of two of one type, the
 * shape in the lower slot. In the call a and b are the sizes of the two (vec3, m) and subshape is the subshape of the
 * pair (geometry.h); pose, limit, cache and m are as in manifold.h. The list becomes a switch (pair_manifold.h), not a
 * table of pointers: all of it is inlined into the narrow phase, and a pair that is listed twice does not compile.
 *
 * Types without an entry have no contacts and must never meet. Static bodies do not meet each other, so a type that
 * lacks an entry with any other is for static bodies only: sadmm_geometry_check refuses it elsewhere, where a shape is
 * added and where collision takes shapes over, on the host and for the device.
 */
#ifndef SADMM_COLLISION_MANIFOLD_COLLISION_TABLE_H
#define SADMM_COLLISION_MANIFOLD_COLLISION_TABLE_H

#include <stdbool.h>

#include "collision/shapes/geometry.h"
#include "subadmm/types.h"

/* clang-format off */
#define SADMM_COLLISION_TABLE(PAIR)                                                             \
    PAIR(PLANE,   SPHERE,  manifold_plane_sphere(b.x, pose, limit, m))                          \
    PAIR(PLANE,   CAPSULE, manifold_plane_capsule(b.x, b.y, pose, limit, m))                    \
    PAIR(PLANE,   BOX,     manifold_plane_box(b, pose, limit, m))                               \
    PAIR(SPHERE,  SPHERE,  manifold_sphere_sphere(a.x, b.x, pose, limit, m))                    \
    PAIR(SPHERE,  CAPSULE, manifold_sphere_capsule(a.x, b.x, b.y, pose, limit, m))              \
    PAIR(SPHERE,  BOX,     manifold_sphere_box(a.x, b, pose, limit, cache, m))                  \
    PAIR(CAPSULE, CAPSULE, manifold_capsule_capsule(a.x, a.y, b.x, b.y, pose, limit, cache, m)) \
    PAIR(CAPSULE, BOX,     manifold_capsule_box(a.x, a.y, b, pose, limit, cache, m))            \
    PAIR(BOX,     BOX,     manifold_box_box(b, a, pose, limit, cache, m))

/* With a hull, by the shape data (hull_data.h), the geometries shape_a and shape_b: a list of their own, so that a
 * narrow phase without hulls is what it would be if there were none. */
#define SADMM_HULL_TABLE(PAIR)                                                         \
    PAIR(PLANE,   HULL, hull_plane_manifold(shape_b, hulls, pose, limit, m))           \
    PAIR(SPHERE,  HULL, hull_manifold(shape_a, shape_b, hulls, pose, limit, cache, m)) \
    PAIR(CAPSULE, HULL, hull_manifold(shape_a, shape_b, hulls, pose, limit, cache, m)) \
    PAIR(BOX,     HULL, hull_manifold(shape_a, shape_b, hulls, pose, limit, cache, m)) \
    PAIR(HULL,    HULL, hull_manifold(shape_a, shape_b, hulls, pose, limit, cache, m))

/* With a mesh: all by triangle_manifold (pair_manifold.h), which the narrow phase calls by itself, a triangle after the
 * other. */
#define SADMM_MESH_TABLE(PAIR)      \
    PAIR(SPHERE,    MESH, (void)0) \
    PAIR(CAPSULE,   MESH, (void)0) \
    PAIR(BOX,       MESH, (void)0) \
    PAIR(HULL,      MESH, (void)0) \
    PAIR(CYLINDER,  MESH, (void)0) \
    PAIR(CONE,      MESH, (void)0) \
    PAIR(ELLIPSOID, MESH, (void)0)

/* With a smooth body, by the same: a list of their own again. */
#define SADMM_CONVEX_TABLE_OF(PAIR, B)                                                \
    PAIR(PLANE,   B, convex_plane_manifold(shape_b, hulls, pose, limit, m))           \
    PAIR(SPHERE,  B, convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m)) \
    PAIR(CAPSULE, B, convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m)) \
    PAIR(BOX,     B, convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m)) \
    PAIR(HULL,    B, convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m))
#define SADMM_CONVEX_TABLE(PAIR)                                                                  \
    SADMM_CONVEX_TABLE_OF(PAIR, CYLINDER)                                                         \
    SADMM_CONVEX_TABLE_OF(PAIR, CONE)                                                             \
    SADMM_CONVEX_TABLE_OF(PAIR, ELLIPSOID)                                                        \
    PAIR(CYLINDER,  CYLINDER,  convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m))   \
    PAIR(CYLINDER,  CONE,      convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m))   \
    PAIR(CYLINDER,  ELLIPSOID, convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m))   \
    PAIR(CONE,      CONE,      convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m))   \
    PAIR(CONE,      ELLIPSOID, convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m))   \
    PAIR(ELLIPSOID, ELLIPSOID, convex_manifold(shape_a, shape_b, hulls, pose, limit, cache, m))
/* clang-format on */

/* One number for two types, below 256 each. */
#define SADMM_TYPE_PAIR(type_a, type_b) ((type_a) * 256 + (type_b))

/* Is there an entry for the two types, in either order? */
SADMM_INLINE bool pair_is_listed(int type_a, int type_b)
{
    const bool in_order = geometry_rank(type_a) < geometry_rank(type_b);
    switch (in_order ? SADMM_TYPE_PAIR(type_a, type_b) : SADMM_TYPE_PAIR(type_b, type_a)) {
#define SADMM_LISTED(A, B, call) case SADMM_TYPE_PAIR((int)SADMM_SHAPE_##A, (int)SADMM_SHAPE_##B):
        SADMM_COLLISION_TABLE(SADMM_LISTED)
        SADMM_HULL_TABLE(SADMM_LISTED)
        SADMM_MESH_TABLE(SADMM_LISTED)
        SADMM_CONVEX_TABLE(SADMM_LISTED)
        return true;
#undef SADMM_LISTED
    default: return false;
    }
}

#endif
